//! A disk or an ellipse as seen from a point: its points drawn nearly uniformly over the solid angle, by a closed form.
//!
//! What is seen is an elliptic cone, on the unit sphere a *spherical ellipse* (Guillén, Ureña, King, Fajardo, Georgiev, López-Moreno,
//! Jarabo 2017, *Area-Preserving Parameterizations for Spherical Ellipses*). With the semi-axes 1 and b along x and y and the
//! middle at c, the axis of the cone is the normal of the confocal ellipsoid through the point: (c_x / (1 + ν), c_y / (b² + ν), c_z / ν)
//! for the ν > 0 with
//!
//! ```text
//! c_x² / (1 + ν) + c_y² / (b² + ν) + c_z² / ν = 1
//! ```
//!
//! Across it μ₁ ≥ μ₂ are eigenvalues of diag(1, b², 0) − c cᵀ, and the half-angles are tan² α = μ₁ / ν, tan² β = μ₂ / ν.
//!
//! To be uniform exactly would take elliptic integrals, inverted by iteration. But in Lambert's azimuthal projection, which keeps
//! areas (√(1 − cos θ) from the middle), a spherical ellipse is almost a flat one, with the semi-axes A = √(1 − cos α) and
//! B = √(1 − cos β). So points of the unit disk are scaled to that ellipse, and then along every radius to the true
//! outline. By s, the squared length of the outline's radius over the ellipse's, the density is
//!
//! ```text
//! p(ω) = 1 / (2π A B s)
//! ```
//!
//! On both axes s = 1; between them it is (1 + m) / (1 + r) for the mean m and the root mean square r, in the same proportions, of
//! cos α and cos β: 0.83 at least, for a line from horizon to horizon, and 0.99 where the lamp is seen under 100°. To the
//! relative variance of light of the same radiance that adds 0.004 at most, and 1.4 · 10⁻⁵ below 100°.

use std::f32::consts::{PI, TAU};

use glam::{Vec2, Vec3};

use crate::{geometry::Frame, sampling::warp::concentric_disk};

/// Below this solid angle, in sr, the draw is by area: of a lamp that is far away that takes 50 ns less, and has a few per cent more variance at
/// most. One that is near is seen so small only from beside its plane, or if it is thin; there the area says little.
const SMALLEST_SOLID_ANGLE: [f32; 2] = [0.1, 0.01];

/// Squared distance, in semi-axes, from which the solid angle is known well enough before it is computed.
const FAR: f32 = 4.0;

/// Steps to ν at most. A disk takes one.
const STEPS: usize = 12;

/// Relative difference of perpendicular diameters that count as equal.
const ROUND: f32 = 1e-5;

/// A step of ν, relative, that needs no other after it: each squares the error.
const CLOSE: f32 = 1e-4;

/// An ellipse about the origin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Ellipse {
    /// Along the principal axes, one over the longer semi-axis in length.
    axes: [Vec3; 2],
    /// 1/m: one over the longer semi-axis.
    scale: f32,
    /// The shorter semi-axis over the longer.
    b: f32,
    /// cos and sin of the angle from the diameters that the ellipse was given by to the axes, on the unit disk that
    /// it is the image of.
    turn: Vec2,
}

impl Ellipse {
    /// `u` and `v` are conjugate diameters.
    pub fn new(u: Vec3, v: Vec3) -> Self {
        let angle = 0.5 * (2.0 * u.dot(v)).atan2(u.length_squared() - v.length_squared());
        let turn = Vec2::from_angle(angle);
        let [along_a, along_b] = [0.5 * (turn.x * u + turn.y * v), 0.5 * (turn.x * v - turn.y * u)];
        let (a2, ab) = (along_a.length_squared(), along_a.cross(along_b).length());
        let b = if (u.length() / v.length() - 1.0).abs() < ROUND && u.dot(v).abs() < ROUND * a2 {
            1.0
        } else {
            ab / a2
        };
        Self { axes: [along_a / a2, along_b / ab], scale: 1.0 / a2.sqrt(), b, turn }
    }

    /// In units of the longer semi-axis: a vector along the axes and the normal.
    fn local(&self, v: Vec3, normal: Vec3) -> Vec3 {
        Vec3::new(v.dot(self.axes[0]), v.dot(self.axes[1]), v.dot(normal).abs() * self.scale)
    }

    /// A point of the unit disk about the axes, as (a, b) in the unit square about the diameters.
    pub fn uv(&self, point: Vec2) -> Vec2 {
        0.5 * (Vec2::ONE + self.turn.rotate(point))
    }
}

/// An ellipse seen from a point. Lengths are in units of the longer semi-axis, vectors along the axes and the normal.
pub(super) struct SphericalEllipse {
    /// Of the ellipse, seen from the point.
    center: Vec3,
    /// The shorter semi-axis.
    b: f32,
    /// Of the cone: the wide one, the narrow one and the middle.
    frame: Frame,
    /// Squared tangents of the half-angles.
    tangents: Vec2,
    /// 1 − cos of the half-angles.
    heights: Vec2,
    /// About.
    solid_angle: f32,
}

impl SphericalEllipse {
    /// `to_center` leads from the point; `normal` is a unit vector. `None` where the draw is better by area.
    pub fn new(ellipse: &Ellipse, to_center: Vec3, normal: Vec3) -> Option<Self> {
        let b = ellipse.b;
        let center = ellipse.local(to_center, normal);
        let d2 = center.length_squared();
        // Of one that is far away π b c_z / d³ is the solid angle. (Not NaN either.)
        let faces = PI * b * center.z;
        if !(center.z > 0.0 && (d2 < FAR || faces * faces >= SMALLEST_SOLID_ANGLE[0].powi(2) * d2 * d2 * d2))
        {
            return None;
        }
        let b2 = b * b;
        let nu = confocal(center * center, b2);
        let middle = (center / (Vec3::new(1.0, b2, 0.0) + nu)).normalize();
        let (frame, wide) = if b == 1.0 {
            // The plane through the point and the axis of the disk is one of symmetry.
            let x = Vec2::new(-center.y, center.x).normalize_or(Vec2::X).extend(0.0);
            (Frame { x, y: middle.cross(x), z: middle }, 1.0)
        } else {
            axes(center, b2, middle)
        };
        // The smaller from the determinant: a difference would leave it no digits where it is small.
        let narrow = b2 * center.z * center.z / (nu * wide);
        let tangents = Vec2::new(wide, narrow) / nu;
        let heights = Vec2::new(height(tangents.x), height(tangents.y));
        let solid_angle = TAU * (heights.x * heights.y).sqrt();
        let smallest = SMALLEST_SOLID_ANGLE[usize::from(d2 < FAR)];
        (solid_angle >= smallest && solid_angle.is_finite()).then_some(Self {
            center,
            b,
            frame,
            tangents,
            heights,
            solid_angle,
        })
    }

    /// A point of the unit disk about the ellipse's axes, and its density over solid angle.
    pub fn sample(&self, u: Vec2) -> (Vec2, f32) {
        let flat = concentric_disk(u) * Vec2::new(self.heights.x.sqrt(), self.heights.y.sqrt());
        let stretch = self.stretch(flat * flat);
        let height = stretch * flat.length_squared();
        let across = flat * (stretch * (2.0 - height)).sqrt();
        let direction = self.frame.to_world(across.extend(1.0 - height));
        let reach = self.center.z / direction.z.max(1e-12);
        let point = direction.truncate() * reach - self.center.truncate();
        let on_disk = (point / Vec2::new(1.0, self.b)).clamp_length_max(1.0);
        (on_disk, 1.0 / (self.solid_angle * stretch))
    }

    /// The density over solid angle where the vector `to` from the point to the ellipse leads.
    pub fn pdf(&self, ellipse: &Ellipse, to: Vec3, normal: Vec3) -> f32 {
        let to = ellipse.local(to, normal);
        let across = Vec2::new(to.dot(self.frame.x), to.dot(self.frame.y));
        1.0 / (self.solid_angle * self.stretch(across * across))
    }

    /// s, where the squares of x and y are in this proportion.
    fn stretch(&self, squares: Vec2) -> f32 {
        let sum = squares.x + squares.y;
        if sum <= 0.0 {
            return 1.0;
        }
        let outline = height(sum / (squares / self.tangents).element_sum());
        outline * (squares / self.heights).element_sum() / sum
    }
}

/// 1 − cos, by the squared tangent.
fn height(tangent_squared: f32) -> f32 {
    let secant = (1.0 + tangent_squared).sqrt();
    tangent_squared / (secant * (1.0 + secant))
}

/// The axes of the cone about its middle, and μ₁.
fn axes(center: Vec3, b2: f32, middle: Vec3) -> (Frame, f32) {
    let Frame { x, y, z } = Frame::from_z(middle);
    let form = |v: Vec3, w: Vec3| v.x * w.x + b2 * v.y * w.y - center.dot(v) * center.dot(w);
    let (xx, xy, yy) = (form(x, x), form(x, y), form(y, y));
    let (mean, half) = (0.5 * (xx + yy), 0.5 * (xx - yy));
    let apart = (half * half + xy * xy).sqrt();
    // Half the angle of (half, xy), from whichever sum has all its digits.
    let turn = if half >= 0.0 {
        Vec2::new(apart + half, xy)
    } else {
        Vec2::new(xy.abs(), (apart - half).copysign(xy))
    };
    let turn = turn.try_normalize().unwrap_or(Vec2::X);
    (Frame { x: turn.x * x + turn.y * y, y: turn.x * y - turn.y * x, z }, mean + apart)
}

/// ν, by the squares of the center's coordinates and of the shorter semi-axis.
///
/// Of the two terms without a pole at 0 a single one is made, with the same value and slope at the ν at hand; what is then to be
/// solved is quadratic. For disks they are one.
fn confocal(squares: Vec3, b2: f32) -> f32 {
    let semi_axes = Vec2::new(1.0, b2);
    let steps = if b2 == 1.0 { 1 } else { STEPS };
    let mut nu = squares.element_sum();
    for _ in 0..steps {
        let terms = squares.truncate() / (semi_axes + nu);
        let slopes = terms / (semi_axes + nu);
        let slope = slopes.element_sum();
        let (pole, weight) = if slope > 0.0 {
            let sum = terms.element_sum();
            ((slopes * semi_axes).element_sum() / slope, sum * (sum / slope))
        } else {
            (1.0, 0.0)
        };
        let (minus_p, minus_q) = (squares.z + weight - pole, squares.z * pole);
        let root = (minus_p * minus_p + 4.0 * minus_q).sqrt();
        let next = if minus_p >= 0.0 { 0.5 * (minus_p + root) } else { 2.0 * minus_q / (root - minus_p) };
        let step = (next - nu).abs();
        nu = next;
        if step <= CLOSE * nu {
            break;
        }
    }
    nu
}

#[cfg(test)]
mod tests {
    use super::super::{
        Quad, Shape,
        shape::{ShapeSample, tests::check},
    };
    use super::*;
    use crate::sampling::stats::{chi2_p_value, r3, uniform};
    use glam::{DVec2, DVec3};

    /// Conjugate diameters in the plane z = 0.
    const ELLIPSES: [(&str, Vec3, Vec3); 5] = [
        ("disk", Vec3::new(2.0, 0.0, 0.0), Vec3::new(0.0, 2.0, 0.0)),
        ("ellipse", Vec3::new(0.7, 0.0, 0.0), Vec3::new(0.0, 2.0, 0.0)),
        ("turned", Vec3::new(0.6, 0.8, 0.0), Vec3::new(-1.6, 1.2, 0.0)),
        ("sheared", Vec3::new(1.6, 0.0, 0.0), Vec3::new(1.2, 1.0, 0.0)),
        ("thin", Vec3::new(2.0, 0.0, 0.0), Vec3::new(0.0, 0.1, 0.0)),
    ];

    /// About the origin.
    fn round(u: Vec3, v: Vec3) -> Quad {
        Quad::new(-0.5 * (u + v), u, v, true)
    }

    fn seen(u: Vec3, v: Vec3, p: Vec3) -> Option<SphericalEllipse> {
        SphericalEllipse::new(&Ellipse::new(u, v), -p, Vec3::Z)
    }

    /// By a polygon of as large an area, cut into triangles: Van Oosterom and Strackee 1983.
    fn solid_angle(u: Vec3, v: Vec3, p: Vec3) -> f64 {
        let corners = 4096;
        let step = std::f64::consts::TAU / f64::from(corners);
        let scale = (step / step.sin()).sqrt();
        let p = p.as_dvec3();
        let corner = |i: u32| {
            let DVec2 { x, y } = 0.5 * scale * DVec2::from_angle(step * f64::from(i));
            (x * u.as_dvec3() + y * v.as_dvec3() - p).normalize()
        };
        let middle = (-p).normalize();
        let triangle = |i: u32| {
            let (a, b) = (corner(i), corner(i + 1));
            let volume = DVec3::dot(middle, a.cross(b)).abs();
            2.0 * volume.atan2(1.0 + middle.dot(a) + a.dot(b) + b.dot(middle))
        };
        (0..corners).map(triangle).sum()
    }

    /// The middles of n × n cells.
    fn grid(n: u32) -> impl Iterator<Item = Vec2> {
        (0..n * n).map(move |i| (Vec2::new((i % n) as f32, (i / n) as f32) + 0.5) / n as f32)
    }

    #[test]
    fn draws_the_whole_solid_angle_nearly_uniformly() {
        let mut drawn_by_area = 0;
        for (name, u, v) in ELLIPSES {
            for i in 0..150 {
                let [x, y, z] = r3(i);
                let p = Vec3::new(4.0 * x - 2.0, 4.0 * y - 2.0, 10f32.powf(4.0 * z - 3.0));
                let expected = solid_angle(u, v, p);
                let Some(seen) = seen(u, v, p) else {
                    drawn_by_area += 1;
                    assert!(
                        expected < 1.4 * f64::from(SMALLEST_SOLID_ANGLE[0]),
                        "{name} from {p}: {expected} by area"
                    );
                    continue;
                };
                let inverse: Vec<f32> = grid(32).map(|u| 1.0 / seen.sample(u).1).collect();
                let mean = inverse.iter().map(|&x| f64::from(x)).sum::<f64>() / inverse.len() as f64;
                assert!((mean / expected - 1.0).abs() < 2e-3, "{name} from {p}: {mean}, not {expected}");
                let [least, most] =
                    [f32::min, f32::max].map(|f| inverse.iter().copied().reduce(f).expect("some"));
                let bound = if seen.tangents.x < 1.4 { 1.011 } else { 1.208 };
                assert!(most <= bound * least, "{name} from {p}: {least} to {most}");
            }
        }
        assert!((50..600).contains(&drawn_by_area), "{drawn_by_area}");
    }

    #[test]
    fn on_the_axis_of_a_disk_it_is_uniform() {
        let (_, u, v) = ELLIPSES[0];
        for height in [1e-3, 0.1, 1.0, 5.0] {
            let seen = seen(u, v, height * Vec3::Z).expect("near");
            // 1 − h / √(1 + h²)
            let secant = (1.0 + 1.0 / (height * height)).sqrt();
            let expected = TAU * (1.0 - 1.0 / secant);
            for u in grid(8) {
                let pdf = seen.sample(u).1;
                assert!((pdf * expected - 1.0).abs() < 1e-5, "{height}: {pdf}, not {}", 1.0 / expected);
            }
        }
    }

    #[test]
    fn points_follow_the_density() {
        let points = [
            ("in front", Vec3::new(0.3, -0.2, 0.9)),
            ("behind, aside", Vec3::new(-0.8, 1.7, -0.6)),
            ("grazing", Vec3::new(-0.3, 1.4, 0.15)),
            ("farther", Vec3::new(2.0, 1.0, 4.0)),
        ];
        for (name, u, v) in ELLIPSES {
            for (place, p) in points {
                check(
                    &format!("{name}, {place}"),
                    &Shape::Quad(round(u, v)),
                    p,
                    [-0.5 * (u + v), u, v],
                    |uv| 0.5 - uv.distance(Vec2::splat(0.5)),
                );
            }
        }
    }

    /// By χ² over cells between rings and spokes, which have the outline for an edge.
    #[test]
    fn close_to_the_plane_points_follow_the_density() {
        const RINGS: usize = 16;
        const SPOKES: usize = 32;
        const FINE: usize = 16;
        let n = 1 << 17;
        for (name, u, v) in &ELLIPSES[..4] {
            let quad = round(*u, *v);
            for (along, height) in [(0.4, 0.02), (1.0, 0.05), (1.1, 0.05)] {
                let p = 0.5 * along * *v - Vec3::Z * height;
                let mut observed = vec![0.0; RINGS * SPOKES];
                for i in 0..n {
                    let s = quad.sample(p, Vec2::new(uniform(i, 0), uniform(i, 1))).expect("near");
                    let at = 2.0 * s.uv - 1.0;
                    let turn = at.to_angle().rem_euclid(TAU) / TAU;
                    let [ring, spoke] = [(at.length(), RINGS), (turn, SPOKES)]
                        .map(|(x, cells)| ((x * cells as f32) as usize).min(cells - 1));
                    observed[ring * SPOKES + spoke] += 1.0;
                }
                let mut expected = vec![0.0; RINGS * SPOKES];
                let step = Vec2::new(1.0 / (RINGS * FINE) as f32, TAU / (SPOKES * FINE) as f32);
                for (i, j) in (0..RINGS * FINE).flat_map(|i| (0..SPOKES * FINE).map(move |j| (i, j))) {
                    let Vec2 { x: r, y: angle } = (Vec2::new(i as f32, j as f32) + 0.5) * step;
                    let at = 0.5 * r * Vec2::from_angle(angle);
                    let point = at.x * *u + at.y * *v;
                    let area = 0.25 * u.cross(*v).length() * r * step.element_product();
                    let solid_angle = area * height / point.distance(p).powi(3);
                    expected[i / FINE * SPOKES + j / FINE] +=
                        f64::from(quad.pdf(p, point) * solid_angle) * f64::from(n);
                }
                let place = format!("{name}, {along} semi-axes along, {height} below");
                let total = expected.iter().sum::<f64>() / f64::from(n);
                assert!((total - 1.0).abs() < 1e-3, "{place}: the density integrates to {total}");
                let p_value = chi2_p_value(&observed, &expected);
                assert!(p_value > 1e-4, "{place}: χ² test failed, p = {p_value:.2e}");
            }
        }
    }

    #[test]
    fn extreme_places_and_sizes() {
        for (scale, i) in [1e-5, 1e-3, 1.0, 1e2, 1e4].into_iter().flat_map(|s| (0..5).map(move |i| (s, i))) {
            let mut drawn = 0;
            let (name, u, v) = ELLIPSES[i];
            let quad = round(scale * u, scale * v);
            let along = [Vec3::ZERO, 0.25 * u, 0.4999 * v, 0.5 * v, 0.5001 * v, 0.6 * u, 2.0 * v, 1e4 * u];
            let heights = [0.0, 1e-20, 1e-10, 1e-6, 1e-4, -1e-3, 1e-2, 1.0, 1e3, 1e8];
            for p in along.into_iter().flat_map(|at| heights.map(|height| scale * (at + height * Vec3::Z))) {
                for u in grid(8).chain([Vec2::ZERO, Vec2::splat(0.5), Vec2::splat(1.0 - 6e-8)]) {
                    let Some(ShapeSample { point, pdf, uv, .. }) = quad.sample(p, u) else { continue };
                    let place = format!("{scale} × {name} from {p} by {u}");
                    assert!(pdf > 0.0 && pdf.is_finite(), "{place}: {pdf}");
                    assert!(point.is_finite() && uv.distance(Vec2::splat(0.5)) < 0.500_01, "{place}: {uv}");
                    // Nearer, rounding moves the point as seen from there; and in the middle the density has no
                    // limit, but one along each radius.
                    if p.z.abs() >= 1e-4 * scale && u != Vec2::splat(0.5) {
                        let asked = quad.pdf(p, point);
                        assert!((asked / pdf - 1.0).abs() < 0.02, "{place}: drawn with {pdf}, told {asked}");
                        drawn += 1;
                    }
                }
            }
            assert!(drawn > 400, "{scale}: {drawn}");
        }
        for (u, v) in
            [(Vec3::ZERO, Vec3::Y), (Vec3::X, Vec3::X), (Vec3::NAN, Vec3::Y), (Vec3::INFINITY, Vec3::Y)]
        {
            assert!(round(u, v).sample(Vec3::ONE, Vec2::splat(0.3)).is_none());
        }
    }
}
