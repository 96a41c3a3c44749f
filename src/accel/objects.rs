//! The tree over all objects. Each has a leaf of its own.

use glam::{Affine3A, DAffine3, Mat3A, Vec3, Vec3A};
use obvhs::aabb::Aabb;
use rayon::prelude::*;

use super::{
    Blas, Hit, Object, Shape,
    lanes::{Lanes, WIDTH},
    lines::{self, Line, lines_of},
    parts::Part,
    plan::LeafSize,
    search::Search,
    top_down,
    traverse::{Leaves, Slabs, traverse},
    triangles::Block,
    wide,
};
use crate::geometry::{Ray, quad::Quad, sphere, triangle::Shear};

/// A leaf's tag: what it is.
const INSTANCE: u32 = 1;
const SPHERE: u32 = 2;
const QUAD: u32 = 3;

/// Of any object.
const MOST_LINES: usize = lines_of::<Instance>();
const _: () = assert!(lines_of::<Sphere>() <= MOST_LINES && lines_of::<PlacedQuad>() <= MOST_LINES);

/// Beyond what a tree can hold in any case.
const MAX_OBJECTS: usize = 1 << 29;

/// Objects that reach farther from the origin are set aside: sums of the areas of boxes would overflow.
const MAX_EXTENT: f32 = 1e15;

#[derive(Clone, Copy, Debug)]
struct Id {
    object: u32,
    filtered: bool,
}

#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
struct Instance {
    to_object: Affine3A,
    /// Whether `to_object` does anything.
    is_placed: bool,
    blas: u32,
    id: Id,
}

#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
struct Sphere {
    center: Vec3,
    radius: f32,
    id: Id,
}

#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
struct PlacedQuad(Quad, Id);

#[derive(Debug)]
pub struct Objects {
    lines: Vec<Line>,
    blases: Vec<Blas>,
    /// Where there is nothing else: rays need not go through the tree.
    alone: Option<Instance>,
    bounds: Option<Aabb>,
    set_aside: usize,
}

/// An object as it is stored, before it has its place.
enum Stored {
    Instance(Instance),
    Sphere(Sphere),
    Quad(PlacedQuad),
}

impl Objects {
    pub fn build(blases: Vec<Blas>, objects: &[Object]) -> Self {
        assert!(objects.len() <= MAX_OBJECTS, "too many objects");
        let mut parts: Vec<Part> = (0..objects.len() as u32)
            .into_par_iter()
            .filter_map(|i| Some((i, bounds(&blases, &objects[i as usize].shape)?)))
            .filter(|(_, b)| {
                [b.min, b.max].iter().all(|p| p.is_finite() && p.abs().max_element() < MAX_EXTENT)
            })
            .filter(|(i, _)| stored(*i, &objects[*i as usize]).is_some())
            .map(|(i, b)| Part::new(&b, i))
            .collect();
        let tree = top_down::build(&mut parts, 1, &|parts| parts.len());
        let one = LeafSize { block: 1, max_blocks: 1, lines: MOST_LINES };
        let lines = wide::collapse(&tree, &parts, one, |numbers, lines| {
            store(numbers[0], &objects[numbers[0] as usize], lines)
        });
        let alone = match &parts[..] {
            [part] => match stored(part.number(), &objects[part.number() as usize]) {
                Some(Stored::Instance(instance)) => Some(instance),
                _ => None,
            },
            _ => None,
        };
        Self {
            lines,
            blases,
            alone,
            bounds: tree.nodes.first().map(|root| *root.aabb()),
            set_aside: objects.len() - parts.len(),
        }
    }

    pub fn bounds(&self) -> (Vec3, Vec3) {
        self.bounds.map_or((Vec3::ZERO, Vec3::ZERO), |b| (b.min.into(), b.max.into()))
    }

    pub fn set_aside(&self) -> usize {
        self.set_aside
    }

    pub fn memory(&self) -> usize {
        size_of_val(&self.lines[..]) + self.blases.iter().map(Blas::memory).sum::<usize>()
    }

    #[inline(always)]
    pub fn search<L: Lanes, F: FnMut(&Hit) -> bool, const ANY: bool>(
        &self,
        ray: &Ray,
        search: Search<F, ANY>,
    ) -> Option<Hit> {
        let mut leaves = ObjectLeaves { objects: self, ray, search };
        match &self.alone {
            Some(instance) => leaves.instance::<L>(instance),
            None => {
                let slabs = Slabs::new(ray.origin.into(), ray.direction.into(), ray.t_min);
                // SAFETY: `lines` comes from `collapse`.
                unsafe { traverse::<L, _>(&self.lines, &slabs, &mut leaves) }
            }
        };
        leaves.search.result()
    }
}

/// Adds the object, which can be stored, to `lines`; its leaf's tag.
fn store(object: u32, description: &Object, lines: &mut Vec<Line>) -> u32 {
    match stored(object, description) {
        Some(Stored::Instance(instance)) => {
            lines.extend_from_slice(lines::of(&[instance]));
            INSTANCE
        }
        Some(Stored::Sphere(sphere)) => {
            lines.extend_from_slice(lines::of(&[sphere]));
            SPHERE
        }
        Some(Stored::Quad(quad)) => {
            lines.extend_from_slice(lines::of(&[quad]));
            QUAD
        }
        None => unreachable!("only objects that can be stored are in the tree"),
    }
}

/// `None` where no ray can hit the shape, whatever its bounds.
fn stored(object: u32, description: &Object) -> Option<Stored> {
    let id = Id { object, filtered: description.filtered };
    match description.shape {
        Shape::Mesh { blas, to_world } => inverse(&to_world).map(|to_object| {
            let is_placed = to_object != Affine3A::IDENTITY;
            Stored::Instance(Instance { to_object, is_placed, blas, id })
        }),
        Shape::Sphere { center, radius } => Some(Stored::Sphere(Sphere { center, radius, id })),
        Shape::Quad { origin, u, v, round } => {
            Quad::new(origin, u, v, round).map(|quad| Stored::Quad(PlacedQuad(quad, id)))
        }
    }
}

/// In `f64`, so that only the last rounding is left; `None` for a singular matrix.
pub fn inverse(m: &Affine3A) -> Option<Affine3A> {
    let m = DAffine3::from_mat3_translation(m.matrix3.as_dmat3(), m.translation.as_dvec3());
    let inverse = m.inverse();
    let single = Affine3A::from_mat3_translation(inverse.matrix3.as_mat3(), inverse.translation.as_vec3());
    (m.matrix3.determinant() != 0.0 && single.is_finite()).then_some(single)
}

impl Shape {
    /// Center and radius of a ball around it in the world; `None` where there is nothing to hit. `blases` are those that it
    /// refers to.
    pub fn ball(&self, blases: &[Blas]) -> Option<(Vec3, f32)> {
        let bounds = match *self {
            Self::Sphere { center, radius } => return (radius > 0.0).then_some((center, radius)),
            Self::Mesh { blas, to_world } => {
                let (low, high) = blases.get(blas as usize)?.bounds()?;
                placed(&to_world, &[Aabb::new(low.into(), high.into())])
            }
            Self::Quad { .. } => bounds(blases, self)?,
        };
        Some((bounds.center().into(), 0.5 * bounds.diagonal().length()))
    }
}

/// Share of the largest numbers that went in: more than the roundings of a transform, there and back.
const MARGIN: f32 = 16.0 * f32::EPSILON;

/// Bounds in the world, rounded outwards.
fn bounds(blases: &[Blas], shape: &Shape) -> Option<Aabb> {
    let corners = |points: &[Vec3A]| {
        let b = Aabb::from_points(points);
        let margin = MARGIN * b.min.abs().max(b.max.abs()).max_element();
        Aabb::new(b.min - margin, b.max + margin)
    };
    match *shape {
        Shape::Mesh { blas, to_world } => {
            let outline = blases.get(blas as usize)?.outline();
            (!outline.is_empty()).then(|| placed(&to_world, outline))
        }
        Shape::Sphere { center, radius } => {
            let (c, r) = (Vec3A::from(center), Vec3A::splat(radius));
            (radius > 0.0).then(|| corners(&[c - r, c + r]))
        }
        Shape::Quad { origin, u, v, .. } => {
            Some(corners(&[origin, origin + u, origin + v, origin + u + v].map(Vec3A::from)))
        }
    }
}

/// Bounds of boxes that are moved.
fn placed(to_world: &Affine3A, boxes: &[Aabb]) -> Aabb {
    let m = &to_world.matrix3;
    let size = Mat3A::from_cols(m.x_axis.abs(), m.y_axis.abs(), m.z_axis.abs());
    // (twice the middle and the extent of each box)
    let (mut low, mut high, mut largest) = (Vec3A::MAX, Vec3A::MIN, Vec3A::ZERO);
    for b in boxes {
        let (middle, extent) = (*m * (b.min + b.max), size * (b.max - b.min));
        (low, high) = (low.min(middle - extent), high.max(middle + extent));
        largest = largest.max(b.min.abs()).max(b.max.abs());
    }
    // (infinite where `middle` may be: such boxes are set aside)
    let margin = MARGIN * (0.5 * (size * (2.0 * largest)) + to_world.translation.abs()).max_element();
    Aabb::new(0.5 * low + to_world.translation - margin, 0.5 * high + to_world.translation + margin)
}

struct ObjectLeaves<'a, F, const ANY: bool> {
    objects: &'a Objects,
    ray: &'a Ray,
    search: Search<F, ANY>,
}

impl<F: FnMut(&Hit) -> bool, const ANY: bool> Leaves for ObjectLeaves<'_, F, ANY> {
    const ANY: bool = ANY;

    #[inline(always)]
    fn visit<L: Lanes>(&mut self, tag: u32, first: *const Line) -> bool {
        // SAFETY: that is what `store` wrote under these tags.
        unsafe {
            match tag {
                INSTANCE => self.instance::<L>(&*first.cast()),
                SPHERE => self.sphere(&*first.cast()),
                QUAD => self.quad(&*first.cast()),
                _ => false,
            }
        }
    }

    #[inline(always)]
    fn t_max(&self) -> f32 {
        self.search.t_max()
    }
}

impl<F: FnMut(&Hit) -> bool, const ANY: bool> ObjectLeaves<'_, F, ANY> {
    #[inline(always)]
    fn instance<L: Lanes>(&mut self, instance: &Instance) -> bool {
        // The direction keeps its length in the world's measure, and so t is the same in both spaces.
        let (origin, direction) = (Vec3A::from(self.ray.origin), Vec3A::from(self.ray.direction));
        let (origin, direction) = match instance.is_placed {
            true => (
                instance.to_object.transform_point3a(origin),
                instance.to_object.transform_vector3a(direction),
            ),
            false => (origin, direction),
        };
        let blas = &self.objects.blases[instance.blas as usize];
        let slabs = Slabs::new(origin, direction, self.ray.t_min);
        let ray = Ray { origin: origin.into(), direction: direction.into(), ..*self.ray };
        let mut leaves = TriangleLeaves { ray: &ray, shear: None, id: instance.id, search: &mut self.search };
        // SAFETY: `lines` comes from `collapse`.
        unsafe { traverse::<L, _>(&blas.lines, &slabs, &mut leaves) }
    }

    #[inline(always)]
    fn sphere(&mut self, s: &Sphere) -> bool {
        let Some(roots) = sphere::intersect_line(self.ray, s.center, s.radius) else { return false };
        // The far side counts where the near one is behind the ray, or filtered out.
        roots.into_iter().any(|t| {
            let hit = Hit { t, u: 0.0, v: 0.0, object: s.id.object, primitive: 0 };
            t > self.ray.t_min && t < self.ray.t_max && self.search.offer(hit, s.id.filtered)
        })
    }

    #[inline(always)]
    fn quad(&mut self, &PlacedQuad(ref quad, id): &PlacedQuad) -> bool {
        quad.intersect(self.ray).is_some_and(|h| {
            let hit = Hit { t: h.t, u: h.a, v: h.b, object: id.object, primitive: 0 };
            self.search.offer(hit, id.filtered)
        })
    }
}

struct TriangleLeaves<'a, F, const ANY: bool> {
    ray: &'a Ray,
    /// Of the ray; `None` until the first leaf, which rays that only brush the box of an instance never get to.
    shear: Option<Shear>,
    id: Id,
    search: &'a mut Search<F, ANY>,
}

impl<F: FnMut(&Hit) -> bool, const ANY: bool> Leaves for TriangleLeaves<'_, F, ANY> {
    const ANY: bool = ANY;

    #[inline(always)]
    fn visit<L: Lanes>(&mut self, tag: u32, first: *const Line) -> bool {
        let shear = *self.shear.get_or_insert_with(|| Shear::new(self.ray.direction));
        // SAFETY: `Blas` has so many blocks there.
        for block in unsafe { std::slice::from_raw_parts(first.cast::<Block>(), tag as usize) } {
            let t_min = self.ray.t_min.max(0.0);
            let Some(hits) = block.intersect::<L>(self.ray, &shear, t_min, self.search.t_last()) else {
                continue;
            };
            if ANY && !self.id.filtered {
                self.search.end();
                return true;
            }
            let (t, v) = (hits.t.to_array(), hits.v.to_array());
            let (w, det) = (hits.w.to_array(), hits.det.to_array());
            let mut lanes = hits.lanes;
            while lanes != 0 {
                let lane = lanes.trailing_zeros() as usize & (WIDTH - 1);
                lanes &= lanes - 1;
                let hit = Hit {
                    t: t[lane],
                    u: v[lane] / det[lane],
                    v: w[lane] / det[lane],
                    object: self.id.object,
                    primitive: block.primitive[lane],
                };
                if self.search.offer(hit, self.id.filtered) {
                    return true;
                }
            }
        }
        false
    }

    #[inline(always)]
    fn t_max(&self) -> f32 {
        self.search.t_max()
    }
}
