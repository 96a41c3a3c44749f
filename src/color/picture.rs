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
    /// The film's means; pixels without a sample are black.
    pub fn of(film: &Film) -> Self {
        let pixels = film.pixels().iter().map(|p| p.mean().to_array()).collect();
        Self { width: film.width(), height: film.height(), pixels }
    }
}
