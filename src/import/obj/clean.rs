//! The text of an OBJ file made safe for `tobj`.
//!
//! `tobj` reads numbers and faces well, but files in the wild trip it up (comments within lines, `l` lines, two names
//! after `mtllib`) and some of what they say it drops (smoothing groups) or makes up (a corner without texture
//! coordinates gets those of the corner before it). So the text is rewritten in a form without such choices:
//!
//! - only `v`, `vt`, `vn`, `f` and `o` statements, all points before all faces, numbers known to be readable;
//! - every corner is `v/vt/vn` with absolute indices known to exist. What a corner does not have is index 1, which
//!   holds NaN: the one value that no good file gives, and the mark of "missing" from here on;
//! - what `tobj` has no place for (material, smoothing group) is kept beside the text, one [`Face`] each.

use std::{
    collections::HashMap,
    fmt::{Display, Write},
    path::Path,
};

use super::{
    corner::{self, Counts},
    text::{name_without_comment, shorten, statements, without_comment},
};
use crate::diagnostic::{Diagnostic, Place};

/// Errors are reported up to this many, then counted.
const MAX_ERRORS: usize = 20;
/// A file with more objects than this becomes one mesh: each mesh costs a tree and an instance.
const MAX_OBJECTS: usize = 1000;

/// Statements of the format's other parts: known, and without meaning here.
const SILENT: [&str; 13] = [
    "g",
    "lod",
    "bevel",
    "c_interp",
    "d_interp",
    "usemap",
    "maplib",
    "shadow_obj",
    "trace_obj",
    "mg",
    "vw",
    "ctech",
    "stech",
];
const FREE_FORM: [&str; 12] =
    ["cstype", "deg", "bmat", "step", "curv", "curv2", "surf", "parm", "trim", "hole", "vp", "sp"];

#[derive(Debug, Default)]
pub(super) struct Clean {
    points: String,
    polygons: String,
    /// In the order of the text.
    pub faces: Vec<Face>,
    /// The names of the objects that hold faces, in the order of the text; an empty name: none was given.
    pub objects: Vec<String>,
    /// Names after `usemtl`, each once.
    pub materials: Vec<String>,
    /// What follows each `mtllib`, with its line.
    pub libraries: Vec<(usize, String)>,
    pub warnings: Vec<Diagnostic>,
}

/// What a face says beside its corners.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Face {
    /// Into [`Clean::materials`].
    pub material: Option<u32>,
    /// 0: flat.
    pub smoothing: u32,
}

impl Clean {
    /// The cleaned text.
    pub fn reader(&self) -> impl std::io::BufRead {
        std::io::Read::chain(self.points.as_bytes(), self.polygons.as_bytes())
    }
}

pub(super) fn clean(text: &str, file: &Path) -> Result<Clean, Vec<Diagnostic>> {
    let (mut all, mut objects, mut colored) = (Counts::default(), 0, false);
    statements(text, |s| match s.keyword {
        "v" => {
            all.v += 1;
            colored |= without_comment(s.rest).split_whitespace().nth(5).is_some();
        }
        "vt" => all.vt += 1,
        "vn" => all.vn += 1,
        "o" => objects += 1,
        _ => {}
    });
    let mut pass = Pass { all, colored, split: objects <= MAX_OBJECTS, ..Pass::default() };
    pass.out.points.push_str("vt nan nan\nvn nan nan nan\n");
    statements(text, |s| {
        if let Err(message) = pass.statement(s.keyword, s.rest, s.line) {
            pass.errors += 1;
            if pass.errors <= MAX_ERRORS {
                pass.diagnostics.push(Diagnostic::error(file, Place::Line(s.line), message));
            }
        }
    });
    pass.finish(file)
}

#[derive(Default)]
struct Pass {
    all: Counts,
    seen: Counts,
    colored: bool,
    split: bool,
    out: Clean,
    material_ids: HashMap<String, u32>,
    face: Option<Face>,
    /// The name of an object that has no face yet.
    new_object: Option<String>,
    notes: Vec<Note>,
    errors: usize,
    diagnostics: Vec<Diagnostic>,
}

/// Something passed over that is worth one line at the end, however often it occurs.
struct Note {
    what: &'static str,
    first_line: usize,
    count: usize,
    /// A word of the first.
    example: String,
}

impl Pass {
    fn statement(&mut self, keyword: &str, rest: &str, line: usize) -> Result<(), String> {
        match keyword {
            "v" => self.position(rest)?,
            "vt" => {
                self.seen.vt += 1;
                // Where v is left out it is 0; a third coordinate is for volumes.
                let mut numbers = numbers(rest);
                let [u, v] = [numbers.next(), numbers.next().or(Some(Some("0")))];
                match (u.flatten(), v.flatten()) {
                    (Some(u), Some(v)) => push(&mut self.out.points, format_args!("vt {u} {v}\n")),
                    _ => {
                        self.note("texture coordinates (`vt`) that are no finite numbers", line, rest);
                        self.out.points.push_str("vt nan nan\n");
                    }
                }
            }
            "vn" => {
                self.seen.vn += 1;
                let mut numbers = numbers(rest);
                match [(); 3].map(|()| numbers.next().flatten()) {
                    [Some(x), Some(y), Some(z)] => {
                        push(&mut self.out.points, format_args!("vn {x} {y} {z}\n"))
                    }
                    _ => {
                        self.note("normals (`vn`) that are no finite numbers", line, rest);
                        self.out.points.push_str("vn nan nan nan\n");
                    }
                }
            }
            "f" | "fo" => self.polygon(rest, line)?,
            "o" if self.split => self.new_object = Some(rest.to_owned()),
            "o" => {}
            "usemtl" => {
                let next = self.out.materials.len() as u32;
                let id = *self.material_ids.entry(rest.to_owned()).or_insert(next);
                if id == next {
                    self.out.materials.push(rest.to_owned());
                }
                self.current().material = Some(id);
            }
            "s" => {
                let group = name_without_comment(rest);
                // A group that is no number is still a group.
                self.current().smoothing = if group == "off" { 0 } else { group.parse().unwrap_or(1) };
            }
            "mtllib" => self.out.libraries.push((line, rest.to_owned())),
            "l" | "p" => self.note("lines and points (`l`, `p`), which have no surface", line, keyword),
            _ if SILENT.contains(&keyword) => {}
            _ if FREE_FORM.contains(&keyword) => {
                self.note("statements of free-form curves and surfaces", line, keyword)
            }
            "con" | "end" | "scrv" => {}
            _ => self.note("statements that are not OBJ", line, keyword),
        }
        Ok(())
    }

    fn position(&mut self, rest: &str) -> Result<(), String> {
        self.seen.v += 1;
        let mut words = without_comment(rest).split_whitespace();
        let xyz = [(); 3].map(|()| words.next().unwrap_or_default());
        if let Some(bad) = xyz.iter().find(|word| word.parse::<f32>().is_err()) {
            return Err(match bad {
                &"" => "a vertex needs three numbers".into(),
                word => format!("`{}` is no number", shorten(word)),
            });
        }
        let [x, y, z] = match xyz.map(finite) {
            [Some(x), Some(y), Some(z)] => [x, y, z],
            _ => ["nan"; 3], // The faces that use it are counted where they are left out.
        };
        push(&mut self.out.points, format_args!("v {x} {y} {z}"));
        if self.colored {
            // A fourth number alone is a weight of free-form surfaces.
            let rgb = [(); 3].map(|()| words.next().and_then(finite));
            let [r, g, b] = if let [Some(r), Some(g), Some(b)] = rgb { [r, g, b] } else { ["1"; 3] };
            push(&mut self.out.points, format_args!(" {r} {g} {b}"));
        }
        self.out.points.push('\n');
        Ok(())
    }

    fn polygon(&mut self, rest: &str, line: usize) -> Result<(), String> {
        let corners =
            without_comment(rest).split_whitespace().map(|word| corner::read(word, self.seen, self.all));
        let corners = corners.collect::<Result<Vec<_>, _>>()?;
        if corners.len() < 3 {
            self.note("faces of fewer than three corners", line, rest);
            return Ok(());
        }
        if self.out.objects.is_empty() || self.new_object.is_some() {
            self.out.objects.push(self.new_object.take().unwrap_or_default());
            self.out.polygons.push_str("o\n");
        }
        self.out.polygons.push('f');
        for [v, vt, vn] in corners {
            push(&mut self.out.polygons, format_args!(" {v}/{vt}/{vn}"));
        }
        self.out.polygons.push('\n');
        let face = *self.current();
        self.out.faces.push(face);
        Ok(())
    }

    fn current(&mut self) -> &mut Face {
        self.face.get_or_insert(Face { material: None, smoothing: 0 })
    }

    fn note(&mut self, what: &'static str, line: usize, example: &str) {
        match self.notes.iter_mut().find(|note| note.what == what) {
            Some(note) => note.count += 1,
            None => {
                let example = shorten(example);
                self.notes.push(Note { what, first_line: line, count: 1, example })
            }
        }
    }

    fn finish(mut self, file: &Path) -> Result<Clean, Vec<Diagnostic>> {
        if self.errors > MAX_ERRORS {
            let more = self.errors - MAX_ERRORS;
            let message = format!("and {more} more errors in this file");
            self.diagnostics.push(Diagnostic::error(file, Place::File, message));
        }
        let notes = self.notes.into_iter().map(|note| {
            let Note { what, first_line, count, example } = note;
            let message = format!("{count} passed over: {what}; the first is `{example}`");
            Diagnostic::warning(file, Place::Line(first_line), message)
        });
        self.out.warnings.extend(notes);
        if self.diagnostics.is_empty() && self.out.faces.is_empty() {
            let message = if self.all.v == 0 {
                "this is no OBJ file: it holds neither vertices nor faces"
            } else {
                "there is nothing to render: the file holds no faces"
            };
            let help = "export a mesh of polygons (`v` and `f` statements)";
            self.diagnostics.push(Diagnostic::error(file, Place::File, message).help(help));
        }
        if self.diagnostics.is_empty() {
            return Ok(self.out);
        }
        self.diagnostics.append(&mut self.out.warnings);
        Err(self.diagnostics)
    }
}

/// The words of a statement; `None` for one that is no finite number.
fn numbers(rest: &str) -> impl Iterator<Item = Option<&str>> {
    without_comment(rest).split_whitespace().map(finite)
}

fn finite(word: &str) -> Option<&str> {
    word.parse::<f32>().is_ok_and(f32::is_finite).then_some(word)
}

fn push(text: &mut String, words: impl Display) {
    let _ = write!(text, "{words}"); // Writing to a `String` does not fail.
}

#[cfg(test)]
mod tests {
    use std::io::Read;

    use super::*;

    const TRIANGLE: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";

    fn ok(text: &str) -> Clean {
        clean(text, Path::new("a.obj")).unwrap_or_else(|e| panic!("{e:?}"))
    }

    fn lines(clean: &Clean) -> Vec<String> {
        let mut text = String::new();
        clean.reader().read_to_string(&mut text).expect("it is text");
        text.lines().map(str::to_owned).collect()
    }

    fn errors(text: &str) -> Vec<(Place, String)> {
        let all = clean(text, Path::new("a.obj")).expect_err("it is wrong");
        all.into_iter().map(|d| (d.place, d.message)).collect()
    }

    #[test]
    fn corners_become_absolute_and_complete() {
        let c = ok(&format!("{TRIANGLE}vt 0 0\nvn 0 0 1\nf -3/-1 -2//1 3\nf 1/1/1 2/1/1 3/1/1 # rest"));
        assert_eq!(
            lines(&c)[2..],
            [
                "v 0 0 0",
                "v 1 0 0",
                "v 0 1 0",
                "vt 0 0",
                "vn 0 0 1",
                "o",
                "f 1/2/1 2/1/2 3/1/1",
                "f 1/2/2 2/2/2 3/2/2"
            ]
        );
    }

    #[test]
    fn faces_may_precede_their_vertices() {
        assert_eq!(ok(&format!("f 1 2 3\n{TRIANGLE}")).faces.len(), 1);
    }

    #[test]
    fn material_and_smoothing_group_stay_with_the_face() {
        let c = ok(&format!(
            "{TRIANGLE}f 1 2 3\nusemtl a b\ns 4\nf 1 2 3\nusemtl c\ns off\nf 1 2 3\nusemtl a b\nf 1 2 3"
        ));
        assert_eq!(c.materials, ["a b", "c"]);
        let kept: Vec<_> = c.faces.iter().map(|f| (f.material, f.smoothing)).collect();
        assert_eq!(kept, [(None, 0), (Some(0), 4), (Some(1), 0), (Some(0), 0)]);
    }

    #[test]
    fn only_objects_with_faces_count_and_too_many_become_one() {
        assert_eq!(ok(&format!("o empty\no a\n{TRIANGLE}f 1 2 3\no b\nf 1 2 3")).objects, ["a", "b"]);
        let many: String = (0..=MAX_OBJECTS).map(|i| format!("o {i}\nf 1 2 3\n")).collect();
        assert_eq!(ok(&format!("{TRIANGLE}{many}")).objects, [""]);
    }

    #[test]
    fn every_error_has_its_line() {
        let found = errors(&format!(
            "{TRIANGLE}v 1 x 2\nv 1 2\nf 1 2 9\nf 1 2 0\nf -9 1 2\nf 1/1 2 3\nf 1/2/3/4 2 3\nf /1 2 3"
        ));
        let said: Vec<_> = found.iter().map(|(place, message)| (place, message.as_str())).collect();
        assert_eq!(
            said,
            [
                (&Place::Line(4), "`x` is no number"),
                (&Place::Line(5), "a vertex needs three numbers"),
                (&Place::Line(6), "vertex 9 does not exist: the file has 5"),
                (&Place::Line(7), "a vertex of index 0: OBJ counts from 1"),
                (&Place::Line(8), "vertex -9 does not exist: 5 precede this face"),
                (&Place::Line(9), "texture coordinate 1 does not exist: the file has 0"),
                (&Place::Line(10), "`1/2/3/4` is no corner: at most v/vt/vn"),
                (&Place::Line(11), "a corner without a vertex"),
            ]
        );
        assert_eq!(errors(&"v x\n".repeat(100)).len(), MAX_ERRORS + 1);
    }

    #[test]
    fn files_without_faces_say_so() {
        assert!(errors("")[0].1.contains("no OBJ"));
        assert!(errors("Dear reader,\nthis is a letter.")[0].1.contains("no OBJ"));
        assert!(errors(TRIANGLE)[0].1.contains("no faces"));
    }

    #[test]
    fn what_is_passed_over_is_counted_once_for_each_kind() {
        let c = ok(&format!("{TRIANGLE}l 1 2\nl 2 3\np 1\nf 1 2\nwibble\nvt nan 0\nvn 0 inf 0\nf 1 2 3"));
        let said: Vec<_> = c.warnings.iter().map(|w| (&w.place, w.message.split(':').next())).collect();
        assert_eq!(
            said,
            [
                (&Place::Line(4), Some("3 passed over")),
                (&Place::Line(7), Some("1 passed over")),
                (&Place::Line(8), Some("1 passed over")),
                (&Place::Line(9), Some("1 passed over")),
                (&Place::Line(10), Some("1 passed over")),
            ]
        );
    }

    #[test]
    fn weights_are_dropped_and_colors_completed() {
        let c = ok("v 0 0 0 2\nv 1 0 0 0.5 0.25 0\nv 0 1 nan\nf 1 2 3");
        assert_eq!(lines(&c)[2..5], ["v 0 0 0 1 1 1", "v 1 0 0 0.5 0.25 0", "v nan nan nan 1 1 1"]);
        assert_eq!(lines(&ok("v 0 0 0 2\nv 1 0 0 2\nv 0 1 0 2\nf 1 2 3"))[2], "v 0 0 0");
    }
}
