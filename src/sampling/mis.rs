//! Multiple importance sampling: how much a sample counts that another strategy could have drawn, too.
//!
//! Source: Veach 1997, *Robust Monte Carlo Methods for Light Transport Simulation*, section 9.2.

/// Weight of a sample of density `pdf_a` beside a strategy of density `pdf_b`: the power heuristic with exponent 2,
/// one sample each. The weights of the two strategies sum to 1.
///
/// An infinite density (delta) outweighs a finite one; where both are infinite, or both 0, neither is preferred or
/// counted: ½ and 0.
pub fn power_heuristic(pdf_a: f32, pdf_b: f32) -> f32 {
    if pdf_a <= 0.0 {
        return 0.0;
    }
    if pdf_a == f32::INFINITY && pdf_b == f32::INFINITY {
        return 0.5;
    }
    // The ratio first: squares of densities overflow.
    let ratio = pdf_b / pdf_a;
    1.0 / (1.0 + ratio * ratio)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_sum_to_one() {
        for (a, b) in [(1.0, 1.0), (0.3, 7.0), (1e30, 1e25), (1e-30, 2e-30), (f32::INFINITY, 2.0), (3.0, 0.0)]
        {
            let sum = power_heuristic(a, b) + power_heuristic(b, a);
            assert!((sum - 1.0).abs() < 1e-6, "{a}, {b}: {sum}");
        }
        assert!((power_heuristic(2.0, 1.0) - 0.8).abs() < 1e-6);
    }

    #[test]
    fn limits_are_finite() {
        assert_eq!(power_heuristic(0.0, 0.0), 0.0);
        assert_eq!(power_heuristic(0.0, f32::INFINITY), 0.0);
        assert_eq!(power_heuristic(f32::INFINITY, 1.0), 1.0);
        assert_eq!(power_heuristic(1.0, f32::INFINITY), 0.0);
        assert_eq!(power_heuristic(f32::INFINITY, f32::INFINITY), 0.5);
    }
}
