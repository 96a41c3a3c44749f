//! The camera: looks along −Z of its own frame with +Y up, as in glTF.

use glam::Affine3A;

#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Projection {
    /// Vertical field of view, radians, in (0, π).
    Perspective { vfov: f32 },
    /// Half the height of the view volume, metres (glTF `ymag`).
    Orthographic { half_height: f32 },
}

#[derive(Clone, Debug)]
pub struct Camera {
    pub name: String,
    /// Name of the node that holds it, by which it may be asked for too; empty where there is none.
    pub node: String,
    /// Camera to world; rigid (any scale has been removed).
    pub to_world: Affine3A,
    pub projection: Projection,
    /// Diameter of the lens, metres; 0 is a pinhole.
    pub aperture: f32,
    /// Distance of the plane in focus, metres. This is not the focal length.
    pub focus: f32,
}
