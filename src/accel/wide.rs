//! Eight-wide trees, and how a binary tree becomes one.
//!
//! Which nodes of the binary tree survive is chosen by dynamic programming for the lowest surface area cost (Ylitie,
//! Karras, Laine, "Efficient Incoherent Ray Traversal on GPUs Through Compressed Wide BVHs", HPG 2017, section 3.2).

use obvhs::{aabb::Aabb, bvh2::Bvh2};

use super::{binary, lanes::WIDTH};

/// Child word: this bit and what the leaf's owner makes of the rest, or the index of a node.
pub const LEAF: u32 = 1 << 31;

/// Cost of a visit to a node and of one leaf block. At 0.6 to 1, speed is the same within a few per cent, and memory least at 0.6.
const NODE_COST: f32 = 1.0;
const BLOCK_COST: f32 = 0.7;

/// Four cache lines.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub struct Node {
    /// Of the children: min x, max x, min y, max y, min z, max z. Unused children have inverted infinite bounds.
    pub bounds: [[f32; WIDTH]; 6],
    /// Unused children are [`LEAF`] with a rest of 0, which every owner can visit without harm: no ray, NaN or not, leads astray.
    pub child: [u32; WIDTH],
}

const EMPTY: Node = Node {
    bounds: [
        [f32::INFINITY; WIDTH],
        [f32::NEG_INFINITY; WIDTH],
        [f32::INFINITY; WIDTH],
        [f32::NEG_INFINITY; WIDTH],
        [f32::INFINITY; WIDTH],
        [f32::NEG_INFINITY; WIDTH],
    ],
    child: [LEAF; WIDTH],
};

/// What a leaf can hold.
#[derive(Clone, Copy)]
pub struct LeafSize {
    /// Primitives tested together, at the cost of one block.
    pub block: usize,
    pub max_blocks: usize,
}

/// The nodes of the eight-wide tree, root first, depth first. `leaf` stores the primitives it is given and returns the
/// child word's lower 31 bits; it is called in depth-first order.
///
/// No deeper than [`binary::MAX_DEPTH`], since `tree` is not.
pub fn collapse(tree: &Bvh2, size: LeafSize, leaf: impl FnMut(&[u32]) -> u32) -> Vec<Node> {
    if tree.nodes.is_empty() {
        return Vec::new();
    }
    debug_assert!(!binary::deeper(tree, 0, binary::MAX_DEPTH));
    let plan = Plan::new(tree, size);
    let mut emitter = Emitter { tree, plan: &plan, leaf, nodes: Vec::new(), primitives: Vec::new() };
    emitter.node(0);
    emitter.nodes.shrink_to_fit();
    emitter.nodes
}

/// For each node of the binary tree, the best way to make a forest of at most j roots out of it, j = 1 … 8.
struct Plan {
    choices: Vec<Choice>,
}

#[derive(Clone, Copy, Default)]
struct Choice {
    /// Primitives below.
    count: u32,
    /// As a single root: a leaf rather than a node.
    leaf: bool,
    /// `left[j]`: how many of j roots go to the left child; 0 says that j − 1 roots do as well.
    left: [u8; WIDTH + 1],
}

impl Plan {
    fn new(tree: &Bvh2, size: LeafSize) -> Self {
        let mut choices = vec![Choice::default(); tree.nodes.len()];
        // costs[node][j − 1], j = 1 … 7: of at most j roots
        let mut costs = vec![[0f32; WIDTH - 1]; tree.nodes.len()];
        for index in parents_first(tree).into_iter().rev().map(|i| i as usize) {
            let node = &tree.nodes[index];
            let area = node.aabb().half_area();
            let leaf_cost = |count: u32| match (count as usize).div_ceil(size.block) {
                blocks if blocks > size.max_blocks => f32::INFINITY,
                blocks => area * BLOCK_COST * blocks as f32,
            };
            if node.is_leaf() {
                choices[index] = Choice { count: 1, leaf: true, left: [0; WIDTH + 1] };
                costs[index] = [leaf_cost(1); WIDTH - 1];
                continue;
            }
            let first = node.first_index as usize;
            let (left, right) = (costs[first], costs[first + 1]);
            let mut choice = Choice {
                count: choices[first].count.saturating_add(choices[first + 1].count),
                ..Choice::default()
            };
            let mut shared = [f32::INFINITY; WIDTH + 1];
            for roots in 2..=WIDTH {
                for to_left in 1..roots {
                    let cost = left[to_left - 1] + right[roots - to_left - 1];
                    if cost < shared[roots] {
                        (shared[roots], choice.left[roots]) = (cost, to_left as u8);
                    }
                }
            }
            let as_node = shared[WIDTH] + area * NODE_COST;
            let as_leaf = leaf_cost(choice.count);
            choice.leaf = as_leaf <= as_node;
            costs[index][0] = as_leaf.min(as_node);
            for roots in 2..WIDTH {
                let fewer = costs[index][roots - 2];
                if shared[roots] < fewer {
                    costs[index][roots - 1] = shared[roots];
                } else {
                    (costs[index][roots - 1], choice.left[roots]) = (fewer, 0);
                }
            }
            choices[index] = choice;
        }
        Self { choices }
    }
}

fn parents_first(tree: &Bvh2) -> Vec<u32> {
    let mut order = Vec::with_capacity(tree.nodes.len());
    let mut open = vec![0];
    while let Some(index) = open.pop() {
        order.push(index);
        let node = &tree.nodes[index as usize];
        if !node.is_leaf() {
            open.extend([node.first_index + 1, node.first_index]);
        }
    }
    order
}

struct Emitter<'a, F> {
    tree: &'a Bvh2,
    plan: &'a Plan,
    leaf: F,
    nodes: Vec<Node>,
    /// Of the leaf being written.
    primitives: Vec<u32>,
}

impl<F: FnMut(&[u32]) -> u32> Emitter<'_, F> {
    /// Writes the wide node that stands for node `root` of the binary tree.
    fn node(&mut self, root: u32) -> u32 {
        let index = self.nodes.len();
        self.nodes.push(EMPTY);
        let mut children = Vec::with_capacity(WIDTH);
        let binary = &self.tree.nodes[root as usize];
        if binary.is_leaf() {
            children.push(root); // a lone primitive still hangs from a node
        } else {
            self.split(root, WIDTH, &mut children);
        }
        let mut node = EMPTY;
        for (lane, &child) in children.iter().enumerate() {
            let Aabb { min, max } = *self.tree.nodes[child as usize].aabb();
            for axis in 0..3 {
                node.bounds[2 * axis][lane] = min[axis];
                node.bounds[2 * axis + 1][lane] = max[axis];
            }
            node.child[lane] = match self.plan.choices[child as usize].leaf {
                true => self.leaf(child),
                false => self.node(child),
            };
        }
        self.nodes[index] = node;
        index as u32
    }

    /// The roots of the best forest of at most `roots`.
    fn forest(&self, node: u32, roots: usize, out: &mut Vec<u32>) {
        if roots == 1 || self.tree.nodes[node as usize].is_leaf() {
            out.push(node);
        } else if self.plan.choices[node as usize].left[roots] == 0 {
            self.forest(node, roots - 1, out);
        } else {
            self.split(node, roots, out);
        }
    }

    fn split(&self, node: u32, roots: usize, out: &mut Vec<u32>) {
        let left = self.plan.choices[node as usize].left[roots] as usize;
        let first = self.tree.nodes[node as usize].first_index;
        self.forest(first, left, out);
        self.forest(first + 1, roots - left, out);
    }

    fn leaf(&mut self, node: u32) -> u32 {
        self.primitives.clear();
        let mut open = vec![node];
        while let Some(index) = open.pop() {
            let node = &self.tree.nodes[index as usize];
            if node.is_leaf() {
                self.primitives.push(node.first_index);
            } else {
                open.extend([node.first_index + 1, node.first_index]);
            }
        }
        LEAF | (self.leaf)(&self.primitives)
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3A;

    use super::*;
    use crate::sampling::stats::uniform;

    /// Every primitive sits in one leaf, inside all bounds above it.
    #[test]
    fn keeps_every_primitive_inside_its_bounds() {
        for n in [1u32, 2, 7, 9, 700] {
            let boxes: Vec<Aabb> = (0..n)
                .map(|i| Vec3A::new(uniform(i, 0), uniform(i, 1), uniform(i, 2)))
                .map(|c| Aabb::new(c, c + 0.02))
                .collect();
            let tree = binary::build(&boxes, &(0..n).collect::<Vec<_>>());
            let mut leaves: Vec<Vec<u32>> = Vec::new();
            let size = LeafSize { block: 4, max_blocks: 2 };
            let nodes = collapse(&tree, size, |primitives| {
                leaves.push(primitives.to_vec());
                leaves.len() as u32 - 1
            });
            let mut seen = vec![0; n as usize];
            let mut open = vec![(0u32, Aabb::LARGEST)];
            while let Some((index, outer)) = open.pop() {
                let node = &nodes[index as usize];
                for lane in (0..WIDTH).filter(|&i| node.bounds[0][i] <= node.bounds[1][i]) {
                    let [x0, x1, y0, y1, z0, z1] = node.bounds.map(|b| b[lane]);
                    let inner = Aabb::new(Vec3A::new(x0, y0, z0), Vec3A::new(x1, y1, z1));
                    assert_eq!(inner.union(&outer).min, outer.min);
                    assert_eq!(inner.union(&outer).max, outer.max);
                    if node.child[lane] & LEAF == 0 {
                        open.push((node.child[lane], inner));
                        continue;
                    }
                    let leaf = &leaves[(node.child[lane] & !LEAF) as usize];
                    assert!(leaf.len() <= 8);
                    for &p in leaf {
                        seen[p as usize] += 1;
                        assert_eq!(inner.union(&boxes[p as usize]).min, inner.min);
                        assert_eq!(inner.union(&boxes[p as usize]).max, inner.max);
                    }
                }
            }
            assert!(seen.iter().all(|&k| k == 1), "{n}: {seen:?}");
        }
    }
}
