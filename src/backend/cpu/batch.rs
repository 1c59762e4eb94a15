//! Many frames: sixteen frames of a field abreast.

use std::ops::Range;

use fearless_simd::Level;
use fearless_simd::prelude::*;

use super::super::{RawBatch, Rows};
use super::Tables;
use super::columns::Place;
use super::in_view::InView;
use super::lines::Lines;
use super::lot::{Between, Wanted, touch};
use super::simd::{F, LANES, Row, U, load, load_u, splat, with_widest};
use super::sixteen::ManyAbreast;
use super::touch::{Abreast, Cells, Members, OneKind, Part};
use super::window::Stretch;
use super::{calibrate, change, columns};
use crate::percept::CellsMut;
use crate::scene::{Plan, PlanField};
use crate::stage::layout::Member;

/// What a task needs to work in.
pub(super) struct Scratch {
    pub(super) in_view: InView,
    /// Sixteen fields' answers, a lane a frame.
    cells: Box<[Cells; LANES]>,
    between: Box<[Between; LANES]>,
    /// Pressures and statuses of the frame before, where there are changes.
    before: (Lines<f32>, Lines<u32>),
    /// Whether any value of these frames so far is anything but a plain number.
    faults: bool,
}

impl Scratch {
    pub(super) fn new(plan: &Plan, tables: &Tables) -> Self {
        let before = if plan.has_changes() { tables.window.slots() / LANES } else { 0 };
        Self {
            in_view: InView::new(tables.window.slots()),
            cells: Box::new([Cells::EMPTY; LANES]),
            between: Box::new([Between::EMPTY; LANES]),
            before: (Lines::new(before, 0.0), Lines::new(before, 0)),
            faults: false,
        }
    }
}

/// What fields have in common.
#[derive(Clone, Copy)]
pub(super) struct Skin<'a> {
    plan: &'a Plan,
    pressures: &'a [Row<f32>],
    statuses: &'a [Row<u32>],
}

impl<'a> Skin<'a> {
    pub(super) fn new(plan: &'a Plan, in_view: &'a InView) -> Self {
        Self { plan, pressures: &in_view.pressures, statuses: &in_view.statuses }
    }
}

/// A field's members over sixteen frames; `WEIGHTED` where weights are not all 1.
#[derive(Clone, Copy)]
pub(super) struct OverFrames<'a, const WEIGHTED: bool> {
    skin: &'a Skin<'a>,
    /// By place in the window.
    seen: &'a [Member],
    field: usize,
}

/// What blocks have to know of every field: little, and side by side.
#[derive(Clone, Copy, Debug)]
pub(super) struct Brief {
    first: usize,
    count: usize,
    way: Way,
    pub(super) kind: OneKind,
}

/// How a field's members are gone over.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Way {
    /// One after the other.
    Narrow {
        weighted: bool,
    },
    Wide,
}

impl Brief {
    /// Of all fields of `plan`.
    pub(super) fn all(plan: &Plan) -> Vec<Self> {
        let of = |field: &PlanField| {
            let way = if field.is_wide() { Way::Wide } else { Way::Narrow { weighted: !field.unweighted } };
            Self { first: field.first, count: field.count, way, kind: OneKind::new(field) }
        };
        plan.fields.iter().map(of).collect()
    }

    pub(super) fn members(&self) -> Range<usize> {
        self.first..self.first + self.count
    }
}

impl<S: Simd, const WEIGHTED: bool> Members<S> for OverFrames<'_, WEIGHTED> {
    #[inline(always)]
    fn count(self) -> usize {
        self.seen.len()
    }

    #[inline(always)]
    fn part(self, simd: S, member: usize, at: usize) -> Part<S> {
        let Member { slot, weight, u, v } = self.seen[member];
        let pressure = load(simd, &self.skin.pressures[slot as usize], at);
        Part {
            pressure,
            pull: if WEIGHTED { splat(simd, weight) * pressure } else { pressure },
            u: splat(simd, u),
            v: splat(simd, v),
        }
    }

    #[inline(always)]
    fn depth(self, simd: S, member: usize, _: usize) -> F<S> {
        splat(simd, self.skin.plan.fields[self.field].depths[member])
    }

    #[inline(always)]
    fn area(self, simd: S, member: usize, _: usize) -> F<S> {
        let plan = self.skin.plan;
        let slot = plan.members[plan.fields[self.field].first + member].slot;
        splat(simd, plan.taxels[slot as usize].area)
    }

    #[inline(always)]
    fn status(self, simd: S, member: usize, at: usize) -> U<S> {
        load_u(simd, &self.skin.statuses[self.seen[member].slot as usize], at)
    }
}

/// Where a stretch's frames are.
pub(super) struct Job<'a> {
    pub(super) raw: &'a RawBatch<'a>,
    /// The first of up to sixteen frames.
    pub(super) first: usize,
    /// The one before them.
    pub(super) before: (Rows<'a>, usize),
}

/// All stages for the fields of `stretch`, in as many frames as `cells` has, which is at most sixteen. Those before have their
/// answers by then.
pub(super) fn stretch(
    level: Level,
    plan: &Plan,
    tables: &Tables,
    job: &Job<'_>,
    stretch: &Stretch,
    scratch: &mut Scratch,
    cells: &mut CellsMut<'_>,
) {
    let &Job { raw, first, before } = job;
    let frames = cells.frames();
    let is_first = stretch.fields.start == 0;
    if is_first {
        (scratch.faults, scratch.in_view.any_rests) = (false, false);
    }
    for tiles in stretch.reads.iter().filter(|tiles| !tiles.is_empty()) {
        let frames = first..first + frames;
        scratch.faults |= scratch.in_view.read(level, plan, tables, raw.rows, frames, tiles.clone());
    }
    if is_first && plan.has_changes() {
        let Scratch { in_view, before: (was, said), .. } = scratch;
        calibrate::frame(level, plan, tables, before, was, said);
        let before = (was.as_flattened(), said.as_flattened());
        scratch.faults |= change::frames(
            plan,
            &raw.steps[first..first + frames],
            before,
            &mut in_view.pressures,
            &mut in_view.statuses,
        );
        in_view.tiles.iter_mut().for_each(|tile| tile.rests = false);
        in_view.any_rests = false;
    }
    if is_first && !cells.pressures.is_empty() {
        let slots = plan.slots();
        let tiles = scratch.in_view.pressures[..slots.next_multiple_of(LANES)]
            .chunks(LANES)
            .zip(&scratch.in_view.tiles)
            .enumerate();
        // Those at rest are 0 there already.
        for (tile, (rows, _)) in tiles.filter(|(_, (_, kept))| !kept.rests) {
            for frame in 0..frames {
                let frame_of = &mut cells.pressures[frame * slots..][tile * LANES..slots.min((tile + 1) * LANES)];
                frame_of.iter_mut().zip(rows).for_each(|(to, lanes)| *to = lanes[frame].into());
            }
        }
    }
    // The last first, as what is written of it may reach into the first ones of the next frame.
    let last = stretch.start_of_last_sixteen();
    let Scratch { in_view, cells: of_fields, between, faults, .. } = scratch;
    let skin = Skin::new(plan, in_view);
    let may_rest = in_view.any_rests;
    for first_field in std::iter::once(last).chain((stretch.fields.start..last).step_by(LANES)) {
        let fields = &plan.fields[first_field..stretch.fields.end.min(first_field + LANES)];
        // Of later stretches the next frame's first fields have their answers.
        let place = Place::new(cells, first_field, fields.len(), is_first);
        let mut rests = [false; LANES];
        let ask = if may_rest { &mut rests[..fields.len()] } else { &mut [] };
        for (field, rests) in (first_field..).zip(ask) {
            *rests = tables.rest.has_at_rest(field, |tile| in_view.tiles[tile].rests);
        }
        let rests = &rests[..fields.len()];
        if rests.iter().all(|&rests| rests) {
            columns::write_at_rest(fields, place, plan.outputs, cells);
            continue;
        }
        with_widest!(level, simd => answer(simd, plan, tables, first_field, rests, &skin, *faults, between, of_fields));
        with_widest!(level, simd => columns::write(simd, of_fields, place, plan.outputs, cells));
    }
}

/// All stages for the fields from `first` on, of which `rests` says whether any pressure is to be seen, over sixteen frames.
#[inline(always)]
#[expect(clippy::too_many_arguments, reason = "as `stretch`")]
fn answer<S: Simd>(
    simd: S,
    plan: &Plan,
    tables: &Tables,
    first: usize,
    rests: &[bool],
    skin: &Skin<'_>,
    faults: bool,
    between: &mut [Between; LANES],
    answers: &mut [Cells; LANES],
) {
    let wanted = Wanted { stages: plan.stages(), outputs: plan.columns, faults, care: plan.is_compensated() };
    let briefs = &tables.briefs[first..first + rests.len()];
    let mut start = 0;
    while start < briefs.len() {
        let (rest, way) = (rests[start], briefs[start].way);
        let others = rests[start..].iter().zip(&briefs[start..]);
        let alike = others.take_while(|(rests, brief)| **rests == rest && brief.way == way).count();
        let run = start..start + alike;
        let (between, answers) = (&mut between[run.clone()], &mut answers[run.clone()]);
        let briefs = &briefs[run];
        // Once for all stages.
        macro_rules! answer {
            ($abreast:ident, $weighted:literal) => {{
                let mut lots = [(&tables.seen[..0], &briefs[0].kind); LANES];
                for (lot, brief) in lots.iter_mut().zip(briefs) {
                    *lot = (&tables.seen[brief.members()], &brief.kind);
                }
                touch(
                    simd,
                    #[inline(always)]
                    |index| {
                        let ((seen, kind), field) = (lots[index], first + start + index);
                        ($abreast(OverFrames::<$weighted> { skin, seen, field }), kind)
                    },
                    LANES,
                    wanted,
                    between,
                    answers,
                );
            }};
        }
        match way {
            _ if rest => {
                for (cells, brief) in answers.iter_mut().zip(briefs) {
                    *cells = Cells::at_rest(&brief.kind);
                }
            }
            Way::Wide => answer!(ManyAbreast, true),
            Way::Narrow { weighted: false } => answer!(Abreast, false),
            Way::Narrow { weighted: true } => answer!(Abreast, true),
        }
        start += alike;
    }
}
