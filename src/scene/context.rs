//! What is known while a scene file is read, and what was found wrong so far.

use std::{
    collections::BTreeMap,
    ops::Range,
    path::{Path, PathBuf},
    sync::Arc,
};

use super::ImageSource;
use crate::{
    diagnostic::{Diagnostic, PRINTED, Place, Severity, nearest, quote},
    world::MaterialId,
};

/// Findings kept; those of a hostile file beyond it are dropped.
const KEPT: usize = 10_000;

pub(super) struct Context {
    file: PathBuf,
    text: Arc<str>,
    /// The names under `[materials]`, known before anything that refers to them is read.
    pub materials: BTreeMap<String, MaterialId>,
    /// Images that materials use, each once.
    pub images: Vec<ImageSource>,
    found: Vec<Diagnostic>,
    /// The file has errors of syntax: what seems to be absent may be among what could not be read.
    partial: bool,
    /// The key whose value is being read, for messages.
    pub key: String,
}

impl Context {
    pub fn new(file: &Path, text: &Arc<str>, partial: bool) -> Self {
        Self {
            file: file.to_owned(),
            text: text.clone(),
            materials: BTreeMap::new(),
            images: Vec::new(),
            found: Vec::new(),
            partial,
            key: String::new(),
        }
    }

    pub fn file(&self) -> &Path {
        &self.file
    }

    /// Relative file names start here.
    pub fn folder(&self) -> &Path {
        self.file.parent().unwrap_or(Path::new(""))
    }

    pub fn place(&self, range: Range<usize>) -> Place {
        Place::Span { source: self.text.clone(), range }
    }

    pub fn error(&mut self, range: Range<usize>, message: impl Into<String>) -> Finding<'_> {
        let place = self.place(range);
        self.find(Diagnostic::error(&self.file, place, message))
    }

    pub fn warn(&mut self, range: Range<usize>, message: impl Into<String>) -> Finding<'_> {
        let place = self.place(range);
        self.find(Diagnostic::warning(&self.file, place, message))
    }

    /// An error that something is not there; not to be trusted where the file could not be read whole.
    pub fn absent(&mut self, range: Range<usize>, message: impl Into<String>) -> Finding<'_> {
        if self.partial { Finding(None) } else { self.error(range, message) }
    }

    /// The value under the current key is not what it must be.
    pub fn must(&mut self, range: Range<usize>, expected: &str, found: &str) -> Finding<'_> {
        let message = format!("`{}` must be {expected}, not {found}", self.key);
        self.error(range, message)
    }

    /// Reads something that is part of the value of `key`.
    pub fn under<T>(&mut self, key: &str, read: impl FnOnce(&mut Self) -> T) -> T {
        let outer = std::mem::replace(&mut self.key, key.to_owned());
        let value = read(self);
        self.key = outer;
        value
    }

    /// The material called `name`, or an error at `range`.
    pub fn material(&mut self, name: &str, range: Range<usize>) -> Option<MaterialId> {
        let id = self.materials.get(name).copied();
        if id.is_none() {
            let help = self.suggest(name, |cx| cx.materials.keys().map(String::as_str).collect());
            let help = help.unwrap_or_else(|| format!("write a table [materials.{name}] with its `type`"));
            self.absent(range, format!("no material is called {}", quote(name))).help(help);
        }
        id
    }

    /// "did you mean", while there is still someone to read it.
    pub fn suggest<'a>(
        &'a self,
        name: &str,
        candidates: impl FnOnce(&'a Self) -> Vec<&'a str>,
    ) -> Option<String> {
        if self.found.len() > PRINTED {
            return None;
        }
        nearest(name, candidates(self)).map(|near| format!("did you mean `{near}`?"))
    }

    /// Errors, or else warnings, in the order of the file.
    pub fn finish(mut self) -> (Vec<Diagnostic>, Vec<Diagnostic>) {
        self.found.sort_by_key(|d| match &d.place {
            Place::Span { range, .. } => (range.start, range.end),
            _ => (0, 0),
        });
        self.found.into_iter().partition(|d| d.severity == Severity::Error)
    }

    fn find(&mut self, diagnostic: Diagnostic) -> Finding<'_> {
        if self.found.len() < KEPT {
            self.found.push(diagnostic);
            Finding(self.found.last_mut())
        } else {
            Finding(None)
        }
    }
}

/// What was just found, to add help to.
pub(super) struct Finding<'a>(Option<&'a mut Diagnostic>);

impl Finding<'_> {
    pub fn help(self, help: impl Into<String>) {
        if let Some(diagnostic) = self.0 {
            diagnostic.help = Some(help.into());
        }
    }
}
