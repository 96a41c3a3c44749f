//! Lights without extent: points and spots. No ray can hit them; their densities are those of deltas.
//!
//! A spot falls off between its half-angles as glTF's KHR_lights_punctual recommends: the square of
//! (cos θ − cos outer) / (cos inner − cos outer), clamped to [0, 1].
//!
//! | parameter | unit |
//! |---|---|
//! | `position` | m |
//! | `intensity` | W/sr per channel |
//! | `direction` (spot) | unit; where the light goes |
//! | `inner`, `outer` (spot) | radians, half-angles, 0 ≤ inner ≤ outer ≤ π |

use std::f32::consts::PI;

use glam::Vec3;

use super::cluster::Cluster;
use crate::color::luminance;

/// The narrowest band, in cos θ, between the inner and the outer cone: equal angles give a sharp edge, not 0 / 0.
const NARROWEST_BAND: f32 = 1e-6;

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Punctual {
    position: Vec3,
    intensity: Vec3,
    cone: Option<SpotCone>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct SpotCone {
    direction: Vec3,
    cos_outer: f32,
    /// 1 / (cos inner − cos outer).
    scale: f32,
}

/// Light that arrives at a point from one direction: as the radiance that, times the cosine, gives the irradiance.
#[derive(Clone, Copy, Debug)]
pub struct Incident {
    pub wi: Vec3,
    pub distance: f32,
    /// W/m² on a surface that faces it.
    pub radiance: Vec3,
}

impl Punctual {
    pub fn point(position: Vec3, intensity: Vec3) -> Self {
        Self { position, intensity, cone: None }
    }

    pub fn spot(position: Vec3, direction: Vec3, intensity: Vec3, inner: f32, outer: f32) -> Self {
        let (cos_inner, cos_outer) = (inner.cos(), outer.cos());
        let scale = 1.0 / (cos_inner - cos_outer).max(NARROWEST_BAND);
        let direction = direction.normalize_or(Vec3::NEG_Z);
        Self { position, intensity, cone: Some(SpotCone { direction, cos_outer, scale }) }
    }

    /// What arrives at `p`; `None` where nothing does.
    pub fn sample(&self, p: Vec3) -> Option<Incident> {
        let to_light = self.position - p;
        let distance = to_light.length();
        let wi = to_light / distance;
        let falloff = self.cone.map_or(1.0, |cone| cone.falloff(-wi.dot(cone.direction)));
        let radiance = self.intensity * falloff / (distance * distance);
        (radiance.is_finite() && radiance != Vec3::ZERO).then_some(Incident { wi, distance, radiance })
    }

    /// What is known of it, for choosing among lights.
    pub(super) fn cluster(&self) -> Cluster {
        let intensity = luminance(self.intensity);
        match &self.cone {
            None => Cluster::round([self.position; 2], 4.0 * PI * intensity),
            Some(cone) => {
                let inner = (cone.cos_outer + 1.0 / cone.scale).clamp(-1.0, 1.0).acos();
                Cluster::beam(self.position, cone.direction, inner, cone.cos_outer.acos(), intensity)
            }
        }
    }
}

impl SpotCone {
    fn falloff(&self, cos_theta: f32) -> f32 {
        let x = ((cos_theta - self.cos_outer) * self.scale).clamp(0.0, 1.0);
        x * x
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_point_obeys_the_inverse_square() {
        let light = Punctual::point(Vec3::new(0.0, 3.0, 0.0), Vec3::new(9.0, 18.0, 0.0));
        let incident = light.sample(Vec3::ZERO).expect("lit");
        assert_eq!((incident.wi, incident.distance), (Vec3::Y, 3.0));
        assert_eq!(incident.radiance, Vec3::new(1.0, 2.0, 0.0));
        assert!(light.sample(light.position).is_none());
    }

    #[test]
    fn a_spot_falls_off_between_its_angles() {
        let light = Punctual::spot(Vec3::ZERO, Vec3::NEG_Y, Vec3::ONE, 0.3, 0.8);
        let at = |theta: f32| light.sample(Vec3::new(theta.sin(), -theta.cos(), 0.0)).map(|i| i.radiance.x);
        assert!((at(0.2).expect("inside") - 1.0).abs() < 1e-5);
        assert!(at(0.81).is_none());
        let x = (0.5f32.cos() - 0.8f32.cos()) / (0.3f32.cos() - 0.8f32.cos());
        assert!((at(0.5).expect("between") - x * x).abs() < 1e-5);
    }
}
