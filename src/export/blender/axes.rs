//! From +Y up to +Z up: (x, y, z) becomes (x, −z, y). Images grow upwards there: v becomes 1 − v.

use glam::{Affine2, Affine3A, Vec2, Vec3};

use super::document::Matrix;

pub fn point(p: Vec3) -> [f32; 3] {
    [p.x, -p.z, p.y]
}

pub fn uv(uv: Vec2) -> [f32; 2] {
    [uv.x, 1.0 - uv.y]
}

/// Of things whose own axes turn as well, such as meshes: C M C⁻¹.
pub fn object(m: &Affine3A) -> Matrix {
    let [x, y, z] = [m.matrix3.x_axis, m.matrix3.y_axis, m.matrix3.z_axis].map(|axis| point(axis.into()));
    rows(x, z.map(|c| -c), y, point(m.translation.into()))
}

/// Of cameras, which look along −Z with +Y up in both conventions: C M.
pub fn camera(m: &Affine3A) -> Matrix {
    let [x, y, z] = [m.matrix3.x_axis, m.matrix3.y_axis, m.matrix3.z_axis].map(|axis| point(axis.into()));
    rows(x, y, z, point(m.translation.into()))
}

/// Of a texture lookup, with v flipped on both sides; none where it changes nothing.
pub fn texture(m: &Affine2) -> Option<[[f32; 3]; 2]> {
    let (x, y, t) = (m.matrix2.x_axis, m.matrix2.y_axis, m.translation);
    let flipped = [[x.x, -y.x, t.x + y.x], [-x.y, y.y, 1.0 - t.y - y.y]];
    (flipped != [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]).then_some(flipped)
}

/// From columns.
fn rows(x: [f32; 3], y: [f32; 3], z: [f32; 3], t: [f32; 3]) -> Matrix {
    let row = |i: usize| [x[i], y[i], z[i], t[i]];
    [row(0), row(1), row(2), [0.0, 0.0, 0.0, 1.0]]
}

#[cfg(test)]
mod tests {
    use glam::{Mat3, Mat4};

    use super::*;

    fn apply(m: Matrix, p: [f32; 3]) -> Vec3 {
        Mat4::from_cols_array_2d(&m).transpose().transform_point3(p.into())
    }

    #[test]
    fn placing_and_turning_the_axes_commute() {
        let m = Affine3A::from_mat3_translation(
            Mat3::from_cols(Vec3::new(1.0, 2.0, 3.0), Vec3::new(-4.0, 5.0, 6.0), Vec3::new(7.0, 8.0, -9.0)),
            Vec3::new(10.0, 11.0, 12.0),
        );
        let p = Vec3::new(0.5, -1.5, 2.5);
        assert_eq!(apply(object(&m), point(p)), Vec3::from(point(m.transform_point3(p))));
        assert_eq!(apply(camera(&m), p.into()), Vec3::from(point(m.transform_point3(p))));
    }

    #[test]
    fn textures_are_looked_up_at_the_same_texel() {
        let m = Affine2::from_scale_angle_translation(Vec2::new(2.0, 3.0), 0.5, Vec2::new(0.25, -0.75));
        let at = Vec2::new(0.3, 0.9);
        let [u, v] = uv(at);
        let [a, b] = texture(&m).expect("not the identity").map(|[x, y, t]| x * u + y * v + t);
        let expected = Vec2::from(uv(m.transform_point2(at)));
        assert!(Vec2::new(a, b).abs_diff_eq(expected, 1e-6));
        assert_eq!(texture(&Affine2::IDENTITY), None);
    }
}
