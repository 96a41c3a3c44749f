//! Images as files, and how materials look them up.

use std::collections::HashMap;

use super::{
    axes,
    document::{self, Fold, Lookup},
};
use crate::{
    export::{Error, bitmap, folder::Folder, names::Names, note::Notes},
    world::{ColorSpace, Filter, ImageId, Model, Texels, Texture, TextureRef, Wrap},
};

/// Texels of an sRGB image that is still written as scene-linear floats: 16 bytes each in Cycles.
const MOST_BAKED: u64 = 1 << 24;

/// What a material reads of a texture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Channels {
    Color,
    Alpha,
}

/// How an image's numbers are stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
enum Storage {
    /// As they are, taken as they are.
    Data,
    /// As they are, decoded by Cycles.
    Encoded,
    /// Decoded here.
    Linear,
}

pub struct Textures<'a> {
    model: &'a Model,
    out: &'a mut Folder,
    names: Names,
    known: HashMap<(ImageId, Storage), usize>,
    pub images: Vec<document::Image>,
}

impl<'a> Textures<'a> {
    pub fn new(model: &'a Model, out: &'a mut Folder) -> Self {
        Self { model, out, names: Names::default(), known: HashMap::new(), images: Vec::new() }
    }

    /// None where the texture is missing, and where A is asked for of an image without it, which is 1.
    pub fn lookup(
        &mut self,
        reference: &TextureRef,
        channels: Channels,
        notes: &mut Notes,
    ) -> Result<Option<Lookup>, Error> {
        let Some(texture) = self.model.textures.get(reference.texture.index()).copied() else {
            return Ok(None);
        };
        let Some(image) = self.model.images.get(texture.image.index()) else { return Ok(None) };
        let float = matches!(image.texels, Texels::RgbF32(_));
        if float && channels == Channels::Alpha {
            return Ok(None);
        }
        let size = [image.width, image.height];
        let storage = match (texture.color_space, texture.filter) {
            (ColorSpace::Linear, _) => Storage::Data,
            _ if float || channels == Channels::Alpha => Storage::Data,
            (ColorSpace::Srgb, Filter::Nearest) => Storage::Encoded,
            (ColorSpace::Srgb, Filter::Linear) if u64::from(size[0]) * u64::from(size[1]) > MOST_BAKED => {
                notes.approximated(
                    format!("image `{}`", image.name),
                    "Cycles interpolates the stored sRGB numbers and decodes the result; here texels are decoded first \
                     (images of up to 16 megapixels are written decoded)",
                );
                Storage::Encoded
            }
            (ColorSpace::Srgb, Filter::Linear) => Storage::Linear,
        };
        let index = self.image(texture.image, storage)?;
        Ok(Some(lookup(index, &texture, reference, size)))
    }

    /// Equirectangular, ready to be light: linear, and black where a texel is not a radiance.
    pub fn environment(
        &mut self,
        id: ImageId,
        space: ColorSpace,
        strength: f32,
    ) -> Result<Option<usize>, Error> {
        let Some(image) = self.model.images.get(id.index()) else { return Ok(None) };
        let bitmap = bitmap::baked(image, space, |texel| {
            let light = texel.truncate();
            let usable = (light * strength).is_finite() && light.min_element() >= 0.0;
            if usable { light } else { glam::Vec3::ZERO }
        })?;
        self.write(&image.name, &bitmap, "Linear Rec.709").map(Some)
    }

    fn image(&mut self, id: ImageId, storage: Storage) -> Result<usize, Error> {
        if let Some(&index) = self.known.get(&(id, storage)) {
            return Ok(index);
        }
        let image = &self.model.images[id.index()];
        let (bitmap, color_space) = match storage {
            Storage::Data => (bitmap::as_stored(image)?, "Non-Color"),
            Storage::Encoded => (bitmap::as_stored(image)?, "sRGB"),
            Storage::Linear => (bitmap::baked(image, ColorSpace::Srgb, |t| t.truncate())?, "Linear Rec.709"),
        };
        let index = self.write(&image.name, &bitmap, color_space)?;
        self.known.insert((id, storage), index);
        Ok(index)
    }

    fn write(
        &mut self,
        name: &str,
        bitmap: &bitmap::Bitmap,
        color_space: &'static str,
    ) -> Result<usize, Error> {
        let file = format!("textures/{}.{}", self.names.unique("t", name), bitmap.extension);
        self.out.write(&file, &bitmap.bytes)?;
        self.images.push(document::Image { file, color_space });
        Ok(self.images.len() - 1)
    }
}

fn lookup(image: usize, texture: &Texture, reference: &TextureRef, [width, height]: [u32; 2]) -> Lookup {
    let (u, v) = (texture.wrap_u, texture.wrap_v);
    // One way for both axes. Where they differ, the other axis is folded into 0 … 1 before.
    let both = match (u, v) {
        (u, v) if u == v => u,
        (Wrap::Repeat, _) | (_, Wrap::Repeat) => Wrap::Repeat,
        _ => Wrap::MirroredRepeat,
    };
    // Between the middle of the last texel and the edge both ways to fold show that texel alone.
    let fold = |mode: Wrap, texels: u32| {
        let half_texel = 0.5 / texels.max(1) as f32;
        (mode != both).then_some(Fold { mirror: mode == Wrap::MirroredRepeat, half_texel })
    };
    Lookup {
        image,
        interpolation: match texture.filter {
            Filter::Nearest => "Closest",
            Filter::Linear => "Linear",
        },
        extension: match both {
            Wrap::Repeat => "REPEAT",
            Wrap::MirroredRepeat => "MIRROR",
            Wrap::ClampToEdge => "EXTEND",
        },
        uv_set: reference.uv_set & 1,
        transform: axes::texture(&reference.transform),
        fold_u: fold(u, width),
        fold_v: fold(v, height),
    }
}

#[cfg(test)]
mod tests {
    use glam::Affine2;

    use super::*;
    use crate::world::TextureId;

    #[test]
    fn axes_that_wrap_differently_are_folded() {
        let reference = TextureRef { texture: TextureId(0), uv_set: 1, transform: Affine2::IDENTITY };
        let look = |wrap_u, wrap_v| {
            let texture = Texture {
                image: ImageId(0),
                color_space: ColorSpace::Srgb,
                wrap_u,
                wrap_v,
                filter: Filter::Linear,
            };
            let found = lookup(0, &texture, &reference, [4, 10]);
            (found.extension, found.fold_u, found.fold_v)
        };
        let (repeat, mirror, clamp) = (Wrap::Repeat, Wrap::MirroredRepeat, Wrap::ClampToEdge);
        assert_eq!(look(mirror, mirror), ("MIRROR", None, None));
        let edge = Some(Fold { mirror: false, half_texel: 0.05 });
        assert_eq!(look(repeat, clamp), ("REPEAT", None, edge));
        assert_eq!(look(mirror, clamp), ("MIRROR", None, edge));
        assert_eq!(look(mirror, repeat), ("REPEAT", Some(Fold { mirror: true, half_texel: 0.125 }), None));
    }
}
