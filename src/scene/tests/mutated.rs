use std::path::Path;

use proptest::{prelude::*, test_runner::FileFailurePersistence};

use super::{FILE, GOOD};
use crate::{diagnostic::render, scene::parse};

/// What is put in where the good scene is cut.
const PIECES: &[&str] = &[
    "",
    "\n",
    "[",
    "]",
    "[[",
    "{",
    "}",
    "\"",
    "'",
    "=",
    ",",
    "#",
    "-",
    ".",
    "0",
    "1e999",
    "-1",
    "nan",
    "inf",
    "true",
    "\0",
    "é",
    "\u{feff}",
    "[camera]\n",
    "[[sphere]]\n",
    "type = \"metal\"\n",
    "\"x\"",
    "[1, 2, 3]",
    "{ a = 1 }",
    "1979-05-27",
];

proptest! {
    #![proptest_config(ProptestConfig {
        cases: 500,
        failure_persistence: Some(Box::new(FileFailurePersistence::Off)),
        ..ProptestConfig::default()
    })]

    /// Whatever a file says: a scene or diagnostics that can be shown, and no panic.
    #[test]
    fn mutations_of_a_good_scene(edits in prop::collection::vec((0.0..1.0f64, 0usize..24, 0..PIECES.len()), 1..4)) {
        let mut chars: Vec<char> = GOOD.chars().collect();
        for (at, removed, piece) in edits {
            let at = (at * chars.len() as f64) as usize;
            let end = (at + removed).min(chars.len());
            chars.splice(at..end, PIECES[piece].chars());
        }
        let text: String = chars.into_iter().collect();
        match parse(&text, Path::new(FILE)) {
            Ok(scene) => prop_assert!(scene.spheres.iter().all(|sphere| sphere.radius > 0.0)),
            Err(errors) => prop_assert!(!errors.is_empty() && !render(&errors, false).is_empty()),
        }
    }
}
