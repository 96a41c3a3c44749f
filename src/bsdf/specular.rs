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
//! brings its own first bounce) and E, E_avg from the tables of [`albedo`](super::albedo).

use glam::Vec3;

use super::albedo::Albedo;
use super::fresnel::SchlickCurve;

#[derive(Clone, Copy, Debug)]
pub struct Specular {
    pub curve: SchlickCurve,
    /// F_ms; zero where multiple scattering is left out.
    multiple: Vec3,
}

impl Specular {
    pub fn new(curve: SchlickCurve, alpha: f32, multiscatter: bool) -> Self {
        let multiple = if multiscatter {
            let (average, e) = (curve.average().min(Vec3::ONE), Albedo::average(alpha));
            average * e / (Vec3::ONE - average * (1.0 - e))
        } else {
            Vec3::ZERO
        };
        Self { curve, multiple }
    }

    pub fn is_single_scattering(&self) -> bool {
        self.multiple == Vec3::ZERO
    }

    pub fn boost(&self, albedo: Albedo) -> Vec3 {
        Vec3::ONE + self.multiple * ((1.0 - albedo.white) / albedo.white)
    }

    /// Directional albedo after one bounce; × [`boost`](Self::boost) it is that of the whole.
    pub fn single(&self, albedo: Albedo) -> Vec3 {
        self.curve.f0 * albedo.white + (self.curve.f90 - self.curve.f0) * albedo.grazing
    }
}
