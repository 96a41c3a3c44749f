//! What `rayo export --to blender` writes, rendered by Cycles, against closed forms. It needs a Python with Blender's
//! module `bpy`: `python3`, or the one that RAYO_PYTHON names; without it the test says so and passes.

use std::{env, fs, path::Path, process::Command};

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

#[test]
fn cycles_renders_closed_forms() {
    let Some(python) = python() else {
        eprintln!("skipped: no Python with the module bpy (RAYO_PYTHON names one)");
        return;
    };
    let folder = tempfile::tempdir().expect("folder");
    let folder = folder.path();
    fs::write(folder.join("scene.toml"), SCENE).expect("written");
    let exported = Command::new(cargo_bin("rayo"))
        .current_dir(folder)
        .args(["export", "scene.toml", "--to", "blender", "-o", "out", "--strict", "-q"])
        .status();
    assert!(exported.expect("runs").success());
    let output = Command::new(python).arg("out/scene.py").current_dir(folder).output().expect("runs");
    let said =
        format!("{}{}", String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    assert!(output.status.success(), "{said}");
    assert!(said.contains("RENDER_SECONDS") && !said.to_lowercase().contains("warning"), "{said}");

    let picture = folder.join("out/scene.exr");
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
