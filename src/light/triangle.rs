//! A triangle as a light: uniform over its area.
//!
//! | parameter | unit | |
//! |---|---|---|
//! | `p0`, `p1`, `p2` | m, world space | the front is the side of (p1 − p0) × (p2 − p0) … |
//! | `mirrored` | | … and the other one where the instance's transform mirrors |

use glam::{Vec2, Vec3};

use super::shape::{ShapeSample, area_to_solid_angle};
use crate::sampling::warp::uniform_triangle;

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Triangle {
    p0: Vec3,
    edge1: Vec3,
    edge2: Vec3,
    pub(super) normal: Vec3,
    pub(super) area: f32,
}

impl Triangle {
    pub fn new([p0, p1, p2]: [Vec3; 3], mirrored: bool) -> Self {
        let (edge1, edge2) = (p1 - p0, p2 - p0);
        let cross = edge1.cross(edge2);
        let normal = cross.normalize_or_zero();
        let area = if normal == Vec3::ZERO { 0.0 } else { 0.5 * cross.length() };
        Self { p0, edge1, edge2, normal: if mirrored { -normal } else { normal }, area }
    }

    pub fn points(&self) -> [Vec3; 3] {
        [self.p0, self.p0 + self.edge1, self.p0 + self.edge2]
    }

    pub fn sample(&self, p: Vec3, u: Vec2) -> Option<ShapeSample> {
        let (point, uv) = self.sample_area(u);
        let pdf = self.pdf(p, point);
        (pdf > 0.0).then_some(ShapeSample { point, normal: self.normal, uv, pdf })
    }

    /// A uniform point, and its barycentrics (b1, b2).
    pub fn sample_area(&self, u: Vec2) -> (Vec3, Vec2) {
        let uv = uniform_triangle(u);
        (self.p0 + uv.x * self.edge1 + uv.y * self.edge2, uv)
    }

    pub fn pdf(&self, p: Vec3, point: Vec3) -> f32 {
        area_to_solid_angle(p, point, self.normal, self.area)
    }
}

#[cfg(test)]
mod tests {
    use super::super::shape::{Shape, tests::check};
    use super::*;

    const POINTS: [Vec3; 3] = [Vec3::new(0.0, 1.0, 0.0), Vec3::new(2.0, 1.0, 0.0), Vec3::new(0.0, 1.5, -1.0)];

    #[test]
    fn samples_follow_the_density() {
        let triangle = Triangle::new(POINTS, false);
        for (name, p) in [
            ("below", Vec3::ZERO),
            ("near", Vec3::new(0.3, 1.0, -0.2)),
            ("grazing", Vec3::new(-1.0, 0.8, 0.3)),
            ("far", Vec3::new(-3.0, -4.0, 3.0)),
        ] {
            let frame = [triangle.p0, triangle.edge1, triangle.edge2];
            check(name, &Shape::Triangle(triangle), p, frame, |uv| 1.0 - uv.x - uv.y);
        }
    }

    #[test]
    fn front_is_counter_clockwise_unless_mirrored() {
        let [a, b, c] = [Vec3::ZERO, Vec3::X, Vec3::Y];
        assert_eq!(Triangle::new([a, b, c], false).normal, Vec3::Z);
        assert_eq!(Triangle::new([a, b, c], true).normal, -Vec3::Z);
    }

    #[test]
    fn degenerate_or_in_the_plane_gives_nothing() {
        let flat = Triangle::new([Vec3::ZERO, Vec3::X, 2.0 * Vec3::X], false);
        assert_eq!(flat.area, 0.0);
        assert!(flat.sample(Vec3::Y, Vec2::splat(0.4)).is_none());
        let triangle = Triangle::new([Vec3::ZERO, Vec3::X, Vec3::Y], false);
        assert!(triangle.sample(Vec3::new(5.0, 5.0, 0.0), Vec2::splat(0.4)).is_none());
    }
}
