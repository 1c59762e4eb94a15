//! What of a skin is at hand at once, where all of it is more than a cache holds.
//!
//! Sixteen frames of a million taxels are 64 MB of pressures. Written by calibration and read again by fields, they would
//! go to memory and back. Where fields that follow each other have taxels that do, it is enough to keep some thousands of
//! them: fields are gone through in order, and the window on their taxels slides along.

use std::ops::Range;
use std::sync::Arc;

use fearless_simd::Level;

use super::simd::{LANES, reads_rows_abreast};
use crate::scene::Plan;
use crate::stage::layout::Member;

/// Slots that a skin may have before it is looked at through a window: with 1 MiB of pressures there is nothing to gain.
const SMALL: usize = 1 << 14;
/// Slots that a window has, the first that does: 256 KiB of pressures and more.
const SIZES: [usize; 3] = [1 << 12, 1 << 13, 1 << 14];

/// Which tiles each sixteen fields need, and how many are kept.
#[derive(Clone, Debug)]
pub(super) struct Window {
    /// Per sixteen fields.
    needs: Vec<Range<usize>>,
    /// Slots that are kept: a power of two, or all there are.
    slots: usize,
    /// What a slot's number is cut to for its place among those that are kept.
    mask: usize,
}

impl Window {
    /// For a machine with the instructions of `level`.
    pub(super) fn new(plan: &Plan, level: Level) -> Self {
        let needs: Vec<Range<usize>> = plan
            .fields
            .chunks(LANES)
            .map(|fields| {
                let slots = fields.iter().flat_map(|field| plan.members_of(field)).map(|member| member.slot as usize);
                let (low, high) = slots.fold((usize::MAX, 0), |(low, high), slot| (low.min(slot), high.max(slot + 1)));
                low.min(high) / LANES..high.div_ceil(LANES)
            })
            .collect();
        let all = plan.slots().next_multiple_of(LANES);
        let whole = Self { needs, slots: all, mask: usize::MAX };
        // Changes and whoever wants all pressures go through all slots. A machine that reads rows abreast reads all of them as
        // fast as it reads a window's, and saves the search for what comes into it.
        if all <= SMALL || reads_rows_abreast(level) || plan.has_changes() || plan.kept_pressures() > 0 {
            return whole;
        }
        let few = SIZES.into_iter().find_map(|slots| {
            let part = Self { slots, mask: slots - 1, needs: whole.needs.clone() };
            // Reading a little twice is better than keeping all.
            part.reads().is_some_and(|tiles| tiles <= all / LANES + all / LANES / 4).then_some(part)
        });
        few.unwrap_or(whole)
    }

    /// Slots that are kept.
    pub(super) fn slots(&self) -> usize {
        self.slots
    }

    pub(super) fn mask(&self) -> usize {
        self.mask
    }

    /// Whether all slots are kept.
    pub(super) fn is_whole(&self) -> bool {
        self.mask == usize::MAX
    }

    /// The plan's members, each with its slot's place among those that are kept.
    pub(super) fn members(&self, plan: &Plan) -> Arc<[Member]> {
        if self.is_whole() {
            return Arc::clone(&plan.members);
        }
        let placed = |&member: &Member| Member { slot: (member.slot as usize & self.mask) as u32, ..member };
        plan.members.iter().map(placed).collect()
    }

    /// Makes what the fields of chunk `chunk` need be there, where `there` is so far: which tiles are to be read.
    pub(super) fn slide(&self, there: &mut Range<usize>, chunk: usize) -> [Range<usize>; 2] {
        let (need, room) = (self.needs[chunk].clone(), self.slots / LANES);
        let apart = need.end < there.start || there.end < need.start;
        if need.is_empty() {
            return [0..0, 0..0];
        }
        if Range::is_empty(there) || (apart && !self.is_whole()) {
            *there = need.clone();
            return [need, 0..0];
        }
        let (below, above) = (need.start..there.start.max(need.start), there.end.min(need.end)..need.end);
        let all = there.start.min(need.start)..there.end.max(need.end);
        *there = match all.len() > room {
            // What is farthest from what was needed now makes room.
            true if need.start == all.start => all.start..all.start + room,
            true => all.end - room..all.end,
            false => all,
        };
        [below, above]
    }

    /// How many tiles are read for all fields, from the first on; none where some do not fit.
    fn reads(&self) -> Option<usize> {
        let mut there = 0..0;
        let mut reads = 0;
        for chunk in 0..self.needs.len() {
            if self.needs[chunk].len() * LANES > self.slots {
                return None;
            }
            reads += self.slide(&mut there, chunk).iter().map(ExactSizeIterator::len).sum::<usize>();
        }
        Some(reads)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn window(needs: Vec<Range<usize>>, tiles: usize) -> Window {
        Window { needs, slots: tiles * LANES, mask: tiles * LANES - 1 }
    }

    proptest! {
        #[test]
        fn what_fields_need_is_always_there(
            starts in prop::collection::vec((0_usize..60, 0_usize..=8), 1..40),
            is_whole: bool,
        ) {
            let needs: Vec<Range<usize>> = starts.iter().map(|&(start, length)| start..start + length).collect();
            let mut window = window(needs.clone(), if is_whole { 128 } else { 8 });
            if is_whole {
                window.mask = usize::MAX;
            }
            // Which tile each place has, as a ring of so many keeps them.
            let mut kept = vec![usize::MAX; window.slots() / LANES];
            let mut there = 0..0;
            let mut reads = vec![0; 70];
            for (chunk, need) in needs.into_iter().enumerate() {
                for tile in window.slide(&mut there, chunk).into_iter().flatten() {
                    let place = ((tile * LANES) & window.mask()) / LANES;
                    kept[place] = tile;
                    reads[tile] += 1;
                }
                prop_assert!(need.clone().all(|tile| kept[((tile * LANES) & window.mask()) / LANES] == tile));
                prop_assert!(there.clone().all(|tile| kept[((tile * LANES) & window.mask()) / LANES] == tile));
            }
            prop_assert!(!is_whole || reads.iter().all(|&reads| reads <= 1), "nothing is read twice where all has room");
        }
    }

    #[test]
    fn rows_of_fields_are_read_about_once() {
        // Each beside the one before and a little over it.
        let sliding = window((0..100).map(|chunk| chunk * 3..chunk * 3 + 5).collect(), 8);
        assert_eq!(sliding.reads(), Some(302));
        assert_eq!(window(vec![0..3, 50..53, 0..3], 8).reads(), Some(9));
        assert_eq!(window(vec![0..3, 0..9], 8).reads(), None);
    }
}
