//! GLB framing, JSON, versions, extensions, URIs.

use std::path::Path;

use serde_json::json;

use super::*;
use crate::import::gltf::uri;

fn import_bytes(bytes: &[u8]) -> Outcome {
    crate::import::gltf::import(bytes, Path::new("asset.glb"), &Selection::default())
}

fn square_glb() -> Vec<u8> {
    let bin: Vec<u8> = [floats(&SQUARE), le![0u16, 1u16, 2u16, 2u16, 1u16, 3u16]].concat();
    let mut json = square();
    json["buffers"] = json!([{ "byteLength": bin.len() }]);
    json["bufferViews"] = json!([
        { "buffer": 0, "byteLength": 48 },
        { "buffer": 0, "byteOffset": 48, "byteLength": 12 },
    ]);
    glb(&json, &bin)
}

#[test]
fn glb_loads() {
    let model = import_bytes(&square_glb()).expect("a valid GLB");
    assert_eq!(model.meshes[0].triangles, [[0, 1, 2], [2, 1, 3]]);
    assert!(model.warnings.is_empty(), "{:?}", model.warnings);
}

#[test]
fn unknown_chunks_are_skipped() {
    let mut bytes = square_glb();
    let json_end = 20 + u32::from_le_bytes(bytes[12..16].try_into().unwrap()) as usize;
    bytes.splice(json_end..json_end, [le![4u32], b"ABCDwxyz".to_vec()].concat());
    let length = (bytes.len() as u32).to_le_bytes();
    bytes[8..12].copy_from_slice(&length);
    assert_eq!(import_bytes(&bytes).expect("a valid GLB").meshes[0].triangles.len(), 2);
}

#[test]
fn every_truncation_of_a_glb_is_refused() {
    let bytes = square_glb();
    for length in 0..bytes.len() {
        assert!(import_bytes(&bytes[..length]).is_err(), "{length} bytes pass");
    }
}

#[test]
fn lying_lengths_are_refused() {
    for at in [8, 12] {
        let mut bytes = square_glb();
        bytes[at..at + 4].copy_from_slice(&u32::MAX.to_le_bytes());
        // The total length alone may lie, with a warning: the chunks say what there is.
        match import_bytes(&bytes) {
            Ok(model) => assert!(at == 8 && model.warnings.len() == 1),
            Err(errors) => assert!(errors[0].message.contains("cut off"), "{errors:?}"),
        }
    }
}

#[test]
fn glb_version_1_is_refused() {
    let mut bytes = square_glb();
    bytes[4] = 1;
    assert!(import_bytes(&bytes).expect_err("version 1")[0].message.contains("version 1"));
}

#[test]
fn byte_order_mark_is_skipped() {
    assert!(import_text(&format!("\u{FEFF}{}", square())).is_ok());
}

#[test]
fn what_is_not_gltf_is_refused() {
    for text in ["", "  ", "[]", "7", "{", "{\"asset\":", "hello", "glTF", "\0\0\0", &"[".repeat(100_000)] {
        let errors = import_text(text).expect_err("rubbish");
        assert!(
            errors[0].message.contains("glTF") || errors[0].message.contains("GLB"),
            "{text:.20}: {errors:?}"
        );
    }
    assert!(import_bytes(&[0xFF, 0xFE, 0x00, 0x01]).is_err());
}

#[test]
fn versions() {
    let with = |asset: Value| json!({ "asset": asset });
    for fine in [
        json!({ "version": "2.0" }),
        json!({ "version": "2.1" }),
        json!({ "version": "2.7", "minVersion": "2.0" }),
    ] {
        model(&with(fine));
    }
    refused(&with(json!({ "version": "1.0" })), "/asset/version", "glTF 1.0");
    refused(&with(json!({ "version": "3.0" })), "/asset/version", "glTF 3.0");
    refused(&with(json!({ "version": "two" })), "/asset/version", "not a version");
    refused(&with(json!({ "version": 2.0 })), "/asset/version", "missing");
    refused(&with(json!({ "version": "2.1", "minVersion": "2.1" })), "/asset/minVersion", "more than");
    refused(&json!({}), "/asset/version", "missing");
}

#[test]
fn extensions_required_and_used() {
    let mut file = square();
    file["extensionsUsed"] = json!(["KHR_materials_unlit", "VENDOR_clearcoat", "VENDOR_nonsense"]);
    // What an ignored extension holds cannot matter.
    file["materials"] = json!([{ "extensions": { "VENDOR_clearcoat": 7, "VENDOR_volume": [] } }]);
    let model = model(&file);
    let named = |name: &str| model.warnings.iter().filter(|w| w.message.contains(name)).count();
    // Of the one that is not declared both is said, that it is ignored and that it is not declared.
    assert_eq!(["clearcoat", "nonsense", "volume", "unlit"].map(named), [1, 1, 2, 0]);
    file["extensionsRequired"] = json!(["KHR_materials_unlit", "VENDOR_nonsense"]);
    refused(&file, "/extensionsRequired/1", "VENDOR_nonsense");
}

#[test]
fn integers_written_as_floats_are_integers() {
    let text =
        square().to_string().replace("\"count\":4", "\"count\":4.0").replace("\"mesh\":0", "\"mesh\":0.0");
    assert!(text.contains("4.0") && import_text(&text).is_ok());
}

#[test]
fn indices_past_32_bits_do_not_wrap_around() {
    for (key, index) in [("mesh", "4294967296"), ("mesh", "-1"), ("mesh", "0.5"), ("mesh", "1e30")] {
        let text = square().to_string().replace(&format!("\"{key}\":0"), &format!("\"{key}\":{index}"));
        assert!(import_text(&text).is_err(), "{key} {index}");
    }
}

#[test]
fn errors_are_collected_and_capped() {
    let mut file = square();
    file["accessors"] = json!(vec![json!({ "count": 1 }); 1000]);
    let errors = import(&file).expect_err("many errors");
    assert!(errors.len() == 101 && errors[100].message.contains("900 more"), "{}", errors.len());
    assert_eq!(place(&errors[7]), "/accessors/7");
}

#[test]
fn uris_stay_in_the_folder() {
    let folder = Path::new("/asset/folder");
    for (uri, path) in
        [("a.bin", "a.bin"), ("b/../a%20b.bin", "a b.bin"), ("./x/./y", "x/y"), ("x\\y.png", "x/y.png")]
    {
        assert_eq!(uri::resolve(uri, folder), Ok(folder.join(path)), "{uri}");
    }
    let outside = [
        "../a.bin",
        "b/../../a.bin",
        "/etc/passwd",
        "%2e%2e/a.bin",
        "%2Fetc%2Fpasswd",
        "..\\a.bin",
        "",
        ".",
        "b/..",
        "file:///etc/passwd",
        "file:a.bin",
        "http://example.org/a.bin",
        "C:\\a.bin",
        "DATA",
        "%FF.bin",
    ];
    for uri in outside {
        assert!(uri::resolve(uri, folder).is_err() || uri == "DATA", "{uri}");
    }
}

#[test]
fn data_uris_with_and_without_padding() {
    let read = |uri: &str| uri::read(uri, Path::new(""), u64::MAX);
    for uri in ["data:;base64,AQI=", "data:;base64,AQI", "DATA:a/b;Base64,AQI=", "data:;base64,AQI%3D"] {
        assert_eq!(read(uri), Ok(vec![1, 2]), "{uri}");
    }
    assert_eq!(read("data:text/plain,a%20b"), Ok(b"a b".to_vec()));
    for uri in ["data:;base64,A", "data:;base64,A*==", "data:", "data:;base64"] {
        assert!(read(uri).is_err(), "{uri}");
    }
}

#[test]
fn buffers_from_files_and_their_absence() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("a b.bin"), floats(&SQUARE)).unwrap();
    let mut file = square();
    file["buffers"][0]["uri"] = json!("a%20b.bin");
    let import = |file: &Value| {
        crate::import::gltf::import(
            file.to_string().as_bytes(),
            &folder.path().join("x.gltf"),
            &Selection::default(),
        )
    };
    assert!(import(&file).is_ok());
    for (uri, text) in
        [("gone.bin", "cannot be read"), ("../a.bin", "out of the folder"), ("file:///a.bin", "scheme")]
    {
        file["buffers"][0]["uri"] = json!(uri);
        let errors = import(&file).expect_err("no such buffer");
        assert!(errors[0].message.contains(text) && place(&errors[0]) == "/buffers/0/uri", "{errors:?}");
    }
    file["buffers"][0] = json!({ "byteLength": 1_000_000_000_000_000u64, "uri": "a b.bin" });
    assert!(import(&file).expect_err("too short")[0].message.contains("only 48 bytes"));
}
