//! What is shown in the documentation, and the scenes that come with the program.

use std::{fs, path::PathBuf};

use super::render;
use crate::scene::{load, parse};

fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

/// Every ```toml block of docs/scene-file.md is a whole scene file. Files that it names are put into its folder.
#[test]
fn snippets_are_good() {
    let folder = tempfile::tempdir().expect("a folder");
    let text = fs::read_to_string(root().join("docs/scene-file.md")).expect("the reference is there");
    let mut snippets = 0;
    for block in text.split("```toml\n").skip(1) {
        let snippet = block.split("```").next().unwrap_or_default();
        for name in snippet.split('"').filter(|name| {
            [".glb", ".gltf", ".obj", ".png", ".jpg", ".hdr", ".exr"].iter().any(|end| name.ends_with(end))
        }) {
            let path = folder.path().join(name);
            fs::create_dir_all(path.parent().expect("has a folder")).expect("a folder");
            fs::write(path, "").expect("a file");
        }
        match parse(snippet, &folder.path().join("scene.toml")) {
            Ok(scene) => assert!(scene.warnings.is_empty(), "{}", render(&scene.warnings, false)),
            Err(errors) => panic!("{}", render(&errors, false)),
        }
        snippets += 1;
    }
    assert!(snippets > 10);
}

/// Every key that the schema knows is in the reference.
#[test]
fn every_key_is_documented() {
    let text = fs::read_to_string(root().join("docs/scene-file.md")).expect("the reference is there");
    let schema = crate::scene::schema();
    for (table, definition) in schema["definitions"].as_object().expect("has definitions") {
        for name in definition["properties"].as_object().into_iter().flatten().map(|(name, _)| name) {
            assert!(text.contains(&format!("`{name}`")), "{table}.{name}");
        }
    }
}

#[test]
fn our_scenes_are_good() {
    let scenes = fs::read_dir(root().join("scenes")).expect("the scenes are there");
    let mut count = 0;
    for path in scenes.filter_map(|entry| Some(entry.ok()?.path())) {
        if path.extension().is_some_and(|extension| extension == "toml") {
            let scene = load(&path).unwrap_or_else(|errors| panic!("{}", render(&errors, false)));
            assert!(scene.warnings.is_empty(), "{}", render(&scene.warnings, false));
            count += 1;
        }
    }
    assert!(count >= 3);
}
