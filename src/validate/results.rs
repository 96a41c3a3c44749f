//! What a validation found, as plain data: `results.json`, and the table that is printed.

use std::fmt::Write;

use serde::Serialize;

use super::Shot;
use crate::compare::{self, Numbers, SizeMismatch};

#[derive(Clone, Debug, Serialize)]
pub struct Results {
    pub scenes: Vec<SceneResults>,
}

#[derive(Clone, Debug, Serialize)]
pub struct SceneResults {
    pub name: String,
    pub size: [u32; 2],
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
    /// Measures every pair of pictures: this program's against each peer's, and the peers' among themselves.
    pub fn measure(name: &str, size: [u32; 2], shots: &[Shot]) -> Result<Self, SizeMismatch> {
        let mut pairs = Vec::new();
        for (i, image) in shots.iter().enumerate() {
            for reference in &shots[i + 1..] {
                let numbers = compare::compare(&reference.picture, &image.picture)?.numbers;
                pairs.push(Pair { reference: reference.key(), image: image.key(), numbers });
            }
        }
        let pictures = shots.iter().map(|shot| PictureResults {
            renderer: shot.key(),
            program: shot.program.clone(),
            samples: shot.samples,
            seconds: shot.seconds,
            noise: shot.noise,
            notes: shot.notes.iter().map(ToString::to_string).collect(),
            complaints: shot.complaints.clone(),
        });
        Ok(Self { name: name.to_owned(), size, pictures: pictures.collect(), pairs })
    }

    /// The rows of this scene in the table: a pair each.
    fn rows(&self, table: &mut String) {
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
    }
}

impl Results {
    /// For a terminal. A star: an export had to approximate something.
    pub fn table(&self) -> String {
        let mut table = format!(
            "{:20} {:8} {:8} {:>7} {:>7} {:>7} {:>7} {:>9}\n",
            "scene", "image", "against", "mean", "block", "p95", "FLIP", "relMSE"
        );
        self.scenes.iter().for_each(|scene| scene.rows(&mut table));
        if table.contains("  *\n") {
            table.push_str("* something had to be approximated or dropped: see the report\n");
        }
        table
    }
}
