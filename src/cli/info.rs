//! `rayo info`: what a model holds.

use std::{
    io::{self, ErrorKind, Write},
    path::PathBuf,
};

use super::{Failure, terminal::has_color};
use crate::{diagnostic, import};

/// Tell what a model holds
///
/// Meshes, triangles, images and the memory they take, materials, animations, cameras, lights, variants, and the extensions of
/// glTF that it uses, each supported or ignored.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Model (.glb, .gltf, .obj)
    file: PathBuf,

    /// Print JSON, with every name
    #[arg(long)]
    json: bool,
}

pub fn run(args: &Args) -> Result<(), Failure> {
    let info =
        import::info(&args.file).map_err(|all| Failure::BadInput(diagnostic::render(&all, has_color())))?;
    let text = if args.json {
        serde_json::to_string_pretty(&info).map_err(|e| Failure::Failed(format!("error: {e}")))? + "\n"
    } else {
        info.to_string()
    };
    match io::stdout().write_all(text.as_bytes()) {
        // Whoever reads has seen enough.
        Err(error) if error.kind() == ErrorKind::BrokenPipe => Ok(()),
        Err(error) => Err(Failure::Failed(format!("error: cannot write: {error}"))),
        Ok(()) => Ok(()),
    }
}
