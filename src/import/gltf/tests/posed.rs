//! Skins and instances.

use std::f32::consts::FRAC_1_SQRT_2;

use glam::{Affine3A, Vec3, Vec4};
use serde_json::json;

use super::*;

/// The identity, column by column.
const IDENTITY: [f32; 16] = [1., 0., 0., 0., 0., 1., 0., 0., 0., 0., 1., 0., 0., 0., 0., 1.];

/// The square at node 0, its lower corners on joint 0 and its upper ones on joint 1 with these weights.
fn skinned(nodes: Value, joints: Value, weights: [[f32; 4]; 4]) -> Value {
    let normals = [0., 0., 1.].repeat(4);
    let indices = [0u8, 1, 0, 0].repeat(4);
    let mut file = asset(
        &[floats(&SQUARE), floats(&normals), indices, floats(weights.as_flattened())],
        &[(0, F32, "VEC3", 4), (1, F32, "VEC3", 4), (2, U8, "VEC4", 4), (3, F32, "VEC4", 4)],
        json!({ "attributes": { "POSITION": 0, "NORMAL": 1, "JOINTS_0": 2, "WEIGHTS_0": 3 }, "mode": 5 }),
    );
    file["nodes"] = nodes;
    file["scenes"][0]["nodes"] = json!([0, 1]);
    file["skins"] = json!([{ "joints": joints }]);
    file
}

/// Lower corners follow joint 0, upper ones joint 1.
const HINGED: [[f32; 4]; 4] = [[1., 0., 0., 0.], [1., 0., 0., 0.], [0., 1., 0., 0.], [0., 1., 0., 0.]];

#[test]
fn vertices_follow_their_joints_and_not_their_node() {
    let nodes = json!([
        { "mesh": 0, "skin": 0, "translation": [100, 0, 0], "scale": [0, 0, 0] },
        { "translation": [0, 0, 5], "children": [2] },
        { "rotation": [0, 0, FRAC_1_SQRT_2, FRAC_1_SQRT_2] },
    ]);
    let model = model(&skinned(nodes, json!([1, 2]), HINGED));
    assert_eq!(model.instances[0].to_world, Affine3A::IDENTITY);
    let expected = [Vec3::ZERO, Vec3::X, Vec3::NEG_X, Vec3::new(-1., 1., 0.)].map(|p| p + 5. * Vec3::Z);
    for (found, expected) in model.meshes[0].positions.iter().zip(expected) {
        assert!(found.abs_diff_eq(expected, 1e-6), "{found} is not {expected}");
    }
}

#[test]
fn weights_blend_and_are_made_to_sum_to_one() {
    let nodes = json!([{ "mesh": 0, "skin": 0 }, { "children": [2] }, { "translation": [0, 0, 4] }]);
    let quarter = [0.3, 0.1, 0., 0.];
    let model = warned(
        &skinned(nodes, json!([1, 2]), [quarter, quarter, quarter, [0.; 4]]),
        "1 skinned vertices have no weight",
    );
    let heights: Vec<f32> = model.meshes[0].positions.iter().map(|p| p.z).collect();
    for (found, expected) in heights.iter().zip([1., 1., 1., 0.]) {
        assert!((found - expected).abs() < 1e-6, "{heights:?}");
    }
}

#[test]
fn inverse_bind_matrices_come_first() {
    let nodes = json!([{ "mesh": 0, "skin": 0 }, { "scale": [2, 2, 2] }, {}]);
    let mut file = skinned(nodes, json!([1]), [[1., 0., 0., 0.]; 4]);
    let mut inverse = IDENTITY;
    inverse[12] = -1.0;
    push(&mut file["buffers"], json!({ "byteLength": 64, "uri": data_uri(&floats(&inverse)) }));
    push(&mut file["bufferViews"], json!({ "buffer": 4, "byteLength": 64 }));
    push(
        &mut file["accessors"],
        json!({ "bufferView": 4, "componentType": F32, "type": "MAT4", "count": 1 }),
    );
    file["skins"][0]["inverseBindMatrices"] = json!(4);
    assert_eq!(mesh(&file).positions[1], Vec3::ZERO);
    file["skins"][0]["joints"] = json!([1, 2]);
    refused(&file, "/skins/0/inverseBindMatrices", "1 matrices for 2 joints");
    file["skins"][0]["joints"] = json!([1]);
    file["skins"][0]["inverseBindMatrices"] = json!(0);
    refused(&file, "/skins/0/inverseBindMatrices", "MAT4");
}

#[test]
fn a_second_set_of_joints_counts() {
    let nodes = json!([{ "mesh": 0, "skin": 0 }, { "children": [2] }, { "translation": [0, 0, 4] }]);
    let mut file = skinned(nodes, json!([1, 2]), [[0.5, 0., 0., 0.]; 4]);
    file["meshes"][0]["primitives"][0]["attributes"]["JOINTS_1"] = json!(2);
    file["meshes"][0]["primitives"][0]["attributes"]["WEIGHTS_1"] = json!(4);
    push(&mut file["buffers"], json!({ "byteLength": 16, "uri": data_uri(&[0u8, 128, 0, 0].repeat(4)) }));
    push(&mut file["bufferViews"], json!({ "buffer": 4, "byteLength": 16 }));
    // Integers of weights are normalised even where the flag is forgotten.
    push(&mut file["accessors"], json!({ "bufferView": 4, "componentType": U8, "type": "VEC4", "count": 4 }));
    let height = mesh(&file).positions[0].z;
    assert!((height - 4. * (128. / 255.) / (0.5 + 128. / 255.)).abs() < 1e-5, "{height}");
}

#[test]
fn normals_turn_with_their_joints_also_where_these_are_stretched_or_flat() {
    let tilted = json!({ "rotation": [FRAC_1_SQRT_2, 0, 0, FRAC_1_SQRT_2], "scale": [1, 1, 0.001] });
    let model_of = |joint: Value| {
        let nodes = json!([{ "mesh": 0, "skin": 0 }, joint]);
        mesh(&skinned(nodes, json!([1]), [[1., 0., 0., 0.]; 4]))
    };
    // 90° about +X takes +Z to −Y; a flattened surface keeps its normal.
    assert!(model_of(tilted).normals[0].abs_diff_eq(Vec3::NEG_Y, 1e-5));
    assert!(model_of(json!({ "scale": [1, 1, 0] })).normals[0].abs_diff_eq(Vec3::Z, 1e-5));
    assert!(model_of(json!({ "scale": [0, 0, 0] })).normals[0].is_normalized());
}

#[test]
fn fronts_stay_fronts_where_a_pose_mirrors() {
    for scale in [json!([-1, 1, 1]), json!([1, 1, 1])] {
        let nodes = json!([{ "mesh": 0, "skin": 0 }, { "scale": scale }]);
        let mesh = mesh(&skinned(nodes, json!([1]), [[1., 0., 0., 0.]; 4]));
        let [a, b, c] = mesh.triangles[0].map(|v| mesh.positions[v as usize]);
        assert!((b - a).cross(c - a).z > 0.0 && mesh.normals[0].z > 0.0, "{scale}");
    }
}

#[test]
fn joints_that_do_not_exist_are_refused() {
    let nodes = || json!([{ "mesh": 0, "skin": 0 }, {}]);
    let file = skinned(nodes(), json!([1]), HINGED);
    refused(&file, "/meshes/0/primitives/0/attributes/JOINTS_0", "joint 1, but there are 1");
    // Without weight an index does not matter.
    assert_eq!(mesh(&skinned(nodes(), json!([1]), [[1., 0., 0., 0.]; 4])).positions.len(), 4);
    refused(&skinned(nodes(), json!([7]), HINGED), "/skins/0/joints/0", "node 7");
    refused(&skinned(nodes(), json!([]), HINGED), "/skins/0/joints", "empty");
    let mut file = skinned(nodes(), json!([1]), HINGED);
    file["meshes"][0]["primitives"][0]["attributes"]["JOINTS_0"] = json!(3);
    refused(&file, "/meshes/0/primitives/0/attributes/JOINTS_0", "8 or 16 bits");
}

/// The square with instances by these attributes: translations, rotations as i8, scales.
fn instanced() -> Value {
    let translations = floats(&[1., 0., 0., 0., 2., 0.]);
    let mut file = asset(
        &[floats(&SQUARE), translations, vec![0, 0, 0, 127, 0, 0, 127, 0], floats(&[1., 1., 1., 3., 1., 1.])],
        &[(0, F32, "VEC3", 4), (1, F32, "VEC3", 2), (2, I8, "VEC4", 2), (3, F32, "VEC3", 2)],
        json!({ "attributes": { "POSITION": 0 }, "mode": 5 }),
    );
    let attributes = json!({ "TRANSLATION": 1, "ROTATION": 2, "SCALE": 3, "_ID": 1 });
    file["nodes"][0]["translation"] = json!([0, 0, 7]);
    file["nodes"][0]["extensions"] = json!({ "EXT_mesh_gpu_instancing": { "attributes": attributes } });
    file
}

#[test]
fn instances_share_their_mesh() {
    let mut file = instanced();
    let model_ = model(&file);
    assert_eq!((model_.meshes.len(), model_.instances.len()), (1, 2));
    let corner = |i: usize| model_.instances[i].to_world.transform_point3(Vec3::X);
    assert!(corner(0).abs_diff_eq(Vec3::new(2., 0., 7.), 1e-5));
    // Half a turn about +Z.
    assert!(corner(1).abs_diff_eq(Vec3::new(-3., 2., 7.), 1e-5), "{}", corner(1));
    file["nodes"][0]["extensions"]["EXT_mesh_gpu_instancing"]["attributes"] = json!({ "TRANSLATION": 1 });
    assert_eq!(model(&file).instances[1].to_world.matrix3, glam::Mat3A::IDENTITY);
}

#[test]
fn instances_that_lie_are_refused() {
    const AT: &str = "/nodes/0/extensions/EXT_mesh_gpu_instancing";
    let mut file = instanced();
    file["nodes"][0]["extensions"]["EXT_mesh_gpu_instancing"]["attributes"]["SCALE"] = json!(0);
    refused(&file, &format!("{AT}/attributes/SCALE"), "4 elements, but another attribute has 2");
    file["nodes"][0]["extensions"]["EXT_mesh_gpu_instancing"]["attributes"]["SCALE"] = json!(9);
    refused(&file, &format!("{AT}/attributes/SCALE"), "does not exist");
    file["nodes"][0]["extensions"]["EXT_mesh_gpu_instancing"] = json!({});
    refused(&file, AT, "no `attributes`");
    let mut file = instanced();
    file["accessors"][1] = json!({ "componentType": F32, "type": "VEC3", "count": 1 << 23 });
    file["nodes"][0]["extensions"]["EXT_mesh_gpu_instancing"]["attributes"] = json!({ "TRANSLATION": 1 });
    refused(&file, AT, "no more than");
}

#[test]
fn a_flat_instance_is_set_aside() {
    let mut file = instanced();
    file["buffers"][3]["uri"] = json!(data_uri(&floats(&[1., 1., 0., 3., 1., 1.])));
    assert_eq!(warned(&file, "1 instance(s) have a transform").instances.len(), 1);
}

#[test]
fn tangents_keep_their_handedness() {
    let nodes = json!([{ "mesh": 0, "skin": 0 }, { "rotation": [0, 0, FRAC_1_SQRT_2, FRAC_1_SQRT_2] }]);
    let mut file = skinned(nodes, json!([1]), [[1., 0., 0., 0.]; 4]);
    let tangents = [1., 0., 0., -1.].repeat(4);
    push(&mut file["buffers"], json!({ "byteLength": 64, "uri": data_uri(&floats(&tangents)) }));
    push(&mut file["bufferViews"], json!({ "buffer": 4, "byteLength": 64 }));
    push(
        &mut file["accessors"],
        json!({ "bufferView": 4, "componentType": F32, "type": "VEC4", "count": 4 }),
    );
    file["meshes"][0]["primitives"][0]["attributes"]["TANGENT"] = json!(4);
    let tangent = mesh(&file).tangents[0];
    assert!(tangent.abs_diff_eq(Vec4::new(0., 1., 0., -1.), 1e-6), "{tangent}");
}
