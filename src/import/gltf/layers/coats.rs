//! KHR_materials_clearcoat and KHR_materials_sheen.

use glam::Vec3;

use super::Reader;
use crate::world::{Clearcoat, Layered, Sheen};

pub fn clearcoat(reader: &mut Reader, layered: &mut Layered) {
    let factor = reader.scalar_input("clearcoatFactor", 0.0, ("clearcoatTexture", 0));
    let roughness = reader.scalar_input("clearcoatRoughnessFactor", 0.0, ("clearcoatRoughnessTexture", 1));
    if factor.factor > 0.0 {
        let normal = reader.normal_map("clearcoatNormalTexture");
        layered.clearcoat = Some(Clearcoat { factor, roughness, normal });
    }
}

pub fn sheen(reader: &mut Reader, layered: &mut Layered) {
    let color = reader.color_input("sheenColorFactor", 0.0, 1.0, "sheenColorTexture");
    let roughness = reader.scalar_input("sheenRoughnessFactor", 0.0, ("sheenRoughnessTexture", 3));
    if color.factor != Vec3::ZERO {
        layered.sheen = Some(Sheen { color, roughness });
    }
}
