//! The binary as people run it: flags, exit codes, files.

use std::{
    fs,
    io::Read,
    path::Path,
    process::{Command, Output, Stdio},
};

use assert_cmd::cargo::cargo_bin;
use tempfile::TempDir;

const SCENE: &str = r##"
[camera]
position = [0, 0, 5]
target = [0, 0, 0]
vfov = 40
[environment]
type = "gradient"
bottom = [1, 1, 1]
top = [0.5, 0.7, 1.0]
[materials.grey]
type = "diffuse"
color = [0.5, 0.5, 0.5]
[[sphere]]
center = [0, 0, 0]
radius = 1
material = "grey"
"##;

fn rayo() -> Command {
    Command::new(cargo_bin("rayo"))
}

/// A folder with `scene.toml` in it.
fn folder() -> TempDir {
    let folder = tempfile::tempdir().expect("folder");
    fs::write(folder.path().join("scene.toml"), SCENE).expect("written");
    folder
}

fn run(folder: &Path, arguments: &str) -> Output {
    rayo().current_dir(folder).args(arguments.split(' ')).output().expect("runs")
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

/// Panics unless the command failed with `code`, saying `message`, and left the folder as it was.
fn fails(folder: &Path, arguments: &str, code: i32, message: &str) {
    let before = names(folder);
    let output = run(folder, arguments);
    let said = text(&output.stderr);
    assert_eq!(output.status.code(), Some(code), "{arguments}: {said}");
    assert!(said.contains(message), "{arguments}: “{message}” is not in: {said}");
    assert!(!said.contains("panicked"), "{arguments}: {said}");
    assert!(output.stdout.is_empty());
    assert_eq!(names(folder), before, "{arguments}");
}

fn names(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).expect("folder");
    let mut names: Vec<_> =
        entries.map(|e| e.expect("entry").file_name().to_string_lossy().into_owned()).collect();
    names.sort();
    names
}

#[test]
fn help_and_version() {
    let folder = folder();
    for (arguments, expected) in [
        ("--help", "render"),
        ("render --help", "--crop <X,Y,W,H>"),
        ("schema --help", "JSON Schema"),
        ("compare --help", "--max-flip <X>"),
        ("--version", concat!("rayo ", env!("CARGO_PKG_VERSION"))),
    ] {
        let output = run(folder.path(), arguments);
        assert_eq!(output.status.code(), Some(0), "{arguments}");
        assert!(text(&output.stdout).contains(expected), "{arguments}: {}", text(&output.stdout));
    }
}

#[test]
fn bad_flags_exit_with_2() {
    let folder = folder();
    let at = folder.path();
    fails(at, "render scene.toml --nosie 0.1", 2, "--noise");
    fails(at, "render", 2, "FILE");
    fails(at, "rneder scene.toml", 2, "render");
    for (flag, message) in [
        ("--size 10", "1280x720"),
        ("--size 0x10", "from 1 to"),
        ("--size 60000x60000", "more than"),
        ("--samples 0", "1.."),
        ("--noise nan", "0.01"),
        ("--time 0s", "90s"),
        ("--threads 0", "from 1 to"),
        ("--seed -1", "--seed"),
        ("--seed 9223372036854775808", "9223372036854775807"),
        ("--crop 1,2,3", "100,50,640,360"),
        ("--size 100x100 --crop 90,90,11,10", "leaves the picture"),
        ("--exposure 1e9", "stops"),
        ("--view agx", "gamma2"),
    ] {
        fails(at, &format!("render scene.toml {flag}"), 2, message);
    }
}

#[test]
fn bad_input_exits_with_2() {
    let folder = folder();
    let at = folder.path();
    fs::write(at.join("picture.jpg"), "no scene").expect("written");
    fails(at, "render missing.toml", 2, "missing.toml");
    fails(at, "render missing.glb", 2, "missing.glb");
    fails(at, "render picture.jpg", 2, ".toml");
    fails(at, "render .", 2, ".toml");
}

#[test]
fn output_that_cannot_be_written_is_found_before_rendering() {
    let folder = folder();
    let at = folder.path();
    fs::create_dir(at.join("taken.png")).expect("folder");
    // So many samples that rendering first would take hours.
    let endless = "render scene.toml --samples 16000000";
    fails(at, &format!("{endless} -o picture.jpg"), 2, ".png or .exr or .hdr");
    fails(at, &format!("{endless} -o no/such/folder/a.png"), 2, "does not exist");
    fails(at, &format!("{endless} -o taken.png"), 2, "folder of that name");
    fails(at, &format!("{endless} --stats no/stats.json"), 2, "does not exist");
    fails(at, &format!("{endless} --stats scene.toml"), 2, ".json");
    #[cfg(target_os = "linux")]
    fails(at, &format!("{endless} -o /proc/a.png"), 2, "cannot write /proc/a.png");
}

#[test]
fn what_a_picture_is_made_of_is_never_overwritten() {
    let folder = folder();
    let at = folder.path();
    let refuses = |arguments: &str, file: &str| {
        let before = fs::read(at.join(file)).expect("there");
        let arguments = format!("render {arguments} --samples 1 --size 8x8");
        fails(at, &arguments, 2, "the picture is made of this file");
        assert!(fs::read(at.join(file)).expect("there") == before, "{arguments}");
    };
    let works = |arguments: &str| {
        let output = run(at, &format!("render {arguments} --samples 1 --size 8x8"));
        assert_eq!(output.status.code(), Some(0), "{arguments}: {}", text(&output.stderr));
    };
    for name in ["pear.png", "sky.png", "coin.png"] {
        image::RgbImage::from_pixel(2, 2, image::Rgb([90; 3])).save(at.join(name)).expect("written");
    }
    let write = |name: &str, text: &str| fs::write(at.join(name), text).expect("written");

    write("pear.mtl", "newmtl skin\nmap_Kd pear.png\n");
    write(
        "pear.obj",
        "mtllib pear.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nusemtl skin\nf 1/1 2/2 3/3\n",
    );
    refuses("pear.obj", "pear.png");
    refuses("pear.obj -o ./pear.png", "pear.png");
    works("pear.obj -o other.png");
    works("pear.obj -o other.png");

    write(
        "sky.toml",
        "[environment]\ntype = \"image\"\nfile = \"sky.png\"\n[[model]]\nfile = \"pear.obj\"\n",
    );
    refuses("sky.toml", "sky.png");
    refuses("sky.toml -o pear.png", "pear.png");
    works("sky.toml -o other.png");

    // A triangle of floats in a file whose name could be that of statistics.
    let corners: Vec<u8> =
        [0, 0, 0, 1, 0, 0, 0, 1, 0].iter().flat_map(|&x| (x as f32).to_le_bytes()).collect();
    fs::write(at.join("coin.json"), corners).expect("written");
    write(
        "coin.gltf",
        r#"{"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3",
        "min": [0, 0, 0], "max": [1, 1, 0]}], "bufferViews": [{"buffer": 0, "byteLength": 36}],
        "buffers": [{"byteLength": 36, "uri": "coin.json"}], "images": [{"uri": "coin.png"}]}"#,
    );
    refuses("coin.gltf -o other.png --stats coin.json", "coin.json");
    refuses("coin.gltf", "coin.png");
    works("coin.gltf -o other.png --stats stats.json");
    #[cfg(unix)]
    {
        std::os::unix::fs::symlink("pear.png", at.join("link.png")).expect("link");
        refuses("pear.obj -o link.png", "pear.png");
    }
}

#[test]
fn a_scene_becomes_a_picture_and_statistics() {
    let folder = folder();
    let at = folder.path();
    let flags =
        "--size 48x32 --crop 8,4,20,10 --samples 4 --seed 7 --bounces 3 --threads 2 --stats stats.json";
    let output = run(at, &format!("render scene.toml -o picture.png {flags}"));
    let said = text(&output.stderr);
    assert_eq!(output.status.code(), Some(0), "{said}");
    assert!(said.contains("wrote picture.png: 20 × 10, 4 samples per pixel"), "{said}");
    assert_eq!(said.trim_end().lines().count(), 1, "{said}");
    assert_eq!(names(at), ["picture.png", "scene.toml", "stats.json"]);
    let picture = image::open(at.join("picture.png")).expect("decodes");
    assert_eq!((picture.width(), picture.height()), (20, 10));
    let stats: serde_json::Value =
        serde_json::from_slice(&fs::read(at.join("stats.json")).expect("written")).expect("JSON");
    assert_eq!(stats["settings"]["seed"], 7);
    assert_eq!(stats["settings"]["bounces"]["total"], 3);
    assert_eq!(stats["samples"]["per_pixel_max"], 4);
    assert_eq!(stats["rays"]["camera"], 800);
}

/// A sphere that shines, alone and without a camera: framed for the scene's narrow picture it would be small in a wide one.
#[test]
fn size_on_the_command_line_is_framed() {
    let folder = folder();
    let at = folder.path();
    let scene = "[render]\nsize = [8, 80]\n[environment]\ntype = \"color\"\ncolor = 0\n[materials.lamp]\ntype = \"emissive\"\n\
                 color = 1\n[[sphere]]\ncenter = [0, 0, 0]\nradius = 1\nmaterial = \"lamp\"\n";
    fs::write(at.join("lamp.toml"), scene).expect("written");
    let output = run(at, "render lamp.toml -o lamp.png --size 60x30 --samples 2");
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    let picture = image::open(at.join("lamp.png")).expect("decodes").into_luma8();
    let lit = (0..30).filter(|&y| picture.get_pixel(30, y).0[0] > 128).count();
    assert!((24..=29).contains(&lit), "{lit} of 30 rows are lit");
}

#[test]
fn quiet_is_quiet_and_every_format_is_written() {
    let folder = folder();
    let at = folder.path();
    for file in ["a.png", "b.exr", "c.HDR"] {
        let output = run(at, &format!("render scene.toml -q --size 16x8 --samples 2 -o {file}"));
        assert_eq!(output.status.code(), Some(0));
        assert_eq!(text(&output.stderr), "");
    }
    assert_eq!(names(at), ["a.png", "b.exr", "c.HDR", "scene.toml"]);
}

#[test]
fn files_are_the_same_for_any_number_of_threads() {
    let folder = folder();
    let at = folder.path();
    let files = ["1", "2", "7"].map(|n| {
        let flags = "--size 70x40 --samples 8 --noise 0.05 -o a.exr";
        assert!(run(at, &format!("render scene.toml --threads {n} {flags}")).status.success());
        fs::read(at.join("a.exr")).expect("written")
    });
    assert!(files[0] == files[1] && files[0] == files[2]);
}

/// Renders of the scene by name, flags appended.
fn renders(at: &Path, pictures: &[(&str, &str)]) {
    for (file, flags) in pictures {
        let output = run(at, &format!("render scene.toml -q --size 48x32 -o {file} {flags}"));
        assert!(output.status.success(), "{file}: {}", text(&output.stderr));
    }
}

#[test]
fn pictures_are_compared_and_gates_close() {
    let folder = folder();
    let at = folder.path();
    renders(at, &[("a.exr", "--samples 16"), ("b.exr", "--samples 16 --seed 1"), ("c.png", "--samples 16")]);
    let output = run(at, "compare a.exr b.exr c.png --json out.json --report page/new");
    let (table, said) = (text(&output.stdout), text(&output.stderr));
    assert_eq!(output.status.code(), Some(0), "{said}");
    assert!(
        table.contains("reference: a.exr, 48 × 32") && table.contains("c.png: display-referred, 8 bits"),
        "{table}"
    );
    let lines: Vec<&str> =
        table.lines().filter(|line| line.contains("LDR-FLIP") || line.starts_with("b.exr ")).collect();
    assert!(lines.len() == 2 && lines[0].chars().count() == lines[1].chars().count(), "{table}");
    assert!(said.contains("wrote page/new/index.html") && at.join("page/new/index.html").is_file(), "{said}");
    let json: serde_json::Value =
        serde_json::from_slice(&fs::read(at.join("out.json")).expect("written")).expect("JSON");
    assert_eq!(
        (&json["images"][0]["file"], &json["images"][0]["welch"]),
        (&"b.exr".into(), &serde_json::Value::Null)
    );
    let number = |key: &str| json["images"][0][key].as_f64().expect("number");
    assert!((number("mean_ratio") - 1.0).abs() < 0.01 && number("ldr_flip") > 0.0 && number("psnr") > 20.0);

    let off = (number("mean_ratio") - 1.0).abs();
    for (flag, value) in
        [("--max-flip", number("ldr_flip")), ("--max-mean", off), ("--max-block", number("block_median"))]
    {
        let passes = run(at, &format!("compare a.exr b.exr {flag} {:.9}", value * 1.001));
        assert_eq!(passes.status.code(), Some(0), "{flag}: {}", text(&passes.stderr));
        let fails = run(at, &format!("compare a.exr b.exr {flag} {:.9}", value * 0.999));
        let said = text(&fails.stderr);
        assert_eq!(fails.status.code(), Some(1), "{flag}: {said}");
        assert!(said.contains("failed: b.exr") && said.contains(flag) && !fails.stdout.is_empty(), "{said}");
    }
    // A picture equals itself, and every limit admits that.
    let same = run(at, "compare a.exr a.exr --max-flip 0 --max-mean 0 --max-block 0");
    assert_eq!(same.status.code(), Some(0), "{}", text(&same.stderr));
}

#[test]
fn what_cannot_be_compared_exits_with_2() {
    let folder = folder();
    let at = folder.path();
    renders(
        at,
        &[
            ("a.exr", "--samples 1"),
            ("small.exr", "--samples 1 --size 24x16"),
            ("wide.png", "--samples 1 --size 50x32"),
        ],
    );
    fs::write(at.join("text.exr"), "no picture").expect("written");
    fs::write(at.join("file"), "in the way").expect("written");
    for (arguments, message) in [
        ("a.exr small.exr", "small.exr against a.exr: 24 × 16 pixels cannot be compared with 48 × 32"),
        ("a.exr small.exr wide.png", "wide.png against a.exr"),
        ("a.exr missing.exr text.exr", "cannot read missing.exr"),
        ("a.exr missing.exr text.exr", "cannot read text.exr"),
        ("a.exr", "IMAGE"),
        ("a.exr a.exr --max-flip x", "0.03"),
        ("a.exr a.exr --max-mean -1", "--max-mean"),
        ("a.exr a.exr --json a.txt", ".json"),
        ("a.exr a.exr --report file", "cannot make the folder file"),
    ] {
        fails(at, &format!("compare {arguments}"), 2, message);
    }
}

/// Two seeds of one scene are the same but for noise, one percent more light is not; and only EXR holds variance.
#[test]
fn variance_tells_noise_from_difference() {
    let folder = folder();
    let at = folder.path();
    let brighter =
        SCENE.replace("[1, 1, 1]", "[1.01, 1.01, 1.01]").replace("[0.5, 0.7, 1.0]", "[0.505, 0.707, 1.01]");
    fs::write(at.join("brighter.toml"), brighter + "[output]\nfile = \"c.exr\"\nvariance = true\n")
        .expect("written");
    let flags = "--samples 256 --variance";
    renders(at, &[("a.exr", flags), ("b.exr", &format!("{flags} --seed 1")), ("plain.exr", "--samples 256")]);
    let output = run(at, "render brighter.toml -q --size 48x32 --samples 256 --seed 2");
    assert!(output.status.success(), "{}", text(&output.stderr));
    let output = run(at, "compare a.exr b.exr c.exr plain.exr --json out.json");
    let table = text(&output.stdout);
    assert!(table.contains("b.exr: Welch test") && table.contains("no difference beyond noise"), "{table}");
    let json: serde_json::Value =
        serde_json::from_slice(&fs::read(at.join("out.json")).expect("written")).expect("JSON");
    let agrees = |i: usize| json["images"][i]["welch"]["agrees"].as_bool();
    assert_eq!((agrees(0), agrees(1), agrees(2)), (Some(true), Some(false), None), "{table}");

    fails(at, "render scene.toml --variance -o a.png", 2, "cannot hold the variance");
    fails(at, "render scene.toml --variance -o a.hdr", 2, "cannot hold the variance");
    fails(at, "render brighter.toml -o a.png", 2, "cannot hold the variance");
}

#[test]
fn a_time_budget_is_kept() {
    let folder = folder();
    let flags = "--size 64x64 --samples 10000000 --time 1s -o a.png";
    let output = run(folder.path(), &format!("render scene.toml {flags}"));
    assert_eq!(output.status.code(), Some(0));
    assert!(text(&output.stderr).contains("time is up"), "{}", text(&output.stderr));
}

#[test]
fn schema_is_json_and_a_closed_pipe_is_no_failure() {
    let folder = folder();
    let output = run(folder.path(), "schema");
    assert_eq!(output.status.code(), Some(0));
    let schema: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
    assert!(schema.is_object());
    for arguments in [["schema", "--help"].as_slice(), &["schema"], &["--help"]] {
        let mut child =
            rayo().args(arguments).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("runs");
        drop(child.stdout.take());
        let mut said = String::new();
        child.stderr.take().expect("piped").read_to_string(&mut said).expect("text");
        assert_eq!((child.wait().expect("ends").code(), said.as_str()), (Some(0), ""));
    }
}

#[cfg(unix)]
mod interrupts {
    use super::*;
    use std::{
        process::Child,
        thread::sleep,
        time::{Duration, Instant},
    };

    /// Starts an endless render and waits until it is under way.
    fn start(at: &Path) -> Child {
        let flags = "render scene.toml -o picture.png --size 64x64 --samples 16000000 --threads 2";
        let child =
            rayo().current_dir(at).args(flags.split(' ')).stderr(Stdio::piped()).spawn().expect("runs");
        sleep(Duration::from_millis(700));
        child
    }

    fn press(child: &Child) {
        let status = Command::new("kill").args(["-INT", &child.id().to_string()]).status();
        assert!(status.expect("kill runs").success());
    }

    fn end(mut child: Child) -> (Option<i32>, String) {
        let limit = Instant::now() + Duration::from_secs(20);
        while child.try_wait().expect("waits").is_none() {
            if Instant::now() > limit {
                child.kill().expect("kills");
                panic!("did not stop");
            }
            sleep(Duration::from_millis(10));
        }
        let output = child.wait_with_output().expect("ended");
        (output.status.code(), text(&output.stderr))
    }

    #[test]
    fn once_writes_what_there_is() {
        let folder = folder();
        let child = start(folder.path());
        press(&child);
        let (code, said) = end(child);
        assert_eq!(code, Some(1), "{said}");
        assert!(said.contains("writing what there is") && said.contains("interrupted"), "{said}");
        assert!(said.contains("wrote picture.png"), "{said}");
        assert_eq!(names(folder.path()), ["picture.png", "scene.toml"]);
        assert!(image::open(folder.path().join("picture.png")).is_ok());
    }

    #[test]
    fn twice_leaves_the_old_picture_or_the_new() {
        let folder = folder();
        fs::write(folder.path().join("picture.png"), "old").expect("written");
        let child = start(folder.path());
        press(&child);
        press(&child);
        let (code, said) = end(child);
        assert_eq!(code, Some(1), "{said}");
        assert_eq!(names(folder.path()), ["picture.png", "scene.toml"]);
        let picture = fs::read(folder.path().join("picture.png")).expect("there");
        assert!(picture == b"old" || image::load_from_memory(&picture).is_ok());
    }
}

/// A degenerate triangle among good ones: one warning that counts it. None but degenerate ones: nothing to be seen.
#[test]
fn degenerate_triangles_are_counted_in_a_warning() {
    let folder = folder();
    let render = |name: &str, faces: &str| {
        let text = format!("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 2 0 0\n{faces}");
        fs::write(folder.path().join(name), text).expect("written");
        rayo()
            .args(["render", name, "--size", "16x12", "--samples", "1"])
            .current_dir(folder.path())
            .output()
            .expect("runs")
    };
    let output = render("one.obj", "f 1 2 3\nf 1 2 4\nf 2 2 2\n");
    let told = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success() && told.contains("warning: 2 triangles"), "{told}");
}

/// A triangle that moves up, seen by a camera called "Eye" on a node called "Stand".
fn moving(folder: &Path) {
    let numbers = [0f32, 0., 0., 1., 0., 0., 0., 1., 0., 0., 1., 0., 0., 0., 0., 2., 0.];
    let bytes: Vec<u8> = numbers.iter().flat_map(|n| n.to_le_bytes()).collect();
    fs::write(folder.join("moving.bin"), &bytes).expect("written");
    let json = r#"{
        "asset": { "version": "2.0" }, "extensionsUsed": ["KHR_xmp_json_ld", "KHR_mesh_quantization"],
        "scenes": [{ "nodes": [0, 1] }],
        "nodes": [{ "mesh": 0 }, { "camera": 0, "name": "Stand", "translation": [0, 0, 5] }],
        "cameras": [{ "name": "Eye", "type": "perspective", "perspective": { "yfov": 1, "znear": 0.1 } }],
        "meshes": [{ "name": "wing", "primitives": [{ "attributes": { "POSITION": 0 } }] }],
        "buffers": [{ "byteLength": 68, "uri": "moving.bin" }],
        "bufferViews": [{ "buffer": 0, "byteLength": 68 }],
        "accessors": [
            { "bufferView": 0, "componentType": 5126, "type": "VEC3", "count": 3 },
            { "bufferView": 0, "byteOffset": 36, "componentType": 5126, "type": "SCALAR", "count": 2 },
            { "bufferView": 0, "byteOffset": 44, "componentType": 5126, "type": "VEC3", "count": 2 }
        ],
        "animations": [{ "name": "Rise", "channels": [{ "sampler": 0, "target": { "node": 0, "path": "translation" } }],
            "samplers": [{ "input": 1, "output": 2 }] }]
    }"#;
    fs::write(folder.join("moving.gltf"), json).expect("written");
}

#[test]
fn what_of_a_model_is_shown() {
    let folder = folder();
    let folder = folder.path();
    moving(folder);
    let picture = |flags: &str| {
        let output = run(folder, &format!("render moving.gltf --size 32x24 --samples 2 -q -o p.png{flags}"));
        assert!(output.status.success(), "{flags}: {}", text(&output.stderr));
        fs::read(folder.join("p.png")).expect("is there")
    };
    let rest = picture("");
    assert_eq!(rest, picture(" --animation Rise"));
    assert_eq!(rest, picture(" --camera Stand --scene 0 --at -1"));
    assert_ne!(rest, picture(" --at 0.5"));
    assert_eq!(picture(" --at 1"), picture(" --animation Rise --at 7s"));
    fails(folder, "render moving.gltf -o q.png --animation Rize", 2, "did you mean `Rise`?");
    fails(folder, "render moving.gltf -o q.png --camera Eve", 2, "did you mean `Eye`?");
    fails(folder, "render moving.gltf -o q.png --scene 1", 2, "no scene called");
    fails(folder, "render scene.toml -o q.png --animation Rise", 2, "[[model]]");
    fails(folder, "render scene.toml -o q.png --at 1", 2, "no model of this scene is animated");
}

#[test]
fn info_tells_what_a_model_holds() {
    let folder = folder();
    let folder = folder.path();
    moving(folder);
    let output = run(folder, "info moving.gltf");
    let told = text(&output.stdout);
    assert!(output.status.success(), "{}", text(&output.stderr));
    for part in
        ["wing: 1 triangles", "Rise: 0 s to 1 s, 1 channels", "Eye: perspective", "KHR_xmp_json_ld: ignored"]
    {
        assert!(told.contains(part), "{part} is not in: {told}");
    }
    let json: serde_json::Value =
        serde_json::from_slice(&run(folder, "info moving.gltf --json").stdout).expect("JSON");
    assert_eq!((&json["shown"]["triangles"], &json["animations"][0]["end"]), (&1.into(), &1.0.into()));
    let extensions = json["extensions"].as_array().expect("a list");
    let state = |name: &str| extensions.iter().find(|e| e["name"] == name).map(|e| e["supported"].clone());
    assert_eq!(state("KHR_mesh_quantization"), Some(true.into()));
    assert_eq!(state("KHR_xmp_json_ld"), Some(false.into()));
    fails(folder, "info scene.toml", 2, "not a kind of model");
    fails(folder, "info nothing.glb", 2, "no such file");
}

/// The picture is the same without a cache, with an empty, a full and a broken one, and with one that two processes fill.
#[test]
fn a_cache_changes_nothing_but_the_time() {
    let folder = folder();
    let noise = |x: u32, y: u32| {
        let bits = (x.wrapping_mul(0x9E37_79B1) ^ y.wrapping_mul(0x85EB_CA6B)).wrapping_mul(0xC2B2_AE35);
        image::Rgb([(bits >> 8) as u8, (bits >> 16) as u8, (bits >> 24) as u8])
    };
    image::RgbImage::from_fn(128, 64, noise).save(folder.path().join("sky.png")).expect("written");
    let scene = SCENE.replace("type = \"gradient\"", "type = \"image\"\nfile = \"sky.png\"");
    let scene = scene.lines().filter(|line| !line.starts_with("bottom") && !line.starts_with("top"));
    fs::write(folder.path().join("scene.toml"), scene.collect::<Vec<_>>().join("\n")).expect("written");
    let render = |flags: &str| {
        let output =
            run(folder.path(), &format!("render scene.toml -q -o a.exr --size 8x8 --samples 2{flags}"));
        assert!(output.status.success(), "{}", text(&output.stderr));
        fs::read(folder.path().join("a.exr")).expect("written")
    };
    let entry = || {
        let mut files = fs::read_dir(folder.path().join("kept")).expect("a folder");
        let file = files.next().expect("one entry").expect("read").path();
        assert!(files.next().is_none());
        file
    };
    let plain = render("");
    assert_eq!(render(" --cache kept"), plain);
    let whole = fs::read(entry()).expect("read");
    assert_eq!(whole.len(), 16 + 128 * 64 * 4 + 32);
    assert_eq!(render(" --cache kept"), plain);

    let mut flipped = whole.clone();
    flipped[4321] ^= 4;
    let broken: [&[u8]; 5] = [&[], &whole[..7], &whole[..whole.len() / 2], &flipped, &[255; 100_000]];
    for bytes in broken {
        fs::write(entry(), bytes).expect("written");
        assert_eq!(render(" --cache kept"), plain);
        assert!(fs::read(entry()).expect("read") == whole, "written anew");
    }
    // Two at once.
    fs::remove_dir_all(folder.path().join("kept")).expect("removed");
    let start = |name: &str| {
        let flags = format!("render scene.toml -q -o {name} --size 8x8 --samples 2 --cache kept");
        rayo().current_dir(folder.path()).args(flags.split(' ')).spawn().expect("runs")
    };
    for (mut process, name) in ["b.exr", "c.exr"].map(|name| (start(name), name)) {
        assert!(process.wait().expect("ends").success());
        assert_eq!(fs::read(folder.path().join(name)).expect("written"), plain);
    }
    assert!(fs::read(entry()).expect("read") == whole);
    // A file in the folder's place.
    fails(folder.path(), "render scene.toml -q -o a.exr --cache scene.toml", 2, "cannot keep anything in");
}
