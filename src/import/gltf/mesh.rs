//! One primitive as a triangle mesh.
//!
//! glTF 2.0, section 3.7.2 "Meshes". Only vertices that a triangle uses are read: exporters let many primitives share
//! one long set of attributes. What is numerically broken is set aside or mended and counted; what would read outside
//! the data is an error.

use std::collections::{BTreeMap, HashMap};

use glam::{Vec2, Vec3, Vec4};
use gltf::json::{self, accessor::ComponentType, mesh::Semantic, validation::Checked};

use super::{
    accessor::{Accessor, Source},
    document::Morph,
    mend,
    report::{Counted, Problem, Tally},
    skin::{self, Joints, Skinned},
    topology::Topology,
};
use crate::{import::tangents, world::Mesh};

/// Everything that the shape of a primitive depends on: equal keys make one mesh.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct Key {
    topology: Topology,
    indices: Option<usize>,
    positions: usize,
    normals: Option<usize>,
    tangents: Option<usize>,
    uvs: [Option<usize>; 2],
    /// What the file calls those.
    uv_sets: [u32; 2],
    colors: Option<usize>,
    targets: Vec<Target>,
    skin: Option<Skin>,
    /// UV set along which tangents are wanted, if the material has a normal map.
    tangent_set: Option<u8>,
}

/// A morph target that applies, with the bits of its weight.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
struct Target {
    weight: u32,
    positions: Option<usize>,
    normals: Option<usize>,
    tangents: Option<usize>,
    uvs: [Option<usize>; 2],
    colors: Option<usize>,
}

/// A skin, and the accessors of joints and weights of each set.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
struct Skin {
    index: usize,
    sets: Vec<[usize; 2]>,
}

/// How a primitive is posed, and what its material asks of it.
pub struct Use<'a> {
    /// Of each morph target, as is `morphs`.
    pub weights: &'a [f32],
    pub morphs: &'a [Morph],
    pub skin: Option<usize>,
    pub uv_sets: [u32; 2],
    pub tangent_set: Option<u8>,
}

/// The key of a primitive; a problem where it has no positions.
pub fn key(
    primitive: &json::mesh::Primitive,
    topology: Topology,
    used: &Use,
    pointer: &str,
) -> Result<Key, Problem> {
    let attribute = |semantic| primitive.attributes.get(&Checked::Valid(semantic)).map(|a| a.value());
    let positions = attribute(Semantic::Positions)
        .ok_or_else(|| Problem::new(format!("{pointer}/attributes"), "has no POSITION"))?;
    let targets = primitive.targets.iter().flatten().zip(used.weights).enumerate();
    let targets = targets.filter(|(_, (_, weight))| **weight != 0.0 && weight.is_finite());
    let more = |i: usize, name: &str| used.morphs.get(i).and_then(|morph| morph.get(name)).copied();
    Ok(Key {
        topology,
        indices: primitive.indices.map(|i| i.value()),
        positions,
        normals: attribute(Semantic::Normals),
        tangents: attribute(Semantic::Tangents),
        uvs: used.uv_sets.map(|set| attribute(Semantic::TexCoords(set))),
        uv_sets: used.uv_sets,
        colors: attribute(Semantic::Colors(0)),
        targets: targets
            .map(|(i, (target, weight))| Target {
                weight: weight.to_bits(),
                positions: target.positions.map(|a| a.value()),
                normals: target.normals.map(|a| a.value()),
                tangents: target.tangents.map(|a| a.value()),
                uvs: used.uv_sets.map(|set| more(i, &format!("TEXCOORD_{set}"))),
                colors: more(i, "COLOR_0"),
            })
            .collect(),
        skin: used.skin.map(|index| Skin { index, sets: skin::sets(primitive) }),
        tangent_set: used.tangent_set,
    })
}

/// Whether positions and indices are there at all. Without, every triangle would be degenerate.
pub fn has_data(source: &Source, primitive: &json::mesh::Primitive) -> bool {
    let positions = primitive.attributes.get(&Checked::Valid(Semantic::Positions));
    positions.into_iter().chain(&primitive.indices).all(|accessor| source.has_data(accessor.value()))
}

impl Key {
    /// Triangles that the primitive will have, known before anything is read.
    pub fn triangle_count(&self, source: &Source) -> usize {
        let corners = source.document.accessors.get(self.indices.unwrap_or(self.positions));
        self.topology.count(corners.and_then(|a| usize::try_from(a.count.0).ok()).unwrap_or(0))
    }

    /// Whether the shape is that of a pose, which other users of the same data need not share.
    pub fn is_posed(&self) -> bool {
        self.skin.is_some() || !self.targets.is_empty()
    }

    pub fn has_uvs(&self, set: u8) -> bool {
        self.uvs.get(usize::from(set)).is_some_and(Option::is_some)
    }
}

/// Reads the mesh of `key`. `pointer` is the primitive's.
pub fn build(
    source: &Source,
    skins: &BTreeMap<usize, Joints>,
    key: &Key,
    name: String,
    pointer: &str,
) -> Result<(Mesh, Tally), Problem> {
    let mut reader = Reader { source, skins, pointer, tally: Tally::default() };
    let mesh = reader.mesh(key, name)?;
    Ok((mesh, reader.tally))
}

struct Reader<'a> {
    source: &'a Source<'a>,
    skins: &'a BTreeMap<usize, Joints>,
    pointer: &'a str,
    tally: Tally,
}

impl<'a> Reader<'a> {
    fn mesh(&mut self, key: &Key, name: String) -> Result<Mesh, Problem> {
        let positions = self.attribute(key.positions, "POSITION", 3..=3, None)?;
        let vertices = positions.count;
        let (mut triangles, used) = self.triangles(key, vertices)?;
        let read =
            |accessor: &Accessor| used.iter().map(|&v| Vec3::from(accessor.floats(v as usize))).collect();

        let mut points: Vec<Vec3> = read(&positions);
        let normals = self.optional(key.normals, "NORMAL", 3..=3, vertices)?;
        let mut normals: Vec<Vec3> = normals.as_ref().map_or_else(Vec::new, read);
        // Where normals are missing the shading is flat, and given tangents mean nothing.
        let given = key.tangents.filter(|_| !normals.is_empty());
        let given = self.optional(given, "TANGENT", 4..=4, vertices)?;
        let mut tangents: Vec<Vec4> =
            given.map_or_else(Vec::new, |a| used.iter().map(|&v| Vec4::from(a.floats(v as usize))).collect());
        for target in &key.targets {
            self.morph(target.positions, f32::from_bits(target.weight), &mut points, &used, vertices)?;
            self.morph(target.normals, f32::from_bits(target.weight), &mut normals, &used, vertices)?;
            let mut moved: Vec<Vec3> = tangents.iter().map(|t| t.truncate()).collect();
            self.morph(target.tangents, f32::from_bits(target.weight), &mut moved, &used, vertices)?;
            tangents.iter_mut().zip(moved).for_each(|(t, m)| *t = m.extend(t.w));
        }
        if let Some(skin) = &key.skin {
            let (normals, tangents) = (&mut normals[..], &mut tangents[..]);
            let skinned = Skinned { points: &mut points, normals, tangents, triangles: &mut triangles };
            self.skin(skin, skinned, &used, vertices)?;
        }
        let uvs = [self.uvs(key, 0, &used, vertices)?, self.uvs(key, 1, &used, vertices)?];
        let colors = self.colors(key, &used, vertices)?;

        let dropped = mend::drop_non_finite(&mut points, &mut triangles);
        self.tally.add(Counted::NonFiniteTriangles, dropped, self.pointer);
        let replaced = mend::normals(&mut normals, &points, &triangles);
        self.tally.add(Counted::BadNormals, replaced, self.pointer);
        let replaced = mend::tangents(&mut tangents, &normals);
        self.tally.add(Counted::BadTangents, replaced, self.pointer);
        let mut mesh =
            Mesh { name, positions: points, normals, tangents, uvs, colors, triangles, slots: Vec::new() };
        if let Some(set) = key.tangent_set
            && mesh.tangents.is_empty()
        {
            tangents::generate(&mut mesh, set.into());
        }
        Ok(mesh)
    }

    /// Opens an attribute: floats or small integers of as many components as `shape` allows, one for each vertex.
    fn attribute(
        &self,
        index: usize,
        name: &str,
        shape: std::ops::RangeInclusive<usize>,
        vertices: Option<usize>,
    ) -> Result<Accessor<'a>, Problem> {
        let problem = |message| Problem::new(format!("{}/attributes/{name}", self.pointer), message);
        let accessor = self.source.accessor(index)?;
        if !shape.contains(&accessor.components) {
            return Err(problem(format!("accessor {index} has {} components", accessor.components)));
        }
        if accessor.component == ComponentType::U32 {
            return Err(problem(format!(
                "accessor {index} holds 32-bit integers, which an attribute cannot"
            )));
        }
        match vertices {
            Some(vertices) if vertices != accessor.count => {
                Err(problem(format!("has {} elements, but POSITION has {vertices}", accessor.count)))
            }
            _ => Ok(accessor),
        }
    }

    fn optional(
        &self,
        index: Option<usize>,
        name: &str,
        shape: std::ops::RangeInclusive<usize>,
        vertices: usize,
    ) -> Result<Option<Accessor<'a>>, Problem> {
        index.map(|index| self.attribute(index, name, shape, Some(vertices))).transpose()
    }

    /// The triangles over the vertices they use, and which those are.
    fn triangles(&mut self, key: &Key, vertices: usize) -> Result<(Vec<[u32; 3]>, Vec<u32>), Problem> {
        let indices = key.indices.map(|index| self.indices(index, vertices)).transpose()?;
        let corners = indices.map_or(vertices, |a| a.count);
        self.tally.add(
            Counted::IncompleteTriangles,
            key.topology.is_incomplete(corners).into(),
            self.pointer,
        );
        let vertex = |corner: usize| indices.map_or(corner as u32, |a| a.vertex(corner));
        let mut triangles: Vec<[u32; 3]> =
            (0..key.topology.count(corners)).map(|i| key.topology.triangle(i).map(vertex)).collect();
        let used = compact(&mut triangles, vertices);
        Ok((triangles, used))
    }

    /// Opens an accessor of indices, all of which are below `vertices`.
    fn indices(&self, index: usize, vertices: usize) -> Result<Accessor<'a>, Problem> {
        let accessor = self.source.accessor(index)?;
        let problem = |message: String| Problem::new(format!("{}/indices", self.pointer), message);
        let unsigned =
            matches!(accessor.component, ComponentType::U8 | ComponentType::U16 | ComponentType::U32);
        if accessor.components != 1 || !unsigned {
            return Err(problem(format!("accessor {index} does not hold unsigned scalars")));
        }
        match (0..accessor.count).map(|i| (i, accessor.vertex(i))).find(|&(_, v)| v as usize >= vertices) {
            Some((i, v)) => Err(problem(format!("index {i} is vertex {v}, but there are {vertices}"))),
            None => Ok(accessor),
        }
    }

    fn morph(
        &self,
        target: Option<usize>,
        weight: f32,
        values: &mut [Vec3],
        used: &[u32],
        vertices: usize,
    ) -> Result<(), Problem> {
        if values.is_empty() {
            return Ok(());
        }
        if let Some(deltas) = self.optional(target, "POSITION (morph target)", 3..=3, vertices)? {
            for (value, &v) in values.iter_mut().zip(used) {
                *value += weight * Vec3::from(deltas.floats(v as usize));
            }
        }
        Ok(())
    }

    fn skin(
        &mut self,
        skin: &Skin,
        mut skinned: Skinned,
        used: &[u32],
        vertices: usize,
    ) -> Result<(), Problem> {
        let Some(joints) = self.skins.get(&skin.index) else { return Ok(()) };
        let mut sets = Vec::new();
        for (n, &[joints, weights]) in skin.sets.iter().enumerate() {
            let name = format!("JOINTS_{n}");
            let joints = self.attribute(joints, &name, 4..=4, Some(vertices))?;
            if !matches!(joints.component, ComponentType::U8 | ComponentType::U16) {
                let message = "does not hold unsigned integers of 8 or 16 bits";
                return Err(Problem::new(format!("{}/attributes/{name}", self.pointer), message));
            }
            let mut weights = self.attribute(weights, &format!("WEIGHTS_{n}"), 4..=4, Some(vertices))?;
            // Integers of weights are always normalised.
            weights.normalized = true;
            sets.push([joints, weights]);
        }
        skin::apply(&mut skinned, &sets, joints, used, self.pointer, &mut self.tally)
    }

    fn uvs(&mut self, key: &Key, set: usize, used: &[u32], vertices: usize) -> Result<Vec<Vec2>, Problem> {
        let name = format!("TEXCOORD_{}", key.uv_sets[set]);
        let Some(accessor) = self.optional(key.uvs[set], &name, 2..=2, vertices)? else {
            return Ok(Vec::new());
        };
        let mut uvs: Vec<Vec2> = used.iter().map(|&v| Vec2::from(accessor.floats(v as usize))).collect();
        for target in &key.targets {
            let weight = f32::from_bits(target.weight);
            let name = format!("{name} (morph target)");
            if let Some(deltas) = self.optional(target.uvs[set], &name, 2..=2, vertices)? {
                uvs.iter_mut()
                    .zip(used)
                    .for_each(|(uv, &v)| *uv += weight * Vec2::from(deltas.floats(v as usize)));
            }
        }
        let mut broken = 0;
        let mut finite = |uv: Vec2| {
            let whole = uv.is_finite();
            broken += usize::from(!whole);
            if whole { uv } else { Vec2::ZERO }
        };
        uvs.iter_mut().for_each(|uv| *uv = finite(*uv));
        self.tally.add(Counted::NonFiniteUvs, broken, self.pointer);
        Ok(uvs)
    }

    /// COLOR_0, whose integers are always normalised and whose values lie in 0 to 1.
    fn colors(&mut self, key: &Key, used: &[u32], vertices: usize) -> Result<Vec<Vec4>, Problem> {
        let Some(mut accessor) = self.optional(key.colors, "COLOR_0", 3..=4, vertices)? else {
            return Ok(Vec::new());
        };
        accessor.normalized = true;
        let mut broken = 0;
        let mut within = |color: Vec4| {
            // A comparison that is false for NaN too.
            let whole = color.cmpge(Vec4::ZERO).all() && color.cmple(Vec4::ONE).all();
            broken += usize::from(!whole);
            let clamp = |c: f32| if c.is_nan() { 1.0 } else { c.clamp(0.0, 1.0) };
            if whole { color } else { Vec4::from(color.to_array().map(clamp)) }
        };
        let opaque = accessor.components == 3;
        let read = |&v: &u32| {
            let color = Vec4::from(accessor.floats(v as usize));
            if opaque { color.with_w(1.0) } else { color }
        };
        let mut colors: Vec<Vec4> = used.iter().map(read).collect();
        for target in &key.targets {
            let weight = f32::from_bits(target.weight);
            if let Some(deltas) = self.optional(target.colors, "COLOR_0 (morph target)", 3..=4, vertices)? {
                let delta = |v: u32| Vec4::from(deltas.floats(v as usize));
                colors.iter_mut().zip(used).for_each(|(color, &v)| *color += weight * delta(v));
            }
        }
        colors.iter_mut().for_each(|color| *color = within(*color));
        self.tally.add(Counted::BadColors, broken, self.pointer);
        Ok(colors)
    }
}

/// Rewrites `triangles` to index the vertices they use, which are returned in increasing order.
fn compact(triangles: &mut [[u32; 3]], vertices: usize) -> Vec<u32> {
    let mut used: Vec<u32>;
    // Marking is faster, but must not cost more than a few triangles are worth in a long set of vertices.
    if vertices <= 64 * triangles.len() {
        let mut marked = vec![false; vertices];
        for &v in triangles.as_flattened() {
            if let Some(mark) = marked.get_mut(v as usize) {
                *mark = true;
            }
        }
        used = (0u32..).zip(&marked).filter_map(|(v, &mark)| mark.then_some(v)).collect();
    } else {
        used = triangles.as_flattened().to_vec();
        used.sort_unstable();
        used.dedup();
    }
    if used.len() == vertices {
        return used;
    }
    let place: HashMap<u32, u32> = used.iter().copied().zip(0..).collect();
    for v in triangles.as_flattened_mut() {
        *v = place.get(v).copied().unwrap_or(0);
    }
    used
}
