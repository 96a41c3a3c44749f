//! `schema.toml`, read: what each object of a document may hold.

use std::{collections::BTreeMap, str::FromStr, sync::LazyLock};

/// The objects of glTF 2.0 and of the extensions that are read.
pub static SCHEMA: LazyLock<Schema> =
    LazyLock::new(|| parse(include_str!("schema.toml")).expect("the schema is part of the program"));

#[derive(Default)]
pub struct Schema {
    pub objects: BTreeMap<String, Object>,
    /// Of each extension the object that it is on each object that may carry it.
    pub extensions: BTreeMap<String, BTreeMap<String, String>>,
}

#[derive(Default)]
pub struct Object {
    pub properties: BTreeMap<String, Property>,
    /// Exactly one of these must be there.
    pub one_of: Vec<Vec<String>>,
    /// The first is to be smaller; each with its default.
    pub order: Vec<[(String, Option<f64>); 2]>,
}

pub struct Property {
    pub shape: Shape,
    pub required: bool,
    /// Required if this other property has the name of this one as its value.
    pub required_by: Option<String>,
    pub with: Option<String>,
    pub not_with: Vec<String>,
    pub unique: bool,
    pub unit: bool,
    /// Of the numbers and strings in it.
    pub limits: Vec<Limit>,
}

pub enum Shape {
    Any,
    Boolean,
    Integer,
    Number,
    String,
    Uri,
    /// Of the array at this pointer, if it is one that is known from here.
    Index(Option<String>),
    Object(String),
    /// Of one of these lengths, or any if there are none.
    Array(Vec<usize>, Box<Shape>),
    Map(Box<Shape>),
}

pub enum Limit {
    AtLeast(f64),
    Above(f64),
    AtMost(f64),
    Below(f64),
    Not(f64),
    /// Not strictly between these.
    Outside(f64, f64),
    MultipleOf(u64),
    In(Vec<String>),
    Like(Pattern),
}

#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Pattern {
    Version,
    Pointer,
}

fn parse(text: &str) -> Option<Schema> {
    let mut schema = Schema::default();
    for (name, table) in toml::Table::from_str(text).ok()? {
        let table = table.as_table()?;
        if name == "extensions" {
            for (extension, owners) in table {
                let owners = owners.as_table()?.iter();
                let owners = owners.map(|(owner, object)| Some((owner.clone(), object.as_str()?.to_owned())));
                schema.extensions.insert(extension.clone(), owners.collect::<Option<_>>()?);
            }
        } else {
            schema.objects.insert(name, object(table)?);
        }
    }
    Some(schema)
}

fn object(table: &toml::Table) -> Option<Object> {
    let mut object = Object::default();
    for (key, value) in table {
        match (key.as_str(), value) {
            ("one of", toml::Value::Array(groups)) => {
                object.one_of =
                    groups.iter().map(|group| Some(words(group.as_str()?))).collect::<Option<_>>()?;
            }
            ("order", toml::Value::Array(pairs)) => {
                object.order = pairs.iter().map(|pair| ordered(pair.as_str()?)).collect::<Option<_>>()?;
            }
            (_, value) => drop(object.properties.insert(key.clone(), property(value.as_str()?)?)),
        }
    }
    Some(object)
}

/// "a=0 b" as a pair of names with their defaults.
fn ordered(pair: &str) -> Option<[(String, Option<f64>); 2]> {
    let (low, high) = pair.split_once(' ')?;
    Some([low, high].map(|side| match side.split_once('=') {
        Some((name, default)) => (name.to_owned(), default.parse().ok()),
        None => (side.to_owned(), None),
    }))
}

fn property(text: &str) -> Option<Property> {
    let mut clauses = text.split(", ");
    let mut property = Property {
        shape: shape(clauses.next()?)?,
        required: false,
        required_by: None,
        with: None,
        not_with: Vec::new(),
        unique: false,
        unit: false,
        limits: Vec::new(),
    };
    for clause in clauses {
        let limit = match clause {
            "required" => {
                property.required = true;
                continue;
            }
            "unique" => {
                property.unique = true;
                continue;
            }
            "unit" => {
                property.unit = true;
                continue;
            }
            _ => clause,
        };
        if let Some(key) = limit.strip_prefix("required by ") {
            property.required_by = Some(key.to_owned());
        } else if let Some(key) = limit.strip_prefix("with ") {
            property.with = Some(key.to_owned());
        } else if let Some(keys) = limit.strip_prefix("not with ") {
            property.not_with = words(keys);
        } else {
            property.limits.push(self::limit(limit)?);
        }
    }
    Some(property)
}

fn shape(text: &str) -> Option<Shape> {
    if let Some(inner) = text.strip_prefix("map of ") {
        return Some(Shape::Map(Box::new(shape(inner)?)));
    }
    if let Some(rest) = text.strip_prefix("array") {
        let (lengths, inner) = rest.split_once("of ")?;
        let lengths = lengths.trim().trim_matches(['[', ']']).split_whitespace();
        let lengths = lengths.map(|n| n.parse().ok()).collect::<Option<_>>()?;
        return Some(Shape::Array(lengths, Box::new(shape(inner)?)));
    }
    if let Some(section) = text.strip_prefix("index of ") {
        let pointer = if section.starts_with('/') { section.to_owned() } else { format!("/{section}") };
        return Some(Shape::Index(Some(pointer)));
    }
    Some(match text {
        "any" => Shape::Any,
        "boolean" => Shape::Boolean,
        "integer" => Shape::Integer,
        "number" => Shape::Number,
        "string" => Shape::String,
        "uri" => Shape::Uri,
        "index" => Shape::Index(None),
        name => Shape::Object(name.to_owned()),
    })
}

fn limit(clause: &str) -> Option<Limit> {
    let (operator, operand) = clause.split_once(' ')?;
    let number = || operand.parse().ok();
    Some(match operator {
        ">=" => Limit::AtLeast(number()?),
        ">" => Limit::Above(number()?),
        "<=" => Limit::AtMost(number()?),
        "<" => Limit::Below(number()?),
        "!=" => Limit::Not(number()?),
        "outside" => {
            let (low, high) = operand.split_once(' ')?;
            Limit::Outside(low.parse().ok()?, high.parse().ok()?)
        }
        "multiple" => Limit::MultipleOf(operand.strip_prefix("of ")?.parse().ok()?),
        "in" => Limit::In(words(operand)),
        "like" => Limit::Like(match operand {
            "version" => Pattern::Version,
            "pointer" => Pattern::Pointer,
            _ => return None,
        }),
        _ => return None,
    })
}

fn words(text: &str) -> Vec<String> {
    text.split_whitespace().map(str::to_owned).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every object that is named is described, and the other way round.
    #[test]
    fn schema_is_whole() {
        let schema =
            parse(include_str!("schema.toml")).expect("a schema of the form that its head describes");
        let mut named = vec!["document"];
        named.extend(schema.extensions.values().flat_map(|owners| owners.values()).map(String::as_str));
        let mut pending: Vec<&Shape> =
            schema.objects.values().flat_map(|object| object.properties.values()).map(|p| &p.shape).collect();
        while let Some(shape) = pending.pop() {
            match shape {
                Shape::Object(name) => named.push(name),
                Shape::Array(_, inner) | Shape::Map(inner) => pending.push(inner),
                _ => {}
            }
        }
        for name in &named {
            assert!(schema.objects.contains_key(*name), "{name} is not described");
        }
        for name in schema.objects.keys() {
            assert!(named.contains(&name.as_str()), "{name} is not used");
        }
        for owner in schema.extensions.values().flat_map(BTreeMap::keys) {
            assert!(schema.objects.contains_key(owner), "{owner} is not described");
        }
    }

    #[test]
    fn every_extension_that_is_read_is_described() {
        for name in crate::import::gltf::extensions::SUPPORTED {
            assert!(SCHEMA.extensions.contains_key(name), "{name}");
        }
    }
}
