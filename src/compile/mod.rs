//! Stub.

#[derive(Clone, Debug, Default)]
pub struct SceneStats {
    pub triangles: u64,
    pub instances: u64,
    pub meshes: u64,
    pub spheres: u64,
    pub quads: u64,
    pub lights: u64,
    pub materials: u64,
    pub textures: u64,
    pub bvh_seconds: f64,
    pub bvh_bytes: u64,
    pub geometry_bytes: u64,
    pub texture_bytes: u64,
    pub triangles_set_aside: u64,
}

pub struct Scene {
    pub stats: SceneStats,
}

pub fn compile(_world: crate::world::World, _settings: &crate::render::Settings) -> Scene {
    Scene { stats: SceneStats::default() }
}
