//! The binary container GLB, and plain .gltf beside it, told apart by their first bytes.
//!
//! glTF 2.0, section 4 "GLB File Format Specification": a 12-byte header (magic, version, length), then chunks of
//! (length, type, data). The first chunk is JSON, a BIN chunk may follow, unknown chunks are skipped. No number in the file
//! is believed before it has been compared with the bytes that are there.

use super::{
    conformance::Findings,
    report::{Problem, Report},
};

const MAGIC: &[u8; 4] = b"glTF";
const HEADER: usize = 12;
const CHUNK_HEADER: usize = 8;
const JSON: u32 = 0x4E4F_534A;
const BIN: u32 = 0x004E_4942;
const RULE: &str = "GLB chunks";

/// The parts of an asset file.
pub struct Container<'a> {
    pub json: &'a [u8],
    pub bin: Option<&'a [u8]>,
    pub is_glb: bool,
}

/// Splits `bytes`; `None` (with an error reported) where there is no JSON to be found.
pub fn split<'a>(bytes: &'a [u8], report: &mut Report) -> Option<Container<'a>> {
    if !bytes.starts_with(MAGIC) {
        return Some(Container { json: bytes, bin: None, is_glb: false });
    }
    match split_glb(bytes, report) {
        Ok(container) => Some(container),
        Err(message) => {
            report.error(Problem::new("", message).help("export or download the file again"));
            None
        }
    }
}

fn split_glb<'a>(bytes: &'a [u8], report: &mut Report) -> Result<Container<'a>, String> {
    let version = u32_at(bytes, 4).ok_or("the file ends inside the GLB header")?;
    if version != 2 {
        return Err(format!("GLB version {version} is not supported, only version 2 (glTF 2.0)"));
    }
    let declared = u32_at(bytes, 8).ok_or("the file ends inside the GLB header")? as usize;
    if declared != bytes.len() {
        report.warn(Problem::new(
            "",
            format!("the GLB header gives a length of {declared} bytes, the file has {}", bytes.len()),
        ));
    }
    // A length smaller than the header is as wrong as one that is too large; what is there decides.
    let end = if declared < HEADER { bytes.len() } else { declared.min(bytes.len()) };
    let (mut json, mut bin) = (None, None);
    let mut met = Vec::new();
    let mut rest = bytes.get(HEADER..end).unwrap_or(&[]);
    while !rest.is_empty() {
        let (kind, data, after) = match chunk(rest) {
            Ok(parts) => parts,
            // With the JSON at hand, rubbish at the end does no harm.
            Err(message) if json.is_some() && rest.len() < CHUNK_HEADER => {
                report.findings.add(RULE, "", message);
                break;
            }
            Err(message) => return Err(message),
        };
        met.push(kind);
        misplaced(&met, data.len(), &mut report.findings);
        match kind {
            JSON if json.is_none() => json = Some(data),
            _ if json.is_none() => return Err("the first chunk of the GLB file is not JSON".into()),
            BIN if bin.is_none() => bin = Some(data),
            _ => {}
        }
        rest = after;
    }
    Ok(Container { json: json.ok_or("the GLB file has no JSON chunk")?, bin, is_glb: true })
}

/// What the last of the chunks `met`, of `length` bytes, does that it should not.
fn misplaced(met: &[u32], length: usize, findings: &mut Findings) {
    let Some((&kind, before)) = met.split_last() else { return };
    let name = match kind {
        JSON => "JSON",
        BIN => "BIN",
        _ => "unknown",
    };
    if !length.is_multiple_of(4) {
        let message = format!("a {name} chunk of the GLB has {length} bytes, not a multiple of 4");
        findings.add(RULE, "", message);
    }
    if kind != JSON && kind != BIN {
        return;
    }
    if before.contains(&kind) {
        findings.add(RULE, "", format!("the GLB has a second {name} chunk, which is ignored"));
    } else if kind == BIN && before.len() > 1 {
        findings.add(RULE, "", "the BIN chunk of the GLB is not the second one");
    }
}

/// Type and data of the first chunk of `rest`, and what follows it.
fn chunk(rest: &[u8]) -> Result<(u32, &[u8], &[u8]), String> {
    let length = u32_at(rest, 0).ok_or("the file ends inside a GLB chunk header")? as usize;
    let kind = u32_at(rest, 4).ok_or("the file ends inside a GLB chunk header")?;
    let body = rest.get(CHUNK_HEADER..).unwrap_or(&[]);
    if length > body.len() {
        return Err(format!("the file is cut off: a GLB chunk of {length} bytes has only {}", body.len()));
    }
    let (data, after) = body.split_at(length);
    Ok((kind, data, after))
}

fn u32_at(bytes: &[u8], at: usize) -> Option<u32> {
    let four = bytes.get(at..at.checked_add(4)?)?;
    Some(u32::from_le_bytes(four.try_into().ok()?))
}
