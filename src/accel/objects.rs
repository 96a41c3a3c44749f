//! The tree over all objects. Each has a leaf of its own.

use glam::{Affine3A, DAffine3, Vec3, Vec3A};
use obvhs::aabb::Aabb;

use super::{
    Blas, Hit, Object, Shape,
    lanes::Lanes,
    parts::Part,
    plan::LeafSize,
    search::Search,
    top_down,
    traverse::{Leaves, traverse},
    wide::{self, LEAF, Node},
};
use crate::geometry::{Ray, quad::Quad, sphere, triangle::Shear};

/// A leaf's rest: the kind above this bit, the index among its kind below.
const KIND_SHIFT: u32 = 29;
const INSTANCE: u32 = 0;
const SPHERE: u32 = 1;
const QUAD: u32 = 2;

/// Objects that reach farther from the origin are set aside: sums of the areas of boxes would overflow.
const MAX_EXTENT: f32 = 1e15;

#[derive(Clone, Copy, Debug)]
struct Id {
    object: u32,
    filtered: bool,
}

#[derive(Debug)]
#[repr(align(64))]
struct Instance {
    to_object: Affine3A,
    /// Whether `to_object` does anything.
    is_placed: bool,
    blas: u32,
    id: Id,
}

#[derive(Debug)]
struct Sphere {
    center: Vec3,
    radius: f32,
    id: Id,
}

#[derive(Debug)]
pub struct Objects {
    nodes: Vec<Node>,
    instances: Vec<Instance>,
    spheres: Vec<Sphere>,
    quads: Vec<(Quad, Id)>,
    blases: Vec<Blas>,
    /// There is one instance and nothing else: rays need not go through `nodes`.
    is_instance: bool,
    bounds: Option<Aabb>,
    set_aside: usize,
}

/// An object as it is stored, before it has its place.
enum Stored {
    Instance(Affine3A, u32),
    Sphere(Vec3, f32),
    Quad(Quad),
}

impl Objects {
    pub fn build(blases: Vec<Blas>, objects: &[Object]) -> Self {
        assert!(objects.len() <= 1 << KIND_SHIFT, "too many objects");
        let mut parts: Vec<Part> = (0..objects.len() as u32)
            .filter_map(|i| Some((i, bounds(&blases, &objects[i as usize].shape)?)))
            .filter(|(_, b)| {
                [b.min, b.max].iter().all(|p| p.is_finite() && p.abs().max_element() < MAX_EXTENT)
            })
            .filter(|(i, _)| stored(&objects[*i as usize].shape).is_some())
            .map(|(i, b)| Part::new(&b, i))
            .collect();
        let tree = top_down::build(&mut parts, 1, &|parts| parts.len());
        let one = LeafSize { block: 1, max_blocks: 1 };
        let (nodes, order) = wide::collapse(&tree, &parts, one, |numbers, order: &mut Vec<u32>| {
            order.append(numbers);
            order.len() as u32
        });
        let mut all = Self {
            nodes,
            instances: Vec::new(),
            spheres: Vec::new(),
            quads: Vec::new(),
            bounds: tree.nodes.first().map(|root| *root.aabb()),
            set_aside: objects.len() - parts.len(),
            is_instance: false,
            blases,
        };
        let words: Vec<u32> = order.iter().map(|&i| all.store(i, &objects[i as usize])).collect();
        // (those of unused children say 0)
        for word in all.nodes.iter_mut().flat_map(|node| &mut node.child).filter(|word| **word > LEAF) {
            *word = LEAF | words[(*word - LEAF) as usize - 1];
        }
        all.is_instance = order.len() == 1 && all.instances.len() == 1;
        all
    }

    /// Stored in the order of the leaves, so that neighbours in space are neighbours in memory.
    fn store(&mut self, object: u32, description: &Object) -> u32 {
        let id = Id { object, filtered: description.filtered };
        let (kind, index) = match stored(&description.shape) {
            Some(Stored::Instance(to_object, blas)) => {
                let is_placed = to_object != Affine3A::IDENTITY;
                self.instances.push(Instance { to_object, is_placed, blas, id });
                (INSTANCE, self.instances.len())
            }
            Some(Stored::Sphere(center, radius)) => {
                self.spheres.push(Sphere { center, radius, id });
                (SPHERE, self.spheres.len())
            }
            Some(Stored::Quad(quad)) => {
                self.quads.push((quad, id));
                (QUAD, self.quads.len())
            }
            None => unreachable!("only objects that can be stored are in the tree"),
        };
        kind << KIND_SHIFT | (index - 1) as u32
    }

    pub fn bounds(&self) -> (Vec3, Vec3) {
        self.bounds.map_or((Vec3::ZERO, Vec3::ZERO), |b| (b.min.into(), b.max.into()))
    }

    pub fn set_aside(&self) -> usize {
        self.set_aside
    }

    pub fn memory(&self) -> usize {
        size_of_val(&self.nodes[..])
            + size_of_val(&self.instances[..])
            + size_of_val(&self.spheres[..])
            + size_of_val(&self.quads[..])
            + self.blases.iter().map(Blas::memory).sum::<usize>()
    }

    #[inline(always)]
    pub fn search<L: Lanes, F: FnMut(&Hit) -> bool, const ANY: bool, const FILTER: bool>(
        &self,
        ray: &Ray,
        search: Search<F, ANY, FILTER>,
    ) -> Option<Hit> {
        let mut leaves = ObjectLeaves { objects: self, ray, search };
        if let (true, [instance]) = (self.is_instance, &self.instances[..]) {
            leaves.instance::<L>(instance);
            return leaves.search.result();
        }
        // SAFETY: `nodes` comes from `collapse`.
        unsafe { traverse::<L, _>(&self.nodes, ray, &mut leaves) };
        leaves.search.result()
    }
}

/// `None` where no ray can hit the shape, whatever its bounds.
fn stored(shape: &Shape) -> Option<Stored> {
    match *shape {
        Shape::Mesh { blas, to_world } => inverse(&to_world).map(|m| Stored::Instance(m, blas)),
        Shape::Sphere { center, radius } => Some(Stored::Sphere(center, radius)),
        Shape::Quad { origin, u, v, round } => Quad::new(origin, u, v, round).map(Stored::Quad),
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
        match *self {
            Self::Sphere { center, radius } => (radius > 0.0).then_some((center, radius)),
            _ => bounds(blases, self).map(|b| (b.center().into(), 0.5 * b.diagonal().length())),
        }
    }
}

/// Bounds in the world, rounded outwards.
fn bounds(blases: &[Blas], shape: &Shape) -> Option<Aabb> {
    /// Share of the largest coordinate: more than the roundings of a transform, there and back.
    const MARGIN: f32 = 16.0 * f32::EPSILON;
    let corners = |points: &[Vec3A]| {
        let b = Aabb::from_points(points);
        let margin = MARGIN * b.min.abs().max(b.max.abs()).max_element();
        Aabb::new(b.min - margin, b.max + margin)
    };
    match *shape {
        Shape::Mesh { blas, to_world } => {
            let (low, high) = blases.get(blas as usize)?.bounds()?;
            Some(corners(&[0, 1, 2, 3, 4, 5, 6, 7].map(|i| {
                let pick = |axis: usize| if i >> axis & 1 == 0 { low[axis] } else { high[axis] };
                to_world.transform_point3a(Vec3A::new(pick(0), pick(1), pick(2)))
            })))
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

struct ObjectLeaves<'a, F, const ANY: bool, const FILTER: bool> {
    objects: &'a Objects,
    ray: &'a Ray,
    search: Search<F, ANY, FILTER>,
}

impl<F: FnMut(&Hit) -> bool, const ANY: bool, const FILTER: bool> Leaves
    for ObjectLeaves<'_, F, ANY, FILTER>
{
    const ANY: bool = ANY;

    #[inline(always)]
    fn visit<L: Lanes>(&mut self, rest: u32) -> bool {
        let index = (rest & ((1 << KIND_SHIFT) - 1)) as usize;
        // (`get`, for the sake of unused children, which say instance 0 even where there is none)
        match rest >> KIND_SHIFT {
            INSTANCE => self.objects.instances.get(index).is_some_and(|i| self.instance::<L>(i)),
            SPHERE => self.objects.spheres.get(index).is_some_and(|s| self.sphere(s)),
            _ => self.objects.quads.get(index).is_some_and(|(q, id)| self.quad(q, *id)),
        }
    }

    #[inline(always)]
    fn t_max(&self) -> f32 {
        self.search.t_max()
    }

    #[inline(always)]
    fn address(&self, rest: u32) -> *const u8 {
        let index = (rest & ((1 << KIND_SHIFT) - 1)) as usize;
        match rest >> KIND_SHIFT {
            INSTANCE => self.objects.instances.as_ptr().wrapping_add(index).cast(),
            SPHERE => self.objects.spheres.as_ptr().wrapping_add(index).cast(),
            _ => self.objects.quads.as_ptr().wrapping_add(index).cast(),
        }
    }
}

impl<F: FnMut(&Hit) -> bool, const ANY: bool, const FILTER: bool> ObjectLeaves<'_, F, ANY, FILTER> {
    #[inline(always)]
    fn instance<L: Lanes>(&mut self, instance: &Instance) -> bool {
        // The direction keeps its length in the world's measure, and so t is the same in both spaces.
        let ray = match instance.is_placed {
            false => *self.ray,
            true => Ray {
                origin: instance.to_object.transform_point3(self.ray.origin),
                direction: instance.to_object.transform_vector3(self.ray.direction),
                ..*self.ray
            },
        };
        let blas = &self.objects.blases[instance.blas as usize];
        let shear = Shear::new(ray.direction);
        let mut leaves = TriangleLeaves { blas, ray: &ray, shear, id: instance.id, search: &mut self.search };
        // SAFETY: `nodes` comes from `collapse`.
        unsafe { traverse::<L, _>(&blas.nodes, &ray, &mut leaves) }
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
    fn quad(&mut self, quad: &Quad, id: Id) -> bool {
        quad.intersect(self.ray).is_some_and(|h| {
            let hit = Hit { t: h.t, u: h.a, v: h.b, object: id.object, primitive: 0 };
            self.search.offer(hit, id.filtered)
        })
    }
}

struct TriangleLeaves<'a, F, const ANY: bool, const FILTER: bool> {
    blas: &'a Blas,
    ray: &'a Ray,
    shear: Shear,
    id: Id,
    search: &'a mut Search<F, ANY, FILTER>,
}

impl<F: FnMut(&Hit) -> bool, const ANY: bool, const FILTER: bool> Leaves
    for TriangleLeaves<'_, F, ANY, FILTER>
{
    const ANY: bool = ANY;

    #[inline(always)]
    fn visit<L: Lanes>(&mut self, rest: u32) -> bool {
        for block in self.blas.leaf(rest) {
            let t_max = self.search.t_max();
            let Some(hits) = block.intersect::<L>(self.ray, &self.shear, self.ray.t_min, t_max) else {
                continue;
            };
            let (t, u, v) = (hits.t.to_array(), hits.u.to_array(), hits.v.to_array());
            let mut lanes = hits.lanes;
            while lanes != 0 {
                let lane = lanes.trailing_zeros() as usize & 7;
                lanes &= lanes - 1;
                let hit = Hit {
                    t: t[lane],
                    u: u[lane],
                    v: v[lane],
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

    #[inline(always)]
    fn address(&self, rest: u32) -> *const u8 {
        self.blas.leaf_address(rest)
    }
}
