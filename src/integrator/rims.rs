//! The rims of lamps in the picture.
//!
//! A lamp that the camera sees is brighter than all around it, often a thousand times: in pixels that it fills in part, nearly all noise is
//! about how large that part is. To find out takes no path, but its first ray alone. So in these pixels the camera ray of every sample is
//! split: beside the one that goes on as a path, some glance through other points of the pixel (and of the lens), and what is directly
//! visible, lamps and surroundings, is the mean over all of them; the light that surfaces scatter remains the path's own:
//!
//! ```text
//! L = L_seen + L_scattered        sample: 1/n Σ L_seen (ray j)  +  L_scattered (path)
//! ```
//!
//! With variances V and costs C of the two parts, the noise of given work is least for n = √(V_seen / V_scattered · C_path / C_ray). To know
//! V_scattered takes many paths, so n is a rule of thumb instead: V_scattered is taken to be the square of the brightness, and a path
//! to cost as much as sixteen rays.
//!
//! Which pixels these are, and n, is found in advance, by rays that no sample has anything to do with: a rim that is missed costs
//! noise, and none of this bends the mean.

use std::ops::Add;

use glam::Vec3;
use rayon::prelude::*;

use super::{Path, RayCounts, meet};
use crate::{
    color::luminance,
    compile::Scene,
    film::around,
    render::{Monitor, Settings},
    sampling::sobol::PixelSampler,
};

/// How much brighter than what is beside it a lamp is, at least.
const CONTRAST: f32 = 4.0;

/// Of what is directly visible, relative to the pixel: with less, there is nothing to be gained.
const LEAST_DEVIATION: f32 = 0.5;

/// Glances for each unit of relative standard deviation (√16: what a path costs, in rays), and at most.
const GLANCES: f32 = 4.0;
const MOST_GLANCES: f32 = 64.0;

/// A pixel's study takes two rays for each of its samples, up to so many of them.
const STUDIED_SAMPLES: u32 = 128;

/// The same where the end is open, and the number of samples but a bound that is seldom reached.
const STUDIED_OPEN: u32 = 32;

/// Glances, scouts and studies draw from other patterns than paths through the same pixel.
const GLANCE_SALT: u64 = 0x676c_616e_6365;
const SCOUT_SALT: u64 = 0x7363_6f75_7473;
const STUDY_SALT: u64 = 0x7374_7564_6965;

/// The pixels on the rim of a lamp.
#[derive(Debug)]
pub struct Rims {
    /// x, y, width and height of the part of the picture that is known.
    window: [u32; 4],
    /// Glances of each sample, pixel by pixel, row by row; empty where there are no rims.
    splits: Vec<u8>,
}

impl Rims {
    /// No pixel is on a rim: every sample is a path alone.
    pub const NONE: Self = Self { window: [0; 4], splits: Vec::new() };

    /// Looks for the pixels that are worth more rays, and says how many rays that took, which `monitor` counts meanwhile. Once `stop`
    /// says so, it ends with those found so far.
    pub fn find(
        scene: &Scene,
        settings: &Settings,
        monitor: &Monitor,
        stop: &(impl Fn() -> bool + Sync),
    ) -> (Self, RayCounts) {
        if !settings.shares_out() || !scene.objects.iter().any(|object| object.emits) {
            return (Self::NONE, RayCounts::default());
        }
        let window @ [_, _, width, _] = scene.window;
        let most = if settings.is_open() { STUDIED_OPEN } else { STUDIED_SAMPLES };
        let samples = settings.samples.min(most);
        let (lamps, scouts) = survey(window, monitor, stop, |_, pixel, rays| scout(scene, pixel, rays));
        let (splits, studies) = survey(window, monitor, stop, |i, pixel, rays| {
            let range = |[low, high]: [f32; 2], y: f32| [low.min(y), high.max(y)];
            let beside = around(i, 1, width as usize, lamps.len()).map(|j| lamps[j]);
            let [low, high] = beside.fold([f32::INFINITY, 0.0], range);
            if high > CONTRAST * low { study(scene, pixel, high, samples, rays) } else { 0 }
        });
        let rims = Self { window, splits };
        (if rims.count() > 0 { rims } else { Self::NONE }, scouts + studies)
    }

    /// How many pixels are on a rim.
    pub fn count(&self) -> usize {
        self.splits.iter().filter(|&&glances| glances > 0).count()
    }

    /// Glances of each sample of a pixel.
    #[inline]
    fn split(&self, [x, y]: [u32; 2]) -> u32 {
        let [left, top, width, height] = self.window;
        let [column, row] = [x.wrapping_sub(left), y.wrapping_sub(top)];
        let is_known = column < width && row < height;
        if is_known { self.splits[(row * width + column) as usize].into() } else { 0 }
    }

    /// Of what is directly visible in sample `index` of a pixel, the share that its path has to count itself, and what the glances bring of
    /// the rest; `None` where the path counts all. A glance that is not finite spoils the sample, as it would if it were the path's own
    /// ray.
    #[inline]
    pub(super) fn directly_visible(
        &self,
        scene: &Scene,
        pixel @ [x, y]: [u32; 2],
        index: u32,
        counts: &mut RayCounts,
    ) -> Option<(f32, Vec3)> {
        let glances = self.split(pixel);
        (glances > 0).then(|| {
            let sampler = PixelSampler::new(scene.seed ^ GLANCE_SALT, x, y, index);
            let share = 1.0 / (glances + 1) as f32;
            let seen =
                (0..glances).map(|i| share * glance(scene, pixel, &sampler.branch(i, glances), counts));
            (share, seen.sum())
        })
    }
}

/// What `look` makes of each pixel of a window, by its place and its x and y, and the rays that took; zeros once `stop` says so.
fn survey<T: Copy + Default + Send>(
    [left, top, width, height]: [u32; 4],
    monitor: &Monitor,
    stop: &(impl Fn() -> bool + Sync),
    look: impl Fn(usize, [u32; 2], &mut RayCounts) -> T + Sync,
) -> (Vec<T>, RayCounts) {
    let columns = width as usize;
    let mut found = vec![T::default(); columns * height as usize];
    let of_row = |(row, pixels): (usize, &mut [T])| {
        let mut rays = RayCounts::default();
        for (column, found) in pixels.iter_mut().enumerate() {
            if stop() {
                break;
            }
            let pixel = [left + column as u32, top + row as u32];
            *found = look(row * columns + column, pixel, &mut rays);
        }
        monitor.count(0, &rays);
        rays
    };
    let rows = found.par_chunks_mut(columns.max(1)).with_max_len(1).enumerate();
    let rays = rows.map(of_row).reduce(RayCounts::default, Add::add);
    (found, rays)
}

/// What is directly visible along one ray through a pixel.
fn glance(scene: &Scene, pixel: [u32; 2], sampler: &PixelSampler, counts: &mut RayCounts) -> Vec3 {
    let mut path = Path::from_camera(scene, pixel, sampler, counts);
    path.arrive::<true>(scene, sampler, counts);
    path.radiance
}

/// The luminance of the lamp that one ray meets in a pixel; 0 where it meets none.
fn scout(scene: &Scene, pixel: [u32; 2], counts: &mut RayCounts) -> f32 {
    let sampler = PixelSampler::new(scene.seed ^ SCOUT_SALT, pixel[0], pixel[1], 0);
    let mut ray = Path::from_camera(scene, pixel, &sampler, counts).ray;
    let Some(hit) = meet(scene, &mut ray, &sampler, 0) else { return 0.0 };
    if !scene.objects[hit.object as usize].emits {
        return 0.0;
    }
    let point = scene.surface_point(&ray, &hit);
    luminance(scene.emission(&hit, &point.uvs, -ray.direction.dot(point.ng)))
}

/// How many glances each sample of a pixel is to have, in or beside which there is a `lamp` of this luminance: 0 where it is no rim. It takes
/// a path for every sixteen `samples` and two rays for each: a part of what paths of several bounces take, but twice as much as those that end
/// at the first surface.
fn study(scene: &Scene, pixel: [u32; 2], lamp: f32, samples: u32, counts: &mut RayCounts) -> u8 {
    let sampler = |index| PixelSampler::new(scene.seed ^ STUDY_SALT, pixel[0], pixel[1], index);
    let paths = (samples / 16).clamp(1, 8);
    let mut of_path = |i| {
        let path = Path::from_camera(scene, pixel, &sampler(i), counts);
        luminance(Path { share: 0.0, ..path }.trace(scene, &sampler(i), counts))
    };
    let scattered = (0..paths).map(&mut of_path).sum::<f32>() / paths as f32;
    if lamp < CONTRAST * scattered {
        return 0;
    }
    let rays = 2 * samples;
    let of_ray = |i| luminance(glance(scene, pixel, &sampler(i), counts));
    let seen: Vec<f32> = (0..rays).map(of_ray).collect();
    let mean = seen.iter().sum::<f32>() / rays as f32;
    let variance = seen.iter().map(|y| (y - mean).powi(2)).sum::<f32>() / rays as f32;
    let deviation = variance.sqrt() / (mean + scattered);
    if deviation > LEAST_DEVIATION { (GLANCES * deviation).min(MOST_GLANCES) as u8 } else { 0 }
}
