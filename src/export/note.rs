//! What an export says differently from the scene.

use std::fmt::{self, Display, Write};

#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Kind {
    /// It is there, and what it is there is near to what it is here.
    Approximated,
    /// It is not there.
    Dropped,
}

/// One way in which the other program's picture will differ.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Note {
    pub kind: Kind,
    /// What it happened to, such as "material `gold`"; none where it concerns the whole scene.
    pub subjects: Vec<String>,
    /// What was done instead, with the formula.
    pub text: String,
}

/// Subjects printed before the rest is counted.
const NAMED: usize = 6;

impl Display for Note {
    /// Without a plus sign (`{:+}`) only the first subjects are named.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self.kind {
            Kind::Approximated => "approximated: ",
            Kind::Dropped => "dropped: ",
        })?;
        if !self.subjects.is_empty() {
            let named = if f.sign_plus() { self.subjects.len() } else { self.subjects.len().min(NAMED) };
            f.write_str(&self.subjects[..named].join(", "))?;
            match self.subjects.len() - named {
                0 => f.write_str(": ")?,
                more => write!(f, " and {more} more: ")?,
            }
        }
        f.write_str(&self.text)
    }
}

/// Notes as they come up; what is said of several subjects is said once.
#[derive(Debug, Default)]
pub struct Notes(Vec<Note>);

impl Notes {
    pub fn approximated(&mut self, subject: impl Into<String>, text: impl Into<String>) {
        self.add(Kind::Approximated, subject.into(), text.into());
    }

    pub fn dropped(&mut self, subject: impl Into<String>, text: impl Into<String>) {
        self.add(Kind::Dropped, subject.into(), text.into());
    }

    /// An empty `subject` is the whole scene.
    fn add(&mut self, kind: Kind, subject: String, text: String) {
        let known = self.0.iter_mut().find(|note| note.kind == kind && note.text == text);
        let subjects = match known {
            Some(note) => &mut note.subjects,
            None => {
                self.0.push(Note { kind, subjects: Vec::new(), text });
                let Some(note) = self.0.last_mut() else { return };
                &mut note.subjects
            }
        };
        // Names come from files, and go to terminals.
        let subject: String = subject
            .chars()
            .flat_map(|c| if c.is_control() { c.escape_default().collect() } else { vec![c] })
            .collect();
        if !subject.is_empty() && !subjects.contains(&subject) {
            subjects.push(subject);
        }
    }

    /// What was dropped comes last, where it is read.
    pub fn finish(mut self) -> Vec<Note> {
        self.0.sort_by_key(|note| note.kind);
        self.0
    }
}

/// `NOTES.md` of an export.
pub fn page(target: &str, command: &str, notes: &[Note]) -> String {
    let mut page = format!("# For {target}, by rayo {}\n\n    {command}\n\n", env!("CARGO_PKG_VERSION"));
    if notes.is_empty() {
        page.push_str("Nothing in the scene had to be approximated or dropped.\n");
    }
    for note in notes {
        let _ = writeln!(page, "- {note:+}");
    }
    page
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_same_note_gathers_its_subjects() {
        let mut notes = Notes::default();
        notes.dropped("", "the crop");
        for i in 0..9 {
            notes.approximated(format!("material `m{}`", i / 2), "no fuzz there");
        }
        let notes = notes.finish();
        assert_eq!(notes.len(), 2);
        assert_eq!(
            notes[0].to_string(),
            "approximated: material `m0`, material `m1`, material `m2`, material `m3`, material `m4`: no fuzz there"
        );
        assert_eq!(notes[1].to_string(), "dropped: the crop");
        let many = Note { subjects: (0..9).map(|i| i.to_string()).collect(), ..notes[0].clone() };
        assert!(many.to_string().contains("5 and 3 more: "));
        assert!(page("POV-Ray", "povray", &[many]).contains("7, 8: "), "the page names all");
    }
}
