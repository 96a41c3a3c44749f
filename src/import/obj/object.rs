//! An object of a file while it is gathered: what becomes a mesh.

use std::collections::HashMap;

use super::chains::Link;

/// An object that has faces.
#[derive(Default)]
pub(super) struct Object {
    /// Empty: none was given.
    pub name: String,
    /// The attributes are a UV and a normal: the file's, or [`SMOOTH`](super::gather::SMOOTH); [`NONE`](super::corner::NONE): none.
    pub vertices: Vec<Link>,
    pub triangles: Vec<[u32; 3]>,
    /// Of each triangle; empty: all are of the first.
    pub slots: Vec<u16>,
    /// The material of each slot, into the names after `usemtl`.
    pub materials: Vec<Option<u32>>,
    slot_of: HashMap<Option<u32>, u16>,
}

impl Object {
    pub fn new(name: String) -> Self {
        Self { name, ..Self::default() }
    }

    /// The slot of `material`, a new one where it is new; the last of all where there are no more.
    pub fn slot(&mut self, material: Option<u32>) -> u16 {
        // Nearly always that of the face before.
        let last = self.slots.last().copied().unwrap_or(0);
        if self.materials.get(usize::from(last)) == Some(&material) {
            return last;
        }
        let next = u16::try_from(self.materials.len()).ok();
        *self.slot_of.entry(material).or_insert_with(|| {
            self.materials.extend(next.map(|_| material));
            next.unwrap_or(u16::MAX)
        })
    }

    /// Takes up the triangles of `other`.
    pub fn append(&mut self, other: Self) {
        let first = self.vertices.len() as u32;
        let slots: Vec<u16> = other.materials.iter().map(|&material| self.slot(material)).collect();
        if self.materials.len() > 1 {
            let slot = |i: usize| slots.get(other.slots.get(i).map_or(0, |&slot| usize::from(slot)));
            self.slots.resize(self.triangles.len(), 0);
            self.slots.extend((0..other.triangles.len()).map(|i| slot(i).copied().unwrap_or(0)));
        }
        self.vertices.extend(other.vertices);
        self.triangles.extend(other.triangles.iter().map(|triangle| triangle.map(|i| i + first)));
    }
}
