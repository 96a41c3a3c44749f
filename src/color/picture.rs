//! The finished picture, before any view transform.

use crate::film::{Film, Pixel};

/// Scene-linear Rec.709, row by row from the top. Finite and not negative.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    pub width: u32,
    pub height: u32,
    pub pixels: Vec<[f32; 3]>,
}

impl Picture {
    /// The film's means; pixels without a sample are black.
    pub fn of(film: &Film) -> Self {
        let pixels = film.pixels().iter().map(|p| p.mean().to_array()).collect();
        Self { width: film.width(), height: film.height(), pixels }
    }
}

/// Estimated variance of each pixel's mean per channel: that of a sample over their number. Infinite below two samples.
pub fn variance_of_means(film: &Film) -> Vec<[f32; 3]> {
    let of_mean = |p: &Pixel| match p.variance() {
        Some(variance) => (variance.as_dvec3() / f64::from(p.kept())).as_vec3().to_array(),
        None => [f32::INFINITY; 3],
    };
    film.pixels().iter().map(of_mean).collect()
}
