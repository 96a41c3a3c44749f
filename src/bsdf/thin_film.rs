//! Iridescence: what a film some hundred nanometres thick reflects, by the interference of light in it.
//!
//! Belcour and Barla 2017 (*A practical extension to microfacet theory for the modeling of varying iridescence*), in
//! the form that KHR_materials_iridescence gives it: Schlick's curve at both interfaces, no polarisation, a base
//! without absorption whose index follows from its f₀. With R₁₂ air to film and R₂₃ film to base,
//!
//! ```text
//! D  = 2 η₂ d cos θ₂                                                optical path difference
//! C₀ = R₁₂ + T₁₂² R₂₃ / (1 − R₁₂ R₂₃)
//! C_m = (R_s − T₁₂) (√(R₁₂ R₂₃))^m,   R_s = T₁₂² R₂₃ / (1 − R₁₂ R₂₃)
//! R  = C₀ + 2 Σ_{m = 1, 2} C_m S(m D, m φ)
//! ```
//!
//! where S is the Fourier transform of the eye's sensitivity at the phase 2π m D, as colour, and φ the phase that the
//! reflections add. Towards thickness 0 the film is not there: its weight goes to zero within 0.03 nm, as in
//! the sample viewer, whose path difference with θ₂ (not θ₁) is used too.
//!
//! | parameter | unit | range |
//! |---|---|---|
//! | `weight` | share of the film's reflectance in the whole | 0 to 1 |
//! | `ior` | index of refraction of the film | 1 to 5 or so |
//! | `thickness` | nm | ≥ 0 |

use std::f32::consts::{PI, TAU};

use glam::Vec3;

use super::fresnel::schlick_weight;

/// An f₀ of 1 has no index.
const MAX_F0: f32 = 0.9999;
/// Films thinner than this, in nm, fade out.
const THINNEST: f32 = 0.03;

#[derive(Clone, Copy, Debug)]
pub struct ThinFilm {
    pub weight: f32,
    ior: f32,
    thickness: f32,
    /// Air to film, at normal incidence.
    r0: f32,
    /// Film to base, at normal incidence.
    r1: Vec3,
    /// Phase added by both reflections.
    phase: Vec3,
}

impl ThinFilm {
    /// A film on a base of normal reflectance `f0`; `None` where it would do nothing.
    pub fn new(weight: f32, ior: f32, thickness: f32, f0: Vec3) -> Option<Self> {
        let fade = (thickness / THINNEST).clamp(0.0, 1.0);
        let weight = weight * fade * fade * (3.0 - 2.0 * fade);
        let root = f0.clamp(Vec3::ZERO, Vec3::splat(MAX_F0)).map(f32::sqrt);
        let base = (1.0 + root) / (1.0 - root);
        let ratio = (base - ior) / (base + ior);
        let r0 = ((ior - 1.0) / (ior + 1.0)).powi(2);
        let first = if ior < 1.0 { 0.0 } else { PI };
        let phase = base.map(|n| first + if n < ior { PI } else { 0.0 });
        (weight > 0.0).then_some(Self { weight, ior, thickness, r0, r1: ratio * ratio, phase })
    }

    /// Reflectance for light that arrives from air at this cosine.
    pub fn reflectance(&self, cos: f32) -> Vec3 {
        let cos = cos.clamp(0.0, 1.0);
        let sin2 = (1.0 - cos * cos) / (self.ior * self.ior);
        if sin2 >= 1.0 {
            return Vec3::ONE;
        }
        let cos2 = (1.0 - sin2).sqrt();
        let r12 = self.r0 + (1.0 - self.r0) * schlick_weight(cos);
        let t12 = 1.0 - r12;
        let r23 = self.r1 + (1.0 - self.r1) * schlick_weight(cos2);
        let both = (r12 * r23).min(Vec3::splat(0.9999));
        let amplitude = both.map(f32::sqrt);
        let rs = t12 * t12 * r23 / (1.0 - both);
        let path = 2.0 * self.ior * self.thickness * cos2;
        let mut sum = r12 + rs;
        let mut c = rs - t12;
        for m in [1.0, 2.0] {
            c *= amplitude;
            sum += 2.0 * c * sensitivity(m * path, m * self.phase);
        }
        sum.clamp(Vec3::ZERO, Vec3::ONE)
    }
}

/// The eye's response at a path difference (nm) and phase, as linear Rec.709: Gaussians fitted to the CIE 1931 colour
/// matching functions, transformed (Belcour and Barla 2017, section 4).
fn sensitivity(path: f32, shift: Vec3) -> Vec3 {
    const VALUE: Vec3 = Vec3::new(5.4856e-13, 4.4201e-13, 5.2481e-13);
    const POSITION: Vec3 = Vec3::new(1.6810e6, 1.7953e6, 2.2084e6);
    const VARIANCE: Vec3 = Vec3::new(4.3278e9, 9.3046e9, 6.6121e9);
    const SECOND: [f32; 3] = [9.7470e-14, 2.2399e6, 4.5282e9];
    const NORMALIZATION: f32 = 1.0685e-7;
    let phase = TAU * path * 1e-9;
    let gaussian = |value: f32, position: f32, variance: f32, shift: f32| {
        value * (TAU * variance).sqrt() * (position * phase + shift).cos() * (-phase * phase * variance).exp()
    };
    let mut xyz = Vec3::ZERO;
    for i in 0..3 {
        xyz[i] = gaussian(VALUE[i], POSITION[i], VARIANCE[i], shift[i]);
    }
    xyz.x += gaussian(SECOND[0], SECOND[1], SECOND[2], shift.x);
    let xyz = xyz / NORMALIZATION;
    Vec3::new(
        Vec3::new(3.240_454_2, -1.537_138_5, -0.498_531_4).dot(xyz),
        Vec3::new(-0.969_266, 1.876_010_8, 0.041_556).dot(xyz),
        Vec3::new(0.055_643_4, -0.204_025_9, 1.057_225_2).dot(xyz),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    const GLASS: Vec3 = Vec3::splat(0.04);

    #[test]
    fn no_thickness_or_weight_is_no_film() {
        assert!(ThinFilm::new(1.0, 1.3, 0.0, GLASS).is_none());
        assert!(ThinFilm::new(0.0, 1.3, 400.0, GLASS).is_none());
        assert!(ThinFilm::new(1.0, 1.3, 0.003, GLASS).is_some_and(|f| f.weight < 0.03));
    }

    /// So thick a film mixes all orders: what is left is the incoherent sum of the reflections.
    #[test]
    fn thick_films_lose_their_colour() {
        let film = ThinFilm::new(1.0, 1.3, 20_000.0, GLASS).expect("a film");
        let (r12, r23) = ((0.3f32 / 2.3).powi(2), (0.2f32 / 2.8).powi(2));
        let expected = r12 + (1.0 - r12).powi(2) * r23 / (1.0 - r12 * r23);
        assert!(film.reflectance(1.0).abs_diff_eq(Vec3::splat(expected), 1e-4), "{}", film.reflectance(1.0));
    }

    /// A quarter wave between air and glass cancels, a half wave is not there: the classic antireflection coating, of index
    /// √1.5, at 550 nm for green.
    #[test]
    fn a_quarter_wave_of_the_mean_index_cancels_green() {
        let ior = 1.5f32.sqrt();
        let green =
            |thickness: f32| ThinFilm::new(1.0, ior, thickness, GLASS).expect("a film").reflectance(1.0).y;
        let quarter = 550.0 / (4.0 * ior);
        assert!(green(quarter) < 0.005, "{}", green(quarter));
        assert!(green(2.0 * quarter) > 0.03, "{}", green(2.0 * quarter));
    }

    #[test]
    fn reflectance_is_a_share_everywhere() {
        for ior in [1.0, 1.3, 1.8, 3.0] {
            for thickness in [0.01, 1.0, 100.0, 400.0, 1200.0, 1e6] {
                for f0 in [Vec3::ZERO, GLASS, Vec3::new(1.0, 0.78, 0.34), Vec3::ONE] {
                    let film = ThinFilm::new(1.0, ior, thickness, f0).expect("a film");
                    for i in 0..=50 {
                        let r = film.reflectance(i as f32 / 50.0);
                        assert!(
                            r.is_finite() && r.min_element() >= 0.0 && r.max_element() <= 1.0,
                            "{film:?}: {r}"
                        );
                    }
                }
            }
        }
    }
}
