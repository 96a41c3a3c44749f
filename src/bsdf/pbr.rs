//! The metallic-roughness material of glTF 2.0 (specification, appendix B): a mix by `metallic` of
//!
//! - a metal: GGX with Schlick's curve from f₀ = base colour to 1, and
//! - a dielectric: a diffuse base of the base colour under GGX with Schlick's curve from f₀ = ((ior − 1)/(ior + 1))²
//!   to 1, of the same roughness.
//!
//! ```text
//! f = [metallic F_m boost_m + (1 − metallic) F_d boost_d] D G₂ / (4 cos θₒ cos θᵢ)
//!   + (1 − metallic) base (1 − E_d(wo)) / π
//! ```
//!
//! Two departures from the sample implementation B.3, both towards keeping energy: the boosts give back multiple
//! scattering ([`specular`](super::specular)), and the diffuse base gets what the specular layer leaves of light along
//! wo, 1 − E_d with E_d the layer's directional albedo, in place of 1 − F(wo·h), which counts no light scattered
//! within the layer and loses a few percent. A white base colour thus reflects all, at any roughness and metalness.
//! E_d depends on wo alone, so the lobe is not reciprocal; Blender's Principled BSDF has the same form.
//!
//! | parameter | unit | range |
//! |---|---|---|
//! | `base_color` | reflectance per channel, linear Rec.709 | 0 to 1 |
//! | `metallic` | share of metal | 0 to 1 |
//! | `alpha` | roughness² | 0 to 1; at least 1e-4 is used |
//! | `dielectric` | reflectance of the specular layer; [`SchlickCurve::dielectric`] of 1.5 is glTF's default | 0 to 1 |
//! | `multiscatter` | whether light that bounces between facets is counted | |

use glam::{Vec2, Vec3};

use super::albedo::Albedo;
use super::fresnel::SchlickCurve;
use super::ggx::Ggx;
use super::specular::Specular;
use super::{Bsdf, BsdfSample, Kind, reflect_about};
use crate::sampling::warp::{cosine_hemisphere, cosine_hemisphere_pdf};

/// As sharp as directions in f32 can be told apart.
const MIN_ALPHA: f32 = 1e-4;

#[derive(Clone, Copy, Debug)]
pub struct Pbr {
    ggx: Ggx,
    metallic: f32,
    metal: Specular,
    dielectric: Specular,
    /// Of the base under the dielectric: (1 − metallic) × base colour.
    diffuse: Vec3,
}

/// What each part weighs, seen along one `wo`.
struct Mix {
    metal: Vec3,
    dielectric: Vec3,
    diffuse: Vec3,
    /// The probability of drawing from the specular lobe.
    p_specular: f32,
}

impl Pbr {
    pub fn bsdf(
        base_color: Vec3,
        metallic: f32,
        alpha: f32,
        dielectric: SchlickCurve,
        multiscatter: bool,
    ) -> Bsdf {
        let ggx = Ggx { alpha: alpha.clamp(MIN_ALPHA, 1.0) };
        Bsdf::Pbr(Self {
            ggx,
            metallic,
            metal: Specular::new(SchlickCurve::metal(base_color), ggx.alpha, multiscatter),
            dielectric: Specular::new(dielectric, ggx.alpha, multiscatter),
            diffuse: (1.0 - metallic) * base_color,
        })
    }

    pub fn eval_pdf(&self, wo: Vec3, wi: Vec3) -> (Vec3, f32) {
        if wo.z <= 0.0 || wi.z <= 0.0 {
            return (Vec3::ZERO, 0.0);
        }
        let Some(h) = (wo + wi).try_normalize() else { return (Vec3::ZERO, 0.0) };
        self.eval_pdf_about(wo, wi, h, &self.mix(wo))
    }

    pub fn sample(&self, wo: Vec3, u: Vec2, u_lobe: f32) -> Option<BsdfSample> {
        if wo.z <= 0.0 {
            return None;
        }
        let mix = self.mix(wo);
        let (wi, h, kind) = if u_lobe < mix.p_specular {
            let h = self.ggx.sample_normal(wo, u);
            (reflect_about(wo, h), h, Kind::Glossy)
        } else {
            let wi = cosine_hemisphere(u);
            (wi, (wo + wi).try_normalize()?, Kind::Diffuse)
        };
        if wi.z <= 0.0 {
            return None;
        }
        let (f, pdf) = self.eval_pdf_about(wo, wi, h, &mix);
        (pdf > 0.0).then(|| BsdfSample { wi, weight: f / pdf, pdf, eta: 1.0, delta: false, kind })
    }

    fn eval_pdf_about(&self, wo: Vec3, wi: Vec3, h: Vec3, mix: &Mix) -> (Vec3, f32) {
        let wo_h = wo.dot(h);
        let reflectance =
            mix.metal * self.metal.curve.at(wo_h) + mix.dielectric * self.dielectric.curve.at(wo_h);
        let facets = self.ggx.d(h) * self.ggx.g2_over_4_cos_cos(wo, wi) * wi.z;
        let lambert = cosine_hemisphere_pdf(wi.z);
        let pdf = mix.p_specular * self.ggx.pdf_mirrored(wo, h) + (1.0 - mix.p_specular) * lambert;
        (reflectance * facets + mix.diffuse * lambert, pdf)
    }

    fn mix(&self, wo: Vec3) -> Mix {
        let albedo = Albedo::at(wo.z, self.ggx.alpha);
        let metal = self.metallic * self.metal.boost(albedo);
        let mut specular = metal * self.metal.single(albedo);
        let (mut dielectric, mut diffuse) = (Vec3::ZERO, Vec3::ZERO);
        if self.metallic < 1.0 {
            let boost = self.dielectric.boost(albedo);
            let layer = boost * self.dielectric.single(albedo);
            dielectric = (1.0 - self.metallic) * boost;
            diffuse = self.diffuse * (1.0 - layer.max_element()).max(0.0);
            specular += (1.0 - self.metallic) * layer;
        }
        let (specular, base) = (specular.element_sum(), diffuse.element_sum());
        let p_specular = if base > 0.0 { specular / (specular + base) } else { 1.0 };
        Mix { metal, dielectric, diffuse, p_specular }
    }
}
