//! Iridescence: what a film some hundred nanometres thick reflects, by the interference of light in it.
//!
//! Belcour and Barla 2017 (*A practical extension to microfacet theory for the modeling of varying iridescence*): the
//! reflections between both faces summed as Airy does, and over the spectrum by the Fourier transform S of the eye's
//! sensitivity. The base does not absorb; its index follows from its f₀, as in KHR_materials_iridescence. With r₁₂ air to
//! film and r₂₃ film to base, for each polarisation and in the mean of both,
//!
//! ```text
//! D   = 2 η₂ d cos θ₂                                         optical path difference
//! R_s = (1 − r₁₂²)² r₂₃² / (1 − q²),   q = −r₁₂ r₂₃
//! R   = r₁₂² + R_s + 2 Σ_{m = 1, 2} (R_s − 1 + r₁₂²) q^m S(m D)
//! ```
//!
//! The extension's sample code has Schlick's curve for r² and no polarisation, which halves the red of a film of 400 nm and
//! index 1.8 on glass at 66°; here they are the equations of Fresnel. Without absorption the phases that the
//! reflections add are signs of q. Towards thickness 0 the film is not there: its weight goes to zero within 0.03 nm, as in
//! the sample viewer.
//!
//! | parameter | unit | range |
//! |---|---|---|
//! | `weight` | share of the film's reflectance in the whole | 0 to 1 |
//! | `ior` | index of refraction of the film | 1 to 5 or so |
//! | `thickness` | nm | ≥ 0 |

use std::f32::consts::TAU;

use glam::Vec3;

/// An f₀ of 1 has no index.
const MAX_F0: f32 = 0.9999;
/// Films thinner than this, in nm, fade out.
const THINNEST: f32 = 0.03;

#[derive(Clone, Copy, Debug)]
pub struct ThinFilm {
    pub weight: f32,
    ior: f32,
    thickness: f32,
    /// Index of what is below.
    base: Vec3,
}

impl ThinFilm {
    /// A film on a base of normal reflectance `f0`; `None` where it would do nothing.
    pub fn new(weight: f32, ior: f32, thickness: f32, f0: Vec3) -> Option<Self> {
        let fade = (thickness / THINNEST).clamp(0.0, 1.0);
        let weight = weight * fade * fade * (3.0 - 2.0 * fade);
        let root = f0.clamp(Vec3::ZERO, Vec3::splat(MAX_F0)).map(f32::sqrt);
        let base = (1.0 + root) / (1.0 - root);
        (weight > 0.0).then_some(Self { weight, ior, thickness, base })
    }

    /// Reflectance for light that arrives from air at this cosine.
    pub fn reflectance(&self, cos: f32) -> Vec3 {
        let cos = cos.clamp(0.0, 1.0);
        let sin2 = (1.0 - cos) * (1.0 + cos);
        let (film, base) = (self.ior, self.base);
        if sin2 >= film * film {
            return Vec3::ONE;
        }
        let cos2 = (1.0 - sin2 / (film * film)).sqrt();
        let cos3 = (1.0 - sin2 / (base * base)).max(Vec3::ZERO).map(f32::sqrt);
        let ratio = |a: f32, b: f32| (a - b) / (a + b).max(f32::MIN_POSITIVE);
        let ratios = |a: Vec3, b: Vec3| (a - b) / (a + b).max(Vec3::splat(f32::MIN_POSITIVE));
        let s = (ratio(cos, film * cos2), ratios(Vec3::splat(film * cos2), base * cos3));
        let p = (ratio(film * cos, cos2), ratios(base * cos2, film * cos3));
        let path = 2.0 * film * self.thickness * cos2;
        let interference = [sensitivity(path), sensitivity(2.0 * path)];
        let polarized = |(r12, r23): (f32, Vec3)| {
            let q = -r12 * r23;
            let t12 = 1.0 - r12 * r12;
            let rs = t12 * t12 * r23 * r23 / (1.0 - q * q).max(Vec3::splat(1e-4));
            let [first, second] = interference;
            r12 * r12 + rs + 2.0 * (rs - t12) * q * (first + q * second)
        };
        (0.5 * (polarized(s) + polarized(p))).clamp(Vec3::ZERO, Vec3::ONE)
    }
}

/// The eye's response at a path difference (nm), as linear Rec.709: Gaussians fitted to the CIE 1931 colour
/// matching functions, transformed (Belcour and Barla 2017, section 4).
fn sensitivity(path: f32) -> Vec3 {
    const VALUE: Vec3 = Vec3::new(5.4856e-13, 4.4201e-13, 5.2481e-13);
    const POSITION: Vec3 = Vec3::new(1.6810e6, 1.7953e6, 2.2084e6);
    const VARIANCE: Vec3 = Vec3::new(4.3278e9, 9.3046e9, 6.6121e9);
    const SECOND: [f32; 3] = [9.7470e-14, 2.2399e6, 4.5282e9];
    const NORMALIZATION: f32 = 1.0685e-7;
    let phase = TAU * path * 1e-9;
    let gaussian = |value: f32, position: f32, variance: f32| {
        value * (TAU * variance).sqrt() * (position * phase).cos() * (-phase * phase * variance).exp()
    };
    let mut xyz = Vec3::ZERO;
    for i in 0..3 {
        xyz[i] = gaussian(VALUE[i], POSITION[i], VARIANCE[i]);
    }
    xyz.x += gaussian(SECOND[0], SECOND[1], SECOND[2]);
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

    /// Airy's formula with the CIE 1931 observer (Wyman et al. 2013) at every nanometre, unpolarised light of equal energy, to
    /// linear Rec.709: a film of index 1.8 on glass.
    #[test]
    fn films_have_the_colours_of_the_spectrum() {
        for (thickness, cos, expected) in [
            (250.0, 1.0, [0.1504, 0.1131, 0.0397]),
            (250.0, 0.4, [0.1765, 0.2227, 0.1908]),
            (400.0, 1.0, [0.1335, 0.1062, 0.0731]),
            (400.0, 0.7, [0.0569, 0.1409, 0.0652]),
            (400.0, 0.4, [0.1069, 0.1967, 0.1856]),
            (600.0, 0.7, [0.1134, 0.1134, 0.1156]),
            (600.0, 0.2, [0.3317, 0.3877, 0.3592]),
        ] {
            let found = ThinFilm::new(1.0, 1.8, thickness, GLASS).expect("a film").reflectance(cos);
            assert!(found.abs_diff_eq(expected.into(), 0.015), "{thickness} nm, {cos}: {found}");
        }
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
