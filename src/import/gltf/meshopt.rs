//! EXT_meshopt_compression and KHR_meshopt_compression: buffer views stored in meshoptimizer's encodings.
//!
//! The extension of a view says where its compressed bytes are, how they are encoded (`mode`: ATTRIBUTES, TRIANGLES or
//! INDICES) and what is undone after that (`filter`: NONE, OCTAHEDRAL, QUATERNION, EXPONENTIAL or COLOR). Decoded, the view
//! holds `count` elements of `byteStride` bytes and is read like any other; the buffer that it names itself is a fallback for
//! readers without the extension, and mostly not there.

use std::panic::{AssertUnwindSafe, catch_unwind};

use draco_gltf::meshopt::{MeshoptFilter, MeshoptMode, decode_buffer_view};
use rayon::prelude::*;
use serde::Deserialize;

use super::{
    buffers::{Buffers, MAX_DECODED_BYTES},
    document::Document,
    report::{Problem, Report, quoted},
};

pub const NAMES: [&str; 2] = ["KHR_meshopt_compression", "EXT_meshopt_compression"];

/// Bytes of an element, which the encoding allows.
const MAX_STRIDE: usize = 256;

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct Extension {
    buffer: usize,
    #[serde(default)]
    byte_offset: usize,
    byte_length: usize,
    byte_stride: usize,
    count: usize,
    mode: String,
    filter: Option<String>,
}

/// A view to decode.
struct Job {
    view: usize,
    pointer: String,
    extension: Extension,
    mode: MeshoptMode,
    filter: MeshoptFilter,
    size: usize,
}

/// Decodes every compressed view of `document` into `buffers`.
pub fn decompress(document: &Document, buffers: &mut Buffers, report: &mut Report) {
    let mut jobs = Vec::new();
    let mut total = 0usize;
    for (view, json) in document.views.iter().enumerate() {
        let extensions = json.extensions.as_ref();
        let found = extensions.and_then(|e| NAMES.iter().find_map(|name| Some((name, e.others.get(*name)?))));
        let Some((name, value)) = found else { continue };
        let pointer = format!("/bufferViews/{view}/extensions/{name}");
        match job(view, pointer.clone(), value, json.byte_length.0) {
            Ok(job) => {
                total = total.saturating_add(job.size);
                jobs.push(job);
            }
            Err((rest, message)) => report.error(Problem::new(format!("{pointer}{rest}"), message)),
        }
    }
    if total > MAX_DECODED_BYTES {
        let message =
            format!("{total} bytes once decompressed are more than the {MAX_DECODED_BYTES} that are read");
        report.error(Problem::new("/bufferViews", message));
    }
    if report.checkpoint().is_none() {
        return;
    }
    let decoded: Vec<_> =
        jobs.par_iter().map(|job| (job, decode(job, buffers).map_err(|m| (&job.pointer, m)))).collect();
    for (job, result) in decoded {
        match result {
            Ok(bytes) => buffers.replace(job.view, bytes),
            Err((pointer, message)) => report.error(
                Problem::new(pointer.clone(), message)
                    .help("the file is broken; export it again, or without mesh compression"),
            ),
        }
    }
}

/// What the extension of a view of `length` bytes asks for; the error has the place in it.
fn job(
    view: usize,
    pointer: String,
    value: &serde_json::Value,
    length: u64,
) -> Result<Job, (&'static str, String)> {
    let extension: Extension = Extension::deserialize(value).map_err(|e| ("", e.to_string()))?;
    let mode = MeshoptMode::from_name(&extension.mode)
        .map_err(|_| ("/mode", format!("is {}, not a mode that is known", quoted(&extension.mode))))?;
    let filter = extension.filter.as_deref().unwrap_or("NONE");
    let filter = MeshoptFilter::from_name(filter)
        .map_err(|_| ("/filter", format!("is {}, not a filter that is known", quoted(filter))))?;
    let stride = extension.byte_stride;
    let fits = match mode {
        MeshoptMode::Attributes => stride.is_multiple_of(4) && (4..=MAX_STRIDE).contains(&stride),
        MeshoptMode::Triangles | MeshoptMode::Indices => stride == 2 || stride == 4,
    };
    if !fits {
        return Err(("/byteStride", format!("is {stride}, which its mode does not allow")));
    }
    if mode == MeshoptMode::Triangles && !extension.count.is_multiple_of(3) {
        return Err(("/count", format!("is {}, not a whole number of triangles", extension.count)));
    }
    let size = extension.count.checked_mul(stride).filter(|&size| size as u64 == length);
    let size = size.ok_or_else(|| {
        let message = format!(
            "has {} elements of {stride} bytes, but the view has a byteLength of {length}",
            extension.count
        );
        ("", message)
    })?;
    Ok(Job { view, pointer, extension, mode, filter, size })
}

fn decode(job: &Job, buffers: &Buffers) -> Result<Vec<u8>, String> {
    let Extension { buffer, byte_offset, byte_length, byte_stride, count, .. } = job.extension;
    let range = byte_offset.checked_add(byte_length).map(|end| byte_offset..end);
    let source = range.and_then(|range| buffers.bytes(buffer)?.get(range));
    let source = source.ok_or_else(|| {
        format!("has {byte_length} bytes from {byte_offset}, which buffer {buffer} does not hold")
    })?;
    let mut bytes = vec![0; job.size];
    // Known to keep to the bounds of its input; but it is not ours.
    catch_unwind(AssertUnwindSafe(|| {
        decode_buffer_view(&mut bytes, source, job.mode, job.filter, count, byte_stride)
    }))
    .map_err(|_| "cannot be decoded".to_owned())
    .and_then(|result| result.map_err(|e| format!("cannot be decoded: {e}")))?;
    Ok(bytes)
}
