//! Many frames: sixteen frames of a field abreast.

use std::ops::Range;

use bytemuck::cast_slice_mut;
use fearless_simd::prelude::*;
use fearless_simd::{Level, f32x16, u32x16};

use super::super::{RawBatch, Rows};
use super::Tables;
use super::lines::{Aligned, Lines};
use super::lot::{Between, Wanted, touch};
use super::simd::{self, F, LANES, Row, U, load, load_u, splat, transpose, with_widest};
use super::touch::{Abreast, Cells, Members, OneKind, Part};
use super::wide::ManyAbreast;
use super::{calibrate, change};
use crate::percept::{CellsMut, Flags, Outputs};
use crate::scene::{Plan, PlanField};
use crate::stage::layout::{Member, Taxel};

/// What a task needs to work in.
pub(super) struct Scratch {
    /// By slot, as far as the window reaches, a lane a frame.
    pressures: Lines<f32>,
    statuses: Lines<u32>,
    /// Places of tiles whose statuses say something.
    faulty: Vec<bool>,
    /// Sixteen fields' answers, a lane a frame.
    cells: Box<[Cells; LANES]>,
    between: Box<[Between; LANES]>,
    /// Pressures and statuses of the frame before, where there are changes.
    before: (Lines<f32>, Lines<u32>),
}

impl Scratch {
    pub(super) fn new(plan: &Plan, tables: &Tables) -> Self {
        let kept = tables.window.slots();
        let before = if plan.has_changes() { kept / LANES } else { 0 };
        Self {
            pressures: Lines::new(kept, 0.0),
            statuses: Lines::new(kept, 0),
            faulty: vec![false; kept / LANES],
            cells: Box::new([Cells::EMPTY; LANES]),
            between: Box::new([Between::EMPTY; LANES]),
            before: (Lines::new(before, 0.0), Lines::new(before, 0)),
        }
    }
}

/// A field's members over sixteen frames; `WEIGHTED` where weights are not all 1.
#[derive(Clone, Copy)]
struct OverFrames<'a, const WEIGHTED: bool> {
    /// By slot.
    members: &'a [Member],
    /// The same, by place in the window.
    seen: &'a [Member],
    depths: &'a [f32],
    taxels: &'a [Taxel],
    pressures: &'a [Row<f32>],
    statuses: &'a [Row<u32>],
}

impl<'a, const WEIGHTED: bool> OverFrames<'a, WEIGHTED> {
    fn new(
        plan: &'a Plan,
        seen: &'a [Member],
        field: &'a PlanField,
        (pressures, statuses): (&'a [Row<f32>], &'a [Row<u32>]),
    ) -> Self {
        let seen = &seen[field.first..field.first + field.count];
        let members = plan.members_of(field);
        Self { members, seen, depths: &field.depths, taxels: &plan.taxels, pressures, statuses }
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
        let pressure = load(simd, &self.pressures[slot as usize], at);
        Part {
            pressure,
            pull: if WEIGHTED { splat(simd, weight) * pressure } else { pressure },
            u: splat(simd, u),
            v: splat(simd, v),
        }
    }

    #[inline(always)]
    fn depth(self, simd: S, member: usize, _: usize) -> F<S> {
        splat(simd, self.depths[member])
    }

    #[inline(always)]
    fn area(self, simd: S, member: usize, _: usize) -> F<S> {
        splat(simd, self.taxels[self.members[member].slot as usize].area)
    }

    #[inline(always)]
    fn status(self, simd: S, member: usize, at: usize) -> U<S> {
        load_u(simd, &self.statuses[self.seen[member].slot as usize], at)
    }
}

/// All stages for the frames of `raw` from `first` on, as many as `cells` has, which is at most sixteen; the one before
/// them is in `before`.
#[expect(clippy::too_many_arguments, reason = "what a plan is run with, and where")]
pub(super) fn block(
    level: Level,
    plan: &Plan,
    tables: &Tables,
    raw: &RawBatch<'_>,
    first: usize,
    before: (Rows<'_>, usize),
    scratch: &mut Scratch,
    cells: &mut CellsMut<'_>,
) {
    let frames = cells.frames();
    let window = &tables.window;
    let mut faults = false;
    let mut there = 0..0;
    if window.is_whole() {
        there = 0..window.slots() / LANES;
        let tiles = 0..tables.tiles.len();
        faults = with_widest!(level, simd => read(simd, plan, tables, raw.rows, first, frames, tiles, scratch));
    }
    if plan.has_changes() {
        let Scratch { pressures, statuses, before: (was, said), .. } = scratch;
        calibrate::frame(level, plan, tables, before, was, said);
        let before = (was.as_flattened(), said.as_flattened());
        faults |= change::frames(plan, &raw.steps[first..first + frames], before, pressures, statuses);
    }
    if !cells.pressures.is_empty() {
        let slots = plan.slots();
        for (slot, lanes) in scratch.pressures.iter().take(slots).enumerate() {
            for (frame, &pressure) in lanes.iter().take(frames).enumerate() {
                cells.pressures[frame * slots + slot] = pressure.into();
            }
        }
    }
    // The last first, as what is written of it may reach into the first ones of the next frame. Few at a time: what is
    // written finds its way to memory while the next ones are computed.
    let last = plan.fields.len().div_ceil(LANES).saturating_sub(1);
    for chunk in std::iter::once(last).chain(0..last) {
        let fields = &plan.fields[chunk * LANES..plan.fields.len().min((chunk + 1) * LANES)];
        for tiles in window.slide(&mut there, chunk).into_iter().filter(|tiles| !tiles.is_empty()) {
            faults |= with_widest!(level, simd => read(simd, plan, tables, raw.rows, first, frames, tiles, scratch));
        }
        if chunk + 1 < last {
            let ahead = window.slide(&mut there.clone(), chunk + 1).into_iter().flatten();
            ahead.for_each(|tile| (first..first + frames).for_each(|frame| simd::announce(raw.rows, frame, tile)));
        }
        let Scratch { pressures, statuses, cells: answers, between, .. } = &mut *scratch;
        let values = (&pressures[..], &statuses[..]);
        let place = Place { fields: cells.fields(), first: chunk * LANES, count: fields.len(), frames };
        place.announce(cells);
        with_widest!(level, simd => answer(simd, plan, &tables.seen, fields, values, faults, between, answers));
        with_widest!(level, simd => write(simd, answers, place, plan.outputs, cells));
    }
}

/// All stages for `fields`, over sixteen frames.
#[inline(always)]
#[expect(clippy::too_many_arguments, reason = "as `block`")]
fn answer<S: Simd>(
    simd: S,
    plan: &Plan,
    seen: &[Member],
    fields: &[PlanField],
    values: (&[Row<f32>], &[Row<u32>]),
    faults: bool,
    between: &mut [Between; LANES],
    answers: &mut [Cells; LANES],
) {
    let wanted = Wanted { stages: plan.stages(), outputs: plan.columns, faults, care: plan.is_compensated() };
    let mut first = 0;
    for run in fields.chunk_by(|a, b| (a.is_wide(), a.unweighted) == (b.is_wide(), b.unweighted)) {
        let (between, answers) = (&mut between[first..][..run.len()], &mut answers[first..][..run.len()]);
        let kind = |index: usize| OneKind::new(&run[index]);
        if run[0].is_wide() {
            let over = |index| ManyAbreast(OverFrames::<true>::new(plan, seen, &run[index], values));
            touch(simd, |index| (over(index), kind(index)), LANES, wanted, between, answers);
        } else if run[0].unweighted {
            let over = |index| Abreast(OverFrames::<false>::new(plan, seen, &run[index], values));
            touch(simd, |index| (over(index), kind(index)), LANES, wanted, between, answers);
        } else {
            let over = |index| Abreast(OverFrames::<true>::new(plan, seen, &run[index], values));
            touch(simd, |index| (over(index), kind(index)), LANES, wanted, between, answers);
        }
        first += run.len();
    }
}

/// Calibrates some tiles of up to sixteen frames, and turns them so that a taxel's frames stand abreast. Whether any value
/// is anything but a plain number.
#[inline(always)]
#[expect(clippy::too_many_arguments, reason = "as `block`")]
fn read<S: Simd>(
    simd: S,
    plan: &Plan,
    tables: &Tables,
    raw: Rows<'_>,
    first: usize,
    frames: usize,
    tiles: Range<usize>,
    scratch: &mut Scratch,
) -> bool {
    let mut any = false;
    let Aligned(bits) = &mut Aligned([[0; LANES]; LANES]);
    let Aligned(pressures) = &mut Aligned([[0.0; LANES]; LANES]);
    let Aligned(statuses) = &mut Aligned([[0; LANES]; LANES]);
    for (index, tile) in tiles.clone().zip(&tables.tiles[tiles]) {
        let slot = index * LANES;
        let place = slot & tables.window.mask();
        // All of them first: what was stored piece by piece is not yet to be had as a whole.
        for (frame, bits) in bits.iter_mut().take(frames).enumerate() {
            simd::read(simd, raw, first + frame, index, plan.calibrated(), tables.shuffles, bits);
        }
        let mut faults = false;
        for frame in 0..frames {
            let (pressures, statuses) = (&mut pressures[frame], &mut statuses[frame]);
            faults |= calibrate::tile(simd, plan, tile, slot, &bits[frame], pressures, statuses);
        }
        let turned: [f32x16<S>; LANES] = transpose(simd, |frame| pressures[frame]);
        for (lanes, turned) in scratch.pressures[place..place + LANES].iter_mut().zip(&turned) {
            turned.store_slice(lanes);
        }
        if faults {
            let turned: [u32x16<S>; LANES] = transpose(simd, |frame| statuses[frame]);
            for (lanes, turned) in scratch.statuses[place..place + LANES].iter_mut().zip(&turned) {
                turned.store_slice(lanes);
            }
        } else if scratch.faulty[place / LANES] {
            scratch.statuses[place..place + LANES].fill([0; LANES]);
        }
        scratch.faulty[place / LANES] = faults;
        any |= faults;
    }
    any
}

/// Writes answers where they belong.
#[inline(always)]
fn write<S: Simd>(simd: S, answers: &[Cells; LANES], place: Place, outputs: Outputs, cells: &mut CellsMut<'_>) {
    floats(simd, answers, place, cells.total, |cells| &cells.total);
    floats(simd, answers, place, cells.peak, |cells| &cells.peak);
    floats(simd, answers, place, cells.area, |cells| &cells.area);
    floats(simd, answers, place, cells.centroid_u, |cells| &cells.u);
    floats(simd, answers, place, cells.centroid_v, |cells| &cells.v);
    floats(simd, answers, place, cells.centroid_depth, |cells| &cells.depth);
    floats(simd, answers, place, cells.orientation, |cells| &cells.orientation);
    floats(simd, answers, place, cells.axis, |cells| &cells.axis);
    floats(simd, answers, place, cells.anisotropy, |cells| &cells.anisotropy);
    integers(simd, answers, place, cells.active, |cells| &cells.active, u32::MAX);
    integers(simd, answers, place, cast_slice_mut::<Flags, u32>(cells.flags), |cells| &cells.flags, u32::MAX);
    let present = cast_slice_mut::<Outputs, u32>(cells.present);
    integers(simd, answers, place, present, |cells| &cells.present, outputs.bits());
}

/// Where answers go in a column.
#[derive(Clone, Copy)]
struct Place {
    /// A frame's cells.
    fields: usize,
    /// The first of them that is written, and how many.
    first: usize,
    count: usize,
    frames: usize,
}

impl Place {
    /// Has the memory that is going to be written fetched meanwhile.
    fn announce(self, cells: &CellsMut<'_>) {
        let columns = [
            &cells.total[..],
            cells.peak,
            cells.area,
            cells.centroid_u,
            cells.centroid_v,
            cells.centroid_depth,
            cells.orientation,
            cells.axis,
            cells.anisotropy,
        ];
        for column in columns {
            self.announce_column(column);
        }
        self.announce_column(cells.active);
        self.announce_column(cells.flags);
        self.announce_column(cells.present);
    }

    /// Of a row, where it begins: its end is where the one that was written before began.
    fn announce_column<T>(self, column: &[T]) {
        for frame in 0..self.frames {
            if let Some(cell) = column.get(frame * self.fields + self.first) {
                simd::soon_needed(cell);
            }
        }
    }

    /// Writes a row for each frame.
    #[inline(always)]
    fn put<S: Simd, V: SimdBase<S>>(self, rows: &[V; LANES], column: &mut [V::Element]) {
        for (frame, row) in rows.iter().take(self.frames).enumerate() {
            let start = frame * self.fields + self.first;
            // A whole row, though it may reach into the next frame: what belongs there is written later.
            match column.get_mut(start..start + LANES) {
                Some(cells) if self.fields >= LANES => row.store_slice(cells),
                _ => column[start..start + self.count].copy_from_slice(&row.as_slice()[..self.count]),
            }
        }
    }
}

#[inline(always)]
fn floats<S: Simd>(
    simd: S,
    answers: &[Cells; LANES],
    place: Place,
    column: &mut [f32],
    of: impl Fn(&Cells) -> &Row<f32>,
) {
    if !column.is_empty() {
        let rows: [f32x16<S>; LANES] = transpose(simd, |field| *of(&answers[field]));
        place.put(&rows, column);
    }
}

#[inline(always)]
fn integers<S: Simd>(
    simd: S,
    answers: &[Cells; LANES],
    place: Place,
    column: &mut [u32],
    of: impl Fn(&Cells) -> &Row<u32>,
    mask: u32,
) {
    if !column.is_empty() {
        let rows: [u32x16<S>; LANES] = transpose(simd, |field| of(&answers[field]).map(|bits| bits & mask));
        place.put(&rows, column);
    }
}
