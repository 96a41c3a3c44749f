//! Wavefront OBJ with its material libraries (MTL) into a [`Model`]: one mesh and instance for each object (`o`), with
//! a slot for each of its materials.
//!
//! `pieces` cuts a file into whole statements, `scan` reads several pieces at a time (`number`, `corner`), `gather` puts
//! them together into vertices (`chains`) and triangles (`polygon`), `mesh` makes meshes of them and supplies normals;
//! `mtl` reads material libraries, `material` says what they mean, `textures` loads their images, `locate` finds the
//! files they name. What is made of a file depends neither on the number of threads nor on where it is cut.
//!
//! The crate `tobj` reads the same files in the tests, as a second opinion. It is not what reads them here: it takes
//! three times as long on one thread only, drops smoothing groups, and makes up what a face leaves out.
//!
//! Units and axes are the file's: OBJ says neither, and most programs write metres with +Y up. Lines, points and
//! free-form surfaces are passed over with a warning; so are a missing library or texture, and faces with a corner
//! that is not finite. What cannot be read at all, or refers to what is not there, is an error with its line.

mod bump;
mod chains;
mod corner;
mod gather;
mod layers;
mod locate;
mod map;
mod material;
mod mesh;
mod mtl;
mod number;
mod object;
mod pieces;
mod polygon;
mod scan;
mod text;
mod textures;

use std::{
    collections::{HashMap, HashSet},
    panic::{AssertUnwindSafe, catch_unwind},
    path::{Path, PathBuf},
};

use glam::Affine3A;

use self::{gather::Gathered, material::Converter, mtl::Library, textures::Textures};
use crate::{
    diagnostic::{Diagnostic, Place},
    import::tangents,
    input,
    world::{Instance, Material, MaterialId, MeshId, Model, Surface},
};

/// More statements that name libraries are passed over: each is looked for in several ways.
const MAX_LIBRARIES: usize = 1000;
/// Larger libraries are refused.
const MAX_MTL_BYTES: u64 = 1 << 26;

/// Reads the OBJ file at `path` and the libraries and images that it names.
pub fn load(path: &Path) -> Result<Model, Vec<Diagnostic>> {
    // The last line: nothing below is known to panic, but `earcut` is not ours.
    catch_unwind(AssertUnwindSafe(|| read(path))).unwrap_or_else(|_| Err(vec![broke_down(path)]))
}

fn broke_down(path: &Path) -> Diagnostic {
    Diagnostic::error(path, Place::File, "the OBJ reader broke down on this file")
        .help("this is a fault of the program, not of the file: please report it")
}

fn read(path: &Path) -> Result<Model, Vec<Diagnostic>> {
    read_in_pieces(path, pieces::PIECE)
}

/// Reads in pieces of about `size` bytes.
fn read_in_pieces(path: &Path, size: usize) -> Result<Model, Vec<Diagnostic>> {
    let pieces = pieces::open(path, size).map_err(|why| {
        vec![Diagnostic::error(path, Place::File, format!("cannot read this OBJ file: {why}"))]
    })?;
    let mut gathered = gather::gather(pieces, path)?;
    let mut model = Model {
        warnings: std::mem::take(&mut gathered.warnings),
        meshes: mesh::build_all(&mut gathered),
        ..Model::default()
    };
    gathered.points = gather::Points::default();
    let stem = path.file_stem().map(|s| s.to_string_lossy().into_owned()).unwrap_or_default();
    for mesh in model.meshes.iter_mut().filter(|mesh| mesh.name.is_empty()) {
        mesh.name.clone_from(&stem);
    }
    add_materials(&gathered, path, &mut model);
    Ok(model)
}

fn read_text(path: &Path, limit: u64) -> Result<String, String> {
    text::decode(input::read(path, limit)?).map_err(Into::into)
}

/// Adds the materials that are used, and the instances.
fn add_materials(gathered: &Gathered, path: &Path, model: &mut Model) {
    let folder = path.parent().unwrap_or(Path::new(""));
    let libraries = read_libraries(gathered, path, model);
    // Vertex colours show where there is no material.
    let mut ids: HashMap<(Option<u32>, bool), MaterialId> = HashMap::new();
    let (mut unknown, mut named) = (Vec::new(), HashSet::new());
    let mut instances = Vec::new();
    let shapes = model.meshes.iter().map(|mesh| (mesh.name.clone(), !mesh.colors.is_empty()));
    let shapes: Vec<_> = shapes.collect();
    let mut converter = Converter { textures: Textures::new(folder, model) };
    for (index, ((name, colored), object)) in shapes.into_iter().zip(&gathered.objects).enumerate() {
        let mut materials = Vec::with_capacity(object.materials.len());
        for &slot in &object.materials {
            let name = slot.and_then(|i| gathered.materials.get(i as usize));
            let found =
                name.and_then(|name| libraries.iter().find_map(|(file, all)| Some((file, all.find(name)?))));
            let colored = colored && found.is_none();
            materials.push(*ids.entry((slot, colored)).or_insert_with(|| {
                let mut material = match found {
                    Some((file, mtl)) => converter.material(mtl, file),
                    None => material::default(colored),
                };
                if let Some(name) = name {
                    // The name that the OBJ file calls it by, which a scene file may use to replace it.
                    material.name.clone_from(name);
                    if found.is_none() && named.insert(name) {
                        unknown.push(name.as_str());
                    }
                }
                converter.textures.model.materials.push(material);
                MaterialId(converter.textures.model.materials.len() as u32 - 1)
            }));
        }
        let mesh = MeshId(index as u32);
        instances.push(Instance { name, mesh, to_world: Affine3A::IDENTITY, materials });
    }
    converter.textures.model.instances = instances;
    add_tangents(model);
    if let Some(first) = unknown.first() {
        let more =
            if unknown.len() > 1 { format!(" and {} others", unknown.len() - 1) } else { String::new() };
        let message = format!("no library has the material `{}`{more}: grey instead", text::shorten(first));
        model.warnings.push(Diagnostic::warning(path, Place::File, message));
    }
}

/// Gives tangents to the meshes that a material bends normals or stretches highlights on.
fn add_tangents(model: &mut Model) {
    let Model { meshes, materials, instances, .. } = model;
    let directed = |material: &Material| {
        let stretched = matches!(&material.surface, Surface::Layered(l) if l.anisotropy.is_some());
        stretched || material.normal.is_some()
    };
    let wanted = |instance: &&Instance| {
        instance.materials.iter().filter_map(|id| materials.get(id.index())).any(directed)
    };
    for instance in instances.iter().filter(wanted) {
        if let Some(mesh) = meshes.get_mut(instance.mesh.index()) {
            tangents::generate(mesh, 0);
        }
    }
}

/// The libraries that are there, in the order in which they are searched. Where none is named, the one called as the
/// OBJ file is.
fn read_libraries(gathered: &Gathered, path: &Path, model: &mut Model) -> Vec<(PathBuf, Library)> {
    let folders = [path.parent().unwrap_or(Path::new(""))];
    let mut files: Vec<PathBuf> = Vec::new();
    let mut warnings = Vec::new();
    for (line, named) in gathered.libraries.iter().take(MAX_LIBRARIES) {
        let found = library_files(named, |name| locate::locate(&folders, name));
        for (name, file) in found {
            match file {
                Some(file) if files.contains(&file) => {}
                Some(file) => files.push(file),
                None => {
                    let message = format!("the material library `{}` was not found", text::shorten(&name));
                    let help = "put it beside the OBJ file, or correct the name after `mtllib`";
                    warnings.push(Diagnostic::warning(path, Place::Line(*line), message).help(help));
                }
            }
        }
    }
    if let Some((line, _)) = gathered.libraries.get(MAX_LIBRARIES) {
        let message =
            format!("more than {MAX_LIBRARIES} `mtllib` statements: from here on they are passed over");
        warnings.push(Diagnostic::warning(path, Place::Line(*line), message));
    }
    if gathered.libraries.is_empty() && !gathered.materials.is_empty() {
        files.extend(Some(path.with_extension("mtl")).filter(|file| file.is_file()));
    }
    model.sources.extend_from_slice(&files);
    let mut libraries = Vec::new();
    for file in files {
        match read_text(&file, MAX_MTL_BYTES) {
            Ok(text) => {
                let (materials, said) = mtl::parse(&text, &file);
                warnings.extend(said);
                libraries.push((file, Library::new(materials)));
            }
            Err(why) => {
                let message = format!("cannot read this material library: {why}");
                warnings.push(Diagnostic::warning(file, Place::File, message));
            }
        }
    }
    model.warnings.append(&mut warnings);
    libraries
}

/// `named` is one name with spaces, or one and a comment, or several: the first reading that finds a file.
fn library_files(named: &str, find: impl Fn(&str) -> Option<PathBuf>) -> Vec<(String, Option<PathBuf>)> {
    let whole = named.trim_matches('"');
    for name in [whole, text::name_without_comment(whole)] {
        if let Some(file) = find(name) {
            return vec![(name.to_owned(), Some(file))];
        }
    }
    let name = text::name_without_comment(whole);
    // A space within a name may be written `\ `: U+0000, which no name holds, stands for it while the names are split.
    let escaped = name.replace("\\ ", "\0");
    let words = escaped.split_whitespace().map(|word| word.replace('\0', " "));
    let several: Vec<_> = words.map(|word| (word.clone(), find(&word))).collect();
    if several.iter().any(|(_, file)| file.is_some()) { several } else { vec![(name.to_owned(), None)] }
}

#[cfg(test)]
mod tests;
