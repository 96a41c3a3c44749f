//! Joints and weights of skinned vertices.
//!
//! glTF 2.0, section 3.7.3.3 "Skinned Mesh Attributes": joints are below the number of those of the skin, none has two weights at
//! a vertex, weights are not negative, and their sum over all sets is 1.

use std::collections::{BTreeMap, BTreeSet};

use gltf::json::accessor::ComponentType;
use rayon::prelude::*;

use super::{findings::Findings, summary::Hits};
use crate::import::gltf::{
    accessor::{Accessor, Source},
    skin,
};

/// Sets that are looked at.
const MAX_SETS: usize = 8;
/// Vertices times sets of all meshes together that are looked at.
const MAX_INFLUENCES: usize = 1 << 25;
const BLOCK: usize = 1 << 14;
/// Rounding of each weight that is not zero.
const ROUNDING: f64 = 2e-7;

pub fn check(source: &Source, findings: &mut Findings) {
    let document = source.document;
    // The fewest joints of the skins that move each mesh.
    let mut joints: BTreeMap<usize, usize> = BTreeMap::new();
    for node in &document.nodes {
        let skin = node.skin.and_then(|skin| document.skins.get(skin.value()));
        if let (Some(mesh), Some(skin)) = (node.mesh, skin) {
            let fewest = joints.entry(mesh.value()).or_insert(usize::MAX);
            *fewest = (*fewest).min(skin.joints.len());
        }
    }
    let mut met = BTreeSet::new();
    let mut influences = 0usize;
    for (m, mesh) in document.meshes.iter().enumerate() {
        let joints = joints.get(&m).copied();
        for (p, primitive) in mesh.primitives.iter().enumerate() {
            let sets = skin::sets(primitive);
            if sets.is_empty() || sets.len() > MAX_SETS || !met.insert((sets.clone(), joints)) {
                continue;
            }
            let Some(opened) = opened(source, &sets) else { continue };
            let count = opened.iter().map(|[joints, _]| joints.count).min().unwrap_or(0);
            influences = influences.saturating_add(count.saturating_mul(sets.len()));
            if influences > MAX_INFLUENCES {
                return;
            }
            let blocks = (0..count.div_ceil(BLOCK)).into_par_iter();
            let found = blocks.map(|block| {
                let vertices = block * BLOCK..count.min((block + 1) * BLOCK);
                vertices.fold(Found::NONE, |found, v| found.and(Found::at(v, &opened, joints)))
            });
            let found = found.reduce(|| Found::NONE, Found::and);
            found.tell(&format!("/meshes/{m}/primitives/{p}/attributes"), joints.unwrap_or(0), findings);
        }
    }
}

/// The accessors of the sets, if they are joints and weights indeed and have data.
fn opened<'a>(source: &Source<'a>, sets: &[[usize; 2]]) -> Option<Vec<[Accessor<'a>; 2]>> {
    let open = |&[joints, weights]: &[usize; 2]| {
        let (joints, mut weights) = (source.accessor(joints).ok()?, source.accessor(weights).ok()?);
        weights.normalized = true;
        let is_right = matches!(joints.component, ComponentType::U8 | ComponentType::U16)
            && [&joints, &weights].iter().all(|a| a.components == 4 && a.plain().is_some())
            && weights.component != ComponentType::U32;
        is_right.then_some([joints, weights])
    };
    sets.iter().map(open).collect()
}

#[derive(Clone, Copy)]
struct Found {
    beyond: Hits,
    repeated: Hits,
    negative: Hits,
    /// Weights that do not sum to 1.
    unbalanced: Hits,
}

impl Found {
    const NONE: Self =
        Self { beyond: Hits::NONE, repeated: Hits::NONE, negative: Hits::NONE, unbalanced: Hits::NONE };

    /// What is wrong with the vertex `v`, whose skins have at least `joints`.
    fn at(v: usize, sets: &[[Accessor; 2]], joints: Option<usize>) -> Self {
        let mut found = Self::NONE;
        let mut used = [u32::MAX; 4 * MAX_SETS];
        let mut free = used.len();
        let (mut sum, mut rounding) = (0.0f64, 0.0);
        for [joint_set, weight_set] in sets {
            let weights: [f32; 4] = weight_set.floats(v);
            for (joint, weight) in joint_set.integers::<4>(v).into_iter().zip(weights) {
                if joints.is_some_and(|joints| joint as usize >= joints) {
                    found.beyond.add(v);
                }
                if weight < 0.0 {
                    found.negative.add(v);
                }
                if weight != 0.0 {
                    if used.get(free..).is_some_and(|others| others.contains(&joint)) {
                        found.repeated.add(v);
                    }
                    free = free.saturating_sub(1);
                    if let Some(slot) = used.get_mut(free) {
                        *slot = joint;
                    }
                    sum += f64::from(weight);
                    rounding += ROUNDING;
                }
            }
        }
        // A comparison that is false for NaN too.
        let is_balanced = (sum - 1.0).abs() <= rounding;
        if !is_balanced {
            found.unbalanced.add(v);
        }
        found
    }

    fn and(self, other: Self) -> Self {
        Self {
            beyond: self.beyond.and(other.beyond),
            repeated: self.repeated.and(other.repeated),
            negative: self.negative.and(other.negative),
            unbalanced: self.unbalanced.and(other.unbalanced),
        }
    }

    fn tell(&self, at: &str, joints: usize, findings: &mut Findings) {
        let told = [
            (self.beyond, "JOINTS_0", format!("has vertices with joints beyond the {joints} of their skin")),
            (self.repeated, "JOINTS_0", "has vertices with two weights for one joint".to_owned()),
            (self.negative, "WEIGHTS_0", "has vertices with negative weights".to_owned()),
            (self.unbalanced, "WEIGHTS_0", "has vertices whose weights do not sum to 1".to_owned()),
        ];
        for (hits, name, message) in told.into_iter().filter(|(hits, ..)| hits.count > 0) {
            let Hits { count, first } = hits;
            findings.add(
                "joints and weights",
                format!("{at}/{name}"),
                format!("{message}: {count}, first {first}"),
            );
        }
    }
}
