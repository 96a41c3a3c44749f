//! An equirectangular map of radiance: lookup and importance sampling.
//!
//! Direction d (unrotated) meets the map at u = 0.5 + atan2(d.z, d.x) / 2π, v = acos(d.y) / π with v = 0 at the top
//! row. Radiance is bilinear between the texels' middles; it wraps in u, and in v it is constant between a pole and
//! the middle of the row next to it.
//!
//! Drawn from is the excess: what a texel's luminance has above half the mean of the map. A draw picks a cell *between* the
//! middles of four texels in proportion to its mean excess × its solid angle, then a point in it in proportion to the
//! bilinear excess. So the density is
//!
//! ```text
//! p(ω) = Y(ω) s / (N sin θ)
//! ```
//!
//! with Y the bilinear excess, s the mean of sin θ over the row of cells and N the sum of the
//! cells' weights: nearly proportional to the excess everywhere, and 0 only where there is none. The two polar
//! rows are uniform in solid angle along v (s = sin θ). Source of the warp: Pharr, Jakob, Humphreys, *Physically
//! Based Rendering*, 4th ed., section 12.5 and appendix A.5; the grid between texels is what makes it exact here.

use std::f32::consts::{PI, TAU};

use glam::{Vec2, Vec3};
use rayon::prelude::*;

use super::{EnvironmentSample, environment::NEGLECTED};
use crate::{
    color::{luminance, srgb_decode},
    sampling::distribution::{Grid, linear},
    world::{ColorSpace, Image, Texels},
};

#[derive(Clone, Debug)]
pub struct Map {
    width: usize,
    height: usize,
    /// Radiance, row by row from the top.
    texels: Vec<[f32; 3]>,
    /// Added to atan2(d.z, d.x) before the lookup, radians.
    rotation: f32,
    /// Mean luminance over the sphere.
    mean: f32,
    sampling: Option<Sampling>,
}

/// None where the map is black.
#[derive(Clone, Debug)]
struct Sampling {
    /// `width` × `height + 1` cells: cell (x, y) lies between the middles of texel columns x and x + 1, and of texel
    /// rows y − 1 and y.
    grid: Grid,
    /// s / N of a row of cells (1 / N at the poles).
    density: Vec<f32>,
}

impl Map {
    /// Decodes `image` and multiplies it by `strength`. Texels that come out negative or not finite become black;
    /// the second value counts them. `None` where the image has no texels, or not as many as its size says.
    pub fn new(
        image: &Image,
        color_space: ColorSpace,
        strength: f32,
        rotation: f32,
    ) -> Option<(Self, usize)> {
        let (width, height) = (image.width as usize, image.height as usize);
        let mut texels = linear_texels(&image.texels, color_space);
        if texels.is_empty() || width.checked_mul(height) != Some(texels.len()) {
            return None;
        }
        let dropped = texels
            .par_iter_mut()
            .map(|texel| {
                let [r, g, b] = *texel;
                *texel = [r * strength, g * strength, b * strength];
                let usable = texel.iter().all(|c| c.is_finite() && *c >= 0.0);
                if !usable {
                    *texel = [0.0; 3];
                }
                !usable as usize
            })
            .sum();
        let mut map = Self { width, height, texels, rotation, mean: 0.0, sampling: None };
        (map.mean, map.sampling) = map.tabulate();
        Some((map, dropped))
    }

    pub fn radiance(&self, direction: Vec3) -> Vec3 {
        let at = self.locate(direction);
        blend(&self.corners(at.column, at.row), at.fraction)
    }

    /// Mean luminance over the sphere.
    pub fn mean_luminance(&self) -> f32 {
        self.mean
    }

    /// Mean excess over the sphere.
    pub fn mean_excess(&self) -> f32 {
        self.sampling.as_ref().map_or(0.0, |s| (s.grid.total() / (2.0 * TAU as f64)) as f32)
    }

    /// `None` where the map is black.
    pub fn sample(&self, u: Vec2) -> Option<EnvironmentSample> {
        let sampling = self.sampling.as_ref()?;
        let cell = sampling.grid.sample(u);
        let corners = self.corners(cell.column, cell.row);
        let [a, b, c, d] = self.excess(&corners);
        let y = linear(cell.u.y, a + b, c + d);
        let x = linear(cell.u.x, a + y * (c - a), b + y * (d - b));
        let (sin, cos) = self.polar(cell.row, y);
        let phi = (((cell.column as f32 + 0.5 + x) / self.width as f32) - 0.5) * TAU - self.rotation;
        let at = Vec2::new(x, y);
        let (radiance, pdf) = (blend(&corners, at), self.density(cell.row, sin, &corners, at));
        let wi = Vec3::new(sin * phi.cos(), cos, sin * phi.sin());
        (pdf > 0.0 && pdf.is_finite()).then_some(EnvironmentSample { wi, radiance, pdf })
    }

    /// Radiance, and the solid-angle density of [`sample`](Self::sample), sr⁻¹.
    pub fn look(&self, direction: Vec3) -> (Vec3, f32) {
        let at = self.locate(direction);
        let corners = self.corners(at.column, at.row);
        let pdf = self.density(at.row, horizontal(direction), &corners, at.fraction);
        (blend(&corners, at.fraction), pdf)
    }

    fn density(&self, row: usize, sin_theta: f32, corners: &[Vec3; 4], at: Vec2) -> f32 {
        let Some(sampling) = &self.sampling else { return 0.0 };
        let [a, b, c, d] = self.excess(corners);
        let (above, below) = (a + at.x * (b - a), c + at.x * (d - c));
        let sin_theta = if row == 0 || row == self.height { 1.0 } else { sin_theta };
        sampling.density[row] * (above + at.y * (below - above)) / sin_theta
    }

    fn excess(&self, [a, b, c, d]: &[Vec3; 4]) -> [f32; 4] {
        let above = |texel: &Vec3| (luminance(*texel) - NEGLECTED * self.mean).max(0.0);
        [above(a), above(b), above(c), above(d)]
    }

    /// sin θ and cos θ in a row of cells at y in [0, 1).
    fn polar(&self, row: usize, y: f32) -> (f32, f32) {
        let rows = self.height as f32;
        if row == 0 || row == self.height {
            // 1 − |cos θ|, uniform from the pole to the middle of the next row of texels
            let cap = 2.0 * (PI / (4.0 * rows)).sin().powi(2);
            let (up, from_pole) = if row == 0 { (1.0, y) } else { (-1.0, 1.0 - y) };
            let h = cap * from_pole;
            ((h * (2.0 - h)).max(0.0).sqrt(), up * (1.0 - h))
        } else {
            ((row as f32 - 0.5 + y) / rows * PI).sin_cos()
        }
    }

    fn locate(&self, direction: Vec3) -> Location {
        let (width, height) = (self.width as f32, self.height as f32);
        let u = 0.5 + (atan2(direction.z, direction.x) + self.rotation) / TAU;
        // Not acos, which has no digits near the poles.
        let v = atan2(horizontal(direction), direction.y) / PI;
        let x = (u - u.floor()) * width - 0.5;
        let y = v * height + 0.5;
        // Neither is below −1: a cast that cuts off towards 0 is the floor. NaN is 0.
        let column = (x + 1.0) as usize;
        let row = (y as usize).min(self.height);
        Location {
            column: if column == 0 { self.width - 1 } else { (column - 1).min(self.width - 1) },
            row,
            fraction: Vec2::new(x + 1.0 - column as f32, y - row as f32).clamp(Vec2::ZERO, Vec2::ONE),
        }
    }

    /// Texels at the corners of a cell: upper left, upper right, lower left, lower right.
    #[inline(always)]
    fn corners(&self, column: usize, row: usize) -> [Vec3; 4] {
        let texel = |i: usize| Vec3::from(self.texels[i]);
        let [a, b, c, d] = self.corner_indices(column, row);
        [texel(a), texel(b), texel(c), texel(d)]
    }

    #[inline(always)]
    fn corner_indices(&self, column: usize, row: usize) -> [usize; 4] {
        let right = if column + 1 == self.width { 0 } else { column + 1 };
        let upper = row.saturating_sub(1) * self.width;
        let lower = row.min(self.height - 1) * self.width;
        [upper + column, upper + right, lower + column, lower + right]
    }

    fn tabulate(&self) -> (f32, Option<Sampling>) {
        let delta = PI as f64 / self.height as f64;
        let middle = |row: usize| row as f64 * delta;
        let polar = |row: usize| row == 0 || row == self.height;
        // Solid angle of a cell: Δφ × (cos θ₀ − cos θ₁), without cancellation.
        let solid_angle = |row: usize| {
            let height = if polar(row) {
                2.0 * (0.25 * delta).sin().powi(2)
            } else {
                2.0 * middle(row).sin() * (0.5 * delta).sin()
            };
            height * TAU as f64 / self.width as f64
        };
        let luminances: Vec<f32> = self.texels.par_iter().map(|&texel| luminance(texel.into())).collect();
        let corners = |column, row| {
            let [a, b, c, d] = self.corner_indices(column, row);
            [luminances[a], luminances[b], luminances[c], luminances[d]]
        };
        let row_sum = |row: usize| {
            let sum = |column| corners(column, row).iter().map(|&l| f64::from(l)).sum::<f64>();
            0.25 * solid_angle(row) * (0..self.width).map(sum).sum::<f64>()
        };
        let sums: Vec<f64> = (0..=self.height).into_par_iter().map(row_sum).collect();
        let mean = (sums.iter().sum::<f64>() / (2.0 * TAU as f64)) as f32;
        let excess = |luminance: &f32| (luminance - NEGLECTED * mean).max(0.0);
        let grid = Grid::new(self.width, self.height + 1, |row, weights| {
            let scale = (0.25 * solid_angle(row)) as f32;
            for (column, weight) in weights.iter_mut().enumerate() {
                *weight = corners(column, row).iter().map(|luminance| scale * excess(luminance)).sum();
            }
        });
        let Some(grid) = grid else { return (mean, None) };
        let density = (0..=self.height)
            .map(|row| {
                let s =
                    if polar(row) { 1.0 } else { middle(row).sin() * (0.5 * delta).sin() / (0.5 * delta) };
                (s / grid.total()) as f32
            })
            .collect();
        (mean, Some(Sampling { grid, density }))
    }
}

/// Between the corners of a cell.
#[inline(always)]
fn blend([a, b, c, d]: &[Vec3; 4], at: Vec2) -> Vec3 {
    a.lerp(*b, at.x).lerp(c.lerp(*d, at.x), at.y)
}

/// The angle of (x, y) from +x, within 3e-7: a fiftieth of a texel in a map of 32 thousand. Twice as fast as a whole one.
/// Polynomial: Abramowitz and Stegun, *Handbook of Mathematical Functions*, 4.4.49.
fn atan2(y: f32, x: f32) -> f32 {
    const EVEN: [f32; 8] = [
        -0.333_331_45,
        0.199_935_51,
        -0.142_089,
        0.106_562_64,
        -0.075_289_64,
        0.042_909_614,
        -0.016_165_737,
        0.002_866_225_7,
    ];
    let (small, large) = (x.abs().min(y.abs()), x.abs().max(y.abs()));
    let t = if large > 0.0 { small / large } else { 0.0 };
    let t2 = t * t;
    // in pairs: one after the other, as Horner has it, each term would wait for the last
    let [a, b, c, d, e, f, g, h] = EVEN;
    let (t4, t8) = (t2 * t2, (t2 * t2) * (t2 * t2));
    let sum = ((a + b * t2) + (c + d * t2) * t4) + ((e + f * t2) + (g + h * t2) * t4) * t8;
    let octant = t + t * t2 * sum;
    let quadrant = if y.abs() > x.abs() { 0.5 * PI - octant } else { octant };
    (if x < 0.0 { PI - quadrant } else { quadrant }).copysign(y)
}

/// sin θ.
fn horizontal(direction: Vec3) -> f32 {
    (direction.x * direction.x + direction.z * direction.z).sqrt()
}

/// Where a direction meets the map: a cell between the middles of texels, and where in it.
struct Location {
    column: usize,
    row: usize,
    fraction: Vec2,
}

fn linear_texels(texels: &Texels, color_space: ColorSpace) -> Vec<[f32; 3]> {
    let decode = |stored: f32| match color_space {
        ColorSpace::Linear => stored,
        ColorSpace::Srgb => srgb_decode(stored),
    };
    match texels {
        Texels::Rgba8(texels) => {
            let table: Vec<f32> = (0..=u8::MAX).map(|c| decode(c as f32 / 255.0)).collect();
            texels.par_iter().map(|&[r, g, b, _]| [r, g, b].map(|c| table[c as usize])).collect()
        }
        Texels::Rgba16(texels) => {
            texels.par_iter().map(|&[r, g, b, _]| [r, g, b].map(|c| decode(c as f32 / 65535.0))).collect()
        }
        Texels::RgbF32(texels) => texels.clone(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::stats::{chi2_test, integrate_sphere, r3, uniform};

    fn image(width: u32, height: u32, texel: impl Fn(u32, u32) -> [f32; 3]) -> Image {
        let texels = (0..width * height).map(|i| texel(i % width, i / width)).collect();
        Image { name: "test".into(), width, height, texels: Texels::RgbF32(texels) }
    }

    fn map(image: &Image, rotation: f32) -> Map {
        Map::new(image, ColorSpace::Linear, 1.0, rotation).expect("a whole image").0
    }

    fn speckled(x: u32, y: u32) -> [f32; 3] {
        [0, 1, 2].map(|c| uniform(x * 1000 + y, c).powi(3))
    }

    fn with_sun(x: u32, y: u32) -> [f32; 3] {
        if (x, y) == (9, 4) { [9e3, 8e3, 7e3] } else { [0.2, 0.3, 0.5] }
    }

    fn check(name: &str, map: &Map) {
        let sample = |[a, b, _]: [f32; 3]| map.sample(Vec2::new(a, b));
        chi2_test(name, |u| sample(u).map(|s| s.wi), |w| map.look(w).1);
        for i in 0..2000 {
            let s = sample(r3(i)).expect("not black");
            assert!(s.wi.is_normalized());
            let (radiance, pdf) = map.look(s.wi);
            let slack = 2e-3 * s.pdf + 1e-4 / map.mean_luminance(); // u and v have 24 bits each
            assert!((pdf - s.pdf).abs() < slack, "{name}: drawn with {}, pdf is {pdf}", s.pdf);
            assert!(
                radiance.abs_diff_eq(s.radiance, 2e-3 * s.radiance.max_element() + 1e-4),
                "{name}: drawn {}, found {radiance}",
                s.radiance
            );
        }
    }

    #[test]
    fn samples_follow_the_density() {
        for (width, height) in [(1, 1), (3, 2), (12, 6)] {
            check(&format!("{width} × {height}"), &map(&image(width, height, speckled), 0.7));
        }
        check("sun", &map(&image(16, 8, with_sun), 0.0));
        check("rotated sun", &map(&image(16, 8, with_sun), 2.0));
        let at_pole = |x, y| if y == 0 { [(x + 1) as f32, 5.0, 0.0] } else { [0.0; 3] };
        check("bright pole", &map(&image(8, 6, at_pole), 0.0));
    }

    #[test]
    fn density_integrates_to_one_and_is_zero_only_where_it_is_dark() {
        let map = map(&image(16, 8, |x, y| if (x, y) == (3, 2) { [0.0, 0.0, 1.0] } else { [0.0; 3] }), 0.0);
        let mass = integrate_sphere(|w| map.look(w).1);
        assert!((mass - 1.0).abs() < 2e-3, "{mass}");
        let mut dark = 0;
        for i in 0..10_000 {
            let [a, b, _] = r3(i);
            let w = crate::sampling::warp::uniform_sphere(Vec2::new(a, b));
            let (radiance, pdf) = map.look(w);
            assert_eq!(radiance, map.radiance(w));
            assert!(pdf > 0.0 || luminance(radiance) <= 0.5 * map.mean, "{radiance}");
            dark += u32::from(pdf == 0.0);
        }
        assert!(dark > 9000, "{dark}");
    }

    #[test]
    fn weight_hardly_varies() {
        let map = map(&image(64, 32, with_sun), 0.0);
        for i in 0..5000 {
            let [a, b, _] = r3(i);
            let s = map.sample(Vec2::new(a, b)).expect("not black");
            let weight = (luminance(s.radiance) - 0.5 * map.mean) / s.pdf / (4.0 * PI * map.mean_excess());
            assert!((0.3..1.8).contains(&weight), "{weight} towards {}", s.wi);
        }
    }

    #[test]
    fn a_bright_texel_is_where_the_convention_says() {
        // 8 × 4 texels: column 4 is φ = 22.5°, row 1 is θ = 67.5°.
        let bright = |x, y| if (x, y) == (4, 1) { [1.0; 3] } else { [0.0; 3] };
        let (phi, theta) = (22.5f32.to_radians(), 67.5f32.to_radians());
        let towards = |phi: f32| Vec3::new(theta.sin() * phi.cos(), theta.cos(), theta.sin() * phi.sin());
        let unrotated = map(&image(8, 4, bright), 0.0);
        assert!((unrotated.radiance(towards(phi)).x - 1.0).abs() < 1e-5);
        // Counter-clockwise seen from above: as a rotation about +Y, which takes +X to −Z.
        for rotation in [0.6, -2.0, 4.0] {
            let turned = glam::Quat::from_rotation_y(rotation) * towards(phi);
            assert!(
                (map(&image(8, 4, bright), rotation).radiance(turned).x - 1.0).abs() < 1e-5,
                "{rotation}"
            );
        }
    }

    #[test]
    fn lookups_wrap_around_and_end_at_the_poles() {
        let map = map(&image(4, 4, |x, y| [x as f32, y as f32, 1.0]), 0.0);
        let at_seam = map.radiance(Vec3::NEG_X);
        assert!((at_seam.x - 1.5).abs() < 1e-4, "between columns 3 and 0: {at_seam}");
        for w in [Vec3::Y, Vec3::NEG_Y, Vec3::new(1e-20, 1.0, 0.0), Vec3::new(0.0, -1.0, -1e-20)] {
            assert_eq!(map.radiance(w).y, if w.y > 0.0 { 0.0 } else { 3.0 });
            assert!(map.look(w).1.is_finite());
        }
        map.look(Vec3::NAN); // must not panic
    }

    #[test]
    fn angles_are_exact_enough() {
        for i in 0..100_000 {
            let [a, b, c] = r3(i);
            let (y, x) = ((a - 0.5) * 10f32.powf(6.0 * (c - 0.5)), b - 0.5);
            let exact = f64::from(y).atan2(f64::from(x));
            assert!((f64::from(atan2(y, x)) - exact).abs() < 3e-7, "{y}, {x}");
        }
        assert_eq!(
            [atan2(0.0, 1.0), atan2(0.0, -1.0), atan2(1.0, 0.0), atan2(0.0, 0.0)],
            [0.0, PI, 0.5 * PI, 0.0]
        );
    }

    #[test]
    fn unusable_texels_become_black_and_are_counted() {
        let odd = [[f32::NAN, 1.0, 1.0], [1.0, -1.0, 1.0], [f32::INFINITY, 0.0, 0.0], [1.0, 1.0, 1.0]];
        let broken = image(4, 1, |x, _| odd[x as usize]);
        let (map, dropped) = Map::new(&broken, ColorSpace::Linear, 2.0, 0.0).expect("whole");
        assert_eq!((dropped, map.texels[0], map.texels[3]), (3, [0.0; 3], [2.0; 3]));
        let short = Image { width: 5, ..broken };
        assert!(Map::new(&short, ColorSpace::Linear, 1.0, 0.0).is_none());
        let black = Map::new(&image(3, 3, |_, _| [0.0; 3]), ColorSpace::Linear, 1.0, 0.0).expect("whole").0;
        assert!(black.sample(Vec2::splat(0.5)).is_none());
        assert_eq!((black.look(Vec3::X).1, black.mean_luminance()), (0.0, 0.0));
    }

    #[test]
    fn stored_integers_are_decoded_once() {
        let gray8 = Texels::Rgba8(vec![[188, 0, 255, 7]]);
        let gray16 = Texels::Rgba16(vec![[188 * 257, 0, 65535, 7]]);
        for texels in [gray8, gray16] {
            let [r, g, b] = linear_texels(&texels, ColorSpace::Srgb)[0];
            assert!((r - 0.502_886_4).abs() < 1e-4 && g == 0.0 && (b - 1.0).abs() < 1e-6, "{r} {g} {b}");
            assert!((linear_texels(&texels, ColorSpace::Linear)[0][0] - 188.0 / 255.0).abs() < 1e-6);
        }
    }

    #[test]
    fn extreme_values_survive() {
        for value in [1e-38, 3e38] {
            let map = map(&image(8, 4, |x, _| if x == 2 { [value; 3] } else { [0.0; 3] }), 0.0);
            let s = map.sample(Vec2::new(0.4, 0.6)).expect("not black");
            assert!(s.pdf.is_finite() && s.radiance.is_finite());
        }
    }
}
