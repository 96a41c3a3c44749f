//! A [`World`] made ready to render: trees over the geometry, tables for the lights, shading data by object.
//!
//! What cannot be rendered (triangles without area or with non-finite corners) is set aside here and counted.

mod emitters;
mod object;
mod scene;

use std::time::Instant;

use rayon::prelude::*;

use crate::{
    accel::{self, Accel, Blas, Shape},
    camera::{Camera, FilterTable},
    light::{Environment, Lights},
    material,
    render::Settings,
    texture::Textures,
    world::{Alpha, Material, Surface, World},
};

pub use object::{Object, ObjectKind};
pub use scene::{Scene, SceneStats};

/// Builds everything a picture of `world` needs.
pub fn compile(world: World, settings: &Settings) -> Scene {
    let World { model, spheres, quads, environment, camera } = world;
    let environment = Environment::new(&environment, &model.images);
    let textures = Textures::new(model.images, model.textures);

    let start = Instant::now();
    let blases: Vec<Blas> =
        model.meshes.par_iter().map(|m| Blas::build(&m.positions, &m.triangles)).collect();
    let triangles_set_aside = blases.iter().map(|b| b.set_aside() as u64).sum();

    let mut objects: Vec<Object> = Vec::with_capacity(model.instances.len() + spheres.len() + quads.len());
    objects.extend(model.instances.into_iter().map(Object::instance));
    objects.extend(spheres.into_iter().map(Object::sphere));
    objects.extend(quads.into_iter().map(Object::quad));
    let filtered: Vec<bool> = model.materials.iter().map(must_be_asked).collect();
    let shapes = objects.iter().map(|object| accel::Object {
        shape: match &object.kind {
            ObjectKind::Instance { mesh, placement } => {
                Shape::Mesh { blas: mesh.0, to_world: placement.to_world }
            }
            ObjectKind::Sphere { center, radius } => Shape::Sphere { center: *center, radius: *radius },
            ObjectKind::Quad { origin, u, v, round } => {
                Shape::Quad { origin: *origin, u: *u, v: *v, round: *round }
            }
        },
        filtered: object.materials.iter().any(|m| filtered[m.index()]),
    });
    let accel = Accel::build(blases, shapes.collect());
    let bvh_seconds = start.elapsed().as_secs_f64();

    let emitters = emitters::collect(&mut objects, &model.meshes, &model.materials, &textures, model.lights);
    let stats = SceneStats {
        triangles: model.meshes.iter().map(|m| m.triangles.len() as u64).sum(),
        meshes: model.meshes.len() as u64,
        instances: objects.iter().filter(|o| matches!(o.kind, ObjectKind::Instance { .. })).count() as u64,
        spheres: objects.iter().filter(|o| matches!(o.kind, ObjectKind::Sphere { .. })).count() as u64,
        quads: objects.iter().filter(|o| matches!(o.kind, ObjectKind::Quad { .. })).count() as u64,
        lights: emitters.len() as u64,
        environment: environment.mean_luminance() > 0.0,
        materials: model.materials.len() as u64,
        textures: textures.len() as u64,
        bvh_seconds,
        bvh_bytes: accel.memory() as u64,
        geometry_bytes: model.meshes.iter().map(|m| m.memory() as u64).sum(),
        texture_bytes: textures.memory() as u64,
        triangles_set_aside,
        objects_set_aside: accel.set_aside() as u64,
        environment_texels_set_aside: environment.dropped_texels as u64,
    };
    Scene {
        lights: Lights::new(&emitters, environment),
        accel,
        objects,
        meshes: model.meshes,
        materials: model.materials,
        textures,
        camera: Camera::new(&camera, settings.size),
        filter: FilterTable::new(settings.filter),
        seed: settings.seed,
        bounces: settings.bounces,
        stats,
    }
}

/// Whether a ray that meets this material may pass through it untouched.
fn must_be_asked(material: &Material) -> bool {
    let is_unlit = matches!(material.surface, Surface::Unlit { .. });
    material.alpha != Alpha::Opaque || is_unlit || material::is_wall(material)
}
