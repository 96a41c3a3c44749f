//! Boxes into a binary tree of low cost, one box a leaf.
//!
//! A top-down build, then obvhs's reinsertion (Meister and Bittner, "Parallel Reinsertion for Bounding Volume Hierarchy
//! Optimization", CGF 2018), which moves subtrees to where they cost less. obvhs's own builder, PLOC, is left out: where boxes share
//! a centre or a corner it merges one pair a round, so that 16 thousand of them take 12 s, and on ordinary
//! scenes its trees were measured to be slower by about a tenth.
//!
//! The tree is obvhs's `Bvh2`; the `first_index` of a leaf is the box's primitive.

use obvhs::{
    aabb::Aabb,
    bvh2::{Bvh2, reinsertion::ReinsertionOptimizer},
};

use super::top_down;

/// No tree is deeper (a lone root has depth 1): it bounds recursion here and the stack of the traversal.
pub const MAX_DEPTH: usize = 64;

/// Share of the nodes that the first pass of reinsertion looks at; later passes look at a third, a fifth, …
const REINSERTED: f32 = 0.1;
const REINSERTION_PASSES: usize = 8;

/// Reinsertion looks at every node that a box overlaps: in a heap of boxes that all overlap, at all of them, for each of them.
/// It is left out where a subtree's nodes have more than this many times its own area: scenes of a million small
/// triangles have 50 to 300, heaps of n boxes about n.
const ENTANGLED: f32 = 2000.0;

/// `boxes` are finite; box i bounds primitive `primitives[i]`, or a part of it.
pub fn build(boxes: &[Aabb], primitives: &[u32]) -> Bvh2 {
    let mut tree = top_down::build(boxes, primitives);
    if tree.nodes.len() < 4 || entangled(&tree) {
        return tree;
    }
    let mut optimizer = ReinsertionOptimizer::default();
    for pass in 0..REINSERTION_PASSES {
        optimizer.run(&mut tree, REINSERTED, Some(vec![1.0 / (2 * pass + 1) as f32]));
        // Looked at after each pass, since the next has a stack for trees of bounded depth.
        if deeper(&tree, 0, MAX_DEPTH) {
            return top_down::build(boxes, primitives);
        }
    }
    tree
}

fn entangled(tree: &Bvh2) -> bool {
    /// Area of all nodes of the subtree; `None` where some subtree is entangled.
    fn area(tree: &Bvh2, index: usize) -> Option<f32> {
        let node = &tree.nodes[index];
        let own = node.aabb().half_area();
        if node.is_leaf() {
            return Some(own);
        }
        let first = node.first_index as usize;
        let all = own + area(tree, first)? + area(tree, first + 1)?;
        (all <= ENTANGLED * own).then_some(all)
    }
    area(tree, 0).is_none()
}

/// Whether the subtree has more than this many levels.
pub fn deeper(tree: &Bvh2, index: usize, levels: usize) -> bool {
    let node = &tree.nodes[index];
    let first = node.first_index as usize;
    levels == 0
        || (!node.is_leaf() && (deeper(tree, first, levels - 1) || deeper(tree, first + 1, levels - 1)))
}

#[cfg(test)]
mod tests {
    use glam::Vec3A;

    use super::*;
    use crate::sampling::stats::uniform;

    fn boxes(n: u32, at: impl Fn(u32) -> (Vec3A, f32)) -> (Vec<Aabb>, Vec<u32>) {
        let boxes = (0..n).map(at).map(|(corner, size)| Aabb::new(corner, corner + size)).collect();
        (boxes, (0..n).collect())
    }

    fn cost(tree: &Bvh2) -> f32 {
        tree.nodes.iter().map(|n| n.aabb().half_area()).sum()
    }

    #[test]
    fn reinsertion_improves_ordinary_trees() {
        let corner = |i| Vec3A::new(uniform(i, 0), uniform(i, 1), uniform(i, 2));
        let (boxes, primitives) = boxes(2000, |i| (corner(i), 0.1 * uniform(i, 3)));
        let plain = top_down::build(&boxes, &primitives);
        assert!(!entangled(&plain));
        let (plain, improved) = (cost(&plain), cost(&build(&boxes, &primitives)));
        assert!(improved < plain, "{plain} became {improved}");
    }

    #[test]
    fn heaps_are_recognised_wherever_they_are() {
        let heap = |i: u32| (Vec3A::ZERO, 1.0 + 1e-3 * i as f32);
        let (mut boxes, mut primitives) = boxes(10_000, heap);
        assert!(entangled(&top_down::build(&boxes, &primitives)));
        boxes.push(Aabb::new(Vec3A::splat(1e6), Vec3A::splat(2e6)));
        primitives.push(10_000);
        assert!(entangled(&top_down::build(&boxes, &primitives)));
    }

    #[test]
    fn boxes_without_extent_are_no_heap() {
        let (boxes, primitives) = boxes(5000, |i| (Vec3A::X * uniform(i, 0), 0.0));
        let tree = build(&boxes, &primitives);
        assert!(!deeper(&tree, 0, MAX_DEPTH));
    }
}
