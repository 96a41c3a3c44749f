//! Animations at a time: curves, what they target, and what is chosen of a file.

use std::f32::consts::{FRAC_1_SQRT_2, PI};

use glam::{Quat, Vec3};
use serde_json::json;

use super::*;
use crate::world::{Light, Projection, Surface};

/// Adds an accessor of floats; returns its index.
fn add(file: &mut Value, shape: &str, values: &[f32]) -> usize {
    let components = match shape {
        "SCALAR" => 1,
        "VEC3" => 3,
        _ => 4,
    };
    let buffer = file["buffers"].as_array().unwrap().len();
    let accessor = file["accessors"].as_array().unwrap().len();
    let bytes = floats(values);
    push(&mut file["buffers"], json!({ "byteLength": bytes.len(), "uri": data_uri(&bytes) }));
    push(&mut file["bufferViews"], json!({ "buffer": buffer, "byteLength": bytes.len() }));
    let json = json!({ "bufferView": buffer, "componentType": F32, "type": shape, "count": values.len() / components });
    push(&mut file["accessors"], bounded(json, &bytes));
    accessor
}

/// Adds an animation of one channel.
fn animate(file: &mut Value, target: Value, interpolation: &str, times: &[f32], shape: &str, values: &[f32]) {
    let input = add(file, "SCALAR", times);
    let output = add(file, shape, values);
    if file["animations"].is_null() {
        file["animations"] = json!([]);
    }
    let name = format!("clip {}", file["animations"].as_array().unwrap().len());
    push(
        &mut file["animations"],
        json!({
            "name": name,
            "channels": [{ "sampler": 0, "target": target }],
            "samplers": [{ "input": input, "output": output, "interpolation": interpolation }],
        }),
    );
}

fn at(seconds: f32) -> Selection {
    Selection { at: Some(seconds), ..Selection::default() }
}

fn model_at(file: &Value, seconds: f32) -> Model {
    import_selected(file, &at(seconds)).unwrap_or_else(|e| panic!("{e:#?}"))
}

fn pointer(pointer: &str) -> Value {
    json!({ "path": "pointer", "extensions": { "KHR_animation_pointer": { "pointer": pointer } } })
}

fn node(path: &str) -> Value {
    json!({ "node": 0, "path": path })
}

#[test]
fn linear_and_step_hold_before_and_after() {
    let keys = [0., 0., 0., 10., 20., 30., 10., 20., 40.];
    for (interpolation, expected) in [("LINEAR", [0., 0., 5., 10., 10.]), ("STEP", [0., 0., 0., 10., 10.])] {
        let mut file = square();
        animate(&mut file, node("translation"), interpolation, &[1., 3., 4.], "VEC3", &keys);
        for (seconds, x) in [-5., 1., 2., 3., 99.].into_iter().zip(expected) {
            let found = model_at(&file, seconds).instances[0].to_world.translation.x;
            assert_eq!(found, x, "{interpolation} at {seconds}");
        }
        assert_eq!(model(&file).instances[0].to_world.translation.x, 0.0, "at rest without a time");
    }
}

#[test]
fn rotations_go_the_shorter_way_at_constant_speed() {
    let mut file = square();
    // From none to a quarter turn about +Y, written with the opposite sign.
    let keys = [0., 0., 0., 1., 0., -FRAC_1_SQRT_2, 0., -FRAC_1_SQRT_2];
    animate(&mut file, node("rotation"), "LINEAR", &[0., 3.], "VEC4", &keys);
    let to_world = model_at(&file, 1.0).instances[0].to_world;
    let expected = Quat::from_rotation_y(PI / 6.0) * Vec3::X;
    assert!(to_world.transform_vector3(Vec3::X).abs_diff_eq(expected, 1e-6), "{to_world}");
}

/// Against the Hermite basis in its other form: points and tangents of a known cubic, x = s³ − 2s + 1.
#[test]
fn splines_reproduce_a_cubic() {
    let (value, slope) = (|s: f32| s * s * s - 2.0 * s + 1.0, |s: f32| 3.0 * s * s - 2.0);
    let mut keys = Vec::new();
    for s in [1.0f32, 3.0] {
        keys.extend([slope(s), 0., 0., value(s), 0., 0., slope(s), 0., 0.]);
    }
    let mut file = square();
    animate(&mut file, node("translation"), "CUBICSPLINE", &[1., 3.], "VEC3", &keys);
    for s in [0.5f32, 1.0, 1.25, 2.0, 2.9, 3.0, 4.0] {
        let found = model_at(&file, s).instances[0].to_world.translation.x;
        let expected = value(s.clamp(1.0, 3.0));
        assert!((found - expected).abs() < 1e-4, "{found} at {s} is not {expected}");
    }
}

#[test]
fn weights_of_nodes_are_animated() {
    let mut file = square();
    let up = add(&mut file, "VEC3", &[0., 0., 1.].repeat(4));
    file["meshes"][0]["primitives"][0]["targets"] = json!([{ "POSITION": up }, { "POSITION": up }]);
    file["meshes"][0]["weights"] = json!([0, 100]);
    animate(&mut file, node("weights"), "LINEAR", &[0., 1.], "SCALAR", &[0., 0., 1., 4.]);
    animate(&mut file, pointer("/nodes/0/weights/1"), "LINEAR", &[0., 1.], "SCALAR", &[0., 2.]);
    animate(&mut file, pointer("/meshes/0/weights"), "LINEAR", &[0., 1.], "SCALAR", &[0., 0., 0., 8.]);
    animate(&mut file, pointer("/nodes/0/weights/2"), "LINEAR", &[0., 1.], "SCALAR", &[0., 2.]);
    let height = |clip: &str| {
        let selection = Selection { animation: Some(clip.into()), at: Some(0.5), ..Selection::default() };
        let model = import_selected(&file, &selection).unwrap_or_else(|e| panic!("{e:#?}"));
        (model.meshes[0].positions[0].z, model.warnings.len())
    };
    assert_eq!(height("clip 0"), (2.5, 0));
    // One weight by its pointer leaves the other as it is at rest.
    assert_eq!(height("clip 1"), (1.0, 0));
    assert_eq!(height("clip 2"), (4.0, 0));
    assert_eq!(height("clip 3"), (100.0, 1));
}

#[test]
fn pointers_change_materials_lights_cameras_and_visibility() {
    let mut file = square();
    file["nodes"] = json!([
        { "mesh": 0, "extensions": { "KHR_node_visibility": { "visible": true } } },
        { "camera": 0 },
        { "extensions": { "KHR_lights_punctual": { "light": 0 } } },
    ]);
    file["scenes"][0]["nodes"] = json!([0, 1, 2]);
    file["meshes"][0]["primitives"][0]["material"] = json!(0);
    file["materials"] = json!([{
        "pbrMetallicRoughness": { "metallicFactor": 1 },
        "extensions": { "KHR_materials_ior": { "ior": 1.5 } },
    }]);
    file["cameras"] = json!([{ "type": "perspective", "perspective": { "yfov": 0.5, "znear": 0.1 } }]);
    file["extensions"] =
        json!({ "KHR_lights_punctual": { "lights": [{ "type": "point", "color": [1, 1, 1] }] } });
    let mut channels = Vec::new();
    let mut samplers = Vec::new();
    let mut channel = |file: &mut Value, to: &str, shape: &str, values: &[f32]| {
        let (input, output) = (add(file, "SCALAR", &[0., 1.]), add(file, shape, values));
        channels.push(json!({ "sampler": samplers.len(), "target": pointer(to) }));
        samplers.push(json!({ "input": input, "output": output }));
    };
    channel(&mut file, "/materials/0/pbrMetallicRoughness/metallicFactor", "SCALAR", &[0., 1.]);
    // Not in the file, but its default is known.
    channel(&mut file, "/materials/0/pbrMetallicRoughness/baseColorFactor", "VEC4", &[0.5; 8]);
    channel(&mut file, "/materials/0/extensions/KHR_materials_ior/ior", "SCALAR", &[1.2, 1.4]);
    channel(&mut file, "/cameras/0/perspective/yfov", "SCALAR", &[1., 2.]);
    channel(&mut file, "/extensions/KHR_lights_punctual/lights/0/intensity", "SCALAR", &[2., 4.]);
    file["animations"] = json!([{ "channels": channels, "samplers": samplers }]);
    let model = model_at(&file, 0.5);
    assert!(model.warnings.is_empty(), "{:#?}", model.warnings);
    let Surface::Pbr(pbr) = model.materials[0].surface else { panic!() };
    assert_eq!((pbr.metallic.factor, pbr.base_color.factor, pbr.ior), (0.5, Vec3::splat(0.5), 1.3));
    assert_eq!(model.cameras[0].projection, Projection::Perspective { vfov: 1.5 });
    assert_eq!(model.lights[0], Light::Point { position: Vec3::ZERO, intensity: Vec3::splat(3.0) });

    animate(
        &mut file,
        pointer("/nodes/0/extensions/KHR_node_visibility/visible"),
        "STEP",
        &[0., 1.],
        "SCALAR",
        &[1., 0.],
    );
    let shown = |seconds| {
        let selection = Selection { animation: Some("1".into()), at: Some(seconds), ..Selection::default() };
        import_selected(&file, &selection).expect("is read").instances.len()
    };
    assert_eq!((shown(0.5), shown(1.0)), (1, 0));
}

#[test]
fn what_cannot_be_animated_is_warned_of_and_left_alone() {
    for (to, text) in [
        ("/materials/0/name", "cannot be animated"),
        ("/materials/0/normalTexture/index", "cannot be animated"),
        ("/materials/0/extensions/KHR_materials_ior/ior", "does not have"),
        ("/materials/7/alphaCutoff", "does not exist"),
        ("/materials/0/emissiveFactor", "cannot be animated in this way"),
        ("/nodes/9/translation", "does not exist"),
        ("/nodes/0/extensions/KHR_node_visibility/visible", "does not have"),
        ("/accessors/0/count", "cannot be animated"),
        ("nodes", "cannot be animated"),
    ] {
        let mut file = square();
        file["materials"] = json!([{ "name": "a", "normalTexture": { "index": 0 } }]);
        file["textures"] = json!([{}]);
        file["meshes"][0]["primitives"][0]["material"] = json!(0);
        let (shape, values): (_, &[f32]) =
            if to.ends_with("translation") { ("VEC3", &[1.; 6]) } else { ("SCALAR", &[1., 1.]) };
        animate(&mut file, pointer(to), "STEP", &[0., 1.], shape, values);
        let model = model_at(&file, 0.0);
        assert!(model.warnings.iter().any(|w| w.message.contains(text)), "{to}: {:#?}", model.warnings);
        assert_eq!(model.instances.len(), 1);
    }
    let mut file = square();
    file["nodes"][0]["matrix"] = json!([1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]);
    animate(&mut file, node("scale"), "STEP", &[0.], "VEC3", &[2.; 3]);
    assert!(model_at(&file, 0.0).warnings[0].message.contains("has a matrix"));
}

#[test]
fn curves_that_make_no_sense_are_refused() {
    let refuse = |times: &[f32], shape: &str, values: &[f32], interpolation: &str, key: &str, text: &str| {
        let mut file = square();
        animate(&mut file, node("translation"), interpolation, times, shape, values);
        let errors = import_selected(&file, &at(0.5)).expect_err("is refused");
        let pointer = format!("/animations/0/samplers/0/{key}");
        assert!(
            errors.iter().any(|e| place(e) == pointer && e.message.contains(text)),
            "{text:?}: {errors:#?}"
        );
    };
    refuse(&[0., 0.], "VEC3", &[0.; 6], "LINEAR", "input", "not later");
    refuse(&[0., f32::NAN], "VEC3", &[0.; 6], "LINEAR", "input", "not later");
    refuse(&[0., 1.], "VEC3", &[0.; 9], "LINEAR", "output", "3 elements for 2 keys");
    refuse(&[0., 1.], "VEC4", &[0.; 8], "LINEAR", "output", "4 values for each key");
    refuse(&[0., 1.], "VEC3", &[0.; 6], "CUBICSPLINE", "output", "2 elements for 2 keys");
    refuse(&[0., 1.], "VEC3", &[0.; 6], "CUBIC", "interpolation", "CUBICSPLINE");
    refuse(&[0., 1.], "VEC3", &[f32::INFINITY; 6], "LINEAR", "output", "not finite");
    let mut file = square();
    animate(&mut file, node("translation"), "LINEAR", &[0.], "VEC3", &[0.; 3]);
    file["animations"][0]["samplers"][0]["input"] = json!(99);
    file["animations"][0]["channels"][0]["sampler"] = json!(3);
    refused(&file, "/animations/0/samplers/0/input", "accessor 99");
    refused(&file, "/animations/0/channels/0/sampler", "sampler 3");
}

#[test]
fn a_channel_without_a_target_is_ignored() {
    let mut file = square();
    animate(&mut file, json!({ "path": "translation" }), "STEP", &[0.], "VEC3", &[9.; 3]);
    assert_eq!(model_at(&file, 0.0).instances[0].to_world.translation.x, 0.0);
}

#[test]
fn animations_are_called_by_name_or_number() {
    let mut file = square();
    let none = import_selected(&file, &at(0.0)).expect_err("has none");
    assert!(none[0].message.contains("no animation"));
    for x in [1., 2.] {
        animate(&mut file, node("translation"), "STEP", &[0.], "VEC3", &[x, 0., 0.]);
    }
    let x = |name: Option<&str>| {
        let selection =
            Selection { animation: name.map(str::to_owned), at: Some(0.0), ..Selection::default() };
        import_selected(&file, &selection)
            .map(|model| (model.instances[0].to_world.translation.x, model.warnings.len()))
    };
    assert_eq!(x(Some("clip 1")).expect("is there"), (2.0, 0));
    assert_eq!(x(Some("0")).expect("is there"), (1.0, 0));
    assert_eq!(x(None).expect("is there"), (1.0, 1));
    let error = x(Some("clup 1")).expect_err("is not there");
    assert!(error[0].help.as_deref().is_some_and(|help| help.contains("clip 1")), "{error:#?}");
}

#[test]
fn times_outside_of_an_animation_are_told() {
    let mut file = square();
    animate(&mut file, node("translation"), "LINEAR", &[1., 2.], "VEC3", &[0., 0., 0., 5., 0., 0.]);
    for (seconds, x, told) in [(0.5, 0., 1), (1., 0., 0), (1.5, 2.5, 0), (3., 5., 1)] {
        let model = import_selected(&file, &at(seconds)).expect("is right");
        assert_eq!((model.instances[0].to_world.translation.x, model.warnings.len()), (x, told), "{seconds}");
    }
}

/// Where a mapping names the variant its material stands in for the primitive's own; elsewhere that stays.
#[test]
fn variants_exchange_materials() {
    let mut file = square();
    file["materials"] = json!([{ "name": "plain" }, { "name": "red" }, { "name": "blue" }]);
    file["extensions"] = json!({ "KHR_materials_variants": {
        "variants": [{ "name": "ruby" }, { "name": "rouge" }, { "name": "sky" }, { "name": "none" }],
    } });
    file["meshes"][0]["primitives"][0]["material"] = json!(0);
    file["meshes"][0]["primitives"][0]["extensions"] = json!({ "KHR_materials_variants": {
        "mappings": [{ "material": 1, "variants": [0, 1] }, { "material": 2, "variants": [2] }],
    } });
    let material = |variant: Option<&str>| {
        let selection = Selection { variant: variant.map(str::to_owned), ..Selection::default() };
        import_selected(&file, &selection)
            .map(|model| model.materials[model.instances[0].materials[0].index()].name.clone())
    };
    let cases = [
        (None, "plain"),
        (Some("ruby"), "red"),
        (Some("1"), "red"),
        (Some("sky"), "blue"),
        (Some("none"), "plain"),
    ];
    for (variant, expected) in cases {
        assert_eq!(material(variant).expect("is there"), expected, "{variant:?}");
    }
    let error = material(Some("rubi")).expect_err("is not there");
    assert!(error[0].help.as_deref().is_some_and(|help| help.contains("ruby")), "{error:#?}");
    file["meshes"][0]["primitives"][0]["extensions"]["KHR_materials_variants"]["mappings"][1]["material"] =
        json!(3);
    let error = &import_selected(&file, &Selection::default()).expect_err("refers to nothing")[0];
    assert!(format!("{:?}", error.place).contains("mappings/1/material"), "{error:?}");
}

#[test]
fn scenes_are_called_by_name_or_number() {
    let mut file = square();
    file["nodes"] = json!([{ "mesh": 0, "name": "a" }, { "mesh": 0, "name": "b" }]);
    file["scenes"] = json!([{ "nodes": [0] }, { "nodes": [1], "name": "night" }]);
    let shown = |scene: &str| {
        let selection = Selection { scene: Some(scene.into()), ..Selection::default() };
        import_selected(&file, &selection).map(|model| model.instances[0].name.clone())
    };
    assert_eq!((shown("0"), shown("1"), shown("night")).0.expect("is there"), "a");
    assert_eq!([shown("1"), shown("night")].map(|s| s.expect("is there")), ["b", "b"]);
    assert!(shown("2").expect_err("is not there")[0].message.contains("no scene called"));
}
