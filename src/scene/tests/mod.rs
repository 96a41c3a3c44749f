//! What scene files mean, and what is said about wrong ones.

mod bad;
mod documents;
mod good;
mod mutated;
mod schema;

use std::path::Path;

use super::{ValidScene, parse};
use crate::diagnostic::{Diagnostic, Place, line_and_column, render};

/// A scene that uses every section.
const GOOD: &str = r##"
#:schema rayo.schema.json
[render]
size = [640, 360]
samples = 64
noise = 0.01
time = "1h30m"
bounces = { total = 12, diffuse = 0 }
seed = 7
threads = 3
filter = { type = "gaussian", width = 2.5 }
crop = [10, 20, 300, 200]
[camera]
position = [13, 2, 3]
target = [0, 0.5, 0]
up = [0, 1, 0]
vfov = 20
aperture = 0.1
focus = 10.0
[environment]
type = "gradient"
bottom = 1
top = [0.5, 0.7, 1.0]
strength = 0.5
visible = false
[materials.ground]
type = "diffuse"
color = "#808080"
[materials.gold]
type = "metal"
color = [1.0, 0.78, 0.34]
roughness = 0.3
fresnel = "constant"
multiscatter = false
[materials.fuzzy]
type = "metal"
fuzz = 0.1
[materials.glass]
type = "dielectric"
ior = 1.5
fresnel = "schlick"
roughness = 0.1
color = 0.9
[materials.lamp]
type = "emissive"
color = [15, 15, 15]
strength = 2
two_sided = true
[materials.paint]
type = "pbr"
base_color = [0.8, 0.1, 0.1]
metallic = 0.5
roughness = 0.2
opacity = 0.5
[materials.car]
type = "pbr"
specular = { factor = 0.9, color = [1.5, 1, 1] }
clearcoat = { factor = 0.8, roughness = 0.1 }
sheen = { color = "#804020", roughness = 0.3 }
iridescence = { factor = 0.7, ior = 1.4, thickness = 350 }
anisotropy = { strength = 0.6, rotation = 45 }
[materials.jade]
type = "pbr"
transmission = 0.9
volume = { attenuation_color = [0.2, 0.8, 0.4], attenuation_distance = 0.05 }
abbe_number = 40
diffuse_transmission = { factor = 0.25, color = 0.5 }
[materials.sign]
type = "unlit"
color = "#f00"
[[quad]]
origin = [-5, 0, 5]
u = [10, 0, 0]
v = [0, 0, -10]
material = "ground"
[[sphere]]
center = [0, 1, 0]
radius = 1
material = "glass"
[[light]]
type = "point"
position = [0, 3, 0]
power = 100
[[light]]
type = "spot"
position = [0, 3, 0]
target = [0, 0, 0]
inner = 10
outer = 20
[[light]]
type = "sun"
azimuth = 90
elevation = 30
angle = 0
[[light]]
type = "rect"
position = [0, 4, 0]
size = [2, 1]
power = 50
[[light]]
type = "disk"
position = [0, 4, 0]
radius = 0.25
radiance = 3
[[light]]
type = "sphere"
center = [0, 5, 0]
radius = 0.5
power = 10
[output]
file = "cover.exr"
view = "raw"
exposure = -1.5
depth = "float"
"##;

/// Where files that are not there are looked for.
const FILE: &str = "scenes/test.toml";

fn good(text: &str) -> ValidScene {
    parse(text, Path::new(FILE)).unwrap_or_else(|errors| panic!("{}", render(&errors, false)))
}

fn errors(text: &str) -> Vec<Diagnostic> {
    parse(text, Path::new(FILE)).expect_err("has errors")
}

/// Line and column, counted from 1.
fn position(diagnostic: &Diagnostic) -> (usize, usize) {
    match &diagnostic.place {
        Place::Span { source, range } => line_and_column(source, range.start),
        _ => (0, 0),
    }
}
