//! The columns of a batch, to be written by a backend in single precision.

use std::ops::Range;

use glam::DVec3;

use super::batch::Values;
use super::columns::{Component, Host};
use super::{Flags, Outputs, Percepts};

/// A run of frames of single-precision percepts, to be written; columns that nobody asked for are empty.
pub(crate) struct CellsMut<'a> {
    fields: usize,
    slots: usize,
    /// Per frame and taxel, not per cell.
    pub(crate) pressures: &'a mut [f64],
    pub(crate) flags: &'a mut [Flags],
    pub(crate) present: &'a mut [u32],
    pub(crate) active: &'a mut [u32],
    pub(crate) parts: [&'a mut [f32]; Component::COUNT],
}

impl Percepts {
    /// All cells of single-precision percepts; `None` for double precision.
    pub(crate) fn cells_f32(&mut self) -> Option<CellsMut<'_>> {
        let Values::F32(parts) = &mut self.values else { return None };
        Some(CellsMut {
            fields: self.fields,
            slots: self.slots,
            pressures: &mut self.pressures,
            flags: &mut self.flags,
            present: &mut self.present,
            active: &mut self.active,
            parts: parts.each_mut().map(Vec::as_mut_slice),
        })
    }
}

index_by_component!(CellsMut<'_>, [f32], parts);

impl CellsMut<'_> {
    pub(crate) fn fields(&self) -> usize {
        self.fields
    }

    pub(crate) fn frames(&self) -> usize {
        self.flags.len() / self.fields.max(1)
    }

    pub(crate) fn split_at(mut self, frames: usize) -> (Self, Self) {
        let (fields, slots, cells) = (self.fields, self.slots, frames * self.fields);
        let first = Self {
            fields,
            slots,
            pressures: take_mut(&mut self.pressures, frames * slots),
            flags: take_mut(&mut self.flags, cells),
            present: take_mut(&mut self.present, cells),
            active: take_mut(&mut self.active, cells),
            parts: self.parts.each_mut().map(|part| take_mut(part, cells)),
        };
        (first, self)
    }

    /// The same cells again, for a shorter while.
    pub(crate) fn reborrow(&mut self) -> CellsMut<'_> {
        CellsMut {
            fields: self.fields,
            slots: self.slots,
            pressures: self.pressures,
            flags: self.flags,
            present: self.present,
            active: self.active,
            parts: self.parts.each_mut().map(|part| &mut **part),
        }
    }

    /// Sets a cell's flags and the quantities it holds, by their bits.
    #[cfg(feature = "gpu")]
    pub(crate) fn set_status(&mut self, cell: usize, flags: u32, present: u32) {
        self.flags[cell] = Flags::from_bits_truncate(flags);
        self.present[cell] = present;
    }
}

/// Takes the first `count` numbers off `column`; all of one that has fewer.
fn take<'a, T>(column: &mut &'a [T], count: usize) -> &'a [T] {
    column.split_off(..count.min(column.len())).unwrap_or_default()
}

fn take_mut<'a, T>(column: &mut &'a mut [T], count: usize) -> &'a mut [T] {
    column.split_off_mut(..count.min(column.len())).unwrap_or_default()
}

/// Cells whose centroids are put on the skin, with the columns that this fills; those that nobody asked for are empty.
pub(crate) struct PlaceCells<'a> {
    pub(crate) flags: &'a mut [Flags],
    present: &'a mut [u32],
    centroids: Centroids<'a>,
    in_world: &'a mut [bool],
    position: &'a mut [[f64; 3]],
    normal: &'a mut [[f64; 3]],
}

/// u, v and depth in the precision of the backend; depth may be empty.
enum Centroids<'a> {
    F32([&'a [f32]; 3]),
    F64([&'a [f64]; 3]),
}

impl Percepts {
    pub(crate) fn place_cells(&mut self, first: usize, frames: usize) -> PlaceCells<'_> {
        fn part<T>(column: &mut [T], cells: Range<usize>) -> &mut [T] {
            if column.is_empty() { column } else { &mut column[cells] }
        }
        fn parts<'a, T>(columns: [&'a [T]; 3], cells: &Range<usize>) -> [&'a [T]; 3] {
            columns.map(|column| if column.is_empty() { column } else { &column[cells.clone()] })
        }
        let cells = first * self.fields..(first + frames) * self.fields;
        const CENTROID: [Component; 3] = [Component::CentroidU, Component::CentroidV, Component::CentroidDepth];
        let centroids = match &self.values {
            Values::F32(columns) => Centroids::F32(parts(CENTROID.map(|part| &columns[part][..]), &cells)),
            Values::F64(columns) => Centroids::F64(parts(CENTROID.map(|part| &columns[part][..]), &cells)),
        };
        let [position, normal, ..] = &mut self.host;
        debug_assert_eq!((Host::Position as usize, Host::Normal as usize), (0, 1));
        PlaceCells {
            flags: &mut self.flags[cells.clone()],
            present: &mut self.present[cells.clone()],
            centroids,
            in_world: &mut self.in_world[cells.clone()],
            position: part(position.as_chunks_mut().0, cells.clone()),
            normal: part(normal.as_chunks_mut().0, cells),
        }
    }
}

impl PlaceCells<'_> {
    pub(crate) fn split_at(mut self, cells: usize) -> (Self, Self) {
        let centroids = match &mut self.centroids {
            Centroids::F32(columns) => Centroids::F32(columns.each_mut().map(|column| take(column, cells))),
            Centroids::F64(columns) => Centroids::F64(columns.each_mut().map(|column| take(column, cells))),
        };
        let first = Self {
            flags: take_mut(&mut self.flags, cells),
            present: take_mut(&mut self.present, cells),
            centroids,
            in_world: take_mut(&mut self.in_world, cells),
            position: take_mut(&mut self.position, cells),
            normal: take_mut(&mut self.normal, cells),
        };
        (first, self)
    }

    /// A cell's (u, v, depth), m; depth is 0 where it is not kept.
    #[inline(always)]
    pub(crate) fn centroid(&self, cell: usize) -> DVec3 {
        #[inline(always)]
        fn read<T: Copy + Default + Into<f64>>([u, v, depth]: &[&[T]; 3], cell: usize) -> DVec3 {
            DVec3::new(u[cell].into(), v[cell].into(), depth.get(cell).copied().unwrap_or_default().into())
        }
        match &self.centroids {
            Centroids::F32(columns) => read(columns, cell),
            Centroids::F64(columns) => read(columns, cell),
        }
    }

    /// Takes a cell's position away; `why` says it.
    pub(crate) fn remove_position(&mut self, cell: usize, why: Flags) {
        self.flags[cell] |= why;
        self.present[cell] &= !(Outputs::POSITION.bits() as u32);
    }

    /// Puts a cell's position (m) and normal where they are wanted.
    #[inline(always)]
    pub(crate) fn put(&mut self, cell: usize, position: DVec3, normal: DVec3, in_world: bool) {
        self.in_world[cell] = in_world;
        if let Some(to) = self.position.get_mut(cell) {
            *to = position.to_array();
        }
        if let Some(to) = self.normal.get_mut(cell) {
            *to = normal.to_array();
        }
    }
}
