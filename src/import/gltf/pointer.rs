//! What KHR_animation_pointer points to: the mutable properties of the glTF 2.0 Asset Object Model that are read here.
//!
//! Nodes and meshes are changed in place. Materials, cameras and lights, whose extensions are many, are changed as the JSON
//! that they were, which is then read again: whatever factor a reader knows can be animated.

use std::collections::BTreeMap;

use serde::de::DeserializeOwned;
use serde_json::Value;

use super::{document::Document, report::quoted};

/// Where the elements are that are changed as JSON.
pub const SECTIONS: [&str; 4] = [
    "/materials",
    "/cameras",
    "/extensions/KHR_lights_punctual/lights",
    "/extensions/EXT_lights_image_based/lights",
];

/// What these are called is no number; references must stay those that were checked.
const IMMUTABLE: [&str; 3] = ["index", "texCoord", "name"];

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NodeProperty {
    Translation,
    Rotation,
    Scale,
    Weights,
    Weight(usize),
    Visible,
}

#[derive(Clone, Debug, PartialEq)]
pub enum Target {
    Node(usize, NodeProperty),
    /// All weights of a mesh, or one of them.
    Mesh(usize, Option<usize>),
    /// Pointer of an element of [`SECTIONS`], and the path in it.
    Element(String, Vec<String>),
}

impl Target {
    /// Numbers of a value; `None` where that is not known before it is written.
    pub fn width(&self, document: &Document) -> Option<usize> {
        match self {
            Self::Node(_, NodeProperty::Translation | NodeProperty::Scale) => Some(3),
            Self::Node(_, NodeProperty::Rotation) => Some(4),
            Self::Node(_, NodeProperty::Visible | NodeProperty::Weight(_)) | Self::Mesh(_, Some(_)) => {
                Some(1)
            }
            Self::Node(node, NodeProperty::Weights) => {
                let mesh = document.nodes.get(*node)?.mesh?.value();
                targets(document, mesh)
            }
            Self::Mesh(mesh, None) => targets(document, *mesh),
            Self::Element(..) => None,
        }
    }
}

/// Morph targets of a mesh.
fn targets(document: &Document, mesh: usize) -> Option<usize> {
    let primitive = document.meshes.get(mesh)?.primitives.first()?;
    Some(primitive.targets.as_ref().map_or(0, Vec::len))
}

/// The section and index of an element to be changed as JSON, and the path in it.
pub fn element(pointer: &str) -> Option<(&'static str, usize, Vec<String>)> {
    SECTIONS.iter().find_map(|section| {
        let mut parts = pointer.strip_prefix(section)?.strip_prefix('/')?.split('/');
        let index = parts.next()?.parse().ok()?;
        let path: Vec<_> = parts.map(|part| part.replace("~1", "/").replace("~0", "~")).collect();
        (!path.is_empty()).then_some((*section, index, path))
    })
}

/// What `pointer` points to. The error says why it cannot be animated.
pub fn parse(pointer: &str, document: &Document) -> Result<Target, String> {
    let unknown = || format!("points to {}, which cannot be animated", quoted(pointer));
    if let Some((section, index, path)) = element(pointer) {
        let element = format!("{section}/{index}");
        return match document.animated.contains_key(&element) {
            true => Ok(Target::Element(element, path)),
            false => Err(format!("points to {}, which does not exist", quoted(&element))),
        };
    }
    let parts: Vec<&str> = pointer.strip_prefix('/').unwrap_or_default().split('/').collect();
    let number = |text: &str| text.parse::<usize>().ok();
    let (list, index, rest) = match parts.as_slice() {
        [list, index, rest @ ..] => (*list, number(index).ok_or_else(unknown)?, rest),
        _ => return Err(unknown()),
    };
    // A weight beyond the morph targets would only take memory.
    let weight = |i: &str| number(i).filter(|&i| Some(i) < targets_at(list, index, document));
    let target = match (list, rest) {
        ("nodes", ["translation"]) => Target::Node(index, NodeProperty::Translation),
        ("nodes", ["rotation"]) => Target::Node(index, NodeProperty::Rotation),
        ("nodes", ["scale"]) => Target::Node(index, NodeProperty::Scale),
        ("nodes", ["weights"]) => Target::Node(index, NodeProperty::Weights),
        ("nodes", ["weights", i]) => {
            Target::Node(index, NodeProperty::Weight(weight(i).ok_or_else(unknown)?))
        }
        ("nodes", ["extensions", "KHR_node_visibility", "visible"]) => {
            Target::Node(index, NodeProperty::Visible)
        }
        ("meshes", ["weights"]) => Target::Mesh(index, None),
        ("meshes", ["weights", i]) => Target::Mesh(index, Some(weight(i).ok_or_else(unknown)?)),
        _ => return Err(unknown()),
    };
    let len = if list == "nodes" { document.nodes.len() } else { document.meshes.len() };
    if index >= len {
        return Err(format!("points to {}, which does not exist", quoted(pointer)));
    }
    Ok(target)
}

fn targets_at(list: &str, index: usize, document: &Document) -> Option<usize> {
    match list {
        "nodes" => targets(document, document.nodes.get(index)?.mesh?.value()),
        _ => targets(document, index),
    }
}

/// Elements that were changed, to be read again.
#[derive(Default)]
pub struct Elements(BTreeMap<String, Value>);

impl Elements {
    /// Sets the property at `path` of `element`.
    pub fn set(
        &mut self,
        document: &Document,
        element: &str,
        path: &[String],
        values: &[f32],
    ) -> Result<(), String> {
        let known = document.animated.get(element).ok_or("does not exist")?;
        let changed = self.0.entry(element.to_owned()).or_insert_with(|| known.clone());
        let (last, parents) = path.split_last().ok_or("points to nothing")?;
        let nowhere = || format!("points to {}, which {element} does not have", quoted(&path.join("/")));
        if IMMUTABLE.contains(&last.as_str()) {
            return Err(format!("points to {}, which cannot be animated", quoted(last)));
        }
        let mut at = changed;
        for parent in parents {
            at = at.get_mut(parent).ok_or_else(nowhere)?;
        }
        let object = at.as_object_mut().ok_or_else(nowhere)?;
        let old = object.get(last);
        let value = match values {
            &[one] if old.is_some_and(Value::is_boolean) => Value::Bool(one != 0.0),
            &[one] if !old.is_some_and(Value::is_array) => Value::from(f64::from(one)),
            many => {
                let length = old.and_then(Value::as_array).map(Vec::len);
                if length.is_some_and(|length| length != many.len()) {
                    return Err(format!("has {} values for {} of them", many.len(), quoted(last)));
                }
                many.iter().map(|&v| Value::from(f64::from(v))).collect()
            }
        };
        object.insert(last.clone(), value);
        Ok(())
    }

    /// Reads the elements again. What cannot be read stays as it was, and is returned with the reason.
    pub fn write(self, document: &mut Document) -> Vec<(String, String)> {
        let mut failed = Vec::new();
        for (pointer, value) in self.0 {
            let Some((section, index)) = pointer.rsplit_once('/') else { continue };
            let Ok(index) = index.parse::<usize>() else { continue };
            let written = match section {
                "/materials" => put(&mut document.materials, index, value),
                "/cameras" => put(&mut document.cameras, index, value),
                "/extensions/KHR_lights_punctual/lights" => put(&mut document.lights, index, value),
                _ => put(&mut document.image_lights, index, value),
            };
            failed.extend(written.err().map(|message| (pointer, message)));
        }
        failed
    }
}

fn put<T: DeserializeOwned>(list: &mut [T], index: usize, value: Value) -> Result<(), String> {
    let read = serde_json::from_value(value).map_err(|e| e.to_string())?;
    if let Some(place) = list.get_mut(index) {
        *place = read;
    }
    Ok(())
}
