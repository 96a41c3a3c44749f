//! The sRGB transfer curve (IEC 61966-2-1:1999): a straight piece near black, then a power of 1/2.4.
//!
//! ```text
//! encode(l) = 12.92 l                  l ≤ 0.0031308
//!           = 1.055 l^(1/2.4) − 0.055  above
//! ```
//!
//! Linear values are relative to display white (1). Neither direction clips: that is the caller's decision.

/// Linear light to the encoded value.
pub fn srgb_encode(linear: f32) -> f32 {
    if linear <= 0.003_130_8 { 12.92 * linear } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 }
}

/// Encoded value to linear light.
pub fn srgb_decode(encoded: f32) -> f32 {
    if encoded <= 0.040_45 { encoded / 12.92 } else { ((encoded + 0.055) / 1.055).powf(2.4) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn known_values() {
        // (encoded byte, linear), from the formula in exact arithmetic
        let known =
            [(0, 0.0), (10, 0.003_035_27), (55, 0.038_204_37), (128, 0.215_860_5), (188, 0.502_886_5)];
        for (byte, linear) in known {
            let encoded = byte as f32 / 255.0;
            assert!((srgb_decode(encoded) - linear).abs() < 1e-6, "{byte}: {}", srgb_decode(encoded));
            assert!((srgb_encode(linear) - encoded).abs() < 1e-5, "{byte}: {}", srgb_encode(linear));
        }
        assert!((srgb_encode(1.0) - 1.0).abs() < 1e-6);
        assert!((srgb_encode(0.18) - 0.461_356).abs() < 1e-5); // middle grey
    }

    #[test]
    fn round_trip_and_continuity() {
        for i in 0..=1000 {
            let x = i as f32 / 1000.0;
            assert!((srgb_decode(srgb_encode(x)) - x).abs() < 1e-5, "{x}");
        }
        assert!((srgb_encode(0.003_130_9) - srgb_encode(0.003_130_7)).abs() < 1e-5);
        assert!((srgb_decode(0.040_46) - srgb_decode(0.040_44)).abs() < 1e-5);
    }
}
