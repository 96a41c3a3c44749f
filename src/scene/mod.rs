//! The scene file: TOML in, [`ValidScene`] out, or all that is wrong with it.

mod valid;

pub use valid::{
    CameraSource, EnvironmentSource, EnvironmentSourceKind, ImageSource, ModelSource, ValidScene,
};
