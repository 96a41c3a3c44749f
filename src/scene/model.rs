//! `[[model]]`: an asset placed in the scene.

use glam::{Affine3A, Mat3, Quat, Vec3};

use super::{
    MaterialOverride, ModelSource,
    context::Context,
    path::ModelFile,
    primitive::MaterialName,
    read::Named,
    table::table,
    vector::{Scale, Triple},
};

table! {
    /// A glTF or OBJ file placed in the scene.
    struct Model {
        /// .glb, .gltf or .obj, relative to the scene file.
        file: ModelFile,
        /// Moved by this, metres, last.
        translate: Triple = Triple([0.0, 0.0, 0.0]),
        /// Turned about X, then Y, then Z, degrees, after scaling.
        rotate: Triple = Triple([0.0, 0.0, 0.0]),
        /// Scaled first: one factor, or one for each axis; negative ones mirror.
        scale: Scale = Scale::Uniform(1.0),
        /// A material for all of it.
        material: Option<MaterialName>,
        /// Materials in place of the model's own, by their names.
        materials: Named<MaterialName>,
    }
}

impl Model {
    pub fn resolve(self, cx: &mut Context) -> ModelSource {
        self.keys.exclusive(&["material", "materials"], cx);
        let [x, y, z] = self.rotate.0.map(f32::to_radians);
        let rotation = Quat::from_rotation_z(z) * Quat::from_rotation_y(y) * Quat::from_rotation_x(x);
        let linear = Mat3::from_quat(rotation) * Mat3::from_diagonal(self.scale.vec());
        if self.keys.sound(&["scale"]) && !invertible(linear) {
            cx.error(
                self.keys.value("scale"),
                "`scale` is too extreme: the model would lose all volume, or be infinite",
            );
        }
        let replacements = self.materials.0.into_iter();
        ModelSource {
            to_world: Affine3A::from_mat3_translation(linear, self.translate.vec()),
            material: self.material.map(|material| material.0),
            materials: replacements
                .map(|(name, material, at)| MaterialOverride {
                    name,
                    material: material.0,
                    place: cx.place(at),
                })
                .collect(),
            place: cx.place(self.keys.value("file")),
            file: self.file.0,
        }
    }
}

fn invertible(linear: Mat3) -> bool {
    let determinant = linear.determinant();
    determinant.is_normal() && linear.inverse().mul_vec3(Vec3::ONE).is_finite()
}
