//! Emitting surfaces as lights: points spread evenly over the area, each shining as the cosine to its normal.
//!
//! ```text
//! E = ∫ L cos θ cos θ' / d² dA  ≈  Σᵢ (L A / N) cos θᵢ cos θ'ᵢ / dᵢ²
//! ```
//!
//! POV-Ray's own `area_light` has no cos θ' of the emitter and one shadow for all of its points; here every point casts
//! its own. Quads have a Fibonacci lattice, whose N points are N different places along either side, so that a
//! penumbra has N steps; disks and spheres a spiral of the golden angle.

use std::f32::consts::{PI, TAU};

use glam::{Vec2, Vec3};

use super::{light::patch, shines};
use crate::{
    color::luminance,
    export::note::Notes,
    texture::Textures,
    world::{Emission, Instance, Mesh, Quad, Sphere, World},
};

/// Lattices: N and its generator.
const LATTICES: [(usize, usize); 5] = [(89, 55), (55, 34), (21, 13), (13, 8), (5, 3)];
/// Points of all emitters, where there are not too many emitters for five each.
const BUDGET: usize = 180;
const MOST_EMITTERS: usize = BUDGET / 5;
/// How far before its surface a point is, in units: POV-Ray would find the surface between it and what it lights.
const BEFORE: f32 = 2e-3;
const GOLDEN: f32 = 2.399_963_2;

struct Sample {
    position: Vec3,
    normal: Vec3,
    uvs: [Vec2; 2],
}

enum Shape<'a> {
    Quad(&'a Quad),
    Sphere(&'a Sphere),
    /// With the triangles that emit.
    Mesh(&'a Instance, &'a Mesh, Vec<usize>),
}

struct Emitter<'a> {
    shape: Shape<'a>,
    emission: &'a Emission,
    area: f32,
    name: String,
}

/// `unit` is POV-Ray units per metre. Empty where nothing emits.
pub fn lights(world: &World, unit: f32, notes: &mut Notes) -> String {
    let mut emitters = emitters(world);
    let power = |e: &Emitter| e.area * luminance(e.emission.color.factor) * e.emission.strength;
    emitters.sort_by(|a, b| power(b).total_cmp(&power(a)));
    for weak in emitters.drain(emitters.len().min(MOST_EMITTERS)..) {
        notes.dropped(
            weak.name,
            format!("its light on others: only the {MOST_EMITTERS} strongest surfaces are lights"),
        );
    }
    let share = BUDGET / emitters.len().max(1);
    let lattice = LATTICES.into_iter().find(|&(n, _)| n <= share).unwrap_or((5, 3));
    // Cloning the pictures is worth it only for textured lights.
    let textures = emitters
        .iter()
        .any(|e| e.emission.color.texture.is_some())
        .then(|| Textures::new(world.model.images.clone(), world.model.textures.clone()));
    let mut out = String::new();
    for emitter in &emitters {
        let n = lattice.0;
        notes.approximated(
            emitter.name.clone(),
            format!(
                "as a light it is {n} points, each with 1/{n} of its area A and the cosine to its normal: irradiance at \
                 distance d is off by about A / {n} d², and a penumbra has {n} steps"
            ),
        );
        for sample in samples(emitter, lattice) {
            let emission = emitter.emission;
            let color = match (&textures, &emission.color.texture) {
                (Some(textures), Some(map)) => {
                    emission.color.factor * textures.lookup(map, &sample.uvs).truncate()
                }
                _ => emission.color.factor,
            };
            let intensity = color * (emission.strength * emitter.area / n as f32 * unit * unit);
            if !(intensity.is_finite() && intensity.max_element() > 0.0) {
                continue;
            }
            let sides = if emission.two_sided { &[1.0, -1.0][..] } else { &[1.0] };
            for side in sides {
                let normal = side * sample.normal;
                out.push_str(&patch(sample.position * unit + BEFORE * normal, normal, intensity));
            }
        }
    }
    out
}

fn emitters(world: &World) -> Vec<Emitter<'_>> {
    let emission = |id: crate::world::MaterialId| {
        let emission = world.model.materials.get(id.index())?.emission.as_ref()?;
        shines(emission).then_some(emission)
    };
    let mut found = Vec::new();
    for (i, quad) in world.quads.iter().enumerate() {
        if let Some(emission) = emission(quad.material) {
            let share = if quad.round { 0.25 * PI } else { 1.0 };
            let area = share * quad.u.cross(quad.v).length();
            found.push(Emitter { shape: Shape::Quad(quad), emission, area, name: format!("quad {}", i + 1) });
        }
    }
    for (i, sphere) in world.spheres.iter().enumerate() {
        if let Some(emission) = emission(sphere.material) {
            let area = 4.0 * PI * sphere.radius * sphere.radius;
            found.push(Emitter {
                shape: Shape::Sphere(sphere),
                emission,
                area,
                name: format!("sphere {}", i + 1),
            });
        }
    }
    for instance in &world.model.instances {
        let Some(mesh) = world.model.meshes.get(instance.mesh.index()) else { continue };
        for (slot, &material) in instance.materials.iter().enumerate() {
            let Some(emission) = emission(material) else { continue };
            let emits = |&t: &usize| mesh.slots.get(t).map_or(0, |&s| usize::from(s)) == slot;
            let triangles: Vec<usize> = (0..mesh.triangles.len()).filter(emits).collect();
            let area = triangles.iter().map(|&t| 0.5 * normal(instance, mesh, t).length()).sum();
            let name = format!("object `{}`", instance.name);
            found.push(Emitter { shape: Shape::Mesh(instance, mesh, triangles), emission, area, name });
        }
    }
    found.retain(|e| e.area > 0.0 && e.area.is_finite());
    found
}

fn samples(emitter: &Emitter, (n, generator): (usize, usize)) -> Vec<Sample> {
    let even = |i: usize| (i as f32 + 0.5) / n as f32;
    match &emitter.shape {
        Shape::Quad(quad) => {
            let normal = quad.u.cross(quad.v).normalize_or_zero();
            let at = |a: f32, b: f32| Sample {
                position: quad.origin + a * quad.u + b * quad.v,
                normal,
                uvs: [Vec2::new(a, 1.0 - b); 2],
            };
            let square = |i: usize| {
                // So that the lattice is its own mirror image in the middle of the quad.
                let shift = if generator % 2 == 0 { 0.5 } else { 0.0 };
                at(even(i), ((2 * i + 1) as f32 * generator as f32 / (2 * n) as f32 + shift).fract())
            };
            let disk = |i: usize| {
                let (sin, cos) = (GOLDEN * i as f32).sin_cos();
                let r = 0.5 * even(i).sqrt();
                at(0.5 + r * cos, 0.5 + r * sin)
            };
            (0..n).map(|i| if quad.round { disk(i) } else { square(i) }).collect()
        }
        Shape::Sphere(sphere) => {
            let point = |i: usize| {
                let y = 1.0 - 2.0 * even(i);
                let (sin, cos) = (GOLDEN * i as f32).sin_cos();
                let r = (1.0 - y * y).max(0.0).sqrt();
                let normal = Vec3::new(r * cos, y, r * sin);
                let uv = Vec2::new(0.5 - normal.z.atan2(normal.x) / TAU, y.acos() / PI);
                Sample { position: sphere.center + sphere.radius * normal, normal, uvs: [uv; 2] }
            };
            (0..n).map(point).collect()
        }
        Shape::Mesh(instance, mesh, triangles) => over_triangles(instance, mesh, triangles, emitter.area, n),
    }
}

/// One point for every n-th part of the area; inside its triangle where the R₂ sequence falls (Roberts 2018).
fn over_triangles(instance: &Instance, mesh: &Mesh, triangles: &[usize], area: f32, n: usize) -> Vec<Sample> {
    let mut samples = Vec::with_capacity(n);
    let mut passed = 0.0;
    for &t in triangles {
        let normal = normal(instance, mesh, t);
        passed += 0.5 * normal.length();
        while samples.len() < n && passed > (samples.len() as f32 + 0.5) / n as f32 * area {
            let i = samples.len() as f32;
            let (u, v) = ((0.5 + i * 0.754_877_7).fract(), (0.5 + i * 0.569_840_3).fract());
            let root = u.sqrt();
            let weights = [1.0 - root, root * (1.0 - v), root * v];
            let corners = mesh.triangles.get(t).copied().unwrap_or_default().map(|v| v as usize);
            let mut sample =
                Sample { position: Vec3::ZERO, normal: normal.normalize_or_zero(), uvs: [Vec2::ZERO; 2] };
            for (corner, weight) in corners.into_iter().zip(weights) {
                let position = mesh.positions.get(corner).copied().unwrap_or_default();
                sample.position += weight * instance.to_world.transform_point3(position);
                for (sum, uvs) in sample.uvs.iter_mut().zip(&mesh.uvs) {
                    *sum += weight * uvs.get(corner).copied().unwrap_or_default();
                }
            }
            samples.push(sample);
        }
    }
    samples
}

/// Outward, of twice the area's length.
fn normal(instance: &Instance, mesh: &Mesh, triangle: usize) -> Vec3 {
    let corners = mesh.triangles.get(triangle).copied().unwrap_or_default();
    let [a, b, c] = corners.map(|v| {
        let p = mesh.positions.get(v as usize).copied().unwrap_or_default();
        instance.to_world.transform_point3(p)
    });
    let normal = (b - a).cross(c - a) * instance.to_world.matrix3.determinant().signum();
    if normal.is_finite() { normal } else { Vec3::ZERO }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::world::{ColorInput, MaterialId};

    #[test]
    fn points_of_a_quad_are_even_and_balanced() {
        let quad = Quad { origin: Vec3::ZERO, u: Vec3::X, v: Vec3::Y, round: false, material: MaterialId(0) };
        let emission = Emission { color: ColorInput::constant(Vec3::ONE), strength: 1.0, two_sided: false };
        let emitter =
            Emitter { shape: Shape::Quad(&quad), emission: &emission, area: 1.0, name: String::new() };
        for lattice in LATTICES {
            let points = samples(&emitter, lattice);
            for axis in 0..2 {
                let mut along: Vec<f32> = points.iter().map(|s| s.position[axis]).collect();
                along.sort_by(f32::total_cmp);
                for (i, x) in along.iter().enumerate() {
                    let even = (i as f32 + 0.5) / lattice.0 as f32;
                    assert!((x - even).abs() < 1e-4, "{lattice:?}, axis {axis}: {x} is not {even}");
                }
            }
            // ∫ xy = 1/4 for points that are each other's mirror images.
            let xy = points.iter().map(|s| s.position.x * s.position.y).sum::<f32>() / lattice.0 as f32;
            assert!((xy - 0.25).abs() < 0.02, "{lattice:?}: {xy}");
            assert!(points.iter().all(|s| s.normal == Vec3::Z));
        }
    }
}
