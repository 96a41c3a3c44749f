//! Heights into normals: `bump` and `map_Bump` name an image of heights by the format, and a normal map in the files of
//! many exporters.
//!
//! The format does not say how high white is. As nothing tells how large a texel will be on the surface, a height is
//! measured in texels here, as the programs do that make normal maps of pictures: a step from black to white from one
//! texel to the next is a slope of 1, times `-bm`. So the normal is
//!
//! ```text
//! n ∝ (−∂h/∂x, −∂h/∂y, 1),   y up the image
//! ```
//!
//! by central differences, and `-bm` is the normal map's scale.

use glam::Vec3;

use crate::world::{Image, Texels};

/// Whether nearly all texels, read as 2c − 1, are unit vectors that point outward. (A grey one would need c = 0.79.)
pub(super) fn holds_normals(image: &Image) -> bool {
    let is_normal = |c: Vec3| {
        let n = 2.0 * c - 1.0;
        (n.length() - 1.0).abs() < 0.1 && n.z > 0.0 && (n.x - n.z).abs().max((n.y - n.z).abs()) > 0.05
    };
    let count = image.width as usize * image.height as usize;
    let normals = (0..count).filter(|&i| is_normal(rgb(image, i))).count();
    normals as f64 > 0.9 * count as f64
}

fn rgb(image: &Image, i: usize) -> Vec3 {
    let texel = texel(image, i);
    Vec3::new(texel[0], texel[1], texel[2])
}

/// As the file has it: 0 to 1, or what a floating-point image holds.
fn texel(image: &Image, i: usize) -> [f32; 4] {
    match &image.texels {
        Texels::Rgba8(texels) => {
            texels.get(i).map_or([0.0; 4], |t| t.map(|c| f32::from(c) / f32::from(u8::MAX)))
        }
        Texels::Rgba16(texels) => {
            texels.get(i).map_or([0.0; 4], |t| t.map(|c| f32::from(c) / f32::from(u16::MAX)))
        }
        Texels::RgbF32(texels) => texels.get(i).map_or([0.0; 4], |&[r, g, b]| [r, g, b, 1.0]),
    }
}

/// The normal map of the heights in `image`: in one channel, or its luminance. Beyond an edge is the opposite one, or
/// with `clamp` the edge itself. 16 bits a channel: a gentle slope of 8-bit heights is less than 8-bit normals can tell.
pub(super) fn normals(image: &Image, channel: Option<u8>, clamp: bool) -> Image {
    let (width, height) = (image.width as usize, image.height as usize);
    let heights = (0..width * height).map(|i| match channel {
        Some(channel) => texel(image, i).get(usize::from(channel)).copied().unwrap_or(0.0),
        None => rgb(image, i).dot(Vec3::new(0.2126, 0.7152, 0.0722)),
    });
    let heights: Vec<f32> = heights.collect();
    let at = |x: usize, y: usize| heights.get(y * width + x).copied().unwrap_or(0.0);
    // The neighbours before and after, and how far apart they are.
    let around = |i: usize, n: usize| match clamp {
        true => (i.saturating_sub(1), (i + 1).min(n - 1)),
        false => ((i + n - 1) % n, (i + 1) % n),
    };
    let encode = |n: f32| ((0.5 * n + 0.5) * f32::from(u16::MAX)).round() as u16;
    let mut texels = Vec::with_capacity(heights.len());
    for y in 0..height {
        let (above, below) = around(y, height);
        for x in 0..width {
            let (left, right) = around(x, width);
            let slope = Vec3::new(at(left, y) - at(right, y), at(x, below) - at(x, above), 2.0);
            let n = slope.normalize_or(Vec3::Z);
            texels.push([encode(n.x), encode(n.y), encode(n.z), u16::MAX]);
        }
    }
    Image {
        name: format!("{} (normals)", image.name),
        width: image.width,
        height: image.height,
        texels: Texels::Rgba16(texels),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn image(width: u32, heights: &[u8]) -> Image {
        let texels = heights.iter().map(|&h| [h, h, h, 255]).collect();
        Image {
            name: String::new(),
            width,
            height: heights.len() as u32 / width,
            texels: Texels::Rgba8(texels),
        }
    }

    fn normal(image: &Image, i: usize) -> Vec3 {
        (2.0 * rgb(image, i) - 1.0).normalize()
    }

    /// A ramp that rises by 51/255 a texel to the right, and one that rises down the image.
    #[test]
    fn a_ramp_leans_against_its_rise() {
        let right = normals(&image(3, &[0, 51, 102, 0, 51, 102, 0, 51, 102]), None, true);
        assert!(normal(&right, 4).distance(Vec3::new(-0.2, 0.0, 1.0).normalize()) < 1e-4);
        // At a clamped edge the slope is that of half a texel's step.
        assert!(normal(&right, 3).distance(Vec3::new(-0.1, 0.0, 1.0).normalize()) < 1e-4);
        let down = normals(&image(3, &[0, 0, 0, 51, 51, 51, 102, 102, 102]), None, true);
        assert!(normal(&down, 4).distance(Vec3::new(0.0, 0.2, 1.0).normalize()) < 1e-4, "y is up");
    }

    #[test]
    fn images_that_repeat_go_on_at_the_other_edge() {
        let wave = normals(&image(4, &[0, 100, 200, 100]), None, false);
        let expected = [0.0, -1.0, 0.0, 1.0].map(|x: f32| Vec3::new(x * 100.0 / 255.0, 0.0, 1.0).normalize());
        for (i, expected) in expected.into_iter().enumerate() {
            assert!(normal(&wave, i).distance(expected) < 1e-4, "{i}");
        }
    }

    #[test]
    fn heights_may_be_one_channel() {
        let texels = vec![[0, 0, 255, 255], [51, 0, 255, 255], [102, 0, 255, 255]];
        let image = Image { name: String::new(), width: 3, height: 1, texels: Texels::Rgba8(texels) };
        assert!(
            normal(&normals(&image, Some(0), true), 1).distance(Vec3::new(-0.2, 0.0, 1.0).normalize()) < 1e-4
        );
        assert!(normal(&normals(&image, Some(2), true), 1).distance(Vec3::Z) < 1e-4);
    }

    #[test]
    fn normal_maps_are_told_from_heights() {
        assert!(!holds_normals(&image(2, &[128, 255, 0, 200])));
        let flat = Texels::Rgba8(vec![[128, 128, 255, 255]; 4]);
        assert!(holds_normals(&Image { texels: flat, ..image(2, &[0; 4]) }));
        assert!(holds_normals(&normals(&image(2, &[0, 50, 70, 10]), None, false)));
    }
}
