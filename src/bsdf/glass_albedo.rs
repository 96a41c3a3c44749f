//! Directional albedo of a rough dielectric boundary: how much of the light from one direction is left, reflected
//! and refracted together, after one bounce. A function of μ = |wo_z|, α, and η = ηₜ/ηᵢ.
//!
//! A table in three dimensions, made of slabs of one η each; a slab is computed when it is first asked for, so a
//! scene pays for the indices it has (about 30 ms for each of the four slabs of a glass). Near η = 1 the albedo goes
//! as √|η − 1| (total reflection begins at that cosine), and so do the slabs: evenly in √(|η − 1| / (η + 1)). By
//! cosine the nodes are those of [`albedo`](super::albedo) going in; coming out total reflection dominates, and
//! μ takes the place of √μ.

use std::sync::OnceLock;

use super::fresnel::{DielectricFresnel, refract};
use super::ggx::Ggx;
use super::reflect_about;
use super::table::{average_over_normals, cell, node};

const SLABS: usize = 48;
const ROUGHNESSES: usize = 24;
const COSINES: usize = 32;
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
        let x = MAX_SLAB_COORDINATE * node(k, SLABS);
        let z = (x * x).max(TINY);
        let eta = if outward { (1.0 - z) / (1.0 + z) } else { (1.0 + z) / (1.0 - z) };
        let row = |i: usize| {
            let r = node(i, ROUGHNESSES).max(TINY.sqrt());
            std::array::from_fn(|j| {
                let t = node(j, COSINES);
                let m = t * r / (1.0 + r - t);
                let mu = if outward { m } else { m * m };
                integrate(fresnel, mu.clamp(TINY, 1.0), r * r, eta)
            })
        };
        Box::new(std::array::from_fn(row))
    })
}

/// The average over the visible normals of F G₂(reflected)/G₁ + (1 − F) G₂(refracted)/G₁.
fn integrate(fresnel: DielectricFresnel, mu: f32, alpha: f32, eta: f32) -> f32 {
    let ggx = Ggx { alpha };
    average_over_normals(ggx, mu, |wo, h| {
        let wo_h = wo.dot(h);
        let (reflectance, cos_t) = fresnel.reflectance(wo_h, eta);
        let (reflected, refracted) = (reflect_about(wo, h), refract(wo, h, wo_h, cos_t, eta));
        let mut kept = 0.0;
        if reflected.z > 0.0 {
            kept += reflectance * ggx.g2_over_g1(wo, reflected);
        }
        if reflectance < 1.0 && refracted.z < 0.0 {
            kept += (1.0 - reflectance) * ggx.g2_over_g1(wo, refracted);
        }
        kept
    })
}
