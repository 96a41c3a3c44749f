//! The tint that gives Mitsuba's rough metals the energy of ours.
//!
//! A `roughconductor` without a material reflects its `specular_reflectance` at every facet, scatters once, and has
//! G₁(wo) G₁(wi) for masking. The tint t makes its albedo over the hemisphere that of our lobe of colour c:
//!
//! ```text
//! t(c) = Ē(c) / Ē₁,   Ē = ∫ E(μ) 2μ dμ
//! ```
//!
//! with E(c) after all bounces and Schlick's curve, and E₁ of white facets after one bounce. It exceeds 1 where light
//! between facets counts.

use glam::{Vec2, Vec3};

use crate::bsdf::{
    Bsdf, BsdfSample, Conductor, Dielectric, Kind, Pbr, RoughDielectric,
    fresnel::{DielectricFresnel, LayerCurve, SchlickCurve},
};

/// Perceptual roughness from which the tint is nearer than Mitsuba's `principled`, whose curve is Schlick's but which scatters
/// once.
pub const SCALED_FROM: f32 = 0.35;

/// Perceptual roughness from which a plain base under the layer is nearer than that of `roughplastic`, which dims by the light
/// that one scattering lets through.
pub const PLAIN_BASE_FROM: f32 = 0.3;

const COLORS: usize = 17;
const SAMPLES: u32 = 1 << 13;

/// Reflectances by colour, of the two lobes that make up a rough metal.
pub struct Metal {
    /// Of `roughconductor`.
    facets: [f32; COLORS],
    /// Of `diffuse`: what leaves after more than one bounce.
    further: [f32; COLORS],
    /// The share of `diffuse` in the blend.
    pub weight: f32,
}

impl Metal {
    pub fn new(alpha: f32, schlick: bool, multiscatter: bool) -> Self {
        let white = white(alpha);
        let albedos: [[f32; 2]; COLORS] = std::array::from_fn(|i| {
            let c = Vec3::splat(i as f32 / (COLORS - 1) as f32);
            let curve = if schlick { SchlickCurve::metal(c) } else { SchlickCurve::constant(c) };
            let all = mean(&Conductor::bsdf(curve, alpha, multiscatter), 1.0, |s| s.weight.x);
            let single = Conductor::bsdf(curve, alpha, false);
            let constant = Conductor::bsdf(SchlickCurve::constant(Vec3::ONE), alpha, false);
            let curve = mean(&single, 1.0, |s| s.weight.x) / mean(&constant, 1.0, |s| s.weight.x);
            [curve, (all - curve * white).max(0.0)]
        });
        let weight = if multiscatter { (1.0 - white).clamp(0.02, 0.5) } else { 0.0 };
        Self { facets: albedos.map(|a| a[0]), further: albedos.map(|a| a[1]), weight }
    }

    /// To be divided by 1 − [`weight`](Self::weight) in the blend.
    pub fn facets(&self, color: Vec3) -> Vec3 {
        color.map(|c| lerp(&self.facets, c)) / (1.0 - self.weight)
    }

    pub fn further(&self, color: Vec3) -> Vec3 {
        color.map(|c| lerp(&self.further, c)) / self.weight
    }
}

fn lerp(table: &[f32; COLORS], c: f32) -> f32 {
    let x = c.clamp(0.0, 1.0) * (COLORS - 1) as f32;
    let i = (x as usize).min(COLORS - 2);
    table[i] + (x - i as f32) * (table[i + 1] - table[i])
}

/// Ē₁
fn white(alpha: f32) -> f32 {
    mean(&Conductor::bsdf(SchlickCurve::constant(Vec3::ONE), alpha, false), 1.0, |s| g1(s.wi.z, alpha))
}

/// Factors on the reflectances of a `roughplastic`.
#[derive(Clone, Copy, Debug)]
pub struct Plastic {
    pub specular: f32,
    pub diffuse: f32,
    /// What the layer leaves for a base that is not part of the plastic: 1 − Ē.
    pub rest: f32,
}

impl Plastic {
    pub fn new(alpha: f32, ior: f32, multiscatter: bool) -> Self {
        let layer = Pbr::bsdf(Vec3::ZERO, 0.0, alpha, LayerCurve::dielectric(ior), multiscatter, Vec3::Z);
        let reflected = mean(&layer, 1.0, |s| s.weight.x);
        let boundary = Dielectric { ior, fresnel: DielectricFresnel::Exact, tint: Vec3::ONE };
        let facets = RoughDielectric::bsdf(boundary, alpha, false);
        let part =
            |side, kind| mean(&facets, side, |s| if s.kind == kind { g1(s.wi.z.abs(), alpha) } else { 0.0 });
        let transmitted = part(1.0, Kind::Transmission);
        // Mitsuba takes the mean of 64 equidistant values, the ends included, where an integral has them by half.
        let internal = part(-1.0, Kind::Glossy) * 63.0 / 64.0;
        let diffuse = transmitted * transmitted / (ior * ior * (1.0 - internal));
        let rest = 1.0 - reflected;
        Self { specular: reflected / part(1.0, Kind::Glossy), diffuse: rest / diffuse, rest }
    }
}

/// Over directions on one side by their cosine, the mean of what `weight` makes of a sample.
fn mean(bsdf: &Bsdf, side: f32, weight: impl Fn(&BsdfSample) -> f32) -> f32 {
    let sum: f64 = (0..SAMPLES)
        .map(|i| {
            // by powers of the inverse of the root of x⁵ = x + 1, as Roberts 2018 has it
            let at = |step: f64| ((i as f64 + 0.5) * step).fract() as f32;
            let [a, b, c, d] = [0.856_674_88, 0.733_891_86, 0.628_706_73, 0.538_597_26].map(at);
            let mu = a.max(1e-6).sqrt();
            let wo = Vec3::new((1.0 - mu * mu).max(0.0).sqrt(), 0.0, side * mu);
            bsdf.sample(wo, Vec2::new(b, c), d).map_or(0.0, |s| weight(&s) as f64)
        })
        .sum();
    (sum / SAMPLES as f64) as f32
}

/// Smith's masking of GGX, 1 / (1 + Λ).
fn g1(cos: f32, alpha: f32) -> f32 {
    2.0 * cos / (cos + (cos * cos + alpha * alpha * (1.0 - cos * cos)).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Albedos over the hemisphere that Mitsuba 3.9.1 has, by sampling its BSDFs: at index 1.5.
    #[test]
    fn what_mitsuba_reflects_is_foreseen() {
        for (alpha, diffuse, specular, metal) in
            [(0.04, 0.8767, 0.0874, 0.9941), (0.36, 0.5721, 0.0484, 0.7972), (1.0, 0.2671, 0.01856, 0.3768)]
        {
            let near = |a: f32, b: f32| assert!((a / b - 1.0).abs() < 0.03, "{alpha}: {a} is not {b}");
            near(white(alpha), metal);
            let plastic = Plastic::new(alpha, 1.5, true);
            let layer = Pbr::bsdf(Vec3::ZERO, 0.0, alpha, LayerCurve::dielectric(1.5), true, Vec3::Z);
            let layer = mean(&layer, 1.0, |s| s.weight.x);
            near(layer / plastic.specular, specular);
            near((1.0 - layer) / plastic.diffuse, diffuse);
        }
    }

    #[test]
    fn a_white_metal_reflects_all_and_a_smooth_one_its_curve() {
        let rough = Metal::new(1.0, false, true);
        let all = (1.0 - rough.weight) * rough.facets(Vec3::ONE) * white(1.0)
            + rough.weight * rough.further(Vec3::ONE);
        assert!((all.x - 1.0).abs() < 0.01, "{all}");
        let smooth = Metal::new(2e-3, true, false);
        // c + (1 − c) / 21
        let grey = smooth.facets(Vec3::splat(0.5)).x;
        assert!((grey - (0.5 + 0.5 / 21.0)).abs() < 3e-3, "{grey}");
    }
}
