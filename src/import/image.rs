//! Image files into [`Image`]: PNG (8 and 16 bit), JPEG, WebP, BMP, TGA, Radiance HDR, OpenEXR, KTX2.
//!
//! Grey, palette and missing alpha are expanded to RGBA; 16-bit files stay 16-bit, floating-point ones become RGB. The
//! numbers are those of the file: what they mean (sRGB or linear) is said by [`ColorSpace`](crate::world::ColorSpace), and
//! colour profiles inside the file are not applied.
//!
//! Files are hostile until proven otherwise: sizes are checked before anything is allocated for them, and a decoder that
//! panics is an error like any other.

mod kept;

use std::{
    io::Cursor,
    panic::{AssertUnwindSafe, catch_unwind},
    path::Path,
};

use ::image::{DynamicImage, ImageFormat, ImageReader, Limits, Luma, LumaA, Rgb};

use super::ktx2;
use crate::{
    cache,
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

/// Images in fewer bytes are decoded sooner than looked for.
const LEAST_KEPT: usize = 1 << 14;

const EXR_MAGIC: [u8; 4] = [0x76, 0x2F, 0x31, 0x01];

/// Reads and decodes the file at `path`.
pub fn load(path: &Path) -> Result<Image, Diagnostic> {
    let error = |message: String| Diagnostic::error(path, Place::File, message);
    let bytes =
        input::read(path, MAX_FILE_BYTES).map_err(|e| error(format!("the image cannot be read: {e}")))?;
    decode(&bytes, &path.to_string_lossy()).map_err(|e| {
        error(format!("the image cannot be decoded: {e}"))
            .help("PNG, JPEG, WebP, BMP, TGA, HDR, EXR and KTX2 are read")
    })
}

/// Decodes `bytes`, or finds them decoded before (see [`cache`]). `name` becomes the image's name; its ending tells the format where
/// the bytes do not (TGA).
pub fn decode(bytes: &[u8], name: &str) -> Result<Image, String> {
    match cache::shared() {
        Some(cache) if bytes.len() >= LEAST_KEPT => kept::decode(cache, bytes, name),
        _ => decode_anew(bytes, name),
    }
}

fn decode_anew(bytes: &[u8], name: &str) -> Result<Image, String> {
    let guarded = catch_unwind(AssertUnwindSafe(|| {
        if bytes.starts_with(&EXR_MAGIC) {
            decode_exr(bytes)
        } else if bytes.starts_with(&ktx2::MAGIC) {
            ktx2::decode(bytes)
        } else {
            decode_common(bytes, name)
        }
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

/// Width, height and what fills them.
pub(super) type Decoded = (u32, u32, Texels);

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
pub(super) fn check_size(width: u32, height: u32, bytes: u64) -> Result<(), String> {
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
    let size = |bytes| check_size(width, height, bytes);
    Ok(match image {
        D::ImageLuma8(i) => Texels::Rgba8(i.pixels().map(|&Luma([l])| [l, l, l, u8::MAX]).collect()),
        D::ImageLumaA8(i) => Texels::Rgba8(i.pixels().map(|&LumaA([l, a])| [l, l, l, a]).collect()),
        // By the raw numbers: the iterators over pixels cost several times as much, and most images are of these kinds.
        D::ImageRgb8(i) => {
            let texels = i.as_raw().as_chunks().0.iter();
            Texels::Rgba8(texels.map(|&[r, g, b]| [r, g, b, u8::MAX]).collect())
        }
        D::ImageRgba8(i) => Texels::Rgba8(i.as_raw().as_chunks().0.to_vec()),
        D::ImageLuma16(i) => {
            size(8)?;
            Texels::Rgba16(i.pixels().map(|&Luma([l])| [l, l, l, u16::MAX]).collect())
        }
        D::ImageLumaA16(i) => {
            size(8)?;
            Texels::Rgba16(i.pixels().map(|&LumaA([l, a])| [l, l, l, a]).collect())
        }
        D::ImageRgb16(i) => {
            size(8)?;
            Texels::Rgba16(i.pixels().map(|&Rgb([r, g, b])| [r, g, b, u16::MAX]).collect())
        }
        D::ImageRgba16(i) => {
            size(8)?;
            Texels::Rgba16(i.pixels().map(|p| p.0).collect())
        }
        other => {
            size(12)?;
            Texels::RgbF32(other.into_rgb32f().as_raw().as_chunks().0.iter().map(|&t| finite(t)).collect())
        }
    })
}

/// A single NaN or infinity would poison every average over the image.
pub(super) fn finite(texel: [f32; 3]) -> [f32; 3] {
    let finite = |c: f32| if c.is_finite() { c } else { 0.0 };
    let [r, g, b] = texel;
    [finite(r), finite(g), finite(b)]
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

#[cfg(test)]
mod tests {
    use ::image::{ImageBuffer, Rgb32FImage, Rgba};

    use super::*;

    fn encoded(image: impl Into<DynamicImage>, format: ImageFormat) -> Vec<u8> {
        let mut bytes = Vec::new();
        image.into().write_to(&mut Cursor::new(&mut bytes), format).expect("an encodable image");
        bytes
    }

    fn rgba8(bytes: &[u8], name: &str) -> Vec<[u8; 4]> {
        match decode(bytes, name).map(|i| i.texels) {
            Ok(Texels::Rgba8(texels)) => texels,
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn eight_bit_formats_expand_to_rgba() {
        let grey = ImageBuffer::from_pixel(2, 1, Luma([7u8]));
        assert_eq!(rgba8(&encoded(grey, ImageFormat::Png), ""), [[7, 7, 7, 255]; 2]);
        let alpha = ImageBuffer::from_pixel(1, 1, LumaA([7u8, 8]));
        assert_eq!(rgba8(&encoded(alpha, ImageFormat::Png), ""), [[7, 7, 7, 8]]);
        let color = ImageBuffer::from_pixel(1, 2, Rgb([1u8, 2, 3]));
        for format in [ImageFormat::Png, ImageFormat::Bmp, ImageFormat::WebP] {
            assert_eq!(rgba8(&encoded(color.clone(), format), ""), [[1, 2, 3, 255]; 2], "{format:?}");
        }
        assert_eq!(rgba8(&encoded(color.clone(), ImageFormat::Tga), "a/b.TGA"), [[1, 2, 3, 255]; 2]);
        assert!(decode(&encoded(color, ImageFormat::Tga), "a/b").is_err());
        let flat = ImageBuffer::from_pixel(8, 8, Rgb([100u8; 3]));
        assert!(
            rgba8(&encoded(flat, ImageFormat::Jpeg), "")
                .iter()
                .all(|t| t[0].abs_diff(100) < 2 && t[3] == 255)
        );
    }

    #[test]
    fn rows_run_from_the_top() {
        let image = ImageBuffer::from_fn(2, 2, |x, y| Luma([(10 * y + x) as u8]));
        for (format, name) in [(ImageFormat::Png, ""), (ImageFormat::Bmp, ""), (ImageFormat::Tga, "x.tga")] {
            let rgb = DynamicImage::from(image.clone()).into_rgb8();
            let reds: Vec<u8> = rgba8(&encoded(rgb, format), name).iter().map(|t| t[0]).collect();
            assert_eq!(reds, [0, 1, 10, 11], "{format:?}");
        }
    }

    #[test]
    fn sixteen_bits_stay_sixteen() {
        let image = ImageBuffer::from_pixel(1, 1, Rgba([1u16, 2, 3, 60_000]));
        let texels = decode(&encoded(image, ImageFormat::Png), "").map(|i| i.texels);
        assert!(matches!(&texels, Ok(Texels::Rgba16(t)) if t[..] == [[1, 2, 3, 60_000]]), "{texels:?}");
    }

    fn rgb32(bytes: &[u8]) -> Vec<[f32; 3]> {
        match decode(bytes, "").map(|i| i.texels) {
            Ok(Texels::RgbF32(texels)) => texels,
            other => panic!("{other:?}"),
        }
    }

    /// Two by two texels: red is x, green is y, blue is 9, or NaN in the left column.
    fn exr() -> Vec<u8> {
        use exr::prelude::*;
        let blue = |x: usize| if x == 0 { f32::NAN } else { 9.0 };
        let texel = |at: Vec2<usize>| (at.x() as f32, at.y() as f32, blue(at.x()));
        let mut bytes = Vec::new();
        Image::from_channels((2, 2), SpecificChannels::rgb(texel))
            .write()
            .to_buffered(Cursor::new(&mut bytes))
            .expect("an encodable image");
        bytes
    }

    #[test]
    fn floating_point_formats() {
        let image = Rgb32FImage::from_pixel(2, 1, Rgb([0.5, 1.0, 4.0]));
        assert_eq!(rgb32(&encoded(image, ImageFormat::Hdr)), [[0.5, 1.0, 4.0]; 2]);

        assert_eq!(rgb32(&exr()), [[0., 0., 0.], [1., 0., 9.], [0., 1., 0.], [1., 1., 9.]]);
    }

    #[test]
    fn truncated_and_mutated_images_are_errors_or_whole() {
        let image = ImageBuffer::from_fn(5, 4, |x, y| Rgb([(x * 50) as u8, (y * 60) as u8, 9]));
        let formats =
            [ImageFormat::Png, ImageFormat::Jpeg, ImageFormat::Bmp, ImageFormat::WebP, ImageFormat::Tga];
        let mut files: Vec<_> = formats.map(|format| encoded(image.clone(), format)).into();
        files.push(encoded(Rgb32FImage::from_pixel(9, 2, Rgb([0.5, 1.0, 4.0])), ImageFormat::Hdr));
        files.push(exr());
        files.push(ktx2::tests::texture(37, [3, 3], false, &[7; 36]));
        let mut state = 1u64;
        let mut random = |n: usize| {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 33) as usize % n
        };
        for file in &files {
            for length in 0..file.len() {
                assert_whole(decode(&file[..length], "x.tga"));
            }
            for _ in 0..300 {
                let mut mutated = file.clone();
                for _ in 0..=random(3) {
                    let at = random(file.len());
                    mutated[at] = random(256) as u8;
                }
                assert_whole(decode(&mutated, "x.tga"));
            }
        }
    }

    fn assert_whole(result: Result<Image, String>) {
        let Ok(image) = result else { return };
        let texels = match &image.texels {
            Texels::Rgba8(t) => t.len(),
            Texels::Rgba16(t) => t.len(),
            Texels::RgbF32(t) => t.len(),
        };
        assert_eq!(texels, image.width as usize * image.height as usize);
        assert!(texels > 0 && byte_size(&image) <= MAX_BYTES);
    }

    #[test]
    fn images_over_the_limits_are_refused_before_they_are_decoded() {
        // The header of a PNG of 100 000 × 100 000 texels, checksum and all, and nothing behind it.
        let mut bytes = encoded(ImageBuffer::from_pixel(1, 1, Luma([0u8])), ImageFormat::Png);
        bytes[16..24].copy_from_slice(&[0, 1, 0x86, 0xA0, 0, 1, 0x86, 0xA0]);
        let crc = bytes[12..29].iter().fold(!0u32, |crc, &b| {
            (0..8).fold(crc ^ u32::from(b), |c, _| if c & 1 == 1 { 0xEDB8_8320 ^ (c >> 1) } else { c >> 1 })
        });
        bytes[29..33].copy_from_slice(&(!crc).to_be_bytes());
        let error = decode(&bytes, "").expect_err("too large");
        assert!(error.contains("100000") || error.to_lowercase().contains("limit"), "{error}");
        assert!(check_size(MAX_SIDE, MAX_SIDE, 4).is_ok() && check_size(MAX_SIDE, MAX_SIDE, 8).is_err());
        assert!(check_size(0, 1, 4).is_err() && check_size(MAX_SIDE + 1, 1, 4).is_err());
    }

    #[test]
    fn what_is_no_image_is_refused() {
        for bytes in
            [&b""[..], b"hello", &EXR_MAGIC, b"\x89PNG\r\n\x1a\n", b"#?RADIANCE\n", b"BM", b"RIFF    WEBP"]
        {
            assert!(decode(bytes, "x.png").is_err(), "{bytes:?}");
        }
        let missing = load(Path::new("no such file.png")).expect_err("missing");
        assert!(missing.message.contains("cannot be read"));
    }
}
