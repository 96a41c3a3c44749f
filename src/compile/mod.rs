//! A [`World`] made ready to render: trees over the geometry, tables for the lights, shading data by object.
//!
//! What cannot be rendered (triangles without area or with non-finite corners) is set aside here and counted.

mod emitters;
mod materials;
mod object;
mod scene;

use std::time::Instant;

use glam::Vec3;
use rayon::prelude::*;

use crate::{
    accel::{self, Accel, Blas, Build, Quality, Shape},
    camera::{Camera, FilterTable},
    light::{Aim, Environment, Lights, SAMPLES_A_LAMP_PATH},
    material::{self, Focus},
    render::{Bounces, Settings},
    sampling::weave::Weave,
    texture::Textures,
    world::{Alpha, EnvironmentKind, Material, Mesh, Model, Surface, Texels, World},
};

pub use object::{Object, ObjectKind};
pub use scene::{Scene, SceneStats};

/// Paths from the first surface that is lit from afar: two are worth 1.1 to 1.4 times what they cost beside one. (Four would be worth
/// more where little of the picture shows surfaces, and less where much of the noise is that of edges within pixels.)
const BRANCHES: u32 = 2;
/// Samples in a pixel from which on paths branch: with fewer, its edges and a soon end matter more.
const BRANCH_FROM: u32 = 32;

/// The trees of a model's meshes.
#[derive(Debug)]
pub struct Trees {
    blases: Vec<Blas>,
    pub start: Instant,
    end: Instant,
}

impl Trees {
    /// Of `model`, whose images need not be there; some of its materials may be replaced by those of `replacing`.
    pub fn of(model: &Model, replacing: &[&Material], settings: &Settings) -> Self {
        let start = Instant::now();
        let reduced = |material: &Material| materials::reduced(material.clone(), &mut |_, _| false);
        let replaced = replacing.iter().any(|material| must_be_asked(&reduced(material)));
        let rendered = materials::rendered(model);
        let mut filtered = vec![replaced; model.meshes.len()];
        for instance in &model.instances {
            let mut materials = instance.materials.iter().filter_map(|id| rendered.get(id.index()));
            if let Some(filtered) = filtered.get_mut(instance.mesh.index()) {
                *filtered |= materials.any(must_be_asked);
            }
        }
        Self::build(&model.meshes, &filtered, settings, start)
    }

    fn build(meshes: &[Mesh], filtered: &[bool], settings: &Settings, start: Instant) -> Self {
        let triangles = meshes.iter().map(|m| m.triangles.len() as u64).sum();
        let quality = settings.bvh.unwrap_or_else(|| Quality::planned(triangles, settings.planned_samples()));
        let build = |(m, &filtered): (&Mesh, &bool)| {
            Blas::build(&m.positions, &m.triangles, Build { quality, filtered })
        };
        let blases = meshes.par_iter().zip(filtered).map(build).collect();
        Self { blases, start, end: Instant::now() }
    }
}

/// Builds everything a picture of `world` needs.
pub fn compile(world: World, settings: &Settings) -> Scene {
    compile_with(world, Vec::new(), settings)
}

/// The same, with the trees that there are already: those of the first meshes.
pub fn compile_with(world: World, trees: Vec<Trees>, settings: &Settings) -> Scene {
    let World { mut model, spheres, quads, environment: surrounding, camera } = world;
    model.materials = materials::rendered(&model);
    let materials = &model.materials;
    let mut objects: Vec<Object> = Vec::with_capacity(model.instances.len() + spheres.len() + quads.len());
    objects.par_extend(model.instances.into_par_iter().map(Object::instance));
    objects.extend(spheres.into_iter().map(Object::sphere));
    objects.extend(quads.into_iter().map(Object::quad));
    objects.par_iter_mut().for_each(|object| object.prepare(materials));
    let filtered: Vec<bool> = materials.iter().map(must_be_asked).collect();
    let is_filtered = |object: &Object| object.materials.iter().any(|m| filtered[m.index()]);

    let (environment, trees) = rayon::join(
        || Environment::new(&surrounding, &model.images),
        || with_those_that_lack(trees, &model.meshes, &objects, is_filtered, settings),
    );
    if let EnvironmentKind::Image { image, .. } = surrounding.kind
        && !model.textures.iter().any(|texture| texture.image == image)
        && let Some(image) = model.images.get_mut(image.index())
    {
        // The environment has texels of its own.
        image.texels = Texels::Rgba8(Vec::new());
    }
    let textures = Textures::new(model.images, model.textures);
    let tree_seconds = trees.iter().map(|trees| (trees.end - trees.start).as_secs_f64()).sum::<f64>();
    let blases: Vec<Blas> = trees.into_iter().flat_map(|trees| trees.blases).collect();
    let triangles_set_aside = blases.iter().map(|b| b.set_aside() as u64).sum();
    let shape = |object: &Object| accel::Object {
        shape: match &object.kind {
            ObjectKind::Instance { mesh, placement } => {
                Shape::Mesh { blas: mesh.0, to_world: placement.to_world }
            }
            ObjectKind::Sphere { center, radius } => Shape::Sphere { center: *center, radius: *radius },
            ObjectKind::Quad { origin, u, v, round, .. } => {
                Shape::Quad { origin: *origin, u: *u, v: *v, round: *round }
            }
        },
        filtered: is_filtered(object),
    };
    let start = Instant::now();
    let shapes: Vec<accel::Object> = objects.par_iter().map(shape).collect();
    let focus: Vec<Focus> = model.materials.iter().map(|m| material::focus(m, &textures)).collect();
    let [sharp, rough] = [Focus::Sharp, Focus::Glossy].map(|kind| {
        let focusing = objects.iter().zip(&shapes).filter(|(o, _)| best_focus(o, &focus) == kind);
        focusing.filter_map(|(_, object)| object.shape.ball(&blases)).collect::<Vec<(Vec3, f32)>>()
    });
    let accel = Accel::build(blases, shapes);
    let bvh_seconds = tree_seconds + start.elapsed().as_secs_f64();

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
    let window = settings.window();
    let camera = Camera::new(&camera, settings.size);
    let Bounces { total, diffuse, glossy, transmission } = settings.bounces;
    // Paths from lamps do not know which of a material's lobes a path from the camera would have taken.
    let aims = camera.connects() && diffuse.min(glossy).min(transmission) >= total;
    let aim = aims.then(|| Aim::new(&emitters, &sharp, &rough)).flatten();
    Scene {
        lights: Lights::new(&emitters, environment),
        aim,
        lamp_paths: window[2] as f32 * window[3] as f32 / SAMPLES_A_LAMP_PATH as f32,
        branches: if settings.adaptive && settings.samples >= BRANCH_FROM { BRANCHES } else { 1 },
        window,
        accel,
        objects,
        meshes: model.meshes,
        materials: model.materials,
        textures,
        camera,
        filter: FilterTable::new(settings.filter),
        seed: settings.seed,
        weave: if settings.is_even() { Weave::of(settings.samples) } else { Weave::NONE },
        bounces: settings.bounces,
        stats,
    }
}

/// Of the object's materials that which focuses best.
fn best_focus(object: &Object, focus: &[Focus]) -> Focus {
    let all = object.materials.iter().filter_map(|m| focus.get(m.index()));
    all.copied().max().unwrap_or(Focus::None)
}

/// `trees`, and those of the meshes that have none yet.
fn with_those_that_lack(
    mut trees: Vec<Trees>,
    meshes: &[Mesh],
    objects: &[Object],
    is_filtered: impl Fn(&Object) -> bool,
    settings: &Settings,
) -> Vec<Trees> {
    let known = trees.iter().map(|trees| trees.blases.len()).sum();
    let Some(rest) = meshes.get(known..).filter(|rest| !rest.is_empty()) else { return trees };
    let mut filtered = vec![false; rest.len()];
    for object in objects {
        let ObjectKind::Instance { mesh, .. } = &object.kind else { continue };
        let flag = mesh.index().checked_sub(known).and_then(|i| filtered.get_mut(i));
        if let Some(flag) = flag {
            *flag |= is_filtered(object);
        }
    }
    trees.push(Trees::build(rest, &filtered, settings, Instant::now()));
    trees
}

/// Whether a ray that meets this material may pass through it untouched.
fn must_be_asked(material: &Material) -> bool {
    let is_unlit = matches!(material.surface, Surface::Unlit { .. });
    material.alpha != Alpha::Opaque || is_unlit || material::is_wall(material)
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use glam::Affine3A;

    use super::*;
    use crate::{
        geometry::Ray,
        world::{self, ColorInput, Instance, MaterialId, MeshId, Projection, ScalarInput},
    };

    /// Of coincident triangles one is enough, unless a material of the scene that replaces the model's lets rays pass.
    #[test]
    fn trees_built_before_materials_are_replaced_have_what_those_need() {
        let opaque = Material::new("a", Surface::Diffuse { color: ColorInput::constant(Vec3::ONE) });
        let coverage = ScalarInput::constant(0.5);
        let glimpse = Material { alpha: Alpha::Blend, coverage, ..opaque.clone() };
        let mesh = Mesh {
            positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y],
            triangles: vec![[0, 1, 2]; 2],
            ..Mesh::default()
        };
        let instance = |material| Instance {
            name: String::new(),
            mesh: MeshId(0),
            to_world: Affine3A::IDENTITY,
            materials: vec![MaterialId(material)],
        };
        let model = Model {
            meshes: vec![mesh],
            materials: vec![opaque, glimpse.clone()],
            instances: vec![instance(0)],
            ..Model::default()
        };
        let met = |trees: Vec<Trees>| {
            let world = World {
                model: Model { instances: vec![instance(1)], ..model.clone() },
                spheres: Vec::new(),
                quads: Vec::new(),
                environment: world::Environment {
                    kind: EnvironmentKind::Color(Vec3::ONE),
                    strength: 1.0,
                    rotation: 0.0,
                    visible: true,
                },
                camera: world::Camera {
                    name: String::new(),
                    node: String::new(),
                    to_world: Affine3A::IDENTITY,
                    projection: Projection::Perspective { vfov: 1.0 },
                    aperture: 0.0,
                    focus: 1.0,
                },
            };
            let scene = compile_with(world, trees, &Settings::default());
            let origin = Vec3::new(0.2, 0.2, 1.0);
            let ray = Ray { origin, direction: Vec3::NEG_Z, t_min: 0.0, t_max: f32::INFINITY };
            let mut met = BTreeSet::new();
            scene.accel.closest_where(&ray, |hit| {
                met.insert(hit.primitive);
                false
            });
            met.len()
        };
        let settings = Settings::default();
        assert_eq!(met(Vec::new()), 2);
        assert_eq!(met(vec![Trees::of(&model, &[&glimpse], &settings)]), 2);
        assert_eq!(met(vec![Trees::of(&model, &[], &settings)]), 1, "nobody said that it is replaced");
    }
}
