//! A sphere as a light.
//!
//! From outside it is seen as a cone of directions, sin θ_max = radius / distance, drawn uniformly over solid angle
//! (Shirley, Wang, Zimmerman 1996, *Monte Carlo Techniques for Direct Lighting Calculations*, section 3.2). From
//! inside every direction meets it once: uniform over the sphere of directions.
//!
//! | parameter | unit | range |
//! |---|---|---|
//! | `center` | m | |
//! | `radius` | m | > 0 |

use std::f32::consts::PI;

use glam::{Vec2, Vec3};

use super::shape::ShapeSample;
use crate::sampling::warp::{uniform_cone, uniform_cone_pdf, uniform_sphere};

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sphere {
    pub center: Vec3,
    pub radius: f32,
}

impl Sphere {
    pub fn area(&self) -> f32 {
        4.0 * PI * self.radius * self.radius
    }

    pub fn sample(&self, p: Vec3, u: Vec2) -> Option<ShapeSample> {
        let normal = match Cone::new(p.distance(self.center), self.radius) {
            Some(cone) => self.seen_from_outside(p, u, cone),
            None => self.seen_from_inside(p, u)?,
        };
        let point = self.center + self.radius * normal;
        Some(ShapeSample { point, normal, uv: Vec2::ZERO, pdf: self.pdf(p) })
            .filter(|s| s.pdf > 0.0 && s.pdf.is_finite() && s.point != p)
    }

    pub fn pdf(&self, p: Vec3) -> f32 {
        Cone::new(p.distance(self.center), self.radius)
            .map_or(1.0 / (4.0 * PI), |cone| uniform_cone_pdf(cone.height))
    }

    /// Outward normal where a uniform direction of the cone first meets the sphere.
    ///
    /// In the triangle of p, the point and the center the angle at p is θ, at the point it is the obtuse one of sine
    /// a = sin θ / sin θ_max, and the one at the center, α, is asin a − θ. Written so that nothing cancels:
    ///
    /// ```text
    /// sin α = sin θ cos² θ_max / (sin θ_max (cos θ + sin θ_max √(1 − a²)))
    /// ```
    fn seen_from_outside(&self, p: Vec3, u: Vec2, cone: Cone) -> Vec3 {
        let w = uniform_cone(u, cone.height);
        let rest = (1.0 - u.x) * (2.0 - cone.height * (1.0 + u.x)) / (2.0 - cone.height); // 1 − a²
        let denominator = cone.sin * (w.z + cone.sin * rest.max(0.0).sqrt());
        let side = w.truncate() * (cone.cos * cone.cos / denominator.max(f32::MIN_POSITIVE));
        let axis = (p - self.center).normalize_or(Vec3::Y);
        let (s, t) = axis.any_orthonormal_pair();
        let cos_alpha = (1.0 - side.length_squared()).max(0.0).sqrt();
        (side.x * s + side.y * t + cos_alpha * axis).normalize()
    }

    /// Outward normal where a uniform direction from inside meets the sphere; `None` for a direction that leads out of
    /// it right away, from a point on its surface.
    fn seen_from_inside(&self, p: Vec3, u: Vec2) -> Option<Vec3> {
        let w = uniform_sphere(u);
        let offset = (p - self.center) / self.radius;
        let along = offset.dot(w);
        let half_chord = (along * along + (1.0 - offset.length_squared()).max(0.0)).sqrt();
        let distance = half_chord - along;
        (distance > SURFACE).then(|| (offset + distance * w).normalize_or(w))
    }
}

/// A point this near to the surface, relative to the radius, lies on it: rounding does not tell inside from outside.
const SURFACE: f32 = 1e-4;

/// The directions under which a sphere is seen from outside.
struct Cone {
    sin: f32,
    cos: f32,
    /// 1 − cos.
    height: f32,
}

impl Cone {
    /// `None` inside and on the surface, where a cone would be half of all directions, wrongly the outer half from
    /// within. Keeps its digits for small far spheres (height = sin² / (1 + cos)) and close to large ones
    /// (cos² from distance − radius).
    fn new(distance: f32, radius: f32) -> Option<Self> {
        if distance <= radius * (1.0 + SURFACE) {
            return None;
        }
        let sin = radius / distance;
        let cos = ((distance - radius) / distance * (1.0 + sin)).sqrt();
        Some(Self { sin, cos, height: sin * sin / (1.0 + cos) })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::stats::{chi2_test, r3};

    /// The first point of the sphere along a ray, in f64.
    fn hit(sphere: Sphere, p: Vec3, w: Vec3) -> Option<Vec3> {
        let (o, w) = ((p - sphere.center).as_dvec3(), w.as_dvec3().normalize());
        let along = o.dot(w);
        let discriminant = along * along - (o.length_squared() - (sphere.radius as f64).powi(2));
        let root = (discriminant >= 0.0).then(|| discriminant.sqrt())?;
        let t = if -along - root > 0.0 { -along - root } else { -along + root };
        (t > 0.0).then(|| p + (t * w).as_vec3())
    }

    #[test]
    fn samples_follow_the_density() {
        let sphere = Sphere { center: Vec3::new(1.0, -2.0, 0.5), radius: 0.75 };
        for (name, offset) in [
            ("far", Vec3::new(3.0, 1.0, 2.0)),
            ("near", Vec3::new(0.3, 0.5, 0.6)),
            ("touching", Vec3::new(0.0, 0.7501, 0.0)),
            ("inside", Vec3::new(0.2, 0.1, -0.5)),
            ("center", Vec3::ZERO),
        ] {
            let p = sphere.center + offset;
            chi2_test(
                name,
                |[a, b, _]| sphere.sample(p, Vec2::new(a, b)).map(|s| (s.point - p).normalize()),
                |w| hit(sphere, p, w).map_or(0.0, |_| sphere.pdf(p)),
            );
            for i in 0..100 {
                let [a, b, _] = r3(i);
                let s = sphere.sample(p, Vec2::new(a, b)).expect("visible from everywhere");
                let first = hit(sphere, p, s.point - p).unwrap_or(s.point); // the edge may be missed by rounding
                assert!(first.abs_diff_eq(s.point, 2e-3), "{name}: {first} hides {}", s.point);
                assert!((s.point.distance(sphere.center) - sphere.radius).abs() < 1e-5, "{name}");
            }
        }
    }

    #[test]
    fn small_far_and_large_near_spheres_keep_their_digits() {
        // a radius of 1 mm at 1 km: solid angle π (r/d)²
        let far = Sphere { center: Vec3::new(1000.0, 0.0, 0.0), radius: 1e-3 };
        let solid_angle = 1.0 / far.pdf(Vec3::ZERO);
        assert!((solid_angle / (PI * 1e-12) - 1.0).abs() < 1e-4, "{solid_angle}");
        // 1 m above a planet: cos θ_max = √(2 · 1 m / R)
        let planet = Sphere { center: Vec3::new(0.0, -1000.0, 0.0), radius: 1000.0 };
        let p = Vec3::Y;
        let expected = 2.0 * PI * (1.0 - (2001.0f32.sqrt() / 1001.0));
        assert!((1.0 / planet.pdf(p) / expected - 1.0).abs() < 1e-4);
        for i in 0..1000 {
            let [a, b, _] = r3(i);
            let s = planet.sample(p, Vec2::new(a, b)).expect("outside");
            assert!((s.point.distance(planet.center) - 1000.0).abs() < 1e-3);
            assert!(s.normal.dot((s.point - p).normalize()) < 1e-3, "the near side");
        }
    }
}
