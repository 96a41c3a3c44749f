//! To come.

use std::path::Path;

use crate::{
    diagnostic::{Diagnostic, Place},
    world::Image,
};

pub fn load(path: &Path) -> Result<Image, Diagnostic> {
    Err(Diagnostic::error(path, Place::File, "images cannot be read yet"))
}
