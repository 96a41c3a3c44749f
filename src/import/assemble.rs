//! Everything that a scene file names, loaded and put together.

use std::{
    collections::{BTreeSet, HashMap},
    path::{Path, PathBuf},
};

use glam::{Affine3A, Vec3};
use rayon::prelude::*;

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

/// A scene with all that its file names.
pub struct Assembled<T> {
    pub world: World,
    pub render: render::Settings,
    pub output: output::Settings,
    /// What was made of each model, in the order of their meshes in the world.
    pub made: Vec<T>,
}

/// Loads the models and images of `scene`: each file once, however often it is used. All that is wrong with any of
/// them is reported; warnings are in the world's model.
pub fn assemble(scene: ValidScene) -> Result<(World, render::Settings, output::Settings), Vec<Diagnostic>> {
    let Assembled { world, render, output, .. } = assemble_while(scene, |_, _| ())?;
    Ok((world, render, output))
}

/// The same, and what `meanwhile` makes of the meshes, materials and instances of each model, while images may still be
/// decoded. Also given are materials of the scene that may replace some of the model's.
pub fn assemble_while<T: Send>(
    scene: ValidScene,
    meanwhile: impl Fn(&Model, &[&Material]) -> T + Sync,
) -> Result<Assembled<T>, Vec<Diagnostic>> {
    let model = |source: &ModelSource, replacing: &[&Material]| {
        super::model_while(&source.file, &source.selection, |model| meanwhile(model, replacing))
    };
    assemble_with(model, image::load, scene)
}

/// … with the ways to read a model, of which it is known which materials may replace some of its own, and an image.
fn assemble_with<T: Send>(
    model: impl Fn(&ModelSource, &[&Material]) -> Result<(Model, T), Vec<Diagnostic>> + Sync,
    image: impl Fn(&Path) -> Result<Image, Diagnostic> + Sync,
    scene: ValidScene,
) -> Result<Assembled<T>, Vec<Diagnostic>> {
    let mut assembly = Assembly {
        files: Files::read(&scene, &model, &image),
        file: scene.file.clone(),
        model: Model {
            materials: scene.materials,
            warnings: scene.warnings,
            sources: vec![scene.file],
            ..Model::default()
        },
        images: HashMap::new(),
        assets: HashMap::new(),
        made: Vec::new(),
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
    let Assembly { file, model, made, cameras, surrounding, mut errors, .. } = assembly;
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
    Ok(Assembled { world, render: scene.render, output: scene.output, made })
}

/// A file, and what of it is shown.
type Key = (PathBuf, Selection);

fn key(source: &ModelSource) -> Key {
    // Two names of one file are one file.
    let file = std::fs::canonicalize(&source.file).unwrap_or_else(|_| source.file.clone());
    (file, source.selection.clone())
}

/// What the files that a scene names hold, or what is wrong with them.
struct Files<T> {
    images: HashMap<PathBuf, Result<Image, Diagnostic>>,
    models: HashMap<Key, Result<(Model, T), Vec<Diagnostic>>>,
}

impl<T: Send> Files<T> {
    /// Reads each file once, and as many at a time as there are threads.
    fn read(
        scene: &ValidScene,
        model: &(impl Fn(&ModelSource, &[&Material]) -> Result<(Model, T), Vec<Diagnostic>> + Sync),
        image: &(impl Fn(&Path) -> Result<Image, Diagnostic> + Sync),
    ) -> Self {
        let mut images: BTreeSet<&Path> = scene.images.iter().map(|source| source.file.as_path()).collect();
        if let Some(EnvironmentSourceKind::Image { file, .. }) = scene.environment.as_ref().map(|e| &e.kind) {
            images.insert(file);
        }
        let mut models: HashMap<Key, (&ModelSource, Vec<&Material>)> = HashMap::new();
        for source in &scene.models {
            let replacing = source.materials.iter().map(|replaced| replaced.material).chain(source.material);
            let replacing = replacing.filter_map(|id| scene.materials.get(id.index()));
            models.entry(key(source)).or_insert((source, Vec::new())).1.extend(replacing);
        }
        let (images, models) = rayon::join(
            || images.into_par_iter().map(|file| (file.to_owned(), image(file))).collect(),
            || models.into_par_iter().map(|(key, (source, by))| (key, model(source, &by))).collect(),
        );
        Self { images, models }
    }
}

struct Assembly<T> {
    /// What has not been used yet.
    files: Files<T>,
    file: PathBuf,
    model: Model,
    images: HashMap<PathBuf, Option<ImageId>>,
    assets: HashMap<Key, Option<Asset>>,
    made: Vec<T>,
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

impl<T> Assembly<T> {
    /// The image in a file; `None` where it cannot be read.
    fn image(&mut self, file: &Path, place: &Place) -> Option<ImageId> {
        if let Some(known) = self.images.get(file) {
            return *known;
        }
        let id = match self.files.images.remove(file)? {
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

    /// Adds the model, unless it has been, and its instances, lights and cameras.
    fn place(&mut self, source: &ModelSource) {
        let key = key(source);
        if let Some(loaded) = self.files.models.remove(&key) {
            let asset = match loaded {
                Ok((mut model, made)) => {
                    let offsets = merge::append(&mut self.model, &mut model);
                    self.made.push(made);
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
