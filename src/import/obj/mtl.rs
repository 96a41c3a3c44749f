//! MTL: the material library beside an OBJ file, as it is written (Wavefront's *MTL material format*, and the PBR
//! extension `Pr`, `Pm`, `norm` of exporters since 2015). What its numbers mean is `material`'s part.
//!
//! Not by `tobj`: its MTL reader panics on `Kd 0.5`, gives up the whole library for one odd line, keeps a texture's
//! options glued to its name and says no lines. This reader loses what it cannot read, says so, and goes on.

use std::path::Path;

use super::text::{name_without_comment, shorten, statements, without_comment};
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
    /// `Pr`, PBR extension.
    pub roughness: Option<f32>,
    /// `Pm`, PBR extension.
    pub metallic: Option<f32>,
    pub maps: Maps,
}

#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Maps {
    pub diffuse: Option<Map>,
    pub emission: Option<Map>,
    pub dissolve: Option<Map>,
    pub exponent: Option<Map>,
    pub roughness: Option<Map>,
    pub metallic: Option<Map>,
    pub normal: Option<Map>,
    /// `bump`, `map_Bump`: heights by the format; normals in the files of many exporters.
    pub bump: Option<Map>,
}

/// A texture with those of its options that are honoured.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Map {
    pub file: String,
    pub line: usize,
    /// `-s`, u and v.
    pub scale: [f32; 2],
    /// `-o` and `-t`, u and v.
    pub offset: [f32; 2],
    /// `-bm`: strength of a normal map.
    pub strength: f32,
    /// `-clamp on`.
    pub clamp: bool,
    /// `-imfchan`.
    pub channel: Option<u8>,
}

/// The materials of a library in its order, and what is wrong with it (warnings all).
pub(super) fn parse(text: &str, file: &Path) -> (Vec<Mtl>, Vec<Diagnostic>) {
    let mut materials: Vec<Mtl> = Vec::new();
    let mut warnings = Vec::new();
    let mut passed_over: Vec<String> = Vec::new();
    statements(text, |s| {
        let mut warn = |message| warnings.push(Diagnostic::warning(file, Place::Line(s.line), message));
        if s.keyword.eq_ignore_ascii_case("newmtl") {
            materials.push(Mtl { name: s.rest.into(), line: s.line, ..Mtl::default() });
        } else if let Some(material) = materials.last_mut() {
            match material.read(s.keyword, s.rest, s.line) {
                Ok(true) => {}
                Ok(false) => {
                    if !passed_over.iter().any(|key| key == s.keyword) && passed_over.len() < MAX_KEYS_NAMED {
                        passed_over.push(s.keyword.to_owned());
                    }
                }
                Err(message) => warn(message),
            }
        } else {
            warn(format!("`{}` before the first `newmtl` belongs to no material", shorten(s.keyword)));
        }
    });
    if warnings.len() > MAX_WARNINGS {
        let more = warnings.len() - MAX_WARNINGS;
        warnings.truncate(MAX_WARNINGS);
        let message = format!("and {more} more lines that cannot be read");
        warnings.push(Diagnostic::warning(file, Place::File, message));
    }
    if !passed_over.is_empty() {
        let keys: Vec<_> = passed_over.iter().map(|key| shorten(key)).collect();
        let message = format!("passed over, as no material here has them: {}", keys.join(", "));
        warnings.push(Diagnostic::warning(file, Place::File, message));
    }
    (materials, warnings)
}

const MAX_WARNINGS: usize = 20;
const MAX_KEYS_NAMED: usize = 20;

impl Mtl {
    /// `Ok(false)`: a statement that is passed over.
    fn read(&mut self, keyword: &str, rest: &str, line: usize) -> Result<bool, String> {
        match keyword.to_ascii_lowercase().as_str() {
            "ka" => self.ambient = color(keyword, rest)?,
            "kd" => self.diffuse = color(keyword, rest)?,
            "ks" => self.specular = color(keyword, rest)?,
            "ke" => self.emission = color(keyword, rest)?,
            "tf" => self.filter = color(keyword, rest)?,
            "ns" => self.exponent = Some(number(keyword, rest)?),
            "ni" => self.ior = Some(number(keyword, rest)?),
            "d" => self.dissolve = Some(number(keyword, rest.strip_prefix("-halo").unwrap_or(rest))?),
            "tr" => self.dissolve = self.dissolve.or(Some(1.0 - number(keyword, rest)?)),
            "pr" => self.roughness = Some(number(keyword, rest)?),
            "pm" => self.metallic = Some(number(keyword, rest)?),
            "illum" => self.illum = Some(number(keyword, rest)? as u32),
            "map_kd" => self.maps.diffuse = map(keyword, rest, line)?,
            "map_ke" | "map_emissive" => self.maps.emission = map(keyword, rest, line)?,
            "map_d" | "map_opacity" => self.maps.dissolve = map(keyword, rest, line)?,
            "map_ns" => self.maps.exponent = map(keyword, rest, line)?,
            "map_pr" => self.maps.roughness = map(keyword, rest, line)?,
            "map_pm" => self.maps.metallic = map(keyword, rest, line)?,
            "norm" | "map_norm" | "map_kn" => self.maps.normal = map(keyword, rest, line)?,
            "bump" | "map_bump" => self.maps.bump = map(keyword, rest, line)?,
            // Ambient light has no part in light transport.
            "map_ka" | "sharpness" => {}
            _ => return Ok(false),
        }
        Ok(true)
    }
}

/// `r`, or `r g b`; spectra and CIE colours are not supported.
fn color(keyword: &str, rest: &str) -> Result<Option<[f32; 3]>, String> {
    let words: Vec<_> = without_comment(rest).split_whitespace().take(3).collect();
    match words.as_slice() {
        ["spectral" | "xyz", ..] => {
            Err(format!("`{keyword} {}` is not supported, only r g b", shorten(rest)))
        }
        [r] => Ok(Some([number(keyword, r)?; 3])),
        [r, g, b] => Ok(Some([number(keyword, r)?, number(keyword, g)?, number(keyword, b)?])),
        _ => Err(format!("`{keyword}` needs three numbers")),
    }
}

fn number(keyword: &str, rest: &str) -> Result<f32, String> {
    let word = without_comment(rest).split_whitespace().next().unwrap_or_default();
    match word.parse::<f32>() {
        Ok(number) if number.is_finite() => Ok(number),
        _ if word.is_empty() => Err(format!("`{keyword}` needs a number")),
        _ => Err(format!("`{keyword} {}` is no finite number", shorten(word))),
    }
}

/// Options, then the file name to the end of the line.
fn map(keyword: &str, rest: &str, line: usize) -> Result<Option<Map>, String> {
    let mut map = Map {
        file: String::new(),
        line,
        scale: [1.0; 2],
        offset: [0.0; 2],
        strength: 1.0,
        clamp: false,
        channel: None,
    };
    let mut rest = rest;
    while rest.starts_with('-') {
        let (option, mut after) = first_word(rest);
        match option.to_ascii_lowercase().as_str() {
            "-s" => map.scale = vector(&mut after, map.scale),
            "-o" => map.offset = vector(&mut after, map.offset),
            // Turbulence displaces the lookup; in practice it is written for an offset of 0.
            "-t" => _ = vector(&mut after, [0.0; 2]),
            "-mm" => _ = vector(&mut after, [0.0; 2]),
            "-bm" => {
                map.strength = word(&mut after).parse().ok().filter(|s: &f32| s.is_finite()).unwrap_or(1.0)
            }
            "-clamp" => map.clamp = word(&mut after).eq_ignore_ascii_case("on"),
            "-imfchan" => {
                map.channel = match word(&mut after).to_ascii_lowercase().as_str() {
                    "r" | "l" => Some(0),
                    "g" => Some(1),
                    "b" => Some(2),
                    "m" => Some(3),
                    _ => None,
                }
            }
            "-blendu" | "-blendv" | "-cc" | "-type" | "-texres" | "-boost" | "-colorspace" => {
                _ = word(&mut after)
            }
            // Not an option, then: a name that begins with a hyphen.
            _ => break,
        }
        rest = after;
    }
    map.file = rest.trim_matches(['"', ' ', '\t']).to_owned();
    match map.file.as_str() {
        "" => Err(format!("`{keyword}` names no file")),
        _ => Ok(Some(map)),
    }
}

fn first_word(text: &str) -> (&str, &str) {
    let (word, rest) = text.split_once(char::is_whitespace).unwrap_or((text, ""));
    (word, rest.trim_start())
}

/// Takes the first word off `text`.
fn word<'a>(text: &mut &'a str) -> &'a str {
    let (word, rest) = first_word(text);
    *text = rest;
    word
}

/// Takes one to three numbers off `text`; those not given stay as they are. The last word is always the name.
fn vector(text: &mut &str, mut given: [f32; 2]) -> [f32; 2] {
    for i in 0..3 {
        let (word, rest) = first_word(text);
        let Some(number) = word.parse::<f32>().ok().filter(|n| n.is_finite() && !rest.is_empty()) else {
            break;
        };
        if let Some(slot) = given.get_mut(i) {
            *slot = number;
        }
        *text = rest;
    }
    given
}

/// The material called `name`: by its whole name, or by what stands before a comment.
pub(super) fn find<'a>(materials: &'a [Mtl], name: &str) -> Option<&'a Mtl> {
    let short = name_without_comment(name);
    let whole = materials.iter().find(|m| m.name == name);
    whole.or_else(|| materials.iter().find(|m| name_without_comment(&m.name) == short))
}

#[cfg(test)]
mod tests {
    use super::*;

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
    fn options_come_off_the_file_name() {
        let plain = one("map_Kd my picture 2.png").maps.diffuse.expect("a map");
        assert_eq!(plain.file, "my picture 2.png");
        let map = one("map_Kd -blendu on -s 2 3 1 -o .5 -bm 0.3 -clamp on -mm 0 1 -imfchan g \"a b.png\"")
            .maps
            .diffuse;
        let map = map.expect("a map");
        assert_eq!((map.scale, map.offset, map.strength), ([2.0, 3.0], [0.5, 0.0], 0.3));
        assert_eq!((map.clamp, map.channel, map.file.as_str()), (true, Some(1), "a b.png"));
        assert_eq!(one("map_Kd -o 1 2").maps.diffuse.expect("a map").file, "2");
        assert_eq!(one("map_Kd -odd.png").maps.diffuse.expect("a map").file, "-odd.png");
    }

    #[test]
    fn an_odd_line_is_lost_alone_and_said() {
        let text = "Kd 1 1 1\nnewmtl m\nKd 1 2\nKs x 0 0\nNs nan\nKd spectral a.rfl\nmap_Kd -s 1 1 1\nmap_Kd\nKd .1 .2 .3\nglow 3";
        let places: Vec<_> = warnings(text).into_iter().map(|(place, _)| place).collect();
        let lines: Vec<_> = [1, 3, 4, 5, 6, 8].map(Place::Line).into_iter().chain([Place::File]).collect();
        assert_eq!(places, lines);
        assert_eq!(parse(text, Path::new("a.mtl")).0[0].diffuse, Some([0.1, 0.2, 0.3]));
    }

    #[test]
    fn materials_are_found_with_and_without_a_comment() {
        let (all, _) =
            parse("newmtl Material #1\nnewmtl Material #2\nnewmtl red\nnewmtl red", Path::new("a.mtl"));
        assert_eq!(find(&all, "Material #2").map(|m| m.line), Some(2));
        assert_eq!(find(&all, "red # the first").map(|m| m.line), Some(3));
        assert_eq!(find(&all, "blue"), None);
    }
}
