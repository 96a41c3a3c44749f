//! The closest hit so far, and which hits count.

use super::Hit;
use crate::geometry::Ray;

/// `ANY`: the first hit that counts ends the search. Hits on filtered objects count if `accept` says so.
pub struct Search<F, const ANY: bool> {
    /// Until something is found: t is the ray's `t_max`, and object and primitive are 0, before which no hit sorts.
    best: Hit,
    found: bool,
    accept: F,
}

impl<F: FnMut(&Hit) -> bool, const ANY: bool> Search<F, ANY> {
    pub fn new(ray: &Ray, accept: F) -> Self {
        let best = Hit { t: ray.t_max, u: 0.0, v: 0.0, object: 0, primitive: 0 };
        Self { best, found: false, accept }
    }

    /// Where any hit will do, whether there is one; it may be in the wrong place.
    pub fn result(self) -> Option<Hit> {
        self.found.then_some(self.best)
    }

    /// Hits beyond this do not count.
    #[inline(always)]
    pub fn t_max(&self) -> f32 {
        self.best.t
    }

    /// The largest t that may count.
    #[inline(always)]
    pub fn t_last(&self) -> f32 {
        // One below `t_max`, unless it may depend on the numbers. (Of 0 and what is below, a NaN or something negative.)
        if ANY { f32::from_bits(self.best.t.to_bits().wrapping_sub(1)) } else { self.best.t }
    }

    /// Takes some hit that counts, it does not matter which, and ends the search.
    #[inline(always)]
    pub fn end(&mut self) {
        debug_assert!(ANY);
        self.found = true;
    }

    /// Takes a hit, with t above the ray's `t_min`, if it counts and is the closest so far. `true` ends the search.
    #[inline(always)]
    pub fn offer(&mut self, hit: Hit, filtered: bool) -> bool {
        let (best, id) = (&self.best, |h: &Hit| (h.object, h.primitive));
        let closer = hit.t < best.t || (hit.t == best.t && id(&hit) < id(best));
        if !closer || (filtered && !(self.accept)(&hit)) {
            return false;
        }
        self.best = hit;
        self.found = true;
        ANY
    }
}
