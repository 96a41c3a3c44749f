//! How many samples each pixel gets, where all share in so much work: more where more noise is left.
//!
//! Let a sample of pixel i cost cᵢ and have the relative variance vᵢ. For given work Σ nᵢcᵢ the relative mean square error of the
//! picture, the mean of vᵢ / nᵢ, is least with
//!
//! ```text
//! nᵢ = λ √(vᵢ / cᵢ)
//! ```
//!
//! (Neyman 1934, *On the two different aspects of the representative method*, with costs), and so is the work for a given error. Both are
//! estimated from the samples that the pixels have taken before; λ is what the work allows, or what the error needs.
//!
//! A pixel's own samples have no say in how many it gets: vᵢ is the mean over the *other* pixels of a window around it. Pixels are
//! independent of each other, so the number of a pixel's samples is independent of what those bring, and their mean is unbiased,
//! however rare and bright a path is; a rule that looks at the samples it weighs stops soonest where nothing bright
//! has been met yet. (What a pixel does share with itself is averaged over many: the brightness and the error of the whole picture, the
//! cost of a tile; where samples are allotted more than once, how well its neighbours' variance is known by then.) And as every pixel
//! keeps its first samples, a wrong estimate costs at most their part: with a quarter of
//! the samples taken in advance, no pixel has more than four times the variance that equal shares would leave.

use rayon::prelude::*;

use super::pass::{LEAST_WORK, TILE_SIDE};
use crate::film::{Film, around, noise_floor};

/// No pixel gets more than so many times the samples asked for.
const MOST: u32 = 16;

/// Pixels from the middle of the window to its edge. Wider, it blurs the edges of what is noisy; narrower, it is fooled.
const REACH: usize = 2;

/// Where wishes are so small that this is not enough, there is no noise.
const LARGEST_SCALE: f64 = 1e30;

/// Of the interval that holds the constant of proportionality: to a ten-thousandth.
const HALVINGS: u32 = 16;

/// What is to be shared out.
pub struct Ask {
    /// Numbers of samples are multiples of it, save where a pixel already has more.
    pub block: u32,
    /// No pixel gets fewer.
    pub least: u32,
    /// The work, in all: of so many samples of every pixel.
    pub budget: f64,
    /// So much of it is used, whatever the error.
    pub needed: f64,
    /// The budget is not exceeded by rounding to blocks either.
    pub strict: bool,
    /// The relative error of the picture as it is, and the one that is enough.
    pub error: Option<[f64; 2]>,
}

pub struct Allotment {
    /// The number of samples of each pixel, row by row, those it has already taken included.
    pub goals: Vec<u32>,
    /// The work: of so many samples of every pixel.
    pub level: f64,
}

/// Shares out what `ask` says among the pixels of `film`, of whose tiles, row by row, each has taken so much `work`.
pub fn allot(film: &Film, work: &[f64], ask: &Ask) -> Allotment {
    let width = film.width().max(1) as usize;
    let costs = Costs::of(film, work);
    let variances = variances(film);
    let wishes = wishes(&variances, &costs, width);
    let shares = Shares { film, ask, costs: &costs, variances: &variances, wishes: &wishes };
    let scale = shares.scale();
    let mut goals = vec![0; wishes.len()];
    goals.par_chunks_mut(width).enumerate().for_each(|(y, goals)| {
        for (goal, i) in goals.iter_mut().zip(y * width..) {
            *goal = shares.whole(i, scale);
        }
    });
    let level = shares.total(|i| f64::from(goals[i])).work / costs.all;
    Allotment { goals, level }
}

/// What a sample costs, by tile.
struct Costs {
    tiles: Vec<f64>,
    width: usize,
    across: usize,
    /// Of one sample of every pixel.
    all: f64,
}

impl Costs {
    fn of(film: &Film, work: &[f64]) -> Self {
        let width = film.width().max(1) as usize;
        let across = width.div_ceil(TILE_SIDE as usize);
        let mut costs = Self { tiles: vec![0.0; work.len()], width, across, all: 0.0 };
        let mut samples = vec![0; work.len()];
        for (i, pixel) in film.pixels().iter().enumerate() {
            samples[costs.tile(i)] += u64::from(pixel.taken());
        }
        for ((cost, &work), samples) in costs.tiles.iter_mut().zip(work).zip(samples) {
            *cost = (work / samples.max(1) as f64).max(LEAST_WORK);
        }
        costs.all = (0..film.pixels().len()).map(|i| costs.of_pixel(i)).sum();
        costs
    }

    fn tile(&self, i: usize) -> usize {
        let [x, y] = [i % self.width, i / self.width].map(|n| n / TILE_SIDE as usize);
        y * self.across + x
    }

    fn of_pixel(&self, i: usize) -> f64 {
        self.tiles[self.tile(i)]
    }
}

/// vᵢ by each pixel's own samples: paths from lamps, which serve all pixels, do not become more by these.
fn variances(film: &Film) -> Vec<f32> {
    let floor = noise_floor(film);
    let relative = |i: usize| {
        let pixel = &film.pixels()[i];
        (pixel.luminance_error() / film.luminance(i).max(floor)).powi(2) * f64::from(pixel.kept())
    };
    let finite = |i| Some(relative(i) as f32).filter(|v| v.is_finite()).unwrap_or(0.0);
    (0..film.pixels().len()).into_par_iter().map(finite).collect()
}

/// √(vᵢ / cᵢ) by the neighbours' samples.
fn wishes(variances: &[f32], costs: &Costs, width: usize) -> Vec<f32> {
    let wish = |i| f64::from(mean_of_others(variances, width, i)) / costs.of_pixel(i);
    (0..variances.len()).into_par_iter().map(|i| wish(i).sqrt() as f32).collect()
}

/// The mean over the window around `i` without its middle; 1 where there is nothing else.
fn mean_of_others(values: &[f32], width: usize, i: usize) -> f32 {
    let others = || around(i, REACH, width, values.len()).filter(|&j| j != i);
    match others().count() {
        0 => 1.0,
        count => others().map(|j| values[j]).sum::<f32>() / count as f32,
    }
}

/// The number of samples of each pixel for any λ.
struct Shares<'a> {
    film: &'a Film,
    ask: &'a Ask,
    costs: &'a Costs,
    variances: &'a [f32],
    wishes: &'a [f32],
}

/// Over all pixels.
#[derive(Default)]
struct Total {
    work: f64,
    samples: f64,
    /// Σ vᵢ / nᵢ
    variance: f64,
}

impl Shares<'_> {
    /// Before rounding.
    fn samples(&self, i: usize, scale: f64) -> f64 {
        let [least, most] = [f64::from(self.ask.least), f64::from(MOST) * self.ask.budget];
        (scale * f64::from(self.wishes[i]))
            .clamp(least, most.max(least))
            .max(self.film.pixels()[i].taken().into())
    }

    /// In whole blocks.
    fn whole(&self, i: usize, scale: f64) -> u32 {
        let block = f64::from(self.ask.block);
        let blocks = (self.samples(i, scale) / block).round().max(1.0);
        ((blocks * block) as u32).max(self.film.pixels()[i].taken())
    }

    /// Where each pixel has so many samples.
    fn total(&self, samples: impl Fn(usize) -> f64 + Sync) -> Total {
        let width = self.costs.width;
        let add = |mut total: Total, more: Total| {
            total.work += more.work;
            total.samples += more.samples;
            total.variance += more.variance;
            total
        };
        let of_pixel = |i| {
            let samples: f64 = samples(i);
            let variance = f64::from(self.variances[i]) / samples.max(1.0);
            Total { work: samples * self.costs.of_pixel(i), samples, variance }
        };
        // by row and then over rows in order: the same bits for any number of threads
        let of_row = |y| (y * width..(y + 1) * width).map(of_pixel).fold(Total::default(), add);
        let rows: Vec<Total> = (0..self.wishes.len() / width).into_par_iter().map(of_row).collect();
        rows.into_iter().fold(Total::default(), add)
    }

    /// λ.
    fn scale(&self) -> f64 {
        let [needed, available] = [self.ask.needed, self.ask.budget].map(|level| level * self.costs.all);
        let pixels = self.wishes.len() as f64;
        let now = self.total(|i| self.film.pixels()[i].taken().into());
        // what lamps' paths add becomes less with every sample
        let of_lamps = |[error, _]: [f64; 2]| (error * error - now.variance / pixels).max(0.0);
        let is_noisy = |total: &Total| {
            self.ask.error.is_none_or(|error| {
                let lamps = of_lamps(error) * now.samples / total.samples.max(1.0);
                total.variance / pixels + lamps > error[1] * error[1]
            })
        };
        let is_too_little = |scale: f64| {
            let total = match self.ask.strict {
                true => self.total(|i| self.whole(i, scale).into()),
                false => self.total(|i| self.samples(i, scale)),
            };
            total.work <= needed || total.work <= available && is_noisy(&total)
        };
        let (mut low, mut high) = (0.0, 1.0);
        while is_too_little(high) && high < LARGEST_SCALE {
            (low, high) = (high, 16.0 * high);
        }
        for _ in 0..HALVINGS {
            let middle = 0.5 * (low + high);
            if is_too_little(middle) { low = middle } else { high = middle }
        }
        low
    }
}
