//! Boxes into a binary tree, from the root down: binned SAH (Wald, "On fast construction of SAH-based bounding volume
//! hierarchies", 2007), with a split in the middle where SAH finds none or the tree would get too deep. Takes any
//! input in O(n · depth).

use glam::Vec3A;
use obvhs::{
    aabb::Aabb,
    bvh2::{Bvh2, node::Bvh2Node},
};

use super::binary::MAX_DEPTH;

const BINS: usize = 16;

/// Subtrees larger than this are built in parallel.
const PARALLEL: usize = 4096;

struct Item {
    bounds: Aabb,
    center: Vec3A,
    primitive: u32,
}

/// As [`super::binary::build`].
pub fn build(boxes: &[Aabb], primitives: &[u32]) -> Bvh2 {
    let mut items: Vec<Item> = boxes
        .iter()
        .zip(primitives)
        .map(|(b, &primitive)| Item { bounds: *b, center: 0.5 * b.min + 0.5 * b.max, primitive })
        .collect();
    let mut tree = Bvh2 {
        nodes: vec![Bvh2Node::default(); (2 * items.len()).saturating_sub(1)],
        primitive_indices: primitives.to_vec(),
        ..Bvh2::default()
    };
    if let Some((root, below)) = tree.nodes.split_first_mut() {
        fill(root, below, 1, &mut items, 1);
    }
    tree
}

/// Writes the node over `items` and, into `below` (2·items − 2 nodes, the first of them number `first`), what hangs from it.
fn fill(node: &mut Bvh2Node, below: &mut [Bvh2Node], first: u32, items: &mut [Item], depth: usize) {
    if let [item] = items {
        *node = Bvh2Node::new(item.bounds, 1, item.primitive);
        return;
    }
    let (mut bounds, mut centers) = (Aabb::empty(), Aabb::empty());
    for item in &*items {
        bounds = bounds.union(&item.bounds);
        centers.extend(item.center);
    }
    *node = Bvh2Node::new(bounds, 0, first);
    let parallel = items.len() > PARALLEL;
    let count = split(items, &centers, depth);
    let (left, right) = items.split_at_mut(count);
    let (children, below) = below.split_at_mut(2);
    let (below_left, below_right) = below.split_at_mut(2 * left.len() - 2);
    let [node_left, node_right] = children else { unreachable!("split at two") };
    let first_right = first + 2 + below_left.len() as u32;
    let mut go_left = || fill(node_left, below_left, first + 2, left, depth + 1);
    let mut go_right = || fill(node_right, below_right, first_right, right, depth + 1);
    if parallel {
        rayon::join(go_left, go_right);
    } else {
        go_left();
        go_right();
    }
}

/// Orders `items` (two or more, with their centers in `centers`) and says how many go to the left: at least one, not all.
fn split(items: &mut [Item], centers: &Aabb, depth: usize) -> usize {
    // The depth that halving from here on would reach.
    let halving = depth + items.len().next_power_of_two().trailing_zeros() as usize;
    let bins = Bins::new(centers);
    if halving < MAX_DEPTH
        && let Some((axis, last)) = bins.best_split(items)
    {
        let mut count = 0;
        for i in 0..items.len() {
            if bins.of(&items[i])[axis] <= last {
                items.swap(i, count);
                count += 1;
            }
        }
        return count;
    }
    let axis = centers.largest_axis();
    let half = items.len() / 2;
    items.select_nth_unstable_by(half, |a, b| a.center[axis].total_cmp(&b.center[axis]));
    half
}

/// Slices of equal width between the outermost centers, on each axis.
struct Bins {
    low: Vec3A,
    scale: Vec3A,
}

impl Bins {
    fn new(centers: &Aabb) -> Self {
        Self { low: centers.min, scale: BINS as f32 / (centers.max - centers.min) }
    }

    /// (On an axis without extent, 0 · ∞ = NaN, which the cast makes 0.)
    fn of(&self, item: &Item) -> [usize; 3] {
        let bin = (item.center - self.low) * self.scale;
        [bin.x, bin.y, bin.z].map(|b| (b as usize).min(BINS - 1))
    }

    /// The axis, and the last bin on the left, of the lowest area × count; `None` where all fall into one bin.
    fn best_split(&self, items: &[Item]) -> Option<(usize, usize)> {
        let mut bins = [[(Aabb::empty(), 0usize); BINS]; 3];
        for item in items {
            for (axis, bin) in self.of(item).into_iter().enumerate() {
                join(&mut bins[axis][bin], &(item.bounds, 1));
            }
        }
        let mut best = None;
        let mut best_cost = f32::INFINITY;
        for (axis, bins) in bins.iter().enumerate() {
            let mut right = [0.0; BINS];
            let mut sum = (Aabb::empty(), 0);
            for i in (1..BINS).rev() {
                join(&mut sum, &bins[i]);
                right[i] = cost(&sum);
            }
            let mut sum = (Aabb::empty(), 0);
            for i in 0..BINS - 1 {
                join(&mut sum, &bins[i]);
                let total = cost(&sum) + right[i + 1];
                if sum.1 > 0 && sum.1 < items.len() && total < best_cost {
                    (best_cost, best) = (total, Some((axis, i)));
                }
            }
        }
        best
    }
}

fn join(sum: &mut (Aabb, usize), part: &(Aabb, usize)) {
    *sum = (sum.0.union(&part.0), sum.1 + part.1);
}

fn cost((bounds, count): &(Aabb, usize)) -> f32 {
    match count {
        0 => 0.0,
        n => bounds.half_area() * *n as f32,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::stats::uniform;

    fn depth(tree: &Bvh2, index: usize) -> usize {
        let node = &tree.nodes[index];
        let first = node.first_index as usize;
        1 + if node.is_leaf() { 0 } else { depth(tree, first).max(depth(tree, first + 1)) }
    }

    /// Every primitive in one leaf, every box inside its parent's, depth within bounds.
    fn check(boxes: &[Aabb]) -> usize {
        let primitives: Vec<u32> = (0..boxes.len() as u32).collect();
        let tree = build(boxes, &primitives);
        let mut seen = vec![0; boxes.len()];
        for node in &tree.nodes {
            if node.is_leaf() {
                seen[node.first_index as usize] += 1;
                continue;
            }
            for child in [node.first_index, node.first_index + 1] {
                let child = tree.nodes[child as usize].aabb();
                let b = node.aabb();
                assert!(b.min.cmple(child.min).all() && b.max.cmpge(child.max).all());
            }
        }
        assert!(seen.iter().all(|&n| n == 1));
        let depth = depth(&tree, 0);
        assert!(depth <= MAX_DEPTH);
        depth
    }

    #[test]
    fn identical_boxes_make_a_balanced_tree() {
        assert_eq!(check(&vec![Aabb::new(Vec3A::ZERO, Vec3A::ONE); 16_384]), 15);
        assert_eq!(check(&[Aabb::new(Vec3A::ZERO, Vec3A::ONE)]), 1);
    }

    #[test]
    fn geometric_series_stays_within_the_depth() {
        // SAH peels off one box at a time here: each is as large as all before it together.
        let boxes: Vec<Aabb> = (0..4000)
            .map(|i| 1.02f32.powi(i - 2000))
            .map(|s| Aabb::new(Vec3A::splat(s), Vec3A::splat(1.01 * s)))
            .collect();
        check(&boxes);
    }

    #[test]
    fn random_boxes_are_split_better_than_in_half() {
        let boxes: Vec<Aabb> = (0..2000)
            .map(|i| Vec3A::new(uniform(i, 0).powi(4), uniform(i, 1).powi(4), uniform(i, 2)))
            .map(|c| Aabb::new(c, c + 0.001))
            .collect();
        check(&boxes);
    }
}
