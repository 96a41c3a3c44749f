//! Which extensions are read. A required one that is not is an error, an optional one a warning.

use std::collections::{BTreeMap, BTreeSet};

use serde_json::{Map, Value};

use super::report::{Problem, Report, quoted};

/// Extensions whose content the importer understands.
pub const SUPPORTED: [&str; 26] = [
    "EXT_lights_image_based",
    "EXT_mesh_gpu_instancing",
    "EXT_meshopt_compression",
    "EXT_texture_webp",
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
    "KHR_node_visibility",
    "KHR_texture_basisu",
    "KHR_texture_transform",
];

/// Drops the members of an `extensions` object that are not read, and notes their names in `met`.
pub fn retain_supported(extensions: &mut Map<String, Value>, met: &mut BTreeSet<String>) {
    extensions.retain(|name, _| {
        let keep = SUPPORTED.contains(&name.as_str());
        if !keep && !met.contains(name) {
            met.insert(name.clone());
        }
        keep
    });
}

/// Reports what the file asks for, or uses (`met`), and is not read. Returns all that are used, and whether they are required.
pub fn check(
    root: &Map<String, Value>,
    met: &BTreeSet<String>,
    report: &mut Report,
) -> BTreeMap<String, bool> {
    let required = names(root, "extensionsRequired");
    for (i, name) in required.iter().enumerate() {
        if !SUPPORTED.contains(name) {
            report.error(
                Problem::new(
                    format!("/extensionsRequired/{i}"),
                    format!("the file needs the extension {}, which is not supported", quoted(name)),
                )
                .help("export the asset again without this extension"),
            );
        }
    }
    let all =
        met.iter().map(String::as_str).chain(names(root, "extensionsUsed")).chain(required.iter().copied());
    let all = all.map(|name| (name.to_owned(), required.contains(&name))).collect();
    let mut optional: BTreeSet<&str> = met.iter().map(String::as_str).collect();
    optional.extend(names(root, "extensionsUsed"));
    for name in optional {
        if !SUPPORTED.contains(&name) && !required.contains(&name) {
            let message = format!("the extension {} is not supported and is ignored", quoted(name));
            report.warn(Problem::new("/extensionsUsed", message));
        }
    }
    all
}

fn names<'a>(root: &'a Map<String, Value>, key: &str) -> Vec<&'a str> {
    let list = root.get(key).and_then(Value::as_array);
    list.into_iter().flatten().filter_map(Value::as_str).collect()
}
