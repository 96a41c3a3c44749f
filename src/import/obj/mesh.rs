//! The objects of a file as meshes: one index for all attributes, missing normals made.
//!
//! A corner's normal is, in this order,
//!
//! 1. the file's (`vn`), made unit;
//! 2. in a smoothing group, the mean of the normals of those faces of the group about the vertex that lack normals;
//! 3. the triangle's own.
//!
//! A mesh of which no corner has the first two keeps none at all, which is flat shading.

use glam::{Vec2, Vec3};
use rayon::prelude::*;

use super::{
    chains::Link,
    corner::NONE,
    gather::{Gathered, Points, SMOOTH},
    object::Object,
};
use crate::{color::srgb_decode, world::Mesh};

/// Turns `object` into a mesh. `smooth` is [`Gathered::smooth`].
pub(super) fn build(object: &mut Object, points: &Points, smooth: &[glam::DVec3]) -> Mesh {
    let links = object.vertices.as_slice();
    let mut triangles = std::mem::take(&mut object.triangles);
    triangles.shrink_to_fit();
    let mut mesh = Mesh {
        name: object.name.clone(),
        positions: gather(links, |link| {
            points.positions.get(link.position as usize).copied().unwrap_or_default()
        }),
        triangles,
        slots: std::mem::take(&mut object.slots),
        ..Mesh::default()
    };
    if links.par_iter().any(|link| link.attributes[0] != NONE) {
        mesh.uvs[0] = gather(links, |link| match points.uvs.get(link.attributes[0] as usize) {
            // OBJ counts v from the bottom row of the image.
            Some(uv) => Vec2::new(uv.x, 1.0 - uv.y),
            None => Vec2::ZERO,
        });
    }
    let color = |link: &Link| points.colors.get(link.position as usize).filter(|color| !color.is_nan());
    if !points.colors.is_empty() && links.par_iter().any(|link| color(link).is_some()) {
        mesh.colors = gather(links, |link| {
            // That they are sRGB no text says; the programs that write them mean it.
            color(link).map_or(Vec3::ONE, |color| color.map(|c| srgb_decode(c.clamp(0.0, 1.0)))).extend(1.0)
        });
    }
    if links.par_iter().any(|link| link.attributes[1] != NONE) {
        mesh.normals = gather(links, |link| match link.attributes[1] {
            NONE => Vec3::NAN,
            index if index & SMOOTH != 0 => smooth
                .get((index & !SMOOTH) as usize)
                .and_then(|sum| sum.try_normalize())
                .map_or(Vec3::NAN, |normal| normal.as_vec3()),
            index => points.normals.get(index as usize).copied().unwrap_or(Vec3::NAN),
        });
        object.vertices = Vec::new();
        complete_normals(&mut mesh);
    }
    mesh
}

fn gather<T: Send>(links: &[Link], value: impl Fn(&Link) -> T + Sync + Send) -> Vec<T> {
    links.par_iter().with_min_len(1 << 12).map(value).collect()
}

/// Gives the vertices whose normal is NaN that of their triangle. Where triangles share one, it is split.
fn complete_normals(mesh: &mut Mesh) {
    if mesh.normals.par_iter().all(|normal| !normal.is_nan()) {
        return;
    }
    let missing: Vec<bool> = mesh.normals.iter().map(|normal| normal.is_nan()).collect();
    let is_missing = |i: u32| missing.get(i as usize) == Some(&true);
    let mut triangles = std::mem::take(&mut mesh.triangles);
    for triangle in triangles.iter_mut().filter(|triangle| triangle.iter().any(|&i| is_missing(i))) {
        let [a, b, c] =
            triangle.map(|i| mesh.positions.get(i as usize).map_or(Vec3::ZERO, |p| *p).as_dvec3());
        // A triangle without area shows no side: any unit vector will do.
        let normal = (b - a).cross(c - a).try_normalize().map_or(Vec3::Z, |normal| normal.as_vec3());
        for corner in triangle.iter_mut().filter(|corner| is_missing(**corner)) {
            let at = *corner as usize;
            match mesh.normals.get_mut(at) {
                Some(own) if own.is_nan() => *own = normal,
                Some(own) if *own == normal => {}
                _ => {
                    *corner = mesh.positions.len() as u32;
                    copy(&mut mesh.positions, at);
                    copy(&mut mesh.uvs[0], at);
                    copy(&mut mesh.colors, at);
                    mesh.normals.push(normal);
                }
            }
        }
    }
    mesh.triangles = triangles;
    // Nothing refers to those that still have none.
    mesh.normals.iter_mut().filter(|normal| normal.is_nan()).for_each(|normal| *normal = Vec3::Z);
}

/// Appends a copy of the value at `at`, if there is one.
fn copy<T: Copy>(values: &mut Vec<T>, at: usize) {
    if let Some(&value) = values.get(at) {
        values.push(value);
    }
}

/// The meshes of all objects, in their order.
pub(super) fn build_all(gathered: &mut Gathered) -> Vec<Mesh> {
    let Gathered { points, objects, smooth, .. } = gathered;
    objects.par_iter_mut().map(|object| build(object, points, smooth)).collect()
}
