//! Texture lookups: a UV in, linear RGBA out.
//!
//! UV (0, 0) is the top left corner of the image; a texel's centre is at half-integer coordinates. sRGB texels are
//! decoded before they are filtered (glTF 2.0, 3.8.2). There are no minification pyramids: a path tracer averages
//! its samples instead, and converges to the exact area integral.

use glam::{Vec2, Vec4};

use crate::{
    color::srgb_decode,
    world::{ColorSpace, Filter, Image, Texels, Texture, TextureRef, Wrap},
};

/// Texels out to which places are told apart.
const FAR: f32 = 1e9;

/// All textures of a scene; a [`TextureRef`] indexes into it.
#[derive(Debug)]
pub struct Textures {
    images: Vec<Image>,
    textures: Vec<Texture>,
    /// Linear value of each sRGB byte.
    srgb: Box<[f32; 256]>,
}

impl Textures {
    pub fn new(images: Vec<Image>, textures: Vec<Texture>) -> Self {
        let srgb = Box::new(std::array::from_fn(|i| srgb_decode(i as f32 / 255.0)));
        Self { images, textures, srgb }
    }

    pub fn len(&self) -> usize {
        self.textures.len()
    }

    pub fn is_empty(&self) -> bool {
        self.textures.is_empty()
    }

    /// Bytes of texel data.
    pub fn memory(&self) -> usize {
        let bytes = |image: &Image| match &image.texels {
            Texels::Rgba8(t) => t.len() * 4,
            Texels::Rgba16(t) => t.len() * 8,
            Texels::RgbF32(t) => t.len() * 12,
        };
        self.images.iter().map(bytes).sum()
    }

    /// Linear RGBA at the UVs of a surface point. Only the channels that a colour space bends are decoded: never A.
    pub fn lookup(&self, reference: &TextureRef, uvs: &[Vec2; 2]) -> Vec4 {
        let Some((image, color_space, corners)) = self.corners(reference, uvs) else { return Vec4::ZERO };
        match (&image.texels, color_space) {
            (Texels::Rgba8(t), ColorSpace::Srgb) => corners.blend(|i| {
                let [r, g, b, a] = t[i];
                let linear = |c: u8| self.srgb[usize::from(c)];
                Vec4::new(linear(r), linear(g), linear(b), f32::from(a) * (1.0 / 255.0))
            }),
            (Texels::Rgba8(t), ColorSpace::Linear) => corners.blend(|i| bytes(t[i])) * (1.0 / 255.0),
            (Texels::Rgba16(t), space) => corners.blend(|i| {
                let [r, g, b, a] = t[i];
                let v = Vec4::new(f32::from(r), f32::from(g), f32::from(b), f32::from(a)) * (1.0 / 65535.0);
                match space {
                    ColorSpace::Srgb => v.truncate().map(srgb_decode).extend(v.w),
                    ColorSpace::Linear => v,
                }
            }),
            (Texels::RgbF32(t), _) => corners.blend(|i| {
                let [r, g, b] = t[i];
                Vec4::new(r, g, b, 1.0)
            }),
        }
    }

    /// A, as [`lookup`](Self::lookup) has it, without the colour: what every ray asks that meets a surface with holes.
    pub fn alpha(&self, reference: &TextureRef, uvs: &[Vec2; 2]) -> f32 {
        let Some((image, color_space, corners)) = self.corners(reference, uvs) else { return 0.0 };
        match (&image.texels, color_space) {
            (Texels::Rgba8(t), ColorSpace::Srgb) => corners.mix(|i| f32::from(t[i][3]) * (1.0 / 255.0)),
            (Texels::Rgba8(t), ColorSpace::Linear) => corners.mix(|i| f32::from(t[i][3])) * (1.0 / 255.0),
            (Texels::Rgba16(t), _) => corners.mix(|i| f32::from(t[i][3]) * (1.0 / 65535.0)),
            (Texels::RgbF32(_), _) => 1.0,
        }
    }

    /// The texels about a point, and what they are; `None` where there is no such point.
    #[inline(always)]
    fn corners(&self, reference: &TextureRef, uvs: &[Vec2; 2]) -> Option<(&Image, ColorSpace, Corners)> {
        let texture = &self.textures[reference.texture.index()];
        let image = &self.images[texture.image.index()];
        let uv = reference.transform.transform_point2(uvs[usize::from(reference.uv_set & 1)]);
        let (width, height) = (image.width as i32, image.height as i32);
        let mut position = uv * Vec2::new(width as f32, height as f32);
        if !(position.x.abs() < FAR && position.y.abs() < FAR) {
            if !position.is_finite() {
                return None;
            }
            position = position.clamp(Vec2::splat(-FAR), Vec2::splat(FAR));
        }
        let nearest = texture.filter == Filter::Nearest;
        let shifted = if nearest { position } else { position - 0.5 };
        let (x, fx) = floor(shifted.x);
        let (y, fy) = floor(shifted.y);
        let left = wrap(texture.wrap_u, x, width) as usize;
        let above = wrap(texture.wrap_v, y, height) as usize * width as usize;
        let corners = if nearest {
            Corners { at: [above + left; 4], fx: 0.0, fy: 0.0 }
        } else {
            let right = wrap(texture.wrap_u, x + 1, width) as usize;
            let below = wrap(texture.wrap_v, y + 1, height) as usize * width as usize;
            Corners { at: [above + left, above + right, below + left, below + right], fx, fy }
        };
        Some((image, texture.color_space, corners))
    }
}

/// Places in the list of texels: upper left, upper right, lower left, lower right; and how far between them.
struct Corners {
    at: [usize; 4],
    fx: f32,
    fy: f32,
}

impl Corners {
    #[inline(always)]
    fn blend(&self, texel: impl Fn(usize) -> Vec4) -> Vec4 {
        let [a, b, c, d] = self.at;
        let above = texel(a).lerp(texel(b), self.fx);
        above.lerp(texel(c).lerp(texel(d), self.fx), self.fy)
    }

    /// [`blend`](Self::blend) of one channel, to the bit.
    #[inline(always)]
    fn mix(&self, texel: impl Fn(usize) -> f32) -> f32 {
        let lerp = |a: f32, b: f32, t: f32| a * (1.0 - t) + b * t;
        let [a, b, c, d] = self.at;
        let above = lerp(texel(a), texel(b), self.fx);
        lerp(above, lerp(texel(c), texel(d), self.fx), self.fy)
    }
}

#[inline(always)]
fn bytes([r, g, b, a]: [u8; 4]) -> Vec4 {
    Vec4::new(f32::from(r), f32::from(g), f32::from(b), f32::from(a))
}

/// The whole number at or below x, which is between ±[`FAR`], and what is above it. (Without a call: the instruction is not on
/// every processor.)
#[inline(always)]
fn floor(x: f32) -> (i32, f32) {
    let truncated = x as i32;
    let whole = truncated - i32::from((truncated as f32) > x);
    (whole, x - whole as f32)
}

/// Texel index inside [0, n).
#[inline(always)]
fn wrap(mode: Wrap, i: i32, n: i32) -> i32 {
    if (i as u32) < n as u32 {
        return i;
    }
    match mode {
        Wrap::ClampToEdge => i.clamp(0, n - 1),
        Wrap::Repeat => i.rem_euclid(n),
        Wrap::MirroredRepeat => {
            let folded = i.rem_euclid(2 * n);
            folded.min(2 * n - 1 - folded)
        }
    }
}

#[cfg(test)]
mod tests {
    use glam::Affine2;

    use super::*;
    use crate::world::{ImageId, TextureId};

    const BYTES: [[u8; 4]; 4] = [[255, 0, 0, 255], [0, 255, 0, 255], [0, 0, 255, 0], [188, 188, 188, 128]];

    fn textures(wrap: Wrap, filter: Filter, color_space: ColorSpace) -> Textures {
        let image = Image { name: String::new(), width: 2, height: 2, texels: Texels::Rgba8(BYTES.to_vec()) };
        let texture = Texture { image: ImageId(0), color_space, wrap_u: wrap, wrap_v: wrap, filter };
        Textures::new(vec![image], vec![texture])
    }

    fn at(t: &Textures, u: f32, v: f32) -> Vec4 {
        let reference = TextureRef { texture: TextureId(0), uv_set: 0, transform: Affine2::IDENTITY };
        t.lookup(&reference, &[Vec2::new(u, v), Vec2::ZERO])
    }

    #[test]
    fn origin_is_the_top_left_corner() {
        let t = textures(Wrap::Repeat, Filter::Nearest, ColorSpace::Linear);
        assert_eq!(at(&t, 0.1, 0.1), Vec4::new(1.0, 0.0, 0.0, 1.0));
        assert_eq!(at(&t, 0.9, 0.1), Vec4::new(0.0, 1.0, 0.0, 1.0));
        assert_eq!(at(&t, 0.1, 0.9), Vec4::new(0.0, 0.0, 1.0, 0.0));
    }

    #[test]
    fn wrap_modes_differ_outside() {
        let red = Vec4::new(1.0, 0.0, 0.0, 1.0);
        let green = Vec4::new(0.0, 1.0, 0.0, 1.0);
        let outside = |mode, u| at(&textures(mode, Filter::Nearest, ColorSpace::Linear), u, 0.1);
        assert_eq!(outside(Wrap::Repeat, 1.1), red);
        assert_eq!(outside(Wrap::MirroredRepeat, 1.1), green);
        assert_eq!(outside(Wrap::MirroredRepeat, -0.1), red);
        assert_eq!(outside(Wrap::ClampToEdge, -7.3), red);
        assert_eq!(outside(Wrap::ClampToEdge, 1e20), green);
    }

    #[test]
    fn srgb_is_decoded_before_filtering_and_alpha_is_not_decoded() {
        let t = textures(Wrap::ClampToEdge, Filter::Linear, ColorSpace::Srgb);
        let between = at(&t, 0.5, 0.25);
        assert!(between.abs_diff_eq(Vec4::new(0.5, 0.5, 0.0, 1.0), 1e-6));
        let grey = at(&t, 0.99, 0.99);
        assert!((grey.x - srgb_decode(188.0 / 255.0)).abs() < 1e-6 && (grey.w - 128.0 / 255.0).abs() < 1e-6);
    }

    #[test]
    fn alpha_alone_is_that_of_the_whole_texel() {
        let sixteen = BYTES.map(|texel| texel.map(|c| 251 * u16::from(c))).to_vec();
        let kinds = [
            Texels::Rgba8(BYTES.to_vec()),
            Texels::Rgba16(sixteen),
            Texels::RgbF32(BYTES.map(|[r, g, b, _]| [r, g, b].map(f32::from)).to_vec()),
        ];
        for texels in kinds {
            for (filter, color_space) in [Filter::Linear, Filter::Nearest]
                .into_iter()
                .flat_map(|f| [(f, ColorSpace::Srgb), (f, ColorSpace::Linear)])
            {
                let image = Image { name: String::new(), width: 2, height: 2, texels: texels.clone() };
                let (wrap_u, wrap_v) = (Wrap::Repeat, Wrap::ClampToEdge);
                let texture = Texture { image: ImageId(0), color_space, wrap_u, wrap_v, filter };
                let t = Textures::new(vec![image], vec![texture]);
                let reference = TextureRef { texture: TextureId(0), uv_set: 0, transform: Affine2::IDENTITY };
                for i in 0..64 {
                    let uvs = [Vec2::new((i % 8) as f32, (i / 8) as f32) * 0.17 - 0.1; 2];
                    assert_eq!(
                        t.alpha(&reference, &uvs),
                        t.lookup(&reference, &uvs).w,
                        "{texels:?} at {}",
                        uvs[0]
                    );
                }
                assert_eq!(t.alpha(&reference, &[Vec2::NAN; 2]), 0.0);
            }
        }
    }

    #[test]
    fn non_finite_coordinates_are_black_and_huge_ones_do_not_panic() {
        let t = textures(Wrap::MirroredRepeat, Filter::Linear, ColorSpace::Linear);
        assert_eq!(at(&t, f32::NAN, 0.0), Vec4::ZERO);
        at(&t, 1e30, -1e30);
        at(&t, i32::MAX as f32, i32::MIN as f32);
    }
}
