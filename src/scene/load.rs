//! From a file's text to a [`ValidScene`], and the JSON Schema of such texts.

use std::{ops::Range, path::Path, sync::Arc};

use schemars::generate::SchemaSettings;
use toml::{
    Spanned,
    de::{DeTable, DeValue},
};

use super::{ValidScene, context::Context, document::Document};
use crate::{
    diagnostic::{Diagnostic, Place},
    input,
};

/// A scene file may have this many bytes: its syntax tree takes some fifty times as much memory.
pub const LARGEST_FILE: u64 = 16 << 20;

/// In a file of more bytes than this only the first error of syntax is told: a list of millions would fill the memory.
const LARGEST_RECOVERED: usize = 1 << 20;

/// Reads the scene file at `path`, or all that is wrong with it.
pub fn load(path: &Path) -> Result<ValidScene, Vec<Diagnostic>> {
    let bytes = input::read(path, LARGEST_FILE).map_err(|why| {
        vec![Diagnostic::error(path, Place::File, format!("cannot read this scene file: {why}"))]
    })?;
    let text = String::from_utf8(bytes).map_err(|error| {
        let line =
            error.as_bytes()[..error.utf8_error().valid_up_to()].iter().filter(|&&b| b == b'\n').count() + 1;
        let message = "the scene file is not text in UTF-8";
        vec![Diagnostic::error(path, Place::Line(line), message).help("a scene file is written in TOML")]
    })?;
    parse(&text, path)
}

/// Reads a scene file's `text`. `path` is where file names in it start from, and its name in messages.
pub fn parse(text: &str, path: &Path) -> Result<ValidScene, Vec<Diagnostic>> {
    let text: Arc<str> = text.into();
    let mut remains = String::new();
    let (syntax_errors, document) = parse_toml(&text, &mut remains, path);
    let partial = !syntax_errors.is_empty();
    let mut cx = Context::new(path, &text, partial);
    let scene = document.and_then(|document| Document::read_scene(&document, &mut cx));
    let (mut errors, warnings) = cx.finish();
    errors.splice(0..0, syntax_errors);
    errors.sort_by_key(|error| match &error.place {
        Place::Span { range, .. } => range.start,
        _ => 0,
    });
    match scene {
        Some(scene) if errors.is_empty() => Ok(ValidScene { warnings, ..scene }),
        _ => {
            debug_assert!(!errors.is_empty(), "a scene that cannot be read has an error");
            Err(errors)
        }
    }
}

/// What is wrong with the syntax, and the document: `None` where it cannot be made out. Where single lines are wrong
/// the document is the rest of the file, so that what is wrong there can be told too. `remains` keeps its text.
fn parse_toml<'t>(
    text: &'t Arc<str>,
    remains: &'t mut String,
    path: &Path,
) -> (Vec<Diagnostic>, Option<Spanned<DeValue<'t>>>) {
    let whole = |table: Spanned<DeTable<'t>>| Some(Spanned::new(0..0, DeValue::Table(table.into_inner())));
    let (table, mut errors) = match text.len() {
        0..=LARGEST_RECOVERED => DeTable::parse_recoverable(text),
        _ => match DeTable::parse(text) {
            Ok(table) => (table, Vec::new()),
            Err(error) => (Spanned::new(0..0, DeTable::new()), vec![error]),
        },
    };
    if errors.is_empty() {
        return (Vec::new(), whole(table));
    }
    errors.sort_by_key(|error| error.span().map_or(0, |span| span.start));
    // What follows on the same line is mostly a consequence.
    let mut lines: Vec<Range<usize>> = Vec::new();
    let mut diagnostics = Vec::new();
    let mut within_array = false;
    for error in &errors {
        let range = error.span().unwrap_or(0..0);
        let line = line_at(text, range.start);
        if lines.last().is_none_or(|last| last.start < line.start) {
            // An array that is not closed takes all that follows for its elements: told once.
            let comma = error.message().starts_with("missing comma between array elements");
            let follows = lines.last().is_some_and(|last| text[last.end..line.start].trim().is_empty());
            if !(comma && within_array && follows) {
                let at = range.start;
                let place = Place::Span { source: text.clone(), range };
                let told = Diagnostic::error(path, place, syntax_message(text, at, error.message()));
                let help = "or an array above is not closed: look for a missing `]`";
                diagnostics.push(if comma { told.help(help) } else { told });
            }
            within_array = comma;
            lines.push(line);
        }
    }
    // Without a header the lines below it would be taken for those of the table above.
    if text.len() > LARGEST_RECOVERED
        || lines.iter().any(|line| text[line.clone()].trim_start().starts_with('['))
    {
        return (diagnostics, None);
    }
    let mut bytes = text.as_bytes().to_vec();
    lines.iter().for_each(|line| bytes[line.clone()].fill(b' '));
    *remains = String::from_utf8(bytes).unwrap_or_default();
    let (table, errors) = DeTable::parse_recoverable(remains);
    (diagnostics, if errors.is_empty() { whole(table) } else { None })
}

/// The parser's message, or a better one for the commonest slips.
fn syntax_message<'m>(text: &str, at: usize, message: &'m str) -> &'m str {
    let rest = text.get(at..).and_then(|rest| rest.lines().next()).unwrap_or_default().trim_start();
    if message.starts_with("string values must be quoted") && (rest.is_empty() || rest.starts_with('#')) {
        "there is no value; a colour in hexadecimal is written in quotes"
    } else if message.starts_with("string values must be quoted") || message.starts_with("invalid boolean") {
        "this is not a value; strings are written in quotes"
    } else {
        message.strip_suffix(", expected nothing").unwrap_or(message)
    }
}

/// The line of `text` that holds the byte `at`, without its end.
fn line_at(text: &str, at: usize) -> Range<usize> {
    let at = (0..=at.min(text.len())).rev().find(|&at| text.is_char_boundary(at)).unwrap_or(0);
    let start = text[..at].rfind('\n').map_or(0, |newline| newline + 1);
    let end = text[at..].find('\n').map_or(text.len(), |newline| at + newline);
    start..end
}

/// The JSON Schema of scene files (draft 7, which editors' TOML plugins understand best).
pub fn schema() -> serde_json::Value {
    let mut schema = SchemaSettings::draft07().into_generator().into_root_schema_for::<Document>();
    schema.insert("title".into(), "rayo scene file".into());
    schema.to_value()
}
