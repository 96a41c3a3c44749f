//! From scene-linear light to the numbers of a display: exposure, then a view transform.
//!
//! A [`Picture`] is the film's mean, linear Rec.709 radiance. [`View`] is applied only where a file stores display
//! numbers (PNG); EXR and HDR keep the picture as it is.

mod luminance;
mod picture;
mod srgb;
mod view;

pub use luminance::{LUMINANCE, luminance};
pub use picture::{Picture, Spread};
pub use srgb::{srgb_decode, srgb_encode};
pub use view::{View, exposure_factor};
