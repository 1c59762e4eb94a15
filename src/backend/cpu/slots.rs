//! Where sixteen fields' members have their values in a frame, and bringing these side by side.

use std::hint::black_box;
use std::sync::OnceLock;
use std::time::{Duration, Instant};

use fearless_simd::Level;
use fearless_simd::prelude::*;

use super::lines::Lines;
use super::simd::{LANES, Row, with_widest};

/// A plan of fewer slots than this has them as 16-bit numbers, which need no check against a table of as many values.
pub(super) const NEAR: usize = 1 << 16;

/// Slots, a row a member.
#[derive(Clone, Debug)]
pub(super) enum Slots {
    Near(Lines<u16>),
    Far(Lines<u32>),
}

impl Slots {
    /// Of `slots`, none of which is more than `most`.
    pub(super) fn new(slots: Lines<u32>, most: usize) -> Self {
        if most < NEAR {
            Self::Near(slots.iter().map(|row| row.map(|slot| slot as u16)).collect())
        } else {
            Self::Far(slots)
        }
    }

    /// The same members where `to` puts them, which is nowhere beyond `most`.
    pub(super) fn moved(&self, to: impl Fn(u32) -> u32, most: usize) -> Self {
        let rows = match self {
            Self::Near(slots) => slots.iter().map(|row| row.map(|slot| to(slot.into()))).collect(),
            Self::Far(slots) => slots.iter().map(|row| row.map(&to)).collect(),
        };
        Self::new(rows, most)
    }

    /// Brings the values of all of them side by side.
    pub(super) fn gather<T: Copy>(&self, values: &[T], rows: &mut [Row<T>]) {
        match self {
            Self::Near(slots) => one_by_one(slots, all_near(values), rows),
            Self::Far(slots) => {
                for (row, slots) in rows.iter_mut().zip(&slots[..]) {
                    for (value, &slot) in row.iter_mut().zip(slots) {
                        *value = values[slot as usize];
                    }
                }
            }
        }
    }

    /// The same for pressures, by way of registers where it `inserts`; see [`inserting_pays`].
    pub(super) fn gather_pressures(&self, level: Level, inserts: bool, values: &[f32], rows: &mut [Row<f32>]) {
        match self {
            Self::Near(slots) if inserts => inserted(level, slots, all_near(values), rows),
            _ => self.gather(values, rows),
        }
    }
}

/// `values` as a table of all that near slots may say.
fn all_near<T>(values: &[T]) -> &[T; NEAR] {
    let Some(values) = values.first_chunk() else { unreachable!("they have room for any such slot") };
    values
}

/// Each value to its place in memory.
fn one_by_one<T: Copy>(slots: &[Row<u16>], values: &[T; NEAR], rows: &mut [Row<T>]) {
    for (row, slots) in rows.iter_mut().zip(slots) {
        for (value, &slot) in row.iter_mut().zip(slots) {
            *value = values[usize::from(slot)];
        }
    }
}

/// Each value to its place in a register, which is stored when it is full, where the machine has instructions for it.
fn inserted(level: Level, slots: &[Row<u16>], values: &[f32; NEAR], rows: &mut [Row<f32>]) {
    with_widest!(level, simd => insert(simd, slots, values, rows));
}

#[inline(always)]
fn insert<S: Simd>(simd: S, slots: &[Row<u16>], values: &[f32; NEAR], rows: &mut [Row<f32>]) {
    #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
    {
        let level = simd.level();
        if let Some(avx512) = level.as_avx512() {
            for (row, slots) in rows.iter_mut().zip(slots) {
                x86::sixteen(avx512, values, slots).store_slice(row);
            }
            return;
        } else if let Some(avx2) = level.as_avx2() {
            let halves = rows.as_flattened_mut().as_chunks_mut::<8>().0.iter_mut();
            for (half, slots) in halves.zip(slots.as_flattened().as_chunks().0) {
                x86::eight(avx2, values, slots).store_slice(half);
            }
            return;
        }
    }
    let _ = simd;
    one_by_one(slots, values, rows);
}

/// Whether [`inserted`] is faster than [`one_by_one`] on this machine, which is asked once: 3.7 ns a row beside 5 on one that
/// stores once a cycle, while others store twice, and have a single unit for what inserting takes.
pub(super) fn inserting_pays(level: Level) -> bool {
    // Elsewhere both are the same, and there may be no clock.
    if cfg!(not(any(target_arch = "x86", target_arch = "x86_64"))) {
        return false;
    }
    static PAYS: OnceLock<bool> = OnceLock::new();
    *PAYS.get_or_init(|| {
        const ROWS: usize = 64;
        let slot = |row: usize, lane: usize| ((row * LANES + lane) * 389 % 1009) as u16;
        let slots: Vec<Row<u16>> = (0..ROWS).map(|row| std::array::from_fn(|lane| slot(row, lane))).collect();
        let (values, mut rows) = (vec![0.0; NEAR], vec![[0.0; LANES]; ROWS]);
        let (values, mut least) = (all_near(&values), [Duration::MAX; 2]);
        // As many tries as make it likely that each way is undisturbed once; they take some 10 µs.
        for _ in 0..16 {
            for (inserts, least) in [false, true].into_iter().zip(&mut least) {
                let start = Instant::now();
                if inserts {
                    inserted(level, black_box(&slots), values, &mut rows);
                } else {
                    one_by_one(black_box(&slots), values, &mut rows);
                }
                black_box(&mut rows);
                *least = start.elapsed().min(*least);
            }
        }
        least[1] < least[0]
    })
}

#[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
mod x86 {
    #[cfg(target_arch = "x86")]
    use core::arch::x86::*;
    #[cfg(target_arch = "x86_64")]
    use core::arch::x86_64::*;

    use fearless_simd::prelude::*;
    use fearless_simd::x86::{Avx2, Avx512};
    use fearless_simd::{f32x8, f32x16};

    use super::{LANES, NEAR};

    /// Four of `values`, at the four `slots`, which are one word: loads are what there are most of.
    macro_rules! four {
        ($values:ident, $slots:expr) => {{
            let slots = u64::from_le_bytes(bytemuck::cast($slots));
            _mm_set_ps(
                $values[usize::from((slots >> 48) as u16)],
                $values[usize::from((slots >> 32) as u16)],
                $values[usize::from((slots >> 16) as u16)],
                $values[usize::from(slots as u16)],
            )
        }};
    }

    fearless_simd::kernel!(
        #[inline(always)]
        pub(super) fn sixteen(token: Avx512, values: &[f32; NEAR], slots: &[u16; LANES]) -> f32x16<Avx512> {
            let [first, second, third, last]: [[u16; 4]; 4] = bytemuck::cast(*slots);
            let one = _mm512_castps128_ps512(four!(values, first));
            let two = _mm512_insertf32x4::<1>(one, four!(values, second));
            let three = _mm512_insertf32x4::<2>(two, four!(values, third));
            _mm512_insertf32x4::<3>(three, four!(values, last)).simd_into(token)
        }
    );

    fearless_simd::kernel!(
        #[inline(always)]
        pub(super) fn eight(token: Avx2, values: &[f32; NEAR], slots: &[u16; 8]) -> f32x8<Avx2> {
            let [low, high]: [[u16; 4]; 2] = bytemuck::cast(*slots);
            _mm256_insertf128_ps::<1>(_mm256_castps128_ps256(four!(values, low)), four!(values, high)).simd_into(token)
        }
    );
}

#[cfg(test)]
mod tests {
    use super::super::tests::levels;
    use super::*;

    #[test]
    fn both_ways_bring_the_same_values() {
        let values: Vec<f32> = (0..NEAR).map(|slot| slot as f32).collect();
        let slots: Vec<Row<u16>> =
            (0..7).map(|row| std::array::from_fn(|lane| (row * 10_007 + lane * 4_001) as u16)).collect();
        let mut right = vec![[0.0; LANES]; slots.len()];
        one_by_one(&slots, all_near(&values), &mut right);
        assert_eq!(right[6][15], f32::from((6 * 10_007 + 15 * 4_001) as u16));
        for level in levels() {
            let mut rows = vec![[0.0; LANES]; slots.len()];
            inserted(level, &slots, all_near(&values), &mut rows);
            assert_eq!(rows, right, "{level:?}");
        }
    }
}
