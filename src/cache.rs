//! What is slow to make of a file, kept in a folder for the next time.
//!
//! An entry is a file named by the BLAKE3 hash of what it was made of and of the version of this layout: 16 bytes of the
//! owner's, the body, and the BLAKE3 hash of the name and all before. Whatever is not exactly that, because it was cut off,
//! flipped, renamed or written by another program, counts as not there and is written anew. Entries appear whole, by renaming, so any
//! number of processes may share a folder. Numbers are as this machine stores them, which the name says too.
//!
//! All entries together take at most a limit, [`LIMIT`] by default; beyond it those not used the longest go first. Files of other
//! names in the folder are left alone. Where the folder cannot be written to, nothing is kept: that is no error.

use std::{
    fs::{self, FileTimes},
    io::{Read, Write},
    path::{Path, PathBuf},
    sync::{Mutex, OnceLock},
    time::SystemTime,
};

use blake3::{Hash, Hasher};

use crate::input;

/// Bytes of all entries.
pub const LIMIT: u64 = 4 << 30;

/// Changes when what is kept, or what it is made by, does.
const LAYOUT: &str = concat!("rayo ", env!("CARGO_PKG_VERSION"), " cache 1");

const EXTENSION: &str = "rayo-cache";
const PREFIX: &str = "rayo-cache-";
const HEAD: usize = 16;
const SUM: usize = blake3::OUT_LEN;

/// That of this process, if it has one.
static SHARED: OnceLock<Cache> = OnceLock::new();

/// From now on this process keeps what it can in `folder`; the first one counts.
pub fn keep_in(folder: &Path) -> Result<(), String> {
    let cache = Cache::open(folder, LIMIT)?;
    _ = SHARED.set(cache);
    Ok(())
}

/// Where this process keeps what it can.
pub fn shared() -> Option<&'static Cache> {
    SHARED.get()
}

#[derive(Debug)]
pub struct Cache {
    folder: PathBuf,
    limit: u64,
    /// Bytes of all entries, about: other processes write, too.
    used: Mutex<u64>,
}

/// The name of an entry.
#[derive(Clone, Copy, Debug)]
pub struct Key(Hash);

impl Key {
    /// Of what `parts` are made into; `kind` says what that is.
    pub fn of(kind: &str, parts: &[&[u8]]) -> Self {
        let order = if cfg!(target_endian = "little") { "little" } else { "big" };
        let mut hasher = Hasher::new();
        for part in [LAYOUT.as_bytes(), order.as_bytes(), kind.as_bytes()].iter().chain(parts) {
            hasher.update(&(part.len() as u64).to_le_bytes()).update(part);
        }
        Self(hasher.finalize())
    }

    fn sum(&self, head: &[u8; HEAD], body: &[u8]) -> Hash {
        Hasher::new().update(self.0.as_bytes()).update(head).update(body).finalize()
    }
}

impl Cache {
    /// In `folder`, which is made where it is not there.
    pub fn open(folder: &Path, limit: u64) -> Result<Self, String> {
        let failed = |e: std::io::Error| format!("cannot keep anything in {}: {e}", folder.display());
        fs::create_dir_all(folder).map_err(failed)?;
        let used = entries(folder).map_err(failed)?.iter().map(|entry| entry.bytes).sum();
        Ok(Self { folder: folder.to_owned(), limit, used: Mutex::new(used) })
    }

    /// What was kept under `key`. `empty` is given its 16 bytes and the length of its body, and makes something with room for exactly
    /// as many `bytes`, or says that they cannot be right.
    pub fn get<B>(
        &self,
        key: &Key,
        empty: impl FnOnce([u8; HEAD], u64) -> Option<B>,
        bytes: impl Fn(&mut B) -> &mut [u8],
    ) -> Option<B> {
        let mut file = input::open(&self.path(key)).ok()?;
        let length = file.metadata().ok()?.len().checked_sub((HEAD + SUM) as u64)?;
        let (mut head, mut sum) = ([0; HEAD], [0; SUM]);
        file.read_exact(&mut head).ok()?;
        let mut body = empty(head, length)?;
        let room = bytes(&mut body);
        if room.len() as u64 != length {
            return None;
        }
        file.read_exact(room).ok()?;
        file.read_exact(&mut sum).ok()?;
        if key.sum(&head, room) != sum {
            return None;
        }
        // So that it is known when it was last of use. (Where it cannot be noted it is the older.)
        _ = file.set_times(FileTimes::new().set_modified(SystemTime::now()));
        Some(body)
    }

    /// Keeps `body` under `key`, if it can.
    pub fn put(&self, key: &Key, head: [u8; HEAD], body: &[u8]) {
        let length = (HEAD + body.len() + SUM) as u64;
        if length <= self.limit && self.make_room(length).is_ok() {
            _ = self.write(key, &head, body);
        }
    }

    fn write(&self, key: &Key, head: &[u8; HEAD], body: &[u8]) -> std::io::Result<()> {
        let mut file = tempfile::Builder::new().prefix(PREFIX).tempfile_in(&self.folder)?;
        file.write_all(head)?;
        file.write_all(body)?;
        file.write_all(key.sum(head, body).as_bytes())?;
        file.persist(self.path(key))?;
        Ok(())
    }

    /// Removes what was not used the longest until `length` bytes more are within the limit, and some to spare.
    fn make_room(&self, length: u64) -> std::io::Result<()> {
        let mut used = self.used.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
        if *used + length > self.limit {
            let mut all = entries(&self.folder)?;
            all.sort_by_key(|entry| entry.time);
            *used = all.iter().map(|entry| entry.bytes).sum();
            for entry in all {
                if *used + length <= self.limit / 4 * 3 {
                    break;
                }
                if fs::remove_file(&entry.path).is_ok() {
                    *used -= entry.bytes;
                }
            }
        }
        *used += length;
        Ok(())
    }

    fn path(&self, key: &Key) -> PathBuf {
        self.folder.join(key.0.to_hex().as_str()).with_extension(EXTENSION)
    }
}

struct Entry {
    path: PathBuf,
    bytes: u64,
    time: SystemTime,
}

/// The files in `folder` that are ours, those left behind by processes that were ended while they wrote among them.
fn entries(folder: &Path) -> std::io::Result<Vec<Entry>> {
    let ours = |path: &Path| {
        path.extension().is_some_and(|extension| extension == EXTENSION)
            || path.file_name().is_some_and(|name| name.to_string_lossy().starts_with(PREFIX))
    };
    let entry = |path: PathBuf| {
        let metadata = fs::symlink_metadata(&path).ok().filter(|metadata| metadata.is_file())?;
        Some(Entry { bytes: metadata.len(), time: metadata.modified().ok()?, path })
    };
    Ok(fs::read_dir(folder)?
        .filter_map(|e| Some(e.ok()?.path()))
        .filter(|p| ours(p))
        .filter_map(entry)
        .collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn get(cache: &Cache, key: &Key) -> Option<([u8; HEAD], Vec<u8>)> {
        cache.get(key, |head, length| Some((head, vec![0; length as usize])), |(_, body)| body)
    }

    fn paths(folder: &Path) -> Vec<PathBuf> {
        entries(folder).expect("a folder").into_iter().map(|entry| entry.path).collect()
    }

    #[test]
    fn what_is_kept_is_found_whole_or_not_at_all() {
        let folder = tempfile::tempdir().expect("a folder");
        let cache = Cache::open(folder.path(), LIMIT).expect("opened");
        let (key, other) = (Key::of("a", &[b"bc"]), Key::of("a", &[b"b", b"c"]));
        assert_eq!(get(&cache, &key), None);
        cache.put(&key, [7; HEAD], b"body");
        let kept = Some(([7; HEAD], b"body".to_vec()));
        assert_eq!(get(&cache, &key), kept);
        assert_eq!(get(&cache, &other), None);
        assert_eq!(get(&Cache::open(folder.path(), LIMIT).expect("opened"), &key), kept);

        let file = cache.path(&key);
        let whole = fs::read(&file).expect("there");
        for length in 0..whole.len() {
            fs::write(&file, &whole[..length]).expect("written");
            assert_eq!(get(&cache, &key), None, "{length} bytes");
        }
        for at in 0..whole.len() {
            let mut flipped = whole.clone();
            flipped[at] ^= 1 << (at % 8);
            fs::write(&file, &flipped).expect("written");
            assert_eq!(get(&cache, &key), None, "byte {at}");
        }
        fs::write(&file, [&whole[..], b"more"].concat()).expect("written");
        assert_eq!(get(&cache, &key), None);
        // Another entry in its place.
        cache.put(&other, [7; HEAD], b"body");
        fs::rename(cache.path(&other), &file).expect("renamed");
        assert_eq!(get(&cache, &key), None);
        cache.put(&key, [7; HEAD], b"body");
        assert_eq!(get(&cache, &key), kept);
    }

    #[test]
    fn the_longest_unused_make_room_and_other_files_stay() {
        let folder = tempfile::tempdir().expect("a folder");
        fs::write(folder.path().join("mine.txt"), [0; 5000]).expect("written");
        let cache = Cache::open(folder.path(), 1000).expect("opened");
        let keys: Vec<Key> = (0..9u8).map(|i| Key::of("a", &[&[i]])).collect();
        for (age, key) in keys.iter().enumerate() {
            cache.put(key, [0; HEAD], &[0; 152]);
            if let Ok(file) = fs::File::open(cache.path(key)) {
                let time = SystemTime::UNIX_EPOCH + std::time::Duration::from_secs(age as u64);
                file.set_times(FileTimes::new().set_modified(time)).expect("set");
            }
        }
        let there: Vec<bool> = keys.iter().map(|key| get(&cache, key).is_some()).collect();
        assert!(there.ends_with(&[true; 3]) && !there[0] && !there[1], "{there:?}");
        let bytes: u64 = entries(folder.path()).expect("a folder").iter().map(|entry| entry.bytes).sum();
        assert!(bytes <= 1000, "{bytes}");
        cache.put(&Key::of("a", &[b"large"]), [0; HEAD], &[0; 1000]);
        assert_eq!(get(&cache, &Key::of("a", &[b"large"])), None);
        assert!(folder.path().join("mine.txt").exists() && !paths(folder.path()).is_empty());
    }
}
