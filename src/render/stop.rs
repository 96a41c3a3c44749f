//! Which pixels go on: decided between passes, from the film alone.
//!
//! A pixel stops for good when it has its share of samples (`schedule.rs`). With a noise threshold it stops earlier, once
//!
//! 1. it has at least max(32, 1 / noise) samples: what was not met in n samples, and would have to be as bright as
//!    the pixel to matter, can move its mean by about 1/n; and the estimate of an error needs some samples itself;
//! 2. the relative error of the pixel *and of its eight neighbours* is below the threshold
//!    ([`NoiseMap::around`](crate::film::NoiseMap::around)).
//!
//! Nothing is remembered: where a neighbour is surprised later, a pixel at rest goes on.
//!
//! With a threshold a crop is not to the bit that part of the whole picture: at its edge neighbours are missing, and
//! the picture's middle brightness is its own. Each pixel's samples are the same; it may stop at another one.
//!
//! A rule that looks at the samples it stops cannot be free of bias (a pixel whose samples happen to be low and
//! quiet stops sooner). The test `the_noise_rule_hardly_biases_rare_bright_paths` bounds it.

use rayon::prelude::*;

use super::{Outcome, Settings, schedule::Schedule};
use crate::film::{Film, NoiseMap};

/// Below this many samples an estimate of their spread says little.
const LEAST_SAMPLES: u32 = 32;

/// What is left to do, and how noisy the film is.
pub struct Plan {
    width: usize,
    /// Of each pixel: its samples after the next pass, if it takes part.
    ends: Vec<u32>,
    totals: Totals,
    pub noise: Option<f32>,
}

#[derive(Clone, Copy, Default)]
struct Totals {
    taken: u64,
    expected: u64,
    /// Pixels that have all their samples.
    complete: usize,
}

impl Plan {
    pub fn of(film: &Film, settings: &Settings, schedule: &Schedule) -> Self {
        let width = film.width().max(1) as usize;
        let noise_map = NoiseMap::of(film);
        let mut ends = vec![0; film.pixels().len()];
        let rows = ends.par_chunks_mut(width).zip(film.pixels().par_chunks(width));
        let totals = rows
            .enumerate()
            .map(|(y, (ends, row))| {
                let mut totals = Totals::default();
                for (x, (end, pixel)) in ends.iter_mut().zip(row).enumerate() {
                    let (i, taken) = (y * width + x, pixel.taken());
                    let goal = schedule.goal(i);
                    let expected = expected_samples(taken, goal, settings.noise, || noise_map.around(x, y));
                    if expected > 0 {
                        *end = schedule.end(i, taken).min(goal);
                    }
                    totals.taken += u64::from(taken);
                    totals.expected += u64::from(expected);
                    totals.complete += usize::from(taken >= goal);
                }
                totals
            })
            .reduce(Totals::default, |a, b| Totals {
                taken: a.taken + b.taken,
                expected: a.expected + b.expected,
                complete: a.complete + b.complete,
            });
        Self { width, ends, totals, noise: noise_map.estimate() }
    }

    /// Samples taken so far, over all pixels.
    pub fn taken(&self) -> u64 {
        self.totals.taken
    }

    /// Samples that are still to come, as far as can be told.
    pub fn expected(&self) -> u64 {
        self.totals.expected
    }

    /// The number of samples that the pixel is to have after the next pass; 0 where it rests.
    pub fn end(&self, x: u32, y: u32) -> u32 {
        self.ends[y as usize * self.width + x as usize]
    }

    /// How rendering ended, where nothing is left to do.
    pub fn outcome(&self) -> Option<Outcome> {
        match (self.totals.expected, self.totals.complete == self.ends.len()) {
            (0, true) => Some(Outcome::Finished),
            (0, false) => Some(Outcome::NoiseReached),
            _ => None,
        }
    }
}

/// How many more samples a pixel needs: 0 where it has settled, else a guess of at least 1.
fn expected_samples(taken: u32, goal: u32, noise: f32, error: impl Fn() -> f32) -> u32 {
    let left = goal.saturating_sub(taken);
    if noise <= 0.0 || left == 0 {
        return left;
    }
    let least = LEAST_SAMPLES.max((1.0 / noise) as u32);
    let error = error();
    if taken >= least && error < noise {
        return 0;
    }
    // Errors fall as 1/√n.
    let needed = taken.max(least) as f32 * (error / noise).powi(2);
    (needed - taken as f32).clamp(1.0, left as f32) as u32
}
