//! Geometry that is numerically broken, made sound.

use glam::{Vec3, Vec4};

/// Leaves out triangles with a corner that is not finite, and says how many. Such positions are then unused, and are moved
/// onto another vertex so that bounds over all positions stay right.
pub fn drop_non_finite(points: &mut [Vec3], triangles: &mut Vec<[u32; 3]>) -> usize {
    let before = triangles.len();
    triangles.retain(|t| t.iter().all(|&v| points.get(v as usize).is_some_and(|p| p.is_finite())));
    let anywhere = points.iter().copied().find(|p| p.is_finite()).unwrap_or(Vec3::ZERO);
    points.iter_mut().filter(|p| !p.is_finite()).for_each(|p| *p = anywhere);
    before - triangles.len()
}

/// Makes normals unit vectors; those that cannot be, which are counted, are replaced by the area-weighted mean of the
/// triangles around.
pub fn normals(normals: &mut [Vec3], points: &[Vec3], triangles: &[[u32; 3]]) -> usize {
    let mut broken = Vec::new();
    for (v, normal) in normals.iter_mut().enumerate() {
        match unit(*normal) {
            Some(unit) => *normal = unit,
            None => broken.push(v),
        }
    }
    if broken.is_empty() {
        return 0;
    }
    let mut sums = vec![Vec3::ZERO; points.len()];
    for triangle in triangles {
        let corner = |i: usize| points.get(triangle[i] as usize).copied().unwrap_or_default();
        let area = (corner(1) - corner(0)).cross(corner(2) - corner(0));
        for &v in triangle {
            if let Some(sum) = sums.get_mut(v as usize) {
                *sum += area;
            }
        }
    }
    for &v in &broken {
        normals[v] = sums.get(v).copied().and_then(unit).unwrap_or(Vec3::Z);
    }
    broken.len()
}

/// Makes tangents unit vectors with w = ±1; those that cannot be, which are counted, point anywhere across the normal.
pub fn tangents(tangents: &mut [Vec4], normals: &[Vec3]) -> usize {
    let mut broken = 0;
    for (tangent, normal) in tangents.iter_mut().zip(normals) {
        let w = if tangent.w < 0.0 { -1.0 } else { 1.0 };
        let direction = unit(tangent.truncate()).unwrap_or_else(|| {
            broken += 1;
            normal.any_orthonormal_vector()
        });
        *tangent = direction.extend(w);
    }
    broken
}

/// `v` at unit length, whatever finite length it has.
fn unit(v: Vec3) -> Option<Vec3> {
    // Scaled first: the square of a tiny or huge length leaves the range of f32.
    let largest = v.abs().max_element();
    (largest > 0.0 && largest.is_finite()).then(|| v / largest).and_then(Vec3::try_normalize)
}
