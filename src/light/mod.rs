//! Where light comes from: shapes, points, the sun and the environment; choosing one of them for a point.

mod quad;
mod shape;
mod sphere;
mod triangle;

pub use quad::Quad;
pub use shape::{Shape, ShapeSample};
pub use sphere::Sphere;
pub use triangle::Triangle;
