//! The tree over one mesh, in its own space; any number of instances share it.

use glam::Vec3;
use obvhs::aabb::Aabb;

use super::{
    binary,
    lanes::WIDTH,
    triangles::Block,
    wide::{self, LeafSize, Node},
};

/// Triangles that reach farther than this from the origin are set aside: products of three coordinates would overflow.
pub const MAX_COORDINATE: f32 = 1e12;

const LEAF_SIZE: LeafSize = LeafSize { block: WIDTH, max_blocks: 2 };

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
    /// On more than 2³¹ triangles.
    pub fn build(positions: &[Vec3], triangles: &[[u32; 3]]) -> Self {
        assert!(triangles.len() <= 1 << 31, "too many triangles for one mesh");
        let corners = |primitive: u32| corners(positions, triangles[primitive as usize]);
        let (primitives, boxes): (Vec<u32>, Vec<Aabb>) =
            (0..triangles.len() as u32).filter_map(|i| Some((i, bounds(corners(i)?)))).unzip();
        let whole = boxes.iter().copied().reduce(|a, b| a.union(&b));
        let mut blocks = Vec::with_capacity(boxes.len().div_ceil(WIDTH));
        let mut nodes = Vec::new();
        if !boxes.is_empty() {
            let tree = binary::build(&boxes, &primitives);
            let mut members = Vec::with_capacity(LEAF_SIZE.block * LEAF_SIZE.max_blocks);
            nodes = wide::collapse(&tree, LEAF_SIZE, |primitives| {
                members.clear();
                members.extend(primitives.iter().filter_map(|&i| Some((i, corners(i)?))));
                let first = blocks.len() as u32;
                blocks.extend(members.chunks(WIDTH).map(Block::new));
                (blocks.len() as u32 - first) << COUNT_SHIFT | first
            });
        }
        assert!(blocks.len() <= 1 << COUNT_SHIFT, "too many triangles for one mesh");
        blocks.shrink_to_fit();
        Self {
            nodes,
            blocks,
            bounds: whole.map(|b| (b.min.into(), b.max.into())),
            set_aside: triangles.len() - primitives.len(),
        }
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

fn bounds(corners: [Vec3; 3]) -> Aabb {
    Aabb::from_points(&corners.map(Into::into))
}
