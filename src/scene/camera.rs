//! `[camera]`: from where and how the scene is seen.

use std::f32::consts::PI;

use glam::{Affine3A, Mat3};
use schemars::json_schema;
use toml::de::DeValue;

use super::{
    CameraSource, Lens,
    context::Context,
    range::{above, from},
    read::{Read, Value, kind},
    table::{Keys, inline_schema, table},
    vector::{Direction, Triple},
};
use crate::world::{Camera as Placed, Projection};

/// Vertical field of view where nothing is said, degrees.
const USUAL_VFOV: f32 = 40.0;

/// Below this sine of the angle between them, `up` and the view are taken for parallel.
const PARALLEL: f64 = 1e-5;

table! {
    /// The camera. Without `position` and `imported` it is placed so that everything is in the picture.
    struct Camera {
        /// Where it stands, metres; +Y is up.
        position: Option<Triple>,
        /// The point in the middle of the picture, metres.
        target: Triple = Triple([0.0, 0.0, 0.0]),
        /// The direction that is up in the picture.
        up: Direction = Direction([0.0, 1.0, 0.0]),
        /// Vertical field of view, degrees; 40 where neither focal_length nor ortho_height says otherwise.
        vfov: Option<f32>; above(0.0).below(180.0),
        /// Instead of vfov: focal length of the lens, millimetres, with sensor_height.
        focal_length: Option<f32>; above(0.0),
        /// Height of the sensor, millimetres.
        sensor_height: f32 = 24.0; above(0.0),
        /// Instead of vfov: orthographic, with this height of the picture in metres.
        ortho_height: Option<f32>; above(0.0),
        /// Diameter of the lens, metres. 0, and without it: a pinhole, everything sharp.
        aperture: Option<f32>; from(0.0),
        /// Instead of aperture: the f-number, focal length over diameter.
        fstop: Option<f32>; above(0.0),
        /// Distance of the plane in focus, metres; not the focal length. Without it: the distance of the target.
        focus: Option<f32>; above(0.0),
        /// A camera of a model instead of one placed here: its name, that of its node, or true for the first there is.
        imported: Option<Imported>,
    }
}

/// `imported = "name"` or `imported = true`.
#[derive(Clone, Debug)]
pub(super) enum Imported {
    First,
    Named(String),
}

impl Camera {
    pub fn resolve(self, cx: &mut Context) -> CameraSource {
        let keys = &self.keys;
        keys.exclusive(&["aperture", "fstop"], cx);
        let lens = match self.fstop {
            Some(number) => Lens::FStop { number, sensor_height: self.sensor_height / 1000.0 },
            None => Lens::Diameter(self.aperture.unwrap_or(0.0)),
        };
        if let Some(imported) = self.imported {
            for placing in ["position", "target", "up", "vfov", "focal_length", "ortho_height"] {
                if keys.given(placing) {
                    cx.error(
                        keys.key(placing),
                        format!("`{placing}` says what the imported camera says already"),
                    )
                    .help("leave it out, or leave out `imported`");
                }
            }
            let name = match imported {
                Imported::First => None,
                Imported::Named(name) => Some(name),
            };
            return CameraSource::Imported {
                name,
                lens,
                focus: self.focus,
                place: cx.place(keys.value("imported")),
            };
        }
        keys.exclusive(&["vfov", "focal_length", "ortho_height"], cx);
        let projection = match (self.focal_length, self.ortho_height) {
            (Some(length), _) => Projection::Perspective {
                vfov: 2.0 * (self.sensor_height / (2.0 * length)).atan().min(0.499 * PI),
            },
            (None, Some(height)) => Projection::Orthographic { half_height: height / 2.0 },
            (None, None) => Projection::Perspective { vfov: self.vfov.unwrap_or(USUAL_VFOV).to_radians() },
        };
        if let (Projection::Orthographic { .. }, Some(_)) = (projection, self.fstop) {
            cx.error(
                keys.key("fstop"),
                "an orthographic camera has no focal length that `fstop` could divide",
            )
            .help("say `aperture`, in metres");
        }
        if keys.given("sensor_height")
            && self.focal_length.is_none()
            && self.fstop.is_none()
            && keys.sound(&["focal_length", "fstop"])
        {
            cx.warn(
                keys.key("sensor_height"),
                "`sensor_height` has no effect without `focal_length` or `fstop`",
            );
        }
        let Some(position) = self.position else {
            if let Some(aiming) = keys.first(&["target", "up"])
                && !keys.given("position")
                && keys.sound(&["position", "imported"])
            {
                cx.absent(keys.key(aiming), format!("`{aiming}` without `position`"))
                    .help("say where the camera stands, or leave both out to have everything framed");
            }
            return CameraSource::Framed { projection, lens, focus: self.focus };
        };
        let to_world = place(position, self.target, self.up, keys, cx);
        CameraSource::Placed(Placed {
            name: "scene".into(),
            node: String::new(),
            to_world,
            projection,
            aperture: match projection {
                Projection::Perspective { vfov } => lens.diameter(vfov),
                Projection::Orthographic { .. } => self.aperture.unwrap_or(0.0),
            },
            focus: self
                .focus
                .unwrap_or_else(|| position.vec().as_dvec3().distance(self.target.vec().as_dvec3()) as f32),
        })
    }
}

/// Looking from `position` to `target`; what cannot be is reported, and anything returned.
fn place(position: Triple, target: Triple, up: Direction, keys: &Keys, cx: &mut Context) -> Affine3A {
    if !keys.sound(&["position", "target"]) {
        return Affine3A::IDENTITY;
    }
    let Some(back) = (position.vec().as_dvec3() - target.vec().as_dvec3()).try_normalize() else {
        let at = keys.value(keys.first(&["target"]).unwrap_or("position"));
        cx.error(at, "`position` and `target` are the same point: the camera has no direction")
            .help("move one of them");
        return Affine3A::IDENTITY;
    };
    let across = up.unit().as_dvec3().cross(back);
    if across.length() < PARALLEL {
        if keys.sound(&["up"]) {
            let at = keys.value(keys.first(&["up", "target"]).unwrap_or("position"));
            let other = if back.y.abs() > 0.9 { "[0, 0, -1]" } else { "[0, 1, 0]" };
            cx.error(at, "`up` is parallel to the direction of view")
                .help(format!("set `up` to another direction, such as {other}"));
        }
        return Affine3A::IDENTITY;
    }
    let right = across.normalize();
    let [x, y, z] = [right, back.cross(right), back].map(|axis| axis.as_vec3());
    Affine3A::from_mat3_translation(Mat3::from_cols(x, y, z), position.vec())
}

impl Read for Imported {
    fn read(value: &Value, cx: &mut Context) -> Option<Self> {
        match value.get_ref() {
            DeValue::Boolean(true) => return Some(Self::First),
            DeValue::String(name) => return Some(Self::Named(name.to_string())),
            DeValue::Boolean(false) => {
                cx.must(value.span(), "a camera's name or true", "false").help("leave it out")
            }
            _ => cx
                .must(value.span(), "a camera's name or true", kind(value))
                .help("true is the first camera there is"),
        }
        None
    }
}

inline_schema! {
    Imported, _generator: json_schema!({ "anyOf": [{ "type": "string" }, { "const": true }] }),
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn f_number_and_focal_length_agree_with_the_field_of_view() {
        // A 50 mm lens at f/2 has a pupil of 25 mm, whichever way the field of view was said.
        let vfov = 2.0 * (24.0f32 / 100.0).atan();
        let lens = Lens::FStop { number: 2.0, sensor_height: 0.024 };
        assert!((lens.diameter(vfov) - 0.025).abs() < 1e-6);
    }
}
