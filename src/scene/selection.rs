//! What of a model is shown: `scene`, `variant`, `animation` and `at` of `[[model]]`.

use std::hash::{Hash, Hasher};

use schemars::json_schema;
use toml::de::DeValue;

use super::{
    context::Context,
    read::{Read, Value, kind},
    table::inline_schema,
};

/// Scenes, variants and animations are called by their names, or by their numbers counted from 0.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Selection {
    /// Without: the file's own choice.
    pub scene: Option<String>,
    /// Of the materials. Without: the materials as they are.
    pub variant: Option<String>,
    /// Without: the first if there is a time, or else the pose at rest.
    pub animation: Option<String>,
    /// The moment of the animation, seconds; finite. Without: 0.
    pub at: Option<f32>,
}

impl Eq for Selection {}

impl Hash for Selection {
    fn hash<H: Hasher>(&self, state: &mut H) {
        (&self.scene, &self.variant, &self.animation, self.at.map(f32::to_bits)).hash(state);
    }
}

/// A name or a number, as text.
#[derive(Clone, Debug)]
pub(super) struct Pick(pub String);

impl Read for Pick {
    fn read(value: &Value, cx: &mut Context) -> Option<Self> {
        let number = |text: &toml::de::DeInteger| i64::from_str_radix(text.as_str(), text.radix()).ok();
        let found = match value.get_ref() {
            DeValue::String(name) => return Some(Self(name.to_string())),
            DeValue::Integer(text) => match number(text).filter(|&number| number >= 0) {
                Some(number) => return Some(Self(number.to_string())),
                None => "another number",
            },
            _ => kind(value),
        };
        cx.must(value.span(), "a name, or a number from 0", found);
        None
    }
}

inline_schema! {
    Pick, _generator: json_schema!({ "anyOf": [{ "type": "string" }, { "type": "integer", "minimum": 0 }] }),
}
