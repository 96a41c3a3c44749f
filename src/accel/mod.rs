//! What does a ray hit? Two levels of eight-wide trees: one over the objects, one over each mesh, which instances share.
//!
//! ```text
//! Accel ── tree over objects ──▶ sphere | quad | instance ── ray into its space ──▶ Blas ── tree ──▶ blocks of 8 triangles
//! ```
//!
//! | file | concept |
//! |---|---|
//! | `parts` | triangles into boxes; long thin ones into several |
//! | `bins`, `top_down` | where to divide a set of boxes; boxes into a binary tree |
//! | `plan`, `wide` | which nodes survive in an eight-wide tree; that tree |
//! | `quality` | how much time goes into that |
//! | `lines` | where nodes and leaves lie in memory |
//! | `memory` | huge pages for what is large |
//! | `traverse` | a ray through an eight-wide tree |
//! | `lanes` | eight floats at once: AVX2, or portable |
//! | `triangles`, `blas` | leaves of a mesh's tree; the mesh's tree |
//! | `objects` | leaves of the tree over the objects |
//! | `search` | the closest hit so far, and which hits count |
//!
//! The hit does not depend on the trees, the kernel or the order of traversal: of hits at equal t, the one with the
//! lowest object, then primitive, is taken. Kernels differ only in how boxes are rounded, always outwards. (Where large
//! triangles overlap in one plane, their t differ by roundings greater than that, and the boxes do have a say.)

mod bins;
mod blas;
mod lanes;
mod lines;
mod memory;
mod objects;
mod parts;
mod plan;
mod quality;
mod search;
mod top_down;
mod traverse;
mod triangles;
mod wide;

#[cfg(test)]
mod tests;

use std::sync::Arc;

use glam::{Affine3A, Vec3};

use self::{lanes::Portable, objects::Objects, search::Search};
use crate::geometry::Ray;

pub use blas::{Blas, Build, MAX_COORDINATE};
pub use quality::Quality;

/// Where a ray meets an object.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// In units of the ray's direction.
    pub t: f32,
    /// Mesh: barycentric coordinate of the triangle's second vertex. Quad: coordinate along u. Sphere: 0.
    pub u: f32,
    /// Mesh: barycentric coordinate of the triangle's third vertex. Quad: coordinate along v. Sphere: 0.
    pub v: f32,
    /// Index into the objects given to [`Accel::build`].
    pub object: u32,
    /// Mesh: the triangle's index in the mesh; otherwise 0.
    pub primitive: u32,
}

#[derive(Clone, Copy, Debug)]
pub enum Shape {
    /// `blas` is an index into those given to [`Accel::build`].
    Mesh {
        blas: u32,
        to_world: Affine3A,
    },
    Sphere {
        center: Vec3,
        radius: f32,
    },
    /// origin + a·u + b·v with a, b in [0, 1]; `round`: only the inscribed ellipse.
    Quad {
        origin: Vec3,
        u: Vec3,
        v: Vec3,
        round: bool,
    },
}

#[derive(Clone, Copy, Debug)]
pub struct Object {
    pub shape: Shape,
    /// The caller decides about each hit on it (see [`Accel::closest_where`]).
    pub filtered: bool,
}

/// Everything that rays can hit. A clone shares the trees.
#[derive(Clone, Debug)]
pub struct Accel {
    objects: Arc<Objects>,
    #[cfg(target_arch = "x86_64")]
    avx2: bool,
}

impl Accel {
    /// Objects without a finite extent (a singular matrix, a radius that is not positive, a quad without area, a mesh without
    /// usable triangles) are never hit; [`Accel::set_aside`] counts them.
    ///
    /// # Panics
    /// On more than 2²⁹ objects.
    pub fn build(blases: Vec<Blas>, objects: Vec<Object>) -> Self {
        Self {
            objects: Arc::new(Objects::build(blases, &objects)),
            #[cfg(target_arch = "x86_64")]
            avx2: lanes::Avx2::available(),
        }
    }

    /// The nearest hit with t in (`t_min`, `t_max`), whatever is filtered.
    pub fn closest(&self, ray: &Ray) -> Option<Hit> {
        self.closest_where(ray, |_| true)
    }

    /// Whether there is a hit with t in (`t_min`, `t_max`), whatever is filtered.
    pub fn occluded(&self, ray: &Ray) -> bool {
        self.occluded_where(ray, |_| true)
    }

    /// As [`closest`](Self::closest), but a hit on a filtered object counts only where `accept` says so.
    ///
    /// `accept` is asked about candidates in no particular order, perhaps more than once about the same one and
    /// perhaps about some behind the nearest hit. The answer must depend on the hit alone.
    pub fn closest_where(&self, ray: &Ray, accept: impl FnMut(&Hit) -> bool) -> Option<Hit> {
        self.search::<false, _>(ray, accept)
    }

    /// As [`occluded`](Self::occluded), but a hit on a filtered object counts only where `accept` says so. It is asked about each hit at most
    /// once, provided that the object's [`Blas`] was [built](Build) for that.
    pub fn occluded_where(&self, ray: &Ray, accept: impl FnMut(&Hit) -> bool) -> bool {
        self.search::<true, _>(ray, accept).is_some()
    }

    /// Lower and upper corner of all objects; both zero where there is nothing to hit.
    pub fn bounds(&self) -> (Vec3, Vec3) {
        self.objects.bounds()
    }

    /// Bytes, of all trees.
    pub fn memory(&self) -> usize {
        self.objects.memory()
    }

    /// How many objects no ray can hit.
    pub fn set_aside(&self) -> usize {
        self.objects.set_aside()
    }

    #[inline]
    fn search<const ANY: bool, F: FnMut(&Hit) -> bool>(&self, ray: &Ray, accept: F) -> Option<Hit> {
        let search = Search::<F, ANY>::new(ray, accept);
        #[cfg(target_arch = "x86_64")]
        if self.avx2 {
            // SAFETY: `avx2` says that the processor has these features.
            return unsafe { search_avx2(&self.objects, ray, search) };
        }
        self.objects.search::<Portable, F, ANY>(ray, search)
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma,bmi1,bmi2,lzcnt,popcnt")]
fn search_avx2<F: FnMut(&Hit) -> bool, const ANY: bool>(
    objects: &Objects,
    ray: &Ray,
    search: Search<F, ANY>,
) -> Option<Hit> {
    objects.search::<lanes::Avx2, F, ANY>(ray, search)
}
