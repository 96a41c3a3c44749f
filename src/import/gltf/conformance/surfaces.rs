//! Materials on primitives: texture coordinates and tangents that the textures ask for.

use serde_json::{Map, Value};

use super::{
    asset::{Asset, extension, index_of, list, members, whole},
    findings::Findings,
};

pub fn check(asset: Asset, primitive: &Value, at: &str, findings: &mut Findings) {
    let has = |name: &str| primitive.get("attributes").and_then(|attributes| attributes.get(name)).is_some();
    let mappings = extension(primitive, "KHR_materials_variants").and_then(|e| e.get("mappings"));
    let mappings = list(mappings).iter().enumerate();
    let mappings = mappings.map(|(i, mapping)| {
        (mapping, format!("{at}/extensions/KHR_materials_variants/mappings/{i}/material"))
    });
    for (user, pointer) in std::iter::once((primitive, format!("{at}/material"))).chain(mappings) {
        let Some(material) = asset.item("materials", index_of(user, "material")) else { continue };
        for (name, set) in texture_sets(material) {
            if !has(&format!("TEXCOORD_{set}")) {
                let message = format!("asks for TEXCOORD_{set} ({name}), which the primitive does not have");
                findings.add("materials' texture coordinates", pointer.clone(), message);
            }
        }
        // Tangents follow a normal map where they are not given.
        if needs_tangents(material) && material.get("normalTexture").is_none() && !has("TANGENT") {
            let message = "asks for TANGENT, which the primitive does not have";
            findings.add("materials' tangents", pointer, message);
        }
    }
}

fn needs_tangents(material: &Value) -> bool {
    let coat = extension(material, "KHR_materials_clearcoat");
    coat.is_some_and(|coat| coat.get("clearcoatNormalTexture").is_some())
        || extension(material, "KHR_materials_anisotropy").is_some()
}

/// The textures of a material, those of its extensions too, by the UV sets that they look up.
fn texture_sets(material: &Value) -> Vec<(&str, u64)> {
    let layers = members(material.get("extensions")).filter_map(|(_, extension)| extension.as_object());
    let inner = material.get("pbrMetallicRoughness").and_then(Value::as_object);
    let objects = material.as_object().into_iter().chain(inner).chain(layers);
    objects.flat_map(textures).collect()
}

/// Both sets of a texture whose KHR_texture_transform names another: readers without the extension take its own.
fn textures(object: &Map<String, Value>) -> impl Iterator<Item = (&str, u64)> {
    let slots = object.iter().filter(|(key, slot)| key.ends_with("Texture") && slot.get("index").is_some());
    slots.flat_map(|(key, slot)| {
        let own = slot.get("texCoord").map_or(Some(0), whole);
        let moved = extension(slot, "KHR_texture_transform").and_then(|transform| transform.get("texCoord"));
        let moved = moved.and_then(whole).filter(|moved| Some(*moved) != own);
        own.into_iter().chain(moved).map(|set| (key.as_str(), set))
    })
}
