//! The whole file: its sections, and how they become a [`ValidScene`].

use super::{
    CameraSource, ValidScene,
    camera::Camera,
    context::Context,
    environment::Environment,
    light::{Light, Lights},
    material::Material,
    model::Model,
    output::Output,
    primitive::{Quad, Sphere},
    read::{Named, Value},
    render::Render,
    table::table,
};
use crate::world::MaterialId;

table! {
    /// A scene of rayo: lengths in metres, angles in degrees, +Y up, colours in linear Rec.709.
    struct Document {
        /// How the picture is made.
        render: Option<Render>,
        /// From where the scene is seen.
        camera: Option<Camera>,
        /// Light from infinitely far away.
        environment: Option<Environment>,
        /// What surfaces do with light, by name.
        materials: Named<Material>,
        /// Spheres.
        sphere: Vec<Sphere>,
        /// Parallelograms.
        quad: Vec<Quad>,
        /// glTF and OBJ files.
        model: Vec<Model>,
        /// Lights.
        light: Vec<Light>,
        /// The file that is written.
        output: Option<Output>,
    }
}

impl Document {
    /// Reads what the sections mean. What is wrong is found in `cx`; the scene is only of use where nothing is.
    pub fn read_scene(value: &Value, cx: &mut Context) -> Option<ValidScene> {
        cx.materials = material_names(value);
        <Self as super::read::Read>::read(value, cx)?.resolve(cx)
    }

    fn resolve(self, cx: &mut Context) -> Option<ValidScene> {
        let render = self.render.or_else(|| Render::absent(cx))?.resolve(cx);
        let output = self.output.or_else(|| Output::absent(cx))?.resolve(cx);
        let camera = self.camera.or_else(|| Camera::absent(cx))?.resolve(cx);
        let environment = self.environment.map(|environment| environment.resolve(cx));
        let mut materials: Vec<crate::world::Material> =
            self.materials.0.into_iter().map(|(name, material, _)| material.resolve(&name, cx)).collect();
        let mut spheres: Vec<_> = self.sphere.into_iter().map(Sphere::resolve).collect();
        let mut quads: Vec<_> = self.quad.into_iter().map(|quad| quad.resolve(cx)).collect();
        let models: Vec<_> = self.model.into_iter().map(|model| model.resolve(cx)).collect();
        let mut lights = Lights::default();
        for (i, light) in self.light.into_iter().enumerate() {
            lights.add(light, i + 1, &mut materials, cx);
        }
        spheres.append(&mut lights.spheres);
        quads.append(&mut lights.quads);
        if let CameraSource::Imported { place: crate::diagnostic::Place::Span { range, .. }, .. } = &camera
            && models.is_empty()
            && !self.keys.given("model")
            && self.keys.sound(&["model"])
        {
            cx.absent(range.clone(), "there is no [[model]] whose camera could be used");
        }
        Some(ValidScene {
            file: cx.file().to_owned(),
            render,
            output,
            camera,
            environment,
            materials,
            images: std::mem::take(&mut cx.images),
            spheres,
            quads,
            models,
            lights: lights.punctual,
            warnings: Vec::new(),
        })
    }
}

/// The handle of every material is its place in the file, known before what refers to it is read.
fn material_names(document: &Value) -> std::collections::BTreeMap<String, MaterialId> {
    let Some(table) = document.get_ref().get("materials").and_then(|value| value.get_ref().as_table()) else {
        return Default::default();
    };
    let mut names: Vec<_> = table.keys().collect();
    names.sort_by_key(|name| name.span().start);
    names.iter().enumerate().map(|(i, name)| (name.get_ref().to_string(), MaterialId(i as u32))).collect()
}
