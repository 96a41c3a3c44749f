//! What of the placed nodes is drawn: primitives of triangles, with their places.

use std::{collections::BTreeSet, sync::Arc};

use glam::{Affine3A, DAffine3};
use gltf::json::{self, mesh::Mode, validation::Checked};

use super::{
    accessor::Source,
    instancing, mesh,
    nodes::Placed,
    report::{Counted, Problem, Report},
    skin,
    topology::Topology,
    variants,
};

/// Instances of a file: nodes times primitives of their meshes.
const MAX_INSTANCES: usize = 1 << 22;

/// A primitive of triangles at a node (an index into the placed nodes).
pub struct Shape {
    pub placed: usize,
    /// Where it is, unless it is skinned; several places are instances.
    pub places: Arc<[Affine3A]>,
    pub skin: Option<usize>,
    pub mesh: usize,
    pub primitive: usize,
    pub topology: Topology,
    pub material: Option<usize>,
}

/// Every primitive that is shown, with those that are not counted.
pub fn shapes(
    source: &Source,
    placed: &[Placed],
    variant: Option<usize>,
    report: &mut Report,
) -> Option<Vec<Shape>> {
    let mut shapes = Vec::new();
    let mut met = BTreeSet::new();
    let mut instances = 0usize;
    let unmoved: Arc<[Affine3A]> = Arc::new([Affine3A::IDENTITY]);
    for (p, node) in placed.iter().enumerate().filter(|(_, node)| node.visible) {
        let Some(json) = source.document.nodes.get(node.node) else { continue };
        let Some(mesh) = json.mesh.map(|m| m.value()) else { continue };
        let places = places(source, node, json, report);
        let first_time = met.insert(mesh);
        let primitives = source.document.meshes.get(mesh).map_or(&[][..], |m| &m.primitives);
        for (i, primitive) in primitives.iter().enumerate() {
            let Checked::Valid(mode) = primitive.mode else { continue };
            let material = variants::material(primitive, variant);
            let skin = json.skin.map(|s| s.value()).filter(|_| !skin::sets(primitive).is_empty());
            let places = if skin.is_some() { unmoved.clone() } else { places.clone() };
            if places.is_empty() {
                continue;
            }
            match Topology::of(mode) {
                Some(_) if !mesh::has_data(source, primitive) => {
                    report.tally.add(Counted::NoData, 1, &format!("/meshes/{mesh}/primitives/{i}"));
                }
                Some(topology) => {
                    instances = instances.saturating_add(places.len());
                    shapes.push(Shape { placed: p, places, skin, mesh, primitive: i, topology, material });
                }
                None if first_time => {
                    let what = if mode == Mode::Points { Counted::Points } else { Counted::Lines };
                    report.tally.add(what, 1, &format!("/meshes/{mesh}/primitives/{i}"));
                }
                None => {}
            }
        }
        if instances > MAX_INSTANCES {
            report.error(Problem::new("/nodes", format!("more than {MAX_INSTANCES} instances are not read")));
            return None;
        }
    }
    Some(shapes)
}

/// Where the mesh of a node is, each place invertible; those that are not are counted.
fn places(source: &Source, node: &Placed, json: &json::Node, report: &mut Report) -> Arc<[Affine3A]> {
    let pointer = format!("/nodes/{}", node.node);
    let instances = match instancing::transforms(source, json, node.node, MAX_INSTANCES) {
        Ok(instances) => instances,
        Err(problem) => {
            report.error(problem);
            None
        }
    };
    let Some(instances) = instances else {
        let place = to_single(&node.to_world);
        // A skinned mesh does not care.
        let lost = place.is_none() && json.skin.is_none();
        report.tally.add(Counted::SingularNodes, lost.into(), &pointer);
        return place.into_iter().collect();
    };
    let places: Vec<_> = instances.iter().filter_map(|i| to_single(&(node.to_world * *i))).collect();
    report.tally.add(Counted::SingularInstances, instances.len() - places.len(), &pointer);
    places.into()
}

/// In f32, if it is invertible there.
fn to_single(to_world: &DAffine3) -> Option<Affine3A> {
    let single = to_world.as_affine3a();
    (single.is_finite() && single.inverse().is_finite()).then_some(single)
}
