//! What is wrong with a user's file, where, and what to do about it.
//!
//! Loaders return `Result<T, Vec<Diagnostic>>`: all that is wrong, not the first thing. Warnings travel beside
//! the result. Printing them is [`render()`]'s business alone.

use std::{borrow::Cow, ops::Range, path::PathBuf, sync::Arc};

use annotate_snippets::{AnnotationKind, Group, Level, Origin, Renderer, Snippet};

/// No more than this many errors, and as many warnings, are printed; the rest are counted.
pub const PRINTED: usize = 50;

/// A source line longer than this is named by its number only.
const LONGEST_LINE: usize = 4096;

/// A message longer than this is cut: it quotes something that no one typed.
const LONGEST_MESSAGE: usize = 1000;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Severity {
    Error,
    Warning,
}

/// Where in a file something is wrong.
#[derive(Clone, Debug, PartialEq)]
pub enum Place {
    /// The file as a whole (missing, unreadable, not of its kind).
    File,
    /// A byte range of a text file whose whole text is kept for the message.
    Span { source: Arc<str>, range: Range<usize> },
    /// A line of a text file, counted from 1.
    Line(usize),
    /// A JSON pointer (RFC 6901) into a glTF document, such as `/meshes/0/primitives/1`.
    Pointer(String),
}

/// One thing that is wrong: `message` says what, `place` where, `help` what to do.
#[derive(Clone, Debug, PartialEq)]
pub struct Diagnostic {
    pub severity: Severity,
    pub file: PathBuf,
    pub place: Place,
    pub message: String,
    pub help: Option<String>,
}

impl Diagnostic {
    pub fn error(file: impl Into<PathBuf>, place: Place, message: impl Into<String>) -> Self {
        Self { severity: Severity::Error, file: file.into(), place, message: message.into(), help: None }
    }

    pub fn warning(file: impl Into<PathBuf>, place: Place, message: impl Into<String>) -> Self {
        Self { severity: Severity::Warning, ..Self::error(file, place, message) }
    }

    /// Adds the line that says what to do.
    pub fn help(mut self, help: impl Into<String>) -> Self {
        self.help = Some(help.into());
        self
    }

    /// Where it is: the file, with the line or the JSON pointer.
    pub fn place(&self) -> String {
        let file = self.file.display();
        match &self.place {
            Place::File => file.to_string(),
            Place::Line(line) => format!("{file}:{line}"),
            Place::Pointer(pointer) => format!("{file}#{pointer}"),
            Place::Span { source, range } => {
                let (line, column) = line_and_column(source, range.start);
                format!("{file}:{line}:{column}")
            }
        }
    }
}

/// `name` in backquotes for a message, cut where it is absurdly long.
pub fn quote(name: &str) -> String {
    const LONGEST: usize = 80;
    match name.char_indices().nth(LONGEST) {
        Some((end, _)) => format!("`{}…`", &name[..end]),
        None => format!("`{name}`"),
    }
}

/// The candidate that `name` was most likely meant to be.
pub fn nearest<'a>(name: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    const LONGEST: usize = 64;
    const CANDIDATES: usize = 1000;
    if name.len() > LONGEST {
        return None;
    }
    let lower = name.to_lowercase();
    candidates
        .into_iter()
        .take(CANDIDATES)
        .filter(|candidate| candidate.len() <= LONGEST)
        .map(|candidate| {
            let other = candidate.to_lowercase();
            (strsim::damerau_levenshtein(&lower, &other), strsim::jaro_winkler(&lower, &other), candidate)
        })
        .filter(|(edits, likeness, candidate)| {
            *edits <= (candidate.chars().count() / 3).max(1) && *likeness > 0.5 || *likeness > 0.88
        })
        .min_by(|a, b| a.0.cmp(&b.0).then(b.1.total_cmp(&a.1)))
        .map(|(_, _, candidate)| candidate)
}

/// Line and column (in characters), both counted from 1, of a byte of `text`.
pub fn line_and_column(text: &str, byte: usize) -> (usize, usize) {
    let before = text.as_bytes().get(..byte).unwrap_or(text.as_bytes());
    let start = before.iter().rposition(|&b| b == b'\n').map_or(0, |newline| newline + 1);
    let line = before.iter().filter(|&&b| b == b'\n').count() + 1;
    // Bytes of the form 10xxxxxx continue a character.
    let column = before[start..].iter().filter(|&&b| b & 0xC0 != 0x80).count() + 1;
    (line, column)
}

/// All of `diagnostics` for people: `file:line:column`, the source line with a caret, and what to do. Errors come
/// first. Nothing that a file or a file name holds can steer the terminal.
pub fn render(diagnostics: &[Diagnostic], color: bool) -> String {
    let renderer = if color { Renderer::styled() } else { Renderer::plain() };
    let mut text = String::new();
    for severity in [Severity::Error, Severity::Warning] {
        let of_kind = || diagnostics.iter().filter(|d| d.severity == severity);
        for diagnostic in of_kind().take(PRINTED) {
            text += &render_one(diagnostic, &renderer);
            text += "\n\n";
        }
        match (of_kind().count().saturating_sub(PRINTED), severity) {
            (0, _) => {}
            (more, Severity::Error) => text += &format!("and {more} more errors\n"),
            (more, Severity::Warning) => text += &format!("and {more} more warnings\n"),
        }
    }
    text
}

fn render_one(diagnostic: &Diagnostic, renderer: &Renderer) -> String {
    let file = one_line(&diagnostic.file.to_string_lossy()).into_owned();
    let mut message = one_line(&diagnostic.message).into_owned();
    let mut column = None;
    let (line, pointer) = match &diagnostic.place {
        Place::File => (None, None),
        Place::Line(line) => (Some(*line), None),
        Place::Pointer(pointer) => (None, Some(one_line(pointer))),
        Place::Span { source, range } => {
            let (line, character) = line_and_column(source, range.start);
            column = Some(character);
            (Some(line), None)
        }
    };
    if let Some((end, _)) = message.char_indices().nth(LONGEST_MESSAGE) {
        message.truncate(end);
        message.push('…');
    }
    let level = match diagnostic.severity {
        Severity::Error => Level::ERROR,
        Severity::Warning => Level::WARNING,
    };
    let quoted = match &diagnostic.place {
        Place::Span { source, range } => SourceLine::around(source, range),
        _ => None,
    };
    let title = level.primary_title(message);
    let mut group: Group = match (&quoted, line) {
        (Some(quoted), Some(line)) => title.element(
            Snippet::source(quoted.text.as_str())
                .path(file)
                .line_start(line)
                .annotation(AnnotationKind::Primary.span(quoted.marked.clone())),
        ),
        _ => {
            let path = match pointer {
                Some(pointer) => format!("{file}#{pointer}"),
                None => file,
            };
            let mut origin = Origin::path(path);
            if let Some(line) = line {
                origin = origin.line(line);
            }
            if let Some(column) = column {
                origin = origin.char_column(column);
            }
            title.element(origin)
        }
    };
    if let Some(help) = &diagnostic.help {
        group = group.element(Level::HELP.message(one_line(help).into_owned()));
    }
    renderer.render(&[group])
}

/// The line on which a span begins, made fit for a terminal.
struct SourceLine {
    text: String,
    /// The part of `text` under which the caret stands.
    marked: Range<usize>,
}

impl SourceLine {
    fn around(source: &str, range: &Range<usize>) -> Option<Self> {
        let start = source.get(..range.start)?.rfind('\n').map_or(0, |newline| newline + 1);
        let line = source.get(start..)?.lines().next().unwrap_or("");
        if line.len() > LONGEST_LINE {
            return None;
        }
        let first = (range.start - start).min(line.len());
        let last = range.end.saturating_sub(start).clamp(first, line.len());
        let mut text = harmless(line.get(..first)?).into_owned();
        let from = text.len();
        text += &harmless(line.get(first..last)?);
        let marked = from..text.len();
        text += &harmless(line.get(last..)?);
        Some(Self { text, marked })
    }
}

/// Control characters, and those that reorder text, replaced one for one. Tabs are left: the renderer expands them.
fn harmless(text: &str) -> Cow<'_, str> {
    let harmful = |c: char| {
        c.is_control() && c != '\t'
            || matches!(c, '\u{200b}'..='\u{200f}' | '\u{202a}'..='\u{202e}' | '\u{2060}'..='\u{2069}' | '\u{feff}')
    };
    if text.contains(harmful) { text.replace(harmful, "\u{fffd}").into() } else { text.into() }
}

/// As [`harmless`], without line breaks and tabs: for titles, paths and help.
fn one_line(text: &str) -> Cow<'_, str> {
    match harmless(text) {
        text if text.contains('\t') => text.replace('\t', " ").into(),
        text => text,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn span(source: &str, range: Range<usize>) -> Place {
        Place::Span { source: source.into(), range }
    }

    #[test]
    fn every_place_is_shown() {
        let shown = |place| render(&[Diagnostic::error("a/b.glb", place, "is wrong").help("do this")], false);
        assert!(shown(Place::File).contains("a/b.glb\n"));
        assert!(shown(Place::Line(7)).contains("a/b.glb:7\n"));
        assert!(shown(Place::Pointer("/meshes/0".into())).contains("a/b.glb#/meshes/0\n"));
        let text = shown(span("x = 1\ny = «ü» # z\n", 12..14));
        assert!(text.contains("a/b.glb:2:6\n") && text.contains("2 | y = «ü» # z\n  |      ^\n"), "{text}");
        assert!(text.starts_with("error: is wrong\n") && text.contains("help: do this"), "{text}");
    }

    /// Places that are not in the text at all, or within a character, are shown somehow.
    #[test]
    fn odd_places() {
        for range in [0..0, 5..6, 6..6, 100..200, Range { start: 3, end: 1 }, 2..3] {
            for text in ["", "x = ü\n", "\r\n\r\n", "\t\u{9b}\u{301}x"] {
                assert!(
                    render(&[Diagnostic::error("f", span(text, range.clone()), "m")], true).contains('m')
                );
            }
        }
        let long = "x".repeat(100_000);
        let text = render(&[Diagnostic::error("f", span(&long, 50_000..50_001), long.clone())], false);
        assert!(text.len() < 2000 && text.contains("f:1:50001"), "{}", text.len());
    }

    #[test]
    fn errors_come_first_and_are_counted() {
        let all: Vec<_> = (0..PRINTED + 7)
            .map(|i| Diagnostic::error("f", Place::Line(i + 1), "wrong"))
            .chain([Diagnostic::warning("f", Place::File, "odd")])
            .rev()
            .collect();
        let text = render(&all, false);
        assert_eq!(text.matches("error: wrong").count(), PRINTED);
        assert!(text.contains("and 7 more errors\n") && text.trim_end().ends_with('f'), "{text}");
    }

    #[test]
    fn what_was_meant() {
        let known = ["samples", "size", "seed", "crop"];
        for (name, meant) in [
            ("sampels", Some("samples")),
            ("Samples", Some("samples")),
            ("sede", Some("seed")),
            ("siz", Some("size")),
            ("aperture", None),
            ("", None),
        ] {
            assert_eq!(nearest(name, known), meant, "{name}");
        }
    }
}
