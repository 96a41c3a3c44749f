//! Materials without what has no effect anywhere, so that no hit asks for it: layers whose constant weight is zero, textures of
//! glTF's materials that a factor of zero multiplies, coverage that is complete, colours of vertices that have none.
//!
//! Layers that weigh nothing at some hits alone, by a texture, are left out there, in `material`. Exporters see what the author wrote.

use std::collections::HashMap;

use glam::Vec3;
use rayon::prelude::*;

use crate::world::{
    Alpha, ColorInput, Image, Layered, Material, Model, Pbr, ScalarInput, SpecularGlossiness, Surface,
    Texels, TextureId,
};

/// The materials of `model` as they are rendered. Of its images, which need not be there, those are looked at that say what a surface
/// covers: many are full.
pub fn rendered(model: &Model) -> Vec<Material> {
    let mut colored = vec![false; model.materials.len()];
    for instance in &model.instances {
        let has_colors = model.meshes.get(instance.mesh.index()).is_some_and(|mesh| !mesh.colors.is_empty());
        for id in &instance.materials {
            if let Some(colored) = colored.get_mut(id.index()) {
                *colored |= has_colors;
            }
        }
    }
    let mut known = HashMap::new();
    let mut is_full = |texture: TextureId, channel: u8| {
        let Some(image) = model.textures.get(texture.index()).map(|texture| texture.image) else {
            return false;
        };
        let of = |image: &Image| self::is_full(image, channel);
        *known.entry((image, channel)).or_insert_with(|| model.images.get(image.index()).is_some_and(of))
    };
    let reduce = |(material, colored): (&Material, bool)| {
        let vertex_colors = material.vertex_colors && colored;
        reduced(Material { vertex_colors, ..material.clone() }, &mut is_full)
    };
    model.materials.iter().zip(colored).map(reduce).collect()
}

/// `material` as it is rendered; `is_full` says whether a channel of a texture is 1 everywhere.
pub fn reduced(mut material: Material, is_full: &mut dyn FnMut(TextureId, u8) -> bool) -> Material {
    material.surface = match material.surface {
        Surface::Layered(layered) => surface(*layered),
        Surface::Pbr(pbr) => Surface::Pbr(self::pbr(pbr)),
        Surface::SpecularGlossiness(surface) => Surface::SpecularGlossiness(SpecularGlossiness {
            diffuse: color(surface.diffuse),
            specular: color(surface.specular),
            glossiness: scalar(surface.glossiness),
        }),
        other => other,
    };
    material.emission = material.emission.filter(|e| e.strength != 0.0 && e.color.factor != Vec3::ZERO);
    if material.alpha != Alpha::Opaque {
        let texture = material.coverage.texture;
        material.coverage.texture = texture.filter(|(texture, channel)| !is_full(texture.texture, *channel));
    }
    let covers_all = material.coverage.texture.is_none() && !material.vertex_colors;
    match material.alpha {
        Alpha::Mask { cutoff } if covers_all && material.coverage.factor >= cutoff => {
            material.alpha = Alpha::Opaque;
        }
        Alpha::Blend if covers_all && material.coverage.factor >= 1.0 => material.alpha = Alpha::Opaque,
        _ => {}
    }
    if material.alpha == Alpha::Opaque {
        material.coverage = ScalarInput::constant(1.0);
    }
    material
}

/// Whether a channel is 1 in all texels, of which there are some.
fn is_full(image: &Image, channel: u8) -> bool {
    let channel = usize::from(channel & 3);
    match &image.texels {
        Texels::Rgba8(texels) => {
            !texels.is_empty() && texels.par_iter().all(|texel| texel[channel] == u8::MAX)
        }
        Texels::Rgba16(texels) => {
            !texels.is_empty() && texels.par_iter().all(|texel| texel[channel] == u16::MAX)
        }
        Texels::RgbF32(_) => channel == 3,
    }
}

fn surface(layered: Layered) -> Surface {
    let Layered { specular, clearcoat, sheen, volume, iridescence, anisotropy, .. } = layered;
    // What the surface bounds is a medium if light could enter it, however little does.
    let bounds = layered.medium().is_some();
    let weighs = |weight: &ScalarInput| weight.factor != 0.0;
    let reduced = Layered {
        pbr: pbr(layered.pbr),
        specular: specular
            .filter(|s| s.factor != ScalarInput::constant(1.0) || s.color != ColorInput::constant(Vec3::ONE)),
        clearcoat: clearcoat.filter(|coat| weighs(&coat.factor)),
        sheen: sheen.filter(|sheen| sheen.color.factor != Vec3::ZERO),
        transmission: layered.transmission.filter(|share| bounds || weighs(share)),
        volume: volume.filter(|_| bounds),
        iridescence: iridescence.filter(|film| {
            let [thin, thick] = film.thickness;
            weighs(&film.factor) && (thick > 0.0 || thin > 0.0 && film.thickness_texture.is_some())
        }),
        anisotropy: anisotropy.filter(|a| a.strength != 0.0),
        diffuse_transmission: layered.diffuse_transmission.filter(|d| bounds || weighs(&d.factor)),
        dispersion: layered.dispersion,
    };
    if reduced.is_plain() { Surface::Pbr(reduced.pbr) } else { Surface::Layered(Box::new(reduced)) }
}

fn pbr(pbr: Pbr) -> Pbr {
    let Pbr { base_color, metallic, roughness, .. } = pbr;
    Pbr { base_color: color(base_color), metallic: scalar(metallic), roughness: scalar(roughness), ..pbr }
}

fn color(input: ColorInput) -> ColorInput {
    ColorInput { texture: input.texture.filter(|_| input.factor != Vec3::ZERO), ..input }
}

fn scalar(input: ScalarInput) -> ScalarInput {
    ScalarInput { texture: input.texture.filter(|_| input.factor != 0.0), ..input }
}

#[cfg(test)]
mod tests {
    use glam::{Affine2, Affine3A, Vec4};

    use super::*;
    use crate::world::{
        Anisotropy, Clearcoat, ColorSpace, DiffuseTransmission, Emission, Filter, ImageId, Instance,
        Iridescence, MaterialId, Mesh, MeshId, Sheen, SpecularLevel, Texture, TextureRef, Volume, Wrap,
    };

    const TEXTURE: TextureRef = TextureRef { texture: TextureId(0), uv_set: 0, transform: Affine2::IDENTITY };

    fn textured(factor: f32) -> ScalarInput {
        ScalarInput { factor, texture: Some((TEXTURE, 3)) }
    }

    fn tinted(factor: Vec3) -> ColorInput {
        ColorInput { factor, texture: Some(TEXTURE) }
    }

    fn plain() -> Pbr {
        let base_color = tinted(Vec3::splat(0.5));
        let (metallic, roughness) = (ScalarInput::constant(0.0), textured(0.5));
        Pbr { base_color, metallic, roughness, ior: 1.5, multiscatter: true }
    }

    fn kept(surface: Surface) -> Surface {
        reduced(Material::new("", surface), &mut |_, _| false).surface
    }

    /// Every layer there is, of this weight.
    fn layers(weight: f32) -> Layered {
        let color = tinted(Vec3::splat(weight));
        let film = Iridescence {
            factor: textured(weight),
            ior: 1.3,
            thickness: [100.0, 400.0],
            thickness_texture: Some((TEXTURE, 1)),
        };
        let coat = Clearcoat { factor: textured(weight), roughness: textured(0.5), normal: None };
        Layered {
            specular: Some(SpecularLevel {
                factor: ScalarInput::constant(1.0 - weight),
                color: ColorInput::constant(Vec3::ONE),
            }),
            clearcoat: Some(coat),
            sheen: Some(Sheen { color, roughness: textured(0.5) }),
            transmission: Some(textured(weight)),
            iridescence: Some(film),
            anisotropy: Some(Anisotropy { strength: weight, rotation: 1.0, texture: Some(TEXTURE) }),
            diffuse_transmission: Some(DiffuseTransmission { factor: textured(weight), color }),
            ..Layered::new(plain())
        }
    }

    #[test]
    fn layers_of_no_weight_leave_the_plain_material_and_the_least_weight_leaves_them() {
        assert_eq!(kept(Surface::Layered(Box::new(layers(0.0)))), Surface::Pbr(plain()));
        let all = Surface::Layered(Box::new(layers(1e-3)));
        assert_eq!(kept(all.clone()), all);
    }

    /// Its medium is met on the way out of what lies within, whether or not light comes in here.
    #[test]
    fn what_bounds_a_medium_goes_on_to() {
        let volume = Some(Volume { attenuation_color: Vec3::splat(0.5), attenuation_distance: 1.0 });
        let bounding =
            Layered { volume, transmission: Some(ScalarInput::constant(0.0)), ..Layered::new(plain()) };
        let surface = Surface::Layered(Box::new(bounding));
        assert_eq!(kept(surface.clone()), surface);
        let alone = Surface::Layered(Box::new(Layered { transmission: None, ..bounding }));
        assert_eq!(kept(alone), Surface::Pbr(plain()));
    }

    #[test]
    fn nothing_is_looked_up_to_be_multiplied_by_zero() {
        let black = Pbr { base_color: tinted(Vec3::ZERO), metallic: textured(0.0), ..plain() };
        let Surface::Pbr(found) = kept(Surface::Pbr(black)) else { panic!("still plain") };
        assert_eq!(found.base_color, ColorInput::constant(Vec3::ZERO));
        assert_eq!((found.metallic, found.roughness), (ScalarInput::constant(0.0), textured(0.5)));
        let emission = |strength| {
            let emission = Emission { color: tinted(Vec3::ONE), strength, two_sided: false };
            let material = Material { emission: Some(emission), ..Material::new("", Surface::Black) };
            reduced(material, &mut |_, _| false).emission
        };
        assert!(emission(0.0).is_none() && emission(1.0).is_some());
    }

    /// What a material with this coverage becomes, on a mesh with colours or without.
    fn alpha(alpha: Alpha, coverage: ScalarInput, texel: u8, colors: Vec<Vec4>) -> Alpha {
        let texels = Texels::Rgba8(vec![[0, 0, 0, 255], [0, 0, 0, texel]]);
        let texture = Texture {
            image: ImageId(0),
            color_space: ColorSpace::Srgb,
            wrap_u: Wrap::Repeat,
            wrap_v: Wrap::Repeat,
            filter: Filter::Linear,
        };
        // (as glTF has it for all materials)
        let material = Material { alpha, coverage, vertex_colors: true, ..Material::new("", Surface::Black) };
        let model = Model {
            meshes: vec![Mesh { colors, ..Mesh::default() }],
            images: vec![Image { name: String::new(), width: 2, height: 1, texels }],
            textures: vec![texture],
            materials: vec![material],
            instances: vec![Instance {
                name: String::new(),
                mesh: MeshId(0),
                to_world: Affine3A::IDENTITY,
                materials: vec![MaterialId(0)],
            }],
            ..Model::default()
        };
        rendered(&model)[0].alpha
    }

    #[test]
    fn what_covers_all_is_opaque() {
        let mask = Alpha::Mask { cutoff: 0.5 };
        for (coverage, texel) in [(textured(1.0), 255), (ScalarInput::constant(1.0), 0)] {
            assert_eq!(alpha(Alpha::Blend, coverage, texel, vec![]), Alpha::Opaque);
            assert_eq!(alpha(mask, coverage, texel, vec![]), Alpha::Opaque);
            let colors = vec![Vec4::splat(0.5)];
            assert_eq!(alpha(Alpha::Blend, coverage, texel, colors), Alpha::Blend, "vertices have alpha too");
        }
        assert_eq!(alpha(Alpha::Blend, textured(1.0), 254, vec![]), Alpha::Blend);
        assert_eq!(alpha(Alpha::Blend, textured(0.9), 255, vec![]), Alpha::Blend);
        assert_eq!(alpha(mask, textured(0.4), 255, vec![]), mask);
    }
}
