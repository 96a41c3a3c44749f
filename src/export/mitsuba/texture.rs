//! Textures: bitmaps as stored where their numbers are what a slot wants, else baked.
//!
//! Mitsuba decodes sRGB before it filters, has v = 0 at the top row, and clamps nothing: as here. A baked bitmap is a float
//! EXR marked `raw`, and holds factor × texel.

use std::f32::consts::{PI, TAU};

use glam::{Affine2, UVec2, Vec2, Vec3, Vec4};

use super::{Exporter, xml::Node};
use crate::{
    export::{Error, bitmap},
    texture::Textures,
    world::{
        ColorInput, ColorSpace, Emission, Filter, Image, ImageId, ScalarInput, Texels, Texture, TextureId,
        TextureRef, Wrap,
    },
};

/// Cut-outs are found this many times finer than their texels, along each axis.
const CUT_OUT: u32 = 4;
/// Texels along a side of a cut-out, where its image is not larger.
const CUT_OUT_SIDE: u32 = 8192;
/// Textures of shining spheres are turned into bitmaps this many times as fine.
const POLAR: u32 = 2;

impl<'a> Exporter<'a> {
    /// A reflectance, each channel from 0 to 1.
    pub fn reflectance(&mut self, name: &str, color: &ColorInput) -> Result<Node, Error> {
        let unit = |c: Vec3| c.clamp(Vec3::ZERO, Vec3::ONE);
        match &color.texture {
            None => Ok(Node::rgb(name, unit(color.factor))),
            Some(t) if color.factor == Vec3::ONE && self.is_storable(t) => self.stored(name, t),
            Some(t) => {
                let factor = color.factor;
                let key = format!("reflectance {:?}", factor.to_array());
                self.baked(name, t, &key, |texel| unit(factor * texel.truncate()))
            }
        }
    }

    /// A reflectance, changed by `shade` before it is stored, where it may exceed 1. `key` tells one `shade` from another.
    pub fn shaded(
        &mut self,
        name: &str,
        color: &ColorInput,
        key: &str,
        shade: impl Fn(Vec3) -> Vec3 + Sync,
    ) -> Result<Node, Error> {
        let factor = color.factor;
        let shade = |c: Vec3| shade((factor * c).clamp(Vec3::ZERO, Vec3::ONE));
        match &color.texture {
            None => Ok(Node::unbounded(name, shade(Vec3::ONE))),
            Some(t) => self
                .baked(name, t, &format!("{key} {:?}", factor.to_array()), |texel| shade(texel.truncate())),
        }
    }

    /// Radiance: color × strength.
    pub fn radiance(&mut self, name: &str, color: &ColorInput, strength: f32) -> Result<Node, Error> {
        let factor = strength * color.factor;
        match &color.texture {
            None => Ok(Node::rgb(name, factor)),
            Some(t) => {
                let key = format!("radiance {:?}", factor.to_array());
                self.baked(name, t, &key, |texel| (factor * texel.truncate()).max(Vec3::ZERO))
            }
        }
    }

    /// The radiance of a sphere that is not turned: Mitsuba has the poles of its UV on Z, and lights wrongly by textured spheres
    /// that are.
    pub fn polar_radiance(&mut self, name: &str, emission: &Emission, t: &TextureRef) -> Result<Node, Error> {
        let factor = emission.strength * emission.color.factor;
        let texture = self.texture(t);
        let image = self.image(&texture);
        let ours = |uv: Vec2| {
            let ((sin_phi, cos_phi), (sin, cos)) = ((TAU * uv.x).sin_cos(), (PI * uv.y).sin_cos());
            let n = Vec3::new(sin * cos_phi, sin * sin_phi, cos);
            Vec2::new(0.5 - n.z.atan2(n.x) / TAU, n.y.clamp(-1.0, 1.0).acos() / PI)
        };
        let shade = |texel: Vec4| (factor * texel.truncate()).max(Vec3::ZERO).to_array();
        let texels = seen(image, &texture, t.transform, POLAR, ours, shade);
        let (width, height) = (image.width * POLAR, image.height * POLAR);
        let polar = Image { name: image.name.clone(), width, height, texels: Texels::RgbF32(texels) };
        let key = format!("polar {:?} {t:?}", factor.to_array());
        let file = self.bitmap_file(t, &key, || bitmap::as_stored(&polar))?;
        let whole = TextureRef { transform: Affine2::IDENTITY, ..*t };
        Ok(self.bitmap_node(name, &whole, &file, true))
    }

    /// A number from 0 to 1, then through `map`; `key` tells one `map` from another.
    pub fn scalar(
        &mut self,
        name: &str,
        input: &ScalarInput,
        key: &str,
        map: impl Fn(f32) -> f32 + Sync,
    ) -> Result<Node, Error> {
        let factor = input.factor;
        let value = |x: f32| map((factor * x).clamp(0.0, 1.0));
        match &input.texture {
            None => Ok(Node::value("float", name, value(1.0))),
            Some((t, channel)) => {
                let channel = usize::from(channel & 3);
                let key = format!("{key} {channel} {factor}");
                self.baked(name, t, &key, |texel| Vec3::splat(value(texel[channel])))
            }
        }
    }

    /// 1 where the number is at least `cutoff`, else 0.
    pub fn cut_out(&mut self, name: &str, input: &ScalarInput, cutoff: f32) -> Result<Node, Error> {
        let factor = input.factor;
        let solid = |x: f32| if factor * x >= cutoff { 1.0 } else { 0.0 };
        let Some((t, channel)) = &input.texture else {
            return Ok(Node::value("float", name, solid(1.0)));
        };
        let channel = usize::from(channel & 3);
        let texture = self.texture(t);
        let image = self.image(&texture);
        let side = image.width.max(image.height);
        let finer = match texture.filter {
            Filter::Nearest => 1,
            Filter::Linear => CUT_OUT.min((CUT_OUT_SIDE / side.max(1)).max(1)),
        };
        let key = format!("cut-out {channel} {factor} {cutoff} {:?}", texture);
        let nearest = |node: Node| node.string("filter_type", "nearest");
        if finer == 1 {
            let node = self.baked_bare(name, t, &key, |texel| Vec3::splat(solid(texel[channel])))?;
            return Ok(nearest(node));
        }
        let texels = resampled(image, &texture, finer, |texel| solid(texel[channel]));
        let finer = Image {
            texels: Texels::RgbF32(texels),
            width: image.width * finer,
            height: image.height * finer,
            name: image.name.clone(),
        };
        let file = self.bitmap_file(t, &key, || bitmap::as_stored(&finer))?;
        Ok(nearest(self.bitmap_node(name, t, &file, true)))
    }

    /// A normal map's x and y times `scale`; `mirrored` turns y round.
    pub fn normals(&mut self, name: &str, t: &TextureRef, scale: f32, mirrored: bool) -> Result<Node, Error> {
        let texture = self.texture(t);
        let plain = scale == 1.0 && !mirrored && texture.color_space == ColorSpace::Linear;
        if plain && self.is_storable(t) {
            return self.stored(name, t);
        }
        let signs = Vec3::new(scale, if mirrored { -scale } else { scale }, 1.0);
        let key = format!("normals {:?}", signs.to_array());
        self.baked(name, t, &key, |texel| 0.5 * (signs * (2.0 * texel.truncate() - 1.0) + 1.0))
    }

    pub fn texture(&self, t: &TextureRef) -> Texture {
        self.world.model.textures[t.texture.index()]
    }

    pub fn image(&self, texture: &Texture) -> &'a Image {
        &self.world.model.images[texture.image.index()]
    }

    fn is_storable(&self, t: &TextureRef) -> bool {
        !matches!(self.image(&self.texture(t)).texels, Texels::RgbF32(_))
    }

    fn stored(&mut self, name: &str, t: &TextureRef) -> Result<Node, Error> {
        let texture = self.texture(t);
        let image = self.image(&texture);
        let file = self.bitmap_file(t, "stored", || bitmap::as_stored(image))?;
        let raw = texture.color_space == ColorSpace::Linear;
        Ok(filter(self.bitmap_node(name, t, &file, raw), texture.filter))
    }

    fn baked(
        &mut self,
        name: &str,
        t: &TextureRef,
        key: &str,
        shade: impl Fn(Vec4) -> Vec3 + Sync,
    ) -> Result<Node, Error> {
        let filtered = self.texture(t).filter;
        Ok(filter(self.baked_bare(name, t, key, shade)?, filtered))
    }

    /// As `baked`, without a filter.
    fn baked_bare(
        &mut self,
        name: &str,
        t: &TextureRef,
        key: &str,
        shade: impl Fn(Vec4) -> Vec3 + Sync,
    ) -> Result<Node, Error> {
        let texture = self.texture(t);
        let image = self.image(&texture);
        let key = format!("{key} {:?}", texture.color_space);
        let file = self.bitmap_file(t, &key, || bitmap::baked(image, texture.color_space, shade))?;
        Ok(self.bitmap_node(name, t, &file, true))
    }

    /// The file of an image in one form, written once.
    fn bitmap_file(
        &mut self,
        t: &TextureRef,
        form: &str,
        encode: impl FnOnce() -> Result<bitmap::Bitmap, Error>,
    ) -> Result<String, Error> {
        let id = self.texture(t).image;
        let key = format!("{} {form}", id.index());
        if let Some(file) = self.bitmaps.get(&key) {
            return Ok(file.clone());
        }
        let bitmap = encode()?;
        let name = self.names.unique("t", &self.world.model.images[id.index()].name);
        let file = format!("textures/{name}.{}", bitmap.extension);
        self.out.write(&file, &bitmap.bytes)?;
        self.bitmaps.insert(key, file.clone());
        Ok(file)
    }

    fn bitmap_node(&mut self, name: &str, t: &TextureRef, file: &str, raw: bool) -> Node {
        let texture = self.texture(t);
        let mut node = Node::plugin("texture", "bitmap").named(name).string("filename", file);
        // Half floats would do for 8 bits, nearly.
        node = node.string("format", "variant");
        if raw {
            node = node.boolean("raw", true);
        }
        let wrap = |wrap| match wrap {
            Wrap::Repeat => "repeat",
            Wrap::MirroredRepeat => "mirror",
            Wrap::ClampToEdge => "clamp",
        };
        if texture.wrap_u != texture.wrap_v {
            let subject = format!("texture `{}`", self.image(&texture).name);
            self.notes.approximated(
                subject,
                format!(
                    "beyond its edges it goes on as `{}` in both directions; Mitsuba has one mode for u and v",
                    wrap(texture.wrap_u)
                ),
            );
        }
        node = node.string("wrap_mode", wrap(texture.wrap_u));
        if t.transform == Affine2::IDENTITY {
            return node;
        }
        let (x, y, o) = (t.transform.matrix2.x_axis, t.transform.matrix2.y_axis, t.transform.translation);
        let rows = [x.x, y.x, o.x, x.y, y.y, o.y, 0.0, 0.0, 1.0];
        node.child(Node::new("transform").named("to_uv").child(Node::matrix(&rows)))
    }
}

fn filter(node: Node, filter: Filter) -> Node {
    match filter {
        Filter::Linear => node,
        Filter::Nearest => node.string("filter_type", "nearest"),
    }
}

/// The image as its texture is seen at the middles of texels `finer` times smaller.
fn resampled(image: &Image, texture: &Texture, finer: u32, shade: impl Fn(Vec4) -> f32) -> Vec<[f32; 3]> {
    seen(image, texture, Affine2::IDENTITY, finer, |uv| uv, |texel| [shade(texel); 3])
}

/// What a texture shows at `uv` of each of the texels of a bitmap `finer` times as fine.
fn seen(
    image: &Image,
    texture: &Texture,
    transform: Affine2,
    finer: u32,
    uv: impl Fn(Vec2) -> Vec2,
    shade: impl Fn(Vec4) -> [f32; 3],
) -> Vec<[f32; 3]> {
    let size = UVec2::new(image.width, image.height) * finer;
    let alone = Texture { image: ImageId(0), ..*texture };
    let textures = Textures::new(vec![image.clone()], vec![alone]);
    let whole = TextureRef { texture: TextureId(0), uv_set: 0, transform };
    let at = |x: u32, y: u32| {
        let middle = (Vec2::new(x as f32, y as f32) + 0.5) / size.as_vec2();
        shade(textures.lookup(&whole, &[uv(middle); 2]))
    };
    (0..size.y).flat_map(|y| (0..size.x).map(move |x| (x, y))).map(|(x, y)| at(x, y)).collect()
}
