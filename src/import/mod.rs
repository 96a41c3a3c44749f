//! Outside assets into a [`Model`](crate::world::Model).

pub mod gltf;
pub mod image;
pub mod obj;
mod tangents;
