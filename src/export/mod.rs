//! A [`World`] as input for another renderer: the one place that knows other programs' conventions.
//!
//! An export is a folder with relative paths only, which the other program renders as it is, set up so that nothing
//! but the scene decides the picture: no clamping, denoising, adaptive sampling or tone curve, equal bounce limits.
//! What the other program cannot express is approximated or dropped, and every such case is a [`Note`]: printed, and
//! kept in `NOTES.md` in the folder.
//!
//! | target | files | units and axes |
//! |---|---|---|
//! | `blender` | `scene.py`, `scene.json`, NumPy arrays, textures | +Z up; W instead of W/sr for lamps |
//! | `povray` | `scene.pov`, `scene.ini`, meshes, textures | left-handed; lights as irradiance over π |
//! | `mitsuba` | `scene.xml`, PLY meshes, textures | as here |

mod bitmap;
mod blender;
mod folder;
mod fuzz;
mod layers;
mod mitsuba;
mod names;
mod note;
mod povray;
mod shading;

use std::{collections::BTreeSet, path::Path};

pub use note::{Kind, Note};

use crate::{
    output, render,
    world::{Material, MaterialId, World},
};
use folder::Folder;
use note::Notes;

#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Target {
    Blender,
    Povray,
    Mitsuba,
}

#[derive(Clone, Copy, Debug, Default)]
pub struct Options {
    /// Nothing is written where anything had to be approximated or dropped.
    pub strict: bool,
    /// The Blender script also saves `scene.blend` when it runs.
    pub save_blend: bool,
}

/// What was written.
#[derive(Clone, Debug)]
pub struct Export {
    /// How to render it, from inside the folder, to `scene.exr` there.
    pub command: &'static str,
    /// Per pixel, as the folder has it: POV-Ray cannot take any number.
    pub samples: u32,
    pub notes: Vec<Note>,
}

#[derive(Debug, thiserror::Error)]
pub enum Error {
    #[error("cannot create the folder {folder}: {problem}")]
    Folder { folder: String, problem: String },
    #[error("{0} is in the way: no export wrote it; choose another folder, or move it")]
    Foreign(String),
    /// Refused by [`Options::strict`].
    #[error("the scene cannot be expressed exactly")]
    Inexact(Vec<Note>),
    #[error("cannot encode {file}: {problem}")]
    Encoding { file: String, problem: String },
    #[error(transparent)]
    Output(#[from] output::Error),
}

/// Writes `world` into `folder`, which is made where it does not exist; files of an earlier export are replaced, any
/// other is an error.
pub fn export(
    world: &World,
    settings: &render::Settings,
    target: Target,
    folder: &Path,
    options: Options,
) -> Result<Export, Error> {
    let mut out = Folder::stage(folder)?;
    let mut notes = Notes::default();
    let command = match target {
        Target::Blender => blender::write(world, settings, options, &mut out, &mut notes),
        Target::Povray => {
            let world = layers::removed(world, &mut notes);
            povray::write(&world, settings, &mut out, &mut notes)
        }
        Target::Mitsuba => {
            let world = layers::removed(world, &mut notes);
            mitsuba::write(&world, settings, &mut out, &mut notes)
        }
    }?;
    let notes = notes.finish();
    if options.strict && !notes.is_empty() {
        return Err(Error::Inexact(notes));
    }
    out.write("NOTES.md", note::page(target.name(), command, &notes).as_bytes())?;
    out.publish()?;
    let samples = match target {
        Target::Povray => povray::samples(world, settings),
        Target::Blender | Target::Mitsuba => settings.samples,
    };
    Ok(Export { command, samples, notes })
}

impl Target {
    pub const ALL: [Self; 3] = [Self::Blender, Self::Povray, Self::Mitsuba];

    /// As it is called in commands and file names.
    pub fn key(self) -> &'static str {
        match self {
            Self::Blender => "blender",
            Self::Povray => "povray",
            Self::Mitsuba => "mitsuba",
        }
    }

    pub fn name(self) -> &'static str {
        match self {
            Self::Blender => "Blender Cycles",
            Self::Povray => "POV-Ray",
            Self::Mitsuba => "Mitsuba 3",
        }
    }
}

/// The materials of all that is placed, each once.
fn used_materials(world: &World) -> Vec<&Material> {
    used(world).into_iter().filter_map(|id| world.model.materials.get(id.index())).collect()
}

fn used(world: &World) -> BTreeSet<MaterialId> {
    let spheres = world.spheres.iter().map(|sphere| sphere.material);
    let quads = world.quads.iter().map(|quad| quad.material);
    let instances = world.model.instances.iter().flat_map(|instance| instance.materials.iter().copied());
    spheres.chain(quads).chain(instances).collect()
}
