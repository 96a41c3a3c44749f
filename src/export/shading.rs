//! Where interpolated normals and the triangles under them part: renderers differ there.

use glam::{Affine3A, Vec3};

use crate::world::Mesh;

/// Cosine of the angle between a normal at a corner and the triangle's (8°) from which a difference is told.
const BENT: f32 = 0.99;

/// Whether a normal at some corner leans further than 8° from its triangle's. Triangles without area do not count.
pub fn is_bent(mesh: &Mesh) -> bool {
    mesh.triangles.iter().any(|triangle| {
        let [a, b, c] = triangle.map(|v| mesh.positions.get(v as usize).copied().unwrap_or(Vec3::NAN));
        let Some(face) = (b - a).cross(c - a).try_normalize() else { return false };
        triangle.iter().filter_map(|&v| mesh.normals.get(v as usize)).any(|normal| normal.dot(face) < BENT)
    })
}

/// Whether a placement changes angles: by scales that are not alike, or by a shear.
pub fn is_uneven(to_world: &Affine3A) -> bool {
    let [x, y, z] = [to_world.x_axis, to_world.y_axis, to_world.z_axis];
    let scale = x.length_squared();
    let differs = |a: f32| a.abs() > 1e-3 * scale;
    differs(y.length_squared() - scale)
        || differs(z.length_squared() - scale)
        || differs(x.dot(y))
        || differs(y.dot(z))
        || differs(z.dot(x))
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Quat;

    #[test]
    fn normals_lean_or_do_not() {
        let mesh = |tilt: f32| Mesh {
            positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y],
            normals: vec![Vec3::Z, Vec3::Z, Quat::from_rotation_x(tilt) * Vec3::Z],
            triangles: vec![[0, 1, 2], [0, 0, 1]],
            ..Mesh::default()
        };
        assert!(!is_bent(&mesh(0.1)) && is_bent(&mesh(0.2)));
        assert!(!is_bent(&Mesh { normals: Vec::new(), ..mesh(0.2) }), "flat");
    }

    #[test]
    fn placements_keep_angles_or_do_not() {
        let turned = Affine3A::from_scale_rotation_translation(
            Vec3::new(-3.0, 3.0, 3.0),
            Quat::from_rotation_y(1.0),
            Vec3::ONE,
        );
        assert!(!is_uneven(&turned));
        assert!(is_uneven(&(turned * Affine3A::from_scale(Vec3::new(1.0, 1.1, 1.0)))));
        let mut sheared = turned;
        sheared.matrix3.x_axis += 0.1 * sheared.matrix3.y_axis;
        assert!(is_uneven(&sheared));
    }
}
