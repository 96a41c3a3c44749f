//! EXR files of any program: the colour channels wherever they are, variance where there is one, and where on the
//! display window the pixels lie.

use std::{
    io::Cursor,
    panic::{AssertUnwindSafe, catch_unwind},
};

use ::exr::{
    meta::attribute::SampleType,
    prelude::{
        Error, IntegerBounds, MetaData, ReadChannels, ReadLayers, ReadSpecificChannel, Text, Vec2, read,
    },
};

use crate::import::image::{MAX_BYTES, MAX_SIDE};

pub const MAGIC: [u8; 4] = [0x76, 0x2F, 0x31, 0x01];

/// Chromaticities closer than this to Rec.709's are Rec.709's.
const CHROMATICITY_TOLERANCE: f32 = 2e-3;

/// Red, green, blue and white of Rec.709.
const REC709: [[f32; 2]; 4] = [[0.64, 0.33], [0.30, 0.60], [0.15, 0.06], [0.3127, 0.3290]];

/// What is in the file, as it is.
pub struct Raw {
    pub width: usize,
    pub pixels: Vec<[f32; 3]>,
    pub variance: Option<Vec<[f32; 3]>>,
    /// Of the first pixel in the display window; negative where the data reach beyond it.
    pub position: [i32; 2],
    pub display: [u32; 2],
    pub half: bool,
    /// Whether the file says that its primaries are others than Rec.709's.
    pub foreign_primaries: bool,
}

/// The names of three channels.
#[derive(Clone, Debug, PartialEq)]
struct Names {
    colors: [String; 3],
    variance: Option<[String; 3]>,
}

pub fn decode(bytes: &[u8]) -> Result<Raw, String> {
    let guarded = catch_unwind(AssertUnwindSafe(|| decode_unguarded(bytes)));
    guarded.unwrap_or_else(|_| Err("its decoder failed on it".into()))
}

fn decode_unguarded(bytes: &[u8]) -> Result<Raw, String> {
    let text = |e: Error| e.to_string();
    let meta = MetaData::read_from_buffered(Cursor::new(bytes), false).map_err(text)?;
    let layers: Vec<Vec<String>> = meta
        .headers
        .iter()
        .map(|header| header.channels.list.iter().map(|c| c.name.to_string()).collect())
        .collect();
    let (layer, names) = choose(&layers).ok_or("it has no channels named R, G and B, nor Y")?;
    let header = meta.headers.get(layer).ok_or("it has no layers")?;
    let (display, data) = (header.shared_attributes.display_window, header.data_window());
    check_size(data)?;
    check_size(display)?;
    let position = [data.position.x() - display.position.x(), data.position.y() - display.position.y()];
    let half = header
        .channels
        .list
        .iter()
        .any(|c| c.name.eq(names.colors[0].as_str()) && c.sample_type == SampleType::F16);
    let foreign_primaries = header.shared_attributes.chromaticities.is_some_and(|c| {
        let given = [c.red, c.green, c.blue, c.white].map(|v| [v.x(), v.y()]);
        let (given, ours) = (given.as_flattened(), REC709.as_flattened());
        given.iter().zip(ours).any(|(a, b)| (a - b).abs() > CHROMATICITY_TOLERANCE)
    });
    let pixels = channels(bytes, &names.colors)?;
    let variance = names.variance.map(|names| channels(bytes, &names)).transpose()?;
    Ok(Raw {
        width: data.size.width(),
        pixels,
        variance,
        position,
        display: [side(display.size.width())?, side(display.size.height())?],
        half,
        foreign_primaries,
    })
}

fn check_size(window: IntegerBounds) -> Result<(), String> {
    let [width, height] = [side(window.size.width())?, side(window.size.height())?];
    // Colour and variance.
    if u64::from(width) * u64::from(height) * 24 > 2 * MAX_BYTES {
        return Err(format!("its {width} × {height} pixels are more than can be held"));
    }
    Ok(())
}

fn side(pixels: usize) -> Result<u32, String> {
    match u32::try_from(pixels) {
        Ok(side) if (1..=MAX_SIDE).contains(&side) => Ok(side),
        _ => Err(format!("its side of {pixels} pixels is not from 1 to {MAX_SIDE}")),
    }
}

/// The layer and the channels that are the picture: R, G and B; else those of Blender's combined pass (`….Combined.R`);
/// else the first that end so; else Y alone, for grey.
fn choose(layers: &[Vec<String>]) -> Option<(usize, Names)> {
    let prefixes = |end: &str| -> Vec<(usize, String)> {
        let of_layer = |(i, names): (usize, &Vec<String>)| -> Vec<(usize, String)> {
            let prefixed = |name: &String| name.strip_suffix(end).map(|prefix| (i, prefix.to_owned()));
            names.iter().filter_map(prefixed).collect()
        };
        layers.iter().enumerate().flat_map(of_layer).collect()
    };
    let has =
        |layer: usize, name: &str| layers.get(layer).is_some_and(|names| names.iter().any(|n| n == name));
    let rank = |prefix: &str| match prefix {
        "" => 0,
        _ if prefix.ends_with("Combined.") => 1,
        _ if !prefix.ends_with('.') => 3,
        _ => 2,
    };
    let whole = |(layer, prefix): &(usize, String)| {
        !prefix.ends_with("variance.") && ["G", "B"].iter().all(|c| has(*layer, &format!("{prefix}{c}")))
    };
    let best = prefixes("R").into_iter().filter(whole).min_by_key(|(_, prefix)| rank(prefix));
    if let Some((layer, prefix)) = best {
        let colors = ["R", "G", "B"].map(|c| format!("{prefix}{c}"));
        let variance = ["R", "G", "B"].map(|c| format!("{prefix}variance.{c}"));
        let variance = variance.iter().all(|name| has(layer, name)).then_some(variance);
        return Some((layer, Names { colors, variance }));
    }
    let (layer, prefix) = prefixes("Y").into_iter().min_by_key(|(_, prefix)| rank(prefix))?;
    let grey = format!("{prefix}Y");
    Some((layer, Names { colors: [grey.clone(), grey.clone(), grey], variance: None }))
}

/// Three channels of the first layer that has them, row by row.
fn channels(bytes: &[u8], names: &[String; 3]) -> Result<Vec<[f32; 3]>, String> {
    type Canvas = (usize, Vec<[f32; 3]>);
    let create = |size: Vec2<usize>| -> Canvas { (size.width(), vec![[0.0; 3]; size.area()]) };
    let put = |(width, pixels): &mut Canvas, at: Vec2<usize>, pixel: [f32; 3]| {
        if let Some(place) = pixels.get_mut(at.y() * *width + at.x()) {
            *place = pixel;
        }
    };
    let name = |i: usize| Text::from(names[i].as_str());
    let levels = || read().no_deep_data().largest_resolution_level();
    let result = if names[0] == names[1] {
        levels()
            .specific_channels()
            .required(name(0))
            .collect_pixels(|size, _| create(size), move |canvas, at, (y,): (f32,)| put(canvas, at, [y; 3]))
            .first_valid_layer()
            .all_attributes()
            .from_buffered(Cursor::new(bytes))
            .map(|image| image.layer_data.channel_data.pixels)
    } else {
        levels()
            .specific_channels()
            .required(name(0))
            .required(name(1))
            .required(name(2))
            .collect_pixels(
                |size, _| create(size),
                move |canvas, at, (r, g, b): (f32, f32, f32)| put(canvas, at, [r, g, b]),
            )
            .first_valid_layer()
            .all_attributes()
            .from_buffered(Cursor::new(bytes))
            .map(|image| image.layer_data.channel_data.pixels)
    };
    result.map(|(_, pixels)| pixels).map_err(|e| e.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn chosen(layers: &[&[&str]]) -> Option<(usize, String, bool)> {
        let layers: Vec<Vec<String>> =
            layers.iter().map(|names| names.iter().map(ToString::to_string).collect()).collect();
        choose(&layers).map(|(layer, n)| (layer, n.colors[0].clone(), n.variance.is_some()))
    }

    #[test]
    fn the_picture_is_found_among_the_channels() {
        let plain: &[&str] = &["A", "B", "G", "R", "variance.B", "variance.G", "variance.R"];
        assert_eq!(chosen(&[plain]), Some((0, "R".into(), true)));
        let blender: &[&str] = &[
            "View.DiffCol.B",
            "View.DiffCol.G",
            "View.DiffCol.R",
            "View.Combined.B",
            "View.Combined.G",
            "View.Combined.R",
            "View.Depth.Z",
        ];
        assert_eq!(chosen(&[blender]), Some((0, "View.Combined.R".into(), false)));
        assert_eq!(
            chosen(&[&["Z"], &["beauty.R", "beauty.G", "beauty.B"]]),
            Some((1, "beauty.R".into(), false))
        );
        assert_eq!(chosen(&[&["Z", "Y"]]), Some((0, "Y".into(), false)));
        assert_eq!(chosen(&[&["variance.R", "variance.G", "variance.B"], &["R", "G"]]), None);
        assert_eq!(chosen(&[]), None);
    }
}
