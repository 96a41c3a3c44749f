//! What tests of samplers share: quasi-random points, integrals over the sphere and Pearson's χ² test.

use std::f64::consts::{PI, TAU};

use glam::Vec3;

/// The i-th point of the R₃ sequence (Roberts 2018): an additive recurrence that fills the unit cube evenly.
pub fn r3(i: u32) -> [f32; 3] {
    const G: f64 = 1.220_744_084_605_76;
    [1, 2, 3].map(|k| ((0.5 + (i as f64 + 1.0) / G.powi(k)).fract() as f32).min(1.0 - f32::EPSILON))
}

/// A hash-based uniform number: independent points, which the χ² distribution assumes.
pub fn uniform(i: u32, dimension: u32) -> f32 {
    let mut x = ((i as u64) << 32 | dimension as u64).wrapping_add(0x9e37_79b9_7f4a_7c15);
    x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    ((x ^ (x >> 31)) >> 40) as f32 / (1u64 << 24) as f32
}

/// `n` directions of the upper hemisphere, from near the pole to near grazing.
pub fn directions(n: u32) -> impl Iterator<Item = Vec3> {
    (0..n).map(move |i| {
        let theta = (i as f32 + 0.5) / n as f32 * std::f32::consts::FRAC_PI_2;
        let phi = i as f32 * 2.4;
        Vec3::new(theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos())
    })
}

fn direction(z: f64, phi: f64) -> Vec3 {
    let r = (1.0 - z * z).max(0.0).sqrt();
    Vec3::new((r * phi.cos()) as f32, (r * phi.sin()) as f32, z as f32)
}

/// ∫ f dω over z in [z0, z1] and φ in [p0, p1] by the midpoint rule.
fn integrate_patch(f: &impl Fn(Vec3) -> f32, z: [f64; 2], p: [f64; 2], n: usize) -> f64 {
    let (dz, dp) = ((z[1] - z[0]) / n as f64, (p[1] - p[0]) / n as f64);
    let mut sum = 0.0;
    for i in 0..n {
        for j in 0..n {
            sum += f(direction(z[0] + (i as f64 + 0.5) * dz, p[0] + (j as f64 + 0.5) * dp)) as f64;
        }
    }
    sum * dz * dp
}

/// ∫ f dω over the upper hemisphere.
pub fn integrate_hemisphere(f: impl Fn(Vec3) -> f32) -> f32 {
    integrate_patch(&f, [0.0, 1.0], [0.0, TAU], 768) as f32
}

/// ∫ f dω over the sphere.
pub fn integrate_sphere(f: impl Fn(Vec3) -> f32) -> f32 {
    (integrate_patch(&f, [0.0, 1.0], [0.0, TAU], 768) + integrate_patch(&f, [-1.0, 0.0], [0.0, TAU], 768))
        as f32
}

/// Panics unless directions drawn by `sample` (three uniform numbers in, `None` where a sample is absorbed) follow
/// the solid-angle density `pdf`, whose integral may fall short of 1 by the absorbed share.
///
/// Pearson's test on a 20 × 40 grid (cos θ × φ), cells with fewer than 5 expected pooled, at a significance of
/// 1e-4 (low, since many such tests run: Šidák over 1000 keeps the whole at 10 %).
pub fn chi2_test(name: &str, sample: impl Fn([f32; 3]) -> Option<Vec3>, pdf: impl Fn(Vec3) -> f32) {
    const N: u32 = 1 << 17;
    const ROWS: usize = 20;
    const COLUMNS: usize = 40;
    let mut observed = vec![0.0; ROWS * COLUMNS + 1];
    for i in 0..N {
        let cell = match sample([uniform(i, 0), uniform(i, 1), uniform(i, 2)]) {
            Some(w) => {
                let row = ((w.z as f64 + 1.0) / 2.0 * ROWS as f64) as usize;
                let column = ((w.y as f64).atan2(w.x as f64).rem_euclid(TAU) / TAU * COLUMNS as f64) as usize;
                row.min(ROWS - 1) * COLUMNS + column.min(COLUMNS - 1)
            }
            None => ROWS * COLUMNS,
        };
        observed[cell] += 1.0;
    }
    let mut expected = Vec::with_capacity(observed.len());
    for row in 0..ROWS {
        let z = [row, row + 1].map(|r| r as f64 / ROWS as f64 * 2.0 - 1.0);
        for column in 0..COLUMNS {
            let p = [column, column + 1].map(|c| c as f64 / COLUMNS as f64 * TAU);
            expected.push(N as f64 * integrate_adaptive(&pdf, z, p, 0));
        }
    }
    let total: f64 = expected.iter().sum();
    assert!(total <= 1.004 * N as f64, "{name}: the density integrates to {}", total / N as f64);
    expected.push((N as f64 - total).max(0.0));
    let p_value = chi2_p_value(&observed, &expected);
    assert!(p_value > 1e-4, "{name}: χ² test failed, p = {p_value:.2e}");
}

/// Refines a patch until two resolutions agree; peaks of narrow lobes need it.
fn integrate_adaptive(f: &impl Fn(Vec3) -> f32, z: [f64; 2], p: [f64; 2], depth: u32) -> f64 {
    let (coarse, fine) = (integrate_patch(f, z, p, 4), integrate_patch(f, z, p, 8));
    if depth == 7 || (coarse - fine).abs() <= 1e-8 + 1e-4 * fine.abs() * (depth > 0) as u8 as f64 {
        return fine;
    }
    let (zm, pm) = ((z[0] + z[1]) / 2.0, (p[0] + p[1]) / 2.0);
    let halves = [[z[0], zm], [zm, z[1]]];
    halves
        .iter()
        .flat_map(|&z| [[p[0], pm], [pm, p[1]]].map(|p| integrate_adaptive(f, z, p, depth + 1)))
        .sum()
}

/// Survival function of Pearson's statistic; cells with fewer than 5 expected are pooled into one.
pub fn chi2_p_value(observed: &[f64], expected: &[f64]) -> f64 {
    let (mut statistic, mut cells) = (0.0, 0);
    let (mut pooled_observed, mut pooled_expected) = (0.0, 0.0);
    let mut add = |o: f64, e: f64| {
        statistic += (o - e) * (o - e) / e;
        cells += 1;
    };
    for (&o, &e) in observed.iter().zip(expected) {
        if e < 5.0 {
            pooled_observed += o;
            pooled_expected += e;
        } else {
            add(o, e);
        }
    }
    if pooled_expected >= 5.0 {
        add(pooled_observed, pooled_expected);
    } else if pooled_observed > pooled_expected + 25.0 {
        return 0.0; // samples where the density says there are none
    }
    if cells < 2 {
        return 1.0;
    }
    gamma_q((cells - 1) as f64 / 2.0, statistic / 2.0)
}

/// Regularised upper incomplete gamma function Q(a, x), by series or continued fraction (Abramowitz and Stegun 6.5).
fn gamma_q(a: f64, x: f64) -> f64 {
    if x <= 0.0 {
        return 1.0;
    }
    let front = (a * x.ln() - x - ln_gamma(a)).exp();
    if x < a + 1.0 {
        let (mut term, mut sum, mut n) = (1.0 / a, 1.0 / a, a);
        for _ in 0..2000 {
            n += 1.0;
            term *= x / n;
            sum += term;
            if term < sum * 1e-15 {
                break;
            }
        }
        1.0 - front * sum
    } else {
        let mut b = x + 1.0 - a;
        let mut c = 1e300;
        let mut d = 1.0 / b;
        let mut h = d;
        for i in 1..2000 {
            let an = -(i as f64) * (i as f64 - a);
            b += 2.0;
            d = 1.0 / (an * d + b);
            c = b + an / c;
            let delta = d * c;
            h *= delta;
            if (delta - 1.0).abs() < 1e-15 {
                break;
            }
        }
        front * h
    }
}

/// Stirling's series, after shifting the argument up to 10.
fn ln_gamma(x: f64) -> f64 {
    let shift: f64 = (0..).map(|k| x + k as f64).take_while(|&y| y < 10.0).map(f64::ln).sum();
    let y = if x < 10.0 { x + (10.0 - x).ceil() } else { x };
    let series = 1.0 / (12.0 * y) - 1.0 / (360.0 * y.powi(3)) + 1.0 / (1260.0 * y.powi(5));
    (y - 0.5) * y.ln() - y + 0.5 * TAU.ln() + series - shift
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gamma_functions_match_known_values() {
        assert!((ln_gamma(0.5) - 0.5 * PI.ln()).abs() < 1e-9);
        assert!((ln_gamma(10.0) - 362_880f64.ln()).abs() < 1e-9);
        // 95 % and 99.9 % quantiles of χ² with 1 and 10 degrees of freedom
        assert!((gamma_q(0.5, 3.841_459 / 2.0) - 0.05).abs() < 1e-6);
        assert!((gamma_q(5.0, 29.588_3 / 2.0) - 0.001).abs() < 1e-6);
    }

    #[test]
    fn chi2_notices_a_density_five_percent_off() {
        use crate::sampling::warp::uniform_sphere;
        let skewed = |w: Vec3| (1.0 + 0.1 * w.z) / (4.0 * std::f32::consts::PI);
        let result = std::panic::catch_unwind(|| {
            chi2_test("skewed", |[a, b, _]| Some(uniform_sphere(glam::Vec2::new(a, b))), skewed)
        });
        assert!(result.is_err());
    }
}
