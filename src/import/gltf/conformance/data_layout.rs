//! Buffers, views and accessors by what they say of themselves: alignment, strides, bounds, sparse parts.
//!
//! glTF 2.0, section 3.6.2.4 "Data Alignment": an accessor begins, in its view and in the buffer, at a multiple of the size of
//! its components; columns of matrices at multiples of 4.

use serde_json::Value;

use super::{
    asset::{Accessor, Asset, component_size, index_of, list, whole},
    findings::Findings,
    uris,
};
use crate::import::gltf::report::quoted;

pub fn check(asset: Asset, findings: &mut Findings) {
    for (i, buffer) in asset.items("buffers") {
        let uri = buffer.get("uri").and_then(Value::as_str);
        if let Some(Ok(kind)) = uri.and_then(uris::media_type)
            && !["application/octet-stream", "application/gltf-buffer"].contains(&kind)
        {
            let message = format!("is data of type {}, not application/octet-stream", quoted(kind));
            findings.add("types of data URIs", format!("/buffers/{i}/uri"), message);
        }
    }
    for (i, view) in asset.items("bufferViews") {
        let Some(stride) = view.get("byteStride").and_then(whole) else { continue };
        let pointer = || format!("/bufferViews/{i}/byteStride");
        if let Some(length) = view.get("byteLength").and_then(whole).filter(|length| stride > *length) {
            findings.add(
                "strides",
                pointer(),
                format!("is {stride}, more than the {length} bytes there are"),
            );
        }
        if view.get("target").and_then(whole).is_some_and(|target| target != super::usage::VERTICES) {
            findings.add("strides", pointer(), "is only for vertex attributes, which this view is not");
        }
    }
    for (i, json) in asset.items("accessors") {
        if let Some(accessor) = asset.accessor(Some(i)) {
            own_layout(i, &accessor, findings);
            bounds(i, &accessor, findings);
            if let Some(sparse) = json.get("sparse") {
                substitutions(asset, i, &accessor, sparse, findings);
            }
        }
    }
}

fn own_layout(i: usize, accessor: &Accessor, findings: &mut Findings) {
    let Accessor { component, component_size: size, offset, .. } = *accessor;
    if accessor.normalized && ["u32", "f32"].contains(&component) {
        let message = format!("is true, but {component} cannot be normalized");
        findings.add("accessors' formats", format!("/accessors/{i}/normalized"), message);
    }
    let unit = if accessor.is_matrix() { size.max(4) } else { size };
    if !offset.is_multiple_of(unit) {
        let message = format!("is {offset}, not a multiple of {unit}");
        findings.add("alignment", format!("/accessors/{i}/byteOffset"), message);
    } else if !accessor.total_offset().is_multiple_of(size) {
        let message =
            format!("begins at byte {} of its buffer, not at a multiple of {size}", accessor.total_offset());
        findings.add("alignment", format!("/accessors/{i}"), message);
    }
}

/// `min` and `max`: as many as there are components, and values of their type.
fn bounds(i: usize, accessor: &Accessor, findings: &mut Findings) {
    for key in ["min", "max"] {
        let Some(value) = accessor.json.get(key) else { continue };
        let values = list(Some(value));
        let pointer = format!("/accessors/{i}/{key}");
        if values.len() != accessor.components() && accessor.components() > 0 {
            let message = format!("has {} elements, not {}", values.len(), accessor.components());
            findings.add("lengths of arrays", pointer, message);
            continue;
        }
        for (c, value) in values.iter().enumerate() {
            let Some(number) = value.as_f64() else { continue };
            let (low, high) = match accessor.component {
                "i8" => (-128.0, 127.0),
                "u8" => (0.0, 255.0),
                "i16" => (-32768.0, 32767.0),
                "u16" => (0.0, 65535.0),
                "u32" => (0.0, 4_294_967_295.0),
                _ => (f64::NEG_INFINITY, f64::INFINITY),
            };
            let is_of_type = (low..=high).contains(&number) && (low.is_infinite() || number.fract() == 0.0);
            if !is_of_type {
                let message = format!("is {number}, not a value of {}", accessor.component);
                findings.add("bounds of accessors", format!("{pointer}/{c}"), message);
            }
        }
    }
}

fn substitutions(asset: Asset, i: usize, accessor: &Accessor, sparse: &Value, findings: &mut Findings) {
    let at = |rest: &str| format!("/accessors/{i}/sparse{rest}");
    if let Some(count) = sparse.get("count").and_then(whole).filter(|count| *count > accessor.count) {
        let message = format!("is {count}, more than the {} elements there are", accessor.count);
        findings.add("sparse accessors", at("/count"), message);
    }
    let index_size = sparse.get("indices").and_then(|indices| indices.get("componentType")).and_then(whole);
    for (part, size) in
        [("indices", index_size.and_then(component_size)), ("values", Some(accessor.component_size))]
    {
        let (Some(json), Some(size)) = (sparse.get(part), size) else { continue };
        let offset = json.get("byteOffset").and_then(whole).unwrap_or(0);
        let Some(view) = asset.item("bufferViews", index_of(json, "bufferView")) else { continue };
        let total = view.get("byteOffset").and_then(whole).unwrap_or(0).saturating_add(offset);
        if !offset.is_multiple_of(size) {
            let message = format!("is {offset}, not a multiple of {size}");
            findings.add("alignment", at(&format!("/{part}/byteOffset")), message);
        } else if !total.is_multiple_of(size) {
            let message = format!("begins at byte {total} of its buffer, not at a multiple of {size}");
            findings.add("alignment", at(&format!("/{part}")), message);
        }
    }
}
