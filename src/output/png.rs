//! PNG (W3C, third edition): display numbers in 8 or 16 bits, with the chunk that says which curve they carry.
//!
//! | view | chunk |
//! |---|---|
//! | `srgb` | sRGB (perceptual), with the gAMA and cHRM of the same meaning |
//! | `gamma2` | gAMA 0.5, cHRM of Rec.709 |
//! | `raw` | none: the numbers claim no meaning |

use ::png::{BitDepth, ColorType, Encoder, ScaledFloat, SourceChromaticities, SrgbRenderingIntent};
use rayon::prelude::*;

use super::{Depth, Error, Settings, View, software};
use crate::color::{Picture, exposure_factor};

pub fn encode(picture: &Picture, settings: &Settings) -> Result<Vec<u8>, Error> {
    let mut bytes = Vec::new();
    let mut encoder = Encoder::new(&mut bytes, picture.width, picture.height);
    encoder.set_color(ColorType::Rgb);
    encoder.set_depth(match settings.depth {
        Depth::Low => BitDepth::Eight,
        Depth::High => BitDepth::Sixteen,
    });
    match settings.view {
        View::Srgb => {
            encoder.set_source_srgb(SrgbRenderingIntent::Perceptual);
            // The values that the specification prescribes beside sRGB, for readers that only know these.
            encoder.set_source_gamma(ScaledFloat::from_scaled(45_455));
            encoder.set_source_chromaticities(rec709());
        }
        View::Gamma2 => {
            encoder.set_source_gamma(ScaledFloat::new(0.5));
            encoder.set_source_chromaticities(rec709());
        }
        View::Raw => {}
    }
    encoder.add_text_chunk("Software".into(), software()).map_err(Error::encoding)?;
    let mut writer = encoder.write_header().map_err(Error::encoding)?;
    writer.write_image_data(&samples(picture, settings)).map_err(Error::encoding)?;
    writer.finish().map_err(Error::encoding)?;
    Ok(bytes)
}

fn rec709() -> SourceChromaticities {
    SourceChromaticities::new((0.3127, 0.3290), (0.64, 0.33), (0.30, 0.60), (0.15, 0.06))
}

/// Rounded to the nearest step, big-endian.
fn samples(picture: &Picture, settings: &Settings) -> Vec<u8> {
    let factor = exposure_factor(settings.exposure);
    let display = picture.pixels.as_flattened().par_iter().map(|&x| settings.view.encode(x * factor));
    match settings.depth {
        Depth::Low => display.map(|v| (v * 255.0 + 0.5) as u8).collect(),
        Depth::High => display.flat_map_iter(|v| ((v * 65535.0 + 0.5) as u16).to_be_bytes()).collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ::png::Decoder;

    fn picture() -> Picture {
        let pixels = vec![[0.0, 0.215_860_5, 1.0], [0.25, 4.0, 0.002], [0.5, 0.125, 1e-9]];
        Picture { width: 1, height: 3, pixels }
    }

    fn decode(bytes: &[u8]) -> (::png::Info<'static>, Vec<u8>) {
        let mut reader = Decoder::new(std::io::Cursor::new(bytes)).read_info().expect("header");
        let mut pixels = vec![0; reader.output_buffer_size().expect("small")];
        reader.next_frame(&mut pixels).expect("pixels");
        (reader.info().clone(), pixels)
    }

    fn settings(view: View, depth: Depth, exposure: f32) -> Settings {
        Settings { view, depth, exposure, ..Settings::default() }
    }

    /// The 4-letter names of the file's chunks, in order.
    fn chunks(bytes: &[u8]) -> Vec<String> {
        let mut names = Vec::new();
        let mut rest = &bytes[8..];
        while rest.len() >= 12 {
            let length = u32::from_be_bytes(rest[..4].try_into().expect("4 bytes")) as usize;
            names.push(String::from_utf8_lossy(&rest[4..8]).into_owned());
            rest = &rest[12 + length..];
        }
        names
    }

    #[test]
    fn srgb_in_eight_bits() {
        let bytes = encode(&picture(), &settings(View::Srgb, Depth::Low, 0.0)).expect("encodes");
        let (info, pixels) = decode(&bytes);
        assert_eq!((info.width, info.height, info.bit_depth), (1, 3, BitDepth::Eight));
        assert_eq!(info.srgb, Some(SrgbRenderingIntent::Perceptual));
        assert_eq!(pixels, [0, 128, 255, 137, 255, 7, 188, 99, 0]);
        assert_eq!(chunks(&bytes), ["IHDR", "sRGB", "gAMA", "cHRM", "tEXt", "IDAT", "IEND"]);
    }

    #[test]
    fn sixteen_bits_are_big_endian_and_rounded() {
        let bytes = encode(&picture(), &settings(View::Raw, Depth::High, 1.0)).expect("encodes");
        let (info, pixels) = decode(&bytes);
        assert_eq!(info.bit_depth, BitDepth::Sixteen);
        let numbers: Vec<u16> = pixels.chunks(2).map(|b| u16::from_be_bytes([b[0], b[1]])).collect();
        assert_eq!(numbers, [0, 28293, 65535, 32768, 65535, 262, 65535, 16384, 0]);
    }

    #[test]
    fn other_views_claim_what_is_true() {
        let gamma2 = encode(&picture(), &settings(View::Gamma2, Depth::Low, 0.0)).expect("encodes");
        let (info, pixels) = decode(&gamma2);
        assert_eq!((info.srgb, info.gamma()), (None, Some(ScaledFloat::new(0.5))));
        assert_eq!(pixels[3], 128); // √0.25
        let raw = encode(&picture(), &settings(View::Raw, Depth::Low, 0.0)).expect("encodes");
        assert_eq!(chunks(&raw), ["IHDR", "tEXt", "IDAT", "IEND"]);
        assert_eq!(decode(&raw).1[3], 64);
    }
}
