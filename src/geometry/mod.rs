//! Rays, shapes and the arithmetic that keeps them robust in `f32`.
//!
//! | module | what it answers |
//! |---|---|
//! | [`triangle`], [`sphere`], [`quad`] | where does a ray meet the shape? |
//! | [`offset`] | how far off may a computed hit point be, and where does the next ray start? |
//! | [`frame`] | an orthonormal frame about a direction |

pub mod frame;
pub mod offset;
pub mod quad;
mod ray;
pub mod sphere;
pub mod triangle;

pub use frame::Frame;
pub use ray::Ray;
