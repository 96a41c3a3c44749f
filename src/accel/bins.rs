//! Where to divide a set of boxes: the surface area heuristic at the borders of bins (Wald, "On fast construction of SAH-based
//! bounding volume hierarchies", RT 2007).

use glam::Vec4;
use rayon::prelude::*;

use super::parts::{Part, Span};

/// At most. Sets of a few boxes have fewer, since most would be empty.
const BINS: usize = 32;

/// Of small sets, at most: most sets are small, and more bins would have to be cleared for nothing.
const FEW: usize = 8;

/// Sets larger than this are binned in parallel, in chunks of this.
const CHUNK: usize = 1 << 16;

/// Bins of equal width between the outermost centers, on each axis.
#[derive(Clone, Copy)]
pub struct Bins {
    low: Vec4,
    scale: Vec4,
    last: Vec4,
    count: usize,
}

/// What parts fall into each bin.
struct Filling<const N: usize> {
    spans: [[Span; N]; 3],
    counts: [[u32; N]; 3],
}

/// The division of a set: what lies up to bin `last` on `axis` goes to the left.
#[derive(Clone, Copy)]
pub struct Division {
    pub axis: usize,
    last: f32,
    /// Sum of the areas of both sides, weighted with `weight` of their counts.
    pub cost: f32,
}

impl Bins {
    /// For `n` parts with their [centers](Part::center) in `centers`.
    pub fn new(centers: &Span, n: usize) -> Self {
        let count = (4 + n / 2).min(BINS);
        let extent = centers.high - centers.low;
        // On an axis without extent, or where its inverse overflows, all goes to the first bin.
        let scale = (count as f32 / extent).min(Vec4::splat(f32::MAX));
        let scale = Vec4::select(extent.cmpgt(Vec4::splat(f32::MIN_POSITIVE)), scale, Vec4::ZERO);
        Self { low: centers.low, scale, last: Vec4::splat((count - 1) as f32), count }
    }

    /// Bin numbers, per axis, as floats with a fraction.
    #[inline(always)]
    fn of(&self, part: &Part) -> Vec4 {
        ((part.center() - self.low) * self.scale).min(self.last)
    }

    #[inline(always)]
    pub fn is_left(&self, part: &Part, division: &Division) -> bool {
        self.of(part)[division.axis] < division.last
    }

    /// `None` where all fall into one bin.
    pub fn best(&self, parts: &[Part], weight: impl Fn(u32) -> f32) -> Option<Division> {
        if self.count <= FEW {
            return self.best_of(&self.fill::<FEW>(parts), weight);
        }
        let filling = match parts.len() {
            n if n <= CHUNK => self.fill::<BINS>(parts),
            _ => {
                parts.par_chunks(CHUNK).map(|chunk| self.fill(chunk)).reduce(Filling::new, |a, b| a.join(&b))
            }
        };
        self.best_of(&filling, weight)
    }

    fn best_of<const N: usize>(&self, filling: &Filling<N>, weight: impl Fn(u32) -> f32) -> Option<Division> {
        let (mut best, mut best_cost) = (None, f32::INFINITY);
        for axis in (0..3).filter(|&axis| self.scale[axis] > 0.0) {
            let (spans, counts) = (&filling.spans[axis], &filling.counts[axis]);
            let mut right = [0.0; N];
            let (mut span, mut count) = (Span::EMPTY, 0);
            for i in (1..self.count.min(N)).rev() {
                (span, count) = (span.join(&spans[i]), count + counts[i]);
                right[i] = if count == 0 { f32::INFINITY } else { span.half_area() * weight(count) };
            }
            let (mut span, mut count) = (Span::EMPTY, 0);
            for i in 0..self.count.min(N) - 1 {
                if counts[i] == 0 {
                    continue;
                }
                (span, count) = (span.join(&spans[i]), count + counts[i]);
                let cost = span.half_area() * weight(count) + right[i + 1];
                if cost < best_cost {
                    best_cost = cost;
                    best = Some(Division { axis, last: (i + 1) as f32, cost });
                }
            }
        }
        best
    }

    fn fill<const N: usize>(&self, parts: &[Part]) -> Filling<N> {
        let mut filling = Filling::new();
        for part in parts {
            // (No `array::map`: it is not always inlined.)
            let bins = self.of(part);
            for (axis, bin) in [bins.x, bins.y, bins.z].into_iter().enumerate() {
                let bin = (bin as usize).min(N - 1);
                filling.spans[axis][bin].add(part);
                filling.counts[axis][bin] += 1;
            }
        }
        filling
    }
}

impl<const N: usize> Filling<N> {
    fn new() -> Self {
        Self { spans: [[Span::EMPTY; N]; 3], counts: [[0; N]; 3] }
    }

    fn join(mut self, other: &Self) -> Self {
        for axis in 0..3 {
            for bin in 0..N {
                self.spans[axis][bin] = self.spans[axis][bin].join(&other.spans[axis][bin]);
                self.counts[axis][bin] += other.counts[axis][bin];
            }
        }
        self
    }
}
