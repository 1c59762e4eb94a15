//! From sixteen lanes to the cells of sixteen fields in one frame.

use bytemuck::cast_slice_mut;

use super::simd::{LANES, Row};
use super::touch::Cells;
use crate::percept::{CellsMut, Flags, Outputs};

/// Where lanes belong.
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

/// Puts a group's lanes where their fields belong.
pub(super) fn write(places: &impl Places, answer: &Cells, outputs: Outputs, cells: &mut CellsMut<'_>) {
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
