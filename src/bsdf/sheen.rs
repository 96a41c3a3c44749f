//! Sheen: the rim of light on velvet and cloth, from fibres that stand on the surface.
//!
//! KHR_materials_sheen: the microfacet form with the "Charlie" distribution of Estevez and Kulla 2017 (*Production
//! friendly microfacet sheen BRDF*), whose normals lie near the horizon, and their fit of Λ for its shadowing:
//!
//! ```text
//! f = color D / (4 cos θₒ cos θᵢ (1 + Λ(θₒ) + Λ(θᵢ)))
//! D(h) = (2 + 1/α) sin^{1/α} θₕ / 2π
//! ```
//!
//! What is below gets 1 − max(color) E(wo), with E the directional albedo of the white lobe, tabulated at first use.
//! Fits overshoot: where E would be above 1, near grazing for small α, the lobe is scaled to it. It is reciprocal elsewhere.
//! Directions are drawn evenly over the hemisphere, as the paper advises: half of the mirrored ones would point down.
//!
//! | parameter | unit | range |
//! |---|---|---|
//! | `color` | albedo of the fibres per channel | 0 to 1 |
//! | `alpha` | roughness² | 0 to 1; at least 0.005 is used |

use std::{f32::consts::TAU, sync::LazyLock};

use glam::{Vec2, Vec3};

use super::table::{cell, gauss_legendre, node};

const ROUGHNESSES: usize = 32;
const COSINES: usize = 64;
/// Roughness 0.07: below, the lobe is a line at the horizon.
const MIN_ALPHA: f32 = 0.005;
const TINY: f32 = 1e-3;

#[derive(Clone, Copy, Debug)]
pub struct Sheen {
    pub color: Vec3,
    alpha: f32,
}

/// E by √α, then by √μ.
static TABLE: LazyLock<Vec<[f32; COSINES]>> = LazyLock::new(|| {
    let rule = gauss_legendre::<20>();
    (0..ROUGHNESSES).map(|i| row(&rule, alpha_at(i))).collect()
});

impl Sheen {
    /// `None` where there is none.
    pub fn new(color: Vec3, alpha: f32) -> Option<Self> {
        (color != Vec3::ZERO).then_some(Self { color, alpha: alpha.clamp(MIN_ALPHA, 1.0) })
    }

    /// BSDF × cos θᵢ, in sr⁻¹.
    pub fn eval(&self, wo: Vec3, wi: Vec3) -> Vec3 {
        if wo.z <= 0.0 || wi.z <= 0.0 {
            return Vec3::ZERO;
        }
        let Some(h) = (wo + wi).try_normalize() else { return Vec3::ZERO };
        let lambdas = lambda(wo.z, self.alpha) + lambda(wi.z, self.alpha);
        let white = white(wo.z, h.x * h.x + h.y * h.y, lambdas, self.alpha);
        self.color * (white / tabulated(wo.z, self.alpha).max(1.0))
    }

    pub fn sample(&self, u: Vec2) -> Vec3 {
        let z = 1.0 - u.x;
        let r = (1.0 - z * z).max(0.0).sqrt();
        let (sin, cos) = (TAU * u.y).sin_cos();
        Vec3::new(r * cos, r * sin, z)
    }

    pub fn pdf(&self, wi: Vec3) -> f32 {
        if wi.z > 0.0 { 1.0 / TAU } else { 0.0 }
    }

    /// Directional albedo of the lobe with a white colour.
    pub fn white_albedo(&self, mu: f32) -> f32 {
        tabulated(mu, self.alpha).min(1.0)
    }

    /// The share of light along a direction of cosine `mu` that what is below gets.
    pub fn passed(&self, mu: f32) -> f32 {
        1.0 - self.color.max_element() * self.white_albedo(mu)
    }
}

fn tabulated(mu: f32, alpha: f32) -> f32 {
    let root = MIN_ALPHA.sqrt();
    let (i, s) = cell((alpha.sqrt() - root) / (1.0 - root), ROUGHNESSES);
    let (j, t) = cell(mu.sqrt(), COSINES);
    let row = |i: usize| TABLE[i][j] + t * (TABLE[i][j + 1] - TABLE[i][j]);
    row(i) + s * (row(i + 1) - row(i))
}

fn alpha_at(i: usize) -> f32 {
    let root = MIN_ALPHA.sqrt();
    (root + node(i, ROUGHNESSES) * (1.0 - root)).powi(2)
}

/// D / (4 cos θₒ (1 + Λ + Λ)): the lobe times cos θᵢ. `sin2` is that of the angle between h and the normal.
fn white(cos_o: f32, sin2: f32, lambdas: f32, alpha: f32) -> f32 {
    let d = (2.0 + 1.0 / alpha) * sin2.min(1.0).powf(0.5 / alpha) / TAU;
    d / (4.0 * cos_o.max(TINY) * (1.0 + lambdas))
}

/// Estevez and Kulla 2017, eq. 3 and table 1.
fn lambda(cos: f32, alpha: f32) -> f32 {
    let t = (1.0 - alpha) * (1.0 - alpha);
    let mix = |a: f32, b: f32| a + t * (b - a);
    let (a, b, c) = (mix(21.5473, 25.3245), mix(3.82987, 3.32435), mix(0.19823, 0.16801));
    let (d, e) = (mix(-1.97760, -1.27393), mix(-4.32054, -4.85967));
    let l = |x: f32| a / (1.0 + b * x.powf(c)) + d * x + e;
    let exponent = if cos < 0.5 { l(cos) } else { 2.0 * l(0.5) - l(1.0 - cos) };
    exponent.exp()
}

/// E(μ, α) for all μ, by cos θᵢ and φ. The lobe peaks where h lies flat: towards φ = 0 and the horizon. In s and t it is smooth,
/// and the rule within 0.02 %.
fn row(rule: &[(f32, f32)], alpha: f32) -> [f32; COSINES] {
    // cos θᵢ = s², φ = π t² of the half turn; the weights are those of s ds and t dt
    let incident: Vec<_> = rule.iter().map(|(s, weight)| (s * s, lambda(s * s, alpha), s * weight)).collect();
    let azimuths: Vec<_> =
        rule.iter().map(|(t, weight)| ((std::f32::consts::PI * t * t).cos(), t * weight)).collect();
    std::array::from_fn(|k| {
        let mu = node(k, COSINES).powi(2).max(TINY);
        let (sin_o, lambda_o) = (((1.0 - mu) * (1.0 + mu)).sqrt(), lambda(mu, alpha));
        let mut sum = 0.0;
        for &(z, lambda_i, ds) in &incident {
            let sin_i = ((1.0 - z) * (1.0 + z)).sqrt();
            let along = (mu + z) * (mu + z); // of wo + wi
            for (cos_phi, dt) in &azimuths {
                let across = sin_o * sin_o + 2.0 * sin_o * sin_i * cos_phi + sin_i * sin_i;
                sum += white(mu, across / (across + along), lambda_o + lambda_i, alpha) * ds * dt;
            }
        }
        sum * 4.0 * TAU
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Against a plain sum over many directions.
    #[test]
    fn table_holds_the_integral() {
        for (alpha, mu) in [(0.25, 0.1f32), (0.25, 0.9), (1.0, 0.5), (0.04, 0.2)] {
            const N: u32 = 400;
            let wo = Vec3::new((1.0 - mu * mu).sqrt(), 0.0, mu);
            let lobe = Sheen { color: Vec3::ONE, alpha };
            let mut sum = 0.0;
            for i in 0..N * N {
                let [x, y] = [i % N, i / N].map(|k| (k as f32 + 0.5) / N as f32);
                sum += f64::from(lobe.eval(wo, lobe.sample(Vec2::new(x, 0.5 * y))).x);
            }
            let integral = (sum / f64::from(N * N)) as f32 * TAU;
            let expected = tabulated(mu, alpha).min(1.0);
            assert!((integral - expected).abs() < 2e-3, "{alpha}, {mu}: {integral}, {expected}");
        }
    }
}
