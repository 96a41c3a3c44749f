//! Values on the right of a key: how one is read, and those that sections are made of.

use std::ops::Range;

use schemars::{JsonSchema, Schema, SchemaGenerator};
use toml::{Spanned, de::DeValue};

use super::context::Context;

/// A value of the file with the place it stands at.
pub(super) type Value<'i> = Spanned<DeValue<'i>>;

/// Something that can stand on the right of a key.
pub(super) trait Read: Sized + JsonSchema {
    /// `None` after having reported why.
    fn read(value: &Value, cx: &mut Context) -> Option<Self>;

    /// What a key that is not there means; `None`: the key is required.
    fn absent() -> Option<Self> {
        None
    }

    /// What a required value that is missing or wrong is taken for, once that has been reported.
    fn stand_in() -> Option<Self> {
        None
    }

    /// What stands for it in a schema. TOML has no null: an absent value has no schema of its own.
    fn schema(generator: &mut SchemaGenerator) -> Schema {
        generator.subschema_for::<Self>()
    }

    /// The numbers in it, for limits.
    fn numbers(&self) -> Vec<f64> {
        Vec::new()
    }
}

impl<T: Read> Read for Option<T> {
    fn read(value: &Value, cx: &mut Context) -> Option<Self> {
        T::read(value, cx).map(Some)
    }

    fn absent() -> Option<Self> {
        Some(None)
    }

    fn schema(generator: &mut SchemaGenerator) -> Schema {
        T::schema(generator)
    }

    fn numbers(&self) -> Vec<f64> {
        self.as_ref().map(T::numbers).unwrap_or_default()
    }
}

impl Read for bool {
    fn read(value: &Value, cx: &mut Context) -> Option<Self> {
        let read = value.get_ref().as_bool();
        if read.is_none() {
            cx.must(value.span(), "true or false", kind(value));
        }
        read
    }
}

impl Read for String {
    fn read(value: &Value, cx: &mut Context) -> Option<Self> {
        let read = value.get_ref().as_str().map(str::to_owned);
        if read.is_none() {
            cx.must(value.span(), "a string", kind(value));
        }
        read
    }
}

/// `[[key]]` tables. Those that cannot be read are left out.
impl<T: Read> Read for Vec<T> {
    fn read(value: &Value, cx: &mut Context) -> Option<Self> {
        let DeValue::Array(items) = value.get_ref() else {
            let help = format!("write `[[{}]]`: there may be several", cx.key);
            cx.must(value.span(), "an array of tables", kind(value)).help(help);
            return None;
        };
        Some(items.iter().filter_map(|item| T::read(item, cx)).collect())
    }

    fn absent() -> Option<Self> {
        Some(Vec::new())
    }
}

/// `[key.name]` tables, or `{ name = value }`, in the order of the file. Those that cannot be read are left out.
#[derive(Clone, Debug)]
pub(super) struct Named<T>(pub Vec<(String, T, Range<usize>)>);

impl<T: Read> Read for Named<T> {
    fn read(value: &Value, cx: &mut Context) -> Option<Self> {
        let DeValue::Table(entries) = value.get_ref() else {
            cx.must(value.span(), "a table of names", kind(value));
            return None;
        };
        let mut named = Vec::new();
        for (name, value) in entries.iter() {
            let text: &str = name.get_ref();
            if let Some(item) = cx.under(text, |cx| T::read(value, cx)) {
                named.push((text.to_owned(), item, name.span()));
            }
        }
        named.sort_by_key(|(_, _, at)| at.start);
        Some(Self(named))
    }

    fn absent() -> Option<Self> {
        Some(Self(Vec::new()))
    }
}

impl<T: JsonSchema> JsonSchema for Named<T> {
    fn inline_schema() -> bool {
        true
    }

    fn schema_name() -> std::borrow::Cow<'static, str> {
        format!("Named{}", T::schema_name()).into()
    }

    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        schemars::json_schema!({ "type": "object", "additionalProperties": generator.subschema_for::<T>() })
    }
}

/// What a value is, with its article.
pub(super) fn kind(value: &Value) -> &'static str {
    match value.get_ref() {
        DeValue::String(_) => "a string",
        DeValue::Integer(_) => "a whole number",
        DeValue::Float(_) => "a number",
        DeValue::Boolean(_) => "true or false",
        DeValue::Datetime(_) => "a date",
        DeValue::Array(_) => "an array",
        DeValue::Table(_) => "a table",
    }
}
