//! Primitives to triangles: topologies, what is broken in them, attributes, morph targets.

use glam::{Vec2, Vec3, Vec4};
use serde_json::json;

use super::*;

fn corners(mode: u32, count: usize) -> Vec<[u32; 3]> {
    let positions: Vec<f32> = (0..count).flat_map(|i| [i as f32, (i * i) as f32, 0.0]).collect();
    let primitive = json!({ "attributes": { "POSITION": 0 }, "mode": mode });
    mesh(&asset(&[floats(&positions)], &[(0, F32, "VEC3", count)], primitive)).triangles
}

#[test]
fn topologies_follow_the_specification() {
    assert_eq!(corners(4, 6), [[0, 1, 2], [3, 4, 5]]);
    assert_eq!(corners(5, 5), [[0, 1, 2], [1, 3, 2], [2, 3, 4]]);
    // (v1, v2, v0) and (v2, v3, v0).
    assert_eq!(corners(6, 4), [[1, 2, 0], [2, 3, 0]]);
}

#[test]
fn a_strip_keeps_the_side_of_its_first_triangle() {
    let mut file = square();
    file["meshes"][0]["primitives"][0] = json!({ "attributes": { "POSITION": 0 }, "mode": 5 });
    let mesh = mesh(&file);
    for t in &mesh.triangles {
        let [a, b, c] = t.map(|v| mesh.positions[v as usize]);
        assert!((b - a).cross(c - a).z > 0.0);
    }
}

#[test]
fn incomplete_triangles_points_and_lines_are_counted() {
    let mut file = square();
    file["meshes"][0]["primitives"][0] = json!({ "attributes": { "POSITION": 0 } });
    assert_eq!(warned(&file, "1 primitive(s) end in an incomplete").meshes[0].triangles.len(), 1);
    file["meshes"][0]["primitives"] =
        json!([0, 1, 2, 3].map(|mode| json!({ "attributes": { "POSITION": 0 }, "mode": mode })));
    let model = warned(&file, "1 primitive(s) of points");
    assert!(model.instances.is_empty());
    warned(&file, "3 primitive(s) of lines");
}

#[test]
fn an_index_out_of_range_is_refused() {
    let mut file = square();
    file["buffers"][1]["uri"] = json!(data_uri(&le![0u16, 1u16, 4u16, 2u16, 1u16, 3u16]));
    refused(&file, "/meshes/0/primitives/0/indices", "index 2 is vertex 4, but there are 4");
}

#[test]
fn only_used_vertices_are_kept() {
    let positions: Vec<f32> = (0..1000).flat_map(|i| [i as f32, (i % 7) as f32, 0.0]).collect();
    for used in [[900u16, 7, 500], [0, 999, 1]] {
        let file = asset(
            &[floats(&positions), le![used[0], used[1], used[2]]],
            &[(0, F32, "VEC3", 1000), (1, U16, "SCALAR", 3)],
            json!({ "attributes": { "POSITION": 0 }, "indices": 1 }),
        );
        let mesh = mesh(&file);
        assert_eq!(mesh.positions.len(), 3);
        let xs = mesh.triangles[0].map(|v| mesh.positions[v as usize].x as u16);
        assert_eq!(xs, used);
    }
}

#[test]
fn triangles_with_non_finite_positions_are_set_aside() {
    for broken in [f32::NAN, f32::INFINITY] {
        let mut positions = SQUARE;
        positions[9] = broken;
        let mut file = square();
        file["buffers"][0]["uri"] = json!(data_uri(&floats(&positions)));
        let model = warned(&file, "1 triangle(s) with positions that are not finite");
        assert_eq!(model.meshes[0].triangles, [[0, 1, 2]]);
        assert!(model.meshes[0].positions.iter().all(|p| p.is_finite()));
    }
}

fn with_attribute(name: &str, shape: &str, values: &[f32]) -> Value {
    let mut file = asset(
        &[floats(&SQUARE), le![0u16, 1u16, 2u16, 2u16, 1u16, 3u16], floats(values)],
        &[(0, F32, "VEC3", 4), (1, U16, "SCALAR", 6), (2, F32, shape, 4)],
        json!({ "attributes": { "POSITION": 0 }, "indices": 1 }),
    );
    file["meshes"][0]["primitives"][0]["attributes"][name] = json!(2);
    file
}

#[test]
fn normals_become_unit_and_broken_ones_are_regenerated() {
    let normals = [0., 0., 2., 0., 0., 0., f32::NAN, 0., 0., 1e-30, 0., 0.];
    let file = with_attribute("NORMAL", "VEC3", &normals);
    let model = warned(&file, "2 normal(s)");
    assert_eq!(model.meshes[0].normals, [Vec3::Z, Vec3::Z, Vec3::Z, Vec3::X]);
    assert!(mesh(&square()).normals.is_empty());
}

#[test]
fn tangents_need_normals_and_get_a_sign() {
    let tangents = [2., 0., 0., -3., 1., 0., 0., 0.5, 0., 0., 0., 1., 1., 0., 0., 1.];
    let mut file = with_attribute("TANGENT", "VEC4", &tangents);
    assert!(mesh(&file).tangents.is_empty());
    file["meshes"][0]["primitives"][0]["attributes"]["NORMAL"] = json!(3);
    push(
        &mut file["buffers"],
        json!({ "byteLength": 48, "uri": data_uri(&floats(&[0., 0., 1.].repeat(4))) }),
    );
    push(&mut file["bufferViews"], json!({ "buffer": 3, "byteLength": 48 }));
    push(
        &mut file["accessors"],
        json!({ "bufferView": 3, "componentType": F32, "type": "VEC3", "count": 4 }),
    );
    let model = warned(&file, "1 tangent(s)");
    let tangents = &model.meshes[0].tangents;
    assert_eq!(tangents[0], Vec4::new(1., 0., 0., -1.));
    assert_eq!(tangents[1], Vec4::new(1., 0., 0., 1.));
    assert!(tangents[2].truncate().is_normalized() && tangents[2].z == 0.0);
}

#[test]
fn vertex_colours_of_three_or_four_components() {
    let mesh_of = |shape, values: &[f32]| mesh(&with_attribute("COLOR_0", shape, values)).colors[1];
    assert_eq!(
        mesh_of("VEC3", &[0., 0., 0., 0.2, 0.4, 0.6, 0., 0., 0., 0., 0., 0.]),
        Vec4::new(0.2, 0.4, 0.6, 1.0)
    );
    let four: Vec<f32> = (0..16).map(|i| i as f32 / 16.).collect();
    assert_eq!(mesh_of("VEC4", &four), Vec4::new(0.25, 0.3125, 0.375, 0.4375));
    let file =
        with_attribute("COLOR_0", "VEC4", &[[f32::NAN, -1., 2., 0.5], [0.; 4], [0.; 4], [0.; 4]].concat());
    assert_eq!(warned(&file, "1 vertex colour").meshes[0].colors[0], Vec4::new(1., 0., 1., 0.5));
}

#[test]
fn attributes_of_the_wrong_length_or_shape_are_refused() {
    let mut file = with_attribute("NORMAL", "VEC3", &SQUARE);
    file["accessors"][2]["count"] = json!(3);
    refused(&file, "/meshes/0/primitives/0/attributes/NORMAL", "3 elements, but POSITION has 4");
    let file = with_attribute("TEXCOORD_0", "VEC3", &SQUARE);
    refused(&file, "/meshes/0/primitives/0/attributes/TEXCOORD_0", "3 components");
    let mut file = square();
    file["meshes"][0]["primitives"][0]["indices"] = json!(0);
    refused(&file, "/meshes/0/primitives/0/indices", "unsigned scalars");
    file["meshes"][0]["primitives"][0] = json!({ "attributes": {} });
    refused(&file, "/meshes/0/primitives/0/attributes", "no POSITION");
}

#[test]
fn default_morph_weights_apply() {
    let mut file = with_attribute("_UNUSED", "VEC3", &[0., 0., 1.].repeat(4));
    file["meshes"][0]["primitives"][0]["targets"] = json!([{ "POSITION": 2 }]);
    assert_eq!(mesh(&file).positions[0].z, 0.0);
    file["meshes"][0]["weights"] = json!([0.5]);
    assert_eq!(mesh(&file).positions[0].z, 0.5);
    file["nodes"][0]["weights"] = json!([2]);
    assert_eq!(mesh(&file).positions[0].z, 2.0);
    // Two nodes with different weights do not share a mesh.
    push(&mut file["nodes"], json!({ "mesh": 0 }));
    file["scenes"][0]["nodes"] = json!([0, 1]);
    assert_eq!(model(&file).meshes.len(), 2);
}

#[test]
fn morph_targets_change_uvs_and_colours() {
    let mut file = with_attribute("TEXCOORD_0", "VEC2", &[0.25; 8]);
    let data = json!({ "byteLength": 48, "uri": data_uri(&floats(&[0.5; 12])) });
    push(&mut file["buffers"], data);
    push(&mut file["bufferViews"], json!({ "buffer": 3, "byteLength": 48 }));
    for shape in ["VEC2", "VEC3"] {
        let accessor = json!({ "bufferView": 3, "componentType": F32, "type": shape, "count": 4 });
        push(&mut file["accessors"], accessor);
    }
    let primitive = &mut file["meshes"][0]["primitives"][0];
    primitive["attributes"]["COLOR_0"] = json!(4);
    primitive["targets"] = json!([{ "COLOR_0": 4 }, { "TEXCOORD_0": 3, "COLOR_0": 4 }]);
    for (weights, uv, color) in [([0., 0.], 0.25, 0.5), ([0.5, 0.], 0.25, 0.75), ([0., 2.], 1.25, 1.0)] {
        file["meshes"][0]["weights"] = json!(weights);
        let model = import(&file).expect("is right");
        let mesh = &model.meshes[0];
        assert_eq!((mesh.uvs[0][3], mesh.colors[3].x, mesh.colors[3].w), (Vec2::splat(uv), color, 1.0));
    }
    file["meshes"][0]["primitives"][0]["targets"][1]["TEXCOORD_0"] = json!(9);
    refused(&file, "/meshes/0/primitives/0/targets/1/TEXCOORD_0", "refers to accessor 9");
}
