//! The JSON of an asset as typed sections.
//!
//! The types are those of the `gltf` crate; its own loader is stricter than the specification in places and believes
//! too much in others, so the text is first put right:
//! - numbers that are integers but written `1.0` become integers, and integers too large for an index become floats (which
//!   an index then refuses, where the crate would cut them to 32 bits);
//! - `extras` and extensions that are not read are dropped, so that errors in them cannot matter;
//! - a scene may have no `nodes`.
//!
//! Each element is then read by itself: one that is wrong is reported with its pointer, and the rest are still looked at.

use std::collections::{BTreeMap, BTreeSet};

use gltf::json;
use serde::de::DeserializeOwned;
use serde_json::{Map, Value};

use super::{
    animation::Animation,
    conformance, extensions,
    ibl::{self, ImageLight},
    pointer,
    report::{Problem, Report},
};

/// Keys whose integers may exceed 32 bits.
const WIDE: [&str; 3] = ["byteLength", "byteOffset", "count"];
const BOM: &[u8] = b"\xEF\xBB\xBF";

#[derive(Default)]
pub struct Document {
    pub accessors: Vec<json::Accessor>,
    pub buffers: Vec<json::Buffer>,
    pub views: Vec<json::buffer::View>,
    pub cameras: Vec<json::Camera>,
    pub images: Vec<json::Image>,
    pub lights: Vec<json::extensions::scene::khr_lights_punctual::Light>,
    pub materials: Vec<json::Material>,
    pub meshes: Vec<json::Mesh>,
    pub nodes: Vec<json::Node>,
    pub samplers: Vec<json::texture::Sampler>,
    pub scenes: Vec<json::Scene>,
    pub textures: Vec<json::Texture>,
    pub skins: Vec<json::Skin>,
    /// The default scene, as the file gives it.
    pub scene: Option<usize>,
    pub animations: Vec<Animation>,
    pub image_lights: Vec<ImageLight>,
    /// The JSON of what KHR_animation_pointer points to, by its pointer.
    pub animated: BTreeMap<String, Value>,
    /// Extensions that the file uses or lists, with those that are required.
    pub extensions: BTreeMap<String, bool>,
    pub generator: Option<String>,
    /// What morph targets change beside what the crate reads, by mesh and primitive.
    pub morphs: BTreeMap<(usize, usize), Vec<Morph>>,
    /// Names of KHR_materials_variants.
    pub variants: Vec<String>,
}

/// Accessors of a morph target by the names of their attributes: TEXCOORD_n and COLOR_0.
pub type Morph = BTreeMap<String, usize>;

/// Reads `text`; `None` (with errors reported) where it is not a glTF 2 document that can be read on.
pub fn parse(text: &[u8], report: &mut Report) -> Option<Document> {
    let mut root = object(text, report)?;
    conformance::document(&root, &mut report.findings);
    version(&root, report)?;
    let text = |value: Option<&Value>| value.and_then(Value::as_str).map(str::to_owned);
    let generator = text(root.get("asset").and_then(|asset| asset.get("generator")));
    let variants =
        root.get("extensions").and_then(|e| e.get("KHR_materials_variants")?.get("variants")?.as_array());
    let variants = variants.into_iter().flatten().map(|v| text(v.get("name")).unwrap_or_default()).collect();
    let mut met = BTreeSet::new();
    for value in root.values_mut() {
        normalise(value, "", &mut met);
    }
    if let Some(Value::Object(found)) = root.get_mut("extensions") {
        extensions::retain_supported(found, &mut met);
    }
    let extensions = extensions::check(&root, &met, report);

    let animations: Vec<Animation> = section(&mut root, "", "animations", report);
    let animated = animated(&root, &animations);
    let mut lights_of = |name: &str| match root.get_mut("extensions").and_then(|e| e.get_mut(name)) {
        Some(Value::Object(lights)) => std::mem::take(lights),
        _ => Map::new(),
    };
    let (mut lights, mut image_lights) = (lights_of("KHR_lights_punctual"), lights_of(ibl::NAME));
    if let Some(Value::Array(scenes)) = root.get_mut("scenes") {
        for scene in scenes.iter_mut().filter_map(Value::as_object_mut) {
            scene.entry("nodes").or_insert_with(|| Value::Array(Vec::new()));
        }
    }
    let morphs = morphs(&root);
    let scene = match root.get("scene") {
        None | Some(Value::Null) => None,
        Some(value) => {
            let index = value.as_u64().and_then(|i| usize::try_from(i).ok());
            if index.is_none() {
                report.error(Problem::new("/scene", "is not an index"));
            }
            index
        }
    };
    let document = Document {
        accessors: section(&mut root, "", "accessors", report),
        buffers: section(&mut root, "", "buffers", report),
        views: section(&mut root, "", "bufferViews", report),
        cameras: section(&mut root, "", "cameras", report),
        images: section(&mut root, "", "images", report),
        lights: section(&mut lights, "/extensions/KHR_lights_punctual", "lights", report),
        materials: section(&mut root, "", "materials", report),
        meshes: section(&mut root, "", "meshes", report),
        nodes: section(&mut root, "", "nodes", report),
        samplers: section(&mut root, "", "samplers", report),
        scenes: section(&mut root, "", "scenes", report),
        textures: section(&mut root, "", "textures", report),
        skins: section(&mut root, "", "skins", report),
        scene,
        animations,
        image_lights: section(&mut image_lights, "/extensions/EXT_lights_image_based", "lights", report),
        animated,
        extensions,
        generator,
        morphs,
        variants,
    };
    report.checkpoint().map(|()| document)
}

/// What is no index is left to the typed reading, or to nobody.
fn morphs(root: &Map<String, Value>) -> BTreeMap<(usize, usize), Vec<Morph>> {
    fn list(value: Option<&Value>) -> &[Value] {
        value.and_then(Value::as_array).map_or(&[], |list| list)
    }
    let mut morphs = BTreeMap::new();
    for (i, mesh) in list(root.get("meshes")).iter().enumerate() {
        for (j, primitive) in list(mesh.get("primitives")).iter().enumerate() {
            let attributes = |target: &Value| {
                let members = target.as_object().into_iter().flatten();
                let wanted = members.filter(|(name, _)| name.starts_with("TEXCOORD_") || *name == "COLOR_0");
                wanted
                    .filter_map(|(name, index)| Some((name.clone(), usize::try_from(index.as_u64()?).ok()?)))
                    .collect()
            };
            let targets: Vec<Morph> = list(primitive.get("targets")).iter().map(attributes).collect();
            if targets.iter().any(|target| !target.is_empty()) {
                morphs.insert((i, j), targets);
            }
        }
    }
    morphs
}

/// What channels of `animations` point to and is to be read again once it is changed.
fn animated(root: &Map<String, Value>, animations: &[Animation]) -> BTreeMap<String, Value> {
    let channels = animations.iter().flat_map(|animation| &animation.channels);
    let pointers: BTreeSet<_> = channels
        .filter_map(|channel| pointer::element(channel.target.pointer()?))
        .map(|(section, index, _)| (section, index))
        .collect();
    let find = |section: &str, index: usize| {
        let mut parts = section.split('/').skip(1);
        let first = root.get(parts.next()?)?;
        parts.try_fold(first, |value, part| value.get(part))?.get(index)
    };
    (pointers.into_iter())
        .filter_map(|(section, index)| Some((format!("{section}/{index}"), find(section, index)?.clone())))
        .collect()
}

fn object(text: &[u8], report: &mut Report) -> Option<Map<String, Value>> {
    let marked = text.strip_prefix(BOM);
    if marked.is_some() {
        report.findings.add("JSON", "", "the JSON begins with a byte order mark, which glTF forbids");
    }
    let text = marked.unwrap_or(text);
    // A GLB chunk is padded with spaces; some exporters pad with zeros.
    let end = text.iter().rposition(|&b| b != 0).map_or(0, |last| last + 1);
    if end < text.len() {
        report.findings.add("JSON", "", "the JSON is padded with zeros, not with spaces");
    }
    let text = text.get(..end).unwrap_or(text);
    match serde_json::from_slice::<Value>(text) {
        Ok(Value::Object(root)) => Some(root),
        Ok(_) => {
            report.error(Problem::new("", "this is not a glTF file: its JSON is not an object"));
            None
        }
        Err(e) if e.line() == 0 || text.iter().all(u8::is_ascii_whitespace) => {
            report.error(Problem::new("", "this is not a glTF file: it holds no JSON"));
            None
        }
        Err(e) => {
            report.error_at_line(e.line(), format!("this is not a glTF file: its JSON is broken: {e}"));
            None
        }
    }
}

/// Accepts 2.x, as section 3.2 of the specification asks of a loader, unless `minVersion` asks for more than 2.0.
fn version(root: &Map<String, Value>, report: &mut Report) -> Option<()> {
    let asset = root.get("asset");
    let text = |key| asset.and_then(|a| a.get(key)).and_then(Value::as_str);
    let Some(version) = text("version") else {
        report.error(
            Problem::new("/asset/version", "is missing: not a glTF 2.0 file")
                .help("every glTF 2.0 file has \"asset\": { \"version\": \"2.0\" }"),
        );
        return None;
    };
    let problem = match (numbers(version), text("minVersion").map(numbers)) {
        (None, _) => Problem::new("/asset/version", format!("{version:?} is not a version such as \"2.0\"")),
        (Some((2, _)), None | Some(Some((2, 0)) | Some((0 | 1, _)))) => return Some(()),
        (Some((2, _)), Some(None)) => Problem::new("/asset/minVersion", "is not a version such as \"2.0\""),
        (Some((2, _)), Some(_)) => Problem::new("/asset/minVersion", "asks for more than glTF 2.0"),
        (Some(_), _) => {
            Problem::new("/asset/version", format!("glTF {version} is not supported, only glTF 2.x"))
        }
    };
    report.error(problem.help("export the asset as glTF 2.0"));
    None
}

/// "2.0" as (2, 0).
fn numbers(version: &str) -> Option<(u32, u32)> {
    let (major, minor) = version.split_once('.')?;
    Some((major.parse().ok()?, minor.parse().ok()?))
}

/// Puts right what the typed reading would refuse or cut, below `value`. The depth of recursion is bounded by
/// `serde_json`, which refuses more than 128 levels.
fn normalise(value: &mut Value, key: &str, met: &mut BTreeSet<String>) {
    match value {
        Value::Number(number) => {
            if let Some(whole) = number.as_f64().filter(|f| !number.is_u64() && is_index(*f)) {
                *number = (whole as u64).into();
            } else if number.as_u64().is_some_and(|u| u > u32::MAX.into())
                && !WIDE.contains(&key)
                && let Some(float) = number.as_f64().and_then(serde_json::Number::from_f64)
            {
                *number = float;
            }
        }
        Value::Array(items) => items.iter_mut().for_each(|item| normalise(item, key, met)),
        Value::Object(members) => {
            members.remove("extras");
            if let Some(Value::Object(found)) = members.get_mut("extensions") {
                extensions::retain_supported(found, met);
            }
            members.iter_mut().for_each(|(key, member)| normalise(member, key, met));
        }
        Value::Null | Value::Bool(_) | Value::String(_) => {}
    }
}

/// Whether a float is an integer that 53 bits hold exactly.
fn is_index(f: f64) -> bool {
    (0.0..=9_007_199_254_740_991.0).contains(&f) && f.fract() == 0.0
}

fn section<T: DeserializeOwned>(
    root: &mut Map<String, Value>,
    parent: &str,
    key: &str,
    report: &mut Report,
) -> Vec<T> {
    let items = match root.remove(key) {
        None | Some(Value::Null) => return Vec::new(),
        Some(Value::Array(items)) => items,
        Some(_) => {
            report.error(Problem::new(format!("{parent}/{key}"), "is not an array"));
            return Vec::new();
        }
    };
    let read = |(i, item)| match serde_json::from_value(item) {
        Ok(item) => Some(item),
        Err(e) => {
            report.error(Problem::new(format!("{parent}/{key}/{i}"), e.to_string()));
            None
        }
    };
    items.into_iter().enumerate().filter_map(read).collect()
}
