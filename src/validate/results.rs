//! What a validation found, as plain data: `results.json`, and the table that is printed.

use std::fmt::Write;

use serde::Serialize;

use super::Shot;
use crate::{
    compare::{Numbers, report},
    render::{Bounces, Settings},
};

/// What the columns of [`SceneResults::rows`] are.
pub const TABLE_HEAD: &str =
    "scene                image    against     mean   block     p95    FLIP    relMSE\n";

#[derive(Clone, Debug, Serialize)]
pub struct Results {
    pub scenes: Vec<SceneResults>,
}

#[derive(Clone, Debug, Serialize)]
pub struct SceneResults {
    pub name: String,
    pub size: [u32; 2],
    pub bounces: Bounces,
    pub seed: u64,
    pub pictures: Vec<PictureResults>,
    pub pairs: Vec<Pair>,
}

#[derive(Clone, Debug, Serialize)]
pub struct PictureResults {
    /// `rayo`, `blender`, `povray` or `mitsuba`.
    pub renderer: &'static str,
    pub program: String,
    pub samples: u32,
    pub seconds: f64,
    pub noise: Option<f64>,
    pub notes: Vec<String>,
    pub complaints: Vec<String>,
}

/// `image` measured against `reference`, both by the name of the renderer.
#[derive(Clone, Debug, Serialize)]
pub struct Pair {
    pub reference: &'static str,
    pub image: &'static str,
    #[serde(flatten)]
    pub numbers: Numbers,
}

impl SceneResults {
    /// What was measured between pictures of `shots`, this program's and the peers', each pair once.
    pub fn new(name: &str, settings: &Settings, shots: &[Shot], pairs: &[report::Pair]) -> Self {
        let pictures = shots.iter().map(|shot| PictureResults {
            renderer: shot.key(),
            program: shot.program.clone(),
            samples: shot.samples,
            seconds: shot.seconds,
            noise: shot.noise,
            notes: shot.notes.iter().map(ToString::to_string).collect(),
            complaints: shot.complaints.clone(),
        });
        // The later renderer is the reference: this program comes first.
        let once = pairs.iter().filter(|pair| pair.image < pair.reference);
        let pairs = once.filter_map(|pair| {
            let [reference, image] = [shots.get(pair.reference)?, shots.get(pair.image)?].map(Shot::key);
            Some(Pair { reference, image, numbers: pair.comparison.numbers })
        });
        Self {
            name: name.to_owned(),
            size: settings.size,
            bounces: settings.bounces,
            seed: settings.seed,
            pictures: pictures.collect(),
            pairs: pairs.collect(),
        }
    }

    /// This scene's lines of the table, under [`TABLE_HEAD`]: a pair each. A star: an export had to approximate something.
    pub fn rows(&self) -> String {
        let mut table = String::new();
        for pair in &self.pairs {
            let Numbers { metrics: m, ldr_flip, .. } = &pair.numbers;
            let inexact = self
                .pictures
                .iter()
                .any(|p| !p.notes.is_empty() && (p.renderer == pair.reference || p.renderer == pair.image));
            let _ = writeln!(
                table,
                "{:20} {:8} {:8} {:7.4} {:7.4} {:7.4} {:7.4} {:9.1e}{}",
                self.name,
                pair.image,
                pair.reference,
                m.mean_ratio,
                m.block_median,
                m.block_p95,
                ldr_flip,
                m.rel_mse,
                if inexact { "  *" } else { "" },
            );
        }
        table
    }
}
