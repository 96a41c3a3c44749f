//! Seeded mutations of small valid files: whatever comes out, nothing panics and nothing is out of range.

use std::path::Path;

use serde_json::json;

use super::*;

const MUTATIONS: usize = 20_000;

/// SplitMix64 (Steele, Lea, Flood 2014).
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    fn below(&mut self, n: usize) -> usize {
        (self.next() % n.max(1) as u64) as usize
    }
}

/// Replaces, deletes or repeats bytes, or puts another number where one stands.
fn mutate(bytes: &[u8], random: &mut Random) -> Vec<u8> {
    const NUMBERS: [&str; 10] =
        ["0", "1", "-1", "3", "255", "4294967295", "18446744073709551615", "1e39", "0.5", "null"];
    let mut bytes = bytes.to_vec();
    for _ in 0..=random.below(3) {
        let at = random.below(bytes.len());
        match random.below(9) {
            0 => bytes[at] = random.next() as u8,
            1 => bytes[at] ^= 1 << random.below(8),
            2 => drop(bytes.drain(at..(at + random.below(6)).min(bytes.len()))),
            3 => {
                let piece = bytes[at..(at + random.below(40)).min(bytes.len())].to_vec();
                let to = random.below(bytes.len());
                bytes.splice(to..to, piece);
            }
            _ => {
                let digit = |b: &u8| b.is_ascii_digit();
                if let Some(start) = bytes[at..].iter().position(digit).map(|p| p + at) {
                    let end =
                        bytes[start..].iter().position(|b| !digit(b)).map_or(bytes.len(), |p| p + start);
                    bytes.splice(start..end, NUMBERS[random.below(NUMBERS.len())].bytes());
                }
            }
        }
        if bytes.is_empty() {
            break;
        }
    }
    bytes
}

/// Everything the importer reads, in little: several primitives, sparse and interleaved data, a texture, lights, cameras.
fn rich() -> Value {
    let mut file = asset(
        &[floats(&SQUARE), le![0u16, 1u16, 2u16, 2u16, 1u16, 3u16], le![0u16, 3u16], floats(&[0.5; 6])],
        &[(0, F32, "VEC3", 4), (1, U16, "SCALAR", 6), (0, F32, "VEC3", 4), (0, F32, "VEC2", 4)],
        json!({ "attributes": { "POSITION": 0, "NORMAL": 2, "TEXCOORD_0": 3, "COLOR_0": 2 }, "indices": 1, "material": 0, "targets": [{ "POSITION": 2 }] }),
    );
    file["accessors"][2]["sparse"] = json!({ "count": 2, "indices": { "bufferView": 2, "componentType": U16 }, "values": { "bufferView": 3 } });
    push(&mut file["meshes"][0]["primitives"], json!({ "attributes": { "POSITION": 2 }, "mode": 5 }));
    file["meshes"][0]["weights"] = json!([0.25]);
    file["materials"] = json!([{
        "pbrMetallicRoughness": { "baseColorTexture": { "index": 0, "extensions": { "KHR_texture_transform": { "offset": [0.5, 0.5] } } } },
        "normalTexture": { "index": 0 }, "alphaMode": "BLEND", "emissiveFactor": [1, 1, 1],
    }]);
    let mut png = Vec::new();
    let image = image::RgbImage::from_pixel(2, 2, image::Rgb([9; 3]));
    image.write_to(&mut std::io::Cursor::new(&mut png), image::ImageFormat::Png).unwrap();
    file["images"] = json!([{ "uri": data_uri(&png) }]);
    file["samplers"] = json!([{ "wrapS": 33071, "magFilter": 9728 }]);
    file["textures"] = json!([{ "source": 0, "sampler": 0 }]);
    file["cameras"] = json!([{ "type": "perspective", "perspective": { "yfov": 0.5, "znear": 0.1 } }]);
    file["nodes"] = json!([
        { "extensions": { "EXT_mesh_gpu_instancing": { "attributes": { "TRANSLATION": 0 } } }, "mesh": 0, "children": [1, 2], "rotation": [0, 0, 0, 1] },
        { "mesh": 0, "camera": 0, "matrix": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1] },
        { "extensions": {
            "KHR_lights_punctual": { "light": 0 },
        }, "mesh": 1, "skin": 0 },
    ]);
    file["extensions"] = json!({
        "KHR_lights_punctual": { "lights": [{ "type": "spot", "spot": {} }] },
        "EXT_lights_image_based": { "lights": [{
            "intensity": 0.5, "specularImages": [[0, 0, 0, 0, 0, 0]], "irradianceCoefficients": [[0, 0, 0]],
        }] },
    });
    file["scenes"][0]["extensions"] = json!({ "EXT_lights_image_based": { "light": 0 } });
    // A skinned and instanced mesh of compressed views, and an animation of it.
    let skinned = json!({ "attributes": { "POSITION": 4, "JOINTS_0": 5, "WEIGHTS_0": 6 }, "mode": 5 });
    push(&mut file["meshes"], json!({ "primitives": [skinned] }));
    file["skins"] = json!([{ "joints": [0, 1], "inverseBindMatrices": 7 }]);
    for (bytes, component, shape, count) in [
        ([0u8, 1, 0, 0].repeat(4), U8, "VEC4", 4),
        (floats(&[0.5, 0.5, 0., 0.].repeat(4)), F32, "VEC4", 4),
        (floats(&[1., 0., 0., 0., 0., 1., 0., 0., 0., 0., 1., 0., 0., 0., 0., 1.].repeat(2)), F32, "MAT4", 2),
        (floats(&[0., 1.]), F32, "SCALAR", 2),
        (floats(&[0., 0., 0., 1., 0., 1., 0., 0.]), F32, "VEC4", 2),
    ] {
        let (buffer, view) =
            (file["buffers"].as_array().unwrap().len(), file["bufferViews"].as_array().unwrap().len());
        push(&mut file["buffers"], json!({ "byteLength": bytes.len(), "uri": data_uri(&bytes) }));
        push(&mut file["bufferViews"], json!({ "buffer": buffer, "byteLength": bytes.len() }));
        if count == 4 && component == U8 {
            push(
                &mut file["accessors"],
                json!({ "bufferView": 0, "componentType": F32, "type": "VEC3", "count": 4 }),
            );
        }
        push(
            &mut file["accessors"],
            json!({ "bufferView": view, "componentType": component, "type": shape, "count": count }),
        );
    }
    file["animations"] = json!([{
        "channels": [
            { "sampler": 0, "target": { "node": 0, "path": "rotation" } },
            { "sampler": 1, "target": { "path": "pointer", "extensions": { "KHR_animation_pointer": { "pointer": "/materials/0/alphaCutoff" } } } },
        ],
        "samplers": [{ "input": 8, "output": 9 }, { "input": 8, "output": 8, "interpolation": "STEP" }],
    }]);
    super::compressed::add(&mut file);
    file
}

#[test]
fn mutated_files_never_panic() {
    let rich = rich();
    let bin = floats(&SQUARE);
    let mut packed = rich.clone();
    packed["buffers"][0] = json!({ "byteLength": bin.len() });
    let unread = |w: &Diagnostic| ["left out", "ignored"].iter().any(|word| w.message.contains(word));
    assert!(!model(&rich).warnings.iter().any(unread), "{:?}", model(&rich).warnings);
    let mut seeds = vec![
        rich.to_string().into_bytes(),
        square().to_string().into_bytes(),
        glb(&packed, &bin),
        super::conformance::conforming().to_string().into_bytes(),
    ];
    if let Some(samples) = std::env::var_os("RAYO_SAMPLE_ASSETS") {
        let names = [
            "Lights.glb",
            "CornellBox.glb",
            "simple-instancing.glb",
            "tv.glb",
            "SimpleSkin/SimpleSkin.gltf",
            "encodings/BoxMeshopt.glb",
            "SimpleMorph/glTF/SimpleMorph.gltf",
            "heart_draco.glb",
        ];
        seeds.extend(
            names.iter().filter_map(|name| std::fs::read(Path::new(&samples).join("gltf").join(name)).ok()),
        );
    }
    let mut random = Random(2);
    let (mut loaded, mut refused) = (0, 0);
    for i in 0..MUTATIONS {
        let bytes = mutate(&seeds[i % seeds.len()], &mut random);
        let at = (i / seeds.len() % 2 == 1).then_some(0.5);
        let selection = Selection { at, ..Selection::default() };
        match crate::import::gltf::import(&bytes, Path::new("mutated.gltf"), &selection) {
            Ok(model) => {
                loaded += 1;
                for mesh in &model.meshes {
                    let n = mesh.positions.len();
                    assert!(mesh.triangles.as_flattened().iter().all(|&v| (v as usize) < n));
                    assert!(
                        [mesh.normals.len(), mesh.tangents.len(), mesh.colors.len()]
                            .iter()
                            .all(|&l| l == 0 || l == n)
                    );
                    assert!(n < 10_000, "a small file made {n} vertices");
                }
            }
            Err(errors) => {
                refused += 1;
                assert!(errors.iter().any(|e| e.severity == Severity::Error));
            }
        }
    }
    println!("{loaded} mutated files load, {refused} are refused");
    assert!(loaded > 300 && refused > 300, "the mutations are too weak or too strong");
}
