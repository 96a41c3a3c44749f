//! What the tree's objects are made of: shape, placement, materials, and which light each part of them is.

use glam::{Affine3A, Mat3A, Vec3, Vec3A};

use crate::{
    material::{self, Needs},
    world::{Instance, Material, MaterialId, MeshId, Quad, Sphere},
};

/// How an instance stands in the world.
#[derive(Clone, Copy, Debug)]
pub struct Placement {
    pub to_world: Affine3A,
    pub to_object: Affine3A,
    /// −1 where it mirrors (a bitangent turns round), else 1.
    pub handedness: f32,
    /// The transpose of the linear part of `to_object`.
    normals: Mat3A,
}

impl Placement {
    fn new(to_world: Affine3A) -> Self {
        let handedness = if to_world.matrix3.determinant() < 0.0 { -1.0 } else { 1.0 };
        let to_object = to_world.inverse();
        Self { to_world, to_object, handedness, normals: to_object.matrix3.transpose() }
    }

    /// A normal by the inverse transpose, not of unit length: outward stays outward, under mirroring too.
    #[inline]
    pub fn normal(&self, n: Vec3A) -> Vec3A {
        self.normals * n
    }
}

#[derive(Clone, Debug)]
pub enum ObjectKind {
    Instance {
        mesh: MeshId,
        placement: Placement,
    },
    Sphere {
        center: Vec3,
        radius: f32,
    },
    Quad {
        origin: Vec3,
        u: Vec3,
        v: Vec3,
        round: bool,
        /// Of unit length.
        normal: Vec3,
    },
}

/// From a primitive of an object to its index among the lights.
#[derive(Clone, Debug, Default)]
pub enum EmitterMap {
    #[default]
    None,
    One(u32),
    /// By primitive; `u32::MAX` where it does not shine.
    ByPrimitive(Box<[u32]>),
}

#[derive(Clone, Debug)]
pub struct Object {
    pub kind: ObjectKind,
    /// One for each slot.
    pub materials: Box<[MaterialId]>,
    pub emitters: EmitterMap,
    /// What its materials need to know of a point; set by [`prepare`](Self::prepare).
    pub needs: Needs,
    /// Whether any of its materials may emit.
    pub emits: bool,
}

impl Object {
    pub fn instance(instance: Instance) -> Self {
        let kind = ObjectKind::Instance { mesh: instance.mesh, placement: Placement::new(instance.to_world) };
        Self::new(kind, instance.materials.into())
    }

    pub fn sphere(sphere: Sphere) -> Self {
        let Sphere { center, radius, material } = sphere;
        Self::new(ObjectKind::Sphere { center, radius }, [material].into())
    }

    pub fn quad(quad: Quad) -> Self {
        let Quad { origin, u, v, round, material } = quad;
        let normal = u.cross(v).normalize_or(Vec3::Y);
        Self::new(ObjectKind::Quad { origin, u, v, round, normal }, [material].into())
    }

    fn new(kind: ObjectKind, materials: Box<[MaterialId]>) -> Self {
        Self { kind, materials, emitters: EmitterMap::None, needs: Needs::default(), emits: false }
    }

    /// Notes what is true of all its materials, that it need not be asked at every hit.
    pub fn prepare(&mut self, materials: &[Material]) {
        for material in self.materials.iter().map(|id| &materials[id.index()]) {
            self.needs |= material::needs(material);
            self.emits |= material.emission.is_some();
        }
    }

    /// Which light a primitive is.
    pub fn emitter(&self, primitive: u32) -> Option<u32> {
        match &self.emitters {
            EmitterMap::None => None,
            EmitterMap::One(index) => Some(*index),
            EmitterMap::ByPrimitive(map) => map.get(primitive as usize).copied().filter(|&i| i != u32::MAX),
        }
    }
}
