//! Pictures and statistics to files.
//!
//! | extension | numbers | what they mean |
//! |---|---|---|
//! | `.png` | 8 or 16 bits | exposure and view applied; says so in its sRGB or gAMA chunk |
//! | `.exr` | half or float, ZIP | scene-linear Rec.709; on request the variance of each pixel |
//! | `.hdr` | shared exponent, 8 bits | scene-linear Rec.709 |
//!
//! [`check_writable`] before rendering, [`encode`] in memory, then [`write_file`], which replaces the target in one step:
//! whatever goes wrong, there is the old file or the new one. The bytes hold nothing that differs between two
//! runs that made the same picture (no dates, no durations).

mod exr;
mod file;
mod hdr;
mod png;
mod settings;
mod stats;

use std::path::Path;

pub use file::{check_writable, write_file};
pub use settings::{Depth, Settings, View};
pub use stats::{Rays, Seconds, Stats, peak_memory};

use crate::color::{Picture, Spread};

/// Extensions of [`Format`], for [`check_writable`].
pub const PICTURE_EXTENSIONS: &[&str] = &["png", "exr", "hdr"];

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    Png,
    Exr,
    Hdr,
}

/// What a file says about how its picture was made.
#[derive(Clone, Copy, Debug)]
pub struct Facts {
    /// Mean over the pixels.
    pub samples_per_pixel: f32,
    /// Estimated relative error.
    pub noise: Option<f32>,
    pub seed: u64,
    /// Pixels, width and height of the whole picture.
    pub size: [u32; 2],
    /// Where in the whole picture this one begins: x, y from the top left.
    pub origin: [u32; 2],
}

/// A file's bytes, and how many of its numbers were beyond the format and had to be clamped.
#[derive(Clone, Debug)]
pub struct Encoded {
    pub bytes: Vec<u8>,
    pub clamped: u64,
}

#[derive(Debug, thiserror::Error)]
pub enum Error {
    #[error("cannot write {file}: {problem}")]
    Target { file: String, problem: String },
    #[error("cannot encode the picture: {0}")]
    Encoding(String),
}

impl Error {
    fn target(file: &Path, problem: impl Into<String>) -> Self {
        Self::Target { file: file.display().to_string(), problem: problem.into() }
    }

    fn encoding(error: impl std::fmt::Display) -> Self {
        Self::Encoding(error.to_string())
    }
}

impl Format {
    /// By the extension.
    pub fn of(file: &Path) -> Option<Self> {
        let extension = file.extension()?.to_str()?.to_ascii_lowercase();
        match extension.as_str() {
            "png" => Some(Self::Png),
            "exr" => Some(Self::Exr),
            "hdr" => Some(Self::Hdr),
            _ => None,
        }
    }

    /// Whether view and exposure have a say in this format.
    pub fn is_display(self) -> bool {
        self == Self::Png
    }
}

/// The bytes of `settings.file`. With `spread`, which only EXR can hold, each pixel's variance and number of samples.
pub fn encode(
    picture: &Picture,
    spread: Option<&[Spread]>,
    settings: &Settings,
    facts: &Facts,
) -> Result<Encoded, Error> {
    match Format::of(&settings.file) {
        Some(Format::Png) => {
            let bytes = png::encode(picture, settings)?;
            Ok(Encoded { bytes, clamped: 0 })
        }
        Some(Format::Exr) => exr::encode(picture, spread, settings.depth, facts),
        Some(Format::Hdr) => hdr::encode(picture),
        None => Err(file::unknown_extension(&settings.file, PICTURE_EXTENSIONS)),
    }
}

fn software() -> String {
    format!("rayo {}", env!("CARGO_PKG_VERSION"))
}
