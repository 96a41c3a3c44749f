//! What paths from lamps bring, beside the samples of the pixels' own paths: each of N such paths lights a few pixels
//! of the picture, and what a pixel gets from them is the sum over N.
//!
//! ```text
//! mean = Σx / N        error² = (Σx² / N − mean²) / N
//! ```

use std::collections::TryReserveError;

use glam::{DVec3, Vec3};

/// The sums of all pixels; empty where no path came from a lamp.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Lamps {
    sums: Vec<Sums>,
    paths: u64,
}

#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Sums {
    radiance: DVec3,
    squares: DVec3,
}

impl Lamps {
    /// For a film of `len` pixels, or an error where there is not the memory.
    pub fn new(len: usize) -> Result<Self, TryReserveError> {
        let mut sums = Vec::new();
        sums.try_reserve_exact(len)?;
        sums.resize(len, Sums::default());
        Ok(Self { sums, paths: 0 })
    }

    /// Paths that were traced, whether they brought anything or not.
    pub fn count(&mut self, paths: u64) {
        self.paths += paths;
    }

    /// What one path brings to a pixel; left out where a channel is negative or not finite.
    pub fn add(&mut self, pixel: usize, radiance: Vec3) {
        if let Some(sums) = self.sums.get_mut(pixel)
            && radiance.is_finite()
            && radiance.min_element() >= 0.0
        {
            let x = radiance.as_dvec3();
            sums.radiance += x;
            sums.squares += x * x;
        }
    }

    pub fn mean(&self, pixel: usize) -> DVec3 {
        match self.sums.get(pixel) {
            Some(sums) if self.paths > 0 => sums.radiance / self.paths as f64,
            _ => DVec3::ZERO,
        }
    }

    /// Of the mean.
    pub fn variance(&self, pixel: usize) -> DVec3 {
        match self.sums.get(pixel) {
            Some(sums) if self.paths > 0 => {
                let n = self.paths as f64;
                ((sums.squares / n - (sums.radiance / n).powf(2.0)) / n).max(DVec3::ZERO)
            }
            _ => DVec3::ZERO,
        }
    }

    /// Bytes.
    pub fn memory(&self) -> usize {
        size_of_val(self.sums.as_slice())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::stats::uniform;

    #[test]
    fn mean_and_error_are_those_of_all_paths() {
        // one path in ten brings something uniform in [0, 1): mean 1/20, variance 1/30 − 1/400
        let mut lamps = Lamps::new(2).expect("small");
        let n = 100_000;
        for i in 0..n {
            if uniform(i, 0) < 0.1 {
                lamps.add(1, Vec3::splat(uniform(i, 1)));
            }
        }
        lamps.count(n.into());
        assert!((lamps.mean(1).x / 0.05 - 1.0).abs() < 0.02, "{}", lamps.mean(1));
        let expected = (1.0 / 30.0 - 1.0 / 400.0) / f64::from(n);
        assert!((lamps.variance(1).y / expected - 1.0).abs() < 0.05);
        assert_eq!((lamps.mean(0), lamps.variance(0)), (DVec3::ZERO, DVec3::ZERO));
        let before = lamps.clone();
        lamps.add(0, Vec3::new(1.0, f32::NAN, 0.0));
        lamps.add(7, Vec3::ONE);
        assert_eq!(lamps, before);
        assert_eq!(Lamps::default().mean(3), DVec3::ZERO);
    }
}
