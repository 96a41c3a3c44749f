//! Paths from lamps, and samples where the noise is, leave the mean alone: the same picture as by as many paths from the camera
//! for every pixel, with less noise.

use std::{
    f64::consts::{PI, TAU},
    path::Path,
    time::Duration,
};

use rayo::{
    compile::{Scene, compile},
    import::assemble,
    integrator::{RayCounts, Rims, sample_pixel},
    render::{self, FilterKind, Monitor, Outcome, PixelFilter, Settings},
    sampling::weave::Weave,
    scene,
    world::World,
};
use statrs::distribution::{ContinuousCDF, Normal};

#[path = "unbiased/lights.rs"]
mod lights;

const SIZE: u32 = 32;

/// Of each block of 4 × 4 pixels the mean and its variance, and the median over blocks of the relative variance of a sample
/// (few rays that see caustics in glass, which no path from a lamp can bring, would decide a mean).
struct Shown {
    blocks: Vec<(f64, f64)>,
    noise: f64,
}

/// How a picture is estimated.
#[derive(Clone, Copy)]
struct Way {
    lamps: bool,
    adaptive: bool,
    samples: u32,
    seed: u64,
}

/// By paths from the camera alone, the same number for every pixel.
const PLAIN: Way = Way { lamps: false, adaptive: false, samples: 4096, seed: 10 };

/// A scene file's world, small, and beside it a ball in a file.
fn load(text: &str) -> (World, Settings) {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("scene.toml");
    std::fs::write(&file, text).expect("written");
    std::fs::write(folder.path().join("ball.obj"), coarse_ball()).expect("written");
    let loaded = scene::load(Path::new(&file)).unwrap_or_else(|all| panic!("{all:?}"));
    let (world, settings, _) = assemble(loaded).unwrap_or_else(|all| panic!("{all:?}"));
    (world, Settings { size: [SIZE; 2], ..settings })
}

fn show(text: &str, filter: PixelFilter, way: Way) -> Shown {
    show_changed(text, filter, way, |_| ())
}

fn show_changed(text: &str, filter: PixelFilter, way: Way, change: impl FnOnce(&mut Scene)) -> Shown {
    let Way { lamps, adaptive, samples, seed } = way;
    let (world, settings) = load(text);
    let settings = Settings { samples, adaptive, filter, seed, ..settings };
    let mut scene = compile(world, &settings);
    assert!(scene.aim.is_some() || !lamps, "there is glass and a lamp");
    if !lamps {
        scene.aim = None;
    }
    change(&mut scene);
    let film = render::render(&scene, &settings, &Monitor::default()).expect("rendered").film;
    let pixel = |x: u32, y: u32| {
        let i = (y * SIZE + x) as usize;
        let variance = film.variance(i).expect("many samples");
        (f64::from(film.radiance(i).element_sum()) / 3.0, variance.map(f64::sqrt).element_sum().powi(2) / 9.0)
    };
    let block = |b: u32| {
        let (left, top) = (4 * (b % 8), 4 * (b / 8));
        let pixels = (0..16).map(|i| pixel(left + i % 4, top + i / 4));
        let (mean, variance) = pixels.fold((0.0, 0.0), |(m, v), (x, s)| (m + x / 16.0, v + s / 256.0));
        (mean, variance)
    };
    let blocks: Vec<(f64, f64)> = (0..64).map(block).collect();
    let relative = |&(x, variance): &(f64, f64)| 16.0 * variance * f64::from(samples) / (x * x + 1e-2);
    let mut noise: Vec<f64> = blocks.iter().map(relative).collect();
    noise.sort_unstable_by(f64::total_cmp);
    Shown { noise: noise[32], blocks }
}

/// Welch's test of every block and of the whole.
fn assert_same(name: &str, a: &Shown, b: &Shown) {
    let normal = Normal::standard();
    let z = |(x, v): (f64, f64), (y, w): (f64, f64)| (x - y) / (v + w).sqrt().max(1e-12);
    for (i, (&p, &q)) in a.blocks.iter().zip(&b.blocks).enumerate() {
        let p_value = 2.0 * normal.cdf(-z(p, q).abs());
        assert!(p_value > 1e-5, "{name}, block {i}: {p:?} and {q:?}, p = {p_value:.1e}");
    }
    let whole = |s: &Shown| s.blocks.iter().fold((0.0, 0.0), |(m, v), (x, w)| (m + x, v + w));
    let p_value = 2.0 * normal.cdf(-z(whole(a), whole(b)).abs());
    assert!(p_value > 1e-3, "{name}: {:?} and {:?}, p = {p_value:.1e}", whole(a), whole(b));
}

/// A ball of few triangles that are shaded as if it were round.
fn coarse_ball() -> String {
    let (rings, sectors) = (5, 8);
    let mut text = String::from("o ball\n");
    for (i, j) in (0..=rings).flat_map(|i| (0..=sectors).map(move |j| (i, j))) {
        let [theta, phi] = [PI * f64::from(i) / f64::from(rings), TAU * f64::from(j) / f64::from(sectors)];
        let (x, y, z) = (theta.sin() * phi.cos(), theta.cos(), theta.sin() * phi.sin());
        text += &format!("v {x} {y} {z}\nvn {x} {y} {z}\n");
    }
    for (i, j) in (0..rings).flat_map(|i| (0..sectors).map(move |j| (i, j))) {
        let a = i * (sectors + 1) + j + 1;
        let [b, c, d] = [a + 1, a + sectors + 2, a + sectors + 1];
        text += &format!("f {a}//{a} {b}//{b} {c}//{c}\nf {a}//{a} {c}//{c} {d}//{d}\n");
    }
    text
}

const BOX: PixelFilter = PixelFilter { kind: FilterKind::Box, width: 1.0 };

/// A matte room (its back wall rough plastic) with a mirror and a glass ball; `lamp` and `camera` are to be filled in.
fn room(lamp: &str, camera: &str) -> String {
    format!(
        r#"
render = {{ bounces = 6 }}
camera = {{ position = [0, 1, 3.5], target = [0, 0.9, 0], vfov = 45{camera} }}
environment = {{ type = "color", color = [0, 0, 0] }}

[materials]
white = {{ type = "diffuse", color = [0.7, 0.7, 0.7] }}
wall = {{ type = "pbr", base_color = [0.6, 0.5, 0.4], metallic = 0.1, roughness = 0.8 }}
glass = {{ type = "dielectric", ior = 1.5 }}
mirror = {{ type = "metal", color = [0.9, 0.8, 0.7], fuzz = 0.0 }}
lamp = {{ type = "emissive", color = [12, 10, 8] }}

[[sphere]]
center = [0.6, 0.4, 0.3]
radius = 0.4
material = "glass"
[[sphere]]
center = [-0.6, 0.4, -0.2]
radius = 0.4
material = "mirror"
[[quad]]
origin = [-1.5, 0, 2]
u = [3, 0, 0]
v = [0, 0, -3]
material = "white"
[[quad]]
origin = [-1.5, 0, -1]
u = [3, 0, 0]
v = [0, 2.5, 0]
material = "wall"
{lamp}
"#
    )
}

/// So wide that paths from the camera alone find what it sends through glass often enough for their own variance to be known:
/// what is rare and missed would be missing from the mean and from the variance.
const QUAD: &str = r#"
[[quad]]
origin = [-1, 2.2, -0.8]
u = [2, 0, 0]
v = [0, 0, 1.6]
material = "lamp"
"#;

const BALL: &str = r#"
[[sphere]]
center = [0.2, 1.7, 0.1]
radius = 0.5
material = "lamp"
"#;

const SMALL: &str = r#"
[[quad]]
origin = [-0.3, 2.2, -0.3]
u = [0.6, 0, 0]
v = [0, 0, 0.5]
material = "lamp"
"#;

fn check(name: &str, text: &str, filter: PixelFilter) {
    let lamps = Way { lamps: true, samples: 1024, seed: 9, ..PLAIN };
    let [with, without] = [lamps, PLAIN].map(|way| show(text, filter, way));
    assert_same(name, &with, &without);
}

#[test]
fn a_lamp_above_glass_and_mirror() {
    check("quad", &room(QUAD, ""), BOX);
}

#[test]
fn a_round_lamp_through_a_lens_and_a_wide_filter() {
    let wide = PixelFilter { kind: FilterKind::BlackmanHarris, width: 3.3 };
    check("ball", &room(BALL, ", aperture = 0.1, focus = 3.0"), wide);
}

#[test]
fn most_of_the_noise_is_gone() {
    let noise = |lamps| show(&room(SMALL, ""), BOX, Way { lamps, samples: 512, ..PLAIN }).noise;
    let [with, without] = [true, false].map(noise);
    assert!(with < without / 8.0, "noise {with} with, {without} without");
}

#[test]
fn samples_where_the_noise_is() {
    let text = room(QUAD, "");
    let plain = show(&text, BOX, PLAIN);
    for lamps in [false, true] {
        let way = Way { lamps, adaptive: true, samples: 512, seed: 11 };
        assert_same(&format!("adaptive, lamps {lamps}"), &show(&text, BOX, way), &plain);
    }
}

/// Lamps of two sizes: one aims from its middle, one from its points.
const TWO: &str = r#"
[[sphere]]
center = [0.1, 1.5, 0.6]
radius = 0.12
material = "lamp"
[[quad]]
origin = [-1.2, 2.2, -0.8]
u = [0.8, 0, 0]
v = [0, 0, 1.6]
material = "lamp"
"#;

/// The room with these materials in place of glass and mirror.
fn metals(glass: &str, mirror: &str, lamp: &str) -> String {
    room(lamp, "")
        .replace(r#"{ type = "dielectric", ior = 1.5 }"#, glass)
        .replace(r#"{ type = "metal", color = [0.9, 0.8, 0.7], fuzz = 0.0 }"#, mirror)
}

#[test]
fn lamps_above_rough_metals() {
    let metal = r#"{ type = "metal", color = [0.9, 0.7, 0.5], roughness = 0.32 }"#;
    let rougher = r#"{ type = "metal", color = [0.9, 0.8, 0.7], roughness = 0.56, multiscatter = false }"#;
    check("metals", &metals(metal, rougher, TWO), BOX);
}

#[test]
fn from_rough_metal_to_a_mirror_wall_and_back() {
    let metal = r#"{ type = "pbr", base_color = [0.9, 0.7, 0.5], metallic = 1, roughness = 0.3 }"#;
    let mirror = r#"{ type = "metal", color = [0.9, 0.8, 0.7], fuzz = 0.0 }"#;
    let wall = r#"
[[quad]]
origin = [1.5, 0, -1]
u = [0, 0, 3]
v = [0, 2.5, 0]
material = "mirror"
"#;
    check("chain", &metals(metal, mirror, &format!("{TWO}{wall}")), BOX);
}

/// Interpolated normals, by which paths from both ends must reckon alike.
#[test]
fn lamps_above_a_faceted_metal_ball() {
    let metal = r#"{ type = "metal", color = [0.9, 0.7, 0.5], roughness = 0.32 }"#;
    let model = r#"
[[model]]
file = "ball.obj"
scale = 0.4
translate = [0.1, 0.45, 0.8]
material = "glass"
"#;
    check("facets", &metals(metal, metal, &format!("{TWO}{model}")), BOX);
}

/// Paths from lamps end at the pane; from metal lamps are chosen through it.
#[test]
fn lamps_behind_a_pane() {
    let metal = r#"{ type = "metal", color = [0.9, 0.7, 0.5], roughness = 0.4 }"#;
    let fuzzy = r#"{ type = "metal", color = [0.9, 0.8, 0.7], fuzz = 0.4 }"#;
    let pane = r#"
[[quad]]
origin = [-1.5, 1.15, -1]
u = [3, 0, 0]
v = [0, 0, 3]
material = "pane"
"#;
    let text = metals(metal, fuzzy, &format!("{TWO}{pane}")).replace(
        "[materials]",
        "[materials]\npane = { type = \"pbr\", base_color = [1, 1, 1], roughness = 0, transmission = 1 }",
    );
    check("pane", &text, BOX);
}

/// Where the sky is most of the light two paths go on from the first surface.
#[test]
fn two_paths_from_what_the_sky_lights() {
    let sky = "{ type = \"gradient\", bottom = [0.2, 0.3, 0.1], top = [2, 3, 5] }";
    let text = room("", "").replace("{ type = \"color\", color = [0, 0, 0] }", sky);
    let way = Way { adaptive: true, samples: 1024, seed: 12, ..PLAIN };
    assert_same("branches", &show(&text, BOX, way), &show(&text, BOX, PLAIN));
}

/// Where every pixel takes the same number of samples, their errors are as large as by sequences of their own, and cancel better.
#[test]
fn neighbours_share_sequences() {
    let text = room("", "")
        .replace("{ type = \"color\", color = [0, 0, 0] }", "{ type = \"color\", color = [1, 1, 1] }");
    let (world, settings) = load(&text);
    let settings = Settings { samples: 4, adaptive: false, filter: BOX, ..settings };
    let mut scene = compile(world, &settings);
    assert_eq!(scene.weave, Weave::of(4));
    let mut picture = |weave, samples, seed| {
        (scene.weave, scene.seed) = (weave, seed);
        let settings = Settings { samples, seed, ..settings.clone() };
        let film = render::render(&scene, &settings, &Monitor::default()).expect("rendered").film;
        (0..(SIZE * SIZE) as usize).map(|i| f64::from(film.radiance(i).y)).collect::<Vec<f64>>()
    };
    let truth = picture(Weave::NONE, 2048, 100);
    // of single pixels, and of the means over 4 x 4
    let mut errors = |weave| {
        let mut squares = [0.0; 2];
        for seed in 0..16 {
            let picture = picture(weave, 4, seed);
            let error = |x: u32, y: u32| picture[(y * SIZE + x) as usize] - truth[(y * SIZE + x) as usize];
            let pixels = (0..SIZE * SIZE).map(|i| error(i % SIZE, i / SIZE));
            squares[0] += pixels.map(|e| e * e).sum::<f64>();
            let block =
                |b: u32| (0..16).map(|i| error(4 * (b % 8) + i % 4, 4 * (b / 8) + i / 4)).sum::<f64>();
            squares[1] += (0..64).map(|b| block(b).powi(2)).sum::<f64>();
        }
        squares
    };
    let (apart, together) = (errors(Weave::NONE), errors(Weave::of(4)));
    let [pixels, blocks] = [0, 1].map(|i| together[i] / apart[i]);
    assert!((0.85..1.15).contains(&pixels), "{pixels}");
    assert!(blocks < 0.8, "{blocks}");
}

/// Small lamps that the camera sees: before a lit wall, glass and a mirror, in part behind a blended leaf and a pane.
fn lamps_in_sight() -> String {
    let mut text = room("", ", aperture = 0.05").replace(
        "[materials]",
        "[materials]\npane = { type = \"pbr\", base_color = [1, 1, 1], roughness = 0, transmission = 1 }\n\
         leaf = { type = \"pbr\", base_color = [0.2, 0.5, 0.2], opacity = 0.5 }",
    );
    for (x, y, z) in [(-0.9, 1.3, 0.0), (0.1, 1.6, -0.5), (0.9, 1.2, 0.4), (-0.2, 0.5, 0.9)] {
        text += &format!("[[sphere]]\ncenter = [{x}, {y}, {z}]\nradius = 0.09\nmaterial = \"lamp\"\n");
    }
    for (x, material) in [(-1.1, "leaf"), (0.8, "pane")] {
        text += &format!(
            "[[quad]]\norigin = [{x}, 1, 0.8]\nu = [0.3, 0, 0]\nv = [0, 0.4, 0]\nmaterial = \"{material}\"\n"
        );
    }
    text
}

/// On the rims of lamps more rays look for what is seen straight.
#[test]
fn rims_of_lamps() {
    let text = lamps_in_sight();
    let way = Way { adaptive: true, samples: 1024, seed: 13, ..PLAIN };
    let (world, settings) = load(&text);
    assert!(rims(&compile(world, &settings), &settings).count() > 20);
    assert_same("rims", &show(&text, BOX, way), &show(&text, BOX, PLAIN));
}

fn rims(scene: &Scene, settings: &Settings) -> Rims {
    Rims::find(scene, settings, &Monitor::default(), &|| false).0
}

/// In a part of the picture the same pixels take the same rays as in the whole, and those outside of it none but the path's.
#[test]
fn rims_of_a_part() {
    let [left, top, width, height] = [9, 5, 14, 19];
    let (world, whole) = load(&lamps_in_sight());
    let part = Settings { crop: Some([left, top, width, height]), ..whole.clone() };
    let mut scene = compile(world, &whole);
    let of_whole = rims(&scene, &whole);
    scene.window = part.window();
    let of_part = rims(&scene, &part);
    assert!(0 < of_part.count() && of_part.count() < of_whole.count(), "{of_part:?}");
    let sample = |rims: &Rims, pixel| {
        let mut counts = RayCounts::default();
        (sample_pixel(&scene, rims, pixel, 3, &mut counts), counts)
    };
    for [x, y] in (0..SIZE * SIZE).map(|i| [i % SIZE, i / SIZE]) {
        let is_within = |margin: u32| {
            (left + margin..left + width - margin).contains(&x)
                && (top + margin..top + height - margin).contains(&y)
        };
        // in the outermost row and column it is not known what is beside a pixel
        if is_within(1) {
            assert_eq!(sample(&of_part, [x, y]), sample(&of_whole, [x, y]), "{x}, {y}");
        } else if !is_within(0) {
            assert_eq!(sample(&of_part, [x, y]), sample(&Rims::NONE, [x, y]), "{x}, {y}");
        }
    }
}

/// A search for rims that would take far longer than the whole picture may: one thread, lamps in half of a million pixels.
#[test]
fn a_short_time_is_not_used_up_by_the_search_for_rims() {
    let lamps = (0..64 * 64).map(|i| {
        let [x, y] = [i % 64, i / 64].map(|n| n as f32 / 32.0 - 1.0);
        format!("[[sphere]]\ncenter = [{x}, {y}, 0]\nradius = 0.006\nmaterial = \"lamp\"\n")
    });
    let text = format!(
        r#"
camera = {{ position = [0, 0, 3], target = [0, 0, 0], ortho_height = 2 }}
environment = {{ type = "color", color = [0, 0, 0] }}
[materials]
lamp = {{ type = "emissive", color = [5, 5, 5] }}
{}"#,
        lamps.collect::<String>()
    );
    let (world, settings) = load(&text);
    let settings =
        Settings { size: [1024; 2], time: Some(Duration::from_secs(1)), threads: Some(1), ..settings };
    let scene = compile(world, &settings);
    let monitor = Monitor::default();
    let done = render::render(&scene, &settings, &monitor).expect("rendered");
    assert_eq!(done.outcome, Outcome::TimeUp);
    assert!(monitor.samples() > 0);
    assert_eq!(monitor.rays(), done.rays.total());
    assert!(monitor.rays() > monitor.samples(), "the rays of the search count");
    let cancelled = Monitor::default();
    cancelled.cancel();
    let done = render::render(&scene, &settings, &cancelled).expect("nothing to render");
    assert_eq!((done.outcome, done.rays.total()), (Outcome::Cancelled, 0));
}

/// As large a part of the picture is bright as a ball fills, with two fifths of the square error of one ray a sample, or less. (Where the
/// ball fills most of a pixel, one is left to do.)
#[test]
fn a_ball_of_light_is_as_large_as_it_is() {
    let (radius, height) = (0.3, 2.0);
    let text = format!(
        r#"
camera = {{ position = [0.013, 0.007, 3], target = [0.013, 0.007, 0], ortho_height = {height} }}
environment = {{ type = "color", color = [0, 0, 0] }}
[materials]
lamp = {{ type = "emissive", color = [5, 5, 5] }}
[[sphere]]
center = [0, 0, 0]
radius = {radius}
material = "lamp"
"#
    );
    let (world, settings) = load(&text);
    let samples = 16;
    let settings = Settings { samples, filter: BOX, ..settings };
    let mut scene = compile(world, &settings);
    let mut errors = |rims: &Rims| {
        let mut sum = |seed| {
            scene.seed = seed;
            let pixels = (0..SIZE * SIZE).map(|i| [i % SIZE, i / SIZE]);
            let sample =
                |pixel, i| f64::from(sample_pixel(&scene, rims, pixel, i, &mut RayCounts::default()).y);
            pixels.map(|p| (0..samples).map(|i| sample(p, i)).sum::<f64>()).sum::<f64>() / f64::from(samples)
        };
        let expected = 5.0 * PI * (radius * f64::from(SIZE) / height).powi(2);
        (0..64).map(|seed| sum(seed) / expected - 1.0).collect::<Vec<f64>>()
    };
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
    let square = |errors: &[f64]| mean(&errors.iter().map(|e| e * e).collect::<Vec<f64>>());
    let plain = errors(&Rims::NONE);
    let (world, _) = load(&text);
    let finer = errors(&rims(&compile(world, &settings), &settings));
    for (name, errors) in [("plain", &plain), ("finer", &finer)] {
        let standard_error = (square(errors) / errors.len() as f64).sqrt();
        let mean = mean(errors);
        assert!(mean.abs() < 4.0 * standard_error + 1e-6, "{name}: off by {mean:.1e} ± {standard_error:.1e}");
    }
    let gain = square(&plain) / square(&finer);
    assert!(gain > 2.5, "{gain}");
}
