//! The bytes behind buffers and buffer views.
//!
//! glTF 2.0, section 3.6.1 "Buffers and Buffer Views". A buffer without URI is the BIN chunk if it is the first and there
//! is one; otherwise it has no bytes, which matters only to what reads it.

use std::{borrow::Cow, collections::HashMap, path::Path};

use gltf::json::{self, Index, buffer::Stride};

use super::{
    container::Container,
    document::Document,
    report::{Problem, Report},
    uri,
};

/// Bytes that compressed geometry of a file may take once it is decompressed, for each way of compression.
pub const MAX_DECODED_BYTES: usize = 1 << 30;

/// Where views find their bytes.
pub struct Buffers<'a> {
    /// Of each buffer, cut to its `byteLength`.
    buffers: Vec<Option<Cow<'a, [u8]>>>,
    /// Of views that hold something else than their part of a buffer.
    replaced: HashMap<usize, Vec<u8>>,
}

/// Loads all buffers and checks that views lie inside them.
pub fn load<'a>(
    document: &Document,
    container: &Container<'a>,
    folder: &Path,
    report: &mut Report,
) -> Buffers<'a> {
    let mut loaded = Vec::new();
    for (i, buffer) in document.buffers.iter().enumerate() {
        let length = buffer.byte_length.0;
        let bytes = match (&buffer.uri, i, container.bin) {
            (Some(uri), ..) => uri::read(uri, folder, length).map(|bytes| Some(Cow::Owned(bytes))),
            (None, 0, Some(bin)) => Ok(Some(Cow::Borrowed(bin))),
            (None, 0, None) if container.is_glb && length > 0 => {
                Err("is missing, and the GLB has no BIN chunk".into())
            }
            (None, ..) => Ok(None),
        };
        match bytes {
            Ok(Some(mut bytes)) if bytes.len() as u64 >= length => {
                match &mut bytes {
                    Cow::Owned(owned) => owned.truncate(length as usize),
                    Cow::Borrowed(all) => *all = all.get(..length as usize).unwrap_or(all),
                }
                loaded.push(Some(bytes));
                continue;
            }
            Ok(Some(bytes)) => report.error(
                Problem::new(
                    format!("/buffers/{i}/byteLength"),
                    format!("is {length}, but the data has only {} bytes", bytes.len()),
                )
                .help("the file is cut off or was edited by hand; export or download it again"),
            ),
            Ok(None) => {}
            Err(message) => report.error(Problem::new(format!("/buffers/{i}/uri"), message)),
        }
        loaded.push(None);
    }
    check_views(document, report);
    Buffers { buffers: loaded, replaced: HashMap::new() }
}

fn check_views(document: &Document, report: &mut Report) {
    for (i, view) in document.views.iter().enumerate() {
        let length = document.buffers.get(view.buffer.value()).map_or(0, |b| b.byte_length.0);
        let offset = view.byte_offset.map_or(0, |o| o.0);
        if offset.checked_add(view.byte_length.0).is_none_or(|end| end > length) {
            report.error(Problem::new(
                format!("/bufferViews/{i}"),
                format!(
                    "has {} bytes from {offset}, more than the {length} of its buffer {}",
                    view.byte_length.0,
                    view.buffer.value()
                ),
            ));
        }
    }
}

impl Buffers<'_> {
    /// The bytes of a view. `None` where its buffer has none.
    pub fn view(&self, document: &Document, index: usize) -> Option<&[u8]> {
        if let Some(bytes) = self.replaced.get(&index) {
            return Some(bytes);
        }
        let view = document.views.get(index)?;
        let start = usize::try_from(view.byte_offset.map_or(0, |o| o.0)).ok()?;
        let end = start.checked_add(usize::try_from(view.byte_length.0).ok()?)?;
        self.bytes(view.buffer.value())?.get(start..end)
    }

    /// The bytes of a buffer. `None` where it has none.
    pub fn bytes(&self, buffer: usize) -> Option<&[u8]> {
        self.buffers.get(buffer)?.as_deref()
    }

    /// View `index` shall hold `bytes`, which are as many as it had.
    pub fn replace(&mut self, index: usize, bytes: Vec<u8>) {
        self.replaced.insert(index, bytes);
    }

    /// A new view of `document` that holds `bytes`.
    pub fn append(
        &mut self,
        document: &mut Document,
        bytes: Vec<u8>,
        stride: Option<usize>,
    ) -> Index<json::buffer::View> {
        let index = document.views.len();
        document.views.push(json::buffer::View {
            buffer: Index::new(u32::MAX),
            byte_length: bytes.len().into(),
            byte_offset: None,
            byte_stride: stride.map(Stride),
            name: None,
            target: None,
            extensions: None,
            extras: Default::default(),
        });
        self.replaced.insert(index, bytes);
        Index::new(index as u32)
    }
}
