//! Points, warps, distributions. Pure functions of uniform numbers; nothing here knows a scene.

pub mod distribution;
pub mod mis;
pub mod sobol;
pub mod warp;
pub mod weave;

#[cfg(test)]
pub mod stats;
