//! Boxes into a binary tree of low cost, one box a leaf.
//!
//! obvhs builds it: PLOC (Meister and Bittner, "Parallel Locally-Ordered Clustering", TVCG 2018), improved by
//! reinsertion ("Parallel Reinsertion", CGF 2018). Where many boxes have the same centre, PLOC merges one pair a round: time
//! grows with the square and depth with the number of boxes. Such input, and any tree that gets too deep, goes to
//! [`top_down`](super::top_down) instead, whose time and depth are bounded for every input.
//!
//! The tree is obvhs's `Bvh2`; the `first_index` of a leaf is the box's primitive.

use glam::Vec3A;
use obvhs::{
    aabb::Aabb,
    bvh2::{Bvh2, reinsertion::ReinsertionOptimizer},
    ploc::{PlocBuilder, PlocSearchDistance, SortPrecision},
};
use rayon::prelude::*;

use super::top_down;

/// No tree is deeper (a lone root has depth 1): it bounds recursion here and the stack of the traversal.
pub const MAX_DEPTH: usize = 64;

/// Share of the nodes that the first pass of reinsertion looks at; later passes look at a third, a fifth, …
const REINSERTED: f32 = 0.1;
const REINSERTION_PASSES: usize = 16;

/// More boxes than this with their centres in one cell of a 2²⁰ grid per axis are too many for PLOC.
const CROWD: usize = 64;
const CELLS_PER_AXIS: f32 = (1 << 20) as f32;

/// `boxes` are finite and not empty; box i bounds primitive `primitives[i]`, or a part of it.
pub fn build(boxes: &[Aabb], primitives: &[u32]) -> Bvh2 {
    clustered(boxes, primitives).unwrap_or_else(|| top_down::build(boxes, primitives))
}

/// `None` where the input does not suit PLOC.
fn clustered(boxes: &[Aabb], primitives: &[u32]) -> Option<Bvh2> {
    if boxes.len() < 4 || crowded(boxes) {
        return None;
    }
    let mut tree = PlocBuilder::with_capacity(boxes.len()).build(
        PlocSearchDistance::Medium,
        boxes,
        primitives.to_vec(),
        SortPrecision::U64,
        3,
    );
    let mut optimizer = ReinsertionOptimizer::default();
    for pass in 0..REINSERTION_PASSES {
        // Looked at between passes, since a pass needs a stack of the tree's depth.
        if depth(&tree) > MAX_DEPTH {
            return None;
        }
        optimizer.run(&mut tree, REINSERTED, Some(vec![1.0 / (2 * pass + 1) as f32]));
    }
    (depth(&tree) <= MAX_DEPTH).then_some(tree)
}

/// Whether some cell of a fine grid holds the centres of a crowd.
fn crowded(boxes: &[Aabb]) -> bool {
    let center = |b: &Aabb| 0.5 * b.min + 0.5 * b.max;
    let (low, high) = boxes
        .iter()
        .map(center)
        .fold((Vec3A::INFINITY, Vec3A::NEG_INFINITY), |(low, high), c| (low.min(c), high.max(c)));
    let scale = CELLS_PER_AXIS / (high - low).max(Vec3A::splat(f32::MIN_POSITIVE));
    let cell = |b: &Aabb| {
        // (an axis without extent gives 0 · ∞; the cast makes that NaN a 0)
        let c = (center(b) - low) * scale;
        (c.x as u64) << 42 | (c.y as u64) << 21 | c.z as u64
    };
    let mut cells: Vec<u64> = boxes.par_iter().map(cell).collect();
    cells.par_sort_unstable();
    cells.windows(CROWD + 1).any(|run| run[0] == run[CROWD])
}

pub fn depth(tree: &Bvh2) -> usize {
    let mut deepest = 0;
    let mut open = vec![(0, 1)];
    while let Some((index, depth)) = open.pop() {
        deepest = deepest.max(depth);
        let node = &tree.nodes[index as usize];
        if !node.is_leaf() {
            open.extend([(node.first_index, depth + 1), (node.first_index + 1, depth + 1)]);
        }
    }
    deepest
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::stats::uniform;

    fn random_boxes(n: u32) -> Vec<Aabb> {
        let corner = |i| Vec3A::new(uniform(i, 0), uniform(i, 1), uniform(i, 2));
        (0..n).map(|i| Aabb::new(corner(i), corner(i) + 0.01 * uniform(i, 3))).collect()
    }

    #[test]
    fn ordinary_boxes_are_clustered_and_crowds_are_not() {
        let boxes = random_boxes(1000);
        let primitives: Vec<u32> = (0..1000).collect();
        assert!(clustered(&boxes, &primitives).is_some());
        let mut same = boxes.clone();
        same[..CROWD].fill(boxes[0]);
        assert!(!crowded(&same), "{CROWD} are not yet a crowd");
        same[..=CROWD].fill(boxes[0]);
        assert!(crowded(&same));
    }

    #[test]
    fn flat_and_pointlike_input_is_not_a_crowd() {
        let flat: Vec<Aabb> =
            random_boxes(1000).iter().map(|b| Aabb::new(b.min * Vec3A::X, b.max * Vec3A::X)).collect();
        assert!(!crowded(&flat));
        assert!(!crowded(&flat[..1]));
    }
}
