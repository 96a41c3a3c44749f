//! Eight-wide trees, and how a binary tree becomes one.

use arrayvec::ArrayVec;
use obvhs::{aabb::Aabb, bvh2::Bvh2};
use rayon::prelude::*;

use super::{
    lanes::WIDTH,
    lines::{self, LEAF, Line, MAX_LINES, lines_of},
    memory::{self, Room},
    parts::Part,
    plan::{LeafSize, Plan},
};

/// Down to this level of the wide tree subtrees are written in parallel.
const PARALLEL_LEVELS: usize = 3;

/// Four cache lines.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub struct Node {
    /// Of the children: min x, max x, min y, max y, min z, max z. Unused children have inverted infinite bounds.
    pub bounds: [[f32; WIDTH]; 6],
    /// [Words](super::lines) of them. Unused children are leaves without a tag, in which there is nothing: no ray, NaN or not, leads
    /// astray.
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

/// Lines of a [`Node`].
pub const NODE: usize = lines_of::<Node>();

/// The eight-wide tree: its root is the first line. Empty where `tree` is.
///
/// `leaf` adds what it makes of the parts with these numbers to the lines that there are so far, and returns the leaf's tag.
///
/// No deeper than [`MAX_DEPTH`](super::top_down::MAX_DEPTH), since `tree` is not.
///
/// # Panics
/// Where more than [`MAX_LINES`] are planned.
pub fn collapse(
    tree: &Bvh2,
    parts: &[Part],
    size: LeafSize,
    leaf: impl Fn(&mut Vec<u32>, &mut Vec<Line>) -> u32 + Sync,
) -> Vec<Line> {
    if tree.nodes.is_empty() {
        return Vec::new();
    }
    let plan = Plan::new(tree, size);
    assert!(plan.lines <= MAX_LINES, "too much for one tree");
    memory::filled(plan.lines, |room| {
        // SAFETY: the root is written when it is known.
        let (_, place) = unsafe { room.take(NODE) };
        let writer = Writer { tree, parts, plan: &plan, room, leaf: &leaf };
        place.write_copy_of_slice(lines::of(&[writer.top(0, PARALLEL_LEVELS)]));
    })
}

/// What one thread writes of a subtree, to be copied to its place while it is in the cache. Words of nodes count from its first node,
/// those of leaves from its first leaf.
#[derive(Default)]
struct Chunk {
    nodes: Vec<Node>,
    leaves: Vec<Line>,
}

impl Chunk {
    /// Copies it there; what is to be added to words of its nodes and of its leaves is added, and to `word`, which is given back.
    fn placed(mut self, room: &Room<Line>, mut word: u32) -> u32 {
        // SAFETY: it is written below.
        let (nodes, place) = unsafe { room.take(NODE * self.nodes.len() + self.leaves.len()) };
        let leaves = nodes + NODE * self.nodes.len();
        for word in self.nodes.iter_mut().flat_map(|node| &mut node.child).chain([&mut word]) {
            *word += match *word {
                LEAF => 0, // unused
                leaf if leaf & LEAF != 0 => leaves as u32,
                _ => nodes as u32,
            };
        }
        let (to_nodes, to_leaves) = place.split_at_mut(NODE * self.nodes.len());
        to_nodes.write_copy_of_slice(lines::of(&self.nodes));
        to_leaves.write_copy_of_slice(&self.leaves);
        word
    }
}

struct Writer<'a, 'b, F> {
    tree: &'a Bvh2,
    parts: &'a [Part],
    plan: &'a Plan,
    /// Where a subtree gets its place is a matter of which thread is first. Nothing else depends on that.
    room: &'a Room<'b, Line>,
    leaf: &'a F,
}

impl<F> Writer<'_, '_, F> {
    /// The wide node that stands for node `root` of the binary tree; all below it is in its place.
    fn top(&self, root: u32, parallel: usize) -> Node
    where
        F: Fn(&mut Vec<u32>, &mut Vec<Line>) -> u32 + Sync,
    {
        let children = self.children(root);
        let mut node = self.around(&children);
        node.child.par_iter_mut().zip(children.par_iter()).for_each(|(word, &child)| {
            let is_leaf = self.plan.is_leaf(child);
            if !is_leaf && parallel > 0 {
                *word = self.room.add(lines::of(&[self.top(child, parallel - 1)])) as u32;
                return;
            }
            let mut chunk = Chunk::default();
            let first =
                if is_leaf { self.leaf(child, &mut chunk.leaves) } else { self.node(child, &mut chunk) };
            *word = chunk.placed(self.room, first);
        });
        node
    }

    /// The wide node that stands for node `root` of the binary tree, and all below it, behind what there is; its word.
    fn node(&self, root: u32, chunk: &mut Chunk) -> u32
    where
        F: Fn(&mut Vec<u32>, &mut Vec<Line>) -> u32,
    {
        let index = chunk.nodes.len();
        chunk.nodes.push(EMPTY);
        let children = self.children(root);
        let mut node = self.around(&children);
        for (lane, &child) in children.iter().enumerate() {
            node.child[lane] = match self.plan.is_leaf(child) {
                true => self.leaf(child, &mut chunk.leaves),
                false => self.node(child, chunk),
            };
        }
        chunk.nodes[index] = node;
        (NODE * index) as u32
    }

    /// Which nodes of the binary tree are the children of the wide node that stands for `root`.
    fn children(&self, root: u32) -> ArrayVec<u32, WIDTH> {
        let mut children = ArrayVec::new();
        match self.tree.nodes[root as usize].is_leaf() {
            true => children.push(root), // a lone leaf still hangs from a node
            false => self.split(root, WIDTH, &mut children),
        }
        // Rays that look for any hit visit children in this order: first leaves, where they may end at once, and large ones.
        let key = |child: u32| {
            let area = self.tree.nodes[child as usize].aabb().half_area();
            (!self.plan.is_leaf(child), !area.to_bits())
        };
        let mut keyed: ArrayVec<_, WIDTH> = children.iter().map(|&child| (key(child), child)).collect();
        keyed.sort_by_key(|(key, _)| *key);
        keyed.into_iter().map(|(_, child)| child).collect()
    }

    /// A node with the bounds of its children.
    fn around(&self, children: &[u32]) -> Node {
        let mut node = EMPTY;
        for (lane, &child) in children.iter().enumerate() {
            let Aabb { min, max } = *self.tree.nodes[child as usize].aabb();
            for axis in 0..3 {
                node.bounds[2 * axis][lane] = min[axis];
                node.bounds[2 * axis + 1][lane] = max[axis];
            }
        }
        node
    }

    /// The roots of the best forest of at most `roots`.
    fn forest(&self, node: u32, roots: usize, out: &mut ArrayVec<u32, WIDTH>) {
        if roots == 1 || self.tree.nodes[node as usize].is_leaf() {
            out.push(node);
        } else if self.plan.left(node, roots) == 0 {
            self.forest(node, roots - 1, out);
        } else {
            self.split(node, roots, out);
        }
    }

    fn split(&self, node: u32, roots: usize, out: &mut ArrayVec<u32, WIDTH>) {
        let left = self.plan.left(node, roots);
        let first = self.tree.nodes[node as usize].first_index;
        self.forest(first, left, out);
        self.forest(first + 1, roots - left, out);
    }

    fn leaf(&self, node: u32, leaves: &mut Vec<Line>) -> u32
    where
        F: Fn(&mut Vec<u32>, &mut Vec<Line>) -> u32,
    {
        let mut numbers = Vec::with_capacity(16);
        self.gather(node, &mut numbers);
        let first = leaves.len();
        lines::leaf((self.leaf)(&mut numbers, leaves), first)
    }

    /// The numbers of all parts below a node.
    fn gather(&self, node: u32, numbers: &mut Vec<u32>) {
        let node = &self.tree.nodes[node as usize];
        let first = node.first_index as usize;
        if node.is_leaf() {
            numbers.extend(self.parts[first..first + node.prim_count as usize].iter().map(Part::number));
        } else {
            self.gather(node.first_index, numbers);
            self.gather(node.first_index + 1, numbers);
        }
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3A;

    use super::*;
    use crate::accel::top_down;
    use crate::sampling::stats::uniform;

    #[derive(Clone, Copy)]
    #[repr(C, align(64))]
    struct Numbers([u32; 16]);

    /// Every primitive sits in one leaf, inside all bounds above it.
    #[test]
    fn keeps_every_primitive_inside_its_bounds() {
        for n in [1u32, 2, 7, 9, 700, 30_000] {
            let boxes: Vec<Aabb> = (0..n)
                .map(|i| Vec3A::new(uniform(i, 0), uniform(i, 1), uniform(i, 2)))
                .map(|c| Aabb::new(c, c + 0.01))
                .collect();
            let mut parts: Vec<Part> = (0..).zip(&boxes).map(|(i, b)| Part::new(b, i)).collect();
            let tree = top_down::build(&mut parts, 4, &|parts| parts.len());
            let size = LeafSize { block: 4, max_blocks: 2, lines: 1 };
            let lines = collapse(&tree, &parts, size, |numbers, lines| {
                let mut leaf = Numbers([u32::MAX; 16]);
                leaf.0[..numbers.len()].copy_from_slice(numbers);
                lines.extend_from_slice(lines::of(&[leaf]));
                1
            });
            let mut seen = vec![0; n as usize];
            let mut open = vec![(0u32, Aabb::LARGEST)];
            while let Some((word, outer)) = open.pop() {
                // SAFETY: `collapse` says what is there.
                let node = unsafe { &*lines[word as usize..][..NODE].as_ptr().cast::<Node>() };
                for lane in (0..WIDTH).filter(|&i| node.bounds[0][i] <= node.bounds[1][i]) {
                    let [x0, x1, y0, y1, z0, z1] = node.bounds.map(|b| b[lane]);
                    let inner = Aabb::new(Vec3A::new(x0, y0, z0), Vec3A::new(x1, y1, z1));
                    assert_eq!(inner.union(&outer).min, outer.min);
                    assert_eq!(inner.union(&outer).max, outer.max);
                    if node.child[lane] & LEAF == 0 {
                        open.push((node.child[lane], inner));
                        continue;
                    }
                    // SAFETY: `collapse` says what is there.
                    let leaf = unsafe { *lines[lines::line(node.child[lane])..].as_ptr().cast::<Numbers>() };
                    for p in leaf.0.into_iter().filter(|&p| p != u32::MAX) {
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
