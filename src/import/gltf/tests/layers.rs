//! The material extensions: every member read, every texture in its channel and colour space, and what is wrong reported.

use glam::{Vec2, Vec3};
use serde_json::json;

use super::surfaces::{png, textured};
use super::*;
use crate::world::{ColorSpace, Layered, Surface, TextureRef};

fn layered(material: Value) -> Layered {
    let file = textured(material, &[png([128, 64, 32, 16])]);
    match model(&file).materials.remove(0).surface {
        Surface::Layered(layered) => *layered,
        other => panic!("{other:?}"),
    }
}

fn extension(name: &str, members: Value) -> Value {
    json!({ "extensions": { format!("KHR_materials_{name}"): members } })
}

/// A texture slot with a transform of its own.
fn slot() -> Value {
    json!({ "index": 0, "extensions": { "KHR_texture_transform": { "offset": [0.25, 0.5] } } })
}

fn moved(texture: &TextureRef) -> bool {
    texture.transform.transform_point2(Vec2::ZERO) == Vec2::new(0.25, 0.5)
}

/// Every slot of every extension: which channel, and whether the colour is sRGB.
#[test]
fn textures_keep_transform_channel_and_colour_space() {
    let all = json!({ "extensions": {
        "KHR_materials_anisotropy": { "anisotropyStrength": 1, "anisotropyTexture": slot() },
        "KHR_materials_clearcoat": {
            "clearcoatFactor": 1, "clearcoatTexture": slot(), "clearcoatNormalTexture": slot(),
            "clearcoatRoughnessFactor": 1, "clearcoatRoughnessTexture": slot(),
        },
        "KHR_materials_diffuse_transmission": {
            "diffuseTransmissionFactor": 1, "diffuseTransmissionTexture": slot(),
            "diffuseTransmissionColorTexture": slot(),
        },
        "KHR_materials_iridescence": {
            "iridescenceFactor": 1, "iridescenceTexture": slot(), "iridescenceThicknessTexture": slot(),
        },
        "KHR_materials_sheen": {
            "sheenColorFactor": [1, 1, 1], "sheenColorTexture": slot(),
            "sheenRoughnessFactor": 1, "sheenRoughnessTexture": slot(),
        },
        "KHR_materials_specular": { "specularTexture": slot(), "specularColorTexture": slot() },
        "KHR_materials_transmission": { "transmissionFactor": 1, "transmissionTexture": slot() },
        "KHR_materials_volume": { "thicknessFactor": 1, "thicknessTexture": slot() },
    } });
    let mut model = model(&textured(all, &[png([128, 64, 32, 16])]));
    // The tangents that it asks for are made here, though the specification wants them in the file.
    assert!(model.warnings.iter().all(|w| w.message.contains("TANGENT")), "{:?}", model.warnings);
    let spaces: Vec<_> = model.textures.iter().map(|t| t.color_space).collect();
    let srgb = |t: TextureRef| spaces[t.texture.index()] == ColorSpace::Srgb;
    let mut count = 0;
    model.materials[0].for_each_texture(&mut |texture| {
        assert!(moved(texture));
        count += 1;
    });
    assert_eq!(count, 13); // all but the thickness, which is that of the mesh
    let Surface::Layered(l) = model.materials.remove(0).surface else { panic!("layers") };
    let coat = l.clearcoat.unwrap();
    let (film, sheen) = (l.iridescence.unwrap(), l.sheen.unwrap());
    let (specular, diffuse) = (l.specular.unwrap(), l.diffuse_transmission.unwrap());
    let channels = [
        (coat.factor.texture, 0),
        (coat.roughness.texture, 1),
        (diffuse.factor.texture, 3),
        (film.factor.texture, 0),
        (film.thickness_texture, 1),
        (sheen.roughness.texture, 3),
        (specular.factor.texture, 3),
        (l.transmission.unwrap().texture, 0),
    ];
    for (i, (texture, channel)) in channels.into_iter().enumerate() {
        let (texture, found) = texture.unwrap();
        assert!(found == channel && !srgb(texture), "{i}: {found}");
    }
    for color in [sheen.color, specular.color, diffuse.color] {
        assert!(srgb(color.texture.unwrap()));
    }
    assert!(!srgb(l.anisotropy.unwrap().texture.unwrap()) && !srgb(coat.normal.unwrap().texture));
}

#[test]
fn factors_are_read() {
    let l = layered(json!({ "extensions": {
        "KHR_materials_anisotropy": { "anisotropyStrength": 0.5, "anisotropyRotation": 1.5 },
        "KHR_materials_clearcoat": { "clearcoatFactor": 0.5, "clearcoatRoughnessFactor": 0.25 },
        "KHR_materials_diffuse_transmission":
            { "diffuseTransmissionFactor": 0.5, "diffuseTransmissionColorFactor": [1, 0.5, 0] },
        "KHR_materials_dispersion": { "dispersion": 0.36 },
        "KHR_materials_iridescence": {
            "iridescenceFactor": 0.5, "iridescenceIor": 1.8,
            "iridescenceThicknessMinimum": 200, "iridescenceThicknessMaximum": 600,
        },
        "KHR_materials_sheen": { "sheenColorFactor": [0.5, 0.25, 0], "sheenRoughnessFactor": 0.75 },
        "KHR_materials_specular": { "specularFactor": 0.5, "specularColorFactor": [2, 1, 0] },
        "KHR_materials_transmission": { "transmissionFactor": 0.5 },
        "KHR_materials_volume":
            { "thicknessFactor": 1, "attenuationDistance": 2, "attenuationColor": [1, 0.5, 0.25] },
    } }));
    let (a, c, d) = (l.anisotropy.unwrap(), l.clearcoat.unwrap(), l.diffuse_transmission.unwrap());
    assert_eq!((a.strength, a.rotation), (0.5, 1.5));
    assert_eq!((c.factor.factor, c.roughness.factor, c.normal), (0.5, 0.25, None));
    assert_eq!((d.factor.factor, d.color.factor), (0.5, Vec3::new(1.0, 0.5, 0.0)));
    let (i, s, p) = (l.iridescence.unwrap(), l.sheen.unwrap(), l.specular.unwrap());
    assert_eq!((i.factor.factor, i.ior, i.thickness), (0.5, 1.8, [200.0, 600.0]));
    assert_eq!((s.color.factor, s.roughness.factor), (Vec3::new(0.5, 0.25, 0.0), 0.75));
    assert_eq!((p.factor.factor, p.color.factor), (0.5, Vec3::new(2.0, 1.0, 0.0)));
    assert_eq!((l.transmission.unwrap().factor, l.dispersion), (0.5, 0.36));
    let absorption = l.medium().unwrap().absorption();
    assert!(absorption.abs_diff_eq(Vec3::new(0.0, 0.5, 1.0) * std::f32::consts::LN_2, 1e-6), "{absorption}");
}

/// What an extension leaves at its default adds nothing: the material is the plain one.
#[test]
fn extensions_without_effect_leave_the_plain_material() {
    for name in [
        "anisotropy",
        "clearcoat",
        "diffuse_transmission",
        "dispersion",
        "iridescence",
        "sheen",
        "specular",
        "transmission",
        "volume",
    ] {
        let with = model(&textured(extension(name, json!({})), &[])).materials.remove(0);
        let without = model(&textured(json!({}), &[])).materials.remove(0);
        assert_eq!(with, without, "{name}");
    }
}

/// A volume is thick only where it has a thickness; its boundary is seen from both sides.
#[test]
fn walls_are_thin_without_thickness() {
    let with = |thickness: f32| {
        let file = textured(
            json!({ "extensions": {
                "KHR_materials_transmission": { "transmissionFactor": 1 },
                "KHR_materials_volume": { "thicknessFactor": thickness, "attenuationDistance": 1 },
            } }),
            &[],
        );
        model(&file).materials.remove(0)
    };
    let (thin, thick) = (with(0.0), with(0.1));
    let medium = |m: &crate::world::Material| match &m.surface {
        Surface::Layered(l) => l.medium().is_some(),
        _ => false,
    };
    assert!(!medium(&thin) && !thin.double_sided && medium(&thick) && thick.double_sided);
}

#[test]
fn wrong_types_are_errors_and_ranges_warnings() {
    let at = |name: &str, key: &str| format!("/materials/0/extensions/KHR_materials_{name}{key}");
    let bad = |name: &str, members: Value, key: &str, text: &str| {
        refused(&textured(extension(name, members), &[]), &at(name, key), text);
    };
    bad("clearcoat", json!(7), "", "is not an object");
    bad("clearcoat", json!({ "clearcoatFactor": "much" }), "/clearcoatFactor", "invalid type");
    bad("sheen", json!({ "sheenColorFactor": [1, 1] }), "/sheenColorFactor", "has 2 numbers where 3");
    bad("sheen", json!({ "sheenColorFactor": 1 }), "/sheenColorFactor", "invalid type");
    bad(
        "transmission",
        json!({ "transmissionFactor": 1, "transmissionTexture": { "index": 3 } }),
        "/transmissionTexture/index",
        "texture 3, but there are 0",
    );
    bad(
        "transmission",
        json!({ "transmissionFactor": 1, "transmissionTexture": [] }),
        "/transmissionTexture",
        "invalid",
    );
    warned(
        &textured(extension("clearcoat", json!({ "clearcoatFactor": 3 })), &[]),
        "is 3, out of range; 1 is used",
    );
    let volume = json!({ "thicknessFactor": 1, "attenuationDistance": -1 });
    warned(&textured(extension("volume", volume), &[]), "is -1, out of range");
    warned(&textured(extension("dispersion", json!({ "dispersion": 1 })), &[]), "has no effect without");
}

#[test]
fn the_archived_workflow_takes_the_place_of_metallic_roughness() {
    let file = textured(
        extension(
            "pbrSpecularGlossiness",
            json!({
                "diffuseFactor": [0.5, 0.25, 0, 0.75], "specularFactor": [0.5, 0.25, 0.125], "glossinessFactor": 0.25,
                "diffuseTexture": slot(), "specularGlossinessTexture": slot(),
            }),
        ),
        &[png([128, 64, 32, 16])],
    );
    let model = model(&file);
    let Surface::SpecularGlossiness(s) = &model.materials[0].surface else { panic!("specular-glossiness") };
    assert_eq!(
        (s.diffuse.factor, s.specular.factor),
        (Vec3::new(0.5, 0.25, 0.0), Vec3::new(0.5, 0.25, 0.125))
    );
    let (texture, channel) = s.glossiness.texture.unwrap();
    assert!(channel == 3 && s.glossiness.factor == 0.25 && Some(texture) == s.specular.texture);
    let space = |t: TextureRef| model.textures[t.texture.index()].color_space;
    assert_eq!((space(s.diffuse.texture.unwrap()), space(texture)), (ColorSpace::Srgb, ColorSpace::Srgb));
    let coverage = model.materials[0].coverage;
    assert_eq!((coverage.factor, coverage.texture.map(|(_, c)| c)), (0.75, Some(3)));
}
