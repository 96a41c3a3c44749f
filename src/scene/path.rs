//! File names: relative to the folder of the scene file.

use std::path::{Path, PathBuf};

use schemars::{Schema, json_schema};

use super::{
    context::Context,
    read::{Read, Value, kind},
    table::{inline_schema, list},
};
use crate::diagnostic::quote;

/// A picture to be read; it exists.
#[derive(Clone, Debug)]
pub(super) struct ImageFile(pub PathBuf);

/// An asset to be read; it exists.
#[derive(Clone, Debug)]
pub(super) struct ModelFile(pub PathBuf);

/// A picture to be written.
#[derive(Clone, Debug)]
pub(super) struct OutputFile(pub PathBuf);

const IMAGES: &[&str] = &["png", "jpg", "jpeg", "hdr", "exr", "webp", "bmp", "tga", "ktx2"];
const MODELS: &[&str] = &["glb", "gltf", "obj"];
const OUTPUTS: &[&str] = &["png", "exr", "hdr"];

impl Read for ImageFile {
    fn read(value: &Value, cx: &mut Context) -> Option<Self> {
        existing(value, IMAGES, cx).map(Self)
    }

    fn stand_in() -> Option<Self> {
        Some(Self(PathBuf::new()))
    }
}

impl Read for ModelFile {
    fn read(value: &Value, cx: &mut Context) -> Option<Self> {
        existing(value, MODELS, cx).map(Self)
    }

    fn stand_in() -> Option<Self> {
        Some(Self(PathBuf::new()))
    }
}

impl Read for OutputFile {
    fn read(value: &Value, cx: &mut Context) -> Option<Self> {
        named(value, OUTPUTS, cx).map(Self)
    }
}

fn existing(value: &Value, extensions: &[&str], cx: &mut Context) -> Option<PathBuf> {
    let path = named(value, extensions, cx)?;
    match std::fs::metadata(&path) {
        Ok(metadata) if metadata.is_file() => return Some(path),
        Ok(_) => cx.error(value.span(), format!("{} is not a file", quote(&path.to_string_lossy()))),
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => {
            let help = match neighbour(&path) {
                Some(near) => format!("did you mean `{near}`?"),
                None => format!("looked for {}", std::path::absolute(&path).unwrap_or(path).display()),
            };
            let given = value.get_ref().as_str().unwrap_or_default();
            cx.error(value.span(), format!("there is no file {}", quote(given))).help(help);
            return None;
        }
        Err(error) => {
            cx.error(value.span(), format!("cannot read {}: {error}", quote(&path.to_string_lossy())))
        }
    };
    None
}

fn named(value: &Value, extensions: &[&str], cx: &mut Context) -> Option<PathBuf> {
    let Some(name) = value.get_ref().as_str() else {
        cx.must(value.span(), "a file name", kind(value));
        return None;
    };
    let extension =
        Path::new(name).extension().map(|e| e.to_string_lossy().to_lowercase()).unwrap_or_default();
    if !extensions.contains(&extension.as_str()) || name.contains('\0') {
        let help = format!("one of {}", list(extensions));
        cx.error(
            value.span(),
            format!("{} does not have an extension that fits `{}`", quote(name), cx.key.clone()),
        )
        .help(help);
        return None;
    }
    Some(cx.folder().join(name))
}

/// A file beside the missing one with a similar name.
fn neighbour(path: &Path) -> Option<String> {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let name = path.file_name()?.to_str()?;
    let names: Vec<String> = std::fs::read_dir(folder)
        .ok()?
        .take(1000)
        .filter_map(|entry| entry.ok()?.file_name().into_string().ok())
        .collect();
    crate::diagnostic::nearest(name, names.iter().map(String::as_str)).map(str::to_owned)
}

/// JSON Schema has no flag for "either case".
fn pattern(extensions: &[&str]) -> Schema {
    let either = |e: &&str| e.chars().map(|c| format!("[{c}{}]", c.to_ascii_uppercase())).collect::<String>();
    let extensions: Vec<String> = extensions.iter().map(either).collect();
    json_schema!({ "type": "string", "pattern": format!(".\\.({})$", extensions.join("|")) })
}

inline_schema! {
    ImageFile, _generator: pattern(IMAGES),
    ModelFile, _generator: pattern(MODELS),
    OutputFile, _generator: pattern(OUTPUTS),
}
