//! Materials as the nodes that `scene.py` knows.

use glam::Vec3;

use super::{
    document::{self, Absorption, Alpha, Color, Emission, NormalMap, Surface, Value},
    layered,
    textures::{Channels, Textures},
};
use crate::{
    export::{Error, fuzz, note::Notes},
    world::{self, ColorInput, Fresnel, MaterialId, MetalFinish, Model, ScalarInput, Texels},
};

/// What a material is put on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Role {
    /// Triangles with their own texture coordinates.
    Mesh,
    /// A sphere, whose texture coordinates follow from its normal.
    Sphere,
    /// A sphere whose light comes from a lamp of its shape.
    LampBody,
}

/// Materials by what they are put on, in the order in which they came up.
pub struct Materials<'a, 'b> {
    model: &'a Model,
    textures: &'a mut Textures<'b>,
    known: Vec<(MaterialId, Role)>,
    done: Vec<document::Material>,
}

/// What a mesh must have for its materials.
#[derive(Clone, Copy, Debug, Default)]
pub struct Needs {
    pub uvs: [bool; 2],
    pub colors: bool,
    pub tangents: bool,
}

impl<'a, 'b> Materials<'a, 'b> {
    pub fn new(model: &'a Model, textures: &'a mut Textures<'b>) -> Self {
        Self { model, textures, known: Vec::new(), done: Vec::new() }
    }

    pub fn finish(self) -> Vec<document::Material> {
        self.done
    }

    pub fn index(&mut self, id: MaterialId, role: Role, notes: &mut Notes) -> Result<usize, Error> {
        if let Some(index) = self.known.iter().position(|known| *known == (id, role)) {
            return Ok(index);
        }
        let Some(material) = self.model.materials.get(id.index()) else { return Ok(0) };
        let done = Conversion { model: self.model, textures: self.textures, notes, material, role }.run()?;
        self.known.push((id, role));
        self.done.push(done);
        Ok(self.done.len() - 1)
    }
}

impl Needs {
    pub fn add(&mut self, material: &world::Material) {
        material.clone().for_each_texture(&mut |texture| self.uvs[usize::from(texture.uv_set & 1)] = true);
        self.colors |= material.vertex_colors;
        let along = layered::of(material)
            .is_some_and(|l| l.anisotropy.is_some() || l.clearcoat.is_some_and(|coat| coat.normal.is_some()));
        self.tangents |= material.normal.is_some() || along;
    }
}

/// Whether a material gives light.
pub fn shines(material: &world::Material) -> bool {
    material.emission.is_some_and(|e| (e.strength * e.color.factor).max_element() > 0.0)
}

struct Conversion<'a, 'b> {
    model: &'a Model,
    textures: &'a mut Textures<'b>,
    notes: &'a mut Notes,
    material: &'a world::Material,
    role: Role,
}

impl Conversion<'_, '_> {
    fn run(mut self) -> Result<document::Material, Error> {
        let material = self.material;
        let emission = material.emission.filter(|_| shines(material));
        let emission_sampling = match emission {
            Some(_) if self.role == Role::LampBody => "NONE",
            Some(e) if e.two_sided => "FRONT_BACK",
            Some(_) => "FRONT",
            None => "NONE",
        };
        let emission = match emission {
            None => None,
            Some(e) => Some(Emission {
                color: Color { vertex: false, ..self.light(&e.color)? },
                strength: e.strength,
                two_sided: e.two_sided,
                camera_only: self.role == Role::LampBody,
                passed: layered::of(material).and_then(layered::glow),
            }),
        };
        let normal = self.normal(material.normal.as_ref())?;
        let absorption = layered::of(material)
            .and_then(|layered| layered.medium())
            .and_then(layered::absorption)
            .map(|(color, density)| Absorption { color, density });
        let bump_correction = self.bump_correction();
        Ok(document::Material {
            name: material.name.clone(),
            sphere: self.role != Role::Mesh,
            surface: self.surface()?,
            absorption,
            emission,
            emission_sampling,
            alpha: self.alpha()?,
            normal,
            bump_correction,
            cull_backs: !material.double_sided,
        })
    }

    fn surface(&mut self) -> Result<Surface, Error> {
        let material = self.material;
        let distribution = |multiscatter| if multiscatter { "MULTI_GGX" } else { "GGX" };
        Ok(match &material.surface {
            world::Surface::Diffuse { color } => Surface::Diffuse { color: self.reflectance(color)? },
            world::Surface::Metal { color, finish: MetalFinish::Fuzz(fuzz) } => {
                let alpha = fuzz::beckmann_alpha(*fuzz);
                if *fuzz > 0.0 {
                    self.note(
                        "fuzz f as Beckmann facets of α = 0.35 f, roughness √α: the width that shares most of its light \
                         with the ball",
                    );
                }
                Surface::Glossy {
                    color: self.reflectance(color)?,
                    roughness: constant(alpha.sqrt()),
                    distribution: "BECKMANN",
                }
            }
            world::Surface::Metal {
                color,
                finish: MetalFinish::Roughness { roughness, fresnel: Fresnel::Constant, multiscatter },
            } => Surface::Glossy {
                color: self.reflectance(color)?,
                roughness: self.value(roughness)?,
                distribution: distribution(*multiscatter),
            },
            world::Surface::Metal {
                color,
                finish: MetalFinish::Roughness { roughness, multiscatter, .. },
            } => Surface::Principled {
                color: self.reflectance(color)?,
                metallic: constant(1.0),
                roughness: self.value(roughness)?,
                ior: 1.5,
                distribution: distribution(*multiscatter),
            },
            world::Surface::Dielectric { ior, fresnel, roughness, tint } => {
                let (color, roughness) = (self.reflectance(tint)?, self.value(roughness)?);
                let smooth = roughness.factor == 0.0;
                if roughness.factor > layered::ROUGH {
                    self.note(layered::ROUGH_GLASS);
                }
                match fresnel {
                    Fresnel::Schlick if smooth => Surface::SchlickGlass { color, ior: *ior },
                    _ => {
                        if *fresnel == Fresnel::Schlick {
                            self.note(
                                "rough glass reflects by the equations of Fresnel instead of Schlick's curve",
                            );
                        }
                        Surface::Glass { color, roughness, ior: *ior }
                    }
                }
            }
            world::Surface::Pbr(pbr) => Surface::Principled {
                color: self.reflectance(&pbr.base_color)?,
                metallic: self.value(&pbr.metallic)?,
                roughness: self.value(&pbr.roughness)?,
                ior: pbr.ior.max(1.0 / pbr.ior),
                distribution: distribution(pbr.multiscatter),
            },
            world::Surface::Unlit { color } => Surface::Unlit { color: self.light(color)? },
            world::Surface::Layered(layered) => {
                layered::differences(layered).into_iter().for_each(|text| self.note(text));
                Surface::Layered(Box::new(self.layered(layered)?))
            }
            world::Surface::SpecularGlossiness(surface) => Surface::SpecularGlossiness {
                diffuse: self.reflectance(&surface.diffuse)?,
                specular: Color { vertex: false, ..self.reflectance(&surface.specular)? },
                glossiness: self.value(&surface.glossiness)?,
            },
            world::Surface::Black => Surface::Black,
        })
    }

    fn layered(&mut self, layered: &world::Layered) -> Result<document::Layered, Error> {
        let pbr = &layered.pbr;
        let specular = match &layered.specular {
            None => None,
            Some(specular) => Some(document::Specular {
                factor: self.value(&specular.factor)?,
                tint: self.plain(&specular.color)?,
                most: layered::most_tint(pbr.ior),
            }),
        };
        let coat = match &layered.clearcoat {
            None => None,
            Some(coat) => Some(document::Coat {
                weight: self.value(&coat.factor)?,
                roughness: self.value(&coat.roughness)?,
                normal: self.normal(coat.normal.as_ref())?,
            }),
        };
        let sheen = match &layered.sheen {
            None => None,
            Some(sheen) => Some(document::Sheen {
                color: self.plain(&sheen.color)?,
                roughness: self.value(&sheen.roughness)?,
            }),
        };
        let film = match &layered.iridescence {
            None => None,
            Some(film) => {
                let texture =
                    film.thickness_texture.map(|texture| ScalarInput { factor: 1.0, texture: Some(texture) });
                Some(document::Film {
                    weight: self.value(&film.factor)?,
                    ior: film.ior,
                    thickness: film.thickness,
                    thickness_texture: texture.map(|texture| self.value(&texture)).transpose()?,
                })
            }
        };
        let anisotropy = match &layered.anisotropy {
            None => None,
            Some(anisotropy) => Some(document::Anisotropy {
                strength: anisotropy.strength,
                rotation: anisotropy.rotation,
                texture: match &anisotropy.texture {
                    Some(texture) => self.textures.lookup(texture, Channels::Color, self.notes)?,
                    None => None,
                },
            }),
        };
        let diffuse_transmission = match &layered.diffuse_transmission {
            None => None,
            Some(diffuse) => Some(document::DiffuseTransmission {
                factor: self.value(&diffuse.factor)?,
                color: self.plain(&diffuse.color)?,
            }),
        };
        Ok(document::Layered {
            color: self.reflectance(&pbr.base_color)?,
            metallic: self.value(&pbr.metallic)?,
            roughness: self.value(&pbr.roughness)?,
            ior: pbr.ior.max(1.0 / pbr.ior),
            distribution: if pbr.multiscatter { "MULTI_GGX" } else { "GGX" },
            specular,
            coat,
            sheen,
            film,
            anisotropy,
            transmission: layered.transmission.as_ref().map(|share| self.value(share)).transpose()?,
            solid: layered.volume.is_some(),
            diffuse_transmission,
            passed: layered::passed(layered),
        })
    }

    fn normal(&mut self, map: Option<&world::NormalMap>) -> Result<Option<NormalMap>, Error> {
        let Some(map) = map else { return Ok(None) };
        let texture = self.textures.lookup(&map.texture, Channels::Color, self.notes)?;
        Ok(texture.map(|texture| NormalMap { texture, scale: map.scale }))
    }

    /// Cycles has both halves of it or none: normals that mirror outwards, as here, and less light from near the
    /// horizon of the true surface, as not here (35 % at an elevation of 10° under a map that leans by 35°).
    fn bump_correction(&mut self) -> bool {
        let coat = layered::of(self.material).and_then(|layered| layered.clearcoat);
        if self.material.normal.is_none() && coat.is_none_or(|coat| coat.normal.is_none()) {
            return false;
        }
        let metallic = match &self.material.surface {
            world::Surface::Metal { .. } => true,
            world::Surface::Pbr(pbr) => pbr.metallic.factor > 0.0,
            world::Surface::Layered(layered) => layered.pbr.metallic.factor > 0.0,
            world::Surface::SpecularGlossiness(surface) => surface.specular.factor.max_element() > 0.2,
            world::Surface::Dielectric { .. }
            | world::Surface::Diffuse { .. }
            | world::Surface::Unlit { .. }
            | world::Surface::Black => return false,
        };
        self.note(match metallic {
            true => "under the normal map Cycles dims light that grazes the true surface (bump map correction on)",
            false => {
                "mapped normals that mirror into the surface reflect nothing there; here they are bent until they \
                 mirror outwards (bump map correction off)"
            }
        });
        metallic
    }

    fn alpha(&mut self) -> Result<Option<Alpha>, Error> {
        let cutoff = match self.material.alpha {
            world::Alpha::Opaque => return Ok(None),
            world::Alpha::Mask { cutoff } => Some(cutoff),
            world::Alpha::Blend => None,
        };
        let coverage = self.value(&self.material.coverage)?;
        Ok(Some(Alpha { coverage, vertex: self.by_vertex(), cutoff }))
    }

    /// Vertex colours are white but on meshes.
    fn by_vertex(&self) -> bool {
        self.material.vertex_colors && self.role == Role::Mesh
    }

    /// Where nothing but constants goes in, it is clamped here.
    fn reflectance(&mut self, input: &ColorInput) -> Result<Color, Error> {
        let color = self.light(input)?;
        if color.texture.is_none() && !color.vertex {
            let factor = Vec3::from(color.factor).clamp(Vec3::ZERO, Vec3::ONE).into();
            return Ok(Color { factor, ..color });
        }
        let clamp = color.vertex || input.factor.max_element() > 1.0 || self.is_float(input);
        Ok(Color { clamp, ..color })
    }

    /// A colour that vertex colours do not multiply.
    fn plain(&mut self, input: &ColorInput) -> Result<Color, Error> {
        Ok(Color { vertex: false, ..self.light(input)? })
    }

    /// A colour that may be greater than 1.
    fn light(&mut self, input: &ColorInput) -> Result<Color, Error> {
        let texture = match &input.texture {
            Some(texture) => self.textures.lookup(texture, Channels::Color, self.notes)?,
            None => None,
        };
        Ok(Color { factor: input.factor.into(), texture, vertex: self.by_vertex(), clamp: false })
    }

    fn is_float(&self, input: &ColorInput) -> bool {
        let texture = input.texture.and_then(|t| self.model.textures.get(t.texture.index()));
        let image = texture.and_then(|t| self.model.images.get(t.image.index()));
        image.is_some_and(|image| matches!(image.texels, Texels::RgbF32(_)))
    }

    fn value(&mut self, input: &ScalarInput) -> Result<Value, Error> {
        let Some((texture, channel)) = &input.texture else { return Ok(constant(input.factor)) };
        let channels = if *channel == 3 { Channels::Alpha } else { Channels::Color };
        let texture = self.textures.lookup(texture, channels, self.notes)?;
        Ok(Value { factor: input.factor, texture, channel: *channel })
    }

    fn note(&mut self, text: &str) {
        self.notes.approximated(format!("material `{}`", self.material.name), text);
    }
}

fn constant(factor: f32) -> Value {
    Value { factor, texture: None, channel: 0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{export::folder::Folder, world::Material};

    fn converted(material: Material, role: Role) -> (document::Material, usize) {
        let root = tempfile::tempdir().expect("folder");
        let mut out = Folder::stage(root.path()).expect("staged");
        let model = Model { materials: vec![material], ..Model::default() };
        let mut textures = Textures::new(&model, &mut out);
        let mut materials = Materials::new(&model, &mut textures);
        let mut notes = Notes::default();
        materials.index(MaterialId(0), role, &mut notes).expect("converted");
        (materials.finish().remove(0), notes.finish().len())
    }

    fn metal(finish: MetalFinish) -> Material {
        Material::new(
            "m",
            world::Surface::Metal { color: ColorInput::constant(Vec3::new(2.0, 0.5, 0.1)), finish },
        )
    }

    #[test]
    fn reflectances_are_clamped_and_mirrors_are_exact() {
        let (mirror, notes) = converted(metal(MetalFinish::Fuzz(0.0)), Role::Mesh);
        let color = Color { factor: [1.0, 0.5, 0.1], texture: None, vertex: false, clamp: false };
        assert_eq!(
            mirror.surface,
            Surface::Glossy { color, roughness: constant(0.0), distribution: "BECKMANN" }
        );
        assert_eq!(notes, 0);
        assert_eq!(converted(metal(MetalFinish::Fuzz(0.3)), Role::Mesh).1, 1);
    }

    #[test]
    fn single_scattering_is_asked_for_where_the_scene_has_it() {
        for (multiscatter, expected) in [(true, "MULTI_GGX"), (false, "GGX")] {
            for fresnel in [Fresnel::Constant, Fresnel::Schlick] {
                let roughness = ScalarInput::constant(0.5);
                let finish = MetalFinish::Roughness { roughness, fresnel, multiscatter };
                let surface = converted(metal(finish), Role::Mesh).0.surface;
                let distribution = match surface {
                    Surface::Glossy { distribution, .. } if fresnel == Fresnel::Constant => distribution,
                    Surface::Principled { distribution, .. } if fresnel == Fresnel::Schlick => distribution,
                    other => panic!("{other:?}"),
                };
                assert_eq!(distribution, expected);
            }
        }
    }

    #[test]
    fn lamps_take_over_the_light_of_their_bodies() {
        let mut material = Material::new("lamp", world::Surface::Black);
        material.emission =
            Some(world::Emission { color: ColorInput::constant(Vec3::ONE), strength: 5.0, two_sided: false });
        let (body, _) = converted(material.clone(), Role::LampBody);
        assert!(body.emission.is_some_and(|e| e.camera_only) && body.emission_sampling == "NONE");
        let (mesh, _) = converted(material.clone(), Role::Mesh);
        assert!(mesh.emission.is_some_and(|e| !e.camera_only) && mesh.emission_sampling == "FRONT");
        material.emission = material.emission.map(|e| world::Emission { strength: 0.0, ..e });
        assert!(converted(material, Role::Mesh).0.emission.is_none());
    }
}
