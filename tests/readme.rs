//! What the README and docs/compare.md say is tried: their commands' files and flags, the scene, the links.

use std::{fs, path::Path, process::Command};

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

/// Each `rayo …` command runs as it stands, made small by flags that come last.
#[test]
fn commands_work() {
    let folder = tempfile::tempdir().expect("folder");
    let mut tried = 0;
    for line in blocks("sh").iter().flat_map(|block| block.lines()) {
        let Some(command) =
            line.strip_prefix("rayo ").or_else(|| line.strip_prefix("cargo run --release -- "))
        else {
            continue;
        };
        let arguments = command.split_whitespace().map(|word| match root().join(word) {
            file if file.is_file() => file.into_os_string(),
            _ => word.into(),
        });
        let small: &[&str] =
            if command.starts_with("render ") { &["--size", "24x16", "--samples", "2"] } else { &[] };
        let output = Command::new(cargo_bin("rayo"))
            .args(arguments)
            .args(small)
            .current_dir(folder.path())
            .output()
            .expect("runs");
        assert!(output.status.success(), "{line}: {}", String::from_utf8_lossy(&output.stderr));
        tried += 1;
    }
    assert_eq!(tried, 5);
    for picture in ["cover.png", "tea-jar.png", "jar.exr", "draft.exr"] {
        assert!(folder.path().join(picture).is_file(), "{picture}");
    }
}

/// Those of docs/compare.md run one after the other, renders made small.
#[test]
fn commands_on_comparing_work() {
    let folder = tempfile::tempdir().expect("folder");
    let commands = blocks_of("docs/compare.md", "sh").concat();
    for line in commands.lines() {
        let words = line.strip_prefix("rayo ").expect("a command of rayo").split_whitespace();
        let arguments = words.map(|word| match root().join(word) {
            file if file.is_file() => file.into_os_string(),
            _ => word.into(),
        });
        let small: &[&str] =
            if line.contains(" render ") { &["--size", "48x32", "--samples", "8"] } else { &[] };
        let output = Command::new(cargo_bin("rayo"))
            .args(arguments)
            .args(small)
            .current_dir(folder.path())
            .output()
            .expect("runs");
        assert!(output.status.success(), "{line}: {}", String::from_utf8_lossy(&output.stderr));
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
