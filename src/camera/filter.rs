//! Reconstruction filter, sampled by importance: a sample's offset from its pixel's centre is drawn with a density
//! proportional to the filter, and then weighs 1 (Ernst, Stamminger, Greiner 2006, *Filter Importance Sampling*).
//! Each sample belongs to one pixel, so pixels stay independent of each other.
//!
//! Separable; each axis by the inverse of its tabulated integral. With w the full width and x in [−w/2, w/2]:
//!
//! | kind | f(x) |
//! |---|---|
//! | box | 1 |
//! | gaussian | exp(−x² / 2σ²) − exp(−(w/2)² / 2σ²), σ = w/6 |
//! | Blackman–Harris | 0.35875 − 0.48829 cos θ + 0.14128 cos 2θ − 0.01168 cos 3θ, θ = 2π (x/w + ½) |

use std::f64::consts::TAU;

use glam::Vec2;

use crate::render::{FilterKind, PixelFilter};

const CELLS: usize = 1024;

#[derive(Clone, Debug)]
pub struct FilterTable {
    /// x at which the integral of the filter reaches i / CELLS.
    quantiles: Vec<f32>,
    /// Of a box, which needs no table.
    even: Option<f32>,
}

impl FilterTable {
    pub fn new(filter: PixelFilter) -> Self {
        let width = filter.width as f64;
        let f = |x: f64| match filter.kind {
            FilterKind::Box => 1.0,
            FilterKind::Gaussian => {
                let gaussian = |x: f64| (-18.0 * (x / width).powi(2)).exp();
                gaussian(x) - gaussian(width / 2.0)
            }
            FilterKind::BlackmanHarris => {
                let theta = TAU * (x / width + 0.5);
                0.35875 - 0.48829 * theta.cos() + 0.14128 * (2.0 * theta).cos()
                    - 0.01168 * (3.0 * theta).cos()
            }
        };
        const STEPS: usize = 1 << 16;
        let x = |i: usize| width * (i as f64 / STEPS as f64 - 0.5);
        let mut integral = vec![0.0; STEPS + 1];
        for i in 0..STEPS {
            integral[i + 1] = integral[i] + f(0.5 * (x(i) + x(i + 1)));
        }
        let total = integral[STEPS];
        let quantile = |k: usize| {
            let target = total * k as f64 / CELLS as f64;
            let i = integral.partition_point(|&s| s < target).clamp(1, STEPS);
            let part = (target - integral[i - 1]) / (integral[i] - integral[i - 1]).max(f64::MIN_POSITIVE);
            (x(i - 1) + part.clamp(0.0, 1.0) * (x(i) - x(i - 1))) as f32
        };
        let even = (filter.kind == FilterKind::Box).then_some(filter.width);
        Self { quantiles: (0..=CELLS).map(quantile).collect(), even }
    }

    /// Offset from the pixel's centre, in pixels.
    pub fn sample(&self, u: Vec2) -> Vec2 {
        match self.even {
            Some(width) => (u - 0.5) * width,
            None => Vec2::new(self.axis(u.x), self.axis(u.y)),
        }
    }

    /// The density of [`sample`](Self::sample) at an offset, per square pixel.
    pub fn density(&self, offset: Vec2) -> f32 {
        // exactly that of the table: as likely as any cell, and even in it
        let axis = |x: f32| {
            let above = self.quantiles.partition_point(|&q| q <= x);
            match (above.checked_sub(1).map(|i| self.quantiles[i]), self.quantiles.get(above)) {
                (Some(a), Some(b)) => 1.0 / (CELLS as f32 * (b - a)),
                _ => 0.0,
            }
        };
        axis(offset.x) * axis(offset.y)
    }

    /// Half of the support's width, pixels.
    pub fn reach(&self) -> f32 {
        self.quantiles[CELLS]
    }

    fn axis(&self, u: f32) -> f32 {
        let scaled = u * CELLS as f32;
        let i = (scaled as usize).min(CELLS - 1);
        let (a, b) = (self.quantiles[i], self.quantiles[i + 1]);
        a + (b - a) * (scaled - i as f32)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn variance(kind: FilterKind, width: f32) -> f64 {
        let table = FilterTable::new(PixelFilter { kind, width });
        let n = 100_000;
        let x = |i: u32| table.axis((i as f32 + 0.5) / n as f32) as f64;
        assert!((0..n).map(x).sum::<f64>().abs() / (n as f64) < 1e-4, "centred");
        (0..n).map(|i| x(i).powi(2)).sum::<f64>() / n as f64
    }

    /// Second moments in closed form: they change with the shape and with the width.
    #[test]
    fn offsets_have_the_moments_of_the_filter() {
        assert!((variance(FilterKind::Box, 1.0) - 1.0 / 12.0).abs() < 1e-4);
        // ∫ x² cos(2πk(x + ½)) dx over one period is 1 / 2π²k²
        let pi2 = std::f64::consts::PI.powi(2);
        let second = 0.35875 / 12.0 - 0.48829 / (2.0 * pi2) + 0.14128 / (8.0 * pi2) - 0.01168 / (18.0 * pi2);
        assert!((variance(FilterKind::BlackmanHarris, 3.0) - 9.0 * second / 0.35875).abs() < 2e-3);
        // a gaussian cut at 3σ and shifted to end at 0 is a little narrower than σ = w/6
        assert!((variance(FilterKind::Gaussian, 3.0).sqrt() - 0.5).abs() < 0.03);
    }

    /// Of many offsets, the share that falls into each of 24 slices is the density's integral over it.
    #[test]
    fn offsets_follow_their_density() {
        for (kind, width) in
            [(FilterKind::Box, 1.0), (FilterKind::Gaussian, 2.0), (FilterKind::BlackmanHarris, 3.3)]
        {
            let table = FilterTable::new(PixelFilter { kind, width });
            let (n, slices) = (1 << 16, 24);
            let mut found = vec![0.0; slices];
            for i in 0..n {
                let x = table.axis((i as f32 + 0.5) / n as f32);
                found[(((x / width + 0.5) * slices as f32) as usize).min(slices - 1)] += 1.0 / n as f32;
            }
            let middle = table.density(Vec2::ZERO).sqrt();
            for (slice, share) in found.iter().enumerate() {
                let at = |k: usize| (slice as f32 + (k as f32 + 0.5) / 64.0) / slices as f32 - 0.5;
                let densities = (0..64).map(|k| table.density(Vec2::new(at(k) * width, 0.0)) / middle);
                let expected = densities.sum::<f32>() * width / (64 * slices) as f32;
                assert!((share - expected).abs() < 2e-4, "{kind:?}, slice {slice}: {share}, not {expected}");
            }
            let beyond = 0.51 * width;
            assert_eq!([beyond, -beyond].map(|x| table.density(Vec2::new(x, 0.0))), [0.0; 2]);
        }
    }

    #[test]
    fn offsets_stay_inside_the_support() {
        let table = FilterTable::new(PixelFilter { kind: FilterKind::BlackmanHarris, width: 3.0 });
        assert!(table.axis(0.0) >= -1.5 && table.axis(1.0 - f32::EPSILON) <= 1.5);
    }
}
