//! Wavefront OBJ with its material libraries (MTL) into a [`Model`]: one mesh and instance for each object (`o`), with
//! a slot for each of its materials.
//!
//! `text` makes statements of bytes, `clean` rewrites them so that `tobj` reads them without a choice of its own,
//! `mesh` makes triangles of what it returns (`polygon`) and supplies normals; `mtl` reads material libraries,
//! `material` says what they mean, `textures` loads their images, `locate` finds the files they name.
//!
//! Units and axes are the file's: OBJ says neither, and most programs write metres with +Y up. Lines, points and
//! free-form surfaces are passed over with a warning; so are a missing library or texture, and faces with a corner
//! that is not finite. What cannot be read at all, or refers to what is not there, is an error with its line.

mod clean;
mod corner;
mod locate;
mod material;
mod mesh;
mod mtl;
mod polygon;
mod text;
mod textures;

use std::{
    collections::HashMap,
    panic::{AssertUnwindSafe, catch_unwind},
    path::{Path, PathBuf},
};

use glam::Affine3A;

use self::{clean::Clean, material::Converter, mtl::Mtl, polygon::Triangulator, textures::Textures};
use crate::{
    diagnostic::{Diagnostic, Place},
    input,
    world::{Instance, MaterialId, MeshId, Model},
};

/// Larger files are refused: in memory they take several times their size.
const MAX_OBJ_BYTES: u64 = 1 << 30;
const MAX_MTL_BYTES: u64 = 1 << 26;

/// Reads the OBJ file at `path` and the libraries and images that it names.
pub fn load(path: &Path) -> Result<Model, Vec<Diagnostic>> {
    // The last line: nothing below is known to panic, but `tobj` and `earcut` are not ours.
    catch_unwind(AssertUnwindSafe(|| read(path))).unwrap_or_else(|_| Err(vec![broke_down(path)]))
}

fn broke_down(path: &Path) -> Diagnostic {
    Diagnostic::error(path, Place::File, "the OBJ reader broke down on this file")
        .help("this is a fault of the program, not of the file: please report it")
}

fn read(path: &Path) -> Result<Model, Vec<Diagnostic>> {
    let text = read_text(path, MAX_OBJ_BYTES).map_err(|why| {
        vec![Diagnostic::error(path, Place::File, format!("cannot read this OBJ file: {why}"))]
    })?;
    let mut clean = clean::clean(&text, path)?;
    drop(text);
    let mut model = Model { warnings: std::mem::take(&mut clean.warnings), ..Model::default() };
    let objects = add_meshes(&clean, path, &mut model)?;
    add_materials(&clean, path, &mut model, objects);
    Ok(model)
}

fn read_text(path: &Path, limit: u64) -> Result<String, String> {
    text::decode(input::read(path, limit)?).map_err(Into::into)
}

/// What becomes of an object: an instance of the mesh of the same number, with the OBJ material of each slot.
struct Object {
    name: String,
    slots: Vec<Option<u32>>,
}

/// Adds the meshes.
fn add_meshes(clean: &Clean, path: &Path, model: &mut Model) -> Result<Vec<Object>, Vec<Diagnostic>> {
    let options = tobj::LoadOptions { triangulate: false, single_index: false, ..Default::default() };
    let no_materials = |_: &Path| Err(tobj::LoadError::GenericFailure);
    let (objects, _) = tobj::load_obj_buf(&mut clean.reader(), &options, no_materials)
        .map_err(|e| vec![Diagnostic::error(path, Place::File, format!("cannot read this OBJ file: {e}"))])?;
    let stem = path.file_stem().map(|s| s.to_string_lossy().into_owned()).unwrap_or_default();
    let mut faces = clean.faces.as_slice();
    let (mut left_out, mut without_slot) = (0, 0);
    let mut triangulator = Triangulator::default();
    let mut named = Vec::new();
    for (object, name) in objects.iter().zip(&clean.objects) {
        let arities = object.mesh.face_arities.len();
        let count = if arities == 0 { object.mesh.indices.len() / 3 } else { arities };
        let built = faces.split_at_checked(count).and_then(|(these, rest)| {
            faces = rest;
            mesh::build(&object.mesh, these, &mut triangulator)
        });
        let Some(mut built) = built else { return Err(vec![broke_down(path)]) };
        left_out += built.left_out;
        without_slot += built.without_slot;
        if !built.mesh.triangles.is_empty() {
            let name = if name.is_empty() { &stem } else { name };
            built.mesh.name.clone_from(name);
            named.push(Object { name: name.clone(), slots: built.slots });
            model.meshes.push(built.mesh);
        }
    }
    let mut warn = |message| model.warnings.push(Diagnostic::warning(path, Place::File, message));
    if left_out > 0 {
        warn(format!("faces left out because a corner is infinite or not a number: {left_out}"));
    }
    if triangulator.fanned > 0 {
        let fanned = triangulator.fanned;
        warn(format!("concave polygons cut up as if convex, as there are too many so large: {fanned}"));
    }
    if without_slot > 0 {
        warn(format!("triangles with the wrong material, as an object may have 65536: {without_slot}"));
    }
    if model.meshes.is_empty() {
        let message = "there is nothing to render: no face has finite corners";
        let help = "its vertices are `nan` or `inf`, or too large: export it again";
        return Err(vec![Diagnostic::error(path, Place::File, message).help(help)]);
    }
    Ok(named)
}

/// Adds the materials that are used, and the instances.
fn add_materials(clean: &Clean, path: &Path, model: &mut Model, objects: Vec<Object>) {
    let folder = path.parent().unwrap_or(Path::new(""));
    let libraries = read_libraries(clean, path, model);
    let mut ids: HashMap<Option<u32>, MaterialId> = HashMap::new();
    let colored = model.meshes.iter().any(|mesh| !mesh.colors.is_empty());
    let mut converter = Converter { textures: Textures::new(folder, model) };
    let mut unknown = Vec::new();
    for (index, Object { name, slots }) in objects.into_iter().enumerate() {
        let mut materials = Vec::with_capacity(slots.len());
        for slot in slots {
            materials.push(*ids.entry(slot).or_insert_with(|| {
                let name = slot.and_then(|i| clean.materials.get(i as usize));
                let found = name.and_then(|name| {
                    libraries.iter().find_map(|(file, all)| Some((file, mtl::find(all, name)?)))
                });
                let mut material = match found {
                    Some((file, mtl)) => converter.material(mtl, file),
                    None => material::default(colored),
                };
                if let Some(name) = name {
                    // The name that the OBJ file calls it by, which a scene file may use to replace it.
                    material.name.clone_from(name);
                    if found.is_none() {
                        unknown.push(name.as_str());
                    }
                }
                converter.textures.model.materials.push(material);
                MaterialId(converter.textures.model.materials.len() as u32 - 1)
            }));
        }
        let mesh = MeshId(index as u32);
        converter.textures.model.instances.push(Instance {
            name,
            mesh,
            to_world: Affine3A::IDENTITY,
            materials,
        });
    }
    if let Some(first) = unknown.first() {
        let more =
            if unknown.len() > 1 { format!(" and {} others", unknown.len() - 1) } else { String::new() };
        let message = format!("no library has the material `{}`{more}: grey instead", text::shorten(first));
        model.warnings.push(Diagnostic::warning(path, Place::File, message));
    }
}

/// The libraries that are there, in the order in which they are searched. Where none is named, the one called as the
/// OBJ file is.
fn read_libraries(clean: &Clean, path: &Path, model: &mut Model) -> Vec<(PathBuf, Vec<Mtl>)> {
    let folders = [path.parent().unwrap_or(Path::new(""))];
    let mut files: Vec<PathBuf> = Vec::new();
    let mut warnings = Vec::new();
    for (line, named) in &clean.libraries {
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
    if clean.libraries.is_empty() && !clean.materials.is_empty() {
        files.extend(Some(path.with_extension("mtl")).filter(|file| file.is_file()));
    }
    model.sources.extend_from_slice(&files);
    let mut libraries = Vec::new();
    for file in files {
        match read_text(&file, MAX_MTL_BYTES) {
            Ok(text) => {
                let (materials, said) = mtl::parse(&text, &file);
                warnings.extend(said);
                libraries.push((file, materials));
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
