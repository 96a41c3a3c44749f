//! Triangles: meshes as they are, quads as meshes, and the sphere of triangles.

use std::{
    collections::HashMap,
    f32::consts::{PI, TAU},
};

use glam::{Vec2, Vec3, Vec4};

use super::{arrays::Arrays, axes, document, materials::Needs};
use crate::world::{Mesh, Quad};

/// Sides of the polygon that stands in for an ellipse.
pub const SIDES: u32 = 256;
/// Times the triangles of the icosahedron are cut into four: 81920 in the end.
const CUTS: u32 = 6;

/// None where no triangle is left: those without area or with corners that are not finite are not rendered here either.
pub fn write(mesh: &Mesh, needs: Needs, arrays: &mut Arrays) -> Option<document::Mesh> {
    let usable = |i: &usize| {
        let [a, b, c] = corners(mesh, *i);
        let area = (b - a).cross(c - a);
        area.is_finite() && area != Vec3::ZERO
    };
    let kept: Vec<usize> = (0..mesh.triangles.len()).filter(usable).collect();
    if kept.is_empty() {
        return None;
    }
    let vertices = mesh.positions.len();
    let finite = |v: Vec3| if v.is_finite() { v } else { Vec3::ZERO };
    let positions = arrays.floats(mesh.positions.iter().flat_map(|p| axes::point(finite(*p))));
    let triangles = arrays.integers(kept.iter().flat_map(|&i| mesh.triangles[i]));
    let normals = (!mesh.normals.is_empty())
        .then(|| arrays.floats(mesh.normals.iter().flat_map(|n| axes::point(finite(*n)))));
    let uvs = [0, 1].map(|set| {
        needs.uvs[set].then(|| match &mesh.uvs[set][..] {
            [] => arrays.floats(std::iter::repeat_n(axes::uv(Vec2::ZERO), vertices).flatten()),
            uvs => arrays.floats(uvs.iter().flat_map(|uv| axes::uv(*uv))),
        })
    });
    let colors = needs.colors.then(|| match &mesh.colors[..] {
        [] => arrays.floats(std::iter::repeat_n(1.0, 4 * vertices)),
        colors => arrays.floats(colors.iter().flat_map(|c| c.to_array())),
    });
    let tangents = needs.tangents.then(|| match &mesh.tangents[..] {
        [] => kept.iter().flat_map(|&i| [flat_tangent(mesh, i); 3]).collect(),
        tangents => tangents.to_vec(),
    });
    let slots =
        (!mesh.slots.is_empty()).then(|| arrays.integers(kept.iter().map(|&i| u32::from(mesh.slots[i]))));
    Some(document::Mesh {
        name: mesh.name.clone(),
        positions,
        triangles,
        normals,
        uvs,
        colors,
        tangents: tangents.as_ref().map(|t| arrays.floats(t.iter().flat_map(|t| axes::point(t.truncate())))),
        tangent_signs: tangents.as_ref().map(|t| arrays.floats(t.iter().map(|t| t.w))),
        tangents_by_corner: mesh.tangents.is_empty(),
        slots,
        slot_count: mesh.slots.iter().max().map_or(1, |&last| usize::from(last) + 1),
    })
}

fn corners(mesh: &Mesh, triangle: usize) -> [Vec3; 3] {
    mesh.triangles[triangle].map(|i| mesh.positions[i as usize])
}

/// ∂p/∂u of a triangle, and the sign that makes the bitangent point up in the picture; zero where the UVs say nothing.
fn flat_tangent(mesh: &Mesh, triangle: usize) -> Vec4 {
    let [set, other] = &mesh.uvs;
    let uvs = if set.is_empty() { other } else { set };
    let corner = |i: usize| uvs.get(mesh.triangles[triangle][i] as usize).copied().unwrap_or_default();
    let [p0, p1, p2] = corners(mesh, triangle);
    let (d1, d2) = (corner(1) - corner(0), corner(2) - corner(0));
    let determinant = d1.perp_dot(d2);
    if determinant == 0.0 || !determinant.is_finite() {
        return Vec4::ZERO;
    }
    let along_u = (d2.y * (p1 - p0) - d1.y * (p2 - p0)) / determinant;
    along_u.normalize_or_zero().extend(-determinant.signum())
}

/// Quads of one material, in world space.
pub fn quads(name: &str, quads: &[Quad]) -> Mesh {
    let mut mesh = Mesh { name: name.to_owned(), ..Mesh::default() };
    for quad in quads {
        let first = mesh.positions.len() as u32;
        let outline = if quad.round { ellipse() } else { vec![Vec2::ZERO, Vec2::X, Vec2::ONE, Vec2::Y] };
        for at in &outline {
            mesh.positions.push(quad.origin + at.x * quad.u + at.y * quad.v);
            mesh.uvs[0].push(Vec2::new(at.x, 1.0 - at.y));
        }
        mesh.triangles.extend((2..outline.len() as u32).map(|i| [first, first + i - 1, first + i]));
    }
    mesh.uvs[1] = mesh.uvs[0].clone();
    mesh
}

/// A polygon with as much area as the circle inscribed in the unit square.
fn ellipse() -> Vec<Vec2> {
    let side = TAU / SIDES as f32;
    let radius = 0.5 * (side / side.sin()).sqrt();
    (0..SIDES).map(|i| Vec2::splat(0.5) + radius * Vec2::from_angle(i as f32 * side)).collect()
}

/// An icosphere with as much area as the unit sphere, and the normals of the sphere.
pub fn sphere() -> Mesh {
    let golden = 0.5 * (1.0 + 5f32.sqrt());
    let mut normals: Vec<Vec3> = Vec::new();
    for (a, b) in [(1.0, golden), (-1.0, golden), (1.0, -golden), (-1.0, -golden)] {
        normals.extend([Vec3::new(0.0, a, b), Vec3::new(a, b, 0.0), Vec3::new(b, 0.0, a)]);
    }
    let mut triangles = hull(&normals);
    for normal in &mut normals {
        *normal = normal.normalize();
    }
    for _ in 0..CUTS {
        let mut middles = HashMap::new();
        let mut middle = |a: u32, b: u32| {
            *middles.entry((a.min(b), a.max(b))).or_insert_with(|| {
                normals.push((normals[a as usize] + normals[b as usize]).normalize());
                normals.len() as u32 - 1
            })
        };
        triangles = triangles
            .iter()
            .flat_map(|&[a, b, c]| {
                let [ab, bc, ca] = [middle(a, b), middle(b, c), middle(c, a)];
                [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
            })
            .collect();
    }
    let area: f64 = triangles
        .iter()
        .map(|t| {
            let [a, b, c] = t.map(|i| normals[i as usize]);
            0.5 * f64::from((b - a).cross(c - a).length())
        })
        .sum();
    let scale = (4.0 * f64::from(PI) / area).sqrt() as f32;
    let positions = normals.iter().map(|n| scale * n).collect();
    Mesh { name: "Sphere".into(), positions, normals, triangles, ..Mesh::default() }
}

/// The faces of the icosahedron, counter-clockwise from outside: corners two apart are its edges' ends.
fn hull(corners: &[Vec3]) -> Vec<[u32; 3]> {
    let near = |a: usize, b: usize| corners[a].distance(corners[b]) < 2.1;
    let mut faces = Vec::new();
    for a in 0..corners.len() {
        for b in a + 1..corners.len() {
            for c in b + 1..corners.len() {
                if near(a, b) && near(b, c) && near(a, c) {
                    let outward = (corners[b] - corners[a]).cross(corners[c] - corners[a]).dot(corners[a]);
                    let [a, b, c] = [a as u32, b as u32, c as u32];
                    faces.push(if outward > 0.0 { [a, b, c] } else { [a, c, b] });
                }
            }
        }
    }
    faces
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::world::MaterialId;

    #[test]
    fn the_sphere_is_closed_and_as_large_as_a_sphere() {
        let mesh = sphere();
        assert_eq!(mesh.triangles.len(), 20 << (2 * CUTS));
        assert_eq!(mesh.positions.len(), mesh.triangles.len() / 2 + 2, "Euler's formula");
        let volume: f64 = mesh
            .triangles
            .iter()
            .map(|t| {
                let [a, b, c] = t.map(|i| mesh.positions[i as usize].as_dvec3());
                a.dot(b.cross(c)) / 6.0
            })
            .sum();
        assert!((volume / (4.0 / 3.0 * std::f64::consts::PI) - 1.0).abs() < 1e-4, "{volume}");
        for p in &mesh.positions {
            assert!((p.length() - 1.0).abs() < 4e-5, "{}", p.length());
        }
    }

    #[test]
    fn quads_face_the_way_of_u_cross_v_and_keep_their_area() {
        let quad = Quad {
            origin: Vec3::new(1.0, 2.0, 3.0),
            u: Vec3::new(2.0, 0.0, 0.0),
            v: Vec3::new(1.0, 3.0, 0.0),
            round: false,
            material: MaterialId(0),
        };
        for (round, area) in [(false, 6.0), (true, 6.0 * PI / 4.0)] {
            let mesh = quads("q", &[quad, Quad { round, ..quad }]);
            let skip = 2;
            let total: Vec3 = (skip..mesh.triangles.len())
                .map(|i| {
                    let [a, b, c] = corners(&mesh, i);
                    0.5 * (b - a).cross(c - a)
                })
                .sum();
            assert!(total.abs_diff_eq(Vec3::new(0.0, 0.0, area), 1e-3), "{total}");
        }
    }

    #[test]
    fn useless_triangles_are_left_out_with_their_slots() {
        let mut mesh = quads(
            "q",
            &[Quad { origin: Vec3::ZERO, u: Vec3::X, v: Vec3::Y, round: false, material: MaterialId(0) }],
        );
        mesh.triangles.insert(1, [0, 1, 1]);
        mesh.slots = vec![3, 7, 2];
        let mut arrays = Arrays::default();
        let needs = Needs { tangents: true, colors: true, ..Needs::default() };
        let written = write(&mesh, needs, &mut arrays).expect("two triangles");
        let [_, (_, integers)] = arrays.files();
        let numbers: Vec<u8> = integers[128..].chunks(4).map(|n| n[0]).collect();
        assert_eq!(numbers, [0, 1, 2, 0, 2, 3, 3, 2]);
        assert_eq!(written.slot_count, 8);
        assert!(written.tangents_by_corner && written.colors.is_some() && written.uvs == [None, None]);
        let tangent = flat_tangent(&mesh, 0);
        assert_eq!(tangent, Vec4::new(1.0, 0.0, 0.0, 1.0));
    }
}
