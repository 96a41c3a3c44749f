//! Ray–sphere test that stays exact for large, tiny and far spheres.
//!
//! The quadratic a t² + 2 b t + c = 0 of the textbook loses the sphere twice: its discriminant b² − ac subtracts
//! numbers of the size of the distance squared, and its small root subtracts nearly equal numbers. Instead
//! (Haines, Günther, Akenine-Möller, "Precision Improvements for Ray/Sphere Intersection", *Ray Tracing Gems*, ch. 7):
//!
//! ```text
//! f = o − center,  b = −f·d,  a = d·d
//! Δ = r² − |f + (b/a) d|²              the squared half chord, from the foot of the perpendicular
//! q = b + sign(b) √(a Δ),  t = c/q and q/a,  c = f·f − r²
//! ```
//!
//! Evaluated in `f64`, in which `o − center` is exact: spheres are few per ray, so this costs little, and the sign of c
//! (is the origin inside?) is right for every origin that `f32` can name, which keeps offset rays from hitting the sphere they left.

use glam::Vec3;

use super::Ray;

/// Both distances, near before far, unclipped; `None` where the line misses. `radius` is positive.
#[inline(always)]
pub fn intersect_line(ray: &Ray, center: Vec3, radius: f32) -> Option<[f32; 2]> {
    let f = ray.origin.as_dvec3() - center.as_dvec3();
    let d = ray.direction.as_dvec3();
    let r = radius as f64;
    let a = d.length_squared();
    let b = -f.dot(d);
    let foot = f + (b / a) * d;
    let half_chord2 = r * r - foot.length_squared();
    // (a negative or NaN half chord: missed, or a direction of length zero)
    if !(half_chord2 >= 0.0 && a > 0.0) {
        return None;
    }
    let c = f.length_squared() - r * r;
    let q = b + (a * half_chord2).sqrt().copysign(b);
    let roots = if q == 0.0 { [0.0, 0.0] } else { [c / q, q / a] };
    let [near, far] = if b >= 0.0 { roots } else { [roots[1], roots[0]] };
    Some([near as f32, far as f32])
}

/// The nearest hit with t in (`t_min`, `t_max`), from outside or inside.
pub fn intersect(ray: &Ray, center: Vec3, radius: f32) -> Option<f32> {
    intersect_line(ray, center, radius)?.into_iter().find(|&t| t > ray.t_min && t < ray.t_max)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn meets_the_poles() {
        let ray = Ray::new(Vec3::new(0.0, 0.0, 5.0), Vec3::new(0.0, 0.0, -2.0));
        assert_eq!(intersect_line(&ray, Vec3::ZERO, 1.0), Some([2.0, 3.0]));
        let inside = Ray::new(Vec3::new(0.0, 0.0, 0.5), Vec3::new(0.0, 0.0, -1.0));
        assert_eq!(intersect(&inside, Vec3::ZERO, 1.0), Some(1.5));
        let behind = Ray::new(Vec3::new(0.0, 0.0, -5.0), Vec3::new(0.0, 0.0, -1.0));
        assert_eq!(intersect(&behind, Vec3::ZERO, 1.0), None);
        assert_eq!(intersect(&Ray::new(Vec3::ZERO, Vec3::ZERO), Vec3::ZERO, 1.0), None);
    }

    #[test]
    fn interval_is_open() {
        let mut ray = Ray::new(Vec3::new(0.0, 0.0, 5.0), Vec3::NEG_Z);
        ray.t_min = 4.0;
        assert_eq!(intersect(&ray, Vec3::ZERO, 1.0), Some(6.0));
        ray.t_max = 6.0;
        assert_eq!(intersect(&ray, Vec3::ZERO, 1.0), None);
    }

    /// Grazing and central rays at spheres of every size and distance: the impact parameter h decides the
    /// half chord √(r² − h²), and so whether and where they meet.
    #[test]
    fn half_chord_matches_the_impact_parameter() {
        for radius in [1e-3, 0.5, 1000.0, 1e5] {
            for distance in [1.5f32, 1e2, 1e4] {
                for share in [0.0, 0.5, 0.99, 1.01] {
                    let h = radius * share;
                    let ray = Ray::new(Vec3::new(h, 0.0, distance * radius), Vec3::NEG_Z);
                    let got = intersect(&ray, Vec3::ZERO, radius);
                    if share > 1.0 {
                        assert_eq!(got, None, "r {radius}, distance {distance}");
                        continue;
                    }
                    let expected =
                        ray.origin.z as f64 - ((radius as f64).powi(2) - (h as f64).powi(2)).sqrt();
                    let t = got.expect("aimed inside the outline") as f64;
                    assert!(
                        (t / expected - 1.0).abs() < 1e-7,
                        "r {radius}, h {h}: {t} instead of {expected}"
                    );
                }
            }
        }
    }
}
