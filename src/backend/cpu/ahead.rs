//! Fetching raw values that are needed next while fields are computed: those that come into the window for the next ones,
//! or of the next frames.
//!
//! A core has room for ten to sixteen lines that are on their way, and waits with the next one until there is room. Fetched
//! all at once, a block's lines take as long as if nobody had asked for them; a few beside each field's sums, they come
//! while it computes.

use std::ops::Range;

use super::super::{FewLines, Rows};
use super::Tables;
use super::simd::{LANES, Row, later_needed};
use crate::scene::PlanField;
use crate::signal::{Frame, RawValue};
use crate::stage::layout::Member;

/// Bytes of raw values from which on they are fetched: what is less may still be in a cache. Tests have less.
const MUCH: usize = if cfg!(test) { 1 << 16 } else { 1 << 20 };
/// Bytes of raw values of sixteen frames that the next larger cache has room for: it has 512 KiB and more.
const BLOCK: usize = 1 << 20;
/// Bytes of a line.
const LINE: usize = 64;

/// Where in each of the frames lie the lines of `tiles`, where they are fetched: frames lie as a source delivered them, are
/// many, and the lines of sixteen are few.
pub(super) fn worth(raw: Rows<'_>, tiles: Range<usize>) -> Option<(&[Frame], &[FewLines])> {
    let Rows::Picked { frames, picks } = raw else { return None };
    let bytes = |lines: &[FewLines]| lines.as_flattened().len() * LINE;
    if frames.len() * bytes(&picks.lines) < MUCH || tiles.is_empty() {
        return None;
    }
    let lines = if tiles.len() == picks.near.len() {
        &picks.lines[..]
    } else {
        let places = &picks.places[tiles.start * LANES..picks.places.len().min(tiles.end * LANES)];
        let (low, high) = places.iter().fold((u32::MAX, 0), |(low, high), &at| (low.min(at), high.max(at)));
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

/// Pressures that the next fields are made of, fetched where they may lie anywhere in more than a cache holds.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Coming<'a> {
    members: &'a [Member],
    pressures: &'a [Row<f32>],
    at_a_time: usize,
}

impl<'a> Coming<'a> {
    /// Those of the first sixteen of `fields`, in so many `steps`.
    pub(super) fn new(fields: &[PlanField], tables: &'a Tables, pressures: &'a [Row<f32>], steps: usize) -> Self {
        let fields = &fields[..fields.len().min(LANES)];
        let (Some(first), Some(last)) = (fields.first(), fields.last()) else { return Self::default() };
        // A wide field's taxels mostly follow each other, and are many.
        if fields.iter().any(PlanField::is_wide) {
            return Self::default();
        }
        let members = &tables.seen[first.first..last.first + last.count];
        Self { members, pressures, at_a_time: members.len().div_ceil(steps.max(1)) }
    }

    /// Has the next few fetched.
    #[inline(always)]
    pub(super) fn step(&mut self) {
        let (now, later) = self.members.split_at(self.at_a_time.min(self.members.len()));
        now.iter().for_each(|member| later_needed(self.pressures.as_ptr().wrapping_add(member.slot as usize)));
        self.members = later;
    }
}
