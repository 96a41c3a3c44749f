//! What facets of a rough surface reflect, with the light that bounces between them given back.
//!
//! GGX with Smith's G₂ counts one bounce and loses the rest: more than half at roughness 1. Turquin (2019,
//! *Practical multiple scattering compensation for microfacet models*) scales the lobe so that it is complete:
//!
//! ```text
//! boost(wo) = 1 + F_ms (1 − E(μ)) / E(μ),   F_ms = F_avg E_avg / (1 − F_avg (1 − E_avg))
//! ```
//!
//! with F_ms the reflectance of the further bounces (Kulla and Conty 2017, with one F_avg less, since the lobe
//! brings its own first bounce) and E, E_avg from the tables of [`albedo`](super::albedo). All is linear in the weight
//! w of F = f₀ + (f₉₀ − f₀) w, of which this need not know the curve.

use glam::Vec3;

use super::albedo::Albedo;

#[derive(Clone, Copy, Debug)]
pub struct Specular {
    f0: Vec3,
    f90: Vec3,
    /// F_ms; zero where multiple scattering is left out.
    multiple: Vec3,
}

impl Specular {
    /// `average` is that of the weight, over the hemisphere by the cosine.
    pub fn new(f0: Vec3, f90: Vec3, average: f32, alpha: f32, multiscatter: bool) -> Self {
        let mut specular = Self { f0, f90, multiple: Vec3::ZERO };
        if multiscatter {
            let (average, e) = (specular.at(average).min(Vec3::ONE), Albedo::average(alpha));
            specular.multiple = average * e / (Vec3::ONE - average * (1.0 - e));
        }
        specular
    }

    /// F at an angle of this weight.
    pub fn at(&self, weight: f32) -> Vec3 {
        self.f0 + (self.f90 - self.f0) * weight
    }

    pub fn is_single_scattering(&self) -> bool {
        self.multiple == Vec3::ZERO
    }

    pub fn boost(&self, white: f32) -> Vec3 {
        Vec3::ONE + self.multiple * ((1.0 - white) / white)
    }

    /// Directional albedo after one bounce; × [`boost`](Self::boost) it is that of the whole.
    pub fn single(&self, albedo: Albedo) -> Vec3 {
        self.f0 * albedo.white + (self.f90 - self.f0) * albedo.grazing
    }
}
