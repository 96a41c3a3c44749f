//! Against the authors' own program, on pictures that `tests/flip/make_references.py` computes as this does.

use super::*;

/// Of means. What is asked for is 1e-4.
const MEAN_TOLERANCE: f64 = 2e-5;

/// Of a pixel. Rounding in the program's single precision, under a square root, is all there is below 1e-3: identical
/// surroundings come out as 0.0002 there.
fn tolerance(error: f64) -> f64 {
    if error < 1e-3 { 3e-4 } else { 1e-4 }
}

/// 0 to 255, as in the script.
fn noise(x: u32, y: u32, channel: u32, seed: u32) -> u32 {
    let mut n = x.wrapping_mul(73_856_093)
        ^ y.wrapping_mul(19_349_663)
        ^ channel.wrapping_mul(83_492_791)
        ^ seed.wrapping_mul(2_654_435_761);
    n ^= n >> 16;
    n = n.wrapping_mul(0x7FEB_352D);
    n ^= n >> 15;
    n = n.wrapping_mul(0x846C_A68B);
    n ^= n >> 16;
    n >> 24
}

/// Both pictures of a case, in 256ths of display white.
fn values(case: &str, x: u32, y: u32, c: u32) -> [u32; 2] {
    let lamp = |y0: u32| x.abs_diff(45).pow(2) + y.abs_diff(y0).pow(2) < 100;
    let dark = |seed| 1 + noise(x, y, c, seed) / 16 + x / 4;
    let point = |share| if noise(x, y, 0, 2) < share { 255 } else { 4 };
    match case {
        "noise on grey" => [64, 48 + noise(x, y, c, 1) / 8],
        "an edge moved by a pixel" => [12, 13].map(|edge| if x < edge { 200 } else { 20 }),
        "colours turned" => [c + 1, 3 - c].map(|k| 16 * ((x * k + y) % 16)),
        "points, some lost" => [point(24), point(12)],
        "high dynamic range" => [3, 4].map(|seed| (1 + noise(x, y, c, seed)) << (noise(x, y, 3, 3) / 20)),
        "narrower than the filters" => [noise(x, y, c, 5), noise(x, y, c, 6)],
        "a bright lamp over dark noise" => {
            [if lamp(70) { 60_000 } else { dark(7) }, if lamp(71) { 55_000 } else { dark(8) }]
        }
        _ => panic!("{case} is not here"),
    }
}

fn pictures(case: &str, width: u32, height: u32) -> [Picture; 2] {
    [0, 1].map(|which| {
        let pixel = |i: u32| [0, 1, 2].map(|c| values(case, i % width, i / width, c)[which] as f32 / 256.0);
        Picture { width, height, pixels: (0..width * height).map(pixel).collect() }
    })
}

#[derive(serde::Deserialize)]
struct References {
    cases: Vec<Case>,
}

#[derive(serde::Deserialize)]
struct Case {
    name: String,
    width: u32,
    height: u32,
    step: usize,
    ldr_mean: f64,
    ldr: Vec<f64>,
    hdr_mean: f64,
    hdr: Vec<f64>,
    exposures: (f32, f32, u32),
}

#[test]
fn equals_the_authors_program() {
    let references: References =
        serde_json::from_str(include_str!("../../../tests/flip/references.json")).expect("JSON");
    assert_eq!(references.cases.len(), 7);
    for case in references.cases {
        let [b, a] = pictures(&case.name, case.width, case.height);
        let Exposures { start, stop, count } = Exposures::of(&b).expect("not black");
        let (their_start, their_stop, their_count) = case.exposures;
        assert!((start - their_start).abs() < 1e-4 && (stop - their_stop).abs() < 1e-4, "{}", case.name);
        assert_eq!(count, their_count, "{}", case.name);
        let maps = [
            ("LDR", ldr(&b, &a).expect("one size"), case.ldr_mean, case.ldr),
            ("HDR", hdr(&b, &a).expect("one size"), case.hdr_mean, case.hdr),
        ];
        for (kind, ours, their_mean, theirs) in maps {
            let name = format!("{kind} of {}", case.name);
            assert!(
                (mean(&ours) - their_mean).abs() < MEAN_TOLERANCE,
                "{name}: mean {} for {their_mean}",
                mean(&ours)
            );
            let sampled: Vec<f32> = ours.into_iter().step_by(case.step).collect();
            assert_eq!(sampled.len(), theirs.len(), "{name}");
            for (i, (&ours, theirs)) in sampled.iter().zip(theirs).enumerate() {
                let difference = (f64::from(ours) - theirs).abs();
                assert!(
                    difference < tolerance(theirs),
                    "{name}: {ours} for {theirs} at pixel {}",
                    i * case.step
                );
            }
        }
    }
}

#[test]
fn equal_black_and_unequal_pictures() {
    let [b, a] = pictures("high dynamic range", 18, 15);
    assert!(ldr(&b, &b).expect("one size").iter().chain(&hdr(&b, &b).expect("one size")).all(|&e| e == 0.0));
    let black = Picture { pixels: vec![[0.0; 3]; 18 * 15], ..b.clone() };
    assert_eq!(mean(&hdr(&black, &black).expect("one size")), 0.0);
    // A black reference shows nothing by itself: the image's exposures then.
    assert!(mean(&hdr(&black, &a).expect("one size")) > 0.1);
    let error = ldr(&b, &Picture { width: 15, height: 18, ..a }).expect_err("sizes differ");
    assert_eq!(error, SizeMismatch { reference: [18, 15], image: [15, 18] });
}

#[test]
fn light_at_the_end_of_its_range_gives_numbers() {
    let pixels: Vec<_> =
        (0..64).map(|i| [f32::MAX, 1e-40, 0.0].map(|c| if i % 3 == 0 { c } else { 1e-44 })).collect();
    let b = Picture { width: 8, height: 8, pixels };
    let a = Picture { pixels: b.pixels.iter().rev().copied().collect(), ..b.clone() };
    for map in [ldr(&b, &a).expect("one size"), hdr(&b, &a).expect("one size")] {
        assert!(map.iter().all(|e| (0.0..=1.0).contains(e)), "{map:?}");
    }
}
