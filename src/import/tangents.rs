//! Tangents for normal mapping where a file gives none: MikkTSpace, which glTF 2.0 prescribes (section 3.7.2.1) and which
//! tools that bake normal maps use.
//!
//! MikkTSpace works on corners. Corners of a vertex that end up with different tangents split it. It is fed (u, 1 − v):
//! texture coordinates here run down the image, while a normal map's green points up it.

use std::collections::HashMap;

use bevy_mikktspace::{Geometry, TangentSpace, generate_tangents};
use glam::{Vec2, Vec3, Vec4};

use crate::{
    cache::{self, Cache, Key},
    world::Mesh,
};

/// Of fewer triangles tangents are computed sooner than looked for.
const LEAST_KEPT: usize = 1 << 10;

/// Gives `mesh` tangents along its UV set `set`. Without normals or that set, or where no triangle has a direction in
/// texture space, it stays without.
pub fn generate(mesh: &mut Mesh, set: usize) {
    let Some(uvs) = mesh.uvs.get(set) else { return };
    let n = mesh.positions.len();
    if mesh.normals.len() != n || uvs.len() != n || mesh.triangles.is_empty() {
        return;
    }
    let tangents = match cache::shared().filter(|_| mesh.triangles.len() >= LEAST_KEPT) {
        Some(cache) => kept(cache, mesh, uvs),
        None => computed(mesh, uvs),
    };
    if tangents.iter().flatten().any(|tangent| !tangent.is_nan()) {
        assign(mesh, &tangents);
    }
}

/// Of the corners of each triangle; NaN where there is none.
fn computed(mesh: &Mesh, uvs: &[Vec2]) -> Vec<[Vec4; 3]> {
    let mut corners = Corners { mesh, uvs, tangents: vec![[Vec4::NAN; 3]; mesh.triangles.len()] };
    match generate_tangents(&mut corners) {
        Ok(()) => corners.tangents,
        Err(_) => Vec::new(),
    }
}

/// The same from the cache, if they are there.
fn kept(cache: &Cache, mesh: &Mesh, uvs: &[Vec2]) -> Vec<[Vec4; 3]> {
    let (positions, normals) = (bytemuck::cast_slice(&mesh.positions), bytemuck::cast_slice(&mesh.normals));
    let triangles = mesh.triangles.as_flattened();
    let key = Key::of(
        "tangents",
        &[positions, normals, bytemuck::cast_slice(uvs), bytemuck::cast_slice(triangles)],
    );
    let count = mesh.triangles.len();
    let empty =
        |_, length| (length == (count * size_of::<[Vec4; 3]>()) as u64).then(|| vec![[Vec4::ZERO; 3]; count]);
    let bytes: fn(&mut Vec<[Vec4; 3]>) -> &mut [u8] = |all| bytemuck::cast_slice_mut(all.as_flattened_mut());
    cache.get(&key, empty, bytes).unwrap_or_else(|| {
        let tangents = computed(mesh, uvs);
        cache.put(&key, [0; 16], bytemuck::cast_slice(tangents.as_flattened()));
        tangents
    })
}

struct Corners<'a> {
    mesh: &'a Mesh,
    uvs: &'a [Vec2],
    tangents: Vec<[Vec4; 3]>,
}

impl Corners<'_> {
    fn vertex(&self, face: usize, corner: usize) -> usize {
        self.mesh.triangles[face][corner] as usize
    }
}

impl Geometry for Corners<'_> {
    fn num_faces(&self) -> usize {
        self.mesh.triangles.len()
    }

    fn num_vertices_of_face(&self, _: usize) -> usize {
        3
    }

    fn position(&self, face: usize, corner: usize) -> [f32; 3] {
        self.mesh.positions[self.vertex(face, corner)].into()
    }

    fn normal(&self, face: usize, corner: usize) -> [f32; 3] {
        self.mesh.normals[self.vertex(face, corner)].into()
    }

    fn tex_coord(&self, face: usize, corner: usize) -> [f32; 2] {
        let uv = self.uvs[self.vertex(face, corner)];
        [uv.x, 1.0 - uv.y]
    }

    fn set_tangent(&mut self, space: Option<TangentSpace>, face: usize, corner: usize) {
        let tangent = space.and_then(|space| {
            let [x, y, z, w] = space.tangent_encoded();
            Vec3::new(x, y, z).try_normalize().map(|t| t.extend(w))
        });
        self.tangents[face][corner] = tangent.unwrap_or(Vec4::NAN);
    }
}

/// Writes the corners' tangents to the vertices, splitting those whose corners disagree. A corner without one (a degenerate
/// triangle apart from all others) gets any direction across the normal.
fn assign(mesh: &mut Mesh, tangents: &[[Vec4; 3]]) {
    let mut given: Vec<Option<Vec4>> = vec![None; mesh.positions.len()];
    let mut split: HashMap<(u32, [u32; 4]), u32> = HashMap::new();
    let mut triangles = std::mem::take(&mut mesh.triangles);
    for (triangle, tangents) in triangles.iter_mut().zip(tangents) {
        for (vertex, tangent) in triangle.iter_mut().zip(tangents) {
            let v = *vertex as usize;
            let tangent = match tangent.is_nan() {
                true => mesh.normals[v].any_orthogonal_vector().normalize_or(Vec3::X).extend(1.0),
                false => *tangent,
            };
            match given[v] {
                None => given[v] = Some(tangent),
                Some(first) if first == tangent => {}
                Some(_) => {
                    let key = (*vertex, tangent.to_array().map(f32::to_bits));
                    *vertex = *split.entry(key).or_insert_with(|| {
                        duplicate(mesh, v);
                        given.push(Some(tangent));
                        (mesh.positions.len() - 1) as u32
                    });
                }
            }
        }
    }
    mesh.triangles = triangles;
    mesh.tangents = given.into_iter().map(|t| t.unwrap_or(Vec4::new(1.0, 0.0, 0.0, 1.0))).collect();
}

/// Appends a copy of vertex `v`.
fn duplicate(mesh: &mut Mesh, v: usize) {
    fn copy<T: Copy>(values: &mut Vec<T>, v: usize) {
        if let Some(&value) = values.get(v) {
            values.push(value);
        }
    }
    copy(&mut mesh.positions, v);
    copy(&mut mesh.normals, v);
    mesh.uvs.iter_mut().for_each(|uvs| copy(uvs, v));
    copy(&mut mesh.colors, v);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_kept_is_what_was_computed() {
        let folder = tempfile::tempdir().expect("a folder");
        let cache = Cache::open(folder.path(), cache::LIMIT).expect("opened");
        let mut mesh = square([Vec2::new(0., 1.), Vec2::new(1., 1.), Vec2::ZERO, Vec2::new(1., 0.)]);
        // One without area, apart from the others, has no tangent.
        mesh.positions.push(Vec3::splat(9.0));
        mesh.normals.push(Vec3::Z);
        mesh.triangles.push([4; 3]);
        let mut uvs = mesh.uvs[0].clone();
        uvs.push(Vec2::ZERO);
        let bits = |all: Vec<[Vec4; 3]>| {
            all.concat().iter().map(|t| t.to_array().map(f32::to_bits)).collect::<Vec<_>>()
        };
        let fresh = bits(computed(&mesh, &uvs));
        assert_eq!(bits(kept(&cache, &mesh, &uvs)), fresh);
        assert_eq!(bits(kept(&cache, &mesh, &uvs)), fresh);
        // Another mesh has its own.
        uvs.iter_mut().for_each(|uv| uv.x = 1.0 - uv.x);
        assert_eq!(bits(kept(&cache, &mesh, &uvs)), bits(computed(&mesh, &uvs)));
        assert_ne!(bits(kept(&cache, &mesh, &uvs)), fresh);
    }

    /// Two triangles of a square in z = 0 facing +Z; v runs down.
    fn square(uvs: [Vec2; 4]) -> Mesh {
        Mesh {
            positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::new(1., 1., 0.)],
            normals: vec![Vec3::Z; 4],
            uvs: [uvs.to_vec(), Vec::new()],
            triangles: vec![[0, 1, 2], [2, 1, 3]],
            ..Mesh::default()
        }
    }

    #[test]
    fn handedness_tells_a_mirrored_image() {
        let upright = [Vec2::new(0., 1.), Vec2::new(1., 1.), Vec2::new(0., 0.), Vec2::new(1., 0.)];
        let mirrored = upright.map(|uv| Vec2::new(1. - uv.x, uv.y));
        for (uvs, expected) in [(upright, Vec4::new(1., 0., 0., 1.)), (mirrored, Vec4::new(-1., 0., 0., -1.))]
        {
            let mut mesh = square(uvs);
            generate(&mut mesh, 0);
            assert_eq!(mesh.tangents, [expected; 4]);
        }
    }

    /// The image is mirrored along the diagonal that the triangles share, whose vertices must split.
    #[test]
    fn vertices_split_where_corners_disagree() {
        let mut mesh = square([Vec2::new(0., 1.), Vec2::new(1., 1.), Vec2::new(0., 0.), Vec2::new(0., 1.)]);
        generate(&mut mesh, 0);
        assert_eq!(mesh.positions.len(), 6);
        assert_eq!([mesh.normals.len(), mesh.tangents.len(), mesh.uvs[0].len()], [6; 3]);
        let corner = |t: usize, c: usize| mesh.tangents[mesh.triangles[t][c] as usize];
        assert!(corner(0, 1).w * corner(1, 1).w < 0.0);
        for (t, original) in [[0, 1, 2], [2, 1, 3]].into_iter().enumerate() {
            for (c, v) in original.into_iter().enumerate() {
                assert_eq!(mesh.positions[mesh.triangles[t][c] as usize], mesh.positions[v]);
            }
        }
    }

    #[test]
    fn without_a_direction_in_texture_space_there_are_none() {
        let mut mesh = square([Vec2::ZERO; 4]);
        generate(&mut mesh, 0);
        assert!(mesh.tangents.is_empty() || mesh.tangents.iter().all(|t| t.truncate().is_normalized()));
        let mut bare = Mesh { normals: Vec::new(), ..square([Vec2::ZERO; 4]) };
        generate(&mut bare, 0);
        generate(&mut bare, 1);
        generate(&mut bare, 7);
        assert!(bare.tangents.is_empty());
    }
}
