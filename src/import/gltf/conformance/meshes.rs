//! Primitives: attributes and their accessors, indices, morph targets, variants.
//!
//! glTF 2.0, section 3.7.2 "Meshes".

use std::collections::{BTreeMap, BTreeSet, HashSet};

use serde_json::Value;

use super::{
    asset::{Accessor, Asset, escaped, extension, list, members, whole},
    findings::Findings,
    formats, surfaces,
};

pub fn check(asset: Asset, findings: &mut Findings) {
    let is_quantized = asset.uses("KHR_mesh_quantization");
    for (i, mesh) in asset.items("meshes") {
        let primitives = list(mesh.get("primitives"));
        let targets = |primitive: &Value| list(primitive.get("targets")).len();
        let first = primitives.first().map_or(0, targets);
        for (j, json) in primitives.iter().enumerate() {
            let at = format!("/meshes/{i}/primitives/{j}");
            if targets(json) != first {
                let message =
                    format!("has {} morph targets, but the first primitive has {first}", targets(json));
                findings.add("morph targets", format!("{at}/targets"), message);
            }
            Primitive { asset, json, is_quantized, at: &at, findings }.check();
            surfaces::check(asset, json, &at, findings);
        }
        if let Some(weights) = mesh.get("weights").map(|weights| list(Some(weights)).len())
            && weights != first
        {
            let message = format!("has {weights} elements for {first} morph targets");
            findings.add("morph weights", format!("/meshes/{i}/weights"), message);
        }
    }
}

struct Primitive<'a> {
    asset: Asset<'a>,
    json: &'a Value,
    is_quantized: bool,
    at: &'a str,
    findings: &'a mut Findings,
}

impl<'a> Primitive<'a> {
    fn check(&mut self) {
        let attributes = self.json.get("attributes");
        self.sets(attributes);
        let vertices = self.attributes(attributes, "/attributes", None);
        for (k, target) in list(self.json.get("targets")).iter().enumerate() {
            self.attributes(Some(target), &format!("/targets/{k}"), Some((attributes, vertices)));
        }
        if let Some(indices) = self.accessor(self.json.get("indices")) {
            self.format(&indices, formats::INDICES.into_iter(), "/indices");
        }
        self.variants();
    }

    fn accessor(&self, index: Option<&Value>) -> Option<Accessor<'a>> {
        self.asset.accessor(index.and_then(whole).and_then(|index| usize::try_from(index).ok()))
    }

    fn add(&mut self, rule: &'static str, rest: &str, message: impl Into<String>) {
        self.findings.add(rule, format!("{}{rest}", self.at), message);
    }

    fn format(
        &mut self,
        accessor: &Accessor,
        allowed: impl Iterator<Item = &'static str> + Clone,
        rest: &str,
    ) {
        let format = accessor.format();
        if !allowed.clone().any(|other| other == format) {
            let message = format!("has data of {format}, not {}", allowed.collect::<Vec<_>>().join(" or "));
            self.add("accessors' formats", rest, message);
        }
    }

    /// Names, formats, alignment and counts of attributes, or of those of a morph target of what `base` has. Returns the
    /// number of vertices.
    fn attributes(
        &mut self,
        attributes: Option<&'a Value>,
        at: &str,
        base: Option<(Option<&Value>, Option<u64>)>,
    ) -> Option<u64> {
        let mut vertices = base.and_then(|(_, vertices)| vertices);
        for (name, json) in members(attributes) {
            let rest = format!("{at}/{}", escaped(name));
            let allowed = formats::attribute(name, base.is_some(), self.is_quantized);
            let is_known = allowed.is_some();
            if !is_known && !name.starts_with('_') {
                self.add(
                    "names of attributes",
                    &rest,
                    "is not an attribute of glTF, whose own begin with `_`",
                );
            }
            if base.is_some_and(|(base, _)| base.and_then(|base| base.get(name)).is_none()) && is_known {
                self.add("morph targets", &rest, "is not an attribute of the primitive");
            }
            let Some(accessor) = self.accessor(Some(json)) else { continue };
            match allowed {
                Some(allowed) => self.format(&accessor, allowed, &rest),
                None if accessor.component == "u32" => {
                    self.add("accessors' formats", &rest, "has data of u32, which attributes cannot");
                }
                None => {}
            }
            self.alignment(&accessor, &rest);
            if name == "POSITION" && !accessor.has_bounds() {
                self.add("bounds of accessors", &rest, "has no `min` and `max`, which positions must have");
            }
            let first = *vertices.get_or_insert(accessor.count);
            if accessor.count != first {
                let message =
                    format!("has {} elements, but others of the primitive have {first}", accessor.count);
                self.add("numbers of vertices", &rest, message);
            }
        }
        vertices
    }

    fn alignment(&mut self, accessor: &Accessor, rest: &str) {
        if accessor.view.is_none() {
            return;
        }
        let size = accessor.components() as u64 * accessor.component_size;
        let stride = accessor.stride().unwrap_or(size);
        if !stride.is_multiple_of(4) {
            let message = format!("has elements {stride} bytes apart, not a multiple of 4");
            self.add("alignment", rest, message);
        } else if !accessor.offset.is_multiple_of(4) || !accessor.total_offset().is_multiple_of(4) {
            self.add("alignment", rest, "is not aligned to 4 bytes, as attributes must be");
        }
    }

    /// Sets are counted from 0, and there are as many of joints as of weights.
    fn sets(&mut self, attributes: Option<&Value>) {
        let mut sets: BTreeMap<&str, BTreeSet<usize>> = BTreeMap::new();
        for (name, _) in members(attributes) {
            if let (base, Some(set)) = formats::split(name)
                && formats::attribute(name, false, false).is_some()
            {
                sets.entry(base).or_default().insert(set);
            }
        }
        for (base, numbers) in &sets {
            if numbers.last().is_some_and(|last| *last >= numbers.len()) {
                let message = format!("has sets of {base} that are not counted from 0 without a gap");
                self.add("sets of attributes", "/attributes", message);
            }
        }
        let count = |base| sets.get(base).map_or(0, BTreeSet::len);
        if count("JOINTS") != count("WEIGHTS") {
            let message =
                format!("has {} set(s) of JOINTS, but {} of WEIGHTS", count("JOINTS"), count("WEIGHTS"));
            self.add("sets of attributes", "/attributes", message);
        }
    }

    fn variants(&mut self) {
        let mappings = extension(self.json, "KHR_materials_variants").and_then(|e| e.get("mappings"));
        let mut met = HashSet::new();
        for (i, mapping) in list(mappings).iter().enumerate() {
            for (j, variant) in list(mapping.get("variants")).iter().enumerate() {
                if whole(variant).is_some_and(|variant| !met.insert(variant)) {
                    let rest = format!("/extensions/KHR_materials_variants/mappings/{i}/variants/{j}");
                    self.add(
                        "repeated elements",
                        &rest,
                        format!("is variant {variant}, which is mapped already"),
                    );
                }
            }
        }
    }
}
