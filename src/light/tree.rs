//! A tree over the local lights: chooses one for a point by walking down it, at each node in proportion to the two
//! halves' [importance](Weigher::importance) there.
//!
//! Source: Conty Estevez, Kulla 2018, *Importance Sampling of Many Lights with Adaptive Tree Splitting*, without the
//! adaptive splitting: one light a choice.
//!
//! Nodes come in pairs of siblings, so that a choice touches neighbouring memory: node 0 is the root, nodes 1 + 2k
//! and 2 + 2k are pair k. The probability of a light is the product of the choices on the way from its leaf up.

use glam::Vec3;

use super::cluster::{Cluster, Weigher};
use crate::sampling::distribution::ONE_MINUS_EPSILON;

const BUCKETS: usize = 12;

/// Sets larger than this are split by two threads.
const PARALLEL: usize = 4096;

/// Below this level sets are halved by count, so that no arrangement of lights makes the tree deep.
const LAST_COSTED_LEVEL: u32 = 48;

#[derive(Clone, Debug)]
pub struct Tree {
    nodes: Vec<Node>,
    /// The node above each pair.
    parents: Vec<u32>,
    /// The leaf of each light.
    leaves: Vec<u32>,
}

#[derive(Clone, Copy, Debug, Default)]
struct Node {
    weigher: Weigher,
    next: Next,
}

#[derive(Clone, Copy, Debug)]
enum Next {
    Pair(u32),
    Light(u32),
}

impl Default for Next {
    fn default() -> Self {
        Self::Light(0)
    }
}

#[derive(Clone, Copy)]
struct Item {
    cluster: Cluster,
    center: Vec3,
    light: u32,
}

impl Tree {
    /// Light i of the tree is `lights[i]`. `None` without lights.
    pub fn new(lights: &[Cluster]) -> Option<Self> {
        let mut items: Vec<Item> = (0..)
            .zip(lights)
            .map(|(light, cluster)| Item { cluster: *cluster, center: cluster.center(), light })
            .collect();
        if items.is_empty() {
            return None;
        }
        let mut pairs = vec![[Node::default(); 2]; items.len() - 1];
        let (root, _) = build(&mut items, &mut pairs, 0, 0);
        let nodes: Vec<Node> = std::iter::once(root).chain(pairs.into_iter().flatten()).collect();
        let mut parents = vec![0; lights.len() - 1];
        let mut leaves = vec![0; lights.len()];
        for (i, node) in (0..).zip(&nodes) {
            match node.next {
                Next::Pair(pair) => parents[pair as usize] = i,
                Next::Light(light) => leaves[light as usize] = i,
            }
        }
        Some(Self { nodes, parents, leaves })
    }

    /// A light for `p` and the probability of choosing it; `None` where none reaches it. `u` is uniform in [0, 1).
    pub fn sample(&self, p: Vec3, mut u: f32) -> Option<(usize, f32)> {
        let mut node = &self.nodes[0];
        let mut probability = 1.0;
        loop {
            let pair = match node.next {
                Next::Light(light) => return Some((light as usize, probability)),
                Next::Pair(pair) => &self.nodes[1 + 2 * pair as usize..][..2],
            };
            let [first, second] = [0, 1].map(|i| pair[i].weigher.importance(p));
            let share = share(first, second)?;
            if u < share {
                u /= share;
                probability *= share;
                node = &pair[0];
            } else {
                u = ((u - share) / (1.0 - share)).min(ONE_MINUS_EPSILON);
                probability *= 1.0 - share;
                node = &pair[1];
            }
        }
    }

    /// The probability with which [`sample`](Self::sample) chooses a light at `p`.
    pub fn probability(&self, p: Vec3, light: usize) -> f32 {
        let Some(&leaf) = self.leaves.get(light) else { return 0.0 };
        let (mut node, mut probability) = (leaf as usize, 1.0);
        while node > 0 {
            let pair = (node - 1) / 2;
            let [first, second] = [1, 2].map(|i| self.nodes[2 * pair + i].weigher.importance(p));
            let Some(share) = share(first, second) else { return 0.0 };
            probability *= if node == 2 * pair + 1 { share } else { 1.0 - share };
            node = self.parents[pair] as usize;
        }
        probability
    }

    /// What all lights together could give at `p`, roughly, W/m².
    pub fn irradiance(&self, p: Vec3) -> f32 {
        self.nodes[0].weigher.importance(p)
    }
}

/// Of the first of two; `None` where neither counts.
fn share(first: f32, second: f32) -> Option<f32> {
    let sum = first + second;
    (sum > 0.0).then(|| first / sum)
}

/// Builds the tree over `items` into `pairs` (one fewer), the first of which is pair number `offset`.
fn build(items: &mut [Item], pairs: &mut [[Node; 2]], offset: u32, level: u32) -> (Node, Cluster) {
    let Some((pair, below)) = pairs.split_first_mut() else {
        let Item { cluster, light, .. } = items[0];
        return (Node { weigher: Weigher::from(&cluster), next: Next::Light(light) }, cluster);
    };
    let (count, middle) = (items.len(), split(items, level));
    let (first, second) = items.split_at_mut(middle);
    let (below_first, below_second) = below.split_at_mut(middle - 1);
    let mut build_first = || build(first, below_first, offset + 1, level + 1);
    let mut build_second = || build(second, below_second, offset + middle as u32, level + 1);
    let ((a, a_cluster), (b, b_cluster)) = if count > PARALLEL {
        rayon::join(build_first, build_second)
    } else {
        (build_first(), build_second())
    };
    *pair = [a, b];
    let cluster = a_cluster.union(&b_cluster);
    (Node { weigher: Weigher::from(&cluster), next: Next::Pair(offset) }, cluster)
}

/// Reorders at least two items and returns where the second half starts: the cheapest of the bounds between
/// [`BUCKETS`] equal slabs along each axis, or halves by count where no bound separates them.
fn split(items: &mut [Item], level: u32) -> usize {
    let half = items.len() / 2;
    if level > LAST_COSTED_LEVEL {
        return half;
    }
    let min = items.iter().map(|item| item.center).fold(Vec3::INFINITY, Vec3::min);
    let max = items.iter().map(|item| item.center).fold(Vec3::NEG_INFINITY, Vec3::max);
    let extent = max - min;
    let bucket = |item: &Item, axis: usize| {
        let x = (item.center[axis] - min[axis]) / extent[axis];
        ((x * BUCKETS as f32) as usize).min(BUCKETS - 1)
    };
    let mut best = (f32::INFINITY, 0, 0);
    for axis in (0..3).filter(|&axis| extent[axis] > 0.0) {
        let mut buckets = [None; BUCKETS];
        for item in items.iter() {
            let bucket = &mut buckets[bucket(item, axis)];
            *bucket = join(bucket, &Some(item.cluster));
        }
        let mut above = [None; BUCKETS];
        for i in (1..BUCKETS).rev() {
            above[i - 1] = join(&above[i], &buckets[i]);
        }
        let mut below = None;
        for i in 0..BUCKETS - 1 {
            below = join(&below, &buckets[i]);
            if let (Some(below), Some(above)) = (&below, &above[i]) {
                // Thin slabs are worth less: Conty Estevez and Kulla, equation 2.
                let cost = (below.cost() + above.cost()) * extent.max_element() / extent[axis];
                if cost < best.0 {
                    best = (cost, axis, i);
                }
            }
        }
    }
    let (cost, axis, last) = best;
    if cost == f32::INFINITY {
        return half;
    }
    let mut middle = 0;
    for i in 0..items.len() {
        if bucket(&items[i], axis) <= last {
            items.swap(i, middle);
            middle += 1;
        }
    }
    middle
}

fn join(a: &Option<Cluster>, b: &Option<Cluster>) -> Option<Cluster> {
    match (a, b) {
        (Some(a), Some(b)) => Some(a.union(b)),
        (a, b) => a.or(*b),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::{
        stats::{chi2_p_value, r3, uniform},
        warp::uniform_sphere,
    };
    use glam::Vec2;

    /// Lamps of several kinds in a room of 10 m.
    fn room(count: u32) -> Vec<Cluster> {
        let lamp = |i: u32| {
            let at = 10.0 * Vec3::from(r3(i));
            let [a, b, power] = r3(i + 5000);
            let axis = uniform_sphere(Vec2::new(a, b));
            match i % 3 {
                0 => Cluster::round([at, at], power),
                1 => Cluster::flat([at - 0.1, at + 0.1], axis, power, i % 6 == 1),
                _ => Cluster::beam(at, axis, 0.2, 0.6, power),
            }
        };
        (0..count).map(lamp).collect()
    }

    #[test]
    fn choices_follow_the_probabilities() {
        for count in [1, 2, 5, 120] {
            let tree = Tree::new(&room(count)).expect("lamps");
            for p in [Vec3::splat(5.0), Vec3::new(-3.0, 2.0, 8.0)] {
                // The last cell: walks that end where neither half reaches p, though their union seemed to.
                let mut expected: Vec<f64> =
                    (0..count as usize).map(|i| tree.probability(p, i) as f64).collect();
                let found = expected.iter().sum::<f64>();
                assert!(found > 0.5 && found < 1.0 + 1e-4, "{count} lamps at {p}: {found}");
                expected.push((1.0 - found).max(0.0));
                let n = 1 << 16;
                let mut observed = vec![0.0; count as usize + 1];
                for i in 0..n {
                    let chosen = tree.sample(p, uniform(i, 0));
                    if let Some((light, probability)) = chosen {
                        assert!((probability / expected[light] as f32 - 1.0).abs() < 1e-4);
                    }
                    observed[chosen.map_or(count as usize, |(light, _)| light)] += 1.0;
                }
                let expected: Vec<f64> = expected.iter().map(|e| e * n as f64).collect();
                assert!(chi2_p_value(&observed, &expected) > 1e-4, "{count} lamps at {p}");
            }
        }
    }

    #[test]
    fn a_near_lamp_is_preferred_to_far_ones() {
        let lamps: Vec<_> =
            (0..200).map(|i| Cluster::round([Vec3::new(i as f32, 0.0, 0.0); 2], 1.0)).collect();
        let tree = Tree::new(&lamps).expect("lamps");
        for i in [0, 60, 199] {
            let probability = tree.probability(Vec3::new(i as f32, 0.1, 0.0), i);
            assert!(probability > 0.1, "lamp {i}: {probability}");
        }
    }

    #[test]
    fn odd_arrangements_make_a_whole_tree() {
        let at = |x: f32| Cluster::round([Vec3::new(x, 0.0, 0.0); 2], 1.0);
        let same: Vec<_> = (0..1000).map(|_| at(1.0)).collect();
        let powers: Vec<_> = (0..76).map(|i| at(10f32.powi(i - 38))).collect();
        let far: Vec<_> = (0..50).map(|i| at(if i % 6 == 1 { f32::MAX } else { f32::MIN })).collect();
        for lamps in [same, powers, far] {
            let tree = Tree::new(&lamps).expect("lamps");
            let mut leaves = tree.leaves.clone();
            leaves.sort_unstable();
            leaves.dedup();
            assert_eq!(leaves.len(), lamps.len());
            let sum: f32 = (0..lamps.len()).map(|i| tree.probability(Vec3::Y, i)).sum();
            assert!((sum - 1.0).abs() < 1e-3 || tree.sample(Vec3::Y, 0.5).is_none(), "{sum}");
        }
        assert!(Tree::new(&[]).is_none());
    }

    #[test]
    fn large_trees_are_built_in_parallel_alike() {
        let lamps = room(3 * PARALLEL as u32);
        let [a, b] = [0, 1].map(|_| Tree::new(&lamps).expect("lamps"));
        assert_eq!(a.leaves, b.leaves);
        let p = Vec3::splat(3.0);
        let sum: f32 = (0..lamps.len()).map(|i| a.probability(p, i)).sum();
        assert!(sum > 0.5 && sum < 1.001, "{sum}");
    }
}
