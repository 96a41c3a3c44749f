use std::path::Path;

use super::{errors, position};
use crate::{
    diagnostic::render,
    scene::{load, parse},
};

/// Line, column, part of the message or help.
type Expected = (usize, usize, &'static str);

/// These errors and no others, in this order.
const CASES: &[(&str, &[Expected])] = &[
    // Keys and types.
    ("[render]\nsampels = 1\n", &[(2, 1, "did you mean `samples`?")]),
    ("[rendr]\n", &[(1, 2, "did you mean `render`?")]),
    ("vfov = 20\n", &[(1, 1, "unknown key `vfov`")]),
    (
        "[render]\nsamples = \"many\"\nseed = -1\n",
        &[(2, 11, "a whole number, not a string"), (3, 8, "0 or more")],
    ),
    ("[render]\nsamples = 1.5\n", &[(2, 11, "a whole number, not 1.5")]),
    ("[[render]]\n", &[(1, 1, "single brackets")]),
    ("[sphere]\n", &[(1, 1, "write `[[sphere]]`")]),
    ("render = 3\n", &[(1, 10, "must be a table")]),
    ("materials = 3\n", &[(1, 13, "a table of names")]),
    ("sphere = [1]\n", &[(1, 11, "must be a table")]),
    // [render]
    ("[render]\nsize = [0, 720]\n", &[(2, 8, "1 to 65536")]),
    ("[render]\nsize = [65537, 1]\n", &[(2, 8, "1 to 65536")]),
    ("[render]\nsize = [65536, 65536]\n", &[(2, 8, "pixels in all")]),
    ("[render]\nsize = [1, 2, 3]\n", &[(2, 8, "two whole numbers: width and height, not 3 of them")]),
    ("[render]\nsamples = 0\n", &[(2, 11, "at least 1")]),
    ("[render]\nsamples = 99999999999999999999\n", &[(2, 11, "at most")]),
    ("[render]\nnoise = nan\nbounces = 5000\n", &[(2, 9, "nan"), (3, 11, "at most 1024")]),
    ("[render]\nnoise = inf\n", &[(2, 9, "infinite")]),
    ("[render]\nbounces = { totl = 1, diffuse = -1 }\n", &[(2, 13, "`total`"), (2, 33, "`diffuse`")]),
    ("[render]\ntime = \"5 parsecs\"\n", &[(2, 8, "such as \"90s\"")]),
    ("[render]\ntime = 0\n", &[(2, 8, "longer than 0")]),
    ("[render]\nfilter = \"bos\"\n", &[(2, 10, "did you mean `box`?")]),
    ("[render]\nfilter = { width = 0 }\n", &[(2, 20, "greater than 0")]),
    ("[render]\nsize = [10, 10]\ncrop = [5, 5, 6, 1]\n", &[(3, 8, "beyond the picture")]),
    ("[render]\ncrop = [5, 5, 0, 1]\n", &[(2, 8, "one pixel")]),
    ("[render]\nthreads = 0\n", &[(2, 11, "at least 1")]),
    // [camera]
    ("[camera]\nposition = [0, 0, 0]\n", &[(2, 12, "the same point")]),
    (
        "[camera]\nposition = [1, 2, 3]\ntarget = [1, 2, 3]\nup = [0, 0, 0]\nvfov = 180\n",
        &[(3, 10, "the same point"), (4, 6, "zero length"), (5, 8, "less than 180")],
    ),
    ("[camera]\nposition = [0, 5, 0]\n", &[(2, 12, "`up` is parallel")]),
    ("[camera]\nposition = [0, 5, 0]\nup = [0, 3, 0]\n", &[(3, 6, "[0, 0, -1]")]),
    ("[camera]\nvfov = 0\n", &[(2, 8, "greater than 0")]),
    ("[camera]\nvfov = 30\nfocal_length = 50\n", &[(3, 1, "exclude each other")]),
    ("[camera]\naperture = 0.1\nfstop = 2\n", &[(3, 1, "exclude each other")]),
    ("[camera]\naperture = -0.1\nfocus = 0\n", &[(2, 12, "at least 0"), (3, 9, "greater than 0")]),
    ("[camera]\northo_height = 1\nfstop = 2\n", &[(3, 1, "orthographic")]),
    ("[camera]\ntarget = [0, 1, 0]\n", &[(2, 1, "`target` without `position`")]),
    ("[camera]\nimported = \"Cam\"\nvfov = 20\n", &[(2, 12, "no [[model]]"), (3, 1, "says already")]),
    ("[camera]\nimported = true\n", &[(2, 12, "no [[model]]")]),
    ("[render]\nseed = -1\n[camera]\nimported = true\n", &[(2, 8, "0 or more"), (4, 12, "no [[model]]")]),
    (
        "[camera]\nimported = true\n[[model]]\nfile = \"a.glb\"\nscale = 0\n",
        &[(4, 8, "there is no file"), (5, 9, "other than 0")],
    ),
    ("[camera]\nimported = false\n", &[(2, 12, "leave it out")]),
    ("[camera]\nposition = [1e300, 0, 0]\n", &[(2, 13, "between")]),
    (
        "[camera]\nposition = [1979-05-27, \"a\", true]\n",
        &[(2, 13, "a date"), (2, 25, "a string"), (2, 30, "true")],
    ),
    // [environment]
    ("[environment]\n", &[(1, 1, "`type` is missing")]),
    ("[environment]\ntype = \"sky\"\n", &[(2, 8, "not there yet")]),
    ("[environment]\ntype = \"gradiant\"\n", &[(2, 8, "did you mean `gradient`?")]),
    (
        "[environment]\ntype = \"color\"\nbottom = 1\nstrength = -1\n",
        &[(3, 1, "color, strength"), (4, 12, "at least 0")],
    ),
    ("[environment]\ntype = \"image\"\n", &[(1, 1, "`file` is missing")]),
    ("[environment]\ntype = \"image\"\nfile = \"sky.hdr\"\n", &[(3, 8, "there is no file `sky.hdr`")]),
    // [materials]
    ("[materials.a]\ntype = \"metl\"\n", &[(2, 8, "did you mean `metal`?")]),
    ("[materials.a]\ntype = 1\n", &[(2, 8, "one of \"diffuse\"")]),
    ("[materials.a]\ncolor = 1\n", &[(1, 1, "`type` is missing")]),
    ("[materials]\na = 1\n", &[(2, 5, "must be a table")]),
    (
        "[materials.a]\ntype = \"diffuse\"\ncolor = [1, -2, \"x\"]\nfuzz = 1\n",
        &[(3, 13, "negative"), (3, 17, "a string"), (4, 1, "the keys of type \"diffuse\" are: color")],
    ),
    ("[materials.a]\ntype = \"diffuse\"\ncolor = \"#12345\"\n", &[(3, 9, "#rrggbb")]),
    ("[materials.a]\ntype = \"diffuse\"\ncolor = true\n", &[(3, 9, "#rrggbb")]),
    (
        "[materials.a]\ntype = \"diffuse\"\ncolor = { image = \"wood.png\", wrap = \"tile\" }\n",
        &[(3, 19, "there is no file"), (3, 38, "\"clamp\"")],
    ),
    (
        "[materials.a]\ntype = \"metal\"\nfuzz = 2\nroughness = 0.5\n",
        &[(3, 8, "at most 1"), (4, 1, "exclude")],
    ),
    (
        "[materials.a]\ntype = \"dielectric\"\nior = 0\nfresnel = \"constant\"\n",
        &[(3, 7, "greater than 0"), (4, 11, "\"exact\"")],
    ),
    ("[materials.a]\ntype = \"emissive\"\nstrength = -1\n", &[(3, 12, "at least 0")]),
    (
        "[materials.a]\ntype = \"pbr\"\nmetallic = 2\nnormal = { scale = 1 }\n",
        &[(3, 12, "at most 1"), (4, 10, "`image` is missing")],
    ),
    (
        "[materials.a]\ntype = \"pbr\"\nclearcoat = 1\nsheen = { roughnes = 1 }\ntransmision = 1\n",
        &[
            (3, 13, "must be a table"),
            (4, 11, "did you mean `roughness`?"),
            (5, 1, "did you mean `transmission`?"),
        ],
    ),
    (
        "[materials.a]\ntype = \"pbr\"\ntransmission = 2\nvolume = { attenuation_color = 2, attenuation_distance = 0 }\nabbe_number = 0.5\n",
        &[(3, 16, "at most 1"), (4, 32, "at most 1"), (4, 58, "greater than 0"), (5, 15, "at least 1")],
    ),
    (
        "[materials.a]\ntype = \"pbr\"\niridescence = { ior = 0.9, thickness = -1 }\nanisotropy = { strength = 2, rotation = 400 }\n",
        &[(3, 23, "at least 1"), (3, 40, "at least 0"), (4, 27, "at most 1"), (4, 41, "at most 360")],
    ),
    (
        "[materials.a.specular]\nfactor = -1\n[materials.a]\ntype = \"pbr\"\nclearcoat = { normal = {} }\n",
        &[(2, 10, "at least 0"), (5, 24, "`image` is missing")],
    ),
    // Shapes.
    ("[[sphere]]\nradius = -1\nmaterial = \"a\"\n", &[(2, 10, "greater than 0"), (3, 12, "[materials.a]")]),
    ("[[sphere]]\nradius = 0\n", &[(1, 1, "`material` is missing"), (2, 10, "greater than 0")]),
    (
        "[[sphere]]\nradius = 1e-30\nmatrial = \"a\"\n",
        &[(2, 10, "beyond"), (3, 1, "did you mean `material`?")],
    ),
    (
        "[materials.gold]\ntype = \"metal\"\n[[sphere]]\nmaterial = \"gild\"\n",
        &[(4, 12, "did you mean `gold`?")],
    ),
    (
        "[materials.gold]\ntype = \"metl\"\n[[sphere]]\nmaterial = \"gold\"\n",
        &[(2, 8, "did you mean `metal`?")],
    ),
    (
        "[materials.a]\ntype = \"unlit\"\n[[quad]]\norigin = [0, 0, 0]\nu = [1, 0, 0]\nv = [2, 0, 0]\nmaterial = \"a\"\n",
        &[(6, 5, "parallel")],
    ),
    (
        "[materials.a]\ntype = \"unlit\"\n[[quad]]\norigin = [0, 0]\nu = [0, 0, 0]\nmaterial = \"a\"\n",
        &[(3, 1, "`v` is missing"), (4, 10, "2 of them"), (5, 5, "zero length")],
    ),
    // What else is wrong in the table hides nothing.
    (
        "[[quad]]\norigin = [0, 0, 0]\nu = [1, 0, 0]\nv = [2, 0, 0]\nmaterial = \"zz\"\n",
        &[(4, 5, "parallel"), (5, 12, "no material is called `zz`")],
    ),
    (
        "[[quad]]\nu = [1, 0, 0]\nv = [2, 0, 0]\nmatrial = \"a\"\n",
        &[(1, 1, "`origin` is missing"), (3, 5, "parallel"), (4, 1, "did you mean `material`?")],
    ),
    (
        "[[quad]]\norigin = [0, 0, 0]\nu = [0, 1, 0]\nmaterial = 1\n",
        &[(1, 1, "`v` is missing"), (4, 12, "the name of a material")],
    ),
    // [[model]]
    ("[[model]]\nfile = \"nothing.glb\"\nscale = 0\n", &[(2, 8, "there is no file"), (3, 9, "other than 0")]),
    ("[[model]]\nfile = \"model.stl\"\n", &[(2, 8, "\"gltf\"")]),
    (
        "[[model]]\nfile = 3\nmaterial = \"a\"\nmaterials = { B = \"c\" }\n",
        &[
            (2, 8, "a file name"),
            (3, 12, "no material is called `a`"),
            (4, 1, "exclude"),
            (4, 19, "no material is called `c`"),
        ],
    ),
    // [[light]]
    ("[[light]]\ntype = \"point\"\n", &[(1, 1, "`position` is missing")]),
    ("[[light]]\ntype = \"point\"\nposition = [0, 0, 0]\npower = 1\nintensity = 1\n", &[(5, 1, "exclude")]),
    ("[[light]]\ntype = \"spot\"\nposition = [0, 0, 0]\ninner = 50\n", &[(4, 9, "less than `outer`")]),
    ("[[light]]\ntype = \"spot\"\nposition = [0, 0, 0]\ntarget = [0, 0, 0]\n", &[(4, 10, "no direction")]),
    (
        "[[light]]\ntype = \"sun\"\ndirection = [0, 0, 0]\nangle = 200\n",
        &[(3, 13, "zero length"), (4, 9, "at most 180")],
    ),
    ("[[light]]\ntype = \"sun\"\ndirection = [0, -1, 0]\nelevation = 3\n", &[(4, 1, "exclude")]),
    (
        "[[light]]\ntype = \"spot\"\ninner = 50\n",
        &[(1, 1, "`position` is missing"), (3, 9, "less than `outer`")],
    ),
    // Nothing is compared with what stands for a value that could not be read.
    ("[[light]]\ntype = \"spot\"\ntarget = [0, 0, 0]\n", &[(1, 1, "`position` is missing")]),
    ("[[light]]\ntype = \"spot\"\nposition = [0, 1, 0]\ninner = 50\nouter = \"a\"\n", &[(5, 9, "a string")]),
    (
        "[[light]]\ntype = \"disk\"\ntarget = [0, 0, 0]\ndirection = [0, 1, 0]\npositon = [1, 1, 1]\n",
        &[(4, 1, "exclude"), (5, 1, "did you mean `position`?")],
    ),
    ("[[light]]\ntype = \"rect\"\npositon = [1, 1, 1]\n", &[(3, 1, "did you mean `position`?")]),
    (
        "[[light]]\ntype = \"rect\"\norigin = 1\nu = [1, 0, 0]\nv = [1, 0, 0]\n",
        &[(3, 10, "three numbers"), (5, 5, "parallel")],
    ),
    ("[[light]]\ntype = \"rect\"\n", &[(1, 1, "no place")]),
    ("[[light]]\ntype = \"rect\"\norigin = [0, 0, 0]\nu = [1, 0, 0]\n", &[(1, 1, "`v` is missing")]),
    (
        "[[light]]\ntype = \"rect\"\norigin = [0, 0, 0]\nu = [1, 0, 0]\nv = [1, 0, 0]\nsize = 1\n",
        &[(5, 5, "parallel"), (6, 1, "exclude")],
    ),
    ("[[light]]\ntype = \"disk\"\nposition = [0, 0, 0]\nradius = 0\n", &[(4, 10, "greater than 0")]),
    ("[[light]]\ntype = \"area\"\n", &[(2, 8, "one of \"point\"")]),
    // [output]
    (
        "[output]\nfile = \"a.png\"\nview = \"agx\"\ndepth = \"half\"\n",
        &[(3, 8, "not there yet"), (4, 9, "8 or 16")],
    ),
    ("[output]\nfile = \"a.tiff\"\ndepth = 12\n", &[(2, 8, "\"exr\""), (3, 9, "16")]),
    (
        "[output]\nfile = \"a.hdr\"\ndepth = 8\nexposure = 100\n",
        &[(3, 9, "leave it out"), (4, 12, "at most 64")],
    ),
    ("[output]\nfile = \"a.hdr\"\nvariance = true\n", &[(3, 12, "ends in .exr")]),
    ("[output]\nvariance = true\n", &[(2, 12, "cannot hold the variance")]),
    // Syntax.
    ("[camera\nvfov = 30\n", &[(1, 8, "unclosed table")]),
    (
        "[render]\nsamples =\nnoise = 0.1.2\nseed = -1\n",
        &[(2, 10, "no value"), (3, 12, "invalid float"), (4, 8, "0 or more")],
    ),
    ("[render]\nseed = 1\nseed = 2\nthreads = 0\n", &[(3, 1, "duplicate key"), (4, 11, "at least 1")]),
    // What is on a line that cannot be read is not said to be missing.
    ("[[sphere]]\nmaterial = gold\nradius = -1\n", &[(2, 12, "in quotes"), (3, 10, "greater than 0")]),
];

#[test]
fn each_error_is_told_at_its_place() {
    for (text, expected) in CASES {
        let found = errors(text);
        let shown = render(&found, false);
        let places: Vec<_> = found.iter().map(position).collect();
        let wanted: Vec<_> = expected.iter().map(|&(line, column, _)| (line, column)).collect();
        assert_eq!(places, wanted, "in\n{text}\n{shown}");
        for (diagnostic, (_, _, part)) in found.iter().zip(*expected) {
            let said = format!("{} {}", diagnostic.message, diagnostic.help.as_deref().unwrap_or_default());
            assert!(said.contains(part), "“{part}” is not in “{said}”");
        }
    }
}

#[test]
fn files_that_are_no_scene_files() {
    let folder = tempfile::tempdir().expect("a folder");
    let binary = folder.path().join("binary.toml");
    std::fs::write(&binary, [b'a', b'\n', 0xff, 0xfe]).expect("a file");
    let missing = folder.path().join("missing.toml");
    for (path, part) in [
        (binary.as_path(), "UTF-8"),
        (missing.as_path(), "cannot read"),
        (folder.path(), "not a file"),
        (Path::new("/dev/zero"), "not a file"),
    ] {
        let errors = load(path).expect_err("is wrong");
        assert!(errors.len() == 1 && errors[0].message.contains(part), "{errors:?}");
    }
}

#[test]
fn a_similar_file_is_suggested() {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("helmet.glb"), "").expect("a file");
    std::fs::create_dir(folder.path().join("folder.obj")).expect("a folder");
    let text = "[[model]]\nfile = \"helmt.glb\"\n[[model]]\nfile = \"folder.obj\"\n";
    let errors = parse(text, &folder.path().join("scene.toml")).expect_err("is wrong");
    assert_eq!(errors[0].help.as_deref(), Some("did you mean `helmet.glb`?"));
    assert!(errors[1].message.contains("not a file"));
}

/// None of these may overflow the stack, take minutes or fill the memory.
#[test]
fn hostile_files() {
    let deep = 100_000;
    let many = 20_000;
    for text in [
        "[".repeat(deep),
        format!("a = {}", "[".repeat(deep)),
        format!("a = {}", "{a=".repeat(deep)),
        format!("a{} = 1", ".a".repeat(deep)),
        format!("[a{}]", ".a".repeat(deep)),
        (0..many).map(|i| format!("key{i} = {i}\n")).collect(),
        (0..many).map(|i| format!("[[sphere]]\nmaterial = \"m{i}\"\nradius = -1\n")).collect(),
        (0..many).map(|i| format!("[materials.m{i}]\n[[sphere]]\nmaterial = \"n{i}\"\n")).collect(),
        format!("[materials]\n\"{}\" = 1\n", "x".repeat(1 << 20)),
        format!("{} = 1\n", "x".repeat(1 << 20)),
        format!("[render]\nsamples = {}\n", "9".repeat(1 << 20)),
        format!("[render]\ntime = \"{}\"\n", "1h".repeat(1 << 16)),
        "\"\"\"".into(),
        "\u{feff}[render]\nsamples = 0\n".into(),
        "\r\n\r[render]\r\n".into(),
        "a = \"\u{0}\"".into(),
    ] {
        let shown = render(&errors(&text), true);
        assert!(shown.len() < 1 << 20, "{}", shown.len());
    }
}

#[test]
fn the_terminal_is_not_steered() {
    let shown = render(&errors("[render]\n\"\u{9b}31m\\u001b[2J\" = 1 # \u{202e}\u{7f}\n"), false);
    assert!(shown.chars().all(|c| !c.is_control() || c == '\n'), "{shown:?}");
    assert!(!shown.contains('\u{202e}'));
}

#[test]
fn an_array_that_is_not_closed_is_told_once() {
    let all = errors("[render]\nsize = [800, 450\nsamples = 3\n\nnoise = 0.1\n[camera]\nvfov = 20\n");
    let commas = all.iter().filter(|e| e.message.starts_with("missing comma")).count();
    assert_eq!(commas, 1, "{}", render(&all, false));
    assert!(render(&all, false).contains("missing `]`"));
}
