//! `rayo validate`: the same scene here and elsewhere, and how far apart the pictures are.

use std::{
    fs,
    path::{Path, PathBuf},
    time::Duration,
};

use super::{
    Failure,
    export::Name,
    flags::{Basics, Choices},
    job::{self, Job},
    print,
    progress::{Waiting, duration},
    terminal::{has_color, say},
};
use crate::{
    compare::report::{self, Entry, Group, Pairs, Report},
    diagnostic,
    export::Target,
    output::{self, Depth},
    render::Settings,
    validate::{self, Manifest, Peer, Results, SceneResults, Shot, Subject, TABLE_HEAD},
};

/// Render scenes with other renderers too, and report how far the pictures are apart
///
/// Exports each scene, renders it here and with every renderer named, all with the same number of samples (POV-Ray takes at
/// most 82 where there is no lens) and a box filter of one pixel, and compares every pair. The report is DIR/index.html, the
/// numbers are in DIR/results.json; exports, pictures and logs stay beside them.
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

    /// A run of another renderer that takes longer is ended
    #[arg(long, value_name = "TIME", default_value = "1h", value_parser = super::flags::time)]
    limit: Duration,

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
    // What lies beside the scenes' folders.
    let mut names = vec!["index.html".into(), "results.json".into()];
    let (mut results, mut faults, mut unread) = (Results { scenes: Vec::new() }, 0, 0);
    let (mut groups, mut pairs) = (Vec::new(), Vec::new());
    for file in &args.files {
        let name = unique_name(file, &mut names);
        let job = job::load(file, &Choices::default(), |render, _| {
            args.basics.apply(render);
            render.threads = args.threads.or(render.threads);
            job::check(render)
        });
        let Job { mut render, world, .. } = match job {
            Ok(job) => job,
            Err(Failure::BadInput(message)) => {
                say(message.trim_end());
                unread += 1;
                continue;
            }
            Err(other) => return Err(other),
        };
        if render.crop.is_some() {
            say(format!("warning: {name}: the crop is left out: whole pictures are compared"));
        }
        if !world.model.warnings.is_empty() {
            say(diagnostic::render(&world.model.warnings, has_color()).trim_end());
        }
        render = validate::neutral(&render);
        let folder = args.output.join(&name);
        fs::create_dir_all(&folder)
            .map_err(|e| failed(format!("{} cannot be made: {e}", folder.display())))?;
        let subject = Subject { world: &world, settings: &render, folder: &folder, limit: args.limit };
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
        for shot in &shots {
            let file = folder.join(shot.key()).with_extension("exr");
            shot.save(&file, Depth::High, &render).map_err(failed)?;
        }
        if let Some(folder) = &args.keep {
            keep(folder, &name, file, &shots, &render)?;
        }
        let group = group(&name, file, &shots, &render);
        let measured = report::measure(&group).map_err(failed)?;
        let scene = SceneResults::new(&name, &render, &shots, &measured);
        if results.scenes.is_empty() {
            print(TABLE_HEAD)?;
        }
        print(&scene.rows())?;
        results.scenes.push(scene);
        groups.push(group);
        pairs.push(measured);
    }
    let report = Report {
        title: "Agreement between renderers".into(),
        notes: vec![
            "Every renderer has the same number of samples (POV-Ray at most 82, without a lens) and a box filter of one \
             pixel. Noise is half of what two pictures of half the samples differ by: the root of the relMSE that the \
             picture owes to it."
                .into(),
        ],
        groups,
    };
    let page = report::page(&report, &pairs);
    output::write_file(&args.output.join("index.html"), page.as_bytes()).map_err(failed)?;
    let json = serde_json::to_string_pretty(&results).map_err(failed)?;
    output::write_file(&args.output.join("results.json"), json.as_bytes()).map_err(failed)?;
    if !args.quiet {
        let inexact = |scene: &SceneResults| scene.pictures.iter().any(|picture| !picture.notes.is_empty());
        if results.scenes.iter().any(inexact) {
            say("* something had to be approximated or dropped: see the report");
        }
        say(format!("wrote {}", args.output.join("index.html").display()));
    }
    match (unread, faults) {
        (0, 0) => Ok(()),
        (0, n) => {
            Err(Failure::Failed(format!("error: {n} pictures could not be made; the report has the others")))
        }
        (n, _) => Err(Failure::BadInput(format!(
            "error: {n} scenes could not be loaded; the report has the others"
        ))),
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

/// A scene's part of the report.
fn group(name: &str, file: &Path, shots: &[Shot], settings: &Settings) -> Group {
    let entry = |shot: &Shot| {
        let mut details = vec![
            ("Program".into(), shot.program.clone()),
            ("Samples".into(), format!("{} per pixel", shot.samples)),
            ("Time".into(), duration(shot.seconds)),
            ("Noise".into(), shot.noise.map_or("none".into(), |noise| format!("{:.2} %", 100.0 * noise))),
        ];
        details.extend(shot.complaints.iter().map(|line| ("It said".into(), line.clone())));
        Entry::new(shot.name(), details, shot.picture.clone())
    };
    let notes =
        shots.iter().flat_map(|shot| shot.notes.iter().map(|note| format!("{}: {note}", shot.name())));
    Group {
        name: name.to_owned(),
        description: format!(
            "{}: {} × {} pixels, {} samples asked for, seed {}, box filter of 1 pixel, bounces: {} in all, {} diffuse, \
             {} glossy, {} transmitted",
            file.display(),
            settings.size[0],
            settings.size[1],
            settings.samples,
            settings.seed,
            settings.bounces.total,
            settings.bounces.diffuse,
            settings.bounces.glossy,
            settings.bounces.transmission,
        ),
        notes: notes.collect(),
        pictures: shots.iter().map(entry).collect(),
        pairs: Pairs::All,
    }
}

fn failed(error: impl std::fmt::Display) -> Failure {
    Failure::Failed(format!("error: {error}"))
}

/// Keeps the peers' pictures as references.
fn keep(folder: &Path, name: &str, file: &Path, shots: &[Shot], settings: &Settings) -> Result<(), Failure> {
    for shot in shots {
        let Some(target) = shot.target else { continue };
        let key = target.key();
        let [width, height] = settings.size;
        let made_by = format!(
            "rayo {}: rayo validate {} --against {key} --size {width}x{height} --samples {} --seed {}",
            env!("CARGO_PKG_VERSION"),
            file.display(),
            settings.samples,
            settings.seed,
        );
        let stem = folder.join(format!("{name}.{key}"));
        shot.save(&stem.with_added_extension("exr"), Depth::Low, settings).map_err(failed)?;
        Manifest::new(shot, settings, made_by).write(&stem).map_err(failed)?;
    }
    Ok(())
}
