//! GGX: the normals of a rough surface, their masking and shadowing, and how to draw a visible one.
//!
//! With s(w) = √(w_z² + α²(w_x² + w_y²)), Smith's Λ(w) = (s(w)/|w_z| − 1) / 2, and
//!
//! ```text
//! D(h)       = α² / (π (h_x² + h_y² + α² h_z²)²)                       Walter et al. 2007, eq. 33
//! G₁(w)      = 1 / (1 + Λ(w))         = 2|w_z| / (|w_z| + s(w))
//! G₂(wo, wi) = 1 / (1 + Λ(wo) + Λ(wi)) = 2|wo_z wi_z| / (|wi_z| s(wo) + |wo_z| s(wi))    Heitz 2014, eq. 99
//! ```
//!
//! written so that nothing cancels or divides by a cosine, for alpha as small as 1e-4 and directions at the
//! horizon. Normals are drawn by their visible area as seen from `wo`: in the space where the surface is a
//! hemisphere, mirrored directions are uniform on a spherical cap (Dupuy and Benyoub 2023).
//!
//! | parameter | unit | range |
//! |---|---|---|
//! | `alpha` | RMS-like slope; roughness² | (0, 1] |

use std::f32::consts::{PI, TAU};

use glam::{Vec2, Vec3};

#[derive(Clone, Copy, Debug)]
pub struct Ggx {
    pub alpha: f32,
}

impl Ggx {
    /// Density of normals over projected solid angle, sr⁻¹.
    #[inline]
    pub fn d(&self, h: Vec3) -> f32 {
        let a2 = self.alpha * self.alpha;
        let t = h.x * h.x + h.y * h.y + a2 * h.z * h.z;
        a2 / (PI * t * t)
    }

    /// s(w): |w_z| × (1 + 2Λ(w)).
    #[inline]
    fn s(&self, w: Vec3) -> f32 {
        (w.z * w.z + self.alpha * self.alpha * (w.x * w.x + w.y * w.y)).sqrt()
    }

    /// G₂ / (4 |wo_z wi_z|), finite at the horizon.
    #[inline]
    pub fn g2_over_4_cos_cos(&self, wo: Vec3, wi: Vec3) -> f32 {
        g2_over_4_cos_cos([wo.z, wi.z], [self.s(wo), self.s(wi)])
    }

    /// G₂(wo, wi) / G₁(wo): the weight of a mirrored sample where all is reflected.
    #[inline]
    pub fn g2_over_g1(&self, wo: Vec3, wi: Vec3) -> f32 {
        g2_over_g1([wo.z, wi.z], [self.s(wo), self.s(wi)])
    }

    /// Draws a normal visible from `wo`, on whose side of the surface `wo.z` must be positive.
    #[inline]
    pub fn sample_normal(&self, wo: Vec3, u: Vec2) -> Vec3 {
        visible_normal(Vec2::splat(self.alpha), wo, u)
    }

    /// Density of [`sample_normal`](Self::sample_normal), sr⁻¹: D(h) G₁(wo) (wo·h) / |wo_z|.
    #[inline]
    pub fn pdf_normal(&self, wo: Vec3, h: Vec3) -> f32 {
        2.0 * self.d(h) * wo.dot(h).max(0.0) / (wo.z.abs() + self.s(wo))
    }

    /// Density, sr⁻¹, of the mirror image of `wo` about a drawn normal: the former over 4 (wo·h).
    #[inline]
    pub fn pdf_mirrored(&self, wo: Vec3, h: Vec3) -> f32 {
        0.5 * self.d(h) / (wo.z.abs() + self.s(wo))
    }
}

/// [`Ggx::g2_over_4_cos_cos`] of facets of any α, by z and s of `wo` and `wi`.
#[inline]
pub fn g2_over_4_cos_cos([o_z, i_z]: [f32; 2], [s_o, s_i]: [f32; 2]) -> f32 {
    0.5 / (i_z.abs() * s_o + o_z.abs() * s_i)
}

/// [`Ggx::g2_over_g1`] likewise.
#[inline]
pub fn g2_over_g1([o_z, i_z]: [f32; 2], [s_o, s_i]: [f32; 2]) -> f32 {
    let (cos_o, cos_i) = (o_z.abs(), i_z.abs());
    cos_i * (cos_o + s_o) / (cos_i * s_o + cos_o * s_i)
}

/// Draws a normal visible from `wo` of facets with these α along x and y.
pub fn visible_normal(alpha: Vec2, wo: Vec3, u: Vec2) -> Vec3 {
    let (sin, cos) = (TAU * u.y).sin_cos();
    visible_normal_at(alpha, wo, u.x, [cos, sin])
}

/// The same by the first uniform number, and cosine and sine of an azimuth.
#[inline]
pub fn visible_normal_at(alpha: Vec2, wo: Vec3, u: f32, [cos, sin]: [f32; 2]) -> Vec3 {
    let w = Vec3::new(alpha.x * wo.x, alpha.y * wo.y, wo.z).normalize();
    // A point of the cap z > −w.z, plus w, is the normal; its z is formed as one product, never zero for u < 1.
    let h_z = (1.0 - u) * (1.0 + w.z);
    let z = h_z - w.z;
    let r = (1.0 - z * z).max(0.0).sqrt();
    Vec3::new(alpha.x * (r * cos + w.x), alpha.y * (r * sin + w.y), h_z).normalize()
}
