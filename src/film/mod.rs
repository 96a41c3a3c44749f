//! Samples in, mean and variance per pixel out.
//!
//! A [`Pixel`] has one owner at a time and sums its samples in the order of their index, so the picture is the same
//! to the bit for any number of threads and any order of tiles. [`Film::tiles_mut`] cuts the film into parts that
//! threads can own without locks.
//!
//! Memory: 56 bytes a pixel ([`Pixel`]), 118 MB for 1920 × 1080, 465 MB for 3840 × 2160; 48 more where light comes from
//! the lamps' side as well ([`Lamps`]).

mod lamps;
mod noise;
mod pixel;
mod tile;

use std::collections::TryReserveError;

use glam::{DVec3, Vec3};

use crate::color::LUMINANCE;

pub use lamps::Lamps;
pub use noise::{noise_floor, relative_error};
pub use pixel::Pixel;
pub use tile::Tile;

/// The pixels up to `reach` from pixel `i`, itself among them, of `len` in rows of `width`.
pub fn around(i: usize, reach: usize, width: usize, len: usize) -> impl Iterator<Item = usize> + Clone {
    let (x, y) = (i % width, i / width);
    let rows = y.saturating_sub(reach)..(y + reach + 1).min(len / width);
    let columns = x.saturating_sub(reach)..(x + reach + 1).min(width);
    rows.flat_map(move |row| columns.clone().map(move |column| row * width + column))
}

/// The sums of every pixel, row by row from the top.
#[derive(Clone, Debug, PartialEq)]
pub struct Film {
    width: u32,
    height: u32,
    pixels: Vec<Pixel>,
    lamps: Lamps,
}

/// How many samples the pixels of a film hold, dropped ones included.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SampleCounts {
    pub min: u32,
    pub mean: f64,
    pub max: u32,
    /// Non-finite or negative samples, which no mean contains.
    pub dropped: u64,
    /// Pixels without any sample that was kept.
    pub empty: u64,
}

impl Film {
    /// An empty film, or an error where there is not the memory for it.
    pub fn new(width: u32, height: u32) -> Result<Self, TryReserveError> {
        let len = usize::try_from(u64::from(width) * u64::from(height)).unwrap_or(usize::MAX);
        let mut pixels = Vec::new();
        pixels.try_reserve_exact(len)?;
        pixels.resize(len, Pixel::default());
        Ok(Self { width, height, pixels, lamps: Lamps::default() })
    }

    /// Takes what paths from lamps bring as well, or an error where there is not the memory.
    pub fn with_lamps(mut self) -> Result<Self, TryReserveError> {
        self.lamps = Lamps::new(self.pixels.len())?;
        Ok(self)
    }

    pub fn lamps_mut(&mut self) -> &mut Lamps {
        &mut self.lamps
    }

    /// What a pixel (by its place, row by row) shows: the mean of its samples and what lamps bring. Black without samples.
    pub fn radiance(&self, pixel: usize) -> Vec3 {
        (self.pixels[pixel].mean().as_dvec3() + self.lamps.mean(pixel)).as_vec3()
    }

    /// The estimated variance of [`radiance`](Self::radiance), per channel; `None` below two samples.
    pub fn variance(&self, pixel: usize) -> Option<DVec3> {
        let own = &self.pixels[pixel];
        Some(own.variance()?.as_dvec3() / f64::from(own.kept()) + self.lamps.variance(pixel))
    }

    /// Of what a pixel shows.
    pub fn luminance(&self, pixel: usize) -> f64 {
        self.pixels[pixel].luminance() + self.lamps.mean(pixel).dot(LUMINANCE)
    }

    /// Standard error of [`luminance`](Self::luminance): infinite below two samples.
    pub fn luminance_error(&self, pixel: usize) -> f64 {
        let lamps = self.lamps.variance(pixel).map(f64::sqrt).dot(LUMINANCE);
        self.pixels[pixel].luminance_error().hypot(lamps)
    }

    pub fn width(&self) -> u32 {
        self.width
    }

    pub fn height(&self) -> u32 {
        self.height
    }

    /// Row by row from the top.
    pub fn pixels(&self) -> &[Pixel] {
        &self.pixels
    }

    /// Bytes of the pixels.
    pub fn memory(&self) -> usize {
        size_of_val(self.pixels.as_slice()) + self.lamps.memory()
    }

    /// Panics outside the film.
    pub fn pixel(&self, x: u32, y: u32) -> &Pixel {
        assert!(x < self.width, "column {x} of {}", self.width);
        &self.pixels[y as usize * self.width as usize + x as usize]
    }

    pub fn sample_counts(&self) -> SampleCounts {
        let mut counts = SampleCounts { min: u32::MAX, mean: 0.0, max: 0, dropped: 0, empty: 0 };
        let mut total = 0;
        for pixel in &self.pixels {
            counts.min = counts.min.min(pixel.taken());
            counts.max = counts.max.max(pixel.taken());
            counts.dropped += u64::from(pixel.dropped());
            counts.empty += u64::from(pixel.kept() == 0);
            total += u64::from(pixel.taken());
        }
        SampleCounts {
            min: counts.min.min(counts.max),
            mean: total as f64 / self.pixels.len().max(1) as f64,
            ..counts
        }
    }
}
