//! From a function of (pixel, sample index) to a film: passes, tiles, threads, and when to stop.
//!
//! First the rims of lamps are looked for, where samples take more rays ([`Rims`]). Then a picture is made in passes over all pixels that
//! still need samples. Passes grow (1, 1, 2, 4, 8, then 16 samples each), so that every pixel soon shows something and little is lost when
//! something stops; after the first of the work, the rest goes where the noise is (`schedule.rs`, `allotment.rs`). Each pass hands tiles
//! of the film to the threads of a pool; a tile has one owner, which adds samples to each pixel in the order of their index. Between
//! passes the film's state alone decides which pixels go on, and whether the picture is good enough. So the film is the same to the bit
//! for any number of threads. A time budget or an interruption ends a pass between two pixels: each pixel then holds its first n
//! samples, whatever n it got to. (Where time ends the search for rims as well, it decides which pixels take more rays a sample.)

mod allotment;
mod monitor;
mod pass;
mod schedule;
mod settings;

use std::{
    collections::TryReserveError,
    time::{Duration, Instant},
};

use glam::Vec3;
use rayon::{ThreadPool, ThreadPoolBuildError, ThreadPoolBuilder};

pub use monitor::Monitor;
pub use settings::{
    Bounces, FilterKind, MAX_BOUNCES, MAX_PIXELS, MAX_SAMPLES, MAX_SIDE, MAX_THREADS, PixelFilter, Settings,
};

use crate::{
    compile::Scene,
    film::{Film, relative_error},
    integrator::{RayCounts, Rims, Splat, sample_pixel, trace_lamp_path},
};
use schedule::Schedule;

/// Deep enough for tree building and scene loading, which recurse; rendering itself hardly does.
const STACK_BYTES: usize = 8 << 20;

/// Of a time budget, the search for the rims of lamps may take one part in so many: the rest is for samples.
const SEARCH_PART: u32 = 10;

/// Why rendering ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// All samples asked for, or as much work as they take, are done.
    Finished,
    /// The estimated relative error of the picture is below the one asked for.
    NoiseReached,
    TimeUp,
    Cancelled,
}

/// What rendering made and what it took.
#[derive(Debug)]
pub struct Rendering {
    pub film: Film,
    pub outcome: Outcome,
    pub rays: RayCounts,
    pub duration: Duration,
    /// Estimated relative error of the picture (see [`relative_error`]); `None` where some pixel
    /// has fewer than two samples.
    pub noise: Option<f32>,
}

#[derive(Debug, thiserror::Error)]
pub enum Error {
    #[error("there is not enough memory for a film of {width} × {height} pixels")]
    Memory { width: u32, height: u32, source: TryReserveError },
    #[error("could not start the threads: {0}")]
    Threads(#[from] ThreadPoolBuildError),
}

/// Renders `scene`. `monitor` shows how far it is, from any thread, and can cancel it.
pub fn render(scene: &Scene, settings: &Settings, monitor: &Monitor) -> Result<Rendering, Error> {
    let film = blank(settings, scene.aim.is_some())?;
    let run = Run::start(settings, monitor)?;
    let stop = || run.is_past(settings.time.map(|budget| budget / SEARCH_PART));
    let (rims, search) = run.pool.install(|| Rims::find(scene, settings, monitor, &stop));
    let sample = |x, y, index, rays: &mut RayCounts| sample_pixel(scene, &rims, [x, y], index, rays);
    let lamp = |x, y, index, rays: &mut RayCounts, splats: &mut Vec<Splat>| {
        trace_lamp_path(scene, [x, y], index, rays, splats);
    };
    let rendering = run.render(film, &sample, scene.aim.as_ref().map(|_| &lamp));
    Ok(Rendering { rays: search + rendering.rays, ..rendering })
}

/// Renders what `sample` returns for (x, y, sample index), x and y being pixels of the whole picture even where only a
/// crop of it is rendered.
pub fn render_samples<S>(sample: &S, settings: &Settings, monitor: &Monitor) -> Result<Rendering, Error>
where
    S: Fn(u32, u32, u32, &mut RayCounts) -> Vec3 + Sync,
{
    let no_lamp = None::<&fn(u32, u32, u32, &mut RayCounts, &mut Vec<Splat>)>;
    let film = blank(settings, false)?;
    Ok(Run::start(settings, monitor)?.render(film, sample, no_lamp))
}

fn blank(settings: &Settings, with_lamps: bool) -> Result<Film, Error> {
    let [.., width, height] = settings.window();
    let film = Film::new(width, height);
    let film = if with_lamps { film.and_then(Film::with_lamps) } else { film };
    film.map_err(|source| Error::Memory { width, height, source })
}

/// A picture that is being made.
struct Run<'a> {
    settings: &'a Settings,
    monitor: &'a Monitor,
    pool: ThreadPool,
    start: Instant,
}

impl<'a> Run<'a> {
    fn start(settings: &'a Settings, monitor: &'a Monitor) -> Result<Self, Error> {
        let start = Instant::now();
        Ok(Self { settings, monitor, pool: thread_pool(settings.threads)?, start })
    }

    /// Whether it is to end now, as far as it is.
    fn is_over(&self) -> bool {
        self.is_past(self.settings.time)
    }

    /// Whether what may take so much time, counted from the start, is to end now.
    fn is_past(&self, budget: Option<Duration>) -> bool {
        self.monitor.is_cancelled() || budget.is_some_and(|budget| self.start.elapsed() >= budget)
    }

    /// `lamp` traces a path from a lamp, of which one goes with every [`SAMPLES_A_LAMP_PATH`](crate::light::SAMPLES_A_LAMP_PATH)
    /// samples of a pixel.
    fn render<S, L>(self, mut film: Film, sample: &S, lamp: Option<&L>) -> Rendering
    where
        S: Fn(u32, u32, u32, &mut RayCounts) -> Vec3 + Sync,
        L: Fn(u32, u32, u32, &mut RayCounts, &mut Vec<Splat>) + Sync,
    {
        let [x, y, width, height] = self.settings.window();
        let mut rays = RayCounts::default();
        let monitor = self.monitor;
        let (outcome, noise) = self.pool.install(|| {
            let mut schedule = Schedule::new(self.settings);
            let mut work = pass::no_work(width, height);
            loop {
                let noise = relative_error(&film);
                let end = schedule.advance(&film, &work, noise);
                monitor.report(schedule.expected(&film, monitor.samples(), noise), noise);
                if let Some(outcome) = end {
                    return (outcome, noise);
                }
                let pass = pass::Pass { origin: [x, y], schedule: &schedule, monitor };
                let is_whole = !self.is_over()
                    && pass.run(&mut film, &mut work, sample, lamp, &|| self.is_over(), &mut rays);
                if !is_whole {
                    let outcome = if monitor.is_cancelled() { Outcome::Cancelled } else { Outcome::TimeUp };
                    return (outcome, relative_error(&film));
                }
            }
        });
        Rendering { film, outcome, rays, duration: self.start.elapsed(), noise }
    }
}

/// The threads that all heavy work runs on. `None`: as many as the machine has.
pub fn thread_pool(threads: Option<usize>) -> Result<ThreadPool, ThreadPoolBuildError> {
    ThreadPoolBuilder::new()
        .num_threads(threads.unwrap_or(0))
        .stack_size(STACK_BYTES)
        .thread_name(|i| format!("rayo {i}"))
        .build()
}

#[cfg(test)]
mod tests;
