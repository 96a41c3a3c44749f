//! Where light comes from: shapes, points, the sun and the environment; choosing one of them for a point.

mod aim;
mod cluster;
mod ellipse;
mod environment;
mod lights;
mod map;
mod punctual;
mod quad;
mod receiver;
mod shape;
mod sphere;
mod sun;
mod tree;
mod triangle;

pub use aim::{Aim, Departure, SAMPLES_A_LAMP_PATH};
pub use environment::{Environment, EnvironmentSample};
pub use lights::{Emitter, FAIR_SHARE, LightSample, Lights, Source};
pub use punctual::{Incident, Punctual};
pub use quad::Quad;
pub use receiver::Receiver;
pub use shape::{Shape, ShapeSample};
pub use sphere::Sphere;
pub use sun::Sun;
pub use triangle::Triangle;
