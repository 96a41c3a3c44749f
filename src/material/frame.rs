//! The frame in which a surface scatters: about the interpolated normal, bent by a normal map.

use glam::Vec3;

use super::SurfacePoint;
use crate::geometry::Frame;

/// The least cosine between the shading normal and the direction a surface is seen from: a normal that leans
/// further away would show a side that cannot be seen, as black specks.
const LEAST_COSINE: f32 = 1e-3;

/// `map` is the tangent-space normal, not necessarily of unit length. With `oriented`, the frame is turned to the side of
/// the surface on which `wo` lies; otherwise it stays on the outside.
pub fn shading_frame(point: &SurfacePoint, map: Option<Vec3>, wo: Vec3, oriented: bool) -> Frame {
    let mapped = map.and_then(|map| bend(point, map)).unwrap_or(point.ns);
    let back = wo.dot(point.ng) < 0.0;
    let outward = if back { -mapped } else { mapped };
    let visible = lean_towards(outward, wo);
    Frame::from_z(if back && !oriented { -visible } else { visible })
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
        let z = |map, wo| shading_frame(&p, Some(map), wo, true).z;
        assert!(z(Vec3::new(0.6, 0.0, 0.8), Vec3::Z).abs_diff_eq(Vec3::new(0.6, 0.0, 0.8), 1e-6));
        assert!(z(Vec3::new(0.0, 0.6, 0.8), Vec3::Z).abs_diff_eq(Vec3::new(0.0, 0.6, 0.8), 1e-6));
        let mirrored = point(Vec3::Z, Vec4::new(1.0, 0.0, 0.0, -1.0));
        let z = shading_frame(&mirrored, Some(Vec3::new(0.0, 0.6, 0.8)), Vec3::Z, true).z;
        assert!(z.abs_diff_eq(Vec3::new(0.0, -0.6, 0.8), 1e-6));
    }

    #[test]
    fn back_faces_reverse_the_mapped_normal_unless_they_bound_a_medium() {
        let p = point(Vec3::Z, Vec4::new(1.0, 0.0, 0.0, 1.0));
        let map = Some(Vec3::new(0.6, 0.0, 0.8));
        let back = -Vec3::Z;
        assert!(shading_frame(&p, map, back, true).z.abs_diff_eq(Vec3::new(-0.6, 0.0, -0.8), 1e-6));
        assert!(shading_frame(&p, map, back, false).z.abs_diff_eq(Vec3::new(0.6, 0.0, 0.8), 1e-6));
    }

    #[test]
    fn the_frame_is_always_seen_from_its_front() {
        for (ns, wo) in [
            (Vec3::new(0.8, 0.0, 0.6), Vec3::new(-0.9, 0.0, 0.1).normalize()),
            (Vec3::new(0.0, -1.0, 1e-3).normalize(), Vec3::new(0.0, 1.0, 1e-4).normalize()),
        ] {
            let z = shading_frame(&point(ns, Vec4::ZERO), None, wo, true).z;
            assert!(z.dot(wo) > 0.0 && (z.length() - 1.0).abs() < 1e-5);
        }
    }
}
