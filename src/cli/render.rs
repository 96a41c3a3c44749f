//! `rayo render`: from a file to a picture.

use std::{
    collections::HashSet,
    env, fs,
    path::{Path, PathBuf},
    sync::Arc,
    time::Instant,
};

use super::{
    Failure,
    flags::{Choices, Overrides},
    interrupt::Interrupt,
    job::{self, Job},
    progress::{Progress, duration},
    terminal::{has_color, say},
};
use crate::{
    cache,
    color::{Picture, Spread},
    compile::{Trees, compile_with},
    diagnostic,
    film::SampleCounts,
    output::{self, Facts, Format, PICTURE_EXTENSIONS, Rays, Seconds, Stats},
    render::{self, Outcome, Rendering},
};

/// Render a scene file or a model
///
/// A scene file (.toml) says what is in the picture and how it is made; flags override it. A model (.glb, .gltf, .obj)
/// is shown with its own camera or one that frames it, and by its own lights or in a built-in studio.
///
/// Ctrl-C once finishes early and writes what there is; twice stops at once. Exit codes: 0 done, 1 interrupted or
/// failed, 2 bad input.
#[derive(Debug, clap::Args)]
// of a flag given twice the last counts, so that a command can be recalled and amended
#[command(args_override_self = true)]
pub struct Args {
    /// Scene file (.toml) or model (.glb, .gltf, .obj)
    file: PathBuf,

    /// File to write: .png, .exr or .hdr; without it, what the scene says, or for a model its name with .png
    #[arg(long, short, value_name = "FILE")]
    output: Option<PathBuf>,

    /// Write what rendering took (times, rays, memory) as JSON
    #[arg(long, value_name = "FILE.json")]
    stats: Option<PathBuf>,

    /// Keep decoded images and computed tangents in this folder for the next time, at most 4 GiB; RAYO_CACHE says the same
    #[arg(long, value_name = "FOLDER")]
    cache: Option<PathBuf>,

    /// Say nothing unless something is wrong
    #[arg(long, short)]
    quiet: bool,

    #[command(flatten)]
    choices: Choices,

    #[command(flatten)]
    overrides: Overrides,
}

pub fn run(args: &Args) -> Result<(), Failure> {
    let interrupt = Interrupt::install();
    let mut seconds = Seconds::default();

    // Loading may take its time: what the flags name is checked before.
    let picture = args.output.as_deref().map(|file| (file, PICTURE_EXTENSIONS));
    let stats = args.stats.as_deref().map(|file| (file, ["json"].as_slice()));
    check_targets(picture.into_iter().chain(stats))?;
    let threads = |n| render::thread_pool(n).map_err(|e| failed(render::Error::from(e)));
    let usual = env::var_os("RAYO_CACHE").filter(|folder| !folder.is_empty()).map(PathBuf::from);
    if let Some(folder) = args.cache.clone().or(usual) {
        cache::keep_in(&folder).map_err(|why| Failure::BadInput(format!("error: {why}\n")))?;
    }
    let start = Instant::now();
    let (job, trees) = threads(args.overrides.threads())?.install(|| {
        job::load_while(&args.file, &args.choices, |render, output| adjust(render, output, args), Trees::of)
    })?;
    // Trees are begun while images are still decoded.
    let trees_start = trees.iter().map(|trees| trees.start).min().unwrap_or_else(Instant::now);
    seconds.load = (trees_start - start).as_secs_f64();
    spare_sources(&job, args)?;
    warn(&job, &args.overrides);
    let Job { world, render: settings, output } = job;

    let pool = threads(settings.threads)?;
    let scene = pool.install(|| compile_with(world, trees, &settings));
    seconds.build = trees_start.elapsed().as_secs_f64();
    scene.stats.notices().iter().for_each(|notice| say(format!("warning: {notice}")));
    interrupt.rendering_starts();
    let progress = Progress::start(&interrupt, &settings, args.quiet);
    let rendering = render::render(&scene, &settings, interrupt.monitor()).map_err(failed)?;
    drop(progress);
    seconds.render = rendering.duration.as_secs_f64();

    let counts = rendering.film.sample_counts();
    if counts.max == 0 {
        say("stopped before the first sample: nothing was written");
        return Err(Failure::Interrupted);
    }
    let clamped = timed(&mut seconds.write, || {
        pool.install(|| write_picture(&interrupt, &rendering, &counts, &settings, &output))
    })?;
    if !args.quiet {
        summarize(&output.file, &rendering, &counts, clamped, settings.noise);
    }
    if let Some(file) = &args.stats {
        let stats = Stats::new(&settings, &output, &scene.stats, &rendering, &counts, seconds);
        interrupt.uninterrupted(|| output::write_file(file, stats.to_json().as_bytes())).map_err(failed)?;
    }
    match rendering.outcome {
        Outcome::Cancelled => Err(Failure::Interrupted),
        Outcome::Finished | Outcome::NoiseReached | Outcome::TimeUp => Ok(()),
    }
}

/// Applies the flags, and checks what comes of it before anything large is loaded.
fn adjust(render: &mut render::Settings, output: &mut output::Settings, args: &Args) -> Result<(), Failure> {
    args.overrides.apply(render, output);
    job::check(render)?;
    match &args.output {
        Some(file) => output.file = file.clone(),
        None => check_targets([(output.file.as_path(), PICTURE_EXTENSIONS)])?,
    }
    if output.variance && Format::of(&output.file) != Some(Format::Exr) {
        let name = output.file.display();
        return Err(Failure::BadInput(format!(
            "error: {name} cannot hold the variance: name an .exr file with -o, or leave the variance out"
        )));
    }
    Ok(())
}

fn check_targets<'a>(targets: impl IntoIterator<Item = (&'a Path, &'a [&'a str])>) -> Result<(), Failure> {
    let problems: String = targets
        .into_iter()
        .filter_map(|(file, extensions)| output::check_writable(file, extensions).err())
        .map(|problem| format!("error: {problem}\n"))
        .collect();
    if problems.is_empty() { Ok(()) } else { Err(Failure::BadInput(problems)) }
}

/// Refuses to write over what the picture is made of: by default it is called as the model is, and so may its texture be.
fn spare_sources(job: &Job, args: &Args) -> Result<(), Failure> {
    let sources: HashSet<PathBuf> =
        job.world.model.sources.iter().filter_map(|file| fs::canonicalize(file).ok()).collect();
    let targets = [(Some(job.output.file.as_path()), "-o"), (args.stats.as_deref(), "--stats")];
    let problems: String = targets
        .into_iter()
        .filter_map(|(file, flag)| Some((file?, flag)))
        // What is not there cannot be overwritten.
        .filter(|(file, _)| fs::canonicalize(file).is_ok_and(|file| sources.contains(&file)))
        .map(|(file, flag)| {
            let name = file.display();
            format!("error: cannot write {name}: the picture is made of this file; choose another name with {flag}\n")
        })
        .collect();
    if problems.is_empty() { Ok(()) } else { Err(Failure::BadInput(problems)) }
}

fn write_picture(
    interrupt: &Arc<Interrupt>,
    rendering: &Rendering,
    counts: &SampleCounts,
    settings: &render::Settings,
    output: &output::Settings,
) -> Result<u64, Failure> {
    let [x, y, ..] = settings.window();
    let facts = Facts {
        samples_per_pixel: counts.mean as f32,
        noise: rendering.noise,
        seed: settings.seed,
        size: settings.size,
        origin: [x, y],
    };
    let spread = output.variance.then(|| Spread::of(&rendering.film));
    let encoded =
        output::encode(&Picture::of(&rendering.film), spread.as_deref(), output, &facts).map_err(failed)?;
    interrupt.uninterrupted(|| output::write_file(&output.file, &encoded.bytes)).map_err(failed)?;
    Ok(encoded.clamped)
}

/// What the loader set aside, and flags that have no effect.
fn warn(job: &Job, overrides: &Overrides) {
    let warnings = &job.world.model.warnings;
    if !warnings.is_empty() {
        say(diagnostic::render(warnings, has_color()).trim_end());
    }
    if overrides.concerns_display() && Format::of(&job.output.file).is_some_and(|format| !format.is_display())
    {
        say("warning: --view and --exposure have no effect here: .exr and .hdr stay scene-linear");
    }
}

/// The closing line, and whatever else should be known about the picture.
fn summarize(file: &Path, rendering: &Rendering, counts: &SampleCounts, clamped: u64, asked: f32) {
    let outcome = match rendering.outcome {
        Outcome::Finished if asked > 0.0 => ", stopped by the number of samples",
        Outcome::Finished => "",
        Outcome::NoiseReached => ", noise threshold reached",
        Outcome::TimeUp => ", time is up",
        Outcome::Cancelled => ", interrupted",
    };
    let noise = match rendering.noise {
        Some(noise) if asked > 0.0 => {
            // two digits that count
            let digits = (1.0 - (100.0 * asked).log10().floor()).clamp(1.0, 9.0) as usize;
            format!(", noise {:.digits$} % of {:.digits$} %", 100.0 * noise, 100.0 * asked)
        }
        _ => String::new(),
    };
    let seconds = duration(rendering.duration.as_secs_f64());
    let speed = Rays::new(&rendering.rays, rendering.duration).mrays_per_second;
    let samples = match counts.mean {
        mean if counts.min == counts.max => format!("{mean:.0} samples per pixel"),
        mean if mean < 10.0 => format!("{mean:.1} samples per pixel on average"),
        mean => format!("{mean:.0} samples per pixel on average"),
    };
    let notes = [
        (counts.dropped, "samples were not finite or negative, and were left out"),
        (counts.empty, "pixels have no sample, and are black"),
        (clamped, "numbers were too large for the file, and were clamped"),
    ];
    for (count, what) in notes.into_iter().filter(|(count, _)| *count > 0) {
        say(format!("warning: {count} {what}"));
    }
    say(format!(
        "wrote {}: {} × {}, {samples}, {seconds}, {speed:.2} Mrays/s{noise}{outcome}",
        file.display(),
        rendering.film.width(),
        rendering.film.height(),
    ));
}

fn failed(error: impl std::fmt::Display) -> Failure {
    Failure::Failed(format!("error: {error}"))
}

/// Runs `work` and notes how long it took.
fn timed<T>(seconds: &mut f64, work: impl FnOnce() -> T) -> T {
    let start = Instant::now();
    let result = work();
    *seconds = start.elapsed().as_secs_f64();
    result
}
