//! A set of local lights as one: where they are, which way they shine, how strongly.
//!
//! The lights lie in a box, their normals within an angle `spread` of `axis`, and each sends light up to an angle
//! `emission` off its normal. From a point p, with the box's bounding ball of center c and radius r, the irradiance
//! that they could give is about
//!
//! ```text
//! I cos θ' / max(|p − c|², r²/4),   θ' = max(0, θ − spread − b), 0 where θ' > emission
//! ```
//!
//! where θ is the angle between the axis and the direction to p, b the angle under which p sees the ball, and I the
//! sum of the lights' peak intensities. θ' is at most the true angle for any of the lights, so no light that reaches
//! p has an importance of 0. A quarter of r², because inside a cluster most light comes from what is near: with r²
//! itself the variance among 300 lamps is three times as large. The cosine at the receiver would take another
//! quarter off it; it is left out, so that no density depends on the receiver's normal.
//!
//! Source: Conty Estevez, Kulla 2018, *Importance Sampling of Many Lights with Adaptive Tree Splitting*, section 4; the
//! form is that of Pharr, Jakob, Humphreys, *Physically Based Rendering*, 4th ed., section 12.6.3, with peak
//! intensity for power, so that lamps of different kinds compare.

use std::f32::consts::{FRAC_PI_2, PI, TAU};

use glam::Vec3;

use super::receiver::Receiver;

/// W/sr; brighter lamps count as this bright, so that sums and quotients stay finite.
const GREATEST_INTENSITY: f32 = 1e20;

/// m²; lamps without extent are never nearer.
const LEAST_DISTANCE_SQUARED: f32 = 1e-12;

/// Radians added to `emission`, so that rounding cannot make an importance 0 at the edge of a beam.
const EDGE: f32 = 1e-3;

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cluster {
    pub min: Vec3,
    pub max: Vec3,
    /// Unit.
    pub axis: Vec3,
    /// Radians, 0 to π.
    pub spread: f32,
    /// Radians, 0 to π/2.
    pub emission: f32,
    /// Light leaves towards −axis as well.
    pub two_sided: bool,
    /// Sum of peak intensities, W/sr.
    pub intensity: f32,
}

impl Cluster {
    /// Something that shines the same way everywhere, of luminous power `power`.
    pub fn round(bounds: [Vec3; 2], power: f32) -> Self {
        Self {
            min: bounds[0],
            max: bounds[1],
            axis: Vec3::Y,
            spread: PI,
            emission: FRAC_PI_2,
            two_sided: false,
            intensity: bounded(power / (4.0 * PI)),
        }
    }

    /// A flat Lambertian emitter of luminous power `power`, both sides together.
    pub fn flat(bounds: [Vec3; 2], normal: Vec3, power: f32, two_sided: bool) -> Self {
        let intensity = bounded(power / if two_sided { TAU } else { PI });
        Self { axis: normal, spread: 0.0, two_sided, intensity, ..Self::round(bounds, 0.0) }
    }

    /// A beam between two half-angles.
    pub fn beam(position: Vec3, axis: Vec3, inner: f32, outer: f32, intensity: f32) -> Self {
        let whole = Self::round([position; 2], 0.0);
        let intensity = bounded(intensity);
        let emission = (outer - inner).max(0.0) + EDGE;
        if emission >= FRAC_PI_2 {
            Self { intensity, ..whole }
        } else {
            Self { axis, spread: inner.clamp(0.0, PI), emission, intensity, ..whole }
        }
    }

    /// Whether it shines and is somewhere.
    pub fn is_usable(&self) -> bool {
        let Self { min, max, axis, intensity, .. } = self;
        *intensity > 0.0 && min.is_finite() && max.is_finite() && axis.is_finite()
    }

    pub fn union(&self, other: &Self) -> Self {
        let (axis, spread) = cone_union((self.axis, self.spread), (other.axis, other.spread));
        Self {
            min: self.min.min(other.min),
            max: self.max.max(other.max),
            axis,
            spread,
            emission: self.emission.max(other.emission),
            two_sided: self.two_sided || other.two_sided,
            intensity: self.intensity + other.intensity,
        }
    }

    pub fn center(&self) -> Vec3 {
        0.5 * self.min + 0.5 * self.max
    }

    /// How much it costs to have these lights in one cluster: intensity × squared extent × solid angle into which
    /// they shine (Conty Estevez and Kulla, equation 1; the extent for the area, which is 0 for lamps in a row).
    pub fn cost(&self) -> f32 {
        let (o, w) = (self.spread, (self.spread + self.emission).min(PI));
        let solid_angle = TAU * (1.0 - o.cos())
            + FRAC_PI_2 * (2.0 * w * o.sin() - (o - 2.0 * w).cos() - 2.0 * o * o.sin() + o.cos());
        self.intensity * self.min.distance_squared(self.max) * solid_angle
    }
}

fn bounded(intensity: f32) -> f32 {
    if intensity.is_finite() { intensity.min(GREATEST_INTENSITY) } else { 0.0 }
}

/// The smallest cone that holds two (axis and half-angle).
fn cone_union(a: (Vec3, f32), b: (Vec3, f32)) -> (Vec3, f32) {
    let (a, b) = if a.1 >= b.1 { (a, b) } else { (b, a) };
    let between = 2.0 * (a.0 - b.0).length().atan2((a.0 + b.0).length());
    if (between + b.1).min(PI) <= a.1 {
        return a;
    }
    let spread = 0.5 * (a.1 + between + b.1);
    if spread >= PI {
        return (a.0, PI);
    }
    // Turn a's axis towards b's, in the plane of both; where they are opposite any plane does.
    let towards = (b.0 - a.0.dot(b.0) * a.0).try_normalize();
    let side = towards.unwrap_or_else(|| a.0.any_orthonormal_vector());
    let (sin, cos) = (spread - a.1).sin_cos();
    (cos * a.0 + sin * side, (spread + EDGE).min(PI))
}

/// Clusters that are weighed at once.
pub const WIDTH: usize = 8;

/// Eight clusters in the form in which importance is computed. Plain arrays, every step for all: the compiler makes vectors of them.
#[derive(Clone, Debug)]
#[repr(align(64))]
pub struct Weighers {
    center: [[f32; WIDTH]; 3],
    radius_squared: [f32; WIDTH],
    /// 0 where there is no cluster.
    intensity: [f32; WIDTH],
    axis: [[f32; WIDTH]; 3],
    sin_spread: [f32; WIDTH],
    cos_spread: [f32; WIDTH],
    cos_emission: [f32; WIDTH],
    two_sided: [bool; WIDTH],
    /// Whether any cluster shines more strongly one way than another.
    oriented: bool,
}

impl Weighers {
    /// At most eight.
    pub fn new<'a>(clusters: impl IntoIterator<Item = &'a Cluster>) -> Self {
        let zero = [0.0; WIDTH];
        let mut all = Self {
            center: [zero; 3],
            radius_squared: zero,
            intensity: zero,
            axis: [zero; 3],
            sin_spread: zero,
            cos_spread: zero,
            cos_emission: zero,
            two_sided: [false; WIDTH],
            oriented: false,
        };
        for (i, cluster) in clusters.into_iter().enumerate().take(WIDTH) {
            let center = cluster.center();
            for axis in 0..3 {
                all.center[axis][i] = center[axis];
                all.axis[axis][i] = cluster.axis[axis];
            }
            all.radius_squared[i] = 0.25 * cluster.min.distance_squared(cluster.max);
            all.intensity[i] = cluster.intensity;
            let (sin_spread, cos_spread) = cluster.spread.sin_cos();
            all.sin_spread[i] = sin_spread.max(0.0);
            all.cos_spread[i] = cos_spread;
            all.cos_emission[i] = cluster.emission.cos().max(0.0);
            all.two_sided[i] = cluster.two_sided;
            all.oriented |= cluster.spread < PI;
        }
        all
    }

    /// The irradiance that the lights of each cluster could give at `p`, roughly, W/m²; 0 only where none of them
    /// reaches it.
    #[inline]
    pub fn importance(&self, p: Vec3) -> [f32; WIDTH] {
        self.importance_for(p, None).0
    }

    /// The importance, and the same times what the receiver scatters of it.
    #[inline]
    pub fn importance_for(&self, p: Vec3, receiver: Option<&Receiver>) -> ([f32; WIDTH], [f32; WIDTH]) {
        let mut from = [[0.0; WIDTH]; 3];
        let (mut distance_squared, mut strength) = ([0.0; WIDTH], [0.0; WIDTH]);
        for i in 0..WIDTH {
            for axis in 0..3 {
                from[axis][i] = p[axis] - self.center[axis][i];
            }
            let d2 = from[0][i] * from[0][i] + from[1][i] * from[1][i] + from[2][i] * from[2][i];
            let inside = 0.25 * self.radius_squared[i];
            let bound = if d2 > inside { d2 } else { inside };
            let bound = if bound > LEAST_DISTANCE_SQUARED { bound } else { LEAST_DISTANCE_SQUARED };
            distance_squared[i] = d2;
            strength[i] = self.intensity[i] / bound;
        }
        let mut importance = strength;
        if self.oriented {
            self.turn_away(&from, &distance_squared, &mut importance);
        }
        let weights = match receiver {
            Some(receiver) => receiver.weigh(&importance, &from, &self.radius_squared, &distance_squared),
            None => importance,
        };
        (importance, weights)
    }

    /// Multiplies by the cosine at the lights.
    #[inline]
    fn turn_away(
        &self,
        from: &[[f32; WIDTH]; 3],
        distance_squared: &[f32; WIDTH],
        importance: &mut [f32; WIDTH],
    ) {
        for i in 0..WIDTH {
            let (d2, r2) = (distance_squared[i], self.radius_squared[i]);
            let along =
                from[0][i] * self.axis[0][i] + from[1][i] * self.axis[1][i] + from[2][i] * self.axis[2][i];
            let cos = along / d2.sqrt();
            let cos = if self.two_sided[i] { cos.abs() } else { cos };
            let rest = 1.0 - cos * cos;
            let sin = if rest > 0.0 { rest } else { 0.0 }.sqrt();
            // Subtract angles through their sines and cosines, never below 0.
            let beyond_cos = cos * self.cos_spread[i] + sin * self.sin_spread[i];
            let beyond_sin = sin * self.cos_spread[i] - cos * self.sin_spread[i];
            let ball_sin_squared = if r2 < d2 { r2 / d2 } else { 1.0 };
            let ball_cos = (1.0 - ball_sin_squared).sqrt();
            let least = beyond_cos * ball_cos + beyond_sin * ball_sin_squared.sqrt();
            let whole = (d2 <= r2) | (cos >= self.cos_spread[i]) | (beyond_cos >= ball_cos);
            let share = if least < self.cos_emission[i] { 0.0 } else { least };
            importance[i] *= if whole { 1.0 } else { share };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::{stats::r3, warp::uniform_sphere};
    use glam::Vec2;

    fn direction(i: u32) -> Vec3 {
        let [a, b, _] = r3(i);
        uniform_sphere(Vec2::new(a, b))
    }

    #[test]
    fn union_holds_both_cones() {
        for i in 0..500 {
            let a = (direction(i), 3.0 * r3(i)[2].powi(2));
            let b = (direction(i + 1000), 3.0 * r3(i + 7)[2].powi(3));
            let (axis, spread) = cone_union(a, b);
            assert!(axis.is_normalized());
            for (other, half_angle) in [a, b] {
                let needed = (axis.dot(other).clamp(-1.0, 1.0).acos() + half_angle).min(PI);
                assert!(spread >= needed - 2e-3, "{a:?} and {b:?} give {spread}, {needed} is needed");
            }
            assert!(spread <= (0.5 * (a.0.angle_between(b.0) + a.1 + b.1)).max(a.1).max(b.1) + 2e-3);
        }
        assert_eq!(cone_union((Vec3::Y, 0.0), (Vec3::Y, 0.0)), (Vec3::Y, 0.0));
        assert!((cone_union((Vec3::Y, 0.0), (-Vec3::Y, 0.0)).1 - FRAC_PI_2).abs() < 2e-3);
    }

    #[test]
    fn importance_never_hides_a_light() {
        // Clusters of two flat emitters: wherever one of them shows a side that emits, the cluster counts.
        for i in 0..300 {
            let at = [0, 1].map(|k| 2.0 * direction(i + 500 * k) * r3(i + k)[2]);
            let normals = [direction(i + 77), direction(i + 990)];
            let two_sided = [false, i % 3 == 0];
            let lamps = [0, 1].map(|k| Cluster::flat([at[k]; 2], normals[k], 1.0, two_sided[k]));
            let union = lamps[0].union(&lamps[1]);
            let weigher = |p| Weighers::new([&union]).importance(p)[0];
            for j in 0..200 {
                let p = 4.0 * direction(j);
                let height = [0, 1].map(|k| (p - at[k]).dot(normals[k]));
                if (0..2).any(|k| height[k] > 1e-3 || two_sided[k] && height[k] < -1e-3) {
                    assert!(weigher(p) > 0.0, "{:?} from {p}", [at, normals]);
                }
            }
        }
    }

    #[test]
    fn importance_of_one_lamp_is_its_irradiance() {
        let weigh = |cluster: Cluster, p| {
            // among others, in any place
            let others = [0, 1, 2].map(|i| Cluster::round([Vec3::splat(i as f32); 2], 1.0));
            Weighers::new(others.iter().chain([&cluster])).importance(p)[3]
        };
        let flat = |two_sided, p| weigh(Cluster::flat([Vec3::ZERO; 2], Vec3::Y, PI, two_sided), p);
        let p = Vec3::new(0.0, 1.5, 2.0);
        assert!((flat(false, p) - 0.6 / 6.25).abs() < 1e-5);
        assert_eq!(flat(false, -p), 0.0);
        assert!((flat(true, -p) - 0.3 / 6.25).abs() < 1e-5);
        let round = |p| weigh(Cluster::round([Vec3::ZERO; 2], 4.0 * PI), p);
        assert!((round(p) - 1.0 / 6.25).abs() < 1e-5);
        assert!(round(Vec3::ZERO).is_finite());
        let beam = |p| weigh(Cluster::beam(Vec3::ZERO, Vec3::Y, 0.3, 0.5, 2.0), p);
        assert!((beam(2.0 * Vec3::Y) - 0.5).abs() < 1e-5);
        assert!(beam(Vec3::new(0.49f32.sin(), 0.49f32.cos(), 0.0)) > 0.0);
        assert_eq!(beam(Vec3::new(0.51f32.sin(), 0.51f32.cos(), 0.0)), 0.0);
        assert_eq!(Weighers::new([]).importance(p), [0.0; WIDTH]);
    }
}
