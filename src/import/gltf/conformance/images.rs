//! Images, used or not: whether they are there, of the type that is said, of one that their textures may have, and whole.
//!
//! glTF 2.0, sections 3.8.1 to 3.8.3; EXT_texture_webp, KHR_texture_basisu. Only headers are read here; that the images which are
//! shown can be decoded is seen when they are.

use std::{
    fs::File,
    io::{Cursor, Read, Seek},
    path::Path,
};

use gltf::json::Image;
use rayon::prelude::*;

use super::{findings::Findings, header, uris};
use crate::{
    import::gltf::{
        accessor::Source,
        report::{Problem, quoted},
        textures::{NO_SOURCE, extension_sources},
        uri,
    },
    import::image::MAX_FILE_BYTES,
    input,
};

/// Types of images that an extension allows.
const EXTENSIONS: [(&str, &str); 2] =
    [("EXT_texture_webp", "image/webp"), ("KHR_texture_basisu", "image/ktx2")];
/// Types of images that textures may have without one.
const PLAIN: [&str; 2] = ["image/jpeg", "image/png"];

pub fn check(source: &Source, folder: &Path, findings: &mut Findings) {
    let images = &source.document.images;
    let looked: Vec<_> =
        images.par_iter().enumerate().map(|(i, image)| look(source, i, image, folder)).collect();
    let mut types = Vec::new();
    for (i, (found, problems)) in looked.into_iter().enumerate() {
        findings.add_all("images", problems);
        let extension = EXTENSIONS.iter().find(|(_, kind)| found == Some(*kind));
        if let Some((name, kind)) =
            extension.filter(|(name, _)| !source.document.extensions.contains_key(*name))
        {
            let message = format!("is of type {kind}, which needs the extension {name}");
            findings.add("images", format!("/images/{i}"), message);
        }
        let declared = images.get(i).and_then(|image| image.mime_type.as_ref());
        types.push(declared.map(|declared| declared.0.as_str()).or(found));
    }
    for (i, texture) in source.document.textures.iter().enumerate() {
        let own = Some(texture.source.value()).filter(|&source| source != NO_SOURCE);
        let own = own.map(|image| (image, format!("/textures/{i}/source"), &PLAIN[..]));
        let extended = extension_sources(texture).filter_map(|(name, image)| {
            let (_, kind) = EXTENSIONS.iter().find(|(other, _)| *other == name)?;
            let pointer = format!("/textures/{i}/extensions/{name}/source");
            Some((image, pointer, std::slice::from_ref(kind)))
        });
        for (image, pointer, allowed) in own.into_iter().chain(extended) {
            if let Some(kind) = types.get(image).copied().flatten().filter(|kind| !allowed.contains(kind)) {
                let message =
                    format!("is image {image} of type {}, not {}", quoted(kind), allowed.join(" or "));
                findings.add("types of textures", pointer, message);
            }
        }
    }
}

/// The type of image `i` by its first bytes, and what is wrong with it.
fn look(source: &Source, i: usize, image: &Image, folder: &Path) -> (Option<&'static str>, Vec<Problem>) {
    let mut problems = Vec::new();
    let place = if image.uri.is_some() { "uri" } else { "bufferView" };
    let found = match (&image.uri, image.buffer_view) {
        (Some(uri), _) if uris::media_type(uri).is_some() => {
            uri::read(uri, folder, MAX_FILE_BYTES).map(|bytes| read(&mut Cursor::new(bytes)))
        }
        (Some(uri), _) => open(uri, folder).map(|mut file| read(&mut file)),
        (None, Some(view)) => match source.buffers.view(source.document, view.value()) {
            Some(bytes) => Ok(read(&mut Cursor::new(bytes))),
            None => return (None, problems),
        },
        (None, None) => return (None, problems),
    };
    let (kind, whole) = match found {
        Ok(found) => found,
        Err(message) => {
            problems.push(Problem::new(format!("/images/{i}/uri"), message));
            return (None, problems);
        }
    };
    if let Err(message) = whole {
        problems.push(Problem::new(format!("/images/{i}"), message));
    }
    let declared = image.mime_type.as_ref().map(|kind| kind.0.as_str());
    let media_type = image.uri.as_deref().and_then(uris::media_type).and_then(Result::ok);
    let declared = [declared, media_type.filter(|media_type| !media_type.is_empty())];
    if let Some(kind) = kind
        && let Some(other) = declared.into_iter().flatten().find(|other| *other != kind)
    {
        let message = format!("is of type {kind}, not {} as the document says", quoted(other));
        problems.push(Problem::new(format!("/images/{i}/{place}"), message));
    }
    (kind, problems)
}

fn open(uri: &str, folder: &Path) -> Result<File, String> {
    let cannot = |why: String| format!("the file {} cannot be read: {why}", quoted(uri));
    input::open(&uri::resolve(uri, folder)?).map_err(cannot)
}

fn read(source: &mut (impl Read + Seek)) -> (Option<&'static str>, Result<(), String>) {
    let kind = header::kind(source);
    (kind, kind.map_or(Ok(()), |kind| header::check(kind, source)))
}
