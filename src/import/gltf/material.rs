//! Materials: metallic-roughness, its layers ([`layers`]), specular-glossiness and unlit; textures, alpha and emission.
//!
//! glTF 2.0, section 3.9 "Materials", with KHR_materials_unlit, KHR_materials_emissive_strength and KHR_materials_ior.
//! Base colour and emissive textures are sRGB, all others linear. Occlusion is not used: a path tracer finds it itself.
//! A primitive without material has the default one: white, fully metallic and rough.

use std::collections::BTreeMap;

use glam::Vec3;
use gltf::json::{
    self,
    extensions::texture::TextureTransform,
    material::{AlphaMode, NormalTexture},
    texture::Info,
    validation::Checked,
};

use super::{
    document::Document,
    layers,
    report::{Problem, Report},
    texcoords::UvSlots,
    textures::{Slot, Textures},
};
use crate::world::{
    Alpha, ColorInput, ColorSpace, Emission, Material, MaterialId, NormalMap, Pbr, ScalarInput, Surface,
    TextureRef,
};

const DEFAULT_IOR: f32 = 1.5;
/// Stands for `ior` 0, by which KHR_materials_ior means a Fresnel term of 1 at every angle: F0 = 0.9996.
const FULLY_REFLECTING_IOR: f32 = 1e4;
/// Of the emissive factor and of its strength, so that their product is finite by far.
const MAX_EMISSION: f32 = 1e12;
/// Beyond this a normal map is all slope.
const MAX_NORMAL_SCALE: f32 = 1e4;

/// Every texture slot of a material: its place in it, and the texture.
pub fn slots(material: &json::Material) -> impl Iterator<Item = (&'static str, usize)> {
    let pbr = &material.pbr_metallic_roughness;
    let info = |info: &Option<Info>| info.as_ref().map(|i| i.index.value());
    [
        ("pbrMetallicRoughness/baseColorTexture", info(&pbr.base_color_texture)),
        ("pbrMetallicRoughness/metallicRoughnessTexture", info(&pbr.metallic_roughness_texture)),
        ("normalTexture", material.normal_texture.as_ref().map(|t| t.index.value())),
        (UNUSED_SLOT, material.occlusion_texture.as_ref().map(|t| t.index.value())),
        ("emissiveTexture", info(&material.emissive_texture)),
    ]
    .into_iter()
    .filter_map(|(name, texture)| Some((name, texture?)))
    .chain(layers::slots(material))
}

/// Whether the image in a slot is looked up, and needs to be decoded.
pub fn is_used(slot: &str) -> bool {
    slot != UNUSED_SLOT && slot != layers::UNUSED_SLOT
}

const UNUSED_SLOT: &str = "occlusionTexture";

/// Materials, and how they are found.
pub struct Converted {
    pub materials: Vec<Material>,
    /// Of each material.
    pub uv_slots: Vec<UvSlots>,
    /// By their index in the file; `None` is the default material.
    pub ids: BTreeMap<Option<usize>, MaterialId>,
}

/// The materials that are used, in the order of the file; the default material comes last.
pub fn convert_all(
    document: &Document,
    used: impl IntoIterator<Item = Option<usize>>,
    textures: &mut Textures,
    report: &mut Report,
) -> Converted {
    let mut used: Vec<_> = used.into_iter().collect();
    used.sort_by_key(|index| index.unwrap_or(usize::MAX));
    let mut converted = Converted { materials: Vec::new(), uv_slots: Vec::new(), ids: BTreeMap::new() };
    for index in used {
        converted.ids.insert(index, MaterialId(converted.materials.len() as u32));
        let mut uv_slots = UvSlots::default();
        converted.materials.push(match index.and_then(|i| Some((i, document.materials.get(i)?))) {
            Some((index, json)) => {
                Conversion { document, textures, report, index, uv_slots: &mut uv_slots }.convert(json)
            }
            None => default_material(),
        });
        converted.uv_slots.push(uv_slots);
    }
    converted
}

fn default_material() -> Material {
    let pbr = Pbr {
        base_color: ColorInput::constant(Vec3::ONE),
        metallic: ScalarInput::constant(1.0),
        roughness: ScalarInput::constant(1.0),
        ior: DEFAULT_IOR,
        multiscatter: true,
    };
    Material { double_sided: false, vertex_colors: true, ..Material::new("default", Surface::Pbr(pbr)) }
}

pub struct Conversion<'a> {
    document: &'a Document,
    textures: &'a mut Textures,
    pub report: &'a mut Report,
    index: usize,
    uv_slots: &'a mut UvSlots,
}

impl Conversion<'_> {
    fn convert(&mut self, json: &json::Material) -> Material {
        let pbr = &json.pbr_metallic_roughness;
        let extensions = json.extensions.as_ref();
        let base =
            pbr.base_color_factor.0.map(|c| self.within(c, 0.0, 1.0, "pbrMetallicRoughness/baseColorFactor"));
        let base_texture = self.info(
            pbr.base_color_texture.as_ref(),
            "pbrMetallicRoughness/baseColorTexture",
            ColorSpace::Srgb,
        );
        let base_color = ColorInput { factor: Vec3::new(base[0], base[1], base[2]), texture: base_texture };
        let mut coverage = ScalarInput { factor: base[3], texture: base_texture.map(|texture| (texture, 3)) };
        let surface = if extensions.is_some_and(|e| e.unlit.is_some()) {
            Surface::Unlit { color: base_color }
        } else if let Some(archived) = layers::specular_glossiness(self, json) {
            coverage = archived.coverage;
            Surface::SpecularGlossiness(archived.surface)
        } else {
            let packed = self.info(
                pbr.metallic_roughness_texture.as_ref(),
                "pbrMetallicRoughness/metallicRoughnessTexture",
                ColorSpace::Linear,
            );
            let mut scalar = |factor: f32, channel: u8, key: &str| ScalarInput {
                factor: self.within(factor, 0.0, 1.0, key),
                texture: packed.map(|texture| (texture, channel)),
            };
            let pbr = Pbr {
                base_color,
                metallic: scalar(pbr.metallic_factor.0, 2, "pbrMetallicRoughness/metallicFactor"),
                roughness: scalar(pbr.roughness_factor.0, 1, "pbrMetallicRoughness/roughnessFactor"),
                ior: self.ior(json),
                multiscatter: true,
            };
            layers::layered(self, json, pbr)
        };
        // "The doubleSided property has no effect on volume boundaries", which a camera inside sees from behind.
        let bounds_medium = matches!(&surface, Surface::Layered(layered) if layered.medium().is_some());
        let name = json.name.as_deref().map_or_else(|| format!("material {}", self.index), super::clipped);
        Material {
            name,
            surface,
            emission: self.emission(json),
            alpha: self.alpha(json),
            coverage,
            normal: json.normal_texture.as_ref().and_then(|normal| self.normal(normal, "normalTexture")),
            double_sided: json.double_sided || bounds_medium,
            vertex_colors: true,
        }
    }

    fn ior(&mut self, json: &json::Material) -> f32 {
        let ior = json.extensions.as_ref().and_then(|e| e.ior.as_ref()).map_or(DEFAULT_IOR, |i| i.ior.0);
        if ior == 0.0 {
            FULLY_REFLECTING_IOR
        } else {
            self.within(ior, 1.0, FULLY_REFLECTING_IOR, "extensions/KHR_materials_ior/ior")
        }
    }

    fn alpha(&mut self, json: &json::Material) -> Alpha {
        match json.alpha_mode {
            Checked::Valid(AlphaMode::Mask) => {
                let cutoff = json.alpha_cutoff.map_or(0.5, |c| c.0);
                Alpha::Mask { cutoff: self.within(cutoff, 0.0, f32::MAX, "alphaCutoff") }
            }
            Checked::Valid(AlphaMode::Blend) => Alpha::Blend,
            Checked::Valid(AlphaMode::Opaque) | Checked::Invalid => Alpha::Opaque,
        }
    }

    fn emission(&mut self, json: &json::Material) -> Option<Emission> {
        let factor = json.emissive_factor.0.map(|c| self.within(c, 0.0, MAX_EMISSION, "emissiveFactor"));
        let strength = json.extensions.as_ref().and_then(|e| e.emissive_strength.as_ref());
        let strength = strength.map_or(1.0, |s| s.emissive_strength.0);
        let key = "extensions/KHR_materials_emissive_strength/emissiveStrength";
        let strength = self.within(strength, 0.0, MAX_EMISSION, key);
        let factor = Vec3::from(factor);
        if factor == Vec3::ZERO || strength == 0.0 {
            return None;
        }
        let texture = self.info(json.emissive_texture.as_ref(), "emissiveTexture", ColorSpace::Srgb);
        Some(Emission { color: ColorInput { factor, texture }, strength, two_sided: json.double_sided })
    }

    pub fn normal(&mut self, json: &NormalTexture, key: &str) -> Option<NormalMap> {
        // The crate does not read the transform of this slot.
        let transform = json.extensions.as_ref().and_then(|e| e.others.get("KHR_texture_transform"));
        let transform: Option<TextureTransform> = match transform.map(|t| serde_json::from_value(t.clone())) {
            None => None,
            Some(Ok(transform)) => Some(transform),
            Some(Err(e)) => {
                let pointer = self.pointer(&format!("{key}/extensions/KHR_texture_transform"));
                self.report.error(Problem::new(pointer, e.to_string()));
                None
            }
        };
        let scale = self.within(json.scale, -MAX_NORMAL_SCALE, MAX_NORMAL_SCALE, &format!("{key}/scale"));
        let texture =
            self.slot(json.index.value(), json.tex_coord, transform.as_ref(), key, ColorSpace::Linear)?;
        Some(NormalMap { texture, scale })
    }

    pub fn info(&mut self, info: Option<&Info>, key: &str, space: ColorSpace) -> Option<TextureRef> {
        let info = info?;
        let transform = info.extensions.as_ref().and_then(|e| e.texture_transform.as_ref());
        self.slot(info.index.value(), info.tex_coord, transform, key, space)
    }

    fn slot(
        &mut self,
        texture: usize,
        tex_coord: u32,
        transform: Option<&TextureTransform>,
        key: &str,
        space: ColorSpace,
    ) -> Option<TextureRef> {
        let pointer = self.pointer(key);
        let set = transform.and_then(|t| t.tex_coord).unwrap_or(tex_coord);
        let Some(uv_set) = self.uv_slots.place(set) else {
            let message =
                format!("uses TEXCOORD_{set}, the third set of this material; the texture is left out");
            self.report.warn(Problem::new(pointer, message));
            return None;
        };
        let slot = Slot { texture, uv_set, transform, pointer };
        self.textures.reference(self.document, &slot, space, self.report)
    }

    /// `value` clamped to the range that the specification gives, with a warning where it was outside.
    pub fn within(&mut self, value: f32, least: f32, most: f32, key: &str) -> f32 {
        if (least..=most).contains(&value) {
            return value;
        }
        let clamped = if value.is_nan() { least } else { value.clamp(least, most) };
        let pointer = self.pointer(key);
        self.report.warn(Problem::new(pointer, format!("is {value}, out of range; {clamped} is used")));
        clamped
    }

    pub fn pointer(&self, key: &str) -> String {
        format!("/materials/{}/{key}", self.index)
    }
}
