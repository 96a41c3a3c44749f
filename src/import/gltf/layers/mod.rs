//! The material extensions of Khronos that lay something on, in or under the metallic-roughness material.
//!
//! | file | extensions, `KHR_materials_…` |
//! |---|---|
//! | `coats` | clearcoat, sheen |
//! | `reflection` | specular, iridescence, anisotropy |
//! | `passage` | transmission, volume, dispersion, diffuse_transmission |
//! | `specular_glossiness` | pbrSpecularGlossiness, in place of metallic-roughness |
//! | `reader` | typed reading of their members |
//!
//! A layer whose factor is zero is left out. `thicknessTexture` is not used: light is traced through the mesh itself.

mod coats;
mod passage;
mod reader;
mod reflection;
mod specular_glossiness;

use gltf::json;

use super::material::Conversion;
use crate::world::{Layered, Pbr, Surface};
use reader::Reader;

/// Texture slots of the extensions, as paths below the material.
const SLOTS: [&str; 16] = [
    "extensions/KHR_materials_anisotropy/anisotropyTexture",
    "extensions/KHR_materials_clearcoat/clearcoatTexture",
    "extensions/KHR_materials_clearcoat/clearcoatRoughnessTexture",
    "extensions/KHR_materials_clearcoat/clearcoatNormalTexture",
    "extensions/KHR_materials_diffuse_transmission/diffuseTransmissionTexture",
    "extensions/KHR_materials_diffuse_transmission/diffuseTransmissionColorTexture",
    "extensions/KHR_materials_iridescence/iridescenceTexture",
    "extensions/KHR_materials_iridescence/iridescenceThicknessTexture",
    "extensions/KHR_materials_pbrSpecularGlossiness/diffuseTexture",
    "extensions/KHR_materials_pbrSpecularGlossiness/specularGlossinessTexture",
    "extensions/KHR_materials_sheen/sheenColorTexture",
    "extensions/KHR_materials_sheen/sheenRoughnessTexture",
    "extensions/KHR_materials_specular/specularTexture",
    "extensions/KHR_materials_specular/specularColorTexture",
    "extensions/KHR_materials_transmission/transmissionTexture",
    UNUSED_SLOT,
];

/// The slot whose image need not be decoded.
pub const UNUSED_SLOT: &str = "extensions/KHR_materials_volume/thicknessTexture";

/// Every texture slot of a material's extensions: its path, and the texture. What is not an index is reported where the
/// extension is read.
pub fn slots(material: &json::Material) -> impl Iterator<Item = (&'static str, usize)> {
    SLOTS.iter().filter_map(|path| {
        let mut parts = path.split('/').skip(1);
        let extension = material.extensions.as_ref()?.others.get(parts.next()?)?;
        let index = extension.get(parts.next()?)?.get("index")?.as_u64()?;
        Some((*path, usize::try_from(index).ok()?))
    })
}

/// `pbr` with the layers that the material's extensions add.
pub fn layered(conversion: &mut Conversion, json: &json::Material, pbr: Pbr) -> Surface {
    let mut layered = Layered::new(pbr);
    let mut read = |name: &'static str, layer: fn(&mut Reader, &mut Layered)| {
        if let Some(mut reader) = Reader::open(conversion, json, name) {
            layer(&mut reader, &mut layered);
        }
    };
    read("KHR_materials_specular", reflection::specular);
    read("KHR_materials_iridescence", reflection::iridescence);
    read("KHR_materials_anisotropy", reflection::anisotropy);
    read("KHR_materials_clearcoat", coats::clearcoat);
    read("KHR_materials_sheen", coats::sheen);
    read("KHR_materials_transmission", passage::transmission);
    read("KHR_materials_diffuse_transmission", passage::diffuse_transmission);
    read("KHR_materials_volume", passage::volume);
    read("KHR_materials_dispersion", passage::dispersion);
    if layered.is_plain() { Surface::Pbr(pbr) } else { Surface::Layered(Box::new(layered)) }
}

/// The archived workflow, where a material has it: its surface, and the coverage that goes with its diffuse colour.
pub fn specular_glossiness(
    conversion: &mut Conversion,
    json: &json::Material,
) -> Option<specular_glossiness::Converted> {
    Reader::open(conversion, json, specular_glossiness::NAME).map(|mut r| specular_glossiness::read(&mut r))
}
