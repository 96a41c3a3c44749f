//! What a render took, as JSON (`--stats FILE.json`). Names carry their unit; absent numbers are `null`.

use std::time::Duration;

use serde::Serialize;

use super::{Depth, Format, Settings as OutputSettings, View};
use crate::{
    compile::SceneStats,
    film::SampleCounts,
    integrator::RayCounts,
    render::{Bounces, FilterKind, Outcome, Rendering, Settings},
};

#[derive(Debug, Serialize)]
pub struct Stats {
    /// Version of rayo.
    pub rayo: &'static str,
    pub file: String,
    pub outcome: &'static str,
    pub settings: SettingsUsed,
    pub scene: SceneStats,
    pub rays: Rays,
    pub samples: Samples,
    /// Estimated relative error of the picture.
    pub noise: Option<f32>,
    pub seconds: Seconds,
    pub film_bytes: u64,
    /// Largest resident memory of the process so far; `null` where the system does not tell.
    pub peak_memory_bytes: Option<u64>,
}

#[derive(Debug, Serialize)]
pub struct SettingsUsed {
    pub size: [u32; 2],
    pub crop: Option<[u32; 4]>,
    pub samples: u32,
    /// Whether samples went where the noise was.
    pub adaptive: bool,
    pub noise: f32,
    pub time_seconds: Option<f64>,
    pub seed: u64,
    pub threads: Option<usize>,
    pub bounces: Bounces,
    pub filter: &'static str,
    /// Full width of the filter's support.
    pub filter_width_pixels: f32,
    /// As scene files call it; `null` for a format that has but one.
    pub depth: Option<&'static str>,
    pub view: &'static str,
    pub exposure: f32,
    /// Whether the file holds the variance of each pixel.
    pub variance: bool,
}

#[derive(Debug, Serialize)]
pub struct Rays {
    pub camera: u64,
    pub bounce: u64,
    pub shadow: u64,
    pub total: u64,
    /// Millions of rays of all kinds per second of rendering.
    pub mrays_per_second: f64,
}

#[derive(Debug, Serialize)]
pub struct Samples {
    pub per_pixel_min: u32,
    pub per_pixel_mean: f64,
    pub per_pixel_max: u32,
    pub per_second: f64,
    /// Non-finite or negative samples, left out of the picture.
    pub dropped: u64,
    pub pixels_without_samples: u64,
}

/// By phase, one after the other.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct Seconds {
    /// Until the first trees were begun.
    pub load: f64,
    /// Until rendering began: trees, tables, and the images that were not decoded before.
    pub build: f64,
    pub render: f64,
    pub write: f64,
}

impl Stats {
    pub fn new(
        settings: &Settings,
        output: &OutputSettings,
        scene: &SceneStats,
        rendering: &Rendering,
        counts: &SampleCounts,
        seconds: Seconds,
    ) -> Self {
        let samples = counts.mean * rendering.film.pixels().len() as f64;
        Self {
            rayo: env!("CARGO_PKG_VERSION"),
            file: output.file.display().to_string(),
            outcome: match rendering.outcome {
                Outcome::Finished => "finished",
                Outcome::NoiseReached => "noise reached",
                Outcome::TimeUp => "time up",
                Outcome::Cancelled => "interrupted",
            },
            settings: SettingsUsed::new(settings, output),
            scene: *scene,
            rays: Rays::new(&rendering.rays, rendering.duration),
            samples: Samples {
                per_pixel_min: counts.min,
                per_pixel_mean: counts.mean,
                per_pixel_max: counts.max,
                per_second: per_second(samples, rendering.duration),
                dropped: counts.dropped,
                pixels_without_samples: counts.empty,
            },
            noise: rendering.noise,
            seconds,
            film_bytes: rendering.film.memory() as u64,
            peak_memory_bytes: peak_memory(),
        }
    }

    pub fn to_json(&self) -> String {
        // Plain numbers and strings: nothing here can fail to serialise.
        serde_json::to_string_pretty(self).unwrap_or_default() + "\n"
    }
}

impl SettingsUsed {
    fn new(render: &Settings, output: &OutputSettings) -> Self {
        Self {
            size: render.size,
            crop: render.crop,
            samples: render.samples,
            adaptive: render.adaptive,
            noise: render.noise,
            time_seconds: render.time.map(|t| t.as_secs_f64()),
            seed: render.seed,
            threads: render.threads,
            bounces: render.bounces,
            filter: match render.filter.kind {
                FilterKind::Box => "box",
                FilterKind::Gaussian => "gaussian",
                FilterKind::BlackmanHarris => "blackman-harris",
            },
            filter_width_pixels: render.filter.width,
            depth: match (Format::of(&output.file), output.depth) {
                (Some(Format::Png), Depth::Low) => Some("8"),
                (Some(Format::Png), Depth::High) => Some("16"),
                (Some(Format::Exr), Depth::Low) => Some("half"),
                (Some(Format::Exr), Depth::High) => Some("float"),
                (Some(Format::Hdr) | None, _) => None,
            },
            view: match output.view {
                View::Srgb => "srgb",
                View::Gamma2 => "gamma2",
                View::Raw => "raw",
            },
            exposure: output.exposure,
            variance: output.variance,
        }
    }
}

impl Rays {
    pub fn new(rays: &RayCounts, duration: Duration) -> Self {
        let total = rays.total();
        Self {
            camera: rays.camera,
            bounce: rays.bounce,
            shadow: rays.shadow,
            total,
            mrays_per_second: per_second(total as f64, duration) / 1e6,
        }
    }
}

fn per_second(count: f64, duration: Duration) -> f64 {
    count / duration.as_secs_f64().max(1e-9)
}

/// Peak resident set size of this process, bytes.
pub fn peak_memory() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    let kibibytes: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(kibibytes * 1024)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::render::{Monitor, render_samples};

    #[test]
    fn json_holds_what_was_rendered() {
        let settings = Settings { size: [8, 4], samples: 4, ..Settings::default() };
        let sample = |x, _, _, rays: &mut RayCounts| {
            rays.camera += 1;
            rays.shadow += 3;
            glam::Vec3::splat(if x == 0 { f32::NAN } else { 1.0 })
        };
        let rendering = render_samples(&sample, &settings, &Monitor::default()).expect("small");
        let counts = rendering.film.sample_counts();
        let scene = SceneStats { triangles: 12, ..SceneStats::default() };
        let output = OutputSettings { file: "a.png".into(), ..OutputSettings::default() };
        let stats = Stats::new(&settings, &output, &scene, &rendering, &counts, Seconds::default());
        let json: serde_json::Value = serde_json::from_str(&stats.to_json()).expect("valid JSON");
        assert_eq!(json["scene"]["triangles"], 12);
        assert_eq!(json["rays"]["total"], 8 * 4 * 4 * 4);
        assert_eq!(json["samples"]["dropped"], 4 * 4);
        assert_eq!(json["samples"]["pixels_without_samples"], 4);
        assert_eq!(json["outcome"], "finished");
        assert_eq!(json["film_bytes"], 8 * 4 * 56);
        assert_eq!(json["settings"]["filter"], "blackman-harris");
        assert_eq!(json["settings"]["depth"], "8");
        assert_eq!(json["settings"]["bounces"]["total"], 16);
    }

    #[test]
    #[cfg(target_os = "linux")]
    fn peak_memory_is_plausible() {
        let bytes = peak_memory().expect("Linux tells");
        assert!((1 << 20..1 << 40).contains(&bytes), "{bytes}");
    }
}
