//! Colours: linear Rec.709, or display sRGB as "#rrggbb".

use glam::Vec3;
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::Serialize;
use toml::de::DeValue;

use super::{
    context::Context,
    range::read_array,
    read::{Read, Value, kind},
};
use crate::color::srgb_decode;

const FORMS: &str = "a number (grey), three numbers (linear Rec.709) or \"#rrggbb\" (sRGB)";

/// Linear Rec.709, no component negative.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub(super) struct Color(pub [f32; 3]);

impl Color {
    pub const WHITE: Self = Self([1.0; 3]);

    pub fn vec(self) -> Vec3 {
        self.0.into()
    }
}

impl Read for Color {
    fn read(value: &Value, cx: &mut Context) -> Option<Self> {
        match value.get_ref() {
            DeValue::Integer(_) | DeValue::Float(_) => component(value, cx).map(|grey| Self([grey; 3])),
            DeValue::Array(_) => read_array(value, FORMS, cx, component).map(Self),
            DeValue::String(text) => {
                let color = hexadecimal(text);
                if color.is_none() {
                    let found = crate::diagnostic::quote(text);
                    cx.must(value.span(), FORMS, &found);
                }
                color
            }
            _ => {
                cx.must(value.span(), FORMS, kind(value));
                None
            }
        }
    }
}

fn component(value: &Value, cx: &mut Context) -> Option<f32> {
    let x = f32::read(value, cx)?;
    if x < 0.0 {
        cx.must(value.span(), "without negative components", &x.to_string());
        return None;
    }
    Some(x)
}

/// "#rgb" or "#rrggbb".
fn hexadecimal(text: &str) -> Option<Color> {
    let digits: Vec<u32> = text.strip_prefix('#')?.chars().map(|c| c.to_digit(16)).collect::<Option<_>>()?;
    let bytes = match digits[..] {
        [r, g, b] => [r * 17, g * 17, b * 17],
        [r1, r0, g1, g0, b1, b0] => [r1 * 16 + r0, g1 * 16 + g0, b1 * 16 + b0],
        _ => return None,
    };
    Some(Color(bytes.map(|byte| srgb_decode(byte as f32 / 255.0))))
}

impl JsonSchema for Color {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "Color".into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({
            "description": "A number (grey), three numbers (linear Rec.709), or \"#rrggbb\" or \"#rgb\" (sRGB).",
            "anyOf": [
                { "type": "number", "minimum": 0 },
                { "type": "array", "items": { "type": "number", "minimum": 0 }, "minItems": 3, "maxItems": 3 },
                { "type": "string", "pattern": "^#([0-9a-fA-F]{3}|[0-9a-fA-F]{6})$" },
            ],
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hexadecimal_is_srgb() {
        let color = hexadecimal("#ff8000").map(|c| c.0);
        // 128/255 in sRGB is 0.21586 in linear light.
        assert!(color.is_some_and(|[r, g, b]| r == 1.0 && (g - 0.215_86).abs() < 1e-5 && b == 0.0));
        assert_eq!(hexadecimal("#f80"), hexadecimal("#ff8800"));
        for wrong in ["ff8000", "#ff80", "#ff80000", "#gg0000", "#", "#é00"] {
            assert_eq!(hexadecimal(wrong), None, "{wrong}");
        }
    }
}
