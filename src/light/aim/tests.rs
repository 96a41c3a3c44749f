//! Departures against their density, by χ² and by integrals of known value.

use super::*;
use crate::{
    light::{Quad, Triangle},
    sampling::stats::{chi2_p_value, uniform},
};

/// Two balls, one half behind the other.
const BALLS: [(Vec3, f32); 2] = [(Vec3::new(2.0, 0.0, 0.0), 0.4), (Vec3::new(3.0, 0.5, 0.2), 0.6)];

fn lamp(shape: Shape) -> Emitter {
    Emitter::Surface { object: 0, primitive: 0, shape, power: 1.0, two_sided: false }
}

fn round(radius: f32) -> Emitter {
    lamp(Shape::Sphere(Sphere { center: Vec3::ZERO, radius }))
}

/// ∫ |cos| over points and directions that lead to the first ball, by what is drawn, with the densities that are told.
fn extent(aim: &Aim) -> f32 {
    let n = 1 << 16;
    let sum: f32 = (0..n)
        .filter_map(|i| {
            let [a, b, c, d, e, f] = [0, 1, 2, 3, 4, 5].map(|dimension| uniform(i, dimension));
            let path = aim.sample([a, b], Vec2::new(c, d), Vec2::new(e, f))?;
            let Departure { emitter, point, normal, direction, pdf, .. } = path;
            let told = aim.pdf(emitter, point, normal, direction);
            assert!((told - pdf).abs() <= 1e-4 * pdf, "drawn with {pdf}, told {told}");
            let hits = Ball { center: BALLS[0].0, radius: BALLS[0].1 }.holds(point, 0.0, direction);
            hits.then(|| normal.dot(direction) / pdf)
        })
        .sum();
    sum / n as f32
}

#[test]
fn from_the_middle_as_from_the_points_of_a_round_lamp() {
    let aim = Aim::new(&[round(0.1)], &BALLS, &[]).expect("a lamp and balls");
    let mut from_points = aim.clone();
    for source in from_points.sources.iter_mut().flatten() {
        assert!(source.middle.take().is_some());
    }
    let [a, b] = [&aim, &from_points].map(extent);
    assert!((a / b - 1.0).abs() < 0.02, "{a} and {b}");
}

#[test]
fn effort_goes_by_the_light_that_glossy_objects_get() {
    let far = [(Vec3::new(1.9, 0.0, 0.0), 0.4)];
    let aim = Aim::new(&[round(0.1)], &[], &far).expect("enough light");
    assert!((0.05..0.2).contains(&aim.effort), "{}", aim.effort);
    let sharp = Aim::new(&[round(0.1)], &far, &[]).expect("a mirror");
    assert_eq!(sharp.effort, 1.0);
    assert!((extent(&aim) / extent(&sharp) - 1.0).abs() < 0.1);
    assert!(Aim::new(&[round(0.1)], &[], &[(Vec3::new(10.0, 0.0, 0.0), 0.4)]).is_none());
}

/// The R₄ sequence.
fn r4(i: u32) -> [f32; 4] {
    const G: f64 = 1.167_303_978_261_418_7;
    [1, 2, 3, 4].map(|k| ((0.5 + f64::from(i) / G.powi(k)).fract() as f32).min(ONE_MINUS_EPSILON))
}

/// χ² over the lamps, the parts of each about its middle, and the directions; the last cell for what does not start.
fn check(name: &str, emitters: &[Emitter], sharp: &[(Vec3, f32)], glossy: &[(Vec3, f32)]) {
    const ROWS: usize = 6;
    const COLUMNS: usize = 10;
    const PARTS: usize = 8;
    let aim = Aim::new(emitters, sharp, glossy).expect("lamps and balls");
    let shapes: Vec<(Shape, bool)> = emitters
        .iter()
        .map(|emitter| match *emitter {
            Emitter::Surface { shape, two_sided, .. } => (shape, two_sided),
            _ => unreachable!("only surfaces here"),
        })
        .collect();
    let none = emitters.len() * PARTS * ROWS * COLUMNS;
    let cell = |emitter: usize, point: Vec3, direction: Vec3| {
        let middle = shapes[emitter].0.cluster(1.0, false).center();
        let part = (point - middle).cmpgt(Vec3::ZERO).bitmask() as usize;
        let row = ((0.5 * direction.z + 0.5) * ROWS as f32) as usize;
        let column = (direction.y.atan2(direction.x).rem_euclid(TAU) / TAU * COLUMNS as f32) as usize;
        ((emitter * PARTS + part) * ROWS + row.min(ROWS - 1)) * COLUMNS + column.min(COLUMNS - 1)
    };
    let n = 1 << 16;
    let mut observed = vec![0.0; none + 1];
    for i in 0..n {
        let [a, b, c, d, e, f] = [0, 1, 2, 3, 4, 5].map(|dimension| uniform(i, dimension));
        let path = aim.sample([a, b], Vec2::new(c, d), Vec2::new(e, f));
        observed[path.map_or(none, |path| {
            let told = aim.pdf(path.emitter, path.point, path.normal, path.direction);
            assert!((told - path.pdf).abs() <= 1e-3 * path.pdf, "{name}: with {}, told {told}", path.pdf);
            cell(path.emitter as usize, path.point, path.direction)
        })] += 1.0;
    }
    let fine = 1 << 19;
    let mut expected = vec![0.0; none + 1];
    let mut all = 0.0;
    for (emitter, (shape, two_sided)) in shapes.iter().enumerate() {
        for i in 0..fine {
            let [a, b, c, d] = r4(i);
            let (point, normal, _) = shape.sample_area(Vec2::new(a, b));
            let direction = uniform_sphere(Vec2::new(c, d));
            let pdf = aim.pdf(emitter as u32, point, normal, direction);
            let mass = f64::from(pdf * shape.area() * 4.0 * PI) / f64::from(fine);
            all += mass;
            if *two_sided || normal.dot(direction) > 0.0 {
                expected[cell(emitter, point, direction)] += f64::from(n) * mass;
            }
        }
    }
    assert!((all / f64::from(aim.effort) - 1.0).abs() < 5e-3, "{name}: {all} of {}", aim.effort);
    expected[none] = (f64::from(n) - expected.iter().sum::<f64>()).max(0.0);
    let p_value = chi2_p_value(&observed, &expected);
    assert!(p_value > 1e-4, "{name}: χ² test failed, p = {p_value:.2e}");
}

fn quad(origin: Vec3, power: f32, two_sided: bool) -> Emitter {
    let shape = Shape::Quad(Quad::new(origin, Vec3::X, Vec3::new(0.0, 0.4, 0.8), false));
    Emitter::Surface { object: 1, primitive: 0, shape, power, two_sided }
}

fn disk(origin: Vec3) -> Emitter {
    lamp(Shape::Quad(Quad::new(origin, Vec3::Y, Vec3::Z, true)))
}

/// As large as the distances between them, so that all cells are filled; the second and third overlap.
const LARGE: [(Vec3, f32); 3] =
    [(Vec3::new(2.0, 0.0, 0.0), 1.2), (Vec3::new(-1.0, 2.0, 0.5), 1.5), (Vec3::new(-0.5, 2.5, -0.8), 1.3)];

#[test]
fn departures_follow_the_density() {
    check("from the middle", &[round(0.1)], &LARGE, &[]);
    check("from points of a large lamp", &[round(0.9)], &LARGE, &[]);
    check("flat lamps", &[quad(-Vec3::Z, 1.0, true), disk(Vec3::new(-0.3, 0.2, 0.1))], &LARGE, &[]);
}

#[test]
fn departures_from_within_a_ball_follow_the_density() {
    let around = [LARGE[0], (Vec3::new(0.3, 0.2, 0.0), 2.0)];
    check("a lamp within", &[quad(Vec3::ZERO, 1.0, false)], &around, &[]);
    // in part: some points see all directions
    let half = [LARGE[0], (Vec3::new(0.8, 0.2, 0.3), 0.6)];
    check("a lamp half within", &[quad(Vec3::ZERO, 1.0, false), round(0.5)], &half, &[]);
    check("a small lamp within", &[round(0.05)], &around, &[]);
}

#[test]
fn departures_towards_sharp_and_glossy_objects_follow_the_density() {
    let triangle = lamp(Shape::Triangle(Triangle::new([Vec3::Z, Vec3::X, 2.0 * Vec3::Y], false)));
    let emitters =
        [round(0.1), quad(Vec3::new(-1.0, -1.0, 0.0), 3.0, false), triangle, quad(Vec3::Z, 0.0, false)];
    check("both", &emitters, &LARGE[..1], &LARGE[1..]);
    // Too little light for every path to start.
    let glossy = [(Vec3::new(1.9, 0.0, 0.0), 0.5), (Vec3::new(1.9, 0.4, 0.0), 0.5)];
    assert!(Aim::new(&emitters[..1], &[], &glossy).is_some_and(|aim| aim.effort < 0.9));
    check("glossy", &emitters[..1], &[], &glossy);
}
