//! Files that users name, read whole and no further than a limit. Errors complete "cannot read …: ".

use std::{
    fs::{self, File},
    io::{self, ErrorKind, Read},
    path::Path,
};

/// The bytes of the file at `path`: at least one, at most `limit`.
pub fn read(path: &Path, limit: u64) -> Result<Vec<u8>, String> {
    let mut bytes = Vec::new();
    // One byte more than is allowed: a file may grow after it was measured.
    let read = open(path)?.take(limit.saturating_add(1)).read_to_end(&mut bytes);
    match read.map_err(|error| why(&error))? as u64 {
        0 => Err("it is empty".into()),
        size if size > limit => Err(format!("it is larger than {} MiB", limit >> 20)),
        _ => Ok(bytes),
    }
}

/// Opens what is a plain file: a pipe or a device could be read without end.
pub fn open(path: &Path) -> Result<File, String> {
    let metadata = fs::metadata(path).map_err(|error| why(&error))?;
    if metadata.is_dir() {
        return Err("it is a folder, not a file".into());
    }
    if !metadata.is_file() {
        return Err("it is not a file but a device or a pipe".into());
    }
    File::open(path).map_err(|error| why(&error))
}

fn why(error: &io::Error) -> String {
    match error.kind() {
        ErrorKind::NotFound => "there is no such file".into(),
        ErrorKind::PermissionDenied => "permission is denied".into(),
        _ => error.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_plain_files_up_to_the_limit() {
        let folder = tempfile::tempdir().expect("a folder");
        let file = folder.path().join("a");
        fs::write(&file, [7; 10]).expect("written");
        let empty = folder.path().join("empty");
        fs::write(&empty, []).expect("written");
        assert_eq!(read(&file, 10), Ok(vec![7; 10]));
        assert_eq!(read(&file, u64::MAX), Ok(vec![7; 10]));
        assert!(read(&file, 9).is_err_and(|why| why.contains("larger")));
        assert!(read(&empty, 10).is_err_and(|why| why.contains("empty")));
        assert!(read(folder.path(), 10).is_err_and(|why| why.contains("folder")));
        assert!(read(&folder.path().join("b"), 10).is_err_and(|why| why.contains("no such file")));
        #[cfg(unix)]
        assert!(read(Path::new("/dev/zero"), 10).is_err_and(|why| why.contains("device")));
    }
}
