//! glTF 2.0 (.gltf and .glb) into a [`Model`].
//!
//! | file | concern |
//! |---|---|
//! | `container` | GLB chunks, or plain JSON |
//! | `document` | JSON to typed sections; `extensions`: which are read |
//! | `check` | every index, and the hierarchy of nodes |
//! | `uri`, `buffers`, `accessor` | bytes: where they come from, and typed reading of them |
//! | `nodes`, `shapes` | the scene flattened, and what of it is drawn |
//! | `textures`, `material`, `layers`, `texcoords` | images and what uses them |
//! | `meshopt`, `draco` | compressed geometry made plain |
//! | `mesh`, `topology`, `skin`, `mend` | primitives to triangles, in the pose of their joints |
//! | `animation`, `curve`, `pointer` | the document at one time of an animation |
//! | `instancing` | a mesh placed many times |
//! | `variants` | other materials under a name |
//! | `punctual`, `ibl` | cameras and lights |
//! | `conformance` | what the specification forbids, and the import survives |
//! | `report` | errors, warnings and counts |
//!
//! The file is read in stages; each looks at all of its elements and reports all that is wrong, and the next begins only
//! if nothing was. A file that the specification allows is read; what cannot be shown yet is named in a warning.
//!
//! An animation is applied to the document before anything is made of it. Not yet: points and lines.

mod accessor;
mod animation;
mod buffers;
mod check;
mod conformance;
mod container;
mod curve;
mod document;
mod draco;
mod extensions;
mod ibl;
mod info;
mod instancing;
mod layers;
mod material;
mod mend;
mod mesh;
mod meshopt;
mod nodes;
mod pointer;
mod punctual;
mod report;
mod shapes;
mod skin;
#[cfg(test)]
mod tests;
mod texcoords;
mod textures;
mod topology;
mod uri;
mod variants;

use std::{
    collections::{BTreeMap, BTreeSet, HashMap},
    panic::{AssertUnwindSafe, catch_unwind},
    path::{Path, PathBuf},
};

use rayon::prelude::*;

use self::{
    accessor::Source,
    buffers::Buffers,
    document::Document,
    material::Converted,
    nodes::Placed,
    report::{Counted, Problem, Report, choose},
    shapes::Shape,
    skin::Joints,
    textures::Textures,
};
use crate::{
    diagnostic::{Diagnostic, Place},
    import::info::Info,
    input,
    scene::Selection,
    world::{Instance, Material, MeshId, Model, Surface},
};

/// Bytes of a .glb or .gltf file (a GLB cannot be longer).
const MAX_FILE_BYTES: u64 = u32::MAX as u64;
/// Triangles of all meshes of a file, each counted once.
const MAX_TRIANGLES: usize = 1 << 27;
/// Triangles of skinned and morphed meshes: each pose is a copy, so few bytes of file could ask for many.
const MAX_POSED_TRIANGLES: usize = 1 << 25;
/// Characters of a name; each instance has its own copy.
const MAX_NAME: usize = 200;

/// Loads what `selection` says of the asset at `path`: a model with its warnings, or all that is wrong with it.
pub fn load(path: &Path, selection: &Selection) -> Result<Model, Vec<Diagnostic>> {
    guarded(path, |bytes| import(bytes, path, selection))
}

/// The same, and what `meanwhile` makes of the model as soon as all is there but its images, which are decoded at the same time.
pub fn load_while<T: Send>(
    path: &Path,
    selection: &Selection,
    meanwhile: impl Fn(&Model) -> T + Sync,
) -> Result<(Model, T), Vec<Diagnostic>> {
    guarded(path, |bytes| import_while(bytes, path, selection, &meanwhile))
}

/// What the asset at `path` holds.
pub fn inspect(path: &Path) -> Result<Info, Vec<Diagnostic>> {
    guarded(path, |bytes| {
        let (mut report, folder) = (Report::new(path), folder(path));
        let found = prepare(bytes, folder, &mut report).and_then(|(document, buffers)| {
            let info = info::info(&Source { document: &document, buffers: &buffers });
            let (model, ()) = build(document, &buffers, folder, &Selection::default(), &|_| (), &mut report)?;
            Some((info, model))
        });
        let warnings = report.finish()?;
        let (info, model) = found.unwrap_or_default();
        Ok(info.showing(&Model { warnings, ..model }))
    })
}

/// Reads the file at `path` for `read`, which nothing in it shall make panic.
fn guarded<T>(
    path: &Path,
    read: impl FnOnce(&[u8]) -> Result<T, Vec<Diagnostic>>,
) -> Result<T, Vec<Diagnostic>> {
    let bytes = input::read(path, MAX_FILE_BYTES).map_err(|why| {
        vec![Diagnostic::error(path, Place::File, format!("cannot read this glTF file: {why}"))]
    })?;
    // Nothing below is known to panic; a file that finds a way must not take the program with it.
    catch_unwind(AssertUnwindSafe(|| read(&bytes))).unwrap_or_else(|_| {
        let message = "the importer failed on this file";
        Err(vec![
            Diagnostic::error(path, Place::File, message).help("please report it, with the file, as a bug"),
        ])
    })
}

fn folder(path: &Path) -> &Path {
    path.parent().unwrap_or(Path::new(""))
}

/// Imports `bytes` as if read from `path`, beside which its other files are.
fn import(bytes: &[u8], path: &Path, selection: &Selection) -> Result<Model, Vec<Diagnostic>> {
    import_while(bytes, path, selection, &|_: &Model| ()).map(|(model, ())| model)
}

fn import_while<T: Send>(
    bytes: &[u8],
    path: &Path,
    selection: &Selection,
    meanwhile: &(impl Fn(&Model) -> T + Sync),
) -> Result<(Model, T), Vec<Diagnostic>> {
    let mut report = Report::new(path);
    let built = prepare(bytes, folder(path), &mut report).and_then(|(document, buffers)| {
        build(document, &buffers, folder(path), selection, meanwhile, &mut report)
    });
    let warnings = report.finish()?;
    let (model, made) = built.unwrap_or_else(|| (Model::default(), meanwhile(&Model::default())));
    Ok((Model { warnings, ..model }, made))
}

/// The document, checked and without compression, and its bytes.
fn prepare<'a>(bytes: &'a [u8], folder: &Path, report: &mut Report) -> Option<(Document, Buffers<'a>)> {
    let container = container::split(bytes, report)?;
    let mut document = document::parse(container.json, report)?;
    check::references(&document, report);
    report.checkpoint()?;
    let mut buffers = buffers::load(&document, &container, folder, report);
    report.checkpoint()?;
    let given = document.accessors.len();
    meshopt::decompress(&document, &mut buffers, report);
    draco::decompress(&mut document, &mut buffers, report);
    report.checkpoint()?;
    let source = Source { document: &document, buffers: &buffers };
    accessor::check(&source, report);
    report.checkpoint()?;
    conformance::data(&source, given, folder, &mut report.findings);
    Some((document, buffers))
}

fn build<T: Send>(
    mut document: Document,
    buffers: &Buffers,
    folder: &Path,
    selection: &Selection,
    meanwhile: &(impl Fn(&Model) -> T + Sync),
    report: &mut Report,
) -> Option<(Model, T)> {
    let source = Source { document: &document, buffers };
    let changes = animation::changes(&source, selection, report);
    animation::apply(&mut document, changes, report);
    if let Some(name) = &selection.scene {
        match choose(name, "scene", "/scenes", document.scenes.iter().map(|s| s.name.as_deref())) {
            Ok(index) => document.scene = Some(index),
            Err(problem) => report.error(problem),
        }
    }
    let variant = variants::chosen(&document, selection.variant.as_deref(), report);
    report.checkpoint()?;

    let source = Source { document: &document, buffers };
    let globals = nodes::globals(&document);
    let placed = nodes::flatten(&document, &globals, report);
    let shapes = shapes::shapes(&source, &placed, variant, report)?;
    let skins = skin::joints(&source, &shapes.iter().filter_map(|s| s.skin).collect(), &globals, report);
    let parts = Parts { source, placed, shapes, skins };
    let wanted = images(&parts);
    // Nearly always all of them decode: the rest begins as if they did.
    let (decoded, (described, said)) = rayon::join(
        || textures::decode_all(&parts.source, &wanted, folder),
        || {
            let mut report = report.clone();
            (describe(&parts, Textures::of(wanted.iter().copied()), meanwhile, &mut report), report)
        },
    );
    let (mut model, made) = if decoded.iter().all(|(_, image)| image.is_ok()) {
        *report = said;
        described?
    } else {
        drop(described); // made anew, without those images
        let there = textures::tell(&decoded, report);
        report.checkpoint()?;
        describe(&parts, Textures::of(there), meanwhile, report)?
    };
    model.images = decoded.into_iter().filter_map(|(_, image)| image.ok()).collect();
    model.sources = files(&document, folder);
    cameras_and_lights(&parts.source, &parts.placed, &mut model, report);
    let scene = nodes::shown_scene(&document);
    model.environment = ibl::environment(&parts.source, scene, folder, &mut model.images, report);
    report.checkpoint().map(|()| (model, made))
}

/// What a model is made of, in the terms of its file.
struct Parts<'a> {
    source: Source<'a>,
    placed: Vec<Placed>,
    shapes: Vec<Shape>,
    skins: BTreeMap<usize, Joints>,
}

/// Materials, meshes and instances, and what `meanwhile` makes of them.
fn describe<T>(
    parts: &Parts,
    mut textures: Textures,
    meanwhile: &impl Fn(&Model) -> T,
    report: &mut Report,
) -> Option<(Model, T)> {
    let used: BTreeSet<Option<usize>> = parts.shapes.iter().map(|s| s.material).collect();
    let converted = material::convert_all(parts.source.document, used, &mut textures, report);
    report.checkpoint()?;
    let mut model = Model { textures: textures.textures, ..Model::default() };
    meshes(parts, &converted, &mut model, report)?;
    model.materials = converted.materials;
    let made = meanwhile(&model);
    Some((model, made))
}

/// The files beside the asset that it names, used or not.
fn files(document: &Document, folder: &Path) -> Vec<PathBuf> {
    let buffers = document.buffers.iter().filter_map(|buffer| buffer.uri.as_deref());
    let images = document.images.iter().filter_map(|image| image.uri.as_deref());
    // What is no name of a file, `data:` above all, does not resolve.
    buffers.chain(images).filter_map(|uri| uri::resolve(uri, folder).ok()).collect()
}

/// The images that materials look up.
fn images(parts: &Parts) -> BTreeSet<usize> {
    let document = parts.source.document;
    let used = parts.shapes.iter().filter_map(|shape| document.materials.get(shape.material?));
    let slots = used.flat_map(material::slots).filter(|(name, _)| material::is_used(name));
    slots.filter_map(|(_, texture)| textures::source(document.textures.get(texture)?)).collect()
}

/// Builds each distinct mesh once, in parallel, and places the instances of those that have triangles.
fn meshes(parts: &Parts, converted: &Converted, model: &mut Model, report: &mut Report) -> Option<()> {
    let Parts { source, placed, shapes, skins } = parts;
    let mut known: HashMap<mesh::Key, MeshId> = HashMap::new();
    let mut jobs = Vec::new();
    let (mut triangles, mut posed) = (0usize, 0usize);
    for shape in shapes {
        let Some(node) = placed.get(shape.placed) else { continue };
        let Some(json_node) = source.document.nodes.get(node.node) else { continue };
        let Some(json_mesh) = source.document.meshes.get(shape.mesh) else { continue };
        let Some(primitive) = json_mesh.primitives.get(shape.primitive) else { continue };
        let Some(&material) = converted.ids.get(&shape.material) else { continue };
        let pointer = format!("/meshes/{}/primitives/{}", shape.mesh, shape.primitive);
        let weights = json_node.weights.as_ref().or(json_mesh.weights.as_ref()).map_or(&[][..], |w| w);
        let used = converted.materials.get(material.index());
        let uv_slots = converted.uv_slots.get(material.index()).copied().unwrap_or_default();
        let key = mesh::Use {
            weights,
            morphs: source.document.morphs.get(&(shape.mesh, shape.primitive)).map_or(&[], |morphs| morphs),
            skin: shape.skin,
            uv_sets: uv_slots.sets(),
            tangent_set: used.and_then(tangent_set),
        };
        let key = match mesh::key(primitive, shape.topology, &key, &pointer) {
            Ok(key) => key,
            Err(problem) => {
                report.error(problem);
                continue;
            }
        };
        let mesh = *known.entry(key).or_insert_with_key(|key| {
            triangles = triangles.saturating_add(key.triangle_count(source));
            if key.is_posed() {
                posed = posed.saturating_add(key.triangle_count(source));
            }
            let lacks = used.is_some_and(|m| uv_sets(m).iter().any(|&set| !key.has_uvs(set)));
            report.tally.add(Counted::MissingUvs, lacks.into(), &pointer);
            let name = json_mesh.name.as_deref().map_or_else(|| format!("mesh {}", shape.mesh), clipped);
            jobs.push((key.clone(), name, pointer));
            MeshId((jobs.len() - 1) as u32)
        });
        let name = json_node.name.as_deref().or(json_mesh.name.as_deref());
        let name = name.map_or_else(|| format!("node {}", node.node), clipped);
        model.instances.extend(shape.places.iter().map(|&to_world| Instance {
            name: name.clone(),
            mesh,
            to_world,
            materials: vec![material],
        }));
    }
    if triangles > MAX_TRIANGLES {
        let message =
            format!("{triangles} triangles in one file are more than the {MAX_TRIANGLES} that are read");
        report.error(Problem::new("/meshes", message));
    }
    if posed > MAX_POSED_TRIANGLES {
        let message = format!(
            "{posed} triangles of skinned and morphed meshes are more than the {MAX_POSED_TRIANGLES} that are read"
        );
        report.error(Problem::new("/meshes", message));
    }
    report.checkpoint()?;
    let built: Vec<_> = (jobs.into_par_iter())
        .map(|(key, name, pointer)| mesh::build(source, skins, &key, name, &pointer))
        .collect();
    for result in built {
        match result {
            Ok((mesh, tally)) => {
                report.tally.merge(&tally);
                model.meshes.push(mesh);
            }
            Err(problem) => report.error(problem),
        }
    }
    report.checkpoint()?;
    let Model { instances, meshes, .. } = model;
    instances.retain(|i| meshes.get(i.mesh.index()).is_some_and(|m| !m.triangles.is_empty()));
    Some(())
}

/// UV sets that a material's textures look up.
fn uv_sets(material: &Material) -> BTreeSet<u8> {
    let mut sets = BTreeSet::new();
    material.clone().for_each_texture(&mut |texture| {
        sets.insert(texture.uv_set);
    });
    sets
}

/// The UV set that tangents follow, where the material needs any.
fn tangent_set(material: &Material) -> Option<u8> {
    if let Some(normal) = &material.normal {
        return Some(normal.texture.uv_set);
    }
    let Surface::Layered(layered) = &material.surface else { return None };
    let coat = layered.clearcoat.and_then(|coat| coat.normal).map(|normal| normal.texture.uv_set);
    let anisotropy = layered.anisotropy.map(|a| a.texture.map_or(0, |texture| texture.uv_set));
    coat.or(anisotropy)
}

fn cameras_and_lights(source: &Source, placed: &[Placed], model: &mut Model, report: &mut Report) {
    let document = source.document;
    for node in placed {
        let Some(json_node) = document.nodes.get(node.node) else { continue };
        if let Some((i, json)) =
            json_node.camera.and_then(|c| Some((c.value(), document.cameras.get(c.value())?)))
        {
            let name = json.name.as_deref().or(json_node.name.as_deref());
            let name = name.map_or_else(|| format!("camera {i}"), clipped);
            let holder = json_node.name.as_deref().map_or_else(String::new, clipped);
            match punctual::camera(json, name, holder, &node.to_world) {
                Ok(camera) => model.cameras.push(camera),
                Err(message) => {
                    report.warn(Problem::new(format!("/cameras/{i}"), format!("{message}; it is left out")))
                }
            }
        }
        let light = nodes::light_index(json_node).filter(|_| node.visible);
        if let Some((i, json)) = light.and_then(|i| Some((i, document.lights.get(i)?))) {
            match punctual::light(json, &node.to_world) {
                Ok(light) => model.lights.push(light),
                Err(message) => {
                    let pointer = format!("/extensions/KHR_lights_punctual/lights/{i}");
                    report.warn(Problem::new(pointer, format!("{message}; it is left out")));
                }
            }
        }
    }
}

/// A name as the model keeps it.
fn clipped(name: &str) -> String {
    name.chars().take(MAX_NAME).collect()
}
