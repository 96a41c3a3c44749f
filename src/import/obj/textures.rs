//! The images that material libraries name, each loaded once, and the textures made of them.

use std::{
    collections::HashMap,
    path::{Path, PathBuf},
};

use glam::{Affine2, U8Vec4, U16Vec4, Vec2, Vec3};

use super::{locate::locate, mtl::Map, text::shorten};
use crate::{
    diagnostic::{Diagnostic, Place, Severity},
    import::image,
    world::{ColorSpace, Filter, Image, ImageId, Model, Texels, Texture, TextureId, TextureRef, Wrap},
};

/// All images of a model together; 8 GiB at eight bits a channel.
const MAX_TEXELS: u64 = 1 << 31;

pub(super) struct Textures<'a> {
    /// The folder of the OBJ file: a second place to look for images.
    folder: &'a Path,
    pub model: &'a mut Model,
    /// By library and name.
    files: HashMap<(PathBuf, String), Option<PathBuf>>,
    images: HashMap<PathBuf, Option<ImageId>>,
    known: HashMap<Texture, TextureId>,
    texels: u64,
}

impl<'a> Textures<'a> {
    pub fn new(folder: &'a Path, model: &'a mut Model) -> Self {
        let (files, images, known) = Default::default();
        Self { folder, model, files, images, known, texels: 0 }
    }

    /// The texture that `map` of the library `library` names, or `None` and a warning.
    pub fn get(&mut self, map: &Map, color_space: ColorSpace, library: &Path) -> Option<TextureRef> {
        let image = self.load(map, library)?;
        let wrap = if map.clamp { Wrap::ClampToEdge } else { Wrap::Repeat };
        let key = Texture { image, color_space, wrap_u: wrap, wrap_v: wrap, filter: Filter::Linear };
        let texture = *self.known.entry(key).or_insert_with(|| {
            self.model.textures.push(key);
            TextureId(self.model.textures.len() as u32 - 1)
        });
        // -s and -o act where v runs up: v' = 1 − (s (1 − v) + o).
        let [[su, sv], [ou, ov]] = [map.scale, map.offset];
        let transform =
            Affine2::from_scale_angle_translation(Vec2::new(su, sv), 0.0, Vec2::new(ou, 1.0 - sv - ov));
        Some(TextureRef { texture, uv_set: 0, transform })
    }

    fn load(&mut self, map: &Map, library: &Path) -> Option<ImageId> {
        let path = self.locate(map, library)?;
        if let Some(&known) = self.images.get(&path) {
            return known;
        }
        self.model.sources.push(path.clone());
        let loaded = match image::load(&path) {
            Ok(image) if self.texels + texels(&image) > MAX_TEXELS => {
                let message =
                    "the model's textures are too large together: its material does without this one";
                self.model.warnings.push(Diagnostic::warning(&path, Place::File, message));
                None
            }
            Ok(image) => {
                self.texels += texels(&image);
                self.model.images.push(image);
                Some(ImageId(self.model.images.len() as u32 - 1))
            }
            Err(diagnostic) => {
                self.model.warnings.push(Diagnostic { severity: Severity::Warning, ..diagnostic });
                None
            }
        };
        self.images.insert(path, loaded);
        loaded
    }

    fn locate(&mut self, map: &Map, library: &Path) -> Option<PathBuf> {
        let key = (library.to_path_buf(), map.file.clone());
        if let Some(known) = self.files.get(&key) {
            return known.clone();
        }
        let found = locate(&[library.parent().unwrap_or(self.folder), self.folder], &map.file);
        if found.is_none() {
            let message =
                format!("the texture `{}` was not found; its material does without", shorten(&map.file));
            let help = "put it beside the file that names it, or correct the name";
            let warning = Diagnostic::warning(library, Place::Line(map.line), message).help(help);
            self.model.warnings.push(warning);
        }
        self.files.insert(key, found.clone());
        found
    }

    pub fn image(&self, texture: TextureRef) -> Option<&Image> {
        let texture = self.model.textures.get(texture.texture.index())?;
        self.model.images.get(texture.image.index())
    }
}

fn texels(image: &Image) -> u64 {
    u64::from(image.width) * u64::from(image.height)
}

pub(super) fn has_alpha(image: &Image) -> bool {
    match &image.texels {
        Texels::Rgba8(texels) => texels.iter().any(|t| t[3] < u8::MAX),
        Texels::Rgba16(texels) => texels.iter().any(|t| t[3] < u16::MAX),
        Texels::RgbF32(_) => false,
    }
}

/// Whether nearly all texels, read as 2c − 1, are unit vectors that point outward. (A grey one would need c = 0.79.)
pub(super) fn holds_normals(image: &Image) -> bool {
    let is_normal = |c: Vec3| {
        let n = 2.0 * c - 1.0;
        (n.length() - 1.0).abs() < 0.1 && n.z > 0.0 && (n.x - n.z).abs().max((n.y - n.z).abs()) > 0.05
    };
    let share = |normals: usize, all: usize| normals as f64 / all.max(1) as f64;
    let share = match &image.texels {
        Texels::Rgba8(t) => share(
            t.iter().filter(|t| is_normal(U8Vec4::from(**t).as_vec4().truncate() / 255.0)).count(),
            t.len(),
        ),
        Texels::Rgba16(t) => share(
            t.iter().filter(|t| is_normal(U16Vec4::from(**t).as_vec4().truncate() / 65535.0)).count(),
            t.len(),
        ),
        Texels::RgbF32(t) => share(t.iter().filter(|t| is_normal(Vec3::from(**t))).count(), t.len()),
    };
    share > 0.9
}
