//! Images, samplers and the lookups that material slots make.
//!
//! glTF 2.0, section 3.8 "Texture Data". Only images that a rendered material uses are decoded, each once, in parallel. One
//! that is missing or does not decode is a warning, and the slot falls back to its factor.
//!
//! KHR_texture_transform: uv′ = T(offset) · R · S(scale) · uv. A positive `rotation` turns the UV counter-clockwise as the
//! image is seen; as v runs down, that is u′ = cos·u + sin·v, v′ = −sin·u + cos·v (the reference viewer and Blender
//! agree on it; the extension's GLSL listing is the transpose).

use std::{
    cmp::Reverse,
    collections::{BTreeSet, HashMap},
    path::Path,
    sync::{
        Mutex, PoisonError,
        atomic::{AtomicU64, Ordering},
    },
};

use glam::{Affine2, Vec2};
use gltf::json::{
    self,
    extensions::texture::TextureTransform,
    texture::{MagFilter, WrappingMode},
    validation::Checked,
};

use super::{
    accessor::Source,
    document::Document,
    report::{Problem, Report, quoted},
    uri,
};
use crate::{
    import::image,
    world::{ColorSpace, Filter, Image, ImageId, Texture, TextureId, TextureRef, Wrap},
};

/// What the `gltf` crate gives as the source of a texture that has none.
pub const NO_SOURCE: usize = u32::MAX as usize;
/// Texels of all images of a file together, in bytes.
const MAX_TOTAL_BYTES: u64 = 8 << 30;
/// What is wrong with those beyond.
const TOO_MANY: &str = "is one too many";

/// Extensions by which a texture has an image of another format than PNG or JPEG.
const SOURCES: [&str; 2] = ["KHR_texture_basisu", "EXT_texture_webp"];

/// Images of a texture by extensions, the best first.
pub fn extension_sources(texture: &json::Texture) -> impl Iterator<Item = (&'static str, usize)> {
    SOURCES.into_iter().filter_map(|name| {
        let source = texture.extensions.as_ref()?.others.get(name)?.get("source")?;
        Some((name, usize::try_from(source.as_u64()?).ok()?))
    })
}

pub fn source(texture: &json::Texture) -> Option<usize> {
    let own = (texture.source.value() != NO_SOURCE).then_some(texture.source.value());
    extension_sources(texture).next().map(|(_, image)| image).or(own)
}

/// A texture as a slot of a material names it.
pub struct Slot<'a> {
    pub texture: usize,
    /// Of the mesh, not of the file.
    pub uv_set: u8,
    pub transform: Option<&'a TextureTransform>,
    pub pointer: String,
}

/// The images that there are, and the textures made of them so far.
pub struct Textures {
    by_image: HashMap<usize, ImageId>,
    pub textures: Vec<Texture>,
    ids: HashMap<Texture, TextureId>,
}

/// An image of the file by its number, or what is wrong with it.
pub type Decoded = (usize, Result<Image, String>);

/// Decodes the images `wanted`, as many at a time as there are threads, and what takes longest first, about: nothing is to be waited for
/// in the end.
pub fn decode_all(source: &Source, wanted: &BTreeSet<usize>, folder: &Path) -> Vec<Decoded> {
    let total = AtomicU64::new(0);
    let decoded = |&i: &usize| {
        let image = decode(source, i, folder).and_then(|image| {
            let bytes = image::byte_size(&image);
            let all = total.fetch_add(bytes, Ordering::Relaxed).saturating_add(bytes);
            // Keeps the memory bounded; the file as a whole is refused by `tell`.
            if all > MAX_TOTAL_BYTES { Err(TOO_MANY.to_owned()) } else { Ok(image) }
        });
        (i, image)
    };
    let mut order: Vec<&usize> = wanted.iter().collect();
    order.sort_by_cached_key(|&&i| Reverse(encoded_bytes(source, i, folder)));
    let found = Mutex::new(Vec::with_capacity(order.len()));
    rayon::scope_fifo(|scope| {
        for i in order {
            let (decoded, found) = (&decoded, &found);
            scope.spawn_fifo(move |_| {
                let image = decoded(i);
                found.lock().unwrap_or_else(PoisonError::into_inner).push(image);
            });
        }
    });
    let mut found = found.into_inner().unwrap_or_else(PoisonError::into_inner);
    found.sort_unstable_by_key(|(i, _)| *i);
    found
}

/// Bytes of an image as it is stored; 0 where that cannot be told before it is read.
fn encoded_bytes(source: &Source, index: usize, folder: &Path) -> u64 {
    let Some(json) = source.document.images.get(index) else { return 0 };
    match (json.buffer_view, &json.uri) {
        (Some(view), _) => {
            source.buffers.view(source.document, view.value()).map_or(0, |bytes| bytes.len() as u64)
        }
        (None, Some(uri)) if uri.starts_with("data:") => uri.len() as u64,
        (None, Some(uri)) => {
            let file = uri::resolve(uri, folder).ok().and_then(|path| path.metadata().ok());
            file.map_or(0, |file| file.len())
        }
        (None, None) => 0,
    }
}

/// Reports what is wrong with images; the numbers of the others.
pub fn tell(decoded: &[Decoded], report: &mut Report) -> Vec<usize> {
    let mut there = Vec::new();
    let mut too_many = false;
    for (i, image) in decoded {
        match image {
            Ok(_) => there.push(*i),
            Err(message) => {
                too_many |= message == TOO_MANY;
                report.warn(
                    Problem::new(format!("/images/{i}"), format!("{message}; it is left out"))
                        .help("the materials that use it fall back to their plain factors"),
                );
            }
        }
    }
    if too_many {
        let message = format!("its textures take more than {MAX_TOTAL_BYTES} bytes of memory");
        report.error(Problem::new("/images", message).help("use smaller textures"));
    }
    there
}

impl Textures {
    /// Of the images with these numbers in the file, which become those of the model.
    pub fn of(images: impl IntoIterator<Item = usize>) -> Self {
        let by_image = images.into_iter().zip((0..).map(ImageId)).collect();
        Self { by_image, textures: Vec::new(), ids: HashMap::new() }
    }

    /// What a slot looks up; `None` where its image is not there.
    pub fn reference(
        &mut self,
        document: &Document,
        slot: &Slot,
        color_space: ColorSpace,
        report: &mut Report,
    ) -> Option<TextureRef> {
        let json = document.textures.get(slot.texture)?;
        let Some(image) = source(json) else {
            let message = format!("texture {} has no image that can be read; it is left out", slot.texture);
            report.warn(Problem::new(&slot.pointer, message));
            return None;
        };
        let image = *self.by_image.get(&image)?;
        let sampler = json.sampler.and_then(|s| document.samplers.get(s.value()));
        let wrap = |mode: Option<Checked<WrappingMode>>| match mode {
            Some(Checked::Valid(WrappingMode::ClampToEdge)) => Wrap::ClampToEdge,
            Some(Checked::Valid(WrappingMode::MirroredRepeat)) => Wrap::MirroredRepeat,
            _ => Wrap::Repeat,
        };
        let filter = match sampler.and_then(|s| s.mag_filter) {
            Some(Checked::Valid(MagFilter::Nearest)) => Filter::Nearest,
            _ => Filter::Linear,
        };
        let texture = Texture {
            image,
            color_space,
            wrap_u: wrap(sampler.map(|s| s.wrap_s)),
            wrap_v: wrap(sampler.map(|s| s.wrap_t)),
            filter,
        };
        let next = TextureId(self.textures.len() as u32);
        let id = *self.ids.entry(texture).or_insert(next);
        if id == next {
            self.textures.push(texture);
        }
        let transform = slot.transform.map_or(Affine2::IDENTITY, affine);
        if !transform.is_finite() {
            report.warn(Problem::new(
                &slot.pointer,
                "its KHR_texture_transform is not finite; the texture is left out",
            ));
            return None;
        }
        Some(TextureRef { texture: id, uv_set: slot.uv_set, transform })
    }
}

/// T · R · S of the extension.
pub fn affine(transform: &TextureTransform) -> Affine2 {
    Affine2::from_scale_angle_translation(
        Vec2::from(transform.scale.0),
        -transform.rotation.0,
        Vec2::from(transform.offset.0),
    )
}

/// The error says what is wrong with the image, as a predicate.
pub fn decode(source: &Source, index: usize, folder: &Path) -> Result<Image, String> {
    let json = source.document.images.get(index).ok_or("does not exist")?;
    let file = json.uri.as_deref().filter(|uri| !uri.starts_with("data:")).unwrap_or("");
    let name = super::clipped(json.name.as_deref().filter(|n| !n.is_empty()).unwrap_or(file));
    let decoded = match (json.buffer_view, &json.uri) {
        (Some(view), _) => {
            let bytes = source.buffers.view(source.document, view.value());
            bytes.map(|bytes| image::decode(bytes, &name)).ok_or("its buffer has no data in this file")
        }
        (None, Some(uri)) => {
            let bytes = uri::read(uri, folder, image::MAX_FILE_BYTES)?;
            Ok(image::decode(&bytes, if file.is_empty() { &name } else { file }))
        }
        (None, None) => Err("has neither uri nor bufferView"),
    };
    let image = decoded?.map_err(|e| {
        let why: String = e.chars().take(200).collect();
        format!("image {} cannot be decoded: {why}", quoted(&name))
    })?;
    Ok(Image { name, ..image })
}
