//! Tables of the scene file. [`table!`] declares one once: from the declaration follow the struct, how it is read
//! (every error at its own key, all of them collected) and its JSON Schema. [`tagged!`] does so for a choice among
//! tables by their `type`.

use std::ops::Range;

use schemars::{Schema, SchemaGenerator};
use serde_json::{Map, Value as Json};
use toml::de::{DeTable, DeValue};

use super::{
    context::Context,
    range::Limits,
    read::{Read, Value, kind},
};
use crate::diagnostic::quote;

/// Where the keys of a table stand, for checks that concern several of them.
#[derive(Clone, Debug)]
pub(super) struct Keys {
    pub table: Range<usize>,
    keys: Vec<Key>,
    /// Those whose value is not what the file means: wrong, mistyped, or required and missing.
    unsound: Vec<&'static str>,
}

#[derive(Clone, Debug)]
struct Key {
    name: &'static str,
    key: Range<usize>,
    value: Range<usize>,
}

impl Keys {
    pub fn none() -> Self {
        Self { table: 0..0, keys: Vec::new(), unsound: Vec::new() }
    }

    pub fn given(&self, name: &str) -> bool {
        self.find(name).is_some()
    }

    /// None of these was given wrongly or left out wrongly, so that it makes sense to compare them.
    pub fn sound(&self, names: &[&str]) -> bool {
        !names.iter().any(|name| self.unsound.contains(name))
    }

    /// The first of these that is given: its name.
    pub fn first<'a>(&self, names: &[&'a str]) -> Option<&'a str> {
        names.iter().copied().find(|name| self.given(name))
    }

    /// The value of `name`, or else the table's header.
    pub fn value(&self, name: &str) -> Range<usize> {
        self.find(name).map_or(self.table.clone(), |key| key.value.clone())
    }

    /// The key `name` itself, or else the table's header.
    pub fn key(&self, name: &str) -> Range<usize> {
        self.find(name).map_or(self.table.clone(), |key| key.key.clone())
    }

    /// Reports every one of `names` beyond the first that is given.
    pub fn exclusive(&self, names: &[&str], cx: &mut Context) {
        let mut given: Vec<&Key> = names.iter().filter_map(|name| self.find(name)).collect();
        given.sort_by_key(|key| key.key.start);
        if let Some((first, others)) = given.split_first() {
            for other in others {
                let message = format!("`{}` and `{}` exclude each other", other.name, first.name);
                cx.error(other.key.clone(), message).help("leave one of them out");
            }
        }
    }

    fn find(&self, name: &str) -> Option<&Key> {
        self.keys.iter().find(|key| key.name == name)
    }
}

/// A table being read.
pub(super) struct TableReader<'a, 'i> {
    entries: Option<&'a DeTable<'i>>,
    known: &'static [&'static str],
    unknown: Vec<(Range<usize>, String, Option<&'static str>)>,
    keys: Keys,
}

impl<'a, 'i> TableReader<'a, 'i> {
    pub fn open(
        value: &'a Value<'i>,
        known: &'static [&'static str],
        tag: Option<&str>,
        cx: &mut Context,
    ) -> Option<Self> {
        let DeValue::Table(entries) = value.get_ref() else {
            let finding = cx.must(value.span(), "a table", kind(value));
            if matches!(value.get_ref(), DeValue::Array(_)) {
                finding.help("there is one of it: write the header in single brackets");
            }
            return None;
        };
        let mut reader = Self {
            entries: Some(entries),
            known,
            unknown: Vec::new(),
            keys: Keys { table: value.span(), ..Keys::none() },
        };
        for (key, _) in entries.iter() {
            let name: &str = key.get_ref();
            if known.contains(&name) || tag.is_some() && name == "type" {
                continue;
            }
            let near = crate::diagnostic::nearest(name, known.iter().copied());
            let near = known.iter().copied().find(|known| Some(*known) == near);
            reader.unknown.push((key.span(), name.to_owned(), near));
        }
        let what = tag.map_or("known here".to_owned(), |tag| format!("the keys of type \"{tag}\" are"));
        for (span, name, near) in &reader.unknown {
            let help = match near {
                Some(near) => format!("did you mean `{near}`?"),
                None if known.is_empty() => "no key is known here".to_owned(),
                None => format!("{what}: {}", known.join(", ")),
            };
            cx.error(span.clone(), format!("unknown key {}", quote(name))).help(help);
        }
        Some(reader)
    }

    /// A table that the file does not have: everything in it is absent.
    pub fn empty() -> Self {
        Self { entries: None, known: &[], unknown: Vec::new(), keys: Keys::none() }
    }

    /// The value of `name`; where it is absent or wrong, `default`, or else what its absence means, or else anything:
    /// the checks that do not concern it still run, on a scene that is then refused. `None` where there is nothing to
    /// stand for it: that has been reported.
    pub fn key<T: Read>(
        &mut self,
        name: &'static str,
        default: Option<T>,
        limits: Option<Limits>,
        cx: &mut Context,
    ) -> Option<T> {
        let Some((key, value)) = self.entries.and_then(|entries| entries.get_key_value(name)) else {
            let stand_in = default.or_else(T::absent);
            let mistyped = self.unknown.iter().any(|(_, _, near)| *near == Some(name));
            if stand_in.is_none() && !mistyped {
                cx.absent(self.keys.table.clone(), format!("the key `{name}` is missing"));
            }
            if stand_in.is_none() || mistyped {
                self.keys.unsound.push(name);
            }
            return stand_in.or_else(T::stand_in);
        };
        let read = cx.under(name, |cx| {
            let read = T::read(value, cx)?;
            match limits.and_then(|limits| limits.broken_by(&read.numbers())) {
                Some(broken) => {
                    cx.error(value.span(), format!("`{name}` {broken}"));
                    None
                }
                None => Some(read),
            }
        });
        self.keys.keys.push(Key { name, key: key.span(), value: value.span() });
        if read.is_none() {
            self.keys.unsound.push(name);
        }
        read.or(default).or_else(T::absent).or_else(T::stand_in)
    }

    pub fn close(self) -> Keys {
        debug_assert!(self.keys.keys.iter().all(|key| self.known.contains(&key.name)));
        self.keys
    }
}

/// The object that a table is in JSON Schema.
pub(super) struct TableSchema {
    properties: Map<String, Json>,
    required: Vec<String>,
    description: &'static str,
}

impl TableSchema {
    pub fn new(description: &'static str, tag: Option<&str>) -> Self {
        let mut schema =
            Self { properties: Map::new(), required: Vec::new(), description: description.trim() };
        if let Some(tag) = tag {
            schema.properties.insert("type".into(), serde_json::json!({ "const": tag }));
            schema.required.push("type".into());
        }
        schema
    }

    pub fn key<T: Read>(
        &mut self,
        name: &str,
        description: &str,
        default: Option<Json>,
        limits: Option<Limits>,
        generator: &mut SchemaGenerator,
    ) {
        if default.is_none() && T::absent().is_none() {
            self.required.push(name.into());
        }
        let mut schema = T::schema(generator);
        if let Some(limits) = limits {
            limits.describe(&mut schema);
        }
        schema.insert("description".into(), description.trim().into());
        if let Some(default) = default {
            schema.insert("default".into(), shortest(default));
        }
        self.properties.insert(name.into(), schema.into());
    }

    pub fn finish(self) -> Schema {
        let mut schema = schemars::json_schema!({
            "type": "object",
            "description": self.description,
            "properties": self.properties,
            "additionalProperties": false,
        });
        if !self.required.is_empty() {
            schema.insert("required".into(), self.required.into());
        }
        schema
    }
}

/// 0.1 and not 0.10000000149: numbers of single precision with the digits that they were written with.
fn shortest(json: Json) -> Json {
    match json {
        Json::Number(number) if number.is_f64() => {
            let single = number.as_f64().unwrap_or_default() as f32;
            single.to_string().parse::<f64>().map_or(Json::Null, |double| {
                if double.fract() == 0.0 { (double as i64).into() } else { double.into() }
            })
        }
        Json::Array(items) => items.into_iter().map(shortest).collect(),
        other => other,
    }
}

/// Declares a table: `table! { /// doc … struct Name as "type" { /// doc … key: Type = default; limits, … } }`.
/// `as "type"`, the default and the limits may be left out; `key as "text": …` is for keys that are words of Rust. A key without default is required, unless its type has
/// a meaning for being absent (`Option`, `Vec`).
macro_rules! table {
    (
        $(#[doc = $doc:literal])*
        struct $name:ident $(as $tag:literal)? {
            $( $(#[doc = $about:literal])* $key:ident $(as $text:literal)? : $type:ty $(= $default:expr)? $(; $limits:expr)? ,)*
        }
    ) => {
        $(#[doc = $doc])*
        #[derive(Clone, Debug)]
        pub(super) struct $name {
            $( $(#[doc = $about])* pub $key: $type, )*
            /// For checks across keys, where a table has such.
            #[allow(dead_code)]
            pub keys: $crate::scene::table::Keys,
        }

        impl $name {
            const KEYS: &[&str] = &[$([$($text,)? stringify!($key)][0]),*];
            pub const TAG: Option<&str> = [$(Some($tag),)? None][0];

            fn from_table(
                mut table: $crate::scene::table::TableReader,
                #[allow(unused_variables)] cx: &mut $crate::scene::context::Context,
            ) -> Option<Self> {
                $( let $key: Option<$type> =
                    table.key([$($text,)? stringify!($key)][0], [$(Some($default),)? None].into_iter().next().flatten(), [$(Some($limits),)? None][0], cx); )*
                Some(Self { $( $key: $key?, )* keys: table.close() })
            }

            /// The table when the file does not have it; `None` where it has required keys.
            #[allow(dead_code)]
            pub fn absent(cx: &mut $crate::scene::context::Context) -> Option<Self> {
                Self::from_table($crate::scene::table::TableReader::empty(), cx)
            }
        }

        impl $crate::scene::read::Read for $name {
            fn read(value: &$crate::scene::read::Value, cx: &mut $crate::scene::context::Context) -> Option<Self> {
                let table = $crate::scene::table::TableReader::open(value, Self::KEYS, Self::TAG, cx)?;
                Self::from_table(table, cx)
            }
        }

        impl schemars::JsonSchema for $name {
            fn schema_name() -> std::borrow::Cow<'static, str> {
                stringify!($name).into()
            }

            fn json_schema(generator: &mut schemars::SchemaGenerator) -> schemars::Schema {
                #[allow(unused_mut)]
                let mut schema = $crate::scene::table::TableSchema::new(concat!($($doc, "\n"),*), Self::TAG);
                $( schema.key::<$type>(
                    [$($text,)? stringify!($key)][0],
                    concat!($($about),*),
                    [$(Some(serde_json::json!($default)),)? None].into_iter().next().flatten(),
                    [$(Some($limits),)? None][0],
                    generator,
                ); )*
                schema.finish()
            }
        }
    };
}

/// Declares a choice among tables declared with `struct … as "type"`: `tagged! { /// doc … enum Name { Table, … } }`.
/// After `later` come types that are planned, so that naming one is told from a mistake.
macro_rules! tagged {
    (
        $(#[doc = $doc:literal])*
        enum $name:ident { $($variant:ident),* $(,)? } $(later $($later:literal)*)?
    ) => {
        $(#[doc = $doc])*
        #[derive(Clone, Debug)]
        // A file has few of them.
        #[allow(clippy::large_enum_variant)]
        pub(super) enum $name {
            $($variant($variant),)*
        }

        impl $crate::scene::read::Read for $name {
            fn read(value: &$crate::scene::read::Value, cx: &mut $crate::scene::context::Context) -> Option<Self> {
                let types = [$($variant::TAG.unwrap_or_default()),*];
                let tag = $crate::scene::table::read_tag(value, &types, &[$($($later),*)?], cx)?;
                $( if Some(tag) == $variant::TAG {
                    return <$variant as $crate::scene::read::Read>::read(value, cx).map(Self::$variant);
                } )*
                None
            }
        }

        impl schemars::JsonSchema for $name {
            fn schema_name() -> std::borrow::Cow<'static, str> {
                stringify!($name).into()
            }

            fn json_schema(generator: &mut schemars::SchemaGenerator) -> schemars::Schema {
                schemars::json_schema!({
                    "description": concat!($($doc, "\n"),*).trim(),
                    "oneOf": [$(generator.subschema_for::<$variant>()),*],
                })
            }
        }
    };
}

/// Which of `types` the key `type` of a table names.
pub(super) fn read_tag<'t>(
    value: &Value,
    types: &[&'t str],
    later: &[&str],
    cx: &mut Context,
) -> Option<&'t str> {
    let DeValue::Table(entries) = value.get_ref() else {
        cx.must(value.span(), "a table", kind(value));
        return None;
    };
    let Some(tag) = entries.get("type") else {
        cx.absent(value.span(), "the key `type` is missing").help(format!("one of {}", list(types)));
        return None;
    };
    cx.under("type", |cx| super::choice::choose(tag, types, later, cx))
}

pub(super) fn list(names: &[&str]) -> String {
    names.iter().map(|name| format!("\"{name}\"")).collect::<Vec<_>>().join(", ")
}

/// The schema of a type that is written out wherever it is used: `inline_schema! { Type, generator: schema }`.
macro_rules! inline_schema {
    ($($type:ident, $generator:ident: $schema:expr),* $(,)?) => {$(
        impl schemars::JsonSchema for $type {
            fn inline_schema() -> bool {
                true
            }

            fn schema_name() -> std::borrow::Cow<'static, str> {
                stringify!($type).into()
            }

            fn json_schema($generator: &mut schemars::SchemaGenerator) -> schemars::Schema {
                $schema
            }
        }
    )*};
}

pub(super) use {inline_schema, table, tagged};
