//! KHR_materials_pbrSpecularGlossiness, archived: in place of metallic-roughness where a material has it.

use glam::Vec3;

use super::Reader;
use crate::world::{ColorInput, ColorSpace, ScalarInput, SpecularGlossiness};

pub const NAME: &str = "KHR_materials_pbrSpecularGlossiness";

pub struct Converted {
    pub surface: SpecularGlossiness,
    /// Alpha of the diffuse factor and texture.
    pub coverage: ScalarInput,
}

pub fn read(reader: &mut Reader) -> Converted {
    let [r, g, b, a] = reader.color::<4>("diffuseFactor", 1.0, 1.0);
    let texture = reader.texture("diffuseTexture", ColorSpace::Srgb);
    let specular = reader.color_input("specularFactor", 1.0, 1.0, "specularGlossinessTexture");
    let glossiness = ScalarInput {
        factor: reader.share("glossinessFactor", 1.0),
        texture: specular.texture.map(|texture| (texture, 3)),
    };
    let diffuse = ColorInput { factor: Vec3::new(r, g, b), texture };
    let coverage = ScalarInput { factor: a, texture: texture.map(|texture| (texture, 3)) };
    Converted { surface: SpecularGlossiness { diffuse, specular, glossiness }, coverage }
}
