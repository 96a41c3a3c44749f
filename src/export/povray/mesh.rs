//! Triangles as `mesh2`: normals and UV go with the vertices, triangles turn the other way round.

use std::{
    collections::{HashMap, hash_map::Entry},
    fmt::Write,
};

use glam::{Vec2, Vec3, Vec4};

use super::sdl::{vec2, vec3};
use crate::world::Mesh;

/// The part of a mesh that has one material.
pub struct Part<'a> {
    mesh: &'a Mesh,
    triangles: Vec<[u32; 3]>,
    /// Of the mesh, for each vertex here.
    vertices: Vec<usize>,
}

impl<'a> Part<'a> {
    /// Broken triangles (no number, no area) are left out. `None` where nothing is left.
    pub fn new(mesh: &'a Mesh, slot: usize) -> Option<Self> {
        let mut part = Self { mesh, triangles: Vec::new(), vertices: Vec::new() };
        let mut known: HashMap<u32, u32> = HashMap::new();
        for (t, triangle) in mesh.triangles.iter().enumerate() {
            if mesh.slots.get(t).map_or(0, |&s| usize::from(s)) != slot {
                continue;
            }
            let [a, b, c] = triangle.map(|v| mesh.positions.get(v as usize).copied().unwrap_or(Vec3::NAN));
            let area = (b - a).cross(c - a).length_squared();
            if !(area.is_finite() && area > 0.0) {
                continue;
            }
            part.triangles.push(triangle.map(|v| match known.entry(v) {
                Entry::Occupied(entry) => *entry.get(),
                Entry::Vacant(entry) => {
                    part.vertices.push(v as usize);
                    *entry.insert(part.vertices.len() as u32 - 1)
                }
            }));
        }
        (!part.triangles.is_empty()).then_some(part)
    }

    /// Colours of the vertices; empty where the mesh has none.
    pub fn colors(&self) -> Vec<Vec4> {
        if self.mesh.colors.is_empty() {
            return Vec::new();
        }
        self.vertices.iter().map(|&v| self.mesh.colors.get(v).copied().unwrap_or(Vec4::ONE)).collect()
    }

    /// `mesh2 { … }`, with the UV set that is asked for, and a texture of `list` for each vertex, if there is a list.
    pub fn sdl(&self, uv_set: Option<u8>, list: Option<(&[String], &[usize])>) -> String {
        let mut out = String::from("mesh2 {\n");
        self.vectors(&mut out, "vertex_vectors", |v| {
            vec3(self.mesh.positions.get(v).copied().unwrap_or_default())
        });
        if !self.mesh.normals.is_empty() {
            let faces = self.face_normals();
            let usable = |n: &&Vec3| n.is_finite() && n.length_squared() > 1e-12;
            let normal = |v: usize| self.mesh.normals.get(v).filter(usable).or(faces.get(&v)).copied();
            self.vectors(&mut out, "normal_vectors", |v| vec3(normal(v).unwrap_or(Vec3::Y)));
        }
        if let Some(set) = uv_set {
            let uvs = &self.mesh.uvs[usize::from(set & 1)];
            self.vectors(&mut out, "uv_vectors", |v| vec2(uvs.get(v).copied().unwrap_or(Vec2::ZERO)));
        }
        if let Some((textures, _)) = list {
            let _ = writeln!(out, "texture_list {{ {}, {} }}", textures.len(), textures.join(" "));
        }
        let _ = write!(out, "face_indices {{ {}", self.triangles.len());
        for &[a, b, c] in &self.triangles {
            let _ = write!(out, ",\n<{a},{c},{b}>");
            if let Some((_, of)) = list {
                let texture = |v: u32| of.get(v as usize).copied().unwrap_or(0);
                let _ = write!(out, ",{},{},{}", texture(a), texture(c), texture(b));
            }
        }
        out.push_str(" }\n}\n");
        out
    }

    fn vectors(&self, out: &mut String, keyword: &str, text: impl Fn(usize) -> String) {
        let _ = write!(out, "{keyword} {{ {}", self.vertices.len());
        for &v in &self.vertices {
            let _ = write!(out, ",\n{}", text(v));
        }
        out.push_str(" }\n");
    }

    /// A face's normal for each vertex whose own is none.
    fn face_normals(&self) -> HashMap<usize, Vec3> {
        let broken = |v: usize| {
            self.mesh.normals.get(v).is_none_or(|n| !(n.is_finite() && n.length_squared() > 1e-12))
        };
        let mut faces = HashMap::new();
        for triangle in &self.triangles {
            let vertices = triangle.map(|v| self.vertices.get(v as usize).copied().unwrap_or(0));
            if vertices.into_iter().any(broken) {
                let [a, b, c] = vertices.map(|v| self.mesh.positions.get(v).copied().unwrap_or_default());
                let normal = (b - a).cross(c - a).normalize_or(Vec3::Y);
                faces.extend(vertices.into_iter().filter(|&v| broken(v)).map(|v| (v, normal)));
            }
        }
        faces
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn triangles_turn_round_and_parts_have_their_own_vertices() {
        let mesh = Mesh {
            positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::ONE, Vec3::NAN],
            normals: vec![Vec3::Z, Vec3::Z, Vec3::ZERO, Vec3::Z, Vec3::Z],
            triangles: vec![[0, 1, 2], [1, 3, 2], [0, 1, 1], [0, 1, 4]],
            slots: vec![0, 1, 1, 1],
            ..Mesh::default()
        };
        let sdl = Part::new(&mesh, 1).expect("a part").sdl(None, None);
        assert_eq!(
            sdl,
            "mesh2 {\nvertex_vectors { 3,\n<1.0,0.0,0.0>,\n<1.0,1.0,1.0>,\n<0.0,1.0,0.0> }\nnormal_vectors { 3,\n\
             <0.0,0.0,1.0>,\n<0.0,0.0,1.0>,\n<-0.57735026,-0.57735026,0.57735026> }\nface_indices { 1,\n<0,2,1> }\n}\n"
        );
        assert!(Part::new(&mesh, 2).is_none());
    }
}
