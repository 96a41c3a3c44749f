//! How a picture is made, resolved from the scene file and the command line.

use std::time::Duration;

use serde::{Deserialize, Serialize};

use crate::accel::Quality;

/// Pixels along a side of a picture.
pub const MAX_SIDE: u32 = 1 << 16;

/// Pixels of a picture: 2²⁸, whose film takes 15 GB, with paths from lamps 28 GB; to look for the rims of lamps another 1.3 GB.
pub const MAX_PIXELS: u64 = 1 << 28;

pub const MAX_SAMPLES: u32 = 1 << 24;

pub const MAX_BOUNCES: u32 = 1024;

pub const MAX_THREADS: usize = 1024;

/// The most scattering events a path may have, in all and by kind. 0 leaves direct light alone: light arriving at
/// the first surface from emitters, without interreflection.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Bounces {
    pub total: u32,
    pub diffuse: u32,
    pub glossy: u32,
    pub transmission: u32,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FilterKind {
    Box,
    Gaussian,
    BlackmanHarris,
}

/// Reconstruction filter, drawn by importance (each sample belongs to one pixel, with weight 1).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PixelFilter {
    pub kind: FilterKind,
    /// Full width of the support, pixels.
    pub width: f32,
}

#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// Pixels, width and height of the whole picture.
    pub size: [u32; 2],
    /// x, y, width, height in pixels from the top left: only this part is rendered and written.
    pub crop: Option<[u32; 4]>,
    /// Per pixel, at most; where `adaptive`, the picture takes as much work as so many of every pixel.
    pub samples: u32,
    /// Samples, and paths of a sample, go where they lessen the noise; otherwise every pixel gets the same number of samples, of
    /// one path each.
    pub adaptive: bool,
    /// Rendering ends when the estimated relative error of the picture is below this; 0 never ends early.
    pub noise: f32,
    pub time: Option<Duration>,
    pub seed: u64,
    /// `None`: as many as the machine has.
    pub threads: Option<usize>,
    pub bounces: Bounces,
    pub filter: PixelFilter,
    /// How trees are built. `None`: as is soonest done, by the number of triangles and of samples.
    pub bvh: Option<Quality>,
}

/// With fewer samples a pixel, each takes the same number, of one path each: to find out where the noise is costs too much of the time.
const LEAST_SHARED: u32 = 16;

impl Settings {
    /// x, y, width and height of what is rendered: the crop (as much of it as lies in the picture) or the whole.
    pub fn window(&self) -> [u32; 4] {
        let [width, height] = self.size;
        let [x, y, w, h] = self.crop.unwrap_or([0, 0, width, height]);
        let (x, y) = (x.min(width), y.min(height));
        [x, y, w.min(width - x), h.min(height - y)]
    }

    /// Over all pixels; where the settings are adaptive, about so many, as they say how much work there is.
    pub fn planned_samples(&self) -> u64 {
        let [.., width, height] = self.window();
        u64::from(width) * u64::from(height) * u64::from(self.samples)
    }

    /// Whether every pixel takes all `samples`, unless rendering is interrupted.
    pub fn is_even(&self) -> bool {
        self.noise <= 0.0 && !self.shares_out()
    }

    /// Whether samples, and rays of a sample, go where they lessen the noise.
    pub(crate) fn shares_out(&self) -> bool {
        self.adaptive && self.samples >= LEAST_SHARED
    }

    /// Whether an error or a time may end it before all `samples`.
    pub(crate) fn is_open(&self) -> bool {
        self.noise > 0.0 || self.time.is_some()
    }

    /// What is wrong with the settings as a whole, in words; empty where they can be rendered.
    pub fn faults(&self) -> Vec<String> {
        let [width, height] = self.size;
        let mut faults = Vec::new();
        let mut check = |bad: bool, fault: String| {
            if bad {
                faults.push(fault);
            }
        };
        check(
            !(1..=MAX_SIDE).contains(&width) || !(1..=MAX_SIDE).contains(&height),
            format!("the size is {width} × {height}, but each side must be from 1 to {MAX_SIDE} pixels"),
        );
        check(
            u64::from(width) * u64::from(height) > MAX_PIXELS,
            format!("the size is {width} × {height}, which is more than {MAX_PIXELS} pixels"),
        );
        check(
            !(1..=MAX_SAMPLES).contains(&self.samples),
            format!("the number of samples is {}, but must be from 1 to {MAX_SAMPLES}", self.samples),
        );
        check(
            !(0.0..1.0).contains(&self.noise),
            format!("the noise threshold is {}, but must be from 0 (off) to below 1", self.noise),
        );
        let Bounces { total, diffuse, glossy, transmission } = self.bounces;
        let bounces = total.max(diffuse).max(glossy).max(transmission);
        check(
            bounces > MAX_BOUNCES,
            format!("the number of bounces is {bounces}, but must be at most {MAX_BOUNCES}"),
        );
        check(
            self.threads.is_some_and(|n| !(1..=MAX_THREADS).contains(&n)),
            format!("the number of threads must be from 1 to {MAX_THREADS}"),
        );
        if let Some([x, y, w, h]) = self.crop {
            let end = |start: u32, len: u32| u64::from(start) + u64::from(len);
            check(
                w == 0 || h == 0 || end(x, w) > u64::from(width) || end(y, h) > u64::from(height),
                format!(
                    "the crop window {x},{y},{w},{h} (x, y, width, height) is empty or leaves the picture of \
                     {width} × {height} pixels"
                ),
            );
        }
        faults
    }
}

impl Bounces {
    /// `total` for every kind.
    pub fn uniform(total: u32) -> Self {
        Self { total, diffuse: total, glossy: total, transmission: total }
    }
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            size: [1280, 720],
            crop: None,
            samples: 256,
            adaptive: true,
            noise: 0.0,
            time: None,
            seed: 0,
            threads: None,
            bounces: Bounces::uniform(16),
            filter: PixelFilter { kind: FilterKind::BlackmanHarris, width: 3.3 },
            bvh: None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn faults_are_all_found() {
        let good = Settings { crop: Some([1270, 710, 10, 10]), ..Settings::default() };
        assert!(good.faults().is_empty());
        assert_eq!(good.window(), [1270, 710, 10, 10]);
        let bad = Settings {
            size: [0, 70_000],
            crop: Some([1, 1, u32::MAX, 0]),
            samples: 0,
            noise: f32::NAN,
            threads: Some(0),
            bounces: Bounces { glossy: MAX_BOUNCES + 1, ..Bounces::uniform(4) },
            ..Settings::default()
        };
        assert_eq!(bad.faults().len(), 6, "{:?}", bad.faults());
        assert_eq!(bad.window(), [0, 1, 0, 0]);
        let huge = Settings { size: [MAX_SIDE, MAX_SIDE], ..Settings::default() };
        assert_eq!(huge.faults().len(), 1);
    }
}
