//! Owen-scrambled Sobol′ points, four dimensions at a time, a pattern of its own for every pixel, or woven into those around
//! ([`Weave`]).
//!
//! Sets of four dimensions are padded: each set shuffles the sample index and shifts its dimensions with a hash of
//! (seed, pixel, set), so sets and, unless woven, pixels are independent of each other while each set on its own stays a
//! (0, 2)-sequence in its first two dimensions and well stratified in all four.
//!
//! One scrambled sequence of `PERIOD` points is tabulated. A set reads it in an order of its own (the index is scrambled as
//! a number, which keeps aligned blocks of 2ᵏ points together, and each of those is a net) and flips the digits of each
//! dimension at random: a shift is uniform, so that every estimate is unbiased and pixels are uncorrelated, and it keeps
//! nets nets. Scrambling anew for every set costs three times as much and gains nothing that was measured. After
//! `PERIOD` samples come shuffles and shifts that have nothing to do with those before.
//!
//! Burley 2020, *Practical Hash-based Owen Scrambling*; the permutation is Vegdahl's improvement (2021) of
//! Laine and Karras's. Direction numbers: Joe and Kuo 2008.
//!
//! A point is a pure function of (seed, pixel, index, set), for up to 2³² samples.

use std::sync::LazyLock;

use super::weave::Weave;

/// Points in the table: 64 KB.
const PERIOD: u32 = 1 << PERIOD_BITS;
pub(super) const PERIOD_BITS: u32 = 12;

/// Point i, as numerators over 2³², at the place of i's bits in reverse.
static TABLE: LazyLock<Box<[[u32; 4]]>> = LazyLock::new(|| {
    let sobol = |index: u32| {
        let directions = [&DIRECTIONS[0], &DIRECTIONS[1], &DIRECTIONS[2]];
        let sum = |columns: &[u32; 32]| {
            (0..32).filter(|bit| index >> bit & 1 == 1).fold(0, |sum, bit| sum ^ columns[bit])
        };
        let [a, b, c] = directions.map(sum);
        let mut reversed = [index, a, b, c];
        for (x, seed) in reversed.iter_mut().zip(1..) {
            *x = permute(*x, hash(0, seed)).reverse_bits();
        }
        reversed
    };
    (0..PERIOD).map(|place| sobol(place.reverse_bits() >> (32 - PERIOD_BITS))).collect()
});

/// Columns of the generator matrices of Sobol′ dimensions 1 to 3, bit-reversed (dimension 0 is the identity then).
const DIRECTIONS: [[u32; 32]; 3] =
    [directions(&[1], 0, 1), directions(&[1, 3], 1, 2), directions(&[1, 3, 1], 1, 3)];

/// Direction numbers from the initial odd numbers `m` and the primitive polynomial of the given degree whose
/// middle coefficients are the bits of `a`.
const fn directions(m: &[u32], a: u32, degree: usize) -> [u32; 32] {
    let mut v = [0u32; 32];
    let mut i = 0;
    while i < 32 {
        if i < degree {
            v[i] = m[i] << (31 - i);
        } else {
            let mut x = v[i - degree] ^ (v[i - degree] >> degree);
            let mut k = 1;
            while k < degree {
                if (a >> (degree - 1 - k)) & 1 == 1 {
                    x ^= v[i - k];
                }
                k += 1;
            }
            v[i] = x;
        }
        i += 1;
    }
    let mut i = 0;
    while i < 32 {
        v[i] = v[i].reverse_bits();
        i += 1;
    }
    v
}

/// The sequence of one pixel at one sample index.
#[derive(Clone, Copy, Debug)]
pub struct PixelSampler {
    table: &'static [[u32; 4]],
    pixel: u64,
    /// Of the pixel and the period.
    key: u64,
    /// The pixel's first point.
    first: u32,
    index: u32,
    /// Place in the table before any shuffle, in the uppermost bits.
    place: u32,
}

impl PixelSampler {
    /// Of a pixel that has a sequence of its own.
    pub fn new(seed: u64, x: u32, y: u32, index: u32) -> Self {
        Self::woven(seed, Weave::NONE, [x, y], index)
    }

    /// Of a pixel that may share its sequence with others.
    pub fn woven(seed: u64, weave: Weave, [x, y]: [u32; 2], index: u32) -> Self {
        let ([x, y], first) = weave.place(x, y);
        let pixel = mix(seed ^ mix((x as u64) << 32 | y as u64));
        Self { table: &TABLE, pixel, key: 0, first, index: 0, place: 0 }.at(u64::from(index))
    }

    /// One of the `branches` that a path has from some vertex on. In the sets that only branches draw from, those of all samples
    /// together are well spread.
    pub fn branch(&self, branch: u32, branches: u32) -> Self {
        self.at(u64::from(self.index) * u64::from(branches) + u64::from(branch))
    }

    fn at(&self, index: u64) -> Self {
        let point = u64::from(self.first) + index;
        let (period, within) = (point / u64::from(PERIOD), (point % u64::from(PERIOD)) as u32);
        let key = self.pixel ^ period.wrapping_mul(0x9fb2_1c65_1e98_df25);
        Self { key, index: index as u32, place: within.reverse_bits(), ..*self }
    }

    /// Four stratified numbers in [0, 1). Each `set` is independent of the others.
    #[inline]
    pub fn draw4(&self, set: u32) -> [f32; 4] {
        let a = mix(self.key.wrapping_add(u64::from(set) << 32));
        let b = mix(a);
        let c = b.wrapping_mul(0xd6e8_feb8_6659_fd93);
        let place = permute(self.place, (a >> 32) as u32) >> (32 - PERIOD_BITS);
        let point = &self.table[place as usize];
        let shift = [a as u32, (b >> 32) as u32, b as u32, (c >> 32) as u32];
        [
            unit(point[0] ^ shift[0]),
            unit(point[1] ^ shift[1]),
            unit(point[2] ^ shift[2]),
            unit(point[3] ^ shift[3]),
        ]
    }

    /// A number in [0, 1) for a decision that belongs to something met on the way (such as the coverage of a
    /// triangle): the same for the same `salt`, independent of all others. Stratified among the samples of the pixel that
    /// meet the same.
    pub fn hashed(&self, salt: u64) -> f32 {
        let a = mix(mix(salt ^ HASHED) ^ self.key);
        let place = permute(self.place, (a >> 32) as u32) >> (32 - PERIOD_BITS);
        unit(self.table[place as usize][0] ^ a as u32)
    }
}

/// Sets numbers for what is met apart from those drawn in order.
const HASHED: u64 = 0x6d65_7420_6f6e_2069;

/// The top 24 bits as a float in [0, 1).
fn unit(x: u32) -> f32 {
    (x >> 8) as f32 * (1.0 / (1 << 24) as f32)
}

/// Owen scrambling of a bit-reversed number: each bit is flipped or not by a hash of the bits above it (which, in
/// the reversed number, are those below).
fn permute(mut x: u32, seed: u32) -> u32 {
    x ^= x.wrapping_mul(0x3d20_adea);
    x = x.wrapping_add(seed);
    x = x.wrapping_mul((seed >> 16) | 1);
    x ^= x.wrapping_mul(0x0552_6c56);
    x ^ x.wrapping_mul(0x53a2_2864)
}

fn hash(a: u32, b: u32) -> u32 {
    (mix((a as u64) << 32 | b as u64) >> 32) as u32
}

/// The finaliser of SplitMix64 (Stafford's variant 13): every bit of the input reaches every bit of the output.
fn mix(mut x: u64) -> u64 {
    x = x.wrapping_add(0x9e37_79b9_7f4a_7c15);
    x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ (x >> 31)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn points(n: u32, x: u32, set: u32) -> Vec<[f32; 4]> {
        (0..n).map(|i| PixelSampler::new(7, x, 3, i).draw4(set)).collect()
    }

    /// The first 2^k points put one into each elementary interval of volume 2^-k: the (0, 2)-sequence property,
    /// which a wrong matrix or a scrambling that is not Owen's breaks.
    #[test]
    fn first_two_dimensions_are_a_net() {
        for (k, set) in [(4, 0), (6, 1), (10, 9)] {
            let points = points(1 << k, 5, set);
            for a in 0..=k {
                let mut cells = vec![0; 1 << k];
                for p in &points {
                    let column = (p[0] * (1 << a) as f32) as usize;
                    let row = (p[1] * (1 << (k - a)) as f32) as usize;
                    cells[row << a | column] += 1;
                }
                assert!(cells.iter().all(|&c| c == 1), "k {k}, 2^{a} columns, set {set}");
            }
        }
    }

    #[test]
    fn every_dimension_is_stratified() {
        for d in 0..4 {
            let mut cells = vec![0; 256];
            points(256, 1, 4).iter().for_each(|p| cells[(p[d] * 256.0) as usize] += 1);
            assert!(cells.iter().all(|&c| c == 1), "dimension {d}");
        }
    }

    /// A smooth integrand over all four dimensions converges far faster than independent points would.
    #[test]
    fn four_dimensional_integral_converges_like_a_net() {
        let f = |p: &[f32; 4]| p.iter().map(|&x| 1.5 * f64::from(x).sqrt()).product::<f64>();
        let mut squared = 0.0;
        for pixel in 0..64 {
            let n = 1024;
            let mean = points(n, pixel, 2).iter().map(f).sum::<f64>() / n as f64;
            squared += (mean - 1.0).powi(2) / 64.0;
        }
        let independent = ((9.0f64 / 8.0).powi(4) - 1.0) / 1024.0;
        assert!(squared < 0.05 * independent, "{squared:.2e} against {independent:.2e}");
    }

    /// Those of all samples together, as if each were a sample.
    #[test]
    fn branches_are_a_net_together() {
        let mut cells = [0; 64];
        for i in 0..32 {
            for branch in 0..2 {
                let p = PixelSampler::new(7, 5, 3, i).branch(branch, 2).draw4(3);
                cells[(p[0] * 8.0) as usize * 8 + (p[1] * 8.0) as usize] += 1;
            }
        }
        assert!(cells.iter().all(|&c| c == 1), "{cells:?}");
    }

    #[test]
    fn decisions_are_stratified_among_samples_and_independent_of_each_other() {
        let n = 1 << 12;
        let numbers = |salt| (0..n).map(move |i| PixelSampler::new(7, 5, 3, i).hashed(salt));
        for salt in [0, 1, 1 << 58] {
            let mut cells = vec![0; 256];
            numbers(salt).take(256).for_each(|u| cells[(u * 256.0) as usize] += 1);
            assert!(cells.iter().all(|&c| c == 1), "salt {salt}");
        }
        let mean = |f: &dyn Fn((f32, f32)) -> f32| numbers(0).zip(numbers(1)).map(f).sum::<f32>() / n as f32;
        let correlation = 12.0 * mean(&|(a, b)| (a - 0.5) * (b - 0.5));
        assert!(correlation.abs() < 0.05, "{correlation}");
    }

    #[test]
    fn pixels_and_sets_are_uncorrelated() {
        let correlation = |a: &[[f32; 4]], b: &[[f32; 4]], d: usize, e: usize| {
            let n = a.len() as f64;
            a.iter().zip(b).map(|(p, q)| 12.0 * (p[d] as f64 - 0.5) * (q[e] as f64 - 0.5)).sum::<f64>() / n
        };
        let n = 1 << 14;
        let (here, there, other) = (points(n, 0, 0), points(n, 1, 0), points(n, 0, 1));
        for d in 0..4 {
            for e in 0..4 {
                assert!(correlation(&here, &there, d, e).abs() < 0.03, "pixels, {d} {e}");
                assert!(correlation(&here, &other, d, e).abs() < 0.03, "sets, {d} {e}");
            }
        }
    }

    #[test]
    fn a_hundred_thousand_samples_stay_uniform() {
        let n = 100_000;
        let mean = points(n, 2, 6).iter().map(|p| p[3] as f64).sum::<f64>() / n as f64;
        assert!((mean - 0.5).abs() < 1e-4, "{mean}");
    }
}
