//! Reflectance by angle.
//!
//! **Dielectrics** (η = ηₜ/ηᵢ, index on the far side over index on the near side): either the equations of Fresnel
//! for unpolarised light, or Schlick's approximation (1994)
//!
//! ```text
//! R(θ) = R₀ + (1 − R₀)(1 − cos θ)⁵,   R₀ = ((n₁ − n₂) / (n₁ + n₂))²
//! ```
//!
//! with θ the angle on the thinner side: the incident one going in, the refracted one coming out, so that R reaches 1
//! where total internal reflection begins and light takes the same share both ways.
//!
//! **Metals**: Schlick's curve between two colours, F(θ) = f₀ + (f₉₀ − f₀)(1 − cos θ)⁵; its average over
//! the hemisphere by the cosine is f₀ + (f₉₀ − f₀)/21. A plain tint is the curve with f₀ = f₉₀.
//!
//! **Layers** on a base: the exact curve of a dielectric between two colours, F(θ) = f₀ + (f₉₀ − f₀) w(θ) with
//! w = max(0, (R(θ) − R₀) / (1 − R₀)), which is R itself where f₀ = R₀ and f₉₀ = 1. Schlick's w, (1 − cos θ)⁵, is
//! that of no index: at 1.5 it reflects 0.086 of diffuse light where the exact one reflects 0.092, and between 1
//! and 1.2 several times too much. Above an index of 2 + √3 R dips below R₀ before it rises; w is cut off there, so
//! that it stays a share between the two colours.

use glam::Vec3;

/// The average of [`schlick_weight`] over the hemisphere by the cosine.
pub const SCHLICK_AVERAGE: f32 = 1.0 / 21.0;
/// It reflects all but 0.04 % at any angle.
const MAX_LAYER_IOR: f32 = 1e4;

/// (1 − cos θ)⁵
#[inline]
pub fn schlick_weight(cos: f32) -> f32 {
    let m = (1.0 - cos).clamp(0.0, 1.0);
    (m * m) * (m * m) * m
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SchlickCurve {
    /// Reflectance at normal incidence.
    pub f0: Vec3,
    /// Reflectance at grazing incidence.
    pub f90: Vec3,
}

impl SchlickCurve {
    pub fn metal(color: Vec3) -> Self {
        Self { f0: color, f90: Vec3::ONE }
    }

    pub fn constant(color: Vec3) -> Self {
        Self { f0: color, f90: color }
    }

    #[inline]
    pub fn at(&self, cos: f32) -> Vec3 {
        self.f0 + (self.f90 - self.f0) * schlick_weight(cos)
    }

    /// Cosine-weighted average over the hemisphere.
    pub fn average(&self) -> Vec3 {
        self.f0 + (self.f90 - self.f0) * SCHLICK_AVERAGE
    }
}

/// What a dielectric layer reflects, between two colours.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LayerCurve {
    /// Reflectance at normal incidence.
    pub f0: Vec3,
    /// Reflectance at grazing incidence.
    pub f90: Vec3,
    pub rise: DielectricRise,
}

impl LayerCurve {
    /// The equations of Fresnel as they are, for a boundary with air.
    pub fn dielectric(ior: f32) -> Self {
        let rise = DielectricRise::new(ior);
        Self { f0: Vec3::splat(rise.r0), f90: Vec3::ONE, rise }
    }

    #[inline]
    pub fn at(&self, cos: f32) -> Vec3 {
        self.f0 + (self.f90 - self.f0) * self.rise.at(cos)
    }
}

/// w(θ): how far the reflectance of a dielectric in air has come from normal incidence, 0, to grazing, 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DielectricRise {
    /// η² − 1
    eta2_minus_1: f32,
    r0: f32,
    /// 1 / (1 − R₀)
    scale: f32,
}

impl DielectricRise {
    /// An index below 1 is not that of a layer; its inverse, of the same R₀, stands in. Where the index is 1, w is
    /// 0 at any angle short of grazing: there is no layer.
    pub fn new(ior: f32) -> Self {
        let ior = 1f32.max(ior).max(1.0 / ior).min(MAX_LAYER_IOR);
        let r0 = normal_reflectance(ior);
        Self { eta2_minus_1: (ior - 1.0) * (ior + 1.0), r0, scale: 1.0 / (1.0 - r0) }
    }

    /// R₀
    pub fn r0(self) -> f32 {
        self.r0
    }

    /// w, by the form of the equations that needs no refracted angle (Cook and Torrance 1982): with c = cos θ and
    /// g = η cos θₜ, R = ½ ((g − c)/(g + c))² (1 + ((c(g + c) − 1)/(c(g − c) + 1))²).
    #[inline]
    pub fn at(self, cos: f32) -> f32 {
        let c = cos.clamp(f32::EPSILON, 1.0);
        let g = (self.eta2_minus_1 + c * c).sqrt();
        let (less, more) = (g - c, g + c);
        let (p, q) = (c * more - 1.0, c * less + 1.0);
        let amplitude = less / (more * q);
        let reflectance = 0.5 * amplitude * amplitude * (p * p + q * q);
        ((reflectance - self.r0) * self.scale).clamp(0.0, 1.0)
    }
}

/// R₀; the same from both sides.
pub fn normal_reflectance(eta: f32) -> f32 {
    let r = (eta - 1.0) / (eta + 1.0);
    r * r
}

/// Which curve a dielectric boundary follows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DielectricFresnel {
    Exact,
    Schlick,
}

impl DielectricFresnel {
    /// Reflectance for light arriving at `cos_i` ≥ 0, and the cosine of the refracted ray, zero where reflection is total.
    pub fn reflectance(self, cos_i: f32, eta: f32) -> (f32, f32) {
        if eta == 1.0 {
            return (0.0, cos_i); // no boundary
        }
        // sin² is formed as a product: near normal incidence 1 − cos² would lose its digits.
        let sin2_i = ((1.0 - cos_i) * (1.0 + cos_i)).max(0.0);
        let cos2_t = 1.0 - sin2_i / (eta * eta);
        if cos2_t <= 0.0 {
            return (1.0, 0.0);
        }
        let cos_t = cos2_t.sqrt();
        let reflectance = match self {
            Self::Exact => {
                let parallel = (eta * cos_i - cos_t) / (eta * cos_i + cos_t);
                let perpendicular = (cos_i - eta * cos_t) / (cos_i + eta * cos_t);
                0.5 * (parallel * parallel + perpendicular * perpendicular)
            }
            Self::Schlick => {
                let r0 = normal_reflectance(eta);
                r0 + (1.0 - r0) * schlick_weight(if eta > 1.0 { cos_i } else { cos_t })
            }
        };
        (reflectance, cos_t)
    }
}

/// `wo` refracted at a boundary of unit normal `n` on its side (`cos_o` = wo·n > 0), `cos_t` from
/// [`reflectance`](DielectricFresnel::reflectance). Snell's law: η sin θₜ = sin θₒ.
pub fn refract(wo: Vec3, n: Vec3, cos_o: f32, cos_t: f32, eta: f32) -> Vec3 {
    (n * (cos_o / eta - cos_t) - wo / eta).normalize()
}

#[cfg(test)]
mod tests {
    use super::DielectricFresnel::{Exact, Schlick};
    use super::*;

    fn cos(degrees: f32) -> f32 {
        degrees.to_radians().cos()
    }

    fn at(fresnel: DielectricFresnel, degrees: f32, eta: f32) -> f32 {
        fresnel.reflectance(cos(degrees), eta).0
    }

    #[test]
    fn glass_reflects_four_percent_head_on() {
        for fresnel in [Exact, Schlick] {
            assert!((at(fresnel, 0.0, 1.5) - 0.04).abs() < 1e-6);
            assert!((at(fresnel, 0.0, 1.0 / 1.5) - 0.04).abs() < 1e-6);
            assert!((at(fresnel, 90.0, 1.5) - 1.0).abs() < 1e-5);
        }
    }

    #[test]
    fn known_values_at_an_angle() {
        // At Brewster's angle, atan 1.5, half of the unpolarised light is not reflected at all:
        // R = ½ ((1 − η²) / (1 + η²))² = ½ (1.25 / 3.25)²
        assert!((at(Exact, 56.309_93, 1.5) - 0.073_965).abs() < 1e-5);
        // 0.04 + 0.96 × (1 − cos 60°)⁵ = 0.04 + 0.96 / 32
        assert!((at(Schlick, 60.0, 1.5) - 0.07).abs() < 1e-6);
    }

    #[test]
    fn light_takes_the_same_share_both_ways() {
        for fresnel in [Exact, Schlick] {
            for degrees in [0.0f32, 20.0, 50.0, 75.0, 89.0] {
                let (entering, cos_t) = fresnel.reflectance(degrees.to_radians().cos(), 1.5);
                let (leaving, _) = fresnel.reflectance(cos_t, 1.0 / 1.5);
                assert!((entering - leaving).abs() < 1e-4, "{degrees}°: {entering} in, {leaving} out");
            }
        }
    }

    #[test]
    fn layers_follow_the_exact_curve() {
        for ior in [1.0, 1.001, 1.1, 1.33, 1.5, 2.4, 3.0] {
            let LayerCurve { f0, f90, rise } = LayerCurve::dielectric(ior);
            for degrees in [0.0, 20.0, 56.309_93, 75.0, 85.0, 89.5] {
                let (layer, exact) = (f0 + (f90 - f0) * rise.at(cos(degrees)), at(Exact, degrees, ior));
                assert!((layer.x - exact).abs() < 1e-5, "{ior}, {degrees}°: {layer}, {exact}");
            }
        }
    }

    #[test]
    fn layers_rise_from_zero_to_one_at_any_index() {
        for ior in [0.0, 0.5, 1.0, 1.0 + 1e-6, 1.5, 3.0, 5.0, 100.0, 1e4, f32::INFINITY, f32::NAN] {
            let rise = DielectricRise::new(ior);
            assert!((0.0..1.0).contains(&rise.r0()), "{ior}: {rise:?}");
            assert!(rise.at(1.0) < 2e-3, "{ior}: {}", rise.at(1.0));
            for i in -10..=1010 {
                assert!((0.0..=1.0).contains(&rise.at(i as f32 / 1000.0)), "{ior}, {i}: {rise:?}");
            }
        }
        assert!(DielectricRise::new(1.001).at(0.0) > 0.999);
        assert_eq!(DielectricRise::new(0.5), DielectricRise::new(2.0));
        assert_eq!(DielectricRise::new(1.0).at(1e-3), 0.0);
    }

    #[test]
    fn average_is_the_cosine_weighted_integral() {
        let curve = SchlickCurve::metal(Vec3::new(0.9, 0.5, 0.04));
        let n = 10_000;
        let integral = (0..n)
            .map(|i| {
                let mu = (i as f32 + 0.5) / n as f32;
                2.0 * mu * curve.at(mu) / n as f32
            })
            .sum::<Vec3>();
        assert!(integral.abs_diff_eq(curve.average(), 1e-5), "{integral}");
    }
}
