//! Gauss–Legendre quadrature, for the tables of directional albedo.

/// Nodes and weights on [0, 1]; Newton's method on the Legendre polynomial of degree `N`.
pub fn gauss_legendre<const N: usize>() -> [(f32, f32); N] {
    let n = N as f64;
    std::array::from_fn(|i| {
        let mut x = (std::f64::consts::PI * (i as f64 + 0.75) / (n + 0.5)).cos();
        let mut derivative = 1.0;
        for _ in 0..8 {
            let (mut before, mut p) = (1.0, x);
            for k in 2..=N {
                let k = k as f64;
                (before, p) = (p, ((2.0 * k - 1.0) * x * p - (k - 1.0) * before) / k);
            }
            derivative = n * (x * p - before) / (x * x - 1.0);
            x -= p / derivative;
        }
        let weight = 1.0 / ((1.0 - x * x) * derivative * derivative);
        (((1.0 - x) / 2.0) as f32, weight as f32)
    })
}

/// The cell of a table of `n` evenly spaced nodes over [0, 1] that `x` falls in, and where in it.
pub fn cell(x: f32, n: usize) -> (usize, f32) {
    let t = x.clamp(0.0, 1.0) * (n - 1) as f32;
    let i = (t as usize).min(n - 2);
    (i, t - i as f32)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn degree_twice_n_less_one_is_exact() {
        let rule = gauss_legendre::<5>();
        for degree in 0..10 {
            let integral: f32 = rule.iter().map(|(x, w)| w * x.powi(degree)).sum();
            assert!((integral - 1.0 / (degree as f32 + 1.0)).abs() < 1e-6, "x^{degree}: {integral}");
        }
    }
}
