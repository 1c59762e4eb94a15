//! From sixteen fields' answers, a lane a frame, to the columns of percepts.

use bytemuck::{cast_ref, cast_slice_mut};
use fearless_simd::prelude::*;
use fearless_simd::u32x16;

use super::simd::{LANES, Row};
use super::touch::{Cells, OneKind};
use super::transpose::{Columns, transpose};
use crate::percept::{CellsMut, Flags, Outputs};
use crate::scene::PlanField;

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

/// As many of the first lanes as `cells` has. In halves, as what goes by way of memory, and is read in pieces across those that
/// were stored, waits until all answers before it have left the core: a fifteenth of a recording's time. With vectors of eight
/// lanes and more a half is one piece.
#[inline(always)]
pub(super) fn store_first<S: Simd>(lanes: u32x16<S>, cells: &mut [u32]) {
    let (first, second) = lanes.split();
    let (half, cells) = match cells.split_first_chunk_mut::<8>() {
        Some((cells, rest)) => {
            first.store_slice(cells);
            (second, rest)
        }
        None => (first, cells),
    };
    let half: [u32; 8] = half.into();
    cells.copy_from_slice(&half[..cells.len()]);
}

/// All columns that stages here fill, as bits: flags and what is present, then what is 0 where nothing presses. Those that
/// nobody wants are empty.
pub(super) fn all<'a>(cells: &'a mut CellsMut<'_>) -> [&'a mut [u32]; 12] {
    [
        cast_slice_mut(cells.flags),
        cast_slice_mut(cells.present),
        cells.active,
        cast_slice_mut(cells.total),
        cast_slice_mut(cells.peak),
        cast_slice_mut(cells.area),
        cast_slice_mut(cells.centroid_u),
        cast_slice_mut(cells.centroid_v),
        cast_slice_mut(cells.centroid_depth),
        cast_slice_mut(cells.orientation),
        cast_slice_mut(cells.axis),
        cast_slice_mut(cells.anisotropy),
    ]
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

/// Writes answers where they belong.
#[inline(always)]
pub(super) fn write<S: Simd>(
    simd: S,
    answers: &[Cells; LANES],
    place: Place,
    outputs: Outputs,
    cells: &mut CellsMut<'_>,
) {
    floats(simd, answers, place, cells.total, |cells| &cells.total);
    floats(simd, answers, place, cells.peak, |cells| &cells.peak);
    floats(simd, answers, place, cells.area, |cells| &cells.area);
    floats(simd, answers, place, cells.centroid_u, |cells| &cells.u);
    floats(simd, answers, place, cells.centroid_v, |cells| &cells.v);
    floats(simd, answers, place, cells.centroid_depth, |cells| &cells.depth);
    floats(simd, answers, place, cells.orientation, |cells| &cells.orientation);
    floats(simd, answers, place, cells.axis, |cells| &cells.axis);
    floats(simd, answers, place, cells.anisotropy, |cells| &cells.anisotropy);
    let to = |column, mask| Target { column, place, mask };
    turn(simd, answers, |cells| &cells.active, to(&mut *cells.active, u32::MAX));
    turn(simd, answers, |cells| &cells.flags, to(cast_slice_mut::<Flags, u32>(cells.flags), u32::MAX));
    let present = cast_slice_mut::<Outputs, u32>(cells.present);
    turn(simd, answers, |cells| &cells.present, to(present, outputs.bits()));
}

#[inline(always)]
fn floats<S: Simd>(
    simd: S,
    answers: &[Cells; LANES],
    place: Place,
    column: &mut [f32],
    of: impl Fn(&Cells) -> &Row<f32>,
) {
    let to = Target { column: cast_slice_mut(column), place, mask: u32::MAX };
    turn(simd, answers, |cells| cast_ref(of(cells)), to);
}

/// Turns the rows that `of` gives into those of a column.
#[inline(always)]
fn turn<S: Simd>(simd: S, answers: &[Cells; LANES], of: impl Fn(&Cells) -> &Row<u32>, mut to: Target<'_>) {
    if !to.column.is_empty() {
        transpose(simd, |field| of(&answers[field]), &mut to);
    }
}

/// Writes what [`write`] would if none of `fields` has a pressure or a status.
pub(super) fn write_at_rest(fields: &[PlanField], place: Place, outputs: Outputs, cells: &mut CellsMut<'_>) {
    let (mut flags, mut present) = ([0; LANES], [0; LANES]);
    for (field, (flags, present)) in fields.iter().zip(flags.iter_mut().zip(&mut present)) {
        (*flags, *present) = OneKind::new(field).untouched();
        *present &= outputs.bits();
    }
    let [flags_of, present_of, others @ ..] = all(cells);
    for frame in 0..place.frames {
        place.of_frame(flags_of, frame).copy_from_slice(&flags[..place.count]);
        place.of_frame(present_of, frame).copy_from_slice(&present[..place.count]);
    }
    for column in others.into_iter().filter(|column| !column.is_empty()) {
        for frame in 0..place.frames {
            place.of_frame(column, frame).fill(0);
        }
    }
}
