//! Many frames: sixteen frames of a field abreast.

use std::ops::Range;

use bytemuck::{cast_ref, cast_slice_mut};
use fearless_simd::Level;
use fearless_simd::prelude::*;

use super::super::{RawBatch, Rows};
use super::Tables;
use super::ahead::{Ahead, Coming};
use super::columns::{Announcement, Place};
use super::lines::{Aligned, Lines};
use super::lot::{Between, Wanted, calls, touch};
use super::pick::{OneFrame, SomeFrames};
use super::simd::{F, LANES, Row, U, load, load_u, reads_rows_abreast, splat, with_widest};
use super::stream::{Outgoing, Staged};
use super::touch::{Abreast, Cells, Members, OneKind, Part};
use super::transpose::transpose;
use super::wide::ManyAbreast;
use super::window::Stretch;
use super::{ahead, calibrate, change, columns};
use crate::percept::CellsMut;
use crate::scene::{Plan, PlanField};
use crate::stage::layout::Member;

/// Tiles whose raw bits are read together where rows are not read abreast: frame by frame, as they lie in memory, so that the
/// processor sees it coming.
const GROUP: usize = 64;
/// Tiles that are read together where nobody has fetched them: the next ones are, meanwhile.
const FETCHED: usize = 16;

/// What a task needs to work in.
pub(super) struct Scratch {
    /// Raw bits of a few tiles, a row a frame.
    bits: Lines<u32>,
    /// By slot, as far as the window reaches, a lane a frame.
    pressures: Lines<f32>,
    statuses: Lines<u32>,
    /// By tile, as far as the window reaches.
    tiles: Vec<KeptTile>,
    /// Sixteen fields' answers, a lane a frame.
    cells: Box<[Cells; LANES]>,
    between: Box<[Between; LANES]>,
    /// Pressures and statuses of the frame before, where there are changes.
    before: (Lines<f32>, Lines<u32>),
    /// Answers on their way past the caches, if any were.
    pub(super) staged: Option<[Staged; 2]>,
    /// Whether any value of these frames so far is anything but a plain number.
    faults: bool,
}

impl Scratch {
    pub(super) fn new(plan: &Plan, tables: &Tables) -> Self {
        let kept = tables.window.slots();
        let before = if plan.has_changes() { kept / LANES } else { 0 };
        Self {
            bits: Lines::new(GROUP * LANES, 0),
            pressures: Lines::new(kept, 0.0),
            statuses: Lines::new(kept, 0),
            tiles: vec![KeptTile { rests: true, faulty: false }; kept / LANES],
            cells: Box::new([Cells::EMPTY; LANES]),
            between: Box::new([Between::EMPTY; LANES]),
            before: (Lines::new(before, 0.0), Lines::new(before, 0)),
            staged: None,
            faults: false,
        }
    }
}

/// What is known of sixteen taxels in sixteen frames.
#[derive(Clone, Copy)]
struct KeptTile {
    /// All pressures and statuses are 0.
    rests: bool,
    /// Statuses say something.
    faulty: bool,
}

/// What fields have in common.
#[derive(Clone, Copy)]
struct Skin<'a> {
    plan: &'a Plan,
    pressures: &'a [Row<f32>],
    statuses: &'a [Row<u32>],
}

/// A field's members over sixteen frames; `WEIGHTED` where weights are not all 1.
#[derive(Clone, Copy)]
struct OverFrames<'a, const WEIGHTED: bool> {
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
    is_wide: bool,
    unweighted: bool,
    kind: OneKind,
}

impl Brief {
    pub(super) fn new(field: &PlanField) -> Self {
        let (is_wide, kind) = (field.is_wide(), OneKind::new(field));
        Self { first: field.first, count: field.count, is_wide, unweighted: field.unweighted, kind }
    }

    pub(super) fn members(&self) -> Range<usize> {
        self.first..self.first + self.count
    }

    pub(super) fn is_wide(&self) -> bool {
        self.is_wide
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

/// Where a stretch's frames are, and what is done beside computing them.
pub(super) struct Job<'a, 'b> {
    pub(super) raw: &'b RawBatch<'a>,
    /// The first of up to sixteen frames.
    pub(super) first: usize,
    /// The one before them.
    pub(super) before: (Rows<'b>, usize),
    /// What is fetched for the next one.
    pub(super) ahead: Ahead<'a>,
}

/// All stages for the fields of `stretch`, in as many frames as `cells` has, which is at most sixteen. Those before have their
/// answers by then.
#[expect(clippy::too_many_arguments, reason = "what a plan is run with, and where")]
pub(super) fn stretch(
    level: Level,
    plan: &Plan,
    tables: &Tables,
    job: Job<'_, '_>,
    stretch: &Stretch,
    scratch: &mut Scratch,
    cells: &mut CellsMut<'_>,
    outgoing: Option<&mut Outgoing<'_>>,
) {
    let Job { raw, first, before, ahead } = job;
    let frames = cells.frames();
    let is_first = stretch.fields.start == 0;
    if is_first {
        scratch.faults = false;
    }
    for tiles in stretch.reads.iter().filter(|tiles| !tiles.is_empty()) {
        scratch.faults |= read(level, plan, tables, raw.rows, first, frames, tiles.clone(), scratch);
    }
    if is_first && plan.has_changes() {
        let Scratch { pressures, statuses, before: (was, said), .. } = scratch;
        calibrate::frame(level, plan, tables, before, was, said);
        let before = (was.as_flattened(), said.as_flattened());
        scratch.faults |= change::frames(plan, &raw.steps[first..first + frames], before, pressures, statuses);
        scratch.tiles.iter_mut().for_each(|tile| tile.rests = false);
    }
    if is_first && !cells.pressures.is_empty() {
        let slots = plan.slots();
        let tiles = scratch.pressures[..slots.next_multiple_of(LANES)].chunks(LANES).zip(&scratch.tiles).enumerate();
        // Those at rest are 0 there already.
        for (tile, (rows, _)) in tiles.filter(|(_, (_, kept))| !kept.rests) {
            for frame in 0..frames {
                let frame_of = &mut cells.pressures[frame * slots..][tile * LANES..slots.min((tile + 1) * LANES)];
                frame_of.iter_mut().zip(rows).for_each(|(to, lanes)| *to = lanes[frame].into());
            }
        }
    }
    // The last first, as what is written of it may reach into the first ones of the next frame. Few at a time: what is
    // written finds its way to memory while the next ones are computed.
    let all = &plan.fields[stretch.fields.clone()];
    let last = all.len().div_ceil(LANES).saturating_sub(1);
    let answers = outgoing.map_or_else(
        || {
            let mut announced = Announcement::of(cells);
            announced.turn_to(stretch.fields.start + last * LANES, frames, 1);
            announced.step();
            Answers::ToBeWritten(announced)
        },
        Answers::OnTheirWay,
    );
    let Scratch { pressures, statuses, tiles, cells: of_fields, between, faults, .. } = scratch;
    let skin = Skin { plan, pressures, statuses };
    let mut meanwhile = Meanwhile { ahead, answers, coming: Coming::default() };
    for chunk in std::iter::once(last).chain(0..last) {
        let fields = &all[chunk * LANES..all.len().min((chunk + 1) * LANES)];
        let steps = fields.len() * calls(plan.stages());
        let first_field = stretch.fields.start + chunk * LANES;
        let place = Place {
            fields: cells.fields(),
            first: first_field,
            count: fields.len(),
            frames,
            // Of later stretches the next frame's first fields have their answers.
            whole_rows: is_first,
        };
        let next = if chunk == last { stretch.fields.start } else { first_field + LANES };
        meanwhile.coming = Coming::new(tables, next..stretch.fields.start + last * LANES, pressures, steps);
        if let Answers::ToBeWritten(announced) = &mut meanwhile.answers {
            announced.turn_to(next, frames, steps);
        }
        let mut rests = [true; LANES];
        for (field, rests) in (first_field..).zip(&mut rests[..place.count]) {
            *rests = tables.rest.has_at_rest(field, |tile| tiles[tile].rests);
        }
        let rests = &rests[..place.count];
        if rests.iter().all(|&rests| rests) {
            (0..steps).for_each(|_| meanwhile.step());
            columns::write_at_rest(fields, place, plan.outputs, cells);
            continue;
        }
        with_widest!(level, simd => answer(simd, plan, tables, first_field, rests, &skin, *faults, &mut meanwhile, between, of_fields));
        with_widest!(level, simd => columns::write(simd, of_fields, place, plan.outputs, cells));
    }
}

/// What a core does beside computing, a little at a time.
struct Meanwhile<'a, 'b, 'c, 'd> {
    ahead: Ahead<'a>,
    answers: Answers<'b, 'c>,
    coming: Coming<'d>,
}

/// What answers ask for.
enum Answers<'b, 'c> {
    /// The next ones are written where the cache does not have it yet.
    ToBeWritten(Announcement),
    /// The last block's are on their way past the caches.
    OnTheirWay(&'b mut Outgoing<'c>),
}

impl Meanwhile<'_, '_, '_, '_> {
    #[inline(always)]
    fn step(&mut self) {
        self.ahead.step();
        self.coming.step();
        match &mut self.answers {
            Answers::ToBeWritten(announced) => announced.step(),
            Answers::OnTheirWay(outgoing) => outgoing.step(),
        }
    }
}

/// All stages for the fields from `first` on, of which `rests` says whether any pressure is to be seen, over sixteen frames.
#[inline(always)]
#[expect(clippy::too_many_arguments, reason = "as `block`")]
fn answer<S: Simd>(
    simd: S,
    plan: &Plan,
    tables: &Tables,
    first: usize,
    rests: &[bool],
    skin: &Skin<'_>,
    faults: bool,
    meanwhile: &mut Meanwhile<'_, '_, '_, '_>,
    between: &mut [Between; LANES],
    answers: &mut [Cells; LANES],
) {
    let wanted = Wanted { stages: plan.stages(), outputs: plan.columns, faults, care: plan.is_compensated() };
    let briefs = &tables.briefs[first..first + rests.len()];
    let sort = |index: usize| (rests[index], briefs[index].is_wide, briefs[index].unweighted);
    let mut start = 0;
    while start < briefs.len() {
        let alike = (start..briefs.len()).take_while(|&index| sort(index) == sort(start)).count();
        let run = start..start + alike;
        let (between, answers) = (&mut between[run.clone()], &mut answers[run.clone()]);
        let briefs = &briefs[run];
        // Once for all stages.
        macro_rules! answer {
            ($abreast:ident, $weighted:literal) => {{
                let lot = |index: usize| {
                    let (seen, field) = (&tables.seen[briefs[index].members()], first + start + index);
                    ($abreast(OverFrames::<$weighted> { skin, seen, field }), briefs[index].kind)
                };
                let mut lots = [lot(0); LANES];
                for (index, one) in lots.iter_mut().enumerate().take(alike).skip(1) {
                    *one = lot(index);
                }
                touch(
                    simd,
                    #[inline(always)]
                    |index| lots[index],
                    LANES,
                    wanted,
                    #[inline(always)]
                    || meanwhile.step(),
                    between,
                    answers,
                );
            }};
        }
        match sort(start) {
            (true, ..) => {
                for (cells, brief) in answers.iter_mut().zip(briefs) {
                    *cells = Cells::at_rest(&brief.kind);
                }
            }
            (_, true, _) => answer!(ManyAbreast, true),
            (_, _, true) => answer!(Abreast, false),
            _ => answer!(Abreast, true),
        }
        start += alike;
    }
}

/// Reads and calibrates some tiles of up to sixteen frames. Whether any value is anything but a plain number.
#[expect(clippy::too_many_arguments, reason = "as `block`")]
fn read(
    level: Level,
    plan: &Plan,
    tables: &Tables,
    raw: Rows<'_>,
    first: usize,
    frames: usize,
    tiles: Range<usize>,
    scratch: &mut Scratch,
) -> bool {
    let groups_of = |count: usize| {
        let tiles = tiles.clone();
        tiles.clone().step_by(count).map(move |start| start..tiles.end.min(start + count))
    };
    let comes_at_once = ahead::worth(raw, tiles.clone()).is_some();
    let count = if comes_at_once { tiles.len() } else { FETCHED };
    if comes_at_once || reads_rows_abreast(level) || groups_of(count).any(|group| ahead::worth(raw, group).is_some()) {
        let (some, mut faults) = (SomeFrames::new(raw, first, frames), false);
        for group in groups_of(count) {
            let next = group.end..tiles.end.min(group.end + count);
            let mut ahead = Ahead::new(raw, first..first + frames, next, group.len());
            faults |= with_widest!(level, simd => calibrate(simd, plan, tables, Some((&some, &mut ahead)), frames, group, scratch));
        }
        return faults;
    }
    let mut faults = false;
    for group in groups_of(GROUP) {
        for frame in 0..frames {
            let values = OneFrame::new(raw, first + frame);
            with_widest!(level, simd => {
                for (tile, bits) in group.clone().zip(scratch.bits.chunks_mut(LANES)) {
                    values.read(simd, tile, plan.calibrated(), &mut bits[frame]);
                }
            });
        }
        faults |= with_widest!(level, simd => calibrate(simd, plan, tables, None, frames, group, scratch));
    }
    faults
}

/// Calibrates tiles whose bits are there, or read from `raw` where they are not, while others are fetched; and turns them so
/// that a taxel's frames stand abreast. Whether any value is anything but a plain number.
#[inline(always)]
fn calibrate<S: Simd>(
    simd: S,
    plan: &Plan,
    tables: &Tables,
    mut raw: Option<(&SomeFrames<'_>, &mut Ahead<'_>)>,
    frames: usize,
    tiles: Range<usize>,
    scratch: &mut Scratch,
) -> bool {
    let mut any = false;
    let Aligned(pressures) = &mut Aligned([[0.0; LANES]; LANES]);
    let Aligned(statuses) = &mut Aligned([[0; LANES]; LANES]);
    let Aligned(bits) = &mut Aligned([[0; LANES]; LANES]);
    let Scratch { bits: there, .. } = scratch;
    for (index, &sort) in tiles.clone().zip(&tables.tiles.sorts[tiles.clone()]) {
        let tile = &tables.tiles.all[index];
        let slot = index * LANES;
        let place = slot & tables.window.mask();
        let bits = match &mut raw {
            Some((raw, ahead)) => {
                ahead.step();
                raw.read(simd, index, plan.calibrated(), bits);
                &bits[..frames]
            }
            None => &there[(index - tiles.start) * LANES..][..frames],
        };
        let mut faults = false;
        let is_pressed = calibrate::plain(simd, sort, tile, bits, pressures).unwrap_or_else(
            #[inline(always)]
            || {
                for ((bits, pressures), statuses) in bits.iter().zip(&mut *pressures).zip(&mut *statuses) {
                    faults |= calibrate::tile(simd, plan, tile, slot, bits, pressures, statuses);
                }
                faults || pressures[..frames].as_flattened().iter().any(|&pressure| pressure > 0.0)
            },
        );
        let rests = !is_pressed;
        let (abreast, kept) = (&mut scratch.pressures[place..place + LANES], &mut scratch.tiles[place / LANES]);
        if !rests {
            transpose(simd, |frame| cast_ref(&pressures[frame]), cast_slice_mut::<Row<f32>, Row<u32>>(abreast));
        } else if !kept.rests {
            abreast.fill([0.0; LANES]);
        }
        let abreast = &mut scratch.statuses[place..place + LANES];
        if faults {
            transpose(simd, |frame| &statuses[frame], abreast);
        } else if kept.faulty {
            abreast.fill([0; LANES]);
        }
        *kept = KeptTile { rests, faulty: faults };
        any |= faults;
    }
    any
}
