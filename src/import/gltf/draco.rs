//! KHR_draco_mesh_compression: the geometry of primitives as Draco bitstreams.
//!
//! The extension of a primitive names a buffer view with the stream, and for each attribute that is in it the id there.
//! Decoded, each becomes an accessor like any other, of the type that the primitive's accessor has; so do the indices.
//! The counts are those of the stream: some encoders merge vertices and leave the old ones in the document. Attributes that
//! are not in the stream are left as they are.

use std::{
    collections::BTreeMap,
    panic::{AssertUnwindSafe, catch_unwind},
};

use draco_core::{DecodeLimits, decoder_buffer::DecoderBuffer, mesh::Mesh, mesh_decoder::MeshDecoder};
use gltf::json::{
    self, Index,
    accessor::{ComponentType, GenericComponentType},
    mesh::Mode,
    validation::Checked,
};
use rayon::prelude::*;
use serde::Deserialize;

use super::{
    buffers::{Buffers, MAX_DECODED_BYTES},
    document::Document,
    report::{Problem, Report},
};

pub const NAME: &str = "KHR_draco_mesh_compression";

#[derive(Clone, Deserialize, PartialEq, Eq, PartialOrd, Ord)]
#[serde(rename_all = "camelCase")]
struct Extension {
    buffer_view: usize,
    attributes: BTreeMap<String, u32>,
}

/// A stream as primitives use it: its attributes with the types that they want.
#[derive(Clone, PartialEq, Eq, PartialOrd, Ord)]
struct Job {
    view: usize,
    attributes: Vec<Attribute>,
}

#[derive(Clone, PartialEq, Eq, PartialOrd, Ord)]
struct Attribute {
    name: String,
    id: u32,
    accessor: usize,
    components: usize,
    /// Position of the component type in [`TYPES`].
    component: usize,
}

const TYPES: [ComponentType; 6] = [
    ComponentType::I8,
    ComponentType::U8,
    ComponentType::I16,
    ComponentType::U16,
    ComponentType::U32,
    ComponentType::F32,
];

/// The triangles of a stream, and of each attribute of the job its tightly packed values.
struct Decoded {
    points: usize,
    triangles: usize,
    indices: Vec<u8>,
    attributes: Vec<Vec<u8>>,
}

/// Decodes the compressed primitives of `document` and makes them plain ones.
pub fn decompress(document: &mut Document, buffers: &mut Buffers, report: &mut Report) {
    let mut wanted: BTreeMap<Job, Vec<(usize, usize)>> = BTreeMap::new();
    for (m, mesh) in document.meshes.iter().enumerate() {
        for (p, primitive) in mesh.primitives.iter().enumerate() {
            let extension = primitive.extensions.as_ref().and_then(|e| e.others.get(NAME));
            let Some(extension) = extension else { continue };
            match job(document, primitive, extension) {
                Ok(job) => wanted.entry(job).or_default().push((m, p)),
                Err((rest, message)) => report.error(Problem::new(at(m, p) + &rest, message)),
            }
        }
    }
    if report.checkpoint().is_none() {
        return;
    }
    let decoded: Vec<_> = (wanted.into_par_iter())
        .map(|(job, users)| {
            let stream =
                buffers.view(document, job.view).ok_or("its buffer has no data in this file".to_owned());
            let decoded = stream.and_then(|stream| decode(stream, &job));
            (job, users, decoded)
        })
        .collect();
    let mut total = 0;
    for (job, users, decoded) in decoded {
        let Some(&(m, p)) = users.first() else { continue };
        match decoded {
            Ok(decoded) => {
                total += decoded.indices.len() + decoded.attributes.iter().map(Vec::len).sum::<usize>();
                if total > MAX_DECODED_BYTES {
                    let message =
                        format!("more than {MAX_DECODED_BYTES} bytes of decompressed geometry are not read");
                    return report.error(Problem::new("/meshes", message));
                }
                replace(document, buffers, &users, &job, decoded);
            }
            Err(message) => report.error(
                Problem::new(at(m, p), format!("the Draco data cannot be decoded: {message}"))
                    .help("the file is broken; export it again, or without mesh compression"),
            ),
        }
    }
}

fn at(mesh: usize, primitive: usize) -> String {
    format!("/meshes/{mesh}/primitives/{primitive}/extensions/{NAME}")
}

/// The error has the place in the extension in it.
fn job(
    document: &Document,
    primitive: &json::mesh::Primitive,
    extension: &serde_json::Value,
) -> Result<Job, (String, String)> {
    let extension = Extension::deserialize(extension).map_err(|e| (String::new(), e.to_string()))?;
    if extension.buffer_view >= document.views.len() {
        let message =
            format!("refers to bufferView {}, but there are {}", extension.buffer_view, document.views.len());
        return Err(("/bufferView".into(), message));
    }
    if !matches!(primitive.mode, Checked::Valid(Mode::Triangles | Mode::TriangleStrip)) {
        return Err((
            String::new(),
            "is on a primitive of another mode than TRIANGLES or TRIANGLE_STRIP".into(),
        ));
    }
    let mut attributes = Vec::new();
    for (name, &id) in &extension.attributes {
        let problem = |message: &str| (format!("/attributes/{name}"), message.to_owned());
        let found = primitive.attributes.iter().find(|(semantic, _)| match semantic {
            Checked::Valid(semantic) => semantic.to_string() == *name,
            Checked::Invalid => false,
        });
        // Attributes of the application are nothing to us, here as elsewhere.
        let Some((_, index)) = found else {
            if name.starts_with('_') {
                continue;
            }
            return Err(problem("is not an attribute of the primitive"));
        };
        let json = document.accessors.get(index.value());
        let json = json.ok_or_else(|| problem("has an accessor that does not exist"))?;
        let (Checked::Valid(component), Checked::Valid(shape)) = (json.component_type, json.type_) else {
            return Err(problem("has an accessor of no type of glTF"));
        };
        attributes.push(Attribute {
            name: name.clone(),
            id,
            accessor: index.value(),
            components: shape.multiplicity(),
            component: TYPES.iter().position(|&t| t == component.0).unwrap_or(TYPES.len() - 1),
        });
    }
    Ok(Job { view: extension.buffer_view, attributes })
}

fn decode(stream: &[u8], job: &Job) -> Result<Decoded, String> {
    // Known not to panic; but it is not ours.
    catch_unwind(AssertUnwindSafe(|| decode_unguarded(stream, job)))
        .unwrap_or_else(|_| Err("its decoder failed on it".into()))
}

fn decode_unguarded(stream: &[u8], job: &Job) -> Result<Decoded, String> {
    // Half of the whole, as two may be decoded at a time; 12 bytes are the least that a point or triangle takes.
    let most = MAX_DECODED_BYTES as u64 / 2;
    let limits = DecodeLimits::default()
        .with_max_points(most / 12)
        .with_max_faces(most / 12)
        .with_max_decoded_bytes(most);
    let mut mesh = Mesh::new();
    let mut buffer = DecoderBuffer::new(stream).with_limits(limits);
    MeshDecoder::new().decode(&mut buffer, &mut mesh).map_err(|e| e.to_string())?;
    let points = mesh.num_points();
    let triangles = mesh.num_faces();
    let indices = mesh.faces().iter().flatten().flat_map(|point| point.0.to_le_bytes()).collect();
    let mut attributes = Vec::new();
    let mut size = 0usize;
    for wanted in &job.attributes {
        let Attribute { name, id, components, .. } = wanted;
        let attribute = mesh
            .attribute_by_unique_id(*id)
            .ok_or_else(|| format!("it has no attribute {id}, which is to be {name}"))?;
        if usize::from(attribute.num_components()) != *components {
            let found = attribute.num_components();
            return Err(format!("its attribute {id} has {found} components, but {name} has {components}"));
        }
        size = size.saturating_add(points.saturating_mul(components * 4));
        if size as u64 > most {
            return Err("its attributes are too large".into());
        }
        let values = attribute.read_f32s(points, *components);
        attributes.push(packed(&values, *components, TYPES[wanted.component]));
    }
    Ok(Decoded { points, triangles, indices, attributes })
}

/// `values` in the type of an accessor, each element of `components` at a multiple of 4 bytes.
fn packed(values: &[f32], components: usize, component: ComponentType) -> Vec<u8> {
    let stride = (components * component.size()).next_multiple_of(4);
    let mut bytes = Vec::with_capacity(values.len() / components.max(1) * stride);
    for element in values.chunks_exact(components.max(1)) {
        let start = bytes.len();
        for &value in element {
            match component {
                ComponentType::I8 => bytes.extend((value as i8).to_le_bytes()),
                ComponentType::U8 => bytes.push(value as u8),
                ComponentType::I16 => bytes.extend((value as i16).to_le_bytes()),
                ComponentType::U16 => bytes.extend((value as u16).to_le_bytes()),
                ComponentType::U32 => bytes.extend((value as u32).to_le_bytes()),
                ComponentType::F32 => bytes.extend(value.to_le_bytes()),
            }
        }
        bytes.resize(start + stride, 0);
    }
    bytes
}

/// Gives the primitives `users` accessors of what was decoded.
fn replace(
    document: &mut Document,
    buffers: &mut Buffers,
    users: &[(usize, usize)],
    job: &Job,
    decoded: Decoded,
) {
    let plain = json::Accessor {
        buffer_view: None,
        byte_offset: None,
        count: (3 * decoded.triangles).into(),
        component_type: Checked::Valid(GenericComponentType(ComponentType::U32)),
        extensions: None,
        extras: Default::default(),
        type_: Checked::Valid(json::accessor::Type::Scalar),
        min: None,
        max: None,
        name: None,
        normalized: false,
        sparse: None,
    };
    let view = buffers.append(document, decoded.indices, None);
    let indices = push(document, json::Accessor { buffer_view: Some(view), ..plain.clone() });
    let mut attributes = Vec::new();
    for (wanted, bytes) in job.attributes.iter().zip(decoded.attributes) {
        let stride = (wanted.components * TYPES[wanted.component].size()).next_multiple_of(4);
        let view = buffers.append(document, bytes, Some(stride));
        let original = document.accessors.get(wanted.accessor).cloned().unwrap_or_else(|| plain.clone());
        let accessor = json::Accessor {
            buffer_view: Some(view),
            byte_offset: None,
            count: decoded.points.into(),
            ..original
        };
        attributes.push((&wanted.name, push(document, accessor)));
    }
    for &(m, p) in users {
        let Some(primitive) = document.meshes.get_mut(m).and_then(|mesh| mesh.primitives.get_mut(p)) else {
            continue;
        };
        primitive.mode = Checked::Valid(Mode::Triangles);
        primitive.indices = Some(indices);
        for (semantic, index) in &mut primitive.attributes {
            let Checked::Valid(semantic) = semantic else { continue };
            let name = semantic.to_string();
            if let Some((_, decoded)) = attributes.iter().find(|(attribute, _)| **attribute == name) {
                *index = *decoded;
            }
        }
    }
}

fn push(document: &mut Document, accessor: json::Accessor) -> Index<json::Accessor> {
    document.accessors.push(accessor);
    Index::new((document.accessors.len() - 1) as u32)
}
