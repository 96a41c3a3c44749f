//! Whether the picture of the README's main command is the one it promises. `.ci/run` makes it first; run alone with
//! `cargo run --release -- render scenes/cover.toml -o cover.png && cargo test --test cover -- --ignored`.

use std::path::Path;

#[test]
#[ignore = "needs cover.png, which the README's main command makes"]
fn the_cover_looks_like_the_cover() {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("cover.png");
    let image = image::open(&file).expect("cover.png is there and decodes").to_rgb8();
    assert_eq!(image.dimensions(), (1200, 675));
    let mean = |x: u32, y: u32, w: u32, h: u32| {
        let mut sum = [0.0; 3];
        for (x, y) in (x..x + w).flat_map(|x| (y..y + h).map(move |y| (x, y))) {
            let pixel = image.get_pixel(x, y);
            (0..3).for_each(|c| sum[c] += f64::from(pixel[c]) / f64::from(w * h));
        }
        sum
    };
    // sky above, pale and bluish; ground below the horizon, darker; the brown ball; the mirror ball's sky
    let [sky, ground, brown, mirror] =
        [mean(100, 40, 100, 60), mean(560, 560, 30, 30), mean(410, 150, 40, 60), mean(760, 120, 60, 60)];
    assert!(sky[2] > 250.0 && sky[0] > 215.0 && sky[0] < sky[2], "sky {sky:?}");
    assert!(ground[0] > 90.0 && ground[0] < 190.0 && ground[2] > ground[0], "ground {ground:?}");
    assert!(brown[0] > brown[1] + 20.0 && brown[1] > brown[2] + 15.0, "brown ball {brown:?}");
    assert!(mirror[0] > 130.0 && (mirror[0] - mirror[2]).abs() < 40.0, "mirror ball {mirror:?}");
    // converged: neighbouring pixels of the smooth sky hardly differ
    let roughness: f64 = (100..200)
        .map(|x| {
            (f64::from(image.get_pixel(x, 60)[0]) - f64::from(image.get_pixel(x + 1, 60)[0])).abs() / 100.0
        })
        .sum();
    assert!(roughness < 2.0, "sky is noisy: {roughness}");
}
