//! Where the picture goes and how it is encoded.

use std::path::PathBuf;

pub use crate::color::View;

/// Numbers in the file: PNG has 8 or 16 bits, EXR half or float.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Depth {
    /// 8-bit PNG, half EXR.
    #[default]
    Low,
    /// 16-bit PNG, float EXR.
    High,
}

#[derive(Clone, Debug, Default, PartialEq)]
pub struct Settings {
    /// .png, .exr or .hdr.
    pub file: PathBuf,
    pub view: View,
    /// Stops: radiance is multiplied by 2^exposure before the view (PNG only, like the view).
    pub exposure: f32,
    pub depth: Depth,
    /// Whether the file also holds the estimated variance of each pixel (EXR only).
    pub variance: bool,
}
