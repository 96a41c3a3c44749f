//! Outside assets into a [`Model`](crate::world::Model).

pub mod gltf;
pub mod obj;
