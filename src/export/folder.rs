//! The folder an export becomes: filled out of sight, then moved into place.

use std::{
    fs, io,
    path::{Path, PathBuf},
};

use tempfile::TempDir;

use super::Error;
use crate::output;

/// Files written so far, in a temporary folder beside the target.
#[derive(Debug)]
pub struct Folder {
    target: PathBuf,
    stage: TempDir,
    /// Relative, with `/`.
    files: Vec<String>,
}

impl Folder {
    pub fn stage(target: &Path) -> Result<Self, Error> {
        let fault = |problem: io::Error| fault(target, problem);
        fs::create_dir_all(target).map_err(fault)?;
        let stage = tempfile::Builder::new().prefix(".rayo-").tempdir_in(target).map_err(fault)?;
        Ok(Self { target: target.to_owned(), stage, files: Vec::new() })
    }

    /// `name` is relative, with `/` between folders.
    pub fn write(&mut self, name: &str, bytes: &[u8]) -> Result<(), Error> {
        let file = self.stage.path().join(name);
        if let Some(parent) = file.parent() {
            fs::create_dir_all(parent).map_err(|e| fault(parent, e))?;
        }
        output::write_file(&file, bytes)?;
        self.files.push(name.to_owned());
        Ok(())
    }

    /// Moves everything to where it belongs.
    pub fn publish(self) -> Result<(), Error> {
        for name in &self.files {
            let (from, to) = (self.stage.path().join(name), self.target.join(name));
            if let Some(parent) = to.parent() {
                fs::create_dir_all(parent).map_err(|e| fault(parent, e))?;
            }
            fs::rename(from, &to).map_err(|e| fault(&to, e))?;
        }
        Ok(())
    }
}

fn fault(folder: &Path, problem: io::Error) -> Error {
    Error::Folder { folder: folder.display().to_string(), problem: problem.to_string() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_is_seen_before_everything_is_there() {
        let root = tempfile::tempdir().expect("folder");
        let target = root.path().join("a/b");
        let mut folder = Folder::stage(&target).expect("staged");
        folder.write("textures/x.png", b"x").expect("written");
        assert!(!target.join("textures").exists());
        folder.publish().expect("published");
        assert_eq!(fs::read(target.join("textures/x.png")).expect("there"), b"x");
        assert_eq!(fs::read_dir(&target).expect("folder").count(), 1, "no temporary folder is left");

        let mut given_up = Folder::stage(&target).expect("staged");
        given_up.write("textures/x.png", b"y").expect("written");
        drop(given_up);
        assert_eq!(fs::read(target.join("textures/x.png")).expect("there"), b"x");
        assert_eq!(fs::read_dir(&target).expect("folder").count(), 1);
    }
}
