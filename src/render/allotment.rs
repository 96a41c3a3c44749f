//! How many samples each pixel gets, where all share in so much work: more where more noise is left.
//!
//! Let a sample of pixel i cost cᵢ and have the relative variance vᵢ. For given work Σ nᵢcᵢ the relative mean square error of the
//! picture, the mean of vᵢ / nᵢ, is least with
//!
//! ```text
//! nᵢ ∝ √(vᵢ / cᵢ)
//! ```
//!
//! (Neyman 1934, *On the two different aspects of the representative method*, with costs). Both are estimated from the few samples that
//! every pixel has taken before.
//!
//! A pixel's own samples have no say in how many it gets: vᵢ is the mean over the *other* pixels of a window around it. Pixels are
//! independent of each other, so the number of a pixel's samples is independent of what those bring, and their mean is unbiased,
//! however rare and bright a path is; a rule that looks at the samples it weighs stops soonest where nothing bright
//! has been met yet. (What a pixel does share with itself is averaged over many: the brightness of the whole picture, the
//! cost of a tile.) And as every pixel keeps its first samples, a wrong estimate costs at most their part: with a quarter of
//! the samples taken in advance, no pixel has more than four times the variance that equal shares would leave.

use rayon::prelude::*;

use super::pass::TILE_SIDE;
use crate::film::{Film, noise_floor};

/// No pixel gets more than so many times the samples asked for.
const MOST: u32 = 16;

/// Pixels from the middle of the window to its edge. Wider, it blurs the edges of what is noisy; narrower, it is fooled.
const REACH: usize = 2;

/// Where wishes are so small that this is not enough, there is no noise.
const LARGEST_SCALE: f64 = 1e30;

/// Of the interval that holds the constant of proportionality: to a ten-thousandth.
const HALVINGS: u32 = 16;

/// The number of samples of each pixel, row by row: at least the `pilot` samples that each has taken, and a multiple of
/// them, as parts of a low-discrepancy sequence are best whole; with as much work in all as `samples` for every
/// pixel. `work`: of each tile so far, row by row.
pub fn allot(film: &Film, work: &[f64], pilot: u32, samples: u32) -> Vec<u32> {
    let width = film.width().max(1) as usize;
    let costs = Costs::of(film, work);
    let wishes = wishes(film, &costs);
    let [pilot, samples] = [pilot, samples].map(f64::from);
    let [least, most] = [1.0, (samples * f64::from(MOST) / pilot).floor()];
    let scale = scale(&wishes, &costs, samples / pilot, [least, most]);
    let mut goals = vec![0; wishes.len()];
    goals.par_chunks_mut(width).zip(wishes.par_chunks(width)).for_each(|(goals, wishes)| {
        for (goal, &wish) in goals.iter_mut().zip(wishes) {
            *goal = (pilot * (scale * f64::from(wish)).clamp(least, most).round()) as u32;
        }
    });
    goals
}

/// What a sample costs, by tile.
struct Costs {
    tiles: Vec<f64>,
    width: usize,
    across: usize,
}

impl Costs {
    fn of(film: &Film, work: &[f64]) -> Self {
        let [width, height] = [film.width(), film.height()];
        let across = width.div_ceil(TILE_SIDE);
        let side = |from: u32, len: u32| f64::from(TILE_SIDE.min(len - from * TILE_SIDE));
        let pixels = |i: u32| side(i % across, width) * side(i / across, height);
        // the least is not 0, by which costs are divided
        let tiles = (0..).zip(work).map(|(i, &work)| (work / pixels(i)).max(f64::MIN_POSITIVE)).collect();
        Self { tiles, width: width as usize, across: across as usize }
    }

    fn of_pixel(&self, i: usize) -> f64 {
        let [x, y] = [i % self.width, i / self.width].map(|n| n / TILE_SIDE as usize);
        self.tiles[y * self.across + x]
    }
}

/// √(vᵢ / cᵢ) of every pixel.
fn wishes(film: &Film, costs: &Costs) -> Vec<f32> {
    let floor = noise_floor(film);
    // of the pixel's own samples: paths from lamps, which serve all pixels, do not become more by these
    let relative = |i: usize| film.pixels()[i].luminance_error() / film.luminance(i).max(floor);
    let variances: Vec<f32> = (0..film.pixels().len())
        .into_par_iter()
        .map(|i| Some(relative(i).powi(2) as f32).filter(|v| v.is_finite()).unwrap_or(0.0))
        .collect();
    let width = film.width().max(1) as usize;
    let wish = |i| f64::from(mean_of_others(&variances, width, i)) / costs.of_pixel(i);
    (0..variances.len()).into_par_iter().map(|i| wish(i).sqrt() as f32).collect()
}

/// The mean over the window around `i` without its middle; 1 where there is nothing else.
fn mean_of_others(values: &[f32], width: usize, i: usize) -> f32 {
    let (x, y) = (i % width, i / width);
    let rows = y.saturating_sub(REACH)..(y + REACH + 1).min(values.len() / width);
    let columns = x.saturating_sub(REACH)..(x + REACH + 1).min(width);
    let others = rows.len() * columns.len() - 1;
    if others == 0 {
        return 1.0;
    }
    let all = rows.flat_map(|row| columns.clone().map(move |column| row * width + column));
    all.filter(|&j| j != i).map(|j| values[j]).sum::<f32>() / others as f32
}

/// By what to multiply the wishes for `clamp(scale × wish)` samples to cost in all what `mean` samples of every pixel would.
fn scale(wishes: &[f32], costs: &Costs, mean: f64, [least, most]: [f64; 2]) -> f64 {
    // by row and then over rows in order: the same bits for any number of threads
    let total = |samples: &(dyn Fn(f32) -> f64 + Sync)| -> f64 {
        let of_row = |(y, row): (usize, &[f32])| {
            (y * costs.width..).zip(row).map(|(i, &wish)| samples(wish) * costs.of_pixel(i)).sum::<f64>()
        };
        let rows: Vec<f64> = wishes.par_chunks(costs.width.max(1)).enumerate().map(of_row).collect();
        rows.iter().sum()
    };
    let available = total(&|_| mean);
    let affordable = |scale: f64| total(&|wish| (scale * f64::from(wish)).clamp(least, most)) <= available;
    let (mut low, mut high) = (0.0, 1.0);
    while affordable(high) && high < LARGEST_SCALE {
        (low, high) = (high, 16.0 * high);
    }
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        if affordable(middle) { low = middle } else { high = middle }
    }
    low
}
