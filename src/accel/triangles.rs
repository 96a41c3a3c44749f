//! Leaves of a mesh's tree: blocks of eight triangles, tested at once.
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
        let mut block = Self { vertices: [[[f32::NAN; WIDTH]; 3]; 3], primitive: [0; WIDTH] };
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
        let mut edges = [edge(c, b), edge(a, c), edge(b, a)];
        let mut inside = Self::inside(edges);
        if L::bits(inside) == 0 {
            return None;
        }
        let zero = L::splat(0.0);
        let [p, q, r] = edges.map(|e| L::and(e.le(zero), zero.le(e)));
        let vanishing = L::bits(L::and(inside, L::or(L::or(p, q), r)));
        if vanishing != 0 {
            edges = refine(vanishing, [a, b, c], edges);
            inside = Self::inside(edges);
        }
        let [u, v, w] = edges;
        let det = u.add(v).add(w);
        let inside = L::and(inside, L::or(det.lt(zero), zero.lt(det)));
        let depth = u.mul(a[2]).add(v.mul(b[2])).add(w.mul(c[2]));
        let t = depth.mul(L::splat(shear.sz)).div(det);
        let within = L::and(inside, L::and(L::splat(t_min).lt(t), t.le(L::splat(t_max))));
        if L::bits(within) == 0 {
            return None;
        }
        let scale = L::splat(shear.sz).div(det);
        let surely_positive = Self::depth_error([a, b, c], [u, v, w], scale).lt(t);
        let lanes = L::bits(L::and(within, surely_positive));
        (lanes != 0).then(|| BlockHits { lanes, t, u: v.div(det), v: w.div(det) })
    }

    /// Bound on the error of t.
    #[inline(always)]
    fn depth_error<L: Lanes>([a, b, c]: [[L; 3]; 3], [u, v, w]: [L; 3], scale: L) -> L {
        let abs = |l: L| l.max(L::splat(0.0).sub(l));
        let largest = |p: L, q: L, r: L| abs(p).max(abs(q)).max(abs(r));
        let times = |factor: f32, l: L| L::splat(factor).mul(l);
        let [x, y, z] = [0, 1, 2].map(|k| largest(a[k], b[k], c[k]));
        let e = largest(u, v, w);
        let edge = times(EDGE, x).mul(y);
        let edge = edge.add(times(SHEAR, y.add(z)).mul(x)).add(times(SHEAR, x.add(z)).mul(y));
        let edge = times(2.0, edge);
        let depth = times(DEPTH, e).mul(z).add(edge.mul(z)).add(times(DEPTH, z).mul(e));
        times(3.0, depth).mul(abs(scale))
    }

    /// All edge functions of one sign.
    #[inline(always)]
    fn inside<L: Lanes>([u, v, w]: [L; 3]) -> L::Mask {
        let zero = L::splat(0.0);
        L::or(zero.le(u.min(v).min(w)), u.max(v).max(w).le(zero))
    }
}

/// The exact edge functions of some lanes (as bits).
#[inline(always)]
fn refine<L: Lanes>(lanes: u32, corners: [[L; 3]; 3], edges: [L; 3]) -> [L; 3] {
    let mut edges = edges.map(L::to_array);
    refine_lanes(lanes, corners.map(|[x, y, _]| [x, y].map(L::to_array)), &mut edges);
    edges.map(|e| L::load(&e))
}

/// Rare: the ray must meet an edge or a vertex.
#[cold]
#[inline(never)]
fn refine_lanes(mut lanes: u32, corners: [[[f32; WIDTH]; 2]; 3], edges: &mut [[f32; WIDTH]; 3]) {
    while lanes != 0 {
        let lane = lanes.trailing_zeros() as usize & (WIDTH - 1);
        lanes &= lanes - 1;
        let exact = triangle::exact_edges(corners.map(|p| p.map(|axis| axis[lane])));
        for (edge, exact) in edges.iter_mut().zip(exact) {
            edge[lane] = exact;
        }
    }
}
