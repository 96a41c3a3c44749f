//! What each pass takes, and how many samples each pixel gets in all.
//!
//! Either every pixel gets as many as asked for, or they go where the noise is ([`Settings::adaptive`]): every pixel first takes a
//! quarter of them, and what those show decides, once, how the rest of the work is shared out (`allotment.rs`).

use super::{Settings, allotment::allot};
use crate::film::Film;

/// Samples per pass once the first few have shown the picture.
const LARGEST_BATCH: u32 = 16;

/// Of the samples asked for, one in so many is taken before any allotment.
const PILOT_PART: u32 = 4;

pub struct Schedule {
    samples: u32,
    /// Samples of each pixel that takes part in the next pass, before any allotment.
    batch: u32,
    /// Sum of the batches.
    level: u32,
    /// The level at which the rest is allotted.
    pilot: Option<u32>,
    shares: Option<Shares>,
}

/// Samples by pixel, approached in equal steps.
struct Shares {
    goals: Vec<u32>,
    pilot: u32,
    step: u32,
    steps: u32,
}

impl Schedule {
    pub fn new(settings: &Settings) -> Self {
        let pilot = settings.samples / PILOT_PART;
        // Where a threshold is given, it says when a pixel has enough.
        let shared = settings.shares_out() && settings.noise <= 0.0;
        Self { samples: settings.samples, batch: 0, level: 0, pilot: shared.then_some(pilot), shares: None }
    }

    /// Goes on to the next pass over `film`, of whose tiles each has taken so much `work`.
    pub fn advance(&mut self, film: &Film, work: &[f64]) {
        if let Some(shares) = &mut self.shares {
            shares.step = (shares.step + 1).min(shares.steps);
        } else if let Some(pilot) = self.pilot.filter(|&pilot| self.level >= pilot) {
            let goals = allot(film, work, pilot, self.samples);
            let steps = (self.samples - pilot).div_ceil(LARGEST_BATCH).max(1);
            self.shares = Some(Shares { goals, pilot, step: 1, steps });
        } else {
            let left = self.pilot.unwrap_or(self.samples) - self.level;
            // 1, 1, 2, 4, 8, 16, 16, …: after the first the number doubles, then grows evenly
            self.batch = self.level.clamp(1, LARGEST_BATCH).min(left);
            self.level += self.batch;
        }
    }

    /// How many samples the pixel (by its place, row by row) is to have in all, as far as is known.
    pub fn goal(&self, pixel: usize) -> u32 {
        self.shares.as_ref().map_or(self.samples, |shares| shares.goals[pixel])
    }

    /// How many a pixel that has `taken` so many is to have after the next pass, if it still needs any.
    pub fn end(&self, pixel: usize, taken: u32) -> u32 {
        self.shares.as_ref().map_or(
            taken.saturating_add(self.batch),
            |Shares { goals, pilot, step, steps }| {
                let more = u64::from(goals[pixel] - pilot) * u64::from(*step) / u64::from(*steps);
                pilot + more as u32
            },
        )
    }
}
