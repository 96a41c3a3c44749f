//! What a surface does with light: the parameters, with the textures that vary them. `material` turns them into a BSDF at a hit.

use glam::Vec3;

use super::{Layered, SpecularGlossiness, TextureRef};

/// factor × texture (× vertex colour where a material says so).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ColorInput {
    pub factor: Vec3,
    pub texture: Option<TextureRef>,
}

/// factor × one channel (0 = R … 3 = A) of a texture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ScalarInput {
    pub factor: f32,
    pub texture: Option<(TextureRef, u8)>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Alpha {
    Opaque,
    /// Not there where alpha is below the cutoff.
    Mask {
        cutoff: f32,
    },
    /// Covers this share of what is behind.
    Blend,
}

/// Tangent-space normal map (glTF: +X right, +Y up, green points up); x and y are multiplied by `scale`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NormalMap {
    pub texture: TextureRef,
    pub scale: f32,
}

/// Radiance = color × strength. Leaves the front (counter-clockwise, outward) side; both where `two_sided`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Emission {
    pub color: ColorInput,
    pub strength: f32,
    pub two_sided: bool,
}

/// How reflectance depends on the angle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fresnel {
    /// The equations of Fresnel (dielectrics only).
    Exact,
    /// Schlick's approximation.
    Schlick,
    /// A plain tint, the same at every angle (metals only).
    Constant,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub enum MetalFinish {
    /// Mirror direction plus a point of a ball of this radius (0 to 1; 0 is a perfect mirror). The tint is plain.
    Fuzz(f32),
    /// GGX of perceptual roughness (alpha = roughness²); 0 is a perfect mirror.
    Roughness { roughness: ScalarInput, fresnel: Fresnel, multiscatter: bool },
}

/// glTF metallic-roughness.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pbr {
    pub base_color: ColorInput,
    /// Linear; the blue channel of the texture.
    pub metallic: ScalarInput,
    /// Perceptual; the green channel of the texture.
    pub roughness: ScalarInput,
    /// Of the dielectric part; glTF's default is 1.5.
    pub ior: f32,
    pub multiscatter: bool,
}

#[derive(Clone, Debug, PartialEq)]
pub enum Surface {
    /// Lambert, two-sided.
    Diffuse {
        color: ColorInput,
    },
    /// Two-sided.
    Metal {
        color: ColorInput,
        finish: MetalFinish,
    },
    /// A boundary between the outside (ior 1) and the inside (`ior`), by the outward normal. `tint` multiplies
    /// both reflection and refraction. `roughness` is perceptual, 0 is smooth.
    Dielectric {
        ior: f32,
        fresnel: Fresnel,
        roughness: ScalarInput,
        tint: ColorInput,
    },
    Pbr(Pbr),
    /// The same with layers.
    Layered(Box<Layered>),
    SpecularGlossiness(SpecularGlossiness),
    /// Shows `color` as radiance, scatters and casts nothing (KHR_materials_unlit).
    Unlit {
        color: ColorInput,
    },
    /// Absorbs all that arrives: the body of an emitter.
    Black,
}

#[derive(Clone, Debug, PartialEq)]
pub struct Material {
    pub name: String,
    pub surface: Surface,
    pub emission: Option<Emission>,
    pub alpha: Alpha,
    /// Coverage, for `Alpha::Mask` and `Alpha::Blend`; usually the base colour's A channel.
    pub coverage: ScalarInput,
    pub normal: Option<NormalMap>,
    /// `false`: camera rays do not see its back (glTF's back-face culling); all other rays do.
    pub double_sided: bool,
    /// Whether the mesh's vertex colours multiply the base colour and coverage.
    pub vertex_colors: bool,
}

impl ColorInput {
    pub fn constant(factor: Vec3) -> Self {
        Self { factor, texture: None }
    }

    pub fn for_each_texture(&mut self, f: &mut dyn FnMut(&mut TextureRef)) {
        self.texture.iter_mut().for_each(f);
    }
}

impl ScalarInput {
    pub fn constant(factor: f32) -> Self {
        Self { factor, texture: None }
    }

    pub fn for_each_texture(&mut self, f: &mut dyn FnMut(&mut TextureRef)) {
        self.texture.iter_mut().for_each(|(texture, _)| f(texture));
    }
}

impl Material {
    /// Calls `f` with every texture that is looked up.
    pub fn for_each_texture(&mut self, f: &mut dyn FnMut(&mut TextureRef)) {
        self.surface.for_each_texture(f);
        self.emission.iter_mut().for_each(|e| e.color.for_each_texture(f));
        self.coverage.for_each_texture(f);
        self.normal.iter_mut().for_each(|n| f(&mut n.texture));
    }

    /// Opaque, two-sided, without emission, textures or vertex colours.
    pub fn new(name: impl Into<String>, surface: Surface) -> Self {
        Self {
            name: name.into(),
            surface,
            emission: None,
            alpha: Alpha::Opaque,
            coverage: ScalarInput::constant(1.0),
            normal: None,
            double_sided: true,
            vertex_colors: false,
        }
    }
}

impl Pbr {
    pub fn for_each_texture(&mut self, f: &mut dyn FnMut(&mut TextureRef)) {
        self.base_color.for_each_texture(f);
        self.metallic.for_each_texture(f);
        self.roughness.for_each_texture(f);
    }
}

impl Surface {
    pub fn for_each_texture(&mut self, f: &mut dyn FnMut(&mut TextureRef)) {
        match self {
            Self::Black => {}
            Self::Diffuse { color } | Self::Unlit { color } => color.for_each_texture(f),
            Self::Metal { color, finish } => {
                color.for_each_texture(f);
                if let MetalFinish::Roughness { roughness, .. } = finish {
                    roughness.for_each_texture(f);
                }
            }
            Self::Dielectric { roughness, tint, .. } => {
                roughness.for_each_texture(f);
                tint.for_each_texture(f);
            }
            Self::Pbr(pbr) => pbr.for_each_texture(f),
            Self::Layered(layered) => layered.for_each_texture(f),
            Self::SpecularGlossiness(surface) => surface.for_each_texture(f),
        }
    }
}
