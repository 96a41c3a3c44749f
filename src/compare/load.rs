//! Picture files of any program into [`Picture`]: linear Rec.709, finite, not negative.
//!
//! | file | read as |
//! |---|---|
//! | EXR, half or float | scene-linear; the channels R, G, B, or those that end so (`ViewLayer.Combined.R`), or Y; with `variance.R/G/B` beside them, the variance of each pixel's mean |
//! | Radiance HDR | scene-linear |
//! | PNG, 8 or 16 bits, and other display formats | decoded with the sRGB curve: light above 1 was clipped when the file was written |
//!
//! Numbers that are not finite, and negative ones, count as 0 and are counted. Alpha is not looked at. An EXR's data
//! window may be smaller than its display window (a crop) or larger (overscan): outside the display window nothing is
//! looked at, and pixels of the display window without data are black, unless [`align`] finds the same window in all.

use std::path::Path;

use super::exr;
use crate::{
    color::{Picture, srgb_decode},
    import::image::{self, MAX_FILE_BYTES},
    input,
    world::Texels,
};

/// How a file stores light.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Encoding {
    /// Scene-linear, 32-bit float or shared exponent.
    Float,
    /// Scene-linear, 16-bit float.
    Half,
    /// Display numbers, with this many bits.
    Display(u8),
}

/// Numbers of a file that count as 0.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct BadNumbers {
    pub nan: u64,
    pub infinite: u64,
    pub negative: u64,
}

/// A picture file.
#[derive(Clone, Debug)]
pub struct Loaded {
    pub picture: Picture,
    /// Estimated variance of each pixel's mean, per channel. Infinite where it is not known.
    pub variance: Option<Vec<[f32; 3]>>,
    /// Of the picture's first pixel in the display window.
    pub origin: [u32; 2],
    /// Width and height of the display window.
    pub display: [u32; 2],
    pub encoding: Encoding,
    pub bad: BadNumbers,
    /// The file says that its primaries are not Rec.709's; they were taken as such.
    pub foreign_primaries: bool,
}

impl Loaded {
    /// A picture that fills its display window.
    pub fn new(picture: Picture, encoding: Encoding) -> Self {
        Self {
            origin: [0; 2],
            display: [picture.width, picture.height],
            picture,
            variance: None,
            encoding,
            bad: BadNumbers::default(),
            foreign_primaries: false,
        }
    }

    /// What should be known about the file beside its pixels, for people.
    pub fn notes(&self) -> Vec<String> {
        let mut notes = Vec::new();
        if let Encoding::Display(bits) = self.encoding {
            notes.push(format!("display-referred, {bits} bits: decoded with the sRGB curve, clipped at 1"));
        }
        let BadNumbers { nan, infinite, negative } = self.bad;
        for (count, what) in [(nan, "NaN"), (infinite, "infinite"), (negative, "negative")] {
            match count {
                0 => {}
                1 => notes.push(format!("1 {what} number counts as 0")),
                n => notes.push(format!("{n} {what} numbers count as 0")),
            }
        }
        if self.foreign_primaries {
            notes.push("its primaries are not those of Rec.709: numbers were taken as they are".into());
        }
        notes
    }

    fn window(&self) -> ([u32; 2], [u32; 2], [u32; 2]) {
        (self.origin, [self.picture.width, self.picture.height], self.display)
    }

    /// Fills the display window, black and without variance where there were no data.
    fn fill_display(&mut self) {
        let [x, y] = self.origin.map(|n| n as usize);
        let old_width = self.picture.width as usize;
        let [width, height] = self.display.map(|n| n as usize);
        let fill = |old: &[[f32; 3]]| {
            let mut new = vec![[0.0; 3]; width * height];
            for (from, to) in old.chunks(old_width.max(1)).zip(new.chunks_mut(width.max(1)).skip(y)) {
                to[x..x + old_width].copy_from_slice(from);
            }
            new
        };
        self.picture =
            Picture { width: self.display[0], height: self.display[1], pixels: fill(&self.picture.pixels) };
        self.variance = self.variance.as_deref().map(fill);
        self.origin = [0; 2];
    }
}

/// Makes pictures of one display window comparable: if they all cover the same part of it, that part is compared, else
/// all of it.
pub fn align(all: &mut [Loaded]) {
    let same = all.windows(2).all(|pair| pair[0].window() == pair[1].window());
    if !same {
        all.iter_mut().for_each(Loaded::fill_display);
    }
}

/// Reads the file at `path`. Errors complete "cannot read …: ".
pub fn load(path: &Path) -> Result<Loaded, String> {
    let bytes = input::read(path, MAX_FILE_BYTES)?;
    if bytes.starts_with(&exr::MAGIC) {
        return from_exr(exr::decode(&bytes)?);
    }
    let image = image::decode(&bytes, &path.to_string_lossy())?;
    let decode = |c: f32| srgb_decode(c);
    let (pixels, encoding) = match image.texels {
        Texels::Rgba8(texels) => {
            let pixels = texels.iter().map(|&[r, g, b, _]| [r, g, b].map(|c| decode(f32::from(c) / 255.0)));
            (pixels.collect(), Encoding::Display(8))
        }
        Texels::Rgba16(texels) => {
            let pixels = texels.iter().map(|&[r, g, b, _]| [r, g, b].map(|c| decode(f32::from(c) / 65535.0)));
            (pixels.collect(), Encoding::Display(16))
        }
        Texels::RgbF32(texels) => (texels, Encoding::Float),
    };
    let mut loaded = Loaded::new(Picture { width: image.width, height: image.height, pixels }, encoding);
    loaded.bad = clean(&mut loaded.picture.pixels);
    Ok(loaded)
}

fn from_exr(raw: exr::Raw) -> Result<Loaded, String> {
    let height = raw.pixels.len().checked_div(raw.width).unwrap_or(0);
    let columns = overlap(raw.position[0], raw.width, raw.display[0]);
    let rows = overlap(raw.position[1], height, raw.display[1]);
    let (Some((x, columns)), Some((y, rows))) = (columns, rows) else {
        return Err("no pixel of it lies within its display window".into());
    };
    let cut = |pixels: Vec<[f32; 3]>| -> Vec<[f32; 3]> {
        let rows = pixels.chunks(raw.width).skip(rows.start).take(rows.len());
        rows.filter_map(|row| row.get(columns.clone())).flatten().copied().collect()
    };
    let mut pixels = cut(raw.pixels);
    let bad = clean(&mut pixels);
    let variance = raw.variance.map(cut).map(|mut variance| {
        for v in variance.as_flattened_mut() {
            *v = if v.is_nan() || *v < 0.0 { f32::INFINITY } else { *v };
        }
        variance
    });
    Ok(Loaded {
        picture: Picture { width: columns.len() as u32, height: rows.len() as u32, pixels },
        variance,
        origin: [x, y],
        display: raw.display,
        encoding: if raw.half { Encoding::Half } else { Encoding::Float },
        bad,
        foreign_primaries: raw.foreign_primaries,
    })
}

/// Where along one axis the data begin in the display window, and which of them lie in it.
fn overlap(position: i32, length: usize, display: u32) -> Option<(u32, std::ops::Range<usize>)> {
    let (position, length) = (i64::from(position), i64::try_from(length).ok()?);
    let start = position.max(0);
    let end = (position + length).min(i64::from(display));
    let range = usize::try_from(start - position).ok()?..usize::try_from(end - position).ok()?;
    (start < end).then_some((u32::try_from(start).ok()?, range))
}

fn clean(pixels: &mut [[f32; 3]]) -> BadNumbers {
    let mut bad = BadNumbers::default();
    for number in pixels.as_flattened_mut() {
        let count = match *number {
            n if n.is_nan() => &mut bad.nan,
            n if n.is_infinite() => &mut bad.infinite,
            n if n < 0.0 => &mut bad.negative,
            _ => continue,
        };
        *count += 1;
        *number = 0.0;
    }
    bad
}

#[cfg(test)]
mod tests {
    use super::*;
    use ::exr::prelude::*;
    use std::path::PathBuf;

    fn write(
        folder: &Path,
        name: &str,
        size: (usize, usize),
        at: (i32, i32),
        display: (usize, usize),
    ) -> PathBuf {
        let file = folder.join(name);
        let width = size.0;
        let channel = |name: &str, value: f32| {
            let samples =
                (0..size.0 * size.1).map(|i| value + (i % width + 10 * (i / width)) as f32).collect();
            AnyChannel::new(name, FlatSamples::F32(samples))
        };
        let channels = AnyChannels::sort(SmallVec::from_vec(vec![
            channel("ViewLayer.Combined.R", 0.0),
            channel("ViewLayer.Combined.G", 100.0),
            channel("ViewLayer.Combined.B", f32::NEG_INFINITY),
            channel("ViewLayer.Combined.A", 1.0),
            channel("ViewLayer.Depth.Z", f32::NAN),
        ]));
        let attributes = LayerAttributes { layer_position: Vec2(at.0, at.1), ..LayerAttributes::default() };
        let layer = Layer::new(size, attributes, ::exr::prelude::Encoding::FAST_LOSSLESS, channels);
        let mut image = Image::from_layer(layer);
        image.attributes.display_window = IntegerBounds::from_dimensions(display);
        image.write().to_file(&file).expect("written");
        file
    }

    #[test]
    fn channels_of_other_programs_and_bad_numbers() {
        let folder = tempfile::tempdir().expect("folder");
        let loaded = load(&write(folder.path(), "a.exr", (3, 2), (0, 0), (3, 2))).expect("reads");
        assert_eq!(loaded.picture.pixels[4], [11.0, 111.0, 0.0]);
        assert_eq!(loaded.bad, BadNumbers { nan: 0, infinite: 6, negative: 0 });
        assert_eq!(loaded.notes(), ["6 infinite numbers count as 0"]);
    }

    #[test]
    fn windows() {
        let folder = tempfile::tempdir().expect("folder");
        let at = folder.path();
        // Overscan by one pixel all around: what is outside does not count.
        let over = load(&write(at, "over.exr", (6, 5), (-1, -1), (4, 3))).expect("reads");
        assert_eq!((over.picture.width, over.picture.height, over.origin), (4, 3, [0, 0]));
        assert_eq!(over.picture.pixels[0][0], 11.0);
        assert_eq!(over.picture.pixels[11][0], 34.0);
        // Two equal crops are compared as they are, a crop and a whole picture on the whole.
        let crop = load(&write(at, "crop.exr", (2, 2), (1, 1), (4, 3))).expect("reads");
        let mut same = [crop.clone(), crop.clone()];
        align(&mut same);
        assert_eq!(same[0].picture.width, 2);
        let mut unlike = [over, crop];
        align(&mut unlike);
        let reds: Vec<f32> = unlike[1].picture.pixels.iter().map(|p| p[0]).collect();
        assert_eq!(reds, [0., 0., 0., 0., 0., 0., 1., 0., 0., 10., 11., 0.]);
        assert!(load(&write(at, "off.exr", (2, 2), (4, 0), (4, 3))).is_err());
    }

    #[test]
    fn png_is_decoded_with_the_srgb_curve() {
        use ::image::{ImageBuffer, Rgb};
        let folder = tempfile::tempdir().expect("folder");
        let (low, high) = (folder.path().join("low.png"), folder.path().join("high.png"));
        ImageBuffer::from_pixel(2, 1, Rgb([128u8, 255, 0])).save(&low).expect("written");
        ImageBuffer::from_pixel(2, 1, Rgb([32896u16, 65535, 0])).save(&high).expect("written");
        for (file, bits) in [(low, 8), (high, 16)] {
            let loaded = load(&file).expect("reads");
            assert!((loaded.picture.pixels[0][0] - 0.215_86).abs() < 1e-4);
            assert_eq!((loaded.picture.pixels[0][1], loaded.encoding), (1.0, super::Encoding::Display(bits)));
            assert!(loaded.notes()[0].contains("sRGB"));
        }
    }
}
