//! A ray `P(t) = origin + t · direction`, t in (`t_min`, `t_max`), `t_min` not negative.

use glam::Vec3;

/// `direction` need not be of unit length: t is measured in its units, so that a ray keeps its t when it is
/// transformed into an instance's space.
#[derive(Clone, Copy, Debug)]
pub struct Ray {
    pub origin: Vec3,
    pub direction: Vec3,
    pub t_min: f32,
    pub t_max: f32,
}

impl Ray {
    /// From `origin` along `direction` without end.
    pub fn new(origin: Vec3, direction: Vec3) -> Self {
        Self { origin, direction, t_min: 0.0, t_max: f32::INFINITY }
    }

    pub fn at(&self, t: f32) -> Vec3 {
        self.origin + t * self.direction
    }
}
