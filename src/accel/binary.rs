//! Parts into a binary tree of low cost.
//!
//! A top-down build, then obvhs's reinsertion (Meister and Bittner, "Parallel Reinsertion for Bounding Volume Hierarchy
//! Optimization", CGF 2018), which moves subtrees to where they cost less. obvhs's own builder, PLOC, is left out: where boxes share
//! a centre or a corner it merges one pair a round, so that 16 thousand of them take 12 s, and on ordinary
//! scenes its trees were measured to be slower by about a tenth.
//!
//! The tree is obvhs's `Bvh2`; a leaf is a range of the parts.

use obvhs::bvh2::{Bvh2, reinsertion::ReinsertionOptimizer};

use super::{
    parts::Part,
    top_down::{self, Thin},
};

/// No tree is deeper (a lone root has depth 1): it bounds recursion here and the stack of the traversal.
pub const MAX_DEPTH: usize = 64;

/// Reinsertion looks at every node that a box overlaps: in a heap of boxes that all overlap, at all of them, for each of them.
/// It is left out where a subtree's nodes have more than this many times its own area: scenes of a million small
/// triangles have 50 to 300, heaps of n boxes about n.
const ENTANGLED: f32 = 2000.0;

/// How much is reinserted: of all nodes, the share with the largest areas, in each of so many passes.
#[derive(Clone, Copy, Debug)]
pub struct Reinsertion {
    pub share: f32,
    pub passes: usize,
}

/// The boxes of `parts` are finite. Puts them in order.
pub fn build(parts: &mut [Part], block: usize, thin: Thin, reinsertion: Reinsertion) -> Bvh2 {
    let mut tree = top_down::build(parts, block, thin);
    if tree.nodes.len() < 4 || reinsertion.passes == 0 || entangled(&tree) {
        return tree;
    }
    let mut optimizer = ReinsertionOptimizer::default();
    for _ in 0..reinsertion.passes {
        let candidates = largest(&tree, reinsertion.share);
        optimizer.run_with_candidates(&mut tree, &candidates, 1);
        // Looked at after each pass, since the next has a stack for trees of bounded depth.
        if deeper(&tree, 0, MAX_DEPTH) {
            return top_down::build(parts, block, thin);
        }
    }
    tree.parents = Vec::new();
    tree
}

/// The nodes (but the root) with the largest areas, largest first.
fn largest(tree: &Bvh2, share: f32) -> Vec<u32> {
    // (areas are not negative, and so their bits sort as they do)
    let key = |i: u32| !(tree.nodes[i as usize].aabb().half_area().to_bits());
    let mut nodes: Vec<(u32, u32)> = (1..tree.nodes.len() as u32).map(|i| (key(i), i)).collect();
    let count = ((share * nodes.len() as f32) as usize).clamp(1, nodes.len() - 1);
    nodes.select_nth_unstable(count);
    nodes.truncate(count);
    nodes.sort_unstable();
    nodes.into_iter().map(|(_, i)| i).collect()
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
    use obvhs::aabb::Aabb;

    use super::*;
    use crate::sampling::stats::uniform;

    const SOME: Reinsertion = Reinsertion { share: 0.1, passes: 3 };

    fn parts(n: u32, at: impl Fn(u32) -> (Vec3A, f32)) -> Vec<Part> {
        let bounds = |i| at(i);
        (0..n).map(|i| (bounds(i), i)).map(|((c, size), i)| Part::new(&Aabb::new(c, c + size), i)).collect()
    }

    fn top_down(parts: &mut [Part]) -> Bvh2 {
        top_down::build(parts, 1, &|parts| parts.len())
    }

    fn cost(tree: &Bvh2) -> f32 {
        tree.nodes.iter().map(|n| n.aabb().half_area()).sum()
    }

    #[test]
    fn reinsertion_improves_ordinary_trees() {
        let corner = |i| Vec3A::new(uniform(i, 0), uniform(i, 1), uniform(i, 2));
        let mut parts = parts(2000, |i| (corner(i), 0.1 * uniform(i, 3)));
        let plain = top_down(&mut parts);
        assert!(!entangled(&plain));
        let (plain, improved) = (cost(&plain), cost(&build(&mut parts, 1, &|parts| parts.len(), SOME)));
        assert!(improved < 0.99 * plain, "{plain} became {improved}");
    }

    #[test]
    fn heaps_are_recognised_wherever_they_are() {
        let heap = |i: u32| (Vec3A::ZERO, 1.0 + 1e-3 * i as f32);
        let mut parts = parts(10_000, heap);
        assert!(entangled(&top_down(&mut parts)));
        parts.push(Part::new(&Aabb::new(Vec3A::splat(1e6), Vec3A::splat(2e6)), 10_000));
        assert!(entangled(&top_down(&mut parts)));
    }

    #[test]
    fn boxes_without_extent_are_no_heap() {
        let mut parts = parts(5000, |i| (Vec3A::X * uniform(i, 0), 0.0));
        let tree = build(&mut parts, 1, &|parts| parts.len(), SOME);
        assert!(!deeper(&tree, 0, MAX_DEPTH));
    }
}
