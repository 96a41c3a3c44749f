//! Textures as image files: as they are stored, or baked to what a slot needs.

use std::io::Cursor;

use ::exr::prelude::{Compression, Encoding, Image as ExrImage, SpecificChannels, Vec2, WritableImage};
use glam::{Vec3, Vec4};

use super::Error;
use crate::{
    color::srgb_decode,
    world::{ColorSpace, Image, Texels},
};

/// A file's bytes, and the ending of its name.
#[derive(Debug)]
pub struct Bitmap {
    pub bytes: Vec<u8>,
    pub extension: &'static str,
}

/// The image with the numbers it has: PNG of 8 or 16 bits with alpha, or EXR of 32-bit floats.
pub fn as_stored(image: &Image) -> Result<Bitmap, Error> {
    match &image.texels {
        Texels::Rgba8(texels) => png(image, png::BitDepth::Eight, texels.as_flattened()),
        Texels::Rgba16(texels) => {
            let bytes: Vec<u8> = texels.as_flattened().iter().flat_map(|n| n.to_be_bytes()).collect();
            png(image, png::BitDepth::Sixteen, &bytes)
        }
        Texels::RgbF32(texels) => exr(image, |i| Vec3::from(texels[i])),
    }
}

/// What `shade` makes of every texel's linear RGBA: EXR of 32-bit floats.
pub fn baked(image: &Image, space: ColorSpace, shade: impl Fn(Vec4) -> Vec3 + Sync) -> Result<Bitmap, Error> {
    exr(image, |i| shade(linear(image, space, i)))
}

/// Linear RGBA of texel `i`, counted row by row. Alpha has no curve.
pub fn linear(image: &Image, space: ColorSpace, i: usize) -> Vec4 {
    let stored = match &image.texels {
        Texels::Rgba8(texels) => Vec4::from(texels[i].map(f32::from)) / 255.0,
        Texels::Rgba16(texels) => Vec4::from(texels[i].map(f32::from)) / 65535.0,
        Texels::RgbF32(texels) => return Vec3::from(texels[i]).extend(1.0),
    };
    match space {
        ColorSpace::Linear => stored,
        ColorSpace::Srgb => Vec3::from(stored.truncate().to_array().map(srgb_decode)).extend(stored.w),
    }
}

fn png(image: &Image, depth: png::BitDepth, bytes: &[u8]) -> Result<Bitmap, Error> {
    let mut file = Vec::new();
    let mut encoder = png::Encoder::new(&mut file, image.width, image.height);
    encoder.set_color(png::ColorType::Rgba);
    encoder.set_depth(depth);
    let written = encoder.write_header().and_then(|mut writer| writer.write_image_data(bytes));
    written.map_err(|e| fault(image, e))?;
    Ok(Bitmap { bytes: file, extension: "png" })
}

fn exr(image: &Image, texel: impl Fn(usize) -> Vec3 + Sync) -> Result<Bitmap, Error> {
    let width = image.width as usize;
    let channels = SpecificChannels::rgb(|at: Vec2<usize>| {
        let [r, g, b] = texel(at.y() * width + at.x()).to_array();
        (r, g, b)
    });
    let encoding = Encoding { compression: Compression::ZIP16, ..Encoding::FAST_LOSSLESS };
    let mut picture = ExrImage::from_encoded_channels((width, image.height as usize), encoding, channels);
    picture.layer_data.attributes.software_name = None;
    let mut bytes = Vec::new();
    picture.write().to_buffered(Cursor::new(&mut bytes)).map_err(|e| fault(image, e))?;
    Ok(Bitmap { bytes, extension: "exr" })
}

fn fault(image: &Image, problem: impl ToString) -> Error {
    Error::Encoding { file: image.name.clone(), problem: problem.to_string() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::import::image::decode;

    fn image(texels: Texels) -> Image {
        Image { name: "t".into(), width: 2, height: 1, texels }
    }

    #[test]
    fn stored_numbers_come_back() {
        let eight = image(Texels::Rgba8(vec![[1, 2, 3, 4], [255, 0, 128, 0]]));
        let sixteen = image(Texels::Rgba16(vec![[1, 2, 3, 4], [65535, 0, 256, 0]]));
        let float = image(Texels::RgbF32(vec![[0.1, 20.0, 1e-5], [1.0, 2.0, 3.0]]));
        for original in [eight, sixteen, float] {
            let bitmap = as_stored(&original).expect("encoded");
            let read = decode(&bitmap.bytes, "x").expect("decoded");
            assert_eq!(format!("{:?}", read.texels), format!("{:?}", original.texels));
        }
    }

    #[test]
    fn baking_sees_linear_light() {
        let grey = image(Texels::Rgba8(vec![[188, 188, 188, 51], [0; 4]]));
        let value = |space| {
            let bitmap = baked(&grey, space, |t| 2.0 * t.truncate() * t.w).expect("encoded");
            match decode(&bitmap.bytes, "x").expect("decoded").texels {
                Texels::RgbF32(texels) => texels[0][0],
                other => panic!("{other:?}"),
            }
        };
        assert!((value(ColorSpace::Srgb) - 2.0 * 0.502_886_5 * 0.2).abs() < 1e-5);
        assert!((value(ColorSpace::Linear) - 2.0 * 188.0 / 255.0 * 0.2).abs() < 1e-5);
    }
}
