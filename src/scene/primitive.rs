//! `[[sphere]]` and `[[quad]]`.

use std::ops::Range;

use super::{
    context::Context,
    range::above,
    read::{Read, Value, kind},
    table::{inline_schema, table},
    vector::{Direction, Triple},
};
use crate::world::{self, MaterialId};

table! {
    /// A sphere.
    struct Sphere {
        /// Metres.
        center: Triple = Triple([0.0, 0.0, 0.0]),
        /// Metres.
        radius: f32 = 1.0; above(0.0),
        /// The name of a material.
        material: MaterialName,
    }
}

table! {
    /// A parallelogram: the points origin + a·u + b·v with a and b from 0 to 1. Its front is the side of u × v.
    struct Quad {
        /// One corner, metres.
        origin: Triple,
        /// From that corner along one edge, metres.
        u: Direction,
        /// From that corner along the other edge, metres.
        v: Direction,
        /// The name of a material.
        material: MaterialName,
    }
}

/// The name of a material that the file has.
#[derive(Clone, Copy, Debug)]
pub(super) struct MaterialName(pub MaterialId);

impl Sphere {
    pub fn resolve(self) -> world::Sphere {
        world::Sphere { center: self.center.vec(), radius: self.radius, material: self.material.0 }
    }
}

impl Quad {
    pub fn resolve(self, cx: &mut Context) -> world::Quad {
        if self.keys.sound(&["u", "v"]) {
            check_edges(self.u.0.into(), self.v.0.into(), self.keys.value("v"), cx);
        }
        world::Quad {
            origin: self.origin.vec(),
            u: self.u.0.into(),
            v: self.v.0.into(),
            round: false,
            material: self.material.0,
        }
    }
}

/// Reports edges that span no area.
pub(super) fn check_edges(u: glam::Vec3, v: glam::Vec3, at: Range<usize>, cx: &mut Context) {
    let (u, v) = (u.as_dvec3(), v.as_dvec3());
    if u.cross(v).length() <= 1e-6 * u.length() * v.length() {
        cx.error(at, "`u` and `v` are parallel: the quad has no area");
    }
}

impl Read for MaterialName {
    fn read(value: &Value, cx: &mut Context) -> Option<Self> {
        let Some(name) = value.get_ref().as_str() else {
            cx.must(value.span(), "the name of a material", kind(value));
            return None;
        };
        cx.material(name, value.span()).map(Self)
    }

    fn stand_in() -> Option<Self> {
        Some(Self(MaterialId(0)))
    }
}

inline_schema! {
    MaterialName, _generator: schemars::json_schema!({ "type": "string" }),
}
