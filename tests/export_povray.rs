//! What POV-Ray makes of an export, against closed forms. Where there is no `povray` on the PATH, nothing is tested.

use std::{
    f64::consts::PI,
    fs,
    process::{Command, Stdio},
};

use assert_cmd::cargo::cargo_bin;
use exr::prelude::read_first_rgba_layer_from_file;

type Picture = Vec<Vec<[f64; 3]>>;

fn has_povray() -> bool {
    let found =
        Command::new("povray").arg("--version").stdout(Stdio::null()).stderr(Stdio::null()).status().is_ok();
    if !found {
        eprintln!("skipped: there is no povray on the PATH");
    }
    found
}

/// Exports the scene, lets POV-Ray render it from another folder, and checks that neither says anything. `exact`: that
/// there is nothing to say about the scene either.
fn rendered(scene: &str, exact: bool) -> Picture {
    let folder = tempfile::tempdir().expect("folder");
    let file = folder.path().join("scene.toml");
    fs::write(&file, scene).expect("written");
    let mut rayo = Command::new(cargo_bin("rayo"));
    rayo.arg("export").arg(&file).args(["--to", "povray", "--quiet", "-o"]).arg(folder.path().join("out"));
    if exact {
        rayo.arg("--strict");
    }
    let output = rayo.output().expect("runs");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let output = Command::new("povray")
        .args(["scene.ini", "+O../picture.exr", "+WT2"])
        .current_dir(folder.path().join("out"))
        .output()
        .expect("povray runs");
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{said}");
    for line in said.lines().filter(|line| !line.contains("Stream")) {
        let line = line.to_lowercase();
        assert!(!line.contains("warning") && !line.contains("error"), "{said}");
    }
    let read = read_first_rgba_layer_from_file(
        folder.path().join("picture.exr"),
        |size, _| vec![vec![[0.0; 3]; size.width()]; size.height()],
        |picture: &mut Picture, at, (r, g, b, _): (f32, f32, f32, f32)| {
            picture[at.y()][at.x()] = [r, g, b].map(f64::from);
        },
    );
    read.expect("a picture").layer_data.channel_data.pixels
}

/// Looks at a grey floor from above: 8 m of it, or `height` metres; x runs to the right, z down.
fn floor(rest: &str, size: u32, height: f32) -> String {
    format!(
        "[render]\nsize = [{size}, {size}]\nsamples = 1\nbounces = {{ total = 2, diffuse = 0 }}\nfilter = \"box\"\n\
         [camera]\nposition = [0, 10, 0]\ntarget = [0, 0, 0]\nup = [0, 0, -1]\northo_height = {height}\n\
         [materials]\nfloor = {{ type = \"diffuse\", color = 0.8 }}\n\
         [[quad]]\norigin = [-20, 0, 20]\nu = [40, 0, 0]\nv = [0, 0, -40]\nmaterial = \"floor\"\n{rest}"
    )
}

#[track_caller]
fn near(value: f64, expected: f64, relative: f64) {
    assert!((value - expected).abs() <= relative * expected.abs().max(1e-6), "{value} is not {expected}");
}

#[test]
fn suns_points_and_spots_light_a_floor() {
    if !has_povray() {
        return;
    }
    let sun = "[[light]]\ntype = \"sun\"\ndirection = [1, -1, 0]\nangle = 0\nirradiance = [1, 2, 3]\n";
    let sun = sun.replace("irradiance = [1, 2, 3]", "irradiance = 3\ncolor = [1, 0.5, 0.25]");
    let [r, g, b] = rendered(&floor(&sun, 4, 2.0), true)[1][2];
    let lit = 0.8 / PI * 3.0 * 0.5f64.sqrt();
    near(r, lit, 1e-3);
    near(g, 0.5 * lit, 1e-3);
    near(b, 0.25 * lit, 1e-3);

    let point = "[[light]]\ntype = \"point\"\nposition = [1, 2, 0]\nintensity = 10\n";
    let picture = rendered(&floor(point, 16, 8.0), true);
    for (x, column) in (0..16).map(|i| ((i as f64 + 0.5) * 0.5 - 4.0, i)) {
        let squared = (x - 1.0).powi(2) + 4.0 + 0.25 * 0.25;
        near(picture[8][column][0], 0.8 / PI * 10.0 * 2.0 / squared.powf(1.5), 2e-3);
    }

    for (inner, outer) in [(20.0f64, 20.0f64), (10.0, 30.0), (0.0, 40.0)] {
        let spot = format!(
            "[[light]]\ntype = \"spot\"\nposition = [0, 4, 0]\ndirection = [0, -1, 0]\nintensity = 10\ninner = {inner}\n\
             outer = {outer}\n"
        );
        let picture = rendered(&floor(&spot, 32, 8.0), true);
        for (x, column) in (0..32).map(|i| ((i as f64 + 0.5) * 0.25 - 4.0, i)) {
            let squared: f64 = x * x + 16.0 + 0.125 * 0.125;
            let cos = 4.0 / squared.sqrt();
            let [ci, co] = [inner, outer].map(|a| a.to_radians().cos());
            let share =
                if ci > co { ((cos - co) / (ci - co)).clamp(0.0, 1.0) } else { (cos > co) as u8 as f64 };
            let expected = 0.8 / PI * 10.0 * cos / squared * share * share;
            let value = picture[16][column][0];
            assert!(
                (value - expected).abs() < 1e-3 * 0.16,
                "{inner} to {outer}° at {x}: {value} is not {expected}"
            );
        }
    }
}

/// Lambert's formula for a polygon: E = L / 2 Σ angle between corners × (normal of the side) · n.
fn polygon(corners: [[f64; 3]; 4]) -> f64 {
    let unit = corners.map(|c| {
        let length = c.iter().map(|x| x * x).sum::<f64>().sqrt();
        c.map(|x| x / length)
    });
    let side = |i: usize| {
        let (a, b) = (unit[i], unit[(i + 1) % 4]);
        let dot: f64 = a.iter().zip(b).map(|(x, y)| x * y).sum();
        let cross = [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
        let length = cross.iter().map(|x| x * x).sum::<f64>().sqrt();
        dot.acos() * cross[1] / length
    };
    0.5 * (0..4).map(side).sum::<f64>().abs()
}

#[test]
fn lights_with_area_light_a_floor_and_show_their_front() {
    if !has_povray() {
        return;
    }
    let rect =
        "[[light]]\ntype = \"rect\"\norigin = [-1, 1.5, -0.5]\nu = [2, 0, 0]\nv = [0, 0, 1]\nradiance = 5\n";
    let below = floor(rect, 8, 4.0).replace("position = [0, 10, 0]", "position = [0, 1, 0]");
    let picture = rendered(&below, false);
    for (x, column) in (0..8).map(|i| ((i as f64 + 0.5) * 0.5 - 2.0, i)) {
        let corner = |a: f64, b: f64| [a - x, 1.5, b - 0.25];
        let form = polygon([corner(-1.0, -0.5), corner(1.0, -0.5), corner(1.0, 0.5), corner(-1.0, 0.5)]);
        near(picture[4][column][0], 0.8 / PI * 5.0 * form, 0.02);
    }
    // Its back is black, and over it there is no light.
    near(rendered(&floor(rect, 4, 0.5), false)[2][2][0], 0.0, 0.0);

    let sphere = "[[light]]\ntype = \"sphere\"\ncenter = [0, 2, 0]\nradius = 0.5\nradiance = 5\n";
    let below = floor(sphere, 8, 4.0).replace("position = [0, 10, 0]", "position = [0, 1, 0]");
    let picture = rendered(&below, false);
    for (x, column) in (0..8).map(|i| ((i as f64 + 0.5) * 0.5 - 2.0, i)) {
        let squared: f64 = x * x + 4.0 + 0.25 * 0.25;
        near(picture[4][column][0], 0.8 * 5.0 * 0.25 * 2.0 / squared.powf(1.5), 0.01);
    }
}

const SKY: &str = "[environment]\ntype = \"color\"\ncolor = [1, 0.5, 2]\n";

fn ball(material: &str, size: u32, height: f32) -> String {
    format!(
        "[render]\nsize = [{size}, {size}]\nsamples = 1\nbounces = {{ total = 8, diffuse = 0 }}\nfilter = \"box\"\n\
         [camera]\nposition = [0, 0, 10]\ntarget = [0, 0, 0]\northo_height = {height}\n{SKY}\
         [materials]\nit = {{ {material} }}\n[[sphere]]\nradius = 1\nmaterial = \"it\"\n"
    )
}

#[test]
fn mirrors_tint_and_glass_keeps_what_it_is_given() {
    if !has_povray() {
        return;
    }
    let plain = rendered(&ball("type = \"metal\", color = [0.9, 0.6, 0.3]", 2, 0.01), true)[0][0];
    for (value, expected) in plain.into_iter().zip([0.9, 0.3, 0.6]) {
        near(value, expected, 1e-3);
    }
    // Schlick's curve at 60°, where the sphere is seen 0.866 off its middle.
    let schlick = rendered(&ball("type = \"metal\", color = 0.5, roughness = 0", 200, 2.0), true);
    let [x, y] = [186.5 / 100.0 - 1.0, 0.5 / 100.0];
    let cos = (1.0f64 - x * x - y * y).sqrt();
    near(schlick[100][186][0], 0.5 + 0.5 * (1.0 - cos).powi(5), 2e-3);

    // In a furnace glass cannot be seen, whatever its index; grey glass takes its tint at each of two surfaces.
    let glass = rendered(&ball("type = \"dielectric\", ior = 1.7", 16, 1.8), true);
    near(glass[3][5][0], 1.0, 2e-3);
    let grey = rendered(&ball("type = \"dielectric\", ior = 1.5, color = 0.5", 2, 0.01), true)[0][0][0];
    let f = 0.04;
    // reflected once; through; through after 2, 3, … inner reflections, each with the tint
    let expected = 0.5 * f + 0.25 * (1.0f64 - f).powi(2) / (1.0 - 0.5 * f);
    near(grey, expected, 2e-3);
}

#[test]
fn the_picture_is_not_mirrored_and_edges_are_where_they_belong() {
    if !has_povray() {
        return;
    }
    // An L of three spheres: red in the corner, green to its right, blue above; each of radius 0.5.
    let mut scene = String::from(
        "[render]\nsize = [90, 60]\nsamples = 81\nbounces = 0\nfilter = \"box\"\n\
         [camera]\nposition = [1.5, 1, 10]\ntarget = [1.5, 1, 0]\northo_height = 6\n\
         [materials]\nred = { type = \"unlit\", color = [100, 0, 0] }\n\
         green = { type = \"unlit\", color = [0, 100, 0] }\nblue = { type = \"unlit\", color = [0, 0, 100] }\n",
    );
    for (name, x, y) in [("red", 0.0, 0.0), ("green", 2.5, 0.0), ("blue", 0.0, 2.5)] {
        scene.push_str(&format!("[[sphere]]\ncenter = [{x}, {y}, 0]\nradius = 0.5\nmaterial = \"{name}\"\n"));
    }
    let picture = rendered(&scene, true);
    let at = |x: f64, y: f64| ((x - 1.5) * 10.0 + 45.0, 30.0 - (y - 1.0) * 10.0);
    for (channel, x, y) in [(0, 0.0, 0.0), (1, 2.5, 0.0), (2, 0.0, 2.5)] {
        let (mut sum, mut sum_x, mut sum_y) = (0.0, 0.0, 0.0);
        for (row, line) in picture.iter().enumerate() {
            for (column, pixel) in line.iter().enumerate() {
                sum += pixel[channel];
                sum_x += pixel[channel] * (column as f64 + 0.5);
                sum_y += pixel[channel] * (row as f64 + 0.5);
            }
        }
        // The area, to a hundredth, of an edge from radiance 100 to 0: pixels are linear means.
        near(sum / 100.0, PI * 25.0, 0.01);
        let (wanted_x, wanted_y) = at(x, y);
        assert!((sum_x / sum - wanted_x).abs() < 0.03, "channel {channel}: x {}", sum_x / sum);
        assert!((sum_y / sum - wanted_y).abs() < 0.03, "channel {channel}: y {}", sum_y / sum);
    }
}
