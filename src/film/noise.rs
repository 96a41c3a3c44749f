//! How noisy the film still is, estimated from its own samples.
//!
//! The relative error of a pixel is the standard error of its luminance over that luminance:
//!
//! ```text
//! ε = s(L) / max(L, f),    f = 0.1 · (mean over pixels of √L)²
//! ```
//!
//! Below the floor f the error counts as absolute: black pixels would never settle otherwise, and what is darker
//! than a tenth of the middle of the picture needs fewer digits to look the same. The floor scales with the light, and
//! the mean of the roots makes a small sun or a black background move it little.
//!
//! The estimate for the picture is the root mean square of ε over its pixels, which is what the root of the relative
//! mean square error against a converged picture would show. Samples are taken as independent; stratified ones converge
//! faster, so the estimate errs on the safe side.

use std::ops::Range;

use rayon::prelude::*;

use super::Film;

/// Below this share of the picture's middle brightness an error counts as absolute.
const FLOOR: f64 = 0.1;

/// Root mean square of the pixels' relative errors; `None` while a pixel has fewer than two samples.
pub fn relative_error(film: &Film) -> Option<f32> {
    let floor = noise_floor(film);
    let square = |i: usize| {
        let pixel = &film.pixels()[i];
        // one that keeps none of its samples stays as it is
        let is_lost = pixel.kept() < 2 && pixel.dropped() >= 2;
        if is_lost { 0.0 } else { (film.luminance_error(i) / film.luminance(i).max(floor)).powi(2) }
    };
    let of_row = |y| places(film, y).map(square).sum();
    let rows = 0..film.height() as usize;
    let estimate = mean(film, rows.into_par_iter().map(of_row).collect()).sqrt();
    estimate.is_finite().then_some(estimate as f32)
}

/// f: below it the error of a luminance counts as absolute.
pub fn noise_floor(film: &Film) -> f64 {
    let root_of_row = |y| places(film, y).map(|i| film.luminance(i).sqrt()).sum();
    let rows = 0..film.height() as usize;
    let mean_root = mean(film, rows.into_par_iter().map(root_of_row).collect());
    (FLOOR * mean_root * mean_root).max(f64::MIN_POSITIVE)
}

/// Of the pixels in a row.
fn places(film: &Film, row: usize) -> Range<usize> {
    let width = film.width() as usize;
    row * width..(row + 1) * width
}

/// Over the pixels, of sums by row. Over rows in order: the same bits for any number of threads.
fn mean(film: &Film, sums: Vec<f64>) -> f64 {
    sums.iter().sum::<f64>() / film.pixels().len().max(1) as f64
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::stats::uniform;
    use glam::Vec3;

    fn noisy_film(n: u32, scale: f32) -> Film {
        let mut film = Film::new(64, 64).expect("small");
        for tile in film.tiles_mut(64) {
            for (y, row) in (0..).zip(tile.rows) {
                for (x, pixel) in (0..).zip(row) {
                    (0..n).for_each(|i| pixel.add(Vec3::splat(scale * uniform(i, y * 64 + x))));
                }
            }
        }
        film
    }

    #[test]
    fn estimate_is_the_root_of_the_relative_mean_square_error() {
        for scale in [1e-6, 1.0, 1e6] {
            let film = noisy_film(64, scale);
            let truth = 0.5 * f64::from(scale);
            let square_error: f64 = film.pixels().iter().map(|p| (p.luminance() / truth - 1.0).powi(2)).sum();
            let actual = (square_error / (64.0 * 64.0)).sqrt();
            let estimate = f64::from(relative_error(&film).expect("64 samples each"));
            assert!((estimate / actual - 1.0).abs() < 0.05, "estimate {estimate}, actual {actual}");
        }
    }

    #[test]
    fn nothing_is_claimed_before_two_samples() {
        assert_eq!(relative_error(&noisy_film(1, 1.0)), None);
        assert_eq!(relative_error(&noisy_film(0, 1.0)), None);
    }

    #[test]
    fn a_black_picture_has_no_noise() {
        assert_eq!(relative_error(&noisy_film(16, 0.0)), Some(0.0));
    }
}
