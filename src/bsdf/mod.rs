//! Scattering at a surface, in its local frame: the shading normal is +Z, `wo` and `wi` are unit vectors that
//! point away from the surface. Pure functions of uniform numbers: no textures, no random state, no scenes.

use glam::Vec3;

/// What kind of scattering a sample is: bounce limits count by it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    Diffuse,
    Glossy,
    Transmission,
}

/// A direction drawn by a BSDF.
#[derive(Clone, Copy, Debug)]
pub struct BsdfSample {
    /// Towards where the light comes from; local frame, unit.
    pub wi: Vec3,
    /// BSDF × |cos θᵢ| / pdf.
    pub weight: Vec3,
    /// Solid-angle density, sr⁻¹, of `wi` over all lobes; for a delta lobe the probability of having chosen it.
    pub pdf: f32,
    /// `wi` has a delta distribution: no other strategy can find it.
    pub delta: bool,
    pub kind: Kind,
}
