//! Colours for numbers: equal steps of the number look like equal steps of lightness.
//!
//! Both maps are made in Oklab (Ottosson 2020, *A perceptual color space for image processing*), with lightness linear in
//! the number, and chroma reduced where the sRGB gamut ends.
//!
//! | map | of | from … to |
//! |---|---|---|
//! | sequential | 0 to 1 | near black, over violet, red and orange, to a light yellow |
//! | diverging | −1 to 1 | dark blue, over near white at 0, to dark red |

use crate::color::srgb_encode;

/// Colour of `t` in 0 to 1.
pub fn sequential(t: f32) -> [u8; 3] {
    // The hue turns through red, as a glowing body's.
    in_gamut(0.16 + 0.80 * t, 0.05 + 0.17 * (std::f32::consts::PI * t).sin(), 290.0 + 175.0 * t)
}

/// Colour of `t` in 0 to 1, ½ being no difference.
pub fn diverging(t: f32) -> [u8; 3] {
    let signed = 2.0 * t - 1.0;
    let size = signed.abs();
    // Chroma rises fast, so that the sign of small differences shows, then stays.
    let chroma = 0.165 * (1.0 - (-3.0 * size).exp());
    in_gamut(0.965 - 0.575 * size, chroma, if signed < 0.0 { 255.0 } else { 33.0 })
}

/// 256 colours of a map, `rrggbb` in a row.
pub fn hex(map: fn(f32) -> [u8; 3]) -> String {
    (0..256).map(|i| map(i as f32 / 255.0)).map(|[r, g, b]| format!("{r:02x}{g:02x}{b:02x}")).collect()
}

/// sRGB of Oklab's lightness, chroma and hue (degrees), with as much of the chroma as sRGB has.
fn in_gamut(lightness: f32, chroma: f32, hue: f32) -> [u8; 3] {
    let (sin, cos) = hue.to_radians().sin_cos();
    let at = |chroma: f32| linear_srgb([lightness, chroma * cos, chroma * sin]);
    let fits = |rgb: [f32; 3]| rgb.iter().all(|c| (-1e-4..=1.0001).contains(c));
    let (mut low, mut high) = (0.0, chroma);
    if fits(at(high)) {
        low = high;
    }
    for _ in 0..16 {
        let middle = 0.5 * (low + high);
        if fits(at(middle)) { low = middle } else { high = middle }
    }
    at(low).map(|c| (255.0 * srgb_encode(c.clamp(0.0, 1.0)) + 0.5) as u8)
}

/// Ottosson's matrices.
#[allow(clippy::excessive_precision)]
fn linear_srgb([l, a, b]: [f32; 3]) -> [f32; 3] {
    let lms = [
        l + 0.396_337_777_4 * a + 0.215_803_757_3 * b,
        l - 0.105_561_345_8 * a - 0.063_854_172_8 * b,
        l - 0.089_484_177_5 * a - 1.291_485_548_0 * b,
    ]
    .map(|x: f32| x * x * x);
    [
        4.076_741_662_1 * lms[0] - 3.307_711_591_3 * lms[1] + 0.230_969_929_2 * lms[2],
        -1.268_438_004_6 * lms[0] + 2.609_757_401_1 * lms[1] - 0.341_319_396_5 * lms[2],
        -0.004_196_086_3 * lms[0] - 0.703_418_614_7 * lms[1] + 1.707_614_701_0 * lms[2],
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::color::srgb_decode;

    /// Oklab's lightness, by the inverse matrices.
    fn lightness(rgb: [u8; 3]) -> f32 {
        let [r, g, b] = rgb.map(|c| srgb_decode(f32::from(c) / 255.0));
        let l = 0.412_221_46 * r + 0.536_332_55 * g + 0.051_445_995 * b;
        let m = 0.211_903_5 * r + 0.680_699_5 * g + 0.107_396_96 * b;
        let s = 0.088_302_46 * r + 0.281_718_85 * g + 0.629_978_7 * b;
        0.210_454_26 * l.cbrt() + 0.793_617_8 * m.cbrt() - 0.004_072_047 * s.cbrt()
    }

    #[test]
    fn lightness_is_linear() {
        for i in 0..=255 {
            let t = i as f32 / 255.0;
            let expected = 0.16 + 0.80 * t;
            assert!((lightness(sequential(t)) - expected).abs() < 0.012, "{t}: {}", lightness(sequential(t)));
            let expected = 0.965 - 0.575 * (2.0 * t - 1.0).abs();
            assert!((lightness(diverging(t)) - expected).abs() < 0.012, "{t}: {}", lightness(diverging(t)));
        }
    }

    #[test]
    fn the_sign_shows_as_blue_or_red() {
        let [middle_low, middle_high] = [diverging(0.499), diverging(0.501)];
        assert!(middle_low.iter().zip(middle_high).all(|(a, b)| a.abs_diff(b) < 3));
        for t in [0.0, 0.2, 0.4] {
            let ([r, _, b], [r2, _, b2]) = (diverging(t), diverging(1.0 - t));
            assert!(b > r + 20 && r2 > b2 + 20, "{t}");
        }
        assert_eq!(hex(diverging).len(), 6 * 256);
    }
}
