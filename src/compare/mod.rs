//! How far pictures are from a reference: numbers, statistical tests, FLIP maps, an HTML report.
//!
//! Only pictures are seen here, never scenes, so that any program's picture can be measured.
//!
//! | file | |
//! |---|---|
//! | [`mod@load`] | EXR, HDR and PNG into linear Rec.709, with variance where there is one |
//! | [`metrics`] | mean ratio, relMSE, error of block means, PSNR |
//! | [`flip`] | LDR-FLIP and HDR-FLIP: what a person sees when the pictures alternate |
//! | [`welch`] | whether a difference is more than noise |
//! | [`report`] | one self-contained page with pictures, maps and numbers |

pub mod flip;
pub mod load;
pub mod metrics;
pub mod report;
pub mod welch;

mod exr;

use serde::Serialize;

use crate::color::Picture;
pub use load::{Loaded, align, load};
pub use metrics::Metrics;
pub use welch::Welch;

/// Two pictures that cannot be laid over each other.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{} × {} pixels cannot be compared with {} × {}", .image[0], .image[1], .reference[0], .reference[1])]
pub struct SizeMismatch {
    pub reference: [u32; 2],
    pub image: [u32; 2],
}

/// All that is measured between two pictures.
#[derive(Clone, Debug)]
pub struct Comparison {
    pub numbers: Numbers,
    /// LDR-FLIP of each pixel, 0 to 1, row by row from the top.
    pub ldr_flip: Vec<f32>,
    /// HDR-FLIP of each pixel, 0 to 1.
    pub hdr_flip: Vec<f32>,
}

#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Numbers {
    #[serde(flatten)]
    pub metrics: Metrics,
    /// Mean of LDR-FLIP: both pictures at exposure 0, clipped at display white.
    pub ldr_flip: f64,
    /// Mean of HDR-FLIP: the worst over all exposures that show something of the reference.
    pub hdr_flip: f64,
}

/// Measures `image` against `reference`.
pub fn compare(reference: &Picture, image: &Picture) -> Result<Comparison, SizeMismatch> {
    let metrics = metrics::measure(reference, image)?;
    let ldr_flip = flip::ldr(reference, image)?;
    let hdr_flip = flip::hdr(reference, image)?;
    let numbers = Numbers { metrics, ldr_flip: flip::mean(&ldr_flip), hdr_flip: flip::mean(&hdr_flip) };
    Ok(Comparison { numbers, ldr_flip, hdr_flip })
}

fn check_sizes(reference: &Picture, image: &Picture) -> Result<(), SizeMismatch> {
    let sizes = [reference, image].map(|p| [p.width, p.height]);
    match sizes {
        [reference, image] if reference != image => Err(SizeMismatch { reference, image }),
        _ => Ok(()),
    }
}
