//! Materials with layers, as Blender's Principled BSDF and what must be added to it.
//!
//! | layer | in Cycles |
//! |---|---|
//! | specular | Specular Tint; a factor below 1 as a mix with a surface that reflects nothing: both are linear in it |
//! | clearcoat | Coat |
//! | sheen | Sheen: another model, above the coat |
//! | iridescence | Thin Film; a factor below 1 as a mix |
//! | anisotropy | αx = roughness²/aspect and αy = roughness² aspect with aspect² = 1 − 0.9 a, solved for ours |
//! | transmission, solid | Transmission of the colour's square, of which Principled takes the root; absorption as a volume |
//! | transmission, thin | added: Refraction of index 1, times what is above lets through |
//! | diffuse transmission | added: Translucent, likewise |
//!
//! What is above lets 1 − E of light along the view through, with E the directional albedo; Principled does so for its own
//! diffuse part and has no socket for others, so the scene brings 1 − E as a curve over √cos θ.

use glam::{Vec2, Vec3};

use crate::{
    bsdf::{
        Coat, Facets, Reflectance, Sheen, ThinFilm,
        fresnel::{LayerCurve, normal_reflectance},
    },
    world::{Layered, Material, ScalarInput, Surface, Volume},
};

/// Points of a curve.
const POINTS: usize = 33;
/// The least αy/αx that Principled has.
const LEAST_RATIO: f32 = 0.1;
/// A wall rougher than this visibly blurs.
const SMOOTH: f32 = 0.03;

/// A boundary rougher than this shows how Cycles weighs the light it draws.
pub const ROUGH: f32 = 0.2;
/// With a sky that is not even, roughness 1, index 1.5: 0.641 where the furnace and superposition demand 0.542, which Cycles
/// finds if it draws no light from the sky. Single scattering likewise: 0.227 and 0.195.
pub const ROUGH_GLASS: &str = "light that Cycles draws from lamps and sky comes too bright through rough glass, though not \
     what rays find by themselves: a ball by 2 % at roughness 0.4, by 18 % at 1";

/// Values at √cos θ = 0 … 1, evenly.
pub type Curve = Vec<f32>;

/// The layers of a material, if it has any.
pub fn of(material: &Material) -> Option<&Layered> {
    match &material.surface {
        Surface::Layered(layered) => Some(layered),
        _ => None,
    }
}

/// Whether light can be below the surface: Cycles must then find its back, too.
pub fn lets_through(material: &Material) -> bool {
    match &material.surface {
        Surface::Dielectric { .. } => true,
        Surface::Layered(layered) => layered.transmission.is_some() || layered.diffuse_transmission.is_some(),
        _ => false,
    }
}

/// Whether it bounds a medium that is denser than air, or thinner.
pub fn refracts(material: &Material) -> bool {
    match &material.surface {
        Surface::Dielectric { .. } => true,
        Surface::Layered(layered) => layered.volume.is_some() && layered.transmission.is_some(),
        _ => false,
    }
}

/// Absorption per metre, as the colour and the density of Cycles' node: density (1 − colour).
pub fn absorption(volume: &Volume) -> Option<([f32; 3], f32)> {
    let sigma = volume.absorption();
    let density = sigma.max_element();
    (density > 0.0).then(|| ((1.0 - sigma / density).into(), density))
}

/// What coat and sheen let through: of the glow of what is below.
pub fn glow(layered: &Layered) -> Option<Curve> {
    (layered.clearcoat.is_some() || layered.sheen.is_some()).then(|| curve(|cos| above(layered, cos)))
}

/// What all layers let through to what scatters to the far side.
pub fn passed(layered: &Layered) -> Option<Curve> {
    let thin = layered.transmission.is_some() && layered.volume.is_none();
    if !thin && layered.diffuse_transmission.is_none() {
        return None;
    }
    let alpha = layered.pbr.roughness.factor.clamp(0.0, 1.0).powi(2);
    let stretch = layered.anisotropy.map_or(0.0, |a| a.strength * a.strength);
    let facets = Facets::new(Vec2::new(alpha + (1.0 - alpha) * stretch, alpha), layered.pbr.multiscatter);
    let exact = LayerCurve::dielectric(layered.pbr.ior);
    let lit = match &layered.specular {
        Some(specular) => {
            let factor = specular.factor.factor.clamp(0.0, 1.0);
            let f0 = (exact.f0 * specular.color.factor).min(Vec3::ONE) * factor;
            LayerCurve { f0, f90: Vec3::splat(factor), ..exact }
        }
        None => exact,
    };
    let film = layered.iridescence.and_then(|film| {
        ThinFilm::new(film.factor.factor.clamp(0.0, 1.0), film.ior, film.thickness[1], lit.f0)
    });
    let reflectance = facets.prepare(Reflectance::dielectric(lit, film));
    Some(curve(|cos| {
        let across = (1.0 - cos * cos).max(0.0).sqrt() * std::f32::consts::FRAC_1_SQRT_2;
        let (_, [weighed, _]) = facets.weigh(Vec3::new(across, across, cos), [Some(&reflectance), None]);
        above(layered, cos) * (1.0 - weighed.albedo.max_element()).max(0.0)
    }))
}

fn above(layered: &Layered, cos: f32) -> f32 {
    let square = |input: &ScalarInput| input.factor.clamp(0.0, 1.0).powi(2);
    let coat = layered
        .clearcoat
        .as_ref()
        .and_then(|coat| Coat::new(coat.factor.factor.clamp(0.0, 1.0), square(&coat.roughness)));
    let sheen = layered.sheen.as_ref().and_then(|sheen| {
        Sheen::new(sheen.color.factor.clamp(Vec3::ZERO, Vec3::ONE), square(&sheen.roughness))
    });
    let coat = coat.map_or(1.0, |coat| 1.0 - coat.weight * coat.weigh(cos).1);
    (coat * sheen.map_or(1.0, |sheen| sheen.passed(cos))).max(0.0)
}

fn curve(f: impl Fn(f32) -> f32) -> Curve {
    (0..POINTS).map(|i| f((i as f32 / (POINTS - 1) as f32).powi(2).max(1e-4))).collect()
}

/// The greatest tint of the specular reflection: beyond, more than all is reflected head on.
pub fn most_tint(ior: f32) -> f32 {
    1.0 / normal_reflectance(ior).max(1e-6)
}

/// What Cycles does otherwise.
pub fn differences(layered: &Layered) -> Vec<&'static str> {
    let textured = |input: &ScalarInput| input.texture.is_some();
    let pbr = &layered.pbr;
    let mut told = Vec::new();
    let mut tell = |is: bool, text: &'static str| told.extend(is.then_some(text));
    tell(
        layered.sheen.is_some(),
        "sheen is that of Zeltner et al. 2022, softer and fainter than Charlie's fibres of the same roughness",
    );
    tell(layered.sheen.is_some() && layered.clearcoat.is_some(), "sheen lies above the clearcoat");
    tell(layered.dispersion > 0.0, "all colours refract alike: the dispersion is left out");
    tell(
        layered.iridescence.is_some(),
        "the thin film's colours are Cycles' sums over the spectrum, here over fitted curves: within 0.015 of reflectance",
    );
    if let Some(anisotropy) = &layered.anisotropy {
        let varies = anisotropy.texture.is_some() || textured(&pbr.roughness);
        let alpha = pbr.roughness.factor.clamp(0.0, 1.0).powi(2).max(1e-4);
        let ratio = alpha / (alpha + (1.0 - alpha) * anisotropy.strength.powi(2));
        tell(
            pbr.multiscatter && anisotropy.strength > 0.0,
            "between stretched facets not all light that is scattered on is given back (of white metal 98 % comes back at \
             roughness 0.3 and strength 0.4, 92 % at 0.5 and 0.7; here all)",
        );
        tell(
            varies || ratio < LEAST_RATIO,
            "highlights are at most √10 times as long, in roughness, as they are wide: beyond, αx/αy is 10 with αx αy as here",
        );
    }
    let passes = layered.transmission.is_some_and(|share| share.factor > 0.0);
    let thin = passes && layered.volume.is_none();
    tell(
        thin && (textured(&pbr.roughness) || pbr.roughness.factor > SMOOTH),
        "the wall without thickness does not blur what is behind it",
    );
    let solid = passes && layered.volume.is_some();
    let rough = textured(&pbr.roughness) || pbr.roughness.factor > ROUGH;
    tell(solid && rough, ROUGH_GLASS);
    let colored = pbr.base_color.texture.is_some() || pbr.base_color.factor != Vec3::ONE;
    tell(
        solid && rough && colored && pbr.multiscatter,
        "light that is scattered between the facets of the boundary is tinted once more (of 0.6, 3 % at roughness 0.4)",
    );
    let specular = layered.specular.is_some_and(|s| textured(&s.factor) || s.factor.factor < 1.0);
    tell(
        solid && specular,
        "the boundary of the solid reflects fully at grazing angles, whatever the specular factor",
    );
    let scattered = layered.diffuse_transmission.is_some_and(|d| d.factor.factor > 0.0);
    let coat = layered.clearcoat.is_some_and(|c| textured(&c.factor) || textured(&c.roughness));
    tell(
        (thin || scattered) && (coat || textured(&pbr.roughness)),
        "what the reflection leaves to light that passes is that of the factors, without their textures",
    );
    told
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::world::{Clearcoat, ColorInput, Pbr};

    fn wall(roughness: f32) -> Layered {
        let pbr = Pbr {
            base_color: ColorInput::constant(Vec3::ONE),
            metallic: ScalarInput::constant(0.0),
            roughness: ScalarInput::constant(roughness),
            ior: 1.5,
            multiscatter: true,
        };
        Layered { transmission: Some(ScalarInput::constant(1.0)), ..Layered::new(pbr) }
    }

    #[test]
    fn a_smooth_wall_passes_what_fresnel_leaves() {
        let passed = passed(&wall(0.0)).expect("passes");
        assert!((passed[POINTS - 1] - 0.96).abs() < 1e-3, "{passed:?}");
        // 60°: √0.5 of 32 steps is 22.6
        assert!((0.5 * (passed[22] + passed[23]) - 0.911).abs() < 3e-3, "{passed:?}");
        assert!(passed[1..].is_sorted_by(|a, b| *a <= b + 1e-3), "{passed:?}");
    }

    #[test]
    fn a_coat_takes_from_what_is_below() {
        let one = ScalarInput::constant(1.0);
        let coat = Clearcoat { factor: one, roughness: ScalarInput::constant(0.0), normal: None };
        let coated = Layered { clearcoat: Some(coat), ..wall(0.0) };
        assert!((passed(&coated).expect("passes")[POINTS - 1] - 0.96 * 0.96).abs() < 1e-3);
        assert!((glow(&coated).expect("is coated")[POINTS - 1] - 0.96).abs() < 1e-3);
        assert_eq!(glow(&wall(0.0)), None);
    }

    #[test]
    fn absorption_comes_back_from_colour_and_density() {
        let volume = Volume { attenuation_color: Vec3::new(0.2, 0.8, 1.0), attenuation_distance: 0.5 };
        let (color, density) = absorption(&volume).expect("absorbs");
        let left = (-density * (1.0 - Vec3::from(color)) * 0.5).exp();
        assert!(left.abs_diff_eq(volume.attenuation_color, 1e-6), "{left}");
        assert_eq!(absorption(&Volume { attenuation_color: Vec3::ONE, ..volume }), None);
        assert_eq!(absorption(&Volume { attenuation_distance: f32::INFINITY, ..volume }), None);
    }
}
