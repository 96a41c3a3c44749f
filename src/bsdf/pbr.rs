//! The metallic-roughness material of glTF 2.0 (specification, appendix B): a mix by `metallic` of
//!
//! - a metal: GGX with Schlick's curve from f₀ = base colour to 1, and
//! - a dielectric: a diffuse base of the base colour under GGX of the same roughness, which reflects by the equations
//!   of Fresnel for its index: f₀ = ((ior − 1)/(ior + 1))² head on, 1 at grazing angles.
//!
//! ```text
//! f = [metallic F_m boost_m + (1 − metallic) F_d boost_d] D G₂ / (4 cos θₒ cos θᵢ)
//!   + (1 − metallic) base (1 − E_d(wo)) / π
//! ```
//!
//! Three departures from the sample implementation B.3:
//!
//! - F_d is exact where the specification offers Schlick's curve as an approximation. At 1.5 that reflects
//!   0.086 of diffuse light, the layer 0.092.
//! - The boosts give back multiple scattering ([`specular`](super::specular)). Without them a white material loses
//!   3 % at roughness 1, a metal more than half.
//! - The base gets what the layer leaves of light along wo, 1 − E_d with E_d the layer's directional albedo, in place
//!   of 1 − F(wo·h). The latter keeps the lobe reciprocal but not its energy: wo·h is that of half the angle between
//!   wo and wi, so that the base is hardly dimmed at grazing angles, where the layer reflects most (white and smooth,
//!   seen at cos θₒ = 0.1, it gives 1.5 times what it gets). 1 − E_d keeps energy at any angle, roughness and metalness: a white
//!   base reflects all. It loses reciprocity, since E_d depends on wo alone; a base seen head on is not dimmed
//!   for light at grazing angles. Light that the layer sends back down to the base is not coloured again.
//!   Blender's Principled BSDF has the same form.
//!
//! | parameter | unit | range |
//! |---|---|---|
//! | `base_color` | reflectance per channel, linear Rec.709 | 0 to 1 |
//! | `metallic` | share of metal | 0 to 1 |
//! | `alpha` | roughness² | 0 to 1; at least 1e-4 is used |
//! | `layer` | reflectance of the dielectric by angle; [`LayerCurve::dielectric`] of 1.5 is glTF's default | 0 to 1 |
//! | `multiscatter` | whether light that bounces between facets is counted | |
//! | `matte` | normal of the base, in the frame of the facets: +Z but where a normal map leans so far that facets cannot follow | unit |

use glam::{Vec2, Vec3};

use super::albedo::Albedo;
use super::fresnel::{LayerCurve, SCHLICK_AVERAGE, SchlickCurve};
use super::ggx::Ggx;
use super::layer_albedo::Layer;
use super::specular::Specular;
use super::{Bsdf, BsdfSample, Kind, reflect_about};
use crate::geometry::Frame;
use crate::sampling::warp::{cosine_hemisphere, cosine_hemisphere_pdf};

/// As sharp as directions in f32 can be told apart.
const MIN_ALPHA: f32 = 1e-4;
/// However faint the layer is on average (its index next to 1), facets that reflect more must not weigh thousands.
const MIN_P_SPECULAR: f32 = 0.01;

/// From here on even the lobe of a metal is wide.
const MATTE_ALPHA: f32 = 0.25;

#[derive(Clone, Copy, Debug)]
pub struct Pbr {
    ggx: Ggx,
    metallic: f32,
    base_color: Vec3,
    layer: LayerCurve,
    multiscatter: bool,
    /// Normal of the base.
    matte: Vec3,
    /// The direction it was [prepared](Self::prepare) for, or zero, and what was found.
    seen: (Vec3, Mix),
}

/// What each part weighs, seen along one `wo`.
#[derive(Clone, Copy, Debug, Default)]
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
        layer: LayerCurve,
        multiscatter: bool,
        matte: Vec3,
    ) -> Bsdf {
        let ggx = Ggx { alpha: alpha.clamp(MIN_ALPHA, 1.0) };
        let seen = (Vec3::ZERO, Mix::default());
        Bsdf::Pbr(Self { ggx, metallic, base_color, layer, multiscatter, matte, seen })
    }

    /// As [`Bsdf::outline`].
    pub fn outline(&self, wo: Vec3) -> ([f32; 2], f32) {
        let p_specular = if wo.z > 0.0 { self.mix(wo).p_specular } else { 1.0 };
        ([1.0 - p_specular, p_specular], self.ggx.alpha)
    }

    /// Without a base.
    pub fn is_metal(&self) -> bool {
        self.metallic >= 1.0
    }

    pub fn is_matte(&self) -> bool {
        self.ggx.alpha >= MATTE_ALPHA
    }

    /// See [`Bsdf::prepare`].
    pub fn prepare(&mut self, wo: Vec3) {
        if wo.z > 0.0 {
            self.seen = (wo, self.weigh(wo));
        }
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
            let wi = match self.matte {
                Vec3::Z => cosine_hemisphere(u),
                leaning => Frame::from_z(leaning).to_world(cosine_hemisphere(u)),
            };
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
        let mut reflectance = Vec3::ZERO;
        if self.metallic > 0.0 {
            reflectance += mix.metal * SchlickCurve::metal(self.base_color).at(wo_h);
        }
        if self.metallic < 1.0 {
            reflectance += mix.dielectric * self.layer.at(wo_h);
        }
        let mirrored = self.ggx.pdf_mirrored(wo, h);
        let facets = self.ggx.d(h) * self.ggx.g2_over_4_cos_cos(wo, wi) * wi.z;
        let lambert = cosine_hemisphere_pdf(wi.dot(self.matte));
        let pdf = mix.p_specular * mirrored + (1.0 - mix.p_specular) * lambert;
        (reflectance * facets + mix.diffuse * lambert, pdf)
    }

    fn mix(&self, wo: Vec3) -> Mix {
        if self.seen.0 == wo { self.seen.1 } else { self.weigh(wo) }
    }

    fn weigh(&self, wo: Vec3) -> Mix {
        let Self { ggx: Ggx { alpha }, metallic, base_color, multiscatter, .. } = *self;
        let albedo = Albedo::at(wo.z, alpha);
        let (mut metal, mut dielectric, mut diffuse) = (Vec3::ZERO, Vec3::ZERO, Vec3::ZERO);
        let mut specular = Vec3::ZERO;
        if metallic > 0.0 {
            let curve = Specular::new(base_color, Vec3::ONE, SCHLICK_AVERAGE, alpha, multiscatter);
            metal = metallic * curve.boost(albedo.white);
            specular = metal * curve.single(albedo);
        }
        if metallic < 1.0 {
            let LayerCurve { f0, f90, rise } = self.layer;
            let layer = Layer::new(rise);
            let curve = Specular::new(f0, f90, layer.average(), alpha, multiscatter);
            let boost = curve.boost(albedo.white);
            let grazing = albedo.white * layer.grazing_share(wo.z, alpha);
            let reflected = boost * curve.single(Albedo { grazing, ..albedo });
            dielectric = (1.0 - metallic) * boost;
            diffuse = (1.0 - metallic) * base_color * (1.0 - reflected.max_element()).max(0.0);
            specular += (1.0 - metallic) * reflected;
        }
        let (specular, base) = (specular.element_sum(), diffuse.element_sum());
        let p_specular = if base > 0.0 { (specular / (specular + base)).max(MIN_P_SPECULAR) } else { 1.0 };
        Mix { metal, dielectric, diffuse, p_specular }
    }
}
