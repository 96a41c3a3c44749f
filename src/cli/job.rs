//! What a command works on: a scene file or a bare model, loaded.

use std::path::{Path, PathBuf};

use super::{Failure, flags::Choices, terminal::has_color};
use crate::{
    diagnostic::{self, Diagnostic, Place},
    import::{Assembled, assemble_while, studio},
    output, render,
    scene::{self, CameraSource, Lens, ModelSource, ValidScene},
    world::{Material, Model, World},
};

/// What is rendered, and how.
pub struct Job {
    pub world: World,
    pub render: render::Settings,
    pub output: output::Settings,
}

/// Reads `file`, and of its models what `choices` say. `adjust` applies the flags before anything large is loaded; framing depends on the size of the picture.
pub fn load(
    file: &Path,
    choices: &Choices,
    adjust: impl FnOnce(&mut render::Settings, &mut output::Settings) -> Result<(), Failure>,
) -> Result<Job, Failure> {
    load_while(file, choices, adjust, |_, _, _| ()).map(|(job, _)| job)
}

/// The same, and what `meanwhile` makes of each model (see [`assemble_while`]), in the order of their meshes.
pub fn load_while<T: Send>(
    file: &Path,
    choices: &Choices,
    adjust: impl FnOnce(&mut render::Settings, &mut output::Settings) -> Result<(), Failure>,
    meanwhile: impl Fn(&Model, &[&Material], &render::Settings) -> T + Sync,
) -> Result<(Job, Vec<T>), Failure> {
    let extension = file.extension().and_then(|e| e.to_str()).unwrap_or_default().to_ascii_lowercase();
    match extension.as_str() {
        "toml" => {
            let mut scene = scene::load(file).map_err(|all| bad_input(&all))?;
            adjust(&mut scene.render, &mut scene.output)?;
            choose(&mut scene, choices)?;
            let settings = scene.render.clone();
            let assembled = assemble_while(scene, |model, replacing| meanwhile(model, replacing, &settings));
            let Assembled { world, render, output, made } = assembled.map_err(|all| bad_input(&all))?;
            Ok((Job { world, render, output }, made))
        }
        "glb" | "gltf" | "obj" => {
            // Beside whoever asked, not beside the model, which may lie in somebody's collection.
            let name = file.file_name().map(PathBuf::from).unwrap_or_default();
            let mut render = render::Settings::default();
            let mut output =
                output::Settings { file: name.with_extension("png"), ..output::Settings::default() };
            adjust(&mut render, &mut output)?;
            let (selection, camera) = (choices.selection(), choices.camera.as_deref());
            let meanwhile = |model: &Model| meanwhile(model, &[], &render);
            let shown = studio::bare_asset(file, render.size, &selection, camera, meanwhile);
            let (world, made) = shown.map_err(|all| bad_input(&all))?;
            Ok((Job { world, render, output }, vec![made]))
        }
        _ => {
            let name = file.display();
            Err(Failure::BadInput(format!(
                "error: cannot tell what {name} is: rayo renders scene files (.toml) and models (.glb, .gltf, .obj)"
            )))
        }
    }
}

/// What `choices` can mean in a scene file, whose models say the rest themselves.
fn choose(scene: &mut ValidScene, choices: &Choices) -> Result<(), Failure> {
    let flags = [("scene", &choices.scene), ("variant", &choices.variant), ("animation", &choices.animation)];
    if let Some((flag, _)) = flags.into_iter().find(|(_, given)| given.is_some()) {
        return Err(Failure::BadInput(format!(
            "error: --{flag} goes with a bare model; in a scene file write `{flag} = …` in its [[model]]"
        )));
    }
    if let Some(at) = choices.at {
        let animated =
            |model: &&mut ModelSource| model.selection.animation.is_some() || model.selection.at.is_some();
        let mut animated = scene.models.iter_mut().filter(animated).peekable();
        if animated.peek().is_none() {
            return Err(Failure::BadInput(
                "error: --at: no model of this scene is animated; write `animation = …` in its [[model]]"
                    .into(),
            ));
        }
        animated.for_each(|model| model.selection.at = Some(at));
    }
    if let Some(name) = &choices.camera {
        let (lens, focus) = match &scene.camera {
            CameraSource::Imported { lens, focus, .. } => (*lens, *focus),
            _ => (Lens::Diameter(0.0), None),
        };
        scene.camera = CameraSource::Imported { name: Some(name.clone()), lens, focus, place: Place::File };
    }
    Ok(())
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
