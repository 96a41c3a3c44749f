//! Whole files through [`load`].

mod oracle;
mod polygons;
mod same;
mod smoothing;

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
fn what_a_face_names_without_its_being_there_is_told_with_its_line() {
    let errors = |text: String| {
        let all = load_files(&[("a.obj", text.as_bytes())]).expect_err("it is wrong");
        all.into_iter().map(|d| (d.place, d.message)).collect::<Vec<_>>()
    };
    let said = errors(format!("f 1 2 9\n{SQUARE}v 1 x 2\nv 1 2\nf 1 2 0\nf -9 1 2\nf 1/2/3/4 2 3\nf /1 2 3"));
    let said: Vec<_> = said.iter().map(|(place, message)| (place, message.as_str())).collect();
    assert_eq!(
        said,
        [
            (&Place::Line(1), "vertex 9 does not exist: the file has 6"),
            (&Place::Line(6), "`x` is no number"),
            (&Place::Line(7), "a vertex needs three numbers"),
            (&Place::Line(8), "a vertex of index 0: OBJ counts from 1"),
            (&Place::Line(9), "an index counts back to before the first vertex"),
            (&Place::Line(10), "`1/2/3/4` is no corner: at most v/vt/vn"),
            (&Place::Line(11), "`/1`: a corner without a vertex"),
        ]
    );
    assert_eq!(errors("v x\n".repeat(100)).len(), scan::MAX_ERRORS + 1);
    assert!(errors(SQUARE.into())[0].1.contains("no faces"));
    assert!(errors("Dear reader,\nthis is a letter.".into())[0].1.contains("no OBJ"));
}

#[test]
fn an_attribute_that_is_not_there_costs_itself_alone() {
    let model = ok(&format!("{SQUARE}vt 1 1\nf 1/1/1 2/1/1 3/1/1\nf 1/-9 3/-1 4/2\nvn 0 0 nan"));
    let mesh = &model.meshes[0];
    assert_eq!((mesh.triangles.len(), mesh.normals.len(), mesh.uvs[0].len()), (2, 0, 5));
    let said: Vec<_> =
        model.warnings.iter().map(|w| (&w.place, w.message.contains("do not exist"))).collect();
    assert_eq!(said, [(&Place::Line(7), true), (&Place::Line(8), false)], "{:?}", model.warnings);
    let wrong = ok(&format!("{SQUARE}f 1//7 2//7 3//7\nf 1//-1 3 4"));
    assert!(wrong.meshes[0].normals.is_empty() && wrong.warnings[0].message.starts_with("2 passed over"));
}

#[test]
fn objects_beyond_the_thousandth_are_one_mesh() {
    let many: String = (0..1500).map(|i| format!("o {i}\nusemtl {}\nf 1 2 {}\n", i % 3, 3 + i % 2)).collect();
    let model = ok(&format!("{SQUARE}usemtl 0\n{many}"));
    assert_eq!((model.meshes.len(), model.meshes[0].name.as_str()), (1, "a"));
    let mesh = &model.meshes[0];
    let slots: Vec<u16> = (0..1500).map(|i| i % 3).collect();
    assert_eq!((mesh.triangles.len(), &mesh.slots), (1500, &slots));
    for (i, triangle) in mesh.triangles.iter().enumerate() {
        let last = mesh.positions[triangle[2] as usize];
        assert_eq!(last, if i % 2 == 0 { Vec3::new(1., 1., 0.) } else { Vec3::Y });
    }
    let few: String = (0..1000).map(|i| format!("o {i}\nf 1 2 3\n")).collect();
    assert_eq!(ok(&format!("{SQUARE}{few}")).meshes.len(), 1000);
}

#[test]
fn names_in_latin1_are_found_in_libraries_in_utf8() {
    let obj = [b"mtllib b.mtl\n", SQUARE.as_bytes(), b"usemtl Gl\xFCck\nf 1 2 3"].concat();
    let model =
        load_files(&[("a.obj", &obj), ("b.mtl", "newmtl Glück\nKd 0 1 0".as_bytes())]).expect("right");
    assert_eq!((model.warnings.len(), model.materials[0].name.as_str()), (0, "Glück"));
}

#[test]
fn meshes_get_tangents_where_a_material_needs_them() {
    let with = |mtl: &str| {
        let obj = format!(
            "mtllib b.mtl\n{SQUARE}vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nvn 0 0 1\nusemtl m\nf 1/1/1 2/2/1 3/3/1 4/4/1"
        );
        let mtl = format!("newmtl m\n{mtl}");
        let model = load_files(&[("a.obj", obj.as_bytes()), ("b.mtl", mtl.as_bytes())]).expect("it is right");
        model.meshes[0].tangents.clone()
    };
    assert!(with("Pr .5").is_empty());
    assert_eq!(with("Pr .5\naniso .5"), [glam::Vec4::new(1.0, 0.0, 0.0, 1.0); 4]);
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
    // An object without colours stays grey beside one that has them.
    let two =
        ok("v 0 0 0 1 0 0\nv 1 0 0 1 0 0\nv 0 1 0 1 0 0\nf 1 2 3\no b\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 4 5 6");
    assert!(two.meshes[1].colors.is_empty());
    assert_eq!(two.materials.iter().map(|m| m.vertex_colors).collect::<Vec<_>>(), [true, false]);
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
