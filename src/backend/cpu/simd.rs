//! Sixteen lanes on whatever vectors the machine has.
//!
//! Lanes never mix, so that a lane's bits do not depend on how many of them one instruction takes. Everything that
//! computes here is `inline(always)`, up to the [`with_widest`] that chooses the instructions: only then can vectors stay
//! in registers. What stands in one is compiled once for each set of instructions, so there are few, none in a loop over
//! lanes.

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
