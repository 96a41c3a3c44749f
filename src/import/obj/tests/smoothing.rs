//! Normals that the file does not give.

use super::*;

#[test]
fn faces_without_normals_are_flat_unless_they_are_in_a_smoothing_group() {
    let roof = "v 0 0 1\nv 0 0 -1\nv 1 -1 0\nv -1 -1 0\n";
    assert!(ok(&format!("{roof}f 1 3 2\nf 1 2 4")).meshes[0].normals.is_empty());
    let smooth = ok(&format!("{roof}s 1\nf 1 3 2\nf 1 2 4"));
    let mesh = &smooth.meshes[0];
    assert_eq!(mesh.positions.len(), 4);
    let ridge = mesh.positions.iter().position(|p| *p == Vec3::Z).map(|i| mesh.normals[i]);
    assert!(ridge.is_some_and(|n| n.distance(Vec3::Y) < 1e-6), "{ridge:?}");
    for split in ["s 1\nf 1 3 2\ns 2\nf 1 2 4", "s 1\nf 1 3 2\ns off\nf 1 2 4"] {
        let mesh = &ok(&format!("{roof}{split}")).meshes[0];
        assert_eq!(mesh.positions.len(), 6, "the ridge is sharp");
        let normal = mesh.normals[mesh.triangles[1][0] as usize];
        assert!(normal.distance(Vec3::new(-1.0, 1.0, 0.0).normalize()) < 1e-6, "{normal}");
    }
}

/// A smooth normal must not depend on how a face happens to be cut up: a cube's corner is along its diagonal.
#[test]
fn smooth_normals_weigh_faces_by_their_angle() {
    let cube = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\ns 1\n\
        f 1 4 3 2\nf 5 6 7 8\nf 1 2 6 5\nf 3 4 8 7\nf 2 3 7 6\nf 1 5 8\nf 1 8 4\n";
    let mesh = &ok(cube).meshes[0];
    for (p, n) in mesh.positions.iter().zip(&mesh.normals) {
        let diagonal = (*p - Vec3::splat(0.5)).normalize();
        assert!(n.distance(diagonal) < 1e-5, "at {p}: {n}");
    }
}

/// The group counts, not where the faces stand: the one of the second object goes on with that of the first.
#[test]
fn a_group_is_one_however_often_it_is_named() {
    let roof = "v 0 0 1\nv 0 0 -1\nv 1 -1 0\nv -1 -1 0\n";
    let mesh = &ok(&format!("{roof}s 7\nf 1 3 2\ns off\nusemtl x\ns 7\nf 1 2 4")).meshes[0];
    assert_eq!(mesh.positions.len(), 4);
}

#[test]
fn double_sided_sheets_keep_a_normal_for_each_side() {
    let mesh = &ok(&format!("{SQUARE}s 1\nf 1 2 3 4\nf 4 3 2 1")).meshes[0];
    for (t, normal) in [Vec3::Z, Vec3::Z, Vec3::NEG_Z, Vec3::NEG_Z].into_iter().enumerate() {
        assert!(mesh.triangles[t].iter().all(|&i| mesh.normals[i as usize] == normal), "{t}");
    }
}

#[test]
fn normals_without_length_are_none() {
    let mesh = &ok(&format!("{SQUARE}vn 0 0 0\nvn 0 0 1\ns 1\nf 1//1 2//1 3//2")).meshes[0];
    assert_eq!(mesh.normals, [Vec3::Z; 3]);
    assert!(ok(&format!("{SQUARE}vn 0 0 0\nf 1//1 2//1 3//1")).meshes[0].normals.is_empty());
}

/// The figures are those that Blender 5.0.1 shows for the same text.
#[test]
fn smooth_normals_are_blenders() {
    let text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 .2 .1\nv -1 0 1\ns 1\nf 1 2 3\nf 1 3 4\nf 1 4 5";
    let mesh = &ok(text).meshes[0];
    let normal = |t: usize, c: usize| mesh.normals[mesh.triangles[t][c] as usize];
    for ((t, c), [x, y, z]) in [
        ((0, 0), [0.469, -0.151, 0.87]),
        ((0, 1), [0.0, 0.0, 1.0]),
        ((0, 2), [0.156, 0.0, 0.988]),
        ((1, 2), [0.944, -0.147, 0.294]),
        ((2, 2), [0.667, -0.333, 0.667]),
    ] {
        assert!(normal(t, c).distance(Vec3::new(x, y, z)) < 2e-3, "corner {c} of {t}: {}", normal(t, c));
    }
}
