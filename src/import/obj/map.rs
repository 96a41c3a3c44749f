//! What names a texture in a material library: options, then a file name to the end of the line, or the other way round.

/// A texture with those of its options that are honoured.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Map {
    pub file: String,
    pub line: usize,
    /// `-s`, u and v.
    pub scale: [f32; 2],
    /// `-o`, u and v.
    pub offset: [f32; 2],
    /// `-bm`: strength of a normal map.
    pub strength: f32,
    /// `-clamp on`.
    pub clamp: bool,
    /// `-imfchan`.
    pub channel: Option<u8>,
}

/// Options and the file name, in either order.
pub(super) fn map(keyword: &str, rest: &str, line: usize) -> Result<Option<Map>, String> {
    let mut map = Map {
        file: String::new(),
        line,
        scale: [1.0; 2],
        offset: [0.0; 2],
        strength: 1.0,
        clamp: false,
        channel: None,
    };
    let rest = map.options(rest, true);
    // Some programs write options after the name.
    let option = |(at, _): &(usize, &str)| {
        let (option, after) = first_word(rest.get(at + 1..).unwrap_or_default());
        !after.is_empty() && Map::is_option(option)
    };
    let (name, after) = match rest.match_indices(" -").find(option) {
        Some((at, _)) if at > 0 => rest.split_at(at),
        _ => (rest, ""),
    };
    map.options(after.trim_start(), false);
    map.file = name.trim_matches(['"', ' ', '\t']).to_owned();
    match map.file.as_str() {
        "" => Err(format!("`{keyword}` names no file")),
        _ => Ok(Some(map)),
    }
}

impl Map {
    /// Takes options off the beginning of `rest`, whose last word is the file's where it is `named`.
    fn options<'a>(&mut self, mut rest: &'a str, named: bool) -> &'a str {
        while rest.starts_with('-') {
            let (option, mut after) = first_word(rest);
            match option.to_ascii_lowercase().as_str() {
                "-s" => self.scale = vector(&mut after, self.scale, named),
                "-o" => self.offset = vector(&mut after, self.offset, named),
                // Turbulence displaces the lookup; in practice it is written for an offset of 0.
                "-t" => _ = vector(&mut after, [0.0; 2], named),
                "-mm" => _ = vector(&mut after, [0.0; 2], named),
                "-bm" => {
                    let strength = word(&mut after).parse().ok();
                    self.strength = strength.filter(|s: &f32| s.is_finite()).unwrap_or(1.0);
                }
                "-clamp" => self.clamp = word(&mut after).eq_ignore_ascii_case("on"),
                "-imfchan" => {
                    self.channel = match word(&mut after).to_ascii_lowercase().as_str() {
                        "r" => Some(0),
                        "g" => Some(1),
                        "b" => Some(2),
                        "m" => Some(3),
                        _ => None,
                    }
                }
                option if OPTIONS_IGNORED.contains(&option) => _ = word(&mut after),
                // Not an option, then: a name that begins with a hyphen.
                _ => break,
            }
            rest = after;
        }
        rest
    }

    pub fn is_option(word: &str) -> bool {
        let word = word.to_ascii_lowercase();
        ["-s", "-o", "-t", "-mm", "-bm", "-clamp", "-imfchan"].contains(&word.as_str())
            || OPTIONS_IGNORED.contains(&word.as_str())
    }
}

/// Those with one value and without effect here.
pub(super) const OPTIONS_IGNORED: [&str; 7] =
    ["-blendu", "-blendv", "-cc", "-type", "-texres", "-boost", "-colorspace"];

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

/// Takes one to three numbers off `text`; those not given stay as they are. The last word is left where it is the
/// file's name.
fn vector(text: &mut &str, mut given: [f32; 2], named: bool) -> [f32; 2] {
    for i in 0..3 {
        let (word, rest) = first_word(text);
        let Some(number) = word.parse::<f32>().ok().filter(|n| n.is_finite() && !(named && rest.is_empty()))
        else {
            break;
        };
        if let Some(slot) = given.get_mut(i) {
            *slot = number;
        }
        *text = rest;
    }
    given
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(rest: &str) -> Map {
        map("map_Kd", rest, 1).ok().flatten().expect("a map")
    }

    #[test]
    fn options_come_off_the_file_name() {
        let plain = read("my picture 2.png");
        assert_eq!(plain.file, "my picture 2.png");
        let map = read("-blendu on -s 2 3 1 -o .5 -bm 0.3 -clamp on -mm 0 1 -imfchan g \"a b.png\"");
        assert_eq!((map.scale, map.offset, map.strength), ([2.0, 3.0], [0.5, 0.0], 0.3));
        assert_eq!((map.clamp, map.channel, map.file.as_str()), (true, Some(1), "a b.png"));
        assert_eq!(read("-o 1 2").file, "2");
        assert_eq!(read("-odd.png").file, "-odd.png");
        assert_eq!(read("a -b.png").file, "a -b.png");
        let last = read("-clamp on x y.png -bm 1.5 -s 2 2 2");
        assert_eq!(
            (last.file.as_str(), last.strength, last.scale, last.clamp),
            ("x y.png", 1.5, [2.0; 2], true)
        );
        let last = read("q.png -s 2 3 -o 0.5");
        assert_eq!((last.file.as_str(), last.scale, last.offset), ("q.png", [2.0, 3.0], [0.5, 0.0]));
        assert_eq!((read("q.png -o 0 .5").offset, read("-o 1 2 3").file.as_str()), ([0.0, 0.5], "3"));
    }
}
