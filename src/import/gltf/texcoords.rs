//! Which UV sets of a file are read.

/// A mesh here has two UV sets, a file any number. For one material: which of the file's are in the mesh's two.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct UvSlots([Option<u32>; 2]);

impl UvSlots {
    /// Where TEXCOORD_`set` is from now on; `None` where others have taken both places. Sets 0 and 1 keep their number
    /// where they can, so that most materials share the meshes they are on.
    pub fn place(&mut self, set: u32) -> Option<u8> {
        let known = self.0.iter().position(|slot| *slot == Some(set));
        let own = usize::try_from(set).ok().filter(|&set| self.0.get(set) == Some(&None));
        let free = || self.0.iter().rposition(Option::is_none);
        let slot = known.or(own).or_else(free)?;
        self.0[slot] = Some(set);
        Some(slot as u8)
    }

    /// The sets to be read, whether the material needs them or not.
    pub fn sets(self) -> [u32; 2] {
        [self.0[0].unwrap_or(0), self.0[1].unwrap_or(1)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_sets_of_any_number_find_a_place() {
        let placed = |sets: &[u32]| {
            let mut slots = UvSlots::default();
            let places: Vec<_> = sets.iter().map(|&set| slots.place(set)).collect();
            (places, slots.sets())
        };
        assert_eq!(placed(&[]), (vec![], [0, 1]));
        assert_eq!(placed(&[1, 0, 1]), (vec![Some(1), Some(0), Some(1)], [0, 1]));
        assert_eq!(placed(&[5, 0]), (vec![Some(1), Some(0)], [0, 5]));
        assert_eq!(placed(&[5, 1, 5]), (vec![Some(1), Some(0), Some(1)], [1, 5]));
        assert_eq!(placed(&[2, 3, 0]), (vec![Some(1), Some(0), None], [3, 2]));
    }
}
