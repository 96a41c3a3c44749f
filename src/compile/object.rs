//! What the tree's objects are made of: shape, placement, materials, and which light each part of them is.

use glam::{Affine3A, Vec3, Vec3A};

use crate::world::{Instance, MaterialId, MeshId, Quad, Sphere};

/// How an instance stands in the world.
#[derive(Clone, Copy, Debug)]
pub struct Placement {
    pub to_world: Affine3A,
    pub to_object: Affine3A,
    /// −1 where it mirrors (a bitangent turns round), else 1.
    pub handedness: f32,
}

impl Placement {
    fn new(to_world: Affine3A) -> Self {
        let handedness = if to_world.matrix3.determinant() < 0.0 { -1.0 } else { 1.0 };
        Self { to_world, to_object: to_world.inverse(), handedness }
    }

    /// A normal by the inverse transpose: outward stays outward, under mirroring too.
    pub fn normal(&self, n: Vec3) -> Option<Vec3> {
        let m = &self.to_object.matrix3;
        let n = Vec3A::from(n);
        Vec3::new(m.x_axis.dot(n), m.y_axis.dot(n), m.z_axis.dot(n)).try_normalize()
    }
}

#[derive(Clone, Debug)]
pub enum ObjectKind {
    Instance { mesh: MeshId, placement: Placement },
    Sphere { center: Vec3, radius: f32 },
    Quad { origin: Vec3, u: Vec3, v: Vec3, round: bool },
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
}

impl Object {
    pub fn instance(instance: Instance) -> Self {
        let kind = ObjectKind::Instance { mesh: instance.mesh, placement: Placement::new(instance.to_world) };
        Self { kind, materials: instance.materials.into(), emitters: EmitterMap::None }
    }

    pub fn sphere(sphere: Sphere) -> Self {
        let Sphere { center, radius, material } = sphere;
        Self {
            kind: ObjectKind::Sphere { center, radius },
            materials: [material].into(),
            emitters: EmitterMap::None,
        }
    }

    pub fn quad(quad: Quad) -> Self {
        let Quad { origin, u, v, round, material } = quad;
        let kind = ObjectKind::Quad { origin, u, v, round };
        Self { kind, materials: [material].into(), emitters: EmitterMap::None }
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
