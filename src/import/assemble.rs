//! Everything that a scene file names, loaded and put together.

use std::{
    collections::HashMap,
    path::{Path, PathBuf},
};

use glam::{Affine3A, Vec3};

use super::{
    framing::{self, Bounds},
    image, merge,
};
use crate::{
    diagnostic::{Diagnostic, Place, nearest, quote},
    output, render,
    scene::{CameraSource, EnvironmentSource, EnvironmentSourceKind, Lens, ModelSource, ValidScene},
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
    model: fn(&Path) -> Result<Model, Vec<Diagnostic>>,
    image: fn(&Path) -> Result<Image, Diagnostic>,
}

fn assemble_with(
    loaders: Loaders,
    scene: ValidScene,
) -> Result<(World, render::Settings, output::Settings), Vec<Diagnostic>> {
    let mut assembly = Assembly {
        loaders,
        file: scene.file.clone(),
        model: Model { materials: scene.materials, warnings: scene.warnings, ..Model::default() },
        images: HashMap::new(),
        assets: HashMap::new(),
        cameras: Vec::new(),
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
    let environment = assembly.environment(&scene.environment);
    assembly.model.lights = scene.lights;
    for source in &scene.models {
        assembly.place(source);
    }

    let Assembly { file, model, cameras, mut errors, .. } = assembly;
    let mut world = World {
        model,
        spheres: scene.spheres,
        quads: scene.quads,
        environment,
        // Stands in until what it is to show is known.
        camera: framing::frame(&Bounds::UNIT, framing::USUAL, 1.0),
    };
    match camera(&scene.camera, &scene.render, &world, &cameras, &file) {
        Ok(camera) => world.camera = camera,
        Err(error) => errors.extend(error),
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
    assets: HashMap<PathBuf, Option<Asset>>,
    cameras: Vec<Camera>,
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
        if !self.assets.contains_key(&file) {
            let asset = match (self.loaders.model)(&source.file) {
                Ok(mut model) => {
                    let offsets = merge::append(&mut self.model, &mut model);
                    Some(Asset { model, offsets })
                }
                Err(errors) => {
                    self.errors.extend(errors);
                    None
                }
            };
            self.assets.insert(file.clone(), asset);
        }
        let Some(Some(asset)) = self.assets.get(&file) else {
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
            let framed = framing::frame(&Bounds::of_subject(world), *projection, aspect);
            let aperture = diameter(*lens, *projection);
            Ok(Camera { aperture, focus: focus.unwrap_or(framed.focus), ..framed })
        }
        CameraSource::Imported { name, lens, focus, place } => {
            let found = match name {
                Some(name) => cameras.iter().find(|camera| camera.name == *name),
                None => cameras.first(),
            };
            let Some(camera) = found else {
                return Err(Some(no_camera(name.as_deref(), cameras, place, file)));
            };
            let focus =
                focus.unwrap_or_else(|| framing::distance_along_view(camera, &Bounds::of_subject(world)));
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

fn no_camera(name: Option<&str>, cameras: &[Camera], place: &Place, file: &Path) -> Diagnostic {
    let names = || cameras.iter().map(|camera| camera.name.as_str());
    let error = |message: String| Diagnostic::error(file, place.clone(), message);
    match name {
        None => {
            error("no model has a camera".into()).help("say where the camera stands: `position` and `target`")
        }
        Some(name) => {
            let error = error(format!("no model has a camera called {}", quote(name)));
            match nearest(name, names()) {
                Some(near) => error.help(format!("did you mean `{near}`?")),
                None if cameras.is_empty() => error.help("there are no cameras in the models"),
                None => error.help(format!(
                    "there are {}",
                    names().take(20).map(quote).collect::<Vec<_>>().join(", ")
                )),
            }
        }
    }
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
mod tests {
    use glam::Affine2;

    use super::*;
    use crate::{
        diagnostic::render,
        scene::parse,
        world::{ColorInput, Filter, Light, MaterialId, Mesh, MeshId, Texels, TextureId, TextureRef, Wrap},
    };

    /// A triangle of a textured material called "Paint", a light, a camera called "Cam".
    fn asset(path: &Path) -> Result<Model, Vec<Diagnostic>> {
        if std::fs::read_to_string(path).is_ok_and(|text| text == "broken") {
            return Err(vec![Diagnostic::error(path, Place::Pointer("/meshes/0".into()), "is broken")]);
        }
        let texture = TextureRef { texture: TextureId(0), uv_set: 0, transform: Affine2::IDENTITY };
        let color = ColorInput { factor: Vec3::ONE, texture: Some(texture) };
        Ok(Model {
            meshes: vec![Mesh {
                positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y],
                triangles: vec![[0, 1, 2]],
                ..Mesh::default()
            }],
            images: vec![picture(path).expect("is read")],
            textures: vec![Texture {
                image: ImageId(0),
                color_space: ColorSpace::Srgb,
                wrap_u: Wrap::Repeat,
                wrap_v: Wrap::Repeat,
                filter: Filter::Linear,
            }],
            materials: vec![Material::new("Paint", Surface::Diffuse { color })],
            instances: vec![Instance {
                name: "triangle".into(),
                mesh: MeshId(0),
                to_world: Affine3A::IDENTITY,
                materials: vec![MaterialId(0)],
            }],
            lights: vec![Light::Point { position: Vec3::X, intensity: Vec3::ONE }],
            cameras: vec![Camera {
                name: "Cam".into(),
                to_world: Affine3A::from_translation(5.0 * Vec3::Z),
                projection: Projection::Perspective { vfov: 1.0 },
                aperture: 0.0,
                focus: 1.0,
            }],
            warnings: Vec::new(),
        })
    }

    fn picture(path: &Path) -> Result<Image, Diagnostic> {
        match path.extension() {
            Some(extension) if extension == "jpg" => {
                Err(Diagnostic::error(path, Place::File, "does not decode"))
            }
            _ => Ok(Image { name: "i".into(), width: 1, height: 1, texels: Texels::Rgba8(vec![[0; 4]]) }),
        }
    }

    fn build(text: &str) -> Result<World, Vec<Diagnostic>> {
        let folder = tempfile::tempdir().expect("a folder");
        for (name, text) in
            [("a.glb", ""), ("b.glb", ""), ("bad.obj", "broken"), ("i.png", ""), ("i.jpg", "")]
        {
            std::fs::write(folder.path().join(name), text).expect("a file");
        }
        let scene = parse(text, &folder.path().join("scene.toml"));
        let scene = scene.unwrap_or_else(|errors| panic!("{}", render(&errors, false)));
        assemble_with(Loaders { model: asset, image: picture }, scene).map(|(world, ..)| world)
    }

    #[test]
    fn a_file_is_loaded_once_and_placed_often() {
        let world = build(
            r#"
            [materials.gold]
            type = "metal"
            color = { image = "i.png" }
            [materials.lit]
            type = "diffuse"
            color = { image = "i.png", wrap = "clamp" }
            [[model]]
            file = "a.glb"
            [[model]]
            file = "./a.glb"
            translate = [10, 0, 0]
            scale = -2
            materials = { Paint = "lit" }
            [[model]]
            file = "b.glb"
            "#,
        )
        .expect("is good");
        let model = &world.model;
        // Two assets, and one image for both textures of the scene file.
        assert_eq!((model.meshes.len(), model.images.len(), model.textures.len()), (2, 3, 4));
        assert_eq!((model.materials.len(), model.instances.len(), model.lights.len()), (4, 3, 3));
        let material = |i: usize| &model.materials[model.instances[i].materials[0].index()];
        assert_eq!([0, 1, 2].map(|i| material(i).name.as_str()), ["Paint", "lit", "Paint"]);
        assert_eq!(model.instances.iter().map(|i| i.mesh.0).collect::<Vec<_>>(), [0, 0, 1]);
        // Handles of the second asset's material lead to its own image.
        let Surface::Diffuse { color } = material(2).surface else { panic!("is diffuse") };
        let texture = model.textures[color.texture.expect("is textured").texture.index()];
        assert_eq!(texture.image, ImageId(2));
        // The light goes with its model, and is as strong.
        assert_eq!(
            model.lights[1],
            Light::Point { position: Vec3::new(8.0, 0.0, 0.0), intensity: Vec3::ONE }
        );
    }

    #[test]
    fn cameras_of_models() {
        let world = build(
            "[[model]]\nfile = \"a.glb\"\nscale = 3\nrotate = [0, 90, 0]\n[camera]\nimported = \"Cam\"\nfstop = 2\n",
        );
        let camera = world.expect("is good").camera;
        let at = camera.to_world.translation;
        assert!(at.abs_diff_eq(glam::Vec3A::new(15.0, 0.0, 0.0), 1e-4), "{at}");
        assert!((camera.to_world.matrix3.determinant() - 1.0).abs() < 1e-5, "no scale is left");
        assert!((camera.focus - 15.0).abs() < 1.6 && camera.aperture > 0.0, "{camera:?}");
    }

    #[test]
    fn all_that_is_wrong_with_the_files_is_told() {
        let errors = build(
            r#"
            [camera]
            imported = "Can"
            [environment]
            type = "image"
            file = "i.jpg"
            [materials.a]
            type = "diffuse"
            [[model]]
            file = "bad.obj"
            [[model]]
            file = "bad.obj"
            [[model]]
            file = "a.glb"
            materials = { Pain = "a" }
            "#,
        )
        .expect_err("is wrong");
        let shown = render(&errors, false);
        for part in ["did you mean `Cam`?", "does not decode", "bad.obj#/meshes/0", "did you mean `Paint`?"] {
            assert!(shown.contains(part), "{part} is not in\n{shown}");
        }
        assert_eq!(errors.len(), 4, "{shown}");
    }

    #[test]
    fn darkness_is_warned_of() {
        let dark =
            build("[materials.a]\ntype = \"diffuse\"\n[[sphere]]\nmaterial = \"a\"\n").expect("is good");
        assert_eq!(dark.model.warnings.len(), 1);
        let lit = build("[environment]\ntype = \"color\"\n").expect("is good");
        assert!(lit.model.warnings.is_empty());
    }
}
