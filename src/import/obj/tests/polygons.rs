//! Polygons as whole files have them.

use super::*;

fn area(mesh: &Mesh) -> f32 {
    let corner = |i: u32| mesh.positions[i as usize];
    let area = |t: &[u32; 3]| (corner(t[1]) - corner(t[0])).cross(corner(t[2]) - corner(t[0])).length() / 2.0;
    mesh.triangles.iter().map(area).sum()
}

/// A square of side 4 with a square hole of side 2, its outline joined to the hole by an edge there and back, as programs
/// write a face with a hole.
#[test]
fn a_keyhole_keeps_its_hole() {
    let points = "v 0 0 0\nv 4 0 0\nv 4 4 0\nv 0 4 0\nv 1 1 0\nv 1 3 0\nv 3 3 0\nv 3 1 0\n";
    for face in ["f 1 2 3 4 1 5 6 7 8 5", "f -8 -7 -6 -5 -8 -4 -3 -2 -1 -4"] {
        let model = ok(&format!("{points}{face}"));
        let mesh = &model.meshes[0];
        assert!((area(mesh) - 12.0).abs() < 1e-5, "area {}", area(mesh));
        let middle = |t: &[u32; 3]| t.iter().map(|&i| mesh.positions[i as usize]).sum::<Vec3>() / 3.0;
        let in_hole = |p: Vec3| (1.0..3.0).contains(&p.x) && (1.0..3.0).contains(&p.y);
        assert!(
            mesh.triangles
                .iter()
                .all(|t| !in_hole(middle(t)) || area(&Mesh { triangles: vec![*t], ..mesh.clone() }) < 1e-6)
        );
        assert_eq!(mesh.positions.len(), 8);
    }
}

/// The corner attributes of a concave polygon stay with their corners, wherever the ears are.
#[test]
fn corners_of_a_concave_polygon_keep_their_attributes() {
    let text = "v 0 0 0\nv 2 1 0\nv 0 2 0\nv 1 1 0\nvt 0 0\nvt 2 1\nvt 0 2\nvt 1 1\nf 1/1 2/2 3/3 4/4";
    let mesh = &ok(text).meshes[0];
    assert!((area(mesh) - 1.0).abs() < 1e-6, "area {}", area(mesh));
    for (p, uv) in mesh.positions.iter().zip(&mesh.uvs[0]) {
        assert_eq!((p.x, 1.0 - p.y), (uv.x, uv.y));
    }
}
