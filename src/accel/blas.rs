//! The tree over one mesh, in its own space; any number of instances share it.

use std::{cmp::Reverse, collections::BinaryHeap};

use glam::{DVec3, Vec3};
use obvhs::{aabb::Aabb, bvh2::Bvh2};

use super::{
    lanes::WIDTH,
    lines::{self, Line, lines_of},
    parts::{self, Part},
    plan::LeafSize,
    quality::Quality,
    top_down,
    triangles::Block,
    wide,
};

/// Triangles that reach farther than this from the origin are set aside: products of three coordinates would overflow.
pub const MAX_COORDINATE: f32 = 1e12;

const LEAF_SIZE: LeafSize = LeafSize { block: WIDTH, max_blocks: 2, lines: lines_of::<Block>() };

/// Triangles, at most.
const MAX_TRIANGLES: usize = 1 << 28;

/// Boxes in the [outline](Blas::outline), at most.
const OUTLINE: usize = 32;

/// How a mesh's tree is built.
#[derive(Clone, Copy, Debug)]
pub struct Build {
    pub quality: Quality,
    /// Hits on some instance are filtered, and so each of several coincident triangles counts, once. Otherwise only the first of them
    /// does.
    pub filtered: bool,
}

/// The tree over a mesh.
#[derive(Debug)]
pub struct Blas {
    /// A leaf's tag is the number of its [blocks](Block).
    pub(super) lines: Vec<Line>,
    bounds: Option<(Vec3, Vec3)>,
    outline: Vec<Aabb>,
    set_aside: usize,
}

impl Blas {
    /// Triangles are kept but for those that no ray can hit: with a vertex that is missing, not finite or beyond
    /// [`MAX_COORDINATE`], or without area in `f32`. They are counted in [`set_aside`](Self::set_aside). (Of triangles with the
    /// same corners all but the first are left out too, unless hits are filtered: at equal t it is the one that is hit.)
    ///
    /// # Panics
    /// On more than 2²⁸ triangles, or fewer where a tree of more than 32 GiB is planned for them.
    pub fn build(positions: &[Vec3], triangles: &[[u32; 3]], build: Build) -> Self {
        assert!(triangles.len() <= MAX_TRIANGLES, "too many triangles for one mesh");
        let corners = |i: u32| corners(positions, &triangles[i as usize]);
        let usable = |i: u32| corners(i).filter(is_usable);
        let mut parts = parts::of_triangles(triangles.len() as u32, usable);
        let set_aside = triangles.len() - parts.len();
        // whoever filters hits is asked once about each, and a triangle in several leaves would be met in each of them
        if build.quality.cuts() && !build.filtered {
            parts::cut(&mut parts, corners);
        }
        let thin = |parts: &mut [Part]| match build.filtered {
            true => parts.len(),
            false => merge_coincident(parts, corners),
        };
        let tree = top_down::build(&mut parts, build.quality.leaf(LEAF_SIZE.block), &thin);
        let lines = wide::collapse(&tree, &parts, LEAF_SIZE, |numbers, lines| {
            // Parts of one triangle may meet in a leaf.
            numbers.sort_unstable();
            numbers.dedup();
            for numbers in numbers.chunks(WIDTH) {
                let block = Block::new(numbers.iter().filter_map(|&i| Some((i, corners(i)?))));
                lines.extend_from_slice(lines::of(&[block]));
            }
            numbers.len().div_ceil(WIDTH) as u32
        });
        let bounds = tree.nodes.first().map(|root| (root.aabb().min.into(), root.aabb().max.into()));
        Self { lines, bounds, outline: outline(&tree), set_aside }
    }

    /// How many triangles no ray can hit, and so are not in the tree.
    pub fn set_aside(&self) -> usize {
        self.set_aside
    }

    /// Lower and upper corner; `None` where there is nothing to hit.
    pub fn bounds(&self) -> Option<(Vec3, Vec3)> {
        self.bounds
    }

    /// Boxes that hold everything, a few: where the mesh is turned, together they reach less far than the one around all.
    pub(super) fn outline(&self) -> &[Aabb] {
        &self.outline
    }

    /// Bytes.
    pub fn memory(&self) -> usize {
        size_of_val(&self.lines[..]) + size_of_val(&self.outline[..])
    }
}

/// The largest nodes opened, as long as they are less than [`OUTLINE`]. (Of equal ones, those that were met first: their places in memory
/// differ from time to time.)
fn outline(tree: &Bvh2) -> Vec<Aabb> {
    let mut met = 0;
    let mut entry = |index: u32| {
        met += 1;
        (tree.nodes[index as usize].aabb().half_area().to_bits(), Reverse(met), index)
    };
    let mut open: BinaryHeap<_> = tree.nodes.iter().take(1).map(|_| entry(0)).collect();
    let mut boxes = Vec::new();
    while let Some((_, _, index)) = open.pop() {
        let node = &tree.nodes[index as usize];
        if node.is_leaf() || boxes.len() + open.len() + 1 >= OUTLINE {
            boxes.push(*node.aabb());
        } else {
            open.extend([entry(node.first_index), entry(node.first_index + 1)]);
        }
    }
    boxes
}

/// Moves the first part of each set of triangles with the same corners, bit by bit, to the front, and counts them. (In the same
/// order: otherwise t may differ by a rounding. Of one triangle's parts none is lost, since their boxes differ.)
fn merge_coincident(parts: &mut [Part], corners: impl Fn(u32) -> Option<[Vec3; 3]>) -> usize {
    let key = |part: &Part| {
        let Aabb { min, max } = part.bounds();
        let [a, b, c] = corners(part.number()).unwrap_or_default();
        [a, b, c, min.into(), max.into()].map(|p: Vec3| p.to_array().map(f32::to_bits))
    };
    parts.sort_by_cached_key(|part| (key(part), part.number()));
    let mut kept = 0;
    for i in 0..parts.len() {
        if kept == 0 || key(&parts[kept - 1]) != key(&parts[i]) {
            parts.swap(kept, i);
            kept += 1;
        }
    }
    kept
}

/// `None` where a vertex is missing. (No `array::map` here: it is not always inlined.)
#[inline(always)]
fn corners(positions: &[Vec3], &[a, b, c]: &[u32; 3]) -> Option<[Vec3; 3]> {
    let position = |i: u32| positions.get(i as usize).copied();
    Some([position(a)?, position(b)?, position(c)?])
}

/// Whether a ray can hit the triangle.
#[inline(always)]
fn is_usable(&[a, b, c]: &[Vec3; 3]) -> bool {
    // (false for NaN too)
    let near = |p: Vec3| p.abs().max_element() <= MAX_COORDINATE && !p.is_nan();
    // In `f64` slivers keep their area, however thin.
    let area = |a: DVec3| (b.as_dvec3() - a).cross(c.as_dvec3() - a).length() as f32;
    near(a) && near(b) && near(c) && area(a.as_dvec3()) >= f32::MIN_POSITIVE
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Nodes of equal area are opened in the same order, whichever thread has written them first.
    #[test]
    fn outlines_do_not_depend_on_where_nodes_lie() {
        let n = 200;
        let positions: Vec<Vec3> =
            (0..n * n).map(|i| Vec3::new((i % n) as f32, (i / n) as f32, 0.0)).collect();
        let cells = (0..n * (n - 1)).filter(|i| i % n < n - 1);
        let triangles: Vec<[u32; 3]> =
            cells.flat_map(|i| [[i, i + 1, i + n], [i + 1, i + n + 1, i + n]]).collect();
        let pool = rayon::ThreadPoolBuilder::new().num_threads(4).build().expect("a pool");
        let outline = || {
            let build = Build { quality: Quality::Fast, filtered: false };
            let boxes = pool.install(|| Blas::build(&positions, &triangles, build)).outline;
            boxes.iter().map(|b| [b.min, b.max]).collect::<Vec<_>>()
        };
        let first = outline();
        (0..20).for_each(|_| assert_eq!(outline(), first));
    }
}
