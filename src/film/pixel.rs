//! One pixel's first two moments, per channel, by Welford's recurrence (*Note on a method for calculating corrected
//! sums of squares and products*, Technometrics 4, 1962):
//!
//! ```text
//! mean ← mean + (x − mean) / n        M ← M + (x − mean_before)(x − mean_after)
//! variance = M / (n − 1)              standard error² = variance / n
//! ```
//!
//! Nothing large is subtracted from something nearly equal, as Σx² − (Σx)²/n would: a wall of radiance 1000 ± 0.01
//! keeps its variance. Samples are `f32`, the state is `f64`: it takes the eight bytes of a compensated `f32` sum
//! (Neumaier's pair) without its steps, and the square of any `f32` fits. What it rounds away, at a million samples, is
//! below the last digit of the `f32` that the mean is handed out in.

use glam::{DVec3, Vec3};

use crate::color::LUMINANCE;

#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Pixel {
    mean: DVec3,
    squared_deviations: DVec3,
    kept: u32,
    dropped: u32,
}

impl Pixel {
    /// Adds a sample, or drops and counts it where a channel is negative or not finite.
    pub fn add(&mut self, sample: Vec3) {
        if sample.is_finite() && sample.min_element() >= 0.0 {
            let x = sample.as_dvec3();
            self.kept += 1;
            let before = x - self.mean;
            self.mean += before / f64::from(self.kept);
            self.squared_deviations += before * (x - self.mean);
        } else {
            self.dropped += 1;
        }
    }

    /// Samples in the mean.
    pub fn kept(&self) -> u32 {
        self.kept
    }

    pub fn dropped(&self) -> u32 {
        self.dropped
    }

    /// Samples drawn for this pixel so far, dropped ones included: the index of the next.
    pub fn taken(&self) -> u32 {
        self.kept + self.dropped
    }

    /// Black without samples.
    pub fn mean(&self) -> Vec3 {
        self.mean.as_vec3()
    }

    /// Unbiased estimate of the variance of a single sample; `None` below two samples.
    pub fn variance(&self) -> Option<Vec3> {
        (self.kept >= 2).then(|| (self.squared_deviations / f64::from(self.kept - 1)).as_vec3())
    }

    /// Of the mean. In `f64`, as is its error: neither overflows, whatever the samples.
    pub fn luminance(&self) -> f64 {
        self.mean.dot(LUMINANCE)
    }

    /// Standard error of [`luminance`](Self::luminance), from above: the channels are taken as fully correlated,
    /// which the noise of paths nearly is (σ(Σ wx) ≤ Σ wσ(x)). Infinite below two samples.
    pub fn luminance_error(&self) -> f64 {
        if self.kept < 2 {
            return f64::INFINITY;
        }
        let n = f64::from(self.kept);
        let standard_error = (self.squared_deviations / (n * (n - 1.0))).map(f64::sqrt);
        standard_error.dot(LUMINANCE)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::stats::uniform;

    /// Samples that are multiples of 2⁻¹², summed exactly in integers: mean and variance without rounding error.
    fn exact_moments(steps: impl Iterator<Item = i128>) -> (f64, f64) {
        let (mut n, mut sum, mut squares) = (0, 0, 0);
        for k in steps {
            n += 1;
            sum += k;
            squares += k * k;
        }
        let mean = sum as f64 / n as f64 / 4096.0;
        let variance = (n * squares - sum * sum) as f64 / (n * (n - 1)) as f64 / (4096.0 * 4096.0);
        (mean, variance)
    }

    fn compare(name: &str, n: u32, steps: impl Fn(u32) -> i128) {
        let mut pixel = Pixel::default();
        for i in 0..n {
            pixel.add(Vec3::splat(steps(i) as f32 / 4096.0));
        }
        let (mean, variance) = exact_moments((0..n).map(steps));
        let mean_error = (pixel.mean().x as f64 / mean - 1.0).abs();
        let variance_error = (pixel.variance().expect("many samples").y as f64 / variance - 1.0).abs();
        assert!(mean_error <= 6e-8, "{name}, {n} samples: mean off by {mean_error:.1e}");
        assert!(variance_error <= 1e-6, "{name}, {n} samples: variance off by {variance_error:.1e}");
    }

    #[test]
    fn neither_moment_drifts() {
        for n in [100_000, 1_000_000] {
            // 1000 + noise of ±0.016, which is 130 steps of an f32 there
            compare("bright and quiet", n, |i| 4_096_000 + (uniform(i, 0) * 128.0) as i128 - 64);
            // mostly 0.01, one in ten thousand is 4000
            compare("fireflies", n, |i| if uniform(i, 1) < 1e-4 { 16_384_000 } else { 41 });
            compare("a constant and one more", n, |i| if i == 7 { 4097 } else { 4096 });
        }
    }

    #[test]
    fn bad_samples_are_dropped_and_counted() {
        let mut pixel = Pixel::default();
        pixel.add(Vec3::ONE);
        for bad in [Vec3::NAN, Vec3::new(0.0, f32::INFINITY, 0.0), Vec3::new(1.0, 1.0, -1e-20)] {
            pixel.add(bad);
        }
        pixel.add(Vec3::splat(3.0));
        assert_eq!((pixel.kept(), pixel.dropped(), pixel.taken()), (2, 3, 5));
        assert_eq!(pixel.mean(), Vec3::splat(2.0));
        assert_eq!(pixel.variance(), Some(Vec3::splat(2.0)));
    }

    #[test]
    fn extremes_overflow_nothing() {
        let mut pixel = Pixel::default();
        for x in [f32::MAX, 0.0, f32::MAX, f32::MIN_POSITIVE] {
            pixel.add(Vec3::splat(x));
        }
        assert!(pixel.mean().is_finite() && pixel.mean().x > 1e38);
        assert!((pixel.luminance_error() / pixel.luminance() - 1.0 / 3.0f64.sqrt()).abs() < 1e-6);
        assert_eq!(Pixel::default().mean(), Vec3::ZERO);
        assert_eq!(Pixel::default().variance(), None);
        assert_eq!(Pixel::default().luminance_error(), f64::INFINITY);
    }

    #[test]
    fn luminance_error_is_the_spread_of_the_mean() {
        // Uniform in [0, 1]: σ = 1/√12; all channels equal, so the bound is an equality.
        let mut pixel = Pixel::default();
        (0..10_000).for_each(|i| pixel.add(Vec3::splat(uniform(i, 2))));
        let expected = (1.0 / 12.0f64).sqrt() / 100.0;
        assert!((pixel.luminance_error() / expected - 1.0).abs() < 0.02, "{}", pixel.luminance_error());
    }

    #[test]
    fn memory_is_as_documented() {
        assert_eq!(size_of::<Pixel>(), 56);
    }
}
