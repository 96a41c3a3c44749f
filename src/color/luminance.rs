//! Luminance of linear Rec.709 (ITU-R BT.709-6, item 3.2): what noise is measured in, and lights are chosen by.

use glam::{DVec3, Vec3};

/// Weights of the primaries.
pub const LUMINANCE: DVec3 = DVec3::new(0.2126, 0.7152, 0.0722);

pub fn luminance(color: Vec3) -> f32 {
    color.dot(LUMINANCE.as_vec3())
}
