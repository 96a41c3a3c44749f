//! Files that are there whole or not at all: written beside the target, then renamed over it.

use std::{
    fs,
    io::Write,
    path::{Path, PathBuf},
};

use tempfile::{Builder, NamedTempFile};

use super::Error;

/// Finds out, before the work is done, why `file` could not be written: an extension that is none of `extensions`, a
/// folder or a device in its place, a folder that is missing or cannot be written to, a write-protected file.
pub fn check_writable(file: &Path, extensions: &[&str]) -> Result<(), Error> {
    let extension = file.extension().and_then(|e| e.to_str()).unwrap_or_default().to_ascii_lowercase();
    if !extensions.contains(&extension.as_str()) {
        return Err(unknown_extension(file, extensions));
    }
    let target = resolve(file);
    if target.is_dir() {
        return Err(Error::target(file, "there is a folder of that name"));
    }
    // Renaming would put a file where a device or a pipe is.
    if target.metadata().is_ok_and(|meta| !meta.is_file()) {
        return Err(Error::target(file, "what is there is not a file"));
    }
    if target.metadata().is_ok_and(|meta| meta.permissions().readonly()) {
        return Err(Error::target(file, "there is a file of that name, and it is write-protected"));
    }
    if !folder(&target).is_dir() {
        let missing = folder(&target).display();
        return Err(Error::target(file, format!("the folder {missing} does not exist; create it first")));
    }
    // The one honest test of a folder (permissions, read-only media, quotas): put something there.
    temporary(&target).map(drop).map_err(|e| Error::target(file, e.to_string()))
}

/// Replaces `file` by `bytes` in one step. On failure the old file is as it was, and nothing else is left.
pub fn write_file(file: &Path, bytes: &[u8]) -> Result<(), Error> {
    let target = resolve(file);
    let write = || {
        let mut temporary = temporary(&target)?;
        temporary.write_all(bytes)?;
        temporary.persist(&target)?;
        Ok(())
    };
    write().map_err(|e: std::io::Error| Error::target(file, e.to_string()))
}

pub fn unknown_extension(file: &Path, extensions: &[&str]) -> Error {
    let known: Vec<String> = extensions.iter().map(|e| format!(".{e}")).collect();
    Error::target(file, format!("the name must end in {}", known.join(" or ")))
}

/// Where a link points, so that the rename replaces the file and not the link.
fn resolve(file: &Path) -> PathBuf {
    match fs::canonicalize(file) {
        Ok(target) if file.is_symlink() => target,
        _ => file.to_owned(),
    }
}

fn folder(file: &Path) -> &Path {
    match file.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    }
}

/// In the target's folder (renaming does not cross file systems), readable as any other file that the user makes.
fn temporary(target: &Path) -> std::io::Result<NamedTempFile> {
    let mut builder = Builder::new();
    builder.prefix(".rayo-").suffix(".tmp");
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666)); // less the umask
    builder.tempfile_in(folder(target))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(folder: &Path) -> Vec<String> {
        let entries = fs::read_dir(folder).expect("folder");
        entries.map(|e| e.expect("entry").file_name().to_string_lossy().into_owned()).collect()
    }

    fn problem(file: &Path) -> String {
        check_writable(file, &["png", "exr"]).expect_err("not writable").to_string()
    }

    #[test]
    fn a_failed_write_leaves_nothing_behind() {
        let folder = tempfile::tempdir().expect("folder");
        let taken = folder.path().join("taken.png");
        fs::create_dir(&taken).expect("folder");
        assert!(write_file(&taken, b"picture").is_err());
        assert_eq!(names(folder.path()), ["taken.png"]);
        assert!(taken.is_dir());
        assert!(write_file(&folder.path().join("missing/a.png"), b"picture").is_err());
        assert_eq!(names(folder.path()).len(), 1);
    }

    #[test]
    fn an_old_file_is_replaced_and_a_check_changes_nothing() {
        let folder = tempfile::tempdir().expect("folder");
        let file = folder.path().join("a.PNG");
        fs::write(&file, "old").expect("written");
        assert!(check_writable(&file, &["png"]).is_ok());
        assert_eq!(fs::read(&file).expect("read"), b"old");
        write_file(&file, b"new").expect("writable");
        assert_eq!(fs::read(&file).expect("read"), b"new");
        assert_eq!(names(folder.path()), ["a.PNG"]);
    }

    #[test]
    fn problems_are_found_and_named() {
        let folder = tempfile::tempdir().expect("folder");
        let at = |name: &str| folder.path().join(name);
        assert!(problem(&at("a.jpg")).contains(".png or .exr"));
        assert!(problem(&at("png")).contains(".png or .exr"));
        assert!(problem(&at("no/such/a.png")).contains("does not exist"));
        fs::create_dir(at("b.png")).expect("folder");
        assert!(problem(&at("b.png")).contains("folder of that name"));
        fs::write(at("c.png"), "keep").expect("written");
        let mut permissions = at("c.png").metadata().expect("meta").permissions();
        permissions.set_readonly(true);
        fs::set_permissions(at("c.png"), permissions).expect("own file");
        assert!(problem(&at("c.png")).contains("write-protected"));
    }

    #[test]
    #[cfg(target_os = "linux")]
    fn an_unwritable_folder_is_found() {
        assert!(problem(Path::new("/proc/a.png")).contains("cannot write /proc/a.png"));
    }

    #[test]
    #[cfg(unix)]
    fn devices_stay_what_they_are() {
        let folder = tempfile::tempdir().expect("folder");
        let link = folder.path().join("a.png");
        std::os::unix::fs::symlink("/dev/null", &link).expect("link");
        assert!(problem(&link).contains("not a file"));
    }

    #[test]
    #[cfg(unix)]
    fn links_are_followed_and_permissions_are_ordinary() {
        use std::os::unix::fs::{PermissionsExt, symlink};
        let folder = tempfile::tempdir().expect("folder");
        let (real, link) = (folder.path().join("real.png"), folder.path().join("link.png"));
        fs::write(&real, "old").expect("written");
        let ordinary = real.metadata().expect("meta").permissions().mode();
        symlink(&real, &link).expect("link");
        write_file(&link, b"new").expect("writable");
        assert!(link.is_symlink());
        assert_eq!(fs::read(&real).expect("read"), b"new");
        assert_eq!(real.metadata().expect("meta").permissions().mode(), ordinary);
    }
}
