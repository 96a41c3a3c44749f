//! View transforms: how scene-linear light becomes display numbers in [0, 1].
//!
//! | view | number stored for the linear value l | for |
//! |---|---|---|
//! | `srgb` | the piecewise sRGB curve | any screen; the default |
//! | `gamma2` | √l, that is l^γ with γ = 1/2 | the curve of *Ray Tracing in One Weekend* |
//! | `raw` | l | masks, measurements |
//!
//! All clip at 1: light brighter than white is white. Exposure, in stops, comes before the curve.

use super::srgb_encode;

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum View {
    /// The piecewise sRGB curve, clipped at 1.
    #[default]
    Srgb,
    /// Square root (γ = 1/2), clipped at 1.
    Gamma2,
    /// No curve: the linear number is stored, clipped at 1.
    Raw,
}

impl View {
    /// The display number, in [0, 1], of a linear value relative to display white.
    pub fn encode(self, linear: f32) -> f32 {
        let l = linear.clamp(0.0, 1.0);
        match self {
            Self::Srgb => srgb_encode(l),
            Self::Gamma2 => l.sqrt(),
            Self::Raw => l,
        }
    }
}

/// Factor on the radiance for an exposure in stops.
pub fn exposure_factor(stops: f32) -> f32 {
    stops.exp2()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_view_keeps_black_and_white_and_clips() {
        for view in [View::Srgb, View::Gamma2, View::Raw] {
            assert_eq!(view.encode(0.0), 0.0);
            assert_eq!(view.encode(-1.0), 0.0);
            assert!((view.encode(1.0) - 1.0).abs() < 1e-6);
            assert_eq!(view.encode(7.0), view.encode(1.0));
        }
    }

    #[test]
    fn curves_and_stops() {
        assert_eq!(View::Gamma2.encode(0.25), 0.5);
        assert_eq!(View::Raw.encode(0.25), 0.25);
        assert!((View::Srgb.encode(0.25) - 0.537_099).abs() < 1e-5);
        assert_eq!(exposure_factor(0.0), 1.0);
        assert_eq!(exposure_factor(-2.0), 0.25);
    }
}
