//! KHR_materials_variants: the same primitives with other materials, under a name.

use gltf::json::mesh::Primitive;
use serde_json::Value;

use super::{
    document::Document,
    report::{Problem, Report, choose},
};

const NAME: &str = "KHR_materials_variants";

/// The variant called `wanted`, by its name or its number.
pub fn chosen(document: &Document, wanted: Option<&str>, report: &mut Report) -> Option<usize> {
    let names = document.variants.iter().map(|name| Some(name.as_str()));
    match choose(wanted?, "variant", &format!("/extensions/{NAME}/variants"), names) {
        Ok(index) => Some(index),
        Err(problem) => {
            report.error(problem);
            None
        }
    }
}

/// The material of a primitive where `variant` is shown.
pub fn material(primitive: &Primitive, variant: Option<usize>) -> Option<usize> {
    let mapped = variant.and_then(|variant| {
        mappings(primitive).find(|mapping| variants(mapping).any(|v| v == variant)).and_then(of)
    });
    mapped.or(primitive.material.map(|material| material.value()))
}

/// Every material and variant that a primitive's mappings name exists.
pub fn check(document: &Document, report: &mut Report) {
    for (i, mesh) in document.meshes.iter().enumerate() {
        for (j, primitive) in mesh.primitives.iter().enumerate() {
            for (k, mapping) in mappings(primitive).enumerate() {
                let pointer = format!("/meshes/{i}/primitives/{j}/extensions/{NAME}/mappings/{k}");
                match of(mapping) {
                    Some(material) if material < document.materials.len() => {}
                    Some(material) => {
                        let there = document.materials.len();
                        let message = format!("refers to material {material}, but there are {there}");
                        report.error(Problem::new(format!("{pointer}/material"), message));
                    }
                    None => report.error(Problem::new(pointer.clone(), "has no index of a `material`")),
                }
                for (n, variant) in variants(mapping).enumerate() {
                    if variant >= document.variants.len() {
                        let there = document.variants.len();
                        let message = format!("refers to variant {variant}, but there are {there}");
                        report.error(Problem::new(format!("{pointer}/variants/{n}"), message));
                    }
                }
            }
        }
    }
}

fn mappings(primitive: &Primitive) -> impl Iterator<Item = &Value> {
    let extension = primitive.extensions.as_ref().and_then(|e| e.others.get(NAME));
    extension.and_then(|e| e.get("mappings")?.as_array()).into_iter().flatten()
}

fn of(mapping: &Value) -> Option<usize> {
    usize::try_from(mapping.get("material")?.as_u64()?).ok()
}

/// What is no index counts as one that no variant has.
fn variants(mapping: &Value) -> impl Iterator<Item = usize> {
    let list = mapping.get("variants").and_then(Value::as_array);
    list.into_iter().flatten().map(|v| v.as_u64().and_then(|v| usize::try_from(v).ok()).unwrap_or(usize::MAX))
}
