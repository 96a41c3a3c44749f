//! Skins: vertices that follow joints.
//!
//! glTF 2.0, section 3.7.3 "Skins": a vertex moves by Σ wᵢ · global(jointᵢ) · inverseBindᵢ, in any number of sets of four joints
//! (`JOINTS_n`, `WEIGHTS_n`). Where the mesh hangs in the tree does not matter: its node's own transform is ignored.
//!
//! Normals go with the matrix of cofactors, which is the inverse transpose up to a factor and exists for singular matrices
//! too. A pose that mirrors more of the vertices than not turns the triangles round, so that fronts stay fronts.

use std::collections::{BTreeMap, BTreeSet};

use glam::{DAffine3, DMat3, DVec3, Vec3, Vec4};
use gltf::json::{
    self,
    accessor::{ComponentType, Type},
    mesh::Semantic,
    validation::Checked,
};

use super::{
    accessor::{Accessor, Source},
    report::{Counted, Problem, Report, Tally},
};

/// global(joint) · inverse bind matrix of every joint of a skin.
pub type Joints = Vec<DAffine3>;

/// The joints of every skin of `used` in the pose of `globals`, the transforms of all nodes.
pub fn joints(
    source: &Source,
    used: &BTreeSet<usize>,
    globals: &[DAffine3],
    report: &mut Report,
) -> BTreeMap<usize, Joints> {
    let mut all = BTreeMap::new();
    for &index in used {
        let Some(skin) = source.document.skins.get(index) else { continue };
        match posed(source, skin, globals) {
            Ok(joints) => drop(all.insert(index, joints)),
            Err(message) => {
                report.error(Problem::new(format!("/skins/{index}/inverseBindMatrices"), message))
            }
        }
    }
    all
}

fn posed(source: &Source, skin: &json::Skin, globals: &[DAffine3]) -> Result<Joints, String> {
    let inverse_bind = match skin.inverse_bind_matrices {
        None => None,
        Some(index) => {
            let accessor = source.accessor(index.value()).map_err(|problem| problem.message)?;
            let is_matrix = source.document.accessors.get(index.value()).is_some_and(|json| {
                matches!(json.type_, Checked::Valid(Type::Mat4)) && accessor.component == ComponentType::F32
            });
            if !is_matrix {
                return Err(format!("accessor {} does not hold MAT4 of floats", index.value()));
            }
            if accessor.count < skin.joints.len() {
                return Err(format!("has {} matrices for {} joints", accessor.count, skin.joints.len()));
            }
            Some(accessor)
        }
    };
    let matrix = |i: usize, joint: usize| {
        let global = globals.get(joint).copied().unwrap_or(DAffine3::IDENTITY);
        let Some(accessor) = inverse_bind else { return global };
        let m: [f32; 16] = accessor.floats(i);
        global
            * DAffine3::from_cols_array_2d(&[0, 4, 8, 12].map(|c| [m[c], m[c + 1], m[c + 2]].map(f64::from)))
    };
    Ok(skin.joints.iter().enumerate().map(|(i, joint)| matrix(i, joint.value())).collect())
}

/// The accessors of `JOINTS_n` and `WEIGHTS_n` of a primitive.
pub fn sets(primitive: &json::mesh::Primitive) -> Vec<[usize; 2]> {
    let attribute = |semantic| primitive.attributes.get(&Checked::Valid(semantic)).map(|a| a.value());
    (0..u32::MAX)
        .map_while(|n| Some([attribute(Semantic::Joints(n))?, attribute(Semantic::Weights(n))?]))
        .collect()
}

/// What is moved; normals and tangents may be empty.
pub struct Skinned<'m> {
    pub points: &'m mut [Vec3],
    pub normals: &'m mut [Vec3],
    pub tangents: &'m mut [Vec4],
    pub triangles: &'m mut [[u32; 3]],
}

/// Moves the vertices `used` of a primitive at `pointer`, by the joints and weights that `sets` holds for each.
pub fn apply(
    skinned: &mut Skinned,
    sets: &[[Accessor; 2]],
    joints: &Joints,
    used: &[u32],
    pointer: &str,
    tally: &mut Tally,
) -> Result<(), Problem> {
    let (mut mirrored, mut weightless) = (0usize, 0);
    for (i, &vertex) in used.iter().enumerate() {
        let (mut blended, mut sum) = (DAffine3::ZERO, 0.0);
        for (n, [indices, weights]) in sets.iter().enumerate() {
            let indices: [u32; 4] = indices.integers(vertex as usize);
            let weights: [f32; 4] = weights.floats(vertex as usize);
            for (index, weight) in indices.into_iter().zip(weights.map(f64::from)) {
                if weight == 0.0 {
                    continue;
                }
                let Some(joint) = joints.get(index as usize) else {
                    let message =
                        format!("vertex {vertex} follows joint {index}, but there are {}", joints.len());
                    return Err(Problem::new(format!("{pointer}/attributes/JOINTS_{n}"), message));
                };
                blended.matrix3 += joint.matrix3 * weight;
                blended.translation += joint.translation * weight;
                sum += weight;
            }
        }
        // Weights that miss 1 by what their integers cannot express.
        if sum > 0.0 && sum.is_finite() {
            blended.matrix3 *= 1.0 / sum;
            blended.translation /= sum;
        } else {
            weightless += 1;
            blended = joints.first().copied().unwrap_or(DAffine3::IDENTITY);
        }
        mirrored += usize::from(blended.matrix3.determinant() < 0.0);
        let DMat3 { x_axis: x, y_axis: y, z_axis: z } = blended.matrix3;
        if let Some(point) = skinned.points.get_mut(i) {
            *point = blended.transform_point3(point.as_dvec3()).as_vec3();
        }
        if let Some(normal) = skinned.normals.get_mut(i) {
            let side = blended.matrix3.determinant().signum();
            let cofactors = DMat3::from_cols(y.cross(z), z.cross(x), x.cross(y));
            // Where all collapses, any direction will do.
            *normal = direction(side * (cofactors * normal.as_dvec3()), *normal);
        }
        if let Some(tangent) = skinned.tangents.get_mut(i) {
            let along = tangent.truncate();
            *tangent = direction(blended.matrix3 * along.as_dvec3(), along).extend(tangent.w);
        }
    }
    if 2 * mirrored > used.len() {
        skinned.triangles.iter_mut().for_each(|triangle| triangle.swap(1, 2));
        skinned.tangents.iter_mut().for_each(|tangent| tangent.w = -tangent.w);
    }
    tally.add(Counted::WeightlessVertices, weightless, pointer);
    Ok(())
}

fn direction(moved: DVec3, rest: Vec3) -> Vec3 {
    moved.try_normalize().map_or(rest, |unit| unit.as_vec3())
}
