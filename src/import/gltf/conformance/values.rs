//! The data of accessors against what they say of it and what they are used for. Compressed data is judged as decoded.
//!
//! glTF 2.0, sections 3.6.2.5 "Accessors Bounds", 3.7.2.1 (attributes and indices), 3.7.3.1 (inverse bind matrices) and 3.11
//! (times and rotations). Lengths may be off by what 8 bits cannot tell.

use std::collections::BTreeMap;

use gltf::json::{accessor::ComponentType, mesh::Semantic, validation::Checked};
use rayon::prelude::*;

use super::{
    asset::list,
    findings::Findings,
    summary::{Hits, Measure, Summary, summary},
};
use crate::import::gltf::{
    accessor::{Accessor, Source},
    meshopt,
    report::Problem,
};

/// Rounding of unit vectors of three and of four components to signed 8 bits.
const UNIT_3: f64 = 0.00674;
const UNIT_4: f64 = 0.00769;
/// Elements of all accessors together that are looked at: views may be shared, so few bytes can be asked for often.
const MAX_ELEMENTS: usize = 1 << 29;
/// An element that may be replaced costs so many others.
const SPARSE_COST: usize = 32;

type Broken = (&'static str, Problem);

/// What an accessor is used for.
#[derive(Clone, Copy)]
enum Use {
    Normal,
    Tangent,
    Color,
    Indices { vertices: usize },
    Times,
    Rotation { is_cubic: bool },
    InverseBindMatrices,
}

/// Looks at all accessors that have data; those from `given` on were made by decoding.
pub fn check(source: &Source, given: usize, findings: &mut Findings) {
    let uses = uses(source);
    let mut elements = 0usize;
    let mut jobs = Vec::new();
    for i in 0..source.document.accessors.len() {
        let Some(accessor) = source.accessor(i).ok().filter(|_| source.has_data(i)) else { continue };
        let cost = if accessor.plain().is_some() { 1 } else { SPARSE_COST };
        elements = elements.saturating_add(accessor.count.saturating_mul(cost));
        if elements > MAX_ELEMENTS {
            break;
        }
        let uses = uses.get(&i).map_or(&[][..], Vec::as_slice);
        let pointer = match uses.first() {
            Some((_, pointer)) if i >= given => pointer.clone(),
            _ => format!("/accessors/{i}"),
        };
        jobs.push((i, accessor, uses, pointer));
    }
    let broken: Vec<Vec<Broken>> = (jobs.into_par_iter())
        .map(|(i, accessor, uses, pointer)| {
            let mut broken = Vec::new();
            let Some(found) = summary(&accessor, measure(uses, &accessor)) else { return broken };
            if found.not_finite.count > 0 {
                let message = format!(
                    "{} element(s) are not finite, first {}",
                    found.not_finite.count, found.not_finite.first
                );
                broken.push(("data that is not finite", Problem::new(pointer.as_str(), message)));
            }
            if i < given && !is_lossy(source, i) {
                declared(source, i, &found, &mut broken);
            }
            for (purpose, pointer) in uses {
                purpose.judge(&accessor, &found, pointer, &mut broken);
            }
            broken
        })
        .collect();
    for (rule, problem) in broken.into_iter().flatten() {
        findings.add_all(rule, [problem]);
    }
}

/// What accessors are used for, and where; each purpose once, indices for the fewest vertices.
fn uses(source: &Source) -> BTreeMap<usize, Vec<(Use, String)>> {
    let document = source.document;
    let mut uses: BTreeMap<usize, Vec<(Use, String)>> = BTreeMap::new();
    let mut add = |accessor: usize, purpose: Use, pointer: &dyn Fn() -> String| {
        let known = uses.entry(accessor).or_default();
        let same = |other: &Use| std::mem::discriminant(other) == std::mem::discriminant(&purpose);
        match (known.iter_mut().find(|(other, _)| same(other)), purpose) {
            (None, _) => known.push((purpose, pointer())),
            (Some((Use::Indices { vertices: fewest }, there)), Use::Indices { vertices })
                if vertices < *fewest =>
            {
                (*fewest, *there) = (vertices, pointer());
            }
            _ => {}
        }
    };
    for (i, mesh) in document.meshes.iter().enumerate() {
        for (j, primitive) in mesh.primitives.iter().enumerate() {
            let at = |rest: &str| format!("/meshes/{i}/primitives/{j}/{rest}");
            for (semantic, accessor) in &primitive.attributes {
                let Checked::Valid(semantic) = semantic else { continue };
                let purpose = match semantic {
                    Semantic::Normals => Use::Normal,
                    Semantic::Tangents => Use::Tangent,
                    Semantic::Colors(_) => Use::Color,
                    _ => continue,
                };
                add(accessor.value(), purpose, &|| at(&format!("attributes/{}", semantic.to_string())));
            }
            let positions = primitive.attributes.get(&Checked::Valid(Semantic::Positions));
            let vertices = positions.and_then(|p| document.accessors.get(p.value())).map(|a| a.count.0);
            if let (Some(indices), Some(vertices)) = (primitive.indices, vertices) {
                let vertices = usize::try_from(vertices).unwrap_or(usize::MAX);
                add(indices.value(), Use::Indices { vertices }, &|| at("indices"));
            }
        }
    }
    for (i, skin) in document.skins.iter().enumerate() {
        if let Some(matrices) = skin.inverse_bind_matrices {
            add(matrices.value(), Use::InverseBindMatrices, &|| format!("/skins/{i}/inverseBindMatrices"));
        }
    }
    for (i, animation) in document.animations.iter().enumerate() {
        for (j, sampler) in animation.samplers.iter().enumerate() {
            add(sampler.input, Use::Times, &|| format!("/animations/{i}/samplers/{j}/input"));
        }
        for (j, channel) in animation.channels.iter().enumerate() {
            let Some(sampler) = animation.samplers.get(channel.sampler) else { continue };
            if channel.target.path == "rotation" {
                let is_cubic = sampler.interpolation.as_deref() == Some("CUBICSPLINE");
                add(sampler.output, Use::Rotation { is_cubic }, &|| {
                    format!("/animations/{i}/channels/{j}/sampler")
                });
            }
        }
    }
    uses
}

/// What has to be looked at beside the bounds of an accessor of these uses.
fn measure(uses: &[(Use, String)], accessor: &Accessor) -> Measure {
    let scale = match accessor.component {
        ComponentType::I8 => 1.0 / 127.0,
        ComponentType::U8 => 1.0 / 255.0,
        ComponentType::I16 => 1.0 / 32767.0,
        ComponentType::U16 => 1.0 / 65535.0,
        ComponentType::U32 | ComponentType::F32 => 1.0,
    };
    let unit = |of, tolerance, from, step| Measure::Unit { of, tolerance, scale, signed: false, from, step };
    let of_use = |(purpose, _): &(Use, String)| match purpose {
        Use::Normal => Some(unit(3, UNIT_3, 0, 1)),
        Use::Tangent => {
            Some(Measure::Unit { of: 3, tolerance: UNIT_3, scale, signed: true, from: 0, step: 1 })
        }
        // A spline has a tangent before and after each value.
        Use::Rotation { is_cubic: true } => Some(unit(4, UNIT_4, 1, 3)),
        Use::Rotation { is_cubic: false } => Some(unit(4, UNIT_4, 0, 1)),
        Use::Times => Some(Measure::Rising),
        Use::Color | Use::Indices { .. } | Use::InverseBindMatrices => None,
    };
    uses.iter().find_map(of_use).unwrap_or(Measure::Bounds)
}

/// Whether the data was compressed with a loss after its bounds had been written.
fn is_lossy(source: &Source, accessor: usize) -> bool {
    let view = source.document.accessors.get(accessor).and_then(|json| json.buffer_view);
    let view = view.and_then(|view| source.document.views.get(view.value()));
    let extensions = view.and_then(|view| view.extensions.as_ref());
    extensions.is_some_and(|e| meshopt::NAMES.iter().any(|name| e.others.contains_key(*name)))
}

/// `min` and `max` of accessor `i` against what was found in it.
fn declared(source: &Source, i: usize, found: &Summary, broken: &mut Vec<Broken>) {
    let Some(json) = source.document.accessors.get(i) else { return };
    let is_float = matches!(json.component_type, Checked::Valid(kind) if kind.0 == ComponentType::F32);
    let sides = [("min", &json.min, &found.low, "least"), ("max", &json.max, &found.high, "greatest")];
    for (key, declared, found, word) in sides {
        for (c, (declared, &found)) in list(declared.as_ref()).iter().zip(found).enumerate() {
            let Some(declared) = declared.as_f64().filter(|_| found.is_finite()) else { continue };
            let rounded = if is_float { f64::from(declared as f32) } else { declared };
            if rounded != found {
                let message = format!("is {declared}, but the {word} value in the data is {found}");
                broken.push((
                    "bounds of accessors",
                    Problem::new(format!("/accessors/{i}/{key}/{c}"), message),
                ));
            }
        }
    }
}

impl Use {
    fn judge(self, accessor: &Accessor, found: &Summary, pointer: &str, broken: &mut Vec<Broken>) {
        let mut tell = |rule, message| broken.push((rule, Problem::new(pointer, message)));
        let low = |c: usize| found.low.get(c).copied().unwrap_or(0.0);
        let high = |c: usize| found.high.get(c).copied().unwrap_or(0.0);
        let amiss = found.amiss;
        match self {
            Self::Normal | Self::Tangent | Self::Rotation { .. } if amiss.count > 0 => {
                let sign = if matches!(self, Self::Tangent) { " with w 1 or -1" } else { "" };
                let Hits { count, first } = amiss;
                let message =
                    format!("has {count} element(s) that are not unit vectors{sign}, first {first}");
                tell("vectors that are not of length 1", message);
            }
            Self::Color if accessor.component == ComponentType::F32 => {
                let (low, high) = (0..accessor.components)
                    .fold((0.0f64, 1.0f64), |(a, b), c| (a.min(low(c)), b.max(high(c))));
                if low < 0.0 || high > 1.0 {
                    let message = format!("has values from {low} to {high}, outside 0 to 1");
                    tell("values that are not allowed", message);
                }
            }
            Self::Indices { vertices } => {
                let restart = match accessor.component {
                    ComponentType::U8 => 255.0,
                    ComponentType::U16 => 65535.0,
                    _ => 4_294_967_295.0,
                };
                if high(0) == restart {
                    tell("indices", format!("has the value {restart}, which would restart the primitive"));
                } else if high(0) >= vertices as f64 {
                    tell("indices", format!("refers to vertex {}, but there are {vertices}", high(0)));
                }
            }
            Self::Times => {
                if low(0) < 0.0 {
                    tell("times", format!("has the negative time {}", low(0)));
                }
                if amiss.count > 0 {
                    let message = format!(
                        "has {} time(s) not after the one before, first {}",
                        amiss.count, amiss.first
                    );
                    tell("times", message);
                }
            }
            Self::InverseBindMatrices => {
                let row = [(3, 0.0), (7, 0.0), (11, 0.0), (15, 1.0)];
                if row.iter().any(|&(c, value)| low(c) != value || high(c) != value) {
                    tell("inverse bind matrices", "has matrices whose last row is not 0 0 0 1".to_owned());
                }
            }
            _ => {}
        }
    }
}
