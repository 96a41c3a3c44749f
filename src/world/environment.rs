//! Light from infinitely far away, by direction.

use glam::Vec3;

use super::{ColorSpace, ImageId};

#[derive(Clone, Debug, PartialEq)]
pub enum EnvironmentKind {
    /// The same radiance from everywhere.
    Color(Vec3),
    /// Linear blend from `bottom` (−Y) to `top` (+Y) in t = (y + 1) / 2.
    Gradient { bottom: Vec3, top: Vec3 },
    /// Equirectangular map: direction d meets it at u = 0.5 + atan2(d.z, d.x) / 2π, v = acos(d.y) / π, v = 0 at
    /// the top row.
    Image { image: ImageId, color_space: ColorSpace },
}

#[derive(Clone, Debug, PartialEq)]
pub struct Environment {
    pub kind: EnvironmentKind,
    /// Factor on the radiance.
    pub strength: f32,
    /// Turns the environment about +Y (counter-clockwise seen from above), radians.
    pub rotation: f32,
    /// Whether camera rays see it. It lights the scene either way.
    pub visible: bool,
}
