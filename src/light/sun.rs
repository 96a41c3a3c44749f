//! The sun: parallel light, or light from a disk of the sky.
//!
//! A disk of angular radius α with radiance L gives a surface that faces it the irradiance E = L π sin² α; the
//! irradiance is what is given, so that the size of the disk softens shadows and leaves the exposure alone.
//!
//! | parameter | unit | range |
//! |---|---|---|
//! | `direction` | unit; where the light goes | |
//! | `irradiance` | W/m² per channel | ≥ 0 |
//! | `angle` | radians, angular diameter | 0 (delta) to π; beyond it is taken as π |

use std::f32::consts::{FRAC_PI_2, PI};

use glam::{Vec2, Vec3};

use crate::sampling::warp::{uniform_cone, uniform_cone_pdf};

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sun {
    /// Unit vector to the middle of the disk.
    pub to_sun: Vec3,
    pub irradiance: Vec3,
    disk: Option<Disk>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Disk {
    radiance: Vec3,
    /// 1 − cos α.
    height: f32,
}

impl Sun {
    pub fn new(direction: Vec3, irradiance: Vec3, angle: f32) -> Self {
        let sin = (0.5 * angle).clamp(0.0, FRAC_PI_2).sin();
        let radiance = irradiance / (PI * sin * sin);
        let height = sin * sin / (1.0 + (1.0 - sin * sin).max(0.0).sqrt());
        // An angle whose square is below f32 is a delta for all purposes.
        let disk = (height > 0.0 && radiance.is_finite()).then_some(Disk { radiance, height });
        Self { to_sun: -direction.normalize_or(Vec3::NEG_Y), irradiance, disk }
    }

    /// No ray can find it by chance.
    pub fn is_delta(&self) -> bool {
        self.disk.is_none()
    }

    /// A direction to the sun, uniform over its disk.
    pub fn sample(&self, u: Vec2) -> Vec3 {
        let Some(disk) = self.disk else { return self.to_sun };
        let w = uniform_cone(u, disk.height);
        let (s, t) = self.to_sun.any_orthonormal_pair();
        (w.x * s + w.y * t + w.z * self.to_sun).normalize()
    }

    /// Solid-angle density of [`sample`](Self::sample), sr⁻¹; 0 where the sun is a delta.
    pub fn pdf(&self, direction: Vec3) -> f32 {
        self.disk_at(direction).map_or(0.0, |disk| uniform_cone_pdf(disk.height))
    }

    /// Radiance of the disk, W·m⁻²·sr⁻¹; 0 beside it, and where the sun is a delta.
    pub fn radiance(&self, direction: Vec3) -> Vec3 {
        self.disk_at(direction).map_or(Vec3::ZERO, |disk| disk.radiance)
    }

    /// |d − s|² = 2 (1 − cos θ) has digits where the cosine of a small disk has none.
    fn disk_at(&self, direction: Vec3) -> Option<&Disk> {
        self.disk.as_ref().filter(|disk| direction.distance_squared(self.to_sun) <= 2.0 * disk.height)
    }
}

#[cfg(test)]
mod tests {
    use glam::Quat;

    use super::*;
    use crate::sampling::stats::{chi2_test, r3};

    const DIRECTION: Vec3 = Vec3::new(-0.48, -0.6, 0.64);

    #[test]
    fn samples_follow_the_density() {
        // Turned to +Z, where the edges of the disks fall on edges of the test's cells.
        let turn = Quat::from_rotation_arc(-DIRECTION, Vec3::Z);
        for angle in [2.0 * 0.9f32.acos(), 2.0 * 0.5f32.acos(), PI, 5.0] {
            let sun = Sun::new(DIRECTION, Vec3::ONE, angle);
            chi2_test(
                &format!("sun of {angle} rad"),
                |[a, b, _]| Some(turn * sun.sample(Vec2::new(a, b))),
                |w| sun.pdf(turn.inverse() * w),
            );
        }
    }

    #[test]
    fn a_plane_that_faces_it_receives_its_irradiance() {
        for angle in [0.5, 0.00935, 1e-4] {
            let sun = Sun::new(DIRECTION, Vec3::splat(3.0), angle);
            let n = 1 << 12;
            let (mut sum, mut inside) = (0.0, 0);
            for i in 0..n {
                let [a, b, _] = r3(i);
                let w = sun.sample(Vec2::new(a, b));
                let pdf = sun.pdf(w);
                if pdf > 0.0 {
                    sum += (sun.radiance(w).x * w.dot(-DIRECTION) / pdf) as f64;
                    inside += 1;
                }
            }
            let (irradiance, kept) = (sum / n as f64, inside as f64 / n as f64);
            assert!(kept > 0.99, "{angle}: rounding puts {kept} inside the disk");
            assert!((irradiance / kept - 3.0).abs() < 3e-3, "{angle}: {irradiance}");
        }
    }

    #[test]
    fn without_an_angle_it_is_a_delta() {
        let sun = Sun::new(DIRECTION, Vec3::ONE, 0.0);
        assert!(sun.is_delta() && sun.sample(Vec2::splat(0.3)) == -DIRECTION.normalize());
        assert_eq!((sun.pdf(-DIRECTION), sun.radiance(-DIRECTION)), (0.0, Vec3::ZERO));
        assert!(Sun::new(DIRECTION, Vec3::ONE, 1e-30).is_delta());
    }
}
