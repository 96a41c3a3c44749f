//! Image files by their first bytes, and whether they are whole as far as headers tell.
//!
//! PNG (ISO/IEC 15948): chunks of length, type, data and checksum up to IEND. JPEG (ITU T.81, annex B): segments up to the
//! frame header. WebP (RFC 9649): a RIFF file of the length that it says. KTX 2.0: a header of 80 bytes.

use std::io::{ErrorKind, Read, Seek, SeekFrom};

/// Chunks or segments that are followed.
const MAX_PARTS: usize = 1 << 16;

/// The media type of an image.
pub fn kind(source: &mut impl Read) -> Option<&'static str> {
    let mut magic = Vec::new();
    source.take(12).read_to_end(&mut magic).ok()?;
    match magic.as_slice() {
        [0x89, b'P', b'N', b'G', b'\r', b'\n', 0x1A, b'\n', ..] => Some("image/png"),
        [0xFF, 0xD8, 0xFF, ..] => Some("image/jpeg"),
        [b'R', b'I', b'F', b'F', _, _, _, _, b'W', b'E', b'B', b'P', ..] => Some("image/webp"),
        [0xAB, b'K', b'T', b'X', b' ', b'2', b'0', 0xBB, ..] => Some("image/ktx2"),
        _ => None,
    }
}

/// What is wrong with a file of this kind.
pub fn check(kind: &str, source: &mut (impl Read + Seek)) -> Result<(), String> {
    let checked = match kind {
        "image/png" => png(source),
        "image/jpeg" => jpeg(source),
        "image/webp" => webp(source),
        _ => size(source).and_then(|size| if size < 80 { Err(Broken::CutOff) } else { Ok(()) }),
    };
    checked.map_err(|broken| match broken {
        Broken::CutOff => format!("is cut off: the {kind} file ends early"),
        Broken::Wrong(what) => format!("is not a valid {kind} file: {what}"),
        Broken::Unreadable(why) => format!("cannot be read: {why}"),
    })
}

enum Broken {
    CutOff,
    Wrong(&'static str),
    Unreadable(String),
}

impl From<std::io::Error> for Broken {
    fn from(error: std::io::Error) -> Self {
        match error.kind() {
            ErrorKind::UnexpectedEof => Self::CutOff,
            _ => Self::Unreadable(error.to_string()),
        }
    }
}

fn size(source: &mut impl Seek) -> Result<u64, Broken> {
    Ok(source.seek(SeekFrom::End(0))?)
}

fn bytes<const N: usize>(source: &mut impl Read) -> Result<[u8; N], Broken> {
    let mut bytes = [0; N];
    source.read_exact(&mut bytes)?;
    Ok(bytes)
}

fn png(source: &mut (impl Read + Seek)) -> Result<(), Broken> {
    let end = size(source)?;
    let mut at = source.seek(SeekFrom::Start(8))?;
    for part in 0..MAX_PARTS {
        let [a, b, c, d, kind @ ..] = bytes::<8>(source)?;
        let length = u64::from(u32::from_be_bytes([a, b, c, d]));
        if part == 0 && (kind != *b"IHDR" || length != 13) {
            return Err(Broken::Wrong("it does not begin with a header"));
        }
        if part == 0 {
            let [a, b, c, d, e, f, g, h, ..] = bytes::<13>(source)?;
            if [a, b, c, d] == [0; 4] || [e, f, g, h] == [0; 4] {
                return Err(Broken::Wrong("it has no size"));
            }
        }
        at += 12 + length;
        if at > end {
            return Err(Broken::CutOff);
        }
        if kind == *b"IEND" {
            return Ok(());
        }
        source.seek(SeekFrom::Start(at))?;
    }
    Ok(())
}

fn jpeg(source: &mut (impl Read + Seek)) -> Result<(), Broken> {
    source.seek(SeekFrom::Start(2))?;
    for _ in 0..MAX_PARTS {
        let [mark, mut kind] = bytes::<2>(source)?;
        if mark != 0xFF {
            return Err(Broken::Wrong("a segment does not begin where one should"));
        }
        // Any number of fill bytes.
        for _ in 0..MAX_PARTS {
            if kind != 0xFF {
                break;
            }
            [kind] = bytes::<1>(source)?;
        }
        match kind {
            // Markers without a segment: TEM and RSTn.
            0x01 | 0xD0..=0xD7 => continue,
            0xD8..=0xDA => return Err(Broken::Wrong("its image data begins before its frame header")),
            _ => {}
        }
        let length = u16::from_be_bytes(bytes::<2>(source)?);
        let Some(rest) = length.checked_sub(2) else {
            return Err(Broken::Wrong("a segment has an impossible length"));
        };
        // SOF0 to SOF15 but for DHT, JPG and DAC.
        if matches!(kind, 0xC0..=0xCF) && ![0xC4, 0xC8, 0xCC].contains(&kind) {
            if rest < 6 {
                return Err(Broken::Wrong("its frame header is too short"));
            }
            bytes::<6>(source)?;
            return Ok(());
        }
        source.seek(SeekFrom::Current(rest.into()))?;
    }
    Ok(())
}

fn webp(source: &mut (impl Read + Seek)) -> Result<(), Broken> {
    let end = size(source)?;
    source.seek(SeekFrom::Start(4))?;
    let declared = u64::from(u32::from_le_bytes(bytes::<4>(source)?));
    if end < declared + 8 {
        return Err(Broken::CutOff);
    }
    source.seek(SeekFrom::Start(12))?;
    match bytes::<4>(source)? {
        [b'V', b'P', b'8', b' ' | b'L' | b'X'] => Ok(()),
        _ => Err(Broken::Wrong("its first part is of no known kind")),
    }
}
