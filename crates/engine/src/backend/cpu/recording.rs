//! Many frames: sixteen frames of a field abreast.

use std::ops::Range;
use std::sync::{Arc, Mutex, PoisonError};

use bytemuck::{cast_ref, cast_slice_mut};
use fearless_simd::Level;
use fearless_simd::prelude::*;

use super::super::{RawBatch, Rows};
use super::calibrate::{Calibrated, Tiles};
use super::lanes::{Aligned, F, LANES, Row, U, load, load_u, splat, transpose, with_widest};
use super::members::{Members, OneKind, Sample};
use super::pipeline::{Abreast, Between, Wanted, all_stages};
use super::read::SomeFrames;
use super::wide::WideAbreast;
use super::window::{Rest, Stretch, Window};
use super::write::{Answers, FilledColumns, Place};
use super::{calibrate, change};
use crate::parallel;
use crate::percept::CellsMut;
use crate::scene::{Plan, PlanField};
use crate::signal::RawValue;
use crate::stage::layout::Member;

/// Memberships that one task takes at least, if it can: some ten microseconds.
const TASK_MEMBERSHIPS: usize = 1 << 14;

/// The plan as recordings read it, and the memory for it.
pub(super) struct Recording {
    window: Window,
    /// The plan's members, each with its slot's place in the window.
    seen: Arc<[Member]>,
    /// By field.
    briefs: Vec<Brief>,
    rest: Rest,
    columns: FilledColumns,
    /// What tasks work in, one for each that runs.
    scratches: Mutex<Vec<Scratch>>,
}

/// What all tasks of a call have in common.
#[derive(Clone, Copy)]
pub(super) struct Call<'a> {
    pub(super) level: Level,
    pub(super) plan: &'a Plan,
    pub(super) tiles: &'a Tiles,
    pub(super) raw: &'a RawBatch<'a>,
    /// The raw values of the frame before the first.
    pub(super) before: &'a [RawValue],
}

impl Recording {
    pub(super) fn new(plan: &Plan) -> Self {
        let window = Window::new(plan);
        let seen = window.members(plan);
        Self {
            briefs: Brief::all(plan),
            rest: Rest::new(&plan.fields, &seen),
            columns: FilledColumns::new(plan),
            scratches: Mutex::new(Vec::new()),
            seen,
            window,
        }
    }

    /// Runs a call on all threads, this one among them: each takes a part of what is left, ever smaller ones, so that none
    /// waits long for the others and frames that follow each other mostly stay together.
    pub(super) fn run(&self, call: Call<'_>, cells: CellsMut<'_>) {
        let least = (TASK_MEMBERSHIPS / call.plan.memberships().max(1)).max(1).next_multiple_of(LANES);
        let threads = parallel::threads().min(cells.frames().div_ceil(least));
        let rest = Mutex::new((0, Some(cells)));
        let take = || {
            let (first, rest) = &mut *rest.lock().unwrap_or_else(PoisonError::into_inner);
            let cells = rest.take().filter(|cells| cells.frames() > 0)?;
            let frames = (cells.frames() / (2 * threads)).max(least).next_multiple_of(LANES).min(cells.frames());
            let (part, later) = cells.split_at(frames);
            *rest = Some(later);
            *first += frames;
            Some((*first - frames, part))
        };
        parallel::on_threads(threads, || {
            while let Some((first, part)) = take() {
                self.part(call, first, part);
            }
        });
    }

    /// Runs the frames from `first` on, sixteen after the other.
    fn part(&self, call: Call<'_>, first: usize, cells: CellsMut<'_>) {
        let frames = cells.frames();
        let free = self.scratches.lock().unwrap_or_else(PoisonError::into_inner).pop();
        let mut scratch = free.unwrap_or_else(|| Scratch::new(call.plan, &self.window));
        let (mut rest, mut done) = (cells, 0);
        while done < frames {
            let (mut cells, later) = rest.split_at(LANES.min(frames - done));
            let raw = SomeFrames::new(call.raw.rows, first + done, cells.frames());
            for stretch in self.window.stretches() {
                self.stretch(call, first + done, &raw, stretch, &mut scratch, &mut cells);
            }
            (rest, done) = (later, done + LANES);
        }
        self.scratches.lock().unwrap_or_else(PoisonError::into_inner).push(scratch);
    }

    /// All stages for the fields of `stretch`, in as many frames from `first` on as `cells` has, which is at most sixteen.
    /// Those before have their answers by then.
    fn stretch(
        &self,
        call: Call<'_>,
        first: usize,
        raw: &SomeFrames<'_>,
        stretch: &Stretch,
        scratch: &mut Scratch,
        cells: &mut CellsMut<'_>,
    ) {
        let Call { level, plan, tiles, .. } = call;
        let is_first = stretch.fields.start == 0;
        if is_first {
            (scratch.faults, scratch.in_window.any_rests) = (false, false);
        }
        for range in stretch.reads.iter().filter(|range| !range.is_empty()) {
            scratch.faults |= scratch.in_window.read(level, plan, tiles, raw, range.clone());
        }
        if is_first && plan.has_changes() {
            self.add_changes(call, first, cells.frames(), scratch);
        }
        if is_first && !cells.pressures.is_empty() {
            scratch.in_window.keep_pressures(plan, cells);
        }
        let Scratch { in_window, answers, between, faults, .. } = scratch;
        let skin = Skin { plan, pressures: &in_window.values.pressures, statuses: &in_window.values.statuses };
        // The last first, as what is written of it may reach into the first ones of the next frame.
        let last = stretch.start_of_last_sixteen();
        for first_field in std::iter::once(last).chain((stretch.fields.start..last).step_by(LANES)) {
            let fields = &plan.fields[first_field..stretch.fields.end.min(first_field + LANES)];
            // Of later stretches the next frame's first fields have their answers.
            let place = Place::new(cells, first_field, fields.len(), is_first);
            let mut rests = [false; LANES];
            let ask = if in_window.any_rests { &mut rests[..fields.len()] } else { &mut [] };
            for (field, rests) in (first_field..).zip(ask) {
                *rests = self.rest.has_at_rest(field, |tile| in_window.tiles[tile].rests);
            }
            let rests = &rests[..fields.len()];
            if rests.iter().all(|&rests| rests) {
                self.columns.write_at_rest(fields, place, cells);
                continue;
            }
            with_widest!(level, simd => answer(simd, plan, self, first_field, rests, &skin, *faults, between, answers));
            with_widest!(level, simd => self.columns.write(simd, answers, place, cells));
        }
    }

    /// Puts changes behind the pressures that they are made of.
    fn add_changes(&self, call: Call<'_>, first: usize, frames: usize, scratch: &mut Scratch) {
        let Call { level, plan, tiles, raw, before } = call;
        let Scratch { in_window, before: last, faults, .. } = scratch;
        calibrate::frame(level, plan, tiles, the_one_before(raw.rows, first, before), last);
        let last = (last.pressures.as_flattened(), last.statuses.as_flattened());
        let steps = &raw.steps[first..first + frames];
        let Calibrated { pressures, statuses } = &mut in_window.values;
        *faults |= change::frames(plan, steps, last, pressures, statuses);
        in_window.tiles.iter_mut().for_each(|tile| tile.rests = false);
        in_window.any_rests = false;
    }
}

/// Where the frame before frame `frame` is; `before` has the one before the first.
pub(super) fn the_one_before<'a>(rows: Rows<'a>, frame: usize, before: &'a [RawValue]) -> (Rows<'a>, usize) {
    match frame.checked_sub(1) {
        Some(last) => (rows, last),
        None => (Rows::Packed { values: before, channels: before.len() }, 0),
    }
}

/// What a task needs to work in.
struct Scratch {
    in_window: InWindow,
    /// Sixteen fields' answers, a lane a frame.
    answers: Box<[Answers; LANES]>,
    between: Box<[Between; LANES]>,
    /// Pressures and statuses of the frame before, where there are changes.
    before: Calibrated,
    /// Whether any value of these frames so far is anything but a plain number.
    faults: bool,
}

impl Scratch {
    fn new(plan: &Plan, window: &Window) -> Self {
        let before = if plan.has_changes() { window.slots() / LANES } else { 0 };
        Self {
            in_window: InWindow::new(window),
            answers: Box::new([Answers::EMPTY; LANES]),
            between: Box::new([Between::EMPTY; LANES]),
            before: Calibrated::new(before),
            faults: false,
        }
    }
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

/// What is to be known of every field: little, and side by side.
#[derive(Clone, Copy, Debug)]
struct Brief {
    first: usize,
    count: usize,
    way: Way,
    kind: OneKind,
}

/// How a field's members are gone over.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Way {
    Unweighted,
    Weighted,
    Wide,
}

impl Brief {
    fn all(plan: &Plan) -> Vec<Self> {
        let brief = |field: &PlanField| {
            let narrow = if field.unweighted { Way::Unweighted } else { Way::Weighted };
            let way = if field.is_wide() { Way::Wide } else { narrow };
            Self { first: field.first, count: field.count, way, kind: OneKind::new(field) }
        };
        plan.fields.iter().map(brief).collect()
    }

    fn members(&self) -> Range<usize> {
        self.first..self.first + self.count
    }
}

impl<S: Simd, const WEIGHTED: bool> Members<S> for OverFrames<'_, WEIGHTED> {
    #[inline(always)]
    fn count(self) -> usize {
        self.seen.len()
    }

    #[inline(always)]
    fn sample(self, simd: S, member: usize, at: usize) -> Sample<S> {
        let Member { slot, weight, u, v } = self.seen[member];
        let pressure = load(simd, &self.skin.pressures[slot as usize], at);
        Sample {
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

/// Values of up to sixteen frames, as far as the window reaches.
struct InWindow {
    /// By slot, a lane a frame.
    values: Calibrated,
    tiles: Vec<TileState>,
    /// Whether any tile rests that was read for these frames.
    any_rests: bool,
    /// What a slot's number is cut to for its place here.
    mask: usize,
}

/// What is known of sixteen taxels in sixteen frames.
#[derive(Clone, Copy)]
struct TileState {
    /// All pressures and statuses are 0.
    rests: bool,
    /// Statuses say something.
    faulty: bool,
}

impl InWindow {
    fn new(window: &Window) -> Self {
        let slots = window.slots();
        Self {
            values: Calibrated::new(slots),
            tiles: vec![TileState { rests: true, faulty: false }; slots / LANES],
            any_rests: false,
            mask: window.mask(),
        }
    }

    fn keep_pressures(&self, plan: &Plan, cells: &mut CellsMut<'_>) {
        let (slots, frames) = (plan.slots(), cells.frames());
        let tiles = self.values.pressures[..slots.next_multiple_of(LANES)].chunks(LANES).zip(&self.tiles).enumerate();
        // Those at rest are 0 there already.
        for (tile, (rows, _)) in tiles.filter(|(_, (_, kept))| !kept.rests) {
            for frame in 0..frames {
                let frame_of = &mut cells.pressures[frame * slots..][tile * LANES..slots.min((tile + 1) * LANES)];
                frame_of.iter_mut().zip(rows).for_each(|(to, lanes)| *to = lanes[frame].into());
            }
        }
    }

    /// Reads and calibrates some tiles of up to sixteen frames. Whether any value is anything but a plain number.
    fn read(&mut self, level: Level, plan: &Plan, tiles: &Tiles, raw: &SomeFrames<'_>, range: Range<usize>) -> bool {
        with_widest!(level, simd => calibrated(simd, plan, tiles, raw, range.clone(), self))
    }
}

/// Reads and calibrates tiles, and turns them so that a taxel's frames stand abreast. Whether any value is anything but a plain number.
#[inline(always)]
fn calibrated<S: Simd>(
    simd: S,
    plan: &Plan,
    tiles: &Tiles,
    raw: &SomeFrames<'_>,
    range: Range<usize>,
    in_window: &mut InWindow,
) -> bool {
    let frames = raw.frames();
    let mut any = false;
    let Aligned(pressures) = &mut Aligned([[0.0; LANES]; LANES]);
    let Aligned(statuses) = &mut Aligned([[0; LANES]; LANES]);
    let Aligned(bits) = &mut Aligned([[0; LANES]; LANES]);
    let InWindow { values: kept_values, tiles: kept_tiles, any_rests, mask } = in_window;
    for (index, &sort) in range.clone().zip(&tiles.sorts[range]) {
        let tile = &tiles.all[index];
        let slot = index * LANES;
        let place = slot & *mask;
        raw.read(simd, index, plan.calibrated(), bits);
        let bits = &bits[..frames];
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
        *any_rests |= rests;
        let (abreast, kept) = (&mut kept_values.pressures[place..place + LANES], &mut kept_tiles[place / LANES]);
        if !rests {
            transpose(simd, |frame| cast_ref(&pressures[frame]), cast_slice_mut::<Row<f32>, Row<u32>>(abreast));
        } else if !kept.rests {
            abreast.fill([0.0; LANES]);
        }
        let abreast = &mut kept_values.statuses[place..place + LANES];
        if faults {
            transpose(simd, |frame| &statuses[frame], abreast);
        } else if kept.faulty {
            abreast.fill([0; LANES]);
        }
        *kept = TileState { rests, faulty: faults };
        any |= faults;
    }
    any
}

/// All stages for the fields from `first` on, over sixteen frames. `rests` says whether their pressures are all 0.
#[inline(always)]
#[expect(clippy::too_many_arguments, reason = "as `stretch`")]
fn answer<S: Simd>(
    simd: S,
    plan: &Plan,
    recording: &Recording,
    first: usize,
    rests: &[bool],
    skin: &Skin<'_>,
    faults: bool,
    between: &mut [Between; LANES],
    answers: &mut [Answers; LANES],
) {
    let wanted = Wanted::new(plan, faults);
    let briefs = &recording.briefs[first..first + rests.len()];
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
                let mut sets = [(&recording.seen[..0], &briefs[0].kind); LANES];
                for (set, brief) in sets.iter_mut().zip(briefs) {
                    *set = (&recording.seen[brief.members()], &brief.kind);
                }
                all_stages(
                    simd,
                    #[inline(always)]
                    |index| {
                        let ((seen, kind), field) = (sets[index], first + start + index);
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
                answers.iter_mut().zip(briefs).for_each(|(answers, brief)| *answers = Answers::untouched(&brief.kind));
            }
            Way::Wide => answer!(WideAbreast, true),
            Way::Unweighted => answer!(Abreast, false),
            Way::Weighted => answer!(Abreast, true),
        }
        start += alike;
    }
}
