//! `[[model]]`: an asset placed in the scene.

use glam::{Affine3A, Mat3, Quat, Vec3};

use super::{
    MaterialOverride, ModelSource, Selection,
    context::Context,
    path::ModelFile,
    primitive::MaterialName,
    read::Named,
    selection::Pick,
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
        /// The scene of a glTF file that is shown, by name or number; without it, the file's own choice.
        scene: Option<Pick>,
        /// The variant of a glTF file's materials, by name or number; without it, the materials as they are.
        variant: Option<Pick>,
        /// The animation that is shown, by name or number; without it, the first if there is `at`, or else the pose at rest.
        animation: Option<Pick>,
        /// The moment of the animation, seconds; 0 where only `animation` is given.
        at: Option<f32>,
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
        let obj = self.file.0.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("obj"));
        if let Some(key) = self.keys.first(&["scene", "variant", "animation", "at"]).filter(|_| obj) {
            cx.error(
                self.keys.key(key),
                format!("`{key}` goes with glTF files: an OBJ file has no such thing"),
            )
            .help("leave it out");
        }
        let text = |pick: Option<Pick>| pick.map(|pick| pick.0);
        let replacements = self.materials.0.into_iter();
        ModelSource {
            selection: Selection {
                scene: text(self.scene),
                variant: text(self.variant),
                animation: text(self.animation),
                at: self.at,
            },
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
