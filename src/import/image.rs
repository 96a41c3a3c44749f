//! Image files into [`Image`]: PNG, JPEG, BMP, TGA, WebP, Radiance HDR.

use std::path::Path;

use crate::{
    diagnostic::{Diagnostic, Place},
    world::{Image, Texels},
};

/// Decodes the image file at `path`; its texels stay as they were stored.
pub fn load(path: &Path) -> Result<Image, Diagnostic> {
    let decoded = image::ImageReader::open(path)
        .and_then(|reader| reader.with_guessed_format())
        .map_err(|e| e.to_string())
        .and_then(|reader| reader.decode().map_err(|e| e.to_string()))
        .map_err(|e| Diagnostic::error(path, Place::File, format!("cannot read the image: {e}")))?;
    let (width, height) = (decoded.width(), decoded.height());
    let texels = match &decoded {
        image::DynamicImage::ImageRgb32F(_) | image::DynamicImage::ImageRgba32F(_) => {
            Texels::RgbF32(decoded.to_rgb32f().pixels().map(|p| p.0).collect())
        }
        image::DynamicImage::ImageLuma16(_)
        | image::DynamicImage::ImageLumaA16(_)
        | image::DynamicImage::ImageRgb16(_)
        | image::DynamicImage::ImageRgba16(_) => {
            Texels::Rgba16(decoded.to_rgba16().pixels().map(|p| p.0).collect())
        }
        _ => Texels::Rgba8(decoded.to_rgba8().pixels().map(|p| p.0).collect()),
    };
    let name = path.file_stem().map(|s| s.to_string_lossy().into_owned()).unwrap_or_default();
    Ok(Image { name, width, height, texels })
}
