//! Draco and meshopt: streams that the reference encoders made of the square, back to the square.

use glam::{Quat, Vec2, Vec3, Vec4};
use serde_json::json;

use super::*;

/// By meshoptimizer 1.0: `encodeVertexBuffer`, versions 0 and 1, and version 0 over `encodeFilterExp` with 15 bits.
const POSITIONS: [(&str, &str); 3] = [
    ("NONE", "oAAAAT8AAAD///8BPwAAAH59fgAAAQwAAAD/AQwAAAB+AAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAA"),
    ("NONE", "ofrqqgAA/wAAf35/AAB/AAAAAAAAAAAAAAAAAAAAAAAAAAAAAAEBAA=="),
    (
        "EXPONENTIAL",
        "oAABPwAAAEA/QAABIAAAAAABDAAAAEAAAQgAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAADyAAAA8gAAAPI=",
    ),
];
/// `encodeIndexBuffer` and `encodeIndexSequence` of 0 1 2 2 1 3.
const TRIANGLES: &str = "4fAQAHaHVmd4qYZliWiYAWkAAA==";
const INDICES: &str = "0QAEBAACCAAAAAA=";
/// `encodeFilterOct` with 8 bits of +Z, (0.6, 0, 0.8), (0, −0.6, −0.8), +X.
const OCTAHEDRAL: &str = "oAE/AAAAbCZsAQ8AAAD9/gAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAfwA=";
/// `encodeFilterColor` with 8 bits of white, (1, 0, 0, 0.5), (0.2, 0.4, 0.6, 1), nothing; version 1.
const COLORS: &str = "of8AgkzLAP6cZgB9fgAAfX79AAAAAAAAAAAAAAAAAAAAAAAAAP8AAP8A";
/// `encodeFilterQuat` with 16 bits of these four.
const ROTATIONS: &str = "oAE/AAAA+/zIAT8AAAC0s9kBPgAAAPz9AT8AAAC1S/0BPAAAAPv8ATwAAAC0swE7AAAABQQAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAA/38=";
const TURNS: [[f32; 4]; 4] = [
    [0., 0., 0., 1.],
    [0.5, 0.5, -0.5, 0.5],
    [0., std::f32::consts::FRAC_1_SQRT_2, 0., std::f32::consts::FRAC_1_SQRT_2],
    [0.6, 0., 0., -0.8],
];

/// By Draco: the square with UV (0: positions, 1: UV, 2: colours), sequential and not quantised, and by edgebreaker with 11
/// bits, which orders the vertices in its own way.
const DRACO: [&str; 2] = [
    "RFJBQ08CAgEAAAACBAEAAQICAQMBAwAJAwAAAwkCAAECAgQAAgAAAQAAAAAAAAAAAAAAAAAAgD8AAAAAAAAAAAAAAAAAAIA/AAAAAAAAgD8AAIA/AAAAAAAAAAAAAIA/AACAPwAAgD8AAAAAAAAAAAAAgD8AAAAAAAEBAAYDARABIAcBEAMAkJBpgCEhdAAAAAD/AAAA",
    "RFJBQ08CAgEBAAAABAICAgAAAR//ARH/ARH/ARED/wAAAAAAAQAAAQAJAwAAAgEDCQIAAQIBAgIEAAIBAQEBAAMDATABEAMAJIJKBAAAAAD/BwAAAAAAAAAAAAAAAAAAAACAPwsFAQEAAgMBQAEADAIAAAABASAAAAAA/wcAAAAAAAAAAAAAAACAPwsBAQEABgMBEAEQBwEgAwBQkUwipXNBQgAAAAAA/wAAAA==",
];

fn uri(base64: &str) -> String {
    format!("data:;base64,{base64}")
}

fn length(base64: &str) -> usize {
    BASE64_STANDARD.decode(base64).expect("base64").len()
}

/// Makes view `view` of `count` elements of `stride` bytes a compressed one.
fn compress(
    file: &mut Value,
    view: usize,
    base64: &str,
    [count, stride]: [usize; 2],
    mode: &str,
    filter: &str,
) {
    let buffer = file["buffers"].as_array().unwrap().len();
    push(&mut file["buffers"], json!({ "byteLength": length(base64), "uri": uri(base64) }));
    // The fallback is not there.
    file["buffers"][view] = json!({ "byteLength": count * stride });
    file["bufferViews"][view] = json!({
        "buffer": view, "byteLength": count * stride,
        "extensions": { "EXT_meshopt_compression": {
            "buffer": buffer, "byteLength": length(base64), "byteStride": stride, "count": count, "mode": mode, "filter": filter,
        } },
    });
}

#[test]
fn meshopt_modes_and_filters() {
    for (filter, positions) in POSITIONS {
        for (mode, indices) in [("TRIANGLES", TRIANGLES), ("INDICES", INDICES)] {
            let mut file = square();
            compress(&mut file, 0, positions, [4, 12], "ATTRIBUTES", filter);
            compress(&mut file, 1, indices, [6, 2], mode, "NONE");
            let (plain, mesh) = (mesh(&square()), mesh(&file));
            assert_eq!(mesh.triangles, plain.triangles, "{mode}");
            assert_eq!(mesh.positions, plain.positions, "{filter}");
        }
    }
    let mut file = asset(
        &[floats(&SQUARE), vec![0; 16], vec![0; 16], vec![0; 32]],
        &[(0, F32, "VEC3", 4), (1, I8, "VEC3", 4), (2, U8, "VEC4", 4), (3, I16, "VEC4", 4)],
        json!({ "attributes": { "POSITION": 0, "NORMAL": 1, "COLOR_0": 2 }, "mode": 5 }),
    );
    for accessor in 1..4 {
        file["accessors"][accessor]["normalized"] = json!(true);
    }
    compress(&mut file, 1, OCTAHEDRAL, [4, 4], "ATTRIBUTES", "OCTAHEDRAL");
    file["bufferViews"][1]["byteStride"] = json!(4);
    compress(&mut file, 2, COLORS, [4, 4], "ATTRIBUTES", "COLOR");
    compress(&mut file, 3, ROTATIONS, [4, 8], "ATTRIBUTES", "QUATERNION");
    file["nodes"][0]["extensions"] =
        json!({ "EXT_mesh_gpu_instancing": { "attributes": { "ROTATION": 3 } } });
    let model = model(&file);
    let normals = [Vec3::Z, Vec3::new(0.6, 0., 0.8), Vec3::new(0., -0.6, -0.8), Vec3::X];
    for (found, expected) in model.meshes[0].normals.iter().zip(normals) {
        assert!(found.abs_diff_eq(expected, 0.02), "{found} is not {expected}");
    }
    let colors = [Vec4::ONE, Vec4::new(1., 0., 0., 0.5), Vec4::new(0.2, 0.4, 0.6, 1.), Vec4::ZERO];
    for (found, expected) in model.meshes[0].colors.iter().zip(colors) {
        assert!(found.abs_diff_eq(expected, 0.02), "{found} is not {expected}");
    }
    for (instance, turn) in model.instances.iter().zip(TURNS) {
        let expected = Quat::from_array(turn) * Vec3::new(1., 2., 3.);
        let found = instance.to_world.transform_vector3(Vec3::new(1., 2., 3.));
        assert!(found.abs_diff_eq(expected, 1e-3), "{found} is not {expected}");
    }
}

#[test]
fn meshopt_that_lies_is_refused() {
    const AT: &str = "/bufferViews/0/extensions/EXT_meshopt_compression";
    let refuse = |key: &str, value: Value, pointer: &str, text: &str| {
        let mut file = square();
        compress(&mut file, 0, POSITIONS[0].1, [4, 12], "ATTRIBUTES", "NONE");
        file["bufferViews"][0]["extensions"]["EXT_meshopt_compression"][key] = value;
        refused(&file, &format!("{AT}{pointer}"), text);
    };
    refuse("count", json!(5), "", "byteLength of 48");
    refuse("count", json!(1u64 << 62), "", "byteLength of 48");
    refuse("byteStride", json!(6), "/byteStride", "does not allow");
    refuse("mode", json!("POINTS"), "/mode", "POINTS");
    refuse("filter", json!("WAVELET"), "/filter", "WAVELET");
    refuse("filter", json!("OCTAHEDRAL"), "", "cannot be decoded");
    refuse("byteLength", json!(40), "", "cannot be decoded");
    refuse("byteLength", json!(400), "", "does not hold");
    refuse("buffer", json!(9), "", "does not hold");
    refuse("byteOffset", json!(u64::MAX >> 1), "", "does not hold");
    let mut file = square();
    compress(&mut file, 0, POSITIONS[0].1, [1 << 28, 12], "ATTRIBUTES", "NONE");
    refused(&file, "/bufferViews", "once decompressed");
}

/// The square with its attributes in a Draco stream alone.
fn draco(stream: &str) -> Value {
    let mut file = asset(
        &[vec![0; length(stream)]],
        &[(0, F32, "VEC3", 4), (0, U16, "SCALAR", 6), (0, F32, "VEC2", 4), (0, U8, "VEC4", 4)],
        json!({
            "attributes": { "POSITION": 0, "TEXCOORD_0": 2, "COLOR_0": 3, "_ID": 3 }, "indices": 1,
            "extensions": { "KHR_draco_mesh_compression": {
                "bufferView": 0, "attributes": { "POSITION": 0, "TEXCOORD_0": 1, "COLOR_0": 2, "_X": 9 },
            } },
        }),
    );
    file["buffers"][0]["uri"] = json!(uri(stream));
    for accessor in file["accessors"].as_array_mut().unwrap() {
        accessor.as_object_mut().unwrap().remove("bufferView");
    }
    file["accessors"][3]["normalized"] = json!(true);
    file
}

/// What the fuzzer adds to its file: a Draco primitive and a meshopt view.
pub fn add(file: &mut Value) {
    let buffer = file["buffers"].as_array().unwrap().len();
    let view = file["bufferViews"].as_array().unwrap().len();
    push(&mut file["buffers"], json!({ "byteLength": length(DRACO[1]), "uri": uri(DRACO[1]) }));
    push(&mut file["buffers"], json!({ "byteLength": length(OCTAHEDRAL), "uri": uri(OCTAHEDRAL) }));
    push(&mut file["bufferViews"], json!({ "buffer": buffer, "byteLength": length(DRACO[1]) }));
    push(
        &mut file["bufferViews"],
        json!({ "buffer": buffer + 1, "byteLength": 16, "byteStride": 4, "extensions": { "EXT_meshopt_compression": {
            "buffer": buffer + 1, "byteLength": length(OCTAHEDRAL), "byteStride": 4, "count": 4, "mode": "ATTRIBUTES", "filter": "OCTAHEDRAL",
        } } }),
    );
    let accessor = file["accessors"].as_array().unwrap().len();
    push(&mut file["accessors"], json!({ "componentType": F32, "type": "VEC3", "count": 4 }));
    push(
        &mut file["accessors"],
        json!({ "bufferView": view + 1, "componentType": I8, "type": "VEC3", "count": 4, "normalized": true }),
    );
    push(
        &mut file["meshes"][0]["primitives"],
        json!({
            "attributes": { "POSITION": accessor, "NORMAL": accessor + 1 },
            "extensions": { "KHR_draco_mesh_compression": { "bufferView": view, "attributes": { "POSITION": 0 } } },
        }),
    );
}

#[test]
fn draco_brings_back_every_corner() {
    let colors =
        [[1., 0., 0., 1.], [0., 1., 0., 1.], [0., 0., 1., 1.], [9. / 255., 8. / 255., 7. / 255., 6. / 255.]];
    for stream in DRACO {
        let mut mesh = mesh(&draco(stream));
        assert_eq!((mesh.positions.len(), mesh.triangles.len()), (4, 2));
        for i in 0..4 {
            let p = mesh.positions[i];
            let corner = p.round();
            assert!(p.abs_diff_eq(corner, 1e-3), "{p}");
            assert!(
                mesh.uvs[0][i].abs_diff_eq(Vec2::new(corner.x, 1. - corner.y), 1e-3),
                "{}",
                mesh.uvs[0][i]
            );
            let which = corner.x as usize + 2 * corner.y as usize;
            assert!(mesh.colors[i].abs_diff_eq(Vec4::from(colors[which]), 1e-6), "{}", mesh.colors[i]);
        }
        for triangle in std::mem::take(&mut mesh.triangles) {
            let [a, b, c] = triangle.map(|v| mesh.positions[v as usize]);
            assert!((b - a).cross(c - a).z > 0.9);
        }
    }
}

#[test]
fn draco_that_lies_is_refused() {
    const AT: &str = "/meshes/0/primitives/0/extensions/KHR_draco_mesh_compression";
    let refuse = |key: &str, value: Value, pointer: &str, text: &str| {
        let mut file = draco(DRACO[1]);
        file["meshes"][0]["primitives"][0]["extensions"]["KHR_draco_mesh_compression"][key] = value;
        refused(&file, &format!("{AT}{pointer}"), text);
    };
    refuse("bufferView", json!(7), "/bufferView", "bufferView 7");
    refuse("attributes", json!({ "NORMAL": 0 }), "/attributes/NORMAL", "not an attribute");
    refuse("attributes", json!({ "POSITION": 5 }), "", "no attribute 5");
    refuse("attributes", json!({ "POSITION": 1 }), "", "2 components, but POSITION has 3");
    refuse("attributes", json!([]), "", "invalid type");
    let mut file = draco(DRACO[1]);
    file["meshes"][0]["primitives"][0]["mode"] = json!(6);
    refused(&file, AT, "another mode");
    let mut file = draco(DRACO[1]);
    file["bufferViews"][0]["byteLength"] = json!(60);
    refused(&file, AT, "cannot be decoded");
}

#[test]
fn primitives_share_a_stream() {
    let mut file = draco(DRACO[0]);
    let primitive = file["meshes"][0]["primitives"][0].clone();
    push(&mut file["meshes"][0]["primitives"], primitive);
    let model = model(&file);
    assert_eq!((model.meshes.len(), model.instances.len()), (1, 2));
}
