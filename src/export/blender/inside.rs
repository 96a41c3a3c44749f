//! Light given off inside glass, which Cycles does not weaken on its way out.
//!
//! Radiance leaving a medium of index η into air falls by η², as its beam widens. Cycles leaves radiance alone at
//! boundaries. What enters and leaves again comes out the same; light from inside, or seen from inside, does not.

use glam::Vec3;

use super::{camera, layered, materials::shines};
use crate::{
    export::note::Notes,
    world::{Light, MaterialId, World},
};

pub fn note(world: &World, notes: &mut Notes) {
    let glass = |id: MaterialId| {
        let material = world.model.materials.get(id.index());
        material.filter(|m| layered::refracts(m))
    };
    let mut sources = emitters(world);
    sources.push(camera::position(&world.camera));
    let mut tell = |id: MaterialId| {
        let Some(material) = glass(id) else { return };
        notes.approximated(
            format!("material `{}`", material.name),
            "light given off inside it, or seen from inside, keeps its radiance at the boundary; here it changes by \
             the square of the index",
        );
    };
    for sphere in &world.spheres {
        if glass(sphere.material).is_some()
            && sources.iter().any(|at| at.distance(sphere.center) < sphere.radius)
        {
            tell(sphere.material);
        }
    }
    for instance in &world.model.instances {
        let Some(&id) = instance.materials.iter().find(|id| glass(**id).is_some()) else { continue };
        let Some(mesh) = world.model.meshes.get(instance.mesh.index()) else { continue };
        let (low, high) = mesh
            .positions
            .iter()
            .fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(low, high), p| (low.min(*p), high.max(*p)));
        let to_object = instance.to_world.inverse();
        let inside = |at: &Vec3| {
            let at = to_object.transform_point3(*at);
            at.cmpge(low).all() && at.cmple(high).all()
        };
        if sources.iter().any(inside) {
            tell(id);
        }
    }
}

/// The middle of everything that shines.
fn emitters(world: &World) -> Vec<Vec3> {
    let emits = |id: &MaterialId| world.model.materials.get(id.index()).is_some_and(shines);
    let spheres = world.spheres.iter().filter(|s| emits(&s.material)).map(|s| s.center);
    let quads = world.quads.iter().filter(|q| emits(&q.material)).map(|q| q.origin + 0.5 * (q.u + q.v));
    let lamps = world.model.lights.iter().filter_map(|light| match light {
        Light::Point { position, .. } | Light::Spot { position, .. } => Some(*position),
        Light::Sun { .. } => None,
    });
    let instances =
        world.model.instances.iter().filter(|i| i.materials.iter().any(emits)).filter_map(|instance| {
            let positions = &world.model.meshes.get(instance.mesh.index())?.positions;
            let middle = positions.iter().sum::<Vec3>() / positions.len().max(1) as f32;
            Some(instance.to_world.transform_point3(middle))
        });
    spheres.chain(quads).chain(lamps).chain(instances).collect()
}

#[cfg(test)]
mod tests {
    use glam::Affine3A;

    use super::*;
    use crate::world::{
        Camera, ColorInput, Environment, EnvironmentKind, Fresnel, Material, Model, Projection, ScalarInput,
        Sphere, Surface,
    };

    #[test]
    fn a_lamp_in_a_glass_ball_is_told_of_and_one_beside_it_is_not() {
        let glass = Surface::Dielectric {
            ior: 1.5,
            fresnel: Fresnel::Exact,
            roughness: ScalarInput::constant(0.0),
            tint: ColorInput::constant(Vec3::ONE),
        };
        let told = |x: f32| {
            let lamp = Light::Point { position: Vec3::new(x, 0.0, 0.0), intensity: Vec3::ONE };
            let materials = vec![Material::new("glass", glass.clone())];
            let world = World {
                model: Model { materials, lights: vec![lamp], ..Model::default() },
                spheres: vec![Sphere { center: Vec3::ZERO, radius: 1.0, material: MaterialId(0) }],
                quads: vec![],
                environment: Environment {
                    kind: EnvironmentKind::Color(Vec3::ONE),
                    strength: 1.0,
                    rotation: 0.0,
                    visible: true,
                },
                camera: Camera {
                    name: String::new(),
                    node: String::new(),
                    to_world: Affine3A::from_translation(Vec3::new(0.0, 0.0, 5.0)),
                    projection: Projection::Perspective { vfov: 1.0 },
                    aperture: 0.0,
                    focus: 1.0,
                },
            };
            let mut notes = Notes::default();
            note(&world, &mut notes);
            notes.finish().len()
        };
        assert_eq!((told(0.9), told(1.1)), (1, 0));
    }
}
