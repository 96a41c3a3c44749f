//! EXT_mesh_gpu_instancing: a node whose mesh is placed many times.
//!
//! Each instance is at global(node) · T · R · S of its elements of the attributes `TRANSLATION`, `ROTATION` and `SCALE`; what is
//! missing is the identity. Other attributes (`_…`) are the application's.

use glam::{DAffine3, DQuat, DVec3};
use gltf::json;

use super::{
    accessor::{Accessor, Source},
    report::Problem,
};

pub const NAME: &str = "EXT_mesh_gpu_instancing";

/// Where the instances are relative to node `index`; `None` for a node that is not instanced. More than `limit` are an error.
pub fn transforms(
    source: &Source,
    node: &json::Node,
    index: usize,
    limit: usize,
) -> Result<Option<Vec<DAffine3>>, Problem> {
    let Some(extension) = node.extensions.as_ref().and_then(|e| e.others.get(NAME)) else {
        return Ok(None);
    };
    let pointer = |rest: &str| format!("/nodes/{index}/extensions/{NAME}{rest}");
    let attributes = extension.get("attributes").and_then(|a| a.as_object());
    let attributes = attributes.ok_or_else(|| Problem::new(pointer(""), "has no `attributes`"))?;
    let mut count = None;
    for (name, value) in attributes {
        let problem = |message: String| Problem::new(pointer(&format!("/attributes/{name}")), message);
        let accessor = value.as_u64().and_then(|i| usize::try_from(i).ok());
        let accessor = accessor.ok_or_else(|| problem("is not an index".into()))?;
        let found = source.accessor(accessor).map_err(|p| problem(p.message))?.count;
        match count {
            Some(first) if first != found => {
                return Err(problem(format!("has {found} elements, but another attribute has {first}")));
            }
            _ => count = Some(found),
        }
    }
    let count = count.unwrap_or(1);
    if count > limit {
        return Err(Problem::new(
            pointer(""),
            format!("has {count} instances; no more than {limit} are read"),
        ));
    }
    let attribute = |name: &str, components: usize| -> Result<Option<Accessor>, Problem> {
        let Some(index) = attributes.get(name).and_then(|v| usize::try_from(v.as_u64()?).ok()) else {
            return Ok(None);
        };
        let accessor = source.accessor(index)?;
        if accessor.components != components {
            let message = format!("accessor {index} has {} components", accessor.components);
            return Err(Problem::new(pointer(&format!("/attributes/{name}")), message));
        }
        Ok(Some(accessor))
    };
    let translation = attribute("TRANSLATION", 3)?;
    let mut rotation = attribute("ROTATION", 4)?;
    let scale = attribute("SCALE", 3)?;
    if let Some(rotation) = &mut rotation {
        // Integers are always normalised here.
        rotation.normalized = true;
    }
    let vector = |accessor: Option<Accessor>, i: usize, missing: DVec3| {
        accessor.map_or(missing, |a| DVec3::from(a.floats::<3>(i).map(f64::from)))
    };
    let transform = |i| {
        let rotation =
            rotation.map_or(DQuat::IDENTITY, |a| DQuat::from_array(a.floats::<4>(i).map(f64::from)));
        DAffine3::from_scale_rotation_translation(
            vector(scale, i, DVec3::ONE),
            rotation / rotation.length(),
            vector(translation, i, DVec3::ZERO),
        )
    };
    Ok(Some((0..count).map(transform).collect()))
}
