//! Which stretch of which sequence a pixel reads.
//!
//! Where all pixels take the same number of samples, n = 2ᵏ, a square of pixels can share one sequence: each reads n points in a
//! row (or, where it takes fewer, the first of them), and pixels come in the order of a Z-shaped curve. A sequence's stretches of 4n, 16n, … points are nets too, and so
//! are, together, the points of 4, 16, … neighbours: what one pixel misses, the next has. Their errors lean against each other, and
//! their sum is small: noise of high frequency, which the eye, or a filter, averages away ("blue"). Each pixel's own error
//! is as large as before. The scrambling, which is hashed anew for every square and dimension, puts the pixels of each square of
//! the curve in another order (Ahmed and Wonka 2020, *Screen-Space Blue-Noise Diffusion of Monte Carlo Sampling Error via
//! Hierarchical Ordering of Pixels*).
//!
//! The fewer of its n points a pixel takes, the less there is of this, down to errors that are independent: of each half, quarter, …
//! of a stretch the scrambling picks another in each pixel. Where the number is not known in advance, or differs from pixel to
//! pixel, each has a sequence of its own, which does not end after n points.

use super::sobol::PERIOD_BITS;

/// log₂ of the samples of a pixel, at most: with more, a sequence is not enough for four pixels.
const MOST_BITS: u32 = PERIOD_BITS - 2;

/// How the sequences of pixels go together.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Weave {
    /// log₂ of the samples that each pixel takes; `None`: sequences are pixels' own.
    bits: Option<u32>,
}

impl Weave {
    /// Every pixel has a sequence of its own, and may take any number of samples.
    pub const NONE: Self = Self { bits: None };

    /// For pictures in which every pixel takes `samples`, at most; of more than a sequence holds for four pixels there is no weave.
    pub fn of(samples: u32) -> Self {
        let bits = samples.checked_next_power_of_two().map(u32::trailing_zeros);
        Self { bits: bits.filter(|&bits| bits <= MOST_BITS) }
    }

    /// The sequence that pixel (x, y) reads, as two numbers, and its first point there.
    #[inline]
    pub(super) fn place(self, x: u32, y: u32) -> ([u32; 2], u32) {
        let Some(bits) = self.bits else { return ([x, y], 0) };
        // of the pixels of a square, or of two beside each other
        let across = (PERIOD_BITS - bits).div_ceil(2);
        let down = PERIOD_BITS - bits - across;
        let within = |n: u32, bits: u32| n & ((1 << bits) - 1);
        let along = spread(within(x, across)) | spread(within(y, down)) << 1;
        ([x >> across, y >> down], along << bits)
    }
}

/// Bit i to bit 2i, of eight.
fn spread(n: u32) -> u32 {
    let n = (n | n << 4) & 0x0f0f;
    let n = (n | n << 2) & 0x3333;
    (n | n << 1) & 0x5555
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::sobol::PixelSampler;

    const SIDE: usize = 64;

    /// Errors of the mean of a function over the first two dimensions of a set, by pixel: what lies on one side of an edge, which is elsewhere
    /// in every pixel, but slowly moves.
    fn errors(weave: Weave, taken: u32, set: u32) -> Vec<f32> {
        let pixel = |i: usize| {
            let (x, y) = ((i % SIDE) as u32, (i / SIDE) as u32);
            let edge = 0.7 + 0.004 * x as f32 + 0.003 * y as f32;
            let f = |index| {
                let [u, v, ..] = PixelSampler::woven(3, weave, [x, y], index).draw4(set);
                f32::from(u8::from(u + v < edge))
            };
            let area = if edge < 1.0 { 0.5 * edge * edge } else { 1.0 - 0.5 * (2.0 - edge) * (2.0 - edge) };
            (0..taken).map(f).sum::<f32>() / taken as f32 - area
        };
        (0..SIDE * SIDE).map(pixel).collect()
    }

    fn mean_square(values: impl ExactSizeIterator<Item = f32>) -> f32 {
        let n = values.len() as f32;
        values.map(|v| v * v).sum::<f32>() / n
    }

    /// Of the means over squares of 4 × 4 pixels, wherever they begin.
    fn coarse(errors: &[f32]) -> f32 {
        let means: Vec<f32> = (0..(SIDE - 4) * (SIDE - 4))
            .map(|i| (i % (SIDE - 4), i / (SIDE - 4)))
            .map(|(x, y)| (0..16).map(|k| errors[(y + k / 4) * SIDE + x + k % 4]).sum::<f32>() / 16.0)
            .collect();
        mean_square(means.into_iter())
    }

    /// Pixels are as noisy as without, their neighbourhoods far less.
    #[test]
    fn errors_of_neighbours_cancel() {
        for (samples, set) in [(1, 0), (2, 3), (4, 1), (6, 2), (8, 0), (16, 2), (64, 4)] {
            let (apart, woven) =
                (errors(Weave::NONE, samples, set), errors(Weave::of(samples), samples, set));
            let pixels = mean_square(woven.iter().copied()) / mean_square(apart.iter().copied());
            assert!((0.85..1.15).contains(&pixels), "{samples} samples: {pixels}");
            let gain = coarse(&woven) / coarse(&apart);
            assert!(gain < 0.7, "{samples} samples: {gain}");
        }
    }

    /// A picture that ends early has errors like any other.
    #[test]
    fn a_part_of_the_samples_is_no_worse() {
        for taken in [1, 3, 8] {
            let (apart, woven) = (errors(Weave::NONE, taken, 0), errors(Weave::of(16), taken, 0));
            let gain = coarse(&woven) / coarse(&apart);
            assert!(gain < 1.2, "{taken} of 16 samples: {gain}");
        }
    }

    #[test]
    fn pixels_share_no_point() {
        for samples in [1, 2, 32, 1024] {
            let mut seen = std::collections::HashSet::new();
            for (x, y) in (0..64).flat_map(|y| (0..64).map(move |x| (x, y))) {
                let (sequence, first) = Weave::of(samples).place(x, y);
                assert!(first + samples <= 1 << PERIOD_BITS && first % samples == 0);
                assert!(seen.insert((sequence, first)), "{samples} samples, pixel {x}, {y}");
            }
        }
        assert_eq!([Weave::of(1025), Weave::of(u32::MAX)], [Weave::NONE; 2]);
    }
}
