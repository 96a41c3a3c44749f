//! Orthonormal right-handed frames, in which BSDFs are evaluated: z is the normal.
//!
//! From z alone: Duff et al., "Building an Orthonormal Basis, Revisited" (JCGT 2017), exact on the whole sphere
//! but for the sign change at z = 0.

use glam::Vec3;

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    pub x: Vec3,
    pub y: Vec3,
    pub z: Vec3,
}

impl Frame {
    /// Any frame about the unit vector `z`.
    pub fn from_z(z: Vec3) -> Self {
        let sign = 1f32.copysign(z.z);
        let a = -1.0 / (sign + z.z);
        let b = z.x * z.y * a;
        let x = Vec3::new(1.0 + sign * z.x * z.x * a, sign * b, -sign * z.x);
        let y = Vec3::new(b, sign + z.y * z.y * a, -z.y);
        Self { x, y, z }
    }

    pub fn to_local(&self, w: Vec3) -> Vec3 {
        Vec3::new(w.dot(self.x), w.dot(self.y), w.dot(self.z))
    }

    pub fn to_world(&self, w: Vec3) -> Vec3 {
        w.x * self.x + w.y * self.y + w.z * self.z
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::stats::r3;
    use crate::sampling::warp::uniform_sphere;

    fn check(frame: &Frame) {
        let Frame { x, y, z } = *frame;
        for (a, b) in [(x, y), (y, z), (z, x)] {
            assert!(a.dot(b).abs() < 1e-6 && (a.length() - 1.0).abs() < 1e-6, "{frame:?}");
        }
        assert!(x.cross(y).dot(z) > 0.999, "left-handed: {frame:?}");
        let w = Vec3::new(0.3, -0.7, 0.2);
        assert!(frame.to_world(frame.to_local(w)).abs_diff_eq(w, 1e-6));
        assert!(frame.to_local(z).abs_diff_eq(Vec3::Z, 1e-6));
    }

    #[test]
    fn frames_are_orthonormal_and_right_handed() {
        let poles = [Vec3::Z, Vec3::NEG_Z, Vec3::X, Vec3::new(0.0, -1e-7, -1.0).normalize()];
        let spread = (0..500).map(|i| uniform_sphere(glam::Vec2::new(r3(i)[0], r3(i)[1])));
        for z in poles.into_iter().chain(spread) {
            check(&Frame::from_z(z));
        }
    }
}
