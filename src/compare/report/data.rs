//! Numbers and text in a form that can stand in a page.

use std::io::Write;

use ::exr::prelude::f16;
use base64::{Engine, prelude::BASE64_STANDARD};
use flate2::{Compression, write::ZlibEncoder};
use rayon::prelude::*;
use serde::Serialize;

/// Bytes that the page inflates when it needs them.
#[derive(Default)]
pub struct Blobs(Vec<Vec<u8>>);

impl Blobs {
    /// Keeps `bytes`; their place is what the page asks for them by.
    pub fn add(&mut self, bytes: Vec<u8>) -> usize {
        self.0.push(bytes);
        self.0.len() - 1
    }

    /// A `script` element for each, which browsers keep as text.
    pub fn elements(&self) -> String {
        let deflated: Vec<String> =
            self.0.par_iter().map(|bytes| BASE64_STANDARD.encode(deflate(bytes))).collect();
        let element = |(i, text): (usize, &String)| {
            format!("<script type=\"application/octet-stream\" id=\"blob{i}\">{text}</script>\n")
        };
        deflated.iter().enumerate().map(element).collect()
    }
}

fn deflate(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = ZlibEncoder::new(Vec::new(), Compression::default());
    // Writing to memory does not fail.
    let _ = encoder.write_all(bytes);
    encoder.finish().unwrap_or_default()
}

/// As 16-bit floats: all low bytes, then all high ones, which deflates better than in turns. Clamped at the largest half.
pub fn halves(pixels: &[[f32; 3]]) -> Vec<u8> {
    let half = |&x: &f32| f16::from_f32(x.min(f16::MAX.to_f32())).to_le_bytes();
    let numbers = pixels.as_flattened();
    let (low, high): (Vec<u8>, Vec<u8>) = numbers.iter().map(half).map(|[low, high]| (low, high)).unzip();
    [low, high].concat()
}

/// 0 to 1 in 8 bits, rounded.
pub fn bytes(map: &[f32]) -> Vec<u8> {
    map.iter().map(|&x| (x * 255.0 + 0.5) as u8).collect()
}

/// JSON that cannot end the `script` element that it stands in.
pub fn json(value: &impl Serialize) -> String {
    // Plain numbers and strings: nothing here can fail to serialise.
    serde_json::to_string(value).unwrap_or_default().replace('<', "\\u003c")
}

/// Text that stays text between tags.
pub fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

/// By what whole factor a picture is reduced so that at most `most` pixels are left.
pub fn reduction(width: usize, height: usize, most: usize) -> usize {
    (1..).find(|&k| width.div_ceil(k) * height.div_ceil(k) <= most.max(1)).unwrap_or(1)
}

/// Means of squares of `factor` pixels along each side, smaller at the right and lower edge.
pub fn reduce<const N: usize>(pixels: &[[f32; N]], width: usize, factor: usize) -> Vec<[f32; N]> {
    if factor <= 1 || width == 0 {
        return pixels.to_vec();
    }
    let band = |rows: &[[f32; N]]| -> Vec<[f32; N]> {
        let columns = (0..width).step_by(factor).map(|x| x..(x + factor).min(width));
        let mean = |columns: std::ops::Range<usize>| {
            let mut sum = [0.0f64; N];
            let mut count = 0.0;
            for pixel in rows.chunks(width).flat_map(|row| &row[columns.clone()]) {
                count += 1.0;
                sum.iter_mut().zip(pixel).for_each(|(sum, &x)| *sum += f64::from(x));
            }
            sum.map(|sum| (sum / count) as f32)
        };
        columns.map(mean).collect()
    };
    pixels.par_chunks(width * factor).flat_map_iter(band).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Read;

    #[test]
    fn reduction_to_what_fits() {
        assert_eq!(reduction(1920, 1080, 1 << 21), 1);
        assert_eq!(reduction(3840, 2160, 1 << 21), 2);
        assert_eq!(reduction(16_384, 5_000, 1 << 21), 7);
        assert_eq!(reduction(0, 0, 10), 1);
    }

    #[test]
    fn reduction_takes_means_and_keeps_the_edges() {
        let pixels: Vec<[f32; 1]> = (0..15).map(|i| [i as f32]).collect(); // 5 × 3
        let reduced: Vec<f32> = reduce(&pixels, 5, 2).into_iter().flatten().collect();
        assert_eq!(reduced, [3.0, 5.0, 6.5, 10.5, 12.5, 14.0]);
        assert_eq!(reduce(&pixels, 5, 1), pixels);
    }

    #[test]
    fn blobs_inflate_to_what_they_were() {
        let mut blobs = Blobs::default();
        assert_eq!((blobs.add(vec![1, 2, 3]), blobs.add(halves(&[[1.0, 1e9, 0.5]]))), (0, 1));
        let html = blobs.elements();
        let text =
            html.split("id=\"blob1\">").nth(1).and_then(|rest| rest.split('<').next()).expect("element");
        let mut bytes = Vec::new();
        let deflated = BASE64_STANDARD.decode(text).expect("base64");
        flate2::read::ZlibDecoder::new(&deflated[..]).read_to_end(&mut bytes).expect("zlib");
        assert_eq!(bytes, [0x00, 0xFF, 0x00, 0x3C, 0x7B, 0x38]);
    }

    #[test]
    fn text_stays_text() {
        assert_eq!(json(&"</script><b>"), "\"\\u003c/script>\\u003cb>\"");
        assert_eq!(escape("<b> & co"), "&lt;b&gt; &amp; co");
        assert_eq!(bytes(&[0.0, 0.5, 1.0]), [0, 128, 255]);
    }
}
