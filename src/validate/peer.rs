//! Other renderers on this machine: finding them, and having them render what was exported for them.

use std::{
    env, fs,
    fs::File,
    io,
    path::{Path, PathBuf},
    process::{Child, Command, ExitStatus, Stdio},
    thread,
    time::{Duration, Instant},
};

use crate::export::Target;

/// A renderer that is there and answers.
#[derive(Clone, Debug)]
pub struct Peer {
    pub target: Target,
    /// Name and version, as the program says.
    pub version: String,
    program: Program,
}

#[derive(Clone, Debug)]
enum Program {
    /// `blender` with its own Python.
    Blender(PathBuf),
    /// A Python that has the module `bpy`.
    Bpy(PathBuf),
    Povray(PathBuf),
    Mitsuba {
        /// `mitsuba`, or a Python that has the module.
        command: PathBuf,
        variant: &'static str,
        /// LLVM's library, where Dr.Jit would not find it by itself.
        llvm: Option<PathBuf>,
    },
}

/// A renderer that was not found, and how to get it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{} was not found: {}", .0.name(), install_hint(*.0))]
pub struct Missing(pub Target);

/// What one run of a peer took.
#[derive(Clone, Debug)]
pub struct Run {
    /// Of the whole process, start-up and loading included.
    pub seconds: f64,
    /// Lines of its output that speak of a warning or an error.
    pub complaints: Vec<String>,
}

#[derive(Debug, thiserror::Error)]
pub enum Error {
    #[error("{program} cannot be started: {problem}")]
    Start { program: String, problem: io::Error },
    #[error("{program} failed ({status}); the end of {log}:\n{tail}")]
    Failed { program: String, status: String, log: String, tail: String },
}

/// What a peer is asked to do.
#[derive(Clone, Copy, Debug)]
pub struct Task<'a> {
    /// An exported folder.
    pub folder: &'a Path,
    /// EXR to write.
    pub picture: &'a Path,
    /// Per pixel; POV-Ray has its own in the folder.
    pub samples: u32,
    pub seed: u32,
    /// As many as the machine has where it is not said.
    pub threads: Option<usize>,
    /// A run that takes longer is ended.
    pub limit: Duration,
}

const PROBE_LIMIT: Duration = Duration::from_secs(60);

impl Peer {
    /// Looks for a program on PATH, then for a Python module. `python` is asked first where it is given.
    pub fn find(target: Target, python: Option<&Path>) -> Result<Self, Missing> {
        let found = match target {
            Target::Blender => find_blender(python),
            Target::Povray => find_povray(),
            Target::Mitsuba => find_mitsuba(python),
        };
        let (version, program) = found.ok_or(Missing(target))?;
        Ok(Self { target, version, program })
    }

    /// Whether another seed gives another pattern of noise.
    pub fn is_random(&self) -> bool {
        self.target != Target::Povray
    }

    /// Renders; everything the program says goes to a log beside the picture.
    pub fn render(&self, task: &Task) -> Result<Run, Error> {
        let mut command = self.command(task);
        let log = task.picture.with_extension("log");
        let start_fault = |problem| Error::Start { program: self.version.clone(), problem };
        let output = File::create(&log).map_err(start_fault)?;
        let errors = output.try_clone().map_err(start_fault)?;
        command.current_dir(task.folder).stdin(Stdio::null()).stdout(output).stderr(errors);
        let start = Instant::now();
        let status = wait(&mut command.spawn().map_err(start_fault)?, task.limit);
        let seconds = start.elapsed().as_secs_f64();
        let said =
            fs::read(&log).map(|bytes| String::from_utf8_lossy(&bytes).into_owned()).unwrap_or_default();
        let succeeded = status.is_some_and(|status| status.success());
        if !succeeded || !task.picture.is_file() {
            let lines: Vec<&str> = said.lines().collect();
            return Err(Error::Failed {
                program: self.version.clone(),
                status: match status {
                    None => format!("it was ended after {seconds:.0} s"),
                    Some(_) if succeeded => "it wrote no picture".into(),
                    Some(status) => status.to_string(),
                },
                log: log.display().to_string(),
                tail: lines[lines.len().saturating_sub(12)..].join("\n"),
            });
        }
        Ok(Run { seconds, complaints: complaints(&said) })
    }

    fn command(&self, task: &Task) -> Command {
        let Task { samples, seed, threads, .. } = task;
        let mut command;
        match &self.program {
            Program::Blender(blender) => {
                command = Command::new(blender);
                command.args([
                    "--background",
                    "--factory-startup",
                    "--python-exit-code",
                    "1",
                    "--python",
                    "scene.py",
                    "--",
                ]);
            }
            Program::Bpy(python) => {
                command = Command::new(python);
                command.arg("scene.py");
            }
            Program::Povray(povray) => {
                command = Command::new(povray);
                command.arg("scene.ini").arg(join("+O", &beside(task)));
                if let Some(threads) = threads {
                    command.arg(format!("+WT{threads}"));
                }
                return command;
            }
            Program::Mitsuba { command: mitsuba, variant, llvm } => {
                command = mitsuba_command(mitsuba, llvm.as_deref());
                command.args(["-m", variant, "-D", &format!("spp={samples}"), "-D", &format!("seed={seed}")]);
                if let Some(threads) = threads {
                    // Mitsuba 3.9 waits for itself when it loads a scene with fewer.
                    command.args(["-t", &(*threads).max(3).to_string()]);
                }
                command.arg("-o").arg(task.picture).arg("scene.xml");
                return command;
            }
        }
        command.arg("--output").arg(task.picture);
        command.args(["--samples", &samples.to_string(), "--seed", &seed.to_string()]);
        if let Some(threads) = threads {
            command.args(["--threads", &threads.to_string()]);
        }
        command
    }
}

/// The picture as seen from the exported folder: POV-Ray takes no path with a space or a quote in it.
fn beside(task: &Task) -> PathBuf {
    match task.picture.file_name() {
        Some(name) if task.picture.parent() == task.folder.parent() => Path::new("..").join(name),
        _ => task.picture.to_owned(),
    }
}

fn join(flag: &str, path: &Path) -> std::ffi::OsString {
    let mut whole = std::ffi::OsString::from(flag);
    whole.push(path);
    whole
}

fn install_hint(target: Target) -> &'static str {
    match target {
        Target::Blender => {
            "install Blender so that `blender` is on PATH, or its Python module with `pip install bpy` (name the Python with --python)"
        }
        Target::Povray => "install POV-Ray so that `povray` is on PATH (Debian: `apt install povray`)",
        Target::Mitsuba => {
            "install it with `pip install mitsuba` so that `mitsuba` is on PATH, or name the Python that has it with --python"
        }
    }
}

fn find_blender(python: Option<&Path>) -> Option<(String, Program)> {
    let bpy = |python| {
        let (python, said) = python_with(python, "import bpy; print('version', bpy.app.version_string)")?;
        Some((format!("Blender {}", marked(&said, "version ")?), Program::Bpy(python)))
    };
    let blender = || {
        let blender = on_path("blender")?;
        let said = answer(Command::new(&blender).arg("--version"))?;
        let version = said.lines().find(|line| line.starts_with("Blender "))?.trim().to_owned();
        Some((version, Program::Blender(blender)))
    };
    python.and_then(|python| bpy(Some(python))).or_else(blender).or_else(|| bpy(None))
}

fn find_povray() -> Option<(String, Program)> {
    let povray = on_path("povray")?;
    let said = answer(Command::new(&povray).arg("--version"))?;
    let version = said.lines().find(|line| line.starts_with("POV-Ray "))?.trim().to_owned();
    Some((version, Program::Povray(povray)))
}

fn find_mitsuba(python: Option<&Path>) -> Option<(String, Program)> {
    let module = |python| Some(python_with(python, "import mitsuba")?.0);
    let command = python
        .and_then(|python| module(Some(python)))
        .or_else(|| on_path("mitsuba"))
        .or_else(|| module(None))?;
    let said = answer(mitsuba_command(&command, None).arg("--help"))?;
    let version = marked(&said, "Mitsuba version ")?.split_whitespace().next()?.to_owned();
    // The fast variant needs LLVM, which it finds only where the loader looks.
    let candidates = [None].into_iter().chain(llvm_libraries().into_iter().map(Some));
    let works = |llvm: &Option<PathBuf>| renders_with_llvm(&command, llvm.as_deref());
    let given = env::var_os("DRJIT_LIBLLVM_PATH").is_some();
    let llvm = candidates.take(if given { 1 } else { 8 }).find(works);
    let variant = if llvm.is_some() { "llvm_ad_rgb" } else { "scalar_rgb" };
    let program = Program::Mitsuba { command, variant, llvm: llvm.flatten() };
    Some((format!("Mitsuba {version} {variant}"), program))
}

fn mitsuba_command(command: &Path, llvm: Option<&Path>) -> Command {
    let mut mitsuba = Command::new(command);
    let is_python = command.file_name().is_some_and(|name| name.to_string_lossy().starts_with("python"));
    if is_python {
        // What the `mitsuba` command of the package does.
        mitsuba.args(["-c", "from mitsuba.cli import _main; _main()"]);
    }
    if let Some(llvm) = llvm {
        mitsuba.env("DRJIT_LIBLLVM_PATH", llvm);
    }
    mitsuba
}

/// Tries it: a picture of four pixels.
fn renders_with_llvm(command: &Path, llvm: Option<&Path>) -> bool {
    let Ok(folder) = tempfile::tempdir() else { return false };
    let scene = r#"<scene version="3.0.0"><integrator type="direct"/><emitter type="constant"/><shape type="sphere"/>
        <sensor type="perspective"><film type="hdrfilm"><integer name="width" value="2"/><integer name="height" value="2"/>
        </film></sensor></scene>"#;
    let (file, picture) = (folder.path().join("probe.xml"), folder.path().join("probe.exr"));
    if fs::write(&file, scene).is_err() {
        return false;
    }
    answer(mitsuba_command(command, llvm).args(["-m", "llvm_ad_rgb", "-o"]).arg(&picture).arg(&file))
        .is_some()
        && picture.is_file()
}

/// LLVM's libraries in the usual places, the newest first.
fn llvm_libraries() -> Vec<PathBuf> {
    let mut found = Vec::new();
    let folders = [
        "/usr/lib/x86_64-linux-gnu",
        "/usr/lib/aarch64-linux-gnu",
        "/usr/lib64",
        "/usr/lib",
        "/opt/homebrew/opt/llvm/lib",
    ];
    for folder in folders {
        for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
            let name = entry.file_name().to_string_lossy().into_owned();
            let Some(rest) = name.strip_prefix("libLLVM") else { continue };
            let version: u32 = rest
                .trim_start_matches('-')
                .split(|c: char| !c.is_ascii_digit())
                .next()
                .and_then(|n| n.parse().ok())
                .unwrap_or(0);
            if rest.contains(".so") || rest.ends_with(".dylib") {
                found.push((version, entry.path()));
            }
        }
    }
    found.sort_by(|a, b| b.cmp(a));
    found.dedup_by_key(|(version, _)| *version);
    found.into_iter().map(|(_, path)| path).collect()
}

/// The first Python in which `code` runs, and what it printed.
fn python_with(python: Option<&Path>, code: &str) -> Option<(PathBuf, String)> {
    let candidates: Vec<PathBuf> = match python {
        Some(python) => vec![on_path(python)?],
        None => ["python3", "python"].into_iter().filter_map(on_path).collect(),
    };
    candidates.into_iter().find_map(|python| {
        let said = answer(Command::new(&python).args(["-c", code]))?;
        Some((python, said))
    })
}

/// What follows `mark` at the beginning of a line.
fn marked<'a>(said: &'a str, mark: &str) -> Option<&'a str> {
    said.lines().find_map(|line| line.trim().strip_prefix(mark)).map(str::trim)
}

fn on_path(name: impl AsRef<Path>) -> Option<PathBuf> {
    let name = name.as_ref();
    if name.components().count() > 1 {
        return name.is_file().then(|| std::path::absolute(name).ok()).flatten();
    }
    let names = [name.to_owned(), name.with_extension("exe")];
    let folders: Vec<PathBuf> = env::split_paths(&env::var_os("PATH")?).collect();
    folders
        .iter()
        .flat_map(|folder| names.iter().map(move |name| folder.join(name)))
        .find(|file| file.is_file())
}

/// What a program prints, if it succeeds within [`PROBE_LIMIT`].
fn answer(command: &mut Command) -> Option<String> {
    let folder = tempfile::tempdir().ok()?;
    let log = folder.path().join("log");
    let output = File::create(&log).ok()?;
    let errors = output.try_clone().ok()?;
    let mut child = command.stdin(Stdio::null()).stdout(output).stderr(errors).spawn().ok()?;
    wait(&mut child, PROBE_LIMIT)?
        .success()
        .then(|| String::from_utf8_lossy(&fs::read(&log).unwrap_or_default()).into_owned())
}

/// How a program ended; `None` where it had to be ended.
fn wait(child: &mut Child, limit: Duration) -> Option<ExitStatus> {
    let start = Instant::now();
    loop {
        match child.try_wait() {
            Ok(Some(status)) => return Some(status),
            Ok(None) if start.elapsed() < limit => thread::sleep(Duration::from_millis(20)),
            Ok(None) | Err(_) => {
                let _ = child.kill();
                let _ = child.wait();
                return None;
            }
        }
    }
}

fn complaints(said: &str) -> Vec<String> {
    const MOST: usize = 20;
    let complains = |line: &&str| {
        let line = line.to_ascii_lowercase();
        ["warning:", "error:", "deprecat", " warn "].iter().any(|sign| line.contains(sign))
    };
    said.lines().filter(complains).take(MOST).map(|line| line.trim().to_owned()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_missing_program_is_told_with_what_to_do() {
        let none = Path::new("/nonexistent/python");
        let missing = Peer::find(Target::Blender, Some(none)).expect_err("not there");
        assert_eq!(missing, Missing(Target::Blender));
        assert!(missing.to_string().contains("pip install bpy"), "{missing}");
        assert!(Missing(Target::Povray).to_string().contains("apt install povray"));
    }

    #[test]
    fn complaints_are_found_in_what_is_said() {
        let said = "Warning Stream to console\n  Parse Warning: odd thing\nDone\nDeprecationWarning: x\n2026 WARN main y\n";
        assert_eq!(
            complaints(said),
            ["Parse Warning: odd thing", "DeprecationWarning: x", "2026 WARN main y"]
        );
    }

    #[test]
    #[cfg(unix)]
    fn programs_that_fail_give_no_answer() {
        assert!(answer(&mut Command::new("/nonexistent/program")).is_none());
        assert_eq!(answer(Command::new("sh").args(["-c", "echo 1; echo 2 >&2"])).as_deref(), Some("1\n2\n"));
        assert!(answer(Command::new("sh").args(["-c", "exit 3"])).is_none());
        let mut endless = Command::new("sleep").arg("60").spawn().expect("started");
        assert!(wait(&mut endless, Duration::from_millis(50)).is_none());
    }
}
