//! Rays, hits, shapes and the arithmetic that keeps them robust in `f32`.

mod ray;

pub use ray::Ray;
