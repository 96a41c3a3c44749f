//! Outside assets into a [`Model`](crate::world::Model).

pub mod gltf;
pub mod image;
pub mod obj;
pub mod studio;

use crate::{diagnostic::Diagnostic, output, render, scene::ValidScene, world::World};

pub fn assemble(scene: ValidScene) -> Result<(World, render::Settings, output::Settings), Vec<Diagnostic>> {
    Ok((studio::empty(), scene.render, scene.output))
}
