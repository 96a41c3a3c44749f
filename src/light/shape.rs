//! The shapes of area lights: points on them, drawn as seen from a reference point.
//!
//! Densities are over solid angle at the reference point, in sr⁻¹. What is drawn is a point of the surface; whether
//! it emits towards the reference point, and how much, is for the light and its material to say.

use glam::{Vec2, Vec3};

use super::{cluster::Cluster, quad::Quad, sphere::Sphere, triangle::Triangle};
use crate::sampling::warp::uniform_sphere;

#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Shape {
    Sphere(Sphere),
    Quad(Quad),
    Triangle(Triangle),
}

/// A point on a light.
#[derive(Clone, Copy, Debug)]
pub struct ShapeSample {
    pub point: Vec3,
    /// Geometric, unit: out of the sphere, out of the front of the others.
    pub normal: Vec3,
    /// Barycentrics (b1, b2) on a triangle, (a, b) on a quad; (0, 0) on a sphere, where the normal says it all.
    pub uv: Vec2,
    /// Solid-angle density at the reference point, sr⁻¹; positive and finite.
    pub pdf: f32,
}

impl Shape {
    /// A point as seen from `p`; `None` where no light can come from it (seen edge on, degenerate).
    pub fn sample(&self, p: Vec3, u: Vec2) -> Option<ShapeSample> {
        match self {
            Self::Sphere(sphere) => sphere.sample(p, u),
            Self::Quad(quad) => quad.sample(p, u),
            Self::Triangle(triangle) => triangle.sample(p, u),
        }
    }

    /// The density with which [`sample`](Self::sample) draws `point` of this surface, as seen from `p`; 0 edge on.
    pub fn pdf(&self, p: Vec3, point: Vec3) -> f32 {
        match self {
            Self::Sphere(sphere) => sphere.pdf(p),
            Self::Quad(quad) => quad.pdf(p, point),
            Self::Triangle(triangle) => triangle.pdf(p, point),
        }
    }

    /// Geometric normal at a point of the surface.
    pub fn normal(&self, point: Vec3) -> Vec3 {
        match self {
            Self::Sphere(sphere) => (point - sphere.center).normalize_or_zero(),
            Self::Quad(quad) => quad.normal,
            Self::Triangle(triangle) => triangle.normal,
        }
    }

    /// A uniform point of the surface, its geometric normal, and coordinates as [`ShapeSample`] has them.
    pub fn sample_area(&self, u: Vec2) -> (Vec3, Vec3, Vec2) {
        match self {
            Self::Sphere(sphere) => {
                let normal = uniform_sphere(u);
                (sphere.center + sphere.radius * normal, normal, Vec2::ZERO)
            }
            Self::Quad(quad) => {
                let (point, uv) = quad.sample_area(u);
                (point, quad.normal, uv)
            }
            Self::Triangle(triangle) => {
                let (point, uv) = triangle.sample_area(u);
                (point, triangle.normal, uv)
            }
        }
    }

    /// What is known of it, as a light of luminous power `power`, for choosing among lights.
    pub(super) fn cluster(&self, power: f32, two_sided: bool) -> Cluster {
        let around = |points: &[Vec3]| {
            let min = points.iter().copied().fold(Vec3::INFINITY, Vec3::min);
            [min, points.iter().copied().fold(Vec3::NEG_INFINITY, Vec3::max)]
        };
        match self {
            Self::Sphere(sphere) => {
                Cluster::round([-1.0, 1.0].map(|side| sphere.center + side * sphere.radius), power)
            }
            Self::Quad(quad) => Cluster::flat(around(&quad.corners()), quad.normal, power, two_sided),
            Self::Triangle(triangle) => {
                Cluster::flat(around(&triangle.points()), triangle.normal, power, two_sided)
            }
        }
    }

    /// m²; 0 where the shape is degenerate.
    pub fn area(&self) -> f32 {
        match self {
            Self::Sphere(sphere) => sphere.area(),
            Self::Quad(quad) => quad.area,
            Self::Triangle(triangle) => triangle.area,
        }
    }
}

/// A uniform density over `area` as one over solid angle at `p`: distance² / (|cos θ| · area), with θ at the light.
/// 0 where that is not a number to work with: edge on, or `point` at `p`.
pub(super) fn area_to_solid_angle(p: Vec3, point: Vec3, normal: Vec3, area: f32) -> f32 {
    let to_light = point - p;
    let distance_squared = to_light.length_squared();
    let pdf = distance_squared * distance_squared.sqrt() / (to_light.dot(normal).abs() * area);
    if pdf.is_finite() { pdf } else { 0.0 }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::sampling::stats::{chi2_p_value, r3, uniform};

    const BINS: usize = 20;
    const POINTS_PER_BIN: usize = 24;

    /// A test of a flat shape's sampler against its density, by χ² over its own coordinates: sharp on the outline
    /// and at any distance. `inside` is the distance from the outline in the coordinates of `origin + a·u + b·v`.
    pub fn check(
        name: &str,
        shape: &Shape,
        p: Vec3,
        [origin, u, v]: [Vec3; 3],
        inside: impl Fn(Vec2) -> f32,
    ) {
        let bin = |uv: Vec2| {
            let [a, b] = uv.to_array().map(|x| ((x * BINS as f32) as usize).min(BINS - 1));
            a * BINS + b
        };
        let n = 1 << 16;
        let mut observed = vec![0.0; BINS * BINS];
        for i in 0..n {
            if let Some(s) = shape.sample(p, Vec2::new(uniform(i, 0), uniform(i, 1))) {
                assert!(s.point.abs_diff_eq(origin + s.uv.x * u + s.uv.y * v, 1e-5), "{name}: point and uv");
                let pdf = shape.pdf(p, s.point);
                assert!((pdf - s.pdf).abs() <= 1e-3 * s.pdf, "{name}: drawn with {}, pdf is {pdf}", s.pdf);
                observed[bin(s.uv)] += 1.0;
            }
        }
        let (side, cross) = (BINS * POINTS_PER_BIN, u.cross(v));
        let mut expected = vec![0.0; BINS * BINS];
        for i in 0..side * side {
            let uv = Vec2::new((i % side) as f32 + 0.5, (i / side) as f32 + 0.5) / side as f32;
            let coverage = (inside(uv) * side as f32 + 0.5).clamp(0.0, 1.0);
            let point = origin + uv.x * u + uv.y * v;
            let d = point - p;
            let solid_angle = d.dot(cross).abs() / d.length().powi(3) / (side * side) as f32;
            expected[bin(uv)] += (n as f32 * coverage * shape.pdf(p, point) * solid_angle) as f64;
        }
        let total = expected.iter().sum::<f64>() / n as f64;
        assert!((total - 1.0).abs() < 2e-3, "{name}: the density integrates to {total}");
        let p_value = chi2_p_value(&observed, &expected);
        assert!(p_value > 1e-4, "{name}: χ² test failed, p = {p_value:.2e}");
    }

    #[test]
    fn normals_point_out_of_the_front() {
        let sphere = Shape::Sphere(Sphere { center: Vec3::X, radius: 2.0 });
        assert_eq!(sphere.normal(Vec3::new(1.0, 2.0, 0.0)), Vec3::Y);
        let quad = Shape::Quad(Quad::new(Vec3::ZERO, Vec3::X, Vec3::Y, false));
        assert_eq!(quad.normal(Vec3::ZERO), Vec3::Z);
        for shape in [sphere, quad] {
            for i in 0..100 {
                let [a, b, _] = r3(i);
                let s = shape.sample(Vec3::new(0.3, 4.0, 5.0), Vec2::new(a, b)).expect("seen from outside");
                assert!(s.normal.is_normalized() && s.normal.dot(shape.normal(s.point)) > 0.9999);
            }
        }
    }
}
