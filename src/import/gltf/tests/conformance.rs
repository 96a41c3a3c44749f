//! What the specification forbids is told, at its place, whether it is shown or not; what it allows is not.

use serde_json::json;

use super::*;

/// A document that breaks no rule and has a little of everything: skin, morph targets, animations, a camera, a light, a texture.
pub fn conforming() -> Value {
    let identity = [1., 0., 0., 0., 0., 1., 0., 0., 0., 0., 1., 0., 0., 0., 0., 1.];
    let mut file = asset(
        &[
            floats(&SQUARE),
            le![0u16, 1u16, 2u16, 2u16, 1u16, 3u16],
            floats(&[0., 0., 1.].repeat(4)),
            floats(&[1., 0., 0., 1.].repeat(4)),
            floats(&[0., 0., 1., 0., 0., 1., 1., 1.]),
            floats(&[0.5, 0.5, 0.5, 1.].repeat(4)),
            [0u8, 1, 0, 0].repeat(4),
            floats(&[0.5, 0.5, 0., 0.].repeat(4)),
            floats(&identity.repeat(2)),
            floats(&[0., 1., 2.]),
            floats(&[0., 0., 0., 1.].repeat(3)),
            floats(&[0., 0.5, 1.]),
            floats(&[0.; 12]),
        ],
        &[
            (0, F32, "VEC3", 4),
            (1, U16, "SCALAR", 6),
            (2, F32, "VEC3", 4),
            (3, F32, "VEC4", 4),
            (4, F32, "VEC2", 4),
            (5, F32, "VEC4", 4),
            (6, U8, "VEC4", 4),
            (7, F32, "VEC4", 4),
            (8, F32, "MAT4", 2),
            (9, F32, "SCALAR", 3),
            (10, F32, "VEC4", 3),
            (11, F32, "SCALAR", 3),
            (12, F32, "VEC3", 4),
        ],
        json!({
            "attributes": {
                "POSITION": 0, "NORMAL": 2, "TANGENT": 3, "TEXCOORD_0": 4, "COLOR_0": 5, "JOINTS_0": 6, "WEIGHTS_0": 7,
            },
            "indices": 1, "material": 0, "targets": [{ "POSITION": 12 }],
        }),
    );
    file["meshes"][0]["weights"] = json!([0.5]);
    file["nodes"] = json!([
        { "mesh": 0, "skin": 0 },
        { "children": [2, 3], "matrix": identity },
        { "rotation": [0, 0, 0, 1] },
        { "camera": 0, "extensions": { "KHR_lights_punctual": { "light": 0 } } },
    ]);
    file["scenes"] = json!([{ "nodes": [0, 1] }]);
    file["skins"] = json!([{ "joints": [1, 2], "inverseBindMatrices": 8, "skeleton": 1 }]);
    file["cameras"] =
        json!([{ "type": "perspective", "perspective": { "yfov": 0.5, "znear": 0.1, "zfar": 9.0 } }]);
    file["extensions"] = json!({ "KHR_lights_punctual": { "lights": [{ "type": "spot", "spot": {} }] } });
    file["materials"] = json!([{
        "pbrMetallicRoughness": { "baseColorTexture": { "index": 0 }, "roughnessFactor": 0.5 },
        "extensions": { "KHR_materials_clearcoat": { "clearcoatFactor": 0.5 } },
    }]);
    // What nothing shows is looked at all the same.
    for section in ["materials", "cameras"] {
        let unused = file[section][0].clone();
        push(&mut file[section], unused);
    }
    push(&mut file["extensions"]["KHR_lights_punctual"]["lights"], json!({ "type": "spot", "spot": {} }));
    file["images"] = json!([{ "uri": data_uri(&png()), "mimeType": "image/png" }]);
    file["textures"] = json!([{ "source": 0 }]);
    file["animations"] = json!([{
        "channels": [
            { "sampler": 0, "target": { "node": 2, "path": "rotation" } },
            { "sampler": 1, "target": { "node": 0, "path": "weights" } },
        ],
        "samplers": [{ "input": 9, "output": 10 }, { "input": 9, "output": 11 }],
    }]);
    file
}

fn png() -> Vec<u8> {
    let mut png = Vec::new();
    let image = image::RgbImage::from_pixel(2, 2, image::Rgb([9; 3]));
    image.write_to(&mut std::io::Cursor::new(&mut png), image::ImageFormat::Png).unwrap();
    png
}

/// All that is said of `file`, whether it loads or not.
fn told(file: &Value) -> Vec<Diagnostic> {
    import(file).map_or_else(|errors| errors, |model| model.warnings)
}

#[test]
fn what_is_allowed_is_not_told() {
    assert_eq!(told(&conforming()), []);
    assert_eq!(told(&square()), []);
}

/// Each replaces a value of the conforming document (`null` takes it away), and is told at a pointer with some words.
const FAULTS: &[(&str, &str, &str, &str)] = &[
    // Types, ranges, what must be there.
    (
        "/materials/1/pbrMetallicRoughness/roughnessFactor",
        "1.5",
        "/materials/1/pbrMetallicRoughness/roughnessFactor",
        "more than 1",
    ),
    (
        "/materials/1/extensions/KHR_materials_clearcoat/clearcoatFactor",
        "-1",
        "/materials/1/extensions/KHR_materials_clearcoat/clearcoatFactor",
        "less than 0",
    ),
    ("/cameras/1/perspective/znear", "10", "/cameras/1/perspective", "not less than `zfar`"),
    (
        "/extensions/KHR_lights_punctual/lights/1/spot/innerConeAngle",
        "1.0",
        "/extensions/KHR_lights_punctual/lights/1/spot",
        "`outerConeAngle`",
    ),
    ("/skins/0/joints", "[1, 2, 2]", "/skins/0/joints/2", "listed twice"),
    ("/nodes/1/translation", "[0, 0, 0]", "/nodes/1/matrix", "beside `translation`"),
    ("/nodes/2/rotation", "[0, 0, 0, 0.9]", "/nodes/2/rotation", "has length"),
    ("/textures", "[]", "/textures", "is empty"),
    ("/asset/copyright", "7", "/asset/copyright", "is a number, not a string"),
    ("/images/0/uri", "\"a%zz.png\"", "/images/0", "a%zz.png"),
    // Extensions.
    (
        "/nodes/1/extensions",
        "{\"KHR_materials_clearcoat\": {}}",
        "/nodes/1/extensions/KHR_materials_clearcoat",
        "does not belong",
    ),
    (
        "/extensionsUsed",
        "[\"KHR_lights_punctual\"]",
        "/materials/0/extensions/KHR_materials_clearcoat",
        "not listed",
    ),
    // Accessors and views.
    ("/accessors/12/normalized", "true", "/accessors/12/normalized", "cannot be normalized"),
    ("/bufferViews/8/byteStride", "64", "/skins/0/inverseBindMatrices", "byteStride"),
    ("/bufferViews/1/target", "34962", "/meshes/0/primitives/0/indices", "vertex attributes"),
    ("/accessors/0/min/0", "-5.0", "/accessors/0/min/0", "least value"),
    ("/accessors/0/max", "null", "/meshes/0/primitives/0/attributes/POSITION", "`min` and `max`"),
    ("/animations/0/samplers/1/output", "12", "/animations/0/samplers/1/output", "elsewhere"),
    // Nodes and skins.
    ("/nodes/1/matrix/4", "0.5", "/nodes/1/matrix", "translation, rotation and scale"),
    ("/skins/0/skeleton", "2", "/skins/0/skeleton", "not above all joints"),
    ("/scenes/0/nodes", "[0]", "/nodes/0", "scene 0"),
    ("/nodes/0/weights", "[1, 2]", "/nodes/0/weights", "1 morph targets"),
    // Primitives.
    (
        "/meshes/0/primitives/0/attributes/FOO",
        "2",
        "/meshes/0/primitives/0/attributes/FOO",
        "not an attribute",
    ),
    ("/meshes/0/primitives/0/attributes/COLOR_2", "5", "/meshes/0/primitives/0/attributes", "sets of COLOR"),
    ("/meshes/0/primitives/0/attributes/WEIGHTS_0", "null", "/meshes/0/primitives/0/attributes", "JOINTS"),
    (
        "/meshes/0/primitives/0/targets/0/COLOR_1",
        "5",
        "/meshes/0/primitives/0/targets/0/COLOR_1",
        "not an attribute of the primitive",
    ),
    ("/meshes/0/weights", "[1, 2]", "/meshes/0/weights", "has 2 elements"),
    (
        "/materials/0/pbrMetallicRoughness/baseColorTexture/texCoord",
        "1",
        "/meshes/0/primitives/0/material",
        "TEXCOORD_1",
    ),
    (
        "/meshes/0/primitives/0/targets/0/POSITION",
        "3",
        "/meshes/0/primitives/0/targets/0/POSITION",
        "VEC4 f32",
    ),
    // Animations.
    ("/animations/0/channels/0/target/node", "1", "/animations/0/channels/0/target", "`matrix`"),
    ("/animations/0/channels/0/target/path", "\"scale\"", "/animations/0/channels/0/sampler", "VEC4 f32"),
    (
        "/animations/0/samplers/0/interpolation",
        "\"CUBICSPLINE\"",
        "/animations/0/channels/0/sampler",
        "not 9",
    ),
    ("/animations/0/samplers/0/input", "11", "/animations/0/samplers/1/output", "elsewhere"),
    // Images.
    ("/images/0/mimeType", "\"image/jpeg\"", "/images/0/uri", "of type image/png"),
    ("/images/0", "{\"uri\": \"nowhere.png\"}", "/images/0", "nowhere.png"),
];

#[test]
fn faults_are_told_at_their_place() {
    let mut missed = Vec::new();
    for (place_of_fault, value, pointer, words) in FAULTS {
        let mut file = declaring(&conforming());
        let (parent, key) = place_of_fault.rsplit_once('/').expect("a pointer");
        let holder = file.pointer_mut(parent).unwrap_or_else(|| panic!("{parent} is not there"));
        let value: Value = serde_json::from_str(value).expect("JSON");
        match holder {
            Value::Array(items) => items[key.parse::<usize>().expect("an index")] = value,
            _ if value.is_null() => drop(holder.as_object_mut().expect("an object").remove(key)),
            _ => holder[key] = value,
        }
        let told = told(&file);
        if !told.iter().any(|d| place(d) == *pointer && d.message.contains(words)) {
            missed.push(format!("{place_of_fault}: not at {pointer} with {words:?}: {told:#?}"));
        }
    }
    assert!(missed.is_empty(), "{}", missed.join("\n"));
}

/// Puts `bytes` in the place of those of buffer `i`.
fn with_data(i: usize, bytes: &[u8]) -> Value {
    let mut file = conforming();
    file["buffers"][i] = json!({ "byteLength": bytes.len(), "uri": data_uri(bytes) });
    let accessor = file["accessors"][i].clone();
    file["accessors"][i] = bounded(accessor, bytes);
    file
}

#[test]
fn data_is_held_to_what_it_is_used_for() {
    let primitive = |rest: &str| format!("/meshes/0/primitives/0/{rest}");
    let faults = [
        (
            2,
            floats(&[0., 0., 1., 0., 0., 2., 0., 0., 1., 0., 0., 1.]),
            primitive("attributes/NORMAL"),
            "first 1",
        ),
        (3, floats(&[1., 0., 0., 0.5].repeat(4)), primitive("attributes/TANGENT"), "w 1 or -1"),
        (5, floats(&[0.5, 0.5, 1.5, 1.].repeat(4)), primitive("attributes/COLOR_0"), "1.5"),
        (1, le![0u16, 1u16, 2u16, 2u16, 1u16, 9u16], primitive("indices"), "vertex 9"),
        (1, le![0u16, 1u16, 2u16, 2u16, 1u16, 65535u16], primitive("indices"), "65535"),
        (6, [0u8, 7, 0, 0].repeat(4), primitive("attributes/JOINTS_0"), "joint 7"),
        (6, [1u8, 1, 0, 0].repeat(4), primitive("attributes/JOINTS_0"), "two weights"),
        (7, floats(&[0.5, 0.4, 0., 0.].repeat(4)), primitive("attributes/WEIGHTS_0"), "sum to 1"),
        (7, floats(&[1.5, -0.5, 0., 0.].repeat(4)), primitive("attributes/WEIGHTS_0"), "negative"),
        (8, floats(&[1.; 32]), "/skins/0/inverseBindMatrices".into(), "0 0 0 1"),
        (9, floats(&[0., 1., 1.]), "/animations/0/samplers/0/input".into(), "first 2"),
        (9, floats(&[-1., 1., 2.]), "/animations/0/samplers/0/input".into(), "negative"),
        (10, floats(&[0., 0., 0., 2.].repeat(3)), "/animations/0/channels/0/sampler".into(), "unit"),
        (12, floats(&[f32::NAN; 12]), "/accessors/12".into(), "not finite"),
    ];
    for (buffer, bytes, pointer, words) in faults {
        let told = told(&with_data(buffer, &bytes));
        let found = told.iter().any(|d| place(d) == pointer && d.message.contains(words));
        assert!(found, "nothing at {pointer} with {words:?}: {told:#?}");
    }
}

#[test]
fn images_are_looked_at_though_nothing_shows_them() {
    let told_of = |bytes: &[u8]| {
        let mut file = conforming();
        let uri = format!("data:;base64,{}", BASE64_STANDARD.encode(bytes));
        push(&mut file["images"], json!({ "uri": uri }));
        told(&file).iter().map(|d| (place(d).to_owned(), d.message.clone())).collect::<Vec<_>>()
    };
    let png = png();
    assert_eq!(told_of(&png), []);
    for length in [20, 40, png.len() - 1] {
        assert!(told_of(&png[..length])[0].1.contains("cut off"), "{length}: {:?}", told_of(&png[..length]));
    }
    let jpeg = b"\xFF\xD8\xFF\xE0\0\x01";
    assert!(told_of(jpeg)[0].1.contains("impossible length"));
    let webp = b"RIFF\x0C\0\0\0WEBPVP8L\0\0\0\0";
    assert!(told_of(webp)[0].1.contains("EXT_texture_webp"));
}

/// What is wrong a thousand times is listed a few times and counted; what the import refuses is not said again.
#[test]
fn reports_stay_short() {
    let mut file = square();
    file["materials"] = json!(vec![json!({ "alphaCutoff": -1 }); 1000]);
    let found = told(&file);
    assert!(found.len() < 20 && found.last().unwrap().message.contains("992 more"), "{found:#?}");
    file = square();
    file["nodes"][0]["mesh"] = json!(7);
    assert_eq!(told(&file).iter().filter(|d| place(d) == "/nodes/0/mesh").count(), 1);
}

/// Counts and references that are absurd cost nothing.
#[test]
fn absurd_documents_are_looked_at_quickly() {
    let start = std::time::Instant::now();
    let mut file = square();
    // A million nodes in a chain, joints at both ends.
    let n = 200_000;
    file["nodes"] =
        (0..n).map(|i| if i + 1 < n { json!({ "children": [i + 1] }) } else { json!({}) }).collect();
    file["skins"] = json!(vec![json!({ "joints": [0, n - 1], "skeleton": n / 2 }); 1000]);
    assert!(told(&file).iter().any(|d| d.message.contains("not above all joints")));
    // As many looks at the same data as a document can ask for.
    let mut file = square();
    file["buffers"][0] = json!({ "byteLength": 1 << 20, "uri": data_uri(&vec![0; 1 << 20]) });
    file["bufferViews"][0]["byteLength"] = json!(1 << 20);
    let json = json!({ "bufferView": 0, "componentType": U8, "type": "SCALAR", "count": 1 << 20 });
    file["accessors"].as_array_mut().unwrap().extend(vec![json; 10_000]);
    told(&file);
    assert!(start.elapsed().as_secs() < 20, "{:?}", start.elapsed());
}
