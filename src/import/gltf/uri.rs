//! URIs of buffers and images: data URIs and files beside the asset.
//!
//! glTF 2.0, section 2.8 "URIs". A file is only ever read from the folder of the asset or below it: absolute paths, schemes
//! (`file:`, `http:`, a drive letter) and `..` that climbs out are refused. Confinement is by the path as written;
//! symbolic links that the user has placed in the folder are followed.

use std::{
    borrow::Cow,
    io::Read,
    path::{Component, Path, PathBuf},
};

use base64::{
    Engine, alphabet,
    engine::{DecodePaddingMode, GeneralPurpose, GeneralPurposeConfig},
};
use percent_encoding::percent_decode_str;

use super::report::quoted;
use crate::input;

/// Padding may be there or not; exporters disagree.
const BASE64: GeneralPurpose = GeneralPurpose::new(
    &alphabet::STANDARD,
    GeneralPurposeConfig::new()
        .with_decode_padding_mode(DecodePaddingMode::Indifferent)
        .with_decode_allow_trailing_bits(true),
);

/// The bytes behind `uri`, at most `limit` of them. The error says what is wrong with it.
pub fn read(uri: &str, folder: &Path, limit: u64) -> Result<Vec<u8>, String> {
    match strip_scheme(uri, "data:") {
        Some(data) => decode_data(data),
        None => read_file(&resolve(uri, folder)?, uri, limit),
    }
}

/// The path of `uri` below `folder`.
pub fn resolve(uri: &str, folder: &Path) -> Result<PathBuf, String> {
    if let Some(scheme) = scheme(uri) {
        return Err(format!(
            "the URI {} is not read: scheme {} (only files beside the asset and data: URIs are)",
            quoted(uri),
            quoted(scheme)
        ));
    }
    let decoded = percent_decode_str(uri)
        .decode_utf8()
        .map_err(|_| format!("the URI {} is not UTF-8 once its % escapes are decoded", quoted(uri)))?;
    let relative = confine(&decoded).ok_or_else(|| {
        format!("the URI {} is not read: it leads out of the folder of the asset", quoted(uri))
    })?;
    let path = folder.join(relative);
    // A file whose name holds a bare % was not escaped by its exporter.
    if !path.exists()
        && let Some(literal) = confine(uri).map(|p| folder.join(p))
        && literal.exists()
    {
        return Ok(literal);
    }
    Ok(path)
}

/// `path` without `.` and `..`, or `None` where it is absolute, empty or climbs out. Backslashes separate, as on Windows.
fn confine(path: &str) -> Option<PathBuf> {
    let unified = path.replace('\\', "/");
    let mut kept = PathBuf::new();
    for component in Path::new(&unified).components() {
        match component {
            Component::Normal(name) => kept.push(name),
            Component::CurDir => {}
            Component::ParentDir => {
                if !kept.pop() {
                    return None;
                }
            }
            Component::RootDir | Component::Prefix(_) => return None,
        }
    }
    (kept.components().next().is_some()).then_some(kept)
}

/// The scheme of an absolute URI (RFC 3986, 3.1), which a drive letter looks like too.
fn scheme(uri: &str) -> Option<&str> {
    let (scheme, _) = uri.split_once(':')?;
    let mut letters = scheme.chars();
    let starts = letters.next().is_some_and(|c| c.is_ascii_alphabetic());
    (starts && letters.all(|c| c.is_ascii_alphanumeric() || "+-.".contains(c))).then_some(scheme)
}

fn strip_scheme<'a>(uri: &'a str, scheme: &str) -> Option<&'a str> {
    let head = uri.get(..scheme.len())?;
    head.eq_ignore_ascii_case(scheme).then(|| uri.get(scheme.len()..)).flatten()
}

/// What follows `data:` (RFC 2397).
fn decode_data(data: &str) -> Result<Vec<u8>, String> {
    let (kind, payload) = data.split_once(',').ok_or("a data URI has no comma before its data")?;
    let bytes: Cow<[u8]> = percent_decode_str(payload).into();
    if kind.to_ascii_lowercase().ends_with(";base64") {
        BASE64.decode(&bytes).map_err(|e| format!("a data URI is not valid base64: {e}"))
    } else {
        Ok(bytes.into_owned())
    }
}

fn read_file(path: &Path, uri: &str, limit: u64) -> Result<Vec<u8>, String> {
    let cannot = |why: String| format!("the file {} cannot be read: {why}", quoted(uri));
    let mut bytes = Vec::new();
    let file = input::open(path).map_err(cannot)?;
    file.take(limit).read_to_end(&mut bytes).map_err(|error| cannot(error.to_string()))?;
    Ok(bytes)
}
