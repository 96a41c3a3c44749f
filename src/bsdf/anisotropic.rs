//! GGX of two widths: facets that lean further along x than along y, as on brushed metal.
//!
//! [`ggx`](super::ggx) with α stretched by direction, s(w) = √(w_z² + α_x² w_x² + α_y² w_y²), and
//!
//! ```text
//! D(h) = 1 / (π α_x α_y ((h_x/α_x)² + (h_y/α_y)² + h_z²)²)        Burley 2012, Heitz 2014 eq. 85
//! ```
//!
//! | parameter | unit | range |
//! |---|---|---|
//! | `alpha` | slope along x and along y; roughness² where they are equal | (0, 1] |

use std::f32::consts::PI;

use glam::{Vec2, Vec3};

use super::ggx::{g2_over_4_cos_cos, g2_over_g1, visible_normal};

#[derive(Clone, Copy, Debug)]
pub struct AnisotropicGgx {
    pub alpha: Vec2,
}

impl AnisotropicGgx {
    /// Density of normals over projected solid angle, sr⁻¹.
    pub fn d(&self, h: Vec3) -> f32 {
        let (x, y) = (h.x / self.alpha.x, h.y / self.alpha.y);
        let t = x * x + y * y + h.z * h.z;
        1.0 / (PI * self.alpha.x * self.alpha.y * t * t)
    }

    /// |w_z| × (1 + 2Λ(w)).
    fn s(&self, w: Vec3) -> f32 {
        let (x, y) = (self.alpha.x * w.x, self.alpha.y * w.y);
        (w.z * w.z + x * x + y * y).sqrt()
    }

    /// G₂ / (4 |wo_z wi_z|), finite at the horizon.
    pub fn g2_over_4_cos_cos(&self, wo: Vec3, wi: Vec3) -> f32 {
        g2_over_4_cos_cos([wo.z, wi.z], [self.s(wo), self.s(wi)])
    }

    /// G₂(wo, wi) / G₁(wo): the weight of a mirrored sample where all is reflected.
    pub fn g2_over_g1(&self, wo: Vec3, wi: Vec3) -> f32 {
        g2_over_g1([wo.z, wi.z], [self.s(wo), self.s(wi)])
    }

    /// Draws a normal visible from `wo`, on whose side of the surface `wo.z` must be positive.
    pub fn sample_normal(&self, wo: Vec3, u: Vec2) -> Vec3 {
        visible_normal(self.alpha, wo, u)
    }

    /// Density of [`sample_normal`](Self::sample_normal), sr⁻¹: D(h) G₁(wo) (wo·h) / |wo_z|.
    pub fn pdf_normal(&self, wo: Vec3, h: Vec3) -> f32 {
        2.0 * self.d(h) * wo.dot(h).max(0.0) / (wo.z.abs() + self.s(wo))
    }

    /// Density, sr⁻¹, of the mirror image of `wo` about a drawn normal: the former over 4 (wo·h).
    pub fn pdf_mirrored(&self, wo: Vec3, h: Vec3) -> f32 {
        0.5 * self.d(h) / (wo.z.abs() + self.s(wo))
    }
}

#[cfg(test)]
mod tests {
    use super::super::ggx::Ggx;
    use super::*;
    use crate::sampling::stats::{directions, r3};

    #[test]
    fn equal_widths_are_the_isotropic_distribution() {
        for alpha in [1e-3, 0.1, 0.7, 1.0] {
            let (two, one) = (AnisotropicGgx { alpha: Vec2::splat(alpha) }, Ggx { alpha });
            for (i, wo) in directions(16).enumerate() {
                let [a, b, _] = r3(i as u32);
                let (h, k) = (two.sample_normal(wo, Vec2::new(a, b)), one.sample_normal(wo, Vec2::new(a, b)));
                assert!(h.abs_diff_eq(k, 1e-6));
                let close = |a: f32, b: f32| (a - b).abs() <= 1e-3 * b.abs();
                assert!(close(two.d(h), one.d(h)), "{alpha}: {} {}", two.d(h), one.d(h));
                assert!(close(two.pdf_normal(wo, h), one.pdf_normal(wo, h)));
                assert!(close(two.g2_over_g1(wo, h), one.g2_over_g1(wo, h)));
            }
        }
    }
}
