//! Numbers that are the same in every run.

/// In [0, 1): a hash of both (the finaliser of SplitMix64; Steele, Lea, Flood, OOPSLA 2014).
pub fn uniform(i: u32, k: u32) -> f32 {
    let mut x = ((i as u64) << 32 | k as u64).wrapping_add(0x9e37_79b9_7f4a_7c15);
    x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    ((x ^ (x >> 31)) >> 40) as f32 / (1u64 << 24) as f32
}
