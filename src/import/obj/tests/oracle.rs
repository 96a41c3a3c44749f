//! The crate `tobj` as a second opinion: another parser, by other people, finds the same triangles.
//!
//! It goes wrong on concave polygons, lines, mixed corners, comments within lines, continued lines and BOMs, so the files
//! are such as it reads rightly.

use std::fmt::Write;

use super::*;

/// Of a corner: position, UV, normal; what is missing is 0.
type Corner = ([f32; 3], [f32; 2], [f32; 3]);

fn ours(path: &Path) -> Vec<Corner> {
    let model = load(path).unwrap_or_else(|e| panic!("{e:?}"));
    let mut all = Vec::new();
    for mesh in &model.meshes {
        for &i in mesh.triangles.iter().flatten() {
            let i = i as usize;
            let uv = mesh.uvs[0].get(i).map_or([0.0; 2], |uv| uv.to_array());
            let normal = mesh.normals.get(i).map_or([0.0; 3], |n| n.to_array());
            all.push((mesh.positions[i].to_array(), uv, normal));
        }
    }
    all
}

fn theirs(path: &Path) -> Vec<Corner> {
    let options = tobj::LoadOptions { triangulate: true, single_index: true, ..Default::default() };
    let (models, _) = tobj::load_obj(path, &options).expect("tobj reads it");
    let mut all = Vec::new();
    for mesh in models.iter().map(|model| &model.mesh) {
        for &i in &mesh.indices {
            let at =
                |values: &[f32], n: usize, k: usize| values.get(i as usize * n + k).copied().unwrap_or(0.0);
            let position = [0, 1, 2].map(|k| at(&mesh.positions, 3, k));
            let (u, v) = (at(&mesh.texcoords, 2, 0), at(&mesh.texcoords, 2, 1));
            let uv = if mesh.texcoords.is_empty() { [0.0; 2] } else { [u, 1.0 - v] };
            let normal = Vec3::from([0, 1, 2].map(|k| at(&mesh.normals, 3, k)));
            all.push((position, uv, normal.normalize_or_zero().to_array()));
        }
    }
    all
}

fn assert_agree(path: &Path) {
    let (ours, theirs) = (ours(path), theirs(path));
    assert_eq!(ours.len(), theirs.len(), "{}", path.display());
    for (i, (ours, theirs)) in ours.iter().zip(&theirs).enumerate() {
        assert_eq!((ours.0, ours.1), (theirs.0, theirs.1), "corner {i} of {}", path.display());
        let apart = Vec3::from(ours.2).distance(theirs.2.into());
        assert!(apart < 1e-5, "normal of corner {i} of {}: {ours:?}, {theirs:?}", path.display());
    }
}

#[test]
fn tobj_finds_the_same_in_our_own_model() {
    assert_agree(&Path::new(env!("CARGO_MANIFEST_DIR")).join("assets/fruit-bowl.obj"));
}

/// A wavy grid of triangles and flat quads in several pieces, with numbers of many shapes and both kinds of indices.
#[test]
fn tobj_finds_the_same_in_a_long_file() {
    const SIDE: usize = 150;
    let mut text = String::new();
    let mut random = 1_u32;
    for i in 0..SIDE * SIDE {
        random = random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        let (x, z, wave) = ((i % SIDE) as f32, (i / SIDE) as f32, random as f32 / 1e10);
        let line = match i % 4 {
            0 => writeln!(text, "v {x} {wave:.9} {z:.1}"),
            1 => writeln!(text, "v  {x:e}\t{wave:e} {z}"),
            2 => writeln!(text, "v {x:.3} -{wave:.4} +{z}.  "),
            _ => writeln!(text, "v {x} {wave:.20} {z}e0"),
        };
        line.and(writeln!(text, "vt {wave} .{:07}", random % 9_999_991)).expect("a string grows");
        writeln!(text, "vn {wave:.3} 1 -.{}", random % 97).expect("a string grows");
    }
    let n = SIDE * SIDE;
    for (x, y) in (0..SIDE - 1).flat_map(|y| (0..SIDE - 1).map(move |x| (x, y))) {
        let a = y * SIDE + x + 1;
        let [b, c, d] = [a + 1, a + SIDE, a + SIDE + 1];
        let back = |i: usize| i as i64 - n as i64 - 1;
        if x == 0 {
            writeln!(text, "usemtl row{}", y % 3).expect("a string grows");
        }
        let [e, f, g] = [back(b), back(c), back(d)];
        let line = match (x + y) % 2 {
            0 => writeln!(text, "f {a}/{a}/{a} {c}/{c}/{c} {b}/{b}/{b}"),
            _ => writeln!(text, "f {e}/{f}/{g} {f}/{f}/{f} {g}/{e}/{e}"),
        };
        line.expect("a string grows");
    }
    let folder = tempfile::tempdir().expect("a folder for temporary files");
    let path = folder.path().join("a.obj");
    std::fs::write(&path, &text).expect("it can be written");
    assert!(text.len() > 2 * pieces::PIECE, "it is read in several pieces");
    assert_agree(&path);
}
