//! Whole files through [`load`].

use glam::{Vec2, Vec3};

use super::*;
use crate::{diagnostic::Severity, world::Mesh, world::Surface};

const SQUARE: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

/// A folder with these files, and what its `a.obj` loads as.
fn load_files(files: &[(&str, &[u8])]) -> Result<Model, Vec<Diagnostic>> {
    let folder = tempfile::tempdir().expect("a folder for temporary files");
    for (name, bytes) in files {
        std::fs::write(folder.path().join(name), bytes).expect("it can be written");
    }
    load(&folder.path().join("a.obj"))
}

fn ok(text: &str) -> Model {
    let model = load_files(&[("a.obj", text.as_bytes())]).unwrap_or_else(|e| panic!("{e:?}"));
    model.meshes.iter().for_each(check);
    model
}

fn message(bytes: &[u8]) -> String {
    load_files(&[("a.obj", bytes)]).expect_err("it is wrong").remove(0).message
}

/// What `world::Mesh` promises.
fn check(mesh: &Mesh) {
    let n = mesh.positions.len();
    assert!(mesh.triangles.iter().flatten().all(|&i| (i as usize) < n));
    for length in [mesh.normals.len(), mesh.uvs[0].len(), mesh.colors.len()] {
        assert!(length == 0 || length == n);
    }
    assert!(mesh.slots.is_empty() || mesh.slots.len() == mesh.triangles.len());
    assert!(mesh.positions.iter().all(|p| p.is_finite()));
    assert!(mesh.normals.iter().all(|v| (v.length() - 1.0).abs() < 1e-4));
}

#[test]
fn texts_of_all_systems_give_the_same_mesh() {
    let text = format!("{SQUARE}f 1 2 \\\n 3 4 # a square\n");
    let plain = ok(&text);
    assert_eq!(plain.meshes[0].triangles.len(), 2);
    for other in [text.replace('\n', "\r\n"), format!("\u{FEFF}{text}"), text.replace(' ', "\t")] {
        assert_eq!(ok(&other).meshes[0].positions, plain.meshes[0].positions);
        assert_eq!(ok(&other).meshes[0].triangles, plain.meshes[0].triangles);
    }
}

#[test]
fn corners_with_and_without_uv_and_normal_may_mix() {
    let model = ok(&format!("{SQUARE}vt 0.25 0.25\nvn 0 0 -2\nf 1/1/1 2/1/1 3/1/1\nf 1//1 3 4/1"));
    let mesh = &model.meshes[0];
    let at = |triangle: usize, corner: usize| mesh.triangles[triangle][corner] as usize;
    // OBJ's v = 0.25 is 0.75 from the top.
    assert_eq!(mesh.uvs[0][at(0, 2)], Vec2::new(0.25, 0.75));
    assert_eq!(mesh.uvs[0][at(1, 0)], Vec2::ZERO, "not that of the corner before");
    assert_eq!(mesh.normals[at(1, 0)], Vec3::NEG_Z, "the file's, made unit");
    assert_eq!(mesh.normals[at(1, 1)], Vec3::Z, "the face's own");
}

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

#[test]
fn objects_are_meshes_and_their_materials_slots() {
    let text = format!(
        "mtllib b.mtl\n{SQUARE}o left\nusemtl red\nf 1 2 3\nusemtl blue\nf 1 3 4\no empty\no right\nusemtl blue\nf 1 2 4"
    );
    let files: [(&str, &[u8]); 2] =
        [("a.obj", text.as_bytes()), ("b.mtl", b"newmtl red\nKd 1 0 0\nnewmtl blue\nKd 0 0 1")];
    let model = load_files(&files).expect("it is right");
    let names: Vec<_> = model.instances.iter().map(|i| i.name.as_str()).collect();
    assert_eq!(names, ["left", "right"]);
    assert_eq!((&model.meshes[0].slots, &model.meshes[1].slots), (&vec![0, 1], &vec![]));
    assert_eq!(model.instances[0].materials, [MaterialId(0), MaterialId(1)]);
    assert_eq!(model.instances[1].materials, [MaterialId(1)]);
    assert_eq!(model.materials.iter().map(|m| m.name.as_str()).collect::<Vec<_>>(), ["red", "blue"]);
    assert_eq!(model.warnings, []);
    assert!(matches!(&model.materials[1].surface, Surface::Diffuse { color } if color.factor == Vec3::Z));
}

#[test]
fn libraries_are_found_however_they_are_named() {
    let find = |mtllib: &str, files: &[&str]| {
        let obj = format!("{mtllib}\n{SQUARE}usemtl m\nf 1 2 3");
        let mut all: Vec<(&str, &[u8])> = vec![("a.obj", obj.as_bytes())];
        all.extend(files.iter().map(|name| (*name, b"newmtl m\nKd 0 1 0".as_slice())));
        let model = load_files(&all).expect("it is right");
        let green =
            matches!(model.materials[0].surface, Surface::Diffuse { color } if color.factor == Vec3::Y);
        (green, model.warnings.len())
    };
    assert_eq!(find("mtllib my materials.mtl", &["my materials.mtl"]), (true, 0));
    assert_eq!(find("mtllib x.mtl # comment", &["X.MTL"]), (true, 0));
    assert_eq!(find("mtllib x.mtl y.mtl", &["y.mtl"]), (true, 1), "x is missing");
    assert_eq!(find(r"mtllib x.mtl my\ materials.mtl", &["my materials.mtl"]), (true, 1));
    assert_eq!(find(r"mtllib C:\models\x.mtl", &["x.mtl"]), (true, 0));
    assert_eq!(find("", &["a.mtl"]), (true, 0));
    assert_eq!(find("mtllib x.mtl", &[]), (false, 2), "no library, and so no material");
}

#[test]
fn a_vertex_that_is_no_number_costs_its_faces_alone() {
    let model = ok(&format!("{SQUARE}v nan 0 0\nf 1 2 3\nf 1 2 5"));
    assert_eq!(model.meshes[0].triangles.len(), 1);
    let said = |i: usize| (&model.warnings[i].place, model.warnings[i].message.as_str());
    assert!(
        matches!(said(0), (Place::Line(5), said) if said.contains("the first is `nan 0 0`")),
        "{:?}",
        said(0)
    );
    assert!(matches!(said(1), (Place::File, said) if said.contains("not a number: 1")), "{:?}", said(1));
    assert!(message(format!("{SQUARE}v nan 0 0\nf 1 2 5").as_bytes()).contains("finite"));
}

#[test]
fn vertex_colors_are_linear_and_show_where_there_is_no_material() {
    let model = ok("v 0 0 0 1 0.5 0\nv 1 0 0\nv 0 1 0\nf 1 2 3");
    let color = model.meshes[0].colors[0];
    assert!((color.y - 0.214_041_14).abs() < 1e-5 && color.w == 1.0, "{color}");
    assert!(model.materials[0].vertex_colors);
    assert!(ok(&format!("{SQUARE}f 1 2 3")).meshes[0].colors.is_empty());
}

#[test]
fn what_is_no_obj_file_is_said_to_be_none() {
    assert!(message(b"").contains("empty"));
    assert!(message(b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR").contains("binary"));
    assert!(message(b"\xFF\xFE\x00\xD8").contains("UTF-16"));
    let missing = load(Path::new("nowhere/a.obj")).expect_err("it is not there");
    assert_eq!((missing.len(), missing[0].severity), (1, Severity::Error));
    assert!(load(Path::new("src")).expect_err("a folder")[0].message.contains("not a file"));
}
