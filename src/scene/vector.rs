//! Points, directions and scales.

use glam::Vec3;
use schemars::{Schema, json_schema};
use serde::Serialize;
use toml::de::DeValue;

use super::{
    context::Context,
    range::read_array,
    read::{Read, Value},
    table::inline_schema,
};

/// Three numbers.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub(super) struct Triple(pub [f32; 3]);

/// Three numbers, not all 0.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub(super) struct Direction(pub [f32; 3]);

/// One number for all axes or one each, none 0. Negative ones mirror.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(untagged)]
pub(super) enum Scale {
    Uniform(f32),
    PerAxis([f32; 3]),
}

/// One number for both axes or one each.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(untagged)]
pub(super) enum Pair {
    Same(f32),
    Each([f32; 2]),
}

impl Triple {
    pub fn vec(self) -> Vec3 {
        self.0.into()
    }
}

impl Direction {
    /// Of unit length.
    pub fn unit(self) -> Vec3 {
        Vec3::from(self.0).normalize_or(Vec3::Y)
    }
}

impl Scale {
    pub fn vec(self) -> Vec3 {
        match self {
            Scale::Uniform(s) => Vec3::splat(s),
            Scale::PerAxis(s) => s.into(),
        }
    }
}

impl Pair {
    pub fn array(self) -> [f32; 2] {
        match self {
            Pair::Same(x) => [x, x],
            Pair::Each(pair) => pair,
        }
    }
}

impl Read for Triple {
    fn read(value: &Value, cx: &mut Context) -> Option<Self> {
        read_array(value, "three numbers", cx, f32::read).map(Self)
    }

    fn stand_in() -> Option<Self> {
        Some(Self([0.0; 3]))
    }
}

impl Read for Direction {
    fn read(value: &Value, cx: &mut Context) -> Option<Self> {
        let direction = read_array(value, "three numbers", cx, f32::read)?;
        if direction == [0.0; 3] {
            cx.must(value.span(), "a direction", "of zero length");
            return None;
        }
        Some(Self(direction))
    }

    fn stand_in() -> Option<Self> {
        Some(Self([0.0, 1.0, 0.0]))
    }
}

impl Read for Scale {
    fn read(value: &Value, cx: &mut Context) -> Option<Self> {
        let scale = match value.get_ref() {
            DeValue::Array(_) => Self::PerAxis(read_array(value, "one number, or three", cx, f32::read)?),
            _ => Self::Uniform(f32::read(value, cx)?),
        };
        if scale.vec().to_array().contains(&0.0) {
            cx.must(value.span(), "other than 0", "0");
            return None;
        }
        Some(scale)
    }
}

impl Read for Pair {
    fn read(value: &Value, cx: &mut Context) -> Option<Self> {
        match value.get_ref() {
            DeValue::Array(_) => read_array(value, "one number, or two", cx, f32::read).map(Self::Each),
            _ => f32::read(value, cx).map(Self::Same),
        }
    }

    fn numbers(&self) -> Vec<f64> {
        self.array().map(f64::from).to_vec()
    }
}

fn numbers(count: usize) -> Schema {
    json_schema!({ "type": "array", "items": { "type": "number" }, "minItems": count, "maxItems": count })
}

inline_schema! {
    Triple, _generator: numbers(3),
    Direction, _generator: numbers(3),
    Scale, _generator: json_schema!({ "anyOf": [{ "type": "number", "not": { "const": 0 } }, numbers(3)] }),
    Pair, _generator: json_schema!({ "anyOf": [{ "type": "number" }, numbers(2)] }),
}
