//! To come.

use std::path::Path;

use crate::{
    diagnostic::{Diagnostic, Place},
    world::Model,
};

pub fn load(path: &Path) -> Result<Model, Vec<Diagnostic>> {
    Err(vec![Diagnostic::error(path, Place::File, "this kind of file cannot be read yet")])
}
