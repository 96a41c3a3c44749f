//! Lambert's diffuse surface: the same radiance in all directions, f = ρ/π.
//!
//! | parameter | unit | range |
//! |---|---|---|
//! | `color` | reflectance per channel, linear Rec.709 | 0 to 1 |

use glam::{Vec2, Vec3};

use super::{BsdfSample, Kind};
use crate::sampling::warp::{cosine_hemisphere, cosine_hemisphere_pdf};

#[derive(Clone, Copy, Debug)]
pub struct Diffuse {
    pub color: Vec3,
}

impl Diffuse {
    pub fn eval(&self, wo: Vec3, wi: Vec3) -> Vec3 {
        self.color * self.pdf(wo, wi)
    }

    pub fn sample(&self, wo: Vec3, u: Vec2) -> Option<BsdfSample> {
        let wi = cosine_hemisphere(u);
        let pdf = self.pdf(wo, wi);
        (pdf > 0.0).then_some(BsdfSample {
            wi,
            weight: self.color,
            pdf,
            eta: 1.0,
            delta: false,
            kind: Kind::Diffuse,
        })
    }

    pub fn pdf(&self, wo: Vec3, wi: Vec3) -> f32 {
        if wo.z > 0.0 { cosine_hemisphere_pdf(wi.z) } else { 0.0 }
    }
}
