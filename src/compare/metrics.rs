//! Numbers that say how far an image a is from a reference b, both linear Rec.709.
//!
//! | number | formula | shows |
//! |---|---|---|
//! | mean ratio | mean L(a) / mean L(b), L the luminance of Rec.709 | light gained or lost as a whole |
//! | relMSE | mean over pixels of mean over channels of (a − b)² / (L(b)² + 0.01), the worst 0.1 % of pixels left out | noise (Rousselle et al. 2011, *Adaptive sampling and reconstruction using greedy error minimization*, with its ε = 0.01 and the outliers that one firefly would make of it cut) |
//! | block error | median and 95th percentile over 8 × 8 blocks of \|A − B\| / (B + 0.01), A and B the mean luminances of a block | bias, once noise has averaged out |
//! | PSNR | −10 log₁₀ of the mean squared difference of sRGB-encoded channels, clipped at 1; in decibels | how like they are on a screen |
//!
//! Sums are in `f64`. A block that would cross the right or lower edge is left out, unless the picture is smaller than
//! one block: then it is the block. Percentiles interpolate linearly between ranks.

use rayon::prelude::*;
use serde::Serialize;

use super::{SizeMismatch, check_sizes};
use crate::color::{LUMINANCE, Picture, View};

/// Pixels along a block's side.
pub const BLOCK: usize = 8;

/// Share of the pixels, the worst ones, that relMSE leaves out.
const OUTLIERS: f64 = 0.001;

/// Added to what is divided by, so that black does not count without bound: to squared luminance, and to luminance.
const EPSILON: f64 = 1e-2;

#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Metrics {
    /// 1 where both are black, infinite where the reference alone is.
    pub mean_ratio: f64,
    pub rel_mse: f64,
    pub block_median: f64,
    pub block_p95: f64,
    /// Infinite (`null` in JSON) where the encoded pictures are equal.
    pub psnr: f64,
}

pub fn measure(reference: &Picture, image: &Picture) -> Result<Metrics, SizeMismatch> {
    check_sizes(reference, image)?;
    let mut blocks = block_errors(reference, image);
    blocks.sort_by(f64::total_cmp);
    Ok(Metrics {
        mean_ratio: mean_ratio(reference, image),
        rel_mse: rel_mse(reference, image),
        block_median: percentile(&blocks, 0.5),
        block_p95: percentile(&blocks, 0.95),
        psnr: psnr(reference, image),
    })
}

fn luminance(pixel: &[f32; 3]) -> f64 {
    LUMINANCE.x * f64::from(pixel[0]) + LUMINANCE.y * f64::from(pixel[1]) + LUMINANCE.z * f64::from(pixel[2])
}

fn mean_ratio(reference: &Picture, image: &Picture) -> f64 {
    let sum = |picture: &Picture| picture.pixels.iter().map(luminance).sum::<f64>();
    match (sum(image), sum(reference)) {
        (0.0, 0.0) => 1.0,
        (image, reference) => image / reference,
    }
}

fn rel_mse(reference: &Picture, image: &Picture) -> f64 {
    let pairs = reference.pixels.par_iter().zip(&image.pixels);
    let mut errors: Vec<f64> = pairs
        .map(|(b, a)| {
            let squared: f64 = a.iter().zip(b).map(|(&a, &b)| (f64::from(a) - f64::from(b)).powi(2)).sum();
            squared / 3.0 / (luminance(b).powi(2) + EPSILON)
        })
        .collect();
    errors.par_sort_unstable_by(f64::total_cmp);
    // One pixel at least, however small the picture.
    let kept = ((errors.len() as f64 * (1.0 - OUTLIERS)) as usize).max(1);
    errors.iter().take(kept).sum::<f64>() / kept as f64
}

fn block_errors(reference: &Picture, image: &Picture) -> Vec<f64> {
    let means = block_luminances(image).into_iter().zip(block_luminances(reference));
    means.map(|(a, b)| (a - b).abs() / (b + EPSILON)).collect()
}

fn block_luminances(picture: &Picture) -> Vec<f64> {
    blocks(picture.width as usize, picture.height as usize)
        .map(|block| {
            let sum: f64 = block.pixels().map(|i| luminance(&picture.pixels[i])).sum();
            sum / block.area() as f64
        })
        .collect()
}

/// A rectangle of a picture that is `stride` pixels wide.
#[derive(Clone, Copy, Debug)]
pub struct Block {
    pub x: usize,
    pub y: usize,
    pub width: usize,
    pub height: usize,
    stride: usize,
}

impl Block {
    pub fn whole(width: usize, height: usize) -> Self {
        Self { x: 0, y: 0, width, height, stride: width }
    }

    pub fn area(&self) -> usize {
        self.width * self.height
    }

    /// Indices into the picture's pixels.
    pub fn pixels(self) -> impl Iterator<Item = usize> {
        (self.y..self.y + self.height)
            .flat_map(move |y| (self.x..self.x + self.width).map(move |x| y * self.stride + x))
    }
}

/// The whole blocks of a picture, row by row.
pub fn blocks(width: usize, height: usize) -> impl Iterator<Item = Block> {
    let (w, h) = (BLOCK.min(width).max(1), BLOCK.min(height).max(1));
    (0..height / h).flat_map(move |j| {
        (0..width / w).map(move |i| Block { x: i * w, y: j * h, width: w, height: h, stride: width })
    })
}

/// Of sorted numbers; NaN of none.
fn percentile(sorted: &[f64], share: f64) -> f64 {
    let rank = share * sorted.len().saturating_sub(1) as f64;
    let at = |i: usize| sorted.get(i).copied().unwrap_or(f64::NAN);
    let (low, high) = (at(rank.floor() as usize), at(rank.ceil() as usize));
    low + (high - low) * rank.fract()
}

fn psnr(reference: &Picture, image: &Picture) -> f64 {
    let encode = |x: f32| f64::from(View::Srgb.encode(x));
    let row = reference.width.max(1) as usize;
    let rows = reference.pixels.par_chunks(row).zip(image.pixels.par_chunks(row));
    // Sums by row, then over rows in order: the same bits for any number of threads.
    let sums: Vec<f64> = rows
        .map(|(b, a)| {
            let pairs = a.as_flattened().iter().zip(b.as_flattened());
            pairs.map(|(&a, &b)| (encode(a) - encode(b)).powi(2)).sum()
        })
        .collect();
    let mean = sums.iter().sum::<f64>() / (3 * reference.pixels.len().max(1)) as f64;
    -10.0 * mean.log10()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::stats::uniform;

    fn picture(width: u32, height: u32, pixel: impl Fn(u32) -> [f32; 3]) -> Picture {
        Picture { width, height, pixels: (0..width * height).map(pixel).collect() }
    }

    fn grey(x: f32) -> [f32; 3] {
        [x; 3]
    }

    #[test]
    fn equal_pictures() {
        let p = picture(20, 17, |i| [0, 1, 2].map(|k| 3.0 * uniform(i, k)));
        let m = measure(&p, &p).expect("one size");
        assert_eq!((m.mean_ratio, m.rel_mse, m.block_median, m.block_p95), (1.0, 0.0, 0.0, 0.0));
        assert_eq!(m.psnr, f64::INFINITY);
    }

    #[test]
    fn a_brighter_picture_in_closed_form() {
        // 0.5 everywhere against 0.55.
        let (b, a) = (picture(16, 16, |_| grey(0.5)), picture(16, 16, |_| grey(0.55)));
        let m = measure(&b, &a).expect("one size");
        assert!((m.mean_ratio - 1.1).abs() < 1e-6);
        assert!((m.rel_mse - 0.0025 / 0.26).abs() < 1e-6);
        assert!((m.block_median - 0.05 / 0.51).abs() < 1e-6 && (m.block_p95 - m.block_median).abs() < 1e-12);
        // sRGB of 0.5 and 0.55 in exact arithmetic: 0.735357, 0.767376
        assert!((m.psnr + 20.0 * (0.767_376f64 - 0.735_357).log10()).abs() < 1e-3, "{}", m.psnr);
    }

    #[test]
    fn the_worst_thousandth_of_pixels_does_not_count() {
        let b = picture(100, 100, |_| grey(1.0));
        let fireflies = |n| picture(100, 100, move |i| grey(if i < n { 100.0 } else { 1.0 }));
        assert_eq!(measure(&b, &fireflies(10)).expect("one size").rel_mse, 0.0);
        let more = measure(&b, &fireflies(11)).expect("one size").rel_mse;
        assert!((more - 99.0 * 99.0 / 1.01 / 9990.0).abs() < 1e-6, "{more}");
    }

    /// What crosses the edge is no block; noise averages out within one.
    #[test]
    fn blocks_are_whole_and_average() {
        let b = picture(17, 9, |_| grey(1.0));
        let edge = picture(17, 9, |i| grey(if i % 17 == 16 || i >= 17 * 8 { 5.0 } else { 1.0 }));
        assert_eq!(measure(&b, &edge).expect("one size").block_p95, 0.0);
        let checkers = picture(16, 8, |i| grey(if (i + i / 16) % 2 == 0 { 2.0 } else { 0.0 }));
        let flat = picture(16, 8, |_| grey(1.0));
        assert_eq!(measure(&flat, &checkers).expect("one size").block_median, 0.0);
        // Two blocks, of errors 0 and e: half-way, and 95 % of the way.
        let right = picture(16, 8, |i| grey(if i % 16 >= 8 { 2.01 } else { 1.0 }));
        let m = measure(&flat, &right).expect("one size");
        assert!((m.block_median - 0.5).abs() < 1e-6 && (m.block_p95 - 0.95).abs() < 1e-6, "{m:?}");
    }

    #[test]
    fn black_small_and_unequal_pictures() {
        let black = picture(3, 2, |_| grey(0.0));
        let m = measure(&black, &black).expect("one size");
        assert_eq!((m.mean_ratio, m.block_median), (1.0, 0.0));
        let white = picture(3, 2, |_| grey(1.0));
        let m = measure(&black, &white).expect("one size");
        assert_eq!(m.mean_ratio, f64::INFINITY);
        assert!((m.block_median - 100.0).abs() < 1e-6 && m.psnr.abs() < 1e-5);
        let error = measure(&black, &picture(2, 3, |_| grey(0.0))).expect_err("sizes differ");
        assert_eq!(error.to_string(), "2 × 3 pixels cannot be compared with 3 × 2");
    }
}
