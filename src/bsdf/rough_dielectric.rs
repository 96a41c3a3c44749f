//! A rough boundary between the outside, of index 1, and a medium: frosted glass.
//!
//! GGX facets that each reflect and refract (Walter et al. 2007; PBRT, 4th ed., 9.7). With η = ηₜ/ηᵢ and h the
//! facet's normal on the side of wo:
//!
//! ```text
//! reflection:    h ∥ wo + wi      f = tint F D G₂ / (4 |cos θₒ cos θᵢ|)
//! transmission:  h ∥ wo + η wi    f = tint (1 − F) D G₂ |wi·h wo·h| / (|cos θₒ cos θᵢ| (wi·h + wo·h/η)²) / η²
//! ```
//!
//! The last 1/η² is that of radiance. One bounce loses up to half of the energy; f is divided by the tabulated share
//! that is left of light along wo, [`glass_albedo`](super::glass_albedo), so that reflection and transmission add
//! up to the tint. Uncompensated the lobe is reciprocal: f(wi, wo) = η² f(wo, wi).
//!
//! | parameter | unit | range |
//! |---|---|---|
//! | `ior` | index of the inside over that of the outside | > 0 |
//! | `alpha` | roughness² | 0 to 1; below 1e-3 it is [`Dielectric`] |
//! | `tint` | factor of both reflection and refraction | 0 to 1 per channel |
//! | `multiscatter` | whether light that bounces between facets is counted | |

use glam::{Vec2, Vec3};

use super::dielectric::relative_eta;
use super::fresnel::refract;
use super::ggx::Ggx;
use super::glass_albedo::glass_albedo;
use super::{Bsdf, BsdfSample, Dielectric, Kind, reflect_about};

/// Narrower lobes are deltas.
pub const MIN_ALPHA: f32 = 1e-3;
/// Facets turn refracted light by about α|η − 1|; where that is less, the lobe is as sharp as a delta.
const MIN_SPREAD: f32 = 1e-4;

/// Whether a boundary of relative index `eta` is as good as smooth.
pub fn is_smooth(alpha: f32, eta: f32) -> bool {
    alpha < MIN_ALPHA || alpha * (eta - 1.0).abs() < MIN_SPREAD
}

#[derive(Clone, Copy, Debug)]
pub struct RoughDielectric {
    ggx: Ggx,
    boundary: Dielectric,
    multiscatter: bool,
    /// The direction it was [prepared](Self::prepare) for, or zero, and the factor for multiple scattering there.
    seen: (Vec3, f32),
}

impl RoughDielectric {
    /// A rough boundary, or a smooth one where `alpha` is next to nothing or `ior` next to 1.
    pub fn bsdf(boundary: Dielectric, alpha: f32, multiscatter: bool) -> Bsdf {
        if is_smooth(alpha, boundary.ior) {
            return Bsdf::Dielectric(boundary);
        }
        let (ggx, seen) = (Ggx { alpha: alpha.min(1.0) }, (Vec3::ZERO, 1.0));
        Bsdf::RoughDielectric(Self { ggx, boundary, multiscatter, seen })
    }

    /// See [`Bsdf::prepare`].
    pub fn prepare(&mut self, wo: Vec3) {
        if wo.z != 0.0 {
            self.seen = (wo, self.boost(wo));
        }
    }

    pub fn eval_pdf(&self, wo: Vec3, wi: Vec3) -> (Vec3, f32) {
        let nothing = (Vec3::ZERO, 0.0);
        let (from, eta) = (wo, relative_eta(self.boundary.ior, wo));
        let (wo, wi) = (to_side_of(wo, wo), to_side_of(wo, wi));
        if wo.z == 0.0 || wi.z == 0.0 {
            return nothing;
        }
        let reflected = wi.z > 0.0;
        let Some(h) = (wo + if reflected { wi } else { eta * wi }).try_normalize() else { return nothing };
        let h = h * h.z.signum();
        let (wo_h, wi_h) = (wo.dot(h), wi.dot(h));
        if wo_h <= 0.0 || (wi_h > 0.0) != reflected {
            return nothing;
        }
        let (reflectance, _) = self.boundary.fresnel.reflectance(wo_h, eta);
        let masked = self.ggx.g2_over_4_cos_cos(wo, wi) * wi.z.abs();
        let (f, pdf) = if reflected {
            (reflectance * self.ggx.d(h) * masked, reflectance * self.ggx.pdf_mirrored(wo, h))
        } else {
            let t = wi_h + wo_h / eta;
            let jacobian = wi_h.abs() / (t * t); // dω(h) / dω(wi)
            let transmitted = (1.0 - reflectance) * jacobian;
            (
                transmitted * self.ggx.d(h) * 4.0 * masked * wo_h / (eta * eta),
                transmitted * self.ggx.pdf_normal(wo, h),
            )
        };
        (self.boundary.tint * (f * self.boost(from)), pdf)
    }

    /// Draws `wi`, or `None` where a reflected ray falls below the surface or a refracted one above it.
    pub fn sample(&self, wo: Vec3, u: Vec2, u_lobe: f32) -> Option<BsdfSample> {
        let (from, eta) = (wo, relative_eta(self.boundary.ior, wo));
        let side = wo.z.signum();
        let wo = to_side_of(wo, wo);
        if wo.z == 0.0 {
            return None;
        }
        let h = self.ggx.sample_normal(wo, u);
        let wo_h = wo.dot(h);
        let (reflectance, cos_t) = self.boundary.fresnel.reflectance(wo_h, eta);
        let (wi, pdf, eta_ratio, kind) = if u_lobe < reflectance {
            (reflect_about(wo, h), reflectance * self.ggx.pdf_mirrored(wo, h), 1.0, Kind::Glossy)
        } else {
            let wi = refract(wo, h, wo_h, cos_t, eta);
            let t = wo_h / eta - cos_t;
            let pdf = (1.0 - reflectance) * self.ggx.pdf_normal(wo, h) * cos_t / (t * t);
            (wi, pdf, eta, Kind::Transmission)
        };
        let valid = pdf > 0.0 && if kind == Kind::Glossy { wi.z > 0.0 } else { wi.z < 0.0 };
        valid.then(|| {
            let scale = self.ggx.g2_over_g1(wo, wi) * self.boost(from) / (eta_ratio * eta_ratio);
            BsdfSample {
                wi: Vec3::new(wi.x, wi.y, side * wi.z),
                weight: self.boundary.tint * scale,
                pdf,
                eta: eta_ratio,
                delta: false,
                kind,
            }
        })
    }

    fn boost(&self, wo: Vec3) -> f32 {
        if self.seen.0 == wo {
            return self.seen.1;
        }
        if self.multiscatter {
            let Dielectric { ior, fresnel, .. } = self.boundary;
            1.0 / glass_albedo(fresnel, wo.z.abs(), self.ggx.alpha, relative_eta(ior, wo))
        } else {
            1.0
        }
    }
}

/// `w`, turned over with the surface if `wo` is below it.
fn to_side_of(wo: Vec3, w: Vec3) -> Vec3 {
    if wo.z < 0.0 { Vec3::new(w.x, w.y, -w.z) } else { w }
}
