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
    filter: PixelFilter,
    /// Of f over the support.
    integral: f32,
}

impl FilterTable {
    pub fn new(filter: PixelFilter) -> Self {
        let width = filter.width as f64;
        let f = |x: f64| value(filter.kind, width, x);
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
        let integral = (total * width / STEPS as f64) as f32;
        Self { quantiles: (0..=CELLS).map(quantile).collect(), filter, integral }
    }

    /// Offset from the pixel's centre, in pixels.
    pub fn sample(&self, u: Vec2) -> Vec2 {
        Vec2::new(self.axis(u.x), self.axis(u.y))
    }

    /// The density of [`sample`](Self::sample) at an offset, per square pixel.
    pub fn density(&self, offset: Vec2) -> f32 {
        let axis = |x: f32| {
            let inside = x.abs() <= 0.5 * self.filter.width;
            let f = || value(self.filter.kind, self.filter.width.into(), x.into()) as f32 / self.integral;
            if inside { f() } else { 0.0 }
        };
        if self.filter.kind == FilterKind::Box {
            // (a constant: no need for the table's digits)
            let inside = offset.abs().max_element() <= 0.5 * self.filter.width;
            return if inside { 1.0 / (self.filter.width * self.filter.width) } else { 0.0 };
        }
        axis(offset.x) * axis(offset.y)
    }

    /// Half of the support's width, pixels.
    pub fn reach(&self) -> f32 {
        0.5 * self.filter.width
    }

    fn axis(&self, u: f32) -> f32 {
        let scaled = u * CELLS as f32;
        let i = (scaled as usize).min(CELLS - 1);
        let (a, b) = (self.quantiles[i], self.quantiles[i + 1]);
        a + (b - a) * (scaled - i as f32)
    }
}

/// f(x), not normalised.
fn value(kind: FilterKind, width: f64, x: f64) -> f64 {
    match kind {
        FilterKind::Box => 1.0,
        FilterKind::Gaussian => {
            let gaussian = |x: f64| (-18.0 * (x / width).powi(2)).exp();
            gaussian(x) - gaussian(width / 2.0)
        }
        FilterKind::BlackmanHarris => {
            let theta = TAU * (x / width + 0.5);
            0.35875 - 0.48829 * theta.cos() + 0.14128 * (2.0 * theta).cos() - 0.01168 * (3.0 * theta).cos()
        }
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

    #[test]
    fn offsets_stay_inside_the_support() {
        let table = FilterTable::new(PixelFilter { kind: FilterKind::BlackmanHarris, width: 3.0 });
        assert!(table.axis(0.0) >= -1.5 && table.axis(1.0 - f32::EPSILON) <= 1.5);
    }
}
