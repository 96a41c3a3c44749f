//! The microfacets nearest to a fuzzy mirror, for renderers that know no other lobe.
//!
//! Seen head on, a fuzzy mirror of radius f ([`FuzzyMirror`](crate::bsdf::FuzzyMirror)) sends its light to directions whose
//! sine s to the mirror direction has the distribution P(s) = 1 − (1 − s²/f²)^{3/2}, up to f². Facets whose normals lean by θ
//! turn light by 2θ. Second moments cannot be compared: that of GGX is infinite but for the horizon, and a match of what
//! the horizon leaves makes the lobe three times too thin. Instead the two lobes are to share as much of their light as
//! they can; the share that falls elsewhere (the total variation, ½ ∫|p − q|) is for f from 0 to 1
//!
//! | facets | best α | elsewhere | |
//! |---|---|---|---|
//! | GGX | 0.304 f | 34 to 15 % | the same half of the light in the same cone: α = ½ f √(1 − 2^{−2/3}) |
//! | Beckmann | 0.35 f | 18 to 1 % | equal second moments would be 0.316 f, equal halves 0.365 f |
//!
//! Away from head on the lobes also differ in shape: facets stretch the lobe towards the horizon, fuzz does not.

/// ½ √(1 − 2^{−2/3})
const GGX: f32 = 0.304_16;
const BECKMANN: f32 = 0.35;

/// Perceptual roughness (√α) of the GGX metal nearest to a fuzzy mirror; 0 is a perfect mirror.
pub fn ggx_roughness(fuzz: f32) -> f32 {
    (GGX * fuzz.clamp(0.0, 1.0)).sqrt()
}

/// α (root-mean-square slope × √2) of the Beckmann metal nearest to a fuzzy mirror; 0 is a perfect mirror.
pub fn beckmann_alpha(fuzz: f32) -> f32 {
    BECKMANN * fuzz.clamp(0.0, 1.0)
}

#[cfg(test)]
mod tests {
    use std::f32::consts::PI;

    use glam::{Vec2, Vec3};

    use super::*;
    use crate::bsdf::{Bsdf, FuzzyMirror};

    /// Half the L1 distance, seen head on, between the fuzz lobe and that of facets with tan² θ ~ `density`(tan²).
    fn elsewhere(fuzz: f32, density: impl Fn(f32) -> f32) -> f32 {
        let lobe = FuzzyMirror::bsdf(Vec3::ONE, fuzz);
        let n = 20_000;
        let step = 0.5 * PI / n as f32;
        let difference = |i: i32| {
            let theta = (i as f32 + 0.5) * step;
            let (sin, cos) = theta.sin_cos();
            let fuzzy = 2.0 * PI * sin * lobe.eval_pdf(Vec3::Z, Vec3::new(sin, 0.0, cos)).1;
            let (t, c) = ((0.5 * theta).tan(), (0.5 * theta).cos());
            let facets = density(t * t) * t / (c * c); // d(tan² ½θ)/dθ
            0.5 * step * (fuzzy - facets).abs()
        };
        (0..n).map(difference).sum()
    }

    fn ggx(alpha: f32) -> impl Fn(f32) -> f32 {
        move |t2| alpha * alpha / (t2 + alpha * alpha).powi(2)
    }

    fn beckmann(alpha: f32) -> impl Fn(f32) -> f32 {
        move |t2| (-t2 / (alpha * alpha)).exp() / (alpha * alpha)
    }

    #[test]
    fn no_other_width_shares_much_more_light() {
        for fuzz in [0.05, 0.3, 0.8] {
            let (g, b) = (ggx_roughness(fuzz).powi(2), beckmann_alpha(fuzz));
            let (here_g, here_b) = (elsewhere(fuzz, ggx(g)), elsewhere(fuzz, beckmann(b)));
            assert!(here_g < 0.35 && here_b < 0.19, "{fuzz}: {here_g} {here_b}");
            for k in [0.7, 0.85, 1.15, 1.3] {
                assert!(elsewhere(fuzz, ggx(k * g)) > here_g - 1e-3, "{fuzz} × {k}");
                assert!(elsewhere(fuzz, beckmann(k * b)) > here_b, "{fuzz} × {k}");
            }
        }
    }

    #[test]
    fn ggx_keeps_half_of_the_light_in_the_same_cone() {
        let fuzz = 0.2;
        let Bsdf::FuzzyMirror(lobe) = FuzzyMirror::bsdf(Vec3::ONE, fuzz) else { panic!("not fuzzy") };
        let cone = 2.0 * ggx_roughness(fuzz).powi(2).atan();
        let n = 1 << 14;
        let inside = (0..n).filter(|&i| {
            let [a, b, c] = crate::sampling::stats::r3(i);
            lobe.sample(Vec3::Z, Vec2::new(a, b), c).is_some_and(|s| s.wi.z > cone.cos())
        });
        let share = inside.count() as f32 / n as f32;
        assert!((share - 0.5).abs() < 0.01, "{share}");
    }

    #[test]
    fn no_fuzz_is_a_mirror() {
        assert_eq!((ggx_roughness(0.0), beckmann_alpha(0.0)), (0.0, 0.0));
    }
}
