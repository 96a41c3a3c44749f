//! The objects that `tobj` has read into meshes: triangles, one index for all attributes, missing normals made.
//!
//! A corner's normal is, in this order,
//!
//! 1. the file's (`vn`), made unit;
//! 2. in a smoothing group, the mean of the normals of the group's faces about the vertex, weighted by the angle each
//!    face has there (Thürmer and Wüthrich 1998: so that it does not depend on how a polygon is cut up);
//! 3. the face's own.
//!
//! A mesh of which no corner has the first two keeps none at all, which is flat shading.

use std::collections::HashMap;

use glam::{DVec3, Vec2, Vec3, Vec4};

use super::{
    clean::Face,
    polygon::{Triangulator, newell},
};
use crate::{color::srgb_decode, world::Mesh};

/// A mesh, with the OBJ material of each of its slots and the number of faces left out of it.
pub(super) struct Built {
    pub mesh: Mesh,
    /// Into the file's materials; `None`: no material.
    pub slots: Vec<Option<u32>>,
    /// Faces with a corner at a position that is not finite.
    pub left_out: usize,
    /// Triangles whose material found no slot: there are more than 65 536.
    pub without_slot: usize,
}

/// Where a vertex takes its normal from; vertices are the same where position, UV and this are.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
enum Normal {
    File(u32),
    Smooth(u32),
    Flat(usize),
    None,
}

/// `faces` belong to `object`, in order. `None` where an index is out of range, which the cleaned text rules out.
pub(super) fn build(object: &tobj::Mesh, faces: &[Face], triangulator: &mut Triangulator) -> Option<Built> {
    let source = Source::new(object, faces)?;
    let mut vertices = Vertices::new(&source);
    let mut built = Built { mesh: Mesh::default(), slots: Vec::new(), left_out: 0, without_slot: 0 };
    let (mut corners, mut indices) = (Vec::new(), Vec::new());
    let mut slot_of: HashMap<Option<u32>, u16> = HashMap::new();
    for (number, polygon) in source.polygons.iter().enumerate() {
        source.corners(polygon, &mut corners)?;
        if corners.iter().any(|p| !p.is_finite()) {
            built.left_out += 1;
            continue;
        }
        let slot = *slot_of.entry(polygon.face.material).or_insert_with(|| {
            let next = u16::try_from(built.slots.len()).ok();
            built.slots.extend(next.map(|_| polygon.face.material));
            next.unwrap_or(u16::MAX)
        });
        let lost = built.slots.get(usize::from(slot)) != Some(&polygon.face.material);
        indices.clear();
        for i in 0..corners.len() {
            indices.push(vertices.index(&source, polygon, number, i)?);
        }
        triangulator.triangulate(&corners, |triangle| {
            // The triangulator answers with positions in `corners`, which `indices` is as long as.
            if let [Some(&a), Some(&b), Some(&c)] = triangle.map(|i| indices.get(i as usize)) {
                built.mesh.triangles.push([a, b, c]);
                built.mesh.slots.push(slot);
                built.without_slot += usize::from(lost);
            }
        });
    }
    if built.slots.len() < 2 {
        built.mesh.slots.clear();
    }
    built.mesh.positions = vertices.positions;
    built.mesh.normals = vertices.normals;
    built.mesh.uvs[0] = vertices.uvs;
    built.mesh.colors = vertices.colors;
    Some(built)
}

/// What `tobj` read, as vectors.
struct Source<'a> {
    object: &'a tobj::Mesh,
    polygons: Vec<Polygon>,
    positions: &'a [[f32; 3]],
    colors: &'a [[f32; 3]],
    /// NaN: missing.
    uvs: &'a [[f32; 2]],
    /// `None`: missing.
    normals: Vec<Option<Vec3>>,
}

struct Polygon {
    face: Face,
    /// Of its first corner among the corners of the object.
    first: usize,
    count: usize,
}

impl<'a> Source<'a> {
    fn new(object: &'a tobj::Mesh, faces: &[Face]) -> Option<Self> {
        let mut first = 0;
        let mut polygons = Vec::with_capacity(faces.len());
        for (i, &face) in faces.iter().enumerate() {
            // No arities: all are triangles.
            let count =
                if object.face_arities.is_empty() { 3 } else { *object.face_arities.get(i)? as usize };
            polygons.push(Polygon { face, first, count });
            first += count;
        }
        let normals = object.normals.as_chunks().0.iter().map(|&n| Vec3::from_array(n).try_normalize());
        (first == object.indices.len()).then(|| Self {
            object,
            polygons,
            positions: object.positions.as_chunks().0,
            colors: object.vertex_color.as_chunks().0,
            uvs: object.texcoords.as_chunks().0,
            normals: normals.collect(),
        })
    }

    /// The positions of a polygon's corners.
    fn corners(&self, polygon: &Polygon, corners: &mut Vec<Vec3>) -> Option<()> {
        corners.clear();
        for at in polygon.first..polygon.first + polygon.count {
            let vertex = *self.object.indices.get(at)? as usize;
            corners.push(Vec3::from_array(*self.positions.get(vertex)?));
        }
        Some(())
    }

    /// The normal that the file gives to corner `at`.
    fn file_normal(&self, at: usize) -> Option<(u32, Vec3)> {
        let index = *self.object.normal_indices.get(at)?;
        Some((index, (*self.normals.get(index as usize)?)?))
    }

    fn uv(&self, at: usize) -> Option<(u32, Vec2)> {
        let index = *self.object.texcoord_indices.get(at)?;
        let uv = Vec2::from_array(*self.uvs.get(index as usize)?);
        // OBJ counts v from the bottom row of the image.
        uv.is_finite().then_some((index, Vec2::new(uv.x, 1.0 - uv.y)))
    }
}

struct Vertices {
    positions: Vec<Vec3>,
    normals: Vec<Vec3>,
    uvs: Vec<Vec2>,
    colors: Vec<Vec4>,
    has_uvs: bool,
    has_normals: bool,
    /// By vertex and smoothing group; not yet unit.
    smooth: HashMap<(u32, u32), DVec3>,
    known: HashMap<(u32, u32, Normal), u32>,
    /// The face whose normal was asked for last, and that normal.
    flat: (usize, Vec3),
}

impl Vertices {
    fn new(source: &Source) -> Self {
        let corners = 0..source.object.indices.len();
        let has_file_normals = source.normals.iter().any(Option::is_some);
        let has_groups = source.polygons.iter().any(|p| p.face.smoothing != 0);
        Self {
            positions: Vec::new(),
            normals: Vec::new(),
            uvs: Vec::new(),
            colors: Vec::new(),
            has_uvs: corners.clone().any(|at| source.uv(at).is_some()),
            has_normals: has_file_normals || has_groups,
            smooth: if has_groups { smooth_normals(source) } else { HashMap::new() },
            known: HashMap::new(),
            flat: (usize::MAX, Vec3::Z),
        }
    }

    /// The index of corner `i` of a polygon, which is a new vertex where there is none like it.
    fn index(&mut self, source: &Source, polygon: &Polygon, number: usize, i: usize) -> Option<u32> {
        let at = polygon.first + i;
        let vertex = *source.object.indices.get(at)?;
        let uv = if self.has_uvs { source.uv(at) } else { None };
        let file = source.file_normal(at);
        let smooth = self.smooth.get(&(vertex, polygon.face.smoothing)).and_then(|n| n.try_normalize());
        let from = match (file, smooth) {
            _ if !self.has_normals => Normal::None,
            (Some((index, _)), _) => Normal::File(index),
            (None, Some(_)) => Normal::Smooth(polygon.face.smoothing),
            (None, None) => Normal::Flat(number),
        };
        let key = (vertex, uv.map_or(u32::MAX, |(index, _)| index), from);
        if let Some(&index) = self.known.get(&key) {
            return Some(index);
        }
        let position = *source.positions.get(vertex as usize)?;
        self.positions.push(position.into());
        if self.has_uvs {
            self.uvs.push(uv.map_or(Vec2::ZERO, |(_, uv)| uv));
        }
        if let Some(&color) = source.colors.get(vertex as usize) {
            // That they are sRGB no text says; the programs that write them mean it.
            let linear = color.map(|c| srgb_decode(c.clamp(0.0, 1.0)));
            self.colors.push(Vec3::from(linear).extend(1.0));
        }
        match from {
            Normal::File(_) => self.normals.extend(file.map(|(_, n)| n)),
            Normal::Smooth(_) => self.normals.extend(smooth.map(|n| n.as_vec3())),
            Normal::Flat(_) => {
                let normal = self.flat_normal(source, polygon, number)?;
                self.normals.push(normal);
            }
            Normal::None => {}
        }
        let index = u32::try_from(self.positions.len() - 1).ok()?;
        self.known.insert(key, index);
        Some(index)
    }

    fn flat_normal(&mut self, source: &Source, polygon: &Polygon, number: usize) -> Option<Vec3> {
        if self.flat.0 != number {
            let mut corners = Vec::with_capacity(polygon.count);
            source.corners(polygon, &mut corners)?;
            // A face without area shows no side: any unit vector will do.
            let normal = newell(&corners).try_normalize().unwrap_or(DVec3::Z);
            self.flat = (number, normal.as_vec3());
        }
        Some(self.flat.1)
    }
}

/// For each vertex and smoothing group: the sum of the group's face normals times their angles at the vertex.
fn smooth_normals(source: &Source) -> HashMap<(u32, u32), DVec3> {
    let mut sums: HashMap<(u32, u32), DVec3> = HashMap::new();
    let mut corners = Vec::new();
    for polygon in source.polygons.iter().filter(|p| p.face.smoothing != 0) {
        if source.corners(polygon, &mut corners).is_none() || corners.iter().any(|p| !p.is_finite()) {
            continue;
        }
        let Some(normal) = newell(&corners).try_normalize() else { continue };
        let n = corners.len();
        for (i, here) in corners.iter().enumerate() {
            let towards =
                |j: usize| corners.get(j % n).map_or(DVec3::ZERO, |p| p.as_dvec3() - here.as_dvec3());
            let (next, previous) = (towards(i + 1), towards(i + n - 1));
            // In the polygon's plane and turning with it, so that a reflex corner counts with more than π.
            let angle =
                normal.dot(next.cross(previous)).atan2(next.dot(previous)).rem_euclid(std::f64::consts::TAU);
            if let Some(&vertex) = source.object.indices.get(polygon.first + i) {
                *sums.entry((vertex, polygon.face.smoothing)).or_default() += angle * normal;
            }
        }
    }
    sums
}
