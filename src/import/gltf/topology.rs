//! Corners of triangle lists, strips and fans.
//!
//! glTF 2.0, section 3.7.2.1: pᵢ of a strip is (vᵢ, vᵢ₊₁₊₍ᵢ mod 2₎, vᵢ₊₂₋₍ᵢ mod 2₎), of a fan (vᵢ₊₁, vᵢ₊₂, v₀).

use gltf::json::mesh::Mode;

#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Topology {
    List,
    Strip,
    Fan,
}

impl Topology {
    /// `None` for points and lines.
    pub fn of(mode: Mode) -> Option<Self> {
        match mode {
            Mode::Triangles => Some(Self::List),
            Mode::TriangleStrip => Some(Self::Strip),
            Mode::TriangleFan => Some(Self::Fan),
            Mode::Points | Mode::Lines | Mode::LineLoop | Mode::LineStrip => None,
        }
    }

    /// Triangles that so many corners make.
    pub fn count(self, corners: usize) -> usize {
        match self {
            Self::List => corners / 3,
            Self::Strip | Self::Fan => corners.saturating_sub(2),
        }
    }

    /// Whether corners are left over.
    pub fn is_incomplete(self, corners: usize) -> bool {
        match self {
            Self::List => !corners.is_multiple_of(3),
            Self::Strip | Self::Fan => matches!(corners, 1 | 2),
        }
    }

    /// Triangle `i` as positions in the list of corners.
    pub fn triangle(self, i: usize) -> [usize; 3] {
        match self {
            Self::List => [3 * i, 3 * i + 1, 3 * i + 2],
            Self::Strip => [i, i + 1 + i % 2, i + 2 - i % 2],
            Self::Fan => [i + 1, i + 2, 0],
        }
    }
}
