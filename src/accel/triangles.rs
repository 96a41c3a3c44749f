//! Leaves of a mesh's tree: blocks of eight triangles, tested at once.
//!
//! No `array::map` here or in `traverse`: it is not always inlined, and then leaves the kernel's instruction set.
//!
//! The arithmetic is that of [`geometry::triangle`](crate::geometry::triangle), operation by operation.

use glam::Vec3;

use super::lanes::{Lanes, WIDTH};
use crate::geometry::{
    Ray,
    triangle::{self, DEPTH, EDGE, SHEAR, Shear},
};

/// Five cache lines. Unused lanes are NaN, which is never hit.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub struct Block {
    /// Vertex, axis, lane.
    vertices: [[[f32; WIDTH]; 3]; 3],
    /// Of each lane, the triangle's index in the mesh.
    pub primitive: [u32; WIDTH],
}

/// What a ray meets in a block.
pub struct BlockHits<L> {
    /// As bits.
    pub lanes: u32,
    pub t: L,
    /// Edge functions of the second and third vertex, and the sum of all three: hits have their quotients as coordinates.
    pub v: L,
    pub w: L,
    pub det: L,
}

impl Block {
    /// At most eight.
    pub fn new(triangles: impl Iterator<Item = (u32, [Vec3; 3])>) -> Self {
        let mut block = Self { vertices: [[[f32::NAN; WIDTH]; 3]; 3], primitive: [0; WIDTH] };
        for (lane, (primitive, corners)) in triangles.enumerate().take(WIDTH) {
            block.primitive[lane] = primitive;
            for (vertex, corner) in block.vertices.iter_mut().zip(corners) {
                for (axis, coordinate) in vertex.iter_mut().zip(corner.to_array()) {
                    axis[lane] = coordinate;
                }
            }
        }
        block
    }

    /// Hits with t in (`t_min`, `t_max`], `t_max` included; `t_min` is not negative.
    #[inline(always)]
    pub fn intersect<L: Lanes>(
        &self,
        ray: &Ray,
        shear: &Shear,
        t_min: f32,
        t_max: f32,
    ) -> Option<BlockHits<L>> {
        let (a, b, c) =
            (self.sheared::<L>(0, ray, shear), self.sheared(1, ray, shear), self.sheared(2, ray, shear));
        let (mut u, mut v, mut w) = (edge(c, b), edge(a, c), edge(b, a));
        let mut inside = same_sign(u, v, w);
        if L::bits(inside) == 0 {
            return None;
        }
        let zero = L::splat(0.0);
        let vanishing = L::bits(L::and(inside, u.abs().min(v.abs()).min(w.abs()).le(zero)));
        if vanishing != 0 {
            let plane = |p: [L; 3]| [p[0].to_array(), p[1].to_array()];
            let edges = [u.to_array(), v.to_array(), w.to_array()];
            let edges = refine(vanishing, [plane(a), plane(b), plane(c)], edges);
            (u, v, w) = (L::load(&edges[0]), L::load(&edges[1]), L::load(&edges[2]));
            inside = same_sign(u, v, w);
        }
        let det = u.add(v).add(w);
        let depth = u.mul(a[2]).add(v.mul(b[2])).add(w.mul(c[2]));
        let t = depth.mul(L::splat(shear.sz)).div(det);
        let det_counts = L::or(det.lt(zero), zero.lt(det));
        let within = L::and(L::and(inside, det_counts), L::and(L::splat(t_min).lt(t), t.le(L::splat(t_max))));
        if L::bits(within) == 0 {
            return None;
        }
        let surely_positive = depth_error(a, b, c, largest(u, v, w)).lt(depth.abs());
        let lanes = L::bits(L::and(within, surely_positive));
        (lanes != 0).then_some(BlockHits { lanes, t, v, w, det })
    }

    /// One vertex of each triangle, relative to the ray's origin and sheared.
    #[inline(always)]
    fn sheared<L: Lanes>(&self, vertex: usize, ray: &Ray, shear: &Shear) -> [L; 3] {
        let origin = ray.origin.as_ref();
        // SAFETY: `Shear::new` makes kx, ky and kz a permutation of 0, 1, 2.
        let relative = |k: usize| unsafe {
            L::load(self.vertices[vertex].get_unchecked(k)).sub(L::splat(*origin.get_unchecked(k)))
        };
        let z = relative(shear.kz);
        let x = relative(shear.kx).sub(L::splat(shear.sx).mul(z));
        let y = relative(shear.ky).sub(L::splat(shear.sy).mul(z));
        [x, y, z]
    }
}

#[inline(always)]
fn edge<L: Lanes>(p: [L; 3], q: [L; 3]) -> L {
    p[0].mul(q[1]).sub(p[1].mul(q[0]))
}

#[inline(always)]
fn same_sign<L: Lanes>(u: L, v: L, w: L) -> L::Mask {
    let zero = L::splat(0.0);
    L::or(zero.le(u.min(v).min(w)), u.max(v).max(w).le(zero))
}

/// Bound on the error of the depth, which decides the sign of t; `e` is the largest edge function.
#[inline(always)]
fn depth_error<L: Lanes>(a: [L; 3], b: [L; 3], c: [L; 3], e: L) -> L {
    let x = largest(a[0], b[0], c[0]);
    let y = largest(a[1], b[1], c[1]);
    let z = largest(a[2], b[2], c[2]);
    let edge = L::splat(EDGE).mul(x).mul(y);
    let edge = edge.add(L::splat(SHEAR).mul(y.add(z)).mul(x)).add(L::splat(SHEAR).mul(x.add(z)).mul(y));
    let edge = L::splat(2.0).mul(edge);
    let depth = L::splat(DEPTH).mul(e).mul(z).add(edge.mul(z)).add(L::splat(DEPTH).mul(z).mul(e));
    L::splat(3.0).mul(depth)
}

#[inline(always)]
fn largest<L: Lanes>(p: L, q: L, r: L) -> L {
    p.abs().max(q.abs()).max(r.abs())
}

/// The exact edge functions of some lanes (as bits). Rare: the ray must meet an edge or a vertex.
#[cold]
#[inline(never)]
fn refine(
    mut lanes: u32,
    corners: [[[f32; WIDTH]; 2]; 3],
    mut edges: [[f32; WIDTH]; 3],
) -> [[f32; WIDTH]; 3] {
    while lanes != 0 {
        let lane = lanes.trailing_zeros() as usize & (WIDTH - 1);
        lanes &= lanes - 1;
        let exact = triangle::exact_edges(corners.map(|p| p.map(|axis| axis[lane])));
        for (edge, exact) in edges.iter_mut().zip(exact) {
            edge[lane] = exact;
        }
    }
    edges
}
