//! `rayo validate` with stand-ins for the other renderers: what is run, compared, told and kept.
#![cfg(unix)]

use std::{
    fs,
    os::unix::fs::PermissionsExt,
    path::Path,
    process::{Command, Output},
};

use assert_cmd::cargo::cargo_bin;
use tempfile::TempDir;

const SCENE: &str = r##"
[render]
size = [32, 24]
samples = 4
filter = "box"
[camera]
position = [0, 0, 5]
[environment]
type = "gradient"
[materials.mirror]
type = "metal"
[[sphere]]
material = "mirror"
"##;

/// Says that it is POV-Ray, and hands out the picture beside it. Like POV-Ray, it takes no name with a space in it.
const STAND_IN: &str = r#"#!/bin/sh
case "$*" in
*--version*) echo "POV-Ray 3.7.stand-in" >&2 ;;
*) echo "Parse Warning: only a stand-in"
   for a in "$@"; do case "$a" in *" "*) exit 9 ;; +O*) cp "$(dirname "$0")/picture.exr" "${a#+O}" ;; esac; done ;;
esac
"#;

fn folder() -> TempDir {
    let folder = tempfile::tempdir().expect("folder");
    fs::write(folder.path().join("ball.toml"), SCENE).expect("written");
    let bin = folder.path().join("bin");
    fs::create_dir(&bin).expect("folder");
    fs::write(bin.join("povray"), STAND_IN).expect("written");
    fs::set_permissions(bin.join("povray"), fs::Permissions::from_mode(0o755)).expect("executable");
    folder
}

fn rayo(folder: &Path, arguments: &str) -> Output {
    let mut command = Command::new(cargo_bin("rayo"));
    let path = format!("{}:/usr/bin:/bin", folder.join("bin").display());
    command.current_dir(folder).env("PATH", path).args(arguments.split(' ')).output().expect("runs")
}

fn said(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

#[test]
fn pictures_are_compared_reported_and_kept() {
    let folder = folder();
    let folder = folder.path();
    let rendered = rayo(folder, "render ball.toml -o bin/picture.exr --samples 4 -q");
    assert!(rendered.status.success(), "{}", said(&rendered));
    let output = rayo(folder, "validate ball.toml --against povray -o out --keep kept");
    assert!(output.status.success(), "{}", said(&output));
    assert!(said(&output).contains("it said: Parse Warning: only a stand-in"), "{}", said(&output));

    let table = String::from_utf8_lossy(&output.stdout).into_owned();
    let row: Vec<&str> = table.lines().nth(1).expect("a row").split_whitespace().collect();
    assert_eq!(row[..3], ["ball", "rayo", "povray"], "{table}");
    let mean: f64 = row[3].parse().expect("a number");
    assert!((mean - 1.0).abs() < 0.01, "{table}");

    let text = fs::read_to_string(folder.join("out/results.json")).expect("results");
    let results: serde_json::Value = serde_json::from_str(&text).expect("json");
    let scene = &results["scenes"][0];
    assert_eq!(scene["pictures"][0]["renderer"], "rayo");
    assert_eq!(scene["pictures"][1]["program"], "POV-Ray 3.7.stand-in");
    assert!(scene["pictures"][0]["noise"].as_f64().is_some_and(|noise| noise > 0.0));
    assert!(scene["pictures"][1]["noise"].is_null(), "one picture has no noise to measure");
    assert_eq!(scene["pairs"][0]["reference"], "povray");

    assert!(folder.join("out/index.html").is_file());
    assert!(folder.join("out/ball/povray/scene.pov").is_file());
    assert!(folder.join("kept/ball.povray.exr").is_file());
    let manifest = fs::read_to_string(folder.join("kept/ball.povray.json")).expect("manifest");
    assert!(manifest.contains("POV-Ray 3.7.stand-in") && manifest.contains("\"samples\": 5"), "{manifest}");
}

#[test]
fn a_scene_that_cannot_be_loaded_does_not_cost_the_others() {
    let folder = folder();
    let folder = folder.path();
    rayo(folder, "render ball.toml -o bin/picture.exr --samples 4 -q");
    let mut command = Command::new(cargo_bin("rayo"));
    let path = format!("{}:/usr/bin:/bin", folder.join("bin").display());
    let arguments = ["validate", "ball.toml", "none.toml", "--against", "povray", "-o", "out of here"];
    let output = command.current_dir(folder).env("PATH", path).args(arguments).output().expect("runs");
    assert_eq!(output.status.code(), Some(2), "{}", said(&output));
    assert!(said(&output).contains("none.toml") && said(&output).contains("1 scenes could not be loaded"));
    for file in ["index.html", "results.json", "ball/rayo.exr", "ball/povray.exr"] {
        assert!(folder.join("out of here").join(file).is_file(), "{file}: {}", said(&output));
    }
}

#[test]
fn a_renderer_that_fails_is_told_and_the_others_go_on() {
    let folder = folder();
    let folder = folder.path();
    fs::write(folder.join("bin/picture.exr"), "no picture").expect("written");
    let output = rayo(folder, "validate ball.toml --against povray -o out");
    assert_eq!(output.status.code(), Some(1), "{}", said(&output));
    assert!(said(&output).contains("povray-1.exr cannot be compared"), "{}", said(&output));
    assert!(folder.join("out/index.html").is_file());

    rayo(folder, "render ball.toml -o bin/picture.exr --size 16x12 --samples 4 -q");
    let output = rayo(folder, "validate ball.toml --against povray -o out");
    assert_eq!(output.status.code(), Some(1), "{}", said(&output));
    assert!(said(&output).contains("16 × 12 pixels") && folder.join("out/index.html").is_file());

    fs::write(folder.join("bin/povray"), STAND_IN.replace("echo \"Parse", "exit 7; echo \"Parse"))
        .expect("written");
    let output = rayo(folder, "validate ball.toml --against povray -o out");
    assert_eq!(output.status.code(), Some(1), "{}", said(&output));
    assert!(said(&output).contains("exit status: 7"), "{}", said(&output));
}

#[test]
fn renderers_that_are_not_there_are_named() {
    let folder = folder();
    let folder = folder.path();
    fs::remove_file(folder.join("bin/povray")).expect("removed");
    let output = rayo(folder, "validate ball.toml --against blender,mitsuba --python /no/such/python -o out");
    assert_eq!(output.status.code(), Some(2), "{}", said(&output));
    for hint in
        ["Blender Cycles was not found", "pip install bpy", "Mitsuba 3 was not found", "pip install mitsuba"]
    {
        assert!(said(&output).contains(hint), "{}", said(&output));
    }
    assert!(!folder.join("out").exists());
}
