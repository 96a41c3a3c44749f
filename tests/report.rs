//! The report of `rayo compare` in a real browser: it opens, moves, and shows the numbers of the pictures.

mod browser;

use std::{env, fs, path::Path};

use browser::Browser;
use image::RgbImage;
use rayo::{
    color::Picture,
    compare::report::{self, Entry, Group, Pairs, Report},
};
use serde_json::json;

const SIZE: [u32; 2] = [96, 64];

/// Neither closes an element nor runs.
const HOSTILE: &str = "</script><img src=x onerror=\"window.hacked=1\">&amp;";

fn picture(pixel: impl Fn(u32, u32) -> [f32; 3]) -> Picture {
    let pixels = (0..SIZE[0] * SIZE[1]).map(|i| pixel(i % SIZE[0], i / SIZE[0])).collect();
    Picture { width: SIZE[0], height: SIZE[1], pixels }
}

/// A ramp in red; the others differ by a known factor, and in a blue square.
fn group(name: &str, pairs: Pairs) -> Group {
    let ramp = |factor: f32| picture(move |x, _| [factor * x as f32 / 95.0, 0.25, 0.0]);
    let square = |x: u32, y: u32| (40..56).contains(&x) && (24..40).contains(&y);
    let blue = picture(|x, y| if square(x, y) { [0.0, 0.0, 12.5] } else { [x as f32 / 95.0, 0.25, 0.0] });
    let detail = |version: &str| vec![("version".to_owned(), version.to_owned())];
    Group {
        name: name.into(),
        description: format!("What {HOSTILE} shows."),
        notes: vec![HOSTILE.into()],
        pictures: vec![
            Entry::new("reference", detail("1.0"), ramp(1.0)),
            Entry::new("darker", detail("2.0"), ramp(0.8)),
            Entry::new(HOSTILE, detail(HOSTILE), blue),
        ],
        pairs,
    }
}

fn page(folder: &Path) -> std::path::PathBuf {
    let report = Report {
        title: format!("Test {HOSTILE}"),
        notes: vec!["A paragraph.".into()],
        groups: vec![
            group("first scene", Pairs::All),
            group("second scene", Pairs::WithFirst),
            group(HOSTILE, Pairs::WithFirst),
        ],
    };
    let file = folder.join("index.html");
    fs::write(&file, report::html(&report).expect("one size")).expect("written");
    file
}

/// Keeps a screenshot where `RAYO_SCREENSHOTS` names a folder, to be looked at.
fn keep(screenshot: &RgbImage, name: &str) {
    if let Some(folder) = env::var_os("RAYO_SCREENSHOTS") {
        screenshot.save(Path::new(&folder).join(name)).expect("saved");
    }
}

#[test]
fn the_report_works_in_a_browser() {
    let Some(programs) = browser::find() else {
        assert!(
            env::var_os("RAYO_REQUIRE_CHROMIUM").is_none(),
            "chromium and chromedriver are not installed"
        );
        eprintln!("skipped: chromium and chromedriver are not on the PATH");
        return;
    };
    let folder = tempfile::tempdir().expect("folder");
    let file = page(folder.path());
    let browser = Browser::start(&programs);
    browser.open(&file);
    browser.wait("document.querySelector('#group0 .viewer').dataset.ready");

    nothing_is_fetched_and_names_are_text(&browser);
    it_is_not_blank(&browser);
    the_slider_moves(&browser);
    values_under_the_mouse(&browser);
    another_pair(&browser);
    exposure_and_ranges(&browser);
    overview_and_other_groups(&browser);
    dark_and_narrow(&browser);
    assert_eq!(browser.console(), [""; 0]);
}

fn nothing_is_fetched_and_names_are_text(browser: &Browser) {
    assert_eq!(browser.run("return performance.getEntriesByType('resource').length"), 0);
    assert_eq!(browser.run("return typeof window.hacked"), "undefined");
    assert_eq!(browser.run("return document.images.length"), 0);
    assert_eq!(browser.text("return document.title"), format!("Test {HOSTILE}"));
    assert_eq!(browser.text("return document.querySelector('#group0 .notes li').textContent"), HOSTILE);
    assert_eq!(browser.console(), [""; 0]);
}

fn it_is_not_blank(browser: &Browser) {
    let screenshot = browser.screenshot();
    keep(&screenshot, "light.png");
    let colors: std::collections::HashSet<[u8; 3]> = screenshot.pixels().map(|p| p.0).collect();
    assert!(colors.len() > 200, "{} colours", colors.len());
}

/// A picture's colour in the window, at a share of the first stage's width and at a third of its height.
fn color_at(browser: &Browser, share: f64) -> [u8; 3] {
    let [x, y, width, height] = browser.place("#group0 .photos .stage");
    browser.screenshot().get_pixel((x + share * width) as u32, (y + height / 3.0) as u32).0
}

fn the_slider_moves(browser: &Browser) {
    // Left of the handle is the reference, right of it the image, whose red is less.
    let before = color_at(browser, 0.4);
    let [x, y, width, height] = browser.place("#group0 .photos .stage");
    let at = |share: f64| [x + share * width, y + height / 2.0];
    browser.mouse(&[at(0.5), at(0.3), at(0.2)], true);
    let split = "return +document.querySelector('#group0 .split').value";
    let value = browser.run(split).as_f64().expect("number");
    assert!((value - 20.0).abs() < 1.5, "{value}");
    let after = color_at(browser, 0.4);
    assert!(before[0] > after[0] + 10 && before[1] == after[1], "{before:?} {after:?}");
    // The keyboard: End is all reference.
    browser.run("document.querySelector('#group0 .split').focus()");
    browser.keys(&['\u{E010}']);
    assert_eq!(browser.run(split), 100);
    assert_eq!(color_at(browser, 0.4), before);
    browser.run("const s = document.querySelector('#group0 .split'); s.value = 50; s.dispatchEvent(new Event('input'))");
}

fn row(browser: &Browser, group: usize, row: usize) -> Vec<String> {
    let script = format!(
        "return [...document.querySelectorAll('#group{group} .readout tbody tr')[{row}].cells].map(c => c.textContent)"
    );
    serde_json::from_value(browser.run(&script)).expect("texts")
}

fn values_under_the_mouse(browser: &Browser) {
    let title = "document.querySelector('#group0 .side figcaption').textContent";
    for (selector, pixel) in
        [("#group0 .photos .stage", [50, 30]), ("#group0 figure:nth-of-type(2) .stage", [17, 60])]
    {
        let [x, y, width, height] = browser.place(selector);
        let at = |i: usize, start: f64, length: f64| {
            start + (f64::from(pixel[i]) + 0.5) * length / f64::from(SIZE[i])
        };
        browser.mouse(&[[at(0, x, width), at(1, y, height)]], false);
        browser.wait(&format!("{title} === 'Pixel {}, {}'", pixel[0], pixel[1]));
        let red = f64::from(pixel[0]) / 95.0;
        let square = pixel == [50, 30];
        let expected = [
            [red, 0.25, 0.0],
            [0.8 * red, 0.25, 0.0],
            if square { [0.0, 0.0, 12.5] } else { [red, 0.25, 0.0] },
        ];
        for (i, expected) in expected.into_iter().enumerate() {
            let shown: Vec<f64> =
                row(browser, 0, i)[1..].iter().map(|t| t.parse().expect("number")).collect();
            for (shown, expected) in shown.iter().zip(expected) {
                // A half keeps 11 bits.
                assert!((shown - expected).abs() <= expected * 6e-4, "{shown} for {expected} at {pixel:?}");
            }
        }
        let luminance = |red: f64| 0.2126 * red + 0.7152 * 0.25;
        let relative =
            100.0 * (luminance(0.8 * red) / luminance(red) - 1.0) * luminance(red) / (luminance(red) + 0.01);
        let shown = row(browser, 0, 3)[1].replace('−', "-").replace(" %", "");
        assert!((shown.parse::<f64>().expect("number") - relative).abs() < 0.15, "{shown} for {relative}");
    }
    // Arrow keys move the pixel that is read.
    browser.run("document.querySelector('#group0 figure:nth-of-type(2) .stage').focus()");
    browser.keys(&['\u{E014}', '\u{E014}', '\u{E013}']);
    browser.wait(&format!("{title} === 'Pixel 19, 59'"));
}

fn another_pair(browser: &Browser) {
    let current = "return [...document.querySelectorAll('#group0 tr[aria-current] td, #group0 tr[aria-current] th')].map(c => c.textContent).join(' ')";
    assert!(browser.text(current).starts_with("darker reference"), "{}", browser.text(current));
    let flip = "return document.querySelector('#group0 figure:nth-of-type(3) figcaption').textContent";
    let before = browser.text(flip);
    browser.run("document.querySelectorAll('#group0 .numbers tbody button')[1].click()");
    browser.wait("document.querySelector('#group0 .viewer').dataset.ready === '0,2'");
    let row = browser.text(current);
    assert!(row.starts_with(HOSTILE), "{row}");
    let after = browser.text(flip);
    assert_ne!(before, after);
    let mean = after.split("mean ").nth(1).expect("mean");
    assert!(row.contains(mean), "{row} has no {mean}");
    assert_eq!(browser.text("return document.querySelector('#group0 .chip.right').textContent"), HOSTILE);
    // The selects choose too.
    browser.run(
        "const s = document.querySelector('#reference0'); s.value = 1; s.dispatchEvent(new Event('change'))",
    );
    browser.wait("document.querySelector('#group0 .viewer').dataset.ready === '1,2'");
    assert!(browser.text(current).contains("darker"));
}

fn exposure_and_ranges(browser: &Browser) {
    let before = color_at(browser, 0.3);
    browser.run(
        "const e = document.querySelector('#exposure0'); e.value = -2; e.dispatchEvent(new Event('input'))",
    );
    let after = color_at(browser, 0.3);
    assert!(before.iter().zip(after).all(|(&b, a)| b > a || b == 0), "{before:?} {after:?}");
    assert_eq!(browser.text("return document.querySelector('#group0 output').textContent"), "−2");
    browser.run(
        "const e = document.querySelector('#exposure0'); e.value = 0; e.dispatchEvent(new Event('input'))",
    );
    browser.run(
        "const e = document.querySelector('#range0'); e.value = 0.02; e.dispatchEvent(new Event('change'))",
    );
    let ticks = "return document.querySelector('#group0 .ticks').textContent";
    assert_eq!(browser.text(ticks), "−2 %−1 %0 %+1 %+2 %");
    browser.run("const e = document.querySelector('#histogram0'); e.value = 'difference'; e.dispatchEvent(new Event('change'))");
    assert_eq!(browser.run("return document.querySelectorAll('#group0 .histogram .bar').length"), 64);
    browser.run(
        "const e = document.querySelector('#flip0'); e.value = 'hdr'; e.dispatchEvent(new Event('change'))",
    );
    browser.wait(
        "document.querySelector('#group0 figure:nth-of-type(3) figcaption').textContent.startsWith('HDR')",
    );
}

fn overview_and_other_groups(browser: &Browser) {
    let worst = "return [...document.querySelectorAll('#overview td')].map(c => c.textContent)";
    let cells: Vec<String> = serde_json::from_value(browser.run(worst)).expect("texts");
    assert_eq!(cells.len(), 3 * 3, "{cells:?}");
    let ratio = "const s = document.querySelector('#metric'); s.value = 2; s.dispatchEvent(new Event('change')); return s.selectedOptions[0].textContent";
    assert_eq!(browser.text(ratio), "mean ratio");
    let changed: Vec<String> = serde_json::from_value(browser.run(worst)).expect("texts");
    assert_ne!(cells, changed);
    // Columns of one number have no worst one, nor do those whose numbers are equal.
    assert_eq!(browser.run("return document.querySelectorAll('#overview .worst').length"), 0);
    assert!(
        browser
            .text("return document.querySelector('#group0 .matrix caption').textContent")
            .contains("mean ratio")
    );
    // A cell of the second scene leads there and shows its pair.
    browser.run("document.querySelectorAll('#overview tbody tr')[1].cells[2].querySelector('a').click()");
    browser.wait("document.querySelector('#group1 .viewer').dataset.ready === '0,2'");
    assert_eq!(browser.text("return location.hash"), "#group1");
    keep(&browser.screenshot(), "second.png");
}

fn dark_and_narrow(browser: &Browser) {
    let background = "return getComputedStyle(document.body).backgroundColor";
    let light = browser.text(background);
    let dark = json!({"features": [{"name": "prefers-color-scheme", "value": "dark"}]});
    browser.chromium("Emulation.setEmulatedMedia", dark);
    assert_ne!(browser.text(background), light);
    browser.run("scrollTo(0, 0)");
    keep(&browser.screenshot(), "dark.png");
    for width in [400, 1280] {
        let size = json!({"width": width, "height": 2400, "deviceScaleFactor": 1, "mobile": false});
        browser.chromium("Emulation.setDeviceMetricsOverride", size);
        let [wide, window] = ["document.documentElement.scrollWidth", "innerWidth"]
            .map(|e| browser.run(&format!("return {e}")).as_i64().expect("number"));
        assert!(window == width && wide <= width, "the page is {wide} pixels wide in a window of {window}");
        keep(&browser.screenshot(), &format!("{width}.png"));
    }
}
