//! What is wrong with a user's file, where, and what to do about it.
//!
//! Loaders return `Result<T, Vec<Diagnostic>>`: all that is wrong, not the first thing. Warnings travel beside
//! the result. Printing them is [`render()`]'s business alone.

use std::{ops::Range, path::PathBuf, sync::Arc};

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
}

pub fn render(diagnostics: &[Diagnostic], _color: bool) -> String {
    diagnostics.iter().map(|d| format!("error: {}: {}\n", d.file.display(), d.message)).collect()
}
