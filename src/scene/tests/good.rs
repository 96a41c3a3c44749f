use std::{f32::consts::PI, time::Duration};

use glam::{Vec3, Vec3A};

use super::{GOOD, good};
use crate::{
    output::{Depth, View},
    render::{Bounces, FilterKind, Settings},
    scene::{CameraSource, EnvironmentSourceKind, Lens},
    world::{self, Alpha, ColorInput, Fresnel, Light, MetalFinish, Projection, ScalarInput, Surface},
};

#[test]
fn every_key_arrives() {
    let scene = good(GOOD);
    let render = &scene.render;
    assert_eq!((render.size, render.samples, render.seed, render.threads), ([640, 360], 64, 7, Some(3)));
    assert_eq!(render.time, Some(Duration::from_secs(5400)));
    assert_eq!(render.bounces, Bounces { total: 12, diffuse: 0, glossy: 12, transmission: 12 });
    assert_eq!((render.filter.kind, render.filter.width), (FilterKind::Gaussian, 2.5));
    assert_eq!((render.crop, render.noise), (Some([10, 20, 300, 200]), 0.01));
    assert_eq!(
        (scene.output.view, scene.output.depth, scene.output.exposure),
        (View::Raw, Depth::High, -1.5)
    );
    assert!(scene.output.file.ends_with("scenes/cover.exr"));
    let environment = scene.environment.expect("is there");
    assert!(!environment.visible && environment.strength == 0.5);
    assert!(matches!(environment.kind, EnvironmentSourceKind::Gradient { bottom: Vec3::ONE, .. }));

    let surface = |name: &str| {
        let material = scene.materials.iter().find(|material| material.name == name);
        material.map(|material| material.surface.clone()).expect("is there")
    };
    assert!(
        matches!(surface("ground"), Surface::Diffuse { color } if (color.factor.x - 0.2158605).abs() < 1e-6)
    );
    assert!(matches!(surface("fuzzy"), Surface::Metal { finish: MetalFinish::Fuzz(0.1), .. }));
    assert!(matches!(
        surface("gold"),
        Surface::Metal {
            finish: MetalFinish::Roughness { fresnel: Fresnel::Constant, multiscatter: false, .. },
            ..
        }
    ));
    assert!(matches!(surface("glass"), Surface::Dielectric { ior: 1.5, fresnel: Fresnel::Schlick, .. }));
    assert_eq!(scene.materials[scene.spheres[0].material.index()].name, "glass");
    assert_eq!(scene.materials[scene.quads[0].material.index()].name, "ground");
    let paint = scene.materials.iter().find(|material| material.name == "paint").expect("is there");
    assert!(paint.alpha == Alpha::Blend && paint.coverage.factor == 0.5 && paint.emission.is_none());
    assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);
}

#[test]
fn every_layer_arrives() {
    let scene = good(GOOD);
    let layered = |name: &str| {
        let material = scene.materials.iter().find(|material| material.name == name).expect("is there");
        let Surface::Layered(layered) = &material.surface else { panic!("{:?}", material.surface) };
        **layered
    };
    let (constant, color) = (ScalarInput::constant, |x, y, z| ColorInput::constant(Vec3::new(x, y, z)));
    let car = layered("car");
    let specular = world::SpecularLevel { factor: constant(0.9), color: color(1.5, 1.0, 1.0) };
    assert_eq!(car.specular, Some(specular));
    let clearcoat = world::Clearcoat { factor: constant(0.8), roughness: constant(0.1), normal: None };
    assert_eq!(car.clearcoat, Some(clearcoat));
    let sheen = car.sheen.expect("is there");
    assert!((sheen.color.factor.x - 0.2158605).abs() < 1e-6 && sheen.roughness == constant(0.3));
    let iridescence = world::Iridescence {
        factor: constant(0.7),
        ior: 1.4,
        thickness: [350.0; 2],
        thickness_texture: None,
    };
    assert_eq!(car.iridescence, Some(iridescence));
    let anisotropy = world::Anisotropy { strength: 0.6, rotation: PI / 4.0, texture: None };
    assert_eq!(car.anisotropy, Some(anisotropy));
    assert_eq!(
        (car.transmission, car.volume, car.dispersion, car.diffuse_transmission),
        (None, None, 0.0, None)
    );
    let jade = layered("jade");
    let volume = world::Volume { attenuation_color: Vec3::new(0.2, 0.8, 0.4), attenuation_distance: 0.05 };
    assert_eq!((jade.transmission, jade.volume, jade.dispersion), (Some(constant(0.9)), Some(volume), 0.5));
    let diffuse = world::DiffuseTransmission { factor: constant(0.25), color: color(0.5, 0.5, 0.5) };
    assert_eq!(jade.diffuse_transmission, Some(diffuse));
}

/// A layer that is named and nothing more is there whole, but for its normal map and its absorption.
#[test]
fn layers_have_defaults() {
    let layers = "specular = {}\nclearcoat = {}\nsheen = {}\ntransmission = 1\nvolume = {}\niridescence = {}\n\
                  anisotropy = {}\ndiffuse_transmission = {}\n";
    let scene = good(&format!("[materials.a]\ntype = \"pbr\"\n{layers}"));
    assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);
    let Surface::Layered(layered) = &scene.materials[0].surface else { panic!("is layered") };
    let factors = [
        layered.specular.map(|l| l.factor),
        layered.clearcoat.map(|l| l.factor),
        layered.iridescence.map(|l| l.factor),
        layered.diffuse_transmission.map(|l| l.factor),
    ];
    assert_eq!(factors, [Some(ScalarInput::constant(1.0)); 4]);
    assert_eq!(layered.anisotropy.map(|l| (l.strength, l.rotation)), Some((1.0, 0.0)));
    assert_eq!(layered.sheen.map(|l| l.color), Some(ColorInput::constant(Vec3::ONE)));
    assert_eq!(layered.volume.map(|v| v.absorption()), Some(Vec3::ZERO));
    let scene = good("[materials.a]\ntype = \"pbr\"\nior = 1.4\n");
    assert!(matches!(scene.materials[0].surface, Surface::Pbr(_)));
}

#[test]
fn an_empty_file_has_the_settings_defaults() {
    let scene = good("");
    assert_eq!(scene.render, Settings::default());
    assert!(scene.output.file.ends_with("scenes/test.png"));
    assert!(matches!(
        scene.camera,
        CameraSource::Framed {
            projection: Projection::Perspective { .. },
            lens: Lens::Diameter(0.0),
            focus: None
        }
    ));
}

#[test]
fn the_camera_looks_at_its_target() {
    let CameraSource::Placed(camera) = good("[camera]\nposition = [13, 2, 3]\ntarget = [1, 0, -1]\n").camera
    else {
        panic!("is placed");
    };
    let target = camera.to_world.inverse().transform_point3a(Vec3A::new(1.0, 0.0, -1.0));
    assert!(target.abs_diff_eq(Vec3A::new(0.0, 0.0, -camera.focus), 1e-5), "{target}");
    assert!(camera.to_world.matrix3.y_axis.y > 0.9);
    assert!((camera.to_world.matrix3.determinant() - 1.0).abs() < 1e-6);
}

#[test]
fn a_lens_said_in_two_ways_is_one_lens() {
    let camera = |keys: &str| match good(&format!("[camera]\nposition = [0, 0, 5]\n{keys}")).camera {
        CameraSource::Placed(camera) => (camera.projection, camera.aperture),
        other => panic!("{other:?}"),
    };
    let (by_length, aperture) = camera("focal_length = 50\nfstop = 2\n");
    assert_eq!(by_length, Projection::Perspective { vfov: 2.0 * (12.0f32 / 50.0).atan() });
    assert!((aperture - 0.025).abs() < 1e-6);
    let vfov = (2.0 * (12.0f32 / 50.0).atan()).to_degrees();
    let (_, aperture) = camera(&format!("vfov = {vfov}\nfstop = 2\n"));
    assert!((aperture - 0.025).abs() < 1e-6);
    assert_eq!(camera("ortho_height = 3\n").0, Projection::Orthographic { half_height: 1.5 });
}

/// The power that leaves an emitter is what the file says, whatever its shape.
#[test]
fn emitters_carry_their_power() {
    let scene = good(GOOD);
    let radiance = |material: crate::world::MaterialId| {
        let emission = scene.materials[material.index()].emission.expect("shines");
        (emission.color.factor * emission.strength).x
    };
    let rect = scene.quads[1];
    assert!((radiance(rect.material) * PI * rect.u.cross(rect.v).length() - 50.0).abs() < 1e-3);
    assert!(rect.u.cross(rect.v).y < 0.0, "faces down where nothing is said");
    assert!((rect.origin + (rect.u + rect.v) / 2.0).abs_diff_eq(Vec3::new(0.0, 4.0, 0.0), 1e-6));
    let disk = scene.quads[2];
    assert!(
        disk.round && (disk.u.length() - 0.5).abs() < 1e-6 && (radiance(disk.material) - 3.0).abs() < 1e-6
    );
    let sphere = scene.spheres[1];
    assert!((radiance(sphere.material) * PI * 4.0 * PI * sphere.radius.powi(2) - 10.0).abs() < 1e-3);
    assert!(
        matches!(scene.lights[0], Light::Point { intensity, .. } if (intensity.x - 100.0 / (4.0 * PI)).abs() < 1e-4)
    );
}

/// A point that is given a size gives the same light from afar: I = L π r².
#[test]
fn a_point_with_a_radius_becomes_a_sphere() {
    let scene = good("[[light]]\ntype = \"point\"\nposition = [0, 0, 0]\nintensity = 8\nradius = 0.1\n");
    let emission = scene.materials[scene.spheres[0].material.index()].emission.expect("shines");
    assert!((emission.strength * PI * 0.01 - 8.0).abs() < 1e-4);
}

#[test]
fn directions_of_light() {
    let Light::Sun { direction, angle, .. } = good(GOOD).lights[2] else { panic!("is a sun") };
    let (cos, sin) = (30f32.to_radians().cos(), 30f32.to_radians().sin());
    assert!(direction.abs_diff_eq(Vec3::new(-cos, -sin, 0.0), 1e-6), "from the east: {direction}");
    assert_eq!(angle, 0.0);
    let Light::Spot { direction, outer, .. } = good(GOOD).lights[1] else { panic!("is a spot") };
    assert!(direction == Vec3::NEG_Y && outer == 20f32.to_radians());
}

/// Scaled, then turned about X, Y and Z in this order, then moved.
#[test]
fn models_are_placed() {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("a.glb"), "").expect("a file");
    let text = r#"
        [materials.a]
        type = "diffuse"
        [[model]]
        file = "a.glb"
        translate = [10, 0, 0]
        rotate = [90, 90, 0]
        scale = [1, 2, 1]
        materials = { Visor = "a" }
    "#;
    let scene = crate::scene::parse(text, &folder.path().join("scene.toml")).expect("is good");
    // (0, 1, 0) → (0, 2, 0) → about X (0, 0, 2) → about Y (2, 0, 0) → (12, 0, 0).
    let p = scene.models[0].to_world.transform_point3(Vec3::Y);
    assert!(p.abs_diff_eq(Vec3::new(12.0, 0.0, 0.0), 1e-5), "{p}");
    assert_eq!(scene.models[0].materials[0].name, "Visor");
}

#[test]
fn textures_are_shared_and_have_their_spaces() {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("a.png"), "").expect("a file");
    let text = r#"
        [materials.a]
        type = "diffuse"
        color = { image = "a.png", repeat = [2, 3], wrap = "mirror" }
        [materials.b]
        type = "pbr"
        base_color = { image = "a.png", wrap = "mirror", factor = 0.5 }
        metallic_roughness = { image = "a.png" }
        normal = { image = "a.png", scale = 0.5 }
    "#;
    let scene = crate::scene::parse(text, &folder.path().join("scene.toml")).expect("is good");
    assert_eq!(scene.images.len(), 2, "{:?}", scene.images);
    let Surface::Diffuse { color } = scene.materials[0].surface else { panic!("is diffuse") };
    let uv = color.texture.expect("is textured").transform.transform_point2(glam::Vec2::ONE);
    assert_eq!(uv, glam::Vec2::new(2.0, 3.0));
    let Surface::Pbr(pbr) = scene.materials[1].surface else { panic!("is pbr") };
    assert_eq!((pbr.metallic.factor, pbr.roughness.factor), (1.0, 1.0), "the texture speaks for itself");
    assert_eq!(pbr.base_color.texture.map(|t| t.texture), color.texture.map(|t| t.texture));
    assert_eq!(scene.materials[1].normal.map(|normal| normal.scale), Some(0.5));
}

#[test]
fn suspicious_things_are_warned_of() {
    let scene = good(
        "[materials.a]\ntype = \"diffuse\"\ncolor = [255, 0, 0]\n[materials.b]\ntype = \"metal\"\nfresnel = \"constant\"\n",
    );
    let messages: Vec<_> = scene.warnings.iter().map(|warning| warning.message.as_str()).collect();
    assert_eq!(messages.len(), 2, "{messages:?}");
}

#[test]
fn layers_that_do_nothing_are_warned_of() {
    for (layers, expected) in [
        ("volume = {}\n", "`volume` has no effect"),
        ("volume = {}\ntransmission = 0\n", "`volume` has no effect"),
        ("transmission = 1\nabbe_number = 30\n", "`abbe_number` has no effect"),
        (
            "transmission = 1\nvolume = { attenuation_color = 0.5 }\n",
            "`attenuation_color` has no effect without",
        ),
        ("sheen = { color = [2, 1, 1] }\n", "reflects more light than arrives"),
        ("diffuse_transmission = { color = 255 }\n", "reflects more light than arrives"),
    ] {
        let scene = good(&format!("[materials.a]\ntype = \"pbr\"\n{layers}"));
        let messages: Vec<_> = scene.warnings.iter().map(|warning| warning.message.as_str()).collect();
        assert!(messages.len() == 1 && messages[0].contains(expected), "{layers}: {messages:?}");
    }
    let fine = "volume = {}\ndiffuse_transmission = { factor = 0.5 }\nspecular = { color = 2 }\n";
    let scene = good(&format!("[materials.a]\ntype = \"pbr\"\n{fine}"));
    assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);
}
