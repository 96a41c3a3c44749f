//! The tree over one mesh, in its own space; any number of instances share it.

use glam::Vec3;
use rayon::prelude::*;

use super::{
    binary::{self, Reinsertion},
    lanes::WIDTH,
    parts,
    plan::LeafSize,
    triangles::Block,
    wide::{self, Node},
};

/// Triangles that reach farther than this from the origin are set aside: products of three coordinates would overflow.
pub const MAX_COORDINATE: f32 = 1e12;

const LEAF_SIZE: LeafSize = LeafSize { block: WIDTH, max_blocks: 2 };

const REINSERTION: Reinsertion = Reinsertion { share: 0.1, passes: 2 };

/// A leaf's rest: the number of blocks above this bit, the first block below.
const COUNT_SHIFT: u32 = 28;

/// The tree over a mesh.
#[derive(Debug)]
pub struct Blas {
    pub(super) nodes: Vec<Node>,
    blocks: Vec<Block>,
    bounds: Option<(Vec3, Vec3)>,
    set_aside: usize,
}

impl Blas {
    /// Triangles are kept but for those that no ray can hit: with a vertex that is missing, not finite or beyond
    /// [`MAX_COORDINATE`], or without area in `f32`. They are counted in [`set_aside`](Self::set_aside).
    ///
    /// # Panics
    /// On more than 2²⁸ triangles.
    pub fn build(positions: &[Vec3], triangles: &[[u32; 3]]) -> Self {
        assert!(triangles.len() <= 1 << COUNT_SHIFT, "too many triangles for one mesh");
        let usable = |i: u32| corners(positions, triangles[i as usize]);
        let count = triangles.len() as u32;
        let mut parts = parts::of_triangles(count, usable, true);
        let set_aside = triangles.len() - (0..count).into_par_iter().filter(|&i| usable(i).is_some()).count();
        let tree = binary::build(&mut parts, LEAF_SIZE.block, &|parts| parts.len(), REINSERTION);
        let (nodes, blocks) = wide::collapse(&tree, &parts, LEAF_SIZE, |numbers, blocks: &mut Vec<Block>| {
            // Parts of one triangle may meet in a leaf.
            numbers.sort_unstable();
            numbers.dedup();
            let first = blocks.len();
            blocks.extend(
                numbers
                    .chunks(WIDTH)
                    .map(|numbers| Block::new(numbers.iter().filter_map(|&i| Some((i, usable(i)?))))),
            );
            ((blocks.len() - first) << COUNT_SHIFT | first) as u32
        });
        assert!(blocks.len() <= 1 << COUNT_SHIFT, "too many triangles for one mesh");
        let bounds = tree.nodes.first().map(|root| (root.aabb().min.into(), root.aabb().max.into()));
        Self { nodes, blocks, bounds, set_aside }
    }

    /// How many triangles no ray can hit, and so are not in the tree.
    pub fn set_aside(&self) -> usize {
        self.set_aside
    }

    /// Lower and upper corner; `None` where there is nothing to hit.
    pub fn bounds(&self) -> Option<(Vec3, Vec3)> {
        self.bounds
    }

    /// Bytes.
    pub fn memory(&self) -> usize {
        size_of_val(&self.nodes[..]) + size_of_val(&self.blocks[..])
    }

    /// The blocks of a leaf.
    #[inline(always)]
    pub(super) fn leaf(&self, rest: u32) -> &[Block] {
        let first = rest as usize & ((1 << COUNT_SHIFT) - 1);
        let count = (rest >> COUNT_SHIFT) as usize;
        debug_assert!(first + count <= self.blocks.len());
        // SAFETY: leaf words are made in `build`, from the blocks just pushed; that of an unused child says 0 blocks.
        unsafe { self.blocks.get_unchecked(first..first + count) }
    }

    #[inline(always)]
    pub(super) fn leaf_address(&self, rest: u32) -> *const u8 {
        self.blocks.as_ptr().wrapping_add(rest as usize & ((1 << COUNT_SHIFT) - 1)).cast()
    }
}

/// `None` where no ray can hit the triangle.
fn corners(positions: &[Vec3], triangle: [u32; 3]) -> Option<[Vec3; 3]> {
    let [a, b, c] = triangle.map(|i| positions.get(i as usize).copied());
    let corners = [a?, b?, c?];
    // (false for NaN too)
    let usable = corners.iter().all(|p| p.abs().max_element() <= MAX_COORDINATE && !p.is_nan());
    // In `f64` slivers keep their area, however thin.
    let [a, b, c] = corners.map(Vec3::as_dvec3);
    let area = (b - a).cross(c - a).length() as f32;
    (usable && area >= f32::MIN_POSITIVE).then_some(corners)
}
