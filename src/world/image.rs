//! Images as they were stored (not yet linear) and how a material looks them up.

use glam::Affine2;

use super::{ImageId, TextureId};

/// Texels, row by row from the top.
#[derive(Clone, Debug)]
pub enum Texels {
    Rgba8(Vec<[u8; 4]>),
    Rgba16(Vec<[u16; 4]>),
    /// Scene-linear, from .hdr and .exr.
    RgbF32(Vec<[f32; 3]>),
}

#[derive(Clone, Debug)]
pub struct Image {
    pub name: String,
    pub width: u32,
    pub height: u32,
    pub texels: Texels,
}

/// How stored numbers become linear ones. Floating-point images are linear whatever this says.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum ColorSpace {
    Srgb,
    Linear,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Wrap {
    Repeat,
    MirroredRepeat,
    ClampToEdge,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Filter {
    Nearest,
    Linear,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Texture {
    pub image: ImageId,
    pub color_space: ColorSpace,
    pub wrap_u: Wrap,
    pub wrap_v: Wrap,
    pub filter: Filter,
}

/// A texture as a material slot uses it. UV (0, 0) is the top left corner of the image, as in glTF.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TextureRef {
    pub texture: TextureId,
    /// Which of the mesh's UV sets.
    pub uv_set: u8,
    /// Applied to the UV before the lookup (KHR_texture_transform, OBJ -s and -o).
    pub transform: Affine2,
}
