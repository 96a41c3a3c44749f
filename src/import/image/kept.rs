//! Decoded images in the cache: width, height and kind of texels, and the texels as they are in memory.

use std::path::Path;

use super::{check_size, decode_anew};
use crate::{
    cache::{Cache, Key},
    world::{Image, Texels},
};

/// As [`decode`](super::decode).
pub fn decode(cache: &Cache, bytes: &[u8], name: &str) -> Result<Image, String> {
    let ending = Path::new(name).extension().unwrap_or_default().to_ascii_lowercase();
    let key = Key::of("image", &[ending.as_encoded_bytes(), bytes]);
    if let Some((width, height, texels)) = cache.get(&key, empty, raw_mut) {
        return Ok(Image { name: name.to_owned(), width, height, texels });
    }
    let image = decode_anew(bytes, name)?;
    let (kind, texels): (u32, &[u8]) = match &image.texels {
        Texels::Rgba8(texels) => (0, texels.as_flattened()),
        Texels::Rgba16(texels) => (1, bytemuck::cast_slice(texels)),
        Texels::RgbF32(texels) => (2, bytemuck::cast_slice(texels)),
    };
    cache.put(&key, bytemuck::cast([image.width, image.height, kind, 0]), texels);
    Ok(image)
}

/// Texels to be read, if there are as many bytes as they take.
fn empty(head: [u8; 16], length: u64) -> Option<(u32, u32, Texels)> {
    let [width, height, kind, _]: [u32; 4] = bytemuck::cast(head);
    let bytes = *[4, 8, 12].get(kind as usize)?;
    check_size(width, height, bytes).ok()?;
    let count = u64::from(width) * u64::from(height);
    if count * bytes != length {
        return None;
    }
    let count = usize::try_from(count).ok()?;
    let texels = match kind {
        0 => Texels::Rgba8(vec![[0; 4]; count]),
        1 => Texels::Rgba16(vec![[0; 4]; count]),
        _ => Texels::RgbF32(vec![[0.0; 3]; count]),
    };
    Some((width, height, texels))
}

fn raw_mut((.., texels): &mut (u32, u32, Texels)) -> &mut [u8] {
    match texels {
        Texels::Rgba8(texels) => texels.as_flattened_mut(),
        Texels::Rgba16(texels) => bytemuck::cast_slice_mut(texels),
        Texels::RgbF32(texels) => bytemuck::cast_slice_mut(texels),
    }
}

#[cfg(test)]
mod tests {
    use std::io::Cursor;

    use ::image::{DynamicImage, ImageBuffer, ImageFormat, Rgb, Rgb32FImage, Rgba};

    use super::*;
    use crate::cache::LIMIT;

    #[test]
    fn texels_of_every_kind_come_back() {
        let folder = tempfile::tempdir().expect("a folder");
        let cache = Cache::open(folder.path(), LIMIT).expect("opened");
        let eight = ImageBuffer::from_fn(3, 2, |x, y| Rgb([x as u8, y as u8, 9]));
        let sixteen = ImageBuffer::from_fn(3, 2, |x, y| Rgba([x as u16, y as u16, 9, 60_000]));
        let float = Rgb32FImage::from_fn(3, 2, |x, y| Rgb([x as f32, y as f32, 0.5]));
        let files: [(DynamicImage, ImageFormat); 3] = [
            (eight.into(), ImageFormat::Png),
            (sixteen.into(), ImageFormat::Png),
            (float.into(), ImageFormat::Hdr),
        ];
        for (image, format) in files {
            let mut bytes = Vec::new();
            image.write_to(&mut Cursor::new(&mut bytes), format).expect("encoded");
            let first = format!("{:?}", decode(&cache, &bytes, "a.x"));
            assert_eq!(first, format!("{:?}", decode_anew(&bytes, "a.x")));
            let key = Key::of("image", &[b"x", &bytes]);
            let kept = cache.get(&key, empty, raw_mut).expect("kept");
            let kept = Image { name: "a.x".into(), width: kept.0, height: kept.1, texels: kept.2 };
            assert_eq!(format!("{:?}", Ok::<_, String>(kept)), first);
        }
        // A head that says other than there is.
        for head in [[3, 2, 0, 0], [2, 3, 3, 0], [0, 0, 0, 0], [u32::MAX, u32::MAX, 2, 0]] {
            assert!(empty(bytemuck::cast(head), 8).is_none(), "{head:?}");
        }
    }
}
