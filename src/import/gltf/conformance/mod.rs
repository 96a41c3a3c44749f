//! What the specification forbids though the import survives it, or does not look at it: warnings, never errors.
//!
//! | file | concern |
//! |---|---|
//! | `schema` | `schema.toml`: the objects of glTF and its extensions, and what they may hold |
//! | `structure` | a document against the schema |
//! | `asset` | raw JSON, read without belief |
//! | `data_layout`, `usage` | views and accessors: alignment, strides, one purpose each |
//! | `tree` | transforms, skins and their joints |
//! | `meshes`, `surfaces`, `formats` | primitives, and what their materials ask of them |
//! | `motions` | animations |
//! | `values`, `summary`, `influences` | the data of accessors |
//! | `uris`, `images`, `header` | URIs, and the image files behind them |
//! | `findings` | gathering, so that a report stays short |
//!
//! [`document`] looks at the JSON alone, before anything of it is put right; [`data`] at what it describes, once that is known
//! to be where it says. Everything is looked at, used or not, and all that takes longer the more there is has a limit.

mod asset;
mod data_layout;
mod findings;
mod formats;
mod header;
mod images;
mod influences;
mod meshes;
mod motions;
mod schema;
mod structure;
mod summary;
mod surfaces;
mod tree;
mod uris;
mod usage;
mod values;

use std::path::Path;

use serde_json::{Map, Value};

use self::asset::Asset;
pub use self::findings::Findings;
use super::accessor::Source;

/// Looks at the JSON of a document.
pub fn document(root: &Map<String, Value>, findings: &mut Findings) {
    let asset = Asset { root };
    structure::check(asset, findings);
    data_layout::check(asset, findings);
    usage::check(asset, findings);
    tree::check(asset, findings);
    meshes::check(asset, findings);
    motions::check(asset, findings);
}

/// Looks at the data of a document that is sound enough to be read; its accessors from `given` on were made by decoding.
pub fn data(source: &Source, given: usize, folder: &Path, findings: &mut Findings) {
    values::check(source, given, findings);
    influences::check(source, findings);
    images::check(source, folder, findings);
}
