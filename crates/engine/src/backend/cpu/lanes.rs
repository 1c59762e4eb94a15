//! Sixteen lanes on whatever vectors the machine has: rows, their transposition and angles.
//!
//! Lanes never mix, so that a lane's bits do not depend on how many of them one instruction takes. Everything that
//! computes here is `inline(always)`, up to the [`with_widest`] that chooses the instructions: only then can vectors stay
//! in registers. What stands in one is compiled once for each set of instructions, so there are few, none in a loop over
//! lanes.

use std::f32::consts::{FRAC_PI_2, PI};
use std::ops::{Deref, DerefMut};

use fearless_simd::prelude::*;
use fearless_simd::{u32x4, u32x16};

use crate::stage::angle::ATAN;

/// Runs an expression with the widest instructions of `level`, which `simd` stands for. On x86 these are AVX-512, AVX2 and
/// what every processor has: sets in between would cost their compilation and gain little.
macro_rules! with_widest {
    ($level:expr, $simd:ident => $run:expr) => {{
        #[cfg(target_arch = "x86_64")]
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
        #[cfg(not(target_arch = "x86_64"))]
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

/// Bytes of a cache line.
const LINE: usize = 64;

/// Something small that begins with a cache line.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
pub(super) struct Aligned<T>(pub(super) T);

/// Rows one after the other; the first begins with a cache line.
#[derive(Debug)]
pub(super) struct Lines<T> {
    memory: Vec<T>,
    first: usize,
    rows: usize,
}

impl<T: Copy> Lines<T> {
    /// `rows` rows of `value`s.
    pub(super) fn new(rows: usize, value: T) -> Self {
        let spare = LINE / size_of::<T>();
        let memory = vec![value; rows * LANES + spare];
        let first = memory.as_ptr().align_offset(LINE).min(spare);
        Self { memory, first, rows }
    }
}

impl<T: Copy> Default for Lines<T> {
    fn default() -> Self {
        Self { memory: Vec::new(), first: 0, rows: 0 }
    }
}

impl<T: Copy> FromIterator<Row<T>> for Lines<T> {
    fn from_iter<I: IntoIterator<Item = Row<T>>>(rows: I) -> Self {
        let rows: Vec<Row<T>> = rows.into_iter().collect();
        let Some(&[value, ..]) = rows.first() else { return Self::default() };
        let mut lines = Self::new(rows.len(), value);
        lines.copy_from_slice(&rows);
        lines
    }
}

impl<T: Copy> Clone for Lines<T> {
    fn clone(&self) -> Self {
        self.iter().copied().collect()
    }
}

impl<T> Deref for Lines<T> {
    type Target = [Row<T>];

    fn deref(&self) -> &[Row<T>] {
        self.memory[self.first..][..self.rows * LANES].as_chunks().0
    }
}

impl<T> DerefMut for Lines<T> {
    fn deref_mut(&mut self) -> &mut [Row<T>] {
        self.memory[self.first..][..self.rows * LANES].as_chunks_mut().0
    }
}

/// The angle of the line along (x, y), in [0, π); not a number where both are 0.
#[inline(always)]
pub(super) fn of_line<S: Simd>(simd: S, x: F<S>, y: F<S>) -> F<S> {
    let turned = up_to_pi(simd, x, y);
    turned.simd_ge(splat(simd, PI)).select(splat(simd, 0.0), turned)
}

/// The same, where a line that leans to the left by too little to tell may have π.
#[inline(always)]
fn up_to_pi<S: Simd>(simd: S, x: F<S>, y: F<S>) -> F<S> {
    let (wide, tall) = (x.abs(), y.abs());
    let a = wide.min(tall) / wide.max(tall);
    let z = a * a;
    let pair = |k: usize| splat(simd, ATAN[k]) + splat(simd, ATAN[k + 1]) * z;
    let z2 = z * z;
    let z4 = z2 * z2;
    let q = (pair(0) + pair(2) * z2) + (pair(4) + pair(6) * z2) * z4 + splat(simd, ATAN[8]) * (z4 * z4);
    let octant = a + (a * z) * q;
    let quadrant = tall.simd_gt(wide).select(splat(simd, FRAC_PI_2) - octant, octant);
    // The signs alone tell which way it leans: where one of the two is 0, both ways are the same line.
    let leans_left = (x.bitcast::<I<S>>() ^ y.bitcast::<I<S>>()).simd_lt(I::<S>::splat(simd, 0));
    leans_left.select(splat(simd, PI) - quadrant, quadrant)
}

/// The direction of (x, y), in (−π, π]; not a number where both are 0.
#[inline(always)]
pub(super) fn of_direction<S: Simd>(simd: S, x: F<S>, y: F<S>) -> F<S> {
    // Above the axis a direction is a line. The largest number under π: f32's own π is above it.
    let size = up_to_pi(simd, x, y.abs()).min(splat(simd, 3.141_592_5));
    y.simd_lt(splat(simd, 0.0)).select(-size, size)
}

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
    #[cfg(target_arch = "x86_64")]
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

#[cfg(target_arch = "x86_64")]
pub(super) mod x86 {
    use core::arch::x86_64::*;

    use fearless_simd::prelude::*;
    use fearless_simd::x86::{Avx2, Avx512};
    use fearless_simd::{u8x16, u32x4, u32x8, u32x16};

    fearless_simd::kernel!(
        /// Quarters as one.
        #[inline(always)]
        pub fn side_by_side_512(
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
        pub fn turn_512(
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
        pub fn side_by_side_256(
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
        pub fn turn_256(
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

    fearless_simd::kernel!(
        /// `places` as lanes.
        #[inline(always)]
        pub fn in_32(token: Avx512, places: u8x16<Avx512>) -> u32x16<Avx512> {
            _mm512_cvtepu8_epi32(places.into()).simd_into(token)
        }
    );

    fearless_simd::kernel!(
        /// The values at `places` among 32 lanes.
        #[inline(always)]
        pub fn of_32(
            token: Avx512,
            low: u32x16<Avx512>,
            high: u32x16<Avx512>,
            places: u32x16<Avx512>,
        ) -> u32x16<Avx512> {
            _mm512_permutex2var_epi32(low.into(), places.into(), high.into()).simd_into(token)
        }
    );

    fearless_simd::kernel!(
        /// `places`, which count from `start` places before sixteen lanes, as lanes that count from the first of these.
        #[inline(always)]
        pub fn in_sixteen(token: Avx2, places: &[u8; 8], start: u8) -> u32x8<Avx2> {
            let places = _mm256_cvtepu8_epi32(_mm_set_epi64x(0, i64::from_ne_bytes(*places)));
            _mm256_sub_epi32(places, _mm256_set1_epi32(start.into())).simd_into(token)
        }
    );

    fearless_simd::kernel!(
        /// The values at `places` among sixteen lanes.
        #[inline(always)]
        pub fn of_sixteen(token: Avx2, low: u32x8<Avx2>, high: u32x8<Avx2>, places: u32x8<Avx2>) -> u32x8<Avx2> {
            let places = places.into();
            let [low, high] =
                [low, high].map(|lanes| _mm256_castsi256_ps(_mm256_permutevar8x32_epi32(lanes.into(), places)));
            // Eight and more is the bit that becomes the sign.
            let which = _mm256_castsi256_ps(_mm256_slli_epi32::<28>(places));
            _mm256_castps_si256(_mm256_blendv_ps(low, high, which)).simd_into(token)
        }
    );
}

/// As many of the first lanes as `cells` has. In halves, as what goes by way of memory, and is read in pieces across those that
/// were stored, waits until all answers before it have left the core: a fifteenth of a recording's time. With vectors of eight
/// lanes and more a half is one piece.
#[inline(always)]
pub(super) fn store_first<S: Simd>(lanes: u32x16<S>, cells: &mut [u32]) {
    let (first, second) = lanes.split();
    let (half, cells) = match cells.split_first_chunk_mut::<8>() {
        Some((cells, rest)) => {
            first.store_slice(cells);
            (second, rest)
        }
        None => (first, cells),
    };
    let half: [u32; 8] = half.into();
    cells.copy_from_slice(&half[..cells.len()]);
}

/// Every set of instructions that this machine has and that anything is compiled for.
#[cfg(test)]
pub(super) fn levels() -> Vec<fearless_simd::Level> {
    use fearless_simd::Level;
    let widest = Level::new();
    #[cfg(target_arch = "x86_64")]
    let narrower = [widest.as_avx2().map(Level::Avx2), widest.as_sse2().map(Level::Sse2)];
    #[cfg(not(target_arch = "x86_64"))]
    let narrower: [Option<Level>; 0] = [];
    std::iter::once(widest).chain(narrower.into_iter().flatten()).collect()
}

#[cfg(test)]
mod tests {
    use fearless_simd::Level;

    use std::f64::consts::PI as PI_F64;

    use super::*;
    use crate::stage::angle::{self, ATAN2_ERROR, between_directions, between_lines};

    #[test]
    fn rows_begin_with_a_line_wherever_they_are_copied() {
        for rows in 1..40 {
            let mut lines = Lines::new(rows, 0.5_f32);
            lines[rows - 1][3] = 7.0;
            for lines in [lines.clone(), lines] {
                assert_eq!((lines.len(), lines[rows - 1][3], lines[0][0]), (rows, 7.0, 0.5));
                assert_eq!(lines.as_ptr().addr() % LINE, 0);
            }
        }
    }

    /// Angles of lines, and directions.
    #[inline(always)]
    fn rows<S: Simd>(simd: S, x: &Row<f32>, y: &Row<f32>) -> [Row<f32>; 2] {
        let mut angles = [[0.0; LANES]; 2];
        for at in (0..LANES).step_by(width::<S>()) {
            let (x, y) = (load(simd, x, at), load(simd, y, at));
            store(simd, of_line(simd, x, y), &mut angles[0], at);
            store(simd, of_direction(simd, x, y), &mut angles[1], at);
        }
        angles
    }

    /// The angles of `x` and `y` on every set of instructions, which have the same bits.
    fn angles(x: &Row<f32>, y: &Row<f32>) -> [Row<f32>; 2] {
        let on_each = levels().into_iter().map(|level| with_widest!(level, simd => rows(simd, x, y)));
        let angles: Vec<[Row<f32>; 2]> = on_each.collect();
        let bits = |angles: &[Row<f32>; 2]| angles.map(|row| row.map(f32::to_bits));
        assert!(angles.iter().all(|other| bits(other) == bits(&angles[0])), "{x:?} {y:?}");
        angles[0]
    }

    #[test]
    fn angles_keep_their_bound() {
        let mut worst: f64 = 0.0;
        for step in (0..400_000_u32).step_by(LANES) {
            let turns: [f64; LANES] = std::array::from_fn(|lane| f64::from(step + lane as u32) / 200_000.0 * PI_F64);
            for scale in [1.0, 1e-15, 3e12] {
                let (x, y) = (turns.map(|a| (a.cos() * scale) as f32), turns.map(|a| (a.sin() * scale) as f32));
                let [lines, directions] = angles(&x, &y);
                for lane in 0..LANES {
                    let (x, y) = (f64::from(x[lane]), f64::from(y[lane]));
                    let line = between_lines(lines[lane].into(), angle::of_line(x, y));
                    let direction = between_directions(directions[lane].into(), y.atan2(x));
                    worst = worst.max(line).max(direction);
                }
            }
        }
        assert!(worst <= ATAN2_ERROR, "{worst:e}");
        // The bound is not idle: an arctangent eight times worse would be caught.
        assert!(worst > ATAN2_ERROR / 8.0, "{worst:e}");
    }

    #[test]
    fn seams_have_one_side() {
        let places = [(-1.0, 0.0), (-1.0, -0.0), (1.0, -0.0), (-1.0, 1e-30), (-1.0, -1e-30), (1.0, 0.0)];
        let at = |pick: fn((f32, f32)) -> f32| std::array::from_fn(|lane| pick(places[lane % places.len()]));
        let [lines, directions] = angles(&at(|(x, _)| x), &at(|(_, y)| y));
        for (lane, (line, direction)) in lines.into_iter().zip(directions).enumerate() {
            assert!(line.is_sign_positive() && line < f32::EPSILON, "{:?}: {line}", places[lane % places.len()]);
            // As f32's own π is above it.
            assert!(f64::from(direction) <= PI_F64 && f64::from(direction) > -PI_F64, "{lane}: {direction}");
        }
    }

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
