//! Picking values with AVX2, eight at a time: its shuffle of eight lanes does in a quarter of the instructions what a
//! shuffle of their bytes does, which is what there is for every machine.

use fearless_simd::prelude::*;

use super::super::Half;
use super::simd::Row;

/// Reads eight and eight of `values`; whether they lie near enough for it, and the machine has AVX2.
#[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
#[inline(always)]
pub(super) fn pick<S: Simd>(simd: S, values: &[u32], halves: &Option<[Half; 2]>, bits: &mut Row<u32>) -> bool {
    use fearless_simd::u32x8;

    let (Some(avx2), Some(halves)) = (simd.level().as_avx2(), halves) else { return false };
    for (half, bits) in halves.iter().zip(bits.as_chunks_mut::<8>().0) {
        let lanes = |lanes: &[u32]| u32x8::from_slice(avx2, lanes);
        let (low, high) = values[half.from..half.from + 16].split_at(8);
        x86::of_sixteen(avx2, lanes(low), lanes(high), lanes(&half.places)).store_slice(bits);
    }
    true
}

#[cfg(not(any(target_arch = "x86", target_arch = "x86_64")))]
#[inline(always)]
pub(super) fn pick<S: Simd>(_: S, _: &[u32], _: &Option<[Half; 2]>, _: &mut Row<u32>) -> bool {
    false
}

#[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
mod x86 {
    #[cfg(target_arch = "x86")]
    use core::arch::x86::*;
    #[cfg(target_arch = "x86_64")]
    use core::arch::x86_64::*;

    use fearless_simd::prelude::*;
    use fearless_simd::u32x8;
    use fearless_simd::x86::Avx2;

    fearless_simd::kernel!(
        /// Those of sixteen lanes that `places` says.
        #[inline(always)]
        pub(super) fn of_sixteen(token: Avx2, low: u32x8<Avx2>, high: u32x8<Avx2>, places: u32x8<Avx2>) -> u32x8<Avx2> {
            let places: __m256i = places.into();
            let [low, high] =
                [low, high].map(|lanes| _mm256_castsi256_ps(_mm256_permutevar8x32_epi32(lanes.into(), places)));
            // Eight and more is the bit that becomes the sign.
            let which = _mm256_castsi256_ps(_mm256_slli_epi32::<28>(places));
            _mm256_castps_si256(_mm256_blendv_ps(low, high, which)).simd_into(token)
        }
    );
}
