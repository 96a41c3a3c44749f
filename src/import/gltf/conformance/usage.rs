//! What views and accessors are used for: each for one purpose only, and strides only where vertices are.
//!
//! glTF 2.0, sections 3.6.1.2 "Buffer Views" and 3.6.2.4 "Data Alignment".

use std::collections::HashMap;

use serde_json::Value;

use super::{
    asset::{Asset, escaped, extension, index_of, list, members, whole},
    findings::Findings,
};
use crate::import::gltf::report::Problem;

/// `target` of a view of vertex attributes.
pub const VERTICES: u64 = 34962;
/// `target` of a view of vertex indices.
const INDICES: u64 = 34963;

#[derive(Clone, Copy, PartialEq, Eq)]
enum Purpose {
    Vertices,
    Indices,
    Image,
    InverseBindMatrices,
    AnimationInput,
    AnimationOutput,
    Instances,
    Sparse,
}

impl Purpose {
    fn name(self) -> &'static str {
        match self {
            Self::Vertices => "vertex attributes",
            Self::Indices => "vertex indices",
            Self::Image => "an image",
            Self::InverseBindMatrices => "inverse bind matrices",
            Self::AnimationInput => "times of an animation",
            Self::AnimationOutput => "values of an animation",
            Self::Instances => "instances",
            Self::Sparse => "sparse data",
        }
    }

    /// What `bufferView.target` tells apart.
    fn of_view(self) -> Self {
        match self {
            Self::AnimationInput | Self::AnimationOutput | Self::Instances => Self::Sparse,
            other => other,
        }
    }
}

pub fn check(asset: Asset, findings: &mut Findings) {
    let (accessors, views, sharing) = Default::default();
    let mut uses = Uses { asset, accessors, views, sharing, findings };
    for (i, view) in asset.items("bufferViews") {
        let purpose = match view.get("target").and_then(whole) {
            Some(VERTICES) => Purpose::Vertices,
            Some(INDICES) => Purpose::Indices,
            _ => continue,
        };
        uses.views.insert(i, (purpose, format!("/bufferViews/{i}/target")));
    }
    for (i, accessor) in asset.items("accessors") {
        for part in ["indices", "values"] {
            let pointer = format!("/accessors/{i}/sparse/{part}/bufferView");
            let json = accessor.get("sparse").and_then(|sparse| sparse.get(part));
            if let Some(view) = json.and_then(|json| index_of(json, "bufferView")) {
                uses.view(view, Purpose::Sparse, pointer);
            }
        }
    }
    for (i, image) in asset.items("images") {
        if let Some(view) = index_of(image, "bufferView") {
            uses.view(view, Purpose::Image, format!("/images/{i}/bufferView"));
        }
    }
    for (i, mesh) in asset.items("meshes") {
        for (j, primitive) in list(mesh.get("primitives")).iter().enumerate() {
            uses.primitive(&format!("/meshes/{i}/primitives/{j}"), primitive);
        }
    }
    for (i, skin) in asset.items("skins") {
        let pointer = format!("/skins/{i}/inverseBindMatrices");
        uses.accessor(skin.get("inverseBindMatrices"), Purpose::InverseBindMatrices, pointer);
    }
    for (i, animation) in asset.items("animations") {
        for (j, sampler) in list(animation.get("samplers")).iter().enumerate() {
            let at = |key: &str| format!("/animations/{i}/samplers/{j}/{key}");
            uses.accessor(sampler.get("input"), Purpose::AnimationInput, at("input"));
            uses.accessor(sampler.get("output"), Purpose::AnimationOutput, at("output"));
        }
    }
    for (i, node) in asset.items("nodes") {
        let instancing = extension(node, "EXT_mesh_gpu_instancing");
        for (name, accessor) in members(instancing.and_then(|e| e.get("attributes"))) {
            let pointer =
                format!("/nodes/{i}/extensions/EXT_mesh_gpu_instancing/attributes/{}", escaped(name));
            uses.accessor(Some(accessor), Purpose::Instances, pointer);
        }
    }
}

struct Uses<'a> {
    asset: Asset<'a>,
    /// The first use of each accessor.
    accessors: HashMap<usize, Purpose>,
    /// The first use of each view, and where it is.
    views: HashMap<usize, (Purpose, String)>,
    /// The first accessor of vertices in each view, and where it is.
    sharing: HashMap<usize, (usize, String)>,
    findings: &'a mut Findings,
}

impl Uses<'_> {
    fn primitive(&mut self, at: &str, primitive: &Value) {
        let sets = [("/attributes".to_owned(), primitive.get("attributes"))].into_iter();
        let targets = list(primitive.get("targets")).iter().enumerate();
        let targets = targets.map(|(k, target)| (format!("/targets/{k}"), Some(target)));
        for (rest, attributes) in sets.chain(targets) {
            for (name, json) in members(attributes) {
                let pointer = format!("{at}{rest}/{}", escaped(name));
                self.accessor(Some(json), Purpose::Vertices, pointer.clone());
                if let Some(index) = whole(json).and_then(|index| usize::try_from(index).ok()) {
                    self.share(index, pointer);
                }
            }
        }
        self.accessor(primitive.get("indices"), Purpose::Indices, format!("{at}/indices"));
    }

    /// Accessors of vertices that share a view need its stride.
    fn share(&mut self, accessor: usize, pointer: String) {
        let Some((view, json)) = self.asset.accessor(Some(accessor)).and_then(|a| a.view) else { return };
        let (first, there) = self.sharing.entry(view).or_insert_with(|| (accessor, pointer.clone()));
        if *first != accessor && json.get("byteStride").is_none() {
            let tell =
                |other| format!("shares bufferView {view}, which has no byteStride, with accessor {other}");
            let both = [Problem::new(there.as_str(), tell(accessor)), Problem::new(pointer, tell(*first))];
            self.findings.add_all("strides", both);
        }
    }

    fn accessor(&mut self, index: Option<&Value>, purpose: Purpose, pointer: String) {
        let Some(index) = index.and_then(whole).and_then(|index| usize::try_from(index).ok()) else { return };
        let Some(json) = self.asset.item("accessors", Some(index)) else { return };
        let first = *self.accessors.entry(index).or_insert(purpose);
        if first != purpose {
            let message = format!(
                "uses accessor {index} for {}, which elsewhere holds {}",
                purpose.name(),
                first.name()
            );
            self.findings.add("data used for two purposes", pointer, message);
        } else if let Some(view) = index_of(json, "bufferView") {
            self.view(view, purpose, pointer);
        }
    }

    fn view(&mut self, index: usize, purpose: Purpose, pointer: String) {
        let Some(view) = self.asset.item("bufferViews", Some(index)) else { return };
        if purpose != Purpose::Vertices && purpose != Purpose::Instances && view.get("byteStride").is_some() {
            let message = format!("is {}, but bufferView {index} has a byteStride", purpose.name());
            self.findings.add("strides", pointer.clone(), message);
        }
        let purpose = purpose.of_view();
        let (first, there) = self.views.entry(index).or_insert_with(|| (purpose, pointer.clone()));
        if *first != purpose {
            let message =
                format!("uses bufferView {index} for {}, but {there} for {}", purpose.name(), first.name());
            self.findings.add("data used for two purposes", pointer, message);
        }
    }
}
