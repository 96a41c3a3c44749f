//! Which nodes of a binary tree survive in an eight-wide one: by dynamic programming, for the lowest surface area cost (Ylitie,
//! Karras, Laine, "Efficient Incoherent Ray Traversal on GPUs Through Compressed Wide BVHs", HPG 2017, section 3.2).

use std::sync::atomic::{AtomicU32, Ordering::Relaxed};

use obvhs::bvh2::Bvh2;
use rayon::prelude::*;

use super::lanes::WIDTH;

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
}

/// For each node of the binary tree, the best way to make a forest of at most j roots out of it, j = 1 … 8.
///
/// A word a node: [`LEAF`] where a single root is best a leaf rather than a node; for j = 2 … 8, three bits: how many of j roots go
/// to the left child; 0 says that j − 1 roots do as well. (Atomic, since subtrees write theirs in parallel; each is written once.)
pub struct Plan {
    words: Vec<AtomicU32>,
}

const LEAF: u32 = 1 << 31;

/// Of a subtree: its primitives, and the costs of at most j = 1 … 7 roots.
type Costs = (usize, [f32; WIDTH - 1]);

impl Plan {
    pub fn new(tree: &Bvh2, size: LeafSize) -> Self {
        let plan = Self { words: tree.nodes.par_iter().map(|_| AtomicU32::new(LEAF)).collect() };
        plan.subtree(tree, size, 0, PARALLEL_LEVELS);
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

    fn subtree(&self, tree: &Bvh2, size: LeafSize, index: u32, parallel: usize) -> Costs {
        let node = &tree.nodes[index as usize];
        let area = node.aabb().half_area();
        let leaf_cost = |count: usize| match count.div_ceil(size.block) {
            blocks if blocks > size.max_blocks => f32::INFINITY,
            blocks => area * BLOCK_COST * blocks as f32,
        };
        if node.is_leaf() {
            let count = node.prim_count as usize;
            return (count, [leaf_cost(count); WIDTH - 1]);
        }
        let child = |k: u32| self.subtree(tree, size, node.first_index + k, parallel.saturating_sub(1));
        let ((count_left, left), (count_right, right)) = match parallel {
            0 => (child(0), child(1)),
            _ => rayon::join(|| child(0), || child(1)),
        };
        let mut shared = [f32::INFINITY; WIDTH + 1];
        let mut to_left = [0; WIDTH + 1];
        for roots in 2..=WIDTH {
            for l in 1..roots {
                let cost = left[l - 1] + right[roots - l - 1];
                if cost < shared[roots] {
                    (shared[roots], to_left[roots]) = (cost, l as u32);
                }
            }
        }
        let count = count_left + count_right;
        let (as_node, as_leaf) = (shared[WIDTH] + area * NODE_COST, leaf_cost(count));
        let mut word = if as_leaf <= as_node { LEAF } else { 0 };
        word |= to_left[WIDTH] << (3 * (WIDTH - 2));
        let mut costs = [as_leaf.min(as_node); WIDTH - 1];
        for roots in 2..WIDTH {
            costs[roots - 1] = costs[roots - 2];
            if shared[roots] < costs[roots - 1] {
                costs[roots - 1] = shared[roots];
                word |= to_left[roots] << (3 * (roots - 2));
            }
        }
        self.words[index as usize].store(word, Relaxed);
        (count, costs)
    }
}
