//! The folder an export becomes: filled out of sight, then moved into place.
//!
//! A list of what was written stays in it. The next export replaces those files and removes what it has no use for; a file
//! that no export wrote is never touched.

use std::{
    collections::BTreeSet,
    fs, io,
    path::{Component, Path, PathBuf},
};

use tempfile::TempDir;

use super::Error;
use crate::output;

/// Names of an export's files, one a line.
const LIST: &str = ".rayo-export";

/// Files written so far, in a temporary folder inside the target.
#[derive(Debug)]
pub struct Folder {
    target: PathBuf,
    /// `None` once it is published.
    stage: Option<TempDir>,
    /// Relative, with `/`.
    files: BTreeSet<String>,
    /// What an earlier export wrote here.
    earlier: BTreeSet<String>,
    /// Folders that were not there before, the outermost first.
    made: Vec<PathBuf>,
}

impl Folder {
    pub fn stage(target: &Path) -> Result<Self, Error> {
        let fault = |problem: io::Error| fault(target, problem);
        let mut made: Vec<PathBuf> = target
            .ancestors()
            .take_while(|folder| !folder.as_os_str().is_empty() && !folder.exists())
            .map(Path::to_owned)
            .collect();
        made.reverse();
        let earlier = fs::read_to_string(target.join(LIST)).unwrap_or_default();
        let earlier = earlier.lines().filter(|name| is_inside(name)).map(str::to_owned).collect();
        let mut folder =
            Self { target: target.to_owned(), stage: None, files: BTreeSet::new(), earlier, made };
        fs::create_dir_all(target).map_err(fault)?;
        folder.stage = Some(tempfile::Builder::new().prefix(".rayo-").tempdir_in(target).map_err(fault)?);
        Ok(folder)
    }

    /// `name` is relative, with `/` between folders.
    pub fn write(&mut self, name: &str, bytes: &[u8]) -> Result<(), Error> {
        let Some(stage) = &self.stage else { return Ok(()) };
        let file = stage.path().join(name);
        if let Some(parent) = file.parent() {
            fs::create_dir_all(parent).map_err(|e| fault(parent, e))?;
        }
        output::write_file(&file, bytes)?;
        self.files.insert(name.to_owned());
        Ok(())
    }

    /// Moves everything to where it belongs.
    pub fn publish(mut self) -> Result<(), Error> {
        for name in self.files.difference(&self.earlier) {
            let file = self.target.join(name);
            if file.symlink_metadata().is_ok() {
                return Err(Error::Foreign(file.display().to_string()));
            }
        }
        let list: String = self.files.iter().map(|name| format!("{name}\n")).collect();
        self.write(LIST, list.as_bytes())?;
        let Some(stage) = self.stage.take() else { return Ok(()) };
        for name in &self.files {
            let (from, to) = (stage.path().join(name), self.target.join(name));
            if let Some(parent) = to.parent() {
                fs::create_dir_all(parent).map_err(|e| fault(parent, e))?;
            }
            fs::rename(from, &to).map_err(|e| fault(&to, e))?;
        }
        for stale in self.earlier.difference(&self.files) {
            let _ = fs::remove_file(self.target.join(stale));
        }
        self.made.clear();
        Ok(())
    }
}

/// What was given up leaves nothing behind.
impl Drop for Folder {
    fn drop(&mut self) {
        drop(self.stage.take());
        for folder in self.made.iter().rev() {
            let _ = fs::remove_dir(folder);
        }
    }
}

/// A list could have been written by anyone.
fn is_inside(name: &str) -> bool {
    !name.is_empty() && Path::new(name).components().all(|part| matches!(part, Component::Normal(_)))
}

fn fault(folder: &Path, problem: io::Error) -> Error {
    Error::Folder { folder: folder.display().to_string(), problem: problem.to_string() }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn export(target: &Path, files: &[&str]) -> Result<(), Error> {
        let mut folder = Folder::stage(target)?;
        files.iter().try_for_each(|name| folder.write(name, name.as_bytes()))?;
        folder.publish()
    }

    #[test]
    fn nothing_is_seen_before_everything_is_there() {
        let root = tempfile::tempdir().expect("folder");
        let target = root.path().join("a/b");
        let mut folder = Folder::stage(&target).expect("staged");
        folder.write("textures/x.png", b"x").expect("written");
        assert!(!target.join("textures").exists());
        folder.publish().expect("published");
        assert_eq!(fs::read(target.join("textures/x.png")).expect("there"), b"x");
        assert_eq!(fs::read_dir(&target).expect("folder").count(), 2, "the file, the list");
    }

    #[test]
    fn what_is_given_up_leaves_nothing() {
        let root = tempfile::tempdir().expect("folder");
        let mut folder = Folder::stage(&root.path().join("a/b")).expect("staged");
        folder.write("x", b"y").expect("written");
        drop(folder);
        assert_eq!(fs::read_dir(root.path()).expect("folder").count(), 0);
    }

    #[test]
    fn the_next_export_replaces_its_own_files_alone() {
        let root = tempfile::tempdir().expect("folder");
        let target = root.path();
        export(target, &["NOTES.md", "old/mesh"]).expect("written");
        fs::write(target.join("old/mine"), "keep").expect("written");
        export(target, &["NOTES.md", "new"]).expect("written");
        assert!(!target.join("old/mesh").exists() && target.join("old/mine").exists());
        fs::write(target.join("scene.py"), "mine").expect("written");
        let refused = export(target, &["NOTES.md", "scene.py"]).expect_err("not its own");
        assert!(refused.to_string().contains("scene.py"), "{refused}");
        assert_eq!(fs::read(target.join("scene.py")).expect("there"), b"mine");
    }

    #[test]
    fn a_forged_list_removes_nothing_outside() {
        let root = tempfile::tempdir().expect("folder");
        let (target, precious) = (root.path().join("t"), root.path().join("precious"));
        fs::create_dir(&target).expect("folder");
        fs::write(&precious, "keep").expect("written");
        fs::write(target.join(LIST), format!("../precious\n{}\n", precious.display())).expect("written");
        export(&target, &["x"]).expect("written");
        assert!(precious.exists());
    }
}
