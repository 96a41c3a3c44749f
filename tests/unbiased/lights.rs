//! Choosing among many lamps of all kinds leaves the mean alone. Light adds up: the lamps that have a surface are found by the
//! scattered rays alone, with nothing chosen, and every lamp without one lights a picture of its own.

use rayo::light::Lights;

use super::{BOX, PLAIN, Shown, Way, assert_same, metals, show, show_changed};

const LIT: &str = r#"lamp = { type = "emissive", color = [12, 10, 8] }"#;
const UNLIT: &str = r#"lamp = { type = "diffuse", color = [0, 0, 0] }"#;

const BRIGHT: &str = "radiance = 8";
const DARK: &str = "radiance = 0";

const POINT: &str = "[[light]]\ntype = \"point\"\nposition = [0.9, 1.2, 0.9]\nintensity = 1.5\n";
const SPOT: &str =
    "[[light]]\ntype = \"spot\"\nposition = [-1, 2, 1]\ntarget = [0, 0, 0]\nintensity = 6\nouter = 30\n";

/// A rectangle, a parallelogram, disks, balls, and two instances of a mesh, each of 80 triangles.
fn surfaces() -> String {
    let mut text = String::new();
    for (x, z, v) in [(-1.3, -0.8, "[0, 0, 0.5]"), (-1.3, 0.6, "[0.3, 0.2, 0.4]")] {
        text +=
            &format!("[[quad]]\norigin = [{x}, 1.9, {z}]\nu = [0.5, 0, 0]\nv = {v}\nmaterial = \"lamp\"\n");
    }
    for (x, y, z, target) in
        [(0.9, 1.9, -0.4, "[0.6, 0, 0]"), (1.2, 0.4, 0.8, "[0.4, 0, 0.6]"), (-0.1, 0.3, 1.3, "[0, 0.2, 0]")]
    {
        text += &format!(
            "[[light]]\ntype = \"disk\"\nposition = [{x}, {y}, {z}]\ntarget = {target}\nradius = 0.3\n{BRIGHT}\n"
        );
    }
    for (x, y, z, radius) in [(-1.1, 0.3, 0.7, 0.25), (0.0, 1.6, 0.0, 0.2), (1.2, 0.9, -0.5, 0.25)] {
        text += &format!("[[sphere]]\ncenter = [{x}, {y}, {z}]\nradius = {radius}\nmaterial = \"lamp\"\n");
    }
    for (x, y, z, scale) in [(-0.2, 0.2, 1.0, 0.2), (-0.5, 1.4, -0.7, 0.3)] {
        text += &format!(
            "[[model]]\nfile = \"ball.obj\"\nscale = {scale}\ntranslate = [{x}, {y}, {z}]\nmaterial = \"lamp\"\n"
        );
    }
    text
}

fn sum(a: &Shown, b: &Shown) -> Shown {
    let blocks = a.blocks.iter().zip(&b.blocks).map(|(p, q)| (p.0 + q.0, p.1 + q.1)).collect();
    Shown { blocks, noise: f64::NAN }
}

#[test]
fn one_of_many_lamps() {
    let plastic = r#"{ type = "pbr", base_color = [0.4, 0.5, 0.6], roughness = 0.3 }"#;
    let metal = r#"{ type = "metal", color = [0.9, 0.8, 0.7], roughness = 0.4 }"#;
    let scene = |lights: &str| {
        metals(plastic, metal, &format!("{}{lights}", surfaces())).replace("bounces = 6", "bounces = 2")
    };
    let way = |samples, seed| Way { samples, seed, ..PLAIN };
    let chosen = show(&scene(&format!("{POINT}{SPOT}")), BOX, way(256, 20));
    let met = show_changed(&scene(""), BOX, way(2048, 21), |scene| {
        scene.lights = Lights::new(&[], scene.lights.environment().clone());
    });
    let alone = |light, seed| {
        let text = scene(light);
        assert!(text.contains(LIT) && text.contains(BRIGHT));
        show(&text.replace(LIT, UNLIT).replace(BRIGHT, DARK), BOX, way(256, seed))
    };
    let plain = sum(&met, &sum(&alone(POINT, 22), &alone(SPOT, 23)));
    assert_same("many lamps", &chosen, &plain);
}
