//! `rayo compare`: pictures against a reference, as a table, as JSON, as a page; and as a gate.

mod table;

use std::{
    fs,
    path::{Path, PathBuf},
};

use serde::Serialize;

use super::{Failure, print, terminal::say};
use crate::{
    compare::{
        self, Loaded, Numbers, SizeMismatch, Welch,
        report::{self, Entry, Group, Pair, Pairs, Report},
    },
    output,
};

/// Compare pictures with a reference
///
/// Reads EXR, HDR and PNG files of one size, of any program. The table has one line for each image; `docs/compare.md` says
/// what its numbers are. Where both files carry the variance of their pixels (`rayo render --variance`), a statistical test
/// tells whether they differ by more than noise.
///
/// Exit codes: 0 done, 1 an image is beyond a limit given with --max-…, 2 bad input.
#[derive(Debug, clap::Args)]
#[command(args_override_self = true)]
pub struct Args {
    /// The picture that is taken as right
    reference: PathBuf,

    /// Pictures to be compared with it
    #[arg(required = true)]
    images: Vec<PathBuf>,

    /// Write all numbers as JSON
    #[arg(long, value_name = "FILE.json")]
    json: Option<PathBuf>,

    /// Write a page with pictures, difference maps and numbers: DIR/index.html
    #[arg(long, value_name = "DIR")]
    report: Option<PathBuf>,

    /// Fail if the mean LDR-FLIP of an image is larger
    #[arg(long, value_name = "X", allow_negative_numbers = true, value_parser = limit)]
    max_flip: Option<f64>,

    /// Fail if the mean ratio of an image is further from 1
    #[arg(long, value_name = "X", allow_negative_numbers = true, value_parser = limit)]
    max_mean: Option<f64>,

    /// Fail if the median error of the 8 × 8 block means of an image is larger
    #[arg(long, value_name = "X", allow_negative_numbers = true, value_parser = limit)]
    max_block: Option<f64>,
}

/// What came out, as `--json` writes it.
#[derive(Serialize)]
struct Results {
    /// Version of rayo.
    rayo: &'static str,
    reference: FileFacts,
    images: Vec<ImageResult>,
}

#[derive(Serialize)]
struct FileFacts {
    file: String,
    size: [u32; 2],
    notes: Vec<String>,
}

#[derive(Serialize)]
pub(super) struct ImageResult {
    #[serde(flatten)]
    file: FileFacts,
    #[serde(flatten)]
    numbers: Numbers,
    /// `null` unless both files carry variance.
    welch: Option<Welch>,
    /// Limits that this image is beyond.
    failed: Vec<String>,
}

pub fn run(args: &Args) -> Result<(), Failure> {
    check_targets(args)?;
    let files: Vec<&Path> =
        std::iter::once(&args.reference).chain(&args.images).map(PathBuf::as_path).collect();
    let mut loaded = load_all(&files)?;
    compare::align(&mut loaded);
    check_sizes(&files, &loaded)?;
    let facts: Vec<FileFacts> = files.iter().zip(&loaded).map(|(file, loaded)| facts(file, loaded)).collect();
    let group = group(&files, loaded);
    let pairs = report::measure(&group).map_err(|e| bad_input(e.to_string()))?;

    let mut facts = facts.into_iter();
    let Some(reference) = facts.next() else { return Ok(()) };
    let images = facts.zip(&pairs).map(|(file, pair)| {
        let numbers = pair.comparison.numbers;
        ImageResult { file, numbers, welch: pair.welch, failed: failures(args, &numbers) }
    });
    let results = Results { rayo: env!("CARGO_PKG_VERSION"), reference, images: images.collect() };
    print(&table::text(&results.reference, &results.images))?;
    if let Some(file) = &args.json {
        // Plain numbers and strings: nothing here can fail to serialise.
        let json = serde_json::to_string_pretty(&results).unwrap_or_default() + "\n";
        output::write_file(file, json.as_bytes()).map_err(failed)?;
    }
    if let Some(folder) = &args.report {
        write_report(folder, group, &pairs)?;
    }
    verdict(&results)
}

/// Finds out what cannot be written before any work is done.
fn check_targets(args: &Args) -> Result<(), Failure> {
    if let Some(file) = &args.json {
        output::check_writable(file, &["json"]).map_err(|e| bad_input(e.to_string()))?;
    }
    if let Some(folder) = &args.report {
        fs::create_dir_all(folder)
            .map_err(|e| bad_input(format!("cannot make the folder {}: {e}", folder.display())))?;
        output::check_writable(&folder.join("index.html"), &["html"])
            .map_err(|e| bad_input(e.to_string()))?;
    }
    Ok(())
}

/// All files that cannot be read are named, not the first.
fn load_all(files: &[&Path]) -> Result<Vec<Loaded>, Failure> {
    let mut problems = String::new();
    let mut all = Vec::new();
    for file in files {
        match compare::load(file) {
            Ok(loaded) => all.push(loaded),
            Err(why) => problems += &format!("error: cannot read {}: {why}\n", file.display()),
        }
    }
    if problems.is_empty() { Ok(all) } else { Err(Failure::BadInput(problems)) }
}

fn check_sizes(files: &[&Path], loaded: &[Loaded]) -> Result<(), Failure> {
    let size = |loaded: &Loaded| [loaded.picture.width, loaded.picture.height];
    let (Some((reference, images)), Some((first, others))) = (loaded.split_first(), files.split_first())
    else {
        return Ok(());
    };
    let problems: String = images
        .iter()
        .zip(others)
        .filter(|(image, _)| size(image) != size(reference))
        .map(|(image, file)| {
            let mismatch = SizeMismatch { reference: size(reference), image: size(image) };
            format!("error: {} against {}: {mismatch}\n", file.display(), first.display())
        })
        .collect();
    if problems.is_empty() { Ok(()) } else { Err(Failure::BadInput(problems)) }
}

fn facts(file: &Path, loaded: &Loaded) -> FileFacts {
    let size = [loaded.picture.width, loaded.picture.height];
    FileFacts { file: file.display().to_string(), size, notes: loaded.notes() }
}

/// The limits that `numbers` are beyond. A number that is not one is beyond all.
fn failures(args: &Args, numbers: &Numbers) -> Vec<String> {
    let off = (numbers.metrics.mean_ratio - 1.0).abs();
    let gates = [
        ("--max-flip", args.max_flip, numbers.ldr_flip, "LDR-FLIP"),
        ("--max-mean", args.max_mean, off, "distance of the mean ratio from 1"),
        ("--max-block", args.max_block, numbers.metrics.block_median, "median block error"),
    ];
    gates
        .into_iter()
        .filter_map(|(flag, limit, number, what)| Some((flag, limit?, number, what)))
        .filter(|(_, limit, number, _)| number.is_nan() || number > limit)
        .map(|(flag, limit, number, what)| format!("{what} {number:.5} is above {flag} {limit}"))
        .collect()
}

fn verdict(results: &Results) -> Result<(), Failure> {
    let lines: String = results
        .images
        .iter()
        .flat_map(|image| image.failed.iter().map(|why| format!("failed: {}: {why}\n", image.file.file)))
        .collect();
    if lines.is_empty() { Ok(()) } else { Err(Failure::Failed(lines)) }
}

/// The files as the report shows them.
fn group(files: &[&Path], loaded: Vec<Loaded>) -> Group {
    let entries = files.iter().zip(report::short_names(files)).zip(loaded).map(|((file, name), loaded)| {
        let size = format!("{} × {}", loaded.picture.width, loaded.picture.height);
        let mut details = vec![("file".to_owned(), file.display().to_string()), ("size".to_owned(), size)];
        details.extend(loaded.notes().into_iter().map(|note| ("note".to_owned(), note)));
        Entry::of(name, details, loaded)
    });
    let pictures: Vec<Entry> = entries.collect();
    let name = pictures.first().map(|entry| entry.name.clone()).unwrap_or_default();
    Group {
        name: format!("Against {name}"),
        description: String::new(),
        notes: Vec::new(),
        pictures,
        pairs: Pairs::WithFirst,
    }
}

fn write_report(folder: &Path, group: Group, pairs: &[Pair]) -> Result<(), Failure> {
    let names: Vec<&str> = group.pictures.iter().map(|entry| entry.name.as_str()).collect();
    let title = match names.as_slice() {
        [reference, image] => format!("{image} compared with {reference}"),
        [reference, ..] => format!("{} pictures compared with {reference}", names.len() - 1),
        [] => String::new(),
    };
    let report = Report { title, notes: Vec::new(), groups: vec![group] };
    let file = folder.join("index.html");
    output::write_file(&file, report::page(&report, &[pairs]).as_bytes()).map_err(failed)?;
    say(format!("wrote {}", file.display()));
    Ok(())
}

fn bad_input(problem: String) -> Failure {
    Failure::BadInput(format!("error: {problem}"))
}

fn failed(error: impl std::fmt::Display) -> Failure {
    Failure::Failed(format!("error: {error}"))
}

fn limit(text: &str) -> Result<f64, &'static str> {
    let number = text.parse().ok().filter(|number: &f64| *number >= 0.0 && number.is_finite());
    number.ok_or("write a number that is not negative, such as 0.03")
}
