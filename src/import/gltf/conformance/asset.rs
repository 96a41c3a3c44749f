//! The document as the file has it, read without belief: what is missing, or of another type than it should be, is `None`.

use serde_json::{Map, Value};

#[derive(Clone, Copy)]
pub struct Asset<'a> {
    pub root: &'a Map<String, Value>,
}

impl<'a> Asset<'a> {
    /// The array `section` of the document, with indices.
    pub fn items(self, section: &str) -> impl Iterator<Item = (usize, &'a Value)> + use<'a> {
        list(self.root.get(section)).iter().enumerate()
    }

    pub fn item(self, section: &str, index: Option<usize>) -> Option<&'a Value> {
        list(self.root.get(section)).get(index?)
    }

    /// How many elements the array at `pointer` has.
    pub fn count(self, pointer: &str) -> usize {
        let mut parts = pointer.split('/').skip(1);
        let first = parts.next().and_then(|part| self.root.get(part));
        list(parts.fold(first, |value, part| value?.get(part))).len()
    }

    /// Whether `extensionsUsed` lists this extension.
    pub fn uses(self, extension: &str) -> bool {
        list(self.root.get("extensionsUsed")).iter().any(|name| name == extension)
    }

    pub fn accessor(self, index: Option<usize>) -> Option<Accessor<'a>> {
        let json = self.item("accessors", index)?;
        let kind = json.get("componentType").and_then(whole)?;
        let component = COMPONENTS.iter().find(|(code, ..)| *code == kind)?;
        let view = index_of(json, "bufferView");
        Some(Accessor {
            json,
            component: component.1,
            component_size: component.2,
            shape: json.get("type")?.as_str()?,
            normalized: json.get("normalized") == Some(&Value::Bool(true)),
            count: json.get("count").and_then(whole)?,
            offset: json.get("byteOffset").and_then(whole).unwrap_or(0),
            view: view.and_then(|view| Some((view, self.item("bufferViews", Some(view))?))),
        })
    }
}

/// Code, name and bytes of component types.
const COMPONENTS: [(u64, &str, u64); 6] = [
    (5120, "i8", 1),
    (5121, "u8", 1),
    (5122, "i16", 2),
    (5123, "u16", 2),
    (5125, "u32", 4),
    (5126, "f32", 4),
];

/// Bytes of a component type that may be an index.
pub fn component_size(code: u64) -> Option<u64> {
    COMPONENTS.iter().find(|(other, ..)| *other == code).map(|(.., size)| *size)
}

/// An accessor that says what it holds.
#[derive(Clone, Copy)]
pub struct Accessor<'a> {
    pub json: &'a Value,
    pub component: &'static str,
    pub component_size: u64,
    pub shape: &'a str,
    pub normalized: bool,
    pub count: u64,
    pub offset: u64,
    pub view: Option<(usize, &'a Value)>,
}

impl Accessor<'_> {
    /// Such as "VEC3 f32" or "VEC2 u16 normalized".
    pub fn format(&self) -> String {
        format!("{} {}{}", self.shape, self.component, if self.normalized { " normalized" } else { "" })
    }

    pub fn components(&self) -> usize {
        match self.shape {
            "SCALAR" => 1,
            "VEC2" => 2,
            "VEC3" => 3,
            "VEC4" | "MAT2" => 4,
            "MAT3" => 9,
            "MAT4" => 16,
            _ => 0,
        }
    }

    pub fn is_matrix(&self) -> bool {
        self.shape.starts_with("MAT")
    }

    pub fn stride(&self) -> Option<u64> {
        self.view.and_then(|(_, view)| view.get("byteStride")).and_then(whole)
    }

    /// Where its elements begin in the buffer.
    pub fn total_offset(&self) -> u64 {
        let view = self.view.and_then(|(_, view)| view.get("byteOffset")).and_then(whole);
        view.unwrap_or(0).saturating_add(self.offset)
    }

    pub fn has_bounds(&self) -> bool {
        ["min", "max"].iter().all(|key| self.json.get(key).is_some())
    }
}

/// The elements of an array; none if it is anything else.
pub fn list(value: Option<&Value>) -> &[Value] {
    value.and_then(Value::as_array).map_or(&[], Vec::as_slice)
}

/// The members of an object; none if it is anything else.
pub fn members(value: Option<&Value>) -> impl Iterator<Item = (&String, &Value)> {
    value.and_then(Value::as_object).into_iter().flatten()
}

/// A non-negative integer, though it be written `1.0`.
pub fn whole(value: &Value) -> Option<u64> {
    let float = || value.as_f64().filter(|f| (0.0..=9_007_199_254_740_991.0).contains(f) && f.fract() == 0.0);
    value.as_u64().or_else(|| float().map(|f| f as u64))
}

pub fn index_of(value: &Value, key: &str) -> Option<usize> {
    usize::try_from(whole(value.get(key)?)?).ok()
}

pub fn extension<'a>(value: &'a Value, name: &str) -> Option<&'a Value> {
    value.get("extensions")?.get(name)
}

/// The numbers of an array; `None` if it holds anything else.
pub fn numbers<const N: usize>(value: Option<&Value>) -> Option<[f64; N]> {
    let numbers: Option<Vec<f64>> = list(value).iter().map(Value::as_f64).collect();
    numbers?.try_into().ok()
}

/// A key as part of a JSON pointer (RFC 6901).
pub fn escaped(key: &str) -> String {
    key.replace('~', "~0").replace('/', "~1")
}
