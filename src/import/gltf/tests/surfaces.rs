//! Materials, textures, images and generated tangents.

use std::f32::consts::FRAC_PI_2;

use glam::{Vec2, Vec3};
use serde_json::json;

use super::*;
use crate::world::{Alpha, ColorSpace, Filter, Material, Surface, Texels, Wrap};

/// PNG of one texel.
pub(super) fn png(texel: [u8; 4]) -> Vec<u8> {
    let mut bytes = Vec::new();
    let image = image::RgbaImage::from_pixel(1, 1, image::Rgba(texel));
    image.write_to(&mut std::io::Cursor::new(&mut bytes), image::ImageFormat::Png).unwrap();
    bytes
}

/// The square with texture coordinates and `material`; texture i shows image i of `images`.
pub(super) fn textured(material: Value, images: &[Vec<u8>]) -> Value {
    let mut file = asset(
        &[
            floats(&SQUARE),
            le![0u16, 1u16, 2u16, 2u16, 1u16, 3u16],
            floats(&[0., 1., 1., 1., 0., 0., 1., 0.]),
            floats(&[0., 0., 1.].repeat(4)),
        ],
        &[(0, F32, "VEC3", 4), (1, U16, "SCALAR", 6), (2, F32, "VEC2", 4), (3, F32, "VEC3", 4)],
        json!({ "attributes": { "POSITION": 0, "TEXCOORD_0": 2, "NORMAL": 3 }, "indices": 1, "material": 0 }),
    );
    file["materials"] = json!([material]);
    file["images"] = images.iter().map(|i| json!({ "uri": data_uri(i) })).collect();
    file["textures"] = (0..images.len()).map(|i| json!({ "source": i })).collect();
    file
}

fn material(json: Value) -> Material {
    model(&textured(json, &[])).materials.remove(0)
}

fn pbr(material: &Material) -> crate::world::Pbr {
    match material.surface {
        Surface::Pbr(pbr) => pbr,
        ref other => panic!("{other:?}"),
    }
}

#[test]
fn defaults_are_those_of_the_specification() {
    let empty = material(json!({}));
    let bare = model(&square()).materials.remove(0);
    for material in [empty, bare] {
        let pbr = pbr(&material);
        assert_eq!(
            (pbr.base_color.factor, pbr.metallic.factor, pbr.roughness.factor, pbr.ior),
            (Vec3::ONE, 1., 1., 1.5)
        );
        assert!(material.emission.is_none() && material.alpha == Alpha::Opaque && !material.double_sided);
        assert!(material.vertex_colors && material.coverage.factor == 1.0 && material.normal.is_none());
    }
}

#[test]
fn factors_alpha_and_extensions() {
    let material = material(json!({
        "pbrMetallicRoughness": { "baseColorFactor": [0.1, 0.2, 0.3, 0.4], "metallicFactor": 0.5, "roughnessFactor": 0.6 },
        "emissiveFactor": [1, 0.5, 0], "alphaMode": "MASK", "alphaCutoff": 0.25, "doubleSided": true,
        "extensions": { "KHR_materials_emissive_strength": { "emissiveStrength": 10 }, "KHR_materials_ior": { "ior": 1.33 } },
    }));
    let pbr = pbr(&material);
    assert_eq!(
        (pbr.base_color.factor, pbr.metallic.factor, pbr.roughness.factor),
        (Vec3::new(0.1, 0.2, 0.3), 0.5, 0.6)
    );
    assert_eq!(
        (pbr.ior, material.coverage.factor, material.alpha),
        (1.33, 0.4, Alpha::Mask { cutoff: 0.25 })
    );
    let emission = material.emission.unwrap();
    assert_eq!(
        (emission.color.factor, emission.strength, emission.two_sided),
        (Vec3::new(1., 0.5, 0.), 10., true)
    );
}

#[test]
fn factors_out_of_range_are_clamped_with_a_warning() {
    let file = textured(
        json!({ "pbrMetallicRoughness": { "roughnessFactor": -3 }, "emissiveFactor": [1e39, 0, 0] }),
        &[],
    );
    let model = warned(&file, "is -3, out of range; 0 is used");
    assert_eq!(pbr(&model.materials[0]).roughness.factor, 0.0);
    assert_eq!(model.materials[0].emission.unwrap().color.factor.x, 1e12);
}

#[test]
fn unlit() {
    let material = material(json!({
        "pbrMetallicRoughness": { "baseColorFactor": [0.5, 0.5, 0.5, 1] }, "extensions": { "KHR_materials_unlit": {} },
    }));
    assert!(matches!(material.surface, Surface::Unlit { color } if color.factor == Vec3::splat(0.5)));
}

#[test]
fn slots_samplers_and_colour_spaces() {
    let mut file = textured(
        json!({
            "pbrMetallicRoughness": { "baseColorTexture": { "index": 0 }, "metallicRoughnessTexture": { "index": 0 } },
            "normalTexture": { "index": 0, "scale": 0.5 }, "occlusionTexture": { "index": 1 },
            "emissiveTexture": { "index": 0 }, "emissiveFactor": [1, 1, 1],
        }),
        &[png([10, 20, 30, 40]), b"occlusion is never decoded".to_vec()],
    );
    file["samplers"] = json!([{ "wrapS": 33071, "wrapT": 33648, "magFilter": 9728 }]);
    file["textures"][0]["sampler"] = json!(0);
    let model = model(&file);
    assert!(model.warnings.is_empty(), "{:?}", model.warnings);
    // One image, looked up as sRGB and as linear.
    assert_eq!((model.images.len(), model.textures.len()), (1, 2));
    assert!(matches!(&model.images[0].texels, Texels::Rgba8(t) if t[..] == [[10, 20, 30, 40]]));
    let pbr = pbr(&model.materials[0]);
    let base = &model.textures[pbr.base_color.texture.unwrap().texture.index()];
    assert_eq!(
        (base.color_space, base.wrap_u, base.wrap_v, base.filter),
        (ColorSpace::Srgb, Wrap::ClampToEdge, Wrap::MirroredRepeat, Filter::Nearest)
    );
    let (metallic, blue) = pbr.metallic.texture.unwrap();
    let (roughness, green) = pbr.roughness.texture.unwrap();
    assert_eq!((blue, green, metallic), (2, 1, roughness));
    assert_eq!(model.textures[metallic.texture.index()].color_space, ColorSpace::Linear);
    assert_eq!(model.materials[0].normal.unwrap().scale, 0.5);
    assert_eq!(model.materials[0].coverage.texture.unwrap().1, 3);
}

#[test]
fn textures_that_cannot_be_had_are_warned_of() {
    let material = json!({ "pbrMetallicRoughness": { "baseColorTexture": { "index": 0 } } });
    let mut file = textured(material.clone(), &[b"not an image".to_vec()]);
    let model = warned(&file, "cannot be decoded");
    assert!(model.images.is_empty() && pbr(&model.materials[0]).base_color.texture.is_none());
    file["images"][0] = json!({ "uri": "gone.png" });
    warned(&file, "cannot be read");
    file["images"][0] = json!({ "uri": "../secret.png" });
    warned(&file, "out of the folder");
    file["images"][0] = json!({ "uri": "%FF" });
    warned(&file, "UTF-8");
    file["images"][0] = json!({});
    warned(&file, "neither uri nor bufferView");
    file["textures"][0] = json!({});
    warned(&file, "no image that can be read");
    file["images"][0] = json!({ "bufferView": 99, "mimeType": "image/png" });
    refused(&file, "/images/0/bufferView", "bufferView 99");
    refused(
        &textured(material, &[]),
        "/materials/0/pbrMetallicRoughness/baseColorTexture/index",
        "texture 0, but there are 0",
    );
}

#[test]
fn images_in_buffer_views() {
    let image = png([1, 2, 3, 4]);
    let mut file =
        textured(json!({ "emissiveTexture": { "index": 0 }, "emissiveFactor": [1, 1, 1] }), &[vec![]]);
    push(&mut file["buffers"], json!({ "byteLength": image.len(), "uri": data_uri(&image) }));
    push(&mut file["bufferViews"], json!({ "buffer": 4, "byteLength": image.len() }));
    file["images"][0] = json!({ "bufferView": 4, "mimeType": "image/png", "name": "dot" });
    assert_eq!(model(&file).images[0].name, "dot");
}

/// A positive rotation turns the UV counter-clockwise as the image (v down) is seen: +U goes to −V.
#[test]
fn texture_transform_is_translation_rotation_scale() {
    let transform = json!({ "KHR_texture_transform": { "offset": [0.5, 0.25], "rotation": FRAC_PI_2, "scale": [2, 3], "texCoord": 1 } });
    let mut file = textured(
        json!({
            "pbrMetallicRoughness": { "baseColorTexture": { "index": 0, "extensions": transform } },
            "normalTexture": { "index": 0, "extensions": transform },
        }),
        &[png([0; 4])],
    );
    file["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_1"] = json!(2);
    let material = model(&file).materials.remove(0);
    for texture in [pbr(&material).base_color.texture.unwrap(), material.normal.unwrap().texture] {
        assert_eq!(texture.uv_set, 1);
        assert!(texture.transform.transform_point2(Vec2::X).abs_diff_eq(Vec2::new(0.5, 0.25 - 2.), 1e-6));
        assert!(texture.transform.transform_point2(Vec2::Y).abs_diff_eq(Vec2::new(0.5 + 3., 0.25), 1e-6));
    }
}

#[test]
fn texture_coordinates_that_are_missing_or_too_many() {
    let slot =
        |set: u32| json!({ "pbrMetallicRoughness": { "baseColorTexture": { "index": 0, "texCoord": set } } });
    warned(&textured(slot(1), &[png([0; 4])]), "not the texture coordinates");
    let mut file = textured(slot(7), &[png([0; 4])]);
    file["meshes"][0]["primitives"][0]["attributes"] = json!({ "POSITION": 0, "TEXCOORD_7": 2 });
    let seventh = model(&file);
    let texture = pbr(&seventh.materials[0]).base_color.texture.expect("is read");
    assert_eq!(seventh.meshes[0].uvs[usize::from(texture.uv_set)].len(), 4);
    file["materials"][0]["normalTexture"] = json!({ "index": 0, "texCoord": 1 });
    file["materials"][0]["emissiveTexture"] = json!({ "index": 0, "texCoord": 2 });
    file["materials"][0]["emissiveFactor"] = json!([1, 1, 1]);
    let model = warned(&file, "the third set of this material");
    assert!(model.materials[0].normal.is_none());
}

/// u grows along +X and the image's up is +Y: tangent +X, and cross(N, T) = +Y makes the handedness +1.
#[test]
fn tangents_are_generated_for_normal_maps_only() {
    let plain = mesh(&textured(json!({}), &[]));
    assert!(plain.tangents.is_empty());
    let file = textured(json!({ "normalTexture": { "index": 0 } }), &[png([128, 128, 255, 255])]);
    let mapped = mesh(&file);
    assert_eq!(mapped.tangents.len(), 4);
    assert!(
        mapped.tangents.iter().all(|t| t.abs_diff_eq(glam::Vec4::new(1., 0., 0., 1.), 1e-5)),
        "{:?}",
        mapped.tangents
    );
}
