use std::path::Path;

use super::parse;
use crate::diagnostic::{Diagnostic, Place, line_and_column};

#[test]
fn show() {
    let text = r##"
[render]
size = [0, 720]
samples = 0
nois = 0.1
noise = nan
time = "5 parsecs"
[camera]
position = [1, 2, 3]
target = [1, 2, 3]
vfov = 180
up = [0, 0, 0]
[materials.gold]
type = "metl"
[materials.red]
type = "diffuse"
color = [1, -2, "x"]
fuzz = 1
[materials.m]
type = "metal"
fuzz = 2
roughness = 0.5
[[sphere]]
radius = -1
material = "gild"
[[quad]]
origin = [0, 0, 0]
u = [1, 0, 0]
v = [2, 0, 0]
material = "gold"
[[model]]
file = "nothing.glb"
[[light]]
type = "point"
[output]
file = "x.png"
view = "agx"
depth = "half"
"##;
    let errors = parse(text, Path::new("scenes/test.toml")).unwrap_err();
    println!("{}", crate::diagnostic::render(&errors, false));
}
