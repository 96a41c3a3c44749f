//! Passes over tiles, threads, stopping rules.

mod settings;

pub use settings::{Bounces, FilterKind, PixelFilter, Settings};
