//! Where the next ray starts, so that it does not meet the surface that it leaves.
//!
//! A computed hit point is off the true surface by a rounding error that grows with its coordinates. Forward error
//! analysis bounds it in each axis (Pharr, Jakob, Humphreys, *Physically Based Rendering*, 4th ed., section 6.8): a
//! value that went through n roundings is off by at most [`gamma`]`(n)` of the sum of the magnitudes that went in. The
//! ray then starts outside the box of that error, on the side to which it goes, so the distance scales with the scene.
//!
//! Each function takes what the point was computed from and returns the absolute error per axis.

use glam::{Affine3A, Vec3};

/// Relative error of one rounding in `f32`: half a unit in the last place.
const ROUNDING: f32 = f32::EPSILON / 2.0;

/// Bound on the relative error of n roundings in a row: nε / (1 − nε).
pub const fn gamma(n: u32) -> f32 {
    let error = n as f32 * ROUNDING;
    error / (1.0 - error)
}

/// Of b₀p₀ + b₁p₁ + b₂p₂ with b₀ = 1 − b₁ − b₂; `u`, `v` are b₁, b₂. In the space of the vertices.
pub fn triangle_error([p0, p1, p2]: [Vec3; 3], u: f32, v: f32) -> Vec3 {
    let sum = ((1.0 - u - v) * p0).abs() + (u * p1).abs() + (v * p2).abs();
    gamma(7) * sum + triangle_test_error([p0, p1, p2])
}

/// The next ray is tested in coordinates relative to its origin, so its t has an error of the size of the triangle, which
/// matters where the hit point is much nearer to the world's origin than the triangle is large.
fn triangle_test_error([p0, p1, p2]: [Vec3; 3]) -> Vec3 {
    gamma(3) * (p0.max(p1).max(p2) - p0.min(p1).min(p2))
}

/// Of a point on a sphere computed as center + radius · normalize(p − center).
pub fn sphere_error(center: Vec3, radius: f32, p: Vec3) -> Vec3 {
    gamma(5) * (p - center).abs().min(Vec3::splat(radius)) + gamma(2) * p.abs()
}

/// Of origin + a·u + b·v.
pub fn quad_error(origin: Vec3, u: Vec3, v: Vec3, a: f32, b: f32) -> Vec3 {
    gamma(4) * (origin.abs() + (a * u).abs() + (b * v).abs())
}

/// Of the point `p`, itself off by `error`, when an instance takes it to the world, and of the next ray's origin when it
/// comes back to be tested in the instance's space. `to_object` is the inverse of `to_world`.
pub fn instance_error(to_world: &Affine3A, to_object: &Affine3A, p: Vec3, error: Vec3) -> Vec3 {
    let world = to_world.transform_point3(p);
    let back = gamma(4) * magnitude(to_object, world);
    absolute(to_world, (1.0 + gamma(3)) * error + back) + gamma(3) * magnitude(to_world, p)
}

/// |M| e, M the linear part.
fn absolute(m: &Affine3A, e: Vec3) -> Vec3 {
    let m = m.matrix3;
    Vec3::from(m.x_axis.abs() * e.x + m.y_axis.abs() * e.y + m.z_axis.abs() * e.z)
}

/// |M| |p| + |translation|.
fn magnitude(m: &Affine3A, p: Vec3) -> Vec3 {
    absolute(m, p.abs()) + Vec3::from(m.translation.abs())
}

/// The origin of a ray from `p`, known up to `error`, that leaves along `w`: beyond the error box, along the geometric
/// normal `ng` (unit, either side) on the side of `w`.
pub fn offset_origin(p: Vec3, error: Vec3, ng: Vec3, w: Vec3) -> Vec3 {
    let n = if w.dot(ng) < 0.0 { -ng } else { ng };
    let offset = ng.abs().dot(error) * n;
    // Rounded away from the surface, or the sum may fall back into the box.
    let away = |sum: f32, offset: f32| match offset {
        o if o > 0.0 => sum.next_up(),
        o if o < 0.0 => sum.next_down(),
        _ => sum,
    };
    let sum = p + offset;
    Vec3::new(away(sum.x, offset.x), away(sum.y, offset.y), away(sum.z, offset.z))
}
