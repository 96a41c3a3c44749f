//! A smooth boundary between the outside, of index 1, and a medium: glass, water, or a bubble of index below 1.
//!
//! With η = ηₜ/ηᵢ, and θ measured from the normal on either side (where the incident direction is R = −wo, the
//! refracted ray is R' = R⊥ + R∥ with R⊥ = (R + cos θ n)/η, R∥ = −√(1 − |R⊥|²) n):
//!
//! ```text
//! η sin θₜ = sin θᵢ                 Snell; no solution is total internal reflection
//! f = tint F δ(reflected) + tint (1 − F) / η² δ(refracted)
//! ```
//!
//! The 1/η² is that of radiance, which grows as its beam narrows in the denser medium (PBRT, 4th ed., 9.5.2). F is
//! from [`fresnel`](super::fresnel), and also the probability of reflection.
//!
//! | parameter | unit | range |
//! |---|---|---|
//! | `ior` | index of the inside over that of the outside | > 0; 1 lets all pass straight |
//! | `tint` | factor of both reflection and refraction | 0 to 1 per channel |

use glam::Vec3;

use super::fresnel::{DielectricFresnel, refract};
use super::{BsdfSample, Kind, reflect};

#[derive(Clone, Copy, Debug)]
pub struct Dielectric {
    pub ior: f32,
    pub fresnel: DielectricFresnel,
    pub tint: Vec3,
}

impl Dielectric {
    pub fn sample(&self, wo: Vec3, u_lobe: f32) -> Option<BsdfSample> {
        let side = wo.z.signum();
        let cos_o = wo.z.abs();
        if cos_o == 0.0 {
            return None;
        }
        let eta = relative_eta(self.ior, wo);
        let (reflectance, cos_t) = self.fresnel.reflectance(cos_o, eta);
        Some(if u_lobe < reflectance {
            BsdfSample {
                wi: reflect(wo),
                weight: self.tint,
                pdf: reflectance,
                eta: 1.0,
                delta: true,
                kind: Kind::Glossy,
            }
        } else {
            BsdfSample {
                wi: refract(wo, side * Vec3::Z, cos_o, cos_t, eta),
                weight: self.tint / (eta * eta),
                pdf: 1.0 - reflectance,
                eta,
                delta: true,
                kind: Kind::Transmission,
            }
        })
    }
}

/// ηₜ/ηᵢ for light seen along `wo`: the far side over the near side.
pub fn relative_eta(ior: f32, wo: Vec3) -> f32 {
    if wo.z > 0.0 { ior } else { 1.0 / ior }
}

#[cfg(test)]
mod tests {
    use super::*;
    use DielectricFresnel::{Exact, Schlick};

    fn glass(ior: f32, fresnel: DielectricFresnel) -> Dielectric {
        Dielectric { ior, fresnel, tint: Vec3::ONE }
    }

    fn at(degrees: f32) -> Vec3 {
        let (sin, cos) = degrees.to_radians().sin_cos();
        Vec3::new(sin * 0.6, sin * 0.8, cos)
    }

    #[test]
    fn refraction_follows_snell() {
        // entering at 30°: asin(sin 30° / 1.5) = 19.471°, in the same plane, on the other side
        let s = glass(1.5, Exact).sample(at(30.0), 0.99).expect("scatters");
        assert_eq!((s.kind, s.eta), (Kind::Transmission, 1.5));
        assert!(s.wi.abs_diff_eq(-at(19.471_22), 1e-6), "{}", s.wi);
        // and back out again
        let back = glass(1.5, Exact).sample(-at(19.471_22), 0.99).expect("scatters");
        assert!(back.wi.abs_diff_eq(at(30.0), 1e-6), "{}", back.wi);
        assert!((back.weight * s.weight).abs_diff_eq(Vec3::ONE, 1e-6));
        assert!((s.weight.x - 1.0 / 2.25).abs() < 1e-6);
    }

    #[test]
    fn beyond_the_critical_angle_all_is_reflected() {
        // asin(1 / 1.5) = 41.8103°; for a bubble of air in water the outside is the denser side
        for (ior, side, critical) in [(1.5, -1.0, 41.810_3), (1.0 / 1.33, 1.0, 48.753_5)] {
            for fresnel in [Exact, Schlick] {
                let wo = |degrees| side * at(degrees);
                let beyond = glass(ior, fresnel).sample(wo(critical + 0.01), 0.999_999).expect("scatters");
                assert_eq!((beyond.kind, beyond.pdf), (Kind::Glossy, 1.0));
                let before = glass(ior, fresnel).sample(wo(critical - 0.01), 0.999_999).expect("scatters");
                assert_eq!(before.kind, Kind::Transmission);
            }
        }
    }

    #[test]
    fn same_index_passes_straight() {
        for fresnel in [Exact, Schlick] {
            for wo in [at(0.0), at(45.0), at(89.9), -at(60.0)] {
                let s = glass(1.0, fresnel).sample(wo, 0.0).expect("scatters");
                assert!(s.wi.abs_diff_eq(-wo, 1e-6) && s.weight == Vec3::ONE, "{s:?}");
            }
        }
    }

    #[test]
    fn both_choices_together_are_white() {
        for ior in [0.75, 1.33, 1.5, 2.4] {
            for fresnel in [Exact, Schlick] {
                for wo in [at(0.0), at(50.0), at(87.0), -at(20.0), -at(60.0)] {
                    let n = 1000;
                    let energy = |i: u32| {
                        let s = glass(ior, fresnel).sample(wo, (i as f32 + 0.5) / n as f32);
                        s.map_or(0.0, |s| s.weight.x * s.eta * s.eta)
                    };
                    let mean = (0..n).map(energy).sum::<f32>() / n as f32;
                    assert!((mean - 1.0).abs() < 1e-4, "ior {ior}, {wo}: {mean}");
                }
            }
        }
    }
}
