//! rayo's trees against Embree 4, both in this process and in turn, so that what else the machine does weighs on both alike.
//!
//! ```sh
//! pip download embreex && unzip embreex-*.whl    # or Debian's libembree4-4
//! RAYO_EMBREE=embreex.libs/libembree4-….so.4 cargo bench --bench rays -- [SCENE | FILE.glb]… [--reps N] [--builds N] [--bvh fast|balanced|best] [--size N]
//! ```
//!
//! Prints three Markdown tables: rays a second relative to Embree (HIGH, its fast and its robust mode; medians over the
//! repetitions, 1 thread), build times (wall, and in brackets of all threads' processors) and bytes (2 threads), and rays lost through closed meshes. Without `RAYO_EMBREE`
//! there is nothing to race against, and it says so.
//!
//! The last column of the first table counts rays whose t is not the same but for roundings. Traced back in `f64`, they are rays that
//! pass within 10⁻⁷ metres of a triangle's border, of whose two sides rayo and Embree are right about equally often, and some that
//! graze a surface. (Rays of a millimetre also get a t that differs by more than a ten-thousandth: both find the same triangle,
//! at a distance that is off by roundings of the coordinates, here 10⁻⁷ to 10⁻⁶ metres. These are not counted.)

mod embree;
mod random;
mod rays;
mod scenes;
mod time;

use std::{hint::black_box, path::Path};

use rayo::{
    accel::{self, Accel, Blas, Build, Object, Shape},
    geometry::Ray,
};

use embree::{Embree, Quality};
use rays::{Kind, RaySet};
use scenes::World;
use time::{Spent, quartiles};

/// rayo, Embree fast, Embree robust: each traces all rays it is given.
type Contestants<'a> = [&'a dyn Fn(&[Ray]); 3];

/// Rays that one contestant traces before it is the next one's turn.
const TURN: usize = 8192;

struct Options {
    scenes: Vec<String>,
    repetitions: usize,
    builds: usize,
    quality: accel::Quality,
    /// Width and height of the picture that camera rays make, in pixels.
    size: u32,
}

fn main() {
    let Some(path) = std::env::var_os("RAYO_EMBREE") else {
        println!("rays: skipped, since RAYO_EMBREE does not name Embree 4's shared library");
        return;
    };
    let embree =
        Embree::load(Path::new(&path), 2).unwrap_or_else(|e| panic!("{}: {e}", Path::new(&path).display()));
    let options = options();
    rayon::ThreadPoolBuilder::new().num_threads(2).build_global().expect("made once");
    let mut builds = Vec::new();
    println!("| scene | rays | Mrays/s | × fast (quartiles) | × robust | other t than robust |");
    println!("|---|---|---|---|---|---|");
    for name in &options.scenes {
        let world = World::named(name).unwrap_or_else(|| {
            World::gltf(Path::new(name)).unwrap_or_else(|e| panic!("no scene {name}, nor a file: {e}"))
        });
        builds.push(race(&world, &embree, &options));
    }
    println!();
    println!(
        "| scene | triangles | rayo s (CPU) | HIGH s | MEDIUM s | rayo / HIGH | rayo MiB (peak) | HIGH MiB (peak) |"
    );
    println!("|---|---|---|---|---|---|---|---|");
    builds.iter().for_each(|row| println!("{row}"));
    println!();
    leaks(&embree);
}

fn options() -> Options {
    let mut options =
        Options { scenes: Vec::new(), repetitions: 7, builds: 3, quality: accel::Quality::Best, size: 384 };
    let mut arguments = std::env::args().skip(1);
    let number =
        |value: Option<String>| value.and_then(|v| v.parse().ok()).expect("a whole number behind it");
    while let Some(argument) = arguments.next() {
        match argument.as_str() {
            "--bench" => {} // from cargo
            "--reps" => options.repetitions = number(arguments.next()),
            "--bvh" => {
                options.quality = match arguments.next().as_deref() {
                    Some("fast") => accel::Quality::Fast,
                    Some("balanced") => accel::Quality::Balanced,
                    _ => accel::Quality::Best,
                }
            }
            "--builds" => options.builds = number(arguments.next()),
            "--size" => options.size = number(arguments.next()) as u32,
            _ => options.scenes.push(argument),
        }
    }
    if options.scenes.is_empty() {
        options.scenes = World::names().map(String::from).to_vec();
    }
    options
}

fn build(world: &World, quality: accel::Quality) -> Accel {
    let blases = world
        .meshes
        .iter()
        .map(|m| Blas::build(m.positions(), &m.triangles, Build { quality, filtered: false }))
        .collect();
    let object = |&(mesh, to_world): &(usize, _)| Object {
        shape: Shape::Mesh { blas: mesh as u32, to_world },
        filtered: false,
    };
    Accel::build(blases, world.instances.iter().map(object).collect())
}

/// Prints the rays' rows, and gives the builds'.
fn race(world: &World, embree: &Embree, options: &Options) -> String {
    let mut spent: [Vec<Spent>; 3] = Default::default();
    for _ in 0..options.builds {
        spent[0].push(time::spent(|| build(world, options.quality)).1);
        spent[1].push(time::spent(|| embree.build(world, Quality::High, false)).1);
        spent[2].push(time::spent(|| embree.build(world, Quality::Medium, false)).1);
    }
    let [rayo, high, medium] = spent.map(Spent::typical);
    let (accel, fast) = (build(world, options.quality), embree.build(world, Quality::High, false));
    let robust = embree.build(world, Quality::High, true);
    let nearest = |ray: &Ray| accel.closest(ray).map_or(f32::INFINITY, |h| h.t);
    for set in RaySet::all(world, options.size, |ray| accel.closest(ray)) {
        let closest: Contestants = [
            &|rays| rays.iter().for_each(|r| _ = black_box(accel.closest(r))),
            &|rays| rays.iter().for_each(|r| _ = black_box(fast.closest(r))),
            &|rays| rays.iter().for_each(|r| _ = black_box(robust.closest(r))),
        ];
        let any: Contestants = [
            &|rays| rays.iter().for_each(|r| _ = black_box(accel.occluded(r))),
            &|rays| rays.iter().for_each(|r| _ = black_box(fast.occluded(r))),
            &|rays| rays.iter().for_each(|r| _ = black_box(robust.occluded(r))),
        ];
        for (query, contestants) in [("closest", closest), ("any", any)] {
            if set.kind == Kind::Shadow && query == "closest" {
                continue;
            }
            let other = set.rays.iter().filter(|ray| match query {
                "closest" => !same(ray, nearest(ray), robust.closest(ray)),
                _ => accel.occluded(ray) != robust.occluded(ray),
            });
            let other = other.count();
            let times = times(&set.rays, &contestants, options.repetitions);
            let typical = typical(&times);
            let ratios = times.iter().map(|turns| sum(turns, 1) / sum(turns, 0)).collect();
            let [low, _, high] = quartiles(ratios);
            println!(
                "| {} | {:?}, {query} | {:.2} | **{:.2}** ({low:.2}–{high:.2}) | **{:.2}** | {other} of {} |",
                world.name,
                set.kind,
                set.rays.len() as f64 / typical[0] / 1e6,
                typical[1] / typical[0],
                typical[2] / typical[0],
                set.rays.len(),
            );
        }
    }
    let mib = |bytes: u64| bytes as f64 / (1 << 20) as f64;
    format!(
        "| {} | {} | {:.2} ({:.2}) | {:.2} ({:.2}) | {:.2} ({:.2}) | **{:.2}** ({:.2}) | {:.0} ({:.0}) | {:.0} ({:.0}) |",
        world.name,
        world.triangles(),
        rayo.seconds,
        rayo.processor,
        high.seconds,
        high.processor,
        medium.seconds,
        medium.processor,
        rayo.seconds / high.seconds,
        rayo.processor / high.processor,
        mib(accel.memory() as u64),
        mib(rayo.peak),
        mib(high.kept),
        mib(high.peak),
    )
}

/// Whether both are the same t but for roundings, of t and of coordinates.
fn same(ray: &Ray, a: f32, b: f32) -> bool {
    let coordinate = ray.origin.abs().max_element() / ray.direction.length();
    a == b || (a - b).abs() <= 1e-4 * a.abs().max(b.abs()) + 1e-6 * coordinate
}

/// Seconds of each contestant for each turn, repetition by repetition.
fn times(rays: &[Ray], contestants: &Contestants, repetitions: usize) -> Vec<Vec<[f64; 3]>> {
    let turn = |repetition: usize, (i, rays): (usize, &[Ray])| {
        let mut seconds = [0.0; 3];
        for k in 0..3 {
            let who = (k + i + repetition) % 3;
            seconds[who] = time::of_thread(|| contestants[who](rays));
        }
        seconds
    };
    (0..repetitions).map(|r| rays.chunks(TURN).enumerate().map(|part| turn(r, part)).collect()).collect()
}

fn sum(turns: &[[f64; 3]], who: usize) -> f64 {
    turns.iter().map(|turn| turn[who]).sum()
}

/// Seconds of each contestant for all rays: of each turn, the median over the repetitions.
fn typical(repetitions: &[Vec<[f64; 3]>]) -> [f64; 3] {
    std::array::from_fn(|who| {
        let turns = 0..repetitions.first().map_or(0, Vec::len);
        turns.map(|turn| quartiles(repetitions.iter().map(|r| r[turn][who]).collect())[1]).sum()
    })
}

/// Rays from inside closed meshes at their vertices and edges: each must hit something.
fn leaks(embree: &Embree) {
    println!("| closed mesh | rays | lost by rayo | by Embree fast | by Embree robust |");
    println!("|---|---|---|---|---|");
    for (name, triangles) in [("ball", 5000), ("ball", 200_000)] {
        let world = scenes::ball(name, triangles);
        let rays = rays::at_edges(&world.meshes[0], 500_000);
        let (accel, [fast, robust]) = (
            build(&world, accel::Quality::Best),
            [false, true].map(|robust| embree.build(&world, Quality::High, robust)),
        );
        let lost = |hit: &dyn Fn(&Ray) -> bool| rays.iter().filter(|ray| !hit(ray)).count();
        println!(
            "| {name}, {} triangles | {} | {} | {} | {} |",
            world.triangles(),
            rays.len(),
            lost(&|ray| accel.closest(ray).is_some() && accel.occluded(ray)),
            lost(&|ray| fast.closest(ray).is_finite() && fast.occluded(ray)),
            lost(&|ray| robust.closest(ray).is_finite() && robust.occluded(ray)),
        );
    }
}
