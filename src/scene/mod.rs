//! The scene file: TOML in, [`ValidScene`] out, or all that is wrong with it.
//!
//! The text becomes a tree of values with their places; each section's table (declared once with `table!`, one file a
//! section) is read from it, every wrong value reported at its own place; what keys mean together is checked after
//! that. The same declarations give the JSON Schema. Nothing but this folder knows TOML.
//!
//! | file | section |
//! |---|---|
//! | `render`, `camera`, `environment`, `material` (with `texture`), `primitive`, `model`, `light`, `output` | the tables of that name |
//! | `document` | the whole file |
//! | `table`, `choice` | how tables and closed sets of strings are declared and read |
//! | `read`, `range`, `vector`, `color`, `time`, `path` | the values on the right of a key |
//! | `context` | what was found wrong so far |

mod camera;
mod choice;
mod color;
mod context;
mod document;
mod environment;
mod layers;
mod light;
mod load;
mod material;
mod model;
mod output;
mod path;
mod primitive;
mod range;
mod read;
mod render;
mod selection;
mod table;
mod texture;
mod time;
mod valid;
mod vector;

#[cfg(test)]
mod tests;

pub use load::{load, parse, schema};
pub use selection::Selection;
pub use time::parse_duration;
pub use valid::{
    CameraSource, EnvironmentSource, EnvironmentSourceKind, ImageSource, Lens, MaterialOverride, ModelSource,
    ValidScene,
};
