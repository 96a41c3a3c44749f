//! A rough metal: GGX facets that reflect by Schlick's curve or a plain tint.
//!
//! ```text
//! f = F(wo·h) D(h) G₂(wo, wi) / (4 cos θₒ cos θᵢ) × boost(wo)
//! ```
//!
//! with [`ggx`](super::ggx) for D and G₂, and the energy compensation of [`specular`](super::specular) for the boost,
//! which costs the lobe its reciprocity (1 without it).
//!
//! | parameter | unit | range |
//! |---|---|---|
//! | `curve` | reflectance per channel by angle | 0 to 1 |
//! | `alpha` | roughness² | 0 to 1; below 1e-3 it is [`Mirror`] |
//! | `multiscatter` | whether light that bounces between facets is counted | |

use glam::{Vec2, Vec3};

use super::albedo::Albedo;
use super::fresnel::{SCHLICK_AVERAGE, SchlickCurve, schlick_weight};
use super::ggx::Ggx;
use super::specular::Specular;
use super::{Bsdf, BsdfSample, Kind, Mirror, reflect_about};

/// A lobe 2 mrad wide is a mirror to any picture, and cheaper as one.
const MIN_ALPHA: f32 = 1e-3;

#[derive(Clone, Copy, Debug)]
pub struct Conductor {
    ggx: Ggx,
    specular: Specular,
    /// The direction it was [prepared](Self::prepare) for, or zero, and the factor for multiple scattering there.
    seen: (Vec3, Vec3),
}

impl Conductor {
    /// A rough metal, or a mirror where `alpha` is next to nothing.
    pub fn bsdf(curve: SchlickCurve, alpha: f32, multiscatter: bool) -> Bsdf {
        if alpha < MIN_ALPHA {
            return Bsdf::Mirror(Mirror { curve });
        }
        let ggx = Ggx { alpha: alpha.min(1.0) };
        let specular = Specular::new(curve.f0, curve.f90, SCHLICK_AVERAGE, ggx.alpha, multiscatter);
        Bsdf::Conductor(Self { ggx, specular, seen: (Vec3::ZERO, Vec3::ONE) })
    }

    /// See [`Bsdf::prepare`].
    pub fn prepare(&mut self, wo: Vec3) {
        if wo.z > 0.0 {
            self.seen = (wo, self.boost(wo));
        }
    }

    pub fn alpha(&self) -> f32 {
        self.ggx.alpha
    }

    pub fn eval_pdf(&self, wo: Vec3, wi: Vec3) -> (Vec3, f32) {
        if wo.z <= 0.0 || wi.z <= 0.0 {
            return (Vec3::ZERO, 0.0);
        }
        let Some(h) = (wo + wi).try_normalize() else { return (Vec3::ZERO, 0.0) };
        let facets = self.ggx.d(h) * self.ggx.g2_over_4_cos_cos(wo, wi) * wi.z;
        (self.reflectance(wo, h) * facets, self.ggx.pdf_mirrored(wo, h))
    }

    /// Draws `wi`, or `None` where it falls below the surface.
    pub fn sample(&self, wo: Vec3, u: Vec2) -> Option<BsdfSample> {
        if wo.z <= 0.0 {
            return None;
        }
        let h = self.ggx.sample_normal(wo, u);
        let wi = reflect_about(wo, h);
        (wi.z > 0.0).then(|| BsdfSample {
            wi,
            weight: self.reflectance(wo, h) * self.ggx.g2_over_g1(wo, wi),
            pdf: self.ggx.pdf_mirrored(wo, h),
            eta: 1.0,
            delta: false,
            kind: Kind::Glossy,
        })
    }

    fn reflectance(&self, wo: Vec3, h: Vec3) -> Vec3 {
        let boost = if self.seen.0 == wo { self.seen.1 } else { self.boost(wo) };
        boost * self.specular.at(schlick_weight(wo.dot(h)))
    }

    fn boost(&self, wo: Vec3) -> Vec3 {
        if self.specular.is_single_scattering() {
            Vec3::ONE
        } else {
            self.specular.boost(Albedo::at(wo.z, self.ggx.alpha).white)
        }
    }
}
