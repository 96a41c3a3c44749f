//! Maps from the unit square (or cube) to shapes, each with its density and, where tests need it, its inverse.
//!
//! | map | measure | density |
//! |---|---|---|
//! | [`concentric_disk`] | area of the unit disk | 1/π |
//! | [`cosine_hemisphere`] | solid angle about +Z | cos θ / π |
//! | [`uniform_sphere`] | solid angle | 1/4π |
//! | [`uniform_cone`] | solid angle within `1 − cos θ ≤ h` of +Z | 1/(2πh) |
//! | [`uniform_ball`] | volume of the unit ball | 3/4π |
//! | [`uniform_triangle`] | barycentrics | 2 |
//!
//! Source: Pharr, Jakob, Humphreys, *Physically Based Rendering*, 4th ed., appendix A.5.

use std::f32::consts::{FRAC_PI_2, FRAC_PI_4, PI, TAU};

use glam::{Vec2, Vec3};

/// Shirley and Chiu's map, which keeps neighbours neighbours.
pub fn concentric_disk(u: Vec2) -> Vec2 {
    let p = 2.0 * u - Vec2::ONE;
    if p == Vec2::ZERO {
        return Vec2::ZERO;
    }
    let (r, phi) = if p.x.abs() > p.y.abs() {
        (p.x, FRAC_PI_4 * (p.y / p.x))
    } else {
        (p.y, FRAC_PI_2 - FRAC_PI_4 * (p.x / p.y))
    };
    let (sin, cos) = phi.sin_cos();
    r * Vec2::new(cos, sin)
}

/// Malley's method: the disk lifted to the hemisphere.
pub fn cosine_hemisphere(u: Vec2) -> Vec3 {
    let d = concentric_disk(u);
    d.extend((1.0 - d.length_squared()).max(0.0).sqrt())
}

pub fn cosine_hemisphere_pdf(cos_theta: f32) -> f32 {
    cos_theta.max(0.0) / PI
}

pub fn uniform_sphere(u: Vec2) -> Vec3 {
    let z = 1.0 - 2.0 * u.x;
    let r = (1.0 - z * z).max(0.0).sqrt();
    let (sin, cos) = (TAU * u.y).sin_cos();
    Vec3::new(r * cos, r * sin, z)
}

/// `height` = 1 − cos θ of the cone's edge: passed instead of the cosine, which has no digits left for thin cones.
pub fn uniform_cone(u: Vec2, height: f32) -> Vec3 {
    let h = u.x * height;
    let r = (h * (2.0 - h)).max(0.0).sqrt();
    let (sin, cos) = (TAU * u.y).sin_cos();
    Vec3::new(r * cos, r * sin, 1.0 - h)
}

pub fn uniform_cone_pdf(height: f32) -> f32 {
    1.0 / (TAU * height)
}

pub fn uniform_ball(u: Vec2, u_radius: f32) -> Vec3 {
    u_radius.cbrt() * uniform_sphere(u)
}

/// Barycentrics (b1, b2) of a uniform point; Heitz 2019, *A Low-Distortion Map Between Triangle and Square*.
pub fn uniform_triangle(u: Vec2) -> Vec2 {
    let (x, y) = (u.x, u.y);
    if x < y {
        let b1 = x / 2.0;
        Vec2::new(b1, y - b1)
    } else {
        let b2 = y / 2.0;
        Vec2::new(x - b2, b2)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::stats::{chi2_test, r3};

    fn mean(n: u32, f: impl Fn(u32) -> f32) -> f32 {
        ((0..n).map(|i| f(i) as f64).sum::<f64>() / n as f64) as f32
    }

    #[test]
    fn directions_follow_their_densities() {
        chi2_test(
            "cosine hemisphere",
            |[a, b, _]| Some(cosine_hemisphere(Vec2::new(a, b))),
            |w| cosine_hemisphere_pdf(w.z),
        );
        chi2_test("sphere", |[a, b, _]| Some(uniform_sphere(Vec2::new(a, b))), |_| 1.0 / (4.0 * PI));
        chi2_test(
            "cone",
            |[a, b, _]| Some(uniform_cone(Vec2::new(a, b), 0.75)),
            |w| if w.z >= 0.25 { uniform_cone_pdf(0.75) } else { 0.0 },
        );
    }

    #[test]
    fn ball_has_uniform_moments() {
        let n = 1 << 14;
        let points = |i| {
            let [a, b, c] = r3(i);
            uniform_ball(Vec2::new(a, b), c)
        };
        assert!((mean(n, |i| points(i).length_squared()) - 0.6).abs() < 2e-3);
        assert!(mean(n, |i| points(i).x).abs() < 2e-3);
    }

    #[test]
    fn disk_and_triangle_have_uniform_moments() {
        let n = 1 << 14;
        let u = |i| {
            let [a, b, _] = r3(i);
            Vec2::new(a, b)
        };
        assert!((mean(n, |i| concentric_disk(u(i)).length_squared()) - 0.5).abs() < 1e-3);
        assert!((mean(n, |i| uniform_triangle(u(i)).x) - 1.0 / 3.0).abs() < 1e-3);
        let second = mean(n, |i| uniform_triangle(u(i)).y.powi(2));
        assert!((second - 1.0 / 6.0).abs() < 3e-3, "{second}");
    }
}
