//! The environment: as it is seen, and as light on surfaces.
//!
//! What rays that leave the scene see is exact: POV-Ray looks an equirectangular map up at u = atan2(z, x) / 2π, half
//! a turn from here, and `rotate y*θ` lowers atan2(z, x) by θ.
//!
//! Without radiosity a sky gives no light to diffuse surfaces. So it is cut into regions of equal power, each of which
//! becomes a distant light from its centroid (Debevec 2005, *A Median Cut Algorithm for Light Probe Sampling*).

use std::f32::consts::{PI, TAU};

use glam::Vec3;

use super::{
    light::parallel,
    picture::Pictures,
    sdl::{num, num64, rgb},
};
use crate::{
    color::luminance,
    export::{Error, bitmap, note::Notes},
    world::{Environment, EnvironmentKind, Image, World},
};

/// Halvings of the sky: 2⁷ lights. All are asked at every sample.
const CUTS: u32 = 7;
/// Cells of the sky that is cut.
const COLUMNS: usize = 512;
const ROWS: usize = 256;
/// Units; farther than anything and nearer than POV-Ray's horizon of 10⁷.
const FAR: f32 = 4e6;

/// The sky as it is seen.
pub fn sphere(world: &World, pictures: &mut Pictures, notes: &mut Notes) -> Result<String, Error> {
    let environment = &world.environment;
    if is_black(environment) {
        return Ok(String::new());
    }
    let strength = environment.strength;
    let pigment = match environment.kind {
        EnvironmentKind::Color(color) => format!("pigment {{ {} }}", rgb(color * strength)),
        // The pattern starts again at 1: the blend reaches a little farther than the zenith.
        EnvironmentKind::Gradient { bottom, top } => format!(
            "pigment {{ gradient y color_map {{ [0 {}] [1 {}] }} scale 2.000002 translate -1.000001*y }}",
            rgb(bottom * strength),
            rgb(top * strength)
        ),
        EnvironmentKind::Image { image, color_space } => {
            let map = pictures.sky(image, color_space)?;
            let turn = 180.0 + f64::from(environment.rotation).to_degrees();
            let strength = num(strength);
            format!(
                "pigment {{ image_map {{ {map} map_type 1 interpolate 2 }} rotate y*{} }} emission {strength}",
                num64(turn)
            )
        }
    };
    let mut out = format!("sky_sphere {{ {pigment} }}\n");
    if !environment.visible {
        // Mirrors see past it.
        out.push_str(&format!(
            "sphere {{ 0, {} pigment {{ rgb 0 }} finish {{ diffuse 0 }} no_reflection no_shadow hollow }}\n",
            num(FAR)
        ));
        notes.approximated("the environment", "not seen through glass either");
    }
    Ok(out)
}

/// The sky as light on surfaces.
pub fn dome(world: &World, notes: &mut Notes) -> String {
    let environment = &world.environment;
    if is_black(environment) {
        return String::new();
    }
    let grid = Grid::new(environment, &world.model.images);
    let mut regions = vec![[0, COLUMNS, 0, ROWS]];
    for _ in 0..CUTS {
        regions = regions.into_iter().flat_map(|region| grid.halves(region)).collect();
    }
    notes.approximated(
        "the environment",
        format!(
            "{} distant lights, each with the power of a region of the sky from the middle of the region: shadows have \
             as many steps",
            regions.len()
        ),
    );
    let mut out = String::new();
    for region in regions {
        let (towards, irradiance) = grid.light(region);
        if irradiance.max_element() > 0.0 {
            out.push_str(&parallel(towards, irradiance));
        }
    }
    out
}

pub fn is_black(environment: &Environment) -> bool {
    let black = |c: Vec3| c.max_element() <= 0.0;
    environment.strength <= 0.0
        || match environment.kind {
            EnvironmentKind::Color(color) => black(color),
            EnvironmentKind::Gradient { bottom, top } => black(bottom) && black(top),
            EnvironmentKind::Image { .. } => false,
        }
}

/// Radiance × solid angle of the cells of an equirectangular map.
struct Grid {
    cells: Vec<Vec3>,
    rotation: f32,
}

impl Grid {
    fn new(environment: &Environment, images: &[Image]) -> Self {
        let mut cells = vec![Vec3::ZERO; COLUMNS * ROWS];
        let solid_angle = |row: usize| {
            let edge = |i: usize| (i as f32 / ROWS as f32 * PI).cos();
            (edge(row) - edge(row + 1)) * TAU / COLUMNS as f32
        };
        for (row, line) in cells.chunks_mut(COLUMNS).enumerate() {
            let y = ((row as f32 + 0.5) / ROWS as f32 * PI).cos();
            match environment.kind {
                EnvironmentKind::Color(color) => line.fill(color),
                EnvironmentKind::Gradient { bottom, top } => line.fill(bottom.lerp(top, 0.5 * (y + 1.0))),
                EnvironmentKind::Image { image, color_space } => {
                    let Some(image) = images.get(image.index()) else { continue };
                    for (column, cell) in line.iter_mut().enumerate() {
                        *cell =
                            mean(image, column, row, |i| bitmap::linear(image, color_space, i).truncate());
                    }
                }
            }
            for cell in line {
                *cell *= environment.strength * solid_angle(row);
                if !cell.is_finite() {
                    *cell = Vec3::ZERO;
                }
            }
        }
        let rotates = matches!(environment.kind, EnvironmentKind::Image { .. });
        Self { cells, rotation: if rotates { environment.rotation } else { 0.0 } }
    }

    fn power(&self, [x0, x1, y0, y1]: [usize; 4]) -> f32 {
        let row = |y: usize| self.cells.get(y * COLUMNS + x0..y * COLUMNS + x1).unwrap_or_default();
        (y0..y1).map(|y| row(y).iter().map(|&c| luminance(c)).sum::<f32>()).sum()
    }

    /// Cut across its longer side.
    fn halves(&self, region: [usize; 4]) -> Vec<[usize; 4]> {
        let [x0, x1, y0, y1] = region;
        let middle = 0.5 * (y0 + y1) as f32 / ROWS as f32 * PI;
        let wide = (x1 - x0) as f32 * middle.sin() > (y1 - y0) as f32;
        let across = if (wide || y1 - y0 < 2) && x1 - x0 > 1 { 0 } else { 2 };
        let (from, to) = (region[across], region[across + 1]);
        if to - from < 2 {
            return vec![region];
        }
        let total = self.power(region);
        let (mut below, mut cut) = (0.0, from);
        while cut < to - 1 && (cut == from || below < 0.5 * total) {
            let mut line = region;
            (line[across], line[across + 1]) = (cut, cut + 1);
            below += self.power(line);
            cut += 1;
        }
        let (mut first, mut second) = (region, region);
        first[across + 1] = cut;
        second[across] = cut;
        vec![first, second]
    }

    /// Where its light comes from, and the irradiance on what faces it.
    fn light(&self, [x0, x1, y0, y1]: [usize; 4]) -> (Vec3, Vec3) {
        let (mut towards, mut sum) = (Vec3::ZERO, Vec3::ZERO);
        for y in y0..y1 {
            let (sin, cos) = ((y as f32 + 0.5) / ROWS as f32 * PI).sin_cos();
            for x in x0..x1 {
                let phi = ((x as f32 + 0.5) / COLUMNS as f32 - 0.5) * TAU - self.rotation;
                let cell = self.cells.get(y * COLUMNS + x).copied().unwrap_or_default();
                towards += luminance(cell) * Vec3::new(sin * phi.cos(), cos, sin * phi.sin());
                sum += cell;
            }
        }
        (towards.normalize_or(Vec3::Y), sum)
    }
}

/// Of the texels under a cell; of the nearest one where the image is coarser.
fn mean(image: &Image, column: usize, row: usize, texel: impl Fn(usize) -> Vec3) -> Vec3 {
    let (width, height) = (image.width.max(1) as usize, image.height.max(1) as usize);
    let range = |i: usize, cells: usize, size: usize| {
        let from = (i * size / cells).min(size - 1);
        from..((i + 1) * size / cells).clamp(from + 1, size)
    };
    let (mut sum, mut count) = (Vec3::ZERO, 0.0);
    for y in range(row, ROWS, height) {
        for x in range(column, COLUMNS, width) {
            let color = texel(y * width + x);
            if color.is_finite() {
                sum += color.max(Vec3::ZERO);
            }
            count += 1.0;
        }
    }
    sum / count
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grid(kind: EnvironmentKind, rotation: f32) -> Grid {
        Grid::new(&Environment { kind, strength: 2.0, rotation, visible: true }, &[])
    }

    #[test]
    fn no_light_is_lost_in_the_cuts() {
        let sky = grid(EnvironmentKind::Gradient { bottom: Vec3::ZERO, top: Vec3::new(1.0, 2.0, 4.0) }, 0.0);
        let mut regions = vec![[0, COLUMNS, 0, ROWS]];
        for _ in 0..CUTS {
            regions = regions.into_iter().flat_map(|r| sky.halves(r)).collect();
        }
        assert_eq!(regions.len(), 1 << CUTS);
        let sum: Vec3 = regions.iter().map(|&r| sky.light(r).1).sum();
        assert!((sum / (4.0 * PI)).abs_diff_eq(Vec3::new(1.0, 2.0, 4.0), 0.01), "{sum}");
        // irradiance from above: ∫ (1 + y) y over the upper half = 2π (1/2 + 1/3)
        let up: f32 = regions.iter().map(|&r| sky.light(r)).map(|(w, e)| w.y.max(0.0) * e.x).sum();
        assert!((up / (2.0 * PI * (0.5 + 1.0 / 3.0)) - 1.0).abs() < 0.02, "{up}");
    }
}
