//! Finds everything that shines: emissive spheres, quads and triangles, and the punctual lights.

use glam::{Vec2, Vec3, Vec4};
use rayon::prelude::*;

use super::object::{EmitterMap, Object, ObjectKind};
use crate::{
    color::luminance,
    light::{Emitter, Quad, Shape, Sphere, Triangle},
    material,
    sampling::warp::uniform_triangle,
    texture::Textures,
    world::{Emission, Light, Material, Mesh},
};

/// Points at which a textured emitter is looked up to estimate its power; 1 where nothing varies.
const SAMPLES: u32 = 16;

/// Triangles that one thread looks at in a row.
const BATCH: usize = 1024;

/// Lists all lights and writes into each object which of them its primitives are.
///
/// Parts whose emission is estimated as zero are left out: rays that hit them still see what little they emit.
pub fn collect(
    objects: &mut [Object],
    meshes: &[Mesh],
    materials: &[Material],
    textures: &Textures,
    lights: Vec<Light>,
) -> Vec<Emitter> {
    let mut emitters = Vec::new();
    for (index, object) in objects.iter_mut().enumerate() {
        let emission = |slot: u16| {
            let id = object.materials.get(usize::from(slot)).or(object.materials.first())?;
            materials[id.index()].emission.as_ref()
        };
        object.emitters = match &object.kind {
            ObjectKind::Instance { mesh, placement } => {
                if !(0..object.materials.len() as u16).any(|slot| emission(slot).is_some()) {
                    continue;
                }
                let mesh = &meshes[mesh.index()];
                let place = |primitive: usize| {
                    let emission = emission(mesh.slots.get(primitive).copied().unwrap_or(0))?;
                    let corners = mesh.triangles[primitive];
                    let [p0, p1, p2] =
                        corners.map(|i| placement.to_world.transform_point3(mesh.positions[i as usize]));
                    let area = 0.5 * (p1 - p0).cross(p2 - p0).length();
                    let mean = mean_emission(emission, textures, |b| mesh.uvs_at(corners, b));
                    let shape = Shape::Triangle(Triangle::new([p0, p1, p2], placement.handedness < 0.0));
                    emitter(index, primitive, shape, emission, mean, area)
                };
                let count = mesh.triangles.len();
                let found = (0..count.div_ceil(BATCH)).into_par_iter().map(|batch| {
                    let primitives = batch * BATCH..count.min((batch + 1) * BATCH);
                    primitives.filter_map(|i| Some((i, place(i)?))).collect::<Vec<_>>()
                });
                let mut map = vec![u32::MAX; count];
                for (primitive, emitter) in found.collect::<Vec<_>>().into_iter().flatten() {
                    map[primitive] = emitters.len() as u32;
                    emitters.push(emitter);
                }
                EmitterMap::ByPrimitive(map.into())
            }
            kind => {
                let Some(emission) = emission(0) else { continue };
                let mean = mean_emission(emission, textures, |b| [b; 2]);
                let (shape, area) = match *kind {
                    ObjectKind::Sphere { center, radius } => (
                        Shape::Sphere(Sphere { center, radius }),
                        4.0 * std::f32::consts::PI * radius * radius,
                    ),
                    ObjectKind::Quad { origin, u, v, round, .. } => {
                        let share = if round { std::f32::consts::FRAC_PI_4 } else { 1.0 };
                        (Shape::Quad(Quad::new(origin, u, v, round)), share * u.cross(v).length())
                    }
                    ObjectKind::Instance { .. } => continue,
                };
                let Some(emitter) = emitter(index, 0, shape, emission, mean, area) else { continue };
                emitters.push(emitter);
                EmitterMap::One(emitters.len() as u32 - 1)
            }
        };
    }
    emitters.extend(lights.into_iter().map(Emitter::Punctual));
    emitters
}

/// Power = π · area · mean radiance, for each side that shines.
fn emitter(
    object: usize,
    primitive: usize,
    shape: Shape,
    emission: &Emission,
    mean: Vec3,
    area: f32,
) -> Option<Emitter> {
    let sides = if emission.two_sided { 2.0 } else { 1.0 };
    let power = sides * std::f32::consts::PI * area * luminance(mean);
    (power > 0.0 && power.is_finite()).then_some(Emitter::Surface {
        object: object as u32,
        primitive: primitive as u32,
        shape,
        power,
        two_sided: emission.two_sided,
    })
}

fn mean_emission(emission: &Emission, textures: &Textures, uvs: impl Fn(Vec2) -> [Vec2; 2]) -> Vec3 {
    let n = if emission.color.texture.is_some() { SAMPLES } else { 1 };
    let sum: Vec3 = (0..n)
        .map(|i| {
            // the R2 sequence of Roberts 2018
            let u = Vec2::new(i as f32 * 0.754_877_7, i as f32 * 0.569_840_3).fract();
            material::emission(emission, textures, &uvs(uniform_triangle(u)), true)
        })
        .sum();
    sum / n as f32
}

impl Mesh {
    /// Bytes of vertex and index data.
    pub fn memory(&self) -> usize {
        size_of_val(&*self.positions)
            + size_of_val(&*self.normals)
            + size_of_val(&*self.tangents)
            + self.uvs.iter().map(|uv| size_of_val(&**uv)).sum::<usize>()
            + size_of_val(&*self.colors)
            + size_of_val(&*self.triangles)
            + size_of_val(&*self.slots)
    }

    /// Both UV sets at barycentrics (b1, b2) of a triangle; where there is one set, it serves as both.
    pub fn uvs_at(&self, [i, j, k]: [u32; 3], b: Vec2) -> [Vec2; 2] {
        let at = |uvs: &[Vec2]| {
            let (a, p, q) = (uvs[i as usize], uvs[j as usize], uvs[k as usize]);
            a + b.x * (p - a) + b.y * (q - a)
        };
        match [self.uvs[0].is_empty(), self.uvs[1].is_empty()] {
            [false, false] => [at(&self.uvs[0]), at(&self.uvs[1])],
            [false, true] => [at(&self.uvs[0]); 2],
            [true, false] => [at(&self.uvs[1]); 2],
            [true, true] => [Vec2::ZERO; 2],
        }
    }

    /// Vertex colour at barycentrics (b1, b2); one where the mesh has none.
    pub fn color_at(&self, [i, j, k]: [u32; 3], b: Vec2) -> Vec4 {
        if self.colors.is_empty() {
            return Vec4::ONE;
        }
        let colors = &self.colors;
        let (a, p, q) = (colors[i as usize], colors[j as usize], colors[k as usize]);
        a + b.x * (p - a) + b.y * (q - a)
    }
}
