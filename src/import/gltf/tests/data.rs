//! Accessors: layouts, normalised integers, sparse substitution, and numbers that lie.

use glam::{Vec2, Vec3};
use serde_json::json;

use super::*;

#[test]
fn interleaved_attributes() {
    // Per vertex: position, two bytes of padding in front of a u16 pair of texture coordinates.
    let mut bytes = Vec::new();
    for (i, p) in SQUARE.chunks(3).enumerate() {
        bytes.extend(floats(p));
        bytes.extend(le![0u32, (i * 1000) as u16, 65535u16]);
    }
    let mut file = asset(
        &[bytes],
        &[(0, F32, "VEC3", 4), (0, U16, "VEC2", 4)],
        json!({ "attributes": { "POSITION": 0, "TEXCOORD_0": 1 }, "mode": 5 }),
    );
    file["bufferViews"][0]["byteStride"] = json!(20);
    file["accessors"][1]["byteOffset"] = json!(16);
    file["accessors"][1]["normalized"] = json!(true);
    let mesh = mesh(&file);
    assert_eq!(mesh.positions[3], Vec3::new(1., 1., 0.));
    assert_eq!(mesh.uvs[0][3], Vec2::new(3000. / 65535., 1.));
}

#[test]
fn normalised_integers_follow_the_table_of_the_specification() {
    let cases: [(u32, Vec<u8>, f32); 5] = [
        (I8, vec![0x80, 0x7F, 0, 0], -1.0),
        (I8, vec![0x81, 0x7F, 0, 0], -1.0),
        (U8, vec![0xFF, 0xFF, 0, 0], 1.0),
        (I16, le![-32768i16, 32767i16], -1.0),
        (U16, le![65535u16, 65535u16], 1.0),
    ];
    for (component, element, expected) in cases {
        let views = [floats(&SQUARE), element.repeat(4)];
        let primitive = json!({ "attributes": { "POSITION": 0, "TEXCOORD_0": 1 }, "mode": 5 });
        let mut file = asset(&views, &[(0, F32, "VEC3", 4), (1, component, "VEC2", 4)], primitive);
        file["bufferViews"][1]["byteStride"] = json!(4);
        file["accessors"][1]["normalized"] = json!(true);
        assert_eq!(mesh(&file).uvs[0][0], Vec2::new(expected, 1.0), "{component}");
        // Without the flag the numbers are what they are (KHR_mesh_quantization).
        file["accessors"][1]["normalized"] = json!(false);
        assert!(mesh(&file).uvs[0][0].y > 100.0);
    }
}

#[test]
fn indices_of_all_widths() {
    let wide = [le![0u8, 1u8, 2u8, 2u8, 1u8, 3u8], le![0u32, 1u32, 2u32, 2u32, 1u32, 3u32]];
    for (bytes, component) in wide.into_iter().zip([U8, U32]) {
        let mut file = square();
        file["buffers"][1] = json!({ "byteLength": bytes.len(), "uri": data_uri(&bytes) });
        file["bufferViews"][1]["byteLength"] = json!(bytes.len());
        file["accessors"][1]["componentType"] = json!(component);
        assert_eq!(mesh(&file).triangles, [[0, 1, 2], [2, 1, 3]]);
    }
}

fn sparse_square(indices: [u16; 2], count: u64) -> Value {
    let mut file = asset(
        &[floats(&SQUARE), le![indices[0], indices[1]], floats(&[5., 5., 5., 6., 6., 6.])],
        &[(0, F32, "VEC3", 4)],
        json!({ "attributes": { "POSITION": 0 }, "mode": 5 }),
    );
    file["accessors"][0]["sparse"] = json!({
        "count": count,
        "indices": { "bufferView": 1, "componentType": U16 },
        "values": { "bufferView": 2 },
    });
    file
}

#[test]
fn sparse_accessors_with_and_without_a_base() {
    let mut file = sparse_square([1, 3], 2);
    assert_eq!(mesh(&file).positions, [Vec3::ZERO, Vec3::splat(5.), Vec3::Y, Vec3::splat(6.)]);
    file["accessors"][0].as_object_mut().unwrap().remove("bufferView");
    assert_eq!(mesh(&file).positions, [Vec3::ZERO, Vec3::splat(5.), Vec3::ZERO, Vec3::splat(6.)]);
}

#[test]
fn sparse_indices_out_of_range_or_order_are_refused() {
    refused(&sparse_square([1, 4], 2), "/accessors/0/sparse/indices", "beyond");
    refused(&sparse_square([3, 1], 2), "/accessors/0/sparse/indices", "not larger");
    refused(&sparse_square([1, 1], 2), "/accessors/0/sparse/indices", "not larger");
    refused(&sparse_square([1, 3], 3), "/accessors/0/sparse", "do not fit");
    refused(&sparse_square([1, 3], 5), "/accessors/0/sparse", "replaces 5 elements of 4");
    refused(&sparse_square([1, 3], 1 << 40), "/accessors/0/sparse/count", "sparse substitutions");
}

#[test]
fn an_accessor_without_bytes_is_zero() {
    let mut file = square();
    push(&mut file["accessors"], json!({ "componentType": F32, "type": "VEC2", "count": 4 }));
    file["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_0"] = json!(2);
    assert_eq!(mesh(&file).uvs[0], [Vec2::ZERO; 4]);
    file["accessors"][2]["count"] = json!(1u64 << 50);
    refused(&file, "/accessors/2/count", "without data");
}

#[test]
fn a_primitive_whose_data_is_elsewhere_is_left_out() {
    let mut file = square();
    file["buffers"][0].as_object_mut().unwrap().remove("uri");
    let model = warned(&file, "no data in this file");
    assert!(model.meshes.is_empty() && model.instances.is_empty());
}

#[test]
fn lying_counts_offsets_and_lengths_are_refused() {
    let refuse = |path: &str, value: Value, pointer: &str, text: &str| {
        let mut file = square();
        *file.pointer_mut(path).unwrap() = value;
        refused(&file, pointer, text);
    };
    refuse("/accessors/0/count", json!(5), "/accessors/0", "do not fit");
    refuse("/accessors/0/count", json!(u64::MAX >> 1), "/accessors/0", "do not fit");
    refuse("/accessors/0/type", json!("VEC5"), "/accessors/0/type", "VEC4");
    refuse("/accessors/0/componentType", json!(5124), "/accessors/0/componentType", "5126");
    refuse("/bufferViews/0/byteLength", json!(49), "/bufferViews/0", "more than the 48");
    refuse("/buffers/0/byteLength", json!(1u64 << 40), "/buffers/0/byteLength", "only 48 bytes");
    let mut file = square();
    file["accessors"][0]["byteOffset"] = json!(u64::MAX >> 1);
    refused(&file, "/accessors/0", "do not fit");
    file["bufferViews"][0]["byteOffset"] = json!(u64::MAX >> 1);
    refused(&file, "/bufferViews/0", "more than");
    let mut file = square();
    file["bufferViews"][0]["byteStride"] = json!(4);
    refused(&file, "/accessors/0", "overlap");
}

#[test]
fn references_to_what_does_not_exist_are_refused() {
    let refuse = |path: &str, value: Value, text: &str| {
        let mut file = square();
        let (parent, key) = path.rsplit_once('/').unwrap();
        let parent = file.pointer_mut(parent).unwrap();
        match key.parse::<usize>() {
            Ok(i) => parent[i] = value,
            Err(_) => parent[key] = value,
        }
        refused(&file, path, text);
    };
    refuse("/scene", json!(1), "scene 1");
    refuse("/scene", json!("x"), "not an index");
    refuse("/scenes/0/nodes/0", json!(9), "node 9");
    refuse("/nodes/0/mesh", json!(1), "mesh 1, but there is 1");
    refuse("/nodes/0/camera", json!(0), "camera 0");
    refuse("/nodes/0/skin", json!(0), "skin 0");
    refuse("/meshes/0/primitives/0/material", json!(0), "material 0");
    refuse("/meshes/0/primitives/0/indices", json!(2), "accessor 2");
    refuse("/meshes/0/primitives/0/attributes/POSITION", json!(2), "accessor 2, but there are 2");
    refuse("/meshes/0/primitives/0/mode", json!(7), "0 to 6");
    refuse("/accessors/0/bufferView", json!(2), "bufferView 2");
    refuse("/bufferViews/0/buffer", json!(2), "buffer 2");
}
