//! The sample assets, which are not ours to ship: the environment variable `RAYO_SAMPLE_ASSETS` names their folder.

use std::path::{Path, PathBuf};

/// The folder of samples of one kind, or `None` with a line that says the test was skipped.
pub fn samples(kind: &str) -> Option<PathBuf> {
    let root = std::env::var_os("RAYO_SAMPLE_ASSETS");
    if root.is_none() {
        println!("skipped: RAYO_SAMPLE_ASSETS is not set");
    }
    root.map(|root| PathBuf::from(root).join(kind))
}

/// All files below `folder` with one of these extensions, in order.
pub fn files(folder: &Path, extensions: &[&str]) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in std::fs::read_dir(folder).expect("a readable folder").flatten() {
        let path = entry.path();
        if path.is_dir() {
            found.append(&mut files(&path, extensions));
        } else if path.extension().is_some_and(|e| extensions.iter().any(|known| e == *known)) {
            found.push(path);
        }
    }
    found.sort();
    found
}
