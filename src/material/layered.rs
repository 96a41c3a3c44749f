//! glTF's layers at a point: textures looked up, shares resolved. Layers of no weight are left out, so that a material which
//! names an extension but does not use it here costs what the plain one does.

use glam::{Vec2, Vec3};

use super::{Side, SurfacePoint, alpha, mapped_normal, pair, shading_frame};
use crate::{
    bsdf::{
        Base, Bsdf, Coat, Facets, Glass, Layered, Passage, Pbr, Reflectance, Sheen, ThinFilm,
        fresnel::LayerCurve,
    },
    geometry::Frame,
    texture::Textures,
    world::{self, ColorInput, NormalMap, ScalarInput},
};

/// Where a material is looked up.
pub struct Place<'a> {
    pub textures: &'a Textures,
    pub point: &'a SurfacePoint,
    /// Vertex colour, if it counts.
    pub tint: Vec3,
    pub wo: Vec3,
    /// In nm.
    pub wavelength: Option<f32>,
}

impl Place<'_> {
    fn color(&self, input: &ColorInput) -> Vec3 {
        input.at(self.textures, &self.point.uvs).clamp(Vec3::ZERO, Vec3::ONE)
    }

    fn unit(&self, input: &ScalarInput) -> f32 {
        input.at(self.textures, &self.point.uvs).clamp(0.0, 1.0)
    }

    fn optional(&self, input: Option<&ScalarInput>) -> f32 {
        input.map_or(0.0, |input| self.unit(input))
    }
}

pub fn scattering(material: &world::Layered, normal: Option<&NormalMap>, place: &Place) -> (Bsdf, Frame) {
    let Place { point, wo, .. } = *place;
    let pbr = &material.pbr;
    let base_color =
        place.color(&ColorInput { factor: pbr.base_color.factor * place.tint, ..pbr.base_color });
    let [metallic, roughness] = pair([&pbr.metallic, &pbr.roughness], place.textures, &point.uvs);
    let roughness = alpha(roughness);
    let ior = index_at(material, place.wavelength);
    let curve = specular(material, ior, place);
    // Inside a medium what lies on the outside is not met.
    let inside = wo.dot(point.ng) < 0.0 && material.medium().is_some();
    let coat = material
        .clearcoat
        .as_ref()
        .filter(|_| !inside)
        .and_then(|coat| Coat::new(place.unit(&coat.factor), alpha(place.unit(&coat.roughness))));
    let sheen = material
        .sheen
        .as_ref()
        .filter(|_| !inside)
        .and_then(|sheen| Sheen::new(place.color(&sheen.color), alpha(place.unit(&sheen.roughness))));
    let transmission = place.optional(material.transmission.as_ref());
    let backlit = place.optional(material.diffuse_transmission.as_ref().map(|d| &d.factor));
    let film = film(material, place);
    let (strength, direction) = anisotropy(material, place);

    let map = normal.map(|map| mapped_normal(map, place.textures, point));
    let plain = coat.is_none() && sheen.is_none() && transmission == 0.0 && backlit == 0.0;
    if plain && film.is_none() && strength == 0.0 {
        let (frame, matte) = shading_frame(point, map, wo, Side::Glossy);
        return (Pbr::bsdf(base_color, metallic, roughness, curve, pbr.multiscatter, matte), frame);
    }

    let alpha = Vec2::new(roughness + (1.0 - roughness) * strength * strength, roughness);
    let facets = Facets::new(alpha, pbr.multiscatter);
    let film = |f0: Vec3| film.and_then(|(weight, ior, nm)| ThinFilm::new(weight, ior, nm, f0));
    let dielectric = facets.prepare(Reflectance::dielectric(curve, film(curve.f0)));
    let passage = match &material.volume {
        _ if transmission == 0.0 => Passage::Opaque,
        None => Passage::Wall { share: transmission, tint: base_color },
        Some(_) => {
            let eta = if inside { 1.0 / ior } else { ior };
            let glass = Glass::new(alpha, pbr.multiscatter, dielectric, eta, base_color);
            Passage::Boundary { share: transmission, glass }
        }
    };
    let backlit_color = match &material.diffuse_transmission {
        Some(diffuse) if backlit > 0.0 => backlit * place.color(&diffuse.color),
        _ => Vec3::ZERO,
    };
    let coat_map = material.clearcoat.as_ref().and_then(|coat| coat.normal.as_ref());
    let coat_map = coat_map.map(|map| mapped_normal(map, place.textures, point));
    let apart = coat.is_some() && (map.is_some() || coat_map.is_some());

    let (base_frame, matte) = shading_frame(point, map, wo, Side::Glossy);
    let (base_frame, matte) = match strength > 0.0 {
        true => along(point, base_frame, matte, direction),
        false => (base_frame, matte),
    };
    let outer = if apart { shading_frame(point, None, wo, Side::Glossy).0 } else { base_frame };
    let within = |frame: Frame| Frame {
        x: outer.to_local(frame.x),
        y: outer.to_local(frame.y),
        z: outer.to_local(frame.z),
    };
    let coat_frame = coat_map.map(|map| within(shading_frame(point, Some(map), wo, Side::Glossy).0));
    let metal = match metallic > 0.0 {
        true => facets.prepare(Reflectance::metal(base_color, film(base_color))),
        false => Reflectance::metal(base_color, None),
    };
    let layered = Layered {
        base: Base {
            facets,
            metallic,
            metal,
            dielectric,
            diffuse: (1.0 - backlit) * base_color,
            backlit: backlit_color,
            passage,
            matte,
        },
        sheen,
        coat,
        base_frame: apart.then(|| within(base_frame)),
        coat_frame,
        seen: None,
    };
    (Bsdf::Layered(Box::new(layered)), outer)
}

/// See [`super::emission_passed`].
pub fn emission_passed(material: &world::Layered, textures: &Textures, uvs: &[Vec2; 2], cos: f32) -> f32 {
    let unit = |input: &ScalarInput| input.at(textures, uvs).clamp(0.0, 1.0);
    let cos = cos.abs().clamp(1e-3, 1.0);
    let mut passed = 1.0;
    if let Some(coat) = &material.clearcoat
        && let Some(coat) = Coat::new(unit(&coat.factor), alpha(unit(&coat.roughness)))
    {
        passed *= 1.0 - coat.weight * coat.weigh(cos).1;
    }
    if let Some(sheen) = &material.sheen {
        let color = sheen.color.at(textures, uvs).clamp(Vec3::ZERO, Vec3::ONE);
        if let Some(sheen) = Sheen::new(color, alpha(unit(&sheen.roughness))) {
            passed *= sheen.passed(cos);
        }
    }
    passed.max(0.0)
}

/// KHR_materials_specular: f₀ = min(F₀ color, 1) factor and f₉₀ = factor.
fn specular(material: &world::Layered, ior: f32, place: &Place) -> LayerCurve {
    let exact = LayerCurve::dielectric(ior);
    let Some(specular) = &material.specular else { return exact };
    let factor = place.unit(&specular.factor);
    let color = specular.color.at(place.textures, &place.point.uvs).max(Vec3::ZERO);
    LayerCurve { f0: (exact.f0 * color).min(Vec3::ONE) * factor, f90: Vec3::splat(factor), rise: exact.rise }
}

/// KHR_materials_dispersion: Cauchy's formula of two terms through the index at 587.6 nm and the Abbe number.
fn index_at(material: &world::Layered, wavelength: Option<f32>) -> f32 {
    let ior = material.pbr.ior;
    match wavelength {
        Some(nm) if material.dispersion > 0.0 => {
            let bend = 523_655.0 / (nm * nm) - 1.5168;
            (ior + (ior - 1.0) * material.dispersion / 20.0 * bend).max(1.0)
        }
        _ => ior,
    }
}

/// Weight, index and thickness in nm of the film, if there is one.
fn film(material: &world::Layered, place: &Place) -> Option<(f32, f32, f32)> {
    let film = material.iridescence.as_ref()?;
    let weight = place.unit(&film.factor);
    if weight == 0.0 {
        return None;
    }
    let [thin, thick] = film.thickness;
    let nm = match &film.thickness_texture {
        None => thick,
        Some((texture, channel)) => {
            let t = place.textures.lookup(texture, &place.point.uvs)[usize::from(channel & 3)];
            thin + t * (thick - thin)
        }
    };
    (nm > 0.0).then_some((weight, film.ior, nm))
}

/// Strength, and direction in the plane of tangent and bitangent.
fn anisotropy(material: &world::Layered, place: &Place) -> (f32, Vec2) {
    let Some(anisotropy) = &material.anisotropy else { return (0.0, Vec2::X) };
    let turn = Vec2::from_angle(anisotropy.rotation);
    match &anisotropy.texture {
        None => (anisotropy.strength, turn),
        Some(texture) => {
            let texel = place.textures.lookup(texture, &place.point.uvs);
            let direction = (2.0 * Vec2::new(texel.x, texel.y) - 1.0).normalize_or(Vec2::X);
            ((anisotropy.strength * texel.z).clamp(0.0, 1.0), turn.rotate(direction))
        }
    }
}

/// `frame` turned about its normal until x lies along `direction`, and `matte` in it.
fn along(point: &SurfacePoint, frame: Frame, matte: Vec3, direction: Vec2) -> (Frame, Vec3) {
    let tangent = point.tangent.truncate();
    let bitangent = point.tangent.w * point.ns.cross(tangent);
    let x = direction.x * tangent + direction.y * bitangent;
    let Some(x) = (x - frame.z * x.dot(frame.z)).try_normalize() else { return (frame, matte) };
    let turned = Frame { x, y: frame.z.cross(x), z: frame.z };
    let matte = if matte == Vec3::Z { matte } else { turned.to_local(frame.to_world(matte)) };
    (turned, matte)
}

#[cfg(test)]
mod tests {
    use glam::Vec4;

    use super::*;
    use crate::world::{Anisotropy, Clearcoat, Layered as Layers, Volume};

    fn plain() -> Layers {
        Layers::new(world::Pbr {
            base_color: ColorInput::constant(Vec3::new(0.8, 0.5, 0.2)),
            metallic: ScalarInput::constant(0.3),
            roughness: ScalarInput::constant(0.4),
            ior: 1.5,
            multiscatter: true,
        })
    }

    fn at(material: &Layers, wo: Vec3, wavelength: Option<f32>) -> (Bsdf, Frame) {
        let textures = Textures::new(Vec::new(), Vec::new());
        let point = SurfacePoint {
            position: Vec3::ZERO,
            error: Vec3::ZERO,
            ng: Vec3::Z,
            ns: Vec3::Z,
            tangent: Vec4::new(0.0, 1.0, 0.0, 1.0),
            uvs: [Vec2::ZERO; 2],
            color: Vec4::ONE,
        };
        let place = Place { textures: &textures, point: &point, tint: Vec3::ONE, wo, wavelength };
        scattering(material, None, &place)
    }

    /// Layers whose factor comes to zero here leave the plain material, to the bit.
    #[test]
    fn layers_of_no_weight_are_not_there() {
        let zero = ScalarInput::constant(0.0);
        let coat = Clearcoat { factor: zero, roughness: ScalarInput::constant(0.5), normal: None };
        let sheen = world::Sheen { color: ColorInput::constant(Vec3::ZERO), roughness: zero };
        let with = Layers { clearcoat: Some(coat), sheen: Some(sheen), transmission: Some(zero), ..plain() };
        let wo = Vec3::new(0.6, 0.0, 0.8);
        let ((with, _), (without, frame)) = (at(&with, wo, None), at(&plain(), wo, None));
        assert!(matches!(with, Bsdf::Pbr(_)));
        let wi = Vec3::new(-0.3, 0.4, 0.75).normalize();
        let (a, b) = (frame.to_local(wo), frame.to_local(wi));
        assert_eq!(with.eval_pdf(a, b), without.eval_pdf(a, b));
    }

    /// The highlight spreads along the tangent, turned counter-clockwise by the rotation.
    #[test]
    fn facets_lean_along_the_turned_tangent() {
        let quarter = std::f32::consts::FRAC_PI_2;
        for (rotation, along) in [(0.0, Vec3::Y), (quarter, Vec3::NEG_X)] {
            let anisotropy = Some(Anisotropy { strength: 0.5, rotation, texture: None });
            let (bsdf, frame) = at(&Layers { anisotropy, ..plain() }, Vec3::Z, None);
            let Bsdf::Layered(layered) = bsdf else { panic!("layers") };
            assert!(frame.x.abs_diff_eq(along, 1e-6), "{}", frame.x);
            let alpha = layered.base.facets.ggx.alpha;
            assert!(alpha.abs_diff_eq(Vec2::new(0.16 + 0.84 * 0.25, 0.16), 1e-6), "{alpha}");
        }
    }

    /// The index at the lines C, d and F of Fraunhofer, of which the Abbe number is made.
    #[test]
    fn dispersion_has_its_abbe_number() {
        let glass = Layers {
            dispersion: 20.0 / 30.0,
            volume: Some(Volume { attenuation_color: Vec3::ONE, attenuation_distance: f32::INFINITY }),
            transmission: Some(ScalarInput::constant(1.0)),
            ..plain()
        };
        let n = |nm: f32| index_at(&glass, Some(nm));
        assert!((n(587.6) - 1.5).abs() < 1e-4);
        let abbe = (n(587.6) - 1.0) / (n(486.1) - n(656.3));
        assert!((abbe - 30.0).abs() < 0.05, "{abbe}");
        assert_eq!(index_at(&glass, None), 1.5);
    }

    /// From inside a medium the boundary turns over: the index is inverted, and the coat is not met.
    #[test]
    fn boundaries_are_turned_over_inside() {
        let one = ScalarInput::constant(1.0);
        let glass = Layers {
            clearcoat: Some(Clearcoat { factor: one, roughness: one, normal: None }),
            volume: Some(Volume { attenuation_color: Vec3::ONE, attenuation_distance: f32::INFINITY }),
            transmission: Some(one),
            ..plain()
        };
        for (wo, coated) in [(Vec3::Z, true), (Vec3::NEG_Z, false)] {
            let (bsdf, frame) = at(&glass, wo, None);
            let Bsdf::Layered(layered) = bsdf else { panic!("layers") };
            assert_eq!((layered.coat.is_some(), frame.z), (coated, wo));
        }
    }
}
