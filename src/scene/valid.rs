//! A scene file after validation: every value in range, every name resolved, units converted (radians, linear
//! colours), file names resolved to paths that exist. What the files hold has not been looked at yet.

use std::{collections::BTreeMap, path::PathBuf};

use glam::{Affine3A, Vec3};

use crate::{
    diagnostic::Diagnostic,
    output, render,
    world::{Camera, ColorSpace, Filter, Light, Material, MaterialId, Quad, Sphere, Wrap},
};

/// Spheres, quads and materials refer to `materials` by [`MaterialId`] and to `images` by
/// [`TextureId`](crate::world::TextureId): texture i is `images[i]`.
#[derive(Clone, Debug)]
pub struct ValidScene {
    pub file: PathBuf,
    pub render: render::Settings,
    pub output: output::Settings,
    pub camera: CameraSource,
    pub environment: EnvironmentSource,
    pub materials: Vec<Material>,
    pub images: Vec<ImageSource>,
    pub spheres: Vec<Sphere>,
    pub quads: Vec<Quad>,
    pub models: Vec<ModelSource>,
    pub lights: Vec<Light>,
    pub warnings: Vec<Diagnostic>,
}

#[derive(Clone, Debug)]
pub enum CameraSource {
    Placed(Camera),
    /// A camera of one of the models: by name, or the first there is. `aperture` and `focus` come from the scene file.
    Imported {
        name: Option<String>,
        aperture: f32,
        focus: Option<f32>,
    },
    /// Nothing said: a camera that frames all models, spheres and quads.
    Framed,
}

/// Strength, rotation (radians) and visibility as in [`Environment`](crate::world::Environment).
#[derive(Clone, Debug)]
pub struct EnvironmentSource {
    pub kind: EnvironmentSourceKind,
    pub strength: f32,
    pub rotation: f32,
    pub visible: bool,
}

#[derive(Clone, Debug)]
pub enum EnvironmentSourceKind {
    Color(Vec3),
    Gradient { bottom: Vec3, top: Vec3 },
    Image(PathBuf),
}

/// An image file used as a texture by a material of the scene file.
#[derive(Clone, Debug, PartialEq)]
pub struct ImageSource {
    pub file: PathBuf,
    pub color_space: ColorSpace,
    pub wrap: Wrap,
    pub filter: Filter,
}

#[derive(Clone, Debug)]
pub struct ModelSource {
    pub file: PathBuf,
    pub to_world: Affine3A,
    /// Replaces every imported material.
    pub material: Option<MaterialId>,
    /// Replaces imported materials by name.
    pub materials: BTreeMap<String, MaterialId>,
    /// Where the scene file says so, for messages about what the model holds.
    pub place: crate::diagnostic::Place,
}
