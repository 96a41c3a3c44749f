//! A scene file after validation: every value in range, every name resolved, units converted (radians, linear
//! colours), file names resolved to paths that exist. What the files hold has not been looked at yet.

use std::path::PathBuf;

use glam::{Affine3A, Vec3};

use super::Selection;
use crate::{
    diagnostic::{Diagnostic, Place},
    output, render,
    world::{Camera, ColorSpace, Filter, Light, Material, MaterialId, Projection, Quad, Sphere, Wrap},
};

/// Spheres, quads and materials refer to `materials` by [`MaterialId`] and to `images` by
/// [`TextureId`](crate::world::TextureId): texture i is `images[i]`.
#[derive(Clone, Debug)]
pub struct ValidScene {
    pub file: PathBuf,
    pub render: render::Settings,
    pub output: output::Settings,
    pub camera: CameraSource,
    /// Without: what a model brings, or nothing.
    pub environment: Option<EnvironmentSource>,
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
    /// A camera of one of the models: by its name or its node's, or the first there is. Without `focus` the middle of everything is in
    /// focus.
    Imported {
        name: Option<String>,
        lens: Lens,
        focus: Option<f32>,
        place: Place,
    },
    /// No place said: a camera that frames all models, spheres and quads.
    Framed {
        projection: Projection,
        lens: Lens,
        focus: Option<f32>,
    },
}

/// How wide the lens is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Lens {
    /// Metres.
    Diameter(f32),
    /// Focal length over diameter; the focal length follows from the field of view and the sensor's height (metres).
    FStop { number: f32, sensor_height: f32 },
}

impl Lens {
    /// Metres; `vfov` in radians.
    pub fn diameter(self, vfov: f32) -> f32 {
        match self {
            Lens::Diameter(diameter) => diameter,
            Lens::FStop { number, sensor_height } => sensor_height / (2.0 * (vfov / 2.0).tan()) / number,
        }
    }
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
    Gradient {
        bottom: Vec3,
        top: Vec3,
    },
    /// `place` is where the scene file says so.
    Image {
        file: PathBuf,
        place: Place,
    },
}

/// An image file used as a texture by a material of the scene file.
#[derive(Clone, Debug, PartialEq)]
pub struct ImageSource {
    pub file: PathBuf,
    /// Where the scene file first says so.
    pub place: Place,
    pub color_space: ColorSpace,
    pub wrap: Wrap,
    pub filter: Filter,
}

#[derive(Clone, Debug)]
pub struct ModelSource {
    pub file: PathBuf,
    /// What of it is shown.
    pub selection: Selection,
    pub to_world: Affine3A,
    /// Replaces every imported material.
    pub material: Option<MaterialId>,
    /// Replace imported materials by name.
    pub materials: Vec<MaterialOverride>,
    /// Where the scene file names the file, for messages about what it holds.
    pub place: Place,
}

#[derive(Clone, Debug)]
pub struct MaterialOverride {
    pub name: String,
    pub material: MaterialId,
    /// Where the scene file says so.
    pub place: Place,
}

impl ImageSource {
    /// The same texture, wherever it is named.
    pub fn same_lookup(&self, other: &Self) -> bool {
        let lookup = |source: &Self| (source.color_space, source.wrap, source.filter);
        self.file == other.file && lookup(self) == lookup(other)
    }
}
