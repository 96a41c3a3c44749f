//! Stub.

use crate::{diagnostic::Diagnostic, world::*};

pub fn bare_asset(path: &std::path::Path) -> Result<World, Vec<Diagnostic>> {
    match std::fs::read(path) {
        Ok(_) => Ok(empty()),
        Err(e) => Err(vec![Diagnostic::error(path, crate::diagnostic::Place::File, e.to_string())]),
    }
}

pub fn empty() -> World {
    World {
        model: Model::default(),
        spheres: vec![],
        quads: vec![],
        environment: Environment {
            kind: EnvironmentKind::Color(glam::Vec3::ONE),
            strength: 1.0,
            rotation: 0.0,
            visible: true,
        },
        camera: Camera {
            name: String::new(),
            to_world: glam::Affine3A::IDENTITY,
            projection: Projection::Perspective { vfov: 1.0 },
            aperture: 0.0,
            focus: 1.0,
        },
    }
}
