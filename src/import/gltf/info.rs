//! What a document holds, for `rayo info`.

use gltf::json::{
    camera::Type as CameraType, extensions::scene::khr_lights_punctual::Type as LightType,
    validation::Checked,
};

use super::{accessor::Source, clipped, document::Document, extensions, nodes, topology::Topology};
use crate::import::info::{Animation, Extension, Info, Mesh, Named, Scene};

pub fn info(source: &Source) -> Info {
    let document = source.document;
    let name = |name: Option<&str>, what: &str, i: usize| {
        name.filter(|name| !name.is_empty()).map_or_else(|| format!("{what} {i}"), clipped)
    };
    Info {
        format: "glTF 2.0".into(),
        generator: document.generator.as_deref().map(clipped),
        scenes: numbered(&document.scenes, |i, scene| Scene {
            name: name(scene.name.as_deref(), "scene", i),
            default: i == nodes::shown_scene(document),
        }),
        nodes: document.nodes.len(),
        meshes: numbered(&document.meshes, |i, mesh| Mesh {
            name: name(mesh.name.as_deref(), "mesh", i),
            primitives: mesh.primitives.len(),
            triangles: mesh.primitives.iter().map(|primitive| triangles(document, primitive)).sum(),
        }),
        skins: document.skins.len(),
        materials: numbered(&document.materials, |i, m| name(m.name.as_deref(), "material", i)),
        variants: numbered(&document.variants, |i, variant| name(Some(variant), "variant", i)),
        animations: numbered(&document.animations, |i, animation| {
            let [start, end] = animation.range(source);
            let name = name(animation.name.as_deref(), "animation", i);
            Animation { name, channels: animation.channels.len(), start, end }
        }),
        cameras: numbered(&document.cameras, |i, camera| Named {
            name: name(camera.name.as_deref(), "camera", i),
            kind: match camera.type_ {
                Checked::Valid(CameraType::Orthographic) => "orthographic".into(),
                _ => "perspective".into(),
            },
        }),
        lights: lights(document, name),
        extensions: (document.extensions.iter())
            .map(|(name, &required)| Extension {
                name: clipped(name),
                required,
                supported: extensions::SUPPORTED.contains(&name.as_str()),
            })
            .collect(),
        ..Info::default()
    }
}

fn lights(document: &Document, name: impl Fn(Option<&str>, &str, usize) -> String) -> Vec<Named> {
    let punctual = document.lights.iter().enumerate().map(|(i, light)| Named {
        name: name(light.name.as_deref(), "light", i),
        kind: match light.type_ {
            Checked::Valid(LightType::Point) => "point".into(),
            Checked::Valid(LightType::Spot) => "spot".into(),
            _ => "directional".into(),
        },
    });
    let surrounding = (0..document.image_lights.len())
        .map(|i| Named { name: format!("surrounding {i}"), kind: "image-based".into() });
    punctual.chain(surrounding).collect()
}

fn numbered<T, U>(items: &[T], mut describe: impl FnMut(usize, &T) -> U) -> Vec<U> {
    items.iter().enumerate().map(|(i, item)| describe(i, item)).collect()
}

fn triangles(document: &Document, primitive: &gltf::json::mesh::Primitive) -> usize {
    let Checked::Valid(mode) = primitive.mode else { return 0 };
    let Some(topology) = Topology::of(mode) else { return 0 };
    let positions = Checked::Valid(gltf::json::mesh::Semantic::Positions);
    let corners = primitive.indices.or_else(|| primitive.attributes.get(&positions).copied());
    let count =
        corners.and_then(|c| document.accessors.get(c.value())).map_or(0, |accessor| accessor.count.0);
    topology.count(usize::try_from(count).unwrap_or(0))
}
