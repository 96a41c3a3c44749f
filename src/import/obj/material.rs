//! What the numbers of an MTL material mean for a path tracer.
//!
//! MTL describes the Phong shading of 1990, so there is no one right reading; the yardstick is Blender 5.0's importer,
//! tried key by key. Where the two columns differ, the reason stands beside.
//!
//! | MTL | here | Blender |
//! |---|---|---|
//! | `Kd`, `map_Kd` | base colour; the map alone where there is one | the same |
//! | `Ns` | roughness = 1 − √(Ns / 1000); without it 0 under `illum 2`, else 1 | the same |
//! | `Ks` | its mean is the specular level L; without it 1 under `illum 2`, else 0 | the same |
//! | `Ni` | ior, 1.5 by default; L scales F₀ by 2L, so the ior changes with it | the same |
//! | `illum` 0, 1 | Lambert | Ks counts here too, against the format |
//! | `illum` 3 to 8 | metallic = mean of `Ka`, or 1 | the same |
//! | `illum` 4, 6, 7, 9 and not opaque | glass of `Ni` and `Tf` | mixed with metal; `Tf` under any `illum`, which would make glass of most of Maya's files |
//! | `d`, `map_d` | coverage; the map's A, or R where it has no A | always A |
//! | `Tr` | 1 − d | not read |
//! | `Ke`, `map_Ke` | radiance, from both sides | the map times the greatest of Ke |
//! | `Pr`, `Pm`, their maps | roughness, metallic; L = ½ without `Ks` | L = 0 |
//! | `norm` | normal map | not read |
//! | `bump` | normal map where the image holds unit vectors; heights are passed over | always a normal map |
//! | no material | Lambert, 0.8 | the same |

use std::path::Path;

use glam::Vec3;

use super::{
    mtl::{Map, Mtl},
    textures::{Textures, has_alpha, holds_normals},
};
use crate::{
    diagnostic::{Diagnostic, Place},
    world::{
        Alpha, ColorInput, ColorSpace, Emission, Fresnel, Material, NormalMap, Pbr, ScalarInput, Surface,
        TextureRef,
    },
};

const GREY: Vec3 = Vec3::splat(0.8);
const IOR: f32 = 1.5;
/// Wavefront's range of `Ni` ends here.
const MAX_IOR: f32 = 10.0;
const MAX_EXPONENT: f32 = 1000.0;

/// For faces without a material. Vertex colours show on it alone: a material says itself what it looks like.
pub(super) fn default(vertex_colors: bool) -> Material {
    let color = ColorInput::constant(if vertex_colors { Vec3::ONE } else { GREY });
    Material { vertex_colors, ..Material::new("default", Surface::Diffuse { color }) }
}

/// Turns MTL materials into the model's.
pub(super) struct Converter<'a> {
    pub textures: Textures<'a>,
}

impl Converter<'_> {
    /// `library` is the file that `mtl` stands in.
    pub fn material(&mut self, mtl: &Mtl, library: &Path) -> Material {
        let maps = &mtl.maps;
        let diffuse_map = self.color_map(&maps.diffuse, library);
        let base_color = match diffuse_map {
            Some(texture) => ColorInput { factor: Vec3::ONE, texture: Some(texture) },
            None => ColorInput::constant(self.reflectance(mtl, library)),
        };
        let roughness =
            self.scalar(roughness(mtl), maps.roughness.as_ref().or(maps.exponent.as_ref()), library);
        let metallic = self.scalar(metallic(mtl), maps.metallic.as_ref(), library);
        let glass = glass_ior(mtl);
        let surface = if let Some(ior) = glass {
            let tint = ColorInput::constant(glass_tint(mtl));
            // Ns is for the highlights of lamps: traced glass is clear unless it says otherwise.
            let roughness = ScalarInput::constant(mtl.roughness.unwrap_or(0.0).clamp(0.0, 1.0));
            Surface::Dielectric { ior, fresnel: Fresnel::Exact, roughness, tint }
        } else if is_lambert(mtl) {
            Surface::Diffuse { color: base_color }
        } else {
            Surface::Pbr(Pbr { base_color, metallic, roughness, ior: effective_ior(mtl), multiscatter: true })
        };
        let mut material = Material::new(&mtl.name, surface);
        material.emission = self.emission(mtl, library);
        material.normal = self.normal(mtl, library);
        let coverage = self.coverage(mtl, library);
        if glass.is_none() && coverage != ScalarInput::constant(1.0) {
            (material.alpha, material.coverage) = (Alpha::Blend, coverage);
        }
        material
    }

    /// Kd within what a surface can reflect.
    fn reflectance(&mut self, mtl: &Mtl, library: &Path) -> Vec3 {
        let Some(given) = mtl.diffuse.map(Vec3::from) else { return GREY };
        let color = given.clamp(Vec3::ZERO, Vec3::ONE);
        if color != given {
            let message = format!("`{}`: a Kd outside 0 to 1 is no reflectance; it was clamped", mtl.name);
            self.warn(library, mtl.line, message);
        }
        color
    }

    fn emission(&mut self, mtl: &Mtl, library: &Path) -> Option<Emission> {
        let texture = self.color_map(&mtl.maps.emission, library);
        let given = mtl.emission.map_or(Vec3::ZERO, |ke| Vec3::from(ke).max(Vec3::ZERO));
        let factor = if given == Vec3::ZERO && texture.is_some() { Vec3::ONE } else { given };
        let color = ColorInput { factor, texture };
        (factor != Vec3::ZERO).then_some(Emission { color, strength: 1.0, two_sided: true })
    }

    fn coverage(&mut self, mtl: &Mtl, library: &Path) -> ScalarInput {
        let given = mtl.dissolve.unwrap_or(1.0).clamp(0.0, 1.0);
        let Some(map) = &mtl.maps.dissolve else {
            if given == 0.0 {
                let message = format!("`{}` cannot be seen: its d is 0 (or its Tr is 1)", mtl.name);
                self.warn(library, mtl.line, message);
            }
            return ScalarInput::constant(given);
        };
        let Some(texture) = self.textures.get(map, ColorSpace::Linear, library) else {
            return ScalarInput::constant(given);
        };
        let has_alpha = self.textures.image(texture).is_some_and(has_alpha);
        let channel = map.channel.unwrap_or(if has_alpha { 3 } else { 0 });
        ScalarInput { factor: 1.0, texture: Some((texture, channel)) }
    }

    fn normal(&mut self, mtl: &Mtl, library: &Path) -> Option<NormalMap> {
        if let Some(map) = &mtl.maps.normal {
            let texture = self.textures.get(map, ColorSpace::Linear, library)?;
            return Some(NormalMap { texture, scale: map.strength });
        }
        let map = mtl.maps.bump.as_ref()?;
        let texture = self.textures.get(map, ColorSpace::Linear, library)?;
        if self.textures.image(texture).is_some_and(holds_normals) {
            return Some(NormalMap { texture, scale: map.strength });
        }
        let message = format!("`{}`: the heights in `{}` are passed over", mtl.name, map.file);
        self.warn(library, map.line, message);
        None
    }

    fn scalar(&mut self, factor: f32, map: Option<&Map>, library: &Path) -> ScalarInput {
        let texture =
            map.and_then(|map| Some((self.textures.get(map, ColorSpace::Linear, library)?, map.channel)));
        match texture {
            Some((texture, channel)) => {
                ScalarInput { factor: 1.0, texture: Some((texture, channel.unwrap_or(0))) }
            }
            None => ScalarInput::constant(factor.clamp(0.0, 1.0)),
        }
    }

    fn color_map(&mut self, map: &Option<Map>, library: &Path) -> Option<TextureRef> {
        self.textures.get(map.as_ref()?, ColorSpace::Srgb, library)
    }

    fn warn(&mut self, library: &Path, line: usize, message: String) {
        self.textures.model.warnings.push(Diagnostic::warning(library, Place::Line(line), message));
    }
}

fn mean(color: [f32; 3]) -> f32 {
    color.iter().sum::<f32>() / 3.0
}

fn has_pbr(mtl: &Mtl) -> bool {
    mtl.roughness.is_some()
        || mtl.metallic.is_some()
        || mtl.maps.roughness.is_some()
        || mtl.maps.metallic.is_some()
}

fn roughness(mtl: &Mtl) -> f32 {
    let of_exponent = |ns: f32| 1.0 - (ns.clamp(0.0, MAX_EXPONENT) / MAX_EXPONENT).sqrt();
    let unsaid = if mtl.illum == Some(2) { 0.0 } else { 1.0 };
    mtl.roughness.or(mtl.exponent.map(of_exponent)).unwrap_or(unsaid)
}

fn metallic(mtl: &Mtl) -> f32 {
    let reflects = matches!(mtl.illum, Some(3..=8));
    mtl.metallic.unwrap_or(if reflects { mtl.ambient.map_or(1.0, mean) } else { 0.0 })
}

/// Blender's "specular IOR level", 0 to 1: ½ leaves the reflectance at normal incidence as the ior has it.
fn specular_level(mtl: &Mtl) -> f32 {
    let unsaid = match mtl.illum {
        _ if has_pbr(mtl) => 0.5,
        Some(2) => 1.0,
        _ => 0.0,
    };
    mtl.specular.map_or(unsaid, mean).clamp(0.0, 1.0)
}

fn is_lambert(mtl: &Mtl) -> bool {
    let no_highlight = matches!(mtl.illum, Some(0 | 1)) || specular_level(mtl) == 0.0;
    no_highlight && !has_pbr(mtl) && metallic(mtl) == 0.0
}

/// The ior whose reflectance at normal incidence, F₀ = ((n − 1) / (n + 1))², is 2L times that of `Ni`.
fn effective_ior(mtl: &Mtl) -> f32 {
    let n = ior(mtl);
    let root = ((n - 1.0) / (n + 1.0) * (2.0 * specular_level(mtl)).sqrt()).min(0.99);
    (1.0 + root) / (1.0 - root)
}

fn ior(mtl: &Mtl) -> f32 {
    mtl.ior.unwrap_or(IOR).clamp(1.0, MAX_IOR)
}

/// The ior of a material that is glass.
fn glass_ior(mtl: &Mtl) -> Option<f32> {
    let see_through = mtl.dissolve.is_some_and(|d| d < 1.0);
    let filters = mtl.filter.is_some_and(|tf| tf.iter().any(|&share| share > 0.0));
    let glass = match mtl.illum {
        Some(4 | 9) => see_through,
        Some(6 | 7) => see_through || filters,
        _ => false,
    };
    Some(ior(mtl)).filter(|&n| glass && n > 1.0)
}

/// Tf, or Kd where that is not black (black is what exporters write for "no diffuse part").
fn glass_tint(mtl: &Mtl) -> Vec3 {
    let given = mtl.filter.or(mtl.diffuse.filter(|&kd| mean(kd) > 0.0));
    given.map_or(Vec3::ONE, Vec3::from).clamp(Vec3::ZERO, Vec3::ONE)
}

#[cfg(test)]
mod tests {
    use glam::Vec2;

    use super::*;
    use crate::{import::obj::mtl, world::Model};

    fn convert(text: &str, folder: &Path) -> (Material, Model) {
        let (all, _) = mtl::parse(&format!("newmtl m\n{text}"), &folder.join("a.mtl"));
        let mut model = Model::default();
        let material = Converter { textures: Textures::new(folder, &mut model) }
            .material(&all[0], &folder.join("a.mtl"));
        (material, model)
    }

    fn plain(text: &str) -> Material {
        convert(text, Path::new("nowhere")).0
    }

    fn pbr(text: &str) -> Pbr {
        match plain(text).surface {
            Surface::Pbr(pbr) => pbr,
            other => panic!("{text}: {other:?}"),
        }
    }

    /// The figures are those that Blender 5.0.1 shows for the same text.
    #[test]
    fn highlights_are_blenders() {
        let lambert = |rgb: [f32; 3]| Surface::Diffuse { color: ColorInput::constant(rgb.into()) };
        assert_eq!(plain("Kd .3 .4 .5").surface, lambert([0.3, 0.4, 0.5]));
        assert_eq!(plain("illum 1\nKs 1 1 1").surface, lambert([0.8; 3]));
        assert_eq!(plain("Ks 0 0 0\nNs 10").surface, lambert([0.8; 3]));
        let close = |a: f32, b: f32| assert!((a - b).abs() < 1e-4, "{a} is not {b}");
        let p = pbr("Ks .2 .3 .4\nNs 250\nNi 1.33\nillum 2");
        close(p.roughness.factor, 0.5);
        close(p.metallic.factor, 0.0);
        // Level 0.3: F₀ = 0.6 (0.33 / 2.33)² = 0.012036, so n = 1.1097 / 0.8903.
        close(p.ior, 1.24644);
        close(pbr("illum 2").roughness.factor, 0.0);
        close(pbr("illum 2\nKs .5 .5 .5").ior, 1.5);
        close(pbr("illum 3").metallic.factor, 1.0);
        close(pbr("illum 3\nKa .25 .25 .25").metallic.factor, 0.25);
        let p = pbr("Pr 0.3\nPm 0.8");
        close(p.roughness.factor, 0.3);
        close(p.metallic.factor, 0.8);
        close(p.ior, 1.5);
    }

    #[test]
    fn what_is_not_opaque_is_glass_or_covers_in_part() {
        let glass = |text| matches!(plain(text).surface, Surface::Dielectric { .. });
        assert!(
            glass("illum 7\nNi 1.5\nTf 1 1 1") && glass("illum 4\nd 0.1") && glass("illum 9\nTr 0.9\nNi 1.3")
        );
        assert!(!glass("illum 4\nd 1\nTf 1 1 1\nNi 1.5"), "every material of Maya");
        assert!(!glass("illum 7\nNi 1\nd 0.5") && !glass("illum 2\nd 0.5\nNi 1.5"));
        let thin = plain("illum 2\nd 0.25");
        assert_eq!((thin.alpha, thin.coverage.factor), (Alpha::Blend, 0.25));
        assert_eq!(plain("illum 4\nd 0.1").alpha, Alpha::Opaque);
        assert_eq!(plain("d 1").alpha, Alpha::Opaque);
    }

    #[test]
    fn values_no_surface_has_are_clamped_and_said() {
        let (material, model) = convert("Kd 2 -1 .5\nKe -1 -1 -1", Path::new("nowhere"));
        assert_eq!(
            material.surface,
            Surface::Diffuse { color: ColorInput::constant(Vec3::new(1.0, 0.0, 0.5)) }
        );
        assert_eq!((material.emission, model.warnings.len()), (None, 1));
    }

    #[test]
    fn a_missing_texture_is_one_warning_and_its_factor_stands_in() {
        let (material, model) =
            convert("Kd .1 .1 .1\nmap_Kd gone.png\nmap_d gone.png\nmap_Ke gone.png", Path::new("nowhere"));
        assert_eq!(material.surface, Surface::Diffuse { color: ColorInput::constant(Vec3::splat(0.1)) });
        assert_eq!((material.alpha, material.emission), (Alpha::Opaque, None));
        assert_eq!(model.warnings.len(), 1);
        assert_eq!(model.warnings[0].place, Place::Line(3));
    }

    #[test]
    fn images_are_loaded_once_and_read_by_what_they_hold() {
        let folder = tempfile::tempdir().expect("a folder for temporary files");
        let save = |name: &str, texel: [u8; 4]| {
            let saved =
                ::image::RgbaImage::from_pixel(2, 2, ::image::Rgba(texel)).save(folder.path().join(name));
            saved.expect("it can be written");
        };
        save("normals.png", [128, 128, 255, 255]);
        save("heights.png", [128, 128, 128, 255]);
        save("alpha.png", [9, 9, 9, 64]);
        std::fs::write(folder.path().join("broken.png"), b"no picture").expect("it can be written");

        let text = "Kd .5 .5 .5\nmap_Kd -s 2 4 -o .5 .25 alpha.png\nmap_d Alpha.png\nbump -bm 0.5 normals.png\nillum 2";
        let (m, model) = convert(text, folder.path());
        assert_eq!((model.images.len(), model.textures.len(), model.warnings.len()), (2, 3, 0));
        assert_eq!(m.normal.map(|n| n.scale), Some(0.5));
        assert_eq!(m.coverage.texture.map(|(_, channel)| channel), Some(3));
        let Surface::Pbr(Pbr { base_color: ColorInput { factor, texture: Some(texture) }, .. }) = m.surface
        else {
            panic!("{:?}", m.surface)
        };
        assert_eq!(factor, Vec3::ONE);
        assert_eq!(model.textures[texture.texture.index()].color_space, ColorSpace::Srgb);
        // (0.25, 0.75) here is (0.25, 0.25) with v up; times (2, 4) plus (0.5, 0.25) is (1, 1.25), so (1, −0.25) here.
        let uv = texture.transform.transform_point2(Vec2::new(0.25, 0.75));
        assert!(uv.distance(Vec2::new(1.0, -0.25)) < 1e-6, "{uv}");

        let (m, model) = convert("bump heights.png\nmap_d heights.png\nmap_Kd broken.png", folder.path());
        assert_eq!((m.normal, model.warnings.len()), (None, 2));
        assert_eq!(m.coverage.texture.map(|(_, channel)| channel), Some(0));
    }
}
