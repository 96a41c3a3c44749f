//! What is made of a file depends on nothing but the file.

use super::*;
use crate::world::Model;

/// Everything that refers to what came before: negative indices, vertices to come, materials, groups, colours, objects.
fn mixed() -> String {
    let mut text = String::from("mtllib none.mtl\n");
    for i in 0..60 {
        let (x, y) = (i % 8, i / 8);
        text += &format!("v {x} {y} {}{}\n", (i * i) % 5, if i == 17 { " 1 0 0.5" } else { "" });
        text += &format!("vt 0.{i} 0.5\nvn {} 1 0\n", i % 3);
        if i % 9 == 4 {
            text += &format!("usemtl m{}\ns {}\n", i % 4, i % 3);
        }
        if i % 20 == 19 {
            text += &format!("o part {i}\n# between \\\n");
        }
        if i > 3 && i < 45 {
            text +=
                ["f -1 -2 -3\n", "f -1/-1 -2/-2 \\\n -3/-3 -4/-4\n", "f -1/-1/-1 -2/-2/-2 1/1/1\n"][i % 3];
        }
        if i == 45 {
            text += "f 1 2 60\nf 1//1 2//2 3//60\n";
        }
        if i > 45 {
            text += "f -3//-3 -2//-2 -1//-1 1//1 5//5\nf 1 2 60\n";
        }
    }
    text
}

fn assert_same(a: &Model, b: &Model) {
    assert_eq!(a.meshes.len(), b.meshes.len());
    for (a, b) in a.meshes.iter().zip(&b.meshes) {
        assert_eq!((&a.name, &a.positions, &a.normals), (&b.name, &b.positions, &b.normals));
        assert_eq!((&a.uvs, &a.colors, &a.triangles, &a.slots), (&b.uvs, &b.colors, &b.triangles, &b.slots));
    }
    assert_eq!((&a.materials, &a.warnings), (&b.materials, &b.warnings));
}

#[test]
fn wherever_the_file_is_cut() {
    let folder = tempfile::tempdir().expect("a folder for temporary files");
    let path = folder.path().join("a.obj");
    std::fs::write(&path, mixed()).expect("it can be written");
    let whole = load(&path).unwrap_or_else(|e| panic!("{e:?}"));
    assert_eq!(whole.meshes.len(), 4);
    whole.meshes.iter().for_each(check);
    for size in [1, 2, 3, 17, 100, 1000] {
        assert_same(&read_in_pieces(&path, size).expect("it was read before"), &whole);
    }
}

#[test]
fn however_many_threads_read_it() {
    let folder = tempfile::tempdir().expect("a folder for temporary files");
    let path = folder.path().join("a.obj");
    std::fs::write(&path, mixed()).expect("it can be written");
    let read = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        pool.install(|| read_in_pieces(&path, 50)).expect("it is right")
    };
    let one = read(1);
    [2, 7].into_iter().for_each(|threads| assert_same(&read(threads), &one));
}

#[test]
fn errors_are_told_in_order_wherever_the_file_is_cut() {
    let folder = tempfile::tempdir().expect("a folder for temporary files");
    let path = folder.path().join("a.obj");
    let lines = (0..200).map(|i| ["v 0 0 0", "f 1 2 999", "v x", "f 0 0 0", "# \\", "l 1 2"][i % 6]);
    std::fs::write(&path, lines.collect::<Vec<_>>().join("\n")).expect("it can be written");
    let whole = load(&path).expect_err("it is wrong");
    let lines: Vec<_> = whole.iter().take(4).map(|error| error.place.clone()).collect();
    assert_eq!(lines, [2, 3, 4, 8].map(Place::Line));
    for size in [1, 30, 500] {
        assert_eq!(read_in_pieces(&path, size).expect_err("it is wrong"), whole);
    }
}
