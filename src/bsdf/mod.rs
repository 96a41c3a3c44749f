//! Scattering at a surface, in its local frame: the shading normal is +Z, `wo` and `wi` are unit vectors that
//! point away from the surface. Pure functions of uniform numbers: no textures, no random state, no scenes.
//!
//! Opaque lobes scatter on the side of +Z only; who calls turns the frame so that `wo.z > 0`. For dielectrics +Z
//! is the outward normal, and `wo.z < 0` means inside the medium.
//!
//! Light is transported as radiance along camera paths: refraction carries the factor (ηᵢ/ηₜ)² of basic radiance.

mod albedo;
mod anisotropic;
mod coat;
mod conductor;
mod dielectric;
mod diffuse;
mod facets;
pub mod fresnel;
mod fuzzy_mirror;
mod ggx;
mod glass;
mod glass_albedo;
mod layer_albedo;
mod layered;
mod mirror;
mod pbr;
mod rough_dielectric;
mod sheen;
mod specular;
mod table;
mod thin_film;

#[cfg(test)]
mod layered_tests;
#[cfg(test)]
mod tests;

use glam::{Vec2, Vec3};

pub use coat::Coat;
pub use conductor::Conductor;
pub use dielectric::Dielectric;
pub use diffuse::Diffuse;
pub use facets::{Facets, Reflectance};
pub use fuzzy_mirror::FuzzyMirror;
pub use glass::Glass;
pub use layered::{Base, Layered, Passage};
pub use mirror::Mirror;
pub use pbr::Pbr;
pub use rough_dielectric::RoughDielectric;
pub use sheen::Sheen;
pub use thin_film::ThinFilm;

/// What kind of scattering a sample is: bounce limits count by it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    Diffuse,
    Glossy,
    Transmission,
}

/// A direction drawn by a BSDF.
#[derive(Clone, Copy, Debug)]
pub struct BsdfSample {
    /// Towards where the light comes from; local frame, unit.
    pub wi: Vec3,
    /// BSDF × |cos θᵢ| / pdf.
    pub weight: Vec3,
    /// Solid-angle density, sr⁻¹, of `wi` over all lobes; for a delta lobe the probability of having chosen it.
    pub pdf: f32,
    /// Index of refraction on the side of `wi` over that on the side of `wo`; 1 for reflection. `weight × eta²`
    /// is the share of energy that goes on, by which Russian roulette should judge.
    pub eta: f32,
    /// `wi` has a delta distribution: no other strategy can find it.
    pub delta: bool,
    pub kind: Kind,
}

/// Of glossy lobes, at most: at 0.45 paths from lamps are worth but a fifth more than they cost in a room with two metal balls, at 0.1
/// five times as much.
const GLOSSY_ALPHA: f32 = 0.4;
/// A ball's samples lie as near the mirror direction as those of facets half as wide.
const GLOSSY_FUZZ: f32 = 0.8;

/// All that a surface can be.
#[derive(Clone, Debug)]
pub enum Bsdf {
    /// Absorbs all.
    Black,
    Diffuse(Diffuse),
    Mirror(Mirror),
    FuzzyMirror(FuzzyMirror),
    Conductor(Conductor),
    Dielectric(Dielectric),
    RoughDielectric(RoughDielectric),
    Pbr(Pbr),
    /// On the heap: few surfaces have layers, and to carry their size everywhere costs all scenes more (2 to 11 % of the instructions of a
    /// path, with layers too) than to allocate them.
    Layered(Box<Layered>),
}

impl Bsdf {
    /// Works out once what depends on `wo` alone, for all that is asked from that very direction after.
    pub fn prepare(&mut self, wo: Vec3) {
        match self {
            Self::Conductor(lobe) => lobe.prepare(wo),
            Self::RoughDielectric(lobe) => lobe.prepare(wo),
            Self::Pbr(lobe) => lobe.prepare(wo),
            Self::Layered(lobe) => lobe.prepare(wo),
            Self::Black | Self::Diffuse(_) | Self::Mirror(_) | Self::FuzzyMirror(_) | Self::Dielectric(_) => {
            }
        }
    }

    /// BSDF × |cos θᵢ| for light from `wi` leaving along `wo`, and the solid-angle density with which
    /// [`sample`](Self::sample) draws `wi`, both in sr⁻¹. Zero for delta lobes.
    pub fn eval_pdf(&self, wo: Vec3, wi: Vec3) -> (Vec3, f32) {
        match self {
            Self::Black | Self::Mirror(_) | Self::Dielectric(_) => (Vec3::ZERO, 0.0),
            Self::Diffuse(lobe) => (lobe.eval(wo, wi), lobe.pdf(wo, wi)),
            Self::FuzzyMirror(lobe) => lobe.eval_pdf(wo, wi),
            Self::Conductor(lobe) => lobe.eval_pdf(wo, wi),
            Self::RoughDielectric(lobe) => lobe.eval_pdf(wo, wi),
            Self::Pbr(lobe) => lobe.eval_pdf(wo, wi),
            Self::Layered(lobe) => lobe.eval_pdf(wo, wi),
        }
    }

    /// Draws `wi`, or `None` where the light is absorbed. `u` and `u_lobe` are uniform in [0, 1).
    pub fn sample(&self, wo: Vec3, u: Vec2, u_lobe: f32) -> Option<BsdfSample> {
        match self {
            Self::Black => None,
            Self::Diffuse(lobe) => lobe.sample(wo, u),
            Self::Mirror(lobe) => lobe.sample(wo),
            Self::FuzzyMirror(lobe) => lobe.sample(wo, u, u_lobe),
            Self::Conductor(lobe) => lobe.sample(wo, u),
            Self::Dielectric(lobe) => lobe.sample(wo, u_lobe),
            Self::RoughDielectric(lobe) => lobe.sample(wo, u, u_lobe),
            Self::Pbr(lobe) => lobe.sample(wo, u, u_lobe),
            Self::Layered(lobe) => lobe.sample(wo, u, u_lobe),
        }
    }

    /// Albedos of what is scattered widely and of a lobe about the mirror direction, and the lobe's α; `None` where that
    /// is not the outline of it.
    pub fn outline(&self, wo: Vec3) -> Option<([f32; 2], f32)> {
        match self {
            Self::Diffuse(_) => Some(([1.0, 0.0], 1.0)),
            Self::Conductor(lobe) => Some(([0.0, 1.0], lobe.alpha())),
            Self::Pbr(lobe) => Some(lobe.outline(wo)),
            _ => None,
        }
    }

    /// Scatters so widely that it may be taken for Lambert's surface where only a rough density is wanted.
    pub fn is_matte(&self) -> bool {
        match self {
            Self::Diffuse(_) => true,
            Self::Pbr(lobe) => lobe.is_matte(),
            _ => false,
        }
    }

    /// One lobe about the mirror direction, narrow but not a delta.
    pub fn is_glossy(&self) -> bool {
        match self {
            Self::FuzzyMirror(lobe) => lobe.fuzz() <= GLOSSY_FUZZ,
            Self::Conductor(lobe) => lobe.alpha() <= GLOSSY_ALPHA,
            Self::Pbr(lobe) => lobe.is_metal() && !lobe.is_matte(),
            _ => false,
        }
    }

    /// Only delta lobes (or none): next-event estimation is pointless.
    pub fn is_delta(&self) -> bool {
        matches!(self, Self::Black | Self::Mirror(_) | Self::Dielectric(_))
    }
}

/// `w` mirrored about +Z.
#[inline]
fn reflect(w: Vec3) -> Vec3 {
    Vec3::new(-w.x, -w.y, w.z)
}

/// `w` mirrored about the unit vector `h`.
#[inline]
fn reflect_about(w: Vec3, h: Vec3) -> Vec3 {
    2.0 * w.dot(h) * h - w
}
