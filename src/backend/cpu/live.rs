//! One frame: sixteen fields abreast.

use std::ops::Range;

use bytemuck::cast_slice_mut;
use fearless_simd::Level;
use fearless_simd::prelude::*;

use super::super::{RawBatch, Rows, Step};
use super::simd::{F, LANES, Row, U, load, load_u, with_widest};
use super::touch::{Abreast, Cells, Kinds, Members, OneKind, Part, touch};
use super::wide::{self, Table, Values, Wide};
use super::{Tables, calibrate, change, the_one_before};
use crate::percept::{CellsMut, Flags, Outputs};
use crate::scene::Plan;
use crate::signal::RawValue;

/// From how many memberships on a frame is shared among the cores: below, waking them costs more than they save.
const SHARED: usize = 1 << 16;

/// Sixteen narrow fields of about as many members, a lane each; or one wide field.
#[derive(Clone, Debug)]
enum Group {
    Narrow(Box<Narrow>),
    Wide { field: usize, kind: OneKind, table: usize },
}

impl Group {
    /// Rows that it gathers.
    fn rows(&self) -> usize {
        match self {
            Self::Narrow(group) => group.members.len(),
            Self::Wide { .. } => 0,
        }
    }
}

#[derive(Clone, Debug)]
struct Narrow {
    /// Per lane, which field; fewer at the end.
    fields: Vec<usize>,
    /// Where they are, if one stands after the other.
    together: Option<usize>,
    kinds: Kinds,
    /// By member; lanes that have no more go on with an unpressed one.
    slots: Slots,
    members: Vec<MemberRow>,
    depths: Vec<Row<f32>>,
    areas: Vec<Row<f32>>,
}

/// A plan of fewer slots than this has them as 16-bit numbers, which need no check against a table of as many values.
const NEAR: usize = 1 << 16;

/// Slots, a row a member.
#[derive(Clone, Debug)]
enum Slots {
    Near(Vec<Row<u16>>),
    Far(Vec<Row<u32>>),
}

impl Slots {
    /// Brings the values of all of them side by side.
    fn gather<T: Copy>(&self, values: &[T], rows: &mut [Row<T>]) {
        match (self, values.first_chunk::<NEAR>()) {
            (Self::Near(slots), Some(values)) => {
                for (row, slots) in rows.iter_mut().zip(slots) {
                    *row = slots.map(|slot| values[usize::from(slot)]);
                }
            }
            (Self::Near(slots), None) => {
                for (row, slots) in rows.iter_mut().zip(slots) {
                    *row = slots.map(|slot| values[usize::from(slot)]);
                }
            }
            (Self::Far(slots), _) => {
                for (row, slots) in rows.iter_mut().zip(slots) {
                    *row = slots.map(|slot| values[slot as usize]);
                }
            }
        }
    }
}

/// A member of each field of a group.
#[derive(Clone, Copy, Debug)]
struct MemberRow {
    weight: Row<f32>,
    u: Row<f32>,
    v: Row<f32>,
}

impl Narrow {
    fn new(plan: &Plan, fields: &[usize], unpressed: usize) -> Self {
        let rows = fields.iter().map(|&field| plan.fields[field].count).max().unwrap_or(0);
        let blank = vec![[0.0; LANES]; rows];
        let mut slots = vec![[unpressed as u32; LANES]; rows];
        let mut group = Self {
            fields: fields.to_vec(),
            together: fields.iter().zip(fields[0]..).all(|(&field, expected)| field == expected).then_some(fields[0]),
            kinds: Kinds::EMPTY,
            slots: Slots::Far(Vec::new()),
            members: vec![MemberRow { weight: [0.0; LANES], u: [0.0; LANES], v: [0.0; LANES] }; rows],
            depths: blank.clone(),
            areas: blank,
        };
        for (lane, field) in fields.iter().map(|&field| &plan.fields[field]).enumerate() {
            group.kinds.set(lane, field);
            for (row, (member, depth)) in plan.members_of(field).iter().zip(&field.depths).enumerate() {
                slots[row][lane] = member.slot;
                group.members[row].weight[lane] = member.weight;
                group.members[row].u[lane] = member.u;
                group.members[row].v[lane] = member.v;
                group.depths[row][lane] = *depth;
                group.areas[row][lane] = plan.taxels[member.slot as usize].area;
            }
        }
        group.slots = if unpressed < NEAR {
            Slots::Near(slots.into_iter().map(|row| row.map(|slot| slot as u16)).collect())
        } else {
            Slots::Far(slots)
        };
        group
    }
}

/// A group's values in this frame.
#[derive(Clone, Copy)]
struct OverFields<'a> {
    group: &'a Narrow,
    pressures: &'a [Row<f32>],
    statuses: &'a [Row<u32>],
}

impl<S: Simd> Members<S> for OverFields<'_> {
    #[inline(always)]
    fn count(self) -> usize {
        self.group.members.len()
    }

    #[inline(always)]
    fn part(self, simd: S, member: usize, at: usize) -> Part<S> {
        let MemberRow { weight, u, v } = &self.group.members[member];
        Part {
            pressure: load(simd, &self.pressures[member], at),
            weight: load(simd, weight, at),
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

/// Rows that are gathered before anything is computed of them: what was stored piece by piece can be loaded as a whole
/// only once it has reached the cache. They fill half of the smallest first-level cache.
const GATHERED_ROWS: usize = 256;

/// What one thread needs beside.
#[derive(Clone, Debug, Default)]
struct Gathered {
    pressures: Vec<Row<f32>>,
    statuses: Vec<Row<u32>>,
    values: Values,
}

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

/// The plan laid out for one frame, and the memory for it.
#[derive(Clone, Debug)]
pub(super) struct Live {
    groups: Vec<Group>,
    /// The groups that are computed together.
    pieces: Vec<Range<usize>>,
    /// Per group.
    answers: Vec<Cells>,
    /// By slot, and a last row of taxels that nothing presses.
    pressures: Vec<Row<f32>>,
    statuses: Vec<Row<u32>>,
    /// Those of the frame before, where there are changes.
    before: (Vec<Row<f32>>, Vec<Row<u32>>),
    gathered: Gathered,
    shared: bool,
}

impl Live {
    pub(super) fn new(plan: &Plan) -> Self {
        let tiles = plan.slots().div_ceil(LANES);
        let (mut wide, mut narrow) = (Vec::new(), Vec::new());
        for (field, of) in plan.fields.iter().enumerate() {
            if of.is_wide() {
                wide.push(Group::Wide { field, kind: OneKind::new(of), table: wide.len() });
            } else {
                narrow.push(field);
            }
        }
        // Fields of one size stay in their order.
        narrow.sort_by_key(|&field| std::cmp::Reverse(plan.fields[field].count));
        let unpressed = tiles * LANES;
        let room = if unpressed < NEAR { NEAR / LANES } else { tiles + 1 };
        let narrow = narrow.chunks(LANES).map(|fields| Group::Narrow(Box::new(Narrow::new(plan, fields, unpressed))));
        let groups: Vec<Group> = wide.into_iter().chain(narrow).collect();
        let mut pieces: Vec<Range<usize>> = Vec::new();
        let mut rows = 0;
        for (index, group) in groups.iter().enumerate() {
            rows += group.rows();
            match pieces.last_mut() {
                Some(piece) if rows <= GATHERED_ROWS => piece.end = index + 1,
                _ => {
                    rows = group.rows();
                    pieces.push(index..index + 1);
                }
            }
        }
        Self {
            answers: vec![Cells::EMPTY; groups.len()],
            groups,
            pieces,
            pressures: vec![[0.0; LANES]; room],
            statuses: vec![[0; LANES]; room],
            before: if plan.has_changes() {
                (vec![[0.0; LANES]; tiles], vec![[0; LANES]; tiles])
            } else {
                (Vec::new(), Vec::new())
            },
            gathered: Gathered::default(),
            shared: plan.memberships() >= SHARED && rayon::current_num_threads() > 1,
        }
    }

    /// All stages for one frame, into `cells`, which is one frame.
    pub(super) fn frame(
        &mut self,
        level: Level,
        plan: &Plan,
        tables: &Tables,
        moment: &Moment<'_>,
        cells: &mut CellsMut<'_>,
    ) {
        let Self { pressures, statuses, before: (was, said), .. } = self;
        let mut faults = calibrate::frame(level, plan, tables, moment.now, pressures, statuses);
        if plan.has_changes() {
            calibrate::frame(level, plan, tables, moment.before, was, said);
            let before = (was.as_flattened(), said.as_flattened());
            let (pressures, statuses) = (pressures.as_flattened_mut(), statuses.as_flattened_mut());
            let (pressures, statuses) = (pressures.as_chunks_mut::<1>().0, statuses.as_chunks_mut::<1>().0);
            faults |= change::frames(plan, std::slice::from_ref(moment.step), before, pressures, statuses);
        }
        let frame = Frame {
            level,
            plan,
            tables,
            pressures: self.pressures.as_flattened(),
            statuses: self.statuses.as_flattened(),
            faults,
        };
        if self.shared {
            frame.share(&self.groups, &self.pieces, &mut self.answers);
        } else {
            for piece in &self.pieces {
                let (groups, answers) = (&self.groups[piece.clone()], &mut self.answers[piece.clone()]);
                frame.piece(groups, &mut self.gathered, answers);
            }
        }
        if !cells.pressures.is_empty() {
            for (kept, &pressure) in cells.pressures.iter_mut().zip(frame.pressures) {
                *kept = pressure.into();
            }
        }
        for (group, answer) in self.groups.iter().zip(&self.answers) {
            match group {
                Group::Wide { field, .. } => write(&Run { first: *field, count: 1 }, answer, plan.outputs, cells),
                Group::Narrow(group) => match group.together {
                    Some(first) if group.fields.len() == LANES => write(&Sixteen(first), answer, plan.outputs, cells),
                    Some(first) => write(&Run { first, count: group.fields.len() }, answer, plan.outputs, cells),
                    None => write(&group.fields, answer, plan.outputs, cells),
                },
            }
        }
    }
}

/// A calibrated frame.
#[derive(Clone, Copy)]
struct Frame<'a> {
    level: Level,
    plan: &'a Plan,
    tables: &'a Tables,
    pressures: &'a [f32],
    statuses: &'a [u32],
    faults: bool,
}

impl Frame<'_> {
    /// Halves the pieces until one remains, and does the halves in parallel; `answers` begin with the first piece's.
    fn share(&self, groups: &[Group], pieces: &[Range<usize>], answers: &mut [Cells]) {
        match pieces {
            [] => {}
            [piece] => self.piece(&groups[piece.clone()], &mut Gathered::default(), answers),
            _ => {
                let (left, right) = pieces.split_at(pieces.len() / 2);
                let (mine, others) = answers.split_at_mut(right[0].start - left[0].start);
                rayon::join(|| self.share(groups, left, mine), || self.share(groups, right, others));
            }
        }
    }

    #[inline(never)]
    fn piece(&self, groups: &[Group], gathered: &mut Gathered, answers: &mut [Cells]) {
        let rows = groups.iter().map(Group::rows).sum();
        if gathered.pressures.len() < rows {
            gathered.pressures.resize(rows, [0.0; LANES]);
            gathered.statuses.resize(rows, [0; LANES]);
        }
        let mut first = 0;
        for group in groups {
            if let Group::Narrow(group) = group {
                let rows = first..first + group.members.len();
                group.slots.gather(self.pressures, &mut gathered.pressures[rows.clone()]);
                if self.faults {
                    group.slots.gather(self.statuses, &mut gathered.statuses[rows.clone()]);
                    self.leave_out_what_is_not_there(group, &mut gathered.statuses[rows.clone()]);
                }
                first = rows.end;
            }
        }
        let Gathered { pressures, statuses, values } = gathered;
        with_widest!(self.level, simd => self.narrow(simd, groups, pressures, statuses, answers));
        for (group, answer) in groups.iter().zip(answers) {
            if let Group::Wide { kind, table, .. } = group {
                let table: &Table = &self.tables.wide[*table];
                values.gather(table, self.faults, |slot| self.pressures[slot], |slot| self.statuses[slot]);
                wide::cell(self.level, self.plan, Wide { table, values }, kind, self.faults, answer);
            }
        }
    }

    #[inline(always)]
    fn narrow<S: Simd>(
        &self,
        simd: S,
        groups: &[Group],
        pressures: &[Row<f32>],
        statuses: &[Row<u32>],
        answers: &mut [Cells],
    ) {
        let mut first = 0;
        for (group, answer) in groups.iter().zip(answers) {
            if let Group::Narrow(group) = group {
                let members = OverFields { group, pressures: &pressures[first..], statuses: &statuses[first..] };
                let (stages, columns) = (self.plan.stages(), self.plan.columns);
                touch(simd, Abreast(members), &group.kinds, stages, columns, self.faults, answer);
                first += group.members.len();
            }
        }
    }

    /// Lanes that have no more members do not keep the others from being all unusable.
    fn leave_out_what_is_not_there(&self, group: &Narrow, statuses: &mut [Row<u32>]) {
        for (lane, &field) in group.fields.iter().enumerate() {
            for row in &mut statuses[self.plan.fields[field].count..group.members.len()] {
                row[lane] = crate::stage::calibrate::UNUSABLE;
            }
        }
    }
}

/// Where lanes belong.
trait Places {
    fn put<T: Copy>(&self, row: &Row<T>, column: &mut [T]);
}

impl Places for Vec<usize> {
    fn put<T: Copy>(&self, row: &Row<T>, column: &mut [T]) {
        for (&field, &value) in self.iter().zip(row) {
            column[field] = value;
        }
    }
}

/// Fields one after the other.
struct Run {
    first: usize,
    count: usize,
}

impl Places for Run {
    fn put<T: Copy>(&self, row: &Row<T>, column: &mut [T]) {
        column[self.first..self.first + self.count].copy_from_slice(&row[..self.count]);
    }
}

/// Sixteen fields one after the other: so many are copied without a call.
struct Sixteen(usize);

impl Places for Sixteen {
    fn put<T: Copy>(&self, row: &Row<T>, column: &mut [T]) {
        column[self.0..self.0 + LANES].copy_from_slice(row);
    }
}

/// Puts a group's lanes where their fields belong.
fn write(places: &impl Places, answer: &Cells, outputs: Outputs, cells: &mut CellsMut<'_>) {
    let floats = |row: &Row<f32>, column: &mut [f32]| {
        if !column.is_empty() {
            places.put(row, column);
        }
    };
    floats(&answer.total, cells.total);
    floats(&answer.peak, cells.peak);
    floats(&answer.area, cells.area);
    floats(&answer.u, cells.centroid_u);
    floats(&answer.v, cells.centroid_v);
    floats(&answer.depth, cells.centroid_depth);
    floats(&answer.orientation, cells.orientation);
    floats(&answer.axis, cells.axis);
    floats(&answer.anisotropy, cells.anisotropy);
    if !cells.active.is_empty() {
        places.put(&answer.active, cells.active);
    }
    places.put(&answer.flags, cast_slice_mut::<Flags, u32>(cells.flags));
    let present = answer.present.map(|present| present & outputs.bits());
    places.put(&present, cast_slice_mut::<Outputs, u32>(cells.present));
}
