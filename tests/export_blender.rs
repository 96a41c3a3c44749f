//! What `rayo export --to blender` writes, rendered by Cycles, against closed forms. It needs a Python with Blender's
//! module `bpy`: `python3`, or the one that RAYO_PYTHON names; without it the test says so and passes.

use std::{
    env, fs,
    path::{Path, PathBuf},
    process::Command,
};

use assert_cmd::cargo::cargo_bin;

/// A wide floor from above: a lamp over the middle, a sun aslant, an even sky.
const SCENE: &str = r#"
[render]
size = [33, 33]
samples = 256
bounces = 0
filter = "box"
[camera]
position = [0, 3, 0]
target = [0, 0, 0]
up = [0, 0, -1]
ortho_height = 0.5
[environment]
type = "color"
color = [0.1, 0.2, 0.3]
[materials]
floor = { type = "diffuse", color = 0.6 }
[[quad]]
origin = [-4, 0, 4]
u = [4.1, 0, 0]
v = [0, 0, -8]
material = "floor"
[[light]]
type = "point"
position = [0, 2, 0]
intensity = 8
color = [1, 0.5, 0.25]
[[light]]
type = "sun"
direction = [0, -0.8, 0.6]
irradiance = 3
angle = 0
"#;

/// An even sky of 1, seen in four small things from above: what layers make of it follows from Fresnel's and Beer's laws.
const LAYERS: &str = r#"
[render]
size = [64, 16]
samples = 512
bounces = 8
filter = "box"
[camera]
position = [0, 5, 0]
target = [0, 0, 0]
up = [0, 0, -1]
ortho_height = 0.1
[environment]
type = "color"
color = 1
[materials]
coat = { type = "pbr", base_color = 0, roughness = 1, specular = { factor = 0 }, clearcoat = { factor = 0.5 } }
pane = { type = "pbr", base_color = [0.5, 0.8, 1], roughness = 0, transmission = 0.75 }
leaf = { type = "pbr", base_color = [0.2, 0.4, 0], specular = { factor = 0 }, diffuse_transmission = { factor = 0.25, color = [0.8, 0, 0.4] } }
tint = { type = "pbr", roughness = 0, ior = 1, transmission = 1, volume = { attenuation_color = [0.5, 0.9, 1], attenuation_distance = 0.03333 } }
[[quad]]
origin = [-0.2, 0, 0.1]
u = [0.1, 0, 0]
v = [0, 0, -0.2]
material = "coat"
[[quad]]
origin = [-0.1, 0, 0.1]
u = [0.1, 0, 0]
v = [0, 0, -0.2]
material = "pane"
[[quad]]
origin = [0, 0, 0.1]
u = [0.1, 0, 0]
v = [0, 0, -0.2]
material = "leaf"
[[sphere]]
center = [0.15, 0, 0]
radius = 0.05
material = "tint"
"#;

fn python() -> Option<String> {
    let python = env::var("RAYO_PYTHON").unwrap_or_else(|_| "python3".into());
    let found = Command::new(&python).args(["-c", "import bpy"]).output();
    found.is_ok_and(|output| output.status.success()).then_some(python)
}

fn pixel(file: &Path, x: usize, y: usize) -> [f32; 3] {
    let image = exr::prelude::read_first_rgba_layer_from_file(
        file,
        |size, _| (size.width(), vec![[0f32; 3]; size.width() * size.height()]),
        |(width, pixels), at, (r, g, b, _): (f32, f32, f32, f32)| {
            pixels[at.y() * *width + at.x()] = [r, g, b]
        },
    );
    let image = image.expect("an EXR").layer_data.channel_data.pixels;
    image.1[y * image.0 + x]
}

/// What Cycles makes of a scene, in the folder; `None` where there is no Cycles.
fn rendered(scene: &str, folder: &Path) -> Option<PathBuf> {
    let Some(python) = python() else {
        eprintln!("skipped: no Python with the module bpy (RAYO_PYTHON names one)");
        return None;
    };
    fs::write(folder.join("scene.toml"), scene).expect("written");
    let exported = Command::new(cargo_bin("rayo"))
        .current_dir(folder)
        .args(["export", "scene.toml", "--to", "blender", "-o", "out", "-q"])
        .status();
    assert!(exported.expect("runs").success());
    let output = Command::new(python).arg("out/scene.py").current_dir(folder).output().expect("runs");
    let said =
        format!("{}{}", String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    assert!(output.status.success(), "{said}");
    assert!(said.contains("RENDER_SECONDS") && !said.to_lowercase().contains("warning"), "{said}");
    Some(folder.join("out/scene.exr"))
}

#[test]
fn cycles_renders_closed_forms() {
    let folder = tempfile::tempdir().expect("folder");
    let Some(picture) = rendered(SCENE, folder.path()) else { return };
    let notes = fs::read_to_string(folder.path().join("out/NOTES.md")).expect("notes");
    assert!(notes.contains("Nothing in the scene had to be"), "{notes}");
    let sky = [0.1, 0.2, 0.3];
    let lamp = [1.0, 0.5, 0.25].map(|color| 8.0 * color / 4.0);
    let floor = pixel(&picture, 16, 16);
    for channel in 0..3 {
        // radiance = albedo / π × (irradiance of the lamp, the sun and the sky)
        let irradiance = lamp[channel] + 3.0 * 0.8 + std::f32::consts::PI * sky[channel];
        let expected = 0.6 / std::f32::consts::PI * irradiance;
        assert!((floor[channel] / expected - 1.0).abs() < 0.01, "{channel}: {floor:?} for {expected}");
    }
    // the floor ends 0.1 m to the right of the middle
    let beside = pixel(&picture, 30, 16);
    assert!((0..3).all(|c| (beside[c] - sky[c]).abs() < 1e-6), "{beside:?}");
}

#[test]
fn cycles_renders_layers() {
    let folder = tempfile::tempdir().expect("folder");
    let Some(picture) = rendered(LAYERS, folder.path()) else { return };
    // what the index of 1.5 reflects head on, and the rest
    let (f, t) = (0.04, 0.96);
    let pane = |base: f32| f + t * (0.25 * base + 0.75 * base);
    let expected = [
        [0.5 * f; 3],
        [pane(0.5), pane(0.8), pane(1.0)],
        [0.75 * 0.2 + 0.25 * 0.8, 0.75 * 0.4, 0.25 * 0.4],
        [0.125, 0.729, 1.0],
    ];
    for (i, (expected, x)) in expected.iter().zip([8, 24, 40, 56]).enumerate() {
        let found = pixel(&picture, x, 8);
        for channel in 0..3 {
            assert!((found[channel] - expected[channel]).abs() < 0.01, "{i}: {found:?} for {expected:?}");
        }
    }
}
