//! Blender Cycles: `scene.py`, the same for every scene, builds what `scene.json` says; numbers of meshes in NumPy
//! arrays, textures as images.
//!
//! | rayo | Blender |
//! |---|---|
//! | +Y up | +Z up: [`axes`] |
//! | opaque spheres | points of a point cloud, which Cycles intersects as true spheres: [`spheres`] |
//! | emissive ones | a lamp of the same radius; the sphere itself shines for camera rays alone |
//! | glass ones | triangles |
//! | intensity in W/sr | power in W: [`lights`] |
//! | materials | nodes: [`materials`], layers: [`layered`]; fuzz as Beckmann's facets: [`fuzz`](super::fuzz) |
//! | tangents | attributes under the name that the Normal Map node would give its own |

mod arrays;
mod axes;
mod camera;
mod document;
mod inside;
mod layered;
mod lights;
mod materials;
mod meshes;
mod spheres;
mod textures;

use std::collections::BTreeMap;

use super::{Error, Options, folder::Folder, note::Notes, shading};
use crate::{
    render,
    world::{MaterialId, Quad, World},
};
use arrays::Arrays;
use materials::{Materials, Needs, Role};
use textures::Textures;

/// Writes the folder; returns the command that renders it.
pub fn write(
    world: &World,
    settings: &render::Settings,
    options: Options,
    out: &mut Folder,
    notes: &mut Notes,
) -> Result<&'static str, Error> {
    let mut textures = Textures::new(&world.model, out);
    let environment = lights::world(&world.environment, &world.model.images, &mut textures)?;
    let mut placed = Placed::default();
    let mut materials = Materials::new(&world.model, &mut textures);
    instances(world, &mut materials, &mut placed, notes)?;
    quads(world, &mut materials, &mut placed, notes)?;
    spheres::place(world, settings.size, &mut materials, &mut placed, notes)?;
    for (i, light) in world.model.lights.iter().enumerate() {
        placed.lights.extend(lights::lamp(format!("Light {i}"), light));
    }
    inside::note(world, notes);
    let materials = materials.finish();
    let document = document::Document {
        rayo: env!("CARGO_PKG_VERSION"),
        save_blend: options.save_blend,
        settings: camera::settings(settings, notes),
        camera: camera::camera(&world.camera, reach(world)),
        world: environment,
        lights: placed.lights,
        images: textures.images,
        materials,
        meshes: placed.meshes,
        instances: placed.instances,
        points: placed.points,
    };
    let json = serde_json::to_vec(&document)
        .map_err(|e| Error::Encoding { file: "scene.json".into(), problem: e.to_string() })?;
    out.write("scene.json", &json)?;
    for (name, bytes) in placed.arrays.files() {
        out.write(name, &bytes)?;
    }
    out.write("scene.py", include_bytes!("scene.py"))?;
    Ok("blender -b -P scene.py    # or, where Python has the module bpy: python scene.py")
}

/// What the scene consists of so far.
#[derive(Default)]
struct Placed {
    arrays: Arrays,
    meshes: Vec<document::Mesh>,
    instances: Vec<document::Instance>,
    points: Vec<document::Points>,
    lights: Vec<document::Light>,
}

fn instances(
    world: &World,
    materials: &mut Materials,
    placed: &mut Placed,
    notes: &mut Notes,
) -> Result<(), Error> {
    let model = &world.model;
    let mut needs = vec![Needs::default(); model.meshes.len()];
    for instance in &model.instances {
        let Some(needs) = needs.get_mut(instance.mesh.index()) else { continue };
        instance.materials.iter().filter_map(|id| model.materials.get(id.index())).for_each(|m| needs.add(m));
    }
    let mut written: Vec<Option<Option<usize>>> = vec![None; model.meshes.len()];
    for instance in &model.instances {
        let at = instance.mesh.index();
        let (Some(mesh), Some(first)) = (model.meshes.get(at), instance.materials.first()) else { continue };
        let index = *written[at].get_or_insert_with(|| {
            let mesh = meshes::write(mesh, needs[at], &mut placed.arrays)?;
            placed.meshes.push(mesh);
            Some(placed.meshes.len() - 1)
        });
        let Some(index) = index.filter(|_| instance.to_world.is_finite()) else { continue };
        if shading::is_bent(mesh) && shading::is_uneven(&instance.to_world) {
            notes.approximated(
                format!("mesh `{}`", mesh.name),
                "normals n of corners become M n / |M n| before they are interpolated, not after (M the inverse transpose of an uneven \
                 placement): up to 6 % of the shading on a ball of 80 triangles",
            );
        }
        let slots = (0..placed.meshes[index].slot_count).map(|slot| {
            let id = instance.materials.get(slot).unwrap_or(first);
            materials.index(*id, Role::Mesh, notes)
        });
        placed.instances.push(document::Instance {
            name: instance.name.clone(),
            mesh: index,
            materials: slots.collect::<Result<_, _>>()?,
            matrix: Some(axes::object(&instance.to_world)),
        });
    }
    Ok(())
}

/// One mesh for all quads of a material.
fn quads(
    world: &World,
    materials: &mut Materials,
    placed: &mut Placed,
    notes: &mut Notes,
) -> Result<(), Error> {
    let mut by_material: BTreeMap<MaterialId, Vec<Quad>> = BTreeMap::new();
    for quad in &world.quads {
        by_material.entry(quad.material).or_default().push(*quad);
    }
    for (id, quads) in by_material {
        let Some(material) = world.model.materials.get(id.index()) else { continue };
        if quads.iter().any(|quad| quad.round) {
            notes.approximated(
                format!("disks of material `{}`", material.name),
                format!(
                    "polygons of {} sides and the same area, up to 1 part in 10⁴ away from the round edge",
                    meshes::SIDES
                ),
            );
        }
        let mut needs = Needs::default();
        needs.add(material);
        let mesh = meshes::quads(&format!("Quads of {}", material.name), &quads);
        let Some(mesh) = meshes::write(&mesh, needs, &mut placed.arrays) else { continue };
        placed.instances.push(document::Instance {
            name: mesh.name.clone(),
            mesh: placed.meshes.len(),
            matrix: None,
            materials: vec![materials.index(id, Role::Mesh, notes)?],
        });
        placed.meshes.push(mesh);
    }
    Ok(())
}

/// From the camera to the farthest thing.
fn reach(world: &World) -> f32 {
    let eye = camera::position(&world.camera);
    let spheres = world.spheres.iter().map(|s| s.center.distance(eye) + s.radius);
    let quads = world
        .quads
        .iter()
        .flat_map(|q| [q.origin, q.origin + q.u, q.origin + q.v, q.origin + q.u + q.v])
        .map(|p| p.distance(eye));
    let radius = |mesh: &crate::world::Mesh| {
        mesh.positions.iter().map(|p| p.length()).filter(|r| r.is_finite()).fold(0.0, f32::max)
    };
    let radii: Vec<f32> = world.model.meshes.iter().map(radius).collect();
    let instances = world.model.instances.iter().map(|instance| {
        let m = &instance.to_world;
        let stretch =
            [m.matrix3.x_axis, m.matrix3.y_axis, m.matrix3.z_axis].map(|axis| axis.length_squared());
        let radius = radii.get(instance.mesh.index()).copied().unwrap_or(0.0);
        glam::Vec3::from(m.translation).distance(eye) + radius * stretch.iter().sum::<f32>().sqrt()
    });
    spheres.chain(quads).chain(instances).filter(|r| r.is_finite()).fold(0.0, f32::max)
}
