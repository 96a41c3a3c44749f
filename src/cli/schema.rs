//! `rayo schema`.

use super::{Failure, print};

/// Print the JSON Schema of scene files.
///
/// Editors complete and check scene files with it: save it beside them and write
/// `#:schema ./rayo.schema.json` as the first line of a scene file.
#[derive(Debug, clap::Args)]
pub struct Args {}

pub fn run(_: &Args) -> Result<(), Failure> {
    print(&format!("{:#}\n", crate::scene::schema()))
}
