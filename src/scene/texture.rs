//! What a colour can be where a texture makes sense.

use glam::{Affine2, Vec2};
use schemars::json_schema;
use toml::de::DeValue;

use super::{
    ImageSource,
    choice::choice,
    color::Color,
    context::Context,
    path::ImageFile,
    read::{Read, Value},
    table::{Keys, inline_schema, table},
    vector::Pair,
};
use crate::{
    diagnostic::Place,
    world::{ColorInput, ColorSpace, Filter, TextureId, TextureRef, Wrap},
};

table! {
    /// An image over a surface.
    struct Texture {
        /// The picture; UV (0, 0) is its top left corner.
        image: ImageFile,
        /// How stored numbers become linear ones. Without it: srgb for colours, linear for data. .hdr and .exr are linear anyway.
        space: Option<Space>,
        /// What is beyond the image's edges.
        wrap: WrapMode = WrapMode::Repeat,
        /// What is between its pixels.
        filter: FilterMode = FilterMode::Linear,
        /// Multiplies the image.
        factor: Color = Color::WHITE,
        /// How many times the image fits into UV 0 to 1: a number, or two for u and v.
        repeat: Pair = Pair::Same(1.0),
    }
}

table! {
    /// A tangent-space normal map: green points up, as in glTF.
    struct NormalMap {
        /// The picture, stored linear.
        image: ImageFile,
        /// Multiplies the map's x and y: 0 is flat.
        scale: f32 = 1.0,
        /// What is beyond the image's edges.
        wrap: WrapMode = WrapMode::Repeat,
        /// What is between its pixels.
        filter: FilterMode = FilterMode::Linear,
        /// How many times the image fits into UV 0 to 1: a number, or two for u and v.
        repeat: Pair = Pair::Same(1.0),
    }
}

choice! {
    /// Encoding of the stored numbers.
    enum Space { "srgb" => Srgb, "linear" => Linear }
}

choice! {
    /// Beyond the image's edges.
    enum WrapMode { "repeat" => Repeat, "mirror" => Mirror, "clamp" => Clamp }
}

choice! {
    /// Between the image's pixels.
    enum FilterMode { "linear" => Linear, "nearest" => Nearest }
}

/// A colour, or a texture.
#[derive(Clone, Debug)]
pub(super) enum Input {
    Color(Color),
    Texture(Texture),
}

impl Input {
    /// `data`: the image holds numbers and not colours, so that it is taken as linear where the file does not say.
    pub fn resolve(&self, data: bool, cx: &mut Context) -> ColorInput {
        match self {
            Input::Color(color) => ColorInput::constant(color.vec()),
            Input::Texture(texture) => {
                let space = match texture.space {
                    Some(Space::Linear) => ColorSpace::Linear,
                    Some(Space::Srgb) => ColorSpace::Srgb,
                    None if data => ColorSpace::Linear,
                    None => ColorSpace::Srgb,
                };
                let place = cx.place(texture.keys.value("image"));
                let Texture { image, wrap, filter, factor, repeat, .. } = texture;
                let texture = Some(texture_ref((image, place), space, *wrap, *filter, *repeat, cx));
                ColorInput { factor: factor.vec(), texture }
            }
        }
    }
}

impl NormalMap {
    pub fn resolve(&self, cx: &mut Context) -> crate::world::NormalMap {
        let place = cx.place(self.keys.value("image"));
        let Self { image, wrap, filter, repeat, scale, .. } = self;
        let texture = texture_ref((image, place), ColorSpace::Linear, *wrap, *filter, *repeat, cx);
        crate::world::NormalMap { texture, scale: *scale }
    }
}

/// Where a colour says how much light is reflected, more than all of it is suspicious.
pub(super) fn warn_reflectance(input: &ColorInput, key: &str, keys: &Keys, cx: &mut Context) {
    if input.factor.max_element() > 1.0 {
        cx.warn(
            keys.value(key),
            format!("`{key}` reflects more light than arrives: a component is greater than 1"),
        )
        .help("reflectances are from 0 to 1; 8-bit values are written as \"#rrggbb\"");
    }
}

fn texture_ref(
    (image, place): (&ImageFile, Place),
    color_space: ColorSpace,
    wrap: WrapMode,
    filter: FilterMode,
    repeat: Pair,
    cx: &mut Context,
) -> TextureRef {
    let source = ImageSource {
        file: image.0.clone(),
        place,
        color_space,
        wrap: match wrap {
            WrapMode::Repeat => Wrap::Repeat,
            WrapMode::Mirror => Wrap::MirroredRepeat,
            WrapMode::Clamp => Wrap::ClampToEdge,
        },
        filter: match filter {
            FilterMode::Linear => Filter::Linear,
            FilterMode::Nearest => Filter::Nearest,
        },
    };
    let index = cx.images.iter().position(|known| known.same_lookup(&source)).unwrap_or_else(|| {
        cx.images.push(source);
        cx.images.len() - 1
    });
    TextureRef {
        texture: TextureId(index as u32),
        uv_set: 0,
        transform: Affine2::from_scale(Vec2::from(repeat.array())),
    }
}

impl Read for Input {
    fn read(value: &Value, cx: &mut Context) -> Option<Self> {
        match value.get_ref() {
            DeValue::Table(_) => Texture::read(value, cx).map(Self::Texture),
            _ => Color::read(value, cx).map(Self::Color),
        }
    }
}

impl serde::Serialize for Input {
    /// Only colours are defaults.
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Input::Color(color) => color.serialize(serializer),
            Input::Texture(_) => serializer.serialize_none(),
        }
    }
}

inline_schema! {
    Input, generator: json_schema!({
        "anyOf": [generator.subschema_for::<Color>(), generator.subschema_for::<Texture>()],
    }),
}
