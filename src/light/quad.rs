//! A quad as a light: the points origin + a·u + b·v, a and b in [0, 1], or the inscribed ellipse.
//!
//! A rectangle is drawn uniformly over the solid angle under which it is seen: Ureña, Fajardo, King 2013, *An
//! Area-Preserving Parametrization for Spherical Rectangles*; an ellipse [nearly so](super::ellipse). Where that angle is too
//! small for its arithmetic, and for parallelograms, the draw is uniform over the area.
//!
//! | parameter | unit | |
//! |---|---|---|
//! | `origin`, `u`, `v` | m | the front is the side of u × v |
//! | `round` | | only (a − ½)² + (b − ½)² ≤ ¼ |

use std::f32::consts::{FRAC_PI_4, TAU};

use glam::{Vec2, Vec3};

use super::{
    ellipse::{Ellipse, SphericalEllipse},
    shape::{ShapeSample, area_to_solid_angle},
};
use crate::sampling::warp::concentric_disk;

/// Below this solid angle, in sr, a rectangle is drawn by area: the angle comes out of sums of numbers of the size of 1,
/// and the two draws hardly differ.
const SMALLEST_SOLID_ANGLE: f32 = 0.02;

/// Squared height over a rectangle, per area: the solid angle is near 2π from there, not near 0.
const TOUCHING: f32 = 1e-4;

/// |cos| of the angle between sides that count as perpendicular.
const PERPENDICULAR: f32 = 1e-5;

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Quad {
    origin: Vec3,
    u: Vec3,
    v: Vec3,
    outline: Outline,
    pub(super) normal: Vec3,
    pub(super) area: f32,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Outline {
    Rectangle(Sides),
    Ellipse(Ellipse),
    Parallelogram,
}

impl Quad {
    pub fn new(origin: Vec3, u: Vec3, v: Vec3, round: bool) -> Self {
        let cross = u.cross(v);
        let normal = cross.normalize_or_zero();
        let perpendicular = u.dot(v).abs() <= PERPENDICULAR * u.length() * v.length();
        let share = if round { FRAC_PI_4 } else { 1.0 };
        let area = if normal == Vec3::ZERO { 0.0 } else { share * cross.length() };
        let outline = if round {
            Outline::Ellipse(Ellipse::new(u, v))
        } else if perpendicular && area > 0.0 {
            Outline::Rectangle(Sides::new(u, v))
        } else {
            Outline::Parallelogram
        };
        Self { origin, u, v, outline, normal, area }
    }

    pub fn corners(&self) -> [Vec3; 4] {
        [self.origin, self.origin + self.u, self.origin + self.u + self.v, self.origin + self.v]
    }

    pub fn sample(&self, p: Vec3, u: Vec2) -> Option<ShapeSample> {
        if self.area <= 0.0 {
            return None;
        }
        let by_solid_angle = match &self.outline {
            Outline::Rectangle(sides) => {
                self.rectangle(p, sides).map(|seen| (seen.sample(u), 1.0 / seen.solid_angle))
            }
            Outline::Ellipse(ellipse) => self.ellipse(p, ellipse).map(|seen| {
                let (on_disk, pdf) = seen.sample(u);
                (ellipse.uv(on_disk), pdf)
            }),
            Outline::Parallelogram => None,
        };
        if let Some((uv, pdf)) = by_solid_angle {
            return Some(ShapeSample { point: self.point(uv), normal: self.normal, uv, pdf });
        }
        let (point, uv) = self.sample_area(u);
        let pdf = area_to_solid_angle(p, point, self.normal, self.area);
        (pdf > 0.0).then_some(ShapeSample { point, normal: self.normal, uv, pdf })
    }

    /// A uniform point, and its (a, b).
    pub fn sample_area(&self, u: Vec2) -> (Vec3, Vec2) {
        let uv = match self.outline {
            Outline::Ellipse(_) => 0.5 * (concentric_disk(u) + Vec2::ONE),
            _ => u,
        };
        (self.point(uv), uv)
    }

    pub fn pdf(&self, p: Vec3, point: Vec3) -> f32 {
        let by_solid_angle = match &self.outline {
            Outline::Rectangle(sides) => self.rectangle(p, sides).map(|seen| 1.0 / seen.solid_angle),
            Outline::Ellipse(ellipse) => {
                self.ellipse(p, ellipse).map(|seen| seen.pdf(ellipse, point - p, self.normal))
            }
            Outline::Parallelogram => None,
        };
        by_solid_angle.unwrap_or_else(|| area_to_solid_angle(p, point, self.normal, self.area))
    }

    fn point(&self, uv: Vec2) -> Vec3 {
        self.origin + uv.x * self.u + uv.y * self.v
    }

    /// `None` where the draw is by area.
    fn rectangle(&self, p: Vec3, sides: &Sides) -> Option<SphericalRectangle> {
        Some(SphericalRectangle::new(p - self.origin, sides))
            .filter(|seen| seen.solid_angle >= SMALLEST_SOLID_ANGLE)
    }

    /// `None` where the draw is by area.
    fn ellipse(&self, p: Vec3, ellipse: &Ellipse) -> Option<SphericalEllipse> {
        SphericalEllipse::new(ellipse, self.point(Vec2::splat(0.5)) - p, self.normal)
    }
}

/// The sides of a rectangle as unit vectors and lengths.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Sides {
    x: Vec3,
    y: Vec3,
    width: f32,
    height: f32,
}

impl Sides {
    fn new(u: Vec3, v: Vec3) -> Self {
        let (width, height) = (u.length(), v.length());
        Self { x: u / width, y: v / height, width, height }
    }
}

/// A rectangle seen from a point, in a frame with its sides along x and y and the rectangle in the plane z = −|z|.
///
/// The solid angle is the sum of the four inner angles less 2π. Angles are added as unit complex numbers are
/// multiplied, cos + i sin of each being at hand, so that a single arc tangent is left; modulo 2π the sum is the solid
/// angle itself.
struct SphericalRectangle {
    x: [f32; 2],
    y: [f32; 2],
    z: f32,
    /// z components of the normals of the planes through the point and the sides y₀ and y₁.
    b: [f32; 2],
    /// cos and sin of k: 2π less the inner angles at the corners of side x₀.
    k: Vec2,
    solid_angle: f32,
}

impl SphericalRectangle {
    /// `from` is the point's place relative to the rectangle's origin.
    fn new(from: Vec3, sides: &Sides) -> Self {
        let (x, y) = (-from.dot(sides.x), -from.dot(sides.y));
        let z = -from.dot(sides.x.cross(sides.y)).abs();
        let (x, y) = ([x, x + sides.width], [y, y + sides.height]);
        // Of the planes through the point and each side, z of the normal, and 1 less its square.
        let normal = |side: f32| {
            let scale = 1.0 / (side * side + z * z).sqrt();
            (side * scale, (z * scale).powi(2))
        };
        let n = [normal(-y[0]), normal(x[1]), normal(y[1]), normal(-x[0])];
        let angle = |i: usize, j: usize| {
            let ((a, a_rest), (b, b_rest)) = (n[i], n[j]);
            Vec2::new(-a * b, (a_rest + a * a * b_rest).sqrt()) // 1 − a²b² without cancellation
        };
        let left = angle(2, 3).rotate(angle(3, 0));
        let sum = left.rotate(angle(0, 1)).rotate(angle(1, 2));
        // Next to 0 and 2π rounding can go round the circle; only a point in front of the rectangle sees more than π.
        let in_front = x[0] < 0.0 && x[1] > 0.0 && y[0] < 0.0 && y[1] > 0.0;
        let near = in_front && z * z < TOUCHING * sides.width * sides.height;
        let solid_angle = match sum.y.atan2(sum.x) {
            angle if angle < 0.0 && (near || in_front && angle < -SMALLEST_SOLID_ANGLE) => angle + TAU,
            angle if angle < SMALLEST_SOLID_ANGLE && near => TAU,
            angle => angle.max(0.0),
        };
        Self { x, y, z, b: [n[0].0, n[2].0], k: Vec2::new(left.x, -left.y), solid_angle }
    }

    /// (a, b) in the unit square.
    fn sample(&self, u: Vec2) -> Vec2 {
        let Self { x, y, z, b, .. } = *self;
        // x first: the part of the rectangle below it has the share u.x of the solid angle.
        let (sin, cos) = (u.x * self.solid_angle).sin_cos();
        let Vec2 { x: cos, y: sin } = self.k.rotate(Vec2::new(cos, sin));
        let f = (cos * b[0] - b[1]) / sin;
        let c = (1.0 / (f * f + b[0] * b[0]).sqrt()).copysign(f).clamp(-1.0, 1.0);
        let xu = (-c * z / ((1.0 - c) * (1.0 + c)).max(1e-20).sqrt()).clamp(x[0], x[1]);
        // Then y, along the arc at x: uniform in the sine of the elevation.
        let d2 = xu * xu + z * z;
        let elevation = |y: f32| y / (y * y + d2).sqrt();
        let (low, high) = (elevation(y[0]), elevation(y[1]));
        let h = low + u.y * (high - low);
        let yv = (h * d2.sqrt() / ((1.0 - h) * (1.0 + h)).max(1e-20).sqrt()).clamp(y[0], y[1]);
        Vec2::new((xu - x[0]) / (x[1] - x[0]), (yv - y[0]) / (y[1] - y[0]))
    }
}

#[cfg(test)]
mod tests {
    use super::super::shape::{Shape, tests::check};
    use super::*;
    use crate::sampling::stats::r3;
    use glam::DVec3;

    const ORIGIN: Vec3 = Vec3::new(-1.0, 2.0, -0.5);
    const U: Vec3 = Vec3::new(2.0, 0.0, 0.0);
    const V: Vec3 = Vec3::new(0.0, 0.3, 1.0);
    const POINTS: [(&str, Vec3); 5] = [
        ("below", Vec3::new(0.2, 0.0, 0.1)),
        ("above", Vec3::new(-0.4, 3.0, 0.4)),
        ("near", Vec3::new(0.3, 2.1, 0.2)),
        ("grazing", Vec3::new(2.5, 2.05, 0.3)),
        ("far", Vec3::new(20.0, -40.0, 15.0)),
    ];

    fn check_quad(name: &str, v: Vec3, round: bool) {
        let quad = Quad::new(ORIGIN, U, v, round);
        for (place, p) in POINTS {
            check(&format!("{name} {place}"), &Shape::Quad(quad), p, [ORIGIN, U, v], |uv| {
                if round { 0.5 - uv.distance(Vec2::splat(0.5)) } else { 1.0 }
            });
        }
    }

    #[test]
    fn rectangle_follows_its_density() {
        check_quad("rectangle", V, false);
    }

    #[test]
    fn parallelogram_follows_its_density() {
        check_quad("parallelogram", V + 0.4 * U, false);
    }

    #[test]
    fn ellipse_follows_its_density() {
        check_quad("ellipse", V, true);
    }

    #[test]
    fn solid_angle_matches_two_triangles() {
        // Van Oosterom and Strackee 1983: tan(Ω/2) of a triangle seen from the origin.
        let triangle = |a: DVec3, b: DVec3, c: DVec3| {
            let (a, b, c) = (a.normalize(), b.normalize(), c.normalize());
            2.0 * a.dot(b.cross(c)).abs().atan2(1.0 + a.dot(b) + b.dot(c) + c.dot(a))
        };
        let around = (0..2000).map(|i| {
            let [a, b, c] = r3(i);
            let height = 4.0 * (c - 0.5).powi(3);
            ("around", ORIGIN + (3.0 * a - 1.0) * U + (3.0 * b - 1.0) * V + height * U.cross(V))
        });
        for (place, p) in POINTS.into_iter().chain(around) {
            let c = Quad::new(ORIGIN, U, V, false).corners().map(|c| (c - p).as_dvec3());
            let expected = triangle(c[0], c[1], c[2]) + triangle(c[0], c[2], c[3]);
            let seen = SphericalRectangle::new(p - ORIGIN, &Sides::new(U, V)).solid_angle;
            assert!((f64::from(seen) - expected).abs() < 2e-5, "{place}, {p}: {seen}, not {expected}");
        }
    }

    #[test]
    fn the_two_draws_agree_where_they_change_over() {
        // A unit square straight above, at the distance where it fills the smallest solid angle.
        let quad = Quad::new(Vec3::new(-0.5, 0.0, -0.5), Vec3::X, Vec3::Z, false);
        let distance = (1.0 / SMALLEST_SOLID_ANGLE).sqrt();
        let [near, far] = [0.99, 1.01].map(|f| quad.pdf(Vec3::Y * distance * f, Vec3::ZERO) / (f * f));
        assert!((near / far - 1.0).abs() < 1e-2, "{near}, {far}");
    }

    #[test]
    fn in_its_plane_or_degenerate_it_gives_nothing() {
        for round in [false, true] {
            let quad = Quad::new(Vec3::ZERO, Vec3::X, Vec3::Z, round);
            assert!(quad.sample(Vec3::new(5.0, 0.0, 0.5), Vec2::splat(0.4)).is_none());
            let flat = Quad::new(Vec3::ZERO, Vec3::X, 2.0 * Vec3::X, round);
            assert!(flat.sample(Vec3::Y, Vec2::splat(0.4)).is_none());
        }
    }
}
