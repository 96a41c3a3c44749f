//! What the README, docs/compare.md and docs/validation.md say is tried: their commands' files and flags, the scene, the links.

use std::{
    fs,
    path::Path,
    process::{Command, Output},
};

use assert_cmd::cargo::cargo_bin;

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// The fenced blocks of a language in the README.
fn blocks(language: &str) -> Vec<String> {
    blocks_of("README.md", language)
}

fn blocks_of(page: &str, language: &str) -> Vec<String> {
    let text = fs::read_to_string(root().join(page)).expect("a page");
    let fence = format!("```{language}\n");
    text.split(&fence).skip(1).map(|rest| rest.split("```").next().unwrap_or_default().to_string()).collect()
}

/// Runs a command of a page in `folder`, with the repository's files by their whole names, and `small` where it makes pictures.
fn run(line: &str, folder: &Path, small: &[&str]) -> Output {
    let mut words = line.split_whitespace();
    assert_eq!(words.next(), Some("rayo"), "a command of rayo: {line}");
    let command = words.next().expect("a command");
    let arguments = words.map(|word| match root().join(word) {
        file if file.is_file() => file.into_os_string(),
        _ => word.into(),
    });
    let small = if command == "compare" { &[] } else { small };
    let mut rayo = Command::new(cargo_bin("rayo"));
    rayo.arg(command).args(arguments).args(small).current_dir(folder).output().expect("runs")
}

/// The other renderers need not be there.
fn works(line: &str, output: &Output) {
    let said = String::from_utf8_lossy(&output.stderr);
    let alone = line.contains("rayo validate") && said.contains("was not found");
    assert!(output.status.success() || alone, "{line}: {said}");
}

/// Each `rayo …` command runs as it stands, made small by flags that come last.
#[test]
fn commands_work() {
    let folder = tempfile::tempdir().expect("folder");
    let lines: Vec<String> = blocks("sh")
        .iter()
        .flat_map(|block| block.lines())
        .map(|line| line.replace("cargo run --release -- ", "rayo "))
        .filter(|line| line.starts_with("rayo "))
        .collect();
    for line in &lines {
        works(line, &run(line, folder.path(), &["--size", "24x16", "--samples", "2"]));
    }
    assert_eq!(lines.len(), 7);
    for picture in ["cover.png", "tea-jar.png", "jar.exr", "draft.exr", "cornell-blender/scene.py"] {
        assert!(folder.path().join(picture).is_file(), "{picture}");
    }
}

/// Those of docs/validation.md: every export, and validations of one scene.
#[test]
fn commands_on_validation_work() {
    let folder = tempfile::tempdir().expect("folder");
    for line in blocks_of("docs/validation.md", "sh").concat().lines() {
        let line = line.replace("*.toml", "sun.toml");
        works(&line, &run(&line, folder.path(), &["--size", "24x16", "--samples", "2"]));
    }
    for file in ["cornell-blender/scene.json", "cornell-povray/scene.ini", "cornell-mitsuba/scene.xml"] {
        assert!(folder.path().join(file).is_file(), "{file}");
    }
}

/// Those of docs/compare.md run one after the other, renders made small.
#[test]
fn commands_on_comparing_work() {
    let folder = tempfile::tempdir().expect("folder");
    let commands = blocks_of("docs/compare.md", "sh").concat();
    for line in commands.lines() {
        let output = run(line, folder.path(), &["--size", "48x32", "--samples", "8"]);
        works(line, &output);
        let table = String::from_utf8_lossy(&output.stdout);
        assert_eq!(
            line.ends_with("compare one.exr other.exr"),
            table.contains("Welch test"),
            "{line}: {table}"
        );
    }
    assert_eq!(commands.lines().count(), 7);
    for file in ["numbers.json", "difference/index.html"] {
        assert!(folder.path().join(file).is_file(), "{file}");
    }
}

#[test]
fn the_scene_renders_without_a_warning_and_its_slip_is_told_as_shown() {
    let folder = tempfile::tempdir().expect("folder");
    let scene = blocks("toml").pop().expect("a scene");
    let file = folder.path().join("first.toml");
    let render = |text: &str| {
        fs::write(&file, text).expect("written");
        Command::new(cargo_bin("rayo"))
            .args(["render", "first.toml", "--size", "24x16", "--samples", "2"])
            .current_dir(folder.path())
            .output()
            .expect("runs")
    };
    let output = render(&scene);
    let told = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success() && !told.contains("warning"), "{told}");
    assert!(folder.path().join("first.png").is_file());

    let output = render(&scene.replacen("radius", "radus", 1));
    let told = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2));
    for line in blocks("text").pop().expect("a message").lines() {
        assert!(told.contains(line.trim()), "{line:?} is not in:\n{told}");
    }
}

#[test]
fn linked_files_are_there() {
    let text = fs::read_to_string(root().join("README.md")).expect("README.md");
    for target in text.split("](").skip(1).filter_map(|rest| rest.split(')').next()) {
        if !target.starts_with("http") {
            assert!(root().join(target).is_file(), "{target}");
        }
    }
}
