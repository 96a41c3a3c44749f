//! Shapes: triangle meshes and their instances, analytic spheres and quads.

use glam::{Affine3A, Vec2, Vec3, Vec4};

use super::{MaterialId, MeshId};

/// Triangles in object space. Every index in `triangles` is below `positions.len()`; optional attributes are
/// empty or as long as `positions`. Counter-clockwise triangles face the viewer.
#[derive(Clone, Debug, Default)]
pub struct Mesh {
    pub name: String,
    pub positions: Vec<Vec3>,
    /// Unit vectors; empty: flat shading.
    pub normals: Vec<Vec3>,
    /// xyz unit, w = ±1 the handedness: bitangent = w · cross(normal, tangent).
    pub tangents: Vec<Vec4>,
    pub uvs: [Vec<Vec2>; 2],
    /// Linear RGBA.
    pub colors: Vec<Vec4>,
    pub triangles: Vec<[u32; 3]>,
    /// Which of an instance's materials each triangle has; empty: the first, everywhere.
    pub slots: Vec<u16>,
}

/// A mesh placed in the world.
#[derive(Clone, Debug)]
pub struct Instance {
    pub name: String,
    pub mesh: MeshId,
    /// Object to world; may mirror (negative determinant), is invertible.
    pub to_world: Affine3A,
    /// One for each slot of the mesh; at least one.
    pub materials: Vec<MaterialId>,
}

/// Outward normals; uv: u = 0.5 − atan2(n.z, n.x) / 2π, v = acos(n.y) / π, so that a texture reads the right way round
/// from outside.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sphere {
    pub center: Vec3,
    /// Metres, positive.
    pub radius: f32,
    pub material: MaterialId,
}

/// The points origin + a·u + b·v with a, b in [0, 1]; the front is the side of u × v. Its uv is (a, 1 − b).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Quad {
    pub origin: Vec3,
    pub u: Vec3,
    pub v: Vec3,
    /// Only the inscribed ellipse: (a − ½)² + (b − ½)² ≤ ¼.
    pub round: bool,
    pub material: MaterialId,
}
