//! Members of an extension object, typed. One of the wrong type is an error, one out of range is clamped with a warning.

use glam::Vec3;
use gltf::json::{self, material::NormalTexture, texture::Info};
use serde::de::DeserializeOwned;
use serde_json::{Map, Value};

use super::super::{material::Conversion, report::Problem};
use crate::world::{ColorInput, ColorSpace, NormalMap, ScalarInput, TextureRef};

pub struct Reader<'a, 'c> {
    conversion: &'a mut Conversion<'c>,
    members: &'a Map<String, Value>,
    name: &'static str,
}

impl<'a, 'c> Reader<'a, 'c> {
    /// `None` where the material does not have the extension.
    pub fn open(
        conversion: &'a mut Conversion<'c>,
        json: &'a json::Material,
        name: &'static str,
    ) -> Option<Self> {
        match json.extensions.as_ref()?.others.get(name)? {
            Value::Object(members) => Some(Self { conversion, members, name }),
            _ => {
                conversion.error(&format!("extensions/{name}"), "is not an object".into());
                None
            }
        }
    }

    fn path(&self, key: &str) -> String {
        format!("extensions/{}/{key}", self.name)
    }

    fn get<T: DeserializeOwned>(&mut self, key: &str) -> Option<T> {
        match serde_json::from_value(self.members.get(key)?.clone()) {
            Ok(value) => Some(value),
            Err(e) => {
                let path = self.path(key);
                self.conversion.error(&path, e.to_string());
                None
            }
        }
    }

    pub fn number(&mut self, key: &str, default: f32, [least, most]: [f32; 2]) -> f32 {
        match self.get::<f32>(key) {
            None => default,
            Some(value) => self.conversion.within(value, least, most, &self.path(key)),
        }
    }

    /// A number from 0 to 1.
    pub fn share(&mut self, key: &str, default: f32) -> f32 {
        self.number(key, default, [0.0, 1.0])
    }

    pub fn color<const N: usize>(&mut self, key: &str, default: f32, most: f32) -> [f32; N] {
        let Some(values) = self.get::<Vec<f32>>(key) else { return [default; N] };
        let path = self.path(key);
        match <[f32; N]>::try_from(values) {
            Ok(values) => values.map(|value| self.conversion.within(value, 0.0, most, &path)),
            Err(values) => {
                let message = format!("has {} numbers where {N} are asked for", values.len());
                self.conversion.error(&path, message);
                [default; N]
            }
        }
    }

    pub fn texture(&mut self, key: &str, space: ColorSpace) -> Option<TextureRef> {
        let info: Info = self.get(key)?;
        self.conversion.info(Some(&info), &self.path(key), space)
    }

    /// One channel of a linear texture.
    pub fn channel(&mut self, key: &str, channel: u8) -> Option<(TextureRef, u8)> {
        Some((self.texture(key, ColorSpace::Linear)?, channel))
    }

    pub fn normal_map(&mut self, key: &str) -> Option<NormalMap> {
        let json: NormalTexture = self.get(key)?;
        self.conversion.normal(&json, &self.path(key))
    }

    /// `default` is that of the factor.
    pub fn scalar_input(&mut self, factor: &str, default: f32, texture: (&str, u8)) -> ScalarInput {
        let factor = self.share(factor, default);
        let texture = if factor > 0.0 { self.channel(texture.0, texture.1) } else { None };
        ScalarInput { factor, texture }
    }

    pub fn color_input(&mut self, factor: &str, default: f32, most: f32, texture: &str) -> ColorInput {
        let factor = Vec3::from(self.color::<3>(factor, default, most));
        ColorInput { factor, texture: self.texture(texture, ColorSpace::Srgb) }
    }

    pub fn warn(&mut self, key: &str, message: &str) {
        let path = self.path(key);
        self.conversion.warn(&path, message);
    }
}

impl Conversion<'_> {
    fn error(&mut self, key: &str, message: String) {
        let pointer = self.pointer(key);
        self.report.error(Problem::new(pointer, message));
    }

    fn warn(&mut self, key: &str, message: &str) {
        let pointer = self.pointer(key);
        self.report.warn(Problem::new(pointer, message));
    }
}
