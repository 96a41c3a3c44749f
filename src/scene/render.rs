//! `[render]`: how the picture is made.

use schemars::json_schema;
use serde::Serialize;
use toml::de::DeValue;

use super::{
    choice::choice,
    context::Context,
    range::{above, from, read_array},
    read::{Read, Value},
    table::{inline_schema, table},
    time::Time,
};
use crate::{
    accel::Quality,
    render::{
        Bounces as BounceLimits, FilterKind, MAX_BOUNCES, MAX_PIXELS, MAX_SAMPLES, MAX_SIDE, MAX_THREADS,
        PixelFilter, Settings,
    },
};

table! {
    /// How the picture is made.
    struct Render {
        /// Width and height of the picture, pixels.
        size: Size = Size([1280, 720]),
        /// Samples per pixel. Where they are spread adaptively, some get more and others fewer, for the same work in all.
        samples: u32 = 256; from(1.0).to(MAX_SAMPLES as f64),
        /// Samples go where the noise is. Otherwise every pixel gets the same number, of one path each.
        adaptive: bool = true,
        /// Rendering ends when the estimated relative error of the picture is below this, if not at `samples` before. 0: never early.
        noise: f32 = 0.0; from(0.0).below(1.0),
        /// Rendering stops after this time: seconds, or "90s", "5m", "1h30m". Without it: no limit.
        time: Option<Time>,
        /// The most scattering events of a path: a number, or a table of limits by kind. 0: direct light only.
        bounces: Bounces = Bounces::All(16); from(0.0).to(MAX_BOUNCES as f64),
        /// Another number, another pattern of noise.
        seed: u64 = 0,
        /// Without it: as many as the machine has.
        threads: Option<u32>; from(1.0).to(MAX_THREADS as f64),
        /// Reconstruction filter: its name, or a table with its width.
        filter: Filter = Filter::Named(Kind::BlackmanHarris),
        /// How much time goes into building trees, which only changes the speed. Without it: by the number of triangles and samples.
        bvh: Option<Bvh>,
        /// Only this part is rendered: x and y of its top left corner, width, height; pixels.
        crop: Option<Crop>,
    }
}

choice! {
    /// Reconstruction filters.
    enum Kind { "box" => Box, "gaussian" => Gaussian, "blackman-harris" => BlackmanHarris }
}

choice! {
    /// How much time goes into building trees.
    enum Bvh { "fast" => Fast, "balanced" => Balanced, "best" => Best }
}

/// Width and height, pixels.
#[derive(Clone, Copy, Debug, Serialize)]
pub(super) struct Size([u32; 2]);

/// x, y, width, height, pixels.
#[derive(Clone, Copy, Debug)]
pub(super) struct Crop([u32; 4]);

/// One limit for all, or a table.
#[derive(Clone, Debug, Serialize)]
#[serde(untagged)]
pub(super) enum Bounces {
    All(u32),
    #[serde(skip)]
    ByKind(BounceTable),
}

table! {
    /// Limits on scattering events by kind, as in Cycles.
    struct BounceTable {
        /// Of all kinds together.
        total: u32 = 16; from(0.0).to(MAX_BOUNCES as f64),
        /// At diffuse surfaces. Without it: as many as in total. 0: direct light, mirrors and glass only.
        diffuse: Option<u32>; from(0.0).to(MAX_BOUNCES as f64),
        /// At mirrors and glossy surfaces. Without it: as many as in total.
        glossy: Option<u32>; from(0.0).to(MAX_BOUNCES as f64),
        /// Through glass. Without it: as many as in total.
        transmission: Option<u32>; from(0.0).to(MAX_BOUNCES as f64),
    }
}

/// A name, or a table with the width.
#[derive(Clone, Debug, Serialize)]
#[serde(untagged)]
pub(super) enum Filter {
    Named(Kind),
    #[serde(skip)]
    Table(FilterTable),
}

table! {
    /// A reconstruction filter with its width.
    struct FilterTable {
        /// Which filter.
        kind as "type": Kind = Kind::BlackmanHarris,
        /// Full width of its support, pixels. Without it: 1 for box, 3 for gaussian, 3.3 for blackman-harris.
        width: Option<f32>; above(0.0).to(16.0),
    }
}

impl Render {
    pub fn resolve(self, cx: &mut Context) -> Settings {
        let [width, height] = self.size.0;
        if let Some(Crop([x, y, w, h])) = self.crop
            && self.keys.sound(&["size"])
            && (u64::from(x) + u64::from(w) > width.into() || u64::from(y) + u64::from(h) > height.into())
        {
            cx.error(
                self.keys.value("crop"),
                format!("`crop` reaches beyond the picture of {width} × {height}"),
            )
            .help("x + width and y + height must not be larger than `size`");
        }
        Settings {
            size: self.size.0,
            crop: self.crop.map(|crop| crop.0),
            samples: self.samples,
            adaptive: self.adaptive,
            noise: self.noise,
            time: self.time.map(|time| time.0),
            seed: self.seed,
            threads: self.threads.map(|n| n as usize),
            bounces: self.bounces.resolve(),
            filter: self.filter.resolve(),
            bvh: self.bvh.map(|bvh| match bvh {
                Bvh::Fast => Quality::Fast,
                Bvh::Balanced => Quality::Balanced,
                Bvh::Best => Quality::Best,
            }),
        }
    }
}

impl Bounces {
    fn resolve(self) -> BounceLimits {
        match self {
            Bounces::All(total) => BounceLimits::uniform(total),
            Bounces::ByKind(BounceTable { total, diffuse, glossy, transmission, .. }) => BounceLimits {
                total,
                diffuse: diffuse.unwrap_or(total),
                glossy: glossy.unwrap_or(total),
                transmission: transmission.unwrap_or(total),
            },
        }
    }
}

impl Filter {
    fn resolve(self) -> PixelFilter {
        let (kind, width) = match self {
            Filter::Named(kind) => (kind, None),
            Filter::Table(table) => (table.kind, table.width),
        };
        let (kind, usual) = match kind {
            Kind::Box => (FilterKind::Box, 1.0),
            Kind::Gaussian => (FilterKind::Gaussian, 3.0),
            Kind::BlackmanHarris => (FilterKind::BlackmanHarris, 3.3),
        };
        PixelFilter { kind, width: width.unwrap_or(usual) }
    }
}

impl Read for Size {
    fn read(value: &Value, cx: &mut Context) -> Option<Self> {
        let [width, height] =
            read_array::<_, 2>(value, "two whole numbers: width and height", cx, u32::read)?;
        let side = 1..=MAX_SIDE;
        if !side.contains(&width) || !side.contains(&height) {
            cx.must(value.span(), &format!("1 to {MAX_SIDE} pixels a side"), &format!("{width} × {height}"));
            return None;
        }
        if u64::from(width) * u64::from(height) > MAX_PIXELS {
            cx.must(
                value.span(),
                &format!("at most {MAX_PIXELS} pixels in all"),
                &format!("{width} × {height}"),
            );
            return None;
        }
        Some(Self([width, height]))
    }
}

impl Read for Crop {
    fn read(value: &Value, cx: &mut Context) -> Option<Self> {
        let crop = read_array::<_, 4>(value, "four whole numbers: x, y, width and height", cx, u32::read)?;
        if crop[2] == 0 || crop[3] == 0 {
            cx.must(value.span(), "at least one pixel wide and high", &format!("{} × {}", crop[2], crop[3]));
            return None;
        }
        Some(Self(crop))
    }
}

impl Read for Bounces {
    fn read(value: &Value, cx: &mut Context) -> Option<Self> {
        match value.get_ref() {
            DeValue::Table(_) => BounceTable::read(value, cx).map(Self::ByKind),
            _ => u32::read(value, cx).map(Self::All),
        }
    }

    fn numbers(&self) -> Vec<f64> {
        match self {
            Bounces::All(total) => vec![f64::from(*total)],
            Bounces::ByKind(_) => Vec::new(),
        }
    }
}

impl Read for Filter {
    fn read(value: &Value, cx: &mut Context) -> Option<Self> {
        match value.get_ref() {
            DeValue::Table(_) => FilterTable::read(value, cx).map(Self::Table),
            _ => Kind::read(value, cx).map(Self::Named),
        }
    }
}

inline_schema! {
    Size, _generator: json_schema!({
        "type": "array",
        "items": { "type": "integer", "minimum": 1, "maximum": MAX_SIDE },
        "minItems": 2,
        "maxItems": 2,
    }),
    Crop, _generator: json_schema!({
        "type": "array",
        "items": { "type": "integer", "minimum": 0, "maximum": MAX_SIDE },
        "minItems": 4,
        "maxItems": 4,
    }),
    Bounces, generator: json_schema!({
        "anyOf": [
            { "type": "integer" },
            generator.subschema_for::<BounceTable>(),
        ],
    }),
    Filter, generator: json_schema!({
        "anyOf": [generator.subschema_for::<Kind>(), generator.subschema_for::<FilterTable>()],
    }),
}
