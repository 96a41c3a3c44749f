//! A tree over the local lights: chooses one for a point by walking down it, at each node in proportion to its eight
//! children's [importance](Weighers::importance) there.
//!
//! Source: Conty Estevez, Kulla 2018, *Importance Sampling of Many Lights with Adaptive Tree Splitting*, without the
//! adaptive splitting: one light a choice. Their binary tree is built first; then nodes take in the children of their costliest
//! children until they have eight, which are weighed at once: a third of the steps, each little dearer.
//!
//! The probability of a light is the product of the choices on the way from its leaf up.

use glam::Vec3;

use super::{
    cluster::{Cluster, WIDTH, Weighers},
    receiver::Receiver,
};
use crate::sampling::distribution::ONE_MINUS_EPSILON;

const BUCKETS: usize = 12;

/// Sets larger than this are split by two threads.
const PARALLEL: usize = 4096;

/// Below this level sets are halved by count, so that no arrangement of lights makes the tree deep.
const LAST_COSTED_LEVEL: u32 = 48;

/// A child that is a light, not a node.
const LIGHT: u32 = 1 << 31;

/// The place of the root's node in its parent.
const NOWHERE: u32 = u32::MAX;

#[derive(Clone, Debug)]
pub struct Tree {
    nodes: Vec<Node>,
    /// The place of each light: node × 8 + child.
    places: Vec<u32>,
}

#[derive(Clone, Debug)]
struct Node {
    weighers: Weighers,
    /// [`LIGHT`] and a light's index, or a node's.
    children: [u32; WIDTH],
    /// In the node above: node × 8 + child.
    place: u32,
}

/// What [`Tree::sample`] chose.
#[derive(Clone, Copy, Debug)]
pub struct Choice {
    pub light: usize,
    pub probability: f32,
    /// The same for a receiver of which nothing is known.
    pub for_any: f32,
}

#[derive(Clone, Copy)]
struct Item {
    cluster: Cluster,
    center: Vec3,
    light: u32,
}

/// A node of the binary tree that the other is made from.
#[derive(Clone, Copy)]
struct Half {
    cluster: Cluster,
    next: Next,
}

#[derive(Clone, Copy)]
enum Next {
    /// Index of two siblings.
    Pair(u32),
    Light(u32),
}

impl Tree {
    /// Light i of the tree is `lights[i]`. `None` without lights.
    pub fn new(lights: &[Cluster]) -> Option<Self> {
        let mut items: Vec<Item> = (0..)
            .zip(lights)
            .map(|(light, cluster)| Item { cluster: *cluster, center: cluster.center(), light })
            .collect();
        let first = *items.first()?;
        let empty = Half { cluster: first.cluster, next: Next::Light(0) };
        let mut pairs = vec![[empty; 2]; items.len() - 1];
        let root = build(&mut items, &mut pairs, 0, 0);
        let mut tree = Self { nodes: Vec::new(), places: vec![0; lights.len()] };
        tree.widen(&[root], &pairs);
        Some(tree)
    }

    /// Adds the nodes under `root`, breadth first.
    fn widen(&mut self, root: &[Half], pairs: &[[Half; 2]]) {
        let mut open = std::collections::VecDeque::from([(root.to_vec(), NOWHERE)]);
        while let Some((mut children, place)) = open.pop_front() {
            while children.len() < WIDTH {
                let splittable = |half: &Half| match half.next {
                    Next::Pair(pair) => Some((half.cluster.cost(), pair)),
                    Next::Light(_) => None,
                };
                let costs = children.iter().enumerate().filter_map(|(i, half)| Some((i, splittable(half)?)));
                let Some((i, (_, pair))) = costs.max_by(|a, b| a.1.0.total_cmp(&b.1.0)) else { break };
                let [a, b] = pairs[pair as usize];
                children[i] = a;
                children.push(b);
            }
            let node = self.nodes.len() as u32;
            let mut words = [LIGHT; WIDTH];
            for (i, child) in (0..).zip(&children) {
                let here = node * WIDTH as u32 + i;
                words[i as usize] = match child.next {
                    Next::Light(light) => {
                        self.places[light as usize] = here;
                        LIGHT | light
                    }
                    Next::Pair(pair) => {
                        open.push_back((pairs[pair as usize].to_vec(), here));
                        node + open.len() as u32
                    }
                };
            }
            let weighers = Weighers::new(children.iter().map(|child| &child.cluster));
            self.nodes.push(Node { weighers, children: words, place });
        }
    }

    /// A light for `p`; `None` where none reaches it, or the receiver scatters none of what does. `u` is uniform in [0, 1).
    pub fn sample(&self, p: Vec3, receiver: &Receiver, mut u: f32) -> Option<Choice> {
        if self.places.len() == 1 {
            return Some(Choice { light: 0, probability: 1.0, for_any: 1.0 });
        }
        let mut node = &self.nodes[0];
        let (mut probability, mut for_any) = (1.0, 1.0);
        loop {
            let (importance, weights) = node.weighers.importance_for(p, Some(receiver));
            let total = sum(&weights);
            // (NaN or infinite where lights are out of all proportion)
            if !(total > 0.0 && total.is_finite()) {
                return None;
            }
            let mut left = u * total;
            let mut chosen = None;
            for (i, &weight) in weights.iter().enumerate() {
                if weight > 0.0 {
                    chosen = Some((i, weight));
                    if left < weight {
                        break;
                    }
                    left -= weight;
                }
            }
            let (child, weight) = chosen?;
            probability *= weight / total;
            for_any *= importance[child] / sum(&importance);
            u = (left / weight).min(ONE_MINUS_EPSILON);
            let word = node.children[child];
            if word & LIGHT != 0 {
                return Some(Choice { light: (word & !LIGHT) as usize, probability, for_any });
            }
            node = &self.nodes[word as usize];
        }
    }

    /// The probability with which [`sample`](Self::sample) would choose a light at `p` for a receiver of which nothing is known.
    pub fn probability(&self, p: Vec3, light: usize) -> f32 {
        let Some(&leaf) = self.places.get(light) else { return 0.0 };
        if self.places.len() == 1 {
            return 1.0;
        }
        let (mut place, mut probability) = (leaf, 1.0);
        while place != NOWHERE {
            let node = &self.nodes[place as usize / WIDTH];
            let importance = node.weighers.importance(p);
            let total = sum(&importance);
            if total <= 0.0 {
                return 0.0;
            }
            probability *= importance[place as usize % WIDTH] / total;
            place = node.place;
        }
        probability
    }

    /// What all lights together could give at `p`, roughly, W/m².
    pub fn irradiance(&self, p: Vec3) -> f32 {
        sum(&self.nodes[0].weighers.importance(p))
    }
}

fn sum(importance: &[f32; WIDTH]) -> f32 {
    importance.iter().sum()
}

/// Builds the tree over `items` into `pairs` (one fewer), the first of which is pair number `offset`.
fn build(items: &mut [Item], pairs: &mut [[Half; 2]], offset: u32, level: u32) -> Half {
    let Some((pair, below)) = pairs.split_first_mut() else {
        let Item { cluster, light, .. } = items[0];
        return Half { cluster, next: Next::Light(light) };
    };
    let (count, middle) = (items.len(), split(items, level));
    let (first, second) = items.split_at_mut(middle);
    let (below_first, below_second) = below.split_at_mut(middle - 1);
    let mut build_first = || build(first, below_first, offset + 1, level + 1);
    let mut build_second = || build(second, below_second, offset + middle as u32, level + 1);
    let (a, b) = if count > PARALLEL {
        rayon::join(build_first, build_second)
    } else {
        (build_first(), build_second())
    };
    *pair = [a, b];
    Half { cluster: a.cluster.union(&b.cluster), next: Next::Pair(offset) }
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
mod tests;
