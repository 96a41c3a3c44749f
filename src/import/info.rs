//! What a model file holds, for `rayo info`: names and numbers, nothing that could be rendered.

use std::{fmt, path::Path};

use serde::Serialize;

use super::{gltf, image, obj};
use crate::{
    diagnostic::{Diagnostic, Place},
    world::{Model, Texels},
};

/// Items of a list that the text shows; JSON has them all.
const SHOWN: usize = 12;

#[derive(Clone, Debug, Default, Serialize)]
pub struct Info {
    pub file: String,
    pub format: String,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub generator: Option<String>,
    pub scenes: Vec<Scene>,
    pub nodes: usize,
    pub meshes: Vec<Mesh>,
    pub skins: usize,
    pub materials: Vec<String>,
    pub variants: Vec<String>,
    pub animations: Vec<Animation>,
    pub cameras: Vec<Named>,
    pub lights: Vec<Named>,
    pub extensions: Vec<Extension>,
    /// Of the scene that is shown without any choice.
    pub shown: Shown,
    pub warnings: Vec<Warning>,
}

#[derive(Clone, Debug, Serialize)]
pub struct Scene {
    pub name: String,
    pub default: bool,
}

#[derive(Clone, Debug, Serialize)]
pub struct Mesh {
    pub name: String,
    pub primitives: usize,
    pub triangles: usize,
}

#[derive(Clone, Debug, Serialize)]
pub struct Animation {
    pub name: String,
    pub channels: usize,
    /// The first and last key, seconds.
    pub start: f32,
    pub end: f32,
}

/// A camera or a light.
#[derive(Clone, Debug, Serialize)]
pub struct Named {
    pub name: String,
    #[serde(rename = "type")]
    pub kind: String,
}

#[derive(Clone, Debug, Serialize)]
pub struct Warning {
    /// The file, with a line or a JSON pointer where there is one.
    pub place: String,
    pub message: String,
}

#[derive(Clone, Debug, Serialize)]
pub struct Extension {
    pub name: String,
    pub required: bool,
    /// Else it is ignored.
    pub supported: bool,
}

#[derive(Clone, Debug, Default, Serialize)]
pub struct Shown {
    pub instances: usize,
    /// Summed over the instances.
    pub triangles: usize,
    pub images: Vec<Image>,
    /// Bytes that the decoded images take.
    pub image_bytes: u64,
    /// Bytes that the meshes take, each once.
    pub mesh_bytes: u64,
}

#[derive(Clone, Debug, Serialize)]
pub struct Image {
    pub name: String,
    pub width: u32,
    pub height: u32,
    /// Of a channel.
    pub bits: u32,
    pub bytes: u64,
}

/// What the model at `path` holds, or all that is wrong with it.
pub fn info(path: &Path) -> Result<Info, Vec<Diagnostic>> {
    let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase()).unwrap_or_default();
    let info = match extension.as_str() {
        "glb" | "gltf" => gltf::inspect(path)?,
        "obj" => {
            let model = obj::load(path)?;
            let mesh = |mesh: &crate::world::Mesh| Mesh {
                name: mesh.name.clone(),
                primitives: 1,
                triangles: mesh.triangles.len(),
            };
            Info {
                format: "Wavefront OBJ".into(),
                meshes: model.meshes.iter().map(mesh).collect(),
                materials: model.materials.iter().map(|material| material.name.clone()).collect(),
                ..Info::default()
            }
            .showing(&model)
        }
        _ => {
            let message = "this is not a kind of model that can be read";
            let help = "models are .glb, .gltf and .obj files";
            return Err(vec![Diagnostic::error(path, Place::File, message).help(help)]);
        }
    };
    Ok(Info { file: path.display().to_string(), ..info })
}

impl Info {
    /// … of which `model` is shown.
    pub(super) fn showing(mut self, model: &Model) -> Self {
        let warnings = model.warnings.iter();
        self.warnings = warnings
            .map(|warning| Warning { place: warning.place(), message: warning.message.clone() })
            .collect();
        let triangles =
            |id: crate::world::MeshId| model.meshes.get(id.index()).map_or(0, |mesh| mesh.triangles.len());
        let images = model.images.iter().map(|image| Image {
            name: image.name.clone(),
            width: image.width,
            height: image.height,
            bits: match image.texels {
                Texels::Rgba8(_) => 8,
                Texels::Rgba16(_) => 16,
                Texels::RgbF32(_) => 32,
            },
            bytes: image::byte_size(image),
        });
        let images: Vec<_> = images.collect();
        self.shown = Shown {
            instances: model.instances.len(),
            triangles: model.instances.iter().map(|instance| triangles(instance.mesh)).sum(),
            image_bytes: images.iter().map(|image| image.bytes).sum(),
            images,
            mesh_bytes: model.meshes.iter().map(mesh_bytes).sum(),
        };
        self
    }
}

fn mesh_bytes(mesh: &crate::world::Mesh) -> u64 {
    let vectors = size_of_val(&mesh.positions[..]) + size_of_val(&mesh.normals[..]);
    let uvs: usize = mesh.uvs.iter().map(|uvs| size_of_val(&uvs[..])).sum();
    let rest = size_of_val(&mesh.tangents[..]) + size_of_val(&mesh.colors[..]);
    (vectors + uvs + rest + size_of_val(&mesh.triangles[..]) + size_of_val(&mesh.slots[..])) as u64
}

impl fmt::Display for Info {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "{}: {}", self.file, self.format)?;
        match &self.generator {
            Some(generator) => writeln!(f, ", by {}", printable(generator))?,
            None => writeln!(f)?,
        }
        let scenes = self.scenes.iter().map(|scene| {
            let mark = if scene.default { " (default)" } else { "" };
            format!("{}{mark}", printable(&scene.name))
        });
        list(f, "scenes", scenes)?;
        list(
            f,
            "meshes",
            self.meshes.iter().map(|mesh| {
                format!(
                    "{}: {} triangles, {} primitives",
                    printable(&mesh.name),
                    mesh.triangles,
                    mesh.primitives
                )
            }),
        )?;
        list(f, "materials", self.materials.iter().map(|name| printable(name)))?;
        list(f, "variants", self.variants.iter().map(|name| printable(name)))?;
        let animations = self.animations.iter().map(|animation| {
            let Animation { name, channels, start, end } = animation;
            format!("{}: {start} s to {end} s, {channels} channels", printable(name))
        });
        list(f, "animations", animations)?;
        let kinds = |all: &[Named]| {
            all.iter().map(|one| format!("{}: {}", printable(&one.name), one.kind)).collect::<Vec<_>>()
        };
        list(f, "cameras", kinds(&self.cameras).into_iter())?;
        list(f, "lights", kinds(&self.lights).into_iter())?;
        let extensions = self.extensions.iter().map(|extension| {
            let state = if extension.supported { "supported" } else { "ignored" };
            let required = if extension.required { ", required" } else { "" };
            format!("{}: {state}{required}", printable(&extension.name))
        });
        list(f, "extensions", extensions)?;
        if self.skins > 0 {
            writeln!(f, "skins: {}", self.skins)?;
        }
        let Shown { instances, triangles, images, image_bytes, mesh_bytes } = &self.shown;
        writeln!(f, "shown: {instances} instances, {triangles} triangles, meshes of {}", size(*mesh_bytes))?;
        let images = images.iter().enumerate().map(|(i, image)| {
            let Image { name, width, height, bits, bytes } = image;
            let name = if name.is_empty() { format!("image {i}") } else { printable(name) };
            format!("{}: {width} × {height}, {bits} bits, {}", name, size(*bytes))
        });
        let title = format!("images in use ({} in memory)", size(*image_bytes));
        list(f, &title, images)?;
        let warnings = self.warnings.iter();
        list(f, "warnings", warnings.map(|w| printable(&format!("{}: {}", w.place, w.message))))
    }
}

/// Nothing where there are none.
fn list(f: &mut fmt::Formatter, title: &str, items: impl ExactSizeIterator<Item = String>) -> fmt::Result {
    let count = items.len();
    if count > 0 {
        writeln!(f, "{title}: {count}")?;
    }
    for item in items.take(SHOWN) {
        writeln!(f, "    {item}")?;
    }
    if count > SHOWN { writeln!(f, "    and {} more (--json lists all)", count - SHOWN) } else { Ok(()) }
}

/// Nothing that a file holds can steer the terminal.
fn printable(text: &str) -> String {
    text.chars().map(|c| if c.is_control() { '\u{FFFD}' } else { c }).collect()
}

fn size(bytes: u64) -> String {
    match bytes {
        0..0x400 => format!("{bytes} bytes"),
        0x400..0x10_0000 => format!("{:.1} KiB", bytes as f64 / 1024.0),
        _ => format!("{:.1} MiB", bytes as f64 / (1024.0 * 1024.0)),
    }
}
