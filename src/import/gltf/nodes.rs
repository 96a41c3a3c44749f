//! The node hierarchy, flattened: which nodes are shown and where.
//!
//! glTF 2.0, sections 3.5.2 and 3.5.3. The default scene, else the first, else (a file without scenes) all root nodes.
//! Transforms are multiplied in f64. KHR_node_visibility hides a node and what is below it; cameras are found all
//! the same.

use glam::{DAffine3, DMat3, DQuat, DVec3};
use gltf::json;

use super::{
    document::Document,
    report::{Counted, Problem, Report},
};

/// A node of the scene. `to_world` may be singular or not finite.
pub struct Placed {
    pub node: usize,
    pub to_world: DAffine3,
    pub visible: bool,
}

/// Index of the light of a node.
pub fn light_index(node: &json::Node) -> Option<usize> {
    Some(node.extensions.as_ref()?.khr_lights_punctual.as_ref()?.light.value())
}

/// The transforms of all nodes to the space of their scene, whatever scene that is.
pub fn globals(document: &Document) -> Vec<DAffine3> {
    let mut globals = vec![DAffine3::IDENTITY; document.nodes.len()];
    let mut stack: Vec<(usize, DAffine3)> =
        orphans(document).into_iter().map(|node| (node, DAffine3::IDENTITY)).collect();
    while let Some((node, parent)) = stack.pop() {
        let (Some(json), Some(global)) = (document.nodes.get(node), globals.get_mut(node)) else { continue };
        *global = parent * local(json);
        stack.extend(json.children.iter().flatten().map(|child| (child.value(), *global)));
    }
    globals
}

/// All nodes of the scene, parents before children, in the order of the file.
pub fn flatten(document: &Document, globals: &[DAffine3], report: &mut Report) -> Vec<Placed> {
    let mut stack: Vec<Placed> = (roots(document, report).into_iter())
        .map(|node| Placed { node, to_world: DAffine3::IDENTITY, visible: true })
        .rev()
        .collect();
    let mut met = vec![false; document.nodes.len()];
    let mut placed = Vec::new();
    while let Some(mut next) = stack.pop() {
        let (Some(json), Some(met)) = (document.nodes.get(next.node), met.get_mut(next.node)) else {
            continue;
        };
        if std::mem::replace(met, true) {
            report.tally.add(Counted::RepeatedNodes, 1, &format!("/nodes/{}", next.node));
            continue;
        }
        next.to_world = globals.get(next.node).copied().unwrap_or(DAffine3::NAN);
        next.visible &= is_visible(json);
        let children = json.children.iter().flatten().rev();
        stack.extend(children.map(|c| Placed {
            node: c.value(),
            to_world: next.to_world,
            visible: next.visible,
        }));
        placed.push(next);
    }
    placed
}

/// The scene that is shown, if there is any.
pub fn shown_scene(document: &Document) -> usize {
    document.scene.unwrap_or(0)
}

fn roots(document: &Document, report: &mut Report) -> Vec<usize> {
    if let Some(scene) = document.scenes.get(shown_scene(document)) {
        return scene.nodes.iter().map(|n| n.value()).collect();
    }
    if !document.nodes.is_empty() {
        report.warn(Problem::new("/scenes", "there is no scene; all nodes are shown"));
    }
    orphans(document)
}

/// The nodes that are no node's child.
fn orphans(document: &Document) -> Vec<usize> {
    let mut is_child = vec![false; document.nodes.len()];
    for child in document.nodes.iter().flat_map(|n| n.children.iter().flatten()) {
        if let Some(child) = is_child.get_mut(child.value()) {
            *child = true;
        }
    }
    is_child.iter().enumerate().filter_map(|(i, child)| (!child).then_some(i)).collect()
}

fn is_visible(node: &json::Node) -> bool {
    let extension = node.extensions.as_ref().and_then(|e| e.others.get("KHR_node_visibility"));
    extension.and_then(|e| e.get("visible")).and_then(serde_json::Value::as_bool).unwrap_or(true)
}

/// T · R · S, or the matrix. A projective matrix is not a transform of glTF and becomes NaN, which is set aside later.
fn local(node: &json::Node) -> DAffine3 {
    if let Some(matrix) = node.matrix {
        let m = matrix.map(f64::from);
        if [m[3], m[7], m[11], m[15]] != [0.0, 0.0, 0.0, 1.0] {
            return DAffine3::NAN;
        }
        let columns = DMat3::from_cols(
            DVec3::new(m[0], m[1], m[2]),
            DVec3::new(m[4], m[5], m[6]),
            DVec3::new(m[8], m[9], m[10]),
        );
        return DAffine3::from_mat3_translation(columns, DVec3::new(m[12], m[13], m[14]));
    }
    let vector = |v: [f32; 3]| DVec3::from(v.map(f64::from));
    let [x, y, z, w] = node.rotation.unwrap_or_default().0.map(f64::from);
    let rotation = DQuat::from_xyzw(x, y, z, w);
    // A quaternion of no length divides by zero: NaN, set aside later.
    let rotation = rotation / rotation.length();
    DAffine3::from_scale_rotation_translation(
        node.scale.map_or(DVec3::ONE, vector),
        rotation,
        node.translation.map_or(DVec3::ZERO, vector),
    )
}
