//! `rayo validate`: the same scene here and elsewhere, and how far apart the pictures are.

use std::{
    fs,
    path::{Path, PathBuf},
};

use super::{
    Failure,
    export::Name,
    flags::Basics,
    job::{self, Job},
    progress::{Waiting, duration},
    terminal::{has_color, say},
};
use crate::{
    diagnostic,
    export::Target,
    output,
    render::Settings,
    validate::{self, Manifest, Peer, Results, SceneResults, Shot, Subject},
};

/// Render scenes with other renderers too, and report how far the pictures are apart
///
/// Exports each scene, renders it here and with every renderer named, all with the same number of samples and a box filter
/// of one pixel, and compares every pair. The report is DIR/index.html, the numbers are in DIR/results.json; exports,
/// pictures and logs stay beside them.
#[derive(Debug, clap::Args)]
#[command(args_override_self = true)]
pub struct Args {
    /// Scene files (.toml) or models (.glb, .gltf, .obj)
    #[arg(required = true)]
    files: Vec<PathBuf>,

    /// The other renderers, such as blender,mitsuba; without it, those that are installed
    #[arg(long, value_enum, value_delimiter = ',', value_name = "NAMES")]
    against: Vec<Name>,

    /// Folder for the report, made where it does not exist
    #[arg(long, short, value_name = "DIR", default_value = "validation")]
    output: PathBuf,

    /// A Python that has the modules bpy and mitsuba, asked before PATH is
    #[arg(long, value_name = "FILE")]
    python: Option<PathBuf>,

    /// Threads for every renderer; as many as the machine has without it
    #[arg(long, value_name = "N", value_parser = super::flags::threads)]
    threads: Option<usize>,

    /// Also keep the other renderers' pictures here, as half-float EXR with a manifest each
    #[arg(long, value_name = "DIR")]
    keep: Option<PathBuf>,

    /// Print nothing but errors and the table
    #[arg(long, short)]
    quiet: bool,

    #[command(flatten)]
    basics: Basics,
}

pub fn run(args: &Args) -> Result<(), Failure> {
    let peers = find_peers(args)?;
    for folder in [Some(&args.output), args.keep.as_ref()].into_iter().flatten() {
        fs::create_dir_all(folder).map_err(|e| {
            Failure::BadInput(format!("error: the folder {} cannot be made: {e}", folder.display()))
        })?;
    }
    let mut names = Vec::new();
    let (mut results, mut faults) = (Results { scenes: Vec::new() }, 0);
    for file in &args.files {
        let name = unique_name(file, &mut names);
        let Job { mut render, world, .. } = job::load(file, |render, _| {
            args.basics.apply(render);
            render.threads = args.threads.or(render.threads);
            job::check(render)
        })?;
        if !args.quiet && !world.model.warnings.is_empty() {
            say(diagnostic::render(&world.model.warnings, has_color()).trim_end());
        }
        render = validate::neutral(&render);
        let folder = args.output.join(&name);
        fs::create_dir_all(&folder)
            .map_err(|e| failed(format!("{} cannot be made: {e}", folder.display())))?;
        let subject = Subject { world: &world, settings: &render, folder: &folder };
        let mut shots = Vec::new();
        let mut take = |who: &str, shot: Result<Shot, validate::Error>| match shot {
            Ok(shot) => {
                if !args.quiet {
                    say(format!("{name}: {} in {}", shot.program, duration(shot.seconds)));
                    shot.complaints.iter().for_each(|line| say(format!("  it said: {line}")));
                }
                shots.push(shot);
            }
            Err(error) => {
                say(format!("error: {name}: {who}: {error}"));
                faults += 1;
            }
        };
        for peer in &peers {
            let waiting = Waiting::start(&name, &peer.version, args.quiet);
            let shot = validate::peer_shot(&subject, peer);
            drop(waiting);
            take(peer.target.name(), shot);
        }
        let waiting = Waiting::start(&name, "rayo", args.quiet);
        let shot = validate::own_shot(world, &render);
        drop(waiting);
        take("rayo", shot);
        // This program first.
        shots.sort_by_key(|shot| shot.target);
        if let Some(folder) = &args.keep {
            keep(folder, &name, &shots, &render)?;
        }
        results.scenes.push(SceneResults::measure(&name, render.size, &shots).map_err(failed)?);
    }
    let json = serde_json::to_string_pretty(&results).map_err(failed)?;
    output::write_file(&args.output.join("results.json"), json.as_bytes()).map_err(failed)?;
    print!("{}", results.table());
    match faults {
        0 => Ok(()),
        n => {
            Err(Failure::Failed(format!("error: {n} pictures could not be made; the report has the others")))
        }
    }
}

/// Those asked for, which must be there, or those there are.
fn find_peers(args: &Args) -> Result<Vec<Peer>, Failure> {
    let asked: Vec<Target> = match args.against.as_slice() {
        [] => Target::ALL.to_vec(),
        names => names.iter().map(|name| name.target()).collect(),
    };
    let mut peers: Vec<Peer> = Vec::new();
    let mut missing = Vec::new();
    for (i, target) in asked.iter().enumerate() {
        if asked[..i].contains(target) {
            continue;
        }
        match Peer::find(*target, args.python.as_deref()) {
            Ok(peer) => peers.push(peer),
            Err(fault) => missing.push(fault),
        }
    }
    let lines = |kind: &str| missing.iter().map(|fault| format!("{kind}: {fault}\n")).collect::<String>();
    if peers.is_empty() || !(args.against.is_empty() || missing.is_empty()) {
        return Err(Failure::BadInput(lines("error")));
    }
    if !missing.is_empty() {
        say(lines("warning").trim_end());
    }
    Ok(peers)
}

/// The file's name without its ending, told apart from those before.
fn unique_name(file: &Path, taken: &mut Vec<String>) -> String {
    let stem = file.file_stem().map_or("scene".into(), |stem| stem.to_string_lossy().into_owned());
    let mut name = stem.clone();
    let mut n = 2;
    while taken.contains(&name) {
        name = format!("{stem}-{n}");
        n += 1;
    }
    taken.push(name.clone());
    name
}

fn failed(error: impl std::fmt::Display) -> Failure {
    Failure::Failed(format!("error: {error}"))
}

/// Keeps the peers' pictures as references.
fn keep(folder: &Path, name: &str, shots: &[Shot], settings: &Settings) -> Result<(), Failure> {
    for shot in shots {
        let Some(target) = shot.target else { continue };
        let key = target.key();
        let made_by = format!("rayo validate {name} --against {key} --samples {}", shot.samples);
        let stem = folder.join(format!("{name}.{key}"));
        Manifest::new(shot, settings, made_by).write(&stem, &shot.picture, settings.seed).map_err(failed)?;
    }
    Ok(())
}
