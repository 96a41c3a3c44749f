//! Animations and inverse bind matrices: what their accessors hold, and what channels drive.
//!
//! glTF 2.0, sections 3.11 "Animations" and 3.7.3.1 "Skins: Overview"; KHR_animation_pointer.

use std::collections::HashMap;

use serde_json::Value;

use super::{
    asset::{Accessor, Asset, extension, index_of, list},
    findings::Findings,
    formats,
};

const POINTER: &str = "KHR_animation_pointer";

pub fn check(asset: Asset, findings: &mut Findings) {
    for (i, skin) in asset.items("skins") {
        let Some(matrices) = asset.accessor(index_of(skin, "inverseBindMatrices")) else { continue };
        let pointer = format!("/skins/{i}/inverseBindMatrices");
        let joints = list(skin.get("joints")).len();
        if matrices.count < joints as u64 {
            let message = format!("has {} matrices for {joints} joints", matrices.count);
            findings.add("skins", pointer.clone(), message);
        }
        format(&matrices, &formats::INVERSE_BIND_MATRICES, pointer, findings);
    }
    for (i, animation) in asset.items("animations") {
        let samplers = list(animation.get("samplers"));
        for (j, sampler) in samplers.iter().enumerate() {
            input(asset, sampler, format!("/animations/{i}/samplers/{j}/input"), findings);
        }
        let mut driven = HashMap::new();
        for (j, channel) in list(animation.get("channels")).iter().enumerate() {
            let Some(target) = channel.get("target") else { continue };
            let at = format!("/animations/{i}/channels/{j}/target");
            let what = pointed(target)
                .map_or_else(|| (target.get("node"), target.get("path")), |pointer| (None, Some(pointer)));
            // A channel without a node drives nothing.
            if what.1.is_some() && (what.0.is_some() || pointed(target).is_some()) {
                let first =
                    *driven.entry((what.0.map(Value::to_string), what.1.map(Value::to_string))).or_insert(j);
                if first != j {
                    let message = format!("is what channel {first} drives already");
                    findings.add("channels that drive the same", at.clone(), message);
                }
            }
            pointer_target(target, &at, findings);
            let targets = node_target(asset, target, &at, findings);
            let index = index_of(channel, "sampler");
            if let Some(sampler) = index.and_then(|index| samplers.get(index)) {
                let pointer = format!("/animations/{i}/channels/{j}/sampler");
                output(asset, sampler, target, targets, pointer, findings);
            }
        }
    }
}

fn format(accessor: &Accessor, allowed: &[&str], pointer: String, findings: &mut Findings) {
    let format = accessor.format();
    if !allowed.is_empty() && !allowed.contains(&format.as_str()) {
        findings.add(
            "accessors' formats",
            pointer,
            format!("has data of {format}, not {}", allowed.join(" or ")),
        );
    }
}

fn is_cubic(sampler: &Value) -> bool {
    sampler.get("interpolation").and_then(Value::as_str) == Some("CUBICSPLINE")
}

fn input(asset: Asset, sampler: &Value, pointer: String, findings: &mut Findings) {
    let Some(input) = asset.accessor(index_of(sampler, "input")) else { return };
    format(&input, &formats::TIMES, pointer.clone(), findings);
    if !input.has_bounds() {
        findings.add("bounds of accessors", pointer.clone(), "has no `min` and `max`, which times must have");
    }
    if is_cubic(sampler) && input.count < 2 {
        findings.add("animations", pointer, "has 1 time, but a cubic spline needs 2 or more");
    }
}

/// What KHR_animation_pointer points to.
fn pointed(target: &Value) -> Option<&Value> {
    extension(target, POINTER)?.get("pointer")
}

fn pointer_target(target: &Value, at: &str, findings: &mut Findings) {
    if extension(target, POINTER).is_none() {
        return;
    }
    if target.get("node").is_some() {
        let message = "is there beside a `node`, which it replaces";
        findings.add("animations", format!("{at}/extensions/{POINTER}"), message);
    }
    if target.get("path").and_then(Value::as_str).is_some_and(|path| path != "pointer") {
        let message = "asks for a `path` of \"pointer\"";
        findings.add("animations", format!("{at}/extensions/{POINTER}"), message);
    }
}

/// Morph targets of the node that `target` drives.
fn node_target(asset: Asset, target: &Value, at: &str, findings: &mut Findings) -> u64 {
    let Some(node) = asset.item("nodes", index_of(target, "node")) else { return 0 };
    let primitives = asset.item("meshes", index_of(node, "mesh")).and_then(|mesh| mesh.get("primitives"));
    let targets = list(primitives).first().map_or(0, |primitive| list(primitive.get("targets")).len());
    match target.get("path").and_then(Value::as_str) {
        Some("translation" | "rotation" | "scale") if node.get("matrix").is_some() => {
            findings.add("animations", at, "has a node with a `matrix`, which cannot be animated");
        }
        Some("weights") if targets == 0 => {
            findings.add("animations", at, "has a node whose mesh has no morph targets");
        }
        _ => {}
    }
    targets as u64
}

/// The values of a sampler for what a channel drives.
fn output(
    asset: Asset,
    sampler: &Value,
    target: &Value,
    targets: u64,
    pointer: String,
    findings: &mut Findings,
) {
    let path = target.get("path").and_then(Value::as_str).unwrap_or("");
    let Some(output) = asset.accessor(index_of(sampler, "output")) else { return };
    format(&output, formats::animated(path), pointer.clone(), findings);
    let Some(input) = asset.accessor(index_of(sampler, "input")) else { return };
    let each = match path {
        "weights" if targets > 0 => targets,
        "translation" | "rotation" | "scale" => 1,
        _ => return,
    };
    let expected = input.count.saturating_mul(each).saturating_mul(if is_cubic(sampler) { 3 } else { 1 });
    if output.count != expected {
        let message = format!("has {} values, not {expected}", output.count);
        findings.add("animations", pointer, message);
    }
}
