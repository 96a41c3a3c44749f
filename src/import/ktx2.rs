//! KTX 2.0 textures: Basis Universal (ETC1S, UASTC, raw ASTC) and uncompressed, plain or under Zstandard.
//!
//! The largest level of the first layer and face is read. What the numbers mean (sRGB or linear) is said by who uses the
//! texture, as with all images. Blocks of other GPU formats (BC, ETC2) are not decoded.
//!
//! Format numbers are those of `VkFormat`.

use std::io::Read;

use basisu::{DecodeFlags, TargetFormat, Transcoder};
use ktx2::{Format, Reader, SupercompressionScheme};

use super::image::{Decoded, check_size, finite};
use crate::world::Texels;

pub const MAGIC: [u8; 12] = *b"\xABKTX 20\xBB\r\n\x1A\n";

/// Decodes the texture in `bytes`. The error completes "cannot be decoded: ".
pub fn decode(bytes: &[u8]) -> Result<Decoded, String> {
    let reader = Reader::new(bytes).map_err(|e| format!("its KTX2 container is broken: {e}"))?;
    let header = reader.header();
    let (width, height) = (header.pixel_width, header.pixel_height);
    if height == 0 || header.pixel_depth > 1 {
        return Err("it is a texture of one or three dimensions".into());
    }
    let Some(layout) = header.format.and_then(Layout::of) else {
        return transcode(bytes, width, height, header.format);
    };
    check_size(width, height, layout.target_bytes())?;
    let level = reader.levels().next().ok_or("it has no level")?;
    let texels = width as usize * height as usize;
    let size = texels * layout.bytes();
    let expanded = match header.supercompression_scheme {
        None => None,
        Some(SupercompressionScheme::Zstandard) => Some(inflate(level.data, size)?),
        Some(_) => return Err("its supercompression is not read, only Zstandard".into()),
    };
    let data = expanded.as_deref().unwrap_or(level.data);
    let data = data.get(..size).ok_or("it ends before its last texel")?;
    Ok((width, height, layout.texels(data)))
}

/// Basis Universal to RGBA.
fn transcode(bytes: &[u8], width: u32, height: u32, format: Option<Format>) -> Result<Decoded, String> {
    check_size(width, height, 4)?;
    let unreadable = || match format {
        Some(format) => format!("its format (VkFormat {}) is not read", format.value()),
        None => "its Basis Universal data is broken, or of a kind that is not read".into(),
    };
    let transcoder = Transcoder::new(bytes).map_err(|_| unreadable())?;
    if transcoder.base_dimensions() != (width, height) || !transcoder.supports(TargetFormat::Rgba32) {
        return Err(unreadable());
    }
    let rgba = transcoder
        .transcode_image(0, 0, 0, TargetFormat::Rgba32, DecodeFlags::NONE)
        .map_err(|e| format!("its Basis Universal data is broken: {e:?}"))?;
    let (texels, rest) = rgba.as_chunks::<4>();
    if texels.len() != width as usize * height as usize || !rest.is_empty() {
        return Err("its Basis Universal data does not fill it".into());
    }
    Ok((width, height, Texels::Rgba8(texels.to_vec())))
}

/// The `size` bytes that `data` is the Zstandard stream of.
fn inflate(data: &[u8], size: usize) -> Result<Vec<u8>, String> {
    let broken = |e: String| format!("its Zstandard data is broken: {e}");
    let decoder = ruzstd::StreamingDecoder::new(data).map_err(|e| broken(e.to_string()))?;
    let mut bytes = Vec::new();
    decoder.take(size as u64).read_to_end(&mut bytes).map_err(|e| broken(e.to_string()))?;
    Ok(bytes)
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Component {
    U8,
    U16,
    F16,
    F32,
}

/// How texels of an uncompressed format lie.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Layout {
    component: Component,
    channels: usize,
    /// Blue comes first.
    swapped: bool,
}

impl Layout {
    fn of(format: Format) -> Option<Self> {
        use Component::{F16, F32, U8, U16};
        let (component, channels, swapped) = match format {
            Format::R8_UNORM | Format::R8_SRGB => (U8, 1, false),
            Format::R8G8_UNORM | Format::R8G8_SRGB => (U8, 2, false),
            Format::R8G8B8_UNORM | Format::R8G8B8_SRGB => (U8, 3, false),
            Format::B8G8R8_UNORM | Format::B8G8R8_SRGB => (U8, 3, true),
            Format::R8G8B8A8_UNORM | Format::R8G8B8A8_SRGB => (U8, 4, false),
            Format::B8G8R8A8_UNORM | Format::B8G8R8A8_SRGB => (U8, 4, true),
            Format::R16_UNORM => (U16, 1, false),
            Format::R16G16_UNORM => (U16, 2, false),
            Format::R16G16B16_UNORM => (U16, 3, false),
            Format::R16G16B16A16_UNORM => (U16, 4, false),
            Format::R16_SFLOAT => (F16, 1, false),
            Format::R16G16_SFLOAT => (F16, 2, false),
            Format::R16G16B16_SFLOAT => (F16, 3, false),
            Format::R16G16B16A16_SFLOAT => (F16, 4, false),
            Format::R32_SFLOAT => (F32, 1, false),
            Format::R32G32_SFLOAT => (F32, 2, false),
            Format::R32G32B32_SFLOAT => (F32, 3, false),
            Format::R32G32B32A32_SFLOAT => (F32, 4, false),
            _ => return None,
        };
        Some(Self { component, channels, swapped })
    }

    /// Of a texel in the file.
    fn bytes(self) -> usize {
        let component = match self.component {
            Component::U8 => 1,
            Component::U16 | Component::F16 => 2,
            Component::F32 => 4,
        };
        component * self.channels
    }

    /// Of a texel in memory.
    fn target_bytes(self) -> u64 {
        match self.component {
            Component::U8 => 4,
            Component::U16 => 8,
            Component::F16 | Component::F32 => 12,
        }
    }

    fn texels(self, data: &[u8]) -> Texels {
        let texels = data.chunks_exact(self.bytes());
        match self.component {
            Component::U8 => Texels::Rgba8(texels.map(|t| self.rgba(u8::MAX, |c| t[c])).collect()),
            Component::U16 => {
                let read = |t: &[u8], c: usize| u16::from_le_bytes([t[2 * c], t[2 * c + 1]]);
                Texels::Rgba16(texels.map(|t| self.rgba(u16::MAX, |c| read(t, c))).collect())
            }
            Component::F16 => {
                let read = |t: &[u8], c: usize| half(u16::from_le_bytes([t[2 * c], t[2 * c + 1]]));
                Texels::RgbF32(texels.map(|t| self.rgb(|c| read(t, c))).collect())
            }
            Component::F32 => {
                let read = |t: &[u8], c: usize| {
                    f32::from_le_bytes([t[4 * c], t[4 * c + 1], t[4 * c + 2], t[4 * c + 3]])
                };
                Texels::RgbF32(texels.map(|t| self.rgb(|c| read(t, c))).collect())
            }
        }
    }

    /// Channels that are not there are 0, alpha is full: as Vulkan samples them.
    fn rgba<T: Copy + Default>(self, full: T, channel: impl Fn(usize) -> T) -> [T; 4] {
        let at = |c: usize| if c < self.channels { channel(c) } else { T::default() };
        let alpha = if self.channels == 4 { channel(3) } else { full };
        if self.swapped { [at(2), at(1), at(0), alpha] } else { [at(0), at(1), at(2), alpha] }
    }

    fn rgb(self, channel: impl Fn(usize) -> f32) -> [f32; 3] {
        let [r, g, b, _] = self.rgba(1.0, channel);
        finite([r, g, b])
    }
}

/// IEEE 754 binary16.
fn half(bits: u16) -> f32 {
    let sign = if bits >> 15 == 1 { -1.0 } else { 1.0 };
    let (exponent, mantissa) = (i32::from(bits >> 10 & 0x1F), f32::from(bits & 0x3FF));
    sign * match exponent {
        0 => mantissa * 2f32.powi(-24),
        0x1F if mantissa == 0.0 => f32::INFINITY,
        0x1F => f32::NAN,
        _ => (1.0 + mantissa / 1024.0) * 2f32.powi(exponent - 15),
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// A texture of one level with these bytes, of a format as `VkFormat` numbers it.
    pub fn texture(format: u32, size: [u32; 2], zstandard: bool, data: &[u8]) -> Vec<u8> {
        let mut bytes = MAGIC.to_vec();
        let dfd_length = 44u32;
        let words =
            [format, 1, size[0], size[1], 0, 0, 1, 1, if zstandard { 2 } else { 0 }, 104, dfd_length, 0, 0];
        words.iter().for_each(|word| bytes.extend(word.to_le_bytes()));
        bytes.extend([0; 16]);
        let start = 104 + u64::from(dfd_length);
        for word in [start, data.len() as u64, data.len() as u64] {
            bytes.extend(word.to_le_bytes());
        }
        // A basic descriptor of one sample.
        let descriptor = [dfd_length, 0, 2 | 40 << 16, 1 | 1 << 8 | 1 << 16, 0, 0, 0, 0, 0, 0, 0];
        descriptor.iter().for_each(|word| bytes.extend(word.to_le_bytes()));
        bytes.extend(data);
        bytes
    }

    #[test]
    fn uncompressed_formats() {
        let (_, _, texels) = decode(&texture(37, [2, 1], false, &[1, 2, 3, 4, 5, 6, 7, 8])).expect("is read");
        assert!(matches!(&texels, Texels::Rgba8(t) if t[..] == [[1, 2, 3, 4], [5, 6, 7, 8]]), "{texels:?}");
        let (_, _, texels) = decode(&texture(44, [1, 1], false, &[1, 2, 3, 4])).expect("is read");
        assert!(matches!(&texels, Texels::Rgba8(t) if t[..] == [[3, 2, 1, 4]]), "{texels:?}");
        let (_, _, texels) = decode(&texture(9, [1, 2], false, &[7, 9])).expect("is read");
        assert!(
            matches!(&texels, Texels::Rgba8(t) if t[..] == [[7, 0, 0, 255], [9, 0, 0, 255]]),
            "{texels:?}"
        );
        let (_, _, texels) = decode(&texture(91, [1, 1], false, &[1, 0, 2, 0, 3, 0, 0, 1])).expect("is read");
        assert!(matches!(&texels, Texels::Rgba16(t) if t[..] == [[1, 2, 3, 256]]), "{texels:?}");
        // 1, −2, and the largest half.
        let halves = [0x00, 0x3C, 0x00, 0xC0, 0xFF, 0x7B];
        let (_, _, texels) = decode(&texture(90, [1, 1], false, &halves)).expect("is read");
        assert!(matches!(&texels, Texels::RgbF32(t) if t[..] == [[1., -2., 65504.]]), "{texels:?}");
        let floats: Vec<u8> = [0.5f32, f32::NAN].iter().flat_map(|f| f.to_le_bytes()).collect();
        let (_, _, texels) = decode(&texture(103, [1, 1], false, &floats)).expect("is read");
        assert!(matches!(&texels, Texels::RgbF32(t) if t[..] == [[0.5, 0., 0.]]), "{texels:?}");
    }

    #[test]
    fn halves_that_are_tiny() {
        assert_eq!((half(1), half(0x8000), half(0x0400)), (2f32.powi(-24), 0.0, 2f32.powi(-14)));
        assert!(half(0x7C00) == f32::INFINITY && half(0x7E00).is_nan());
    }

    #[test]
    fn zstandard_is_undone() {
        // A frame with a block of one byte repeated (RLE), eight times: RFC 8878.
        let frame = [0x28, 0xB5, 0x2F, 0xFD, 0x20, 8, 8 << 3 | 1 << 1 | 1, 0, 0, 42];
        let (_, _, texels) = decode(&texture(37, [2, 1], true, &frame)).expect("is read");
        assert!(matches!(&texels, Texels::Rgba8(t) if t[..] == [[42; 4]; 2]), "{texels:?}");
        assert!(decode(&texture(37, [3, 1], true, &frame)).is_err_and(|e| e.contains("last texel")));
        assert!(decode(&texture(37, [2, 1], true, &frame[..7])).is_err_and(|e| e.contains("Zstandard")));
    }

    #[test]
    fn what_cannot_be_read_is_refused_with_a_reason() {
        let refused = |bytes: &[u8], text: &str| match decode(bytes) {
            Err(error) => assert!(error.contains(text), "{error}"),
            Ok(_) => panic!("{text} is read"),
        };
        refused(&texture(37, [2, 2], false, &[0; 15]), "last texel");
        refused(&texture(131, [4, 4], false, &[0; 8]), "VkFormat 131");
        refused(&texture(37, [1 << 17, 1], false, &[0; 8]), "along a side");
        refused(&texture(37, [4, 0], false, &[0; 8]), "dimensions");
        refused(&texture(37, [1, 1], false, &[0; 8])[..90], "container");
    }
}
