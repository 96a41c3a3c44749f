//! Numbers and vectors as the scene language writes them: with all their digits, and never anything but numbers.

use glam::{Affine3A, DVec3, Vec2, Vec3};

/// The shortest text that reads back as the same number; 0 where there is no number.
pub fn num(x: f32) -> String {
    if x.is_finite() { format!("{x:?}") } else { "0".into() }
}

pub fn num64(x: f64) -> String {
    if x.is_finite() { format!("{x:?}") } else { "0".into() }
}

pub fn vec3(v: Vec3) -> String {
    format!("<{},{},{}>", num(v.x), num(v.y), num(v.z))
}

pub fn dvec3(v: DVec3) -> String {
    format!("<{},{},{}>", num64(v.x), num64(v.y), num64(v.z))
}

pub fn vec2(v: Vec2) -> String {
    format!("<{},{}>", num(v.x), num(v.y))
}

pub fn rgb(color: Vec3) -> String {
    if color.x == color.y && color.y == color.z {
        format!("rgb {}", num(color.x))
    } else {
        format!("rgb {}", vec3(color))
    }
}

/// As POV-Ray has it: the images of the three axes, then of the origin.
pub fn matrix(m: &Affine3A) -> String {
    let columns = m.to_cols_array();
    let numbers: Vec<String> = columns.iter().map(|&x| num(x)).collect();
    format!("matrix <{}>", numbers.join(","))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_read_back_and_are_numbers() {
        for x in [0.1, -1e-30, 3.4e38, 1.0 / 3.0, 16_777_217.0] {
            assert_eq!(num(x).parse::<f32>().expect("a number"), x);
        }
        assert_eq!(num(f32::NAN), "0");
        assert_eq!(rgb(Vec3::splat(0.5)), "rgb 0.5");
        let m = Affine3A::from_translation(Vec3::new(1.0, 2.0, 3.0));
        assert_eq!(matrix(&m), "matrix <1.0,0.0,0.0,0.0,1.0,0.0,0.0,0.0,1.0,1.0,2.0,3.0>");
    }
}
