//! What the stages found in lanes, and from there to the columns of percepts: sixteen fields over sixteen frames, or sixteen
//! fields of one frame.

use bytemuck::{cast_ref, cast_slice_mut};
use fearless_simd::prelude::*;
use fearless_simd::u32x16;

use super::lanes::{Columns, F, LANES, Row, U, load_u, store, store_first, store_u, transpose};
use super::members::OneKind;
use crate::percept::{CellsMut, Component, Flags, Outputs, index_by_component};
use crate::scene::{Plan, PlanField};

/// What the stages found, a row each; lengths in metres.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
pub(super) struct Answers {
    pub(super) flags: Row<u32>,
    pub(super) present: Row<u32>,
    pub(super) active: Row<u32>,
    parts: [Row<f32>; Component::COUNT],
}

impl Answers {
    pub(super) const EMPTY: Self =
        Self { flags: [0; LANES], present: [0; LANES], active: [0; LANES], parts: [[0.0; LANES]; Component::COUNT] };

    /// The answers of a field that nothing presses.
    pub(super) fn untouched(kind: &OneKind) -> Self {
        let (flags, present) = kind.untouched();
        Self { flags: [flags; LANES], present: [present; LANES], ..Self::EMPTY }
    }

    #[inline(always)]
    pub(super) fn put<S: Simd>(&mut self, simd: S, part: Component, lanes: F<S>, at: usize) {
        store(simd, lanes, &mut self[part], at);
    }

    #[inline(always)]
    pub(super) fn add_status<S: Simd>(&mut self, simd: S, (flags, present): (U<S>, U<S>), at: usize) {
        let flags = load_u(simd, &self.flags, at) | flags;
        store_u(simd, flags, &mut self.flags, at);
        let present = load_u(simd, &self.present, at) | present;
        store_u(simd, present, &mut self.present, at);
    }
}

index_by_component!(Answers, Row<f32>, parts);

/// The columns that the stages up to axis fill for a plan.
#[derive(Clone, Debug)]
pub(super) struct FilledColumns {
    outputs: Outputs,
    parts: Vec<Component>,
    counts: bool,
}

impl FilledColumns {
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
    pub(super) fn write<S: Simd>(&self, simd: S, answers: &[Answers; LANES], place: Place, cells: &mut CellsMut<'_>) {
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
        let (column, mask) = (&mut *cells.present, self.outputs.low());
        transpose(simd, |field| &answers[field].present, &mut Target { column, place, mask });
    }

    /// Writes what [`Self::write`] would if none of `fields` has a pressure or a status.
    pub(super) fn write_at_rest(&self, fields: &[PlanField], place: Place, cells: &mut CellsMut<'_>) {
        let (mut flags, mut present) = ([0; LANES], [0; LANES]);
        for (field, (flags, present)) in fields.iter().zip(flags.iter_mut().zip(&mut present)) {
            (*flags, *present) = OneKind::new(field).untouched();
            *present &= self.outputs.low();
        }
        for frame in 0..place.frames {
            place.of_frame(cast_slice_mut(cells.flags), frame).copy_from_slice(&flags[..place.count]);
            place.of_frame(cells.present, frame).copy_from_slice(&present[..place.count]);
            if self.counts {
                place.of_frame(cells.active, frame).fill(0);
            }
        }
        for &part in &self.parts {
            (0..place.frames).for_each(|frame| place.of_frame(&mut cells[part], frame).fill(0.0));
        }
    }

    /// Writes the answers of fields of one frame.
    pub(super) fn write_frame(&self, lanes: &FieldLanes, answer: &Answers, cells: &mut CellsMut<'_>) {
        for &part in &self.parts {
            lanes.put(&answer[part], &mut cells[part]);
        }
        if self.counts {
            lanes.put(&answer.active, cells.active);
        }
        lanes.put(&answer.flags, cast_slice_mut::<Flags, u32>(cells.flags));
        let present = answer.present.map(|present| present & self.outputs.low());
        lanes.put(&present, cells.present);
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
    /// The place of `count` fields from `first` on in all frames of `cells`; `beyond` says whether a row may reach beyond its frame's
    /// last field.
    pub(super) fn new(cells: &CellsMut<'_>, first: usize, count: usize, beyond: bool) -> Self {
        let (fields, frames) = (cells.fields(), cells.frames());
        let is_whole = fields >= LANES && (beyond || count == LANES);
        let end = first + LANES;
        let whole = if is_whole && fields * frames >= end { (fields * frames - end) / fields + 1 } else { 0 };
        Self { fields, first, count, frames, whole: whole.min(frames) }
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
        let Self { column, place, mask } = self;
        let lanes = if *mask == u32::MAX { lanes } else { lanes & *mask };
        if frame < place.whole {
            lanes.store_slice(&mut column[frame * place.fields + place.first..][..LANES]);
        } else if frame < place.frames {
            store_first(lanes, place.of_frame(column, frame));
        }
    }
}

/// Up to sixteen fields of a frame, a lane each.
#[derive(Clone, Debug)]
pub(super) struct FieldLanes {
    fields: Vec<usize>,
    /// The first of them, if they stand one after the other.
    first: Option<usize>,
}

impl FieldLanes {
    pub(super) fn new(fields: &[usize]) -> Self {
        let are_consecutive = fields.iter().zip(fields[0]..).all(|(&field, expected)| field == expected);
        Self { fields: fields.to_vec(), first: are_consecutive.then_some(fields[0]) }
    }

    pub(super) fn fields(&self) -> impl Iterator<Item = usize> + '_ {
        self.fields.iter().copied()
    }

    fn put<T: Copy>(&self, row: &Row<T>, column: &mut [T]) {
        let count = self.fields.len();
        match self.first {
            // So many are copied without a call.
            Some(first) if count == LANES => column[first..first + LANES].copy_from_slice(row),
            Some(first) => column[first..first + count].copy_from_slice(&row[..count]),
            None => self.fields.iter().zip(row).for_each(|(&field, &value)| column[field] = value),
        }
    }
}
