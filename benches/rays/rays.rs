//! The rays of the race: from a camera, in random directions from what the camera sees, and from there to a lamp.

use glam::Vec3;
use rayo::{
    accel::Hit,
    geometry::{Frame, Ray},
};

use crate::{
    random::uniform,
    scenes::{Mesh, World},
};

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Neighbours in the picture, one after the other.
    Primary,
    /// Cosine-distributed about the normal of what is seen, shuffled.
    Bounce,
    /// From what is seen to a point of the lamp.
    Shadow,
}

pub struct RaySet {
    pub kind: Kind,
    pub rays: Vec<Ray>,
}

impl RaySet {
    /// Of each kind; `closest` finds what is seen. The picture has `size` × `size` pixels.
    pub fn all(world: &World, size: u32, closest: impl Fn(&Ray) -> Option<Hit>) -> [Self; 3] {
        let primary = primary(world, size);
        let (mut bounce, mut shadow) = (Vec::new(), Vec::new());
        for (i, ray) in (0..).zip(&primary) {
            let Some(hit) = closest(ray) else { continue };
            let normal = normal(world, &hit);
            let normal = if normal.dot(ray.direction) < 0.0 { normal } else { -normal };
            let point = ray.at(hit.t) + 1e-4 * hit.t * normal;
            let (r, phi) = (uniform(i, 0).sqrt(), std::f32::consts::TAU * uniform(i, 1));
            let local = Vec3::new(r * phi.cos(), r * phi.sin(), (1.0 - r * r).sqrt());
            bounce.push(Ray::new(point, Frame::from_z(normal).to_world(local)));
            let (middle, half) = world.lamp;
            let lamp = middle + half * (2.0 * Vec3::new(uniform(i, 2), 0.5, uniform(i, 3)) - Vec3::ONE);
            shadow.push(Ray { t_max: 1.0, ..Ray::new(point, lamp - point) });
        }
        for i in (1..bounce.len()).rev() {
            bounce.swap(i, (uniform(i as u32, 4) * (i + 1) as f32) as usize);
        }
        [(Kind::Primary, primary), (Kind::Bounce, bounce), (Kind::Shadow, shadow)]
            .map(|(kind, rays)| Self { kind, rays })
    }
}

/// 50 degrees wide, row by row.
fn primary(world: &World, size: u32) -> Vec<Ray> {
    let forward = (world.target - world.eye).normalize();
    let right = forward.cross(Vec3::Y).normalize();
    let up = right.cross(forward);
    let tan = 25f32.to_radians().tan();
    let share = |i: u32| tan * (2.0 * (i as f32 + 0.5) / size as f32 - 1.0);
    (0..size)
        .flat_map(|y| (0..size).map(move |x| (x, y)))
        .map(|(x, y)| Ray::new(world.eye, (forward + share(x) * right - share(y) * up).normalize()))
        .collect()
}

fn normal(world: &World, hit: &Hit) -> Vec3 {
    let (mesh, to_world) = &world.instances[hit.object as usize];
    let mesh = &world.meshes[*mesh];
    let [a, b, c] = mesh.triangles[hit.primitive as usize]
        .map(|i| to_world.transform_point3(mesh.positions()[i as usize]));
    (b - a).cross(c - a).normalize_or(Vec3::Y)
}

/// From the middle of a closed mesh at its vertices and at points of its edges.
pub fn at_edges(mesh: &Mesh, count: u32) -> Vec<Ray> {
    (0..count)
        .map(|i| {
            let triangle = mesh.triangles[i as usize * 7919 % mesh.triangles.len()];
            let [a, b, _] = triangle.map(|k| mesh.positions()[k as usize]);
            let target = if i % 3 == 0 { a } else { a.lerp(b, uniform(i, 0)) };
            let origin = 0.2 * Vec3::new(uniform(i, 1), uniform(i, 2), uniform(i, 3));
            Ray::new(origin, target - origin)
        })
        .collect()
}
