//! Whether Mitsuba renders what was exported for it, without complaint, to the radiance that the scene has. Needs `mitsuba` on
//! PATH, or a Python that has it, named by the environment variable `RAYO_PYTHON`; is skipped without.

use std::{
    fs,
    path::{Path, PathBuf},
    time::Duration,
};

use assert_cmd::Command;
use rayo::{
    export::Target,
    import::image::decode,
    validate::{Peer, Task},
    world::Texels,
};

const LIMIT: Duration = Duration::from_secs(120);

fn peer() -> Option<Peer> {
    let python = std::env::var_os("RAYO_PYTHON").map(PathBuf::from);
    match Peer::find(Target::Mitsuba, python.as_deref()) {
        Ok(peer) => Some(peer),
        Err(missing) => {
            println!("skipped: {missing}");
            None
        }
    }
}

fn rayo(folder: &Path, arguments: &[&str]) {
    Command::cargo_bin("rayo").expect("built").current_dir(folder).args(arguments).assert().success();
}

struct Picture {
    width: usize,
    texels: Vec<[f32; 3]>,
}

impl Picture {
    fn read(file: &Path) -> Self {
        let image = decode(&fs::read(file).expect("picture"), "picture").expect("decoded");
        let Texels::RgbF32(texels) = image.texels else { panic!("not float") };
        Self { width: image.width as usize, texels }
    }

    fn at(&self, x: usize, y: usize) -> [f32; 3] {
        self.texels[y * self.width + x]
    }
}

/// Mitsuba's picture and rayo's.
fn render(peer: &Peer, scene: &str, samples: u32) -> [Picture; 2] {
    let folder = tempfile::tempdir().expect("folder");
    let root = folder.path();
    fs::write(root.join("scene.toml"), scene).expect("written");
    fs::copy(
        Path::new(env!("CARGO_MANIFEST_DIR")).join("assets/tea-jar-base-color.png"),
        root.join("jar.png"),
    )
    .expect("copied");
    rayo(root, &["export", "scene.toml", "--to", "mitsuba", "-o", "out"]);
    let (out, picture) = (root.join("out"), root.join("peer.exr"));
    let run = peer
        .render(&Task { folder: &out, picture: &picture, samples, seed: 1, threads: None, limit: LIMIT })
        .expect("rendered");
    assert_eq!(run.complaints, Vec::<String>::new());
    rayo(root, &["render", "scene.toml", "-q", "-o", "ours.exr", "--samples", &samples.to_string()]);
    [Picture::read(&picture), Picture::read(&root.join("ours.exr"))]
}

const DOWN: &str = r#"
[render]
size = [8, 8]
bounces = 0
filter = { type = "box", width = 1 }
[camera]
position = [0, 1, 0]
target = [0, 0, 0]
up = [0, 0, -1]
ortho_height = 0.05
[materials]
half = { type = "diffuse", color = [0.5, 0.25, 1] }
[[quad]]
origin = [-10, 0, 10]
u = [20, 0, 0]
v = [0, 0, -20]
material = "half"
"#;

/// Lambert: radiance = albedo / π × irradiance.
#[test]
fn lamps_give_the_light_they_are_said_to() {
    let Some(peer) = peer() else { return };
    for (lamp, irradiance) in [
        ("type = 'point'\nposition = [0, 2, 0]\nintensity = 8", 2.0),
        ("type = 'spot'\nposition = [0, 2, 0]\nintensity = 8\ninner = 10\nouter = 30", 2.0),
        ("type = 'sun'\nelevation = 90\nirradiance = 3\nangle = 0", 3.0),
        ("type = 'sun'\nelevation = 30\nirradiance = 3\nangle = 2", 1.5),
        // π L sin² of the half-angle that a disk in the zenith has
        ("type = 'disk'\nposition = [0, 2, 0]\nradius = 2\nradiance = 1", std::f32::consts::FRAC_PI_2),
    ] {
        let [theirs, _] = render(&peer, &format!("{DOWN}\n[[light]]\n{lamp}\n"), 256);
        for (c, albedo) in [0.5, 0.25, 1.0].into_iter().enumerate() {
            let mean = theirs.texels.iter().map(|t| t[c]).sum::<f32>() / theirs.texels.len() as f32;
            let expected = albedo / std::f32::consts::PI * irradiance;
            assert!((mean / expected - 1.0).abs() < 0.01, "{lamp}: {mean}, not {expected}");
        }
    }
}

/// Everything that has a way round: camera, environment, UVs of quads and spheres, the front of emitters.
#[test]
fn all_is_the_right_way_round() {
    let Some(peer) = peer() else { return };
    let scene = r#"
[render]
size = [48, 32]
bounces = 0
filter = { type = "box", width = 1 }
[camera]
position = [0.5, 1.2, 4]
target = [0, 0.8, 0]
vfov = 60
[environment]
type = "image"
file = "jar.png"
rotation = 50
[materials]
glow = { type = "emissive", color = { image = "jar.png" }, strength = 2 }
mirror = { type = "metal", color = [0.9, 0.8, 0.5], fuzz = 0 }
[[sphere]]
center = [-1.5, 1, 0]
material = "glow"
[[quad]]
origin = [0, 0.2, 0]
u = [1.5, 0.2, 0.3]
v = [0, 1.2, -0.2]
material = "glow"
[[sphere]]
center = [0.9, 2.2, -0.5]
radius = 0.7
material = "mirror"
[[quad]]
origin = [2, 0, -1]
u = [-1, 0, 0]
v = [0, 1, 0]
material = "glow"
"#;
    let [theirs, ours] = render(&peer, scene, 256);
    let mut sums = [0.0; 2];
    for y in 0..32 {
        for x in 0..48 {
            let (a, b) = (theirs.at(x, y), ours.at(x, y));
            for c in 0..3 {
                sums[0] += (a[c] - b[c]).abs();
                sums[1] += b[c];
            }
        }
    }
    assert!(sums[0] / sums[1] < 0.03, "mean difference over mean: {}", sums[0] / sums[1]);
}
