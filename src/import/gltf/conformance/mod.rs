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
//! | `uris`, `images` | what lies outside the document |
//! | `findings` | gathering, so that a report stays short |
//!
//! [`document`] looks at the JSON alone, before anything of it is put right. Everything in it is looked at, used or not.

mod asset;
mod data_layout;
mod findings;
mod formats;
mod meshes;
mod motions;
mod schema;
mod structure;
mod surfaces;
mod tree;
mod uris;
mod usage;

use serde_json::{Map, Value};

use self::asset::Asset;
pub use self::findings::Findings;

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
