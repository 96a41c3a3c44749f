//! What is raced on: scenes of 50 thousand to 10 million triangles, made here with fixed seeds, and glTF files by path.

use std::{f32::consts::TAU, path::Path};

use glam::{Affine3A, Quat, Vec2, Vec3};
use rayo::sampling::warp::uniform_sphere;

use crate::random::uniform;

pub struct Mesh {
    positions: Vec<Vec3>,
    pub triangles: Vec<[u32; 3]>,
}

impl Mesh {
    fn new(mut positions: Vec<Vec3>, triangles: Vec<[u32; 3]>) -> Self {
        positions.push(Vec3::ZERO);
        Self { positions, triangles }
    }

    pub fn positions(&self) -> &[Vec3] {
        &self.positions[..self.positions.len() - 1]
    }

    /// With one more at the end than the mesh has.
    pub fn padded_positions(&self) -> &[Vec3] {
        &self.positions
    }
}

pub struct World {
    pub name: String,
    pub meshes: Vec<Mesh>,
    /// Which mesh, and its place in the world.
    pub instances: Vec<(usize, Affine3A)>,
    pub eye: Vec3,
    pub target: Vec3,
    /// Middle and half width of the square lamp that shadow rays go to.
    pub lamp: (Vec3, f32),
}

impl World {
    fn of_mesh(name: impl Into<String>, mesh: Mesh) -> Self {
        Self {
            name: name.into(),
            meshes: vec![mesh],
            instances: vec![(0, Affine3A::IDENTITY)],
            eye: Vec3::new(3.4, 1.6, 3.4),
            target: Vec3::new(0.0, 0.4, 0.0),
            lamp: (Vec3::new(3.0, 6.0, 2.0), 1.0),
        }
    }

    /// Instanced triangles are counted as often as they are placed.
    pub fn triangles(&self) -> usize {
        self.instances.iter().map(|(mesh, _)| self.meshes[*mesh].triangles.len()).sum()
    }

    /// The scene of this name; `None` where there is none.
    pub fn named(name: &str) -> Option<Self> {
        let world = match name {
            "land 50k" => Self::of_mesh(name, land(50_000)),
            "land 1M" => Self::of_mesh(name, land(1_000_000)),
            "land 10M" => Self::of_mesh(name, land(10_000_000)),
            "blades 500k" => Self::of_mesh(name, blades(500_000)),
            "clutter 200k" => Self::of_mesh(name, clutter(200_000)),
            "grove 20k × 20k" => grove(name, 20_000),
            _ => return None,
        };
        Some(world)
    }

    pub fn names() -> [&'static str; 6] {
        ["land 50k", "clutter 200k", "blades 500k", "land 1M", "land 10M", "grove 20k × 20k"]
    }

    /// Looked at from a corner above its bounds.
    pub fn gltf(path: &Path) -> Result<Self, String> {
        let world = rayo::import::model(path, &Default::default())
            .map_err(|problems| format!("{}: {} problems", path.display(), problems.len()))?;
        let meshes: Vec<Mesh> =
            world.meshes.into_iter().map(|m| Mesh::new(m.positions, m.triangles)).collect();
        let instances: Vec<_> = world.instances.iter().map(|i| (i.mesh.index(), i.to_world)).collect();
        let (mut low, mut high) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
        for (mesh, to_world) in &instances {
            for &p in meshes[*mesh].positions() {
                let p = to_world.transform_point3(p);
                (low, high) = (low.min(p), high.max(p));
            }
        }
        let (middle, half) = (0.5 * (low + high), 0.5 * (high - low));
        Ok(Self {
            name: path.file_stem().unwrap_or_default().to_string_lossy().into_owned(),
            meshes,
            instances,
            eye: middle + half * Vec3::new(0.9, 0.6, 1.2),
            target: middle,
            lamp: (middle + half * Vec3::new(0.3, 2.0, 0.5), 0.1 * half.max_element()),
        })
    }
}

/// Smooth between random values at the corners of a grid.
fn noise(p: Vec3) -> f32 {
    let cell = p.floor();
    let f = p - cell;
    let f = f * f * (3.0 - 2.0 * f);
    (0..8u32)
        .map(|corner| {
            let bit = |axis: u32| (corner >> axis & 1) as f32;
            let at = (cell + Vec3::new(bit(0), bit(1), bit(2))).as_ivec3();
            let weight = |axis: u32, f: f32| if bit(axis) == 1.0 { f } else { 1.0 - f };
            let value =
                uniform(at.x as u32, (at.y as u32).wrapping_mul(7919) ^ (at.z as u32).wrapping_mul(104_729));
            weight(0, f.x) * weight(1, f.y) * weight(2, f.z) * value
        })
        .sum()
}

fn fractal(p: Vec3) -> f32 {
    (0..5).map(|octave| 0.5f32.powi(octave + 1) * noise(p * 2.03f32.powi(octave) + 7.1 * octave as f32)).sum()
}

fn height(x: f32, z: f32) -> f32 {
    1.2 * fractal(Vec3::new(0.8 * x, 0.3, 0.8 * z)) - 0.9
}

/// `columns` × `rows` squares, two triangles each.
fn grid(columns: usize, rows: usize, point: impl Fn(f32, f32) -> Vec3) -> (Vec<Vec3>, Vec<[u32; 3]>) {
    let share = |i: usize, n: usize| i as f32 / n as f32;
    let positions = (0..=rows)
        .flat_map(|j| (0..=columns).map(move |i| (i, j)))
        .map(|(i, j)| point(share(i, columns), share(j, rows)))
        .collect();
    let triangles = (0..rows)
        .flat_map(|j| (0..columns).map(move |i| (j * (columns + 1) + i) as u32))
        .flat_map(|a| {
            let below = a + columns as u32 + 1;
            [[a, below, a + 1], [a + 1, below, below + 1]]
        })
        .collect();
    (positions, triangles)
}

fn append((positions, triangles): &mut (Vec<Vec3>, Vec<[u32; 3]>), other: (Vec<Vec3>, Vec<[u32; 3]>)) {
    let first = positions.len() as u32;
    positions.extend(other.0);
    triangles.extend(other.1.into_iter().map(|t| t.map(|i| i + first)));
}

fn hills(triangles: usize) -> (Vec<Vec3>, Vec<[u32; 3]>) {
    let side = (triangles as f32 / 2.0).sqrt() as usize;
    grid(side, side, |u, v| {
        let (x, z) = (10.0 * u - 5.0, 10.0 * v - 5.0);
        Vec3::new(x, height(x, z), z)
    })
}

fn boulder(triangles: usize) -> (Vec<Vec3>, Vec<[u32; 3]>) {
    let rows = (triangles as f32 / 4.0).sqrt() as usize;
    grid(2 * rows, rows, |u, v| {
        let (phi, theta) = (TAU * (u % 1.0), 0.5 * TAU * v);
        let direction = Vec3::new(theta.sin() * phi.cos(), theta.cos(), theta.sin() * phi.sin());
        direction * (0.9 + 0.35 * fractal(3.0 * direction) + 0.03 * noise(60.0 * direction))
    })
}

/// Hills, and a boulder above them.
fn land(triangles: usize) -> Mesh {
    let mut all = hills(triangles / 2);
    let mut above = boulder(triangles / 2);
    above.0.iter_mut().for_each(|p| p.y += 1.0);
    append(&mut all, above);
    Mesh::new(all.0, all.1)
}

/// Long thin triangles in all directions, on hills.
fn blades(triangles: u32) -> Mesh {
    let mut all = hills(triangles as usize / 10);
    for i in 0..triangles * 9 / 10 {
        let u = |k: u32| uniform(i, k);
        let (x, z) = (9.0 * u(0) - 4.5, 9.0 * u(1) - 4.5);
        let root = Vec3::new(x, height(x, z), z);
        let length = 0.1 + 0.7 * u(2) * u(3);
        let tip = root + length * Vec3::new(1.6 * u(4) - 0.8, 1.0, 1.6 * u(5) - 0.8);
        let side = (0.004 + 0.004 * u(6)) * Vec3::new((TAU * u(7)).cos(), 0.0, (TAU * u(7)).sin());
        append(&mut all, (vec![root - side, root + side, tip], vec![[0, 1, 2]]));
    }
    Mesh::new(all.0, all.1)
}

/// Triangles of sizes from a millimetre to a metre, in a room of six walls.
fn clutter(triangles: u32) -> Mesh {
    let mut all = (Vec::new(), Vec::new());
    for axis in 0..3 {
        for side in [-5.0, 5.0] {
            let (u, v) = (Vec3::AXES[(axis + 1) % 3], Vec3::AXES[(axis + 2) % 3]);
            let wall = |a: f32, b: f32| side * Vec3::AXES[axis] + (10.0 * a - 5.0) * u + (10.0 * b - 5.0) * v;
            append(&mut all, grid(1, 1, wall));
        }
    }
    for i in 0..triangles {
        let direction = |k: u32| uniform_sphere(Vec2::new(uniform(i, k), uniform(i, k + 1)));
        let at = 9.8 * Vec3::new(uniform(i, 0), uniform(i, 1), uniform(i, 2)) - 4.9;
        let size = 10f32.powf(-3.0 * uniform(i, 3).sqrt());
        append(&mut all, (vec![at, at + size * direction(4), at + size * direction(6)], vec![[0, 1, 2]]));
    }
    Mesh::new(all.0, all.1)
}

/// `count` boulders of 20 thousand triangles on hills.
fn grove(name: &str, count: u32) -> World {
    let (positions, triangles) = boulder(20_000);
    let ground = hills(100_000);
    let mut world = World::of_mesh(name, Mesh::new(ground.0, ground.1));
    world.meshes.push(Mesh::new(positions, triangles));
    for i in 0..count {
        let (x, z) = (10.0 * uniform(i, 0) - 5.0, 10.0 * uniform(i, 1) - 5.0);
        let size =
            Vec3::new(0.02 + 0.04 * uniform(i, 2), 0.04 + 0.1 * uniform(i, 3), 0.02 + 0.04 * uniform(i, 4));
        let turn = Quat::from_rotation_y(TAU * uniform(i, 5)) * Quat::from_rotation_x(uniform(i, 6) - 0.5);
        let place = Vec3::new(x, height(x, z), z);
        world.instances.push((1, Affine3A::from_scale_rotation_translation(size, turn, place)));
    }
    world
}

/// A closed ball of triangles that share their vertices, but for its seam and poles.
pub fn ball(name: &str, triangles: usize) -> World {
    let rows = (triangles as f32 / 4.0).sqrt() as usize;
    let (positions, triangles) = grid(2 * rows, rows, |u, v| {
        // (exactly the same points on both sides of the seam, and at the poles)
        let (phi, theta) = (TAU * (u % 1.0), 0.5 * TAU * v);
        let r = if v == 0.0 || v == 1.0 { 0.0 } else { theta.sin() };
        Vec3::new(r * phi.cos(), theta.cos(), r * phi.sin())
    });
    World::of_mesh(name, Mesh::new(positions, triangles))
}
