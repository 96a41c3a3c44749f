//! Punctual lights (those without area; emissive surfaces are lights too, through their materials).

use glam::Vec3;

#[derive(Clone, Debug, PartialEq)]
pub enum Light {
    /// `intensity` in W/sr per channel.
    Point { position: Vec3, intensity: Vec3 },
    /// As `Point`, inside a cone about `direction`. Between the half-angles `inner` and `outer` (radians) it falls off
    /// as the square of (cos θ − cos outer) / (cos inner − cos outer): KHR_lights_punctual.
    Spot { position: Vec3, direction: Vec3, intensity: Vec3, inner: f32, outer: f32 },
    /// `direction` is where the light goes; `irradiance` in W/m² on a surface that faces it. `angle` is the angular
    /// diameter in radians; 0 is a delta direction.
    Sun { direction: Vec3, irradiance: Vec3, angle: f32 },
}
