//! Axis-aligned boxes.

use glam::DVec3;

/// An axis-aligned box, in double precision so that nothing overflows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Bounds {
    pub min: DVec3,
    pub max: DVec3,
}

impl Bounds {
    pub const EMPTY: Self = Self { min: DVec3::INFINITY, max: DVec3::NEG_INFINITY };
    pub const UNIT: Self = Self { min: DVec3::NEG_ONE, max: DVec3::ONE };

    pub fn center(&self) -> DVec3 {
        (self.min + self.max) / 2.0
    }

    pub fn half_diagonal(&self) -> f64 {
        (self.max - self.min).length() / 2.0
    }

    /// Half the diagonal, or 1 where there is no extent to speak of at this distance from the origin.
    pub fn radius(&self) -> f64 {
        let extent = self.half_diagonal();
        let resolved = 1e-6 * self.center().length();
        if extent > resolved.max(1e-12) { extent } else { resolved.max(1.0) }
    }

    pub fn contains(&self, point: DVec3) -> bool {
        point.cmpge(self.min).all() && point.cmple(self.max).all()
    }

    pub fn is_finite(&self) -> bool {
        self.min.is_finite() && self.max.is_finite()
    }

    pub fn union(&self, other: &Self) -> Self {
        Self { min: self.min.min(other.min), max: self.max.max(other.max) }
    }

    pub fn corners(&self) -> [DVec3; 8] {
        std::array::from_fn(|i| {
            let pick = |bit: usize, low: f64, high: f64| if i >> bit & 1 == 0 { low } else { high };
            DVec3::new(
                pick(0, self.min.x, self.max.x),
                pick(1, self.min.y, self.max.y),
                pick(2, self.min.z, self.max.z),
            )
        })
    }
}
