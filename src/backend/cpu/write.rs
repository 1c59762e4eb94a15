//! From lanes to the columns of percepts: sixteen fields over sixteen frames, or sixteen fields of one frame.

use bytemuck::{cast_ref, cast_slice_mut};
use fearless_simd::prelude::*;
use fearless_simd::u32x16;

use super::lanes::{Columns, LANES, Row, store_first, transpose};
use super::members::{Cells, OneKind};
use crate::percept::{CellsMut, Component, Flags, Outputs};
use crate::scene::{Plan, PlanField};

/// Which columns the stages up to axis fill for a plan.
#[derive(Clone, Debug)]
pub(super) struct Columned {
    outputs: Outputs,
    parts: Vec<Component>,
    counts: bool,
}

impl Columned {
    pub(super) fn new(plan: &Plan) -> Self {
        let motion = |part: &Component| part.column().is_some_and(|column| Outputs::MOTION.contains(column.output));
        let kept = |part: &Component| plan.columns.intersects(part.kept_for()) && !motion(part);
        Self {
            outputs: plan.outputs,
            parts: Component::ALL.iter().copied().filter(kept).collect(),
            counts: plan.columns.contains(Outputs::ACTIVE),
        }
    }

    /// Writes the answers of sixteen fields, a lane a frame, where they belong.
    #[inline(always)]
    pub(super) fn write<S: Simd>(&self, simd: S, answers: &[Cells; LANES], place: Place, cells: &mut CellsMut<'_>) {
        for &part in &self.parts {
            let column = cast_slice_mut(&mut cells[part]);
            transpose(simd, |field| cast_ref(&answers[field][part]), &mut Target { column, place, mask: u32::MAX });
        }
        if self.counts {
            let column = &mut *cells.active;
            transpose(simd, |field| &answers[field].active, &mut Target { column, place, mask: u32::MAX });
        }
        let column = cast_slice_mut::<Flags, u32>(cells.flags);
        transpose(simd, |field| &answers[field].flags, &mut Target { column, place, mask: u32::MAX });
        let (column, mask) = (cast_slice_mut::<Outputs, u32>(cells.present), self.outputs.bits());
        transpose(simd, |field| &answers[field].present, &mut Target { column, place, mask });
    }

    /// Writes what [`Self::write`] would if none of `fields` has a pressure or a status.
    pub(super) fn write_at_rest(&self, fields: &[PlanField], place: Place, cells: &mut CellsMut<'_>) {
        let (mut flags, mut present) = ([0; LANES], [0; LANES]);
        for (field, (flags, present)) in fields.iter().zip(flags.iter_mut().zip(&mut present)) {
            (*flags, *present) = OneKind::new(field).untouched();
            *present &= self.outputs.bits();
        }
        for frame in 0..place.frames {
            place.of_frame(cast_slice_mut(cells.flags), frame).copy_from_slice(&flags[..place.count]);
            place.of_frame(cast_slice_mut(cells.present), frame).copy_from_slice(&present[..place.count]);
            if self.counts {
                place.of_frame(cells.active, frame).fill(0);
            }
        }
        for &part in &self.parts {
            (0..place.frames).for_each(|frame| place.of_frame(&mut cells[part], frame).fill(0.0));
        }
    }

    /// Writes the answers of fields of one frame, a lane a field.
    pub(super) fn write_frame(&self, places: &impl Places, answer: &Cells, cells: &mut CellsMut<'_>) {
        for &part in &self.parts {
            places.put(&answer[part], &mut cells[part]);
        }
        if self.counts {
            places.put(&answer.active, cells.active);
        }
        places.put(&answer.flags, cast_slice_mut::<Flags, u32>(cells.flags));
        let present = answer.present.map(|present| present & self.outputs.bits());
        places.put(&present, cast_slice_mut::<Outputs, u32>(cells.present));
    }
}

/// Where answers go in a column.
#[derive(Clone, Copy)]
pub(super) struct Place {
    /// A frame's cells.
    fields: usize,
    /// The first of them that is written, and how many.
    first: usize,
    count: usize,
    frames: usize,
    /// Of how many frames a whole row is written, though it may reach into the next frame: what belongs there is written later.
    whole: usize,
}

impl Place {
    /// That of `count` fields from `first` on in all frames of `cells`; `beyond` says whether a row may reach beyond its frame's
    /// last field.
    pub(super) fn new(cells: &CellsMut<'_>, first: usize, count: usize, beyond: bool) -> Self {
        let (fields, frames) = (cells.fields(), cells.frames());
        let is_whole = fields >= LANES && (beyond || count == LANES);
        let end = first + LANES;
        let whole = if is_whole && fields * frames >= end { (fields * frames - end) / fields + 1 } else { 0 };
        Self { fields, first, count, frames, whole: whole.min(frames) }
    }

    /// Writes the row of `frame`, if there is such a frame.
    #[inline(always)]
    fn put<S: Simd>(self, frame: usize, row: u32x16<S>, column: &mut [u32]) {
        if frame < self.whole {
            row.store_slice(&mut column[frame * self.fields + self.first..][..LANES]);
        } else if frame < self.frames {
            store_first(row, self.of_frame(column, frame));
        }
    }

    /// The cells of one of the frames.
    #[inline(always)]
    fn of_frame<T>(self, column: &mut [T], frame: usize) -> &mut [T] {
        let start = frame * self.fields + self.first;
        &mut column[start..start + self.count]
    }
}

/// A column, and where in it answers go.
struct Target<'a> {
    column: &'a mut [u32],
    place: Place,
    mask: u32,
}

impl Columns for Target<'_> {
    #[inline(always)]
    fn put<S: Simd>(&mut self, _: S, frame: usize, lanes: u32x16<S>) {
        let lanes = if self.mask == u32::MAX { lanes } else { lanes & self.mask };
        self.place.put(frame, lanes, self.column);
    }
}

/// Where the lanes of one frame belong.
pub(super) trait Places {
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
pub(super) struct Run {
    pub(super) first: usize,
    pub(super) count: usize,
}

impl Places for Run {
    fn put<T: Copy>(&self, row: &Row<T>, column: &mut [T]) {
        column[self.first..self.first + self.count].copy_from_slice(&row[..self.count]);
    }
}

/// Sixteen fields one after the other: so many are copied without a call.
pub(super) struct Sixteen(pub(super) usize);

impl Places for Sixteen {
    fn put<T: Copy>(&self, row: &Row<T>, column: &mut [T]) {
        column[self.0..self.0 + LANES].copy_from_slice(row);
    }
}
