//! Whether two pictures differ by more than their noise: Welch's test on block means and on the whole.
//!
//! Each file carries, beside the mean of each pixel, the estimated variance of that mean. The means A and B of a block
//! of 8 × 8 pixels then have the variances V_A = Σ vᵢ / n² and V_B, and under the hypothesis that both pictures show the same
//! light,
//!
//! ```text
//! t = (A − B) / √(V_A + V_B)
//! ```
//!
//! follows Student's distribution with ν degrees of freedom (Welch 1947, *The generalization of "Student's" problem when
//! several different population variances are involved*). With Satterthwaite's ν = (Σ vᵢ)² / Σ (vᵢ² / νᵢ), taken over the pixels of
//! both blocks; files do not say how many samples a pixel had, so νᵢ = 1 stands for all: ν comes out too small, and the test errs
//! on the side of agreement. So it does because samples are stratified: their mean varies less than v says.
//!
//! Each channel of each block is one test, and so is each channel of the whole picture. The smallest of m p-values is
//! corrected for having been chosen (Šidák 1967): 1 − (1 − p)^m.
//!
//! A half in a file is rounded: that adds (2⁻¹¹ x)² / 3 to a pixel's variance. Pixels whose variance is not known (below two
//! samples) are left out, in both pictures.

use serde::Serialize;
use statrs::distribution::{ContinuousCDF, StudentsT};

use super::{
    SizeMismatch, check_sizes,
    metrics::{Block, blocks},
};
use crate::color::Picture;

/// Two pictures of the same light are said to differ this often.
pub const SIGNIFICANCE: f64 = 0.01;

/// A picture with the variance of each pixel's mean.
#[derive(Clone, Copy, Debug)]
pub struct Estimate<'a> {
    pub picture: &'a Picture,
    /// Not finite where unknown.
    pub variance: &'a [[f32; 3]],
    /// Whether the means were rounded to 16-bit floats.
    pub half: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Welch {
    /// How likely so large a difference of some block is without a cause; corrected over all blocks and channels.
    pub blocks_p: f64,
    /// Likewise of the whole picture's mean, over the channels.
    pub whole_p: f64,
    /// Left top pixel of the block that differs most significantly.
    pub worst_block: [u32; 2],
    /// Tests on blocks: blocks times channels.
    pub tests: usize,
    /// The smaller of the two, corrected for being of two.
    pub p: f64,
    /// Whether `p` is not below [`SIGNIFICANCE`].
    pub agrees: bool,
}

/// Tests whether `a` and `b` show the same light; `None` where no pixel has a known variance in both.
pub fn test(a: Estimate, b: Estimate) -> Result<Option<Welch>, SizeMismatch> {
    check_sizes(b.picture, a.picture)?;
    let (width, height) = (a.picture.width as usize, a.picture.height as usize);
    let mut worst = (f64::INFINITY, [0, 0]);
    let mut tests = 0;
    for block in blocks(width, height) {
        for p in p_values(a, b, block).into_iter().flatten() {
            tests += 1;
            if p < worst.0 {
                worst = (p, [block.x as u32, block.y as u32]);
            }
        }
    }
    let whole: Vec<f64> = p_values(a, b, Block::whole(width, height)).into_iter().flatten().collect();
    if tests == 0 || whole.is_empty() {
        return Ok(None);
    }
    let blocks_p = sidak(worst.0, tests);
    let whole_p = sidak(whole.iter().copied().fold(1.0, f64::min), whole.len());
    let p = sidak(blocks_p.min(whole_p), 2);
    Ok(Some(Welch { blocks_p, whole_p, worst_block: worst.1, tests, p, agrees: p >= SIGNIFICANCE }))
}

/// Of each channel; `None` where no variance is known.
fn p_values(a: Estimate, b: Estimate, block: Block) -> [Option<f64>; 3] {
    [0, 1, 2].map(|channel| {
        let (mut count, mut difference, mut variance, mut squares) = (0u64, 0.0, 0.0, 0.0);
        for i in block.pixels() {
            let [(mean_a, v_a), (mean_b, v_b)] = [a, b].map(|e| e.at(i, channel));
            if v_a.is_finite() && v_b.is_finite() {
                count += 1;
                difference += mean_a - mean_b;
                variance += v_a + v_b;
                squares += v_a * v_a + v_b * v_b;
            }
        }
        (count > 0).then(|| p_value(difference, variance, variance * variance / squares))
    })
}

impl Estimate<'_> {
    /// Mean and its variance; the latter infinite beyond the picture.
    fn at(&self, pixel: usize, channel: usize) -> (f64, f64) {
        let number = |numbers: &[[f32; 3]]| numbers.get(pixel).map(|n| f64::from(n[channel]));
        let mean = number(&self.picture.pixels).unwrap_or(0.0);
        let variance = number(self.variance).unwrap_or(f64::INFINITY);
        // Below 2⁻¹⁴ the steps of a half are 2⁻²⁴.
        let half_step = (mean / 2048.0).max(1.0 / (1 << 25) as f64);
        (mean, if self.half { variance + half_step * half_step / 3.0 } else { variance })
    }
}

/// How likely a difference at least this large is, by Student's distribution.
fn p_value(difference: f64, variance: f64, freedom: f64) -> f64 {
    if difference == 0.0 {
        return 1.0;
    }
    let t = difference.abs() / variance.sqrt();
    match StudentsT::new(0.0, 1.0, freedom) {
        Ok(distribution) if t.is_finite() => 2.0 * distribution.sf(t),
        // No variance at all, and yet a difference.
        _ => 0.0,
    }
}

/// The p-value of the smallest of `count`.
fn sidak(p: f64, count: usize) -> f64 {
    -f64::exp_m1(count as f64 * f64::ln_1p(-p))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::stats::uniform;

    const SIZE: [u32; 2] = [64, 48];

    /// Means of `n` samples around `level`, uniform in ±100 %, and their estimated variance.
    fn estimate(seed: u32, n: u32, level: impl Fn(u32) -> f64) -> (Picture, Vec<[f32; 3]>) {
        let pixel = |i: u32| {
            let moments = [0, 1, 2].map(|c| {
                let samples = (0..n).map(|s| {
                    2.0 * level(i) * f64::from(uniform(i * 3 + c, seed.wrapping_mul(100_003).wrapping_add(s)))
                });
                let (sum, squares) = samples.fold((0.0, 0.0), |(sum, squares), x| (sum + x, squares + x * x));
                let (n, mean) = (f64::from(n), sum / f64::from(n));
                (mean as f32, ((squares / n - mean * mean) / (n - 1.0)) as f32)
            });
            (moments.map(|m| m.0), moments.map(|m| m.1))
        };
        let (pixels, variance) = (0..SIZE[0] * SIZE[1]).map(pixel).unzip();
        (Picture { width: SIZE[0], height: SIZE[1], pixels }, variance)
    }

    fn run(a: &(Picture, Vec<[f32; 3]>), b: &(Picture, Vec<[f32; 3]>)) -> Welch {
        let [a, b] = [a, b].map(|e| Estimate { picture: &e.0, variance: &e.1, half: false });
        test(a, b).expect("one size").expect("variance")
    }

    #[test]
    fn pictures_of_the_same_light_agree_and_p_is_spread_evenly() {
        let level = |i: u32| f64::from(1 + i % 7);
        let all: Vec<_> = (0..12).map(|seed| estimate(seed, 8, level)).collect();
        let results: Vec<Welch> = all.iter().zip(&all[1..]).map(|(a, b)| run(a, b)).collect();
        assert!(results.iter().all(|w| w.agrees && w.tests == 3 * 8 * 6), "{results:?}");
        // Without a difference p-values are anywhere between 0 and 1: a test that never rejects would give none below ½.
        for p in [|w: &Welch| w.whole_p, |w: &Welch| w.blocks_p] {
            let low = results.iter().filter(|w| p(w) < 0.5).count();
            assert!((1..=10).contains(&low), "{results:?}");
        }
    }

    #[test]
    fn one_percent_is_found_on_the_whole_and_a_dark_block_in_its_place() {
        let plain = estimate(1, 32, |_| 1.0);
        // σ of the whole's mean is 0.58 / √(32 · 3072) = 0.0018, of the difference 0.0026: 1 % is four σ.
        let brighter = estimate(2, 32, |_| 1.01);
        let found = run(&plain, &brighter);
        assert!(!found.agrees && found.whole_p < 0.005 && found.blocks_p > 0.01, "{found:?}");
        let block = |i: u32| (16..24).contains(&(i % SIZE[0])) && (8..16).contains(&(i / SIZE[0]));
        let darker = estimate(3, 32, |i| if block(i) { 0.9 } else { 1.0 });
        let found = run(&plain, &darker);
        assert!(!found.agrees && found.blocks_p < 1e-3, "{found:?}");
        assert_eq!(found.worst_block, [16, 8]);
    }

    #[test]
    fn rounding_to_halves_is_no_difference() {
        let round = |x: f32| ::exr::prelude::f16::from_f32(x).to_f32();
        let fine = estimate(1, 4, |_| 1.0);
        let quiet: Vec<[f32; 3]> = vec![[1e-12; 3]; fine.1.len()];
        let half = Picture { pixels: fine.0.pixels.iter().map(|p| p.map(round)).collect(), ..fine.0.clone() };
        let a = Estimate { picture: &fine.0, variance: &quiet, half: false };
        let b = Estimate { picture: &half, variance: &quiet, half: true };
        assert!(test(a, b).expect("one size").expect("variance").agrees);
        let blind = Estimate { half: false, ..b };
        assert!(!test(a, blind).expect("one size").expect("variance").agrees);
    }

    #[test]
    fn unknown_and_missing_variance() {
        let (a, b) = (estimate(1, 4, |_| 1.0), estimate(2, 4, |_| 1.0));
        let mut holes = b.clone();
        holes.0.pixels[70] = [1e9; 3];
        holes.1[70] = [f32::INFINITY; 3];
        assert!(run(&a, &holes).agrees);
        let unknown = vec![[f32::INFINITY; 3]; a.1.len()];
        let nothing = Estimate { picture: &a.0, variance: &unknown, half: false };
        assert_eq!(test(nothing, nothing), Ok(None));
        // Neither varies: equal pictures agree, others do not.
        let still = vec![[0.0; 3]; a.1.len()];
        let [a, b] = [&a.0, &b.0].map(|picture| Estimate { picture, variance: &still, half: false });
        assert!(test(a, a).expect("one size").expect("variance").agrees);
        assert_eq!(test(a, b).expect("one size").expect("variance").whole_p, 0.0);
    }

    #[test]
    fn known_p_values() {
        // Student's t: 2.228 at 10 degrees is 5 %; 1.96 at very many too.
        assert!((p_value(2.228_139, 1.0, 10.0) - 0.05).abs() < 1e-6);
        assert!((p_value(1.959_964, 1.0, 1e9) - 0.05).abs() < 1e-6);
        assert!(p_value(30.0, 1.0, 200.0) > 0.0);
        assert!((sidak(0.01, 10) - 0.095_617_924).abs() < 1e-8);
        assert!((sidak(1e-18, 1000) - 1e-15).abs() < 1e-20);
    }
}
