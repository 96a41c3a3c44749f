//! Vertices told apart: an index for each triple of a position and two attributes that occurs.
//!
//! A hash table over ten million corners would miss the cache at every one. Most positions have one or two vertices, and
//! files name neighbours one after another; so each position has a chain of its own, short and near.

use std::collections::HashMap;

use super::corner::NONE;

/// Chains end here, and what more there is of a position is looked up by hash: else the hub of a wheel would cost the
/// square of its spokes.
const LONGEST: usize = 32;

#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Link {
    pub position: u32,
    pub attributes: [u32; 2],
    next: u32,
}

#[derive(Default)]
pub(super) struct Chains {
    /// By position: its newest link.
    heads: Vec<u32>,
    links: Vec<Link>,
    beyond: HashMap<[u32; 3], u32>,
}

impl Chains {
    /// The index of this triple; they count from 0 as they first occur.
    #[inline]
    pub fn index(&mut self, position: u32, attributes: [u32; 2]) -> u32 {
        let place = position as usize;
        if place >= self.heads.len() {
            // Room for those to come, as `resize` alone makes none.
            self.heads.resize((place + 1).max(self.heads.len() * 2), NONE);
        }
        let mut at = self.heads.get(place).copied().unwrap_or(NONE);
        let mut length = 0;
        while let Some(link) = self.links.get(at as usize) {
            if link.attributes == attributes {
                return at;
            }
            at = link.next;
            length += 1;
        }
        let new = self.links.len() as u32;
        let mut next = NONE;
        if length >= LONGEST {
            let [a, b] = attributes;
            let known = *self.beyond.entry([position, a, b]).or_insert(new);
            if known != new {
                return known;
            }
        } else if let Some(head) = self.heads.get_mut(place) {
            next = std::mem::replace(head, new);
        }
        self.links.push(Link { position, attributes, next });
        new
    }

    /// How many there are.
    pub fn len(&self) -> usize {
        self.links.len()
    }

    /// All of them, in the order of their indices. Then it begins anew.
    pub fn take(&mut self) -> Vec<Link> {
        for link in &self.links {
            if let Some(head) = self.heads.get_mut(link.position as usize) {
                *head = NONE;
            }
        }
        self.beyond.clear();
        std::mem::take(&mut self.links)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn triples_have_an_index_each_however_many_share_a_position() {
        let mut chains = Chains::default();
        for round in 0..2 {
            let n = 5 * LONGEST as u32;
            let all: Vec<_> = (0..n).map(|i| [7 * (i % 3), i / 3, NONE]).collect();
            for _ in 0..2 {
                let indices: Vec<u32> = all.iter().map(|&[p, a, b]| chains.index(p, [a, b])).collect();
                assert_eq!(indices, (0..n).collect::<Vec<_>>(), "round {round}");
            }
            assert_eq!(chains.len(), n as usize);
            let kept: Vec<_> =
                chains.take().iter().map(|l| [l.position, l.attributes[0], l.attributes[1]]).collect();
            assert_eq!(kept, all);
        }
    }

    #[test]
    fn a_hub_does_not_cost_the_square_of_its_spokes() {
        let start = std::time::Instant::now();
        let mut chains = Chains::default();
        (0..200_000).for_each(|i| _ = chains.index(0, [i, i]));
        assert_eq!(chains.len(), 200_000);
        assert!(start.elapsed().as_secs() < 5);
    }
}
