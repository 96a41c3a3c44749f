//! docs/gltf.md says what is read, and is held to it.

use std::collections::BTreeMap;

use super::super::extensions::SUPPORTED;

/// The extension registry of the Khronos Group, ratified and archived.
const REGISTRY: [&str; 27] = [
    "KHR_animation_pointer",
    "KHR_draco_mesh_compression",
    "KHR_lights_punctual",
    "KHR_materials_anisotropy",
    "KHR_materials_clearcoat",
    "KHR_materials_diffuse_transmission",
    "KHR_materials_dispersion",
    "KHR_materials_emissive_strength",
    "KHR_materials_ior",
    "KHR_materials_iridescence",
    "KHR_materials_pbrSpecularGlossiness",
    "KHR_materials_sheen",
    "KHR_materials_specular",
    "KHR_materials_transmission",
    "KHR_materials_unlit",
    "KHR_materials_variants",
    "KHR_materials_volume",
    "KHR_mesh_quantization",
    "KHR_meshopt_compression",
    "KHR_node_hoverability",
    "KHR_node_selectability",
    "KHR_node_visibility",
    "KHR_techniques_webgl",
    "KHR_texture_basisu",
    "KHR_texture_transform",
    "KHR_xmp",
    "KHR_xmp_json_ld",
];

#[test]
fn the_table_of_extensions_is_true() {
    let page = include_str!("../../../../docs/gltf.md");
    // Other tables of the page name extensions too.
    let section = page.split("\n## ").find(|section| section.starts_with("Extensions")).expect("the table");
    let rows: BTreeMap<&str, &str> = section
        .lines()
        .filter_map(|line| line.strip_prefix("| `")?.split_once("` | "))
        .filter(|(name, _)| name.starts_with("KHR_") || name.starts_with("EXT_"))
        .map(|(name, rest)| (name, rest.split(" | ").nth(1).unwrap_or_default()))
        .collect();
    for (name, state) in &rows {
        assert!(["read", "ignored"].contains(state), "{name} is {state:?}");
        assert_eq!(*state == "read", SUPPORTED.contains(name), "{name} is {state} by docs/gltf.md");
    }
    for name in REGISTRY.iter().chain(&SUPPORTED) {
        assert!(rows.contains_key(name), "docs/gltf.md does not tell of {name}");
    }
}
