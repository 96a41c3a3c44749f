//! The boundary of a medium under a layered material: as [`RoughDielectric`](super::RoughDielectric), but its curve may be
//! tinted or iridescent, its facets stretched, and only what is refracted takes the colour of the material.
//!
//! `wo` is always above: the boundary is turned to it, and `eta` says which side is which.
//!
//! | parameter | unit | range |
//! |---|---|---|
//! | `eta` | index below over that above | > 0 |
//! | `reflectance` | by angle | 0 to 1 |
//! | `tint` | factor of what is refracted | 0 to 1 per channel |

use glam::{Vec2, Vec3};

use super::facets::{Facets, Reflectance};
use super::fresnel::refract;
use super::rough_dielectric::{MIN_ALPHA, is_smooth};
use super::{BsdfSample, Kind, reflect, reflect_about};

#[derive(Clone, Copy, Debug)]
pub struct Glass {
    facets: Facets,
    reflectance: Reflectance,
    eta: f32,
    tint: Vec3,
    smooth: bool,
}

impl Glass {
    /// `alpha` along x and y.
    pub fn new(alpha: Vec2, multiscatter: bool, reflectance: Reflectance, eta: f32, tint: Vec3) -> Self {
        let smooth = is_smooth(alpha.max_element(), eta);
        let facets = Facets::new(alpha.max(Vec2::splat(MIN_ALPHA)), multiscatter);
        Self { facets, reflectance, eta, tint, smooth }
    }

    pub fn is_smooth(&self) -> bool {
        self.smooth
    }

    /// What single scattering must be multiplied by.
    pub fn boost(&self, wo: Vec3) -> f32 {
        if self.smooth { 1.0 } else { 1.0 / self.facets.boundary_albedo(wo, self.eta, &self.reflectance) }
    }

    /// BSDF × |cos θᵢ| without [`boost`](Self::boost), and density; zero where it is smooth.
    pub fn eval_pdf(&self, wo: Vec3, wi: Vec3) -> (Vec3, f32) {
        let nothing = (Vec3::ZERO, 0.0);
        if self.smooth || wo.z <= 0.0 || wi.z == 0.0 {
            return nothing;
        }
        let (eta, ggx) = (self.eta, &self.facets.ggx);
        let reflected = wi.z > 0.0;
        let Some(h) = (wo + if reflected { wi } else { eta * wi }).try_normalize() else { return nothing };
        let h = h * h.z.signum();
        let (wo_h, wi_h) = (wo.dot(h), wi.dot(h));
        if wo_h <= 0.0 || (wi_h > 0.0) != reflected {
            return nothing;
        }
        let (reflectance, cos_t) = self.reflectance.at_boundary(wo_h, eta);
        let p = self.p_reflect(reflectance, cos_t);
        let masked = ggx.d(h) * ggx.g2_over_4_cos_cos(wo, wi) * wi.z.abs();
        if reflected {
            (reflectance * masked, p * ggx.pdf_mirrored(wo, h))
        } else {
            let t = wi_h + wo_h / eta;
            let jacobian = wi_h.abs() / (t * t); // dω(h) / dω(wi)
            let f = (1.0 - reflectance) * self.tint * (jacobian * masked * 4.0 * wo_h / (eta * eta));
            (f, (1.0 - p) * jacobian * ggx.pdf_normal(wo, h))
        }
    }

    /// Draws `wi`; weight and density are those of this lobe alone, without [`boost`](Self::boost).
    pub fn sample(&self, wo: Vec3, u: Vec2, u_side: f32) -> Option<BsdfSample> {
        let h = if self.smooth { Vec3::Z } else { self.facets.ggx.sample_normal(wo, u) };
        let wo_h = wo.dot(h);
        let (reflectance, cos_t) = self.reflectance.at_boundary(wo_h, self.eta);
        let p = self.p_reflect(reflectance, cos_t);
        let reflects = u_side < p;
        let wi = match (reflects, self.smooth) {
            (true, true) => reflect(wo),
            (true, false) => reflect_about(wo, h),
            (false, _) => refract(wo, h, wo_h, cos_t, self.eta),
        };
        if (wi.z > 0.0) != reflects || wi.z == 0.0 {
            return None;
        }
        let (weight, pdf, eta, kind) = if reflects {
            (reflectance / p, p, 1.0, Kind::Glossy)
        } else {
            let weight = (1.0 - reflectance) * self.tint / ((1.0 - p) * self.eta * self.eta);
            (weight, 1.0 - p, self.eta, Kind::Transmission)
        };
        if self.smooth {
            return Some(BsdfSample { wi, weight, pdf, eta, delta: true, kind });
        }
        let (f, pdf) = self.eval_pdf(wo, wi);
        (pdf > 0.0).then(|| BsdfSample { wi, weight: f / pdf, pdf, eta, delta: false, kind })
    }

    /// By what goes each way.
    fn p_reflect(&self, reflectance: Vec3, cos_t: f32) -> f32 {
        let reflected = reflectance.element_sum();
        let refracted = ((1.0 - reflectance) * self.tint).element_sum();
        if cos_t == 0.0 || reflected + refracted <= 0.0 { 1.0 } else { reflected / (reflected + refracted) }
    }
}
