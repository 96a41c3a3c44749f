//! The finished picture, before any view transform.

use crate::film::Film;

/// Scene-linear Rec.709, row by row from the top. Finite and not negative.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    pub width: u32,
    pub height: u32,
    pub pixels: Vec<[f32; 3]>,
}

impl Picture {
    /// What the film's pixels show; pixels without a sample are black.
    pub fn of(film: &Film) -> Self {
        let pixels = (0..film.pixels().len()).map(|i| film.radiance(i).to_array()).collect();
        Self { width: film.width(), height: film.height(), pixels }
    }
}

/// Estimated variance of what each pixel shows, per channel. Infinite below two samples.
pub fn variance_of_means(film: &Film) -> Vec<[f32; 3]> {
    let of_mean = |i| film.variance(i).map_or([f32::INFINITY; 3], |v| v.as_vec3().to_array());
    (0..film.pixels().len()).map(of_mean).collect()
}
