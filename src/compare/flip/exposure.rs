//! Which exposures HDR-FLIP looks at, and the tone curve it shows them with (2021, section 4).
//!
//! The curve is Narkowicz's fit of ACES with its pre-exposure of 0.6 taken out,
//!
//! ```text
//! f(x) = (a x² + b x) / (c x² + d x + e)
//! ```
//!
//! and x₈₅ is where it reaches 0.85. The range runs from the exposure that brings the reference's brightest luminance to
//! x₈₅ to the one that brings the median there, in n = max(2, ⌈range⌉) equal steps, ends included.

use crate::color::{LUMINANCE, Picture};

const A: f32 = 0.6 * 0.6 * 2.51;
const B: f32 = 0.6 * 0.03;
const C: f32 = 0.6 * 0.6 * 2.43;
const D: f32 = 0.6 * 0.59;
const E: f32 = 0.14;

/// How bright, on the display, the brightest and the median are brought.
const LEVEL: f32 = 0.85;

/// More than any real picture needs (a 16-bit half spans 40); keeps one with a median of 1e-38 from taking hours.
const MOST: u32 = 64;

/// A range of exposures, in stops.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Exposures {
    pub start: f32,
    pub stop: f32,
    pub count: u32,
}

impl Exposures {
    /// For `picture` as the reference; `None` where it is black. The median of a picture that is more than half black is
    /// taken over the pixels that are not, for lack of an exposure that shows the others.
    pub fn of(picture: &Picture) -> Option<Self> {
        let weights = LUMINANCE.as_vec3();
        let mut luminances: Vec<f32> = picture
            .pixels
            .iter()
            .map(|&[r, g, b]| weights.x * r + weights.y * g + weights.z * b)
            .map(|l| l.min(f32::MAX))
            .collect();
        let largest = luminances.iter().copied().fold(0.0, f32::max);
        if largest <= 0.0 {
            return None;
        }
        let mut median = upper_median(&mut luminances);
        if median <= 0.0 {
            luminances.retain(|&l| l > 0.0);
            median = upper_median(&mut luminances);
        }
        let shown = brought_to(LEVEL);
        let (start, stop) = ((shown / largest).log2(), (shown / median).log2());
        let count = ((stop - start).ceil() as u32).clamp(2, MOST);
        Some(Self { start, stop, count })
    }

    pub fn stops(&self) -> impl Iterator<Item = f32> + use<> {
        let Self { start, stop, count } = *self;
        let step = (stop - start) / (count - 1) as f32;
        (0..count).map(move |i| start + i as f32 * step)
    }
}

/// The tone curve, clipped.
pub fn tone(x: f32) -> f32 {
    // Both squares overflow together: what is that bright is white.
    let y = (x * x * A + x * B) / (x * x * C + x * D + E);
    if y.is_nan() { 1.0 } else { y.clamp(0.0, 1.0) }
}

/// Where the tone curve reaches `level`.
fn brought_to(level: f32) -> f32 {
    let (a, b, c) = (A - level * C, B - level * D, -level * E);
    let half = -0.5 * b / a;
    half + (half * half - c / a).sqrt()
}

/// Of an even number, the upper of the two in the middle. 0 of none.
fn upper_median(values: &mut [f32]) -> f32 {
    if values.is_empty() {
        return 0.0;
    }
    *values.select_nth_unstable_by(values.len() / 2, f32::total_cmp).1
}

#[cfg(test)]
mod tests {
    use super::*;

    fn exposures(luminances: &[f32]) -> Option<Exposures> {
        let pixels = luminances.iter().map(|&l| [l; 3]).collect();
        Exposures::of(&Picture { width: luminances.len() as u32, height: 1, pixels })
    }

    #[test]
    fn the_brightest_and_the_median_are_shown_alike() {
        let e = exposures(&[8.0, 1.0, 0.5, 0.5, 0.125]).expect("light");
        for (stops, luminance) in [(e.start, 8.0), (e.stop, 0.5)] {
            assert!((tone(luminance * stops.exp2()) - LEVEL).abs() < 1e-4);
        }
        assert_eq!(e.count, 4);
        let stops: Vec<f32> = e.stops().collect();
        assert!(stops[0] == e.start && (stops[3] - e.stop).abs() < 1e-5);
    }

    #[test]
    fn odd_pictures() {
        assert_eq!(exposures(&[0.0; 4]), None);
        assert_eq!(exposures(&[1.0; 4]).map(|e| e.count), Some(2));
        let mostly_black = exposures(&[0.0, 0.0, 0.0, 0.0, 1.0, 0.25, 0.25]).expect("light");
        assert!((mostly_black.stop - mostly_black.start - 2.0).abs() < 1e-5);
        let wide = exposures(&[1e30, 1e-30, 1e-30]).expect("light");
        assert!(wide.count == MOST && wide.stops().all(f32::is_finite));
        assert_eq!((tone(0.0), tone(f32::MAX), tone(f32::INFINITY)), (0.0, 1.0, 1.0));
    }
}
