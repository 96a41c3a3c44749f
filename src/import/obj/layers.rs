//! Layers of a material that need more than a number looked up.

use std::f32::consts::TAU;

use glam::Vec3;

use crate::world::{Anisotropy, Layered, ScalarInput, Volume};

/// Lets this share of what is not reflected into the inside, which is clear.
pub(super) fn transmit(layered: &mut Layered, share: f32) {
    layered.transmission = Some(ScalarInput::constant(share));
    layered.volume = Some(Volume { attenuation_color: Vec3::ONE, attenuation_distance: f32::INFINITY });
}

/// Stretches the highlight as Disney's material does (Burley 2012, 5.4), and Blender's: with the aspect √(1 − 0.9 a) of
/// the ellipse, α is α / aspect along the tangent and α · aspect across. glTF's layer has the latter as its base, and
/// α across + (1 − α across) s² along. Where a map varies the roughness, s is that of a roughness of ½.
pub(super) fn stretch(layered: &mut Layered, anisotropy: f32, turns: f32) {
    let roughness = &mut layered.pbr.roughness;
    let aspect = (1.0 - 0.9 * anisotropy).sqrt();
    let alpha = if roughness.texture.is_some() { 0.25 } else { roughness.factor * roughness.factor };
    let (along, across) = ((alpha / aspect).min(1.0), alpha * aspect);
    roughness.factor *= aspect.sqrt();
    let strength = ((along - across) / (1.0 - across).max(f32::EPSILON)).clamp(0.0, 1.0).sqrt();
    layered.anisotropy = Some(Anisotropy { strength, rotation: TAU * turns.rem_euclid(1.0), texture: None });
}
