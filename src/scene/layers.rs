//! Layers of `pbr` materials: `clearcoat = { … }` and the like in `[materials.NAME]`.

use super::{
    color::Color,
    context::Context,
    range::{above, from},
    table::{Keys, table},
    texture::{Input, NormalMap, warn_reflectance},
};
use crate::world::{self, Layered, Pbr, ScalarInput, Surface};

table! {
    /// Strength and colour of the dielectric's reflection.
    struct Specular {
        /// Strength at every angle: 0 is without reflection.
        factor: f32 = 1.0; from(0.0).to(1.0),
        /// Multiplies the reflectance at normal incidence, which the index of refraction gives; may be greater than 1: a colour or a texture.
        color: Input = Input::Color(Color::WHITE),
    }
}

table! {
    /// A layer of varnish over all else.
    struct Clearcoat {
        /// Share of the surface that is coated.
        factor: f32 = 1.0; from(0.0).to(1.0),
        /// Perceptual roughness of the coat.
        roughness: f32 = 0.0; from(0.0).to(1.0),
        /// A tangent-space normal map of the coat alone. Without it the coat is smooth, whatever lies below.
        normal: Option<NormalMap>,
    }
}

table! {
    /// Fibres that shine at grazing angles: velvet, cloth.
    struct Sheen {
        /// Reflectance of the fibres: a colour or a texture.
        color: Input = Input::Color(Color::WHITE),
        /// Perceptual roughness: the smaller, the closer to the rim.
        roughness: f32 = 0.5; from(0.0).to(1.0),
    }
}

table! {
    /// What is inside, where light passes through the surface: the mesh is solid, refracts and absorbs.
    struct Volume {
        /// What is left of white light after attenuation_distance.
        attenuation_color: Color = Color::WHITE,
        /// How far light goes until it has the attenuation_color, m. Without it nothing is absorbed.
        attenuation_distance: Option<f32>; above(0.0),
    }
}

table! {
    /// A thin film on the surface, coloured by interference: soap bubbles, oil, tempered steel.
    struct Iridescence {
        /// Share of the film's reflection in the whole.
        factor: f32 = 1.0; from(0.0).to(1.0),
        /// Index of refraction of the film.
        ior: f32 = 1.3; from(1.0).to(100.0),
        /// Thickness of the film, nm.
        thickness: f32 = 400.0; from(0.0).to(1e6),
    }
}

table! {
    /// Highlights stretched in one direction: brushed metal, hair.
    struct Anisotropy {
        /// How much further the highlight reaches along the direction than across it; 0 is round.
        strength: f32 = 1.0; from(0.0).to(1.0),
        /// Direction, degrees: from the u axis of the texture coordinates, counter-clockwise.
        rotation: f32 = 0.0; from(-360.0).to(360.0),
    }
}

table! {
    /// Light that leaves, scattered, on the far side: leaves, paper, wax.
    struct DiffuseTransmission {
        /// Share of the light that is not reflected by the surface.
        factor: f32 = 1.0; from(0.0).to(1.0),
        /// Colour of what passes: a colour or a texture.
        color: Input = Input::Color(Color::WHITE),
    }
}

/// What of a `pbr` table is layers.
#[derive(Default)]
pub(super) struct Layers {
    pub specular: Option<Specular>,
    pub clearcoat: Option<Clearcoat>,
    pub sheen: Option<Sheen>,
    pub transmission: Option<f32>,
    pub volume: Option<Volume>,
    pub abbe_number: Option<f32>,
    pub iridescence: Option<Iridescence>,
    pub anisotropy: Option<Anisotropy>,
    pub diffuse_transmission: Option<DiffuseTransmission>,
}

impl Layers {
    /// `pbr` under these layers. `keys` are those of the material.
    pub fn resolve(self, pbr: Pbr, keys: &Keys, cx: &mut Context) -> Surface {
        self.warn(keys, cx);
        let constant = ScalarInput::constant;
        let mut reflectance = |input: &Input, keys: &Keys| {
            let color = input.resolve(false, cx);
            warn_reflectance(&color, "color", keys, cx);
            color
        };
        let sheen = self.sheen.map(|sheen| world::Sheen {
            color: reflectance(&sheen.color, &sheen.keys),
            roughness: constant(sheen.roughness),
        });
        let diffuse_transmission = self.diffuse_transmission.map(|diffuse| world::DiffuseTransmission {
            factor: constant(diffuse.factor),
            color: reflectance(&diffuse.color, &diffuse.keys),
        });
        let layered = Layered {
            specular: self.specular.map(|specular| world::SpecularLevel {
                factor: constant(specular.factor),
                color: specular.color.resolve(false, cx),
            }),
            clearcoat: self.clearcoat.map(|coat| world::Clearcoat {
                factor: constant(coat.factor),
                roughness: constant(coat.roughness),
                normal: coat.normal.map(|normal| normal.resolve(cx)),
            }),
            sheen,
            transmission: self.transmission.map(constant),
            volume: self.volume.map(|volume| volume.resolve(cx)),
            dispersion: self.abbe_number.map_or(0.0, |abbe| 20.0 / abbe),
            iridescence: self.iridescence.map(|film| world::Iridescence {
                factor: constant(film.factor),
                ior: film.ior,
                thickness: [film.thickness; 2],
                thickness_texture: None,
            }),
            anisotropy: self.anisotropy.map(|anisotropy| world::Anisotropy {
                strength: anisotropy.strength,
                rotation: anisotropy.rotation.to_radians(),
                texture: None,
            }),
            diffuse_transmission,
            ..Layered::new(pbr)
        };
        match layered.is_plain() {
            true => Surface::Pbr(pbr),
            false => Surface::Layered(Box::new(layered)),
        }
    }

    /// Of what is there and does nothing.
    fn warn(&self, keys: &Keys, cx: &mut Context) {
        let passes = self.transmission.is_some_and(|share| share > 0.0);
        let passes_scattered = self.diffuse_transmission.as_ref().is_some_and(|diffuse| diffuse.factor > 0.0);
        if self.volume.is_some()
            && !passes
            && !passes_scattered
            && keys.sound(&["transmission", "diffuse_transmission"])
        {
            cx.warn(keys.key("volume"), "`volume` has no effect: no light passes through the surface")
                .help("say `transmission = 1`, or `diffuse_transmission`");
        }
        let refracts = passes && self.volume.is_some();
        if self.abbe_number.is_some() && !refracts && keys.sound(&["transmission", "volume"]) {
            cx.warn(keys.key("abbe_number"), "`abbe_number` has no effect: the surface does not refract")
                .help("say `transmission = 1` and `volume = {}`");
        }
    }
}

impl Volume {
    fn resolve(self, cx: &mut Context) -> world::Volume {
        let color = self.attenuation_color.vec();
        if color.max_element() > 1.0 {
            cx.error(
                self.keys.value("attenuation_color"),
                "`attenuation_color` must be at most 1: no more light is left than there was",
            );
        }
        if self.attenuation_distance.is_none()
            && self.keys.given("attenuation_color")
            && self.keys.sound(&["attenuation_distance"])
        {
            cx.warn(
                self.keys.key("attenuation_color"),
                "`attenuation_color` has no effect without `attenuation_distance`",
            )
            .help("say how many metres light goes until it has this colour");
        }
        world::Volume {
            attenuation_color: color,
            attenuation_distance: self.attenuation_distance.unwrap_or(f32::INFINITY),
        }
    }
}
