//! Sixteen lanes on whatever vectors the machine has.
//!
//! Lanes never mix, so that a lane's bits do not depend on how many of them one instruction takes. Everything that
//! computes here is `inline(always)`, up to the [`with_widest`] that chooses the instructions: only then can vectors stay
//! in registers. What stands in one is compiled once for each set of instructions, so there are few, none in a loop over
//! lanes.

use fearless_simd::Level;
use fearless_simd::prelude::*;

/// Runs an expression with the widest instructions of `level`, which `simd` stands for. On x86 these are AVX-512, AVX2 and
/// what every processor has: sets in between would cost their compilation and gain little.
macro_rules! with_widest {
    ($level:expr, $simd:ident => $run:expr) => {{
        #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
        {
            use fearless_simd::Simd as _;
            let level = $level;
            if let Some($simd) = level.as_avx512() {
                $simd.vectorize(#[inline(always)] || $run)
            } else if let Some($simd) = level.as_avx2() {
                $simd.vectorize(#[inline(always)] || $run)
            } else if let Some($simd) = level.as_sse2() {
                $simd.vectorize(#[inline(always)] || $run)
            } else {
                unreachable!("a processor without SSE2 runs nothing that this was compiled to")
            }
        }
        #[cfg(not(any(target_arch = "x86", target_arch = "x86_64")))]
        fearless_simd::dispatch!($level, $simd => $run)
    }};
}
pub(crate) use with_widest;

/// Whether a machine with the instructions of `level` keeps values coming where rows of sixteen frames are read side by side,
/// each in another page. Of two machines that were measured the one with AVX-512 does: recordings of 12,000 and of 10⁵ taxels
/// took 0.6 and 0.5 times as long. The one without waited for memory a third of the time.
pub(super) fn reads_rows_abreast(level: Level) -> bool {
    #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
    return level.as_avx512().is_some();
    #[cfg(not(any(target_arch = "x86", target_arch = "x86_64")))]
    {
        let _ = level;
        false
    }
}

/// Lanes side by side.
pub(super) const LANES: usize = 16;

/// As many lanes as one instruction takes.
pub(super) type F<S> = <S as Simd>::f32s;
/// The same of integers.
pub(super) type U<S> = <S as Simd>::u32s;
/// The same of whole numbers of either sign.
pub(super) type I<S> = <S as Simd>::i32s;
/// The same of decisions.
pub(super) type M<S> = <S as Simd>::mask32s;

/// One value a lane.
pub(super) type Row<T> = [T; LANES];

/// How many lanes one instruction takes; it divides [`LANES`].
#[inline(always)]
pub(super) const fn width<S: Simd>() -> usize {
    <F<S> as SimdBase<S>>::LEN
}

/// The lanes from `at` on.
#[inline(always)]
pub(super) fn load<S: Simd>(simd: S, row: &Row<f32>, at: usize) -> F<S> {
    F::<S>::from_slice(simd, &row[at..at + width::<S>()])
}

#[inline(always)]
pub(super) fn store<S: Simd>(_: S, lanes: F<S>, row: &mut Row<f32>, at: usize) {
    lanes.store_slice(&mut row[at..at + width::<S>()]);
}

#[inline(always)]
pub(super) fn load_u<S: Simd>(simd: S, row: &Row<u32>, at: usize) -> U<S> {
    U::<S>::from_slice(simd, &row[at..at + width::<S>()])
}

#[inline(always)]
pub(super) fn store_u<S: Simd>(_: S, lanes: U<S>, row: &mut Row<u32>, at: usize) {
    lanes.store_slice(&mut row[at..at + width::<S>()]);
}

#[inline(always)]
pub(super) fn splat<S: Simd>(simd: S, value: f32) -> F<S> {
    F::<S>::splat(simd, value)
}

#[inline(always)]
pub(super) fn splat_u<S: Simd>(simd: S, value: u32) -> U<S> {
    U::<S>::splat(simd, value)
}

/// `bits` where `mask` holds, 0 elsewhere.
#[inline(always)]
pub(super) fn bits_where<S: Simd>(simd: S, mask: M<S>, bits: u32) -> U<S> {
    mask.select(splat_u(simd, bits), splat_u(simd, 0))
}

/// Has the cache fetch the line that `value` begins in, if there is such a thing, to be read or written soon. A core that
/// writes to memory waits for what was there before, too: a tenth of a batch's time.
#[inline(always)]
pub(super) fn soon_needed<T>(value: *const T) {
    fetch::<T, true>(value);
}

/// The same into the next larger cache, for what is needed later.
#[inline(always)]
pub(super) fn later_needed<T>(value: *const T) {
    fetch::<T, false>(value);
}

#[inline(always)]
#[cfg_attr(target_arch = "x86_64", expect(unsafe_code, reason = "there is no safe word for it"))]
fn fetch<T, const SOON: bool>(value: *const T) {
    #[cfg(target_arch = "x86_64")]
    // SAFETY: a hint reads and writes nothing, wherever it points.
    unsafe {
        use core::arch::x86_64::{_MM_HINT_T0, _MM_HINT_T1, _mm_prefetch};
        if SOON { _mm_prefetch::<_MM_HINT_T0>(value.cast()) } else { _mm_prefetch::<_MM_HINT_T1>(value.cast()) }
    }
    #[cfg(not(target_arch = "x86_64"))]
    let _ = value;
}
