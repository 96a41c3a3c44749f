//! Rendering of synthetic functions: no scene needed.

use std::{
    sync::atomic::{AtomicU64, Ordering::Relaxed},
    time::Duration,
};

use super::*;
use crate::{film::Pixel, sampling::stats::uniform};

fn noisy(x: u32, y: u32, index: u32, rays: &mut RayCounts) -> Vec3 {
    rays.camera += 1;
    rays.shadow += 2;
    let u = |k| uniform(index, (y * 4096 + x) * 4 + k);
    let steady = if x < 40 { 0.0 } else { 2.0 };
    if u(3) < 1e-3 { Vec3::NAN } else { steady + Vec3::new(u(0), u(1) * (x % 7) as f32, 10.0 * u(2)) }
}

fn settings(size: [u32; 2], samples: u32) -> Settings {
    Settings { size, samples, adaptive: false, ..Settings::default() }
}

fn run<S: Fn(u32, u32, u32, &mut RayCounts) -> Vec3 + Sync>(sample: S, settings: &Settings) -> Rendering {
    render_samples(&sample, settings, &Monitor::default()).expect("small")
}

#[test]
fn same_bits_for_any_number_of_threads() {
    let day = Some(Duration::from_hours(24));
    let ways =
        [(0.0, false, None), (0.05, false, None), (0.0, true, None), (0.03, true, None), (0.0, true, day)];
    for (noise, adaptive, time) in ways {
        let films = [1, 2, 7].map(|threads| {
            let settings = Settings { noise, adaptive, time, ..settings([83, 45], 300) };
            run(noisy, &Settings { threads: Some(threads), ..settings }).film
        });
        assert_eq!(films[0], films[1]);
        assert_eq!(films[0], films[2]);
        let counts = films[0].sample_counts();
        assert!(counts.dropped > 0);
        assert_eq!(counts.min < counts.max, adaptive, "{counts:?}");
    }
}

#[test]
fn a_pixel_holds_its_samples_in_order() {
    let film = run(noisy, &settings([5, 3], 100)).film;
    let mut pixel = Pixel::default();
    (0..100).for_each(|i| pixel.add(noisy(4, 2, i, &mut RayCounts::default())));
    assert_eq!(film.pixel(4, 2), &pixel);
}

#[test]
fn a_crop_is_that_part_of_the_whole() {
    let whole = run(noisy, &settings([70, 50], 20)).film;
    let crop = run(noisy, &Settings { crop: Some([13, 21, 40, 19]), ..settings([70, 50], 20) }).film;
    assert_eq!((crop.width(), crop.height()), (40, 19));
    for y in 0..19 {
        for x in 0..40 {
            assert_eq!(crop.pixel(x, y), whole.pixel(x + 13, y + 21));
        }
    }
}

#[test]
fn counters_agree_with_the_film() {
    let monitor = Monitor::default();
    let done = render_samples(&noisy, &settings([33, 17], 40), &monitor).expect("small");
    let samples = 33 * 17 * 40;
    assert_eq!(done.outcome, Outcome::Finished);
    assert_eq!((done.rays.camera, done.rays.bounce, done.rays.shadow), (samples, 0, 2 * samples));
    assert_eq!((monitor.samples(), monitor.rays(), monitor.fraction()), (samples, 3 * samples, 1.0));
    assert_eq!(monitor.noise(), done.noise);
}

#[test]
fn cancelling_stops_within_a_few_pixels() {
    let monitor = Monitor::default();
    let calls = AtomicU64::new(0);
    let sample = |x, y, index, rays: &mut RayCounts| {
        if calls.fetch_add(1, Relaxed) == 5000 {
            monitor.cancel();
        }
        noisy(x, y, index, rays)
    };
    let done = render_samples(&sample, &settings([64, 64], 100), &monitor).expect("small");
    let counts = done.film.sample_counts();
    assert_eq!(done.outcome, Outcome::Cancelled);
    assert_eq!((counts.min, counts.max), (1, 2));
    assert_eq!(done.rays.camera, calls.load(Relaxed));
    assert!(calls.load(Relaxed) < 5000 + 64, "{calls:?}");
}

#[test]
fn time_runs_out() {
    let slow = |_, _, _, _: &mut RayCounts| {
        std::thread::sleep(Duration::from_millis(1));
        Vec3::ONE
    };
    let limited =
        Settings { time: Some(Duration::from_millis(100)), threads: Some(2), ..settings([1000, 1000], 1000) };
    let done = run(slow, &limited);
    assert_eq!(done.outcome, Outcome::TimeUp);
    assert!(done.duration < Duration::from_millis(1000), "{:?}", done.duration);
    assert!(done.film.sample_counts().empty > 0);
    assert_eq!(done.noise, None);
}

#[test]
fn panics_of_the_sampler_reach_the_caller() {
    let result = std::panic::catch_unwind(|| {
        run(
            |x, _, _, _: &mut RayCounts| if x == 40 { panic!("on purpose") } else { Vec3::ONE },
            &settings([50, 9], 4),
        )
    });
    assert!(result.is_err());
}

/// Uniform noise of relative standard deviation 1/√3 per sample and constant mean: the number of samples at
/// which it stops, and how far pixels then are from the truth, are known.
#[test]
fn noise_stops_where_the_error_of_the_picture_is_what_was_asked() {
    let flat = |x: u32, y: u32, index, _: &mut RayCounts| Vec3::splat(uniform(index, y * 64 + x));
    for (noise, adaptive) in [(0.1, false), (0.04, false), (0.1, true), (0.04, true)] {
        let done = run(flat, &Settings { noise, adaptive, ..settings([64, 64], 100_000) });
        assert_eq!(done.outcome, Outcome::NoiseReached);
        let needed = 1.0 / 3.0 / f64::from(noise * noise);
        let counts = done.film.sample_counts();
        assert!(counts.mean > needed && counts.mean < 1.25 * needed, "{counts:?}, needed {needed}");
        let square_error: f64 = done.film.pixels().iter().map(|p| (p.luminance() / 0.5 - 1.0).powi(2)).sum();
        let actual = (square_error / 4096.0).sqrt() as f32;
        assert!(actual < noise && actual > 0.8 * noise, "asked {noise}, got {actual}");
        let estimate = done.noise.expect("many samples");
        assert!((estimate / actual - 1.0).abs() < 0.1, "estimate {estimate}, actual {actual}");
    }
}

/// As [`rare_bright_paths_keep_their_mean`], where the end is open. That stages follow each other, and that the error of all decides the end,
/// may cost the mean something (on average of many pictures, up to a fiftieth of a pixel's error), but no more than a picture of this size shows. With
/// the pixel's own samples let in, it is too dark by 20 standard errors and more.
#[test]
fn stages_keep_the_mean_of_rare_bright_paths() {
    for (p, bright) in [(0.02f32, 10.0f32), (0.005, 20.0), (0.001, 50.0), (0.0002, 50.0)] {
        for (noise, time) in [(0.1, None), (0.05, None), (0.0, Some(Duration::from_hours(1)))] {
            let rare = |x: u32, y: u32, index, rays: &mut RayCounts| {
                rays.bounce += 1;
                let dim = uniform(index, 2 * (y * 128 + x));
                let hit = uniform(index, 2 * (y * 128 + x) + 1) < p;
                Vec3::splat(if hit { bright } else { dim })
            };
            let samples = if noise > 0.0 { 16_384 } else { 256 };
            let done = run(rare, &Settings { noise, time, ..adaptive([96, 96], samples) });
            assert_eq!(done.outcome == Outcome::NoiseReached, noise > 0.0);
            let truth = f64::from((1.0 - p) * 0.5 + p * bright);
            let variance = f64::from((1.0 - p) / 3.0 + p * bright * bright) - truth * truth;
            let z = z_of_mean(&done.film, truth, variance);
            assert!(
                z.abs() < 3.5,
                "z {z:+.2} at noise {noise}, {bright} in one of {} paths, {:?}",
                1.0 / p,
                done.film.sample_counts()
            );
        }
    }
}

/// By how many standard errors the mean of the picture is off.
fn z_of_mean(film: &Film, truth: f64, variance: f64) -> f64 {
    let pixels = film.pixels();
    let mean = pixels.iter().map(Pixel::luminance).sum::<f64>() / pixels.len() as f64;
    let error = pixels.iter().map(|pixel| variance / f64::from(pixel.kept())).sum::<f64>().sqrt();
    (mean - truth) / (error / pixels.len() as f64)
}

fn adaptive(size: [u32; 2], samples: u32) -> Settings {
    Settings { adaptive: true, ..settings(size, samples) }
}

/// Four columns of pixels: noise of amplitude 1 or 8, samples of one ray or of four. The error is least with √(v/c).
#[test]
fn samples_go_as_the_root_of_variance_over_cost() {
    let sample = |x: u32, y: u32, index, rays: &mut RayCounts| {
        rays.bounce += 1 + 3 * u64::from(x / 64 % 2);
        let amplitude = if x / 128 == 0 { 0.1 } else { 0.8 };
        Vec3::splat(1.0 + amplitude * (uniform(index, y * 1024 + x) - 0.5))
    };
    let done = run(sample, &adaptive([256, 64], 256));
    assert_eq!(done.outcome, Outcome::Finished);
    let mean = |column: u32| {
        let taken = |x, y| f64::from(done.film.pixel(64 * column + x, y).taken());
        (16..48).map(|x| (0..64).map(|y| taken(x, y)).sum::<f64>()).sum::<f64>() / (32.0 * 64.0)
    };
    // in proportion 2 : 1 : 16 : 8, of which none is below a quarter: 64, 64, 16 s, 8 s with 64 + 256 + 16 s + 32 s = 10 × 256
    let s = (2560.0 - 320.0) / 48.0;
    for (column, expected) in [64.0, 64.0, 16.0 * s, 8.0 * s].into_iter().enumerate() {
        let mean = mean(column as u32);
        assert!((mean / expected - 1.0).abs() < 0.05, "column {column}: {mean} instead of {expected}");
    }
    let work = done.rays.bounce as f64 / (256.0 * 64.0 * 256.0 * 2.5);
    assert!((work - 1.0).abs() < 0.02, "{work} of the work");
}

/// One path in 1/p is far brighter than the rest. Were a pixel's own samples asked how many it needs, those that have met none
/// would get fewer and count as much: the picture would be too dark by many times its standard error.
#[test]
fn rare_bright_paths_keep_their_mean() {
    for (p, bright) in [(0.02f32, 10.0f32), (0.005, 40.0), (0.0005, 400.0)] {
        let rare = |x: u32, y: u32, index, rays: &mut RayCounts| {
            rays.bounce += 1;
            let dim = uniform(index, 2 * (y * 1024 + x));
            Vec3::splat(if uniform(index, 2 * (y * 1024 + x) + 1) < p { bright } else { dim })
        };
        let done = run(rare, &adaptive([256, 256], 32));
        let counts = done.film.sample_counts();
        assert!(counts.min < 32 && counts.max > 32, "{counts:?}");
        let truth = f64::from((1.0 - p) * 0.5 + p * bright);
        let variance = f64::from((1.0 - p) / 3.0 + p * bright * bright) - truth * truth;
        let z = z_of_mean(&done.film, truth, variance);
        assert!(z.abs() < 3.5, "{bright} in one of {} paths: z {z:.2}", 1.0 / p);
    }
}

#[test]
fn a_picture_without_noise_takes_only_the_first_samples() {
    let flat = |_, _, _, rays: &mut RayCounts| {
        rays.camera += 1;
        Vec3::ONE
    };
    let done = run(flat, &adaptive([40, 30], 64));
    assert_eq!((done.outcome, done.film.sample_counts().max), (Outcome::Finished, 16));
    // a lonely pixel has nobody to ask and gets all; samples that are no numbers are no noise
    assert_eq!(run(noisy, &adaptive([1, 1], 64)).film.pixel(0, 0).taken(), 64);
    let nan = |_, _, _, _: &mut RayCounts| Vec3::NAN;
    assert_eq!(run(nan, &adaptive([9, 9], 64)).film.sample_counts().max, 16);
}

/// However many samples are asked for, where time ends them the noisy half has got more.
#[test]
fn shares_are_made_long_before_the_last_sample() {
    let monitor = Monitor::default();
    let sample = |x: u32, y: u32, index, _: &mut RayCounts| {
        if monitor.samples() > 64 * 64 * 200 {
            monitor.cancel();
        }
        let amplitude = if x < 32 { 0.05 } else { 0.8 };
        Vec3::splat(1.0 + amplitude * (uniform(index, y * 64 + x) - 0.5))
    };
    let open = Settings { time: Some(Duration::from_hours(1)), ..adaptive([64, 64], MAX_SAMPLES) };
    let done = render_samples(&sample, &open, &monitor).expect("small");
    assert_eq!(done.outcome, Outcome::Cancelled);
    let [quiet, noisy] = [16, 48].map(|x| done.film.pixel(x, 32).taken());
    assert!(noisy >= 4 * quiet && quiet >= 16, "{noisy} and {quiet}");
}

/// Stages whose lengths do not add up to the samples asked for take no more.
#[test]
fn samples_are_never_more_than_asked_for() {
    let even = |_, _, _, _: &mut RayCounts| Vec3::ONE;
    let uneven = |x, y, index, rays: &mut RayCounts| noisy(x, y, index, rays).max(Vec3::ZERO);
    for samples in [16, 33, 66, 132, 500] {
        for noise in [0.0, 1e-6] {
            let open = Settings { noise, time: Some(Duration::from_hours(1)), ..adaptive([48, 32], samples) };
            let taken = run(even, &open).film.sample_counts().mean;
            assert!(taken <= f64::from(samples), "{taken} of {samples}, noise {noise}");
            let taken = run(uneven, &open).film.sample_counts().mean;
            assert!(taken <= 1.05 * f64::from(samples), "{taken} of {samples}, noise {noise}, uneven");
        }
    }
}

/// A single pixel has met the one bright path in 500 before its error is believed.
#[test]
fn a_few_pixels_do_not_stop_at_once() {
    let rare =
        |x, _, index, _: &mut RayCounts| Vec3::splat(if uniform(index, x) < 2e-3 { 20.0 } else { 1.0 });
    let done = run(rare, &Settings { noise: 0.1, ..adaptive([1, 1], 65_536) });
    assert_eq!(done.outcome, Outcome::NoiseReached);
    assert!(done.film.pixel(0, 0).taken() >= 4096, "{}", done.film.pixel(0, 0).taken());
}
