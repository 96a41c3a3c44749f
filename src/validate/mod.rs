//! One scene, rendered here and by other renderers, as pictures that can be compared.
//!
//! Every renderer that draws random numbers makes two pictures with half the samples and different seeds: their mean is
//! the picture, and what they differ by is its noise, measured in the same way for all. Nothing else is told apart so
//! easily from a difference that matters.

mod manifest;
mod peer;
mod results;

use std::{
    fs,
    path::{Path, PathBuf},
    time::{Duration, Instant},
};

pub use manifest::Manifest;
pub use peer::{Missing, Peer, Run, Task};
pub use results::{Pair, PictureResults, Results, SceneResults, TABLE_HEAD};

use crate::{
    color::Picture,
    compare::{self, metrics},
    compile::compile,
    export::{self, Note, Options, Target},
    output::{self, Depth, Facts},
    render::{self, FilterKind, Monitor, PixelFilter},
    world::World,
};

/// A scene to be rendered by all.
#[derive(Debug)]
pub struct Subject<'a> {
    pub world: &'a World,
    /// As [`neutral`] leaves them.
    pub settings: &'a render::Settings,
    /// Exports and pictures go here.
    pub folder: &'a Path,
    /// For each run of another renderer.
    pub limit: Duration,
}

/// A renderer's picture of a scene, and how it came about.
#[derive(Clone, Debug)]
pub struct Shot {
    /// `None` is this program.
    pub target: Option<Target>,
    /// Program and version.
    pub program: String,
    pub picture: Picture,
    /// Per pixel; POV-Ray's are a grid.
    pub samples: u32,
    /// Root of the relMSE that the picture owes to noise; `None` where the program draws no random numbers.
    pub noise: Option<f64>,
    /// Wall clock of all runs; whole processes for peers, rendering alone for this program.
    pub seconds: f64,
    /// What the export could not express exactly.
    pub notes: Vec<Note>,
    /// Warnings that the program printed.
    pub complaints: Vec<String>,
}

impl Shot {
    /// Writes the picture as EXR.
    pub fn save(&self, file: &Path, depth: Depth, settings: &render::Settings) -> Result<(), output::Error> {
        let facts = Facts {
            samples_per_pixel: self.samples as f32,
            noise: self.noise.map(|noise| noise as f32),
            seed: settings.seed,
            size: settings.size,
            origin: [0; 2],
        };
        let exr = output::Settings { file: file.to_owned(), depth, ..Default::default() };
        output::write_file(file, &output::encode(&self.picture, None, &exr, &facts)?.bytes)
    }

    /// The renderer, as it is called in commands and file names.
    pub fn key(&self) -> &'static str {
        self.target.map_or("rayo", Target::key)
    }

    /// The renderer, as people call it.
    pub fn name(&self) -> &'static str {
        self.target.map_or("rayo", Target::name)
    }
}

#[derive(Debug, thiserror::Error)]
pub enum Error {
    #[error(transparent)]
    Export(#[from] export::Error),
    #[error(transparent)]
    Peer(#[from] peer::Error),
    #[error(transparent)]
    Render(#[from] render::Error),
    #[error("{file} cannot be compared: {problem}")]
    Picture { file: PathBuf, problem: String },
    #[error("{0}")]
    Size(#[from] compare::SizeMismatch),
    #[error("{folder} cannot be used: {problem}")]
    Folder { folder: PathBuf, problem: std::io::Error },
}

/// The settings under which renderers can be compared: a box filter of one pixel, which all have, every sample asked
/// for in every pixel, the whole picture, an even number of samples.
pub fn neutral(settings: &render::Settings) -> render::Settings {
    render::Settings {
        crop: None,
        noise: 0.0,
        time: None,
        samples: settings.samples.next_multiple_of(2),
        adaptive: false,
        filter: PixelFilter { kind: FilterKind::Box, width: 1.0 },
        ..settings.clone()
    }
}

/// Renders here.
pub fn own_shot(world: World, settings: &render::Settings) -> Result<Shot, Error> {
    let settings = &render::Settings { samples: settings.samples / 2, ..settings.clone() };
    let mut scene = compile(world, settings);
    let start = Instant::now();
    let mut half = |seed: u64| {
        let settings = render::Settings { seed, ..settings.clone() };
        scene.seed = seed;
        render::render(&scene, &settings, &Monitor::default()).map(|rendering| Picture::of(&rendering.film))
    };
    let seed = settings.seed;
    let (picture, noise) = blend(half(seed)?, half(seed.wrapping_add(1))?)?;
    Ok(Shot {
        target: None,
        program: format!("rayo {}", env!("CARGO_PKG_VERSION")),
        picture,
        samples: settings.samples,
        noise: Some(noise),
        seconds: start.elapsed().as_secs_f64(),
        notes: Vec::new(),
        complaints: Vec::new(),
    })
}

/// Exports to `peer` and has it render.
pub fn peer_shot(subject: &Subject, peer: &Peer) -> Result<Shot, Error> {
    let folder = std::path::absolute(subject.folder)
        .map_err(|problem| Error::Folder { folder: subject.folder.to_owned(), problem })?;
    let key = peer.target.key();
    let exported = folder.join(key);
    let export = export::export(subject.world, subject.settings, peer.target, &exported, Options::default())?;
    let runs: u32 = if peer.is_random() { 2 } else { 1 };
    let mut pictures = Vec::new();
    let (mut seconds, mut complaints) = (0.0, Vec::new());
    for i in 0..runs {
        let picture = folder.join(format!("{key}-{}.exr", i + 1));
        let _ = fs::remove_file(&picture);
        let task = Task {
            folder: &exported,
            picture: &picture,
            samples: subject.settings.samples / runs,
            seed: (subject.settings.seed as u32 & 0xFFFF).wrapping_add(i),
            threads: subject.settings.threads,
            limit: subject.limit,
        };
        let run = peer.render(&task)?;
        seconds += run.seconds;
        complaints = run.complaints;
        let unfit = |problem| Error::Picture { file: picture.clone(), problem };
        let loaded = compare::load(&picture).map_err(unfit)?.picture;
        if [loaded.width, loaded.height] != subject.settings.size {
            return Err(unfit(format!("it is {} × {} pixels", loaded.width, loaded.height)));
        }
        pictures.push(loaded);
    }
    let (first, second) = (pictures.swap_remove(0), pictures.pop());
    let (picture, noise) = match second {
        None => (first, None),
        Some(second) => {
            let (picture, noise) = blend(first, second)?;
            (picture, Some(noise))
        }
    };
    Ok(Shot {
        target: Some(peer.target),
        program: peer.version.clone(),
        picture,
        samples: export.samples,
        noise,
        seconds,
        notes: export.notes,
        complaints,
    })
}

/// The mean of two equally good pictures, and its noise: half of what they differ by.
fn blend(mut a: Picture, b: Picture) -> Result<(Picture, f64), Error> {
    let between = metrics::measure(&a, &b)?.rel_mse;
    for (x, y) in a.pixels.iter_mut().zip(&b.pixels) {
        *x = std::array::from_fn(|c| 0.5 * (x[c] + y[c]));
    }
    Ok((a, 0.5 * between.sqrt()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::stats::uniform;

    #[test]
    fn noise_is_that_of_the_mean() {
        // Uniform noise of ±s about 1: the variance of one picture is s²/3, that of the mean of two half of it.
        let s = 0.1;
        let noisy = |seed| {
            let value = |i: u32| 1.0 + s * (2.0 * uniform(i, seed) - 1.0);
            Picture { width: 128, height: 128, pixels: (0..128 * 128).map(|i| [value(i); 3]).collect() }
        };
        let (picture, noise) = blend(noisy(1), noisy(2)).expect("same size");
        let expected = (s * s / 6.0).sqrt();
        assert!((noise / f64::from(expected) - 1.0).abs() < 0.03, "{noise} {expected}");
        let spread: f32 = picture.pixels.iter().map(|p| (p[0] - 1.0).powi(2)).sum::<f32>() / (128.0 * 128.0);
        assert!((spread.sqrt() / expected - 1.0).abs() < 0.03);
    }

    #[test]
    fn neutral_settings_can_be_had_from_all() {
        let odd = render::Settings { samples: 7, noise: 0.1, crop: Some([0, 0, 1, 1]), ..Default::default() };
        let neutral = neutral(&odd);
        assert_eq!((neutral.samples, neutral.noise, neutral.crop), (8, 0.0, None));
        assert_eq!(neutral.filter.kind, FilterKind::Box);
    }
}
