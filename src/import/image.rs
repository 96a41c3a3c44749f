//! Image files into [`Image`]: PNG (8 and 16 bit), JPEG, WebP, BMP, TGA, Radiance HDR, OpenEXR.
//!
//! Grey, palette and missing alpha are expanded to RGBA; 16-bit files stay 16-bit, floating-point ones become RGB. The
//! numbers are those of the file: what they mean (sRGB or linear) is said by [`ColorSpace`](crate::world::ColorSpace), and
//! colour profiles inside the file are not applied.
//!
//! Files are hostile until proven otherwise: sizes are checked before anything is allocated for them, and a decoder that
//! panics is an error like any other.

use std::{
    io::Cursor,
    panic::{AssertUnwindSafe, catch_unwind},
    path::Path,
};

use ::image::{DynamicImage, ImageFormat, ImageReader, Limits};

use crate::{
    diagnostic::{Diagnostic, Place},
    input,
    world::{Image, Texels},
};

/// Texels along a side.
pub const MAX_SIDE: u32 = 16_384;
/// Bytes of the decoded texels, and of what a decoder may allocate on the way.
pub const MAX_BYTES: u64 = 1 << 30;
/// Bytes of an image file.
pub const MAX_FILE_BYTES: u64 = 1 << 30;

const EXR_MAGIC: [u8; 4] = [0x76, 0x2F, 0x31, 0x01];

/// Reads and decodes the file at `path`.
pub fn load(path: &Path) -> Result<Image, Diagnostic> {
    let error = |message: String| Diagnostic::error(path, Place::File, message);
    let bytes =
        input::read(path, MAX_FILE_BYTES).map_err(|e| error(format!("the image cannot be read: {e}")))?;
    decode(&bytes, &path.to_string_lossy()).map_err(|e| {
        error(format!("the image cannot be decoded: {e}"))
            .help("PNG, JPEG, WebP, BMP, TGA, HDR and EXR are read")
    })
}

/// Decodes `bytes`. `name` becomes the image's name; its ending tells the format where the bytes do not (TGA).
pub fn decode(bytes: &[u8], name: &str) -> Result<Image, String> {
    let guarded = catch_unwind(AssertUnwindSafe(|| {
        if bytes.starts_with(&EXR_MAGIC) { decode_exr(bytes) } else { decode_common(bytes, name) }
    }));
    let (width, height, texels) = guarded.unwrap_or_else(|_| Err("its decoder failed on it".into()))?;
    Ok(Image { name: name.to_owned(), width, height, texels })
}

/// Bytes that the texels take.
pub fn byte_size(image: &Image) -> u64 {
    match &image.texels {
        Texels::Rgba8(texels) => size_of_val(texels.as_slice()) as u64,
        Texels::Rgba16(texels) => size_of_val(texels.as_slice()) as u64,
        Texels::RgbF32(texels) => size_of_val(texels.as_slice()) as u64,
    }
}

type Decoded = (u32, u32, Texels);

fn decode_common(bytes: &[u8], name: &str) -> Result<Decoded, String> {
    if bytes.is_empty() {
        return Err("it is empty".into());
    }
    let format = ::image::guess_format(bytes)
        .ok()
        .or_else(|| ImageFormat::from_path(name).ok().filter(|&format| format == ImageFormat::Tga))
        .ok_or("it is of no known format")?;
    let reader = || {
        let mut reader = ImageReader::with_format(Cursor::new(bytes), format);
        let mut limits = Limits::no_limits();
        limits.max_image_width = Some(MAX_SIDE);
        limits.max_image_height = Some(MAX_SIDE);
        limits.max_alloc = Some(MAX_BYTES);
        reader.limits(limits);
        reader
    };
    let (width, height) = reader().into_dimensions().map_err(|e| e.to_string())?;
    check_size(width, height, 4)?;
    let image = reader().decode().map_err(|e| e.to_string())?;
    Ok((image.width(), image.height(), expand(image)?))
}

/// Refuses what is empty or over the limits at `bytes` per texel.
fn check_size(width: u32, height: u32, bytes: u64) -> Result<(), String> {
    if width == 0 || height == 0 {
        return Err("it has no texels".into());
    }
    if width > MAX_SIDE || height > MAX_SIDE {
        return Err(format!("its {width} × {height} texels are more than {MAX_SIDE} along a side"));
    }
    if u64::from(width) * u64::from(height) * bytes > MAX_BYTES {
        return Err(format!("its {width} × {height} texels take more than {MAX_BYTES} bytes"));
    }
    Ok(())
}

fn expand(image: DynamicImage) -> Result<Texels, String> {
    use DynamicImage as D;
    let (width, height) = (image.width(), image.height());
    Ok(match image {
        D::ImageLuma8(_) | D::ImageLumaA8(_) | D::ImageRgb8(_) | D::ImageRgba8(_) => {
            Texels::Rgba8(image.into_rgba8().as_raw().as_chunks().0.to_vec())
        }
        D::ImageLuma16(_) | D::ImageLumaA16(_) | D::ImageRgb16(_) | D::ImageRgba16(_) => {
            check_size(width, height, 8)?;
            Texels::Rgba16(image.into_rgba16().as_raw().as_chunks().0.to_vec())
        }
        other => {
            check_size(width, height, 12)?;
            let mut texels: Vec<[f32; 3]> = other.into_rgb32f().as_raw().as_chunks().0.to_vec();
            texels.iter_mut().for_each(|texel| *texel = finite(*texel));
            Texels::RgbF32(texels)
        }
    })
}

/// A single NaN or infinity would poison every average over the image.
fn finite(texel: [f32; 3]) -> [f32; 3] {
    texel.map(|c| if c.is_finite() { c } else { 0.0 })
}

/// The first layer that has R, G and B, else the first that has Y.
fn decode_exr(bytes: &[u8]) -> Result<Decoded, String> {
    use exr::prelude::*;
    let text = |e: Error| e.to_string();
    let meta = MetaData::read_from_buffered(Cursor::new(bytes), false).map_err(text)?;
    for header in &meta.headers {
        let size = header.layer_size;
        check_size(side(size.x())?, side(size.y())?, 12)?;
    }
    type Canvas = (usize, Vec<[f32; 3]>);
    let create = |size: Vec2<usize>| -> Canvas { (size.x(), vec![[0.0; 3]; size.x() * size.y()]) };
    let put = |(width, texels): &mut Canvas, at: Vec2<usize>, texel: [f32; 3]| {
        if let Some(place) = texels.get_mut(at.y() * *width + at.x()) {
            *place = finite(texel);
        }
    };
    let color = read()
        .no_deep_data()
        .largest_resolution_level()
        .specific_channels()
        .required("R")
        .required("G")
        .required("B")
        .collect_pixels(
            |size, _| create(size),
            move |canvas, at, (r, g, b): (f32, f32, f32)| put(canvas, at, [r, g, b]),
        )
        .first_valid_layer()
        .all_attributes()
        .from_buffered(Cursor::new(bytes))
        .map(|image| image.layer_data.channel_data.pixels);
    let (width, texels) = match color {
        Ok(pixels) => pixels,
        Err(color_error) => read()
            .no_deep_data()
            .largest_resolution_level()
            .specific_channels()
            .required("Y")
            .collect_pixels(|size, _| create(size), move |canvas, at, (y,): (f32,)| put(canvas, at, [y; 3]))
            .first_valid_layer()
            .all_attributes()
            .from_buffered(Cursor::new(bytes))
            .map(|image| image.layer_data.channel_data.pixels)
            .map_err(|_| text(color_error))?,
    };
    let height = texels.len().checked_div(width).unwrap_or(0);
    Ok((side(width)?, side(height)?, Texels::RgbF32(texels)))
}

fn side(texels: usize) -> Result<u32, String> {
    u32::try_from(texels).map_err(|_| format!("its side of {texels} texels is too long"))
}
