//! One pass: some samples for every pixel that still needs them.

use std::mem;

use glam::Vec3;
use rayon::prelude::*;

use super::{Monitor, schedule::Schedule};
use crate::{
    film::{Film, Tile},
    integrator::{RayCounts, Splat},
    light::SAMPLES_A_LAMP_PATH,
};

/// Pixels along a tile's side: small enough to share out evenly, large enough for neighbouring paths to find the same
/// nodes and texels in the cache.
pub const TILE_SIDE: u32 = 16;

/// Tiles between two visits to the sums of what lamps bring: of a wide filter each may have a megabyte to bring.
const TILES_A_THREAD: usize = 32;

/// What a tile took, beside the samples of its pixels.
#[derive(Default)]
struct Done {
    rays: RayCounts,
    paths: u64,
    splats: Vec<Splat>,
    is_cut: bool,
}

pub struct Pass<'a> {
    /// Where the film lies in the whole picture.
    pub origin: [u32; 2],
    pub schedule: &'a Schedule,
    pub monitor: &'a Monitor,
}

/// How long a ray takes, beside one that meets a surface: the camera's often meet nothing, and what is behind is
/// looked up once.
const CAMERA_RAY_WORK: f64 = 0.25;

/// What a sample takes at least.
pub const LEAST_WORK: f64 = CAMERA_RAY_WORK;

/// Of each tile, row by row: the work it took, in rays.
pub type TileWork = Vec<f64>;

pub fn no_work(width: u32, height: u32) -> TileWork {
    vec![0.0; width.div_ceil(TILE_SIDE) as usize * height.div_ceil(TILE_SIDE) as usize]
}

impl Pass<'_> {
    /// Adds the pass's samples to the film and their rays to `total` and `work`, or those of them that were taken before `stop` said
    /// so; says whether these are all.
    ///
    /// What paths from lamps bring is written to the film tile by tile in their order, for the same bits whatever the
    /// threads, and after so many tiles that the list of it stays short.
    pub fn run<S, L>(
        &self,
        film: &mut Film,
        work: &mut TileWork,
        sample: &S,
        lamp: Option<&L>,
        stop: &(impl Fn() -> bool + Sync),
        total: &mut RayCounts,
    ) -> bool
    where
        S: Fn(u32, u32, u32, &mut RayCounts) -> Vec3 + Sync,
        L: Fn(u32, u32, u32, &mut RayCounts, &mut Vec<Splat>) + Sync,
    {
        let mut is_whole = true;
        let width = film.width() as usize;
        let mut lamps = mem::take(film.lamps_mut());
        let at_once = if lamp.is_some() { TILES_A_THREAD * rayon::current_num_threads() } else { usize::MAX };
        let mut tiles = film.tiles_mut(TILE_SIDE).into_iter();
        let mut work = work.iter_mut();
        loop {
            let part: Vec<Tile> = tiles.by_ref().take(at_once).collect();
            if part.is_empty() {
                break;
            }
            let done: Vec<Done> = part
                .into_par_iter()
                .with_max_len(1)
                .map(|tile| self.run_tile(tile, width, sample, lamp, stop))
                .collect();
            for Done { rays, paths, splats, is_cut } in done {
                is_whole &= !is_cut;
                if let Some(work) = work.next() {
                    *work += CAMERA_RAY_WORK * rays.camera as f64 + (rays.bounce + rays.shadow) as f64;
                }
                *total = *total + rays;
                lamps.count(paths);
                for Splat { x, y, radiance } in splats {
                    let [x, y] = [x - self.origin[0], y - self.origin[1]].map(|n| n as usize);
                    lamps.add(y * width + x, radiance);
                }
            }
        }
        *film.lamps_mut() = lamps;
        is_whole
    }

    fn run_tile<S, L>(
        &self,
        tile: Tile,
        width: usize,
        sample: &S,
        lamp: Option<&L>,
        stop: &impl Fn() -> bool,
    ) -> Done
    where
        S: Fn(u32, u32, u32, &mut RayCounts) -> Vec3,
        L: Fn(u32, u32, u32, &mut RayCounts, &mut Vec<Splat>),
    {
        let mut done = Done::default();
        for (y, row) in (tile.y..).zip(tile.rows) {
            let mut rays = RayCounts::default();
            let mut taken = 0;
            for (x, pixel) in (tile.x..).zip(row) {
                let first = pixel.taken();
                let end = self.schedule.end(y as usize * width + x as usize, first);
                if end <= first {
                    continue;
                }
                if stop() {
                    done.is_cut = true;
                    break;
                }
                for index in first..end {
                    pixel.add(sample(x + self.origin[0], y + self.origin[1], index, &mut rays));
                }
                taken += u64::from(end - first);
                if let Some(lamp) = lamp {
                    let every = SAMPLES_A_LAMP_PATH;
                    for index in first.div_ceil(every)..end.div_ceil(every) {
                        done.paths += 1;
                        lamp(x + self.origin[0], y + self.origin[1], index, &mut rays, &mut done.splats);
                    }
                }
            }
            self.monitor.count(taken, &rays);
            done.rays = done.rays + rays;
        }
        done
    }
}
