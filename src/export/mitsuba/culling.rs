//! Whether the camera could meet backs that rayo does not show it, and Mitsuba does.

use std::collections::HashSet;

use glam::Vec3;

use crate::world::{Material, MaterialId, Mesh, World};

/// Materials of which the camera may see backs that it should see through.
pub fn shown_backs(world: &World) -> Vec<&Material> {
    let eye = Vec3::from(world.camera.to_world.translation);
    let material = |id: MaterialId| &world.model.materials[id.index()];
    let mut ids = Vec::new();
    for quad in world.quads.iter().filter(|q| !material(q.material).double_sided) {
        if quad.u.cross(quad.v).dot(eye - quad.origin) < 0.0 {
            ids.push(quad.material);
        }
    }
    for sphere in world.spheres.iter().filter(|s| !material(s.material).double_sided) {
        if eye.distance(sphere.center) < sphere.radius {
            ids.push(sphere.material);
        }
    }
    let closed: Vec<bool> = world.model.meshes.iter().map(is_closed).collect();
    for instance in world.model.instances.iter().filter(|i| !closed[i.mesh.index()]) {
        ids.extend(instance.materials.iter().filter(|&&id| !material(id).double_sided));
    }
    ids.sort_unstable();
    ids.dedup();
    ids.into_iter().map(material).collect()
}

/// Every edge is met from both sides: from outside, no back is seen.
fn is_closed(mesh: &Mesh) -> bool {
    let corner = |i: u32| mesh.positions[i as usize].to_array().map(|x| (x + 0.0).to_bits());
    let mut open = HashSet::new();
    for &[a, b, c] in &mesh.triangles {
        let [a, b, c] = [a, b, c].map(corner);
        for (from, to) in [(a, b), (b, c), (c, a)] {
            if from != to && !open.remove(&(to, from)) && !open.insert((from, to)) {
                return false;
            }
        }
    }
    open.is_empty()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tetrahedron_is_closed_and_without_a_face_it_is_not() {
        let mut mesh = Mesh {
            positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::Z, -Vec3::ZERO],
            triangles: vec![[0, 2, 1], [0, 1, 3], [4, 3, 2], [1, 2, 3]],
            ..Mesh::default()
        };
        assert!(is_closed(&mesh));
        mesh.triangles.pop();
        assert!(!is_closed(&mesh));
    }
}
