//! Spheres: as points where they are opaque, else as triangles.
//!
//! Cycles intersects the points of a point cloud as true spheres, but a ray that leaves one never meets the same one
//! again. So glass is made of triangles, and so is whatever the camera sees from inside.
//! Points do not light the scene either: a lamp of the same radius does, which all rays but the camera's see. The
//! point itself is a little smaller, so that it stands behind the lamp's surface, and shines for camera rays.

use glam::Vec3;

use super::{
    Placed, axes, camera,
    document::{Instance, Points},
    layered, lights,
    materials::{Materials, Needs, Role, shines},
    meshes,
};
use crate::{
    export::{Error, note::Notes},
    world::{Alpha, Material, MaterialId, Sphere, World},
};

/// Radius of a lamp's body over that of the lamp.
const BODY: f32 = 1.0 - 1e-4;

pub fn place(
    world: &World,
    size: [u32; 2],
    materials: &mut Materials,
    placed: &mut Placed,
    notes: &mut Notes,
) -> Result<(), Error> {
    let eye = camera::position(&world.camera);
    let extent = camera::extent(&world.camera, size);
    let mut points: Vec<(MaterialId, Role, Vec<Sphere>)> = Vec::new();
    let mut triangulated = None;
    for sphere in &world.spheres {
        let Some(material) = world.model.materials.get(sphere.material.index()) else { continue };
        let outside = sphere.center.distance(eye) > sphere.radius + extent;
        if let Some(role) = role(material).filter(|_| outside) {
            let known = points.iter_mut().find(|(id, known, _)| (*id, *known) == (sphere.material, role));
            match known {
                Some((_, _, spheres)) => spheres.push(*sphere),
                None => points.push((sphere.material, role, vec![*sphere])),
            }
            continue;
        }
        notes.approximated(
            format!("spheres of material `{}`", material.name),
            "81920 triangles of the same area with the sphere's normals, up to 3·10⁻⁵ of the radius away from it",
        );
        let mesh = *triangulated.get_or_insert_with(|| {
            placed.meshes.extend(meshes::write(&meshes::sphere(), Needs::default(), &mut placed.arrays));
            placed.meshes.len() - 1
        });
        let [x, y, z] = axes::point(sphere.center);
        let r = sphere.radius;
        placed.instances.push(Instance {
            name: format!("Sphere of {}", material.name),
            mesh,
            matrix: Some([[r, 0.0, 0.0, x], [0.0, r, 0.0, y], [0.0, 0.0, r, z], [0.0, 0.0, 0.0, 1.0]]),
            materials: vec![materials.index(sphere.material, Role::Sphere, notes)?],
        });
    }
    for (id, role, spheres) in points {
        let material = &world.model.materials[id.index()];
        if role == Role::LampBody {
            placed.lights.extend(spheres.iter().filter_map(|sphere| lamp(material, sphere)));
        }
        let size = if role == Role::LampBody { BODY } else { 1.0 };
        placed.points.push(Points {
            name: format!("Spheres of {}", material.name),
            material: materials.index(id, role, notes)?,
            centers: placed.arrays.floats(spheres.iter().flat_map(|s| axes::point(s.center))),
            radii: placed.arrays.floats(spheres.iter().map(|s| size * s.radius)),
        });
    }
    Ok(())
}

/// As a point, if it can be one.
fn role(material: &Material) -> Option<Role> {
    let opaque = material.alpha == Alpha::Opaque && !layered::lets_through(material);
    let textured = material.emission.is_some_and(|e| e.color.texture.is_some());
    match (opaque, shines(material)) {
        (false, _) => None,
        (true, false) => Some(Role::Sphere),
        (true, true) => (!textured).then_some(Role::LampBody),
    }
}

fn lamp(material: &Material, sphere: &Sphere) -> Option<super::document::Light> {
    let radiance: Vec3 = material.emission.map(|e| e.strength * e.color.factor)?;
    lights::sphere(format!("Lamp of {}", material.name), sphere.center, sphere.radius, radiance)
}
