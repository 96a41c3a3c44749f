//! The document against `schema.toml`: types, ranges, what must be there and what may not, references, extensions.

use std::collections::HashSet;

use serde_json::{Map, Value};

use super::{
    asset::{Asset, escaped, list, whole},
    findings::Findings,
    schema::{Limit, Object, Pattern, Property, SCHEMA, Shape},
    uris,
};
use crate::import::gltf::report::quoted;

/// How far the length of a vector that is to be a unit may be from 1.
const UNIT_TOLERANCE: f64 = 5e-4;

pub fn check(asset: Asset, findings: &mut Findings) {
    let declared = list(asset.root.get("extensionsUsed")).iter().filter_map(Value::as_str).collect();
    let mut walk = Walk { asset, declared, findings, pointer: String::new() };
    walk.object("document", asset.root);
    walk.required_extensions();
}

struct Walk<'a> {
    asset: Asset<'a>,
    declared: HashSet<&'a str>,
    findings: &'a mut Findings,
    /// Where the walk is.
    pointer: String,
}

impl Walk<'_> {
    fn add(&mut self, rule: &'static str, message: impl Into<String>) {
        self.findings.add(rule, self.pointer.as_str(), message);
    }

    /// Goes on at a member or element of where the walk is.
    fn below(&mut self, key: &str, go: impl FnOnce(&mut Self)) {
        let length = self.pointer.len();
        self.pointer += "/";
        self.pointer += &escaped(key);
        go(self);
        self.pointer.truncate(length);
    }

    fn object(&mut self, name: &str, members: &Map<String, Value>) {
        let Some(object) = SCHEMA.objects.get(name) else { return };
        for (key, property) in &object.properties {
            match members.get(key) {
                Some(value) => self.below(key, |walk| walk.property(property, value, members)),
                None => {
                    let by = property.required_by.as_ref().and_then(|by| members.get(by));
                    if property.required || by.and_then(Value::as_str) == Some(key) {
                        self.add("required properties that are missing", format!("has no `{key}`"));
                    }
                }
            }
        }
        self.together(object, members);
        match members.get("extensions") {
            Some(Value::Object(found)) => {
                self.below("extensions", |walk| {
                    found.iter().for_each(|(extension, value)| walk.extension(name, extension, value));
                });
            }
            Some(_) => self.below("extensions", |walk| walk.add("wrong types", "is not an object")),
            None => {}
        }
    }

    /// What properties of an object ask of one another.
    fn together(&mut self, object: &Object, members: &Map<String, Value>) {
        for group in &object.one_of {
            let there = group.iter().filter(|key| members.contains_key(*key)).count();
            if there != 1 {
                let keys = group.iter().map(|key| format!("`{key}`")).collect::<Vec<_>>();
                let message = format!("has {there} of {}, not exactly one", keys.join(" and "));
                self.add("alternatives", message);
            }
        }
        for [low, high] in &object.order {
            let number =
                |(key, default): &(String, Option<f64>)| members.get(key).map_or(*default, Value::as_f64);
            if let (Some(a), Some(b)) = (number(low), number(high))
                && a >= b
            {
                let message = format!("has `{}` {a}, which is not less than `{}` {b}", low.0, high.0);
                self.add("numbers in the wrong order", message);
            }
        }
    }

    fn property(&mut self, property: &Property, value: &Value, members: &Map<String, Value>) {
        if let Some(with) = property.with.as_ref().filter(|with| !members.contains_key(*with)) {
            self.add("properties without what they need", format!("is there without `{with}`"));
        }
        if let Some(other) = property.not_with.iter().find(|other| members.contains_key(*other)) {
            self.add("properties that exclude each other", format!("is there beside `{other}`"));
        }
        self.value(&property.shape, &property.limits, value);
        let items = list(Some(value));
        if property.unique {
            let mut met = HashSet::new();
            for (i, item) in items.iter().enumerate().filter(|(_, item)| item.is_string() || item.is_u64()) {
                if !met.insert(item) {
                    self.below(&i.to_string(), |walk| walk.add("repeated elements", "is listed twice"));
                }
            }
        }
        if property.unit {
            let length = items.iter().filter_map(Value::as_f64).map(|x| x * x).sum::<f64>().sqrt();
            if !items.is_empty() && (length - 1.0).abs() > UNIT_TOLERANCE {
                self.add("vectors that are not of length 1", format!("has length {length:.4}, not 1"));
            }
        }
    }

    fn value(&mut self, shape: &Shape, limits: &[Limit], value: &Value) {
        match (shape, value) {
            (Shape::Any, _) | (Shape::Boolean, Value::Bool(_)) => {}
            (Shape::Object(name), Value::Object(members)) => self.object(name, members),
            (Shape::Array(lengths, inner), Value::Array(items)) => {
                if items.is_empty() {
                    return self.add("empty arrays and objects", "is empty; it should be left out");
                }
                if !lengths.is_empty() && !lengths.contains(&items.len()) {
                    let allowed: Vec<_> = lengths.iter().map(usize::to_string).collect();
                    let message = format!("has {} elements, not {}", items.len(), allowed.join(" or "));
                    self.add("lengths of arrays", message);
                }
                for (i, item) in items.iter().enumerate() {
                    self.below(&i.to_string(), |walk| walk.value(inner, limits, item));
                }
            }
            (Shape::Map(inner), Value::Object(members)) => {
                if members.is_empty() {
                    return self.add("empty arrays and objects", "is empty");
                }
                for (name, member) in members {
                    self.below(name, |walk| walk.value(inner, limits, member));
                }
            }
            (Shape::Index(section), _) => match (whole(value), section) {
                (None, _) => self.add("indices", "is not an index (an integer of 0 or more)"),
                (Some(index), Some(section)) => {
                    let count = self.asset.count(section);
                    if index >= count as u64 {
                        let what = section.trim_start_matches('/');
                        self.add("indices", format!("refers to {what} {index}, but there are {count}"));
                    }
                }
                (Some(_), None) => {}
            },
            (Shape::Uri, Value::String(uri)) => {
                if let Err(why) = uris::check(uri) {
                    self.add("URIs", why);
                }
            }
            (Shape::Integer, Value::Number(number)) if !is_integer(number) => {
                self.add("wrong types", format!("is {number}, not an integer"));
            }
            (Shape::Number | Shape::Integer, Value::Number(_)) | (Shape::String, Value::String(_)) => {
                limits.iter().for_each(|limit| self.limit(limit, value));
            }
            _ => self.add("wrong types", format!("is {}, not {}", type_of(value), wanted(shape))),
        }
    }

    fn limit(&mut self, limit: &Limit, value: &Value) {
        let number = value.as_f64().unwrap_or(0.0);
        let text = value.as_str().map_or_else(|| value.to_string(), quoted);
        let complaint = match limit {
            Limit::AtLeast(n) => (number < *n).then(|| format!("less than {n}")),
            Limit::Above(n) => (number <= *n).then(|| format!("not more than {n}")),
            Limit::AtMost(n) => (number > *n).then(|| format!("more than {n}")),
            Limit::Below(n) => (number >= *n).then(|| format!("not less than {n}")),
            Limit::Not(n) => (number == *n).then(|| "which it must not be".to_owned()),
            Limit::Outside(a, b) => (*a < number && number < *b).then(|| format!("between {a} and {b}")),
            Limit::MultipleOf(n) => {
                let fits = whole(value).is_some_and(|whole| whole.is_multiple_of(*n));
                (!fits).then(|| format!("not a multiple of {n}"))
            }
            Limit::In(allowed) => {
                let found = value.as_str().map_or_else(|| value.to_string(), str::to_owned);
                (!allowed.contains(&found)).then(|| format!("not one of {}", allowed.join(", ")))
            }
            Limit::Like(pattern) => {
                (!matches(*pattern, value.as_str().unwrap_or(""))).then(|| match pattern {
                    Pattern::Version => "not a version such as \"2.0\"".to_owned(),
                    Pattern::Pointer => "not a JSON pointer such as \"/nodes/0/rotation\"".to_owned(),
                })
            }
        };
        if let Some(complaint) = complaint {
            self.add("values that are not allowed", format!("is {text}, {complaint}"));
        }
    }

    /// An extension of an object called `owner`.
    fn extension(&mut self, owner: &str, name: &str, value: &Value) {
        self.below(name, |walk| {
            if !walk.declared.contains(name) {
                walk.add("extensions that are not declared", "is not listed in `extensionsUsed`");
            }
            let Some(owners) = SCHEMA.extensions.get(name) else { return };
            match (owners.get(owner), value) {
                (Some(object), Value::Object(members)) => walk.object(object, members),
                (Some(_), _) => walk.add("wrong types", format!("is {}, not an object", type_of(value))),
                (None, _) => walk.add("misplaced extensions", "is an extension that does not belong here"),
            }
        });
    }

    fn required_extensions(&mut self) {
        let required = list(self.asset.root.get("extensionsRequired"));
        for (i, name) in required.iter().enumerate().filter_map(|(i, name)| Some((i, name.as_str()?))) {
            if !self.declared.contains(name) {
                let message = format!("requires {}, which `extensionsUsed` does not list", quoted(name));
                self.findings.add(
                    "extensions that are not declared",
                    format!("/extensionsRequired/{i}"),
                    message,
                );
            }
        }
        // Readers without it would take the integers for metres.
        let quantization = "KHR_mesh_quantization";
        let position =
            list(self.asset.root.get("extensionsUsed")).iter().position(|name| name == quantization);
        if let Some(i) = position.filter(|_| !required.iter().any(|name| name == quantization)) {
            let message = format!("uses {quantization}, which `extensionsRequired` must list too");
            self.findings.add("extensions that are not declared", format!("/extensionsUsed/{i}"), message);
        }
    }
}

fn is_integer(number: &serde_json::Number) -> bool {
    // Beyond 2⁵³ not every float is one, though each looks like it.
    number.as_f64().is_some_and(|f| f.fract() == 0.0 && f.abs() <= 9_007_199_254_740_992.0)
}

fn matches(pattern: Pattern, text: &str) -> bool {
    let digits = |part: &str| !part.is_empty() && part.bytes().all(|b| b.is_ascii_digit());
    match pattern {
        Pattern::Version => text.split_once('.').is_some_and(|(a, b)| digits(a) && digits(b)),
        // Every tilde is the beginning of ~0 or ~1.
        Pattern::Pointer => {
            text.starts_with('/') && text.split('~').skip(1).all(|rest| rest.starts_with(['0', '1']))
        }
    }
}

fn type_of(value: &Value) -> &'static str {
    match value {
        Value::Null => "null",
        Value::Bool(_) => "a boolean",
        Value::Number(_) => "a number",
        Value::String(_) => "a string",
        Value::Array(_) => "an array",
        Value::Object(_) => "an object",
    }
}

fn wanted(shape: &Shape) -> &'static str {
    match shape {
        Shape::Any => "anything",
        Shape::Boolean => "a boolean",
        Shape::Integer => "an integer",
        Shape::Number => "a number",
        Shape::String => "a string",
        Shape::Uri => "a URI",
        Shape::Index(_) => "an index",
        Shape::Array(..) => "an array",
        Shape::Object(_) | Shape::Map(_) => "an object",
    }
}
