//! Materials with layers, for renderers that have none of ours: the nearest material without.

use std::borrow::Cow;

use super::{Kind, note::Notes, used};
use crate::{
    bsdf::fresnel::normal_reflectance,
    world::{Fresnel, Layered, Pbr, ScalarInput, SpecularGlossiness, Surface, World},
};

/// `world` without layers. It is a copy only where a material in use has some.
pub fn removed<'a>(world: &'a World, notes: &mut Notes) -> Cow<'a, World> {
    let mut world = Cow::Borrowed(world);
    for id in used(&world) {
        let Some(material) = world.model.materials.get(id.index()) else { continue };
        let (surface, differences) = match &material.surface {
            Surface::Layered(layered) => nearest(layered),
            Surface::SpecularGlossiness(surface) => nearest_of_glossy(surface),
            _ => continue,
        };
        for (kind, difference) in differences {
            let subject = format!("material `{}`", material.name);
            match kind {
                Kind::Approximated => notes.approximated(subject, difference),
                Kind::Dropped => notes.dropped(subject, difference),
            }
        }
        world.to_mut().model.materials[id.index()].surface = surface;
    }
    world
}

type Difference = (Kind, &'static str);

fn nearest(layered: &Layered) -> (Surface, Vec<Difference>) {
    let mut told = Vec::new();
    let absent = [
        (layered.clearcoat.is_some(), "the clearcoat is left out"),
        (layered.sheen.is_some(), "the sheen is left out"),
        (layered.iridescence.is_some(), "the thin film is left out"),
        (layered.anisotropy.is_some(), "highlights are round: the anisotropy is left out"),
        (layered.dispersion > 0.0, "all colours refract alike: the dispersion is left out"),
        (layered.diffuse_transmission.is_some(), "no light passes diffusely to the far side"),
        (
            layered.medium().is_some_and(|volume| volume.attenuation_distance.is_finite()),
            "the inside does not absorb",
        ),
    ];
    told.extend(absent.into_iter().filter_map(|(is, text)| is.then_some((Kind::Dropped, text))));
    let mut pbr = layered.pbr;
    if let Some(specular) = &layered.specular {
        told.push((Kind::Approximated, "the strength and colour of the specular reflection are in the index of refraction, as their mean"));
        let strength = specular.factor.factor * specular.color.factor.element_sum() / 3.0;
        pbr.ior = ior_of_f0(normal_reflectance(pbr.ior) * strength);
    }
    let Some(share) = layered.transmission else { return (Surface::Pbr(pbr), told) };
    if share.factor < 0.5 || pbr.metallic.factor >= 0.5 && pbr.metallic.texture.is_none() {
        told.push((Kind::Dropped, "no light passes through"));
        return (Surface::Pbr(pbr), told);
    }
    if share.factor < 1.0 || share.texture.is_some() {
        told.push((
            Kind::Approximated,
            "all of what is not reflected passes, where the material lets a share of it pass",
        ));
    }
    let (ior, roughness) = match layered.volume {
        Some(_) => {
            told.push((
                Kind::Approximated,
                "the colour tints reflections too, and reflection is by the equations of Fresnel",
            ));
            (pbr.ior, pbr.roughness)
        }
        None => {
            told.push((
                Kind::Approximated,
                "a wall without thickness is a filter: it neither reflects nor blurs",
            ));
            (1.0, ScalarInput::constant(0.0))
        }
    };
    (Surface::Dielectric { ior, fresnel: Fresnel::Exact, roughness, tint: pbr.base_color }, told)
}

fn nearest_of_glossy(surface: &SpecularGlossiness) -> (Surface, Vec<Difference>) {
    let mut told = vec![(
        Kind::Approximated,
        "specular-glossiness as metallic-roughness: the reflection is white, as strong as the mean colour's",
    )];
    if surface.glossiness.texture.is_some() {
        told.push((Kind::Approximated, "the roughness has no texture: that of the glossiness is left out"));
    }
    let f0 = surface.specular.factor.element_sum() / 3.0;
    let is_metal = surface.diffuse.factor.max_element() < 0.05 && f0 > 0.2;
    let roughness = ScalarInput::constant(1.0 - surface.glossiness.factor.clamp(0.0, 1.0));
    let pbr = Pbr {
        base_color: if is_metal { surface.specular } else { surface.diffuse },
        metallic: ScalarInput::constant(if is_metal { 1.0 } else { 0.0 }),
        roughness,
        ior: ior_of_f0(f0),
        multiscatter: true,
    };
    (Surface::Pbr(pbr), told)
}

/// The index of refraction that reflects this share head on. Shares of 1 have none: it stops at 0.9.
fn ior_of_f0(f0: f32) -> f32 {
    let root = f0.clamp(0.0, 0.9).sqrt();
    (1.0 + root) / (1.0 - root)
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::world::{Clearcoat, ColorInput, Volume};

    fn plastic() -> Layered {
        Layered::new(Pbr {
            base_color: ColorInput::constant(Vec3::new(0.8, 0.5, 0.2)),
            metallic: ScalarInput::constant(0.0),
            roughness: ScalarInput::constant(0.4),
            ior: 1.4,
            multiscatter: true,
        })
    }

    #[test]
    fn each_layer_left_out_is_told() {
        let one = ScalarInput::constant(1.0);
        let coat = Clearcoat { factor: one, roughness: one, normal: None };
        let (surface, told) = nearest(&Layered { clearcoat: Some(coat), dispersion: 1.0, ..plastic() });
        assert_eq!((surface, told.len()), (Surface::Pbr(plastic().pbr), 2));
    }

    #[test]
    fn what_lets_light_through_stays_clear() {
        let clear = Volume { attenuation_color: Vec3::ONE, attenuation_distance: f32::INFINITY };
        let transmission = Some(ScalarInput::constant(1.0));
        for (volume, expected) in [(Some(clear), 1.4), (None, 1.0)] {
            let (surface, told) = nearest(&Layered { transmission, volume, ..plastic() });
            let Surface::Dielectric { ior, .. } = surface else { panic!("{surface:?}") };
            assert_eq!((ior, told.len()), (expected, 1));
        }
    }

    #[test]
    fn indices_come_back_from_their_reflectance() {
        for ior in [1.0, 1.33, 1.5, 2.4] {
            assert!((ior_of_f0(normal_reflectance(ior)) - ior).abs() < 1e-4);
        }
        assert!(ior_of_f0(1.0).is_finite());
    }
}
