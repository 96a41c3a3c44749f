//! Which pixels go on: decided between passes, from the film alone.
//!
//! A pixel stops for good at `samples`. With a noise threshold it stops earlier, once
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

use super::{Outcome, Settings};
use crate::film::{Film, NoiseMap};

/// Below this many samples an estimate of their spread says little.
const LEAST_SAMPLES: u32 = 32;

/// What is left to do, and how noisy the film is.
pub struct Plan {
    width: usize,
    active: Vec<bool>,
    /// Samples taken so far, over all pixels.
    pub taken: u64,
    /// Samples that are still to come, as far as can be told.
    pub expected: u64,
    pub noise: Option<f32>,
    finished: bool,
}

impl Plan {
    pub fn of(film: &Film, settings: &Settings) -> Self {
        let width = film.width().max(1) as usize;
        let noise_map = NoiseMap::of(film);
        let least = LEAST_SAMPLES.max((1.0 / settings.noise) as u32);
        let remaining: Vec<u32> = film
            .pixels()
            .par_iter()
            .enumerate()
            .map(|(i, pixel)| {
                let (taken, left) = (pixel.taken(), settings.samples.saturating_sub(pixel.taken()));
                if settings.noise <= 0.0 {
                    return left;
                }
                let error = noise_map.around(i % width, i / width);
                let needed = taken.max(least) as f32 * (error / settings.noise).powi(2);
                if taken >= least && error < settings.noise {
                    0
                } else {
                    // Errors fall as 1/√n. At least one: whoever has not settled goes on.
                    (needed - taken as f32).max(1.0).min(left as f32) as u32
                }
            })
            .collect();
        Self {
            width,
            active: remaining.iter().map(|&r| r > 0).collect(),
            taken: film.pixels().par_iter().map(|p| u64::from(p.taken())).sum(),
            expected: remaining.par_iter().map(|&r| u64::from(r)).sum(),
            noise: noise_map.estimate(),
            finished: film.pixels().par_iter().all(|p| p.taken() >= settings.samples),
        }
    }

    pub fn is_active(&self, x: u32, y: u32) -> bool {
        self.active[y as usize * self.width + x as usize]
    }

    /// How rendering ended, where nothing is left to do.
    pub fn outcome(&self) -> Option<Outcome> {
        match (self.expected, self.finished) {
            (0, true) => Some(Outcome::Finished),
            (0, false) => Some(Outcome::NoiseReached),
            _ => None,
        }
    }
}
