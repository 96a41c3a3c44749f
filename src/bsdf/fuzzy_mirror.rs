//! Fuzzy mirror: a mirror whose reflected direction is perturbed by a ball.
//!
//! The reflected ray is `r + fuzz · p`, with `r` the unit mirror direction and `p` uniform in the unit ball
//! (*Ray Tracing in One Weekend*, "Fuzzy reflection"). It is usually given as a recipe for sampling only; the
//! density follows in closed form. A direction ω meets the ball of radius f around r between the distances
//!
//! ```text
//! t± = c ± q,   c = ω·r,   q = √(f² − |ω × r|²)
//! ```
//!
//! and the uniform volume density 3 / (4πf³), integrated over t² dt along ω, gives the solid-angle density
//!
//! ```text
//! p(ω) = (t₊³ − t₋³) / (4πf³) = q (3c² + q²) / (2πf³)
//! ```
//!
//! so the lobe takes part in next-event estimation and MIS like any other. Rays that end below the surface are
//! absorbed: the lobe loses energy at grazing angles by construction, and is not reciprocal.
//!
//! | parameter | unit | range |
//! |---|---|---|
//! | `tint` | reflectance per channel, linear Rec.709 | 0 to 1 |
//! | `fuzz` | radius relative to the unit direction | (0, 1]; 0 is [`Mirror`] |

use std::f32::consts::PI;

use glam::{Vec2, Vec3};

use super::fresnel::SchlickCurve;
use super::{Bsdf, BsdfSample, Kind, Mirror, reflect};
use crate::sampling::warp::uniform_ball;

/// Thinner lobes have no digits left in f32 and are perfect mirrors.
const MIN_FUZZ: f32 = 1e-4;

#[derive(Clone, Copy, Debug)]
pub struct FuzzyMirror {
    tint: Vec3,
    fuzz: f32,
}

impl FuzzyMirror {
    /// A fuzzy mirror, or a perfect one where `fuzz` is (next to) nothing.
    pub fn bsdf(tint: Vec3, fuzz: f32) -> Bsdf {
        if fuzz >= MIN_FUZZ {
            Bsdf::FuzzyMirror(Self { tint, fuzz: fuzz.min(1.0) })
        } else {
            Bsdf::Mirror(Mirror { curve: SchlickCurve::constant(tint) })
        }
    }

    pub fn fuzz(&self) -> f32 {
        self.fuzz
    }

    pub fn eval_pdf(&self, wo: Vec3, wi: Vec3) -> (Vec3, f32) {
        let pdf = self.pdf(wo, wi);
        (self.tint * pdf, pdf)
    }

    /// Draws `wi`, or `None` where the perturbed ray is absorbed.
    pub fn sample(&self, wo: Vec3, u: Vec2, u_radius: f32) -> Option<BsdfSample> {
        let wi = (reflect(wo) + self.fuzz * uniform_ball(u, u_radius)).try_normalize()?;
        let pdf = self.pdf(wo, wi);
        (pdf > 0.0).then_some(BsdfSample {
            wi,
            weight: self.tint,
            pdf,
            eta: 1.0,
            delta: false,
            kind: Kind::Glossy,
        })
    }

    /// Integrates to the share that is not absorbed.
    pub fn pdf(&self, wo: Vec3, wi: Vec3) -> f32 {
        let r = reflect(wo);
        let c = wi.dot(r);
        let q2 = self.fuzz * self.fuzz - wi.cross(r).length_squared();
        if wo.z <= 0.0 || wi.z <= 0.0 || c <= 0.0 || q2 <= 0.0 {
            return 0.0;
        }
        let q = q2.sqrt();
        q * (3.0 * c * c + q2) / (2.0 * PI * self.fuzz.powi(3))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::stats::{directions, integrate_hemisphere, r3};

    #[test]
    fn density_integrates_to_the_share_of_samples_kept() {
        for fuzz in [0.05, 0.3, 0.7, 1.0] {
            let lobe = FuzzyMirror { tint: Vec3::ONE, fuzz };
            for wo in directions(4) {
                let n = 1 << 14;
                let kept = (0..n).filter(|&i| {
                    let [a, b, c] = r3(i);
                    lobe.sample(wo, Vec2::new(a, b), c).is_some()
                });
                let kept = kept.count() as f32 / n as f32;
                let mass = integrate_hemisphere(|wi| lobe.pdf(wo, wi));
                assert!((mass - kept).abs() < 0.01, "fuzz {fuzz}, wo {wo}: ∫pdf {mass}, kept {kept}");
            }
        }
    }

    #[test]
    fn density_at_the_centre_of_a_thin_lobe_is_that_of_a_ball_seen_from_afar() {
        // chord 2f × 3 / (4πf³) = 3 / (2πf²), up to f²
        let fuzz = 1e-3;
        let lobe = FuzzyMirror { tint: Vec3::ONE, fuzz };
        let wo = Vec3::new(0.6, 0.0, 0.8);
        let expected = 3.0 / (2.0 * PI * fuzz * fuzz);
        assert!((lobe.pdf(wo, reflect(wo)) / expected - 1.0).abs() < 1e-4);
    }
}
