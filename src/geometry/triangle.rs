//! Watertight ray–triangle test: Woop, Benthin, Wald, "Watertight Ray/Triangle Intersection" (JCGT 2013).
//!
//! Space is translated to the ray's origin and sheared so that the ray runs along one axis; what is left is a point in
//! a triangle in two dimensions, decided by three edge functions. Two triangles that share an edge compute the same
//! products for it, with opposite signs: as long as each is `a·b − c·d` with two roundings and no fused multiply-add,
//! the two values are exact negatives, edges are inclusive, and no ray slips between.
//!
//! Rounding cannot turn the sign of such a difference, but it can make it zero. Then it is computed again in `f64`, exactly; or
//! triangles smaller than the spacing of floats so far from the ray's origin would be hit by rays that pass at a distance.
//!
//! `accel` tests eight triangles at once with the same operations in the same order, so its hits equal these to the bit.

use glam::Vec3;

use super::{Ray, offset::gamma};

/// The shear that turns a ray's direction into its largest axis `kz`.
#[derive(Clone, Copy, Debug)]
pub struct Shear {
    /// Axes, a permutation of 0, 1, 2; `kz` is where the direction is largest.
    pub kx: usize,
    pub ky: usize,
    pub kz: usize,
    pub sx: f32,
    pub sy: f32,
    pub sz: f32,
}

impl Shear {
    #[inline(always)]
    pub fn new(direction: Vec3) -> Self {
        let (d, size) = (direction.to_array(), direction.abs());
        // Arithmetic rather than branches, which would be mispredicted, and inlined, for the sake of `accel`.
        let y = size.y > size.x;
        let z = size.z > if y { size.y } else { size.x };
        let kz = 2 * z as usize + (y & !z) as usize;
        let (kx, ky) = (kz + 1 - 3 * z as usize, kz + 2 - 3 * (y | z) as usize);
        let sz = 1.0 / d[kz];
        Self { kx, ky, kz, sx: d[kx] * sz, sy: d[ky] * sz, sz }
    }
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TriangleHit {
    pub t: f32,
    /// Barycentric coordinate of the second vertex. u + v may exceed 1 by rounding.
    pub u: f32,
    /// Barycentric coordinate of the third vertex.
    pub v: f32,
}

/// Both sides count. Triangles seen edge-on, those without area, and hits whose t is not surely positive are left out.
pub fn intersect(ray: &Ray, shear: &Shear, triangle: [Vec3; 3]) -> Option<TriangleHit> {
    let Shear { kx, ky, kz, sx, sy, sz } = *shear;
    let [a, b, c] = triangle.map(|p| {
        let p = p - ray.origin;
        let z = p[kz];
        Vec3::new(p[kx] - sx * z, p[ky] - sy * z, z)
    });
    let mut edges = [c.x * b.y - c.y * b.x, a.x * c.y - a.y * c.x, b.x * a.y - b.y * a.x];
    if edges.contains(&0.0) {
        edges = exact_edges([a, b, c].map(|p| [p.x, p.y]));
    }
    let [u, v, w] = edges;
    let inside = (u >= 0.0 && v >= 0.0 && w >= 0.0) || (u <= 0.0 && v <= 0.0 && w <= 0.0);
    let det = (u + v) + w;
    if !inside || det == 0.0 {
        return None;
    }
    let depth = (u * a.z + v * b.z) + w * c.z;
    let t = depth * sz / det;
    if !(t > ray.t_min.max(0.0) && t < ray.t_max) {
        return None;
    }
    let largest = |p: f32, q: f32, r: f32| p.abs().max(q.abs()).max(r.abs());
    let (x, y, z) = (largest(a.x, b.x, c.x), largest(a.y, b.y, c.y), largest(a.z, b.z, c.z));
    let e = largest(u, v, w);
    let edge_error = 2.0 * ((EDGE * x) * y + (SHEAR * (y + z)) * x + (SHEAR * (x + z)) * y);
    let error = 3.0 * (((DEPTH * e) * z + edge_error * z) + (DEPTH * z) * e);
    (depth.abs() > error).then(|| TriangleHit { t, u: v / det, v: w / det })
}

/// Relative errors of an edge function, of the sheared coordinates and of the depth, in what t's error bound is built
/// from (PBRT, 4th ed., 6.8.7). A t within it may be a surface that the ray has just left, or one level with it.
pub const EDGE: f32 = gamma(2);
pub const SHEAR: f32 = gamma(5);
pub const DEPTH: f32 = gamma(3);

/// The edge functions of a triangle in the sheared plane. Products of two `f32` are exact in `f64`.
pub fn exact_edges(corners: [[f32; 2]; 3]) -> [f32; 3] {
    let [a, b, c] = corners.map(|p| p.map(f64::from));
    let edge = |p: [f64; 2], q: [f64; 2]| (p[0] * q[1] - p[1] * q[0]) as f32;
    [edge(c, b), edge(a, c), edge(b, a)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::stats::uniform;

    fn random_point(i: u32, k: u32) -> Vec3 {
        Vec3::new(uniform(i, 3 * k), uniform(i, 3 * k + 1), uniform(i, 3 * k + 2)) * 2.0 - Vec3::ONE
    }

    #[test]
    fn hits_where_the_barycentric_point_is() {
        for i in 0..2000 {
            let triangle = [0, 1, 2].map(|k| random_point(i, k));
            let (mut u, mut v) = (uniform(i, 20), uniform(i, 21));
            if u + v > 1.0 {
                (u, v) = (1.0 - u, 1.0 - v);
            }
            let target = triangle[0] * (1.0 - u - v) + triangle[1] * u + triangle[2] * v;
            let normal = (triangle[1] - triangle[0]).cross(triangle[2] - triangle[0]);
            let origin = random_point(i, 5) * 3.0;
            let direction = (target - origin) * 0.5;
            let margin = u.min(v).min(1.0 - u - v);
            if margin < 1e-3 || normal.dot(direction).abs() < 0.05 * normal.length() || normal.length() < 0.05
            {
                continue;
            }
            let hit = intersect(&Ray::new(origin, direction), &Shear::new(direction), triangle)
                .expect("aimed at the inside");
            assert!(
                (hit.t - 2.0).abs() < 1e-4 && (hit.u - u).abs() < 1e-3 && (hit.v - v).abs() < 1e-3,
                "{hit:?}"
            );
        }
    }

    #[test]
    fn respects_the_interval_and_both_sides() {
        let triangle = [Vec3::ZERO, Vec3::X, Vec3::Y];
        for side in [1.0, -1.0] {
            let mut ray = Ray::new(Vec3::new(0.25, 0.25, 4.0 * side), Vec3::new(0.0, 0.0, -2.0 * side));
            let shear = Shear::new(ray.direction);
            assert_eq!(intersect(&ray, &shear, triangle).map(|h| h.t), Some(2.0));
            ray.t_max = 2.0;
            assert_eq!(intersect(&ray, &shear, triangle), None);
            ray.t_max = f32::INFINITY;
            ray.t_min = 2.0;
            assert_eq!(intersect(&ray, &shear, triangle), None);
        }
    }

    #[test]
    fn triangles_below_the_resolution_are_not_hit_from_afar() {
        let hits = (0..100_000).filter(|&i| {
            let corner = random_point(i, 0) * 1e-3;
            let triangle = [corner, corner + 1e-7 * Vec3::X, corner + 1e-7 * Vec3::Y];
            let origin = 3.0 * random_point(i, 1);
            let direction = random_point(i, 2);
            let passes_near = direction.normalize().cross(corner - origin).length() < 1e-5;
            !passes_near
                && intersect(&Ray::new(origin, direction), &Shear::new(direction), triangle).is_some()
        });
        assert_eq!(hits.count(), 0);
    }
}
