//! The media a path is in: those whose boundary it has crossed inwards and not outwards.
//!
//! A medium is known by the material of its boundary; which side is inside follows from the outward normals of a closed
//! mesh. The one entered last is the one that absorbs: an object all inside another displaces what is around it. Where a
//! path arrives at a boundary from behind without having entered (the camera is inside, or a mesh is not closed), the
//! medium of that boundary lies behind it.

use glam::Vec3;

/// Media within media; what is entered beyond that is not followed.
const DEEPEST: usize = 6;

#[derive(Clone, Copy, Debug, Default)]
pub struct Media {
    /// Material, and absorption per metre.
    entered: [(u32, Vec3); DEEPEST],
    depth: usize,
}

impl Media {
    pub fn is_empty(&self) -> bool {
        self.depth == 0
    }

    /// The path crosses the boundary of a medium.
    pub fn cross(&mut self, material: u32, absorption: Vec3, inwards: bool) {
        if inwards {
            if let Some(slot) = self.entered.get_mut(self.depth) {
                *slot = (material, absorption);
                self.depth += 1;
            }
        } else if let Some(at) = self.entered[..self.depth].iter().rposition(|(m, _)| *m == material) {
            self.entered.copy_within(at + 1..self.depth, at);
            self.depth -= 1;
        }
    }

    /// Absorption on the way to a boundary of `medium` (material and absorption) met from behind.
    pub fn behind(&self, (material, absorption): (u32, Vec3)) -> Vec3 {
        match self.entered[..self.depth].iter().any(|(m, _)| *m == material) {
            true => self.absorption(),
            false => absorption,
        }
    }

    /// Of the medium that the path is in, per metre.
    pub fn absorption(&self) -> Vec3 {
        self.entered[..self.depth].last().map_or(Vec3::ZERO, |(_, absorption)| *absorption)
    }
}

/// Beer's law: the share of light left after `distance` metres.
pub fn beer(absorption: Vec3, distance: f32) -> Vec3 {
    (-absorption * distance).exp()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_medium_entered_last_absorbs_until_it_is_left() {
        let (glass, ice) = ((1, Vec3::X), (2, Vec3::Y));
        let mut media = Media::default();
        media.cross(glass.0, glass.1, true);
        media.cross(ice.0, ice.1, true);
        assert_eq!(media.absorption(), Vec3::Y);
        // overlapping: out of the first before the second
        media.cross(glass.0, glass.1, false);
        assert_eq!(media.absorption(), Vec3::Y);
        media.cross(ice.0, ice.1, false);
        assert!(media.is_empty() && media.absorption() == Vec3::ZERO);
        // out of what was never entered
        media.cross(ice.0, ice.1, false);
        assert!(media.is_empty());
        assert_eq!(media.behind(ice), Vec3::Y);
    }

    #[test]
    fn no_depth_is_too_deep() {
        let mut media = Media::default();
        (0..20).for_each(|i| media.cross(i, Vec3::ONE, true));
        (0..20).for_each(|i| media.cross(i, Vec3::ONE, false));
        assert!(media.is_empty());
    }
}
