//! Where the files are that OBJ and MTL name.
//!
//! Names come from other machines: with `\` between folders, in another case, absolute, or from a folder that was not
//! sent along. Parent folders (`../textures/wood.png`) are usual. A name is looked up
//!
//! 1. as it is, relative to each of the folders (an absolute one: where it says),
//! 2. without regard to case,
//! 3. by its last part alone, in the folders themselves.
//!
//! Only regular files are found: a pipe or device would block or never end.

use std::{
    ffi::OsStr,
    path::{Component, Path, PathBuf},
};

/// The first file that `name` may mean.
pub(super) fn locate(folders: &[&Path], name: &str) -> Option<PathBuf> {
    let name = name.trim().replace('\\', "/");
    if name.is_empty() || name.contains("://") {
        return None;
    }
    let path = Path::new(&name);
    let last = path.file_name().map(Path::new);
    let as_is = folders.iter().map(|folder| folder.join(path)).find(|p| p.is_file());
    let any_case = || folders.iter().find_map(|folder| ignoring_case(folder, path));
    let last_part = || folders.iter().find_map(|folder| ignoring_case(folder, last?));
    as_is.or_else(any_case).or_else(last_part)
}

/// `folder/path` where each part may differ in case from that on disk.
fn ignoring_case(folder: &Path, path: &Path) -> Option<PathBuf> {
    let mut at = folder.to_path_buf();
    for part in path.components() {
        match part {
            Component::CurDir => {}
            Component::ParentDir => at.push(".."),
            Component::Normal(name) if at.join(name).exists() => at.push(name),
            Component::Normal(name) => at.push(entry_like(&at, name)?),
            Component::RootDir | Component::Prefix(_) => return None,
        }
    }
    at.is_file().then_some(at)
}

/// The entry of `folder` that is `name` but for case; the first in alphabetical order, so that it is always the same.
fn entry_like(folder: &Path, name: &OsStr) -> Option<std::ffi::OsString> {
    let wanted = name.to_string_lossy().to_lowercase();
    let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
    let entries = folder.read_dir().ok()?.flatten().map(|entry| entry.file_name());
    entries.filter(|entry| entry.to_string_lossy().to_lowercase() == wanted).min()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_other_machines_are_found() {
        let root = tempfile::tempdir().expect("a folder for temporary files");
        let folder = root.path().join("models");
        let _ = std::fs::create_dir_all(folder.join("Textures"));
        for file in ["Textures/Wood Oak.PNG", "brick.png", "../sky.png"] {
            std::fs::write(folder.join(file), "").expect("it can be written");
        }
        let found = |name: &str| {
            let path = locate(&[Path::new("nowhere"), &folder], name)?;
            Some(path.strip_prefix(&folder).map(Path::to_path_buf).unwrap_or(path))
        };
        let path = |name: &str| Some(PathBuf::from(name));
        assert_eq!(found("Textures/Wood Oak.PNG"), path("Textures/Wood Oak.PNG"));
        assert_eq!(found(r"textures\wood oak.png"), path("Textures/Wood Oak.PNG"));
        assert_eq!(found(r"C:\Users\me\Brick.png"), path("brick.png"));
        assert_eq!(found("/home/me/brick.png"), path("brick.png"));
        assert_eq!(found("../sky.png"), path("../sky.png"));
        assert_eq!(found(r".\brick.png"), path("brick.png"));
        for nothing in ["", "..", "Textures", "missing.png", "https://example.com/brick.png", "/etc"] {
            assert_eq!(found(nothing), None, "{nothing}");
        }
    }
}
