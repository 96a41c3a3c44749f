//! Clearcoat: a layer of varnish of index 1.5 over all else, with facets and a normal of its own.
//!
//! KHR_materials_clearcoat: `coated = fresnel_coat(normal, ior = 1.5, weight, base, layer)`. The layer reflects by the
//! equations of Fresnel with multiple scattering ([`specular`](super::specular)); what is below gets 1 − weight × E(wo), with E
//! its directional albedo, so that no energy is gained or lost at any angle.
//!
//! | parameter | unit | range |
//! |---|---|---|
//! | `weight` | share of the surface that is coated | 0 to 1 |
//! | `alpha` | roughness² | 0 to 1; at least 1e-4 is used |

use glam::{Vec2, Vec3};

use super::albedo::Albedo;
use super::fresnel::LayerCurve;
use super::ggx::Ggx;
use super::layer_albedo::Layer;
use super::reflect_about;
use super::specular::Specular;

const IOR: f32 = 1.5;
const MIN_ALPHA: f32 = 1e-4;

#[derive(Clone, Copy, Debug)]
pub struct Coat {
    pub weight: f32,
    ggx: Ggx,
    specular: Specular,
    layer: Layer,
}

impl Coat {
    /// `None` where there is none.
    pub fn new(weight: f32, alpha: f32) -> Option<Self> {
        let ggx = Ggx { alpha: alpha.clamp(MIN_ALPHA, 1.0) };
        let LayerCurve { f0, f90, rise } = LayerCurve::dielectric(IOR);
        let layer = Layer::new(rise);
        let specular = Specular::new(f0, f90, layer.average(), ggx.alpha, true);
        (weight > 0.0).then_some(Self { weight, ggx, specular, layer })
    }

    /// The factor for multiple scattering and the directional albedo, both for full weight.
    pub fn weigh(&self, mu: f32) -> (f32, f32) {
        let albedo = Albedo::at(mu, self.ggx.alpha);
        let grazing = albedo.white * self.layer.grazing_share(mu, self.ggx.alpha);
        let boost = self.specular.boost(albedo.white);
        (boost.x, (boost * self.specular.single(Albedo { grazing, ..albedo })).x)
    }

    /// BSDF × cos θᵢ for full weight without multiple scattering, and density.
    pub fn eval_pdf(&self, wo: Vec3, wi: Vec3) -> (f32, f32) {
        if wo.z <= 0.0 || wi.z <= 0.0 {
            return (0.0, 0.0);
        }
        let Some(h) = (wo + wi).try_normalize() else { return (0.0, 0.0) };
        let facets = self.ggx.d(h) * self.ggx.g2_over_4_cos_cos(wo, wi) * wi.z;
        (self.specular.at(self.layer.rise.at(wo.dot(h))).x * facets, self.ggx.pdf_mirrored(wo, h))
    }

    pub fn sample(&self, wo: Vec3, u: Vec2) -> Vec3 {
        reflect_about(wo, self.ggx.sample_normal(wo, u))
    }
}
