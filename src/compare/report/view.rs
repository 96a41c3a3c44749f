//! What the page is told, as its JSON says it.

use serde::Serialize;

use super::{
    Pair, Pairs, VIEW_PIXELS,
    data::{Blobs, bytes, halves, reduce, reduction},
};
use crate::compare::{Numbers, Welch};

#[derive(Serialize)]
pub struct Report<'a> {
    pub rayo: &'static str,
    pub title: &'a str,
    pub notes: &'a [String],
    /// 256 colours each, `rrggbb` in a row.
    pub sequential: String,
    pub diverging: String,
    pub groups: Vec<Group<'a>>,
}

#[derive(Serialize)]
pub struct Group<'a> {
    name: &'a str,
    description: &'a str,
    notes: &'a [String],
    /// Whether each picture is compared with each.
    all: bool,
    /// Of the pictures.
    width: usize,
    height: usize,
    /// Of what is shown of them: smaller by this factor.
    reduction: usize,
    pictures: Vec<Picture<'a>>,
    pairs: Vec<PairView>,
}

#[derive(Serialize)]
struct Picture<'a> {
    name: &'a str,
    details: &'a [(String, String)],
    blob: usize,
}

#[derive(Serialize)]
struct PairView {
    reference: usize,
    image: usize,
    #[serde(flatten)]
    numbers: Numbers,
    welch: Option<Welch>,
    ldr_blob: usize,
    hdr_blob: usize,
}

impl<'a> Group<'a> {
    pub fn new(group: &'a super::Group, pairs: &[Pair], blobs: &mut Blobs) -> Self {
        let size = group.pictures.first().map(|entry| &entry.picture);
        let (width, height) = size.map_or((0, 0), |p| (p.width as usize, p.height as usize));
        let factor = reduction(width, height, VIEW_PIXELS);
        let pictures = group.pictures.iter().map(|entry| Picture {
            name: &entry.name,
            details: &entry.details,
            blob: blobs.add(halves(&reduce(&entry.picture.pixels, width, factor))),
        });
        let pictures = pictures.collect();
        let mut views: Vec<PairView> = Vec::new();
        for pair in pairs {
            let mut map = |map: &[f32]| {
                let map: Vec<[f32; 1]> = map.iter().map(|&e| [e]).collect();
                blobs.add(bytes(reduce(&map, width, factor).as_flattened()))
            };
            let hdr_blob = map(&pair.comparison.hdr_flip);
            // LDR-FLIP is the same either way round.
            let turned = views.iter().find(|v| (v.image, v.reference) == (pair.reference, pair.image));
            let ldr_blob = match turned {
                Some(turned) => turned.ldr_blob,
                None => map(&pair.comparison.ldr_flip),
            };
            let Pair { reference, image, welch, .. } = *pair;
            views.push(PairView {
                reference,
                image,
                numbers: pair.comparison.numbers,
                welch,
                ldr_blob,
                hdr_blob,
            });
        }
        Self {
            name: &group.name,
            description: &group.description,
            notes: &group.notes,
            all: group.pairs == Pairs::All,
            width,
            height,
            reduction: factor,
            pictures,
            pairs: views,
        }
    }
}
