//! The validation scenes against what Blender and POV-Ray made of them.
//!
//! `tests/references/` holds the other renderers' pictures, each with a manifest (program, version, settings, samples,
//! residual noise); `scenes/validation/budgets.json` says how far apart the pictures may be, and why. Five deliberate
//! errors show that the budgets are tight enough to find a mistake.
//!
//! A picture that breaks its budget is left in `target/tmp/agreement`, with the reference and the difference.

use std::{
    collections::{BTreeMap, BTreeSet},
    fs,
    path::{Path, PathBuf},
};

use glam::{Affine3A, Vec3};
use rayo::{
    color::Picture,
    compare::{self, Numbers},
    compile::compile,
    film::Film,
    import::assemble,
    output::{self, Depth, Facts},
    render::{Monitor, Settings, render},
    scene,
    validate::{Manifest, neutral},
    world::{ColorSpace, Projection, Surface, World},
};
use serde::Deserialize;

const SCENES: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/validation");
const REFERENCES: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/references");
const PEERS: [&str; 2] = ["blender", "povray"];

/// What `budgets.json` says of a scene.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Scene {
    /// Per pixel, in this test.
    samples: u32,
    blender: Budget,
    povray: Option<Budget>,
}

/// How far a picture may be from a reference.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Budget {
    /// |ratio of the means − 1|
    mean: f64,
    /// Median of the block errors.
    block: f64,
    /// Mean LDR-FLIP.
    flip: f64,
    why: String,
}

impl Scene {
    fn budget(&self, peer: &str) -> Option<&Budget> {
        if peer == "blender" { Some(&self.blender) } else { self.povray.as_ref() }
    }
}

impl Budget {
    /// What is beyond the budget, in words.
    fn broken_by(&self, numbers: &Numbers) -> Vec<String> {
        let m = &numbers.metrics;
        let measured = [
            ("mean", (m.mean_ratio - 1.0).abs(), self.mean),
            ("block median", m.block_median, self.block),
            ("FLIP", numbers.ldr_flip, self.flip),
        ];
        let beyond = measured.into_iter().filter(|(_, value, bound)| value.is_nan() || value > bound);
        beyond.map(|(what, value, bound)| format!("{what} {value:.4} > {bound}")).collect()
    }
}

fn scenes() -> BTreeMap<String, Scene> {
    let text = fs::read_to_string(Path::new(SCENES).join("budgets.json")).expect("budgets");
    serde_json::from_str(&text).expect("budgets.json")
}

fn load(name: &str, samples: u32) -> (World, Settings) {
    let scene = scene::load(&Path::new(SCENES).join(format!("{name}.toml"))).expect("valid scene");
    let (world, settings, _) = assemble(scene).expect("assets");
    (world, Settings { samples, ..neutral(&settings) })
}

fn picture(world: World, settings: &Settings) -> Film {
    render(&compile(world, settings), settings, &Monitor::default()).expect("rendered").film
}

fn reference(name: &str, peer: &str) -> PathBuf {
    Path::new(REFERENCES).join(format!("{name}.{peer}.exr"))
}

fn measure(name: &str, peer: &str, picture: &Picture) -> Numbers {
    let reference = compare::load(&reference(name, peer)).expect("reference").picture;
    compare::compare(&reference, picture).expect("same size").numbers
}

#[test]
fn every_scene_is_within_its_budgets() {
    let mut broken = Vec::new();
    for (name, scene) in scenes() {
        let (world, settings) = load(&name, scene.samples);
        let film = picture(world, &settings);
        let picture = Picture::of(&film);
        for peer in PEERS {
            let Some(budget) = scene.budget(peer) else { continue };
            let numbers = measure(&name, peer, &picture);
            let m = &numbers.metrics;
            println!(
                "{name:20} {peer:8} mean {:.4} block {:.4} {:.4} FLIP {:.4}",
                m.mean_ratio, m.block_median, m.block_p95, numbers.ldr_flip
            );
            let faults = budget.broken_by(&numbers);
            if !faults.is_empty() {
                let place = leave_behind(&name, peer, &picture);
                let verdict = verdict(&film, &numbers);
                broken.push(format!("{name} against {peer}: {} ({verdict}; see {place})", faults.join(", ")));
            }
        }
    }
    assert!(broken.is_empty(), "{}", broken.join("\n"));
}

/// Whether the mean moved or noise grew: the error that the picture's own variance explains, beside the one found.
fn verdict(film: &Film, numbers: &Numbers) -> String {
    let expected: f64 = film
        .pixels()
        .iter()
        .filter_map(|p| {
            let variance = p.variance()?.element_sum() / 3.0 / p.kept() as f32;
            Some(f64::from(variance) / (p.luminance().powi(2) + 0.01))
        })
        .sum::<f64>()
        / film.pixels().len() as f64;
    let found = numbers.metrics.rel_mse;
    let cause = if found > 3.0 * expected { "the mean moved" } else { "it is noise" };
    format!("{cause}: relMSE {found:.1e}, of which noise is {expected:.1e}")
}

fn leave_behind(name: &str, peer: &str, picture: &Picture) -> String {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("agreement");
    fs::create_dir_all(&folder).expect("folder");
    let wanted = compare::load(&reference(name, peer)).expect("reference").picture;
    let difference = |(a, b): (&[f32; 3], &[f32; 3])| std::array::from_fn(|c| (a[c] - b[c]).abs());
    let pixels = picture.pixels.iter().zip(&wanted.pixels).map(difference).collect();
    for (what, picture) in
        [("ours", picture), (peer, &wanted), ("difference", &Picture { pixels, ..wanted.clone() })]
    {
        let file = folder.join(format!("{name}.{what}.exr"));
        let facts = Facts {
            samples_per_pixel: 0.0,
            noise: None,
            seed: 0,
            size: [picture.width, picture.height],
            origin: [0; 2],
        };
        let settings = output::Settings { file: file.clone(), depth: Depth::High, ..Default::default() };
        let encoded = output::encode(picture, None, &settings, &facts).expect("encoded");
        output::write_file(&file, &encoded.bytes).expect("written");
    }
    folder.join(name).display().to_string()
}

/// One mistake, and the scenes that must notice it.
struct Mistake {
    name: &'static str,
    scenes: &'static [&'static str],
    make: fn(&mut World, &mut Settings),
}

const MISTAKES: [Mistake; 5] = [
    Mistake {
        name: "albedo × 1.05",
        scenes: &["sun", "cornell", "textures", "rough-metal"],
        make: brighter_albedo,
    },
    Mistake {
        name: "half a pixel to the right",
        scenes: &["textures", "instances", "environment"],
        make: half_pixel,
    },
    Mistake {
        name: "sRGB textures read as linear",
        scenes: &["textures", "obj", "alpha"],
        make: wrong_gamma,
    },
    Mistake {
        name: "left-handed camera",
        scenes: &["sun", "textures", "environment", "gltf-scene"],
        make: left_handed,
    },
    Mistake { name: "ior + 0.02", scenes: &["glass", "glass-bubble"], make: denser_glass },
];

#[test]
fn deliberate_errors_break_the_budgets() {
    let scenes = scenes();
    let mut missed = Vec::new();
    for Mistake { name: mistake, scenes: noticing, make } in MISTAKES {
        for &name in noticing {
            let scene = &scenes[name];
            let (mut world, mut settings) = load(name, scene.samples);
            make(&mut world, &mut settings);
            let picture = Picture::of(&picture(world, &settings));
            for peer in PEERS {
                let Some(budget) = scene.budget(peer) else { continue };
                let faults = budget.broken_by(&measure(name, peer, &picture));
                println!("{mistake}: {name} against {peer}: {}", faults.join(", "));
                if faults.is_empty() {
                    missed.push(format!("{mistake} is not noticed in {name} against {peer}"));
                }
            }
        }
    }
    assert!(missed.is_empty(), "{}", missed.join("\n"));
}

fn brighter_albedo(world: &mut World, _: &mut Settings) {
    for material in &mut world.model.materials {
        match &mut material.surface {
            Surface::Diffuse { color } | Surface::Metal { color, .. } => color.factor *= 1.05,
            Surface::Pbr(pbr) => pbr.base_color.factor *= 1.05,
            Surface::Layered(layered) => layered.pbr.base_color.factor *= 1.05,
            Surface::SpecularGlossiness(surface) => surface.diffuse.factor *= 1.05,
            Surface::Dielectric { .. } | Surface::Unlit { .. } | Surface::Black => {}
        }
    }
}

fn half_pixel(world: &mut World, settings: &mut Settings) {
    let Projection::Perspective { vfov } = world.camera.projection else { panic!("no perspective") };
    let pixel = 2.0 * (0.5 * vfov).tan() / settings.size[1] as f32;
    world.camera.to_world *= Affine3A::from_rotation_y((0.5 * pixel).atan());
}

fn wrong_gamma(world: &mut World, _: &mut Settings) {
    for texture in &mut world.model.textures {
        texture.color_space = ColorSpace::Linear;
    }
}

fn left_handed(world: &mut World, _: &mut Settings) {
    world.camera.to_world *= Affine3A::from_scale(Vec3::new(-1.0, 1.0, 1.0));
}

fn denser_glass(world: &mut World, _: &mut Settings) {
    for material in &mut world.model.materials {
        if let Surface::Dielectric { ior, .. } = &mut material.surface {
            *ior += 0.02;
        }
    }
}

#[test]
fn every_scene_has_references_and_reasons() {
    let scenes = scenes();
    let files: BTreeSet<String> = fs::read_dir(SCENES)
        .expect("scenes")
        .filter_map(|entry| Some(entry.ok()?.file_name().to_str()?.strip_suffix(".toml")?.to_owned()))
        .collect();
    assert_eq!(files, scenes.keys().cloned().collect(), "every scene has a section in budgets.json");
    assert!(scenes.len() >= 16, "{}", scenes.len());
    assert!(scenes.values().filter(|scene| scene.povray.is_some()).count() >= 8);
    for (name, scene) in &scenes {
        for peer in PEERS {
            let Some(budget) = scene.budget(peer) else { continue };
            assert!(budget.why.len() > 10, "{name}: why this budget against {peer}?");
            let file = reference(name, peer).with_extension("json");
            let text = fs::read_to_string(&file).expect("manifest");
            let manifest: Manifest = serde_json::from_str(&text).expect("manifest");
            let (_, settings) = load(name, 2);
            assert_eq!((manifest.size, manifest.bounces), (settings.size, settings.bounces), "{name}");
            assert!(!manifest.program.is_empty() && manifest.samples > 0, "{name}");
            if peer == "povray" {
                assert!(manifest.notes.is_empty(), "{name}: {:?}", manifest.notes);
            }
        }
    }
}
