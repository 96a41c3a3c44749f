//! ꟻLIP: how different two pictures look to someone who flips between them. 0 is no difference, 1 the largest.
//!
//! Andersson, Nilsson, Akenine-Möller, Oskarsson, Åström, Fairchild, *ꟻLIP: A Difference Evaluator for Alternating
//! Images*, HPG 2020 (LDR), and Andersson, Nilsson, Shirley, Akenine-Möller, *Visualizing the Error in Rendered High
//! Dynamic Range Images*, Eurographics 2021 (HDR). For each pixel:
//!
//! ```text
//! ΔE  = (ΔE_c)^(1 − ΔE_f)
//! ```
//!
//! where ΔE_c is the distance of the colours after what the eye cannot resolve is filtered away (`color.rs`,
//! `filter.rs`), and ΔE_f that of edges and points, which draw the eye (`feature` in `band.rs`). HDR-FLIP is, for each
//! pixel, the largest LDR-FLIP over a range of exposures of both pictures (`exposure.rs`).
//!
//! The display is the papers': 3840 pixels, 0.7 m wide, seen from 0.7 m, which is 67.02 pixels per degree. Filters are
//! separable, as in the authors' program, [`flip-evaluator`](https://pypi.org/project/flip-evaluator/) 1.7, whose numbers
//! these equal: means within 1e-5 and pixels within 1e-4, but for those below 1e-3, where the last digits of its single
//! precision show through a square root. Pictures are worked on in bands of rows, so that large ones take little memory.

mod band;
mod color;
mod exposure;
mod filter;

use std::f32::consts::PI;

use rayon::prelude::*;

use super::{SizeMismatch, check_sizes};
use crate::color::Picture;
use band::{Band, Detector};
pub use exposure::Exposures;

/// Of the display at the distance it is watched from.
pub const PIXELS_PER_DEGREE: f32 = 3840.0 * PI / 180.0;

/// Rows of a band. A band's filters reach 10 rows further on both sides, which neighbours then filter twice.
const BAND_ROWS: usize = 64;

/// LDR-FLIP of each pixel, row by row. Light above 1 is clipped, as a display does.
pub fn ldr(reference: &Picture, image: &Picture) -> Result<Vec<f32>, SizeMismatch> {
    map(reference, image, &[None])
}

/// HDR-FLIP of each pixel, row by row: the largest LDR-FLIP over the exposures that [`Exposures::of`] the reference are.
/// Nothing where both pictures are black.
pub fn hdr(reference: &Picture, image: &Picture) -> Result<Vec<f32>, SizeMismatch> {
    let exposures = Exposures::of(reference).or_else(|| Exposures::of(image));
    let factors: Vec<Option<f32>> =
        exposures.iter().flat_map(Exposures::stops).map(|stops| Some(stops.exp2().min(f32::MAX))).collect();
    map(reference, image, &factors)
}

/// Mean over the pixels.
pub fn mean(map: &[f32]) -> f64 {
    map.iter().map(|&e| f64::from(e)).sum::<f64>() / map.len().max(1) as f64
}

/// The largest error over `factors`: `None` clips, `Some` multiplies and applies the tone curve.
fn map(reference: &Picture, image: &Picture, factors: &[Option<f32>]) -> Result<Vec<f32>, SizeMismatch> {
    check_sizes(reference, image)?;
    let detector = Detector::new(PIXELS_PER_DEGREE);
    let width = reference.width.max(1) as usize;
    let mut map = vec![0.0f32; reference.pixels.len()];
    map.par_chunks_mut(width * BAND_ROWS).enumerate().for_each(|(i, worst)| {
        let first = i * BAND_ROWS;
        let rows = first..first + worst.len() / width;
        for &factor in factors {
            let [b, a] = [reference, image].map(|p| Band::new(p, rows.clone(), factor, &detector));
            for (worst, error) in worst.iter_mut().zip(detector.errors(&b, &a)) {
                *worst = worst.max(error);
            }
        }
    });
    Ok(map)
}

#[cfg(test)]
mod tests;
