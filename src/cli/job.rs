//! What a command works on: a scene file or a bare model, loaded.

use std::path::{Path, PathBuf};

use super::{Failure, terminal::has_color};
use crate::{
    diagnostic::{self, Diagnostic},
    import::{assemble, studio},
    output, render, scene,
    world::World,
};

/// What is rendered, and how.
pub struct Job {
    pub world: World,
    pub render: render::Settings,
    pub output: output::Settings,
}

/// Reads `file`. `adjust` applies the flags before anything large is loaded; framing depends on the size of the picture.
pub fn load(
    file: &Path,
    adjust: impl FnOnce(&mut render::Settings, &mut output::Settings) -> Result<(), Failure>,
) -> Result<Job, Failure> {
    let extension = file.extension().and_then(|e| e.to_str()).unwrap_or_default().to_ascii_lowercase();
    match extension.as_str() {
        "toml" => {
            let mut scene = scene::load(file).map_err(|all| bad_input(&all))?;
            adjust(&mut scene.render, &mut scene.output)?;
            let (world, render, output) = assemble(scene).map_err(|all| bad_input(&all))?;
            Ok(Job { world, render, output })
        }
        "glb" | "gltf" | "obj" => {
            // Beside whoever asked, not beside the model, which may lie in somebody's collection.
            let name = file.file_name().map(PathBuf::from).unwrap_or_default();
            let mut render = render::Settings::default();
            let mut output =
                output::Settings { file: name.with_extension("png"), ..output::Settings::default() };
            adjust(&mut render, &mut output)?;
            let world = studio::bare_asset(file, render.size).map_err(|all| bad_input(&all))?;
            Ok(Job { world, render, output })
        }
        _ => {
            let name = file.display();
            Err(Failure::BadInput(format!(
                "error: cannot tell what {name} is: rayo renders scene files (.toml) and models (.glb, .gltf, .obj)"
            )))
        }
    }
}

/// Whether the settings, as the flags left them, can be rendered.
pub fn check(render: &render::Settings) -> Result<(), Failure> {
    let faults = render.faults();
    if faults.is_empty() {
        return Ok(());
    }
    Err(Failure::BadInput(faults.iter().map(|fault| format!("error: {fault}\n")).collect()))
}

fn bad_input(diagnostics: &[Diagnostic]) -> Failure {
    Failure::BadInput(diagnostic::render(diagnostics, has_color()))
}
