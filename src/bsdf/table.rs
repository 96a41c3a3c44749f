//! What the tables of directional albedo share: averages over visible normals, and where a value falls between nodes.

use std::sync::LazyLock;

use glam::{Vec2, Vec3};

use super::ggx::{Ggx, visible_normal_at};

/// Points of a Fibonacci lattice, the two-dimensional rule for integrands with kinks (the horizon, total reflection):
/// they stay within 0.6 % of the integral, where a product rule of as many nodes is off by up to 3 %.
const LATTICE: [u32; 2] = [610, 377];
/// The next multiple of [`LANES`].
pub const PLACES: usize = 616;
/// Sums are made in so many parts at once, as vector instructions want it.
const LANES: usize = 8;

/// Over one half of the turn: the other is its mirror image.
static HALF: LazyLock<Box<Lattice<PLACES>>> = LazyLock::new(|| Box::new(Lattice::new(LATTICE, 0.5)));

/// A Fibonacci lattice over the visible normals, in `N` places, a multiple of [`LANES`]; what is left of them counts nothing.
pub struct Lattice<const N: usize> {
    points: f32,
    polar: [f32; N],
    /// Cosine and sine of the azimuth.
    cos: [f32; N],
    sin: [f32; N],
}

/// What normals visible from one direction mirror.
pub struct Mirrored<const N: usize> {
    points: f32,
    /// G₂/G₁ of the mirrored direction, zero where that is below the surface.
    pub kept: [f32; N],
    /// Of the angle between the direction and the normal.
    pub cos: [f32; N],
}

impl<const N: usize> Lattice<N> {
    /// Of `n` ≤ `N` points, over this share of the turn.
    pub fn new([n, step]: [u32; 2], share: f32) -> Self {
        // at 1 the normal lies flat and mirrors below the surface
        let mut lattice = Self { points: n as f32, polar: [1.0; N], cos: [1.0; N], sin: [0.0; N] };
        for i in 0..n {
            let turn = ((i * step % n) as f32 + 0.25) / n as f32;
            let k = i as usize;
            (lattice.sin[k], lattice.cos[k]) = (std::f32::consts::TAU * share * turn).sin_cos();
            lattice.polar[k] = (i as f32 + 0.5) / n as f32;
        }
        lattice
    }

    /// As many normals as their density has it.
    pub fn normals(&self, alpha: Vec2, wo: Vec3) -> impl Iterator<Item = Vec3> {
        let points = self.polar.iter().zip(self.cos.iter().zip(&self.sin)).take(self.points as usize);
        points.map(move |(&polar, (&cos, &sin))| visible_normal_at(alpha, wo, polar, [cos, sin]))
    }

    /// The same [`normals`](Self::normals) and [`g2_over_g1`](super::ggx::g2_over_g1), written without branches.
    pub fn mirror(&self, alpha: Vec2, wo: Vec3) -> Mirrored<N> {
        let mut found = Mirrored { points: self.points, kept: [0.0; N], cos: [0.0; N] };
        let w = (wo * alpha.extend(1.0)).normalize();
        let alpha2 = alpha * alpha;
        let s_o = (wo.z * wo.z + alpha2.x * wo.x * wo.x + alpha2.y * wo.y * wo.y).sqrt();
        for i in 0..N {
            let h_z = (1.0 - self.polar[i]) * (1.0 + w.z);
            let z = h_z - w.z;
            let left = 1.0 - z * z;
            let r = if left > 0.0 { left } else { 0.0 }.sqrt();
            let (h_x, h_y) = (alpha.x * (r * self.cos[i] + w.x), alpha.y * (r * self.sin[i] + w.y));
            let square = h_x * h_x + h_y * h_y + h_z * h_z;
            let length = if square > f32::MIN_POSITIVE { square } else { f32::MIN_POSITIVE }.sqrt();
            let cos = (wo.x * h_x + wo.y * h_y + wo.z * h_z) / length;
            let twice = 2.0 * cos / length;
            let (x, y, z) = (twice * h_x - wo.x, twice * h_y - wo.y, twice * h_z - wo.z);
            let s_i = (z * z + alpha2.x * x * x + alpha2.y * y * y).sqrt();
            let kept = z * (wo.z + s_o) / (z * s_o + wo.z * s_i);
            found.kept[i] = if z > 0.0 { kept } else { 0.0 };
            found.cos[i] = cos;
        }
        found
    }
}

impl<const N: usize> Mirrored<N> {
    /// E: the average of what is kept.
    pub fn white(&self) -> f32 {
        self.average(|_| 1.0)
    }

    /// The average of what is kept times a factor by the cosine.
    #[inline(always)]
    pub fn average(&self, factor: impl Fn(f32) -> f32) -> f32 {
        let mut sums = [0.0; LANES];
        for (kept, cos) in self.kept.chunks_exact(LANES).zip(self.cos.chunks_exact(LANES)) {
            for k in 0..LANES {
                sums[k] += kept[k] * factor(cos[k]);
            }
        }
        sums.iter().sum::<f32>() / self.points
    }
}

/// The direction of this cosine, at azimuth 0.
fn direction(mu: f32) -> Vec3 {
    Vec3::new(((1.0 - mu) * (1.0 + mu)).sqrt(), 0.0, mu)
}

/// What normals visible from a direction of cosine `mu` > 0 mirror.
pub fn mirrored(alpha: f32, mu: f32) -> Mirrored<PLACES> {
    HALF.mirror(Vec2::splat(alpha), direction(mu))
}

/// The average of `f`, of such a direction and such a normal.
pub fn average_over_normals(ggx: Ggx, mu: f32, f: impl Fn(Vec3, Vec3) -> f32) -> f32 {
    let wo = direction(mu);
    HALF.normals(Vec2::splat(ggx.alpha), wo).map(|h| f(wo, h)).sum::<f32>() / HALF.points
}

/// Points and weights of Gauss and Legendre's rule over [0, 1], for smooth integrands: the roots of Legendre's polynomial by
/// Newton's iteration from where they nearly are.
pub fn gauss_legendre<const N: usize>() -> [(f32, f32); N] {
    std::array::from_fn(|i| {
        let n = N as f64;
        let mut x = (std::f64::consts::PI * (i as f64 + 0.75) / (n + 0.5)).cos();
        let mut slope = 1.0;
        for _ in 0..5 {
            let (mut before, mut value) = (1.0, x);
            for k in 2..=N {
                let k = k as f64;
                (before, value) = (value, ((2.0 * k - 1.0) * x * value - (k - 1.0) * before) / k);
            }
            slope = n * (x * value - before) / (x * x - 1.0);
            x -= value / slope;
        }
        ((0.5 + 0.5 * x) as f32, (1.0 / ((1.0 - x * x) * slope * slope)) as f32)
    })
}

/// The cell of a table of `n` evenly spaced nodes over [0, 1] that `x` falls in, and how far in it, 0 to 1.
#[inline]
pub fn cell(x: f32, n: usize) -> (usize, f32) {
    let t = x.clamp(0.0, 1.0) * (n - 1) as f32;
    let i = (t as i32 as usize).min(n - 2);
    (i, t - i as f32)
}

/// The i-th of `n` evenly spaced nodes over [0, 1].
pub fn node(i: usize, n: usize) -> f32 {
    i as f32 / (n - 1) as f32
}
