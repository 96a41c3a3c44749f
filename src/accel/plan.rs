//! Which nodes of a binary tree survive in an eight-wide one: by dynamic programming, for the lowest surface area cost (Ylitie,
//! Karras, Laine, "Efficient Incoherent Ray Traversal on GPUs Through Compressed Wide BVHs", HPG 2017, section 3.2).

use std::sync::atomic::{AtomicU32, Ordering::Relaxed};

use obvhs::bvh2::Bvh2;
use rayon::prelude::*;

use super::{lanes::WIDTH, wide::NODE};

/// Cost of a visit to a node and of one leaf block. At 0.6 to 1, speed is the same within a few per cent, and memory least at 0.6.
const NODE_COST: f32 = 1.0;
const BLOCK_COST: f32 = 0.7;

/// Down to this level subtrees are planned in parallel.
const PARALLEL_LEVELS: usize = 10;

/// What a leaf can hold.
#[derive(Clone, Copy)]
pub struct LeafSize {
    /// Primitives tested together, at the cost of one block.
    pub block: usize,
    pub max_blocks: usize,
    /// Lines of a block, at most.
    pub lines: usize,
}

/// For each node of the binary tree, the best way to make a forest of at most j roots out of it, j = 1 … 8.
///
/// A word a node: [`LEAF`] where a single root is best a leaf rather than a node; for j = 2 … 8, three bits: how many of j roots go
/// to the left child; 0 says that j − 1 roots do as well. (Atomic, since subtrees write theirs in parallel; each is written once.)
pub struct Plan {
    words: Vec<AtomicU32>,
    /// Lines of all of it, at most: leaves may need fewer than planned.
    pub lines: usize,
}

const LEAF: u32 = 1 << 31;

/// The best forest of at most so many roots: its cost, and its lines.
type Forest = (f32, usize);

/// Of a subtree.
struct Planned {
    primitives: usize,
    /// Of at most j = 1 … 7 roots.
    forests: [Forest; WIDTH - 1],
    /// Lines, where its root has to be a node.
    as_node: usize,
}

impl Plan {
    pub fn new(tree: &Bvh2, size: LeafSize) -> Self {
        let words = tree.nodes.par_iter().map(|_| AtomicU32::new(LEAF)).collect();
        let mut plan = Self { words, lines: 0 };
        plan.lines = plan.subtree(tree, size, 0, PARALLEL_LEVELS).as_node;
        plan
    }

    /// As a single root.
    pub fn is_leaf(&self, node: u32) -> bool {
        self.words[node as usize].load(Relaxed) & LEAF != 0
    }

    /// Of `roots` (2 … 8), how many go to the left child; 0 says that one less does as well.
    pub fn left(&self, node: u32, roots: usize) -> usize {
        (self.words[node as usize].load(Relaxed) >> (3 * (roots - 2)) & 7) as usize
    }

    fn subtree(&self, tree: &Bvh2, size: LeafSize, index: u32, parallel: usize) -> Planned {
        let node = &tree.nodes[index as usize];
        let area = node.aabb().half_area();
        let leaf = |count: usize| match count.div_ceil(size.block) {
            blocks if blocks > size.max_blocks => (f32::INFINITY, 0),
            blocks => (area * BLOCK_COST * blocks as f32, size.lines * blocks),
        };
        if node.is_leaf() {
            let primitives = node.prim_count as usize;
            let leaf = leaf(primitives);
            return Planned { primitives, forests: [leaf; WIDTH - 1], as_node: NODE + leaf.1 };
        }
        let child = |k: u32| self.subtree(tree, size, node.first_index + k, parallel.saturating_sub(1));
        let (left, right) = match parallel {
            0 => (child(0), child(1)),
            _ => rayon::join(|| child(0), || child(1)),
        };
        let mut shared = [(f32::INFINITY, 0); WIDTH + 1];
        let mut to_left = [0; WIDTH + 1];
        for roots in 2..=WIDTH {
            for l in 1..roots {
                let (a, b) = (left.forests[l - 1], right.forests[roots - l - 1]);
                if a.0 + b.0 < shared[roots].0 {
                    (shared[roots], to_left[roots]) = ((a.0 + b.0, a.1 + b.1), l as u32);
                }
            }
        }
        let primitives = left.primitives + right.primitives;
        let as_leaf = leaf(primitives);
        let as_node = (shared[WIDTH].0 + area * NODE_COST, NODE + shared[WIDTH].1);
        let is_leaf = as_leaf.0 <= as_node.0;
        let mut word = if is_leaf { LEAF } else { 0 };
        word |= to_left[WIDTH] << (3 * (WIDTH - 2));
        let mut forests = [if is_leaf { as_leaf } else { as_node }; WIDTH - 1];
        for roots in 2..WIDTH {
            forests[roots - 1] = forests[roots - 2];
            if shared[roots].0 < forests[roots - 1].0 {
                forests[roots - 1] = shared[roots];
                word |= to_left[roots] << (3 * (roots - 2));
            }
        }
        self.words[index as usize].store(word, Relaxed);
        Planned { primitives, forests, as_node: as_node.1 }
    }
}
