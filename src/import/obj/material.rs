//! What the numbers of an MTL material mean for a path tracer.
//!
//! MTL describes the Phong shading of 1990, so there is no one right reading; the yardstick is Blender 5.0's importer,
//! tried key by key. docs/obj.md has the tables: what each key and each `illum` becomes, and where and why Blender
//! differs.

use std::path::Path;

use glam::Vec3;

use super::{
    layers,
    map::Map,
    mtl::Mtl,
    textures::{Textures, has_alpha},
};
use crate::{
    diagnostic::{Diagnostic, Place},
    world::{
        Alpha, Clearcoat, ColorInput, ColorSpace, Emission, Fresnel, Layered, Material, NormalMap, Pbr,
        ScalarInput, Sheen, SpecularLevel, Surface, TextureRef,
    },
};

const GREY: Vec3 = Vec3::splat(0.8);
const IOR: f32 = 1.5;
/// Disney's clearcoat, which `Pc` is, has a quarter of the strength of a full one (Burley 2012, *Physically-Based Shading
/// at Disney*, 5.6); Blender writes and reads it so.
const COAT: f32 = 0.25;
/// Of Blender's principled material, where `Pcr` is not said.
const COAT_ROUGHNESS: f32 = 0.03;
/// MTL has no roughness of the sheen; this is Blender's.
const SHEEN_ROUGHNESS: f32 = 0.5;
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
        if mtl.illum == Some(10) {
            let message =
                format!("`{}`: illum 10 is for invisible catchers of shadows: it is seen here", mtl.name);
            self.warn(library, mtl.line, message);
        }
        let glass = glass_ior(mtl);
        let surface = self.surface(mtl, glass, library);
        let mut material = Material::new(&mtl.name, surface);
        material.emission = self.emission(mtl, library);
        material.normal = self.normal(mtl, library);
        let coverage = self.coverage(mtl, library);
        if glass.is_none() && coverage != ScalarInput::constant(1.0) {
            (material.alpha, material.coverage) = (Alpha::Blend, coverage);
        }
        material
    }

    fn surface(&mut self, mtl: &Mtl, glass: Option<f32>, library: &Path) -> Surface {
        let maps = &mtl.maps;
        let base_color = match self.color_map(&maps.diffuse, library) {
            Some(texture) => ColorInput { factor: Vec3::ONE, texture: Some(texture) },
            None => ColorInput::constant(mtl.diffuse.map_or(GREY, Vec3::from)),
        };
        if is_lambert(mtl) && glass.is_none() {
            return Surface::Diffuse { color: base_color };
        }
        let roughness =
            self.scalar(roughness(mtl), maps.roughness.as_ref().or(maps.exponent.as_ref()), library);
        let metallic = self.scalar(metallic(mtl), maps.metallic.as_ref(), library);
        let ior = effective_ior(mtl, specular_level(mtl));
        let mut layered = Layered::new(Pbr { base_color, metallic, roughness, ior, multiscatter: true });
        self.add_layers(&mut layered, mtl, library);
        match glass {
            Some(ior) => {
                let tint = match glass_tint(mtl) {
                    Some(tint) => ColorInput::constant(tint),
                    None if base_color.texture.is_some() => base_color,
                    None => ColorInput::constant(Vec3::ONE),
                };
                // Ns is for the highlights of lamps: traced glass is clear unless it says otherwise.
                let roughness = self.scalar(mtl.roughness.unwrap_or(0.0), maps.roughness.as_ref(), library);
                if layered.is_plain() {
                    return Surface::Dielectric { ior, fresnel: Fresnel::Exact, roughness, tint };
                }
                let metallic = ScalarInput::constant(0.0);
                layered.pbr = Pbr { base_color: tint, metallic, roughness, ior, ..layered.pbr };
                layers::transmit(&mut layered, 1.0);
            }
            // As Blender writes its transmission. Other programs write Tf 1 for what is opaque.
            None if has_pbr(mtl) && mtl.filter.is_some_and(|tf| mean(tf) > 0.0) => {
                layers::transmit(&mut layered, mtl.filter.map_or(0.0, mean));
            }
            None => {}
        }
        if let Some(anisotropy) = mtl.anisotropy.filter(|&a| a > 0.0) {
            layers::stretch(&mut layered, anisotropy, mtl.anisotropy_rotation.unwrap_or(0.0));
        }
        if layered.is_plain() { Surface::Pbr(layered.pbr) } else { Surface::Layered(Box::new(layered)) }
    }

    /// The layers on top.
    fn add_layers(&mut self, layered: &mut Layered, mtl: &Mtl, library: &Path) {
        let maps = &mtl.maps;
        if let Some(map) = &maps.specular
            && let factor @ ScalarInput { texture: Some(_), .. } = self.scalar(1.0, Some(map), library)
        {
            // The map is the level, of twice the reflectance that the ior has.
            layered.pbr.ior = effective_ior(mtl, 1.0);
            layered.specular = Some(SpecularLevel { factor, color: ColorInput::constant(Vec3::ONE) });
        }
        let sheen = self.scalar(mtl.sheen.unwrap_or(0.0), maps.sheen.as_ref(), library);
        if sheen != ScalarInput::constant(0.0) {
            let texture = sheen.texture.map(|(texture, _)| texture);
            layered.sheen = Some(Sheen {
                color: ColorInput { factor: Vec3::splat(sheen.factor), texture },
                roughness: ScalarInput::constant(SHEEN_ROUGHNESS),
            });
        }
        let coat = self.scalar(mtl.clearcoat.unwrap_or(0.0) * COAT, maps.clearcoat.as_ref(), library);
        if coat != ScalarInput::constant(0.0) {
            let factor = if coat.texture.is_some() { COAT } else { coat.factor };
            let roughness = mtl.clearcoat_roughness.unwrap_or(COAT_ROUGHNESS);
            layered.clearcoat = Some(Clearcoat {
                factor: ScalarInput { factor, ..coat },
                roughness: self.scalar(roughness, maps.clearcoat_roughness.as_ref(), library),
                normal: None,
            });
        }
    }

    fn emission(&mut self, mtl: &Mtl, library: &Path) -> Option<Emission> {
        let texture = self.color_map(&mtl.maps.emission, library);
        let given = mtl.emission.map_or(Vec3::ZERO, Vec3::from);
        let factor = if given == Vec3::ZERO && texture.is_some() { Vec3::ONE } else { given };
        let color = ColorInput { factor, texture };
        (factor != Vec3::ZERO).then_some(Emission { color, strength: 1.0, two_sided: true })
    }

    fn coverage(&mut self, mtl: &Mtl, library: &Path) -> ScalarInput {
        let given = mtl.dissolve.unwrap_or(1.0);
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
        Some(NormalMap { texture: self.textures.bump(map, library)?, scale: map.strength })
    }

    fn scalar(&mut self, factor: f32, map: Option<&Map>, library: &Path) -> ScalarInput {
        let texture =
            map.and_then(|map| Some((self.textures.get(map, ColorSpace::Linear, library)?, map.channel)));
        match texture {
            Some((texture, channel)) => {
                ScalarInput { factor: 1.0, texture: Some((texture, channel.unwrap_or(0))) }
            }
            None => ScalarInput::constant(factor),
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

/// Whether the PBR extension is used.
fn has_pbr(mtl: &Mtl) -> bool {
    let Mtl { roughness, metallic, sheen, clearcoat, clearcoat_roughness, anisotropy, maps, .. } = mtl;
    let values = [roughness, metallic, sheen, clearcoat, clearcoat_roughness, anisotropy];
    let maps = [&maps.roughness, &maps.metallic, &maps.sheen, &maps.clearcoat, &maps.clearcoat_roughness];
    values.iter().any(|value| value.is_some()) || maps.iter().any(|map| map.is_some())
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
    let no_specular = specular_level(mtl) == 0.0 && mtl.maps.specular.is_none();
    let no_highlight = matches!(mtl.illum, Some(0 | 1)) || no_specular;
    no_highlight && !has_pbr(mtl) && metallic(mtl) == 0.0
}

/// The ior whose reflectance at normal incidence, F₀ = ((n − 1) / (n + 1))², is 2L times that of `Ni`, with L = `level`.
fn effective_ior(mtl: &Mtl, level: f32) -> f32 {
    let n = ior(mtl);
    let root = ((n - 1.0) / (n + 1.0) * (2.0 * level).sqrt()).min(0.99);
    (1.0 + root) / (1.0 - root)
}

fn ior(mtl: &Mtl) -> f32 {
    mtl.ior.unwrap_or(IOR)
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

/// Tf, or Kd where that is not black (black is what exporters write for "no diffuse part") and no map stands for it.
fn glass_tint(mtl: &Mtl) -> Option<Vec3> {
    let diffuse = mtl.diffuse.filter(|&kd| mean(kd) > 0.0 && mtl.maps.diffuse.is_none());
    mtl.filter.or(diffuse).map(Vec3::from)
}

#[cfg(test)]
mod tests {
    use std::f32::consts::TAU;

    use glam::Vec2;

    use super::*;
    use crate::world::Anisotropy;
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

    fn layered(text: &str) -> Layered {
        match plain(text).surface {
            Surface::Layered(layered) => *layered,
            other => panic!("{text}: {other:?}"),
        }
    }

    #[test]
    fn the_pbr_extension_is_layers() {
        let l = layered("Pr .4\nPs .3\nPc 2\nPcr .1");
        assert_eq!((l.pbr.roughness.factor, l.pbr.ior), (0.4, 1.5));
        assert_eq!(l.sheen.map(|s| (s.color.factor, s.roughness.factor)), Some((Vec3::splat(0.3), 0.5)));
        let coat = l.clearcoat.map(|c| (c.factor.factor, c.roughness.factor));
        assert_eq!(coat, Some((0.5, 0.1)), "Blender shows a coat weight of 0.5 for Pc 2");
        assert_eq!(layered("Pc 4").clearcoat.map(|c| c.roughness.factor), Some(0.03));
        assert!(matches!(plain("Pr .4\nPs 0\nPc 0\naniso 0\nTf 0 0 0").surface, Surface::Pbr(_)));
    }

    /// α along and across the tangent are those of Blender's principled material.
    #[test]
    fn the_highlight_is_stretched_as_in_blender() {
        let l = layered("Pr .6\naniso .7\nanisor .25");
        let Some(Anisotropy { strength, rotation, .. }) = l.anisotropy else { panic!("{l:?}") };
        let across = l.pbr.roughness.factor.powi(2);
        let along = across + (1.0 - across) * strength * strength;
        let aspect = (1.0_f32 - 0.9 * 0.7).sqrt();
        assert!((along - 0.36 / aspect).abs() < 1e-5 && (across - 0.36 * aspect).abs() < 1e-5);
        assert!((rotation - TAU / 4.0).abs() < 1e-5);
    }

    #[test]
    fn transmission_is_that_of_glass_or_of_blenders_files() {
        let share = |text| layered(text).transmission.map(|t| t.factor);
        assert_eq!(share("Pr 0\nTf .6 .6 .6"), Some(0.6));
        assert!(matches!(plain("Tf 1 1 1\nillum 2").surface, Surface::Pbr(_)), "no PBR: opaque");
        let coated = layered("illum 7\nTf .5 1 1\nPc 4\nNi 1.4");
        assert_eq!((coated.transmission.map(|t| t.factor), coated.pbr.ior), (Some(1.0), 1.4));
        assert_eq!(coated.pbr.base_color.factor, Vec3::new(0.5, 1.0, 1.0));
        assert!(coated.volume.is_some(), "it is solid");
    }

    /// The table of docs/obj.md: what `illum` alone makes of a material.
    #[test]
    fn every_illumination_model_is_what_the_table_says() {
        let page = include_str!("../../../docs/obj.md");
        let rows = page.lines().filter_map(|line| line.strip_prefix("| ")?.split_once(" | "));
        let rows: Vec<_> =
            rows.filter_map(|(illum, rest)| Some((illum.parse::<u32>().ok()?, rest))).collect();
        assert_eq!(rows.iter().map(|row| row.0).collect::<Vec<_>>(), (0..=10).collect::<Vec<_>>());
        for (illum, rest) in rows {
            let cells: Vec<_> = rest.trim_end_matches(" |").split(" | ").collect();
            for (cell, text) in [(1, ""), (2, "d 0.4"), (3, "Tf 0.9 0.9 0.9")] {
                let m = plain(&format!("illum {illum}\nNi 1.5\nKs .5 .5 .5\n{text}"));
                let kind = match m.surface {
                    Surface::Diffuse { .. } => "matte",
                    Surface::Pbr(pbr) if pbr.metallic.factor == 1.0 => "metal",
                    Surface::Pbr(_) => "plastic",
                    Surface::Dielectric { .. } => "glass",
                    other => panic!("{other:?}"),
                };
                let kind =
                    if m.alpha == Alpha::Blend { format!("{kind}, covers in part") } else { kind.into() };
                assert_eq!(cells.get(cell), Some(&kind.as_str()), "illum {illum} with {text:?}");
            }
        }
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

        let text = "bump -bm 2 heights.png\nmap_d heights.png\nmap_Kd broken.png";
        let (m, model) = convert(text, folder.path());
        assert_eq!((m.normal.map(|n| n.scale), model.warnings.len()), (Some(2.0), 1));
        let names: Vec<_> = model.images.iter().map(|i| i.name.ends_with("(normals)")).collect();
        assert_eq!(names, [true, false]);
        assert_eq!(m.coverage.texture.map(|(_, channel)| channel), Some(0));
        let (_, model) = convert("bump heights.png\nnewmtl b", folder.path());
        assert_eq!(model.images.len(), 1, "the heights themselves are not kept");

        let Surface::Layered(l) =
            convert("map_Ks -imfchan g alpha.png\nmap_Pc alpha.png", folder.path()).0.surface
        else {
            panic!("no layers")
        };
        assert_eq!(l.specular.and_then(|s| s.factor.texture).map(|(_, channel)| channel), Some(1));
        assert_eq!(l.clearcoat.map(|c| (c.factor.factor, c.factor.texture.is_some())), Some((0.25, true)));
    }
}
