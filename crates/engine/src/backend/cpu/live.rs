//! One frame: sixteen fields abreast.

use std::ops::Range;

use fearless_simd::Level;
use fearless_simd::prelude::*;

use super::super::{RawBatch, Rows, Step};
use super::calibrate::{Calibrated, Tiles};
use super::gate::Gate;
use super::lanes::{LANES, with_widest};
use super::members::{InFrame, Kinds, MemberRows, OneKind};
use super::pipeline::{Abreast, Between, Wanted, all_stages};
use super::recording::the_one_before;
use super::wide::Wide;
use super::write::{Answers, FieldLanes, FilledColumns};
use super::{calibrate, change};
use crate::parallel::{Tasks, on_threads};
use crate::percept::CellsMut;
use crate::scene::Plan;
use crate::signal::RawValue;
use crate::stage::calibrate::UNUSABLE;

/// A frame, the one before it, and the time between them.
pub(super) struct Moment<'a> {
    now: (Rows<'a>, usize),
    before: (Rows<'a>, usize),
    step: &'a Step,
}

impl<'a> Moment<'a> {
    pub(super) fn new(raw: &RawBatch<'a>, frame: usize, before: &'a [RawValue]) -> Self {
        Self { now: (raw.rows, frame), before: the_one_before(raw.rows, frame, before), step: &raw.steps[frame] }
    }
}

/// From how many memberships on a frame is shared among the cores: below, waking them costs more than they save.
const SHARED: usize = 1 << 16;

pub(super) fn is_shared(plan: &Plan, threads: usize) -> bool {
    plan.memberships() >= SHARED && threads > 1
}

/// About how many rows are gathered before anything is computed of them: what was stored piece by piece can be loaded as
/// a whole only once it has reached the cache. With their weights and places they are to stay in the nearest one.
const GATHERED_ROWS: usize = 64;

/// Members' values side by side, and what one thread needs beside.
#[derive(Clone, Debug, Default)]
struct Gathered {
    values: Calibrated,
    between: Vec<Between>,
}

impl Gathered {
    fn reserve(&mut self, rows: usize, sets: usize) {
        if self.values.pressures.len() < rows {
            self.values = Calibrated::new(rows);
        }
        if self.between.len() < sets {
            self.between.resize(sets, Between::EMPTY);
        }
    }
}

/// The plan laid out for one frame, and the memory for it.
#[derive(Clone, Debug)]
pub(super) struct Live {
    wide: Vec<WideField>,
    narrow: Vec<Narrow>,
    /// How many of the narrow are computed together.
    together: usize,
    /// Per wide field, then per group of narrow ones.
    answers: Vec<Answers>,
    /// By slot, and a last row that is nobody's: unpressed and unusable.
    values: Calibrated,
    /// The values of the frame before, if there are changes.
    before: Calibrated,
    gathered: Gathered,
    /// Of the other threads that take part, where a frame is shared.
    others: Vec<Gathered>,
    gate: Option<Gate>,
    /// What is stale where no gate says it: all units.
    everything: Vec<bool>,
    columns: FilledColumns,
}

impl Live {
    pub(super) fn new(plan: &Plan) -> Self {
        let tiles = plan.slots().div_ceil(LANES);
        let (wide, mut narrow): (Vec<usize>, Vec<usize>) =
            (0..plan.fields.len()).partition(|&field| plan.fields[field].is_wide());
        // Fields of one size stay in their order.
        narrow.sort_by_key(|&field| std::cmp::Reverse(plan.fields[field].count));
        let unpressed = tiles * LANES;
        let groups = narrow.chunks(LANES);
        let mut narrow: Vec<Narrow> = groups.map(|fields| Narrow::new(plan, fields, unpressed)).collect();
        let mut first_row = 0;
        for group in &mut narrow {
            group.first_row = first_row;
            first_row += group.rows.count();
        }
        let most_rows = narrow.iter().map(|group| group.rows.count()).max().unwrap_or(0);
        let together = (GATHERED_ROWS / most_rows.max(1)).max(1);
        for groups in narrow.chunks_mut(together).filter(|groups| groups.iter().any(|group| group.rows.is_weighted())) {
            groups.iter_mut().for_each(|group| group.rows.weigh());
        }
        let slots_of = |field: usize| plan.members_of(&plan.fields[field]).iter().map(|member| member.slot);
        let gate = Gate::new(plan, wide.len() + narrow.len(), |unit| match unit.checked_sub(wide.len()) {
            None => slots_of(wide[unit]).collect(),
            Some(group) => narrow[group].lanes.fields().flat_map(slots_of).collect(),
        });
        let threads = crate::parallel::threads();
        let mut values = Calibrated::new(tiles + 1);
        values.statuses[tiles] = [UNUSABLE; LANES];
        Self {
            columns: FilledColumns::new(plan),
            gate,
            everything: vec![true; wide.len() + narrow.len()],
            answers: vec![Answers::EMPTY; wide.len() + narrow.len()],
            wide: wide.into_iter().map(|field| WideField::new(plan, field, unpressed)).collect(),
            narrow,
            together,
            values,
            before: Calibrated::new(if plan.has_changes() { tiles } else { 0 }),
            gathered: Gathered::default(),
            others: vec![Gathered::default(); if is_shared(plan, threads) { threads - 1 } else { 0 }],
        }
    }

    /// Computes everything anew in the next frame.
    pub(super) fn forget(&mut self) {
        if let Some(gate) = &mut self.gate {
            gate.forget();
        }
    }

    /// All stages for one frame, into `cells`, which is one frame.
    pub(super) fn frame(
        &mut self,
        level: Level,
        plan: &Plan,
        tiles: &Tiles,
        moment: &Moment<'_>,
        cells: &mut CellsMut<'_>,
    ) {
        let Self { values, before, gate, .. } = self;
        let mut gate = gate.as_mut().and_then(|gate| gate.is_due().then_some(gate));
        let is_shared = !self.others.is_empty();
        let mut faults = match &mut gate {
            Some(gate) => gate.pass(level, plan, tiles, moment.now, values),
            None if is_shared => calibrate::shared_frame(level, plan, tiles, moment.now, values),
            None => calibrate::frame(level, plan, tiles, moment.now, values),
        };
        if plan.has_changes() {
            calibrate::frame(level, plan, tiles, moment.before, before);
            let before = (before.pressures.as_flattened(), before.statuses.as_flattened());
            let (pressures, _) = values.pressures.as_flattened_mut().as_chunks_mut::<1>();
            let (statuses, _) = values.statuses.as_flattened_mut().as_chunks_mut::<1>();
            faults |= change::frames(plan, std::slice::from_ref(moment.step), before, pressures, statuses);
        }
        let (pressures, statuses) = (self.values.pressures.as_flattened(), self.values.statuses.as_flattened());
        let frame = Frame { level, plan, pressures, statuses, faults };
        let stale = gate.as_ref().map_or(&self.everything[..], |gate| gate.stale());
        let (wide, narrow) = self.answers.split_at_mut(self.wide.len());
        let (stale_wide, stale_narrow) = stale.split_at(self.wide.len());
        let together = self.together;
        // What little is left behind a gate is done before others are awake.
        let share = stale.iter().filter(|&&stale| stale).count() as f64 / stale.len().max(1) as f64;
        if is_shared && share * plan.memberships() as f64 >= SHARED as f64 {
            let fields = (&self.wide[..], &self.narrow[..], together);
            let gathered = (&mut self.gathered, &mut self.others[..]);
            frame.shared(fields, (wide, narrow), (stale_wide, stale_narrow), gathered);
        } else {
            let wide = self.wide.iter().zip(wide).zip(stale_wide).filter(|(_, stale)| **stale);
            wide.for_each(|((field, answer), _)| frame.wide(field, &mut self.gathered, answer));
            let narrow = self.narrow.chunks(together).zip(narrow.chunks_mut(together));
            for ((groups, answers), stale) in narrow.zip(stale_narrow.chunks(together)) {
                frame.stale(groups, stale, &mut self.gathered, answers);
            }
        }
        if !cells.pressures.is_empty() {
            for (kept, &pressure) in cells.pressures.iter_mut().zip(frame.pressures) {
                *kept = pressure.into();
            }
        }
        let (wide, narrow) = self.answers.split_at(self.wide.len());
        for (field, answer) in self.wide.iter().zip(wide) {
            self.columns.write_frame(&field.lanes, answer, cells);
        }
        for (group, answer) in self.narrow.iter().zip(narrow) {
            self.columns.write_frame(&group.lanes, answer, cells);
        }
    }
}

#[derive(Clone, Copy)]
struct Frame<'a> {
    level: Level,
    plan: &'a Plan,
    pressures: &'a [f32],
    statuses: &'a [u32],
    faults: bool,
}

impl Frame<'_> {
    /// Answers the fields that are stale: wide ones one by one, narrow ones in sets of `together` groups. There are as many threads
    /// as `own` and `others`, which they work in.
    #[inline(never)]
    fn shared(
        &self,
        (wide, narrow, together): (&[WideField], &[Narrow], usize),
        (wide_answers, narrow_answers): (&mut [Answers], &mut [Answers]),
        (stale_wide, stale_narrow): (&[bool], &[bool]),
        (own, others): (&mut Gathered, &mut [Gathered]),
    ) {
        let threads = 1 + others.len();
        let wide = wide.iter().zip(wide_answers).zip(stale_wide).filter(|(_, stale)| **stale);
        // A task is several sets of fields, so that taking one costs little, but each thread has about 16 tasks, so that all end together.
        let some = (narrow.len() / (16 * threads)).next_multiple_of(together).max(together);
        let narrow = narrow.chunks(some).zip(narrow_answers.chunks_mut(some)).zip(stale_narrow.chunks(some));
        let (wide, narrow) = (Tasks::new(wide), Tasks::new(narrow));
        let gathered = Tasks::new(std::iter::once(own).chain(others));
        on_threads(threads, || {
            let Some(gathered) = gathered.take() else { return };
            while let Some(((field, answer), _)) = wide.take() {
                self.wide(field, gathered, answer);
            }
            while let Some(((groups, answers), stale)) = narrow.take() {
                let pieces = groups.chunks(together).zip(answers.chunks_mut(together));
                for ((groups, answers), stale) in pieces.zip(stale.chunks(together)) {
                    self.stale(groups, stale, gathered, answers);
                }
            }
        });
    }

    /// A field alone, whose answer is the first lane of `answer`.
    #[inline(never)]
    fn wide(&self, field: &WideField, gathered: &mut Gathered, answer: &mut Answers) {
        let count = field.rows.count();
        gathered.reserve(count, 1);
        self.gather(&field.rows, &mut gathered.values, 0..count);
        let Gathered { values, between } = gathered;
        let members = Wide(InFrame::<true>::new(&field.rows, &values.pressures, &values.statuses));
        let (wanted, between) = (Wanted::new(self.plan, self.faults), &mut between[..1]);
        let answer = std::slice::from_mut(answer);
        with_widest!(self.level, simd => all_stages(simd, |_| (members, &field.kind), 1, wanted, between, answer));
    }

    /// Brings members' values side by side into `range` of the rows of `values`.
    fn gather(&self, rows: &MemberRows, values: &mut Calibrated, range: Range<usize>) {
        rows.gather(self.pressures, &mut values.pressures[range.clone()]);
        if self.faults {
            rows.gather(self.statuses, &mut values.statuses[range]);
        }
    }

    /// Answers the stale ones of `groups`, adjacent ones together.
    fn stale(&self, mut groups: &[Narrow], stale: &[bool], gathered: &mut Gathered, mut answers: &mut [Answers]) {
        for run in stale.chunk_by(|a, b| a == b) {
            let (now, later) = groups.split_at(run.len());
            let (into, rest) = answers.split_at_mut(run.len());
            if run[0] {
                self.piece(now, gathered, into);
            }
            (groups, answers) = (later, rest);
        }
    }

    #[inline(never)]
    fn piece(&self, groups: &[Narrow], gathered: &mut Gathered, answers: &mut [Answers]) {
        gathered.reserve(groups.iter().map(|group| group.rows.count()).sum(), groups.len());
        let mut first = 0;
        for group in groups {
            let end = first + group.rows.count();
            self.gather(&group.rows, &mut gathered.values, first..end);
            first = end;
        }
        if groups.iter().any(|group| group.rows.is_weighted()) {
            with_widest!(self.level, simd => self.narrow::<_, true>(simd, groups, gathered, answers));
        } else {
            with_widest!(self.level, simd => self.narrow::<_, false>(simd, groups, gathered, answers));
        }
    }

    #[inline(always)]
    fn narrow<S: Simd, const WEIGHTED: bool>(
        &self,
        simd: S,
        groups: &[Narrow],
        gathered: &mut Gathered,
        answers: &mut [Answers],
    ) {
        let wanted = Wanted::new(self.plan, self.faults);
        let Gathered { values: Calibrated { pressures, statuses }, between } = gathered;
        let (pressures, statuses) = (&pressures[..], &statuses[..]);
        all_stages(
            simd,
            #[inline(always)]
            |index| {
                let group = &groups[index];
                let first = group.first_row - groups[0].first_row;
                let members = InFrame::<WEIGHTED>::new(&group.rows, &pressures[first..], &statuses[first..]);
                (Abreast(members), &group.kinds)
            },
            LANES,
            wanted,
            &mut between[..groups.len()],
            answers,
        );
    }
}

/// A field of many members, which a frame's lanes share.
#[derive(Clone, Debug)]
struct WideField {
    lanes: FieldLanes,
    kind: OneKind,
    rows: MemberRows,
}

impl WideField {
    fn new(plan: &Plan, field: usize, unpressed: usize) -> Self {
        let own = &plan.fields[field];
        let rows = MemberRows::of_one(plan, own, unpressed);
        Self { lanes: FieldLanes::new(&[field]), kind: OneKind::new(own), rows }
    }
}

/// Sixteen narrow fields of about as many members, a lane each; fewer at the end.
#[derive(Clone, Debug)]
struct Narrow {
    lanes: FieldLanes,
    kinds: Kinds,
    rows: MemberRows,
    /// Rows of the groups before it.
    first_row: usize,
}

impl Narrow {
    fn new(plan: &Plan, fields: &[usize], unpressed: usize) -> Self {
        Self {
            lanes: FieldLanes::new(fields),
            kinds: Kinds::new(fields.iter().map(|&field| &plan.fields[field])),
            rows: MemberRows::of_each(plan, fields, unpressed),
            first_row: 0,
        }
    }
}
