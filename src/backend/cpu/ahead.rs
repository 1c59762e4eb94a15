//! Fetching raw values that are needed next while fields are computed: the next block's, or where a skin is looked at
//! through a window, those that come into it.
//!
//! A core has room for ten to sixteen lines that are on their way, and waits with the next one until there is room. Fetched
//! all at once, a block's lines take as long as if nobody had asked for them; a few beside each field's sums, they come
//! while it computes.

use std::borrow::Cow;
use std::ops::Range;

use super::super::{Near, Picks, Rows};
use super::simd::{LANES, later_needed};
use crate::signal::Frame;

/// Bytes of raw values from which on they are fetched: what is less may still be in a cache. Tests have less.
const MUCH: usize = if cfg!(test) { 1 << 16 } else { 8 << 20 };
/// Bytes of a block's raw values that the next larger cache has room for: it has 512 KiB and more.
const BLOCK: usize = 512 << 10;
/// Bytes of a line.
const LINE: usize = 64;

/// The frames, where a whole block's raw values are fetched: they lie as a source delivered them, are many, and a block's are
/// few.
pub(super) fn worth(raw: Rows<'_>) -> Option<(&[Frame], &Picks)> {
    let Rows::Picked { frames, picks } = raw else { return None };
    let frame = picks.lines.len() * LINE;
    (frames.len() * frame >= MUCH && LANES * frame <= BLOCK).then_some((frames, picks))
}

/// How many of each frame's `lines` are fetched in a step, of which none takes lines of two `frames`.
fn at_a_time(frames: usize, lines: usize, steps: usize) -> usize {
    lines.div_ceil((steps / frames.max(1)).max(1))
}

/// What is still to be fetched, and how much of it at a time.
#[derive(Clone, Debug)]
pub(super) struct Ahead<'a> {
    frames: &'a [Frame],
    /// Where in a frame the lines begin.
    lines: Cow<'a, [u32]>,
    line: usize,
    at_a_time: usize,
}

impl<'a> Ahead<'a> {
    /// The sixteen frames of `raw` from `first` on, in so many `steps`.
    pub(super) fn new(raw: Rows<'a>, first: usize, steps: usize) -> Self {
        let Some((frames, picks)) = worth(raw) else {
            return Self { frames: &[], lines: Cow::Borrowed(&[]), line: 0, at_a_time: 0 };
        };
        let frames = &frames[first.min(frames.len())..frames.len().min(first + LANES)];
        let at_a_time = at_a_time(frames.len(), picks.lines.len(), steps);
        Self { frames, lines: Cow::Borrowed(&picks.lines), line: 0, at_a_time }
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
        let lines = self.lines.to_mut();
        lines.clear();
        for tile in tiles {
            let (from, values) = match picks.near[tile] {
                Near::Straight(from) => (from, LANES),
                Near::Shuffled(at) => (picks.shuffles[at].from, 2 * LANES),
                Near::Scattered => continue,
            };
            lines.extend((from / LANES..(from + values).div_ceil(LANES)).map(|line| (line * LANES) as u32));
        }
        lines.dedup();
        self.at_a_time = at_a_time(frames.len(), lines.len(), steps);
        (self.frames, self.line) = (if lines.is_empty() { &[] } else { &all[frames] }, 0);
    }

    /// Has the next few lines of a frame fetched.
    #[inline(always)]
    pub(super) fn step(&mut self) {
        let Some((frame, later)) = self.frames.split_first() else { return };
        let lines = &self.lines[self.line..];
        let count = self.at_a_time.min(lines.len());
        lines[..count].iter().for_each(|&line| later_needed(frame.values.as_ptr().wrapping_add(line as usize)));
        self.line += count;
        if self.line == self.lines.len() {
            (self.frames, self.line) = (later, 0);
        }
    }
}
