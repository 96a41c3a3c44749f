//! What is inside of what. POV-Ray's index of refraction is against nothing at all and nests; here it is against what
//! is on the other side of the surface.

use std::collections::HashMap;

use glam::Vec3;

use crate::world::{Mesh, Sphere, Surface, World};

/// Product of the indices of all glass spheres around a ball.
pub fn around(world: &World, center: Vec3, radius: f32, but: Option<usize>) -> f32 {
    let surrounds = |(i, sphere): (usize, &Sphere)| {
        let inside = center.distance(sphere.center) + radius <= sphere.radius;
        if !inside || Some(i) == but || (radius == sphere.radius && Some(i) > but) {
            return None;
        }
        match world.model.materials.get(sphere.material.index())?.surface {
            Surface::Dielectric { ior, .. } => Some(ior),
            _ => None,
        }
    };
    world.spheres.iter().enumerate().filter_map(surrounds).product()
}

/// Whether the triangles bound a volume: each edge has another one that runs the other way.
pub fn closed(mesh: &Mesh) -> bool {
    let place = |v: u32| mesh.positions.get(v as usize).map(|p| p.to_array().map(|x| (x + 0.0).to_bits()));
    let mut open: HashMap<_, i32> = HashMap::new();
    for &[a, b, c] in &mesh.triangles {
        for (from, to) in [(a, b), (b, c), (c, a)] {
            let (from, to) = (place(from), place(to));
            let (edge, way) = if from < to { ((from, to), 1) } else { ((to, from), -1) };
            if from != to {
                *open.entry(edge).or_default() += way;
            }
        }
    }
    !mesh.triangles.is_empty() && open.values().all(|&n| n == 0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tetrahedron_is_closed_until_a_face_is_gone() {
        let positions = vec![Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::Z];
        let triangles = vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];
        let mut mesh = Mesh { positions, triangles, ..Mesh::default() };
        assert!(closed(&mesh));
        mesh.triangles.pop();
        assert!(!closed(&mesh));
    }
}
