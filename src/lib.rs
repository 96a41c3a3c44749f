//! **rayo**: a physically based CPU renderer, driven by scene files, that imports glTF 2.0 and OBJ.
//!
//! Data flows in one direction, one folder a step:
//!
//! ```text
//! text ──scene──▶ ValidScene ──import──▶ World ──compile──▶ Scene ──integrator──▶ samples ──film──▶ Film ──color──▶ Image ──output──▶ file
//! ```
//!
//! | module | what lives there |
//! |---|---|
//! | [`cli`] | one file per command; flags resolved once into plain settings |
//! | [`scene`] | the scene file: its types, defaults, units, validation, JSON Schema |
//! | [`import`] | outside assets (glTF, OBJ, images) into a [`world::World`] |
//! | [`world`] | the flattened description: handles, metres, linear Rec.709, no file paths left |
//! | [`compile`] | a `World` made ready to render: trees, light tables, shading data |
//! | [`geometry`], [`accel`] | rays, shapes, robust offsets; the two-level tree over them |
//! | [`texture`], [`material`] | lookups; a material at a hit becomes the parameters of a BSDF |
//! | [`bsdf`] | lobes in the local frame: `eval`, `sample`, `pdf` |
//! | [`light`], [`camera`], [`sampling`] | emitters, projection, low-discrepancy points and warps |
//! | [`integrator`] | a `Scene` and one pixel sample in, radiance out |
//! | [`film`], [`render`] | sums per pixel; passes, tiles, threads, limits |
//! | [`export`] | a `World` as input for Blender, POV-Ray and Mitsuba |
//! | [`color`], [`output`] | view transforms; PNG, EXR, HDR, statistics |
//! | [`compare`] | pictures against pictures: error metrics, FLIP, tests, an HTML report |
//! | [`cache`] | what is slow to make of a file, kept for the next time |
//! | [`input`], [`diagnostic`] | reading what users name; what is wrong with it, where, and what to do about it |
//!
//! Conventions: right-handed, +Y up, metres, radians inside (degrees in files), linear Rec.709 radiance in
//! W·m⁻²·sr⁻¹. Directions `wo` and `wi` point away from the surface.

pub mod accel;
pub mod bsdf;
pub mod cache;
pub mod camera;
pub mod cli;
pub mod color;
pub mod compare;
pub mod compile;
pub mod diagnostic;
pub mod export;
pub mod film;
pub mod geometry;
pub mod import;
pub mod input;
pub mod integrator;
pub mod light;
pub mod material;
pub mod output;
pub mod render;
pub mod sampling;
pub mod scene;
pub mod texture;
pub mod validate;
pub mod world;
