//! One self-contained HTML page that shows how pictures differ: no network, no other files.
//!
//! A [`Report`] is a list of groups, each a few pictures of one size that show the same thing. [`measure`] compares them in
//! pairs, [`page`] writes the page around the numbers, [`html`] does both.
//!
//! The page holds each picture as half floats and each FLIP map in 8 bits, deflated (zlib) and in base64; the browser
//! inflates what is looked at. Of pictures above [`VIEW_PIXELS`] it holds a box-filtered reduction by a whole factor, and
//! says so; the numbers are always those of all pixels.
//!
//! HTML, style and scripts are the files beside this one. Names and notes reach the page as JSON and are set as text,
//! so that none can become markup.

mod colormap;
mod data;
mod view;

use std::path::Path;

use super::{
    Comparison, Loaded, SizeMismatch, Welch, compare,
    load::Encoding,
    welch::{self, Estimate},
};
use crate::color::Picture;
use rayon::prelude::*;

/// Pictures of more pixels are shown reduced; just above 1920 × 1080.
pub const VIEW_PIXELS: usize = 1 << 21;

const PAGE: &str = include_str!("page.html");
const STYLE: &str = include_str!("style.css");
const SCRIPTS: [&str; 6] = [
    include_str!("data.js"),
    include_str!("format.js"),
    include_str!("tables.js"),
    include_str!("histogram.js"),
    include_str!("viewer.js"),
    include_str!("main.js"),
];

#[derive(Clone, Debug)]
pub struct Report {
    pub title: String,
    /// Paragraphs below the title.
    pub notes: Vec<String>,
    pub groups: Vec<Group>,
}

/// Pictures of one size that show the same thing.
#[derive(Clone, Debug)]
pub struct Group {
    pub name: String,
    pub description: String,
    pub notes: Vec<String>,
    pub pictures: Vec<Entry>,
    pub pairs: Pairs,
}

/// Which pictures of a group are compared.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pairs {
    /// Each but the first with the first, which is the reference.
    WithFirst,
    /// Each with each other, either way round.
    All,
}

#[derive(Clone, Debug)]
pub struct Entry {
    pub name: String,
    /// What to know about how it was made: name and value (version, settings, seconds).
    pub details: Vec<(String, String)>,
    pub picture: Picture,
    /// Variance of each pixel's mean, for the Welch test.
    pub variance: Option<Vec<[f32; 3]>>,
    /// Whether the numbers were rounded to 16-bit floats.
    pub half: bool,
}

impl Entry {
    pub fn new(name: impl Into<String>, details: Vec<(String, String)>, picture: Picture) -> Self {
        Self { name: name.into(), details, picture, variance: None, half: false }
    }

    /// A picture that was read, with its variance.
    pub fn of(name: impl Into<String>, details: Vec<(String, String)>, loaded: Loaded) -> Self {
        let half = loaded.encoding == Encoding::Half;
        Self { variance: loaded.variance, half, ..Self::new(name, details, loaded.picture) }
    }

    fn estimate(&self) -> Option<Estimate<'_>> {
        let variance = self.variance.as_deref()?;
        Some(Estimate { picture: &self.picture, variance, half: self.half })
    }
}

/// One picture of a group measured against another, by their places in the group.
#[derive(Clone, Debug)]
pub struct Pair {
    pub reference: usize,
    pub image: usize,
    pub comparison: Comparison,
    /// Where both carry variance.
    pub welch: Option<Welch>,
}

/// The pairs of a group, in the order of reference and image.
pub fn measure(group: &Group) -> Result<Vec<Pair>, SizeMismatch> {
    let count = group.pictures.len();
    let references = match group.pairs {
        Pairs::WithFirst => 0..count.min(1),
        Pairs::All => 0..count,
    };
    let pairs: Vec<[usize; 2]> = references
        .flat_map(|reference| (0..count).map(move |image| [reference, image]))
        .filter(|[reference, image]| reference != image)
        .collect();
    pairs
        .into_par_iter()
        .map(|[reference, image]| {
            let [b, a] = [&group.pictures[reference], &group.pictures[image]];
            let comparison = compare(&b.picture, &a.picture)?;
            let welch = match (a.estimate(), b.estimate()) {
                (Some(a), Some(b)) => welch::test(a, b)?,
                _ => None,
            };
            Ok(Pair { reference, image, comparison, welch })
        })
        .collect()
}

/// Measures all groups and writes the page.
pub fn html(report: &Report) -> Result<String, SizeMismatch> {
    let pairs: Result<Vec<Vec<Pair>>, SizeMismatch> = report.groups.iter().map(measure).collect();
    Ok(page(report, &pairs?))
}

/// The page of `report`, `pairs` being those of its groups.
pub fn page(report: &Report, pairs: &[impl AsRef<[Pair]>]) -> String {
    let mut blobs = data::Blobs::default();
    let groups: Vec<view::Group> = report
        .groups
        .iter()
        .zip(pairs)
        .map(|(group, pairs)| view::Group::new(group, pairs.as_ref(), &mut blobs))
        .collect();
    let view = view::Report {
        rayo: env!("CARGO_PKG_VERSION"),
        title: &report.title,
        notes: &report.notes,
        sequential: colormap::hex(colormap::sequential),
        diverging: colormap::hex(colormap::diverging),
        groups,
    };
    let parts = [
        ("<!--title-->", data::escape(&report.title)),
        ("/*style*/", STYLE.to_owned()),
        ("<!--blobs-->", blobs.elements()),
        ("/*report*/", data::json(&view)),
        ("/*scripts*/", SCRIPTS.join("\n")),
    ];
    fill(PAGE, &parts)
}

/// `template` with each mark replaced. Marks are looked for in the template alone, never in what was put in.
fn fill(template: &str, parts: &[(&str, String)]) -> String {
    let mut rest = template;
    let mut page =
        String::with_capacity(template.len() + parts.iter().map(|(_, text)| text.len()).sum::<usize>());
    for (mark, text) in parts {
        if let Some((before, after)) = rest.split_once(mark) {
            page += before;
            page += text;
            rest = after;
        }
    }
    page + rest
}

/// The shortest ends of paths that tell them apart: `a.exr` and `b.exr`, but `old/a.exr` and `new/a.exr`.
pub fn short_names(files: &[&Path]) -> Vec<String> {
    let end = |file: &Path, parts: usize| -> String {
        let all: Vec<_> = file.components().map(|c| c.as_os_str().to_string_lossy().into_owned()).collect();
        all[all.len().saturating_sub(parts)..].join("/")
    };
    let longest = files.iter().map(|file| file.components().count()).max().unwrap_or(1);
    let named = |parts: usize| -> Vec<String> { files.iter().map(|file| end(file, parts)).collect() };
    let distinct = |names: &[String]| {
        let mut sorted = names.to_vec();
        sorted.sort();
        sorted.windows(2).all(|pair| pair[0] != pair[1])
    };
    (1..longest).map(named).find(|names| distinct(names)).unwrap_or_else(|| named(longest))
}

#[cfg(test)]
mod tests;
