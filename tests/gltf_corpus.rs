//! Every sample glTF file, valid and invalid, through the importer: a model or an error, never a panic, and quickly.
//!
//! The samples are reached through the environment variable `RAYO_SAMPLE_ASSETS`; where it is unset these tests say so
//! and pass. Figures of the known files were counted apart from the importer, from their JSON.

use std::{
    path::{Path, PathBuf},
    time::{Duration, Instant},
};

use rayo::{
    diagnostic::{Diagnostic, Severity},
    import::gltf,
    world::Model,
};

const TIME_LIMIT: Duration = Duration::from_secs(5);

/// The folder of samples, or `None` with a line that says the test was skipped.
fn samples() -> Option<PathBuf> {
    let folder = std::env::var_os("RAYO_SAMPLE_ASSETS").map(PathBuf::from);
    if folder.is_none() {
        println!("skipped: RAYO_SAMPLE_ASSETS is not set");
    }
    folder
}

fn gltf_files(folder: &Path) -> Vec<PathBuf> {
    let mut files = Vec::new();
    let mut folders = vec![folder.to_owned()];
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(&folder).expect("a readable folder").flatten() {
            let path = entry.path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|e| e == "gltf" || e == "glb") {
                files.push(path);
            }
        }
    }
    files.sort();
    files
}

fn load_in_time(path: &Path) -> Result<Model, Vec<Diagnostic>> {
    let start = Instant::now();
    let result = gltf::load(path);
    assert!(start.elapsed() < TIME_LIMIT, "{} took {:?}", path.display(), start.elapsed());
    match &result {
        Ok(model) => assert_sound(model, path),
        Err(diagnostics) => {
            let error = diagnostics.iter().find(|d| d.severity == Severity::Error);
            let error = error.unwrap_or_else(|| panic!("{} fails without an error", path.display()));
            assert!(!error.message.is_empty());
            assert!(!error.message.contains("the importer failed"), "{} panics", path.display());
        }
    }
    result
}

/// What the rest of the program relies on without looking.
fn assert_sound(model: &Model, path: &Path) {
    for mesh in &model.meshes {
        let n = mesh.positions.len();
        let optional = |len: usize| len == 0 || len == n;
        assert!(mesh.triangles.as_flattened().iter().all(|&v| (v as usize) < n), "{}", path.display());
        assert!(optional(mesh.normals.len()) && optional(mesh.tangents.len()) && optional(mesh.colors.len()));
        assert!(optional(mesh.uvs[0].len()) && optional(mesh.uvs[1].len()));
        assert!(
            mesh.normals.iter().all(|v| v.is_normalized()) && mesh.positions.iter().all(|p| p.is_finite())
        );
        assert!(mesh.tangents.iter().all(|t| t.truncate().is_normalized() && t.w.abs() == 1.0));
    }
    for instance in &model.instances {
        assert!(instance.mesh.index() < model.meshes.len() && instance.materials.len() == 1);
        assert!(
            instance.materials[0].index() < model.materials.len() && instance.to_world.inverse().is_finite()
        );
    }
    assert!(model.textures.iter().all(|t| t.image.index() < model.images.len()));
}

#[test]
fn every_sample_loads_or_says_why_not() {
    let Some(samples) = samples() else { return };
    let (mut loaded, mut refused) = (0, 0);
    for path in gltf_files(&samples.join("gltf")) {
        match load_in_time(&path) {
            Ok(_) => loaded += 1,
            Err(diagnostics) => {
                refused += 1;
                println!("{}: {}", path.display(), diagnostics[0].message);
            }
        }
    }
    println!("{loaded} samples load, {refused} are refused");
}
