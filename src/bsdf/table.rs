//! What the tables of directional albedo share: the average over visible normals, and where a value falls between nodes.

use glam::{Vec2, Vec3};

use super::ggx::Ggx;

/// Points of a Fibonacci lattice, the two-dimensional rule for integrands with kinks (the horizon, total reflection):
/// they stay within 0.6 % of the integral, where a product rule of as many nodes is off by up to 3 %.
const LATTICE: [u32; 2] = [610, 377];

/// A direction of cosine `mu` > 0, and normals visible from it, as many as their density has it.
pub fn visible_normals(ggx: Ggx, mu: f32) -> (Vec3, impl ExactSizeIterator<Item = Vec3>) {
    let [n, step] = LATTICE;
    let wo = Vec3::new(((1.0 - mu) * (1.0 + mu)).sqrt(), 0.0, mu);
    let normals = (0..n).map(move |i| {
        let polar = (i as f32 + 0.5) / n as f32;
        let azimuth = ((i * step % n) as f32 + 0.25) / n as f32;
        ggx.sample_normal(wo, Vec2::new(polar, 0.5 * azimuth)) // the other half of the turn is the mirror image
    });
    (wo, normals)
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
pub fn cell(x: f32, n: usize) -> (usize, f32) {
    let t = x.clamp(0.0, 1.0) * (n - 1) as f32;
    let i = (t as usize).min(n - 2);
    (i, t - i as f32)
}

/// The i-th of `n` evenly spaced nodes over [0, 1].
pub fn node(i: usize, n: usize) -> f32 {
    i as f32 / (n - 1) as f32
}
