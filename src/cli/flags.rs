//! The flags that override the scene: their syntax, and how they take effect.

use std::time::Duration;

use clap::{Args, ValueEnum};

use crate::{
    accel::Quality,
    output::{self, View},
    render::{self, Bounces, MAX_BOUNCES, MAX_SAMPLES, MAX_THREADS},
    scene::{Selection, parse_duration},
};

/// As far as whole numbers reach in a scene file.
const MAX_SEED: u64 = i64::MAX as u64;

/// What any renderer can be asked for. Each overrides what the scene file says.
#[derive(Debug, Default, Args)]
#[command(next_help_heading = "Overriding the scene")]
pub struct Basics {
    /// Picture size in pixels, such as 1280x720
    #[arg(long, value_name = "WxH", value_parser = size)]
    size: Option<[u32; 2]>,

    /// Samples per pixel, at most
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=i64::from(MAX_SAMPLES)))]
    samples: Option<u32>,

    /// Scattering events per path, at most, whatever their kind; 0: direct light only
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(..=i64::from(MAX_BOUNCES)))]
    bounces: Option<u32>,

    /// Another number, another pattern of noise
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = clap::value_parser!(u64).range(..=MAX_SEED))]
    seed: Option<u64>,

    /// Render only this part: left, top, width and height in pixels of the whole picture
    #[arg(long, value_name = "X,Y,W,H", value_parser = crop)]
    crop: Option<[u32; 4]>,
}

/// Each overrides what the scene file says.
#[derive(Debug, Default, Args)]
#[command(next_help_heading = "Overriding the scene")]
pub struct Overrides {
    #[command(flatten)]
    basics: Basics,

    /// The relative error of the picture, as estimated, that is enough, such as 0.01; 0: never stops early
    #[arg(long, value_name = "ERROR", value_parser = noise)]
    noise: Option<f32>,

    /// The same number of samples for every pixel, of one path each; without it, more go where more noise is
    #[arg(long)]
    uniform: bool,

    /// Time for rendering (loading not included), such as 90s, 5m or 1h30m
    #[arg(long, value_name = "TIME", value_parser = time)]
    time: Option<Duration>,

    /// Threads; as many as the machine has where neither this nor the scene says
    #[arg(long, value_name = "N", value_parser = threads)]
    threads: Option<usize>,

    /// How much time goes into building trees; by the number of triangles and samples where neither this nor the scene says
    #[arg(long, value_enum)]
    bvh: Option<BvhName>,

    /// Brighten by so many stops before the view (PNG only), such as 1.5 or -1
    #[arg(long, value_name = "STOPS", allow_negative_numbers = true, value_parser = exposure)]
    exposure: Option<f32>,

    /// Write the estimated variance of each pixel beside it (EXR only), for `rayo compare`
    #[arg(long)]
    variance: bool,

    /// Curve from light to the numbers of a PNG
    #[arg(long, value_enum)]
    view: Option<ViewName>,
}

/// The picture does not depend on it.
#[derive(Clone, Copy, Debug, ValueEnum)]
enum BvhName {
    /// For a preview of many triangles
    Fast,
    /// In between
    Balanced,
    /// For many samples
    Best,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum ViewName {
    /// The sRGB curve, for any screen
    Srgb,
    /// The square root (gamma 1/2)
    Gamma2,
    /// No curve
    Raw,
}

/// What of a model is shown, and from where.
#[derive(Clone, Debug, Default, Args)]
#[command(next_help_heading = "Choosing from what models hold")]
pub struct Choices {
    /// Scene of a glTF file, by name or number (from 0); in a scene file: `scene` in [[model]]
    #[arg(long, value_name = "NAME")]
    pub scene: Option<String>,

    /// Variant of a glTF file's materials, by name or number (from 0); in a scene file: `variant` in [[model]]
    #[arg(long, value_name = "NAME")]
    pub variant: Option<String>,

    /// Camera of a model, by its name, its node's, or number (from 0)
    #[arg(long, value_name = "NAME")]
    pub camera: Option<String>,

    /// Animation of a glTF file, by name or number (from 0); in a scene file: `animation` in [[model]]
    #[arg(long, value_name = "NAME")]
    pub animation: Option<String>,

    /// Moment of the animation; in a scene file, of all models that are animated
    #[arg(long, value_name = "SECONDS", allow_negative_numbers = true, value_parser = seconds)]
    pub at: Option<f32>,
}

impl Choices {
    pub fn selection(&self) -> Selection {
        Selection {
            scene: self.scene.clone(),
            variant: self.variant.clone(),
            animation: self.animation.clone(),
            at: self.at,
        }
    }
}

impl Basics {
    pub fn apply(&self, render: &mut render::Settings) {
        set(&mut render.size, self.size);
        set(&mut render.samples, self.samples);
        set(&mut render.bounces, self.bounces.map(Bounces::uniform));
        set(&mut render.seed, self.seed);
        render.crop = self.crop.or(render.crop);
    }
}

impl Overrides {
    pub fn apply(&self, render: &mut render::Settings, output: &mut output::Settings) {
        self.basics.apply(render);
        set(&mut render.noise, self.noise);
        render.adaptive &= !self.uniform;
        render.time = self.time.or(render.time);
        render.threads = self.threads.or(render.threads);
        let bvh = self.bvh.map(|bvh| match bvh {
            BvhName::Fast => Quality::Fast,
            BvhName::Balanced => Quality::Balanced,
            BvhName::Best => Quality::Best,
        });
        render.bvh = bvh.or(render.bvh);
        output.variance |= self.variance;
        set(&mut output.exposure, self.exposure);
        let view = self.view.map(|view| match view {
            ViewName::Srgb => View::Srgb,
            ViewName::Gamma2 => View::Gamma2,
            ViewName::Raw => View::Raw,
        });
        set(&mut output.view, view);
    }

    pub fn threads(&self) -> Option<usize> {
        self.threads
    }

    /// Whether a flag was given that only display formats heed.
    pub fn concerns_display(&self) -> bool {
        self.view.is_some() || self.exposure.is_some()
    }
}

fn set<T>(target: &mut T, value: Option<T>) {
    if let Some(value) = value {
        *target = value;
    }
}

fn numbers<const N: usize>(text: &str, separators: &[char]) -> Option<[u32; N]> {
    let numbers: Option<Vec<u32>> = text.split(separators).map(|n| n.trim().parse().ok()).collect();
    numbers?.try_into().ok()
}

fn size(text: &str) -> Result<[u32; 2], &'static str> {
    numbers(text, &['x', 'X', '×']).ok_or("write width and height in pixels, such as 1280x720")
}

fn crop(text: &str) -> Result<[u32; 4], &'static str> {
    numbers(text, &[',']).ok_or("write left, top, width and height in pixels, such as 100,50,640,360")
}

pub fn time(text: &str) -> Result<Duration, &'static str> {
    parse_duration(text).filter(|time| !time.is_zero()).ok_or("write a time such as 90s, 5m or 1h30m")
}

fn seconds(text: &str) -> Result<f32, &'static str> {
    let seconds = text.strip_suffix('s').unwrap_or(text).parse().ok();
    seconds.filter(|seconds: &f32| seconds.is_finite()).ok_or("write a number of seconds, such as 1.5")
}

fn noise(text: &str) -> Result<f32, &'static str> {
    let noise = text.parse().ok().filter(|noise| (0.0..1.0).contains(noise));
    noise.ok_or("write a number from 0 (never early) to below 1, such as 0.01")
}

fn exposure(text: &str) -> Result<f32, &'static str> {
    let stops = text.parse().ok().filter(|stops| (-64.0..=64.0).contains(stops));
    stops.ok_or("write a number of stops from -64 to 64, such as 1.5 or -1")
}

pub fn threads(text: &str) -> Result<usize, String> {
    let threads = text.parse().ok().filter(|n| (1..=MAX_THREADS).contains(n));
    threads.ok_or_else(|| format!("write a number from 1 to {MAX_THREADS}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lists_of_numbers() {
        assert_eq!(size("1280x720"), Ok([1280, 720]));
        assert_eq!(crop("1,2, 3,4"), Ok([1, 2, 3, 4]));
        for bad in ["", "12", "12x", "1x2x3", "-1x2", "1.5x2", "99999999999x1"] {
            assert!(size(bad).is_err(), "{bad}");
        }
        assert!(crop("1,2,3").is_err());
    }

    #[test]
    fn numbers_out_of_range() {
        assert!(["nan", "-0.1", "1", "inf", ""].iter().all(|text| noise(text).is_err()));
        assert!(["nan", "65", "x"].iter().all(|text| exposure(text).is_err()));
        assert!(["nan", "inf", "1:30", ""].iter().all(|text| seconds(text).is_err()));
        assert_eq!((seconds("1.5"), seconds("2s")), (Ok(1.5), Ok(2.0)));
        assert!(["0", "-1", "2000", "two"].iter().all(|text| threads(text).is_err()));
        assert!(["0s", "soon"].iter().all(|text| time(text).is_err()));
        assert_eq!((noise("0.02"), exposure("-1.5"), threads("3")), (Ok(0.02), Ok(-1.5), Ok(3)));
    }

    #[test]
    fn only_what_was_given_overrides() {
        let mut render = render::Settings { time: Some(Duration::from_secs(1)), ..Default::default() };
        let mut output = output::Settings::default();
        Overrides::default().apply(&mut render, &mut output);
        assert_eq!(render, render::Settings { time: Some(Duration::from_secs(1)), ..Default::default() });
        let basics = Basics { bounces: Some(2), crop: Some([1, 2, 3, 4]), ..Basics::default() };
        let flags = Overrides { basics, ..Overrides::default() };
        flags.apply(&mut render, &mut output);
        assert_eq!((render.bounces, render.crop), (Bounces::uniform(2), Some([1, 2, 3, 4])));
        assert_eq!(render.time, Some(Duration::from_secs(1)));
    }
}
