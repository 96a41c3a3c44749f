//! How large a scene is.

use glam::Vec3;

use crate::world::World;

/// A sphere about everything, the camera included: its centre, and its radius, which is positive.
pub fn sphere(world: &World) -> (Vec3, f32) {
    let mut points = vec![Vec3::from(world.camera.to_world.translation)];
    for sphere in &world.spheres {
        points.extend([sphere.center - sphere.radius, sphere.center + sphere.radius]);
    }
    for quad in &world.quads {
        points.extend([
            quad.origin,
            quad.origin + quad.u,
            quad.origin + quad.v,
            quad.origin + quad.u + quad.v,
        ]);
    }
    for instance in &world.model.instances {
        let positions = &world.model.meshes[instance.mesh.index()].positions;
        points.extend(positions.iter().map(|&p| instance.to_world.transform_point3(p)));
    }
    let finite = points.iter().filter(|p| p.is_finite());
    let (low, high) = finite.fold((Vec3::MAX, Vec3::MIN), |(low, high), &p| (low.min(p), high.max(p)));
    let radius = 0.5 * low.distance(high);
    if radius.is_finite() && radius > 0.0 { (0.5 * (low + high), radius) } else { (Vec3::ZERO, 1.0) }
}
