//! What the inner loops cost, each by itself: `cargo bench --bench kernels`.
//!
//! Every kernel runs over a fixed set of 1024 inputs and the time is that of all of them, so that divided by 1024 it
//! is nanoseconds a call (criterion's `elem/s` says it the other way round). The inputs come from scenes as renders
//! meet them: rays of the camera and of bounces, surfaces seen from where rays hit them.

use std::{hint::black_box, path::Path, time::Duration};

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use glam::{Affine2, Affine3A, Vec2, Vec3};
use rayo::{
    bsdf::Bsdf,
    compile::{Scene, compile},
    geometry::{Frame, Ray},
    import::assemble,
    integrator::{RayCounts, Rims, sample_pixel},
    light::{Receiver, Source},
    material,
    sampling::sobol::PixelSampler,
    scene,
    texture::Textures,
    world::{
        ColorSpace, Filter, Image, ImageId, Instance, Light, Mesh, MeshId, Texels, Texture, TextureId,
        TextureRef, World, Wrap,
    },
};

const INPUTS: u32 = 1024;

criterion_group! {
    name = benches;
    config = Criterion::default().warm_up_time(Duration::from_millis(500)).measurement_time(Duration::from_secs(2)).sample_size(30);
    targets = rays, bsdfs, sampler, textures, lights, environment, paths
}
criterion_main!(benches);

fn rays(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("ray");
    group.throughput(Throughput::Elements(INPUTS.into()));
    for name in ["cover", "still-life", "street"] {
        let scene = scene(name);
        let camera = camera_rays(&scene);
        let bounced = bounce_rays(&scene, &camera);
        for (kind, rays) in [("camera", &camera), ("bounce", &bounced)] {
            group.bench_function(format!("{name}/closest/{kind}"), |bencher| {
                bencher.iter(|| rays.iter().filter_map(|ray| scene.accel.closest(ray)).count());
            });
            group.bench_function(format!("{name}/any/{kind}"), |bencher| {
                bencher.iter(|| rays.iter().filter(|ray| scene.accel.occluded(ray)).count());
            });
        }
    }
}

const MATERIALS: [(&str, &str); 10] = [
    ("diffuse", r#"type = "diffuse""#),
    ("fuzz", r#"type = "metal", fuzz = 0.3"#),
    ("metal", r#"type = "metal", roughness = 0.3"#),
    ("glass", r#"type = "dielectric""#),
    ("rough-glass", r#"type = "dielectric", roughness = 0.3"#),
    ("pbr", r#"type = "pbr", metallic = 0.5, roughness = 0.4"#),
    ("coated", r#"type = "pbr", clearcoat = {}"#),
    ("velvet", r#"type = "pbr", sheen = {}"#),
    ("brushed", r#"type = "pbr", metallic = 1, roughness = 0.3, anisotropy = {}"#),
    ("solid", r#"type = "pbr", roughness = 0.2, transmission = 1, volume = {}"#),
];

/// `make` looks the material up at a hit, `eval` and `sample` are what light and bounce cost there.
fn bsdfs(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("bsdf");
    group.throughput(Throughput::Elements(INPUTS.into()));
    for (name, keys) in MATERIALS {
        let scene = compiled(&format!(
            "sphere = [{{ material = \"m\" }}]\n[camera]\nposition = [0, 0, 3]\n[materials]\nm = {{ {keys} }}"
        ));
        let points: Vec<_> = camera_rays(&scene)
            .iter()
            .filter_map(|ray| Some((scene.surface_point(ray, &scene.accel.closest(ray)?), -ray.direction)))
            .collect();
        let points: Vec<_> = points.iter().cycle().take(INPUTS as usize).collect();
        let material = &scene.materials[0];
        let make =
            |&&(point, wo): &&(_, Vec3)| material::scattering(material, &scene.textures, &point, wo, None);
        group.bench_function(format!("{name}/make"), |bencher| {
            bencher.iter(|| points.iter().for_each(|input| drop(black_box(make(input)))));
        });
        let drawn: Vec<(Bsdf, Vec3, Vec2, f32, Vec3)> = (0..)
            .zip(&points)
            .map(|(i, input)| {
                let (bsdf, frame) = make(input);
                let [u, v, lobe, _] = PixelSampler::new(1, i, 0, 0).draw4(0);
                let wo = frame.to_local(input.1);
                let wi = bsdf.sample(wo, Vec2::new(u, v), lobe).map_or(Vec3::Z, |sample| sample.wi);
                (bsdf, wo, Vec2::new(v, lobe), u, wi)
            })
            .collect();
        group.bench_function(format!("{name}/sample"), |bencher| {
            bencher.iter(|| {
                drawn.iter().filter_map(|(bsdf, wo, u, lobe, _)| bsdf.sample(*wo, *u, *lobe)).count()
            });
        });
        if !drawn[0].0.is_delta() {
            group.bench_function(format!("{name}/eval"), |bencher| {
                bencher
                    .iter(|| drawn.iter().map(|(bsdf, wo, _, _, wi)| bsdf.eval_pdf(*wo, *wi).1).sum::<f32>());
            });
        }
    }
}

fn sampler(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("sampler");
    group.throughput(Throughput::Elements(INPUTS.into()));
    // As along paths: a pixel's sample draws a few sets.
    group.bench_function("draw4", |bencher| {
        bencher.iter(|| {
            (0..INPUTS / 8)
                .map(|i| {
                    let sampler = PixelSampler::new(0, i, 7, black_box(13));
                    (0..8).map(|set| sampler.draw4(set)[3]).sum::<f32>()
                })
                .sum::<f32>()
        });
    });
}

fn textures(criterion: &mut Criterion) {
    const SIDE: u32 = 2048;
    let mut group = criterion.benchmark_group("texture");
    group.throughput(Throughput::Elements(INPUTS.into()));
    let bytes = |i: u32| (i.wrapping_mul(0x9e37_79b9) ^ 0x5bd1_e995).to_le_bytes();
    let image = |texels| Image { name: String::new(), width: SIDE, height: SIDE, texels };
    let images = vec![
        image(Texels::Rgba8((0..SIDE * SIDE).map(bytes).collect())),
        image(Texels::RgbF32((0..SIDE * SIDE).map(|i| [i as f32 * 1e-3; 3]).collect())),
    ];
    let texture = |image, color_space| Texture {
        image: ImageId(image),
        color_space,
        wrap_u: Wrap::Repeat,
        wrap_v: Wrap::Repeat,
        filter: Filter::Linear,
    };
    let kinds =
        [("srgb", 0, ColorSpace::Srgb), ("linear", 0, ColorSpace::Linear), ("float", 1, ColorSpace::Linear)];
    let textures = Textures::new(images, kinds.map(|(_, image, space)| texture(image, space)).to_vec());
    let far: Vec<Vec2> = points().iter().map(|&[u, v, ..]| Vec2::new(3.0 * u, 2.0 * v)).collect();
    // As neighbouring pixels look it up: half a texel from one to the next, in rows of 32.
    let near = (0..INPUTS)
        .map(|i| Vec2::new((i % 32) as f32, (i / 32) as f32) * (0.5 / SIDE as f32) + 0.3)
        .collect();
    for (number, (kind, ..)) in kinds.iter().enumerate() {
        let reference =
            TextureRef { texture: TextureId(number as u32), uv_set: 0, transform: Affine2::IDENTITY };
        for (where_, uvs) in [("near", &near), ("far", &far)] {
            group.bench_function(format!("{kind}/{where_}"), |bencher| {
                bencher.iter(|| uvs.iter().map(|&uv| textures.lookup(&reference, &[uv; 2]).x).sum::<f32>());
            });
        }
    }
}

/// Choosing one of many lamps and a point of it, as glossy surfaces all about do; and of glowing triangles the density that such a
/// choice has, where a path meets one by chance.
fn lights(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("light");
    group.throughput(Throughput::Elements(INPUTS.into()));
    let inputs = points().into_iter().map(|[x, y, z, u]| {
        let inwards = (0.5 - Vec3::new(x, y, z)).normalize_or(Vec3::Z);
        let receiver = Receiver::new(Frame::from_z(inwards), Vec3::new(0.6, 0.0, 0.8), [0.5, 0.5], 0.3);
        (20.0 * Vec3::new(x, y, z), receiver, u)
    });
    let inputs: Vec<_> = inputs.collect();
    for count in [10, 1000, 100_000] {
        for (kind, scene) in [("points", point_lights(count)), ("triangles", glowing_triangles(count))] {
            let sample = |(p, receiver, u): &(Vec3, Receiver, f32)| {
                scene.lights.sample(*p, receiver, *u, Vec2::new(*u, 1.0 - u))
            };
            group.bench_function(format!("{count}/{kind}/sample"), |bencher| {
                bencher.iter(|| inputs.iter().filter_map(sample).count());
            });
            let found: Vec<_> = inputs
                .iter()
                .filter_map(|input| match sample(input)?.source {
                    Source::Surface { object, primitive, point, .. } => {
                        Some((scene.objects[object as usize].emitter(primitive)?, input.0, point))
                    }
                    Source::Radiance(_) => None,
                })
                .collect();
            if found.is_empty() {
                continue;
            }
            let found: Vec<_> = found.iter().cycle().take(INPUTS as usize).collect();
            group.bench_function(format!("{count}/{kind}/pdf"), |bencher| {
                let pdf = |&&(emitter, p, point): &&_| scene.lights.mis_pdf_surface(emitter, p, point);
                bencher.iter(|| found.iter().map(pdf).sum::<f32>());
            });
        }
    }
    // One lamp, of a size that fills much of what is above.
    for (kind, size) in [("disk", "radius = 8"), ("rect", "size = [14, 14]")] {
        let scene = compiled(&format!(
            "[camera]\nposition = [0, 0, 3]\n[[light]]\ntype = \"{kind}\"\nposition = [10, 20, 10]\n\
             direction = [0, -1, 0]\n{size}"
        ));
        group.bench_function(format!("{kind}/sample"), |bencher| {
            let sample = |(p, receiver, u): &(Vec3, Receiver, f32)| {
                scene.lights.sample(*p, receiver, *u, Vec2::new(*u, 1.0 - u))
            };
            bencher.iter(|| inputs.iter().filter_map(sample).count());
        });
    }
}

fn point_lights(count: u32) -> Scene {
    let (mut world, settings) = world("[camera]\nposition = [0, 0, 3]");
    let lamp = |i: u32| {
        let [x, y, z, power] = PixelSampler::new(3, i, 0, 0).draw4(0);
        Light::Point { position: 20.0 * Vec3::new(x, y, z), intensity: Vec3::splat(0.1 + power) }
    };
    world.model.lights.extend((0..count).map(lamp));
    compile(world, &settings)
}

/// At the same places, of several sizes, turned every way.
fn glowing_triangles(count: u32) -> Scene {
    let (mut world, settings) = world(
        "sphere = [{ material = \"m\" }]\n[camera]\nposition = [0, 0, 3]\n[materials]\n\
         m = { type = \"emissive\", color = [1, 1, 1] }",
    );
    let material = world.spheres.remove(0).material;
    let corners = |i: u32| {
        let [x, y, z, power] = PixelSampler::new(3, i, 0, 0).draw4(0);
        let corner = 20.0 * Vec3::new(x, y, z);
        let edge = |a: f32, b: f32, c: f32| 0.2 * (Vec3::new(a, b, c) - 0.5);
        [corner, corner + edge(y, z, power), corner + edge(power, x, y)]
    };
    world.model.meshes.push(Mesh {
        positions: (0..count).flat_map(corners).collect(),
        triangles: (0..count).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect(),
        ..Mesh::default()
    });
    world.model.instances.push(Instance {
        name: String::new(),
        mesh: MeshId(0),
        to_world: Affine3A::IDENTITY,
        materials: vec![material],
    });
    compile(world, &settings)
}

fn environment(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("environment");
    group.throughput(Throughput::Elements(INPUTS.into()));
    let scene = scene("still-life");
    let environment = scene.lights.environment();
    let points = points();
    group.bench_function("sample", |bencher| {
        bencher.iter(|| points.iter().filter_map(|p| environment.sample(Vec2::new(p[0], p[1]))).count());
    });
    let directions: Vec<Vec3> = points
        .iter()
        .filter_map(|p| environment.sample(Vec2::new(p[0], p[1])))
        .map(|sample| sample.wi)
        .collect();
    group.bench_function("look", |bencher| {
        bencher.iter(|| directions.iter().map(|&d| environment.look(d).1).sum::<f32>());
    });
}

/// Whole paths, one thread.
fn paths(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("path");
    group.throughput(Throughput::Elements(INPUTS.into()));
    for name in ["cover", "cornell", "still-life", "interior", "street"] {
        let scene = scene(name);
        group.bench_function(name, |bencher| {
            bencher.iter(|| {
                let mut counts = RayCounts::default();
                pixels().map(|[x, y]| sample_pixel(&scene, &Rims::NONE, [x, y], 5, &mut counts)).sum::<Vec3>()
            });
        });
    }
}

// Inputs

const SIZE: [u32; 2] = [320, 180];

/// One of the project's scenes, with small pictures.
fn scene(name: &str) -> Scene {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("scenes/{name}.toml"));
    let mut valid = scene::load(&path).unwrap_or_else(|faults| panic!("{}: {faults:?}", path.display()));
    valid.render.size = SIZE;
    let (world, settings, _) = assemble(valid).expect("its files are there");
    compile(world, &settings)
}

fn world(text: &str) -> (World, rayo::render::Settings) {
    let mut valid = scene::parse(text, Path::new("bench.toml")).expect("a valid scene");
    valid.render.size = SIZE;
    let (world, settings, _) = assemble(valid).expect("a scene without files");
    (world, settings)
}

fn compiled(text: &str) -> Scene {
    let (world, settings) = world(text);
    compile(world, &settings)
}

/// Spread over the picture.
fn pixels() -> impl Iterator<Item = [u32; 2]> {
    points().into_iter().map(|[x, y, ..]| [(x * SIZE[0] as f32) as u32, (y * SIZE[1] as f32) as u32])
}

fn points() -> Vec<[f32; 4]> {
    (0..INPUTS).map(|i| PixelSampler::new(0, 0, 0, i).draw4(0)).collect()
}

/// Neighbours first: 32 × 32 pixels in rows, every fifth.
fn camera_rays(scene: &Scene) -> Vec<Ray> {
    let at = |i: u32| Vec2::new((i % 32 * SIZE[0] / 32) as f32, (i / 32 * SIZE[1] / 32) as f32) + 0.5;
    (0..INPUTS).map(|i| scene.camera.ray(at(i), Vec2::splat(0.5))).collect()
}

/// From where those hit, to anywhere above the surface.
fn bounce_rays(scene: &Scene, rays: &[Ray]) -> Vec<Ray> {
    let hits: Vec<_> = rays.iter().filter_map(|ray| Some((ray, scene.accel.closest(ray)?))).collect();
    let bounced = hits.iter().cycle().zip(points()).map(|((ray, hit), [u, v, ..])| {
        let point = scene.surface_point(ray, hit);
        let (z, turn) = (1.0 - 2.0 * u, std::f32::consts::TAU * v);
        let side = (1.0 - z * z).sqrt();
        let direction = Vec3::new(side * turn.cos(), side * turn.sin(), z);
        let normal = if ray.direction.dot(point.ng) < 0.0 { point.ng } else { -point.ng };
        let direction = if direction.dot(normal) < 0.0 { -direction } else { direction };
        Ray::new(point.position + 1e-4 * normal, direction)
    });
    bounced.take(INPUTS as usize).collect()
}
