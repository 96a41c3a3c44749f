//! How a picture is made, resolved from the scene file and the command line.

use std::time::Duration;

/// The most scattering events a path may have, in all and by kind. 0 leaves direct light alone: light arriving at
/// the first surface from emitters, without interreflection.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Bounces {
    pub total: u32,
    pub diffuse: u32,
    pub glossy: u32,
    pub transmission: u32,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FilterKind {
    Box,
    Gaussian,
    BlackmanHarris,
}

/// Reconstruction filter, drawn by importance (each sample belongs to one pixel, with weight 1).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PixelFilter {
    pub kind: FilterKind,
    /// Full width of the support, pixels.
    pub width: f32,
}

#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// Pixels, width and height of the whole picture.
    pub size: [u32; 2],
    /// x, y, width, height in pixels from the top left: only this part is rendered and written.
    pub crop: Option<[u32; 4]>,
    /// At most, per pixel.
    pub samples: u32,
    /// A pixel stops when its estimated relative error is below this; 0 never stops early.
    pub noise: f32,
    pub time: Option<Duration>,
    pub seed: u64,
    /// `None`: as many as the machine has.
    pub threads: Option<usize>,
    pub bounces: Bounces,
    pub filter: PixelFilter,
}

impl Bounces {
    /// `total` for every kind.
    pub fn uniform(total: u32) -> Self {
        Self { total, diffuse: total, glossy: total, transmission: total }
    }
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            size: [1280, 720],
            crop: None,
            samples: 256,
            noise: 0.0,
            time: None,
            seed: 0,
            threads: None,
            bounces: Bounces::uniform(16),
            filter: PixelFilter { kind: FilterKind::BlackmanHarris, width: 3.3 },
        }
    }
}
