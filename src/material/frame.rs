//! The frame in which a surface scatters: about the interpolated normal, bent by a normal map.

use glam::Vec3;

use super::SurfacePoint;
use crate::geometry::Frame;

/// The least cosine between the shading normal and the direction a surface is seen from: a normal that leans
/// further away would show a side that cannot be seen, as black specks.
const LEAST_COSINE: f32 = 1e-3;

/// What a surface does decides how far its normal may lean, and to which side it is turned.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// Scatters everywhere on the side of `wo`, to which the frame is turned.
    Matte,
    /// As `Matte`, and mirrors: the mirror direction must leave the surface, or what it would show turns black.
    Glossy,
    /// Bounds a medium: the frame stays on the outside.
    Boundary,
}

/// `map` is the tangent-space normal, not necessarily of unit length. Returned with the frame: the normal before it was
/// made to mirror outside, which matte light keeps to, in the frame.
pub fn shading_frame(point: &SurfacePoint, map: Option<Vec3>, wo: Vec3, side: Side) -> (Frame, Vec3) {
    let mapped = map.and_then(|map| bend(point, map)).unwrap_or(point.ns);
    let back = wo.dot(point.ng) < 0.0;
    let (ng, n) = if back { (-point.ng, -mapped) } else { (point.ng, mapped) };
    let n = lean_towards(n, wo);
    match side {
        Side::Matte => (Frame::from_z(n), Vec3::Z),
        Side::Boundary => (Frame::from_z(if back { -n } else { n }), Vec3::Z),
        Side::Glossy => {
            let glossy = keep_mirrored_outside(n, ng, wo);
            let frame = Frame::from_z(glossy);
            (frame, if glossy == n { Vec3::Z } else { frame.to_local(n) })
        }
    }
}

/// The map's normal in the frame of the interpolated normal and the tangent (glTF 2.0, 3.7.2.1: bitangent =
/// cross(normal, tangent) · w). The tangent is used as it is interpolated, as MikkTSpace demands.
fn bend(point: &SurfacePoint, map: Vec3) -> Option<Vec3> {
    let tangent = point.tangent.truncate();
    if tangent == Vec3::ZERO {
        return None;
    }
    let bitangent = point.tangent.w * point.ns.cross(tangent);
    (map.x * tangent + map.y * bitangent + map.z * point.ns).try_normalize()
}

/// The normal nearest to `n` that `wo` sees.
fn lean_towards(n: Vec3, wo: Vec3) -> Vec3 {
    let cos = n.dot(wo);
    if cos >= LEAST_COSINE {
        return n;
    }
    (n + (LEAST_COSINE - cos) * wo).try_normalize().unwrap_or(wo)
}

/// The normal between `ng` and `n`, nearest to `n`, that mirrors `wo` to this side of the surface, if only just.
///
/// In the plane of both, at angle φ from `ng` towards `n`, with wo = (z, x) there, the mirrored direction has the height
///
/// ```text
/// wo'·ng = z cos 2φ + x sin 2φ = √(z² + x²) cos(2φ − atan2(x, z))
/// ```
///
/// above the surface, which falls to the threshold at 2φ = atan2(x, z) + acos(threshold / √(z² + x²)). The idea is that
/// of Keller et al. 2017 (*The Iray Light Transport Simulation and Rendering System*, A.3); Cycles does the same.
fn keep_mirrored_outside(n: Vec3, ng: Vec3, wo: Vec3) -> Vec3 {
    let z = wo.dot(ng);
    let threshold = (0.9 * z).min(0.01);
    let height = 2.0 * n.dot(wo) * n.dot(ng) - z;
    if height >= threshold {
        return n;
    }
    let Some(across) = (n - n.dot(ng) * ng).try_normalize() else { return n };
    let x = wo.dot(across);
    let phi = 0.5 * (x.atan2(z) + (threshold / z.hypot(x)).clamp(-1.0, 1.0).acos());
    let (sin, cos) = phi.sin_cos();
    cos * ng + sin * across
}

#[cfg(test)]
mod tests {
    use glam::{Vec2, Vec4};

    use super::*;

    fn point(ns: Vec3, tangent: Vec4) -> SurfacePoint {
        SurfacePoint {
            position: Vec3::ZERO,
            error: Vec3::ZERO,
            ng: Vec3::Z,
            ns,
            tangent,
            uvs: [Vec2::ZERO; 2],
            color: Vec4::ONE,
        }
    }

    #[test]
    fn normal_map_bends_along_tangent_and_bitangent() {
        let p = point(Vec3::Z, Vec4::new(1.0, 0.0, 0.0, 1.0));
        let z = |map, wo| shading_frame(&p, Some(map), wo, Side::Matte).0.z;
        assert!(z(Vec3::new(0.6, 0.0, 0.8), Vec3::Z).abs_diff_eq(Vec3::new(0.6, 0.0, 0.8), 1e-6));
        assert!(z(Vec3::new(0.0, 0.6, 0.8), Vec3::Z).abs_diff_eq(Vec3::new(0.0, 0.6, 0.8), 1e-6));
        let mirrored = point(Vec3::Z, Vec4::new(1.0, 0.0, 0.0, -1.0));
        let z = shading_frame(&mirrored, Some(Vec3::new(0.0, 0.6, 0.8)), Vec3::Z, Side::Matte).0.z;
        assert!(z.abs_diff_eq(Vec3::new(0.0, -0.6, 0.8), 1e-6));
    }

    #[test]
    fn back_faces_reverse_the_mapped_normal_unless_they_bound_a_medium() {
        let p = point(Vec3::Z, Vec4::new(1.0, 0.0, 0.0, 1.0));
        let map = Some(Vec3::new(0.6, 0.0, 0.8));
        let back = -Vec3::Z;
        assert!(shading_frame(&p, map, back, Side::Matte).0.z.abs_diff_eq(Vec3::new(-0.6, 0.0, -0.8), 1e-6));
        assert!(shading_frame(&p, map, back, Side::Boundary).0.z.abs_diff_eq(Vec3::new(0.6, 0.0, 0.8), 1e-6));
    }

    #[test]
    fn the_frame_is_always_seen_from_its_front() {
        for (ns, wo) in [
            (Vec3::new(0.8, 0.0, 0.6), Vec3::new(-0.9, 0.0, 0.1).normalize()),
            (Vec3::new(0.0, -1.0, 1e-3).normalize(), Vec3::new(0.0, 1.0, 1e-4).normalize()),
        ] {
            let z = shading_frame(&point(ns, Vec4::ZERO), None, wo, Side::Matte).0.z;
            assert!(z.dot(wo) > 0.0 && (z.length() - 1.0).abs() < 1e-5);
        }
    }

    #[test]
    fn glossy_normals_mirror_to_the_outside_and_lean_no_further_than_they_must() {
        use crate::sampling::stats::directions;
        for wo in directions(12) {
            for n in directions(12) {
                let p = point(n, Vec4::ZERO);
                let leaned = lean_towards(n, wo);
                let z = shading_frame(&p, None, wo, Side::Glossy).0.z;
                let height = |n: Vec3| 2.0 * n.dot(wo) * n.z - wo.z;
                let threshold = (0.9 * wo.z).min(0.01);
                assert!(height(z) > threshold - 1e-4, "{n} from {wo}: {}", height(z));
                if height(leaned) >= threshold {
                    assert_eq!(z, leaned);
                } else {
                    assert!((height(z) - threshold).abs() < 1e-4, "{n} from {wo}: further than need be");
                }
            }
        }
    }
}
