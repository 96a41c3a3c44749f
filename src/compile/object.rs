//! What the tree's objects are made of: shape, placement, materials, and which light each part of them is.

use glam::{Affine3A, Mat3A, Vec3};

use crate::world::{Instance, MaterialId, MeshId, Quad, Sphere};

#[derive(Clone, Debug)]
pub enum ObjectKind {
    Instance {
        mesh: MeshId,
        to_world: Affine3A,
        /// Inverse transpose of the linear part: outward normals stay outward, under mirroring too.
        normal_to_world: Mat3A,
        /// −1 where the placement mirrors (a bitangent turns round), else 1.
        handedness: f32,
    },
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
        let to_world = instance.to_world;
        let kind = ObjectKind::Instance {
            mesh: instance.mesh,
            to_world,
            normal_to_world: to_world.matrix3.inverse().transpose(),
            handedness: if to_world.matrix3.determinant() < 0.0 { -1.0 } else { 1.0 },
        };
        Self { kind, materials: instance.materials.into(), emitters: EmitterMap::None }
    }

    pub fn sphere(sphere: Sphere) -> Self {
        let Sphere { center, radius, material } = sphere;
        Self { kind: ObjectKind::Sphere { center, radius }, materials: [material].into(), emitters: EmitterMap::None }
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
