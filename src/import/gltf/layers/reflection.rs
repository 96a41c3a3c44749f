//! KHR_materials_specular, KHR_materials_iridescence and KHR_materials_anisotropy.

use glam::Vec3;

use super::Reader;
use crate::world::{Anisotropy, ColorSpace, Iridescence, Layered, SpecularLevel};

/// Of factors without a limit of their own.
const MOST: f32 = 1e12;
const MAX_FILM_IOR: f32 = 100.0;
/// A film of a millimetre has long lost its colours.
const MAX_THICKNESS: f32 = 1e6;

pub fn specular(reader: &mut Reader, layered: &mut Layered) {
    let factor = reader.scalar_input("specularFactor", 1.0, ("specularTexture", 3));
    let color = reader.color_input("specularColorFactor", 1.0, MOST, "specularColorTexture");
    let changes = factor.factor != 1.0 || color.factor != Vec3::ONE;
    if changes || factor.texture.is_some() || color.texture.is_some() {
        layered.specular = Some(SpecularLevel { factor, color });
    }
}

pub fn iridescence(reader: &mut Reader, layered: &mut Layered) {
    let factor = reader.scalar_input("iridescenceFactor", 0.0, ("iridescenceTexture", 0));
    let ior = reader.number("iridescenceIor", 1.3, [1.0, MAX_FILM_IOR]);
    let thin = reader.number("iridescenceThicknessMinimum", 100.0, [0.0, MAX_THICKNESS]);
    let thick = reader.number("iridescenceThicknessMaximum", 400.0, [0.0, MAX_THICKNESS]);
    if factor.factor > 0.0 {
        let thickness_texture = reader.channel("iridescenceThicknessTexture", 1);
        layered.iridescence = Some(Iridescence { factor, ior, thickness: [thin, thick], thickness_texture });
    }
}

pub fn anisotropy(reader: &mut Reader, layered: &mut Layered) {
    let strength = reader.share("anisotropyStrength", 0.0);
    let rotation = reader.number("anisotropyRotation", 0.0, [-MOST, MOST]);
    if strength > 0.0 {
        let texture = reader.texture("anisotropyTexture", ColorSpace::Linear);
        layered.anisotropy = Some(Anisotropy { strength, rotation, texture });
    }
}
