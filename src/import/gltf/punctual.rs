//! Cameras and punctual lights, which have a frame but no shape: they look and shine along −Z of their node.
//!
//! glTF 2.0, section 3.10 "Cameras"; KHR_lights_punctual. One candela is taken as 1 W/sr and one lux as 1 W/m² per channel, as
//! renderers do that know radiometric units only. Scale of the node does not matter to either; `range` is
//! a hint to rasterisers and is not used.

use std::f32::consts::{FRAC_PI_2, FRAC_PI_4, PI};

use glam::{Affine3A, DAffine3, DMat3, Vec3};
use gltf::json::{
    self,
    camera::Type as CameraType,
    extensions::scene::khr_lights_punctual::{Light as JsonLight, Type as LightType},
    validation::Checked,
};

use crate::world::{Camera, Light, Projection};

/// The most of a spot's outer angle that its inner one is: exporters write equal angles for a sharp edge, which would divide
/// by zero.
const SHARPEST: f32 = 0.999;

/// A camera at a node; the error says why it cannot be used.
pub fn camera(
    json: &json::Camera,
    name: String,
    node: String,
    to_world: &DAffine3,
) -> Result<Camera, String> {
    let positive = |value: f32, what: &str| {
        (value > 0.0 && value.is_finite())
            .then_some(value)
            .ok_or_else(|| format!("its {what} of {value} is not positive"))
    };
    let projection = match (json.type_, &json.perspective, &json.orthographic) {
        (Checked::Valid(CameraType::Perspective), Some(perspective), _) => {
            let vfov = positive(perspective.yfov, "yfov")?;
            if vfov >= PI {
                return Err(format!("its yfov of {vfov} radians is not below π"));
            }
            Projection::Perspective { vfov }
        }
        (Checked::Valid(CameraType::Orthographic), _, Some(orthographic)) => {
            Projection::Orthographic { half_height: positive(orthographic.ymag.abs(), "ymag")? }
        }
        (Checked::Invalid, ..) => return Err("its type is neither perspective nor orthographic".into()),
        _ => return Err("the properties of its type are missing".into()),
    };
    let to_world = rigid(to_world).ok_or("its node has a singular transform")?;
    Ok(Camera { name, node, to_world, projection, aperture: 0.0, focus: 1.0 })
}

/// A light at a node; the error says why it cannot be used.
pub fn light(json: &JsonLight, to_world: &DAffine3) -> Result<Light, String> {
    let power = Vec3::from(json.color) * json.intensity;
    if !power.is_finite() || power.min_element() < 0.0 {
        return Err(format!(
            "its colour {:?} at intensity {} is negative or not finite",
            json.color, json.intensity
        ));
    }
    let position = to_world.translation.as_vec3();
    let direction = || (-to_world.matrix3.z_axis).try_normalize().map(|d| d.as_vec3());
    let direction = || direction().ok_or("its node has a singular transform");
    if !position.is_finite() {
        return Err("its node has a transform that is not finite".into());
    }
    Ok(match json.type_ {
        Checked::Valid(LightType::Point) => Light::Point { position, intensity: power },
        Checked::Valid(LightType::Directional) => {
            Light::Sun { direction: direction()?, irradiance: power, angle: 0.0 }
        }
        Checked::Valid(LightType::Spot) => {
            let spot = json.spot.as_ref();
            let inner = spot.map_or(0.0, |s| s.inner_cone_angle);
            let outer = spot.map_or(FRAC_PI_4, |s| s.outer_cone_angle);
            if !(0.0 <= inner && inner <= outer && 0.0 < outer && outer <= FRAC_PI_2 * 1.000_001) {
                return Err(format!("its cone angles {inner} and {outer} are not 0 ≤ inner ≤ outer ≤ π/2"));
            }
            Light::Spot {
                position,
                direction: direction()?,
                intensity: power,
                inner: inner.min(outer * SHARPEST),
                outer: outer.min(FRAC_PI_2),
            }
        }
        Checked::Invalid => return Err("its type is not directional, point or spot".into()),
    })
}

/// The frame of `to_world` without scale, shear or mirroring: it keeps the viewing direction and the plane of "up".
fn rigid(to_world: &DAffine3) -> Option<Affine3A> {
    let DMat3 { y_axis: up, z_axis: back, .. } = to_world.matrix3;
    let z = back.try_normalize()?;
    let x = up.try_normalize()?.cross(z).try_normalize()?;
    let columns = DMat3::from_cols(x, z.cross(x), z);
    let single = Affine3A::from_mat3_translation(columns.as_mat3(), to_world.translation.as_vec3());
    single.is_finite().then_some(single)
}
