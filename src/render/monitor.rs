//! A window on a running render: counters to look at and a switch to cancel it, from any thread.
//!
//! Whoever shows progress reads it at a pace of their own; rendering never waits for them.

use std::sync::atomic::{AtomicBool, AtomicU32, AtomicU64, Ordering::Relaxed};

use crate::integrator::RayCounts;

#[derive(Debug)]
pub struct Monitor {
    cancelled: AtomicBool,
    taken: AtomicU64,
    expected: AtomicU64,
    rays: AtomicU64,
    /// Bits of an `f32`, NaN before the first estimate.
    noise: AtomicU32,
}

impl Default for Monitor {
    fn default() -> Self {
        Self {
            cancelled: AtomicBool::new(false),
            taken: AtomicU64::new(0),
            expected: AtomicU64::new(0),
            rays: AtomicU64::new(0),
            noise: AtomicU32::new(f32::NAN.to_bits()),
        }
    }
}

impl Monitor {
    /// Rendering stops as soon as the samples under way are finished, and keeps them.
    pub fn cancel(&self) {
        self.cancelled.store(true, Relaxed);
    }

    pub fn is_cancelled(&self) -> bool {
        self.cancelled.load(Relaxed)
    }

    /// Samples taken so far, over all pixels.
    pub fn samples(&self) -> u64 {
        self.taken.load(Relaxed)
    }

    /// Rays of all kinds traced so far.
    pub fn rays(&self) -> u64 {
        self.rays.load(Relaxed)
    }

    /// Share of the expected samples that are done, from 0 to 1. With an error to reach the expectation moves.
    pub fn fraction(&self) -> f64 {
        let expected = self.expected.load(Relaxed);
        if expected == 0 { 0.0 } else { (self.samples() as f64 / expected as f64).min(1.0) }
    }

    /// Estimated relative error of the picture as it was at the end of the last pass.
    pub fn noise(&self) -> Option<f32> {
        Some(f32::from_bits(self.noise.load(Relaxed))).filter(|noise| !noise.is_nan())
    }

    pub(crate) fn count(&self, samples: u64, rays: &RayCounts) {
        self.taken.fetch_add(samples, Relaxed);
        self.rays.fetch_add(rays.total(), Relaxed);
    }

    /// What is known between passes: how many samples there will be in all, and how noisy the picture is.
    pub(super) fn report(&self, expected: u64, noise: Option<f32>) {
        self.expected.store(expected, Relaxed);
        self.noise.store(noise.unwrap_or(f32::NAN).to_bits(), Relaxed);
    }
}
