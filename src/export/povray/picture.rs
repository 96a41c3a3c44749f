//! Textures as files that POV-Ray looks up as they are looked up here.
//!
//! An `image_map` covers the unit square, its bottom at v = 0, and repeats. `interpolate 2` is bilinear between the
//! same texel centres, after the curve of `gamma srgb` is undone. What it has not: mirrored and clamped edges (the
//! file holds them then), a factor (baked), and alpha that is not transparency (left out of the file).

use std::collections::HashMap;

use glam::{Affine2, Mat2, Vec2, Vec3};

use crate::{
    export::{
        Error,
        bitmap::{self, Bitmap},
        names::Names,
    },
    world::{ColorSpace, Filter, Image, ImageId, Texels, Texture, TextureRef, World, Wrap},
};

/// What of the texels is wanted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Part {
    /// RGB times a factor.
    Color(Vec3),
    /// One channel (0 = R … 3 = A) times a factor.
    Channel(u8, f32),
}

/// An image in the folder.
#[derive(Clone, Debug)]
pub struct Picture {
    /// What goes into `image_map { … }` or `image_pattern { … }`.
    pub sdl: String,
    /// UV (as in glTF, from the top left) to POV-Ray's unit square.
    pub fit: Affine2,
}

pub struct Pictures<'a> {
    world: &'a World,
    /// Name in the folder, and content.
    pub files: Vec<(String, Vec<u8>)>,
    names: Names,
    written: HashMap<String, Picture>,
}

impl<'a> Pictures<'a> {
    pub fn new(world: &'a World) -> Self {
        Self { world, files: Vec::new(), names: Names::default(), written: HashMap::new() }
    }

    /// `None` where the handles lead nowhere.
    pub fn picture(&mut self, map: &TextureRef, part: Part) -> Result<Option<Picture>, Error> {
        let model = &self.world.model;
        let Some(texture) = model.textures.get(map.texture.index()) else { return Ok(None) };
        let Some(image) = model.images.get(texture.image.index()) else { return Ok(None) };
        let key = format!("{texture:?} {part:?}");
        let mut picture = match self.written.get(&key) {
            Some(known) => known.clone(),
            None => {
                let made = self.write(image, texture, part)?;
                self.written.insert(key, made.clone());
                made
            }
        };
        picture.fit *= map.transform;
        Ok(Some(picture))
    }

    /// The equirectangular map: what goes into `image_map`.
    pub fn sky(&mut self, image: ImageId, space: ColorSpace) -> Result<String, Error> {
        let texture = Texture {
            image,
            color_space: space,
            wrap_u: Wrap::Repeat,
            wrap_v: Wrap::Repeat,
            filter: Filter::Nearest,
        };
        match self.world.model.images.get(image.index()) {
            Some(image) => Ok(self.write(image, &texture, Part::Color(Vec3::ONE))?.sdl),
            None => Ok(String::new()),
        }
    }

    fn write(&mut self, image: &Image, texture: &Texture, part: Part) -> Result<Picture, Error> {
        let (arranged, fit) = arranged(image, texture);
        let image = arranged.as_ref().unwrap_or(image);
        let space = texture.color_space;
        let bitmap = match part {
            Part::Color(Vec3::ONE) => bitmap::as_stored(&opaque(image))?,
            Part::Color(factor) => bitmap::baked(image, space, |t| factor * t.truncate())?,
            Part::Channel(channel, factor) => {
                bitmap::baked(image, space, |t| Vec3::splat(factor * t[usize::from(channel & 3)]))?
            }
        };
        let Bitmap { bytes, extension } = bitmap;
        let file = format!("textures/{}.{extension}", self.names.unique("t", &image.name));
        self.files.push((file.clone(), bytes));
        let gamma = match (extension, space) {
            ("png", ColorSpace::Srgb) => " gamma srgb",
            ("png", ColorSpace::Linear) => " gamma 1.0",
            _ => "",
        };
        let interpolate = if texture.filter == Filter::Linear { " interpolate 2" } else { "" };
        let upside_down = Affine2::from_mat2_translation(Mat2::from_diagonal(Vec2::new(1.0, -1.0)), Vec2::Y);
        Ok(Picture { sdl: format!("{extension} \"{file}\"{gamma}{interpolate}"), fit: upside_down * fit })
    }
}

/// The image with mirrored or clamped edges put into it, and where UV lie in it then.
fn arranged(image: &Image, texture: &Texture) -> (Option<Image>, Affine2) {
    let axis = |wrap: Wrap, n: u32| match wrap {
        Wrap::Repeat => (n, 0),
        Wrap::MirroredRepeat => (2 * n, 0),
        Wrap::ClampToEdge => (n + 2, 1),
    };
    let (width, left) = axis(texture.wrap_u, image.width);
    let (height, top) = axis(texture.wrap_v, image.height);
    let old = Vec2::new(image.width as f32, image.height as f32);
    let new = Vec2::new(width as f32, height as f32);
    if old == new {
        return (None, Affine2::IDENTITY);
    }
    let fit = Affine2::from_mat2_translation(
        Mat2::from_diagonal(old / new),
        Vec2::new(left as f32, top as f32) / new,
    );
    let source = |wrap: Wrap, i: u32, n: u32| match wrap {
        Wrap::Repeat => i,
        Wrap::MirroredRepeat => i.min(2 * n - 1 - i),
        Wrap::ClampToEdge => i.saturating_sub(1).min(n - 1),
    };
    let mut from = Vec::with_capacity(width as usize * height as usize);
    for y in 0..height {
        let row = source(texture.wrap_v, y, image.height) as usize * image.width as usize;
        from.extend((0..width).map(|x| row + source(texture.wrap_u, x, image.width) as usize));
    }
    let texels = match &image.texels {
        Texels::Rgba8(t) => Texels::Rgba8(picked(t, &from)),
        Texels::Rgba16(t) => Texels::Rgba16(picked(t, &from)),
        Texels::RgbF32(t) => Texels::RgbF32(picked(t, &from)),
    };
    (Some(Image { name: image.name.clone(), width, height, texels }), fit)
}

fn picked<T: Copy + Default>(texels: &[T], from: &[usize]) -> Vec<T> {
    from.iter().map(|&i| texels.get(i).copied().unwrap_or_default()).collect()
}

fn opaque(image: &Image) -> Image {
    let mut image = image.clone();
    match &mut image.texels {
        Texels::Rgba8(t) => t.iter_mut().for_each(|texel| texel[3] = u8::MAX),
        Texels::Rgba16(t) => t.iter_mut().for_each(|texel| texel[3] = u16::MAX),
        Texels::RgbF32(_) => {}
    }
    image
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn edges_are_put_into_the_file() {
        let image =
            Image { name: "t".into(), width: 2, height: 1, texels: Texels::RgbF32(vec![[0.0; 3], [1.0; 3]]) };
        let with = |wrap_u| Texture {
            image: ImageId(0),
            color_space: ColorSpace::Linear,
            wrap_u,
            wrap_v: Wrap::Repeat,
            filter: Filter::Linear,
        };
        let row = |wrap| {
            let (image, fit) = arranged(&image, &with(wrap));
            let Texels::RgbF32(t) = image.expect("rearranged").texels else { panic!("floats") };
            let values: Vec<f32> = t.iter().map(|t| t[0]).collect();
            (values, fit.transform_point2(Vec2::new(0.25, 0.5)))
        };
        assert_eq!(row(Wrap::MirroredRepeat), (vec![0.0, 1.0, 1.0, 0.0], Vec2::new(0.125, 0.5)));
        assert_eq!(row(Wrap::ClampToEdge), (vec![0.0, 0.0, 1.0, 1.0], Vec2::new(0.375, 0.5)));
        assert!(arranged(&image, &with(Wrap::Repeat)).0.is_none());
    }
}
