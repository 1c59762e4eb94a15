//! Columns of a batch as plain arrays, for other languages.

use super::columns::{Column, Component, Store};
use super::{Components, Flags, Outputs, Percepts, Values};

/// The values of a column, frame by frame, field by field, components side by side.
#[derive(Clone, Debug, PartialEq)]
pub enum ColumnValues {
    /// In single precision; NaN where absent.
    F32(Vec<f32>),
    /// In double precision; NaN where absent.
    F64(Vec<f64>),
    /// Whole numbers; 0 where absent.
    U32(Vec<u32>),
}

impl Percepts {
    /// All values of `column`: frames × fields × components. `None` unless it was asked for.
    #[must_use]
    pub fn column(&self, column: &Column) -> Option<ColumnValues> {
        if !self.outputs().contains(column.output) {
            return None;
        }
        let is_there = self.presence_of(column.output);
        let cells = self.frames() * self.fields;
        Some(match (column.store, &self.values) {
            (Store::Active, _) => {
                let active_in = |cell: usize| if is_there(cell) { self.active[cell] } else { 0 };
                ColumnValues::U32((0..cells).map(active_in).collect())
            }
            (Store::Backend(parts), Values::F32(kept)) => {
                ColumnValues::F32(side_by_side(kept, parts, cells, is_there, f32::NAN))
            }
            (Store::Backend(parts), Values::F64(kept)) => {
                ColumnValues::F64(side_by_side(kept, parts, cells, is_there, f64::NAN))
            }
            (Store::Host(host), _) => {
                let mut values = self.host[host as usize].clone();
                for (cell, components) in values.chunks_exact_mut(column.components).enumerate() {
                    if !is_there(cell) {
                        components.fill(f64::NAN);
                    }
                }
                ColumnValues::F64(values)
            }
        })
    }

    /// By frame and field, whether the quantity of `output` is present.
    pub fn presence(&self, output: Outputs) -> impl ExactSizeIterator<Item = bool> + '_ {
        (0..self.frames() * self.fields).map(self.presence_of(output))
    }

    /// By frame and field, why quantities are absent, or in doubt.
    #[must_use]
    pub fn all_flags(&self) -> &[Flags] {
        &self.flags
    }

    /// By frame, its time, s.
    #[must_use]
    pub fn times_s(&self) -> &[f64] {
        &self.t_s
    }
}

fn side_by_side<T: Copy>(
    kept: &Components<T>,
    parts: &[Component],
    cells: usize,
    is_there: impl Fn(usize) -> bool,
    absent: T,
) -> Vec<T> {
    match *parts {
        [a] => rows([a], kept, cells, is_there, absent),
        [a, b] => rows([a, b], kept, cells, is_there, absent),
        [a, b, c] => rows([a, b, c], kept, cells, is_there, absent),
        _ => (0..cells)
            .flat_map(|cell| {
                let there = is_there(cell);
                parts.iter().map(move |&part| if there { kept[part][cell] } else { absent })
            })
            .collect(),
    }
}

/// [`side_by_side`] of a number of components that the compiler knows: in two thirds of the time.
fn rows<T: Copy, const N: usize>(
    parts: [Component; N],
    kept: &Components<T>,
    cells: usize,
    is_there: impl Fn(usize) -> bool,
    absent: T,
) -> Vec<T> {
    let columns = parts.map(|part| &kept[part][..cells]);
    let row = |cell| if is_there(cell) { columns.map(|column| column[cell]) } else { [absent; N] };
    (0..cells).map(row).collect::<Vec<[T; N]>>().into_flattened()
}
