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
    /// What the film's pixels show; pixels without a sample are black.
    pub fn of(film: &Film) -> Self {
        let pixels = (0..film.pixels().len()).map(|i| film.radiance(i).to_array()).collect();
        Self { width: film.width(), height: film.height(), pixels }
    }
}

/// How sure a pixel is of what it shows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spread {
    /// Estimated, of what it shows, per channel. Infinite below two samples.
    pub variance: [f32; 3],
    /// Taken for this pixel.
    pub samples: u32,
}

impl Spread {
    /// Of every pixel, row by row from the top.
    pub fn of(film: &Film) -> Vec<Self> {
        let pixel = |(i, pixel): (usize, &Pixel)| Self {
            variance: film.variance(i).map_or([f32::INFINITY; 3], |v| v.as_vec3().to_array()),
            samples: pixel.taken(),
        };
        film.pixels().iter().enumerate().map(pixel).collect()
    }
}
