//! `rayo schema`.

use std::io::{self, ErrorKind, Write};

use super::Failure;

/// Print the JSON Schema of scene files.
///
/// Editors complete and check scene files with it: save it beside them and write
/// `#:schema ./rayo.schema.json` as the first line of a scene file.
#[derive(Debug, clap::Args)]
pub struct Args {}

pub fn run(_: &Args) -> Result<(), Failure> {
    match writeln!(io::stdout(), "{:#}", crate::scene::schema()) {
        // Whoever reads has seen enough.
        Err(error) if error.kind() == ErrorKind::BrokenPipe => Ok(()),
        Err(error) => Err(Failure::Failed(format!("error: cannot write the schema: {error}"))),
        Ok(()) => Ok(()),
    }
}
