//! Where the next ray starts, so that it does not meet the surface that it leaves.
//!
//! A computed hit point is off the true surface by a rounding error that grows with its coordinates. Forward error
//! analysis bounds it in each axis (Pharr, Jakob, Humphreys, *Physically Based Rendering*, 4th ed., section 6.8): a
//! value that went through n roundings is off by at most [`gamma`]`(n)` of the sum of the magnitudes that went in. The
//! ray then starts outside the box of that error, on the side to which it goes, so the distance scales with the scene.
//!
//! Each function takes what the point was computed from and returns the absolute error per axis.

use glam::{Affine3A, Mat3A, Vec3, Vec3A};

/// Relative error of one rounding in `f32`: half a unit in the last place.
const ROUNDING: f32 = f32::EPSILON / 2.0;

/// Bound on the relative error of n roundings in a row: nε / (1 − nε).
pub const fn gamma(n: u32) -> f32 {
    let error = n as f32 * ROUNDING;
    error / (1.0 - error)
}

/// Of b₀p₀ + b₁p₁ + b₂p₂ with b₀ = 1 − b₁ − b₂; `u`, `v` are b₁, b₂. In the space of the vertices.
#[inline]
pub fn triangle_error([p0, p1, p2]: [Vec3A; 3], u: f32, v: f32) -> Vec3A {
    let sum = (1.0 - u - v).abs() * p0.abs() + u.abs() * p1.abs() + v.abs() * p2.abs();
    gamma(7) * sum + triangle_test_error([p0, p1, p2])
}

/// The next ray is tested in coordinates relative to its origin, so its t has an error of the size of the triangle, which
/// matters where the hit point is much nearer to the world's origin than the triangle is large.
#[inline]
fn triangle_test_error([p0, p1, p2]: [Vec3A; 3]) -> Vec3A {
    gamma(3) * (p0.max(p1).max(p2) - p0.min(p1).min(p2))
}

/// Of a point on a sphere computed as center + radius · normalize(p − center).
pub fn sphere_error(center: Vec3, radius: f32, p: Vec3) -> Vec3 {
    gamma(5) * (p - center).abs().min(Vec3::splat(radius)) + gamma(2) * p.abs()
}

/// Of origin + a·u + b·v.
pub fn quad_error(origin: Vec3, u: Vec3, v: Vec3, a: f32, b: f32) -> Vec3 {
    gamma(4) * (origin.abs() + (a * u).abs() + (b * v).abs())
}

/// Of the point `p`, itself off by `error`, when an instance takes it to the world, and of the next ray's origin when it
/// comes back to be tested in the instance's space. `to_object` is the inverse of `to_world`.
#[inline]
pub fn instance_error(to_world: &Affine3A, to_object: &Affine3A, p: Vec3A, error: Vec3A) -> Vec3A {
    let world = to_world.transform_point3a(p);
    let back = absolute(to_object) * world.abs() + to_object.translation.abs();
    let object = (1.0 + gamma(3)) * error + gamma(4) * back + gamma(3) * p.abs();
    absolute(to_world) * object + gamma(3) * to_world.translation.abs()
}

/// |M|, M the linear part.
#[inline]
fn absolute(m: &Affine3A) -> Mat3A {
    let m = &m.matrix3;
    Mat3A::from_cols(m.x_axis.abs(), m.y_axis.abs(), m.z_axis.abs())
}

/// The origin of a ray from `p`, known up to `error`, that leaves along `w`: beyond the error box, along the geometric
/// normal `ng` (unit, either side) on the side of `w`.
pub fn offset_origin(p: Vec3, error: Vec3, ng: Vec3, w: Vec3) -> Vec3 {
    let n = if w.dot(ng) < 0.0 { -ng } else { ng };
    let offset = ng.abs().dot(error) * n;
    // Rounded away from the surface, or the sum may fall back into the box.
    let away = |sum: f32, offset: f32| match offset {
        o if o > 0.0 => sum.next_up(),
        o if o < 0.0 => sum.next_down(),
        _ => sum,
    };
    let sum = p + offset;
    Vec3::new(away(sum.x, offset.x), away(sum.y, offset.y), away(sum.z, offset.z))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{
        Ray,
        quad::Quad,
        sphere,
        triangle::{self, Shear},
    };
    use glam::{Quat, Vec2};
    use proptest::prelude::*;

    use crate::sampling::warp::uniform_sphere;

    fn triangle_error(corners: [Vec3; 3], u: f32, v: f32) -> Vec3 {
        super::triangle_error(corners.map(Vec3A::from), u, v).into()
    }

    fn unit() -> impl Strategy<Value = Vec3> {
        (0f32..1.0, 0f32..1.0).prop_map(|(a, b)| uniform_sphere(Vec2::new(a, b)))
    }

    /// Lengths over many orders of magnitude, between 10^`low` and 10^`high`.
    fn length(low: f32, high: f32) -> impl Strategy<Value = f32> {
        (low..high).prop_map(|e| 10f32.powf(e))
    }

    /// A direction on the side of `n`, often grazing.
    fn leaving(n: Vec3, w: Vec3, grazing: f32) -> Vec3 {
        let tangent = w - w.dot(n) * n;
        (tangent.normalize_or_zero() + grazing * n).normalize_or(n)
    }

    fn config() -> ProptestConfig {
        ProptestConfig {
            cases: 4000,
            failure_persistence: None,
            rng_seed: prop::test_runner::RngSeed::Fixed(7),
            ..Default::default()
        }
    }

    proptest! {
        #![proptest_config(config())]

        /// A ray that leaves a sphere outwards misses it; one that goes in meets the far side, a chord away.
        #[test]
        fn spheres_are_left(
            radius in length(-3.0, 5.0), place in unit(), distance in length(-3.0, 5.0),
            from in unit(), w in unit(), grazing in length(-3.0, 1.0),
        ) {
            let center = place * distance;
            // a hit as a renderer would find it: from outside, towards somewhere inside
            let ray = Ray::new(center + from * radius * 3.0, center + 0.9 * radius * w - (center + from * radius * 3.0));
            let Some(t) = sphere::intersect(&ray, center, radius) else { return Ok(()) };
            let n = (ray.at(t) - center).normalize();
            let p = center + radius * n;
            let error = sphere_error(center, radius, p);
            // where floats are coarser than the sphere, there is no side to be on
            prop_assume!(error.length() < 0.01 * grazing.min(1.0) * radius);
            for side in [n, -n] {
                let out = leaving(side, w, grazing);
                let origin = offset_origin(p, error, n, out);
                prop_assert_eq!((origin - center).length() > radius, side == n, "on the wrong side");
                let hit = sphere::intersect(&Ray::new(origin, out), center, radius);
                if side == n {
                    prop_assert_eq!(hit, None);
                } else {
                    // (deeper inside, a grazing chord is longer)
                    let chord = 2.0 * radius * out.dot(side);
                    let t = hit.expect("inside");
                    prop_assert!(t > 0.99 * chord, "{} instead of {}", t, chord);
                }
            }
        }

        /// A ray that leaves a triangle, on either side, does not meet it again.
        #[test]
        fn triangles_are_left(
            place in unit(), distance in length(-3.0, 4.0), size in length(-2.0, 3.0), a in unit(), b in unit(),
            u in 0f32..1.0, v in 0f32..1.0, from in unit(), w in unit(), grazing in length(-3.0, 1.0),
        ) {
            let corners = [place * distance, place * distance + size * a, place * distance + size * b];
            prop_assume!(a.cross(b).length() > 0.02 && size > 1e-4 * distance);
            let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
            let target = corners[0] + u * (corners[1] - corners[0]) + v * (corners[2] - corners[0]);
            let origin = target + 2.0 * size * from;
            let ray = Ray::new(origin, target - origin);
            let Some(hit) = triangle::intersect(&ray, &Shear::new(ray.direction), corners) else { return Ok(()) };
            let p = (1.0 - hit.u - hit.v) * corners[0] + hit.u * corners[1] + hit.v * corners[2];
            let ng = (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalize();
            for side in [ng, -ng] {
                let out = leaving(side, w, grazing);
                let origin = offset_origin(p, triangle_error(corners, hit.u, hit.v), ng, out);
                prop_assert!((origin - p).length() < 1e-5 * (size + distance), "far off: {}", (origin - p).length());
                let again = triangle::intersect(&Ray::new(origin, out), &Shear::new(out), corners);
                prop_assert_eq!(again, None);
            }
        }

        /// The same through an instance: out to the world, and back into the triangle's space.
        #[test]
        fn instanced_triangles_are_left(
            place in unit(), distance in length(-2.0, 4.0), scale in length(-2.0, 2.0), axis in unit(), angle in 0f32..6.0,
            stretch in 0.3f32..3.0, mirrored: bool, a in unit(), b in unit(), shift in unit(),
            u in 0f32..0.5, v in 0f32..0.5, w in unit(), grazing in length(-2.0, 1.0),
        ) {
            let corners = [shift, shift + a, shift + b];
            prop_assume!(a.cross(b).length() > 0.02 && scale > 1e-3 * distance);
            let scale = scale * Vec3::new(1.0, stretch, if mirrored { -1.0 } else { 1.0 });
            let to_world = Affine3A::from_scale_rotation_translation(
                scale, Quat::from_axis_angle(axis, angle), place * distance);
            let to_object = to_world.inverse();
            let p = (1.0 - u - v) * corners[0] + u * corners[1] + v * corners[2];
            let error = triangle_error(corners, u, v);
            let error = Vec3::from(instance_error(&to_world, &to_object, p.into(), error.into()));
            let p = to_world.transform_point3(p);
            let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
            let ng = Vec3::from(to_object.matrix3.transpose() * glam::Vec3A::from(normal)).normalize();
            for side in [ng, -ng] {
                let out = leaving(side, w, grazing);
                let origin = offset_origin(p, error, ng, out);
                let back = Ray::new(to_object.transform_point3(origin), to_object.transform_vector3(out));
                prop_assert_eq!(triangle::intersect(&back, &Shear::new(back.direction), corners), None);
            }
        }

        #[test]
        fn quads_are_left(
            place in unit(), distance in length(-3.0, 4.0), size in length(-2.0, 3.0), a in unit(), b in unit(),
            from in unit(), x in 0f32..1.0, y in 0f32..1.0, w in unit(), grazing in length(-3.0, 1.0),
        ) {
            let (corner, u, v) = (place * distance, size * a, size * b);
            prop_assume!(a.cross(b).length() > 0.02 && size > 1e-4 * distance);
            let quad = Quad::new(corner, u, v, false).expect("has an area");
            let target = corner + x * u + y * v;
            let origin = target + 2.0 * size * from;
            let Some(hit) = quad.intersect(&Ray::new(origin, target - origin)) else { return Ok(()) };
            let p = corner + hit.a * u + hit.b * v;
            let ng = u.cross(v).normalize();
            for side in [ng, -ng] {
                let out = leaving(side, w, grazing);
                let origin = offset_origin(p, quad_error(corner, u, v, hit.a, hit.b), ng, out);
                prop_assert_eq!(quad.intersect(&Ray::new(origin, out)), None);
            }
        }
    }

    /// The bound is a bound, and not a hundred times too wide.
    #[test]
    fn triangle_error_holds_and_is_not_idle() {
        use crate::sampling::stats::uniform;
        let mut largest = 0f64;
        for i in 0..20_000 {
            let corners = [0, 1, 2]
                .map(|k| 100.0 * Vec3::new(uniform(i, 3 * k), uniform(i, 3 * k + 1), uniform(i, 3 * k + 2)));
            let (u, v) = (0.5 * uniform(i, 10), 0.5 * uniform(i, 11));
            let p = (1.0 - u - v) * corners[0] + u * corners[1] + v * corners[2];
            let [a, b, c] = corners.map(Vec3::as_dvec3);
            let exact = a + u as f64 * (b - a) + v as f64 * (c - a);
            let error = (p.as_dvec3() - exact).abs() / triangle_error(corners, u, v).as_dvec3();
            largest = largest.max(error.max_element());
        }
        assert!(largest < 1.0 && largest > 0.05, "{largest}");
    }

    #[test]
    fn origin_moves_off_on_the_side_of_the_direction() {
        let (p, error) = (Vec3::new(1.0, -1e4, 0.0), Vec3::new(1e-7, 1e-3, 0.0));
        let up = offset_origin(p, error, Vec3::Y, Vec3::new(1.0, 0.1, 0.0));
        let down = offset_origin(p, error, Vec3::Y, Vec3::new(1.0, -0.1, 0.0));
        assert!(up.y > p.y && down.y < p.y && up.x == p.x && up.z == p.z);
        // An error below the spacing of floats still moves it.
        assert!(offset_origin(Vec3::Y, Vec3::splat(1e-12), Vec3::Y, Vec3::Y).y > 1.0);
    }
}
