//! Reference pictures, and beside each how it was made.

use std::path::Path;

use serde::{Deserialize, Serialize};

use super::Shot;
use crate::{
    color::Picture,
    output::{self, Depth, Facts},
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

    /// Writes `stem.exr` (half float) and `stem.json`.
    pub fn write(&self, stem: &Path, picture: &Picture, seed: u64) -> Result<(), output::Error> {
        let (exr, json) = (stem.with_added_extension("exr"), stem.with_added_extension("json"));
        let facts = Facts {
            samples_per_pixel: self.samples as f32,
            noise: self.residual_noise.map(|noise| noise as f32),
            seed,
            size: self.size,
            origin: [0; 2],
        };
        let settings = output::Settings { file: exr.clone(), depth: Depth::Low, ..Default::default() };
        let encoded = output::encode(picture, None, &settings, &facts)?;
        output::write_file(&exr, &encoded.bytes)?;
        let text = serde_json::to_string_pretty(self).unwrap_or_default() + "\n";
        output::write_file(&json, text.as_bytes())
    }
}
