//! Reference pictures, and beside each how it was made.

use std::path::Path;

use serde::{Deserialize, Serialize};

use super::Shot;
use crate::{
    output,
    render::{Bounces, Settings},
};

/// What stands beside a reference picture, as JSON.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Manifest {
    /// Program and version.
    pub program: String,
    /// What made the picture from which scene.
    pub made_by: String,
    pub size: [u32; 2],
    pub samples: u32,
    pub bounces: Bounces,
    /// See [`Shot::noise`].
    pub residual_noise: Option<f64>,
    /// What the export could not express exactly.
    pub notes: Vec<String>,
}

impl Manifest {
    pub fn new(shot: &Shot, settings: &Settings, made_by: String) -> Self {
        Self {
            program: shot.program.clone(),
            made_by,
            size: settings.size,
            samples: shot.samples,
            bounces: settings.bounces,
            // Two digits say what there is to say, and stay the same when nothing has changed.
            residual_noise: shot.noise.map(|noise| format!("{noise:.1e}").parse().unwrap_or(noise)),
            notes: shot.notes.iter().map(ToString::to_string).collect(),
        }
    }

    /// Writes it to `stem.json`.
    pub fn write(&self, stem: &Path) -> Result<(), output::Error> {
        let text = serde_json::to_string_pretty(self).unwrap_or_default() + "\n";
        output::write_file(&stem.with_added_extension("json"), text.as_bytes())
    }
}
