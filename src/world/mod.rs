//! The flattened description of what is to be rendered: plain data, index handles, metres, linear Rec.709,
//! one moment in time. Importers and the scene file write it, `compile` (and exporters) read it. No acceleration
//! structures, no sampling tables, and of files only their names, lest a picture be written over one.

mod camera;
mod environment;
mod image;
mod layers;
mod light;
mod material;
mod mesh;

pub use camera::{Camera, Projection};
pub use environment::{Environment, EnvironmentKind};
pub use image::{ColorSpace, Filter, Image, Texels, Texture, TextureRef, Wrap};
pub use layers::{
    Anisotropy, Clearcoat, DiffuseTransmission, Iridescence, Layered, Sheen, SpecularGlossiness,
    SpecularLevel, Volume,
};
pub use light::Light;
pub use material::{
    Alpha, ColorInput, Emission, Fresnel, Material, MetalFinish, NormalMap, Pbr, ScalarInput, Surface,
};
pub use mesh::{Instance, Mesh, Quad, Sphere};

use std::path::PathBuf;

use crate::diagnostic::Diagnostic;

macro_rules! handles {
    ($($(#[$doc:meta])* $name:ident),* $(,)?) => {$(
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
        pub struct $name(pub u32);

        impl $name {
            pub fn index(self) -> usize {
                self.0 as usize
            }
        }
    )*};
}

handles! {
    /// Index into [`Model::meshes`].
    MeshId,
    /// Index into [`Model::images`].
    ImageId,
    /// Index into [`Model::textures`].
    TextureId,
    /// Index into [`Model::materials`].
    MaterialId,
}

/// What an asset file holds, flattened: every handle in it points into the same `Model`.
#[derive(Clone, Debug, Default)]
pub struct Model {
    pub meshes: Vec<Mesh>,
    pub images: Vec<Image>,
    pub textures: Vec<Texture>,
    pub materials: Vec<Material>,
    pub instances: Vec<Instance>,
    pub lights: Vec<Light>,
    pub cameras: Vec<Camera>,
    /// The surrounding that the asset brings; its image is among `images`.
    pub environment: Option<Environment>,
    /// What was set aside or approximated on the way.
    pub warnings: Vec<Diagnostic>,
    /// The files that it was made of.
    pub sources: Vec<PathBuf>,
}

/// Everything that is rendered.
#[derive(Clone, Debug)]
pub struct World {
    /// Meshes, textures, materials, instances and punctual lights of all assets and of the scene file.
    pub model: Model,
    pub spheres: Vec<Sphere>,
    pub quads: Vec<Quad>,
    pub environment: Environment,
    pub camera: Camera,
}
