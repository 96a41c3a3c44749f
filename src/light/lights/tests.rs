//! Closed forms of irradiance, and the densities of all lights together.

use super::*;
use crate::{
    geometry::Frame,
    light::{Quad, Sphere, Triangle},
    sampling::{
        mis::power_heuristic,
        stats::{chi2_test, integrate_hemisphere, r3},
        warp::{cosine_hemisphere, cosine_hemisphere_pdf, uniform_sphere},
    },
    world::{ColorSpace, EnvironmentKind, Image, ImageId, Light, Texels},
};

fn environment(bottom: f32, top: f32) -> Environment {
    let kind = EnvironmentKind::Gradient { bottom: Vec3::splat(bottom), top: Vec3::splat(top) };
    Environment::new(&world::Environment { kind, strength: 1.0, rotation: 0.0, visible: true }, &[])
}

fn black() -> Environment {
    environment(0.0, 0.0)
}

fn surface(shape: Shape, power: f32) -> Emitter {
    Emitter::Surface { object: 3, primitive: 5, shape, power, two_sided: false }
}

fn sphere(center: Vec3, radius: f32) -> Shape {
    Shape::Sphere(Sphere { center, radius })
}

/// Irradiance at `p` on a surface of normal `n`, where every surface emits a radiance of 1. What comes from afar is found
/// by directions drawn by the cosine, too.
fn irradiance(lights: &Lights, p: Vec3, n: Vec3) -> f32 {
    let count = 1 << 19;
    let frame = Frame::from_z(n);
    let mut sum = 0.0;
    for i in 0..count {
        let [a, b, c] = r3(i);
        if let Some(s) = lights.sample(p, &Receiver::anywhere(), a, Vec2::new(b, c)) {
            let cos = s.wi.dot(n).max(0.0);
            let radiance = match s.source {
                Source::Radiance(radiance) if s.delta => radiance.x,
                Source::Radiance(radiance) => radiance.x * power_heuristic(s.pdf, cosine_hemisphere_pdf(cos)),
                Source::Surface { .. } => 1.0,
            };
            sum += (radiance * cos / s.pdf) as f64;
        }
        let w = cosine_hemisphere(Vec2::new(b, c));
        let (radiance, pdf) = lights.escaped(p, frame.to_world(w));
        sum += (PI * radiance.x * power_heuristic(cosine_hemisphere_pdf(w.z), pdf)) as f64;
    }
    (sum / count as f64) as f32
}

#[track_caller]
fn assert_close(found: f32, expected: f32) {
    assert!((found / expected - 1.0).abs() < 3e-3, "{found}, not {expected}");
}

#[test]
fn a_sphere_gives_its_solid_angle() {
    for (center, radius) in [(Vec3::new(1.0, 2.0, 0.5), 0.5), (Vec3::new(0.0, 2.0, 0.0), 1.9)] {
        let lights = Lights::new(&[surface(sphere(center, radius), 1.0)], black());
        let d = center.length();
        assert_close(irradiance(&lights, Vec3::ZERO, Vec3::Y), PI * (radius / d).powi(2) * center.y / d);
    }
}

#[test]
fn a_disk_gives_its_form_factor() {
    let (h, r) = (1.5, 0.8);
    let disk =
        Quad::new(Vec3::new(-r, h, -r), Vec3::new(2.0 * r, 0.0, 0.0), Vec3::new(0.0, 0.0, 2.0 * r), true);
    // u × v points down: −Y.
    let lights = Lights::new(&[surface(Shape::Quad(disk), 2.0)], black());
    assert_close(irradiance(&lights, Vec3::ZERO, Vec3::Y), PI * r * r / (r * r + h * h));
    let above = Vec3::new(0.0, 2.0 * h, 0.0);
    assert_eq!(irradiance(&lights, above, Vec3::NEG_Y), 0.0, "nothing leaves the back");
}

#[test]
fn a_square_gives_its_form_factor_whole_and_in_two_triangles() {
    // A unit square, 1 above the corner under which the receiver lies (Howell, configuration B-3), with X = Y = 1.
    let expected = (1.0 / 2.0f32.sqrt()) * (1.0 / 2.0f32.sqrt()).atan();
    let [o, u, v] = [Vec3::Y, Vec3::X, Vec3::Z];
    let square = Shape::Quad(Quad::new(o, u, v, false));
    let triangles =
        [[o, o + u, o + u + v], [o, o + u + v, o + v]].map(|t| Shape::Triangle(Triangle::new(t, false)));
    for shapes in [vec![square], triangles.to_vec()] {
        let emitters: Vec<_> = shapes.iter().map(|&s| surface(s, 1.0)).collect();
        assert_close(irradiance(&Lights::new(&emitters, black()), Vec3::ZERO, Vec3::Y), expected);
    }
}

#[test]
fn points_and_suns_give_what_they_say() {
    let point = Light::Point { position: Vec3::new(0.0, 2.0, 0.0), intensity: Vec3::splat(8.0) };
    let soft = Light::Sun { direction: Vec3::NEG_Y, irradiance: Vec3::splat(3.0), angle: 0.3 };
    let hard = Light::Sun {
        direction: Vec3::new(0.0, -1.0, 1.0),
        irradiance: Vec3::splat(2.0f32.sqrt()),
        angle: 0.0,
    };
    let only = |light: &Light| Lights::new(&[Emitter::Punctual(light.clone())], black());
    for (light, expected) in [(&point, 2.0), (&soft, 3.0), (&hard, 1.0)] {
        assert_close(irradiance(&only(light), Vec3::ZERO, Vec3::Y), expected);
    }
    let all = [point, soft, hard].map(Emitter::Punctual);
    assert_close(irradiance(&Lights::new(&all, black()), Vec3::ZERO, Vec3::Y), 6.0);
    assert_close(irradiance(&Lights::new(&all, environment(1.0, 1.0)), Vec3::ZERO, Vec3::Y), 6.0 + PI);
}

/// What is drawn of the sky leaves out half of its mean: the rest comes by the other draw, with weights that sum to 1 everywhere.
#[test]
fn skies_of_which_not_all_is_drawn_give_their_irradiance() {
    let texel = |i: usize| match (i % 16, i / 16) {
        (5, 2) => [300.0, 250.0, 200.0],
        (x, y) if y < 4 => [0.2 + 0.1 * (x % 3) as f32, 0.5, 0.9],
        _ => [0.1, 0.3 * (i % 2) as f32, 0.05],
    };
    let texels = Texels::RgbF32((0..128).map(texel).collect());
    let image = Image { name: "sky".into(), width: 16, height: 8, texels };
    let gradient = |bottom: f32, top: f32| EnvironmentKind::Gradient {
        bottom: Vec3::splat(bottom),
        top: Vec3::splat(top),
    };
    let map = EnvironmentKind::Image { image: ImageId(0), color_space: ColorSpace::Linear };
    for (name, kind) in [("image", map), ("steep", gradient(0.1, 5.0)), ("even", gradient(0.8, 1.0))] {
        let described = world::Environment { kind, strength: 1.0, rotation: 0.4, visible: true };
        let lights = Lights::new(&[], Environment::new(&described, std::slice::from_ref(&image)));
        // up, aside, and down where hardly any of it is drawn
        for n in [Vec3::Y, Vec3::new(0.6, 0.0, -0.8), Vec3::new(0.0, -0.96, 0.28)] {
            let frame = Frame::from_z(n);
            let radiance = |w| lights.environment().radiance(frame.to_world(w)).x;
            let expected = integrate_hemisphere(|w| radiance(w) * w.z);
            let found = irradiance(&lights, Vec3::ZERO, n);
            assert!((found / expected - 1.0).abs() < 4e-3, "{name}, {n}: {found}, not {expected}");
        }
    }
}

#[test]
fn a_mixture_gives_the_sum() {
    let (emitters, _) = mixture();
    let lights = Lights::new(&emitters, environment(0.2, 0.2));
    let expected = PI * 0.2 + PI * 0.25 / 4.0 + PI * 0.01 / 9.0 + 8.0;
    assert_close(irradiance(&lights, Vec3::ZERO, Vec3::Y), expected);
}

/// Two spheres above and below, one without power, a sun with a wide disk; and where the surfaces are.
fn mixture() -> (Vec<Emitter>, [(u32, Vec3, f32); 3]) {
    let surfaces =
        [(0, Vec3::new(0.0, 2.0, 0.0), 0.5), (1, Vec3::new(0.0, 3.0, 0.0), 0.1), (3, -Vec3::Y, 0.3)];
    let sun = Light::Sun { direction: -Vec3::Y, irradiance: Vec3::splat(8.0), angle: 1.0 };
    let lamp = |i: usize, power| surface(sphere(surfaces[i].1, surfaces[i].2), power);
    (vec![lamp(0, 1.0), lamp(1, 0.4), Emitter::Punctual(sun), lamp(2, 0.7)], surfaces)
}

#[test]
fn directions_follow_the_densities_of_all_lights_together() {
    let (emitters, surfaces) = mixture();
    let lights = Lights::new(&emitters, environment(0.5, 1.0));
    let p = Vec3::new(1.0, 0.5, 0.2);
    chi2_test(
        "mixture",
        |[a, b, c]| lights.sample(p, &Receiver::anywhere(), a, Vec2::new(b, c)).map(|s| s.wi),
        |w| {
            let through = |&(emitter, center, radius): &(u32, Vec3, f32)| {
                let along = (center - p).dot(w);
                let near = radius * radius - (p + along * w).distance_squared(center);
                (along > 0.0 && near >= 0.0)
                    .then(|| lights.pdf_surface(emitter, p, p + (along - near.sqrt()) * w))
            };
            lights.escaped(p, w).1 + surfaces.iter().filter_map(through).sum::<f32>()
        },
    );
}

#[test]
fn a_sample_carries_the_density_that_is_asked_for_later() {
    let (emitters, _) = mixture();
    let lights = Lights::new(&emitters, environment(0.5, 1.0));
    let mut found = [0; 2];
    for i in 0..2000 {
        let [a, b, c] = r3(i);
        let p = 3.0 * uniform_sphere(Vec2::new(c, a));
        let Some(s) = lights.sample(p, &Receiver::anywhere(), a, Vec2::new(b, c)) else { continue };
        let pdf = match s.source {
            Source::Radiance(radiance) => {
                let (expected, pdf) = lights.escaped(p, s.wi);
                assert_eq!(radiance, expected);
                pdf
            }
            Source::Surface { point, object, primitive, .. } => {
                assert_eq!((object, primitive), (3, 5));
                assert!(point.abs_diff_eq(p + s.distance * s.wi, 1e-5));
                [0, 1, 3]
                    .into_iter()
                    .map(|e| lights.pdf_surface(e, p, point))
                    .min_by(|a, b| (a - s.pdf).abs().total_cmp(&(b - s.pdf).abs()))
                    .expect("three surfaces")
            }
        };
        found[matches!(s.source, Source::Surface { .. }) as usize] += 1;
        assert!((pdf / s.pdf - 1.0).abs() < 1e-3, "{pdf}, drawn with {}", s.pdf);
    }
    assert!(found[0] > 400 && found[1] > 400, "{found:?}");
}

/// Whoever meets a lamp by chance weighs that against the same density as whoever chose it, for whatever receiver.
#[test]
fn weights_of_both_ways_to_a_lamp_are_of_the_same_density() {
    let lamps: Vec<(Vec3, f32)> = (0..40).map(|i| (6.0 * Vec3::from(r3(i)), 0.1 + 0.2 * r3(i)[1])).collect();
    let emitter = |(i, &(center, radius)): (u32, &(Vec3, f32))| Emitter::Surface {
        object: i,
        primitive: 0,
        shape: sphere(center, radius),
        power: 0.1 + r3(i)[0],
        two_sided: false,
    };
    let emitters: Vec<_> = (0..).zip(&lamps).map(emitter).collect();
    let lights = Lights::new(&emitters, environment(0.5, 1.0));
    let mut found = 0;
    for i in 0..4000 {
        let [a, b, c] = r3(i);
        let [d, e, f] = r3(i + 7000);
        let p = 6.0 * Vec3::new(d, e, f);
        let frame = Frame::from_z(uniform_sphere(Vec2::new(e, d)));
        let receiver = Receiver::new(frame, Vec3::new(0.6, 0.0, 0.8), [1.0 - f, f], 0.05 + b);
        let Some(s) = lights.sample(p, &receiver, a, Vec2::new(b, c)) else { continue };
        let Source::Surface { object, point, .. } = s.source else { continue };
        let told = lights.mis_pdf_surface(object, p, point);
        assert!((told / s.mis_pdf - 1.0).abs() < 1e-3, "{told}, drawn with {}", s.mis_pdf);
        found += 1;
    }
    assert!(found > 500, "{found}");
}

#[test]
fn among_many_lamps_the_tree_beats_a_choice_by_power() {
    // 300 equal lamps over a floor of 16 m: the second moment of one sample, in closed form.
    let lamps: Vec<(Vec3, f32)> = (0..300)
        .map(|i| {
            let [x, y, z] = r3(i);
            (Vec3::new(16.0 * x - 8.0, 0.2 + 2.8 * y, 16.0 * z - 8.0), 0.04)
        })
        .collect();
    let emitters: Vec<_> = lamps.iter().map(|&(c, r)| surface(sphere(c, r), 1.0)).collect();
    let lights = Lights::new(&emitters, black());
    let (mut tree, mut by_power, mut ideal) = (0.0, 0.0, 0.0);
    for i in 0..100 {
        let [x, z, _] = r3(i + 900);
        let p = Vec3::new(16.0 * x - 8.0, 0.0, 16.0 * z - 8.0);
        let mut total = 0.0;
        for (emitter, &(center, radius)) in (0..).zip(&lamps) {
            let d = center - p;
            let e = PI * radius * radius * d.y / d.length().powi(3);
            let shape = sphere(center, radius);
            let point = center - radius * d.normalize();
            let probability = lights.pdf_surface(emitter, p, point) / shape.pdf(p, point);
            tree += e * e / probability;
            by_power += e * e * lamps.len() as f32;
            total += e;
        }
        ideal += total * total;
    }
    let [tree, by_power] = [tree, by_power].map(|moment| moment / ideal - 1.0);
    assert!(tree < 0.05 * by_power, "relative variance {tree}, by power {by_power}");
}

#[test]
fn what_has_no_power_is_never_chosen() {
    let flat = Shape::Triangle(Triangle::new([Vec3::ZERO; 3], false));
    let dark = [
        surface(sphere(Vec3::Y, 0.5), 0.0),
        surface(sphere(Vec3::Y, 0.5), f32::NAN),
        surface(flat, 1.0),
        Emitter::Punctual(Light::Point { position: Vec3::Y, intensity: Vec3::ZERO }),
        Emitter::Punctual(Light::Sun { direction: Vec3::NEG_Y, irradiance: Vec3::ZERO, angle: 0.1 }),
    ];
    let lights = Lights::new(&dark, black());
    for i in 0..100 {
        let [a, b, c] = r3(i);
        assert!(lights.sample(Vec3::ZERO, &Receiver::anywhere(), a, Vec2::new(b, c)).is_none());
    }
    for emitter in 0..9 {
        assert_eq!(lights.pdf_surface(emitter, Vec3::ZERO, Vec3::Y), 0.0);
    }
    assert_eq!(lights.escaped(Vec3::ZERO, Vec3::Y).1, 0.0);
}
