//! What each pass takes, and how many samples each pixel gets in all.
//!
//! A picture is made in stages, of some passes each. In the first every pixel takes the same number; then, where samples are to go where
//! the noise is ([`Settings::adaptive`]), what all have shown by then decides how the work of the next stage is shared out
//! (`allotment.rs`).
//!
//! Where a number of samples alone is asked for, the first stage is a quarter of them, and the second the rest. With an end that is not
//! known (a relative error to reach, or a time), the first stage is short, the second at most four times as long in all, and each of the others
//! at most doubles the work, so that shares are seldom older than half of it; with an error to reach, a stage takes no more than should bring the picture there.
//!
//! The error that ends a picture is that of the whole ([`relative_error`](crate::film::relative_error)), looked at between stages: the mean over
//! all pixels, on which each has next to no influence. A rule by which each pixel stopped on seeing its own samples would favour those that
//! have met nothing bright yet. Estimated from few samples an error is rather too low: hence never less than [`LEAST_SAMPLES`] of a
//! pixel, and another stage where it turns out to be larger.

use super::{
    Outcome, Settings,
    allotment::{Ask, allot},
};
use crate::film::{Film, Pixel};

/// Samples per pass once the first few have shown the picture.
const LARGEST_BATCH: u32 = 16;

/// Of the samples asked for, one in so many is taken before any allotment.
const PILOT_PART: u32 = 4;

/// The largest first stage where a time may be the end.
const OPEN_PILOT: u32 = 16;

/// With fewer in every pixel, no estimate of the error is believed.
const LEAST_SAMPLES: u32 = 16;

/// Nor with fewer in all, as in a picture of a few pixels: each would decide by its own.
const LEAST_IN_ALL: f64 = 4096.0;

/// A stage that is to reach an error takes so much more than all before, at least.
const LEAST_GROWTH: f64 = 1.0 / 8.0;

/// A stage aims at so much of the error asked for, so that one more is seldom needed.
const AIM: f64 = 0.98;

/// Of the samples: what is left is not worth a stage.
const NEARLY_ALL: f64 = 0.97;

pub struct Schedule {
    samples: u32,
    adaptive: bool,
    /// To be reached; 0 where there is none.
    noise: f32,
    /// Whether an error or a time may end it before all samples.
    open: bool,
    stage: Stage,
    /// At its end all samples are taken.
    last: bool,
    /// At its end: as many samples of every pixel take as much work.
    level: f64,
}

enum Stage {
    /// Every pixel takes as many: `now` after this pass.
    Equal { now: u32, until: u32 },
    /// By pixel, in equal steps.
    Shared { goals: Vec<u32>, passes: u32 },
}

impl Schedule {
    pub fn new(settings: &Settings) -> Self {
        let &Settings { samples, noise, .. } = settings;
        let (adaptive, open) = (settings.shares_out(), settings.is_open());
        let part = samples / PILOT_PART;
        let pilot = match open {
            true if noise > 0.0 => samples.min(LEAST_SAMPLES),
            true => part.min(OPEN_PILOT),
            false => part,
        };
        let until = match adaptive {
            true => pilot,
            false if noise > 0.0 => samples.min(LEAST_SAMPLES),
            false => samples,
        };
        Self {
            samples,
            adaptive,
            noise,
            open,
            stage: Stage::Equal { now: 0, until },
            last: until == samples,
            level: until.into(),
        }
    }

    /// Goes on to the next pass over `film`, of whose tiles each has taken so much `work`, and whose relative error is `noise`; or says how
    /// rendering ended.
    pub fn advance(&mut self, film: &Film, work: &[f64], noise: Option<f32>) -> Option<Outcome> {
        if film.pixels().is_empty() {
            return Some(Outcome::Finished);
        }
        if self.stage.is_over() {
            let is_believed =
                self.level >= LEAST_SAMPLES.into() && self.level * film.pixels().len() as f64 >= LEAST_IN_ALL;
            if is_believed && noise.is_some_and(|noise| noise < self.noise) {
                return Some(Outcome::NoiseReached);
            }
            if self.last {
                return Some(Outcome::Finished);
            }
            self.stage = if self.adaptive { self.share(film, work, noise) } else { self.equal(noise) };
        } else if let Stage::Shared { passes, .. } = &mut self.stage {
            *passes -= 1;
        }
        if let Stage::Equal { now, until } = &mut self.stage {
            // 1, 1, 2, 4, 8, 16, 16, …: after the first the number doubles, then grows evenly
            *now += (*now).clamp(1, LARGEST_BATCH).min(*until - *now);
        }
        None
    }

    /// How many a pixel (by its place, row by row) that has `taken` so many is to have after the pass.
    pub fn end(&self, pixel: usize, taken: u32) -> u32 {
        match &self.stage {
            Stage::Equal { now, .. } => *now,
            Stage::Shared { goals, passes } => {
                let more = u64::from(goals[pixel].saturating_sub(taken));
                let passes = u64::from(*passes);
                taken + ((more + passes / 2) / passes) as u32
            }
        }
    }

    /// Samples of all pixels at the end, as far as can be told from those `taken` and their `noise`.
    pub fn expected(&self, film: &Film, taken: u64, noise: Option<f32>) -> u64 {
        let all = film.pixels().len() as u64 * u64::from(self.samples);
        let of_stage = match &self.stage {
            Stage::Equal { until, .. } => film.pixels().len() as u64 * u64::from(*until),
            Stage::Shared { goals, .. } => goals.iter().map(|&goal| u64::from(goal)).sum(),
        };
        match noise {
            _ if self.last => of_stage,
            // errors fall as 1/√n
            Some(noise) if self.noise > 0.0 => {
                let needed = taken as f64 * f64::from(noise / self.noise).powi(2);
                (needed as u64).min(all).max(of_stage)
            }
            _ => all.max(of_stage),
        }
    }

    /// The next stage, where all pixels take as many.
    fn equal(&mut self, noise: Option<f32>) -> Stage {
        let now = self.level as u32;
        let needed = noise.map_or(f64::INFINITY, |noise| (f64::from(noise / self.noise) / AIM).powi(2));
        let growth = needed.clamp(1.0 + LEAST_GROWTH, 2.0);
        let until = whole(self.level * growth, block(self.level / 8.0)).min(self.samples);
        self.last = until == self.samples;
        self.level = until.into();
        Stage::Equal { now, until }
    }

    /// The next stage, where samples go where the noise is.
    fn share(&mut self, film: &Film, work: &[f64], noise: Option<f32>) -> Stage {
        let is_first = matches!(self.stage, Stage::Equal { .. });
        let [samples, pixels] = [f64::from(self.samples), film.pixels().len() as f64];
        let growth = if is_first { f64::from(PILOT_PART) } else { 2.0 };
        let ask = if self.open {
            let budget = (self.level * growth).min(samples);
            // finer where the error decides how much is taken
            let parts = if self.noise > 0.0 { 16.0 } else { 4.0 };
            Ask {
                block: block(budget / parts),
                least: (self.level as u32 / PILOT_PART).max(1),
                budget,
                needed: (self.level * (1.0 + LEAST_GROWTH)).max(LEAST_IN_ALL / pixels).min(budget),
                strict: true,
                error: noise
                    .filter(|_| self.noise > 0.0)
                    .map(|noise| [noise.into(), AIM * f64::from(self.noise)]),
            }
        } else {
            let pilot = self.level as u32;
            Ask { block: pilot, least: pilot, budget: samples, needed: samples, strict: false, error: None }
        };
        let mut allotment = allot(film, work, &ask);
        let adds = |(&goal, pixel): (&u32, &Pixel)| goal > pixel.taken();
        if self.open && !allotment.goals.iter().zip(film.pixels()).any(adds) {
            // nothing is left by rounding, or all noise is the lamps'
            let step = ask.block.min((samples - self.level).max(1.0) as u32);
            allotment.goals.iter_mut().for_each(|goal| *goal += step);
            allotment.level += f64::from(step);
        }
        self.last = !self.open || allotment.level >= NEARLY_ALL * samples;
        let passes = ((allotment.level - self.level) / f64::from(LARGEST_BATCH)).ceil().max(1.0) as u32;
        self.level = allotment.level;
        Stage::Shared { goals: allotment.goals, passes }
    }
}

impl Stage {
    /// Whether the pass was its last.
    fn is_over(&self) -> bool {
        match self {
            Self::Equal { now, until } => now == until,
            Self::Shared { passes, .. } => *passes <= 1,
        }
    }
}

/// The largest power of two up to `samples`: parts of a low-discrepancy sequence are best whole.
fn block(samples: f64) -> u32 {
    1 << samples.max(1.0).log2() as u32
}

/// The least multiple of `block` that is not less.
fn whole(level: f64, block: u32) -> u32 {
    (level / f64::from(block)).ceil() as u32 * block
}
