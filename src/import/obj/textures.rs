//! The images that material libraries name, each loaded once, and the textures made of them.

use std::{
    collections::HashMap,
    path::{Path, PathBuf},
};

use glam::{Affine2, Vec2};

use super::{bump, locate::locate, map::Map, text::shorten};
use crate::{
    diagnostic::{Diagnostic, Place, Severity},
    import::image,
    world::{ColorSpace, Filter, Image, ImageId, Model, Texels, Texture, TextureId, TextureRef, Wrap},
};

/// After so many textures that were not there, names are no longer looked for in other ways.
const MAX_SEARCHES: usize = 1000;
/// All images of a model together; 8 GiB at eight bits a channel.
const MAX_TEXELS: u64 = 1 << 31;

pub(super) struct Textures<'a> {
    /// The folder of the OBJ file: a second place to look for images.
    folder: &'a Path,
    pub model: &'a mut Model,
    /// By library and name.
    files: HashMap<(PathBuf, String), Option<PathBuf>>,
    images: HashMap<PathBuf, Option<ImageId>>,
    /// Normal maps made of heights, by file, channel and whether it is clamped.
    bumps: HashMap<(PathBuf, Option<u8>, bool), Option<ImageId>>,
    known: HashMap<Texture, TextureId>,
    texels: u64,
    /// Names without a file.
    missing: usize,
}

impl<'a> Textures<'a> {
    pub fn new(folder: &'a Path, model: &'a mut Model) -> Self {
        let (files, images, bumps, known) = Default::default();
        Self { folder, model, files, images, bumps, known, texels: 0, missing: 0 }
    }

    /// The texture that `map` of the library `library` names, or `None` and a warning.
    pub fn get(&mut self, map: &Map, color_space: ColorSpace, library: &Path) -> Option<TextureRef> {
        let image = self.load(map, library)?;
        Some(self.texture(map, image, color_space))
    }

    /// The normal map that `map` names, or one made of the heights that it names.
    pub fn bump(&mut self, map: &Map, library: &Path) -> Option<TextureRef> {
        let path = self.locate(map, library)?;
        let key = (path.clone(), map.channel, map.clamp);
        let image = match self.bumps.get(&key) {
            Some(&known) => known,
            None => {
                let image = self.normals(map, &path);
                self.bumps.insert(key, image);
                image
            }
        };
        Some(self.texture(map, image?, ColorSpace::Linear))
    }

    fn normals(&mut self, map: &Map, path: &Path) -> Option<ImageId> {
        let of = |image: &Image| {
            (!bump::holds_normals(image)).then(|| bump::normals(image, map.channel, map.clamp))
        };
        if let Some(&known) = self.images.get(path) {
            let id = known?;
            return match self.model.images.get(id.index()).map(of)? {
                Some(normals) => self.keep(normals, path),
                None => Some(id),
            };
        }
        // The heights themselves are of no further use.
        let image = self.read(path)?;
        match of(&image) {
            Some(normals) => self.keep(normals, path),
            None => {
                let id = self.keep(image, path);
                self.images.insert(path.to_owned(), id);
                id
            }
        }
    }

    fn texture(&mut self, map: &Map, image: ImageId, color_space: ColorSpace) -> TextureRef {
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
        TextureRef { texture, uv_set: 0, transform }
    }

    fn load(&mut self, map: &Map, library: &Path) -> Option<ImageId> {
        let path = self.locate(map, library)?;
        if let Some(&known) = self.images.get(&path) {
            return known;
        }
        let loaded = self.read(&path).and_then(|image| self.keep(image, &path));
        self.images.insert(path, loaded);
        loaded
    }

    fn read(&mut self, path: &Path) -> Option<Image> {
        if !self.model.sources.iter().any(|source| source == path) {
            self.model.sources.push(path.to_owned());
        }
        image::load(path)
            .map_err(|error| {
                self.model.warnings.push(Diagnostic { severity: Severity::Warning, ..error });
            })
            .ok()
    }

    /// Adds `image`, of the file at `path`, unless there are too many.
    fn keep(&mut self, image: Image, path: &Path) -> Option<ImageId> {
        let texels = u64::from(image.width) * u64::from(image.height);
        if self.texels + texels > MAX_TEXELS {
            let message = "the model's textures are too large together: its material does without this one";
            self.model.warnings.push(Diagnostic::warning(path, Place::File, message));
            return None;
        }
        self.texels += texels;
        self.model.images.push(image);
        Some(ImageId(self.model.images.len() as u32 - 1))
    }

    fn locate(&mut self, map: &Map, library: &Path) -> Option<PathBuf> {
        let key = (library.to_path_buf(), map.file.clone());
        if let Some(known) = self.files.get(&key) {
            return known.clone();
        }
        let folder = library.parent().unwrap_or(self.folder);
        let found = match self.missing < MAX_SEARCHES {
            true => locate(&[folder, self.folder], &map.file),
            false => Some(folder.join(&map.file)).filter(|file| file.is_file()),
        };
        if found.is_none() {
            self.missing += 1;
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

pub(super) fn has_alpha(image: &Image) -> bool {
    match &image.texels {
        Texels::Rgba8(texels) => texels.iter().any(|t| t[3] < u8::MAX),
        Texels::Rgba16(texels) => texels.iter().any(|t| t[3] < u16::MAX),
        Texels::RgbF32(_) => false,
    }
}
