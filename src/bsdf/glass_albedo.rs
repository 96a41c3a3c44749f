//! Directional albedo of a rough dielectric boundary: how much of the light from one direction is left, reflected
//! and refracted together, after one bounce. A function of μ = |wo_z|, α, and η = ηₜ/ηᵢ.
//!
//! A table in three dimensions, made of slabs of one η each; a slab is computed when it is first asked for, so a
//! scene pays for the indices it has (about 20 ms for each of the four slabs of a glass). Near η = 1 the albedo goes
//! as √|η − 1| (total reflection begins at that cosine), and so do the slabs: evenly in √(|η − 1| / (η + 1)). By
//! cosine the nodes are those of [`albedo`](super::albedo) going in; coming out total reflection dominates, and
//! μ takes the place of √μ.

use std::sync::OnceLock;

use glam::{Vec2, Vec3};

use super::fresnel::{DielectricFresnel, refract};
use super::ggx::Ggx;
use super::quadrature::{cell, gauss_legendre};
use super::reflect_about;

const SLABS: usize = 48;
const ROUGHNESSES: usize = 24;
const COSINES: usize = 24;
/// Quadrature nodes in the polar and in the azimuthal direction of the cap of normals.
const POLAR: usize = 24;
const AZIMUTHAL: usize = 24;
/// Beyond an index of 3 (diamond has 2.4) the albedo of 3 stands in.
const MAX_SLAB_COORDINATE: f32 = std::f32::consts::FRAC_1_SQRT_2;
/// The nodes at zero stand for the limit.
const TINY: f32 = 1e-5;

/// By roughness, then by cosine.
type Slab = [[f32; COSINES]; ROUGHNESSES];

/// By curve, by whether light comes in or out, by η.
static TABLE: [[[OnceLock<Box<Slab>>; SLABS]; 2]; 2] =
    [const { [const { [const { OnceLock::new() }; SLABS] }; 2] }; 2];

/// `mu` in (0, 1], `alpha` in [0, 1], `eta` > 0.
pub fn glass_albedo(fresnel: DielectricFresnel, mu: f32, alpha: f32, eta: f32) -> f32 {
    let x = ((eta - 1.0).abs() / (eta + 1.0)).sqrt() / MAX_SLAB_COORDINATE;
    let (k, s) = cell(x, SLABS);
    let (near, far) = (slab(fresnel, eta < 1.0, k), slab(fresnel, eta < 1.0, k + 1));
    let r = alpha.sqrt();
    let (i, t) = cell(r, ROUGHNESSES);
    let m = if eta < 1.0 { mu } else { mu.sqrt() };
    let (j, u) = cell(m * (1.0 + r) / (m + r), COSINES);
    let lerp = |a: f32, b: f32, t: f32| a + t * (b - a);
    let row = |i: usize| lerp(lerp(near[i][j], near[i][j + 1], u), lerp(far[i][j], far[i][j + 1], u), s);
    lerp(row(i), row(i + 1), t)
}

fn slab(fresnel: DielectricFresnel, outward: bool, k: usize) -> &'static Slab {
    TABLE[fresnel as usize][outward as usize][k].get_or_init(|| {
        let x = MAX_SLAB_COORDINATE * k as f32 / (SLABS - 1) as f32;
        let z = (x * x).max(TINY);
        let eta = if outward { (1.0 - z) / (1.0 + z) } else { (1.0 + z) / (1.0 - z) };
        let row = |i: usize| {
            let r = (i as f32 / (ROUGHNESSES - 1) as f32).max(TINY.sqrt());
            std::array::from_fn(|j| {
                let t = j as f32 / (COSINES - 1) as f32;
                let m = t * r / (1.0 + r - t);
                let mu = if outward { m } else { m * m };
                integrate(fresnel, mu.clamp(TINY, 1.0), r * r, eta)
            })
        };
        Box::new(std::array::from_fn(row))
    })
}

/// By quadrature over the visible normals: the average of F G₂(reflected)/G₁ + (1 − F) G₂(refracted)/G₁.
fn integrate(fresnel: DielectricFresnel, mu: f32, alpha: f32, eta: f32) -> f32 {
    let ggx = Ggx { alpha };
    let wo = Vec3::new((1.0 - mu * mu).sqrt(), 0.0, mu);
    let nodes = gauss_legendre::<POLAR>();
    let mut sum = 0.0;
    for (x, weight) in nodes {
        let u_polar = x * (2.0 - x); // crowds the nodes towards the cap's rim, where masking sets in
        let weight = weight * 2.0 * (1.0 - x);
        for k in 0..AZIMUTHAL {
            let u_azimuth = 0.5 * (k as f32 + 0.5) / AZIMUTHAL as f32; // the other half is its mirror image
            let h = ggx.sample_normal(wo, Vec2::new(u_polar, u_azimuth));
            let wo_h = wo.dot(h);
            let (reflectance, cos_t) = fresnel.reflectance(wo_h, eta);
            let reflected = reflect_about(wo, h);
            if reflected.z > 0.0 {
                sum += weight * reflectance * ggx.g2_over_g1(wo, reflected);
            }
            let refracted = refract(wo, h, wo_h, cos_t, eta);
            if reflectance < 1.0 && refracted.z < 0.0 {
                sum += weight * (1.0 - reflectance) * ggx.g2_over_g1(wo, refracted);
            }
        }
    }
    sum / AZIMUTHAL as f32
}
