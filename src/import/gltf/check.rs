//! Every reference from one element of the document to another, and the shape of the node hierarchy.
//!
//! glTF 2.0, section 3.5.2 "Node Hierarchy": nodes are a set of strict trees. After this check an index that the rest of the
//! importer follows exists, no node has two parents and none is its own ancestor.

use gltf::json::validation::Checked;

use super::{
    document::Document,
    ibl,
    material::slots,
    nodes,
    report::{Problem, Report},
    textures::{NO_SOURCE, extension_sources},
    variants,
};

/// Checks references by value against the number of elements there are.
struct References<'a> {
    report: &'a mut Report,
}

impl References<'_> {
    fn check(&mut self, index: usize, len: usize, what: &str, pointer: impl FnOnce() -> String) {
        if index >= len {
            let there = if len == 1 { "is" } else { "are" };
            let message = format!("refers to {what} {index}, but there {there} {len}");
            self.report.error(Problem::new(pointer(), message));
        }
    }
}

pub fn references(document: &Document, report: &mut Report) {
    let mut references = References { report };
    scenes(document, &mut references);
    skins(document, &mut references);
    animations(document, &mut references);
    image_lights(document, &mut references);
    meshes(document, &mut references);
    materials(document, &mut references);
    data(document, &mut references);
    variants::check(document, report);
    hierarchy(document, report);
}

fn scenes(document: &Document, references: &mut References) {
    if let Some(scene) = document.scene {
        references.check(scene, document.scenes.len(), "scene", || "/scene".into());
    }
    let nodes = document.nodes.len();
    for (i, scene) in document.scenes.iter().enumerate() {
        for (j, node) in scene.nodes.iter().enumerate() {
            references.check(node.value(), nodes, "node", || format!("/scenes/{i}/nodes/{j}"));
        }
    }
    for (i, node) in document.nodes.iter().enumerate() {
        for (j, child) in node.children.iter().flatten().enumerate() {
            references.check(child.value(), nodes, "node", || format!("/nodes/{i}/children/{j}"));
        }
        if let Some(mesh) = node.mesh {
            references.check(mesh.value(), document.meshes.len(), "mesh", || format!("/nodes/{i}/mesh"));
        }
        if let Some(camera) = node.camera {
            references
                .check(camera.value(), document.cameras.len(), "camera", || format!("/nodes/{i}/camera"));
        }
        if let Some(skin) = node.skin {
            references.check(skin.value(), document.skins.len(), "skin", || format!("/nodes/{i}/skin"));
        }
        if let Some(light) = nodes::light_index(node) {
            references.check(light, document.lights.len(), "light", || {
                format!("/nodes/{i}/extensions/KHR_lights_punctual/light")
            });
        }
    }
}

fn skins(document: &Document, references: &mut References) {
    for (i, skin) in document.skins.iter().enumerate() {
        if skin.joints.is_empty() {
            references.report.error(Problem::new(format!("/skins/{i}/joints"), "is empty"));
        }
        for (j, joint) in skin.joints.iter().enumerate() {
            references
                .check(joint.value(), document.nodes.len(), "node", || format!("/skins/{i}/joints/{j}"));
        }
        if let Some(skeleton) = skin.skeleton {
            references
                .check(skeleton.value(), document.nodes.len(), "node", || format!("/skins/{i}/skeleton"));
        }
        if let Some(matrices) = skin.inverse_bind_matrices {
            references.check(matrices.value(), document.accessors.len(), "accessor", || {
                format!("/skins/{i}/inverseBindMatrices")
            });
        }
    }
}

fn animations(document: &Document, references: &mut References) {
    let accessors = document.accessors.len();
    for (i, animation) in document.animations.iter().enumerate() {
        for (j, sampler) in animation.samplers.iter().enumerate() {
            for (name, index) in [("input", sampler.input), ("output", sampler.output)] {
                references
                    .check(index, accessors, "accessor", || format!("/animations/{i}/samplers/{j}/{name}"));
            }
        }
        for (j, channel) in animation.channels.iter().enumerate() {
            let at = |rest: &str| format!("/animations/{i}/channels/{j}/{rest}");
            references.check(channel.sampler, animation.samplers.len(), "sampler", || at("sampler"));
            if let Some(node) = channel.target.node {
                references.check(node, document.nodes.len(), "node", || at("target/node"));
            }
        }
    }
}

fn image_lights(document: &Document, references: &mut References) {
    for i in 0..document.scenes.len() {
        if let Some(light) = ibl::index(document, i) {
            references.check(light, document.image_lights.len(), "light", || {
                format!("/scenes/{i}/extensions/{}/light", ibl::NAME)
            });
        }
    }
    for (i, light) in document.image_lights.iter().enumerate() {
        for (j, faces) in light.specular_images.iter().enumerate() {
            for (k, &image) in faces.iter().enumerate() {
                references.check(image, document.images.len(), "image", || {
                    format!("/extensions/{}/lights/{i}/specularImages/{j}/{k}", ibl::NAME)
                });
            }
        }
    }
}

fn meshes(document: &Document, references: &mut References) {
    let accessors = document.accessors.len();
    for (i, mesh) in document.meshes.iter().enumerate() {
        for (j, primitive) in mesh.primitives.iter().enumerate() {
            let at = |rest: &str| format!("/meshes/{i}/primitives/{j}/{rest}");
            if let Checked::Invalid = primitive.mode {
                references.report.error(Problem::new(at("mode"), "is not one of 0 to 6"));
            }
            if let Some(material) = primitive.material {
                references.check(material.value(), document.materials.len(), "material", || at("material"));
            }
            if let Some(indices) = primitive.indices {
                references.check(indices.value(), accessors, "accessor", || at("indices"));
            }
            for (name, index) in &primitive.attributes {
                references.check(index.value(), accessors, "accessor", || {
                    at(&format!("attributes/{}", name.to_string()))
                });
            }
            for (k, target) in primitive.targets.iter().flatten().enumerate() {
                let named = [
                    ("POSITION", target.positions),
                    ("NORMAL", target.normals),
                    ("TANGENT", target.tangents),
                ];
                let named = named.into_iter().filter_map(|(name, index)| Some((name, index?.value())));
                let more = document.morphs.get(&(i, j)).and_then(|targets| targets.get(k));
                let more = more.into_iter().flatten().map(|(name, index)| (name.as_str(), *index));
                for (name, index) in named.chain(more) {
                    references.check(index, accessors, "accessor", || at(&format!("targets/{k}/{name}")));
                }
            }
        }
    }
}

fn materials(document: &Document, references: &mut References) {
    for (i, material) in document.materials.iter().enumerate() {
        for (name, texture) in slots(material) {
            references.check(texture, document.textures.len(), "texture", || {
                format!("/materials/{i}/{name}/index")
            });
        }
        if let Checked::Invalid = material.alpha_mode {
            let problem = Problem::new(format!("/materials/{i}/alphaMode"), "is not OPAQUE, MASK or BLEND");
            references.report.error(problem);
        }
    }
    for (i, texture) in document.textures.iter().enumerate() {
        let images = document.images.len();
        if texture.source.value() != NO_SOURCE {
            references.check(texture.source.value(), images, "image", || format!("/textures/{i}/source"));
        }
        for (name, source) in extension_sources(texture) {
            references.check(source, images, "image", || format!("/textures/{i}/extensions/{name}/source"));
        }
        if let Some(sampler) = texture.sampler {
            references.check(sampler.value(), document.samplers.len(), "sampler", || {
                format!("/textures/{i}/sampler")
            });
        }
    }
    for (i, sampler) in document.samplers.iter().enumerate() {
        let invalid = |mode: &Checked<_>| matches!(mode, Checked::Invalid);
        for (name, wrong) in [("wrapS", invalid(&sampler.wrap_s)), ("wrapT", invalid(&sampler.wrap_t))] {
            if wrong {
                let message = "is not a wrap mode (33071, 33648 or 10497)";
                references.report.error(Problem::new(format!("/samplers/{i}/{name}"), message));
            }
        }
    }
}

fn data(document: &Document, references: &mut References) {
    let views = document.views.len();
    for (i, image) in document.images.iter().enumerate() {
        if let Some(view) = image.buffer_view {
            references.check(view.value(), views, "bufferView", || format!("/images/{i}/bufferView"));
        }
    }
    for (i, view) in document.views.iter().enumerate() {
        references.check(view.buffer.value(), document.buffers.len(), "buffer", || {
            format!("/bufferViews/{i}/buffer")
        });
    }
    for (i, accessor) in document.accessors.iter().enumerate() {
        if let Some(view) = accessor.buffer_view {
            references.check(view.value(), views, "bufferView", || format!("/accessors/{i}/bufferView"));
        }
        if let Some(sparse) = &accessor.sparse {
            references.check(sparse.indices.buffer_view.value(), views, "bufferView", || {
                format!("/accessors/{i}/sparse/indices/bufferView")
            });
            references.check(sparse.values.buffer_view.value(), views, "bufferView", || {
                format!("/accessors/{i}/sparse/values/bufferView")
            });
        }
    }
}

/// Two parents and cycles. References that do not exist have been reported already and are passed over.
fn hierarchy(document: &Document, report: &mut Report) {
    let nodes = &document.nodes;
    let mut parents = vec![None; nodes.len()];
    for (i, node) in nodes.iter().enumerate() {
        for (j, child) in node.children.iter().flatten().enumerate() {
            match parents.get_mut(child.value()) {
                Some(parent @ None) => *parent = Some(i),
                Some(Some(first)) => {
                    let message = format!("node {} already has node {first} as its parent", child.value());
                    report.error(Problem::new(format!("/nodes/{i}/children/{j}"), message));
                }
                None => {}
            }
        }
    }
    for (i, scene) in document.scenes.iter().enumerate() {
        for (j, node) in scene.nodes.iter().enumerate() {
            if let Some(Some(parent)) = parents.get(node.value()) {
                let message = format!("node {} is not a root: it is a child of node {parent}", node.value());
                report.error(Problem::new(format!("/scenes/{i}/nodes/{j}"), message));
            }
        }
    }
    // With one parent each, walking up ends at a root, at a node that another walk has passed, or where this one began
    // to go round.
    let mut passed_by = vec![usize::MAX; nodes.len()];
    for start in 0..nodes.len() {
        let mut at = Some(start);
        while let Some(node) = at {
            match passed_by.get_mut(node) {
                Some(walk) if *walk == usize::MAX => *walk = start,
                Some(walk) if *walk == start => {
                    report.error(Problem::new(
                        format!("/nodes/{node}"),
                        "is its own ancestor: the nodes form a cycle",
                    ));
                    break;
                }
                _ => break,
            }
            at = parents.get(node).copied().flatten();
        }
    }
}
