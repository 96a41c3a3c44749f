//! Real OBJ files, whole and damaged: each is a model or a list of what is wrong, soon and without a panic.

mod samples;

use std::{
    fs,
    path::{Path, PathBuf},
    time::{Duration, Instant},
};

use rayo::{diagnostic::Diagnostic, import::obj, world::Model};
use samples::{files, samples};

const LONGEST: Duration = Duration::from_secs(5);
const MUTATIONS: usize = 2000;
/// Files up to this size are damaged: small enough for thousands of loads.
const SMALL: u64 = 4 << 10;

/// Loads `path`, and checks what holds for every file whatsoever.
fn load(path: &Path) -> Result<Model, Vec<Diagnostic>> {
    let start = Instant::now();
    let result = obj::load(path);
    assert!(start.elapsed() < LONGEST, "{} took {:?}", path.display(), start.elapsed());
    match &result {
        Ok(model) => check(model),
        Err(errors) => {
            assert!(!errors.is_empty() && errors.iter().all(|e| !e.message.is_empty()));
            assert!(errors.iter().all(|e| !e.message.contains("broke down")), "{errors:?}");
        }
    }
    result
}

fn check(model: &Model) {
    assert_eq!(model.meshes.len(), model.instances.len());
    for instance in &model.instances {
        let mesh = &model.meshes[instance.mesh.index()];
        let n = mesh.positions.len();
        assert!(!mesh.triangles.is_empty());
        assert!(mesh.triangles.iter().flatten().all(|&i| (i as usize) < n));
        assert!(mesh.positions.iter().all(|p| p.is_finite()));
        assert!(mesh.normals.iter().all(|v| (v.length() - 1.0).abs() < 1e-3));
        assert!(mesh.uvs[0].iter().all(|uv| uv.is_finite()));
        for length in [mesh.normals.len(), mesh.uvs[0].len(), mesh.colors.len()] {
            assert!(length == 0 || length == n);
        }
        assert!(mesh.slots.is_empty() || mesh.slots.len() == mesh.triangles.len());
        assert!(mesh.slots.iter().all(|&slot| usize::from(slot) < instance.materials.len()));
        assert!(!instance.materials.is_empty());
        assert!(instance.materials.iter().all(|id| id.index() < model.materials.len()));
    }
    assert!(model.textures.iter().all(|t| t.image.index() < model.images.len()));
}

#[test]
fn every_sample_is_a_model_or_an_error() {
    let Some(folder) = samples("obj") else { return };
    let (mut models, mut triangles, mut warnings, mut refused) = (0, 0, 0, 0);
    for path in files(&folder, &["obj"]) {
        let name = path.strip_prefix(&folder).unwrap_or(&path).display();
        match load(&path) {
            Ok(model) => {
                let here: usize = model.meshes.iter().map(|mesh| mesh.triangles.len()).sum();
                println!(
                    "{name}: {} meshes, {here} triangles, {} materials",
                    model.meshes.len(),
                    model.materials.len()
                );
                model.warnings.iter().for_each(|w| println!("    {:?}: {}", w.place, w.message));
                (models, triangles, warnings) =
                    (models + 1, triangles + here, warnings + model.warnings.len());
            }
            Err(errors) => {
                println!("{name}: refused");
                errors.iter().for_each(|e| println!("    {:?}: {}", e.place, e.message));
                refused += 1;
            }
        }
    }
    println!("{models} models, {triangles} triangles, {warnings} warnings; {refused} files refused");
    assert!(models > 30, "only {models} of the samples are models");
}

/// The bowl that we ship: closed shapes seen from outside, with the textures that its library names.
#[test]
fn our_own_model_is_whole() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("assets/fruit-bowl.obj");
    let model = load(&path).unwrap_or_else(|e| panic!("{e:?}"));
    assert_eq!(model.warnings, []);
    let names: Vec<_> = model.instances.iter().map(|i| i.name.as_str()).collect();
    assert_eq!(names, ["Bowl", "Pear_1", "Pear_2", "Pear_3", "Board"]);
    assert_eq!((model.materials.len(), model.images.len(), model.textures.len()), (4, 3, 3));
    for mesh in &model.meshes {
        let corner = |i: u32| (mesh.positions[i as usize], mesh.normals[i as usize]);
        let (mut volume, mut agree) = (0.0, 0);
        for &[a, b, c] in &mesh.triangles {
            let [(a, n), (b, _), (c, _)] = [a, b, c].map(corner);
            volume += a.dot(b.cross(c)) / 6.0;
            agree += usize::from((b - a).cross(c - a).dot(n) > 0.0);
        }
        assert!(volume > 0.0, "{} is inside out", mesh.name);
        assert!(agree * 100 > mesh.triangles.len() * 98, "{}: normals point inward", mesh.name);
    }
}

/// A little of everything, so that there is something to damage without the samples.
const OBJ_SEEDS: [&str; 3] = [
    "o a b\nv 0 0 0\nv 1 0 0 1 0 0.5\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 1 0\nvn 0 0 1\ns 1\nusemtl m\nf 1/1/1 2/2/1 3 4//1\nf -1 -2 -3\n",
    "# c\nv 0 0 0 \\\n1\nv 1e0 .5 -2.\nv 3 4 5 # six\r\ng x y\nusemtl n\ns off\nf 1 2 3 9\nl 1 2\np 1\nv 7 8 9\nv 7 8 8\nv 1 2 3\nv 9 9 9\nv 0 9 9\nv 9 0 9\n",
    "v 0 0 0\nv 4 0 0\nv 4 4 0\nv 0 4 0\nv 1 1 0\nv 1 3 0\nv 3 3 0\nv 3 1 0\nf 1 2 3 4 1 5 6 7 8 5\ncurv 1 2\n",
];
const MTL_SEEDS: [&str; 2] = [
    "newmtl m\nKd .5 .5 .5\nKs 1\nNs 200\nNi 1.5\nd 0.5\nTr 0.5\nTf 1 1 1\nillum 7\nKe 1 2 3\nmap_Kd -s 2 2 2 -o 1 -clamp on a.png\n",
    "newmtl n\nPr .5\nPm .5\nPs .1\nPc 1\nPcr .1\naniso .5\nanisor .25\nnorm -bm 2 n.png\nbump b.png -bm 1\nrefl r.png\nmap_RMA x\nmap_Ks -imfchan g k.png\n",
];

#[test]
fn damaged_files_do_no_harm() {
    let bytes = |texts: &[&str]| texts.iter().map(|text| text.as_bytes().to_vec()).collect::<Vec<_>>();
    let (mut objs, mut mtls) = (bytes(&OBJ_SEEDS), bytes(&MTL_SEEDS));
    if let Some(folder) = samples("obj") {
        let small = |path: &PathBuf| fs::metadata(path).is_ok_and(|m| m.len() <= SMALL);
        let read = |path: PathBuf| fs::read(path).expect("it can be read");
        objs.extend(files(&folder, &["obj"]).into_iter().filter(small).map(read));
        mtls.extend(files(&folder, &["mtl"]).into_iter().filter(small).map(read));
    }
    let place = tempfile::tempdir().expect("a folder for temporary files");
    let (obj, mtl) = (place.path().join("a.obj"), place.path().join("a.mtl"));
    let mut random = Random(0x7261_796F);
    let mut models = 0;
    for _ in 0..MUTATIONS {
        let mut bytes = b"mtllib a.mtl\n".to_vec();
        bytes.extend(random.damaged(&objs));
        fs::write(&obj, bytes).expect("it can be written");
        fs::write(&mtl, random.damaged(&mtls)).expect("it can be written");
        models += usize::from(load(&obj).is_ok());
    }
    println!("{models} of {MUTATIONS} damaged files are models still");
    assert!(models > MUTATIONS / 10, "too damaged to show anything: {models} models");
}

/// Short texts that would cost much if every word of them were taken seriously.
#[test]
fn files_made_to_take_long_do_not() {
    let place = tempfile::tempdir().expect("a folder for temporary files");
    let obj = place.path().join("a.obj");
    let mtl: String = (0..70_000).map(|i| format!("newmtl {i}\nmap_Kd {i}.png\n")).collect();
    fs::write(place.path().join("b.mtl"), mtl).expect("it can be written");
    let points = "v 0 0 0\nv 1 0 0\nv 1 1 0\n".to_owned();
    let spokes = |n: usize| (1..=n).map(|i| format!("vt {i} 0\nf 1/{i} 2/{i} 3/{i}\n")).collect::<String>();
    let saw = |n: usize| {
        let points: String = (0..n).map(|i| format!("v {i} {} 0\n", i * i % 7 + 1)).collect();
        let all: Vec<_> = (1..=n).map(|i| i.to_string()).collect();
        format!("{points}f {}\n", all.join(" "))
    };
    for text in [
        points.clone() + &spokes(200_000),
        points.clone() + "f" + &" 1 2 3 \\\n".repeat(500_000),
        points.clone() + &"o x\nusemtl a\nf 1 2 3\nusemtl b\nf 1 2 3\n".repeat(100_000),
        points.clone() + &(0..70_000).map(|i| format!("usemtl {i}\nf 1 2 3\n")).collect::<String>(),
        points.clone() + &(1..100_000).map(|i| format!("s {i}\nf 1 2 3\n")).collect::<String>(),
        saw(30_000),
        points.clone() + &(0..70_000).map(|i| format!("mtllib {i}.mtl\n")).collect::<String>() + "f 1 2 3",
        points
            + "mtllib b.mtl\n"
            + &(0..70_000).map(|i| format!("usemtl {i}\nf 1 2 3\n")).collect::<String>(),
    ] {
        fs::write(&obj, &text).expect("it can be written");
        let start = Instant::now();
        assert!(load(&obj).is_ok());
        println!("{:?} for {} bytes", start.elapsed(), text.len());
    }
}

/// SplitMix64.
struct Random(u64);

impl Random {
    fn below(&mut self, n: usize) -> usize {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((z ^ (z >> 31)) % n.max(1) as u64) as usize
    }

    /// One of `all` with one to four injuries: bytes changed, cut out, doubled, or replaced by what parsers dislike.
    fn damaged(&mut self, all: &[Vec<u8>]) -> Vec<u8> {
        const NASTY: [&[u8]; 16] = [
            b"-1",
            b"0",
            b"99999999999999999999",
            b"-9223372036854775808",
            b"nan",
            b"-inf",
            b"1e39",
            b"/",
            b"//",
            b"\\\n",
            b"#",
            b"\0",
            b"\xFF\xFE",
            b"\nf 1 2 3 4 5\n",
            b"\nusemtl \n",
            b"\no\n",
        ];
        let mut bytes = all[self.below(all.len())].clone();
        for _ in 0..=self.below(4) {
            let at = self.below(bytes.len());
            let end = (at + self.below(20)).min(bytes.len());
            match self.below(5) {
                0 if !bytes.is_empty() => bytes[at] = self.below(256) as u8,
                1 => drop(bytes.drain(at..end)),
                2 => bytes.extend_from_within(at..end),
                3 => drop(bytes.splice(at..end, NASTY[self.below(NASTY.len())].iter().copied())),
                _ => bytes.truncate(bytes.len() - self.below(bytes.len() / 4)),
            }
        }
        bytes
    }
}
