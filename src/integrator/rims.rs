//! The rims of lamps in the picture.
//!
//! A lamp that the camera sees is brighter than all around it, often a thousand times: in pixels that it fills in part, nearly all noise is
//! about how large that part is. To find out takes no path, but its first ray alone. So in these pixels every sample
//! has some rays more, which look from other points of the pixel (and of the lens), and what the camera sees straight, lamps and
//! surroundings, is the mean over all of them; the light that surfaces scatter remains the path's own:
//!
//! ```text
//! L = L_seen + L_scattered        sample: 1/k Σ L_seen (ray j)  +  L_scattered (path)
//! ```
//!
//! Which pixels these are, and k, is found in advance, by rays that no sample has anything to do with: a rim that is missed costs
//! noise, and none of this bends the mean.

use glam::Vec3;
use rayon::prelude::*;

use super::{Path, RayCounts, meet};
use crate::{
    color::luminance, compile::Scene, film::around, render::Settings, sampling::sobol::PixelSampler,
};

/// With fewer samples a pixel, there are none: to find them costs too much of the time.
const RIMS_FROM: u32 = 16;

/// How much brighter than what is beside it a lamp is, at least.
const CONTRAST: f32 = 4.0;

/// Of what is seen straight, relative to the pixel: with less, there is nothing to be gained.
const LEAST_DEVIATION: f32 = 0.5;

/// Glances for each unit of relative standard deviation, and at most.
const GLANCES: f32 = 4.0;
const MOST_GLANCES: f32 = 64.0;

/// Glances and scouts draw from other patterns than paths through the same pixel.
const GLANCE_SALT: u64 = 0x676c_616e_6365;
const SCOUT_SALT: u64 = 0x7363_6f75_7473;
const STUDY_SALT: u64 = 0x7374_7564_6965;

/// The pixels on the rim of a lamp.
#[derive(Debug)]
pub struct Rims {
    /// x, y, width and height of the part of the picture that is known.
    window: [u32; 4],
    /// How many rays of each sample look for what is seen straight, beside its path's, row by row; empty where there are no rims.
    glances: Vec<u8>,
}

impl Rims {
    pub const NONE: Self = Self { window: [0; 4], glances: Vec::new() };

    /// Looks for those that are worth a closer look; for none after `stop` says so.
    pub fn find(scene: &Scene, settings: &Settings, stop: &(impl Fn() -> bool + Sync)) -> Self {
        let samples = settings.samples;
        if !settings.adaptive || samples < RIMS_FROM || !scene.objects.iter().any(|object| object.emits) {
            return Self::NONE;
        }
        let window @ [left, top, width, height] = scene.window;
        let [columns, rows] = [width, height].map(|n| n as usize);
        let pixel = |i: usize| [left + (i % columns) as u32, top + (i / columns) as u32];
        let pixels = (0..columns * rows).into_par_iter();
        let look = |i| if stop() { 0.0 } else { scout(scene, pixel(i)) };
        let seen: Vec<f32> = pixels.clone().map(look).collect();
        let study = |i: usize| {
            let range = |[low, high]: [f32; 2], y: f32| [low.min(y), high.max(y)];
            let [low, high] =
                around(i, 1, columns, seen.len()).map(|j| seen[j]).fold([f32::INFINITY, 0.0], range);
            if high > CONTRAST * low && !stop() { glances(scene, pixel(i), high, samples) } else { 0 }
        };
        let glances: Vec<u8> = pixels.map(study).collect();
        if glances.iter().any(|&n| n > 0) { Self { window, glances } } else { Self::NONE }
    }

    /// Of what is seen straight in sample `index` of a pixel, the share that its path has to count itself, and the sum of the others'; `None`
    /// where it counts all.
    #[inline]
    pub(super) fn glances(
        &self,
        scene: &Scene,
        [x, y]: [u32; 2],
        index: u32,
        counts: &mut RayCounts,
    ) -> Option<(f32, Vec3)> {
        let [left, top, width, _] = self.window;
        let place = || ((y - top) * width + x - left) as usize;
        let others = u32::from(if self.glances.is_empty() { 0 } else { self.glances[place()] });
        (others > 0).then(|| {
            let sampler = PixelSampler::new(scene.seed ^ GLANCE_SALT, x, y, index);
            let look = |i| glance(scene, [x, y], &sampler.branch(i, others), counts);
            let share = 1.0 / (others + 1) as f32;
            (share, share * (0..others).map(look).sum::<Vec3>())
        })
    }
}

/// What the camera sees straight in a pixel.
fn glance(scene: &Scene, pixel: [u32; 2], sampler: &PixelSampler, counts: &mut RayCounts) -> Vec3 {
    let mut path = Path::from_camera(scene, pixel, sampler, counts);
    path.arrive::<true>(scene, sampler, counts);
    path.radiance
}

/// The luminance of the lamp that one ray meets in a pixel; 0 where it meets none.
fn scout(scene: &Scene, pixel: [u32; 2]) -> f32 {
    let sampler = PixelSampler::new(scene.seed ^ SCOUT_SALT, pixel[0], pixel[1], 0);
    let mut ray = Path::from_camera(scene, pixel, &sampler, &mut RayCounts::default()).ray;
    let Some(hit) = meet(scene, &mut ray, &sampler, 0) else { return 0.0 };
    if !scene.objects[hit.object as usize].emits {
        return 0.0;
    }
    let point = scene.surface_point(&ray, &hit);
    luminance(scene.emission(&hit, &point.uvs, -ray.direction.dot(point.ng)))
}

/// How many rays of each sample are to look for what is seen straight in a pixel, in or beside which there is a `lamp` of this luminance: 0
/// where it is no rim. It takes a small part of the time of the pixel's `samples`.
fn glances(scene: &Scene, pixel: [u32; 2], lamp: f32, samples: u32) -> u8 {
    let mut counts = RayCounts::default();
    let sampler = |index| PixelSampler::new(scene.seed ^ STUDY_SALT, pixel[0], pixel[1], index);
    let paths = (samples / 16).clamp(1, 8);
    let mut of_path = |i| {
        let path = Path::from_camera(scene, pixel, &sampler(i), &mut counts);
        luminance(Path { share: 0.0, ..path }.trace(scene, &sampler(i), &mut counts))
    };
    let scattered = (0..paths).map(&mut of_path).sum::<f32>() / paths as f32;
    if lamp < CONTRAST * scattered {
        return 0;
    }
    let rays = 2 * samples.min(128);
    let of_ray = |i| luminance(glance(scene, pixel, &sampler(i), &mut counts));
    let seen: Vec<f32> = (0..rays).map(of_ray).collect();
    let mean = seen.iter().sum::<f32>() / rays as f32;
    let variance = seen.iter().map(|y| (y - mean).powi(2)).sum::<f32>() / rays as f32;
    let deviation = variance.sqrt() / (mean + scattered);
    if deviation > LEAST_DEVIATION { (GLANCES * deviation).min(MOST_GLANCES) as u8 } else { 0 }
}
