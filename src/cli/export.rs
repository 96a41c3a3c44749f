//! `rayo export`: a scene as input for another renderer.

use std::path::PathBuf;

use clap::ValueEnum;

use super::{
    Failure,
    flags::{Basics, Choices},
    job::{self, Job},
    terminal::{has_color, say},
};
use crate::{
    diagnostic,
    export::{self, Error, Note, Options, Target},
};

/// Write a scene as input for another renderer
///
/// The folder is rendered as it is by Blender (Cycles), POV-Ray or Mitsuba 3; NOTES.md in it says with which command. What
/// the other program cannot express is approximated or dropped, and every such case is printed.
#[derive(Debug, clap::Args)]
#[command(args_override_self = true)]
pub struct Args {
    /// Scene file (.toml) or model (.glb, .gltf, .obj)
    file: PathBuf,

    /// The other renderer
    #[arg(long, value_enum)]
    to: Name,

    /// Folder to write, made where it does not exist; files of an earlier export in it are replaced
    #[arg(long, short, value_name = "DIR")]
    output: PathBuf,

    /// Fail, and write nothing, where anything would be approximated or dropped
    #[arg(long)]
    strict: bool,

    /// Blender: also save scene.blend when the script runs
    #[arg(long)]
    save_blend: bool,

    /// Print nothing but errors
    #[arg(long, short)]
    quiet: bool,

    #[command(flatten)]
    choices: Choices,

    #[command(flatten)]
    basics: Basics,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Name {
    Blender,
    Povray,
    Mitsuba,
}

impl Name {
    pub fn target(self) -> Target {
        match self {
            Self::Blender => Target::Blender,
            Self::Povray => Target::Povray,
            Self::Mitsuba => Target::Mitsuba,
        }
    }
}

pub fn run(args: &Args) -> Result<(), Failure> {
    if args.save_blend && args.to != Name::Blender {
        return Err(Failure::BadInput("error: --save-blend goes with --to blender only".into()));
    }
    let Job { world, render, .. } = job::load(&args.file, &args.choices, |render, _| {
        args.basics.apply(render);
        job::check(render)
    })?;
    if !world.model.warnings.is_empty() {
        say(diagnostic::render(&world.model.warnings, has_color()).trim_end());
    }
    let options = Options { strict: args.strict, save_blend: args.save_blend };
    let exported = export::export(&world, &render, args.to.target(), &args.output, options);
    let export = exported.map_err(|error| match error {
        Error::Inexact(notes) => Failure::BadInput(format!(
            "error: {} cannot express this scene exactly; nothing was written\n{}",
            args.to.target().name(),
            lines(&notes)
        )),
        Error::Folder { .. } | Error::Foreign(_) => Failure::BadInput(format!("error: {error}")),
        other => Failure::Failed(format!("error: {other}")),
    })?;
    if !args.quiet {
        if !export.notes.is_empty() {
            say(lines(&export.notes).trim_end());
        }
        say(format!("wrote {}; to render it there:\n    {}", args.output.display(), export.command));
    }
    Ok(())
}

fn lines(notes: &[Note]) -> String {
    notes.iter().map(|note| format!("{note}\n")).collect()
}
