//! Every sample glTF file, valid and invalid, through the importer: a model or an error, never a panic, and quickly.
//!
//! Figures of the known files were counted apart from the importer, from their JSON.

mod samples;

use std::{
    path::{Path, PathBuf},
    time::{Duration, Instant},
};

use glam::Vec3;
use rayo::{
    diagnostic::{Diagnostic, Place, Severity},
    import::{gltf, image},
    scene::Selection,
    world::{Model, Texels},
};
use samples::{files, samples};

const GLTF: [&str; 2] = ["gltf", "glb"];
const TIME_LIMIT: Duration = Duration::from_secs(5);

fn load_in_time(path: &Path) -> Result<Model, Vec<Diagnostic>> {
    let start = Instant::now();
    let result = gltf::load(path, &Selection::default());
    assert!(start.elapsed() < TIME_LIMIT, "{} took {:?}", path.display(), start.elapsed());
    match &result {
        Ok(model) => assert_sound(model, path),
        Err(diagnostics) => {
            let error = diagnostics.iter().find(|d| d.severity == Severity::Error);
            let error = error.unwrap_or_else(|| panic!("{} fails without an error", path.display()));
            assert!(!error.message.is_empty());
            assert!(!error.message.contains("the importer failed"), "{} panics", path.display());
        }
    }
    result
}

/// What the rest of the program relies on without looking.
fn assert_sound(model: &Model, path: &Path) {
    for mesh in &model.meshes {
        let n = mesh.positions.len();
        let optional = |len: usize| len == 0 || len == n;
        assert!(mesh.triangles.as_flattened().iter().all(|&v| (v as usize) < n), "{}", path.display());
        assert!(optional(mesh.normals.len()) && optional(mesh.tangents.len()) && optional(mesh.colors.len()));
        assert!(optional(mesh.uvs[0].len()) && optional(mesh.uvs[1].len()));
        assert!(
            mesh.normals.iter().all(|v| v.is_normalized()) && mesh.positions.iter().all(|p| p.is_finite())
        );
        assert!(mesh.tangents.iter().all(|t| t.truncate().is_normalized() && t.w.abs() == 1.0));
    }
    for instance in &model.instances {
        assert!(instance.mesh.index() < model.meshes.len() && instance.materials.len() == 1);
        assert!(
            instance.materials[0].index() < model.materials.len() && instance.to_world.inverse().is_finite()
        );
    }
    assert!(model.textures.iter().all(|t| t.image.index() < model.images.len()));
}

#[test]
fn every_sample_loads_or_says_why_not() {
    let Some(samples) = samples("gltf") else { return };
    let (mut loaded, mut refused) = (0, 0);
    for path in files(&samples, &GLTF) {
        match load_in_time(&path) {
            Ok(_) => loaded += 1,
            Err(diagnostics) => {
                refused += 1;
                println!("{}: {}", path.display(), diagnostics[0].message);
            }
        }
    }
    println!("{loaded} samples load, {refused} are refused");
}

/// Instances, triangles summed over instances, cameras, lights, decoded images.
const KNOWN: [(&str, [usize; 5]); 17] = [
    ("2CylinderEngine-glTF-Binary/2CylinderEngine.glb", [115, 121_496, 1, 0, 0]),
    ("BoxTextured-glTF/BoxTextured.gltf", [1, 12, 0, 0, 1]),
    ("BoxTextured-glTF-Embedded/BoxTextured.gltf", [1, 12, 0, 0, 1]),
    ("CornellBox.glb", [6, 36, 0, 0, 0]),
    ("DamagedHelmet.glb", [1, 15_452, 0, 0, 4]),
    ("FlightHelmet/FlightHelmet.gltf", [6, 94_722, 0, 0, 15]),
    ("Fox.glb", [1, 576, 0, 0, 1]),
    ("GolfBall.glb", [1, 356, 0, 0, 2]),
    ("Lights.glb", [1, 12, 1, 4, 0]),
    ("MorphPrimitivesTest/glTF/MorphPrimitivesTest.gltf", [2, 32, 0, 0, 1]),
    ("NormalTangentTest.glb", [1, 7_774, 0, 0, 3]),
    ("PrimitiveModeNormalsTest.glb", [9, 2_562, 0, 0, 1]),
    ("SpecularTest.glb", [24, 44_828, 0, 0, 4]),
    ("TwoSidedPlane.glb", [1, 2, 0, 0, 3]),
    ("cameras/Cameras.gltf", [1, 2, 2, 0, 0]),
    ("geometry-camera-light.glb", [2, 14, 2, 2, 0]),
    ("simple-instancing.glb", [125, 1_500, 0, 0, 0]),
];

#[test]
fn known_samples_hold_what_their_json_says() {
    let Some(samples) = samples("gltf") else { return };
    let mut wrong = Vec::new();
    for (name, expected) in KNOWN {
        let path = samples.join(name);
        let model = load_in_time(&path).unwrap_or_else(|e| panic!("{name}: {e:?}"));
        let triangles = model.instances.iter().map(|i| model.meshes[i.mesh.index()].triangles.len()).sum();
        let found =
            [model.instances.len(), triangles, model.cameras.len(), model.lights.len(), model.images.len()];
        if found != expected {
            wrong.push(format!("{name}: {found:?}, not {expected:?}"));
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

/// Animation, seconds, and the corners of the box around all vertices, as Blender 5.0 evaluates the same file at the same
/// time (+Y up again; its NLA strips begin at frame 1).
type Posed = (&'static str, &'static str, f32, [[f32; 3]; 2]);

const POSED: [Posed; 8] = [
    ("Fox.glb", "Run", 11.0 / 24.0, [[-13.2767, -0.4856, -94.8363], [13.927, 73.2285, 69.4714]]),
    ("Fox.glb", "Walk", 8.0 / 24.0, [[-12.7658, -0.3495, -91.3244], [12.4195, 74.8422, 70.0121]]),
    ("SimpleSkin/SimpleSkin.gltf", "0", 0.5, [[-1.0608, 0.0, 0.0], [0.5518, 2.0605, 0.0]]),
    ("SimpleSkin/SimpleSkin.gltf", "0", 4.0, [[-0.5, 0.0, 0.0], [1.0, 1.5, 0.0]]),
    ("SimpleMorph/glTF/SimpleMorph.gltf", "0", 1.0, [[0.0, 0.0, 0.0], [1.5, 1.5, 0.0]]),
    ("SimpleMorph/glTF/SimpleMorph.gltf", "0", 2.5, [[0.0, 0.0, 0.0], [1.0, 2.0, 0.0]]),
    ("AnimatedMorphCube/glTF/AnimatedMorphCube.gltf", "Square", 1.0, [[-1.0; 3], [1.0, 1.0, -0.2942]]),
    ("AnimatedMorphCube/glTF/AnimatedMorphCube.gltf", "Square", 2.0, [[-1.0; 3], [1.0, 1.0, -0.5251]]),
];

#[test]
fn poses_are_those_of_blender() {
    let Some(samples) = samples("gltf") else { return };
    for (name, animation, at, [low, high]) in POSED {
        let selection = Selection { animation: Some(animation.into()), at: Some(at), ..Selection::default() };
        let model = gltf::load(&samples.join(name), &selection).unwrap_or_else(|e| panic!("{name}: {e:?}"));
        assert_sound(&model, Path::new(name));
        let (mut least, mut most) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
        for instance in &model.instances {
            for p in &model.meshes[instance.mesh.index()].positions {
                let p = instance.to_world.transform_point3(*p);
                (least, most) = (least.min(p), most.max(p));
            }
        }
        let size = (Vec3::from(high) - Vec3::from(low)).length();
        let error = (least - Vec3::from(low)).abs().max((most - Vec3::from(high)).abs()).max_element();
        assert!(error < 5e-4 * size, "{name} at {at} s: {least} to {most}");
    }
}

/// The box as Draco and as meshopt: the same cube, within the precision that each keeps.
#[test]
fn encodings_hold_the_same_box() {
    let Some(samples) = samples("gltf") else { return };
    for name in ["BoxDraco.gltf", "BoxMeshopt.gltf", "BoxMeshopt.glb"] {
        let model = load_in_time(&samples.join("encodings").join(name)).unwrap_or_else(|e| panic!("{e:?}"));
        let [instance] = &model.instances[..] else { panic!("{name}: {:?}", model.instances) };
        let mesh = &model.meshes[instance.mesh.index()];
        assert_eq!((mesh.triangles.len(), mesh.positions.len()), (12, 24), "{name}");
        for (p, n) in mesh.positions.iter().zip(&mesh.normals) {
            let (p, n) = (instance.to_world.transform_point3(*p), instance.to_world.transform_vector3(*n));
            let n = n.normalize();
            assert!(p.abs().abs_diff_eq(Vec3::splat(0.5), 1e-4), "{name}: {p}");
            assert!(
                (n.abs().max_element() - 1.0).abs() < 1e-3 && (p.dot(n) - 0.5).abs() < 1e-3,
                "{name}: {n}"
            );
        }
    }
}

/// The same picture as ETC1S, UASTC and plain RGBA, and a WebP.
#[test]
fn encoded_textures_decode() {
    let Some(samples) = samples("gltf") else { return };
    let load = |name: &str| {
        let image = image::load(&samples.join("encodings").join(name)).unwrap_or_else(|e| panic!("{e:?}"));
        let Texels::Rgba8(texels) = image.texels else { panic!("{name} is not of 8 bits") };
        assert_eq!(texels.len(), image.width as usize * image.height as usize);
        assert!(texels.iter().any(|t| t[..3] != texels[0][..3]), "{name} is all of one colour");
        texels
    };
    for name in ["2d_etc1s.ktx2", "2d_uastc.ktx2", "2d_rgba8.ktx2", "test-lossy.webp"] {
        load(name);
    }
}

/// MikkTSpace as called here against the tangents that FlightHelmet brings, which Blender's exporter or its like made.
#[test]
fn generated_tangents_agree_with_given_ones() {
    let Some(samples) = samples("gltf") else { return };
    let path = samples.join("FlightHelmet/FlightHelmet.gltf");
    let given = load_in_time(&path).expect("a valid sample");
    let folder = tempfile::tempdir().expect("a temporary folder");
    let text = std::fs::read_to_string(&path).expect("a readable sample");
    for entry in std::fs::read_dir(path.parent().expect("a folder")).expect("a readable folder").flatten() {
        std::fs::copy(entry.path(), folder.path().join(entry.file_name())).expect("a copy");
    }
    let bare = folder.path().join("bare.gltf");
    std::fs::write(&bare, text.replace("\"TANGENT\"", "\"_TANGENT\"")).expect("a copy");
    let generated = load_in_time(&bare).expect("as valid as before");
    for (given, generated) in given.meshes.iter().zip(&generated.meshes) {
        let (mut near, mut same_side, mut corners) = (0, 0, 0);
        for (a, b) in given.triangles.as_flattened().iter().zip(generated.triangles.as_flattened()) {
            let (a, b) = (given.tangents[*a as usize], generated.tangents[*b as usize]);
            corners += 1;
            near += usize::from(a.truncate().dot(b.truncate()) > 0.95);
            same_side += usize::from(a.w == b.w);
        }
        println!("{}: of {corners} corners {near} tangents agree, {same_side} handednesses", given.name);
        assert!(near * 100 > corners * 95 && same_side * 100 > corners * 99, "{}", given.name);
    }
}

/// Files whose fault is told without the place that the validator gives, and why.
const NO_PLACE: [(&str, &str); 1] = [(
    "infinite_transform.gltf",
    "1e999 is no number of JSON's that fits, so there is no document to point into",
)];

/// The Khronos validator's files: what it calls an error is an error or a warning here too, at a place in its document that
/// is one of the validator's, or holds it, or is in it. What it calls valid is not refused.
#[test]
fn what_the_validator_finds_is_told() {
    let Some(samples) = samples("gltf-invalid") else { return };
    let [mut refused, mut warned, mut pointed, mut without_place] = [0, 0, 0, 0];
    let mut wrong = Vec::new();
    for path in files(&samples, &GLTF) {
        let result = load_in_time(&path);
        let report = PathBuf::from(format!("{}.report.json", path.display()));
        let Ok(report) = std::fs::read(report) else { continue };
        let report: serde_json::Value = serde_json::from_slice(&report).expect("JSON");
        let messages = report["issues"]["messages"].as_array().into_iter().flatten();
        let errors: Vec<_> = messages.filter(|message| message["severity"] == 0).collect();
        let told = match result {
            Err(diagnostics) if errors.is_empty() => {
                wrong.push(format!("{}: refused, though valid: {}", path.display(), diagnostics[0].message));
                continue;
            }
            Ok(_) if errors.is_empty() => continue,
            Err(diagnostics) => {
                refused += 1;
                diagnostics
            }
            Ok(model) => {
                warned += usize::from(!model.warnings.is_empty());
                model.warnings
            }
        };
        let places: Vec<&str> =
            errors.iter().filter_map(|e| e["pointer"].as_str()).filter(|p| p.len() > 1).collect();
        let is_listed = NO_PLACE.iter().any(|(name, _)| path.ends_with(name));
        if told.is_empty() {
            wrong.push(format!("{}: nothing is said, but there are {errors:?}", path.display()));
        } else if places.is_empty() || is_listed {
            without_place += 1;
        } else if told.iter().any(|d| places.iter().any(|place| is_same_or_inside(pointer(d), place))) {
            pointed += 1;
        } else {
            wrong.push(format!("{}: {told:?} is not at any of {places:?}", path.display()));
        }
    }
    println!(
        "with errors by the validator: {refused} refused, {warned} warned of; {pointed} at its place, {without_place} that have none"
    );
    assert!(wrong.is_empty(), "{wrong:#?}");
}

fn pointer(diagnostic: &Diagnostic) -> &str {
    match &diagnostic.place {
        Place::Pointer(pointer) => pointer,
        _ => "",
    }
}

/// Whether one pointer is the other, or the beginning of its path.
fn is_same_or_inside(a: &str, b: &str) -> bool {
    let (short, long) = if a.len() < b.len() { (a, b) } else { (b, a) };
    !short.is_empty() && long.strip_prefix(short).is_some_and(|rest| rest.is_empty() || rest.starts_with('/'))
}

/// Samples that the validator passes but for the two that it does not, and what is said of those and of ours.
#[test]
fn conforming_samples_break_no_rule() {
    let ours = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("assets");
    let samples = samples("gltf").map(|samples| files(&samples, &GLTF)).unwrap_or_default();
    for path in samples.into_iter().chain(files(&ours, &GLTF)) {
        let Ok(model) = load_in_time(&path) else { continue };
        // What the import leaves out of a valid file, and what a file does that is not valid.
        let expected = |d: &Diagnostic| match path.file_name().and_then(|name| name.to_str()) {
            Some("PrimitiveModeNormalsTest.glb") => d.message.contains("are not rendered"),
            Some("ClearCoatTest.gltf") => d.message.contains("asks for TANGENT"),
            _ => false,
        };
        let unexpected: Vec<_> = model.warnings.iter().filter(|d| !expected(d)).collect();
        assert!(unexpected.is_empty(), "{}: {unexpected:#?}", path.display());
    }
}
