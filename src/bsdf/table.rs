//! What the tables of directional albedo share: the average over visible normals, and where a value falls between nodes.

use std::sync::LazyLock;

use glam::{Vec2, Vec3};

use super::ggx::{Ggx, visible_normal_at};

/// Points of a Fibonacci lattice, the two-dimensional rule for integrands with kinks (the horizon, total reflection):
/// they stay within 0.6 % of the integral, where a product rule of as many nodes is off by up to 3 %.
const LATTICE: [u32; 2] = [610, 377];

static POINTS: LazyLock<Vec<Point>> = LazyLock::new(|| lattice(LATTICE, 0.5)); // the other half of the turn is the mirror image

/// A point of the unit square, the second coordinate as cosine and sine of an azimuth.
pub type Point = (f32, [f32; 2]);

/// The Fibonacci lattice of `n` points, over this share of the turn.
pub fn lattice([n, step]: [u32; 2], share: f32) -> Vec<Point> {
    let point = |i| {
        let turn = ((i * step % n) as f32 + 0.25) / n as f32;
        let (sin, cos) = (std::f32::consts::TAU * share * turn).sin_cos();
        ((i as f32 + 0.5) / n as f32, [cos, sin])
    };
    (0..n).map(point).collect()
}

/// A direction of cosine `mu` > 0, and normals visible from it, as many as their density has it.
pub fn visible_normals(ggx: Ggx, mu: f32) -> (Vec3, impl ExactSizeIterator<Item = Vec3>) {
    let wo = Vec3::new(((1.0 - mu) * (1.0 + mu)).sqrt(), 0.0, mu);
    let alpha = Vec2::splat(ggx.alpha);
    (wo, POINTS.iter().map(move |&(polar, azimuth)| visible_normal_at(alpha, wo, polar, azimuth)))
}

/// The average of `f`, of such a direction and such a normal.
pub fn average_over_normals<T>(ggx: Ggx, mu: f32, f: impl Fn(Vec3, Vec3) -> T) -> T
where
    T: std::iter::Sum + std::ops::Div<f32, Output = T>,
{
    let (wo, normals) = visible_normals(ggx, mu);
    let n = normals.len();
    normals.map(|h| f(wo, h)).sum::<T>() / n as f32
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
