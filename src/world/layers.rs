//! Layers on, in and under the metallic-roughness material, in the terms of glTF's extensions. Each is absent where a file does
//! not name it.

use glam::Vec3;

use super::{ColorInput, NormalMap, Pbr, ScalarInput, TextureRef};

/// KHR_materials_specular: strength and colour of the dielectric's reflection. The texture is its A channel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpecularLevel {
    pub factor: ScalarInput,
    /// Of reflection at normal incidence; may be above 1.
    pub color: ColorInput,
}

/// KHR_materials_clearcoat: varnish of index 1.5.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Clearcoat {
    pub factor: ScalarInput,
    /// Perceptual.
    pub roughness: ScalarInput,
    /// Without it the coat has the normal of the mesh, whatever lies below.
    pub normal: Option<NormalMap>,
}

/// KHR_materials_sheen: fibres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sheen {
    pub color: ColorInput,
    /// Perceptual.
    pub roughness: ScalarInput,
}

/// KHR_materials_volume: the surface bounds a medium that absorbs. Its thickness is that of the mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Volume {
    /// What white light turns into over the distance.
    pub attenuation_color: Vec3,
    /// Metres; infinite where nothing is absorbed.
    pub attenuation_distance: f32,
}

/// KHR_materials_iridescence: a thin film on the surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Iridescence {
    pub factor: ScalarInput,
    pub ior: f32,
    /// Nanometres, where the texture is 0 and where it is 1; the latter without a texture.
    pub thickness: [f32; 2],
    pub thickness_texture: Option<(TextureRef, u8)>,
}

/// KHR_materials_anisotropy: the highlight stretched in one direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Anisotropy {
    pub strength: f32,
    /// From the tangent, counter-clockwise, radians.
    pub rotation: f32,
    /// Red and green: the direction, to be turned by `rotation`; blue multiplies the strength.
    pub texture: Option<TextureRef>,
}

/// KHR_materials_diffuse_transmission: light that leaves, scattered, on the far side.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DiffuseTransmission {
    pub factor: ScalarInput,
    pub color: ColorInput,
}

/// The metallic-roughness material with layers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Layered {
    pub pbr: Pbr,
    pub specular: Option<SpecularLevel>,
    pub clearcoat: Option<Clearcoat>,
    pub sheen: Option<Sheen>,
    /// KHR_materials_transmission: the share of what is not reflected that passes, unscattered but for roughness. The surface is
    /// a thin wall unless it has a volume.
    pub transmission: Option<ScalarInput>,
    pub volume: Option<Volume>,
    /// KHR_materials_dispersion: 20 over the Abbe number; 0 where all colours refract alike.
    pub dispersion: f32,
    pub iridescence: Option<Iridescence>,
    pub anisotropy: Option<Anisotropy>,
    pub diffuse_transmission: Option<DiffuseTransmission>,
}

/// KHR_materials_pbrSpecularGlossiness, archived.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpecularGlossiness {
    pub diffuse: ColorInput,
    /// Reflectance at normal incidence.
    pub specular: ColorInput,
    /// 1 − perceptual roughness.
    pub glossiness: ScalarInput,
}

impl Layered {
    /// `pbr` without layers.
    pub fn new(pbr: Pbr) -> Self {
        Self {
            pbr,
            specular: None,
            clearcoat: None,
            sheen: None,
            transmission: None,
            volume: None,
            dispersion: 0.0,
            iridescence: None,
            anisotropy: None,
            diffuse_transmission: None,
        }
    }

    pub fn is_plain(&self) -> bool {
        *self == Self::new(self.pbr)
    }

    pub fn for_each_texture(&mut self, f: &mut dyn FnMut(&mut TextureRef)) {
        self.pbr.for_each_texture(f);
        if let Some(specular) = &mut self.specular {
            specular.factor.for_each_texture(f);
            specular.color.for_each_texture(f);
        }
        if let Some(coat) = &mut self.clearcoat {
            coat.factor.for_each_texture(f);
            coat.roughness.for_each_texture(f);
            coat.normal.iter_mut().for_each(|normal| f(&mut normal.texture));
        }
        if let Some(sheen) = &mut self.sheen {
            sheen.color.for_each_texture(f);
            sheen.roughness.for_each_texture(f);
        }
        if let Some(transmission) = &mut self.transmission {
            transmission.for_each_texture(f);
        }
        if let Some(film) = &mut self.iridescence {
            film.factor.for_each_texture(f);
            film.thickness_texture.iter_mut().for_each(|(texture, _)| f(texture));
        }
        if let Some(anisotropy) = &mut self.anisotropy {
            anisotropy.texture.iter_mut().for_each(&mut *f);
        }
        if let Some(diffuse) = &mut self.diffuse_transmission {
            diffuse.factor.for_each_texture(f);
            diffuse.color.for_each_texture(f);
        }
    }

    /// The medium behind the surface, if light can enter it.
    pub fn medium(&self) -> Option<&Volume> {
        self.volume.as_ref().filter(|_| self.transmission.is_some() || self.diffuse_transmission.is_some())
    }
}

impl SpecularGlossiness {
    pub fn for_each_texture(&mut self, f: &mut dyn FnMut(&mut TextureRef)) {
        self.diffuse.for_each_texture(f);
        self.specular.for_each_texture(f);
        self.glossiness.for_each_texture(f);
    }
}

impl Volume {
    /// Absorption per metre: Beer's law, color = exp(−σ distance).
    pub fn absorption(&self) -> Vec3 {
        // A channel at 0 is black within a thousandth of the distance, not an infinity that makes NaN of 0 × ∞.
        self.attenuation_color.max(Vec3::splat(1e-30)).map(f32::ln) / -self.attenuation_distance
    }
}
