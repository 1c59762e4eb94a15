//! Which fields rest in a block of frames, as nothing presses any of their taxels: most of a skin, most of the time.
//!
//! A block's tiles are read in any case. What is at rest there is known by then, and a field that has all of its taxels in
//! such tiles needs no sum: its percepts are known beforehand. A tile is sixteen taxels, so that this asks one question
//! where sums go over members and frames.

use super::simd::LANES;
use crate::scene::PlanField;
use crate::stage::layout::Member;

/// In which tiles fields have their taxels.
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
            let first = tiles.len();
            tiles.extend(members.iter().map(|member| member.slot / LANES as u32));
            tiles[first..].sort_unstable();
            let mut kept = first;
            for index in first..tiles.len() {
                if index == first || tiles[index] != tiles[kept - 1] {
                    tiles[kept] = tiles[index];
                    kept += 1;
                }
            }
            tiles.truncate(kept);
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
