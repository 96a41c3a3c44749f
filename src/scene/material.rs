//! `[materials.NAME]`: what surfaces do with light.

use super::{
    choice::choice,
    color::Color,
    context::Context,
    layers::{Anisotropy, Clearcoat, DiffuseTransmission, Iridescence, Layers, Sheen, Specular, Volume},
    range::{above, from},
    table::{table, tagged},
    texture::{Input, NormalMap, Texture, warn_reflectance},
};
use crate::world::{self, Alpha, ColorInput, Emission, Fresnel, MetalFinish, Pbr, ScalarInput, Surface};

tagged! {
    /// What a surface does with light.
    enum Material { Diffuse, Metal, Dielectric, Emissive, PbrMaterial, Unlit }
}

table! {
    /// Scatters light evenly to all sides (Lambert).
    struct Diffuse as "diffuse" {
        /// Share of the light that is reflected: a colour or a texture.
        color: Input = Input::Color(Color([0.5, 0.5, 0.5])),
    }
}

table! {
    /// A mirror, perfect or blurred.
    struct Metal as "metal" {
        /// Reflectance at normal incidence: a colour or a texture.
        color: Input = Input::Color(Color([0.8, 0.8, 0.8])),
        /// Blur: radius of the ball that perturbs the reflected ray. Without it, and without roughness: 0, a perfect mirror.
        fuzz: Option<f32>; from(0.0).to(1.0),
        /// Instead of fuzz: GGX microfacets of this perceptual roughness.
        roughness: Option<f32>; from(0.0).to(1.0),
        /// With roughness: "schlick" (brighter at grazing angles) or "constant" (a plain tint).
        fresnel: MetalFresnel = MetalFresnel::Schlick,
        /// With roughness: whether energy lost to scattering between microfacets is given back.
        multiscatter: bool = true,
    }
}

table! {
    /// Glass, water: reflects and refracts.
    struct Dielectric as "dielectric" {
        /// Index of refraction.
        ior: f32 = 1.5; above(0.0).to(100.0),
        /// "exact", or "schlick" for his approximation.
        fresnel: DielectricFresnel = DielectricFresnel::Exact,
        /// Perceptual roughness; 0 is smooth.
        roughness: f32 = 0.0; from(0.0).to(1.0),
        /// Multiplies what is reflected and what is refracted: a colour or a texture.
        color: Input = Input::Color(Color::WHITE),
    }
}

table! {
    /// Gives light and reflects none.
    struct Emissive as "emissive" {
        /// Radiance, W/m²/sr, before strength: a colour or a texture.
        color: Input = Input::Color(Color::WHITE),
        /// Factor on the radiance.
        strength: f32 = 1.0; from(0.0),
        /// Whether the back gives light too.
        two_sided: bool = false,
    }
}

table! {
    /// The metallic-roughness model of glTF 2.0.
    struct PbrMaterial as "pbr" {
        /// Diffuse reflectance of dielectrics, specular reflectance of metals: a colour or a texture (its alpha is the coverage).
        base_color: Input = Input::Color(Color::WHITE),
        /// 0 is a dielectric, 1 a metal. Without it: 0, or 1 with a metallic_roughness texture.
        metallic: Option<f32>; from(0.0).to(1.0),
        /// Perceptual roughness. Without it: 0.5, or 1 with a metallic_roughness texture.
        roughness: Option<f32>; from(0.0).to(1.0),
        /// A texture whose blue channel multiplies metallic and whose green channel multiplies roughness.
        metallic_roughness: Option<Texture>,
        /// A tangent-space normal map.
        normal: Option<NormalMap>,
        /// Radiance given off, W/m²/sr, before emissive_strength: a colour or a texture.
        emissive: Input = Input::Color(Color([0.0, 0.0, 0.0])),
        /// Factor on emissive.
        emissive_strength: f32 = 1.0; from(0.0),
        /// What alpha means: "opaque" (nothing), "mask" (there or not), "blend" (covers that share). Without it: opaque, or blend where opacity is below 1.
        alpha: Option<AlphaMode>,
        /// With alpha = "mask": not there below it.
        alpha_cutoff: f32 = 0.5; from(0.0).to(1.0),
        /// Multiplies alpha.
        opacity: f32 = 1.0; from(0.0).to(1.0),
        /// Whether camera rays see the back of the surface.
        double_sided: bool = true,
        /// Index of refraction of the dielectric part.
        ior: f32 = 1.5; from(1.0).to(100.0),
        /// Whether energy lost to scattering between microfacets is given back.
        multiscatter: bool = true,
        /// Strength and colour of the dielectric part's reflection.
        specular: Option<Specular>,
        /// A layer of varnish of index 1.5 over all else.
        clearcoat: Option<Clearcoat>,
        /// Fibres that shine at grazing angles.
        sheen: Option<Sheen>,
        /// Share of what the dielectric part does not reflect that passes through the surface, tinted by base_color. Without volume the surface is a thin wall, which does not refract.
        transmission: Option<f32>; from(0.0).to(1.0),
        /// With transmission or diffuse_transmission: the mesh is solid, and what it absorbs.
        volume: Option<Volume>,
        /// Dispersion, with transmission and volume: the Abbe number, 55 for diamond, 59 for crown glass, 30 for flint. Without it all colours refract alike.
        abbe_number: Option<f32>; from(1.0),
        /// A thin film on the surface, coloured by interference.
        iridescence: Option<Iridescence>,
        /// Highlights stretched in one direction.
        anisotropy: Option<Anisotropy>,
        /// Light that leaves, scattered, on the far side.
        diffuse_transmission: Option<DiffuseTransmission>,
    }
}

table! {
    /// Shows its colour, whatever the light, and casts none.
    struct Unlit as "unlit" {
        /// Radiance shown: a colour or a texture.
        color: Input = Input::Color(Color::WHITE),
    }
}

choice! {
    /// How a metal's reflectance depends on the angle.
    enum MetalFresnel { "schlick" => Schlick, "constant" => Constant }
}

choice! {
    /// How a dielectric's reflectance depends on the angle.
    enum DielectricFresnel { "exact" => Exact, "schlick" => Schlick }
}

choice! {
    /// What alpha means.
    enum AlphaMode { "opaque" => Opaque, "mask" => Mask, "blend" => Blend }
}

impl Material {
    pub fn resolve(self, name: &str, cx: &mut Context) -> world::Material {
        match self {
            Material::Diffuse(m) => {
                let color = m.color.resolve(false, cx);
                warn_reflectance(&color, "color", &m.keys, cx);
                world::Material::new(name, Surface::Diffuse { color })
            }
            Material::Metal(m) => m.resolve(name, cx),
            Material::Dielectric(m) => {
                let tint = m.color.resolve(false, cx);
                warn_reflectance(&tint, "color", &m.keys, cx);
                let fresnel = match m.fresnel {
                    DielectricFresnel::Exact => Fresnel::Exact,
                    DielectricFresnel::Schlick => Fresnel::Schlick,
                };
                let roughness = ScalarInput::constant(m.roughness);
                world::Material::new(name, Surface::Dielectric { ior: m.ior, fresnel, roughness, tint })
            }
            Material::Emissive(m) => {
                let color = m.color.resolve(false, cx);
                let emission = Some(Emission { color, strength: m.strength, two_sided: m.two_sided });
                world::Material { emission, ..world::Material::new(name, Surface::Black) }
            }
            Material::PbrMaterial(m) => m.resolve(name, cx),
            Material::Unlit(m) => {
                let color = m.color.resolve(false, cx);
                world::Material::new(name, Surface::Unlit { color })
            }
        }
    }
}

impl Metal {
    fn resolve(self, name: &str, cx: &mut Context) -> world::Material {
        let color = self.color.resolve(false, cx);
        warn_reflectance(&color, "color", &self.keys, cx);
        self.keys.exclusive(&["fuzz", "roughness"], cx);
        let finish = match self.roughness {
            Some(roughness) => MetalFinish::Roughness {
                roughness: ScalarInput::constant(roughness),
                fresnel: match self.fresnel {
                    MetalFresnel::Schlick => Fresnel::Schlick,
                    MetalFresnel::Constant => Fresnel::Constant,
                },
                multiscatter: self.multiscatter,
            },
            None => {
                if let Some(idle) = self.keys.first(&["fresnel", "multiscatter"])
                    && self.keys.sound(&["roughness"])
                {
                    cx.warn(self.keys.key(idle), format!("`{idle}` has no effect without `roughness`"))
                        .help("say `roughness` instead of `fuzz` for GGX");
                }
                MetalFinish::Fuzz(self.fuzz.unwrap_or(0.0))
            }
        };
        world::Material::new(name, Surface::Metal { color, finish })
    }
}

impl PbrMaterial {
    fn resolve(self, name: &str, cx: &mut Context) -> world::Material {
        let base_color = self.base_color.resolve(false, cx);
        warn_reflectance(&base_color, "base_color", &self.keys, cx);
        let map = self.metallic_roughness.map(|texture| Input::Texture(texture).resolve(true, cx));
        // The factor of the texture's channel multiplies, as everywhere.
        let scalar = |value: Option<f32>, usual: f32, channel: u8| match map {
            Some(ColorInput { factor, texture }) => ScalarInput {
                factor: value.unwrap_or(1.0) * factor[usize::from(channel)],
                texture: texture.map(|texture| (texture, channel)),
            },
            None => ScalarInput::constant(value.unwrap_or(usual)),
        };
        let emission = self.emissive.resolve(false, cx);
        let emits = emission.factor.max_element() > 0.0 && self.emissive_strength > 0.0;
        let alpha = match self.alpha {
            Some(AlphaMode::Opaque) => Alpha::Opaque,
            Some(AlphaMode::Mask) => Alpha::Mask { cutoff: self.alpha_cutoff },
            Some(AlphaMode::Blend) => Alpha::Blend,
            None if self.opacity < 1.0 => Alpha::Blend,
            None => Alpha::Opaque,
        };
        if self.keys.given("alpha_cutoff")
            && !matches!(alpha, Alpha::Mask { .. })
            && self.keys.sound(&["alpha"])
        {
            cx.warn(self.keys.key("alpha_cutoff"), "`alpha_cutoff` has no effect without alpha = \"mask\"");
        }
        let pbr = Pbr {
            base_color,
            metallic: scalar(self.metallic, 0.0, 2),
            roughness: scalar(self.roughness, 0.5, 1),
            ior: self.ior,
            multiscatter: self.multiscatter,
        };
        let layers = Layers {
            specular: self.specular,
            clearcoat: self.clearcoat,
            sheen: self.sheen,
            transmission: self.transmission,
            volume: self.volume,
            abbe_number: self.abbe_number,
            iridescence: self.iridescence,
            anisotropy: self.anisotropy,
            diffuse_transmission: self.diffuse_transmission,
        };
        world::Material {
            emission: emits.then_some(Emission {
                color: emission,
                strength: self.emissive_strength,
                two_sided: false,
            }),
            alpha,
            coverage: ScalarInput {
                factor: self.opacity,
                texture: base_color.texture.map(|texture| (texture, 3)),
            },
            normal: self.normal.map(|normal| normal.resolve(cx)),
            double_sided: self.double_sided,
            ..world::Material::new(name, layers.resolve(pbr, &self.keys, cx))
        }
    }
}
