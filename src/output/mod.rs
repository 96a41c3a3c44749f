//! Pictures and statistics to files.

mod settings;

pub use settings::{Depth, Settings, View};
