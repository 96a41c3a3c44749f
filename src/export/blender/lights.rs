//! Lamps and the surroundings.
//!
//! Blender gives the power of point and spot lamps as if they shone to all sides: 4π times the intensity. A lamp of
//! radius r is a sphere of radiance P / (4π² r²).

use std::f32::consts::{FRAC_PI_2, PI};

use glam::Vec3;

use super::{
    axes,
    document::{self, WorldKind},
    textures::Textures,
};
use crate::{
    export::Error,
    world::{Environment, EnvironmentKind, Light},
};

/// The narrowest band, in cos θ, between the inner and the outer cone.
const NARROWEST_BAND: f32 = 1e-6;
const MAP_RESOLUTIONS: [u32; 2] = [512, 4096];

/// None where it gives no light.
pub fn lamp(name: String, light: &Light) -> Option<document::Light> {
    let dark = document::Light {
        name,
        r#type: "POINT",
        strength: [0.0; 3],
        position: [0.0; 3],
        direction: None,
        radius: 0.0,
        angle: 0.0,
        spot_size: 0.0,
        cone: None,
    };
    let power = |intensity: &Vec3| (4.0 * PI * *intensity).to_array();
    let lamp = match light {
        Light::Point { position, intensity } => {
            document::Light { strength: power(intensity), position: axes::point(*position), ..dark }
        }
        Light::Spot { position, direction, intensity, inner, outer } => {
            let band = (inner.cos() - outer.cos()).max(NARROWEST_BAND);
            // Blender's cones end at a half-sphere; wider ones are point lamps that nodes darken.
            let wide = *outer > FRAC_PI_2;
            document::Light {
                r#type: if wide { "POINT" } else { "SPOT" },
                strength: power(intensity),
                position: axes::point(*position),
                direction: Some(axes::point(direction.normalize_or(Vec3::NEG_Z))),
                spot_size: 2.0 * outer.min(FRAC_PI_2),
                cone: Some([outer.cos(), 1.0 / band]),
                ..dark
            }
        }
        Light::Sun { direction, irradiance, angle } => document::Light {
            r#type: "SUN",
            strength: irradiance.to_array(),
            direction: Some(axes::point(direction.normalize_or(Vec3::NEG_Y))),
            angle: angle.clamp(0.0, PI),
            ..dark
        },
    };
    let strength = Vec3::from(lamp.strength);
    (strength.max_element() > 0.0 && strength.is_finite()).then_some(lamp)
}

/// A sphere that shines evenly.
pub fn sphere(name: String, center: Vec3, radius: f32, radiance: Vec3) -> Option<document::Light> {
    let intensity = PI * radius * radius * radiance;
    let lamp = lamp(name, &Light::Point { position: center, intensity })?;
    Some(document::Light { radius, ..lamp })
}

pub fn world(
    environment: &Environment,
    images: &[crate::world::Image],
    textures: &mut Textures,
) -> Result<document::World, Error> {
    let Environment { kind, strength, rotation, visible } = environment;
    let kind = match *kind {
        EnvironmentKind::Color(color) => WorldKind::Color { color: color.to_array() },
        EnvironmentKind::Gradient { bottom, top } => {
            WorldKind::Gradient { bottom: bottom.to_array(), top: top.to_array() }
        }
        EnvironmentKind::Image { image: id, color_space } => {
            match (images.get(id.index()), textures.environment(id, color_space, *strength)?) {
                (Some(image), Some(index)) => WorldKind::Image {
                    image: index,
                    rotation: *rotation,
                    highest: (FRAC_PI_2 / image.height.max(1) as f32).cos(),
                    map_resolution: image.width.clamp(MAP_RESOLUTIONS[0], MAP_RESOLUTIONS[1]),
                },
                _ => WorldKind::Color { color: [0.0; 3] },
            }
        }
    };
    Ok(document::World { kind, strength: *strength, visible: *visible })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn powers_are_those_of_closed_forms() {
        let lamp_of = |light: &Light| lamp("l".into(), light).expect("it shines");
        let point =
            lamp_of(&Light::Point { position: Vec3::new(1.0, 2.0, 3.0), intensity: Vec3::splat(2.0) });
        assert_eq!(point.position, [1.0, -3.0, 2.0]);
        assert!((point.strength[0] - 8.0 * PI).abs() < 1e-5);
        // a Lambertian sphere gives π L from each m²
        let ball = sphere("l".into(), Vec3::ZERO, 0.5, Vec3::splat(3.0)).expect("it shines");
        assert!((ball.strength[1] - 3.0 * PI * (4.0 * PI * 0.25)).abs() < 1e-4);
        let spot = lamp_of(&Light::Spot {
            position: Vec3::ZERO,
            direction: Vec3::NEG_Y,
            intensity: Vec3::ONE,
            inner: 0.0,
            outer: PI / 3.0,
        });
        let [cos_outer, scale] = spot.cone.expect("a cone");
        assert!((cos_outer - 0.5).abs() < 1e-6 && (scale - 2.0).abs() < 1e-5);
        assert_eq!(spot.direction.map(|d| d[2]), Some(-1.0));
        let sun =
            lamp_of(&Light::Sun { direction: Vec3::NEG_Y, irradiance: Vec3::new(1.0, 2.0, 3.0), angle: 0.1 });
        assert_eq!((sun.strength, sun.angle), ([1.0, 2.0, 3.0], 0.1));
        assert!(lamp("l".into(), &Light::Point { position: Vec3::ZERO, intensity: Vec3::ZERO }).is_none());
    }
}
