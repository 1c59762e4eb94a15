//! One frame: sixteen fields abreast.

use fearless_simd::Level;
use fearless_simd::prelude::*;

use super::super::{RawBatch, Rows, Step};
use super::calibrate::Tiles;
use super::gate::Gate;
use super::lanes::{F, LANES, Lines, Row, U, load, load_u, with_widest};
use super::members::{Cells, Kinds, Members, Sample};
use super::pipeline::{Abreast, Between, Wanted, touch};
use super::recording::the_one_before;
use super::wide::{self, Table, Values, Wide};
use super::write::{Columned, Run, Sixteen};
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
    /// Frame `frame` of `raw`; `before` has the values of the frame before the first.
    pub(super) fn new(raw: &RawBatch<'a>, frame: usize, before: &'a [RawValue]) -> Self {
        Self { now: (raw.rows, frame), before: the_one_before(raw.rows, frame, before), step: &raw.steps[frame] }
    }
}

/// From how many memberships on a frame is shared among the cores: below, waking them costs more than they save.
const SHARED: usize = 1 << 16;

/// Whether `threads` share a frame of `plan`.
pub(super) fn is_shared(plan: &Plan, threads: usize) -> bool {
    plan.memberships() >= SHARED && threads > 1
}

/// About how many rows are gathered before anything is computed of them: what was stored piece by piece can be loaded as
/// a whole only once it has reached the cache. With their weights and places they are to stay in the nearest one.
const GATHERED_ROWS: usize = 64;

/// What one thread needs beside.
#[derive(Clone, Debug, Default)]
struct Gathered {
    pressures: Lines<f32>,
    statuses: Lines<u32>,
    between: Vec<Between>,
    values: Values,
}

/// The plan laid out for one frame, and the memory for it.
#[derive(Clone, Debug)]
pub(super) struct Live {
    wide: Vec<Table>,
    narrow: Vec<Narrow>,
    /// How many of the narrow are computed together.
    together: usize,
    /// Per wide field, then per group of narrow ones.
    answers: Vec<Cells>,
    /// By slot, and a last row of taxels that nothing presses, which is nobody's.
    pressures: Lines<f32>,
    statuses: Lines<u32>,
    /// Those of the frame before, where there are changes.
    before: (Lines<f32>, Lines<u32>),
    gathered: Gathered,
    /// Of the other threads that take part, where a frame is shared.
    others: Vec<Gathered>,
    gate: Option<Gate>,
    /// What is stale where no gate says it: all units.
    everything: Vec<bool>,
    columned: Columned,
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
            first_row += group.places.len();
        }
        let most_rows = narrow.iter().map(|group| group.places.len()).max().unwrap_or(0);
        let together = (GATHERED_ROWS / most_rows.max(1)).max(1);
        for groups in narrow.chunks_mut(together).filter(|groups| groups.iter().any(Narrow::is_weighted)) {
            groups.iter_mut().for_each(Narrow::weigh);
        }
        let slots_of = |field: usize| plan.members_of(&plan.fields[field]).iter().map(|member| member.slot);
        let gate = Gate::new(plan, wide.len() + narrow.len(), |unit| match unit.checked_sub(wide.len()) {
            None => slots_of(wide[unit]).collect(),
            Some(group) => narrow[group].fields.iter().flat_map(|&field| slots_of(field)).collect(),
        });
        let threads = crate::parallel::threads();
        let before = if plan.has_changes() { tiles } else { 0 };
        Self {
            columned: Columned::new(plan),
            gate,
            everything: vec![true; wide.len() + narrow.len()],
            answers: vec![Cells::EMPTY; wide.len() + narrow.len()],
            wide: wide.into_iter().map(|field| Table::new(plan, field)).collect(),
            narrow,
            together,
            pressures: Lines::new(tiles + 1, 0.0),
            statuses: Lines::new(tiles + 1, 0),
            before: (Lines::new(before, 0.0), Lines::new(before, 0)),
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
        let Self { pressures, statuses, before: (was, said), gate, .. } = self;
        let mut gate = gate.as_mut().and_then(|gate| gate.is_due().then_some(gate));
        let is_shared = !self.others.is_empty();
        let mut faults = match &mut gate {
            Some(gate) => gate.pass(level, plan, tiles, moment.now, pressures, statuses),
            None if is_shared => calibrate::shared_frame(level, plan, tiles, moment.now, pressures, statuses),
            None => calibrate::frame(level, plan, tiles, moment.now, pressures, statuses),
        };
        if plan.has_changes() {
            calibrate::frame(level, plan, tiles, moment.before, was, said);
            let before = (was.as_flattened(), said.as_flattened());
            let (pressures, statuses) = (pressures.as_flattened_mut(), statuses.as_flattened_mut());
            let (pressures, statuses) = (pressures.as_chunks_mut::<1>().0, statuses.as_chunks_mut::<1>().0);
            faults |= change::frames(plan, std::slice::from_ref(moment.step), before, pressures, statuses);
        }
        let frame = Frame {
            level,
            plan,
            pressures: self.pressures.as_flattened(),
            statuses: self.statuses.as_flattened(),
            faults,
        };
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
            wide.for_each(|((table, answer), _)| frame.wide(table, &mut self.gathered, answer));
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
        for (of, answer) in self.wide.iter().zip(wide) {
            self.columned.write_frame(&Run { first: of.field, count: 1 }, answer, cells);
        }
        for (group, answer) in self.narrow.iter().zip(narrow) {
            match group.together {
                Some(first) if group.fields.len() == LANES => self.columned.write_frame(&Sixteen(first), answer, cells),
                Some(first) => {
                    let run = Run { first, count: group.fields.len() };
                    self.columned.write_frame(&run, answer, cells);
                }
                None => self.columned.write_frame(&group.fields, answer, cells),
            }
        }
    }
}

/// A calibrated frame.
#[derive(Clone, Copy)]
struct Frame<'a> {
    level: Level,
    plan: &'a Plan,
    pressures: &'a [f32],
    statuses: &'a [u32],
    faults: bool,
}

impl Frame<'_> {
    /// Fields alone and in groups, so many of these together, those of them that are stale, by as many threads as have
    /// something to work in.
    #[inline(never)]
    fn shared(
        &self,
        (wide, narrow, together): (&[Table], &[Narrow], usize),
        (wide_answers, narrow_answers): (&mut [Cells], &mut [Cells]),
        (stale_wide, stale_narrow): (&[bool], &[bool]),
        (own, others): (&mut Gathered, &mut [Gathered]),
    ) {
        let threads = 1 + others.len();
        let wide = wide.iter().zip(wide_answers).zip(stale_wide).filter(|(_, stale)| **stale);
        // Several at a time, and yet enough to choose from.
        let some = (narrow.len() / (16 * threads)).next_multiple_of(together).max(together);
        let narrow = narrow.chunks(some).zip(narrow_answers.chunks_mut(some)).zip(stale_narrow.chunks(some));
        let (wide, narrow) = (Tasks::new(wide), Tasks::new(narrow));
        let gathered = Tasks::new(std::iter::once(own).chain(others));
        on_threads(threads, || {
            let Some(gathered) = gathered.take() else { return };
            while let Some(((table, answer), _)) = wide.take() {
                self.wide(table, gathered, answer);
            }
            while let Some(((groups, answers), stale)) = narrow.take() {
                let pieces = groups.chunks(together).zip(answers.chunks_mut(together));
                for ((groups, answers), stale) in pieces.zip(stale.chunks(together)) {
                    self.stale(groups, stale, gathered, answers);
                }
            }
        });
    }

    /// A field alone.
    fn wide(&self, table: &Table, gathered: &mut Gathered, answer: &mut Cells) {
        let values = &mut gathered.values;
        values.gather(table, self.faults, |slot| self.pressures[slot], |slot| self.statuses[slot]);
        wide::cell(self.level, self.plan, Wide { table, values }, self.faults, answer);
    }

    /// Those of `groups` that are stale, those side by side together.
    fn stale(&self, mut groups: &[Narrow], stale: &[bool], gathered: &mut Gathered, mut answers: &mut [Cells]) {
        for run in stale.chunk_by(|a, b| a == b) {
            let (now, later) = groups.split_at(run.len());
            let (into, rest) = answers.split_at_mut(run.len());
            if run[0] {
                self.piece(now, gathered, into);
            }
            (groups, answers) = (later, rest);
        }
    }

    /// Groups together.
    #[inline(never)]
    fn piece(&self, groups: &[Narrow], gathered: &mut Gathered, answers: &mut [Cells]) {
        let rows = groups.iter().map(|group| group.places.len()).sum();
        if gathered.pressures.len() < rows || gathered.between.len() < groups.len() {
            gathered.pressures = Lines::new(rows, 0.0);
            gathered.statuses = Lines::new(rows, 0);
            gathered.between.resize(groups.len(), Between::EMPTY);
        }
        let mut first = 0;
        for group in groups {
            let rows = first..first + group.places.len();
            group.gather(self.pressures, &mut gathered.pressures[rows.clone()]);
            if self.faults {
                group.gather(self.statuses, &mut gathered.statuses[rows.clone()]);
                self.leave_out_what_is_not_there(group, &mut gathered.statuses[rows.clone()]);
            }
            first = rows.end;
        }
        if groups.iter().any(Narrow::is_weighted) {
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
        answers: &mut [Cells],
    ) {
        let wanted = Wanted::new(self.plan, self.faults);
        let Gathered { pressures, statuses, between, .. } = gathered;
        touch(
            simd,
            #[inline(always)]
            |index| {
                let group = &groups[index];
                let rows = group.first_row - groups[0].first_row..;
                let members = InFrame::<WEIGHTED> {
                    group,
                    weights: group.weights.as_deref().unwrap_or_default(),
                    pressures: &pressures[rows.clone()],
                    statuses: &statuses[rows],
                };
                (Abreast(members), &group.kinds)
            },
            LANES,
            wanted,
            &mut between[..groups.len()],
            answers,
        );
    }

    /// Lanes that have no more members do not keep the others from being all unusable.
    fn leave_out_what_is_not_there(&self, group: &Narrow, statuses: &mut [Row<u32>]) {
        for (lane, &field) in group.fields.iter().enumerate() {
            for row in &mut statuses[self.plan.fields[field].count..group.places.len()] {
                row[lane] = UNUSABLE;
            }
        }
    }
}

/// Sixteen narrow fields of about as many members, a lane each.
#[derive(Clone, Debug)]
struct Narrow {
    /// Per lane, which field; fewer at the end.
    fields: Vec<usize>,
    /// Where they are, if one stands after the other.
    together: Option<usize>,
    kinds: Kinds,
    /// By member, where it has its value.
    slots: Lines<u32>,
    places: Vec<PlaceRow>,
    /// Rows of the groups before it.
    first_row: usize,
    /// None where all are 1.
    weights: Option<Lines<f32>>,
    depths: Lines<f32>,
    areas: Lines<f32>,
}

/// Where a member of each field of a group is.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
struct PlaceRow {
    u: Row<f32>,
    v: Row<f32>,
}

impl Narrow {
    /// The group of `fields`, whose lanes go on with slot `unpressed` where they have no more members.
    fn new(plan: &Plan, fields: &[usize], unpressed: usize) -> Self {
        let rows = fields.iter().map(|&field| plan.fields[field].count).max().unwrap_or(0);
        let blank = Lines::new(rows, 0.0);
        let mut group = Self {
            fields: fields.to_vec(),
            together: fields.iter().zip(fields[0]..).all(|(&field, expected)| field == expected).then_some(fields[0]),
            kinds: Kinds::EMPTY,
            slots: Lines::new(rows, unpressed as u32),
            places: vec![PlaceRow { u: [0.0; LANES], v: [0.0; LANES] }; rows],
            first_row: 0,
            weights: (!fields.iter().all(|&field| plan.fields[field].unweighted)).then(|| blank.clone()),
            depths: blank.clone(),
            areas: blank,
        };
        for (lane, field) in fields.iter().map(|&field| &plan.fields[field]).enumerate() {
            group.kinds.set(lane, field);
            for (row, (member, depth)) in plan.members_of(field).iter().zip(&field.depths).enumerate() {
                group.slots[row][lane] = member.slot;
                if let Some(weights) = &mut group.weights {
                    weights[row][lane] = member.weight;
                }
                group.places[row].u[lane] = member.u;
                group.places[row].v[lane] = member.v;
                group.depths[row][lane] = *depth;
                group.areas[row][lane] = plan.taxels[member.slot as usize].area;
            }
        }
        group
    }

    /// Brings its members' values side by side.
    fn gather<T: Copy>(&self, values: &[T], rows: &mut [Row<T>]) {
        for (row, slots) in rows.iter_mut().zip(&self.slots[..]) {
            for (value, &slot) in row.iter_mut().zip(slots) {
                *value = values[slot as usize];
            }
        }
    }

    fn is_weighted(&self) -> bool {
        self.weights.is_some()
    }

    /// Has weights from now on, of 1 if it had none.
    fn weigh(&mut self) {
        self.weights.get_or_insert_with(|| Lines::new(self.places.len(), 1.0));
    }
}

/// A group's values in this frame; `WEIGHTED` where weights are not all 1.
#[derive(Clone, Copy)]
struct InFrame<'a, const WEIGHTED: bool> {
    group: &'a Narrow,
    /// Empty if not `WEIGHTED`.
    weights: &'a [Row<f32>],
    pressures: &'a [Row<f32>],
    statuses: &'a [Row<u32>],
}

impl<S: Simd, const WEIGHTED: bool> Members<S> for InFrame<'_, WEIGHTED> {
    #[inline(always)]
    fn count(self) -> usize {
        self.group.places.len()
    }

    #[inline(always)]
    fn sample(self, simd: S, member: usize, at: usize) -> Sample<S> {
        let PlaceRow { u, v } = &self.group.places[member];
        let pressure = load(simd, &self.pressures[member], at);
        Sample {
            pressure,
            pull: if WEIGHTED { load(simd, &self.weights[member], at) * pressure } else { pressure },
            u: load(simd, u, at),
            v: load(simd, v, at),
        }
    }

    #[inline(always)]
    fn depth(self, simd: S, member: usize, at: usize) -> F<S> {
        load(simd, &self.group.depths[member], at)
    }

    #[inline(always)]
    fn area(self, simd: S, member: usize, at: usize) -> F<S> {
        load(simd, &self.group.areas[member], at)
    }

    #[inline(always)]
    fn status(self, simd: S, member: usize, at: usize) -> U<S> {
        load_u(simd, &self.statuses[member], at)
    }
}
