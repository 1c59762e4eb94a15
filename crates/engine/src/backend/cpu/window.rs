//! What of a skin is at hand at once, where all of it is more than a cache holds.
//!
//! Sixteen frames of a million taxels are 64 MB of pressures. Written by calibration and read again by fields, they would
//! go to memory and back. Where fields that follow each other have taxels that do, it is enough to keep some thousands of
//! them: fields are gone through in order, a stretch of them at a time, and the window on their taxels slides along.

use std::ops::Range;
use std::sync::Arc;

use super::lanes::LANES;
use crate::scene::{Plan, PlanField};
use crate::stage::layout::Member;

/// Slots that a skin may have before it is looked at through a window.
const SMALL: usize = 1 << 12;
/// Slots that a window has, the first that does: 256 KiB of pressures and more.
const SIZES: [usize; 3] = [1 << 12, 1 << 13, 1 << 14];

/// Which fields are computed together, what is read before, and how many slots are kept.
#[derive(Clone, Debug)]
pub(super) struct Window {
    stretches: Vec<Stretch>,
    /// Slots that are kept: a power of two, or all there are.
    slots: usize,
    /// What a slot's number is cut to for its place among those that are kept.
    mask: usize,
}

/// Fields that follow each other.
#[derive(Clone, Debug)]
pub(super) struct Stretch {
    /// From a multiple of [`LANES`] on.
    pub(super) fields: Range<usize>,
    /// Tiles that come into the window for them.
    pub(super) reads: [Range<usize>; 2],
}

impl Stretch {
    /// The first of the last sixteen fields, or of as many as there are.
    pub(super) fn start_of_last_sixteen(&self) -> usize {
        self.fields.start + self.fields.len().saturating_sub(1) / LANES * LANES
    }
}

impl Window {
    pub(super) fn new(plan: &Plan) -> Self {
        let all = plan.slots().next_multiple_of(LANES);
        let needs = plan.fields.chunks(LANES).map(|fields| {
            let needed = fields.iter().map(|field| tiles_of(plan.members_of(field)));
            needed.reduce(|one, other| around(&one, &other)).unwrap_or_default()
        });
        let needs: Vec<Range<usize>> = needs.collect();
        // Changes and whoever wants all pressures go through all slots.
        if all > SMALL && !needs.is_empty() && !plan.has_changes() && plan.kept_pressures() == 0 {
            for slots in SIZES {
                let Some(stretches) = cut(&needs, slots / LANES, plan.fields.len()) else { continue };
                let reads =
                    stretches.iter().flat_map(|stretch| &stretch.reads).map(ExactSizeIterator::len).sum::<usize>();
                // Reading a little twice is better than keeping all.
                let tiles = all / LANES;
                if reads <= tiles + tiles / 4 {
                    return Self { stretches, slots, mask: slots - 1 };
                }
            }
        }
        let stretch = Stretch { fields: 0..plan.fields.len(), reads: [0..plan.calibrated().div_ceil(LANES), 0..0] };
        Self { stretches: vec![stretch], slots: all, mask: usize::MAX }
    }

    /// All fields, in order.
    pub(super) fn stretches(&self) -> &[Stretch] {
        &self.stretches
    }

    /// Slots that are kept.
    pub(super) fn slots(&self) -> usize {
        self.slots
    }

    pub(super) fn mask(&self) -> usize {
        self.mask
    }

    /// Whether all slots are kept.
    fn is_whole(&self) -> bool {
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
}

/// In which tiles fields have their taxels: a field all of whose taxels lie in tiles that nothing presses needs no sum. Most
/// of a skin is so, most of the time; a tile is sixteen taxels, which a block reads in any case.
#[derive(Clone, Debug)]
pub(super) struct Rest {
    /// By field, where its tiles begin; and where the last one's end.
    starts: Vec<u32>,
    /// Among those that are kept.
    tiles: Vec<u32>,
}

impl Rest {
    /// Of `fields`, whose members are `seen` by place in the window.
    pub(super) fn new(fields: &[PlanField], seen: &[Member]) -> Self {
        let (mut starts, mut tiles) = (vec![0], Vec::new());
        for field in fields {
            let members = &seen[field.first..field.first + field.count];
            let mut own: Vec<u32> = members.iter().map(|member| member.slot / LANES as u32).collect();
            own.sort_unstable();
            own.dedup();
            tiles.extend(own);
            starts.push(tiles.len() as u32);
        }
        tiles.shrink_to_fit();
        Self { starts, tiles }
    }

    /// Whether field `field` rests, given which tiles do.
    pub(super) fn has_at_rest(&self, field: usize, rests: impl Fn(usize) -> bool) -> bool {
        self.tiles[self.starts[field] as usize..self.starts[field + 1] as usize]
            .iter()
            .all(|&tile| rests(tile as usize))
    }
}

/// Cuts `fields` into stretches, each with as many fields as fit together into a window of `room` tiles. `needs` are the tiles of
/// each sixteen fields. At most half of a window is read at a time, so that a cache has room for what is read next beside it. None
/// where sixteen fields do not fit alone.
fn cut(needs: &[Range<usize>], room: usize, fields: usize) -> Option<Vec<Stretch>> {
    let (mut stretches, mut there, mut start) = (Vec::new(), 0..0, 0);
    while start < needs.len() {
        let mut need = needs[start].clone();
        let mut end = start + 1;
        while let Some(next) = needs.get(end) {
            let both = around(&need, next);
            let new = slide(&mut there.clone(), both.clone(), room).iter().map(ExactSizeIterator::len).sum::<usize>();
            if both.len() > room || new > room / 2 {
                break;
            }
            (need, end) = (both, end + 1);
        }
        if need.len() > room {
            return None;
        }
        let reads = slide(&mut there, need, room);
        stretches.push(Stretch { fields: start * LANES..fields.min(end * LANES), reads });
        start = end;
    }
    Some(stretches)
}

/// From the first to the last tile in which `members` have their taxels.
fn tiles_of(members: &[Member]) -> Range<usize> {
    let slots = members.iter().map(|member| member.slot as usize);
    let (low, high) = slots.fold((usize::MAX, 0), |(low, high), slot| (low.min(slot), high.max(slot + 1)));
    low.min(high) / LANES..high.div_ceil(LANES)
}

/// All that is in either, and between them.
fn around(one: &Range<usize>, other: &Range<usize>) -> Range<usize> {
    match (one.is_empty(), other.is_empty()) {
        (true, _) => other.clone(),
        (_, true) => one.clone(),
        _ => one.start.min(other.start)..one.end.max(other.end),
    }
}

/// Moves the window `there`, which has room for `room` tiles, so that it holds `need`. Returns the tiles to read for that.
fn slide(there: &mut Range<usize>, need: Range<usize>, room: usize) -> [Range<usize>; 2] {
    let apart = need.end < there.start || there.end < need.start;
    if need.is_empty() {
        return [0..0, 0..0];
    }
    if Range::is_empty(there) || apart {
        *there = need.clone();
        return [need, 0..0];
    }
    let (below, above) = (need.start..there.start.max(need.start), there.end.min(need.end)..need.end);
    let all = around(there, &need);
    *there = match all.len() > room {
        // What is farthest from what was needed now makes room.
        true if need.start == all.start => all.start..all.start + room,
        true => all.end - room..all.end,
        false => all,
    };
    [below, above]
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn what_fields_need_is_always_there(
            starts in prop::collection::vec((0_usize..60, 0_usize..=8), 1..40),
        ) {
            const ROOM: usize = 8;
            let needs: Vec<Range<usize>> = starts.iter().map(|&(start, length)| start..start + length).collect();
            // Which tile each place of a ring of `ROOM` has.
            let mut kept = [usize::MAX; ROOM];
            let mut next = 0;
            for Stretch { fields, reads } in cut(&needs, ROOM, needs.len() * LANES).unwrap() {
                prop_assert_eq!(fields.start, next * LANES);
                next = fields.end / LANES;
                for tile in reads.into_iter().flatten() {
                    kept[tile % ROOM] = tile;
                }
                prop_assert!(needs[fields.start / LANES..next].iter().cloned().flatten().all(|tile| kept[tile % ROOM] == tile));
            }
            prop_assert_eq!(next, needs.len());
        }
    }

    #[test]
    fn rows_of_fields_are_read_about_once_and_little_at_a_time() {
        let reads = |needs: &[Range<usize>], room| -> Option<Vec<usize>> {
            let tiles = |stretch: &Stretch| stretch.reads.iter().map(ExactSizeIterator::len).sum();
            Some(cut(needs, room, needs.len() * LANES)?.iter().map(tiles).collect())
        };
        // Each beside the one before and a little over it.
        let sliding: Vec<Range<usize>> = (0..100).map(|chunk| chunk * 3..chunk * 3 + 5).collect();
        let read = reads(&sliding, 32).unwrap();
        assert_eq!((read.iter().sum::<usize>(), read.iter().max()), (302, Some(&15)));
        assert_eq!(reads(&[0..3, 50..53, 0..3], 8), Some(vec![3, 3, 3]));
        assert_eq!(reads(&[0..3, 0..9], 8), None);
    }
}
