//! What a piece of an OBJ file says, read without the pieces before it: numbers as they are, indices as far as they can
//! be told, and what a statement sets for the faces after it in the order of the text.

use glam::{Vec2, Vec3};

use super::{
    corner::{self, Corner},
    number::{Word, is_blank, next_float},
    text::{self, shorten_bytes},
};

/// Errors are kept up to this many, then counted.
pub(super) const MAX_ERRORS: usize = 20;

/// Statements of the format's other parts: known, and without meaning here.
const SILENT: [&[u8]; 16] = [
    b"g",
    b"lod",
    b"bevel",
    b"c_interp",
    b"d_interp",
    b"usemap",
    b"maplib",
    b"shadow_obj",
    b"trace_obj",
    b"mg",
    b"vw",
    b"ctech",
    b"stech",
    b"con",
    b"end",
    b"scrv",
];
const FREE_FORM: [&[u8]; 12] = [
    b"cstype", b"deg", b"bmat", b"step", b"curv", b"curv2", b"surf", b"parm", b"trim", b"hole", b"vp", b"sp",
];

const BAD_POSITIONS: &str = "vertices that are infinite or not a number, with their faces";
const BAD_UVS: &str = "texture coordinates (`vt`) that are no finite numbers";
const BAD_NORMALS: &str = "normals (`vn`) that are no finite numbers";

/// A piece, read.
#[derive(Default)]
pub(super) struct Scanned {
    pub lines: usize,
    /// NaN: not finite, with what follows from it.
    pub positions: Vec<Vec3>,
    /// Empty, or one for each position; NaN: none. sRGB.
    pub colors: Vec<Vec3>,
    pub uvs: Vec<Vec2>,
    /// Unit; NaN: none.
    pub normals: Vec<Vec3>,
    pub corners: Vec<Corner>,
    pub faces: Vec<Face>,
    pub settings: Vec<Setting>,
    pub notes: Vec<Note>,
    /// Those of the first errors, with their lines.
    pub errors: Vec<(usize, String)>,
    pub error_count: usize,
}

#[derive(Clone, Copy)]
pub(super) struct Face {
    pub corners: u32,
    pub line: u32,
}

/// What holds from the face of this number on.
pub(super) struct Setting {
    pub face: usize,
    pub line: usize,
    pub set: Set,
}

#[derive(Clone)]
pub(super) enum Set {
    Object(String),
    Material(String),
    /// 0: none.
    Smoothing(u32),
    /// For the whole file.
    Library(String),
}

/// Something passed over that is worth one line at the end, however often it occurs.
#[derive(Clone, Debug)]
pub(super) struct Note {
    pub what: &'static str,
    pub first_line: usize,
    pub count: usize,
    /// A word of the first.
    pub example: String,
}

/// Reads `text`, whose lines end with `line_end`. Lines count from 1 within it.
pub(super) fn scan(text: &[u8], line_end: u8) -> Scanned {
    let mut scanned = Scanned::default();
    let mut joined = Vec::new();
    let mut rest = text;
    while !rest.is_empty() {
        let line = take_line(&mut rest, line_end);
        scanned.lines += 1;
        let number = scanned.lines;
        match line {
            [] | [b'#', ..] => {}
            [open @ .., b'\\'] => {
                joined.clear();
                joined.extend_from_slice(open);
                while !rest.is_empty() {
                    let next = take_line(&mut rest, line_end);
                    scanned.lines += 1;
                    joined.push(b' ');
                    match next {
                        [open @ .., b'\\'] => joined.extend_from_slice(open),
                        _ => {
                            joined.extend_from_slice(next);
                            break;
                        }
                    }
                }
                scanned.statement(joined.trim_ascii(), number);
            }
            _ => scanned.statement(line, number),
        }
    }
    scanned
}

/// Takes the first line off `rest`, without its outer blanks.
#[inline]
fn take_line<'a>(rest: &mut &'a [u8], line_end: u8) -> &'a [u8] {
    let (mut line, after) = match memchr::memchr(line_end, rest) {
        Some(at) => (rest.get(..at).unwrap_or_default(), rest.get(at + 1..).unwrap_or_default()),
        None => (*rest, [].as_slice()),
    };
    *rest = after;
    while let [first, inner @ ..] = line
        && is_blank(*first)
    {
        line = inner;
    }
    while let [inner @ .., last] = line
        && is_blank(*last)
    {
        line = inner;
    }
    line
}

impl Scanned {
    #[inline]
    fn statement(&mut self, statement: &[u8], line: usize) {
        let end = statement.iter().position(|&byte| is_blank(byte)).unwrap_or(statement.len());
        let (keyword, rest) = statement.split_at(end);
        let read = match keyword {
            b"v" => self.position(rest, line),
            b"vt" => {
                self.uv(rest, line);
                Ok(())
            }
            b"vn" => {
                self.normal(rest, line);
                Ok(())
            }
            b"f" => self.face(rest, line),
            _ => self.other(keyword, rest.trim_ascii(), line),
        };
        if let Err(message) = read {
            self.error_count += 1;
            if self.errors.len() < MAX_ERRORS {
                self.errors.push((line, message));
            }
        }
    }

    #[inline]
    fn position(&mut self, mut rest: &[u8], line: usize) -> Result<(), String> {
        let whole = rest;
        let mut finite = true;
        let mut xyz = [0.0; 3];
        for slot in &mut xyz {
            match next_float(&mut rest) {
                Word::Number(number) => *slot = number,
                Word::NotFinite => finite = false,
                Word::Other(word) => {
                    self.positions.push(Vec3::NAN);
                    return Err(format!("`{}` is no number", shorten_bytes(word)));
                }
                Word::None => {
                    self.positions.push(Vec3::NAN);
                    return Err("a vertex needs three numbers".into());
                }
            }
        }
        if !finite {
            self.note(BAD_POSITIONS, line, whole);
        }
        self.positions.push(if finite { xyz.into() } else { Vec3::NAN });
        if !self.colors.is_empty() || !matches!(rest, [] | [b'#', ..]) {
            self.color(rest);
        }
        Ok(())
    }

    /// A fourth number alone is a weight of free-form surfaces; a fifth without a sixth belongs to nothing.
    fn color(&mut self, mut rest: &[u8]) {
        let rgb = [(); 3].map(|()| next_float(&mut rest).number());
        if let [Some(r), Some(g), Some(b)] = rgb {
            self.colors.resize(self.positions.len() - 1, Vec3::NAN);
            self.colors.push(Vec3::new(r, g, b));
        } else if !self.colors.is_empty() {
            self.colors.push(Vec3::NAN);
        }
    }

    /// Where v is left out it is 0; a third coordinate is for volumes.
    #[inline]
    fn uv(&mut self, mut rest: &[u8], line: usize) {
        let whole = rest;
        let u = next_float(&mut rest);
        let v = next_float(&mut rest);
        let uv = match (u, v) {
            (Word::Number(u), Word::Number(v)) => Vec2::new(u, v),
            (Word::Number(u), Word::None) => Vec2::new(u, 0.0),
            _ => {
                self.note(BAD_UVS, line, whole);
                Vec2::NAN
            }
        };
        self.uvs.push(uv);
    }

    #[inline]
    fn normal(&mut self, mut rest: &[u8], line: usize) {
        let whole = rest;
        let xyz = [(); 3].map(|()| next_float(&mut rest).number());
        let normal = match xyz {
            // One without length says nothing: the face has its own.
            [Some(x), Some(y), Some(z)] => unit(Vec3::new(x, y, z)),
            _ => {
                self.note(BAD_NORMALS, line, whole);
                Vec3::NAN
            }
        };
        self.normals.push(normal);
    }

    #[inline]
    fn face(&mut self, mut rest: &[u8], line: usize) -> Result<(), String> {
        let (whole, first) = (rest, self.corners.len());
        let seen = [self.positions.len(), self.uvs.len(), self.normals.len()];
        loop {
            match corner::next(&mut rest, &seen) {
                Ok(Some(corner)) => self.corners.push(corner),
                Ok(None) => break,
                Err(message) => {
                    self.corners.truncate(first);
                    return Err(message);
                }
            }
        }
        let count = self.corners.len() - first;
        if count < 3 {
            self.corners.truncate(first);
            self.note("faces of fewer than three corners", line, whole);
        } else {
            self.faces.push(Face { corners: count as u32, line: line as u32 });
        }
        Ok(())
    }

    #[cold]
    fn other(&mut self, keyword: &[u8], rest: &[u8], line: usize) -> Result<(), String> {
        let set = match keyword {
            b"o" => Set::Object(text::name(rest)),
            b"usemtl" => Set::Material(text::name(rest)),
            b"s" => Set::Smoothing(smoothing(rest)),
            b"mtllib" => Set::Library(text::name(rest)),
            b"fo" => return self.face(rest, line),
            _ => {
                match keyword {
                    _ if SILENT.contains(&keyword) => {}
                    b"l" | b"p" => {
                        self.note("lines and points (`l`, `p`), which have no surface", line, keyword)
                    }
                    b"call" | b"csh" => self.note("other files and commands (`call`, `csh`)", line, rest),
                    _ if FREE_FORM.contains(&keyword) => {
                        self.note("statements of free-form curves and surfaces", line, keyword)
                    }
                    _ => self.note("statements that are not OBJ", line, keyword),
                }
                return Ok(());
            }
        };
        self.settings.push(Setting { face: self.faces.len(), line, set });
        Ok(())
    }

    #[cold]
    fn note(&mut self, what: &'static str, line: usize, example: &[u8]) {
        match self.notes.iter_mut().find(|note| note.what == what) {
            Some(note) => note.count += 1,
            None => {
                let example = shorten_bytes(example.trim_ascii());
                self.notes.push(Note { what, first_line: line, count: 1, example });
            }
        }
    }
}

/// NaN where it has no direction.
#[inline]
fn unit(v: Vec3) -> Vec3 {
    let length = v.length();
    if (1e-18..1e18).contains(&length) {
        v / length
    } else {
        v.as_dvec3().try_normalize().map_or(Vec3::NAN, |v| v.as_vec3())
    }
}

/// `off`, `0` and what some programs write for them: none. A group that is no number is still a group.
fn smoothing(rest: &[u8]) -> u32 {
    let group = text::name(rest);
    match text::name_without_comment(&group) {
        "off" | "null" | "none" => 0,
        group => group.parse().unwrap_or(1),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Scanned {
        scan(text.as_bytes(), b'\n')
    }

    #[test]
    fn settings_hold_from_the_next_face_on() {
        let s =
            read("o a\nf 1 2 3\nusemtl b c # d\n s 4 # e\nf 1 2 3\ns off\n s 0\n s null\ns smooth\nmtllib x");
        let told = s.settings.iter().map(|Setting { face, line, set }| match set {
            Set::Object(name) | Set::Material(name) | Set::Library(name) => (*face, *line, name.clone()),
            Set::Smoothing(group) => (*face, *line, group.to_string()),
        });
        let told: Vec<_> = told.collect();
        let expected = [
            (0, 1, "a"),
            (1, 3, "b c # d"),
            (1, 4, "4"),
            (2, 6, "0"),
            (2, 7, "0"),
            (2, 8, "0"),
            (2, 9, "1"),
            (2, 10, "x"),
        ];
        assert_eq!(told, expected.map(|(face, line, name)| (face, line, name.to_owned())));
    }

    #[test]
    fn continued_statements_are_one_and_lines_still_count() {
        let s = read("f 1 \\\n 2\\\r\n  3\nv 1 2 3\n# C:\\\nv x 0 0\nf 1 2 3 \\");
        assert_eq!((s.corners.len(), s.positions.len(), s.lines), (6, 2, 7));
        assert_eq!(s.faces.iter().map(|f| (f.corners, f.line)).collect::<Vec<_>>(), [(3, 1), (3, 7)]);
        assert_eq!(s.errors, [(6, "`x` is no number".to_owned())]);
    }

    #[test]
    fn weights_are_dropped_and_colors_kept_with_their_vertices() {
        let s = read("v 0 0 0 2\nv 1 0 0 0.5 0.25 0\nv 0 1 0\nv 0 0 1 1 1 # 1");
        assert_eq!((s.positions.len(), s.colors.len()), (4, 4));
        assert_eq!(s.colors[1], Vec3::new(0.5, 0.25, 0.0));
        assert!([0, 2, 3].iter().all(|&i: &usize| s.colors[i].is_nan()));
        assert!(read("v 0 0 0 1\nv 0 0 0 1").colors.is_empty());
    }

    #[test]
    fn what_is_passed_over_is_counted_once_for_each_kind() {
        let s = read(
            "l 1 2\nl 2 3\np 1\nf 1 2\nwibble\nvt nan 0\nvn 0 inf 0\nv 0 1e99 0\ng x\ncall a.obj\nsurf 1",
        );
        let said: Vec<_> = s.notes.iter().map(|note| (note.first_line, note.count)).collect();
        assert_eq!(said, [(1, 3), (4, 1), (5, 1), (6, 1), (7, 1), (8, 1), (10, 1), (11, 1)]);
        assert!(s.errors.is_empty());
        assert!(s.positions[0].is_nan() && s.uvs[0].is_nan() && s.normals[0].is_nan());
    }

    #[test]
    fn normals_are_made_unit_and_those_without_length_are_none() {
        let s = read("vn 0 0 -2\nvn 0 0 0\nvn 0 1e-30 0\nvn 1e30 0 0");
        assert_eq!((s.normals[0], s.normals[2], s.normals[3]), (Vec3::NEG_Z, Vec3::Y, Vec3::X));
        assert!(s.normals[1].is_nan() && s.notes.is_empty());
    }

    #[test]
    fn errors_are_counted_beyond_the_first() {
        let s = read(&"v x\nf 0 1 2\n".repeat(100));
        assert_eq!((s.errors.len(), s.error_count), (MAX_ERRORS, 200));
    }
}
