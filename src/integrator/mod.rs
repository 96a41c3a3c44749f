//! Stub.

#[derive(Default, Clone, Copy, Debug)]
pub struct RayCounts {
    pub camera: u64,
    pub bounce: u64,
    pub shadow: u64,
}

pub fn sample_pixel(
    _scene: &crate::compile::Scene,
    x: u32,
    y: u32,
    index: u32,
    counts: &mut RayCounts,
) -> glam::Vec3 {
    counts.camera += 1;
    let mut h = (x as u64) << 40 ^ (y as u64) << 20 ^ index as u64;
    for _ in 0..100 {
        h = (h ^ (h >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9).wrapping_add(0x9e37_79b9_7f4a_7c15);
    }
    glam::Vec3::splat((h >> 40) as f32 / (1u64 << 24) as f32)
}
