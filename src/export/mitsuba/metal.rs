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

use crate::bsdf::{BsdfSample, Conductor, fresnel::SchlickCurve};

/// Perceptual roughness from which the tint is nearer than Mitsuba's `principled`, whose curve is Schlick's but which scatters
/// once.
pub const SCALED_FROM: f32 = 0.5;

const COLORS: usize = 17;
const SAMPLES: u32 = 1 << 13;

pub struct Scale([f32; COLORS]);

impl Scale {
    pub fn new(alpha: f32, schlick: bool, multiscatter: bool) -> Self {
        let single = mean(alpha, SchlickCurve::constant(Vec3::ONE), false, |s| g1(s.wi.z, alpha));
        Self(std::array::from_fn(|i| {
            let c = Vec3::splat(i as f32 / (COLORS - 1) as f32);
            let curve = if schlick { SchlickCurve::metal(c) } else { SchlickCurve::constant(c) };
            mean(alpha, curve, multiscatter, |s| s.weight.x) / single
        }))
    }

    /// Per channel.
    pub fn of(&self, color: Vec3) -> Vec3 {
        color.map(|c| {
            let x = c.clamp(0.0, 1.0) * (COLORS - 1) as f32;
            let i = (x as usize).min(COLORS - 2);
            let [a, b] = [self.0[i], self.0[i + 1]];
            a + (x - i as f32) * (b - a)
        })
    }
}

/// Ē: over directions by their cosine, the mean of what `weight` makes of a sample.
fn mean(alpha: f32, curve: SchlickCurve, multiscatter: bool, weight: impl Fn(&BsdfSample) -> f32) -> f32 {
    let bsdf = Conductor::bsdf(curve, alpha, multiscatter);
    let sum: f64 = (0..SAMPLES)
        .map(|i| {
            // the R3 sequence of Roberts 2018
            let at = |step: f64| ((i as f64 + 0.5) * step).fract() as f32;
            let [a, b, c] = [at(0.819_172_513), at(0.671_043_607), at(0.549_700_478)];
            let mu = a.max(1e-6).sqrt();
            let wo = Vec3::new((1.0 - mu * mu).max(0.0).sqrt(), 0.0, mu);
            bsdf.sample(wo, Vec2::new(b, c), 0.0).map_or(0.0, |s| weight(&s) as f64)
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

    #[test]
    fn next_to_no_roughness_the_tint_is_the_mean_of_the_curve() {
        let plain = Scale::new(2e-3, false, true).of(Vec3::new(0.2, 0.5, 1.0));
        assert!(plain.abs_diff_eq(Vec3::new(0.2, 0.5, 1.0), 3e-3), "{plain}");
        // c + (1 − c) / 21
        let schlick = Scale::new(2e-3, true, true).of(Vec3::splat(0.5));
        assert!((schlick.x - (0.5 + 0.5 / 21.0)).abs() < 3e-3, "{schlick}");
    }

    /// A white rough metal that loses nothing needs 1 / E₁, which at α = 1 is more than two.
    #[test]
    fn white_facets_are_made_to_reflect_all() {
        let scale = Scale::new(1.0, false, true).of(Vec3::ONE).x;
        let single = mean(1.0, SchlickCurve::constant(Vec3::ONE), false, |s| g1(s.wi.z, 1.0));
        assert!((scale * single - 1.0).abs() < 0.01 && scale > 2.0, "{scale}, {single}");
    }
}
