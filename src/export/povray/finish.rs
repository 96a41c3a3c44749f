//! Textures of the scene language as sums and covers of simple ones.
//!
//! A `finish` has one pigment for all that it does. What needs several (base colour, emission) is the `average` of k
//! textures, each k times as strong.

use glam::Vec3;

use super::sdl::{num, rgb};

/// Opaque black, or invisible.
pub const BLACK: &str = "texture { pigment { rgb 0 } finish { diffuse 0 } }";
pub const CLEAR: &str = "texture { pigment { rgb 1 transmit 1 } finish { diffuse 0 } }";

#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Reflection {
    /// The same at every angle.
    Constant(Vec3),
    /// F₀ + (1 − F₀) (1 − cos θ)⁵, which is what `falloff 5` does.
    Schlick(Vec3),
    /// The pigment at normal incidence, white at grazing, by a curve of POV-Ray's own.
    Metallic,
}

/// Blinn's highlight: `strength` × (n·h)^(1 / `roughness`) of the colour of the light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Highlight {
    pub strength: f32,
    pub roughness: f32,
    /// In the colour of the pigment.
    pub metallic: bool,
}

#[derive(Clone, Debug)]
pub struct Term {
    /// `pigment { … }`
    pub pigment: String,
    pub diffuse: f32,
    /// Times the pigment.
    pub emission: f32,
    pub reflection: Option<Reflection>,
    pub highlight: Option<Highlight>,
}

impl Term {
    pub fn diffuse(pigment: String, diffuse: f32) -> Self {
        Self { pigment, diffuse, emission: 0.0, reflection: None, highlight: None }
    }

    pub fn emission(pigment: String, emission: f32) -> Self {
        Self { emission, ..Self::diffuse(pigment, 0.0) }
    }

    pub fn reflection(pigment: String, reflection: Reflection) -> Self {
        Self { reflection: Some(reflection), ..Self::diffuse(pigment, 0.0) }
    }

    fn texture(&self, times: f32) -> String {
        let mut finish = format!("diffuse {}", num(times * self.diffuse));
        if self.emission > 0.0 {
            finish.push_str(&format!(" emission {}", num(times * self.emission)));
        }
        match self.reflection {
            Some(Reflection::Constant(tint)) => {
                finish.push_str(&format!(" reflection {{ {} }}", rgb(times * tint)));
            }
            Some(Reflection::Schlick(f0)) => {
                let (normal, grazing) = (rgb(times * f0), rgb(Vec3::splat(times)));
                finish.push_str(&format!(" reflection {{ {normal}, {grazing} falloff 5 }}"));
            }
            Some(Reflection::Metallic) => {
                finish.push_str(&format!(" reflection {{ {} metallic 1 }}", rgb(Vec3::splat(times))));
            }
            None => {}
        }
        if let Some(h) = self.highlight {
            let metallic = if h.metallic { " metallic 1" } else { "" };
            finish.push_str(&format!(
                " specular {} roughness {}{metallic}",
                num(times * h.strength),
                num(h.roughness)
            ));
        }
        format!("texture {{ {} finish {{ {finish} }} }}", self.pigment)
    }
}

pub fn sum(terms: &[Term]) -> String {
    match terms {
        [] => BLACK.into(),
        [one] => one.texture(1.0),
        several => {
            let times = several.len() as f32;
            let parts: Vec<(f32, String)> = several.iter().map(|t| (1.0, t.texture(times))).collect();
            average(&parts)
        }
    }
}

/// `texture { … }` blended by weight.
pub fn average(parts: &[(f32, String)]) -> String {
    let entries: String =
        parts.iter().map(|(weight, texture)| format!(" [{} {}]", num(*weight), inner(texture))).collect();
    format!("texture {{ average texture_map {{{entries} }} }}")
}

/// From `from` where the pattern is 0 to `to` where it is 1; all at once at `step`, if there is one.
pub fn blend(pattern: &str, from: &str, to: &str, step: Option<f32>) -> String {
    let (from, to) = (inner(from), inner(to));
    match step {
        None => format!("texture {{ {pattern} texture_map {{ [0 {from}] [1 {to}] }} }}"),
        Some(at) => {
            let at = num(at);
            format!("texture {{ {pattern} texture_map {{ [0 {from}] [{at} {from}] [{at} {to}] [1 {to}] }} }}")
        }
    }
}

/// What is between the braces of `texture { … }`.
fn inner(texture: &str) -> &str {
    texture.strip_prefix("texture {").and_then(|rest| rest.strip_suffix('}')).unwrap_or(texture).trim()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sum_is_an_average_of_stronger_terms() {
        let base = Term::diffuse("pigment { rgb 0.5 }".into(), 1.0);
        let glow = Term::emission("pigment { rgb 2.0 }".into(), 3.0);
        assert_eq!(
            sum(std::slice::from_ref(&base)),
            "texture { pigment { rgb 0.5 } finish { diffuse 1.0 } }"
        );
        assert_eq!(
            sum(&[base, glow]),
            "texture { average texture_map { [1.0 pigment { rgb 0.5 } finish { diffuse 2.0 }] [1.0 pigment { rgb 2.0 } \
             finish { diffuse 0.0 emission 6.0 }] } }"
        );
    }

    #[test]
    fn schlick_is_a_falloff_of_five() {
        let gold =
            Term::reflection("pigment { rgb 0 }".into(), Reflection::Schlick(Vec3::new(1.0, 0.5, 0.25)));
        assert!(sum(&[gold]).contains("reflection { rgb <1.0,0.5,0.25>, rgb 1.0 falloff 5 }"));
    }
}
