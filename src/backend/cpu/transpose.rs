//! Rows turned into columns, sixteen by sixteen: lane j of row i becomes lane i of column j.
//!
//! Where there are instructions for it, four columns are made of quarters of all rows: rows j, j + 4, j + 8 and j + 12 are
//! loaded side by side, a quarter each, which takes no shuffle; then the four vectors for j = 0 … 3 are turned four by four
//! within their quarters. That is half the shuffles of AVX-512, of which a core does one at a time, and a quarter of AVX2's.

use fearless_simd::prelude::*;
use fearless_simd::{u32x4, u32x16};

use super::simd::{LANES, Row};

/// Takes columns, one after the other.
pub(super) trait Columns {
    fn put<S: Simd>(&mut self, simd: S, column: usize, lanes: u32x16<S>);
}

impl Columns for [Row<u32>] {
    #[inline(always)]
    fn put<S: Simd>(&mut self, _: S, column: usize, lanes: u32x16<S>) {
        lanes.store_slice(&mut self[column]);
    }
}

/// Turns the rows that `row` gives.
#[inline(always)]
pub(super) fn transpose<'a, S: Simd>(
    simd: S,
    row: impl Fn(usize) -> &'a Row<u32>,
    columns: &mut (impl Columns + ?Sized),
) {
    #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
    {
        // Written out, so that where quarters lie is known where they are loaded, and none takes a detour through memory.
        macro_rules! by_quarters {
            ($simd:ident, $side_by_side:path, $turn:path, $($first:literal),*) => {$({
                macro_rules! quarter {
                    ($i:expr) => { u32x4::from_slice($simd, &row($i)[$first..$first + 4]) };
                }
                macro_rules! quarters {
                    ($i:expr) => {
                        $side_by_side($simd, quarter!($i), quarter!($i + 4), quarter!($i + 8), quarter!($i + 12))
                    };
                }
                let [a, b, c, d] = $turn($simd, quarters!(0), quarters!(1), quarters!(2), quarters!(3));
                columns.put($simd, $first, a);
                columns.put($simd, $first + 1, b);
                columns.put($simd, $first + 2, c);
                columns.put($simd, $first + 3, d);
            })*};
        }
        let level = simd.level();
        if let Some(avx512) = level.as_avx512() {
            by_quarters!(avx512, x86::side_by_side_512, x86::turn_512, 0, 4, 8, 12);
            return;
        } else if let Some(avx2) = level.as_avx2() {
            by_quarters!(avx2, x86::side_by_side_256, x86::turn_256, 0, 4, 8, 12);
            return;
        }
    }
    by_shuffles(simd, row, columns);
}

/// The same on any machine: four perfect shuffles.
#[inline(always)]
fn by_shuffles<'a, S: Simd>(simd: S, row: impl Fn(usize) -> &'a Row<u32>, columns: &mut (impl Columns + ?Sized)) {
    let mut now = [u32x16::splat(simd, 0); LANES];
    let mut i = 0;
    while i < LANES {
        now[i] = u32x16::from_slice(simd, row(i));
        i += 1;
    }
    let mut round = 0;
    while round < 4 {
        let before = now;
        let mut i = 0;
        while i < LANES / 2 {
            (now[2 * i], now[2 * i + 1]) = before[i].interleave(before[i + LANES / 2]);
            i += 1;
        }
        round += 1;
    }
    let mut i = 0;
    while i < LANES {
        columns.put(simd, i, now[i]);
        i += 1;
    }
}

#[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
mod x86 {
    #[cfg(target_arch = "x86")]
    use core::arch::x86::*;
    #[cfg(target_arch = "x86_64")]
    use core::arch::x86_64::*;

    use fearless_simd::prelude::*;
    use fearless_simd::x86::{Avx2, Avx512};
    use fearless_simd::{u32x4, u32x8, u32x16};

    fearless_simd::kernel!(
        /// Quarters as one.
        #[inline(always)]
        pub(super) fn side_by_side_512(
            token: Avx512,
            a: u32x4<Avx512>,
            b: u32x4<Avx512>,
            c: u32x4<Avx512>,
            d: u32x4<Avx512>,
        ) -> u32x16<Avx512> {
            let two = _mm512_inserti32x4::<1>(_mm512_castsi128_si512(a.into()), b.into());
            _mm512_inserti32x4::<3>(_mm512_inserti32x4::<2>(two, c.into()), d.into()).simd_into(token)
        }
    );

    fearless_simd::kernel!(
        /// Within each quarter, rows turned into columns.
        #[inline(always)]
        pub(super) fn turn_512(
            token: Avx512,
            a: u32x16<Avx512>,
            b: u32x16<Avx512>,
            c: u32x16<Avx512>,
            d: u32x16<Avx512>,
        ) -> [u32x16<Avx512>; 4] {
            let (a, b, c, d) = (a.into(), b.into(), c.into(), d.into());
            let (low, next_low) = (_mm512_unpacklo_epi32(a, b), _mm512_unpacklo_epi32(c, d));
            let (high, next_high) = (_mm512_unpackhi_epi32(a, b), _mm512_unpackhi_epi32(c, d));
            [
                _mm512_unpacklo_epi64(low, next_low).simd_into(token),
                _mm512_unpackhi_epi64(low, next_low).simd_into(token),
                _mm512_unpacklo_epi64(high, next_high).simd_into(token),
                _mm512_unpackhi_epi64(high, next_high).simd_into(token),
            ]
        }
    );

    fearless_simd::kernel!(
        /// Quarters as one.
        #[inline(always)]
        pub(super) fn side_by_side_256(
            token: Avx2,
            a: u32x4<Avx2>,
            b: u32x4<Avx2>,
            c: u32x4<Avx2>,
            d: u32x4<Avx2>,
        ) -> u32x16<Avx2> {
            let low = _mm256_inserti128_si256::<1>(_mm256_castsi128_si256(a.into()), b.into());
            let high = _mm256_inserti128_si256::<1>(_mm256_castsi128_si256(c.into()), d.into());
            let [low, high]: [u32x8<Avx2>; 2] = [low.simd_into(token), high.simd_into(token)];
            low.combine(high)
        }
    );

    fearless_simd::kernel!(
        /// Within each quarter, rows turned into columns.
        #[inline(always)]
        pub(super) fn turn_256(
            token: Avx2,
            a: u32x16<Avx2>,
            b: u32x16<Avx2>,
            c: u32x16<Avx2>,
            d: u32x16<Avx2>,
        ) -> [u32x16<Avx2>; 4] {
            let half = |[a, b, c, d]: [__m256i; 4]| -> [u32x8<Avx2>; 4] {
                let (low, next_low) = (_mm256_unpacklo_epi32(a, b), _mm256_unpacklo_epi32(c, d));
                let (high, next_high) = (_mm256_unpackhi_epi32(a, b), _mm256_unpackhi_epi32(c, d));
                [
                    _mm256_unpacklo_epi64(low, next_low).simd_into(token),
                    _mm256_unpackhi_epi64(low, next_low).simd_into(token),
                    _mm256_unpacklo_epi64(high, next_high).simd_into(token),
                    _mm256_unpackhi_epi64(high, next_high).simd_into(token),
                ]
            };
            let [(a, a_high), (b, b_high), (c, c_high), (d, d_high)] = [a.split(), b.split(), c.split(), d.split()];
            let low = half([a.into(), b.into(), c.into(), d.into()]);
            let high = half([a_high.into(), b_high.into(), c_high.into(), d_high.into()]);
            [low[0].combine(high[0]), low[1].combine(high[1]), low[2].combine(high[2]), low[3].combine(high[3])]
        }
    );
}

#[cfg(test)]
mod tests {
    use fearless_simd::Level;

    use super::super::simd::with_widest;
    use super::super::tests::levels;
    use super::*;

    #[test]
    fn every_lane_finds_its_place() {
        let rows: [Row<u32>; LANES] = std::array::from_fn(|row| std::array::from_fn(|lane| (row * 100 + lane) as u32));
        for level in levels() {
            let mut columns = [[0; LANES]; LANES];
            with_widest!(level, simd => transpose(simd, |row| &rows[row], &mut columns[..]));
            let mut by_shuffles = [[0; LANES]; LANES];
            with_widest!(Level::new(), simd => super::by_shuffles(simd, |row| &rows[row], &mut by_shuffles[..]));
            for (column, lanes) in columns.iter().enumerate() {
                assert_eq!(lanes, &std::array::from_fn(|row| rows[row][column]), "{level:?}");
            }
            assert_eq!(columns, by_shuffles);
        }
    }
}
