//! Small assets made in memory, through the importer without its last guard: a panic fails the test.

mod compressed;
mod conformance;
mod containers;
mod data;
mod fuzz;
mod geometry;
mod layers;
mod moving;
mod posed;
mod scene;
mod surfaces;
mod table;

use std::{collections::BTreeSet, path::Path};

use base64::{Engine, prelude::BASE64_STANDARD};
use serde_json::{Value, json};

use crate::{
    diagnostic::{Diagnostic, Place, Severity},
    scene::Selection,
    world::{Mesh, Model},
};

type Outcome = Result<Model, Vec<Diagnostic>>;

/// Imports text as if it were `asset.gltf` in the current folder.
fn import_text(text: &str) -> Outcome {
    super::import(text.as_bytes(), Path::new("asset.gltf"), &Selection::default())
}

/// Imports what `selection` says of it.
fn import_selected(asset: &Value, selection: &Selection) -> Outcome {
    let asset = declaring(asset);
    super::import(asset.to_string().as_bytes(), Path::new("asset.gltf"), selection)
}

fn import(asset: &Value) -> Outcome {
    import_text(&declaring(asset).to_string())
}

/// `asset` with all its extensions declared, unless it declares some itself.
fn declaring(asset: &Value) -> Value {
    fn names<'a>(value: &'a Value, found: &mut BTreeSet<&'a str>) {
        if let Some(extensions) = value.get("extensions").and_then(Value::as_object) {
            found.extend(extensions.keys().map(String::as_str));
        }
        let members = value.as_object().into_iter().flat_map(|members| members.values());
        members.chain(value.as_array().into_iter().flatten()).for_each(|inner| names(inner, found));
    }
    let mut found = BTreeSet::new();
    names(asset, &mut found);
    let mut declaring = asset.clone();
    if !found.is_empty() && asset.get("extensionsUsed").is_none() {
        declaring["extensionsUsed"] = json!(found);
    }
    declaring
}

fn model(asset: &Value) -> Model {
    import(asset).unwrap_or_else(|e| panic!("{e:#?}"))
}

/// The only mesh of an asset.
fn mesh(asset: &Value) -> Mesh {
    let mut model = model(asset);
    assert_eq!(model.meshes.len(), 1);
    model.meshes.remove(0)
}

/// Asserts that `asset` is refused with an error at `pointer` that mentions `text`.
fn refused(asset: &Value, pointer: &str, text: &str) {
    let diagnostics = import(asset).expect_err("an asset that must be refused");
    let found = diagnostics
        .iter()
        .any(|d| d.severity == Severity::Error && d.message.contains(text) && place(d) == pointer);
    assert!(found, "no error at {pointer} with {text:?} in {diagnostics:#?}");
}

/// Asserts that `asset` loads with a warning that mentions `text`.
fn warned(asset: &Value, text: &str) -> Model {
    let model = model(asset);
    assert!(model.warnings.iter().any(|w| w.message.contains(text)), "no {text:?} in {:#?}", model.warnings);
    model
}

fn place(diagnostic: &Diagnostic) -> &str {
    match &diagnostic.place {
        Place::Pointer(pointer) => pointer,
        _ => "",
    }
}

fn data_uri(bytes: &[u8]) -> String {
    let kind = if bytes.starts_with(b"\x89PNG") { "image/png" } else { "application/octet-stream" };
    format!("data:{kind};base64,{}", BASE64_STANDARD.encode(bytes))
}

/// Appends to an array of the document.
fn push(array: &mut Value, item: Value) {
    array.as_array_mut().unwrap().push(item);
}

/// Little-endian bytes of floats or integers.
macro_rules! le {
    ($($value:expr),* $(,)?) => {{
        let mut bytes: Vec<u8> = Vec::new();
        $(bytes.extend_from_slice(&$value.to_le_bytes());)*
        bytes
    }};
}
use le;

fn floats(values: &[f32]) -> Vec<u8> {
    values.iter().flat_map(|v| v.to_le_bytes()).collect()
}

/// Corners of the unit square in the plane z = 0: (0,0), (1,0), (0,1), (1,1).
const SQUARE: [f32; 12] = [0., 0., 0., 1., 0., 0., 0., 1., 0., 1., 1., 0.];

/// An asset with one node, one mesh and one primitive over `views`: each view is its own buffer, each accessor
/// (`(view, componentType, type, count)`) begins at its view.
fn asset(views: &[Vec<u8>], accessors: &[(usize, u32, &str, usize)], primitive: Value) -> Value {
    json!({
        "asset": { "version": "2.0" },
        "scene": 0,
        "scenes": [{ "nodes": [0] }],
        "nodes": [{ "mesh": 0 }],
        "meshes": [{ "primitives": [primitive] }],
        "buffers": views.iter().map(|v| json!({ "byteLength": v.len(), "uri": data_uri(v) })).collect::<Vec<_>>(),
        "bufferViews": views.iter().enumerate()
            .map(|(i, v)| json!({ "buffer": i, "byteLength": v.len() })).collect::<Vec<_>>(),
        "accessors": accessors.iter()
            .map(|(view, component, shape, count)| bounded(json!({
                "bufferView": view, "componentType": component, "type": shape, "count": count,
            }), &views[*view])).collect::<Vec<_>>(),
    })
}

/// Gives an accessor from the beginning of `bytes` its bounds, if it holds floats that are there.
fn bounded(mut accessor: Value, bytes: &[u8]) -> Value {
    let components = match accessor["type"].as_str() {
        Some("SCALAR") => 1,
        Some("VEC2") => 2,
        Some("VEC3") => 3,
        Some("VEC4") => 4,
        _ => return accessor,
    };
    let count = accessor["count"].as_u64().unwrap() as usize;
    let values: Vec<f32> = bytes.as_chunks::<4>().0.iter().map(|b| f32::from_le_bytes(*b)).collect();
    let Some(values) = values.get(..count * components).filter(|v| v.iter().all(|v| v.is_finite())) else {
        return accessor;
    };
    if accessor["componentType"] == F32 && count > 0 {
        let column = |c: usize| values.iter().copied().skip(c).step_by(components);
        accessor["min"] = (0..components).map(|c| column(c).fold(f32::INFINITY, f32::min)).collect();
        accessor["max"] = (0..components).map(|c| column(c).fold(f32::NEG_INFINITY, f32::max)).collect();
    }
    accessor
}

const U8: u32 = 5121;
const I8: u32 = 5120;
const U16: u32 = 5123;
const I16: u32 = 5122;
const U32: u32 = 5125;
const F32: u32 = 5126;

/// The square as two indexed triangles.
fn square() -> Value {
    asset(
        &[floats(&SQUARE), le![0u16, 1u16, 2u16, 2u16, 1u16, 3u16]],
        &[(0, F32, "VEC3", 4), (1, U16, "SCALAR", 6)],
        json!({ "attributes": { "POSITION": 0 }, "indices": 1 }),
    )
}

/// Wraps JSON and a BIN chunk as GLB, padded to 4 bytes as the format asks.
fn glb(json: &Value, bin: &[u8]) -> Vec<u8> {
    let mut json = json.to_string().into_bytes();
    json.resize(json.len().next_multiple_of(4), b' ');
    let mut bin = bin.to_vec();
    bin.resize(bin.len().next_multiple_of(4), 0);
    let length = 12 + 8 + json.len() + 8 + bin.len();
    let mut bytes = b"glTF".to_vec();
    bytes.extend(le![2u32, length as u32, json.len() as u32]);
    bytes.extend(b"JSON");
    bytes.extend(&json);
    bytes.extend(le![bin.len() as u32]);
    bytes.extend(b"BIN\0");
    bytes.extend(&bin);
    bytes
}
