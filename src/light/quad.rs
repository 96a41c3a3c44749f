//! A quad as a light: the points origin + a·u + b·v, a and b in [0, 1], or the inscribed ellipse.
//!
//! A rectangle is drawn uniformly over the solid angle under which it is seen: Ureña, Fajardo, King 2013, *An
//! Area-Preserving Parametrization for Spherical Rectangles*. Where that angle is too small for its arithmetic, and
//! for parallelograms and ellipses, the draw is uniform over the area.
//!
//! | parameter | unit | |
//! |---|---|---|
//! | `origin`, `u`, `v` | m | the front is the side of u × v |
//! | `round` | | only (a − ½)² + (b − ½)² ≤ ¼ |

use std::f32::consts::FRAC_PI_4;

use glam::{DVec3, Vec2, Vec3};

use super::shape::{ShapeSample, area_to_solid_angle};
use crate::sampling::warp::concentric_disk;

/// Below this solid angle, in sr, a rectangle is drawn by area: the angle is a difference of numbers near 2π, and
/// the two draws hardly differ.
const SMALLEST_SOLID_ANGLE: f64 = 1e-3;

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

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Outline {
    Rectangle,
    Parallelogram,
    Ellipse,
}

impl Quad {
    pub fn new(origin: Vec3, u: Vec3, v: Vec3, round: bool) -> Self {
        let cross = u.cross(v);
        let normal = cross.normalize_or_zero();
        let outline = if round {
            Outline::Ellipse
        } else if u.dot(v).abs() <= PERPENDICULAR * u.length() * v.length() {
            Outline::Rectangle
        } else {
            Outline::Parallelogram
        };
        let share = if round { FRAC_PI_4 } else { 1.0 };
        let area = if normal == Vec3::ZERO { 0.0 } else { share * cross.length() };
        Self { origin, u, v, outline, normal, area }
    }

    pub fn corners(&self) -> [Vec3; 4] {
        [self.origin, self.origin + self.u, self.origin + self.u + self.v, self.origin + self.v]
    }

    pub fn sample(&self, p: Vec3, u: Vec2) -> Option<ShapeSample> {
        if self.area <= 0.0 {
            return None;
        }
        if let Some(seen) = self.spherical(p) {
            let uv = seen.sample(u);
            let pdf = (1.0 / seen.solid_angle) as f32;
            return Some(ShapeSample { point: self.point(uv), normal: self.normal, uv, pdf });
        }
        let uv = match self.outline {
            Outline::Ellipse => 0.5 * (concentric_disk(u) + Vec2::ONE),
            Outline::Rectangle | Outline::Parallelogram => u,
        };
        let point = self.point(uv);
        let pdf = area_to_solid_angle(p, point, self.normal, self.area);
        (pdf > 0.0).then_some(ShapeSample { point, normal: self.normal, uv, pdf })
    }

    pub fn pdf(&self, p: Vec3, point: Vec3) -> f32 {
        match self.spherical(p) {
            Some(seen) => (1.0 / seen.solid_angle) as f32,
            None => area_to_solid_angle(p, point, self.normal, self.area),
        }
    }

    fn point(&self, uv: Vec2) -> Vec3 {
        self.origin + uv.x * self.u + uv.y * self.v
    }

    /// `None` where the draw is by area.
    fn spherical(&self, p: Vec3) -> Option<SphericalRectangle> {
        (self.outline == Outline::Rectangle)
            .then(|| SphericalRectangle::new(p, self.origin, self.u, self.v))
            .filter(|seen| seen.solid_angle >= SMALLEST_SOLID_ANGLE)
    }
}

/// A rectangle seen from a point, in a frame with its sides along x and y and the rectangle in the plane z = −|z|.
struct SphericalRectangle {
    x: [f64; 2],
    y: [f64; 2],
    z: f64,
    /// z components of the normals of the planes through the point and the sides y₀ and y₁.
    b: [f64; 2],
    /// 2π less the inner angles at the corners of side x₀.
    k: f64,
    solid_angle: f64,
}

impl SphericalRectangle {
    fn new(p: Vec3, origin: Vec3, u: Vec3, v: Vec3) -> Self {
        let [d, u, v]: [DVec3; 3] = [origin.as_dvec3() - p.as_dvec3(), u.as_dvec3(), v.as_dvec3()];
        let (width, height) = (u.length(), v.length());
        let (ex, ey) = (u / width, v / height);
        let (x, y, z) = (d.dot(ex), d.dot(ey), -d.dot(ex.cross(ey)).abs());
        let (x, y) = ([x, x + width], [y, y + height]);
        let n = [-y[0], x[1], y[1], -x[0]].map(|side| side / (side * side + z * z).sqrt());
        let angle = |i: usize, j: usize| (-n[i] * n[j]).clamp(-1.0, 1.0).acos();
        let k = std::f64::consts::TAU - angle(2, 3) - angle(3, 0);
        let solid_angle = angle(0, 1) + angle(1, 2) - k;
        Self { x, y, z, b: [n[0], n[2]], k, solid_angle }
    }

    /// (a, b) in the unit square.
    fn sample(&self, u: Vec2) -> Vec2 {
        let Self { x, y, z, b, .. } = *self;
        // x first: the part of the rectangle below it has the share u.x of the solid angle.
        let (sin, cos) = (u.x as f64 * self.solid_angle + self.k).sin_cos();
        let f = (cos * b[0] - b[1]) / sin;
        let c = (1.0 / (f * f + b[0] * b[0]).sqrt()).copysign(f).clamp(-1.0, 1.0);
        let xu = (-c * z / (1.0 - c * c).max(1e-30).sqrt()).clamp(x[0], x[1]);
        // Then y, along the arc at x: uniform in the sine of the elevation.
        let d = (xu * xu + z * z).sqrt();
        let h = y.map(|y| y / (y * y + d * d).sqrt());
        let h = h[0] + u.y as f64 * (h[1] - h[0]);
        let yv = (h * d / (1.0 - h * h).max(1e-30).sqrt()).clamp(y[0], y[1]);
        Vec2::new(((xu - x[0]) / (x[1] - x[0])) as f32, ((yv - y[0]) / (y[1] - y[0])) as f32)
    }
}

#[cfg(test)]
mod tests {
    use super::super::shape::{Shape, tests::check};
    use super::*;

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
        for (place, p) in POINTS {
            let c = Quad::new(ORIGIN, U, V, false).corners().map(|c| (c - p).as_dvec3());
            let expected = triangle(c[0], c[1], c[2]) + triangle(c[0], c[2], c[3]);
            let seen = SphericalRectangle::new(p, ORIGIN, U, V).solid_angle;
            assert!((seen - expected).abs() < 1e-6, "{place}: {seen}, not {expected}");
        }
    }

    #[test]
    fn the_two_draws_agree_where_they_change_over() {
        // A unit square straight above, at the distance where it fills the smallest solid angle.
        let quad = Quad::new(Vec3::new(-0.5, 0.0, -0.5), Vec3::X, Vec3::Z, false);
        let distance = (1.0 / SMALLEST_SOLID_ANGLE).sqrt() as f32;
        let [near, far] = [0.99, 1.01].map(|f| quad.pdf(Vec3::Y * distance * f, Vec3::ZERO) / (f * f));
        assert!((near / far - 1.0).abs() < 1e-3, "{near}, {far}");
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
