//! Fetching raw values that are needed next while fields are computed: those that come into the window for the next ones,
//! or of the next frames.
//!
//! A core has room for ten to sixteen lines that are on their way, and waits with the next one until there is room. Fetched
//! all at once, a block's lines take as long as if nobody had asked for them; a few beside each field's sums, they come
//! while it computes.

use std::ops::Range;

use super::super::{FewLines, Rows};
use super::Tables;
use super::batch::Brief;
use super::simd::{LANES, Row, later_needed, soon_needed};
use crate::signal::{Frame, RawValue};
use crate::stage::layout::Member;

/// Bytes of raw values from which on they are fetched: what is less may still be in a cache. Tests have less.
const MUCH: usize = if cfg!(test) { 1 << 16 } else { 1 << 20 };
/// Bytes of raw values of sixteen frames that the next larger cache has room for: it has 512 KiB and more.
const BLOCK: usize = 1 << 20;
/// Bytes of a line.
const LINE: usize = 64;
/// Members that a line has.
const MEMBERS_A_LINE: usize = LINE / size_of::<Member>();
/// Members from which on they are fetched: all of a plan's are more than a cache holds. Tests have fewer.
const MANY_MEMBERS: usize = if cfg!(test) { 1 << 10 } else { 1 << 18 };

/// Whether raw values are so little that a cache may still have them.
pub(super) fn are_near(raw: Rows<'_>) -> bool {
    let bytes_of_all = match raw {
        Rows::Packed { values, .. } => size_of_val(values),
        Rows::Picked { frames, picks } => frames.len() * bytes(&picks.lines),
    };
    bytes_of_all < MUCH
}

/// Bytes of `lines` of a frame.
fn bytes(lines: &[FewLines]) -> usize {
    lines.as_flattened().len() * LINE
}

/// Where in each of the frames lie the lines of `tiles`, where they are fetched: frames lie as a source delivered them, are
/// many, and the lines of sixteen are few.
pub(super) fn worth(raw: Rows<'_>, tiles: Range<usize>) -> Option<(&[Frame], &[FewLines])> {
    let Rows::Picked { frames, picks } = raw else { return None };
    if are_near(raw) || tiles.is_empty() {
        return None;
    }
    let lines = if tiles.len() == picks.near.len() {
        &picks.lines[..]
    } else {
        let spans = &picks.spans[tiles];
        let (low, high) = spans.iter().fold((u32::MAX, 0), |(low, high), &[from, to]| (low.min(from), high.max(to)));
        let from = picks.lines.partition_point(|lines| lines[3] + LANES as u32 <= low);
        let to = picks.lines.partition_point(|lines| lines[0] <= high);
        &picks.lines[from..to]
    };
    (LANES * bytes(lines) <= BLOCK).then_some((frames, lines))
}

/// What is still to be fetched, and how much of it at a time.
#[derive(Clone, Debug, Default)]
pub(super) struct Ahead<'a> {
    /// The frame whose lines are fetched, and those after it.
    values: &'a [RawValue],
    frames: &'a [Frame],
    /// Where in each frame the lines begin, a few at a time.
    lines: &'a [FewLines],
    next: usize,
    at_a_time: usize,
}

impl<'a> Ahead<'a> {
    /// The `tiles` of those `frames` of `raw` that there are, in so many `steps`.
    pub(super) fn new(raw: Rows<'a>, frames: Range<usize>, tiles: Range<usize>, steps: usize) -> Self {
        let Some((all, lines)) = worth(raw, tiles) else { return Self::default() };
        let frames = &all[frames.start.min(all.len())..frames.end.min(all.len())];
        let at_a_time = (frames.len() * lines.len()).div_ceil(steps.max(1));
        Self { values: &[], frames, lines, next: lines.len(), at_a_time }
    }

    /// Has the next few lines fetched, into the nearest cache, from which they go to the next larger one: straight into that
    /// one took 1.05 to 1.2 times as long.
    #[inline(always)]
    pub(super) fn step(&mut self) {
        for _ in 0..self.at_a_time {
            if self.next == self.lines.len() {
                let Some((first, later)) = self.frames.split_first() else { return };
                (self.values, self.frames, self.next) = (&first.values, later, 0);
            }
            let Some(lines) = self.lines.get(self.next) else { return };
            lines.iter().for_each(|&line| soon_needed(self.values.as_ptr().wrapping_add(line as usize)));
            self.next += 1;
        }
    }
}

/// What the next fields are made of, fetched where it is more than a cache holds: pressures that may lie anywhere among many,
/// or else the members themselves.
#[derive(Clone, Copy, Debug)]
pub(super) struct Coming<'a> {
    members: &'a [Member],
    /// Where it is they that are fetched.
    pressures: Option<&'a [Row<f32>]>,
    at_a_time: usize,
}

impl<'a> Coming<'a> {
    /// Nothing yet, of fields that have `pressures`.
    pub(super) fn of(tables: &Tables, pressures: &'a [Row<f32>]) -> Self {
        Self { members: &[], pressures: tables.window.is_far().then_some(pressures), at_a_time: 0 }
    }

    /// Now for the first sixteen of `fields`, in so many `steps`. In place, as a copy would wait for all stores before it.
    pub(super) fn turn_to(&mut self, tables: &'a Tables, fields: Range<usize>, steps: usize) {
        self.members = &[];
        if self.pressures.is_none() && tables.seen.len() < MANY_MEMBERS {
            return;
        }
        let (briefs, later) = tables.briefs[fields].split_at_checked(LANES).unwrap_or_default();
        later.iter().take(LANES).for_each(|brief| soon_needed(brief));
        let (Some(first), Some(last)) = (briefs.first(), briefs.last()) else { return };
        // A wide field's taxels mostly follow each other, and are many.
        if briefs.iter().any(Brief::is_wide) {
            return;
        }
        self.members = &tables.seen[first.members().start..last.members().end];
        let at_a_time = self.members.len().div_ceil(steps.max(1));
        self.at_a_time = match self.pressures {
            Some(_) => at_a_time,
            None => at_a_time.next_multiple_of(MEMBERS_A_LINE),
        };
    }

    /// Has the next few fetched.
    #[inline(always)]
    pub(super) fn step(&mut self) {
        let (now, later) = self.members.split_at(self.at_a_time.min(self.members.len()));
        match self.pressures {
            Some(rows) => now.iter().for_each(|member| later_needed(rows.as_ptr().wrapping_add(member.slot as usize))),
            None => now.iter().step_by(MEMBERS_A_LINE).for_each(|member| soon_needed(member)),
        }
        self.members = later;
    }
}
