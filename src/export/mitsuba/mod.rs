//! Mitsuba 3 (3.9): `scene.xml`, PLY meshes, bitmaps.
//!
//! Axes and units are ours: +Y up, metres, radiance in linear Rec.709. `mitsuba -Dspp=64 -Dseed=1` overrides what the
//! scene says.
//!
//! | here | Mitsuba |
//! |---|---|
//! | bounces: scattering events, 0 is direct light | `max_depth`: edges of a path, 2 is direct light |
//! | alpha, culling | `volpath` instead of `path`, whose shadow rays see no opacity |

mod bounds;
mod camera;
mod culling;
mod energy;
mod light;
mod material;
mod ply;
mod shape;
mod texture;
mod xml;

use std::collections::HashMap;

use super::{Error, folder::Folder, names::Names, note::Notes, shading, used_materials};
use crate::{
    bsdf::Kind,
    render::{Bounces, Settings},
    world::{Alpha, Material, MaterialId, Surface, World},
};
use material::Variant;
use xml::Node;

const COMMAND: &str = "mitsuba -m llvm_ad_rgb -o scene.exr scene.xml";

/// The scene as it grows.
struct Exporter<'a> {
    world: &'a World,
    out: &'a mut Folder,
    notes: &'a mut Notes,
    names: Names,
    /// In the order of the file: what is referred to comes first.
    nodes: Vec<Node>,
    bsdfs: HashMap<(MaterialId, Variant), String>,
    /// Files written, by image and form.
    bitmaps: HashMap<String, String>,
    /// Files written, by mesh and part, and whether they have normals.
    meshes: HashMap<String, (String, bool)>,
}

/// Writes the folder; returns the command that renders it.
pub fn write(
    world: &World,
    settings: &Settings,
    out: &mut Folder,
    notes: &mut Notes,
) -> Result<&'static str, Error> {
    let mut exporter = Exporter {
        world,
        out,
        notes,
        names: Names::default(),
        nodes: Vec::new(),
        bsdfs: HashMap::new(),
        bitmaps: HashMap::new(),
        meshes: HashMap::new(),
    };
    let used = used_materials(world);
    let hidden = !world.environment.visible && used.iter().all(|m| shape::emission(m).is_none());
    let mut head = vec![
        Node::new("default").attribute("name", "spp").attribute("value", settings.samples),
        // Mitsuba's seed is 32 bits wide.
        Node::new("default").attribute("name", "seed").attribute("value", settings.seed & 0x7fff_ffff),
        exporter.integrator(settings.bounces, &used, hidden),
        exporter.sensor(settings),
    ];
    exporter.shapes()?;
    let placed = |mesh: usize| world.model.instances.iter().any(|instance| instance.mesh.index() == mesh);
    for (i, mesh) in world.model.meshes.iter().enumerate() {
        if shading::is_bent(mesh) && placed(i) {
            exporter.notes.approximated(
                format!("mesh `{}`", mesh.name),
                "light from below a triangle that the interpolated normal faces is let through: near the terminator, a rim is \
                 lit that should be dark",
            );
        }
    }
    for material in culling::shown_backs(world) {
        exporter.notes.approximated(
            material::subject(material),
            "the camera sees backs that it should see through, where there are any in sight: Mitsuba culls nothing",
        );
    }
    let [width, height] = settings.size;
    let lights = exporter.lights(hidden, width as f32 / height.max(1) as f32)?;
    head.append(&mut exporter.nodes);
    let scene = Node::new("scene").attribute("version", "3.0.0").children(head).children(lights);
    let comment = format!(" rayo {}: {COMMAND} ", env!("CARGO_PKG_VERSION"));
    let bytes = xml::document(&comment, &scene)
        .map_err(|e| Error::Encoding { file: "scene.xml".into(), problem: e.to_string() })?;
    out.write("scene.xml", &bytes)?;
    Ok(COMMAND)
}

impl Exporter<'_> {
    fn integrator(&mut self, bounces: Bounces, used: &[&Material], hidden: bool) -> Node {
        let transparent = used.iter().any(|m| m.alpha != Alpha::Opaque);
        let all =
            [(Kind::Diffuse, "diffuse"), (Kind::Glossy, "glossy"), (Kind::Transmission, "transmission")];
        let is_there = |kind| used.iter().any(|m| kinds(m).contains(&kind));
        let present: Vec<_> = all.into_iter().filter(|(kind, _)| is_there(*kind)).collect();
        let total = match &present[..] {
            // The limit of the only kind there is is one on all.
            [(kind, _)] => bounces.total.min(limit(&bounces, *kind)),
            _ => bounces.total,
        };
        for (kind, name) in present {
            let limit = limit(&bounces, kind);
            if limit < total {
                self.notes.dropped(
                    "",
                    format!("the limit of {limit} {name} bounces: Mitsuba counts all kinds together, up to {total}"),
                );
            }
        }
        Node::plugin("integrator", if transparent { "volpath" } else { "path" })
            .integer("max_depth", total + 2)
            .boolean("hide_emitters", hidden)
    }
}

fn limit(bounces: &Bounces, kind: Kind) -> u32 {
    match kind {
        Kind::Diffuse => bounces.diffuse,
        Kind::Glossy => bounces.glossy,
        Kind::Transmission => bounces.transmission,
    }
}

/// What a surface's scattering counts as.
fn kinds(material: &Material) -> &'static [Kind] {
    match &material.surface {
        Surface::Diffuse { .. } => &[Kind::Diffuse],
        Surface::Metal { .. } => &[Kind::Glossy],
        Surface::Dielectric { .. } => &[Kind::Glossy, Kind::Transmission],
        Surface::Pbr(pbr) if pbr.metallic.texture.is_none() && pbr.metallic.factor >= 1.0 => &[Kind::Glossy],
        Surface::Pbr(_) => &[Kind::Diffuse, Kind::Glossy],
        Surface::Unlit { .. } | Surface::Black | Surface::Layered(_) | Surface::SpecularGlossiness(_) => &[],
    }
}
