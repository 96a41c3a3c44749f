//! Leaves of a mesh's tree: blocks of eight triangles, tested at once.
//!
//! The arithmetic is that of [`geometry::triangle`](crate::geometry::triangle), operation by operation.

use glam::Vec3;

use super::lanes::{Lanes, WIDTH};
use crate::geometry::{Ray, triangle::Shear};

/// Five cache lines. Unused lanes are triangles without area, which are never hit.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub struct Block {
    /// Vertex, axis, lane.
    vertices: [[[f32; WIDTH]; 3]; 3],
    /// Of each lane, the triangle's index in the mesh.
    pub primitive: [u32; WIDTH],
}

/// What a ray meets in a block: lanes as bits, and t, u, v of each.
pub struct BlockHits<L> {
    pub lanes: u32,
    pub t: L,
    pub u: L,
    pub v: L,
}

impl Block {
    /// At most eight.
    pub fn new(triangles: &[(u32, [Vec3; 3])]) -> Self {
        let mut block = Self { vertices: [[[0.0; WIDTH]; 3]; 3], primitive: [0; WIDTH] };
        for (lane, (primitive, corners)) in triangles.iter().enumerate().take(WIDTH) {
            block.primitive[lane] = *primitive;
            for (vertex, corner) in block.vertices.iter_mut().zip(corners) {
                for (axis, coordinate) in vertex.iter_mut().zip(corner.to_array()) {
                    axis[lane] = coordinate;
                }
            }
        }
        block
    }

    /// Hits with t in (`t_min`, `t_max`], `t_max` included.
    #[inline(always)]
    pub fn intersect<L: Lanes>(
        &self,
        ray: &Ray,
        shear: &Shear,
        t_min: f32,
        t_max: f32,
    ) -> Option<BlockHits<L>> {
        let Shear { kx, ky, kz, .. } = *shear;
        let (sx, sy) = (L::splat(shear.sx), L::splat(shear.sy));
        let origin = ray.origin.to_array();
        let [a, b, c] = [0, 1, 2].map(|vertex| {
            // SAFETY: `Shear::new` makes kx, ky and kz a permutation of 0, 1, 2.
            let relative = |k: usize| unsafe {
                L::load(self.vertices[vertex].get_unchecked(k)).sub(L::splat(*origin.get_unchecked(k)))
            };
            let z = relative(kz);
            [relative(kx).sub(sx.mul(z)), relative(ky).sub(sy.mul(z)), z]
        });
        let edge = |p: [L; 3], q: [L; 3]| p[0].mul(q[1]).sub(p[1].mul(q[0]));
        let (u, v, w) = (edge(c, b), edge(a, c), edge(b, a));
        let zero = L::splat(0.0);
        let (least, most) = (u.min(v).min(w), u.max(v).max(w));
        let det = u.add(v).add(w);
        let inside = L::or(zero.le(least), most.le(zero));
        let inside = L::and(inside, L::or(det.lt(zero), zero.lt(det)));
        if L::bits(inside) == 0 {
            return None;
        }
        let depth = u.mul(a[2]).add(v.mul(b[2])).add(w.mul(c[2]));
        let t = depth.mul(L::splat(shear.sz)).div(det);
        let within = L::and(L::splat(t_min).lt(t), t.le(L::splat(t_max)));
        let lanes = L::bits(L::and(inside, within));
        (lanes != 0).then(|| BlockHits { lanes, t, u: v.div(det), v: w.div(det) })
    }
}
