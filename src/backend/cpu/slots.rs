//! Where sixteen fields' members have their values in a frame, and bringing these side by side.

use super::lines::Lines;
use super::simd::Row;

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

    /// Brings the values of all of them side by side.
    pub(super) fn gather<T: Copy>(&self, values: &[T], rows: &mut [Row<T>]) {
        match self {
            Self::Near(slots) => {
                let Some(values) = values.first_chunk::<NEAR>() else {
                    unreachable!("they have room for any such slot")
                };
                for (row, slots) in rows.iter_mut().zip(&slots[..]) {
                    for (value, &slot) in row.iter_mut().zip(slots) {
                        *value = values[usize::from(slot)];
                    }
                }
            }
            Self::Far(slots) => {
                for (row, slots) in rows.iter_mut().zip(&slots[..]) {
                    for (value, &slot) in row.iter_mut().zip(slots) {
                        *value = values[slot as usize];
                    }
                }
            }
        }
    }
}
