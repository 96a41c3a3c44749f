//! Where the picture goes and how it is encoded.

use std::path::PathBuf;

/// How scene-linear light becomes display numbers (PNG only; EXR and HDR stay scene-linear).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum View {
    /// The piecewise sRGB curve, clipped at 1.
    Srgb,
    /// Square root (γ = 1/2), clipped at 1.
    Gamma2,
    /// No curve: the linear number is stored, clipped at 1.
    Raw,
}

/// Numbers in the file: PNG has 8 or 16 bits, EXR half or float.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Depth {
    /// 8-bit PNG, half EXR.
    Low,
    /// 16-bit PNG, float EXR.
    High,
}

#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// .png, .exr or .hdr.
    pub file: PathBuf,
    pub view: View,
    /// Stops: radiance is multiplied by 2^exposure before the view.
    pub exposure: f32,
    pub depth: Depth,
}
