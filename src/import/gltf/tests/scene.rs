//! Nodes, instances, cameras, lights.

use std::f32::consts::{FRAC_1_SQRT_2, FRAC_PI_4};

use glam::Vec3;
use serde_json::json;

use super::*;
use crate::world::{Light, Projection};

fn with_nodes(nodes: Value, roots: Value) -> Value {
    let mut file = square();
    file["nodes"] = nodes;
    file["scenes"][0]["nodes"] = roots;
    file
}

#[test]
fn transforms_multiply_down_the_tree() {
    let turned = [0., FRAC_1_SQRT_2, 0., FRAC_1_SQRT_2];
    let model = model(&with_nodes(
        json!([
            { "translation": [10, 0, 0], "rotation": turned, "scale": [2, 2, 2], "children": [1] },
            { "matrix": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, -1, 0, 1, 2, 3, 1], "mesh": 0 },
        ]),
        json!([0]),
    ));
    // 90° about +Y takes +X to −Z and +Z to +X.
    let to_world = model.instances[0].to_world;
    assert!(to_world.transform_point3(Vec3::ZERO).abs_diff_eq(Vec3::new(16., 4., -2.), 1e-5));
    assert!(to_world.transform_vector3(Vec3::Z).abs_diff_eq(Vec3::new(-2., 0., 0.), 1e-5));
    assert!(to_world.matrix3.determinant() < 0.0);
}

#[test]
fn meshes_are_stored_once() {
    let mut file = with_nodes(json!([{ "mesh": 0 }, { "mesh": 0 }, { "mesh": 1 }]), json!([0, 1, 2]));
    // Another mesh over the same accessors, with another material.
    let again = file["meshes"][0].clone();
    push(&mut file["meshes"], again);
    file["meshes"][1]["primitives"][0]["material"] = json!(0);
    file["materials"] = json!([{ "name": "red" }]);
    let model = model(&file);
    assert_eq!((model.meshes.len(), model.instances.len()), (1, 3));
    let names: Vec<_> =
        model.instances.iter().map(|i| &*model.materials[i.materials[0].index()].name).collect();
    assert_eq!(names, ["default", "default", "red"]);
}

#[test]
fn cycles_and_shared_children_are_refused() {
    let file = |nodes| with_nodes(nodes, json!([0]));
    refused(&file(json!([{ "children": [0] }])), "/nodes/0", "cycle");
    refused(
        &file(json!([{}, { "children": [2] }, { "children": [3] }, { "children": [1] }])),
        "/nodes/1",
        "cycle",
    );
    let shared = json!([{ "children": [1, 2] }, { "children": [2] }, {}]);
    refused(&file(shared), "/nodes/1/children/0", "already has node 0");
    refused(&file(json!([{ "children": [1, 1] }, {}])), "/nodes/0/children/1", "already");
    refused(&with_nodes(json!([{ "children": [1] }, {}]), json!([1])), "/scenes/0/nodes/0", "not a root");
}

#[test]
fn a_deep_chain_of_nodes_is_no_trouble() {
    let n = 50_000;
    let mut nodes: Vec<_> = (1..n).map(|i| json!({ "children": [i], "translation": [1, 0, 0] })).collect();
    nodes.push(json!({ "mesh": 0 }));
    let model = model(&with_nodes(json!(nodes), json!([0])));
    assert_eq!(model.instances[0].to_world.translation.x, (n - 1) as f32);
}

#[test]
fn a_node_listed_twice_is_placed_once() {
    let model = warned(&with_nodes(json!([{ "mesh": 0 }]), json!([0, 0])), "listed more than once");
    assert_eq!(model.instances.len(), 1);
}

#[test]
fn singular_transforms_are_set_aside() {
    let model = warned(
        &with_nodes(
            json!([
                { "mesh": 0, "scale": [1, 0, 1] },
                { "mesh": 0, "rotation": [0, 0, 0, 0] },
                { "mesh": 0, "translation": [1e39, 0, 0] },
                { "mesh": 0, "matrix": [1, 0, 0, 0.5, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1] },
                { "mesh": 0, "scale": [-1, 1, 1] },
            ]),
            json!([0, 1, 2, 3, 4]),
        ),
        "4 node(s) have a transform that is singular",
    );
    assert_eq!(model.instances.len(), 1);
}

#[test]
fn scenes_default_first_and_none() {
    let mut file = with_nodes(json!([{ "mesh": 0 }, { "mesh": 0, "name": "b" }]), json!([0]));
    push(&mut file["scenes"], json!({ "nodes": [1] }));
    file["scene"] = json!(1);
    assert_eq!(model(&file).instances[0].name, "b");
    file.as_object_mut().unwrap().remove("scene");
    assert_eq!(model(&file).instances[0].name, "node 0");
    file.as_object_mut().unwrap().remove("scenes");
    assert_eq!(warned(&file, "no scene").instances.len(), 2);
    file["scenes"] = json!([{}]);
    assert!(model(&file).instances.is_empty());
}

#[test]
fn invisible_nodes_hide_what_is_below() {
    let hidden = json!({ "KHR_node_visibility": { "visible": false } });
    let nodes = json!([{ "children": [1], "extensions": hidden }, { "mesh": 0 }, { "mesh": 0 }]);
    assert_eq!(model(&with_nodes(nodes, json!([0, 2]))).instances.len(), 1);
}

#[test]
fn cameras_are_rigid_and_look_along_minus_z() {
    let mut file = with_nodes(
        json!([{ "camera": 0, "scale": [2, 3, -4], "translation": [0, 0, 5] }, { "camera": 1 }, { "camera": 2 }]),
        json!([0, 1, 2]),
    );
    file["cameras"] = json!([
        { "type": "perspective", "name": "eye", "perspective": { "yfov": 0.5, "znear": 0.1 } },
        { "type": "orthographic", "orthographic": { "xmag": 2, "ymag": 3, "zfar": 1, "znear": 0 } },
        { "type": "perspective", "perspective": { "yfov": 4, "znear": 0.1 } },
    ]);
    let model = warned(&file, "yfov of 4 radians");
    let [eye, flat] = &model.cameras[..] else { panic!("{:?}", model.cameras) };
    assert_eq!((eye.name.as_str(), eye.projection), ("eye", Projection::Perspective { vfov: 0.5 }));
    assert!((eye.to_world.matrix3.determinant() - 1.0).abs() < 1e-6);
    // Mirrored in z: it looks along +Z.
    assert!(eye.to_world.transform_point3(-Vec3::Z).abs_diff_eq(Vec3::new(0., 0., 6.), 1e-6));
    assert_eq!(
        (flat.name.as_str(), flat.projection),
        ("camera 1", Projection::Orthographic { half_height: 3.0 })
    );
}

#[test]
fn punctual_lights() {
    let light = |i: usize| json!({ "KHR_lights_punctual": { "light": i } });
    let mut file = with_nodes(
        json!([
            { "extensions": light(0), "translation": [1, 2, 3] },
            { "extensions": light(1), "rotation": [FRAC_1_SQRT_2, 0, 0, -FRAC_1_SQRT_2], "scale": [9, 9, 9] },
            { "extensions": light(2) },
            { "extensions": light(3) },
            { "extensions": light(4) },
        ]),
        json!([0, 1, 2, 3, 4]),
    );
    file["extensions"] = json!({ "KHR_lights_punctual": { "lights": [
        { "type": "point", "color": [1, 0.5, 0], "intensity": 2, "extras": { "a": [] } },
        { "type": "directional" },
        { "type": "spot", "spot": {}, "intensity": 3 },
        { "type": "spot", "spot": { "innerConeAngle": 1, "outerConeAngle": 0.5 } },
        { "type": "spot", "spot": { "innerConeAngle": 0.5, "outerConeAngle": 0.5 } },
    ] } });
    let model = warned(&file, "cone angles");
    let position = Vec3::new(1., 2., 3.);
    assert_eq!(model.lights[0], Light::Point { position, intensity: Vec3::new(2., 1., 0.) });
    // −90° about +X takes −Z to −Y.
    let Light::Sun { direction, irradiance, angle } = model.lights[1] else { panic!() };
    assert!(direction.abs_diff_eq(-Vec3::Y, 1e-6) && irradiance == Vec3::ONE && angle == 0.0);
    let Light::Spot { inner, outer, intensity, direction, .. } = model.lights[2] else { panic!() };
    assert_eq!((inner, outer, intensity, direction), (0.0, FRAC_PI_4, Vec3::splat(3.), -Vec3::Z));
    let Light::Spot { inner, outer, .. } = model.lights[3] else { panic!() };
    assert!(inner.cos() - outer.cos() > 1e-5 && outer == 0.5);
    assert_eq!(model.lights.len(), 4);
}

#[test]
fn many_instances_are_refused_before_they_fill_memory() {
    let mut file = with_nodes(json!(vec![json!({ "mesh": 0 }); 3000]), json!((0..3000).collect::<Vec<_>>()));
    let primitive = file["meshes"][0]["primitives"][0].clone();
    file["meshes"][0]["primitives"] = json!(vec![primitive; 3000]);
    refused(&file, "/nodes", "instances");
}
