//! Fetching raw values that are needed next while fields are computed: the next block's, or where a skin is looked at
//! through a window, those that come into it.
//!
//! A core has room for ten to sixteen lines that are on their way, and waits with the next one until there is room. Fetched
//! all at once, a block's lines take as long as if nobody had asked for them; a few beside each field's sums, they come
//! while it computes.

use std::borrow::Cow;
use std::ops::Range;

use super::super::{FewLines, Near, Picks, Rows, few_at_a_time};
use super::simd::{LANES, later_needed};
use crate::signal::{Frame, RawValue};

/// Bytes of raw values from which on they are fetched: what is less may still be in a cache. Tests have less.
const MUCH: usize = if cfg!(test) { 1 << 16 } else { 1 << 20 };
/// Bytes of a block's raw values that the next larger cache has room for: it has 512 KiB and more.
const BLOCK: usize = 512 << 10;
/// Bytes of a line.
const LINE: usize = 64;

/// The frames, where a whole block's raw values are fetched: they lie as a source delivered them, are many, and a block's are
/// few.
pub(super) fn worth(raw: Rows<'_>) -> Option<(&[Frame], &Picks)> {
    let Rows::Picked { frames, picks } = raw else { return None };
    let frame = picks.lines.as_flattened().len() * LINE;
    (frames.len() * frame >= MUCH && LANES * frame <= BLOCK).then_some((frames, picks))
}

/// What is still to be fetched, and how much of it at a time.
#[derive(Clone, Debug, Default)]
pub(super) struct Ahead<'a> {
    /// The frame whose lines are fetched, and those after it.
    values: &'a [RawValue],
    frames: &'a [Frame],
    /// Where in each frame the lines begin, a few at a time.
    lines: Cow<'a, [FewLines]>,
    next: usize,
    at_a_time: usize,
}

impl<'a> Ahead<'a> {
    /// The sixteen frames of `raw` from `first` on, in so many `steps`.
    pub(super) fn new(raw: Rows<'a>, first: usize, steps: usize) -> Self {
        let Some((frames, picks)) = worth(raw) else { return Self::default() };
        let mut ahead = Self { lines: Cow::Borrowed(&picks.lines), ..Self::default() };
        ahead.begin(&frames[first.min(frames.len())..frames.len().min(first + LANES)], steps);
        ahead
    }

    /// Now those of `tiles` in `frames`, in so many `steps`.
    pub(super) fn turn_to(
        &mut self,
        raw: Rows<'a>,
        frames: Range<usize>,
        tiles: impl Iterator<Item = usize>,
        steps: usize,
    ) {
        let Rows::Picked { frames: all, picks } = raw else { return };
        let tiles = tiles.filter_map(|tile| match picks.near[tile] {
            Near::Straight(from) => Some((from, LANES)),
            Near::Shuffled(at) => Some((picks.shuffles[at].from, 2 * LANES)),
            Near::Scattered => None,
        });
        let lines = tiles.flat_map(|(from, values)| from / LANES..(from + values).div_ceil(LANES));
        self.lines = Cow::Owned(few_at_a_time(lines.map(|line| (line * LANES) as u32).collect()));
        self.begin(&all[frames], steps);
    }

    fn begin(&mut self, frames: &'a [Frame], steps: usize) {
        self.at_a_time = (frames.len() * self.lines.len()).div_ceil(steps.max(1));
        (self.frames, self.next) = (frames, self.lines.len());
    }

    /// Has the next few lines fetched.
    #[inline(always)]
    pub(super) fn step(&mut self) {
        for _ in 0..self.at_a_time {
            if self.next == self.lines.len() {
                let Some((first, later)) = self.frames.split_first() else { return };
                (self.values, self.frames, self.next) = (&first.values, later, 0);
            }
            let Some(lines) = self.lines.get(self.next) else { return };
            lines.iter().for_each(|&line| later_needed(self.values.as_ptr().wrapping_add(line as usize)));
            self.next += 1;
        }
    }
}
