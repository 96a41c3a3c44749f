//! Eight floats side by side: the one difference between the kernels. AVX2 where the processor has it, chosen at run
//! time; elsewhere plain arrays, which the compiler turns into whatever the target has.
//!
//! Comparisons with NaN are false, and `min`, `max` give their second operand where either is NaN, in both.

/// Number of lanes.
pub const WIDTH: usize = 8;

/// Bits of all lanes.
pub const ALL: u32 = (1 << WIDTH) - 1;

pub trait Lanes: Copy {
    type Mask: Copy;

    fn splat(x: f32) -> Self;
    fn load(x: &[f32; WIDTH]) -> Self;
    fn to_array(self) -> [f32; WIDTH];
    fn add(self, other: Self) -> Self;
    fn sub(self, other: Self) -> Self;
    fn mul(self, other: Self) -> Self;
    fn div(self, other: Self) -> Self;
    fn min(self, other: Self) -> Self;
    fn max(self, other: Self) -> Self;
    fn abs(self) -> Self;
    /// self · factor + term, in one rounding or two. For conservative bounds only: what is hit must not depend on it.
    fn mul_add(self, factor: Self, term: Self) -> Self;
    /// As `max` and `min` where neither is negative; otherwise `later` may be any of two negative ones, and so may `earlier`. (With
    /// AVX2 the bits are compared, as integers, in a quarter of the time.)
    fn later(self, other: Self) -> Self;
    fn earlier(self, other: Self) -> Self;
    /// Where self, which is not negative, is above `other` by more than so many units in the last place, about, or NaN: as bits.
    fn exceeds(self, other: Self, units: i32) -> u32;
    /// Of each lane its bits, above those of `low`.
    fn above(self, low: &[u32; WIDTH]) -> [u64; WIDTH];
    /// The items whose bits are set in `lanes`, from the last to the first, and then any.
    fn pack(items: &[u32; WIDTH], lanes: u32) -> [u32; WIDTH];
    fn le(self, other: Self) -> Self::Mask;
    fn lt(self, other: Self) -> Self::Mask;
    fn and(a: Self::Mask, b: Self::Mask) -> Self::Mask;
    fn or(a: Self::Mask, b: Self::Mask) -> Self::Mask;
    /// Lane i is bit i.
    fn bits(mask: Self::Mask) -> u32;
    /// Asks for the cache line of `address`, which need not be valid.
    fn prefetch(address: *const u8);
}

#[derive(Clone, Copy)]
#[repr(align(32))]
pub struct Portable([f32; WIDTH]);

impl Portable {
    #[inline(always)]
    fn zip(mut self, other: Self, f: impl Fn(f32, f32) -> f32) -> Self {
        for i in 0..WIDTH {
            self.0[i] = f(self.0[i], other.0[i]);
        }
        self
    }

    #[inline(always)]
    fn compare(self, other: Self, f: impl Fn(f32, f32) -> bool) -> u32 {
        let mut bits = 0;
        for i in 0..WIDTH {
            bits |= (f(self.0[i], other.0[i]) as u32) << i;
        }
        bits
    }
}

impl Lanes for Portable {
    type Mask = u32;

    #[inline(always)]
    fn splat(x: f32) -> Self {
        Self([x; WIDTH])
    }
    #[inline(always)]
    fn load(x: &[f32; WIDTH]) -> Self {
        Self(*x)
    }
    #[inline(always)]
    fn to_array(self) -> [f32; WIDTH] {
        self.0
    }
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        self.zip(other, |a, b| a + b)
    }
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        self.zip(other, |a, b| a - b)
    }
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        self.zip(other, |a, b| a * b)
    }
    #[inline(always)]
    fn div(self, other: Self) -> Self {
        self.zip(other, |a, b| a / b)
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        self.zip(other, |a, b| if a < b { a } else { b })
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        self.zip(other, |a, b| if a > b { a } else { b })
    }
    #[inline(always)]
    fn abs(mut self) -> Self {
        for x in &mut self.0 {
            *x = x.abs();
        }
        self
    }
    #[inline(always)]
    fn mul_add(self, factor: Self, term: Self) -> Self {
        self.mul(factor).add(term)
    }
    #[inline(always)]
    fn later(self, other: Self) -> Self {
        self.max(other)
    }
    #[inline(always)]
    fn earlier(self, other: Self) -> Self {
        self.min(other)
    }
    #[inline(always)]
    fn exceeds(self, other: Self, units: i32) -> u32 {
        let widened = other.mul(Self::splat(1.0 + units as f32 * (f32::EPSILON / 2.0)));
        self.le(widened) ^ ALL
    }
    #[inline(always)]
    fn above(self, low: &[u32; WIDTH]) -> [u64; WIDTH] {
        let mut out = [0; WIDTH];
        for i in 0..WIDTH {
            out[i] = (self.0[i].to_bits() as u64) << 32 | low[i] as u64;
        }
        out
    }
    #[inline(always)]
    fn pack(items: &[u32; WIDTH], lanes: u32) -> [u32; WIDTH] {
        let set = (0..WIDTH).rev().filter(|lane| lanes >> lane & 1 == 1);
        let mut out = [0; WIDTH];
        for (out, lane) in out.iter_mut().zip(set) {
            *out = items[lane];
        }
        out
    }
    #[inline(always)]
    fn le(self, other: Self) -> Self::Mask {
        self.compare(other, |a, b| a <= b)
    }
    #[inline(always)]
    fn lt(self, other: Self) -> Self::Mask {
        self.compare(other, |a, b| a < b)
    }
    #[inline(always)]
    fn and(a: Self::Mask, b: Self::Mask) -> Self::Mask {
        a & b
    }
    #[inline(always)]
    fn or(a: Self::Mask, b: Self::Mask) -> Self::Mask {
        a | b
    }
    #[inline(always)]
    fn bits(mask: Self::Mask) -> u32 {
        mask
    }
    #[inline(always)]
    fn prefetch(_: *const u8) {}
}

#[cfg(target_arch = "x86_64")]
pub use avx2::Avx2;

#[cfg(target_arch = "x86_64")]
mod avx2 {
    use std::arch::x86_64::*;

    use super::{Lanes, WIDTH};

    /// Only to be used inside a function compiled for what [`available`](Self::available) asks for, into which all of this
    /// is inlined.
    #[derive(Clone, Copy)]
    pub struct Avx2(__m256);

    /// Of each set of lanes, which they are, from the last to the first.
    static PACKED: [[u8; WIDTH]; 256] = {
        let mut table = [[0; WIDTH]; 256];
        let mut lanes = 0;
        while lanes < 256 {
            let (mut lane, mut count) = (WIDTH, 0);
            while lane > 0 {
                lane -= 1;
                if lanes >> lane & 1 == 1 {
                    table[lanes][count] = lane as u8;
                    count += 1;
                }
            }
            lanes += 1;
        }
        table
    };

    impl Avx2 {
        /// Whether this processor has everything the kernel is compiled for.
        pub fn available() -> bool {
            is_x86_feature_detected!("avx2")
                && is_x86_feature_detected!("fma")
                && is_x86_feature_detected!("bmi1")
                && is_x86_feature_detected!("bmi2")
                && is_x86_feature_detected!("lzcnt")
                && is_x86_feature_detected!("popcnt")
        }

        #[inline(always)]
        fn integers(self) -> __m256i {
            // SAFETY: as below.
            unsafe { _mm256_castps_si256(self.0) }
        }
    }

    // SAFETY, for all of these: the instructions exist, since `Avx2` is named only by the kernel that runs when
    // `Avx2::available` is true. Loads and stores go through references to arrays of the right size.
    impl Lanes for Avx2 {
        type Mask = __m256;

        #[inline(always)]
        fn splat(x: f32) -> Self {
            Self(unsafe { _mm256_set1_ps(x) })
        }
        #[inline(always)]
        fn load(x: &[f32; WIDTH]) -> Self {
            Self(unsafe { _mm256_loadu_ps(x.as_ptr()) })
        }
        #[inline(always)]
        fn to_array(self) -> [f32; WIDTH] {
            let mut out = [0.0; WIDTH];
            unsafe { _mm256_storeu_ps(out.as_mut_ptr(), self.0) };
            out
        }
        #[inline(always)]
        fn add(self, other: Self) -> Self {
            Self(unsafe { _mm256_add_ps(self.0, other.0) })
        }
        #[inline(always)]
        fn sub(self, other: Self) -> Self {
            Self(unsafe { _mm256_sub_ps(self.0, other.0) })
        }
        #[inline(always)]
        fn mul(self, other: Self) -> Self {
            Self(unsafe { _mm256_mul_ps(self.0, other.0) })
        }
        #[inline(always)]
        fn div(self, other: Self) -> Self {
            Self(unsafe { _mm256_div_ps(self.0, other.0) })
        }
        #[inline(always)]
        fn min(self, other: Self) -> Self {
            Self(unsafe { _mm256_min_ps(self.0, other.0) })
        }
        #[inline(always)]
        fn max(self, other: Self) -> Self {
            Self(unsafe { _mm256_max_ps(self.0, other.0) })
        }
        #[inline(always)]
        fn abs(self) -> Self {
            Self(unsafe { _mm256_andnot_ps(_mm256_set1_ps(-0.0), self.0) })
        }
        #[inline(always)]
        fn mul_add(self, factor: Self, term: Self) -> Self {
            Self(unsafe { _mm256_fmadd_ps(self.0, factor.0, term.0) })
        }
        #[inline(always)]
        fn later(self, other: Self) -> Self {
            Self(unsafe { _mm256_castsi256_ps(_mm256_max_epi32(self.integers(), other.integers())) })
        }
        #[inline(always)]
        fn earlier(self, other: Self) -> Self {
            Self(unsafe { _mm256_castsi256_ps(_mm256_min_epi32(self.integers(), other.integers())) })
        }
        #[inline(always)]
        fn exceeds(self, other: Self, units: i32) -> u32 {
            unsafe {
                let other = _mm256_add_epi32(other.integers(), _mm256_set1_epi32(units));
                _mm256_movemask_ps(_mm256_castsi256_ps(_mm256_cmpgt_epi32(self.integers(), other))) as u32
            }
        }
        #[inline(always)]
        fn above(self, low: &[u32; WIDTH]) -> [u64; WIDTH] {
            let mut out = [0; WIDTH];
            unsafe {
                let (low, high) = (_mm256_loadu_si256(low.as_ptr().cast()), self.integers());
                let (a, b) = (_mm256_unpacklo_epi32(low, high), _mm256_unpackhi_epi32(low, high));
                _mm256_storeu_si256(out.as_mut_ptr().cast(), _mm256_permute2x128_si256::<0x20>(a, b));
                _mm256_storeu_si256(out[4..].as_mut_ptr().cast(), _mm256_permute2x128_si256::<0x31>(a, b));
            }
            out
        }
        #[inline(always)]
        fn pack(items: &[u32; WIDTH], lanes: u32) -> [u32; WIDTH] {
            let mut out = [0; WIDTH];
            unsafe {
                let from = _mm_loadl_epi64((&raw const PACKED[lanes as usize & 255]).cast());
                let items = _mm256_loadu_si256(items.as_ptr().cast());
                let packed = _mm256_permutevar8x32_epi32(items, _mm256_cvtepu8_epi32(from));
                _mm256_storeu_si256(out.as_mut_ptr().cast(), packed);
            }
            out
        }
        #[inline(always)]
        fn le(self, other: Self) -> Self::Mask {
            unsafe { _mm256_cmp_ps::<_CMP_LE_OQ>(self.0, other.0) }
        }
        #[inline(always)]
        fn lt(self, other: Self) -> Self::Mask {
            unsafe { _mm256_cmp_ps::<_CMP_LT_OQ>(self.0, other.0) }
        }
        #[inline(always)]
        fn and(a: Self::Mask, b: Self::Mask) -> Self::Mask {
            unsafe { _mm256_and_ps(a, b) }
        }
        #[inline(always)]
        fn or(a: Self::Mask, b: Self::Mask) -> Self::Mask {
            unsafe { _mm256_or_ps(a, b) }
        }
        #[inline(always)]
        fn bits(mask: Self::Mask) -> u32 {
            unsafe { _mm256_movemask_ps(mask) as u32 }
        }
        #[inline(always)]
        fn prefetch(address: *const u8) {
            // SAFETY: a prefetch of any address is harmless.
            unsafe { _mm_prefetch::<_MM_HINT_T0>(address.cast()) }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pack_of<L: Lanes>() {
        let items = std::array::from_fn(|i| 10 + i as u32);
        for lanes in 0..=ALL {
            let set = (0..WIDTH).rev().filter(|i| lanes >> i & 1 == 1).map(|i| items[i]);
            let packed = L::pack(&items, lanes);
            assert!(packed.into_iter().take(lanes.count_ones() as usize).eq(set), "{lanes:b}: {packed:?}");
        }
    }

    #[test]
    fn packs_every_set_of_lanes() {
        pack_of::<Portable>();
        #[cfg(target_arch = "x86_64")]
        if Avx2::available() {
            pack_of::<Avx2>();
        }
    }
}
