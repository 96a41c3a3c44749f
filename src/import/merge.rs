//! Several models in one: handles are shifted by what was there before.

use glam::{Affine3A, Mat3A};

use crate::world::{
    Camera, Environment, EnvironmentKind, Light, Material, MaterialId, MeshId, Model, TextureId,
};

/// Where the parts of a model begin in the model it was appended to.
#[derive(Clone, Copy, Debug)]
pub(super) struct Offsets {
    meshes: u32,
    materials: u32,
}

impl Offsets {
    pub fn mesh(self, id: MeshId) -> MeshId {
        MeshId(id.0 + self.meshes)
    }

    pub fn material(self, id: MaterialId) -> MaterialId {
        MaterialId(id.0 + self.materials)
    }
}

/// Moves meshes, images, textures, materials, warnings and sources of `part` into `whole`. Instances, lights and cameras stay:
/// they are placed, possibly several times; so does the surrounding.
pub(super) fn append(whole: &mut Model, part: &mut Model) -> Offsets {
    let offsets = Offsets { meshes: whole.meshes.len() as u32, materials: whole.materials.len() as u32 };
    let (images, textures) = (whole.images.len() as u32, whole.textures.len() as u32);
    for texture in &mut part.textures {
        texture.image.0 += images;
    }
    for material in &mut part.materials {
        shift_textures(material, textures);
    }
    if let Some(Environment { kind: EnvironmentKind::Image { image, .. }, .. }) = &mut part.environment {
        image.0 += images;
    }
    whole.meshes.append(&mut part.meshes);
    whole.images.append(&mut part.images);
    whole.textures.append(&mut part.textures);
    // The names are still asked for.
    whole.materials.extend(part.materials.iter().cloned());
    whole.warnings.append(&mut part.warnings);
    whole.sources.append(&mut part.sources);
    offsets
}

/// Adds `by` to every texture that `material` looks up.
fn shift_textures(material: &mut Material, by: u32) {
    material.for_each_texture(&mut |reference| reference.texture = TextureId(reference.texture.0 + by));
}

/// `light` of a model that is placed by `to_world`. Its strength is not scaled: it is in W/sr or W/m².
pub(super) fn place_light(light: &Light, to_world: Affine3A) -> Light {
    let point = |p: glam::Vec3| to_world.transform_point3(p);
    let direction = |d: glam::Vec3| to_world.transform_vector3(d).normalize_or(d);
    let mut light = light.clone();
    match &mut light {
        Light::Point { position, .. } => *position = point(*position),
        Light::Spot { position, direction: axis, .. } => {
            *position = point(*position);
            *axis = direction(*axis);
        }
        Light::Sun { direction: way, .. } => *way = direction(*way),
    }
    light
}

/// `camera` of a model that is placed by `to_world`: scale and mirroring are left behind.
pub(super) fn place_camera(camera: &Camera, to_world: Affine3A) -> Camera {
    let placed = to_world * camera.to_world;
    let back = placed.matrix3.z_axis.normalize_or(glam::Vec3A::Z);
    let up = placed.matrix3.y_axis;
    let right = up.cross(back).normalize_or(back.any_orthonormal_vector());
    let matrix3 = Mat3A::from_cols(right, back.cross(right), back);
    Camera { to_world: Affine3A { matrix3, translation: placed.translation }, ..camera.clone() }
}
