//! Materials as textures of the scene language.
//!
//! | here | there | |
//! |---|---|---|
//! | diffuse | `diffuse 1` | exact |
//! | metal, fuzz or roughness 0 | `reflection`, `falloff 5` for Schlick's curve | exact but for textured tints |
//! | other metals | the mirror without its blur, a highlight | |
//! | dielectric, smooth | `reflection { 0, 1 fresnel }`, `conserve_energy`, and a copy that casts the shadow | exact |
//! | emission | `emission`; black inside where it is one-sided | exact as it is seen |
//! | pbr | diffuse, mirror and highlight in the same proportions | |
//! | alpha | a pattern from clear to covered, with a step for masks | exact |
//!
//! A dielectric's tint t multiplies reflection and refraction, but `conserve_energy` leaves t (1 − t F) of what is
//! refracted. Grey glass is the blend of t parts clear glass with 1 − t parts black. For colours there is such a blend,
//! too, but it splits every inner reflection into two rays, without an end.

use std::{collections::HashMap, fmt::Write};

use glam::{Affine2, DVec4, Mat2, Mat3, Vec2, Vec3, Vec4};

use super::{
    finish::{self, BLACK, CLEAR, Highlight, Reflection, Term},
    picture::{Part, Pictures},
    sdl::{matrix, rgb},
    shines,
};
use crate::{
    export::{Error, bitmap, names::Names, note::Notes},
    world::{
        Alpha, ColorInput, Fresnel, Material, MaterialId, MetalFinish, Pbr, ScalarInput, Surface, TextureRef,
        World,
    },
};

/// Below this roughness (α < 0.001) a mirror is a mirror.
const SMOOTH: f32 = 0.03;

/// How a shape's uv come to POV-Ray.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Mapping {
    /// As they are here, from the top left.
    Given,
    /// As POV-Ray makes them for a sphere: u = atan2(z, x) / 2π, v from the south pole.
    Sphere,
}

/// What an object needs besides its shape.
#[derive(Clone, Debug, Default)]
pub struct Look {
    /// `texture { … }`
    pub texture: String,
    /// That of the back, where it is another one.
    pub back: Option<String>,
    pub interior: Option<Interior>,
    /// Has pictures.
    pub uv: bool,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Interior {
    /// Rays go straight on.
    Thin,
    /// Index of refraction, against what is around. Casts the shadow of something opaque.
    Glass(f32),
}

pub struct Looks<'a> {
    pub world: &'a World,
    pub notes: &'a mut Notes,
    /// The textures of all looks so far, to be written before the objects.
    pub declared: String,
    pub pictures: Pictures<'a>,
    /// Whether highlights stand for lights that mirrors do not show.
    highlights: bool,
    names: Names,
    known: HashMap<(MaterialId, Mapping), Look>,
}

impl<'a> Looks<'a> {
    pub fn new(world: &'a World, pictures: Pictures<'a>, highlights: bool, notes: &'a mut Notes) -> Self {
        let (declared, names, known) = (String::new(), Names::default(), HashMap::new());
        Self { world, notes, declared, pictures, highlights, names, known }
    }

    pub fn material(&self, id: MaterialId) -> Option<&'a Material> {
        self.world.model.materials.get(id.index())
    }

    pub fn look(&mut self, id: MaterialId, mapping: Mapping) -> Result<Look, Error> {
        if let Some(known) = self.known.get(&(id, mapping)) {
            return Ok(known.clone());
        }
        let mut look = match self.material(id) {
            Some(material) => self.make(material, mapping, Vec3::ONE)?,
            None => Look { texture: BLACK.into(), ..Look::default() },
        };
        let name = self.material(id).map_or("none", |m| &m.name);
        look.texture = self.declare("m", name, &look.texture);
        look.back = look.back.map(|back| self.declare("back", name, &back));
        self.known.insert((id, mapping), look.clone());
        Ok(look)
    }

    /// The texture by a name.
    fn declare(&mut self, prefix: &str, name: &str, texture: &str) -> String {
        let name = self.names.unique(prefix, name);
        let _ = writeln!(self.declared, "#declare {name} = {texture}");
        format!("texture {{ {name} }}")
    }

    /// The look with its colour multiplied by `tint`.
    pub fn make(&mut self, material: &Material, mapping: Mapping, tint: Vec3) -> Result<Look, Error> {
        let mut maker = Maker { looks: self, material, mapping, tint, uv: false, within: None };
        if material.normal.is_some() {
            maker.dropped("its normal map");
        }
        let cover = maker.cover()?;
        let glow = maker.glow()?;
        let one_sided = glow.is_some() && material.emission.is_some_and(|e| !e.two_sided);
        let texture = cover.over(maker.body(glow.as_ref())?);
        let back = if one_sided { Some(cover.over(maker.body(None)?)) } else { None };
        let mut interior = match material.surface {
            Surface::Dielectric { ior, .. } => Some(Interior::Glass(ior)),
            _ => None,
        };
        if material.alpha != Alpha::Opaque {
            interior = interior.or(Some(Interior::Thin));
        }
        let uv = maker.uv;
        Ok(Look { texture, back, interior, uv })
    }
}

struct Maker<'a, 'b> {
    looks: &'a mut Looks<'b>,
    material: &'a Material,
    mapping: Mapping,
    tint: Vec3,
    uv: bool,
    /// Where the pattern that chooses between the textures being made looks its picture up: they begin there.
    within: Option<Affine2>,
}

impl Maker<'_, '_> {
    fn subject(&self) -> String {
        format!("material `{}`", self.material.name)
    }

    fn approximated(&mut self, text: impl Into<String>) {
        let subject = self.subject();
        self.looks.notes.approximated(subject, text);
    }

    fn dropped(&mut self, text: impl Into<String>) {
        let subject = self.subject();
        self.looks.notes.dropped(subject, text);
    }

    /// All but alpha.
    fn body(&mut self, glow: Option<&Term>) -> Result<String, Error> {
        let surface = &self.material.surface;
        let with_glow =
            |terms: Vec<Term>| finish::sum(&[terms, glow.cloned().into_iter().collect()].concat());
        Ok(match surface {
            Surface::Diffuse { color } => with_glow(vec![Term::diffuse(self.pigment(color, true)?, 1.0)]),
            Surface::Metal { color, finish } => with_glow(vec![self.metal(color, finish)?]),
            Surface::Dielectric { fresnel, roughness, tint, .. } => {
                if glow.is_some() {
                    self.dropped("the light that the glass itself gives off");
                }
                self.dielectric(*fresnel, roughness, tint)
            }
            Surface::Pbr(pbr) => self.pbr(pbr, glow)?,
            Surface::Unlit { color } => with_glow(vec![Term::emission(self.pigment(color, false)?, 1.0)]),
            // `layers` has replaced those with layers.
            Surface::Black | Surface::Layered(_) | Surface::SpecularGlossiness(_) => with_glow(Vec::new()),
        })
    }

    fn glow(&mut self) -> Result<Option<Term>, Error> {
        let Some(emission) = self.material.emission else { return Ok(None) };
        if !shines(&emission) {
            return Ok(None);
        }
        // Vertex colours do not reach the emission.
        let tint = std::mem::replace(&mut self.tint, Vec3::ONE);
        let pigment = self.pigment(&emission.color, false);
        self.tint = tint;
        Ok(Some(Term::emission(pigment?, emission.strength)))
    }

    fn metal(&mut self, color: &ColorInput, finish: &MetalFinish) -> Result<Term, Error> {
        let (constant, roughness) = match finish {
            MetalFinish::Fuzz(fuzz) => {
                if *fuzz > 0.0 {
                    self.approximated("a sharp mirror: its fuzz is left out");
                }
                (true, 0.0)
            }
            MetalFinish::Roughness { roughness, fresnel, .. } => {
                (*fresnel == Fresnel::Constant, self.constant(roughness, "roughness"))
            }
        };
        self.mirror(color, constant, roughness)
    }

    fn mirror(&mut self, color: &ColorInput, constant: bool, roughness: f32) -> Result<Term, Error> {
        if color.texture.is_some() {
            self.approximated(
                "the texture tints reflections by POV-Ray's curve, 0.0146 / (θ/90° − 1.12)² − 0.0116 of white, instead \
                 of (1 − cos θ)⁵",
            );
        }
        let f0 = (color.factor * self.tint).clamp(Vec3::ZERO, Vec3::ONE);
        let reflection = match (color.texture, constant) {
            (Some(_), _) => Reflection::Metallic,
            (None, true) => Reflection::Constant(f0),
            (None, false) => Reflection::Schlick(f0),
        };
        let mut term = Term::reflection(self.pigment(color, true)?, reflection);
        if roughness > SMOOTH {
            self.approximated(self.rough_text());
            term.highlight = self.highlight(roughness, 1.0, true);
        }
        Ok(term)
    }

    fn rough_text(&self) -> &'static str {
        if self.looks.highlights {
            "a sharp mirror instead of its roughness α = r², and Blinn's highlight of strength F₀ / 4α² and exponent \
             2/α² − 2 for lights"
        } else {
            "a sharp mirror: its roughness is left out"
        }
    }

    /// What GGX looks like about the mirror direction: D(0) = 1 / πα², and (n·h)ⁿ falls off alike.
    fn highlight(&self, roughness: f32, f0: f32, metallic: bool) -> Option<Highlight> {
        let alpha = (roughness * roughness).clamp(1e-3, 0.95);
        let strength = f0 / (4.0 * alpha * alpha);
        let exponent = 2.0 / (alpha * alpha) - 2.0;
        // Without a mirror there is nothing that shows lights twice.
        (self.looks.highlights || !metallic).then_some(Highlight {
            strength,
            roughness: 1.0 / exponent,
            metallic,
        })
    }

    fn dielectric(&mut self, fresnel: Fresnel, roughness: &ScalarInput, color: &ColorInput) -> String {
        if fresnel == Fresnel::Schlick {
            self.approximated("the exact equations of Fresnel instead of Schlick's approximation");
        }
        let roughness = self.constant(roughness, "roughness");
        if roughness > SMOOTH {
            self.approximated("smooth glass: its roughness is left out");
        }
        let mut tint = color.factor * self.tint;
        if color.texture.is_some() {
            self.approximated("the mean of its texture");
            tint *= self.mean(color.texture.as_ref());
        }
        glass(tint.clamp(Vec3::ZERO, Vec3::ONE)).unwrap_or_else(|near| {
            self.approximated(
                "t (1 − t F) of the light is refracted instead of t (1 − F), and total reflection has no tint t",
            );
            near
        })
    }

    fn pbr(&mut self, pbr: &Pbr, glow: Option<&Term>) -> Result<String, Error> {
        let roughness = self.constant(&pbr.roughness, "roughness");
        let root = (pbr.ior - 1.0) / (pbr.ior + 1.0);
        let f0 = root * root;
        let glow: Vec<Term> = glow.cloned().into_iter().collect();
        let metal = |this: &mut Self| -> Result<String, Error> {
            Ok(finish::sum(&[vec![this.mirror(&pbr.base_color, false, roughness)?], glow.clone()].concat()))
        };
        let plastic = |this: &mut Self| -> Result<String, Error> {
            let mut term = Term::diffuse(this.pigment(&pbr.base_color, true)?, 1.0 - f0);
            if roughness > SMOOTH {
                this.approximated(
                    "diffuse × (1 − F₀), F₀ = ((ior − 1) / (ior + 1))², under Blinn's highlight of strength F₀ / 4α² and \
                     exponent 2/α² − 2, α = r², for lights; its reflections of other things are left out",
                );
                term.highlight = this.highlight(roughness, f0, false);
            } else {
                this.approximated("diffuse × (1 − F₀) under a mirror of Schlick's curve");
                term.reflection = Some(Reflection::Schlick(Vec3::splat(f0)));
            }
            Ok(finish::sum(&[vec![term], glow.clone()].concat()))
        };
        let metallic = pbr.metallic.factor.clamp(0.0, 1.0);
        if metallic <= 0.0 {
            return plastic(self);
        }
        let Some((map, channel)) = pbr.metallic.texture else {
            if metallic >= 1.0 {
                return metal(self);
            }
            return Ok(finish::average(&[(1.0 - metallic, plastic(self)?), (metallic, metal(self)?)]));
        };
        let Some((pattern, at)) = self.pattern(&map, channel, metallic)? else { return plastic(self) };
        let around = self.within.replace(at);
        let (plastic, metal) = (plastic(self)?, metal(self)?);
        self.within = around;
        Ok(finish::blend(&pattern, &plastic, &metal, None))
    }

    /// To be asked for before what it covers.
    fn cover(&mut self) -> Result<Cover, Error> {
        let coverage = self.material.coverage;
        let step = match self.material.alpha {
            Alpha::Opaque => return Ok(Cover::Share(1.0)),
            Alpha::Mask { cutoff } => Some(cutoff),
            Alpha::Blend => None,
        };
        let Some((map, channel)) = coverage.texture else {
            let share = match step {
                Some(cutoff) => f32::from(coverage.factor >= cutoff),
                None => coverage.factor.clamp(0.0, 1.0),
            };
            return Ok(Cover::Share(share));
        };
        let factor = coverage.factor.max(0.0);
        // A pattern ends at 1: a factor beyond is in the step.
        let (factor, step) = match step {
            Some(cutoff) if cutoff <= 0.0 => return Ok(Cover::Share(1.0)),
            Some(cutoff) if cutoff > factor => return Ok(Cover::Share(0.0)),
            Some(cutoff) => (1.0, Some(cutoff / factor)),
            None => (factor, None),
        };
        Ok(match self.pattern(&map, channel, factor)? {
            Some((pattern, at)) => {
                self.within = Some(at);
                Cover::Pattern(pattern, step)
            }
            None => Cover::Share(1.0),
        })
    }

    /// `pigment { … }`; reflectances end at 1.
    fn pigment(&mut self, color: &ColorInput, reflectance: bool) -> Result<String, Error> {
        let mut factor = color.factor * self.tint;
        let Some(map) = &color.texture else {
            if reflectance {
                factor = factor.clamp(Vec3::ZERO, Vec3::ONE);
            }
            return Ok(format!("pigment {{ {} }}", rgb(factor)));
        };
        let Some(picture) = self.looks.pictures.picture(map, Part::Color(factor))? else {
            return Ok(format!("pigment {{ {} }}", rgb(factor)));
        };
        Ok(match self.placed(&picture.fit, map) {
            Some((matrix, _)) => format!("pigment {{ image_map {{ {} }} {matrix} }}", picture.sdl),
            None => format!("pigment {{ {} }}", rgb(factor * self.mean(Some(map)))),
        })
    }

    /// `image_pattern { … }` of one channel, and where it looks that up.
    fn pattern(
        &mut self,
        map: &TextureRef,
        channel: u8,
        factor: f32,
    ) -> Result<Option<(String, Affine2)>, Error> {
        let Some(picture) = self.looks.pictures.picture(map, Part::Channel(channel, factor))? else {
            return Ok(None);
        };
        let place = self.placed(&picture.fit, map);
        Ok(place.map(|(matrix, at)| (format!("image_pattern {{ {} }} {matrix}", picture.sdl), at)))
    }

    /// The transformation that lets POV-Ray look `fit` of the UV up, and that place. It looks up where the inverse of
    /// the transformation leads to, from where the pattern around has led already.
    fn placed(&mut self, fit: &Affine2, map: &TextureRef) -> Option<(String, Affine2)> {
        self.uv = true;
        if map.uv_set != self.looks.uv_set(self.material) {
            self.approximated("all of its textures use the same set of uv");
        }
        let from_povray = match self.mapping {
            Mapping::Given => Affine2::IDENTITY,
            Mapping::Sphere => {
                Affine2::from_mat2_translation(Mat2::from_diagonal(Vec2::splat(-1.0)), Vec2::new(0.5, 1.0))
            }
        };
        let lookup = *fit * from_povray;
        if !(lookup.is_finite() && lookup.matrix2.determinant().abs() > 1e-12) {
            self.approximated("a texture that is stretched without end is its mean");
            return None;
        }
        let place = self.within.unwrap_or(Affine2::IDENTITY) * lookup.inverse();
        let flat = Mat3::from_mat2(place.matrix2);
        let moved = glam::Affine3A::from_mat3_translation(flat, place.translation.extend(0.0));
        Some((matrix(&moved), lookup))
    }

    /// The value, or that times the mean of its texture.
    fn constant(&mut self, input: &ScalarInput, name: &str) -> f32 {
        let Some((map, channel)) = &input.texture else { return input.factor.clamp(0.0, 1.0) };
        self.approximated(format!("the mean of its {name} texture"));
        let mean = self.mean_texel(map)[usize::from(channel & 3)];
        (input.factor * mean).clamp(0.0, 1.0)
    }

    fn mean(&self, map: Option<&TextureRef>) -> Vec3 {
        map.map_or(Vec3::ONE, |map| self.mean_texel(map).truncate())
    }

    fn mean_texel(&self, map: &TextureRef) -> Vec4 {
        let model = &self.looks.world.model;
        let Some(texture) = model.textures.get(map.texture.index()) else { return Vec4::ONE };
        let Some(image) = model.images.get(texture.image.index()) else { return Vec4::ONE };
        let count = image.width as usize * image.height as usize;
        let sum: DVec4 = (0..count).map(|i| bitmap::linear(image, texture.color_space, i).as_dvec4()).sum();
        (sum / count.max(1) as f64).as_vec4()
    }
}

impl Looks<'_> {
    /// Which of a mesh's UV sets goes to POV-Ray, which has one.
    pub fn uv_set(&self, material: &Material) -> u8 {
        let color = match &material.surface {
            Surface::Diffuse { color } | Surface::Metal { color, .. } | Surface::Unlit { color } => {
                color.texture
            }
            Surface::Dielectric { tint, .. } => tint.texture,
            Surface::Pbr(pbr) => pbr.base_color.texture.or(pbr.metallic.texture.map(|t| t.0)),
            Surface::Black | Surface::Layered(_) | Surface::SpecularGlossiness(_) => None,
        };
        let emission = || material.emission.and_then(|e| e.color.texture);
        let coverage = || material.coverage.texture.map(|t| t.0);
        color.or_else(emission).or_else(coverage).map_or(0, |map| map.uv_set)
    }
}

/// How an alpha channel covers a texture.
enum Cover {
    /// This much everywhere.
    Share(f32),
    /// A pattern; all or nothing at a step.
    Pattern(String, Option<f32>),
}

impl Cover {
    fn over(&self, full: String) -> String {
        match self {
            Self::Share(share) if *share >= 1.0 => full,
            Self::Share(share) if *share <= 0.0 => CLEAR.into(),
            Self::Share(share) => finish::average(&[(1.0 - share, CLEAR.into()), (*share, full)]),
            Self::Pattern(pattern, step) => finish::blend(pattern, CLEAR, &full, *step),
        }
    }
}

/// Smooth glass; as an error, what is near to it.
fn glass(tint: Vec3) -> Result<String, String> {
    let clear = |tint: Vec3| {
        format!(
            "texture {{ pigment {{ {} filter 1 }} finish {{ diffuse 0 reflection {{ 0, {} fresnel on }} conserve_energy \
             }} }}",
            rgb(tint),
            rgb(tint)
        )
    };
    let grey = tint.x;
    if tint != Vec3::splat(grey) {
        Err(clear(tint))
    } else if grey >= 1.0 {
        Ok(clear(tint))
    } else {
        Ok(finish::average(&[(grey, clear(Vec3::ONE)), (1.0 - grey, BLACK.into())]))
    }
}
