//! MTL: the material library beside an OBJ file, as it is written (Wavefront's *MTL material format*, and the PBR
//! extension `Pr`, `Pm`, … of exporters since 2015). What its numbers mean is `material`'s part; docs/obj.md lists the
//! keys.
//!
//! Not by `tobj`: its MTL reader panics on `Kd 0.5`, gives up the whole library for one odd line, keeps a texture's
//! options glued to its name and says no lines. This reader loses what it cannot read, brings what is out of range into
//! it, says so, and goes on.

use std::{collections::HashMap, path::Path};

use super::{
    map::{Map, map},
    text::{name_without_comment, shorten, statements, without_comment},
};
use crate::diagnostic::{Diagnostic, Place};

/// The material after one `newmtl`. `None`: not said.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Mtl {
    pub name: String,
    pub line: usize,
    /// `Ka`. Blender's exporter keeps the metallic value here.
    pub ambient: Option<[f32; 3]>,
    /// `Kd`.
    pub diffuse: Option<[f32; 3]>,
    /// `Ks`.
    pub specular: Option<[f32; 3]>,
    /// `Ke`.
    pub emission: Option<[f32; 3]>,
    /// `Tf`, the share of light let through.
    pub filter: Option<[f32; 3]>,
    /// `Ns`, 0 to 1000.
    pub exponent: Option<f32>,
    /// `d`, or 1 − `Tr`: 1 is opaque.
    pub dissolve: Option<f32>,
    /// `Ni`.
    pub ior: Option<f32>,
    pub illum: Option<u32>,
    /// The PBR extension from here on: `Pr`.
    pub roughness: Option<f32>,
    /// `Pm`.
    pub metallic: Option<f32>,
    /// `Ps`.
    pub sheen: Option<f32>,
    /// `Pc`, 0 to 4.
    pub clearcoat: Option<f32>,
    /// `Pcr`.
    pub clearcoat_roughness: Option<f32>,
    /// `aniso`.
    pub anisotropy: Option<f32>,
    /// `anisor`, in turns.
    pub anisotropy_rotation: Option<f32>,
    pub maps: Maps,
}

#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Maps {
    pub diffuse: Option<Map>,
    pub emission: Option<Map>,
    pub dissolve: Option<Map>,
    pub exponent: Option<Map>,
    pub specular: Option<Map>,
    pub roughness: Option<Map>,
    pub metallic: Option<Map>,
    pub sheen: Option<Map>,
    pub clearcoat: Option<Map>,
    pub clearcoat_roughness: Option<Map>,
    pub normal: Option<Map>,
    /// `bump`, `map_Bump`: heights by the format; normals in the files of many exporters.
    pub bump: Option<Map>,
}

/// A number with the range that it has a meaning in.
struct Range(f32, f32);

const UNIT: Range = Range(0.0, 1.0);
/// Energy, and Ka, which has none here.
const POSITIVE: Range = Range(0.0, f32::MAX);
const EXPONENT: Range = Range(0.0, 1000.0);
/// Wavefront's goes down to 0.001: an inside thinner than air.
const INDEX: Range = Range(1.0, 10.0);
/// Disney's clearcoat of 1 is a quarter of a full one.
const COAT: Range = Range(0.0, 4.0);
const ANY: Range = Range(f32::MIN, f32::MAX);
const ILLUM: Range = Range(0.0, 10.0);

/// Why a known key does nothing.
const IGNORED: [(&str, &str); 8] = [
    ("refl", REFLECTIONS),
    ("map_refl", REFLECTIONS),
    ("disp", DISPLACEMENT),
    ("map_disp", DISPLACEMENT),
    ("decal", "decals are not laid over textures here"),
    ("map_aat", "every picture is antialiased"),
    ("sharpness", REFLECTIONS),
    ("kt", "`Tf` is the share of light let through"),
];
const REFLECTIONS: &str = "reflections are traced, not looked up in an image";
const DISPLACEMENT: &str = "surfaces are not displaced";

/// The materials of a library in its order, and what is wrong with it (warnings all).
pub(super) fn parse(text: &str, file: &Path) -> (Vec<Mtl>, Vec<Diagnostic>) {
    let mut materials: Vec<Mtl> = Vec::new();
    let mut warnings = Vec::new();
    let mut passed_over: Vec<PassedOver> = Vec::new();
    statements(text, |s| {
        let mut warn = |message| warnings.push((s.line, message));
        if s.keyword.eq_ignore_ascii_case("newmtl") {
            materials.push(Mtl { name: s.rest.into(), line: s.line, ..Mtl::default() });
        } else if let Some(material) = materials.last_mut() {
            match material.read(s.keyword, s.rest, s.line, &mut warn) {
                Ok(true) => {}
                Ok(false) => {
                    let known = passed_over.iter_mut().find(|one| one.key.eq_ignore_ascii_case(s.keyword));
                    if let Some(one) = known {
                        one.count += 1;
                    } else if passed_over.len() < MAX_KEYS_NAMED {
                        passed_over.push(PassedOver { key: s.keyword.to_owned(), line: s.line, count: 1 });
                    }
                }
                Err(message) => warn(message),
            }
        } else {
            warn(format!("`{}` before the first `newmtl` belongs to no material", shorten(s.keyword)));
        }
    });
    let more = warnings.len().saturating_sub(MAX_WARNINGS);
    warnings.truncate(MAX_WARNINGS);
    warnings.extend(passed_over.iter().map(|one| (one.line, one.message())));
    warnings.sort_by_key(|(line, _)| *line);
    let warning = |(line, message)| Diagnostic::warning(file, Place::Line(line), message);
    let mut warnings: Vec<_> = warnings.into_iter().map(warning).collect();
    if more > 0 {
        let message = format!("and {more} more lines that say what cannot be");
        warnings.push(Diagnostic::warning(file, Place::File, message));
    }
    (materials, warnings)
}

const MAX_WARNINGS: usize = 20;
const MAX_KEYS_NAMED: usize = 20;

/// A key that does nothing here, where it is met first.
struct PassedOver {
    key: String,
    line: usize,
    count: usize,
}

impl PassedOver {
    fn message(&self) -> String {
        let known = IGNORED.iter().find(|(key, _)| key.eq_ignore_ascii_case(&self.key));
        let why = known.map_or("no material here has such a thing", |(_, why)| why);
        format!("`{}` is passed over: {why} (lines: {})", shorten(&self.key), self.count)
    }
}

impl Mtl {
    /// `Ok(false)`: a statement that is passed over. `warn` is told what was made of a value out of range.
    fn read(
        &mut self,
        keyword: &str,
        rest: &str,
        line: usize,
        warn: &mut dyn FnMut(String),
    ) -> Result<bool, String> {
        let mut color = |range| color(keyword, rest, range, warn);
        let maps = &mut self.maps;
        match keyword.to_ascii_lowercase().as_str() {
            "ka" => self.ambient = color(POSITIVE)?,
            "kd" => self.diffuse = color(UNIT)?,
            "ks" => self.specular = color(UNIT)?,
            "ke" => self.emission = color(POSITIVE)?,
            "tf" => self.filter = color(UNIT)?,
            "ns" => self.exponent = Some(number(keyword, rest, EXPONENT, warn)?),
            "ni" => self.ior = Some(number(keyword, rest, INDEX, warn)?),
            "d" => {
                let rest = rest.strip_prefix("-halo").unwrap_or(rest);
                self.dissolve = Some(number(keyword, rest, UNIT, warn)?);
            }
            "tr" => {
                let transparent = number(keyword, rest, UNIT, warn)?;
                self.dissolve = self.dissolve.or(Some(1.0 - transparent));
            }
            "illum" => self.illum = Some(number(keyword, rest, ILLUM, warn)? as u32),
            "pr" => self.roughness = Some(number(keyword, rest, UNIT, warn)?),
            "pm" => self.metallic = Some(number(keyword, rest, UNIT, warn)?),
            "ps" => self.sheen = Some(number(keyword, rest, UNIT, warn)?),
            "pc" => self.clearcoat = Some(number(keyword, rest, COAT, warn)?),
            "pcr" => self.clearcoat_roughness = Some(number(keyword, rest, UNIT, warn)?),
            "aniso" => self.anisotropy = Some(number(keyword, rest, UNIT, warn)?),
            "anisor" => self.anisotropy_rotation = Some(number(keyword, rest, ANY, warn)?),
            "map_kd" => maps.diffuse = map(keyword, rest, line)?,
            "map_ks" => maps.specular = map(keyword, rest, line)?,
            "map_ke" | "map_emissive" => maps.emission = map(keyword, rest, line)?,
            "map_d" | "map_opacity" => maps.dissolve = map(keyword, rest, line)?,
            "map_ns" => maps.exponent = map(keyword, rest, line)?,
            "map_pr" => maps.roughness = map(keyword, rest, line)?,
            "map_pm" => maps.metallic = map(keyword, rest, line)?,
            "map_ps" => maps.sheen = map(keyword, rest, line)?,
            "map_pc" => maps.clearcoat = map(keyword, rest, line)?,
            "map_pcr" => maps.clearcoat_roughness = map(keyword, rest, line)?,
            // Roughness, metalness, occlusion; and the same in glTF's order.
            "map_rma" => (maps.roughness, maps.metallic) = packed(map(keyword, rest, line)?, 0, 1),
            "map_orm" => (maps.roughness, maps.metallic) = packed(map(keyword, rest, line)?, 1, 2),
            "norm" | "map_norm" | "map_kn" => maps.normal = map(keyword, rest, line)?,
            "bump" | "map_bump" => maps.bump = map(keyword, rest, line)?,
            // Ambient light has no part in light transport; nearly every file has it.
            "map_ka" => {}
            _ => return Ok(false),
        }
        Ok(true)
    }
}

/// One image for two values.
fn packed(map: Option<Map>, roughness: u8, metallic: u8) -> (Option<Map>, Option<Map>) {
    let of = |channel| map.clone().map(|map| Map { channel: Some(channel), ..map });
    (of(roughness), of(metallic))
}

/// `r`, or `r g b`; spectra and CIE colours are not supported.
fn color(
    keyword: &str,
    rest: &str,
    range: Range,
    warn: &mut dyn FnMut(String),
) -> Result<Option<[f32; 3]>, String> {
    let words: Vec<_> = without_comment(rest).split_whitespace().take(3).collect();
    let given = match words.as_slice() {
        ["spectral" | "xyz", ..] => {
            return Err(format!("`{keyword} {}` is not supported, only r g b", shorten(rest)));
        }
        [r] => [finite(keyword, r)?; 3],
        [r, g, b] => [finite(keyword, r)?, finite(keyword, g)?, finite(keyword, b)?],
        _ => return Err(format!("`{keyword}` needs three numbers")),
    };
    let color = given.map(|c| c.clamp(range.0, range.1));
    if color != given {
        warn(range.clamped(keyword, without_comment(rest).trim()));
    }
    Ok(Some(color))
}

fn number(keyword: &str, rest: &str, range: Range, warn: &mut dyn FnMut(String)) -> Result<f32, String> {
    let word = without_comment(rest).split_whitespace().next().unwrap_or_default();
    let given = finite(keyword, word)?;
    let number = given.clamp(range.0, range.1);
    if number != given {
        warn(range.clamped(keyword, word));
    }
    Ok(number)
}

impl Range {
    fn clamped(&self, keyword: &str, given: &str) -> String {
        let given = shorten(given);
        match *self {
            Self(low, f32::MAX) => format!("`{keyword} {given}` is below {low}: {low} instead"),
            Self(low, high) => format!("`{keyword} {given}` is outside {low} to {high}: it was clamped"),
        }
    }
}

fn finite(keyword: &str, word: &str) -> Result<f32, String> {
    match word.parse::<f32>() {
        Ok(number) if number.is_finite() => Ok(number),
        _ if word.is_empty() => Err(format!("`{keyword}` needs a number")),
        _ => Err(format!("`{keyword} {}` is no finite number", shorten(word))),
    }
}

/// The materials of a library by their names.
#[derive(Default)]
pub(super) struct Library {
    materials: Vec<Mtl>,
    by_name: HashMap<String, usize>,
    by_name_without_comment: HashMap<String, usize>,
}

impl Library {
    pub fn new(materials: Vec<Mtl>) -> Self {
        let mut library = Self::default();
        for (i, material) in materials.iter().enumerate() {
            // The first of a name counts.
            library.by_name.entry(material.name.clone()).or_insert(i);
            let short = name_without_comment(&material.name).to_owned();
            library.by_name_without_comment.entry(short).or_insert(i);
        }
        Self { materials, ..library }
    }

    /// The material called `name`: by its whole name, or by what stands before a comment.
    pub fn find(&self, name: &str) -> Option<&Mtl> {
        let short = || self.by_name_without_comment.get(name_without_comment(name));
        let index = self.by_name.get(name).or_else(short)?;
        self.materials.get(*index)
    }
}

#[cfg(test)]
mod tests {
    use super::{super::map, *};

    fn one(text: &str) -> Mtl {
        let (mut all, warnings) = parse(&format!("newmtl m\n{text}"), Path::new("a.mtl"));
        assert_eq!(warnings, []);
        all.remove(0)
    }

    fn warnings(text: &str) -> Vec<(Place, String)> {
        parse(text, Path::new("a.mtl")).1.into_iter().map(|d| (d.place, d.message)).collect()
    }

    #[test]
    fn keys_are_read_in_any_case_and_colors_short_or_long() {
        let m = one("KD 0.5 # grey\nKs 1 0 .5\nNs 250\nillum 2\nTr 0.25\nNi 1.33\n Pr 1e-1");
        assert_eq!((m.diffuse, m.specular), (Some([0.5; 3]), Some([1.0, 0.0, 0.5])));
        assert_eq!((m.exponent, m.illum, m.dissolve), (Some(250.0), Some(2), Some(0.75)));
        assert_eq!((m.ior, m.roughness), (Some(1.33), Some(0.1)));
        assert_eq!(one("Tr 1\nd 0.5").dissolve, Some(0.5), "d is the clearer of the two");
    }

    #[test]
    fn an_odd_line_is_lost_alone_and_said() {
        let text = "Kd 1 1 1\nnewmtl m\nKd 1 2\nKs x 0 0\nNs nan\nKd spectral a.rfl\nmap_Kd -s 1 1 1\nmap_Kd\nKd .1 .2 .3\nglow 3";
        let places: Vec<_> = warnings(text).into_iter().map(|(place, _)| place).collect();
        let lines: Vec<_> = [1, 3, 4, 5, 6, 8, 10].map(Place::Line).into_iter().collect();
        assert_eq!(places, lines);
        assert_eq!(parse(text, Path::new("a.mtl")).0[0].diffuse, Some([0.1, 0.2, 0.3]));
    }

    #[test]
    fn values_out_of_range_are_clamped_and_said() {
        let text = "newmtl m\nKd 2 -1 .5\nKe -1 4 0\nPr 1.5\nNs 1e6\nNi 0\nd -1\nTr 0\nPc 9\nillum 77\nPm .5";
        let (all, said) = parse(text, Path::new("a.mtl"));
        let m = &all[0];
        assert_eq!((m.diffuse, m.emission), (Some([1.0, 0.0, 0.5]), Some([0.0, 4.0, 0.0])));
        assert_eq!((m.roughness, m.exponent, m.ior), (Some(1.0), Some(1000.0), Some(1.0)));
        assert_eq!((m.dissolve, m.clearcoat, m.illum), (Some(0.0), Some(4.0), Some(10)));
        let lines: Vec<_> = said.iter().map(|d| d.place.clone()).collect();
        assert_eq!(lines, [2, 3, 4, 5, 6, 7, 9, 10].map(Place::Line));
        assert_eq!(said[0].message, "`Kd 2 -1 .5` is outside 0 to 1: it was clamped");
        assert_eq!(said[1].message, "`Ke -1 4 0` is below 0: 0 instead");
    }

    #[test]
    fn what_is_passed_over_is_said_once_with_its_reason_and_first_line() {
        let said = warnings("newmtl a\nrefl a.png\nnewmtl b\nREFL b.png\ndisp c.png\nglow 1");
        let told: Vec<_> = said.iter().map(|(place, message)| (place, message.as_str())).collect();
        assert_eq!(
            told.iter().map(|(place, _)| (*place).clone()).collect::<Vec<_>>(),
            [2, 5, 6].map(Place::Line)
        );
        assert!(told[0].1.contains("traced") && told[0].1.ends_with("(lines: 2)"), "{told:?}");
        assert!(told[1].1.contains("displaced") && told[2].1.contains("`glow`"), "{told:?}");
    }

    #[test]
    fn packed_maps_are_two() {
        let m = one("map_ORM a.png").maps;
        assert_eq!([m.roughness, m.metallic].map(|map| map.and_then(|m| m.channel)), [Some(1), Some(2)]);
        let m = one("map_RMA a.png").maps;
        assert_eq!([m.roughness, m.metallic].map(|map| map.and_then(|m| m.channel)), [Some(0), Some(1)]);
    }

    /// docs/obj.md lists every key and option, and whether it is read.
    #[test]
    fn the_table_of_keys_is_true() {
        let page = include_str!("../../../docs/obj.md");
        let mut told = Vec::new();
        let row = |line: &'static str| line.strip_prefix("| `")?.split_once(" | ");
        for (keys, rest) in page.lines().filter_map(row) {
            let state = rest.split(" | ").next().unwrap_or_default();
            for key in format!("`{keys}").split(", ").map(|key| key.trim_matches('`').to_owned()) {
                let value = if key.starts_with("map_") || ["norm", "bump"].contains(&key.as_str()) {
                    "a.png"
                } else {
                    "1"
                };
                let read = Mtl::default().read(&key, value, 1, &mut |_| {});
                match state {
                    "read" => assert_eq!(read, Ok(true), "{key}"),
                    "ignored" if key.starts_with('-') => {}
                    "ignored" => assert_eq!(read, Ok(false), "{key}"),
                    _ if key.starts_with('-') => assert!(Map::is_option(&key), "{key}"),
                    _ => continue,
                }
                told.push(key.to_ascii_lowercase());
            }
        }
        let code = |file: &'static str| file.split_once("#[cfg(test)]").expect("tests").0;
        let source = [code(include_str!("mtl.rs")), code(include_str!("map.rs"))].concat();
        let keys = source.lines().filter_map(|line| line.trim().strip_prefix('"')?.split_once(" => "));
        let keys: Vec<_> =
            keys.flat_map(|(keys, _)| keys.split(" | ")).map(|key| key.trim_matches('"')).collect();
        assert!(keys.len() > 30, "{keys:?}");
        let ignored = IGNORED.iter().map(|(key, _)| *key);
        let channels = ["", "r", "g", "b", "m"];
        for key in
            keys.into_iter().chain(ignored).chain(map::OPTIONS_IGNORED).filter(|key| !channels.contains(key))
        {
            assert!(told.iter().any(|one| one == key), "docs/obj.md does not tell of {key}");
        }
    }

    #[test]
    fn materials_are_found_with_and_without_a_comment() {
        let (all, _) =
            parse("newmtl Material #1\nnewmtl Material #2\nnewmtl red\nnewmtl red", Path::new("a.mtl"));
        let library = Library::new(all);
        assert_eq!(library.find("Material #2").map(|m| m.line), Some(2));
        assert_eq!(library.find("red # the first").map(|m| m.line), Some(3));
        assert_eq!(library.find("blue"), None);
    }
}
