//! Triangles as binary PLY: the parts of a mesh that have one material.

use std::collections::HashMap;

use glam::{Affine3A, Vec2, Vec3, Vec4};

use crate::world::Mesh;

/// Which triangles of a mesh, and what of them.
#[derive(Clone, Copy, Debug)]
pub struct Part {
    pub slot: u16,
    /// The UV set that is written.
    pub uv_set: u8,
    /// Whole textures by which the UV is moved back.
    pub uv_shift: Vec2,
    /// Vertex colours times this, and vertex alpha times this; `None` writes neither.
    pub colors: Option<(Vec3, f32)>,
    /// Only triangles whose bitangent has this sign.
    pub handedness: Option<f32>,
    /// Moved against the normal by this share of the size, for what lies just below a surface.
    pub inset: f32,
    /// Baked into the positions; where it mirrors, triangles are turned over with it.
    pub to_world: Option<Affine3A>,
}

/// A mesh file's bytes, and whether it carries normals.
pub struct Ply {
    pub bytes: Vec<u8>,
    pub normals: bool,
}

/// `None` where the part has no triangles with an area.
pub fn encode(mesh: &Mesh, part: &Part) -> Option<Ply> {
    let transform = part.to_world.unwrap_or(Affine3A::IDENTITY);
    let mirrors = transform.matrix3.determinant() < 0.0;
    let to_object = transform.inverse();
    let normal = |n: Vec3| to_object.matrix3.transpose().mul_vec3(n).normalize_or(Vec3::Y);
    let depth = inset(mesh, part);
    let uvs = set(mesh, part.uv_set);
    let mut file = Vertices::default();
    let mut faces: Vec<u8> = Vec::new();
    let mut count = 0u32;
    for (primitive, &corners) in mesh.triangles.iter().enumerate() {
        if mesh.slots.get(primitive).copied().unwrap_or(0) != part.slot {
            continue;
        }
        let Some(area) = area(mesh, corners) else { continue };
        if part.handedness.is_some_and(|sign| sign != handedness(mesh, corners)) {
            continue;
        }
        let [i, j, k] = corners;
        let turned = if mirrors { [i, k, j] } else { corners };
        let flip =
            !mesh.normals.is_empty() && corners.iter().all(|&i| mesh.normals[i as usize].dot(area) < 0.0);
        faces.push(3);
        for i in turned {
            // Without normals a corner moves with its own triangle.
            let apart = if depth != 0.0 && mesh.normals.is_empty() { primitive + 1 } else { 0 };
            let index = file.index((i, flip, apart), |bytes| {
                let n = mesh.normals.get(i as usize).map(|&n| if flip { -n } else { n });
                let p = mesh.positions[i as usize] - depth * n.unwrap_or(area.normalize_or_zero());
                put(bytes, &transform.transform_point3(p).to_array());
                if let Some(n) = n {
                    put(bytes, &normal(n).to_array());
                }
                if let Some(uv) = uvs.get(i as usize) {
                    put(bytes, &(*uv - part.uv_shift).to_array());
                }
                if let Some((factor, alpha)) = part.colors {
                    let color = mesh.colors.get(i as usize).copied().unwrap_or(Vec4::ONE);
                    put(bytes, &(color * factor.extend(alpha)).to_array());
                }
            });
            faces.extend(index.to_le_bytes());
        }
        count += 1;
    }
    if count == 0 {
        return None;
    }
    let mut header = format!("ply\nformat binary_little_endian 1.0\nelement vertex {}\n", file.count);
    let mut properties = vec!["x", "y", "z"];
    let normals = !mesh.normals.is_empty();
    if normals {
        properties.extend(["nx", "ny", "nz"]);
    }
    if !uvs.is_empty() {
        properties.extend(["u", "v"]);
    }
    if part.colors.is_some() {
        // Mitsuba names them vertex_color and vertex_opacity.
        properties.extend(["r", "g", "b", "opacity_x"]);
    }
    for property in properties {
        header.push_str(&format!("property float {property}\n"));
    }
    header.push_str(&format!("element face {count}\nproperty list uchar uint vertex_indices\nend_header\n"));
    let mut bytes = header.into_bytes();
    bytes.extend(file.bytes);
    bytes.extend(faces);
    Some(Ply { bytes, normals })
}

/// The set asked for; where the mesh has one only, that one.
pub fn set(mesh: &Mesh, uv_set: u8) -> &[Vec2] {
    let [first, second] = &mesh.uvs;
    if (uv_set == 1 && !second.is_empty()) || first.is_empty() { second } else { first }
}

/// The sign of the bitangent against cross(normal, ∂p/∂u), which is where Mitsuba has it.
pub fn handedness(mesh: &Mesh, corners: [u32; 3]) -> f32 {
    if let [i, ..] = corners
        && let Some(tangent) = mesh.tangents.get(i as usize)
    {
        return tangent.w.signum();
    }
    let uvs = set(mesh, 0);
    if uvs.is_empty() {
        return 1.0;
    }
    let [a, b, c] = corners.map(|i| uvs[i as usize]);
    if (b - a).perp_dot(c - a) > 0.0 { -1.0 } else { 1.0 }
}

/// The area times two along the normal; `None` where there is none.
pub fn area(mesh: &Mesh, corners: [u32; 3]) -> Option<Vec3> {
    let [a, b, c] = corners.map(|i| mesh.positions[i as usize]);
    let area = (b - a).cross(c - a);
    (area.is_finite() && area != Vec3::ZERO).then_some(area)
}

fn inset(mesh: &Mesh, part: &Part) -> f32 {
    if part.inset == 0.0 {
        return 0.0;
    }
    let finite = mesh.positions.iter().filter(|p| p.is_finite());
    let (low, high) = finite.fold((Vec3::MAX, Vec3::MIN), |(low, high), &p| (low.min(p), high.max(p)));
    part.inset * (high - low).max_element()
}

fn put(bytes: &mut Vec<u8>, numbers: &[f32]) {
    bytes.extend(numbers.iter().flat_map(|n| n.to_le_bytes()));
}

/// Vertices written so far: only those that triangles use.
#[derive(Default)]
struct Vertices {
    known: HashMap<(u32, bool, usize), u32>,
    bytes: Vec<u8>,
    count: u32,
}

impl Vertices {
    fn index(&mut self, key: (u32, bool, usize), write: impl FnOnce(&mut Vec<u8>)) -> u32 {
        if let Some(&index) = self.known.get(&key) {
            return index;
        }
        write(&mut self.bytes);
        self.known.insert(key, self.count);
        self.count += 1;
        self.count - 1
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mesh() -> Mesh {
        Mesh {
            positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y, 2.0 * Vec3::X],
            normals: vec![Vec3::Z, Vec3::Z, Vec3::Z, Vec3::Z],
            uvs: [
                vec![Vec2::new(0.0, 2.0), Vec2::new(1.0, 2.0), Vec2::new(0.0, 1.0), Vec2::ZERO],
                Vec::new(),
            ],
            triangles: vec![[0, 1, 2], [0, 1, 3], [2, 1, 0]],
            slots: vec![0, 0, 1],
            ..Mesh::default()
        }
    }

    const PART: Part = Part {
        slot: 0,
        uv_set: 1,
        uv_shift: Vec2::Y,
        colors: Some((Vec3::new(0.5, 1.0, 2.0), 0.25)),
        handedness: None,
        inset: 0.0,
        to_world: None,
    };

    /// Header, the numbers of the vertices, the indices of the triangles.
    fn decode(part: &Part) -> (String, Vec<f32>, Vec<u32>) {
        let bytes = encode(&mesh(), part).expect("has triangles").bytes;
        let end = bytes.windows(11).position(|w| w == b"end_header\n").expect("header") + 11;
        let header = String::from_utf8(bytes[..end].to_vec()).expect("ASCII");
        let count = |what: &str| -> usize {
            let line = header.lines().find(|l| l.starts_with(what)).expect("counted");
            line.rsplit(' ').next().and_then(|n| n.parse().ok()).expect("a number")
        };
        let properties = header.matches("property float").count();
        let (vertices, faces) = bytes[end..].split_at(4 * properties * count("element vertex"));
        let word = |b: &[u8]| [b[0], b[1], b[2], b[3]];
        let numbers = vertices.chunks(4).map(|b| f32::from_le_bytes(word(b))).collect();
        assert_eq!(faces.len(), 13 * count("element face"));
        let indices = faces.chunks(13).flat_map(|f| f[1..].chunks(4)).map(|b| u32::from_le_bytes(word(b)));
        (header, numbers, indices.collect())
    }

    #[test]
    fn a_part_has_its_triangles_with_an_area_and_their_vertices() {
        let (header, numbers, indices) = decode(&PART);
        assert!(header.contains("element vertex 3\n") && header.contains("element face 1\n"), "{header}");
        assert_eq!(indices, [0, 1, 2]);
        // position, normal, UV of the only set there is, colour, opacity
        assert_eq!(numbers[12..24], [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 0.5, 1.0, 2.0, 0.25]);
    }

    #[test]
    fn normals_keep_to_the_front_that_the_winding_says() {
        let (_, numbers, _) = decode(&Part { slot: 1, ..PART });
        assert_eq!(numbers[3..6], [0.0, 0.0, -1.0]);
    }

    #[test]
    fn mirrors_turn_triangles_over_and_not_normals() {
        let mirror = Affine3A::from_scale(Vec3::new(-1.0, 1.0, 1.0));
        let (_, numbers, indices) = decode(&Part { to_world: Some(mirror), ..PART });
        // the first vertex, then the third
        assert_eq!((indices, &numbers[12..18]), (vec![0, 1, 2], &[0.0, 1.0, 0.0, 0.0, 0.0, 1.0][..]));
        assert_eq!(numbers[24..27], [-1.0, 0.0, 0.0]);
    }

    /// v grows downwards in the picture: laid out as it is seen, a triangle's bitangent is cross(normal, ∂p/∂u).
    #[test]
    fn handedness_follows_the_layout_of_the_uvs() {
        let mut mesh = mesh();
        assert_eq!(handedness(&mesh, [0, 1, 2]), 1.0);
        for uv in &mut mesh.uvs[0] {
            uv.x = -uv.x;
        }
        assert_eq!(handedness(&mesh, [0, 1, 2]), -1.0);
    }
}
