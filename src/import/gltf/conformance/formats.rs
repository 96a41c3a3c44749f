//! What the accessors of attributes, indices, skins and animations may hold.
//!
//! glTF 2.0, sections 3.7.2.1 "Overview" (attributes), 3.7.2.2 "Morph Targets", 3.7.3 "Skins" and 3.11 "Animations";
//! KHR_mesh_quantization for what it adds.

/// Formats by the name of the attribute without its set, and those that KHR_mesh_quantization adds. A format is type and
/// component type; `n` stands for normalized.
type Attribute = (&'static str, &'static [&'static str], &'static [&'static str]);

const INTEGERS: [&str; 8] = [
    "VEC3 i8",
    "VEC3 i8 normalized",
    "VEC3 u8",
    "VEC3 u8 normalized",
    "VEC3 i16",
    "VEC3 i16 normalized",
    "VEC3 u16",
    "VEC3 u16 normalized",
];
const SIGNED: [&str; 4] = ["VEC3 i8", "VEC3 i8 normalized", "VEC3 i16", "VEC3 i16 normalized"];
const DIRECTIONS: [&str; 2] = ["VEC3 i8 normalized", "VEC3 i16 normalized"];
const COLORS: [&str; 6] = [
    "VEC3 f32",
    "VEC3 u8 normalized",
    "VEC3 u16 normalized",
    "VEC4 f32",
    "VEC4 u8 normalized",
    "VEC4 u16 normalized",
];
const FRACTIONS: [&str; 5] =
    ["VEC2 f32", "VEC2 u8 normalized", "VEC2 u16 normalized", "VEC2 i8 normalized", "VEC2 i16 normalized"];

const ATTRIBUTES: [Attribute; 7] = [
    ("POSITION", &["VEC3 f32"], &INTEGERS),
    ("NORMAL", &["VEC3 f32"], &DIRECTIONS),
    ("TANGENT", &["VEC4 f32"], &["VEC4 i8 normalized", "VEC4 i16 normalized"]),
    (
        "TEXCOORD",
        &["VEC2 f32", "VEC2 u8 normalized", "VEC2 u16 normalized"],
        &["VEC2 i8", "VEC2 i8 normalized", "VEC2 u8", "VEC2 i16", "VEC2 i16 normalized", "VEC2 u16"],
    ),
    ("COLOR", &COLORS, &[]),
    ("JOINTS", &["VEC4 u8", "VEC4 u16"], &[]),
    ("WEIGHTS", &["VEC4 f32", "VEC4 u8 normalized", "VEC4 u16 normalized"], &[]),
];

const TARGETS: [Attribute; 5] = [
    ("POSITION", &["VEC3 f32"], &SIGNED),
    ("NORMAL", &["VEC3 f32"], &DIRECTIONS),
    ("TANGENT", &["VEC3 f32"], &DIRECTIONS),
    ("TEXCOORD", &FRACTIONS, &["VEC2 i8", "VEC2 u8", "VEC2 i16", "VEC2 u16"]),
    (
        "COLOR",
        &[
            "VEC3 f32",
            "VEC3 u8 normalized",
            "VEC3 u16 normalized",
            "VEC3 i8 normalized",
            "VEC3 i16 normalized",
            "VEC4 f32",
            "VEC4 u8 normalized",
            "VEC4 u16 normalized",
            "VEC4 i8 normalized",
            "VEC4 i16 normalized",
        ],
        &[],
    ),
];

pub const INDICES: [&str; 3] = ["SCALAR u8", "SCALAR u16", "SCALAR u32"];
pub const INVERSE_BIND_MATRICES: [&str; 1] = ["MAT4 f32"];
pub const TIMES: [&str; 1] = ["SCALAR f32"];

/// Values of an animation by the path of their target.
pub fn animated(path: &str) -> &'static [&'static str] {
    match path {
        "translation" | "scale" => &["VEC3 f32"],
        "rotation" => &[
            "VEC4 f32",
            "VEC4 i8 normalized",
            "VEC4 u8 normalized",
            "VEC4 i16 normalized",
            "VEC4 u16 normalized",
        ],
        "weights" => &[
            "SCALAR f32",
            "SCALAR i8 normalized",
            "SCALAR u8 normalized",
            "SCALAR i16 normalized",
            "SCALAR u16 normalized",
        ],
        _ => &[],
    }
}

/// The formats of an attribute, or of that of a morph target; `None` where it is no attribute of the specification.
pub fn attribute(
    name: &str,
    is_target: bool,
    is_quantized: bool,
) -> Option<impl Iterator<Item = &'static str> + Clone> {
    let (base, set) = split(name);
    let table: &[Attribute] = if is_target { &TARGETS } else { &ATTRIBUTES };
    let (_, core, added) = table.iter().find(|(other, ..)| *other == base)?;
    let has_sets = !["POSITION", "NORMAL", "TANGENT"].contains(&base);
    let added: &[&str] = if is_quantized { added } else { &[] };
    (has_sets == set.is_some()).then(|| core.iter().chain(added).copied())
}

/// "TEXCOORD_1" as the name and the number of the set.
pub fn split(name: &str) -> (&str, Option<usize>) {
    let number = |digits: &str| {
        // "TEXCOORD_01" is none.
        let number: usize = digits.parse().ok()?;
        (number.to_string() == digits).then_some(number)
    };
    match name.rsplit_once('_').and_then(|(base, digits)| Some((base, number(digits)?))) {
        Some((base, set)) => (base, Some(set)),
        None => (name, None),
    }
}
