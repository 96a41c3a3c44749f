//! A perfect mirror: all light leaves in the one mirror direction.
//!
//! | parameter | unit | range |
//! |---|---|---|
//! | `curve` | reflectance by angle: a plain tint, or Schlick's curve of a metal | 0 to 1 per channel |

use glam::Vec3;

use super::fresnel::SchlickCurve;
use super::{BsdfSample, Kind, reflect};

#[derive(Clone, Copy, Debug)]
pub struct Mirror {
    pub curve: SchlickCurve,
}

impl Mirror {
    pub fn sample(&self, wo: Vec3) -> Option<BsdfSample> {
        (wo.z > 0.0).then(|| BsdfSample {
            wi: reflect(wo),
            weight: self.curve.at(wo.z),
            pdf: 1.0,
            eta: 1.0,
            delta: true,
            kind: Kind::Glossy,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reflects_by_schlick() {
        let gold = Mirror { curve: SchlickCurve::metal(Vec3::new(1.0, 0.78, 0.34)) };
        let wo = Vec3::new(0.6, -0.64, 0.48);
        let s = gold.sample(wo).expect("above the surface");
        assert_eq!(s.wi, Vec3::new(-0.6, 0.64, 0.48));
        // 0.34 + 0.66 × 0.52⁵
        assert!((s.weight.z - 0.365_093).abs() < 1e-5, "{}", s.weight.z);
        assert!(gold.sample(-wo).is_none());
    }

    #[test]
    fn plain_tint_does_not_change_with_angle() {
        let curve = SchlickCurve::constant(Vec3::splat(0.5));
        let s = Mirror { curve }.sample(Vec3::new(0.8, 0.0, 0.6)).expect("above the surface");
        assert_eq!(s.weight, Vec3::splat(0.5));
    }
}
