//! The microfacets that come nearest to a fuzzy mirror.
//!
//! A mirror direction r plus a uniform point of a ball of radius f has a mean cosine to r of 1 − f²/5: |x| is
//! biharmonic away from the origin, so its gradient's mean over the ball about r is that of the series
//! u + (f²/10) Δu, with u = ∂|x|/∂r and Δu = −2. Facets tilted by θ turn the mirror direction by 2θ. Beckmann's
//! distribution has, seen head on, tan²θ = α² t with t exponentially distributed, so that both means agree where
//!
//! ```text
//! ∫ e⁻ᵗ α² t / (1 + α² t) dt = f² / 10
//! ```
//!
//! which is α = f/√10 for small f. Beckmann's lobe ends like the ball's; GGX has far longer tails.

/// Steps in t, up to where e⁻ᵗ has no digits left.
const STEPS: u32 = 4096;
const LAST: f64 = 40.0;

/// Blender's roughness √α of the Beckmann lobe that stands in for `fuzz`, 0 to 1.
pub fn roughness(fuzz: f32) -> f32 {
    let wanted = f64::from(fuzz.clamp(0.0, 1.0)).powi(2) / 10.0;
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..50 {
        let middle = 0.5 * (low + high);
        if mean_sin2(middle) < wanted { low = middle } else { high = middle }
    }
    (0.5 * (low + high)).sqrt() as f32
}

/// Mean sin²θ of the facets' normals.
fn mean_sin2(alpha: f64) -> f64 {
    let step = LAST / f64::from(STEPS);
    let terms = (0..STEPS).map(|i| {
        let t = (f64::from(i) + 0.5) * step;
        let tan2 = alpha * alpha * t;
        (-t).exp() * tan2 / (1.0 + tan2)
    });
    terms.sum::<f64>() * step
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn small_fuzz_has_the_width_of_its_variance() {
        for fuzz in [0.01f32, 0.05, 0.1] {
            let alpha = roughness(fuzz).powi(2);
            let limit = fuzz / 10f32.sqrt();
            assert!((alpha / limit - 1.0).abs() < 0.01 + fuzz * fuzz, "{fuzz}: {alpha} for {limit}");
        }
        assert_eq!(roughness(0.0), 0.0);
    }

    /// Draws from both lobes: the closed forms above are not taken on trust.
    #[test]
    fn both_lobes_have_the_same_mean_cosine() {
        use glam::{Vec2, Vec3};

        use crate::sampling::{stats::r3, warp::uniform_ball};
        let n = 1 << 16;
        for fuzz in [0.2f32, 0.6, 1.0] {
            let alpha2 = roughness(fuzz).powi(4);
            let (mut ball, mut facets) = (0.0, 0.0);
            for i in 0..n {
                let [a, b, c] = r3(i);
                ball += f64::from((Vec3::Z + fuzz * uniform_ball(Vec2::new(a, b), c)).normalize().z);
                let tan2 = -alpha2 * (1.0 - a).ln();
                facets += f64::from((1.0 - tan2) / (1.0 + tan2)); // cos 2θ
            }
            let (ball, facets) = (ball / f64::from(n), facets / f64::from(n));
            assert!((ball - facets).abs() < 1e-3, "{fuzz}: {ball} and {facets}");
        }
    }
}
