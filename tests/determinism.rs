//! The same bits whatever the number of threads and the trees, on scenes that use everything: lens, glass, textures, environment maps.

use std::path::Path;

use rayo::{
    accel::Quality,
    compile::{Scene, compile},
    import::assemble,
    integrator::Rims,
    render::{self, Monitor, Settings},
    scene,
};

/// Every sum and count of the film, as bits.
fn film(name: &str, threads: usize, seed: u64) -> Vec<u64> {
    film_of(name, |settings| Settings { threads: Some(threads), seed, ..settings })
}

fn compiled(name: &str, change: impl Fn(Settings) -> Settings) -> (Scene, Settings) {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes").join(name);
    let scene = scene::load(&file).unwrap_or_else(|all| panic!("{all:?}"));
    let (world, settings, _) = assemble(scene).unwrap_or_else(|all| panic!("{all:?}"));
    let settings = change(Settings { size: [60, 40], samples: 24, ..settings });
    (compile(world, &settings), settings)
}

fn film_of(name: &str, change: impl Fn(Settings) -> Settings) -> Vec<u64> {
    let (scene, settings) = compiled(name, change);
    let rendering = render::render(&scene, &settings, &Monitor::default()).expect("rendered");
    let film = rendering.film;
    let pixels = film.pixels().iter().enumerate();
    pixels
        .flat_map(|(i, p)| {
            let variance = film.variance(i).unwrap_or_default().as_vec3();
            let floats = [film.radiance(i).to_array(), variance.to_array()].concat();
            floats.into_iter().map(|f| u64::from(f.to_bits())).chain([p.kept().into(), p.dropped().into()])
        })
        .collect()
}

#[test]
fn pictures_do_not_depend_on_the_number_of_threads() {
    for name in ["cover.toml", "cornell.toml", "still-life.toml", "street.toml"] {
        let one = film(name, 1, 0);
        assert!(one == film(name, 2, 0), "{name}: 2 threads differ from 1");
        assert!(one == film(name, 7, 0), "{name}: 7 threads differ from 1");
        assert!(one != film(name, 1, 1), "{name}: another seed gives another picture");
    }
}

/// One of those above has rims of lamps.
#[test]
fn street_has_rims() {
    let (scene, settings) = compiled("street.toml", |settings| settings);
    let (rims, _) = Rims::find(&scene, &settings, &Monitor::default(), &|| false);
    assert!(rims.count() > 0);
}

#[test]
fn pictures_do_not_depend_on_the_trees() {
    for name in ["cover.toml", "still-life.toml"] {
        let with = |bvh| film_of(name, |settings| Settings { bvh: Some(bvh), ..settings });
        let fast = with(Quality::Fast);
        assert!(fast == with(Quality::Balanced), "{name}: balanced differs from fast");
        assert!(fast == with(Quality::Best), "{name}: best differs from fast");
    }
}

/// A layer whose factor is zero is as one that is not named, to the bit, in what carries caustics too.
#[test]
fn layers_of_no_weight_do_not_change_the_picture() {
    let film = |layers: &str| {
        let text = format!(
            r#"
            [camera]
            position = [0, 1, 4]
            target = [0, 1, 0]
            [environment]
            type = "color"
            color = 0.1
            [materials]
            floor = {{ type = "diffuse", color = 0.5 }}
            metal = {{ type = "pbr", base_color = [0.9, 0.6, 0.3], metallic = 1, roughness = 0.1 {layers} }}
            lamp = {{ type = "emissive", color = 20 }}
            [[quad]]
            origin = [-3, 0, 3]
            u = [6, 0, 0]
            v = [0, 0, -6]
            material = "floor"
            [[quad]]
            origin = [-0.3, 3, -0.3]
            u = [0.6, 0, 0]
            v = [0, 0, 0.6]
            material = "lamp"
            [[sphere]]
            center = [0, 1, 0]
            radius = 0.8
            material = "metal"
            "#
        );
        let folder = tempfile::tempdir().expect("a folder");
        let file = folder.path().join("scene.toml");
        std::fs::write(&file, text).expect("written");
        film_of(file.to_str().expect("a name"), |settings| settings)
    };
    let plain = film("");
    let nothing = "clearcoat = { factor = 0 }, sheen = { color = 0 }, transmission = 0, anisotropy = { strength = 0 }, \
                   iridescence = { factor = 0 }, diffuse_transmission = { factor = 0 }";
    assert!(plain == film(&format!(", {nothing}")), "no layer is there");
    assert!(plain != film(", clearcoat = { factor = 0.01 }"), "a faint one is");
}
