//! Choosing one of many in proportion to weights, and densities on the unit interval that go with it.
//!
//! [`Discrete`] is a cumulative table with a guide (Chen and Asau 1974, *On Generating Random Variates from an
//! Empirical Distribution*): the guide says where the search for `u` starts and ends, so that it takes O(1) steps
//! on average. Unlike an alias table, which is O(1) always, the map from u to index is monotone: points that are
//! well spread over [0, 1) stay so. What is left of `u` after the choice is uniform again and can be used for another.
//!
//! [`Grid`] is the same over the cells of a rectangle: a row first, then a cell in it. Read as densities on the unit
//! interval or square, (index + leftover) / n with density n × probability is piecewise constant.
//!
//! Weights that are negative or not finite count as 0. Entries of weight 0 are never chosen.

use glam::Vec2;
use rayon::prelude::*;

/// The largest `f32` below 1.
pub const ONE_MINUS_EPSILON: f32 = 1.0 - f32::EPSILON / 2.0;

/// Table entries for each entry of the guide, on average: 4 cost at most three steps more and a quarter of the memory.
const ENTRIES_PER_GUIDE: usize = 4;

/// A discrete distribution in proportion to given weights.
#[derive(Clone, Debug)]
pub struct Discrete {
    /// P(index ≤ i).
    cdf: Vec<f32>,
    guide: Vec<u32>,
    /// Sum of the weights.
    total: f64,
}

/// What [`Discrete::sample`] chose.
#[derive(Clone, Copy, Debug)]
pub struct Choice {
    pub index: usize,
    pub probability: f32,
    /// What is left of the uniform number: uniform in [0, 1).
    pub u: f32,
}

impl Discrete {
    /// `None` where no weight is positive.
    pub fn new(weights: impl IntoIterator<Item = f32>) -> Option<Self> {
        let mut cdf: Vec<f32> = weights.into_iter().collect();
        let mut guide = vec![0; guide_length(cdf.len())];
        let total = tabulate(&mut cdf, &mut guide);
        (total > 0.0).then_some(Self { cdf, guide, total })
    }

    /// `u` is uniform in [0, 1).
    pub fn sample(&self, u: f32) -> Choice {
        choose(&self.cdf, &self.guide, u)
    }

    /// Exactly the probability with which [`sample`](Self::sample) returns `index`; 0 where there is no such index.
    pub fn probability(&self, index: usize) -> f32 {
        probability(&self.cdf, index)
    }

    /// Sum of the weights.
    pub fn total(&self) -> f64 {
        self.total
    }
}

/// A distribution over the cells of a grid in proportion to given weights.
#[derive(Clone, Debug)]
pub struct Grid {
    width: usize,
    rows: Discrete,
    /// One table after the other, for all rows.
    cdf: Vec<f32>,
    guide: Vec<u32>,
}

/// What [`Grid::sample`] chose.
#[derive(Clone, Copy, Debug)]
pub struct Cell {
    pub column: usize,
    pub row: usize,
    pub probability: f32,
    /// What is left of the uniform numbers: uniform in the unit square.
    pub u: Vec2,
}

impl Grid {
    /// `fill(row, weights)` writes the weights of a row; rows are built in parallel, in place. `None` where no weight
    /// is positive.
    pub fn new(width: usize, height: usize, fill: impl Fn(usize, &mut [f32]) + Sync) -> Option<Self> {
        if width == 0 || height == 0 {
            return None;
        }
        let guides = guide_length(width);
        let mut cdf = vec![0.0; width * height];
        let mut guide = vec![0; guides * height];
        let sums: Vec<f64> = cdf
            .par_chunks_mut(width)
            .zip(guide.par_chunks_mut(guides))
            .enumerate()
            .map(|(row, (cdf, guide))| {
                fill(row, cdf);
                tabulate(cdf, guide)
            })
            .collect();
        // Scaled: a row's sum may be beyond f32.
        let largest = sums.iter().copied().fold(0.0, f64::max);
        let mut rows = Discrete::new(sums.iter().map(|sum| (sum / largest) as f32))?;
        rows.total = sums.iter().sum();
        Some(Self { width, rows, cdf, guide })
    }

    /// `u.y` chooses the row, `u.x` the column.
    pub fn sample(&self, u: Vec2) -> Cell {
        let row = self.rows.sample(u.y);
        let (cdf, guide) = self.row(row.index);
        let column = choose(cdf, guide, u.x);
        Cell {
            column: column.index,
            row: row.index,
            probability: row.probability * column.probability,
            u: Vec2::new(column.u, row.u),
        }
    }

    pub fn probability(&self, column: usize, row: usize) -> f32 {
        match self.rows.probability(row) {
            0.0 => 0.0,
            p => p * probability(self.row(row).0, column),
        }
    }

    /// Sum of the weights.
    pub fn total(&self) -> f64 {
        self.rows.total
    }

    fn row(&self, row: usize) -> (&[f32], &[u32]) {
        let guides = guide_length(self.width);
        (&self.cdf[row * self.width..][..self.width], &self.guide[row * guides..][..guides])
    }
}

/// A power of two: bounds k / n of the guide's intervals are exact, and so is finding the interval of a `u`.
fn guide_length(n: usize) -> usize {
    (n / ENTRIES_PER_GUIDE).next_power_of_two()
}

/// Turns weights into their cumulative table, in place, writes its guide and returns the weights' sum.
///
/// `guide[k]` is the first index with `cdf > k / guides`: the choice for every u from there up is at or after it.
fn tabulate(weights: &mut [f32], guide: &mut [u32]) -> f64 {
    let usable = |w: f32| if w > 0.0 && w.is_finite() { w as f64 } else { 0.0 };
    let total: f64 = weights.iter().map(|&w| usable(w)).sum();
    if total <= 0.0 {
        return 0.0;
    }
    let mut sum = 0.0;
    let mut last = 0;
    for (i, w) in weights.iter_mut().enumerate() {
        let weight = usable(*w);
        if weight > 0.0 {
            last = i;
        }
        sum += weight;
        *w = ((sum / total) as f32).min(1.0);
    }
    weights[last..].fill(1.0); // rounding must not leave u close to 1 without an entry, nor choose one of weight 0
    let (mut first, guides) = (0, guide.len() as f32);
    for (k, entry) in guide.iter_mut().enumerate() {
        let u = k as f32 / guides;
        while weights[first] <= u {
            first += 1;
        }
        *entry = first as u32;
    }
    total
}

fn choose(cdf: &[f32], guide: &[u32], u: f32) -> Choice {
    let u = u.clamp(0.0, ONE_MINUS_EPSILON);
    let interval = (u * guide.len() as f32) as usize;
    let from = guide[interval] as usize;
    let to = guide.get(interval + 1).map_or(cdf.len() - 1, |&i| i as usize);
    let index = from + cdf[from..to].partition_point(|&c| c <= u);
    let probability = probability(cdf, index);
    let below = if index == 0 { 0.0 } else { cdf[index - 1] };
    Choice { index, probability, u: ((u - below) / probability).clamp(0.0, ONE_MINUS_EPSILON) }
}

fn probability(cdf: &[f32], index: usize) -> f32 {
    match (cdf.get(index), index) {
        (None, _) => 0.0,
        (Some(&c), 0) => c,
        (Some(&c), i) => c - cdf[i - 1],
    }
}

/// x in [0, 1) with a density that goes linearly from `a` at 0 to `b` at 1 (both ≥ 0), up to its norm (a + b) / 2;
/// uniform where both are 0.
pub fn linear(u: f32, a: f32, b: f32) -> f32 {
    let sum = a + b;
    if sum <= 0.0 || !sum.is_finite() {
        return u;
    }
    let (a, b) = (a / sum, b / sum);
    // The root of a x + (b − a) x² / 2 = u / 2 in the form that keeps its digits where a ≈ b.
    let root = (a * a + u * (b - a) * (b + a)).max(0.0).sqrt();
    (u / (a + root).max(f32::MIN_POSITIVE)).min(ONE_MINUS_EPSILON)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::stats::{chi2_p_value, r3, uniform};

    #[test]
    fn choices_follow_the_weights() {
        let tables: [Vec<f32>; 5] = [
            vec![1.0],
            vec![0.0, 0.0, 3.0, 0.0],
            vec![1.0, 2.0, 0.0, 4.0, 0.5, 0.0],
            (0..1000).map(|i| if i == 700 { 1e4 } else { (i % 7) as f32 }).collect(),
            vec![f32::NAN, 1.0, -5.0, f32::INFINITY, 2.0],
        ];
        for weights in tables {
            let discrete = Discrete::new(weights.iter().copied()).expect("a positive weight");
            let n = 1 << 17;
            let mut observed = vec![0.0; weights.len()];
            for i in 0..n {
                let choice = discrete.sample(uniform(i, 0));
                assert_eq!(choice.probability, discrete.probability(choice.index));
                observed[choice.index] += 1.0;
            }
            let usable = |w: &f32| if *w > 0.0 && w.is_finite() { *w as f64 } else { 0.0 };
            let total: f64 = weights.iter().map(usable).sum();
            let expected: Vec<f64> = weights.iter().map(|w| usable(w) / total * n as f64).collect();
            for (o, e) in observed.iter().zip(&expected) {
                assert!(*e > 0.0 || *o == 0.0, "an entry of weight 0 was chosen");
            }
            assert!(chi2_p_value(&observed, &expected) > 1e-4, "{} weights", weights.len());
        }
    }

    #[test]
    fn choice_is_monotone_and_what_is_left_is_uniform() {
        let discrete = Discrete::new([1.0, 5.0, 0.0, 2.0]).expect("positive weights");
        let (mut last, mut sum) = (0, 0.0);
        let n = 10_000;
        for i in 0..n {
            let u = i as f32 / n as f32;
            let choice = discrete.sample(u);
            assert!(choice.index >= last && (0.0..1.0).contains(&choice.u));
            let below: f32 = (0..choice.index).map(|j| discrete.probability(j)).sum();
            assert!((below + choice.u * choice.probability - u).abs() < 1e-6);
            (last, sum) = (choice.index, sum + choice.u);
        }
        assert!((sum / n as f32 - 0.5).abs() < 1e-3);
        assert_eq!(discrete.sample(1.0).index, 3);
        assert_eq!(discrete.probability(4), 0.0);
    }

    #[test]
    fn nothing_to_choose_from_is_none() {
        assert!(Discrete::new([]).is_none());
        assert!(Discrete::new([0.0, -1.0, f32::NAN]).is_none());
        assert!(Grid::new(4, 4, |_, _| ()).is_none());
        assert!(Grid::new(0, 3, |_, _| ()).is_none());
    }

    #[test]
    fn grid_follows_its_weights() {
        let (width, height) = (13, 7);
        let weight = |x: usize, y: usize| if y == 3 { 0.0 } else { ((x * 5 + y * 3) % 11) as f32 };
        let fill =
            |y: usize, row: &mut [f32]| row.iter_mut().enumerate().for_each(|(x, w)| *w = weight(x, y));
        let grid = Grid::new(width, height, fill).expect("positive weights");
        let n = 1 << 17;
        let mut observed = vec![0.0; width * height];
        for i in 0..n {
            let cell = grid.sample(Vec2::new(uniform(i, 0), uniform(i, 1)));
            assert_eq!(cell.probability, grid.probability(cell.column, cell.row));
            observed[cell.row * width + cell.column] += 1.0;
        }
        let all: f32 = (0..width * height).map(|i| weight(i % width, i / width)).sum();
        assert!((grid.total() - all as f64).abs() < 1e-6);
        let expected: Vec<f64> =
            (0..width * height).map(|i| (weight(i % width, i / width) / all) as f64 * n as f64).collect();
        assert!(chi2_p_value(&observed, &expected) > 1e-4);
    }

    #[test]
    fn linear_has_the_mean_of_its_density() {
        for (a, b) in [(1.0, 1.0), (0.0, 1.0), (1.0, 0.0), (1.0, 1.0001), (1e30, 3e30), (1e-30, 3e-30)] {
            let n = 1 << 12;
            let mean = (0..n).map(|i| linear(r3(i)[0], a, b) as f64).sum::<f64>() / n as f64;
            let (a, b) = (a as f64, b as f64);
            let expected = (a + 2.0 * b) / (3.0 * (a + b));
            assert!((mean - expected).abs() < 1e-3, "{a}, {b}: {mean}, not {expected}");
        }
        assert_eq!(linear(0.25, 0.0, 0.0), 0.25);
        assert_eq!(linear(0.0, 0.0, 1.0), 0.0);
    }
}
