//! Everything that a scene file names, loaded and put together.

use std::{
    collections::HashMap,
    path::{Path, PathBuf},
};

use glam::{Affine3A, Vec3};

use super::{
    bounds::Bounds,
    cameras,
    framing::{self, Subject},
    image, merge,
};
use crate::{
    diagnostic::{Diagnostic, Place, nearest, quote},
    output, render,
    scene::{
        CameraSource, EnvironmentSource, EnvironmentSourceKind, Lens, ModelSource, Selection, ValidScene,
    },
    world::{
        Camera, ColorSpace, Environment, EnvironmentKind, Image, ImageId, Instance, Material, Model,
        Projection, Surface, Texture, World,
    },
};

/// Loads the models and images of `scene`: each file once, however often it is used. All that is wrong with any of
/// them is reported; warnings are in the world's model.
pub fn assemble(scene: ValidScene) -> Result<(World, render::Settings, output::Settings), Vec<Diagnostic>> {
    assemble_with(Loaders { model: super::model, image: image::load }, scene)
}

/// How files are read.
#[derive(Clone, Copy)]
struct Loaders {
    model: fn(&Path, &Selection) -> Result<Model, Vec<Diagnostic>>,
    image: fn(&Path) -> Result<Image, Diagnostic>,
}

fn assemble_with(
    loaders: Loaders,
    scene: ValidScene,
) -> Result<(World, render::Settings, output::Settings), Vec<Diagnostic>> {
    let mut assembly = Assembly {
        loaders,
        file: scene.file.clone(),
        model: Model {
            materials: scene.materials,
            warnings: scene.warnings,
            sources: vec![scene.file],
            ..Model::default()
        },
        images: HashMap::new(),
        assets: HashMap::new(),
        cameras: Vec::new(),
        surrounding: None,
        errors: Vec::new(),
    };
    for source in &scene.images {
        let image = assembly.image(&source.file, &source.place).unwrap_or(ImageId(0));
        assembly.model.textures.push(Texture {
            image,
            color_space: source.color_space,
            wrap_u: source.wrap,
            wrap_v: source.wrap,
            filter: source.filter,
        });
    }
    let environment = scene.environment.as_ref().map(|source| assembly.environment(source));
    assembly.model.lights = scene.lights;
    for source in &scene.models {
        assembly.place(source);
    }

    let all_loaded = assembly.assets.values().all(Option::is_some);
    let Assembly { file, model, cameras, surrounding, mut errors, .. } = assembly;
    let environment = environment.or(surrounding).unwrap_or_else(darkness);
    let mut world = World {
        model,
        spheres: scene.spheres,
        quads: scene.quads,
        environment,
        // Stands in until what it is to show is known.
        camera: framing::frame(&Subject::boxed(Bounds::UNIT), framing::USUAL, 1.0),
    };
    match camera(&scene.camera, &scene.render, &world, &cameras, &file) {
        Ok(camera) => world.camera = camera,
        // A model that could not be loaded may hold the camera.
        Err(error) => errors.extend(error.filter(|_| all_loaded)),
    }
    if !errors.is_empty() {
        return Err(errors);
    }
    if is_dark(&world) {
        let warning = Diagnostic::warning(file, Place::File, "nothing in this scene gives light")
            .help("add an [environment], a [[light]] or an emissive material");
        world.model.warnings.push(warning);
    }
    Ok((world, scene.render, scene.output))
}

struct Assembly {
    loaders: Loaders,
    file: PathBuf,
    model: Model,
    images: HashMap<PathBuf, Option<ImageId>>,
    assets: HashMap<(PathBuf, Selection), Option<Asset>>,
    cameras: Vec<Camera>,
    /// The first that a model brings.
    surrounding: Option<Environment>,
    errors: Vec<Diagnostic>,
}

/// A model file that has been loaded: its meshes, textures and materials are in the world's model already.
struct Asset {
    /// What is left to be placed.
    model: Model,
    offsets: merge::Offsets,
}

impl Assembly {
    /// The image in a file; `None` where it cannot be read.
    fn image(&mut self, file: &Path, place: &Place) -> Option<ImageId> {
        if let Some(known) = self.images.get(file) {
            return *known;
        }
        let id = match (self.loaders.image)(file) {
            Ok(image) => {
                self.model.sources.push(file.to_owned());
                self.model.images.push(image);
                Some(ImageId(self.model.images.len() as u32 - 1))
            }
            Err(error) => {
                let message = format!("{}: {}", quote(&file.to_string_lossy()), error.message);
                self.errors.push(Diagnostic { help: error.help, ..self.error(place, message) });
                None
            }
        };
        self.images.insert(file.to_owned(), id);
        id
    }

    fn environment(&mut self, source: &EnvironmentSource) -> Environment {
        let kind = match &source.kind {
            EnvironmentSourceKind::Color(color) => EnvironmentKind::Color(*color),
            EnvironmentSourceKind::Gradient { bottom, top } => {
                EnvironmentKind::Gradient { bottom: *bottom, top: *top }
            }
            EnvironmentSourceKind::Image { file, place } => EnvironmentKind::Image {
                image: self.image(file, place).unwrap_or(ImageId(0)),
                color_space: ColorSpace::Srgb,
            },
        };
        let EnvironmentSource { strength, rotation, visible, .. } = *source;
        Environment { kind, strength, rotation, visible }
    }

    /// Loads the model, unless it has been, and adds its instances, lights and cameras.
    fn place(&mut self, source: &ModelSource) {
        // Two names of one file are one file.
        let file = std::fs::canonicalize(&source.file).unwrap_or_else(|_| source.file.clone());
        let key = (file, source.selection.clone());
        if !self.assets.contains_key(&key) {
            let asset = match (self.loaders.model)(&source.file, &source.selection) {
                Ok(mut model) => {
                    let offsets = merge::append(&mut self.model, &mut model);
                    Some(Asset { model, offsets })
                }
                Err(errors) => {
                    self.errors.extend(errors);
                    None
                }
            };
            self.assets.insert(key.clone(), asset);
        }
        let Some(Some(asset)) = self.assets.get(&key) else {
            return;
        };

        let names = || asset.model.materials.iter().map(|material| material.name.as_str());
        for replaced in &source.materials {
            if !names().any(|name| name == replaced.name) {
                let help = match (nearest(&replaced.name, names()), names().count()) {
                    (Some(near), _) => format!("did you mean `{near}`?"),
                    (None, 0) => "the model has no materials".into(),
                    (None, _) => {
                        let names: Vec<_> = names().take(20).map(quote).collect();
                        format!("its materials are {}", names.join(", "))
                    }
                };
                let message = format!("the model has no material called {}", quote(&replaced.name));
                self.errors.push(Diagnostic::error(&self.file, replaced.place.clone(), message).help(help));
            }
        }

        let replacement = |material: &Material| {
            let named = source.materials.iter().find(|replaced| replaced.name == material.name);
            source.material.or(named.map(|replaced| replaced.material))
        };
        let mut flat = 0;
        for instance in &asset.model.instances {
            let to_world = source.to_world * instance.to_world;
            if !is_invertible(to_world) {
                flat += 1;
                continue;
            }
            let material = |id: &crate::world::MaterialId| {
                let imported = asset.model.materials.get(id.index());
                imported.and_then(replacement).unwrap_or(asset.offsets.material(*id))
            };
            self.model.instances.push(Instance {
                name: instance.name.clone(),
                mesh: asset.offsets.mesh(instance.mesh),
                to_world,
                materials: instance.materials.iter().map(material).collect(),
            });
        }
        let lights = asset.model.lights.iter().map(|light| merge::place_light(light, source.to_world));
        self.model.lights.extend(lights);
        let cameras = asset.model.cameras.iter().map(|camera| merge::place_camera(camera, source.to_world));
        self.cameras.extend(cameras);
        if self.surrounding.is_none() {
            self.surrounding = asset.model.environment.clone();
        }
        if flat > 0 {
            let message = format!(
                "{flat} parts of the model are left out: at this scale they have no volume, or no end"
            );
            let warning = Diagnostic::warning(&self.file, source.place.clone(), message);
            self.model.warnings.push(warning);
        }
    }

    fn error(&self, place: &Place, message: String) -> Diagnostic {
        Diagnostic::error(&self.file, place.clone(), message)
    }
}

fn camera(
    source: &CameraSource,
    settings: &render::Settings,
    world: &World,
    cameras: &[Camera],
    file: &Path,
) -> Result<Camera, Option<Diagnostic>> {
    let aspect = settings.size[0] as f32 / settings.size[1].max(1) as f32;
    match source {
        CameraSource::Placed(camera) => Ok(camera.clone()),
        CameraSource::Framed { projection, lens, focus } => {
            let framed = framing::frame(&Subject::of(world), *projection, aspect);
            let aperture = diameter(*lens, *projection);
            Ok(Camera { aperture, focus: focus.unwrap_or(framed.focus), ..framed })
        }
        CameraSource::Imported { name, lens, focus, place } => {
            let camera = cameras::find(cameras, name.as_deref(), file, place).map_err(Some)?;
            let focus =
                focus.unwrap_or_else(|| framing::distance_along_view(camera, &Subject::of(world).bounds));
            Ok(Camera { aperture: diameter(*lens, camera.projection), focus, ..camera.clone() })
        }
    }
}

fn diameter(lens: Lens, projection: Projection) -> f32 {
    match (lens, projection) {
        (lens, Projection::Perspective { vfov }) => lens.diameter(vfov),
        (Lens::Diameter(diameter), Projection::Orthographic { .. }) => diameter,
        // An orthographic view has no focal length to divide.
        (Lens::FStop { .. }, Projection::Orthographic { .. }) => 0.0,
    }
}

fn darkness() -> Environment {
    Environment { kind: EnvironmentKind::Color(Vec3::ZERO), strength: 1.0, rotation: 0.0, visible: true }
}

fn is_invertible(to_world: Affine3A) -> bool {
    to_world.is_finite() && to_world.matrix3.determinant().is_normal() && to_world.inverse().is_finite()
}

/// Nothing gives light: the picture will be black.
fn is_dark(world: &World) -> bool {
    let gives = |color: Vec3| color.max_element() > 0.0;
    let environment = world.environment.strength > 0.0
        && match world.environment.kind {
            EnvironmentKind::Color(color) => gives(color),
            EnvironmentKind::Gradient { bottom, top } => gives(bottom) || gives(top),
            EnvironmentKind::Image { .. } => true,
        };
    let shines = |material: &Material| {
        material.emission.is_some() || matches!(material.surface, Surface::Unlit { .. })
    };
    !environment && world.model.lights.is_empty() && !world.model.materials.iter().any(shines)
}

#[cfg(test)]
mod tests;
