//! POV-Ray 3.7 and 3.8: `scene.pov`, `scene.ini`, meshes and textures.
//!
//! Conventions, measured against POV-Ray 3.7.0.10:
//!
//! | here | there |
//! |---|---|
//! | right-handed | the same coordinates, and a camera whose three vectors are right-handed (`view`) |
//! | metres | units of a power of two to the metre: what is nearer than 0.001 units to a surface is lost (`Scale`) |
//! | irradiance E | a light of colour E / π (`light`) |
//! | front: counter-clockwise | clockwise: triangles are turned round (`mesh`) |
//! | UV from the top left | v from the bottom, the bottom row at 0 (`picture`) |
//!
//! Light comes to a surface from lights alone, along straight lines that only opaque things (and glass, by a copy that
//! nothing but shadows shows) block: the picture of `bounces = { diffuse = 0 }`. Mirrors and glass are followed as far
//! as `total` bounces, and no farther than to a weight of 10⁻⁵.
//!
//! Every pixel is the linear mean of n × n jittered samples and one in its centre; measured on an edge between radiance
//! 0 and 100, nothing is clipped and no gamma is in it. POV-Ray takes 81 at most; with a lens up to 1024, unstratified.
//!
//! The one line it always prints on stderr, that the user's povray.conf is missing, is about that file; no setting of a
//! scene keeps it quiet.

mod emitter;
mod finish;
mod glass;
mod light;
mod material;
mod mesh;
mod picture;
mod sdl;
mod shapes;
mod sky;
#[cfg(test)]
mod tests;
mod view;

use super::{Error, folder::Folder, note::Notes, used_materials};
use crate::{
    render::{Bounces, Settings},
    world::{Alpha, Emission, Material, MetalFinish, Surface, World},
};
use material::Looks;
use picture::Pictures;

const COMMAND: &str = "povray scene.ini";

/// Samples of a pixel that the folder asks for.
pub fn samples(world: &World, settings: &Settings) -> u32 {
    view::samples(&world.camera, settings)
}

/// Writes the folder; returns the command that renders it.
pub fn write(
    world: &World,
    settings: &Settings,
    out: &mut Folder,
    notes: &mut Notes,
) -> Result<&'static str, Error> {
    let unit = shapes::units_per_metre(world);
    let materials = used_materials(world);
    let diffuse = materials.iter().any(|m| is_diffuse(m));
    let lights = if diffuse || materials.iter().any(|m| is_rough(m)) {
        lights(world, unit, notes)
    } else {
        String::new()
    };
    let (emitters, dome) = match diffuse {
        true => (emitter::lights(world, unit, notes), sky::dome(world, notes)),
        false => Default::default(),
    };
    bounces(settings.bounces, &materials, notes);
    let ini = view::ini(&world.camera, settings, notes);
    let camera = view::camera(&world.camera, settings, unit, notes);
    let mut pictures = Pictures::new(world);
    let sky = sky::sphere(world, &mut pictures, notes)?;
    // Mirrors show emitting surfaces and the sky; punctual lights they do not.
    let highlights = !lights.is_empty() && dome.is_empty() && emitters.is_empty();
    let mut looks = Looks::new(world, pictures, highlights, notes);
    let shapes = shapes::write(&mut looks, unit)?;
    let Looks { declared, pictures, .. } = looks;
    for (name, bytes) in pictures.files.into_iter().chain(shapes.files) {
        out.write(&name, &bytes)?;
    }
    let through = materials.iter().any(|m| m.alpha != Alpha::Opaque);
    let depth = (settings.bounces.total + 2 + if through { 32 } else { 0 }).min(256);
    let scene = format!(
        "#version 3.7;\n// Written by rayo {}. 1 metre is {unit} units.\n\
         global_settings {{ assumed_gamma 1.0 ambient_light rgb 0 max_trace_level {depth} adc_bailout 1e-5 }}\n\
         #default {{ pigment {{ rgb 0 }} finish {{ ambient 0 diffuse 1 brilliance 1 }} }}\n\
         {camera}{sky}{lights}{emitters}{dome}{declared}{}",
        env!("CARGO_PKG_VERSION"),
        shapes.scene
    );
    out.write("scene.pov", scene.as_bytes())?;
    out.write("scene.ini", ini.as_bytes())?;
    Ok(COMMAND)
}

fn lights(world: &World, unit: f32, notes: &mut Notes) -> String {
    let light = |(i, light)| light::light(light, &format!("light {}", i + 1), unit, notes);
    world.model.lights.iter().enumerate().map(light).collect()
}

/// Whether light from any direction shows on it.
fn is_diffuse(material: &Material) -> bool {
    matches!(material.surface, Surface::Diffuse { .. } | Surface::Pbr(_))
}

/// Whether it may have a highlight.
fn is_rough(material: &Material) -> bool {
    matches!(material.surface, Surface::Metal { finish: MetalFinish::Roughness { roughness, .. }, .. } if roughness.factor > 0.0)
}

fn bounces(bounces: Bounces, materials: &[&Material], notes: &mut Notes) {
    let Bounces { total, diffuse, glossy, transmission } = bounces;
    if diffuse > 0 && total > 0 && materials.iter().any(|m| is_diffuse(m)) {
        notes.dropped(
            "",
            "diffuse interreflection and caustics: surfaces are lit by lights alone; compare with bounces = { diffuse = \
             0 }",
        );
    }
    let is_glass = |m: &&Material| matches!(m.surface, Surface::Dielectric { .. });
    let is_mirror = |m: &&Material| matches!(m.surface, Surface::Metal { .. } | Surface::Pbr(_));
    let limited = (glossy < total && materials.iter().any(|m| is_mirror(m) || is_glass(m)))
        || (transmission < total && materials.iter().any(is_glass));
    if limited {
        notes.approximated("", format!("mirrors and glass have the same limit of bounces, {total} in all"));
    }
}

/// Whether it gives off light at all.
fn shines(emission: &Emission) -> bool {
    emission.strength > 0.0 && emission.color.factor.max_element() > 0.0
}
