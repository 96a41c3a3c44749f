//! OpenEXR: scene-linear half or float, ZIP-compressed scan lines, Rec.709 chromaticities, and how the picture was made.
//!
//! The attribute `software` holds name and version, `comments` samples, noise and seed. (Attributes of our own would be
//! written in another order each time: the crate keeps them in a hash map.)
//!
//! The data window of a crop is its place in the whole picture, which is the display window.
//!
//! With their spread there are four more channels: `variance.R`, `variance.G` and `variance.B`, the estimated variance of the
//! pixel's mean (that of a sample over the number of samples), always float, infinite below two samples; and `samples`, whole
//! numbers, how many there are.
//!
//! A half ends at 65504: what is brighter is clamped to that and counted.

use std::io::Cursor;

use ::exr::{
    meta::attribute::Chromaticities,
    prelude::{
        Blocks, Compression, Encoding, Image, ImageAttributes, IntegerBounds, IntoSample, Layer,
        LayerAttributes, LineOrder, SpecificChannels, Text, Vec2, WritableImage, f16,
    },
};

use super::{Depth, Encoded, Error, Facts, software};
use crate::color::{Picture, Spread};

const REC709: Chromaticities = Chromaticities {
    red: Vec2(0.64, 0.33),
    green: Vec2(0.30, 0.60),
    blue: Vec2(0.15, 0.06),
    white: Vec2(0.3127, 0.3290),
};

pub fn encode(
    picture: &Picture,
    spread: Option<&[Spread]>,
    depth: Depth,
    facts: &Facts,
) -> Result<Encoded, Error> {
    match depth {
        Depth::High => {
            let bytes = encode_as(picture, spread, facts, |x| x)?;
            Ok(Encoded { bytes, clamped: 0 })
        }
        Depth::Low => {
            let largest = f16::MAX.to_f32();
            let bytes = encode_as(picture, spread, facts, |x| f16::from_f32(x.min(largest)))?;
            let clamped = picture.pixels.as_flattened().iter().filter(|&&x| x > largest).count() as u64;
            Ok(Encoded { bytes, clamped })
        }
    }
}

fn encode_as<T: IntoSample>(
    picture: &Picture,
    spread: Option<&[Spread]>,
    facts: &Facts,
    convert: impl Fn(f32) -> T + Sync,
) -> Result<Vec<u8>, Error> {
    let width = picture.width as usize;
    let size = (width, picture.height as usize);
    let index = |position: Vec2<usize>| position.y() * width + position.x();
    let (image, layer, encoding) = (image_attributes(facts), layer_attributes(facts), encoding());
    let mut bytes = Vec::new();
    let file = Cursor::new(&mut bytes);
    let written = match spread {
        None => {
            let channels = SpecificChannels::rgb(|position: Vec2<usize>| {
                let [r, g, b] = picture.pixels[index(position)];
                (convert(r), convert(g), convert(b))
            });
            Image::new(image, Layer::new(size, layer, encoding, channels)).write().to_buffered(file)
        }
        Some(spread) => {
            let channels = SpecificChannels::build()
                .with_channel("R")
                .with_channel("G")
                .with_channel("B")
                .with_channel("variance.R")
                .with_channel("variance.G")
                .with_channel("variance.B")
                .with_channel("samples")
                .with_pixel_fn(|position: Vec2<usize>| {
                    let i = index(position);
                    let ([r, g, b], Spread { variance: [vr, vg, vb], samples }) =
                        (picture.pixels[i], spread[i]);
                    (convert(r), convert(g), convert(b), vr, vg, vb, samples)
                });
            Image::new(image, Layer::new(size, layer, encoding, channels)).write().to_buffered(file)
        }
    };
    written.map_err(Error::encoding)?;
    Ok(bytes)
}

fn image_attributes(facts: &Facts) -> ImageAttributes {
    let [width, height] = facts.size.map(|n| n as usize);
    let mut attributes = ImageAttributes::new(IntegerBounds::from_dimensions((width, height)));
    attributes.chromaticities = Some(REC709);
    attributes
}

fn layer_attributes(facts: &Facts) -> LayerAttributes {
    let noise = facts.noise.map_or("unknown".into(), |noise| noise.to_string());
    let comments =
        format!("samples per pixel {}, relative noise {noise}, seed {}", facts.samples_per_pixel, facts.seed);
    let [x, y] = facts.origin.map(|n| n as i32);
    LayerAttributes {
        layer_position: Vec2(x, y),
        software_name: Text::new_or_none(software()),
        comments: Text::new_or_none(comments),
        ..LayerAttributes::default()
    }
}

fn encoding() -> Encoding {
    Encoding { compression: Compression::ZIP16, blocks: Blocks::ScanLines, line_order: LineOrder::Increasing }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ::exr::prelude::*;

    const FACTS: Facts =
        Facts { samples_per_pixel: 12.5, noise: Some(0.03), seed: u64::MAX, size: [40, 21], origin: [0, 0] };

    fn picture() -> Picture {
        let pixels = (0..40 * 21).map(|i| [i as f32 / 7.0, 1e-5 * i as f32, 0.1]).collect();
        Picture { width: 40, height: 21, pixels }
    }

    fn decode(bytes: &[u8]) -> Vec<[f32; 3]> {
        let image = read()
            .no_deep_data()
            .largest_resolution_level()
            .rgb_channels(
                |size, _| (size.width(), vec![[0.0; 3]; size.area()]),
                |(width, pixels), p, (r, g, b): (f32, f32, f32)| pixels[p.y() * *width + p.x()] = [r, g, b],
            )
            .first_valid_layer()
            .all_attributes()
            .from_buffered(Cursor::new(bytes))
            .expect("reads back");
        image.layer_data.channel_data.pixels.1
    }

    #[test]
    fn float_round_trip_is_exact() {
        let encoded = encode(&picture(), None, Depth::High, &FACTS).expect("encodes");
        assert_eq!(encoded.clamped, 0);
        assert_eq!(decode(&encoded.bytes), picture().pixels);
    }

    #[test]
    fn variance_is_float_beside_half_colours() {
        let spread: Vec<Spread> = (0..40 * 21)
            .map(|i| Spread { variance: [1e-9 * i as f32, 0.3, f32::INFINITY], samples: 1 << 24 | i })
            .collect();
        let encoded = encode(&picture(), Some(&spread), Depth::Low, &FACTS).expect("encodes");
        let plain = encode(&picture(), None, Depth::Low, &FACTS).expect("encodes");
        assert_eq!(decode(&encoded.bytes), decode(&plain.bytes));
        let image = all_channels_of(&encoded.bytes);
        let names: Vec<String> = image.iter().map(|(name, _)| name.clone()).collect();
        assert_eq!(names, ["B", "G", "R", "samples", "variance.B", "variance.G", "variance.R"]);
        let reds: Vec<f32> = spread.iter().map(|s| s.variance[0]).collect();
        assert_eq!(image[6].1, reds);
        assert_eq!(image[3].1[7], ((1 << 24) | 7) as f32);
        assert!(image[4].1.iter().all(|v| v.is_infinite()));
    }

    fn all_channels_of(bytes: &[u8]) -> Vec<(String, Vec<f32>)> {
        let image = read()
            .no_deep_data()
            .largest_resolution_level()
            .all_channels()
            .first_valid_layer()
            .all_attributes()
            .from_buffered(Cursor::new(bytes))
            .expect("reads back");
        let channels = image.layer_data.channel_data.list;
        channels.iter().map(|c| (c.name.to_string(), c.sample_data.values_as_f32().collect())).collect()
    }

    #[test]
    fn half_rounds_and_clamps() {
        let mut picture = picture();
        picture.pixels[3] = [1e6, 65504.0, 65519.0];
        let encoded = encode(&picture, None, Depth::Low, &FACTS).expect("encodes");
        assert_eq!(encoded.clamped, 2);
        let decoded = decode(&encoded.bytes);
        assert_eq!(decoded[3], [65504.0; 3]);
        for (a, b) in decoded.as_flattened().iter().zip(picture.pixels.as_flattened()) {
            let b = b.min(65504.0);
            assert!((a - b).abs() <= b / 2048.0 + 3.1e-8, "{a} for {b}");
        }
    }

    #[test]
    fn a_crop_keeps_its_place() {
        let facts = Facts { size: [100, 60], origin: [7, 30], ..FACTS };
        let encoded = encode(&picture(), None, Depth::High, &facts).expect("encodes");
        let meta = MetaData::read_from_buffered(Cursor::new(&encoded.bytes), false).expect("header");
        let header = &meta.headers[0];
        assert_eq!(header.shared_attributes.display_window, IntegerBounds::new((0, 0), (100, 60)));
        assert_eq!(header.data_window(), IntegerBounds::new((7, 30), (40, 21)));
        assert_eq!(decode(&encoded.bytes), picture().pixels);
    }

    #[test]
    fn the_file_says_how_it_was_made() {
        let encoded = encode(&picture(), None, Depth::Low, &FACTS).expect("encodes");
        let meta = MetaData::read_from_buffered(Cursor::new(&encoded.bytes), false).expect("header");
        let header = &meta.headers[0];
        assert_eq!(header.compression, Compression::ZIP16);
        assert_eq!(header.shared_attributes.chromaticities, Some(REC709));
        let says = |text: &Option<Text>| text.as_ref().map(Text::to_string).unwrap_or_default();
        assert_eq!(says(&header.own_attributes.software_name), software());
        let comments = says(&header.own_attributes.comments);
        assert_eq!(comments, "samples per pixel 12.5, relative noise 0.03, seed 18446744073709551615");
    }
}
