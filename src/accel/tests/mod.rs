//! The trees against testing everything, one by one, with both kernels.

mod hostile;

use glam::{Quat, Vec2};

use super::*;
use crate::{
    geometry::{
        quad, sphere,
        triangle::{self, Shear},
    },
    sampling::{stats::uniform, warp::uniform_sphere},
};

#[derive(Clone, Default)]
struct Soup {
    positions: Vec<Vec3>,
    triangles: Vec<[u32; 3]>,
}

impl Soup {
    fn add(&mut self, corners: [Vec3; 3]) {
        let first = self.positions.len() as u32;
        self.positions.extend(corners);
        self.triangles.push([first, first + 1, first + 2]);
    }

    fn blas(&self) -> Blas {
        self.built(Quality::Best, true)
    }

    fn built(&self, quality: Quality, filtered: bool) -> Blas {
        Blas::build(&self.positions, &self.triangles, Build { quality, filtered })
    }

    fn corners(&self, i: usize) -> [Vec3; 3] {
        self.triangles[i].map(|k| self.positions[k as usize])
    }
}

fn random(i: u32, k: u32) -> Vec3 {
    2.0 * Vec3::new(uniform(i, 3 * k), uniform(i, 3 * k + 1), uniform(i, 3 * k + 2)) - Vec3::ONE
}

fn direction(i: u32, k: u32) -> Vec3 {
    uniform_sphere(Vec2::new(uniform(i, k), uniform(i, k + 1)))
}

/// Triangles of about `size` with corners in about the unit cube; every fourth is a long thin one.
fn soup(n: u32, size: f32) -> Soup {
    let mut soup = Soup::default();
    for i in 0..n {
        let (a, stretch) = (random(i, 100), if i % 4 == 0 { 20.0 } else { 1.0 });
        let b = a + size * stretch * random(i, 101);
        soup.add([a, b, a.lerp(b, 0.5) + size * random(i, 102)]);
    }
    soup
}

/// A closed sphere of triangles, in rings.
fn globe(rings: u32, segments: u32) -> Soup {
    let mut globe = Soup::default();
    for ring in 0..=rings {
        for segment in 0..segments {
            let theta = std::f32::consts::PI * ring as f32 / rings as f32;
            let phi = std::f32::consts::TAU * segment as f32 / segments as f32;
            // (the poles are single points, though many vertices)
            let r = if ring == 0 || ring == rings { 0.0 } else { theta.sin() };
            globe.positions.push(Vec3::new(r * phi.cos(), theta.cos(), r * phi.sin()));
        }
    }
    for ring in 0..rings {
        for segment in 0..segments {
            let next = (segment + 1) % segments;
            let at = |ring: u32, segment: u32| ring * segments + segment;
            let (a, b) = (at(ring, segment), at(ring, next));
            let (c, d) = (at(ring + 1, segment), at(ring + 1, next));
            globe.triangles.extend([[a, b, c], [b, d, c]]);
        }
    }
    globe
}

/// A scene kept both ways.
#[derive(Default)]
struct Scene {
    soups: Vec<Soup>,
    objects: Vec<Object>,
}

impl Scene {
    fn add(&mut self, shape: Shape) {
        self.objects.push(Object { shape, filtered: false });
    }

    fn of_mesh(soup: Soup) -> Self {
        let mut scene = Self { soups: vec![soup], objects: Vec::new() };
        scene.add(Shape::Mesh { blas: 0, to_world: Affine3A::IDENTITY });
        scene
    }

    fn accel(&self) -> Accel {
        Accel::build(self.soups.iter().map(Soup::blas).collect(), self.objects.clone())
    }

    /// Every primitive of every object.
    fn brute_force(&self, ray: &Ray, mut accept: impl FnMut(&Hit) -> bool) -> Option<Hit> {
        let mut best: Option<Hit> = None;
        let mut offer = |hit: Hit| {
            let key = |h: &Hit| (h.t, h.object, h.primitive);
            if best.is_none_or(|b| key(&hit) < key(&b)) && accept(&hit) {
                best = Some(hit);
            }
        };
        for (object, shape) in self.objects.iter().map(|o| &o.shape).enumerate() {
            let hit = |t, u, v, primitive| Hit { t, u, v, object: object as u32, primitive };
            match *shape {
                Shape::Sphere { center, radius } => sphere::intersect_line(ray, center, radius)
                    .into_iter()
                    .flatten()
                    .filter(|&t| t > ray.t_min && t < ray.t_max)
                    .for_each(|t| offer(hit(t, 0.0, 0.0, 0))),
                Shape::Quad { origin, u, v, round } => {
                    if let Some(h) = quad::Quad::new(origin, u, v, round).and_then(|q| q.intersect(ray)) {
                        offer(hit(h.t, h.a, h.b, 0));
                    }
                }
                Shape::Mesh { blas, to_world } => {
                    let to_object = objects::inverse(&to_world).expect("test scenes are invertible");
                    let ray = Ray {
                        origin: to_object.transform_point3(ray.origin),
                        direction: to_object.transform_vector3(ray.direction),
                        ..*ray
                    };
                    let (soup, shear) = (&self.soups[blas as usize], Shear::new(ray.direction));
                    for i in 0..soup.triangles.len() {
                        if let Some(h) = triangle::intersect(&ray, &shear, soup.corners(i)) {
                            offer(hit(h.t, h.u, h.v, i as u32));
                        }
                    }
                }
            }
        }
        best
    }

    /// Both kernels give the hit that testing everything gives, to the bit.
    fn check(&self, rays: impl Iterator<Item = Ray>) {
        let mut hits = 0;
        let accels = kernels(self.accel());
        for ray in rays {
            let expected = self.brute_force(&ray, |_| true);
            hits += expected.is_some() as u32;
            for accel in &accels {
                assert_eq!(accel.closest(&ray), expected, "{ray:?}");
                assert_eq!(accel.occluded(&ray), expected.is_some(), "{ray:?}");
                assert_eq!(accel.closest_where(&ray, |_| panic!("nothing is filtered")), expected);
                assert_eq!(accel.occluded_where(&ray, |_| panic!("nothing is filtered")), expected.is_some());
            }
        }
        assert!(hits > 100, "only {hits} rays hit anything: the test shows little");
    }
}

/// The same trees, once with the kernel of this machine, once with the portable one.
fn kernels(accel: Accel) -> Vec<Accel> {
    let portable = Accel {
        #[cfg(target_arch = "x86_64")]
        avx2: false,
        ..accel.clone()
    };
    vec![accel, portable]
}

/// From around the unit cube, through it; every third within limits, every seventh along an axis.
fn rays(n: u32) -> impl Iterator<Item = Ray> {
    (0..n).map(|i| {
        let origin = 2.0 * random(i, 0);
        let mut direction = (random(i, 1) - origin) * (0.1 + uniform(i, 7));
        if i % 7 == 0 {
            direction *= Vec3::AXES[i as usize % 3];
        }
        let mut ray = Ray::new(origin, direction);
        if i % 3 == 0 {
            ray.t_min = uniform(i, 8) * 2.0;
            ray.t_max = ray.t_min + uniform(i, 9) * 4.0;
        }
        ray
    })
}

#[test]
fn soups_of_every_size() {
    for (n, size) in [(1, 2.0), (9, 1.0), (100, 0.5), (3000, 0.05)] {
        let scene = Scene::of_mesh(soup(n, size));
        let aimed = rays(1500).enumerate().map(|(i, mut ray)| {
            // half of them at a triangle, for the small soups' sake
            if i % 2 == 0 {
                let [a, b, c] = scene.soups[0].corners(i % n as usize);
                ray.direction = (a + b + c) / 3.0 - ray.origin;
            }
            ray
        });
        scene.check(aimed);
    }
}

#[test]
fn instances_spheres_and_quads_together() {
    let mut scene = Scene { soups: vec![soup(200, 0.3), globe(8, 12)], objects: Vec::new() };
    for i in 0..60 {
        let scale = Vec3::new(0.1 + uniform(i, 50), 0.3, if i % 3 == 0 { -0.4 } else { 0.2 });
        let rotation = Quat::from_axis_angle(direction(i, 51), 6.0 * uniform(i, 53));
        let to_world = Affine3A::from_scale_rotation_translation(scale, rotation, random(i, 20));
        scene.add(match i % 4 {
            0 | 1 => Shape::Mesh { blas: i % 4, to_world },
            2 => Shape::Sphere { center: random(i, 20), radius: 0.02 + 0.2 * uniform(i, 54) },
            _ => Shape::Quad {
                origin: random(i, 20),
                u: 0.5 * random(i, 21),
                v: 0.5 * random(i, 22),
                round: i % 8 == 3,
            },
        });
    }
    scene.check(rays(1500));
}

#[test]
fn coincident_hits_go_to_the_lowest_numbers() {
    let mut quilt = Soup::default();
    for _ in 0..300 {
        quilt.add([Vec3::new(-1.0, -1.0, 0.0), Vec3::new(3.0, -1.0, 0.0), Vec3::new(-1.0, 3.0, 0.0)]);
    }
    let mut scene = Scene { soups: vec![quilt], objects: Vec::new() };
    for _ in 0..5 {
        scene.add(Shape::Mesh { blas: 0, to_world: Affine3A::IDENTITY });
    }
    for accel in kernels(scene.accel()) {
        let hit = accel.closest(&Ray::new(Vec3::new(0.1, 0.2, 1.0), Vec3::NEG_Z)).expect("covers the origin");
        assert_eq!((hit.t, hit.object, hit.primitive), (1.0, 0, 0));
    }
}

/// Whatever the trees are like, and whether or not triangles that are never the nearest are kept.
#[test]
fn hits_do_not_depend_on_how_trees_are_built() {
    let mut soup = soup(1500, 0.2);
    let twice: Vec<[u32; 3]> = soup.triangles[..700].iter().rev().flat_map(|&t| [t; 12]).collect();
    soup.triangles.extend(twice);
    let whole = |blas| Object { shape: Shape::Mesh { blas, to_world: Affine3A::IDENTITY }, filtered: false };
    let accels: Vec<Accel> = [Quality::Fast, Quality::Balanced, Quality::Best]
        .into_iter()
        .flat_map(|quality| [false, true].map(|filtered| soup.built(quality, filtered)))
        .map(|blas| Accel::build(vec![blas], vec![whole(0)]))
        .collect();
    assert!(accels.windows(2).all(|pair| pair[0].memory() != pair[1].memory()), "all the same trees");
    let same = |ray: &Ray| {
        let hit = accels[0].closest(ray);
        assert!(hit.is_none_or(|h| h.primitive < 1500), "a copy is hit instead of the first");
        accels.iter().all(|a| a.closest(ray) == hit && a.occluded(ray) == hit.is_some())
    };
    assert!(rays(3000).all(|ray| same(&ray)));
}

#[test]
fn closed_meshes_are_tight() {
    let shapes = [globe(24, 40), globe(3, 3)];
    for (globe, shift) in shapes.iter().zip([Vec3::ZERO, Vec3::new(100.0, -30.0, 7.0)]) {
        let mut soup = globe.clone();
        soup.positions.iter_mut().for_each(|p| *p += shift);
        let accels = kernels(Scene::of_mesh(soup.clone()).accel());
        let leaks = (0..30_000u32)
            .flat_map(|i| {
                let [a, b, _] = soup.corners((i as usize * 7919) % soup.triangles.len());
                let target = if i % 2 == 0 { a } else { a.lerp(b, uniform(i, 0)) };
                let origin = shift + 0.2 * random(i, 1);
                let ray = Ray::new(origin, target - origin);
                accels.iter().map(move |accel| accel.closest(&ray).is_none() || !accel.occluded(&ray))
            })
            .filter(|&leak| leak)
            .count();
        assert_eq!(leaks, 0);
    }
}

/// Rays that lie in the planes between the children, with directions of exactly zero.
#[test]
fn axis_parallel_rays_on_box_faces() {
    let mut grid = Soup::default();
    for i in 0..32u32 {
        for j in 0..32u32 {
            let p = |i: u32, j: u32| Vec3::new(i as f32 - 16.0, j as f32 - 16.0, 0.25 * (i * j % 3) as f32);
            grid.add([p(i, j), p(i + 1, j), p(i, j + 1)]);
            grid.add([p(i + 1, j + 1), p(i, j + 1), p(i + 1, j)]);
        }
    }
    let down = (0..33u32 * 33).map(|i| {
        let (x, y) = ((i % 33) as f32 - 16.0, (i / 33) as f32 - 16.0);
        let zero = if i % 2 == 0 { 0.0 } else { -0.0 };
        Ray::new(Vec3::new(x, y, 5.0), Vec3::new(zero, -zero, -1.0))
    });
    let scene = Scene::of_mesh(grid);
    let accel = scene.accel();
    assert!(down.clone().all(|ray| accel.occluded(&ray)), "a ray slipped between two boxes");
    scene.check(down);
}

#[test]
fn filtered_objects_ask_and_others_do_not() {
    let wall = |z: f32, filtered| Object {
        shape: Shape::Quad {
            origin: Vec3::new(-1.0, -1.0, z),
            u: 2.0 * Vec3::X,
            v: 2.0 * Vec3::Y,
            round: false,
        },
        filtered,
    };
    let ball =
        Object { shape: Shape::Sphere { center: Vec3::new(0.0, 0.0, -3.0), radius: 1.0 }, filtered: true };
    let accel = Accel::build(Vec::new(), vec![wall(-1.0, true), ball, wall(-5.0, false)]);
    let ray = Ray::new(Vec3::ZERO, Vec3::NEG_Z);
    for accel in kernels(accel) {
        let through = |allowed: &[f32]| {
            accel.closest_where(&ray, |hit| {
                assert_ne!(hit.object, 2, "asked about an object that is not filtered");
                allowed.contains(&hit.t)
            })
        };
        assert_eq!(accel.closest(&ray).map(|h| h.t), Some(1.0));
        assert_eq!(through(&[1.0]).map(|h| h.t), Some(1.0));
        assert_eq!(through(&[2.0, 4.0]).map(|h| h.t), Some(2.0));
        assert_eq!(through(&[4.0]).map(|h| (h.t, h.object)), Some((4.0, 1)), "the far side of the sphere");
        assert_eq!(through(&[]).map(|h| (h.t, h.object)), Some((5.0, 2)));
        assert!(accel.occluded_where(&ray, |_| false));
        assert!(!accel.occluded_where(&Ray { t_max: 4.5, ..ray }, |_| false));
        assert!(accel.occluded_where(&Ray { t_max: 4.5, ..ray }, |h| h.t == 4.0));
    }
}

#[test]
fn filtered_meshes_skip_single_triangles() {
    let mut scene = Scene::of_mesh(soup(400, 0.3));
    scene.objects[0].filtered = true;
    let keep = |hit: &Hit| hit.primitive.is_multiple_of(3);
    for accel in kernels(scene.accel()) {
        for ray in rays(800) {
            let expected = scene.brute_force(&ray, keep);
            assert_eq!(accel.closest_where(&ray, keep), expected);
            assert_eq!(accel.occluded_where(&ray, keep), expected.is_some());
        }
    }
}

/// Who counts what a ray passes must not meet it twice.
#[test]
fn nothing_is_asked_about_twice() {
    let mut scene = Scene::of_mesh(soup(2000, 0.1));
    scene.objects[0].filtered = true;
    for accel in kernels(scene.accel()) {
        for ray in rays(2000) {
            let mut asked = Vec::new();
            let occluded = accel.occluded_where(&ray, |hit| {
                asked.push(hit.primitive);
                false
            });
            let all = asked.len();
            asked.sort_unstable();
            asked.dedup();
            assert!(!occluded && asked.len() == all, "{all} asked, {} of them different", asked.len());
        }
    }
}

#[test]
fn a_hundred_thousand_instances() {
    let mut scene = Scene { soups: vec![globe(4, 6)], objects: Vec::new() };
    for i in 0..100_000 {
        let to_world = Affine3A::from_scale_rotation_translation(
            Vec3::splat(0.005),
            Quat::from_axis_angle(direction(i, 0), uniform(i, 2)),
            random(i, 3),
        );
        scene.add(Shape::Mesh { blas: 0, to_world });
    }
    let accels = kernels(scene.accel());
    let hits = rays(2000).filter(|ray| {
        let hit = accels[0].closest(ray);
        assert!(accels.iter().all(|accel| accel.closest(ray) == hit && accel.occluded(ray) == hit.is_some()));
        hit.is_some()
    });
    assert!(hits.count() > 500);
    for ray in rays(20) {
        assert_eq!(accels[0].closest(&ray), scene.brute_force(&ray, |_| true));
    }
}
