//! What must break neither the builder nor the traversal.

use std::time::{Duration, Instant};

use super::*;

#[test]
fn nothing_to_hit() {
    let flat =
        Soup { positions: vec![Vec3::ZERO, Vec3::X, 2.0 * Vec3::X], triangles: vec![[0, 1, 2], [0, 0, 1]] };
    let blas = flat.blas();
    assert_eq!((blas.set_aside(), blas.bounds(), blas.memory()), (2, None, 0));
    let singular = Affine3A::from_scale(Vec3::new(1.0, 0.0, 1.0));
    let shapes = [
        Shape::Mesh { blas: 0, to_world: Affine3A::IDENTITY },
        Shape::Mesh { blas: 1, to_world: singular },
        Shape::Mesh { blas: 1, to_world: Affine3A::from_scale(Vec3::splat(1e30)) },
        Shape::Mesh { blas: 1, to_world: Affine3A::from_translation(Vec3::NAN) },
        Shape::Mesh { blas: 9, to_world: Affine3A::IDENTITY },
        Shape::Sphere { center: Vec3::ZERO, radius: 0.0 },
        Shape::Sphere { center: Vec3::ZERO, radius: f32::NAN },
        Shape::Sphere { center: Vec3::INFINITY, radius: 1.0 },
        Shape::Quad { origin: Vec3::ZERO, u: Vec3::X, v: Vec3::X, round: false },
    ];
    let objects: Vec<_> = shapes.iter().map(|&shape| Object { shape, filtered: false }).collect();
    let empty = Accel::build(Vec::new(), Vec::new());
    let useless = Accel::build(vec![blas, soup(10, 1.0).blas()], objects);
    assert_eq!((empty.set_aside(), useless.set_aside()), (0, shapes.len()));
    for accel in [empty, useless] {
        assert_eq!(accel.bounds(), (Vec3::ZERO, Vec3::ZERO));
        assert!(rays(50).all(|ray| accel.closest(&ray).is_none() && !accel.occluded(&ray)));
    }
}

#[test]
fn unusable_triangles_are_set_aside_and_the_rest_stays() {
    let good = soup(50, 0.5);
    let mut bad = good.clone();
    for (i, x) in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 1e20, f32::MAX].into_iter().enumerate() {
        let mut corners = [Vec3::X, Vec3::Y, Vec3::Z];
        corners[i % 3][i % 2] = x;
        bad.add(corners);
    }
    bad.add([Vec3::ZERO, 1e-38 * Vec3::X, 1e-38 * Vec3::Y]);
    bad.triangles.push([0, 1, 1_000_000]);
    assert_eq!(bad.blas().set_aside(), 7);
    let (good, bad) = (Scene::of_mesh(good).accel(), Scene::of_mesh(bad).accel());
    assert!(rays(500).all(|ray| good.closest(&ray) == bad.closest(&ray)));
}

/// A heap of copies is one triangle, unless each may count.
#[test]
fn heaps_of_identical_triangles_vanish() {
    let mut heap = Soup::default();
    heap.add([Vec3::ZERO, Vec3::X, Vec3::Y]);
    heap.triangles = vec![[0, 1, 2]; 100_000];
    let start = Instant::now();
    // (a node, a block, and its box in the outline)
    assert_eq!(heap.built(Quality::Best, false).memory(), size_of::<wide::Node>() + 320 + 32);
    assert!(start.elapsed() < Duration::from_secs(1), "{:?} to build", start.elapsed());
    assert!(heap.built(Quality::Best, true).memory() > 320 * 100_000 / 8);
}

/// Hostile meshes build in time, and rays of any kind go through them without harm.
#[test]
fn hostile_input_is_survived() {
    let repeat = |n: u32, f: &dyn Fn(u32) -> [Vec3; 3]| {
        let mut soup = Soup::default();
        (0..n).for_each(|i| soup.add(f(i)));
        soup
    };
    let unit = [Vec3::ZERO, Vec3::X, Vec3::Y];
    let cases = [
        ("identical", repeat(16_384, &|_| unit)),
        (
            "concentric",
            repeat(16_384, &|i| {
                let s = 1.0 + i as f32 * 1e-3;
                [Vec3::new(-s, -s, 0.0), Vec3::new(s, -s, 0.0), Vec3::new(0.0, s, 0.0)]
            }),
        ),
        ("nested at a corner", repeat(16_384, &|i| unit.map(|p| p * (1.0 + i as f32 * 1e-3)))),
        ("geometric", repeat(4000, &|i| unit.map(|p| (p + 1.0) * 1.02f32.powi(i as i32 - 2500)))),
        ("slivers", repeat(4000, &|i| [Vec3::ZERO, 1e6 * direction(i, 0), 1e-3 * direction(i, 2)])),
        ("huge", repeat(2000, &|i| [0, 1, 2].map(|k| 1e11 * random(i, k)))),
        ("tiny", repeat(2000, &|i| [0, 1, 2].map(|k| 1e-15 * random(i, k)))),
        ("outlier", {
            let mut soup = soup(5000, 0.01);
            soup.add(unit.map(|p| 1e11 * p));
            soup
        }),
    ];
    let odd = [0.0, -0.0, 1e-40, 1e-20, 1.0, -1e20, f32::MAX, f32::INFINITY, f32::NAN];
    for (name, soup) in cases {
        let start = Instant::now();
        let mut scene = Scene::of_mesh(soup);
        scene.add(Shape::Mesh { blas: 0, to_world: Affine3A::from_scale(Vec3::splat(1e-3)) });
        let accels = kernels(scene.accel());
        let spent = start.elapsed();
        assert!(spent < Duration::from_secs(8), "{name}: {spent:?} to build");
        for i in 0..300u32 {
            let pick = |k: u32| odd[(uniform(i, k) * odd.len() as f32) as usize];
            let vector = |k: u32| Vec3::new(pick(k), pick(k + 1), pick(k + 2));
            let ray = Ray { origin: vector(0), direction: vector(3), t_min: pick(6), t_max: pick(7) };
            for accel in &accels {
                accel.closest(&ray);
                accel.occluded(&ray);
            }
        }
        // Overlapping triangles in one plane differ in t by roundings alone: which is nearest is then anyone's guess.
        for ray in rays(20) {
            let expected = scene.brute_force(&ray, |_| true).map(|h| h.t);
            for accel in &accels {
                let got = accel.closest(&ray).map(|h| h.t);
                let same = got.zip(expected).map_or(got == expected, |(a, b)| (a - b).abs() <= 1e-4 * b);
                assert!(same, "{name}: {got:?} instead of {expected:?}, {ray:?}");
            }
        }
    }
}
