//! Outside assets into a [`Model`], and everything a scene file names into one
//! [`World`](crate::world::World).

mod assemble;
mod bounds;
mod cameras;
mod framing;
pub mod gltf;
pub mod image;
mod info;
mod ktx2;
mod merge;
pub mod obj;
pub mod studio;
mod tangents;

use std::path::Path;

pub use assemble::{Assembled, assemble, assemble_while};
pub use info::info;

use crate::{
    diagnostic::{Diagnostic, Place},
    scene::Selection,
    world::Model,
};

/// Reads what `selection` says of an asset, of the kind that its file name says.
pub fn model(path: &Path, selection: &Selection) -> Result<Model, Vec<Diagnostic>> {
    model_while(path, selection, |_| ()).map(|(model, ())| model)
}

/// The same, and what `meanwhile` makes of the model's meshes, materials and instances, while images may still be decoded.
pub fn model_while<T: Send>(
    path: &Path,
    selection: &Selection,
    meanwhile: impl Fn(&Model) -> T + Sync,
) -> Result<(Model, T), Vec<Diagnostic>> {
    let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase()).unwrap_or_default();
    let (mut model, made) = match extension.as_str() {
        "glb" | "gltf" => gltf::load_while(path, selection, meanwhile)?,
        "obj" if *selection != Selection::default() => {
            let message = "an OBJ file has no scenes and no animations to choose from";
            return Err(vec![Diagnostic::error(path, Place::File, message)]);
        }
        "obj" => {
            let model = obj::load(path)?;
            let made = meanwhile(&model);
            (model, made)
        }
        _ => {
            let message = "this is not a kind of model that can be read";
            let help = "models are .glb, .gltf and .obj files";
            return Err(vec![Diagnostic::error(path, Place::File, message).help(help)]);
        }
    };
    model.sources.push(path.to_owned());
    Ok((model, made))
}
