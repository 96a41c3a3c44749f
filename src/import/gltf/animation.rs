//! Animations, at one time: what channels make of nodes, and of anything that KHR_animation_pointer may point to.
//!
//! glTF 2.0, section 3.11 "Animations" and appendix C "Animation Sampler Interpolation Modes". Before the first key and after
//! the last, the nearest holds. Every channel of the animation replaces the value that the document has; after that
//! there is no animation left, and the rest of the importer reads a document at rest.

use gltf::json;
use serde::Deserialize;
use serde_json::{Map, Value};

use super::{
    accessor::Source,
    curve::{Curve, Interpolation, Kind},
    document::Document,
    pointer::{self, NodeProperty, Target},
    report::{Problem, Report, choose, quoted},
};
use crate::scene::Selection;

pub const POINTER: &str = "KHR_animation_pointer";

#[derive(Clone, Debug, Deserialize)]
pub struct Animation {
    pub name: Option<String>,
    pub channels: Vec<Channel>,
    pub samplers: Vec<Sampler>,
}

#[derive(Clone, Debug, Deserialize)]
pub struct Channel {
    pub sampler: usize,
    pub target: ChannelTarget,
}

#[derive(Clone, Debug, Deserialize)]
pub struct ChannelTarget {
    pub node: Option<usize>,
    pub path: String,
    #[serde(default)]
    pub extensions: Map<String, Value>,
}

#[derive(Clone, Debug, Deserialize)]
pub struct Sampler {
    pub input: usize,
    pub output: usize,
    pub interpolation: Option<String>,
}

impl ChannelTarget {
    /// The JSON pointer of KHR_animation_pointer.
    pub fn pointer(&self) -> Option<&str> {
        self.extensions.get(POINTER)?.get("pointer")?.as_str()
    }
}

/// A value that a channel gives to what it targets.
pub struct Change {
    /// The channel's, for messages.
    pointer: String,
    target: Target,
    values: Vec<f32>,
}

/// What the animation of `selection` makes of the document at its time; nothing where none is asked for.
pub fn changes(source: &Source, selection: &Selection, report: &mut Report) -> Vec<Change> {
    let animations = &source.document.animations;
    let index = match &selection.animation {
        Some(name) => {
            let names = animations.iter().map(|a| a.name.as_deref());
            match choose(name, "animation", "/animations", names) {
                Ok(index) => index,
                Err(problem) => {
                    report.error(problem);
                    return Vec::new();
                }
            }
        }
        None if selection.at.is_some() && !animations.is_empty() => {
            if animations.len() > 1 {
                let first = animations.first().and_then(|a| a.name.as_deref()).unwrap_or_default();
                let message =
                    format!("of {} animations the first, {}, is shown", animations.len(), quoted(first));
                report.warn(Problem::new("/animations", message).help("name another with `animation`"));
            }
            0
        }
        None if selection.at.is_some() => {
            report.error(
                Problem::new("", "has no animation that could be shown at a time").help("leave `at` out"),
            );
            return Vec::new();
        }
        None => return Vec::new(),
    };
    let at = selection.at.unwrap_or(0.0);
    let Some(animation) = animations.get(index) else { return Vec::new() };
    let [start, end] = animation.range(source);
    if !(start..=end).contains(&at) && selection.at.is_some() {
        let message = format!("lasts from {start} s to {end} s: at {at} s its nearest pose is shown");
        report.warn(Problem::new(format!("/animations/{index}"), message));
    }
    let mut changes = Vec::new();
    for (c, channel) in animation.channels.iter().enumerate() {
        let place = format!("/animations/{index}/channels/{c}");
        let target = match target(channel, source.document) {
            Ok(Some(target)) => target,
            // A channel without target is to be ignored.
            Ok(None) => continue,
            Err(message) => {
                report.warn(Problem::new(place + "/target", format!("{message}; the channel is ignored")));
                continue;
            }
        };
        let sampler = format!("/animations/{index}/samplers/{}", channel.sampler);
        match values(source, animation, channel, &target, at) {
            Ok(values) => changes.push(Change { pointer: place, target, values }),
            Err((key, message)) => report.error(Problem::new(sampler + key, message)),
        }
    }
    changes
}

impl Animation {
    /// Seconds from the first key of all channels to the last.
    pub fn range(&self, source: &Source) -> [f32; 2] {
        let curves = self.samplers.iter().filter_map(|sampler| {
            // Only the times matter here.
            Curve::new(source, sampler.input, sampler.input, Interpolation::Step).ok()
        });
        let ranges = curves.map(|curve| curve.range());
        ranges.reduce(|all, one| [all[0].min(one[0]), all[1].max(one[1])]).unwrap_or([0.0; 2])
    }
}

fn target(channel: &Channel, document: &Document) -> Result<Option<Target>, String> {
    if channel.target.path == "pointer" {
        return match channel.target.pointer() {
            Some(pointer) => pointer::parse(pointer, document).map(Some),
            None => Err("has no pointer".into()),
        };
    }
    let Some(node) = channel.target.node else { return Ok(None) };
    let property = match channel.target.path.as_str() {
        "translation" => NodeProperty::Translation,
        "rotation" => NodeProperty::Rotation,
        "scale" => NodeProperty::Scale,
        "weights" => NodeProperty::Weights,
        other => return Err(format!("has the path {}, which is not known", quoted(other))),
    };
    Ok(Some(Target::Node(node, property)))
}

/// The error has the key of the sampler that is wrong.
fn values(
    source: &Source,
    animation: &Animation,
    channel: &Channel,
    target: &Target,
    at: f32,
) -> Result<Vec<f32>, (&'static str, String)> {
    let sampler = animation.samplers.get(channel.sampler);
    let sampler = sampler.ok_or_else(|| ("", "does not exist".to_owned()))?;
    let interpolation = match sampler.interpolation.as_deref() {
        None | Some("LINEAR") => Interpolation::Linear,
        Some("STEP") => Interpolation::Step,
        Some("CUBICSPLINE") => Interpolation::Cubic,
        Some(other) => {
            return Err(("/interpolation", format!("is {}, not LINEAR, STEP or CUBICSPLINE", quoted(other))));
        }
    };
    let kind =
        if matches!(target, Target::Node(_, NodeProperty::Rotation)) { Kind::Rotation } else { Kind::Plain };
    let curve = Curve::new(source, sampler.input, sampler.output, interpolation)?;
    let (found, expected) = (curve.width(), target.width(source.document));
    if let Some(expected) = expected.filter(|&expected| expected != found) {
        return Err(("/output", format!("has {found} values for each key, but {expected} are animated")));
    }
    let values = curve.at(at, kind);
    if !values.iter().all(|value| value.is_finite()) {
        return Err(("/output", format!("is not finite at {at} s")));
    }
    Ok(values)
}

/// Writes `changes` into `document`.
pub fn apply(document: &mut Document, changes: Vec<Change>, report: &mut Report) {
    let mut elements = pointer::Elements::default();
    let mut nodes = Vec::new();
    for change in changes {
        match change.target {
            Target::Node(node, property) => nodes.push((node, property, change)),
            Target::Mesh(mesh, ref which) => {
                if let Some(mesh) = document.meshes.get_mut(mesh) {
                    set_weights(mesh.weights.get_or_insert_default(), *which, &change.values);
                }
            }
            Target::Element(ref element, ref path) => {
                if let Err(message) = elements.set(document, element, path, &change.values) {
                    let message = format!("{message}; the channel is ignored");
                    report.warn(Problem::new(change.pointer + "/target", message));
                }
            }
        }
    }
    for (element, message) in elements.write(document) {
        report.warn(Problem::new(element, format!("cannot be animated in this way: {message}")));
    }
    for (index, property, change) in nodes {
        let inherited = document.nodes.get(index).and_then(|node| node.mesh).map(|mesh| mesh.value());
        let inherited = inherited.and_then(|mesh| document.meshes.get(mesh)?.weights.clone());
        let Some(node) = document.nodes.get_mut(index) else { continue };
        if let Err(message) = set(node, property, &change.values, inherited) {
            report
                .warn(Problem::new(change.pointer + "/target", format!("{message}; the channel is ignored")));
        }
    }
}

/// `inherited`: the weights of the mesh, which the node has while it has none of its own.
fn set(
    node: &mut json::Node,
    property: NodeProperty,
    values: &[f32],
    inherited: Option<Vec<f32>>,
) -> Result<(), String> {
    let moves = matches!(property, NodeProperty::Translation | NodeProperty::Rotation | NodeProperty::Scale);
    if moves && node.matrix.is_some() {
        return Err("moves a node that has a matrix".into());
    }
    match (property, values) {
        (NodeProperty::Translation, &[x, y, z]) => node.translation = Some([x, y, z]),
        (NodeProperty::Scale, &[x, y, z]) => node.scale = Some([x, y, z]),
        (NodeProperty::Rotation, &[x, y, z, w]) => {
            node.rotation = Some(json::scene::UnitQuaternion([x, y, z, w]));
        }
        (NodeProperty::Weights, values) => node.weights = Some(values.to_vec()),
        (NodeProperty::Weight(i), values) => {
            set_weights(node.weights.get_or_insert_with(|| inherited.unwrap_or_default()), Some(i), values);
        }
        (NodeProperty::Visible, &[visible]) => {
            let extensions = node.extensions.as_mut().map(|e| &mut e.others);
            let extension = extensions.and_then(|e| e.get_mut("KHR_node_visibility"));
            let object = extension.and_then(Value::as_object_mut);
            let object = object.ok_or("points to a visibility that the node does not have")?;
            object.insert("visible".into(), (visible != 0.0).into());
        }
        _ => return Err("has another number of values".into()),
    }
    Ok(())
}

/// All weights, or one of them.
fn set_weights(weights: &mut Vec<f32>, which: Option<usize>, values: &[f32]) {
    match which {
        None => *weights = values.to_vec(),
        Some(i) => {
            if weights.len() <= i {
                weights.resize(i + 1, 0.0);
            }
            if let (Some(weight), Some(value)) = (weights.get_mut(i), values.first()) {
                *weight = *value;
            }
        }
    }
}
