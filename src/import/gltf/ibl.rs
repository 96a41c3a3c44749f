//! EXT_lights_image_based: the surrounding of a scene as a cube map.
//!
//! The sharpest level of `specularImages` is the radiance; the blurred levels and the harmonics of the irradiance are for those
//! who cannot integrate it. It becomes an equirectangular map. Colours are sRGB; a PNG with alpha holds RGBD, which is the
//! linear colour divided by alpha.
//!
//! Faces are +X, −X, +Y, −Y, +Z, −Z, oriented as OpenGL's and then mirrored left to right, so that each shows what is
//! seen from inside: in the face of +Z, +X is to the left.

use std::{f32::consts::PI, path::Path};

use glam::{Quat, Vec3};
use rayon::prelude::*;
use serde::Deserialize;

use super::{
    accessor::Source,
    document::Document,
    report::{Problem, Report},
    textures,
};
use crate::{
    color::srgb_decode,
    world::{ColorSpace, Environment, EnvironmentKind, Image, ImageId, Texels},
};

pub const NAME: &str = "EXT_lights_image_based";

/// Texels along a face; the map is four times as wide.
const MAX_SIDE: u32 = 2048;
/// An alpha of RGBD below this, which would divide by nothing, is taken for it.
const LEAST_ALPHA: f32 = 1.0 / 255.0;

#[derive(Clone, Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub struct ImageLight {
    #[serde(default = "one")]
    intensity: f32,
    #[serde(default = "unrotated")]
    rotation: [f32; 4],
    pub specular_images: Vec<Vec<usize>>,
}

fn one() -> f32 {
    1.0
}

fn unrotated() -> [f32; 4] {
    [0.0, 0.0, 0.0, 1.0]
}

/// The image-based light of a scene.
pub fn index(document: &Document, scene: usize) -> Option<usize> {
    let extension = document.scenes.get(scene)?.extensions.as_ref()?.others.get(NAME)?;
    usize::try_from(extension.get("light")?.as_u64()?).ok()
}

/// The surrounding of `scene`, if it has one; its map is appended to `images`.
pub fn environment(
    source: &Source,
    scene: usize,
    folder: &Path,
    images: &mut Vec<Image>,
    report: &mut Report,
) -> Option<Environment> {
    let index = index(source.document, scene)?;
    let light = source.document.image_lights.get(index)?;
    let pointer = format!("/extensions/{NAME}/lights/{index}");
    let mut left_out = |message: String| {
        report.warn(Problem::new(&pointer, format!("{message}; the light is left out")));
    };
    if !(light.intensity >= 0.0 && light.intensity.is_finite()) {
        left_out(format!("its intensity of {} is negative or not finite", light.intensity));
        return None;
    }
    let rotation = Quat::from_array(light.rotation);
    if !(rotation.length() > 0.0 && rotation.is_finite()) {
        left_out("its rotation is no quaternion".into());
        return None;
    }
    let faces = match faces(source, light, folder) {
        Ok(faces) => faces,
        Err(message) => {
            left_out(message);
            return None;
        }
    };
    images.push(equirectangular(&faces, rotation.normalize()));
    Some(Environment {
        kind: EnvironmentKind::Image {
            image: ImageId((images.len() - 1) as u32),
            color_space: ColorSpace::Linear,
        },
        strength: light.intensity,
        rotation: 0.0,
        visible: true,
    })
}

/// One face: radiance, row by row from the top.
struct Face {
    side: usize,
    texels: Vec<Vec3>,
}

fn faces(source: &Source, light: &ImageLight, folder: &Path) -> Result<Vec<Face>, String> {
    let sharpest = light.specular_images.first().filter(|faces| faces.len() == 6);
    let sharpest = sharpest.ok_or("it does not have six faces")?;
    let decoded: Vec<Result<Face, String>> = (sharpest.par_iter())
        .map(|&i| {
            let image =
                textures::decode(source, i, folder).map_err(|message| format!("image {i} {message}"))?;
            if image.width != image.height || image.width > MAX_SIDE {
                let (w, h) = (image.width, image.height);
                return Err(format!("its face of {w} × {h} texels is not square, or larger than {MAX_SIDE}"));
            }
            Ok(Face { side: image.width as usize, texels: radiance(&image.texels) })
        })
        .collect();
    decoded.into_iter().collect()
}

fn radiance(texels: &Texels) -> Vec<Vec3> {
    let divided = |[r, g, b, a]: [f32; 4]| Vec3::new(r, g, b).map(srgb_decode) / a.max(LEAST_ALPHA);
    match texels {
        Texels::Rgba8(all) => all.iter().map(|t| divided(t.map(|c| f32::from(c) / 255.0))).collect(),
        Texels::Rgba16(all) => all.iter().map(|t| divided(t.map(|c| f32::from(c) / 65535.0))).collect(),
        Texels::RgbF32(all) => all.iter().map(|&t| Vec3::from(t)).collect(),
    }
}

/// The faces, turned by `rotation`, as a map of twice the width of its height.
fn equirectangular(faces: &[Face], rotation: Quat) -> Image {
    let side = faces.first().map_or(1, |face| face.side);
    let (width, height) = (4 * side, 2 * side);
    let inverse = rotation.conjugate();
    let row = |y: usize| {
        let polar = (y as f32 + 0.5) / height as f32 * PI;
        (0..width).map(move |x| {
            let azimuth = ((x as f32 + 0.5) / width as f32 - 0.5) * 2.0 * PI;
            let d = Vec3::new(polar.sin() * azimuth.cos(), polar.cos(), polar.sin() * azimuth.sin());
            lookup(faces, inverse * d).to_array()
        })
    };
    let texels = (0..height).into_par_iter().flat_map_iter(row).collect();
    Image {
        name: "image-based light".into(),
        width: width as u32,
        height: height as u32,
        texels: Texels::RgbF32(texels),
    }
}

fn lookup(faces: &[Face], d: Vec3) -> Vec3 {
    let a = d.abs();
    // Face, and the coordinates across it: OpenGL's s mirrored, and t.
    let (face, s, t, major) = if a.x >= a.y && a.x >= a.z {
        if d.x > 0.0 { (0, d.z, -d.y, a.x) } else { (1, -d.z, -d.y, a.x) }
    } else if a.y >= a.z {
        if d.y > 0.0 { (2, -d.x, d.z, a.y) } else { (3, -d.x, -d.z, a.y) }
    } else if d.z > 0.0 {
        (4, -d.x, -d.y, a.z)
    } else {
        (5, d.x, -d.y, a.z)
    };
    let Some(face) = faces.get(face) else { return Vec3::ZERO };
    let place =
        |c: f32| ((c / major + 1.0) / 2.0 * face.side as f32 - 0.5).clamp(0.0, (face.side - 1) as f32);
    let (x, y) = (place(s), place(t));
    let texel = |x: f32, y: f32| {
        let last = face.side - 1;
        let (x, y) = ((x as usize).min(last), (y as usize).min(last));
        face.texels.get(y * face.side + x).copied().unwrap_or(Vec3::ZERO)
    };
    let (x0, y0) = (x.floor(), y.floor());
    let upper = texel(x0, y0).lerp(texel(x0 + 1.0, y0), x - x0);
    let lower = texel(x0, y0 + 1.0).lerp(texel(x0 + 1.0, y0 + 1.0), x - x0);
    upper.lerp(lower, y - y0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Faces of two by two texels: each its number, plus a tenth to the right and a fifth below.
    fn numbered() -> Vec<Face> {
        (0..6)
            .map(|i| {
                let texel = |x: usize, y: usize| Vec3::splat(i as f32 + 0.1 * x as f32 + 0.2 * y as f32);
                Face { side: 2, texels: vec![texel(0, 0), texel(1, 0), texel(0, 1), texel(1, 1)] }
            })
            .collect()
    }

    #[test]
    fn faces_show_what_is_seen_from_inside() {
        let faces = numbered();
        for (d, expected) in [
            (Vec3::X, 0.0),
            (Vec3::NEG_X, 1.0),
            (Vec3::Y, 2.0),
            (Vec3::NEG_Y, 3.0),
            (Vec3::Z, 4.0),
            (Vec3::NEG_Z, 5.0),
        ] {
            assert!((lookup(&faces, d).x - (expected + 0.15)).abs() < 1e-5, "{d}");
        }
        // Looking along each, with +Y up (or, up and down, with +Z below and above): to the right, and down.
        for (d, right, down) in [
            (Vec3::X, Vec3::Z, Vec3::NEG_Y),
            (Vec3::NEG_X, Vec3::NEG_Z, Vec3::NEG_Y),
            (Vec3::Y, Vec3::NEG_X, Vec3::Z),
            (Vec3::NEG_Y, Vec3::NEG_X, Vec3::NEG_Z),
            (Vec3::Z, Vec3::NEG_X, Vec3::NEG_Y),
            (Vec3::NEG_Z, Vec3::X, Vec3::NEG_Y),
        ] {
            let middle = lookup(&faces, d).x;
            assert!((lookup(&faces, d + 0.5 * right).x - middle - 0.05).abs() < 1e-5, "{d} to the right");
            assert!((lookup(&faces, d + 0.5 * down).x - middle - 0.1).abs() < 1e-5, "{d} down");
        }
    }

    #[test]
    fn the_map_follows_the_convention_of_environments_and_turns() {
        let level = |rotation: Quat, x: usize| match equirectangular(&numbered(), rotation).texels {
            // The row just below the middle, at u = (x + 0.5) / 8.
            Texels::RgbF32(texels) => texels[2 * 8 + x][0].floor(),
            _ => panic!("is in floating point"),
        };
        // u = 0.5 is +X, 0.75 is +Z, 0.25 is −Z.
        assert_eq!(
            [level(Quat::IDENTITY, 4), level(Quat::IDENTITY, 6), level(Quat::IDENTITY, 2)],
            [0., 4., 5.]
        );
        // A quarter turn about +Y takes +X to −Z.
        assert_eq!(level(Quat::from_rotation_y(PI / 2.0), 2), 0.0);
    }

    #[test]
    fn rgbd_divides_linear_colour_by_alpha() {
        let found = radiance(&Texels::Rgba8(vec![[255, 0, 255, 51], [0, 0, 0, 0]]));
        assert!(found[0].abs_diff_eq(Vec3::new(5., 0., 5.), 1e-4) && found[1] == Vec3::ZERO, "{found:?}");
    }
}
