//! What was found wrong or set aside while one glTF file is read.
//!
//! Errors and warnings carry a JSON pointer (RFC 6901) into the document. What happens per triangle or per vertex is
//! counted and reported once. However broken a file is, the report stays short: past [`MAX_LISTED`] of a kind only their
//! number is kept.

use std::{
    collections::{BTreeMap, BTreeSet},
    path::{Path, PathBuf},
};

use super::conformance::Findings;
use crate::diagnostic::{Diagnostic, Place, nearest};

/// Errors, and warnings, that are listed one by one; the rest are only counted.
const MAX_LISTED: usize = 100;
/// Characters of a name or URI from the file that a message quotes.
const MAX_QUOTED: usize = 80;

/// One thing that is wrong, at `pointer` (empty: the file as a whole).
#[derive(Clone, Debug)]
pub struct Problem {
    pub pointer: String,
    pub message: String,
    pub help: Option<String>,
}

impl Problem {
    pub fn new(pointer: impl Into<String>, message: impl Into<String>) -> Self {
        Self { pointer: pointer.into(), message: message.into(), help: None }
    }

    pub fn help(mut self, help: impl Into<String>) -> Self {
        self.help = Some(help.into());
        self
    }
}

/// Things that are counted, not listed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Counted {
    NonFiniteTriangles,
    IncompleteTriangles,
    BadNormals,
    BadTangents,
    NonFiniteUvs,
    BadColors,
    Points,
    Lines,
    SingularNodes,
    SingularInstances,
    RepeatedNodes,
    WeightlessVertices,
    MissingUvs,
    NoData,
}

impl Counted {
    fn message(self, n: u64) -> String {
        match self {
            Self::NonFiniteTriangles => {
                format!("{n} triangle(s) with positions that are not finite are left out")
            }
            Self::IncompleteTriangles => {
                format!("{n} primitive(s) end in an incomplete triangle, which is left out")
            }
            Self::BadNormals => format!(
                "{n} normal(s) of zero length or not finite are replaced by those of the triangles around"
            ),
            Self::BadTangents => format!("{n} tangent(s) of zero length or not finite are replaced"),
            Self::NonFiniteUvs => format!("{n} texture coordinate(s) that are not finite are taken as 0"),
            Self::BadColors => format!("{n} vertex colour(s) outside 0 to 1 are clamped"),
            Self::Points => format!("{n} primitive(s) of points are not rendered"),
            Self::Lines => format!("{n} primitive(s) of lines are not rendered"),
            Self::SingularNodes => format!(
                "{n} node(s) have a transform that is singular or not finite; what they hold is left out"
            ),
            Self::SingularInstances => {
                format!("{n} instance(s) have a transform that is singular or not finite and are left out")
            }
            Self::RepeatedNodes => {
                format!("{n} node(s) are listed more than once in the scene and are placed once")
            }
            Self::WeightlessVertices => {
                format!("{n} skinned vertices have no weight and follow the first joint of their skin")
            }
            Self::NoData => format!(
                "{n} primitive(s) have no data in this file (compressed, or a buffer without uri) and are left out"
            ),
            Self::MissingUvs => format!(
                "{n} primitive(s) have a textured material but not the texture coordinates it asks for"
            ),
        }
    }
}

/// How often each [`Counted`] happened, and where first.
#[derive(Clone, Debug, Default)]
pub struct Tally(BTreeMap<Counted, (u64, String)>);

impl Tally {
    pub fn add(&mut self, what: Counted, n: usize, pointer: &str) {
        if n > 0 {
            self.0.entry(what).or_insert_with(|| (0, pointer.to_owned())).0 += n as u64;
        }
    }

    pub fn merge(&mut self, other: &Self) {
        for (&what, (n, pointer)) in &other.0 {
            self.add(what, *n as usize, pointer);
        }
    }
}

/// Collects what is wrong with one file.
#[derive(Clone)]
pub struct Report {
    file: PathBuf,
    errors: Vec<Diagnostic>,
    more_errors: usize,
    warnings: Vec<Diagnostic>,
    more_warnings: usize,
    pub tally: Tally,
    /// What the specification forbids, told unless an error or warning is about the same.
    pub findings: Findings,
}

impl Report {
    pub fn new(file: &Path) -> Self {
        Self {
            file: file.to_owned(),
            errors: Vec::new(),
            more_errors: 0,
            warnings: Vec::new(),
            more_warnings: 0,
            tally: Tally::default(),
            findings: Findings::default(),
        }
    }

    pub fn error(&mut self, problem: Problem) {
        if self.errors.len() < MAX_LISTED {
            let (place, message, help) = parts(problem);
            self.errors.push(Diagnostic { help, ..Diagnostic::error(&self.file, place, message) });
        } else {
            self.more_errors += 1;
        }
    }

    /// An error at a line of the text, before there is a document to point into.
    pub fn error_at_line(&mut self, line: usize, message: String) {
        self.errors.push(Diagnostic::error(&self.file, Place::Line(line), message));
    }

    pub fn warn(&mut self, problem: Problem) {
        if self.warnings.len() < MAX_LISTED {
            let (place, message, help) = parts(problem);
            self.warnings.push(Diagnostic { help, ..Diagnostic::warning(&self.file, place, message) });
        } else {
            self.more_warnings += 1;
        }
    }

    /// Where errors and warnings are.
    fn pointers(&self) -> BTreeSet<String> {
        let places = self.errors.iter().chain(&self.warnings).map(|diagnostic| &diagnostic.place);
        let pointers = places.filter_map(|place| match place {
            Place::Pointer(pointer) => Some(pointer.clone()),
            _ => None,
        });
        pointers.collect()
    }

    /// `None` once there is an error: the stages of the import stop there.
    pub fn checkpoint(&self) -> Option<()> {
        self.errors.is_empty().then_some(())
    }

    /// `Ok` with all warnings, or `Err` with errors and warnings.
    pub fn finish(mut self) -> Result<Vec<Diagnostic>, Vec<Diagnostic>> {
        let told = self.pointers();
        for problem in std::mem::take(&mut self.findings).problems(|pointer| is_told(&told, pointer)) {
            self.warn(problem);
        }
        for (what, (n, first)) in std::mem::take(&mut self.tally.0) {
            self.warn(Problem::new(first, what.message(n)));
        }
        if self.more_warnings > 0 {
            let message = format!("{} more warnings of this file are not listed", self.more_warnings);
            self.warnings.push(Diagnostic::warning(&self.file, Place::File, message));
        }
        if self.more_errors > 0 {
            let message = format!("{} more errors of this file are not listed", self.more_errors);
            self.errors.push(Diagnostic::error(&self.file, Place::File, message));
        }
        if self.errors.is_empty() {
            return Ok(self.warnings);
        }
        self.errors.append(&mut self.warnings);
        Err(self.errors)
    }
}

/// Whether something was said of the place `pointer`, of what holds it, or of what is in it. What is said of a whole section
/// is on something else than one of its elements.
fn is_told(told: &BTreeSet<String>, pointer: &str) -> bool {
    if told.contains(pointer) {
        return true;
    }
    let inner = format!("{pointer}/");
    let slashes: Vec<usize> = pointer.match_indices('/').map(|(at, _)| at).collect();
    let is_inside = || told.range(inner.clone()..).next().is_some_and(|other| other.starts_with(&inner));
    let is_around = |&end: &usize| pointer.get(..end).is_some_and(|outer| told.contains(outer));
    slashes.len() > 1 && (is_inside() || slashes.iter().skip(2).any(is_around))
}

fn parts(problem: Problem) -> (Place, String, Option<String>) {
    let is_predicate = ["is ", "has ", "asks ", "does "].iter().any(|verb| problem.message.starts_with(verb));
    let message = match is_predicate {
        true => format!("{} {}", subject(&problem.pointer), problem.message),
        false => problem.message,
    };
    let place = if problem.pointer.is_empty() { Place::File } else { Place::Pointer(problem.pointer) };
    (place, message, problem.help)
}

/// The end of a pointer as the subject of a sentence: "`roughnessFactor`", "`nodes` 3".
fn subject(pointer: &str) -> String {
    let mut parts = pointer.rsplit('/');
    match (parts.next().unwrap_or_default(), parts.next().unwrap_or_default()) {
        ("", _) => "the file".into(),
        (index, list) if index.bytes().all(|b| b.is_ascii_digit()) => format!("`{list}` {index}"),
        (key, _) => format!("`{key}`"),
    }
}

/// Which of `names` is `wanted`, by its name or its number. `what` they are, and where the list is.
pub fn choose<'n>(
    wanted: &str,
    what: &str,
    pointer: &str,
    names: impl ExactSizeIterator<Item = Option<&'n str>> + Clone,
) -> Result<usize, Problem> {
    if let Some(index) = names.clone().position(|name| name == Some(wanted)) {
        return Ok(index);
    }
    let count = names.len();
    if let Some(index) = wanted.parse().ok().filter(|&index| index < count) {
        return Ok(index);
    }
    let problem = Problem::new("", format!("has no {what} called {}", quoted(wanted)));
    let help = match (nearest(wanted, names.clone().flatten()), count) {
        (Some(near), _) => format!("did you mean `{near}`?"),
        (None, 0) => format!("there is no {what} in it"),
        (None, _) => {
            let label = |(i, name): (usize, Option<&str>)| name.map_or_else(|| format!("number {i}"), quoted);
            let some: Vec<_> = names.enumerate().take(20).map(label).collect();
            format!("there are {}; numbers from 0 will do, too", some.join(", "))
        }
    };
    Err(Problem { pointer: if count == 0 { String::new() } else { pointer.into() }, ..problem }.help(help))
}

/// `text` in quotes, shortened: a message never repeats a megabyte of the file, nor its control characters.
pub fn quoted(text: &str) -> String {
    let mut shown: String = text.chars().take(MAX_QUOTED).flat_map(char::escape_debug).collect();
    if text.chars().nth(MAX_QUOTED).is_some() {
        shown.push('…');
    }
    format!("\"{shown}\"")
}
