//! Radiance HDR: three 8-bit mantissas with one exponent (Ward, *Real Pixels*, Graphics Gems II, 1991).
//!
//! The encoder of the `image` crate truncates mantissas, as Radiance does; but most readers, that crate's among them, do
//! not add the half step back that Radiance's reader adds, so that pictures come out 0.3 % too dark. Hence values are
//! rounded to the steps of the format first: truncation then changes nothing.

use image::{Rgb, codecs::hdr::HdrEncoder};

use super::{Encoded, Error};
use crate::color::Picture;

/// Just under 2¹²⁷, the largest number of the format with a margin for rounding.
const LARGEST: f32 = 1.69e38;

/// Below the format's smallest exponent: black.
const SMALLEST: f32 = 1e-38;

pub fn encode(picture: &Picture) -> Result<Encoded, Error> {
    let pixels: Vec<Rgb<f32>> = picture.pixels.iter().map(|&p| Rgb(round(p))).collect();
    let clamped = picture.pixels.as_flattened().iter().filter(|&&x| x > LARGEST).count() as u64;
    let mut bytes = Vec::new();
    HdrEncoder::new(&mut bytes)
        .encode(&pixels, picture.width as usize, picture.height as usize)
        .map_err(Error::encoding)?;
    Ok(Encoded { bytes, clamped })
}

/// The nearest colour that the format has: multiples of 2⁻⁸ of the power of two above the largest channel.
fn round(pixel: [f32; 3]) -> [f32; 3] {
    let pixel = pixel.map(|x| x.min(LARGEST));
    let largest = pixel.into_iter().fold(0.0, f32::max);
    if largest < SMALLEST {
        return [0.0; 3];
    }
    let step = 2f64.powi(f64::from(largest).log2().floor() as i32 - 7);
    pixel.map(|x| ((f64::from(x) / step).round() * step) as f32)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::stats::uniform;
    use image::{ImageDecoder, codecs::hdr::HdrDecoder};

    fn decode(bytes: &[u8]) -> Vec<[f32; 3]> {
        let decoder = HdrDecoder::new(std::io::Cursor::new(bytes)).expect("header");
        let mut raw = vec![0; decoder.total_bytes() as usize];
        decoder.read_image(&mut raw).expect("pixels");
        let floats: Vec<f32> =
            raw.chunks(4).map(|b| f32::from_ne_bytes(b.try_into().expect("4 bytes"))).collect();
        floats.as_chunks().0.to_vec()
    }

    #[test]
    fn the_mean_survives() {
        for width in [7, 64] {
            let pixels: Vec<_> =
                (0..width * 64).map(|i| [0, 1, 2].map(|k| 0.3 + 3.0 * uniform(i, k).powi(4))).collect();
            let encoded = encode(&Picture { width, height: 64, pixels: pixels.clone() }).expect("encodes");
            let decoded = decode(&encoded.bytes);
            let mean = |p: &[[f32; 3]]| p.as_flattened().iter().sum::<f32>() / p.len() as f32;
            assert!((mean(&decoded) / mean(&pixels) - 1.0).abs() < 1e-3);
            for (a, b) in decoded.as_flattened().iter().zip(pixels.as_flattened()) {
                assert!((a - b).abs() <= 3.3 / 256.0, "{a} for {b}");
            }
        }
    }

    #[test]
    fn extremes_wrap_around_nowhere() {
        let pixels = vec![[f32::MAX, 0.0, 1.0], [1e-44, 0.0, 1e-40], [0.998, 0.5, 0.001], [0.0; 3]];
        let encoded = encode(&Picture { width: 4, height: 1, pixels }).expect("encodes");
        let decoded = decode(&encoded.bytes);
        assert_eq!(encoded.clamped, 1);
        assert!((decoded[0][0] / LARGEST - 1.0).abs() < 0.01);
        assert_eq!(decoded[1], [0.0; 3]);
        assert!((decoded[2][0] - 0.998).abs() < 0.003, "{}", decoded[2][0]);
    }
}
