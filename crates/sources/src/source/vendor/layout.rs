//! What a recording says of its sensors: panels of cells, with places and areas where it has them.

use super::text::{Cells, Word};
use crate::error::{Result, failed};
use crate::signal::{RawValue, UnitOfP};

/// Most cells of a recording, so that a damaged header does not fill the memory.
pub(super) const MAX_CELLS: u64 = 1 << 20;

/// The sensors of a recording.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Layout {
    /// Sheets of sensors, each a link of the body and a field.
    pub panels: Vec<Panel>,
    /// The unit of the values.
    pub unit: UnitOfP,
}

/// A flat sheet of sensors: an insole, a mat, one of several panels on a map.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Panel {
    /// Its name, unique in the recording.
    pub name: String,
    /// Its cells, in the order of the frames' values.
    pub cells: Vec<Cell>,
    /// Parts that the recording names, and the ids of their cells: fields of their own.
    pub parts: Vec<(String, Vec<u32>)>,
    /// Whether the recording says where the cells are.
    pub is_placed: bool,
    /// Where its origin is in the body, x to the right and y up the page, m. It only says where the panel is drawn.
    pub offset_m: [f64; 2],
}

/// One sensor.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Cell {
    /// Its taxel's id.
    pub id: u32,
    /// Its middle, x to the right and y up the page as the file prints it, m from the panel's origin.
    pub centre_m: [f64; 2],
    /// Its corners, one after the other, m.
    pub corners_m: [[f64; 2]; 4],
    /// Its area, m²; 0 if unknown.
    pub area_m2: f64,
}

impl Cell {
    /// A rectangle.
    pub(super) fn rectangle(id: u32, centre_m: [f64; 2], [width_m, height_m]: [f64; 2], area_m2: f64) -> Self {
        let corner = |x: f64, y: f64| [centre_m[0] + x * width_m / 2.0, centre_m[1] + y * height_m / 2.0];
        let corners_m = [corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
        Self { id, centre_m, corners_m, area_m2 }
    }
}

impl Layout {
    /// The ids of all cells, in the order of the frames' values.
    #[must_use]
    pub fn ids(&self) -> Vec<u32> {
        self.panels.iter().flat_map(|panel| &panel.cells).map(|cell| cell.id).collect()
    }

    /// Whether the recording says where every cell is.
    #[must_use]
    pub fn is_placed(&self) -> bool {
        self.panels.iter().all(|panel| panel.is_placed)
    }

    /// Draws the panels beside each other, from left to right, where they do not stand on one map.
    pub(super) fn side_by_side(&mut self) {
        const GAP_M: f64 = 0.03;
        let mut next_m = 0.0;
        for panel in &mut self.panels {
            let xs = panel.cells.iter().flat_map(|cell| cell.corners_m).map(|[x, _]| x);
            let (low, high) = xs.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(x), high.max(x)));
            panel.offset_m = [next_m - low, 0.0];
            next_m += high - low + GAP_M;
        }
        let shift_m = (next_m - GAP_M) / 2.0;
        self.panels.iter_mut().for_each(|panel| panel.offset_m[0] -= shift_m);
    }
}

/// Rows and columns of cells.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Grid {
    pub(super) rows: u32,
    pub(super) columns: u32,
    /// Width and height of a cell, m, where they are known.
    pub(super) pitch_m: Option<[f64; 2]>,
    /// The area of a cell, where it is not width times height, m².
    pub(super) area_m2: Option<f64>,
}

impl Grid {
    /// Refuses a grid of no cells or far too many.
    pub(super) fn check(self) -> Result<Self> {
        let cells = u64::from(self.rows) * u64::from(self.columns);
        if cells == 0 || cells > MAX_CELLS {
            let Self { rows, columns, .. } = self;
            return Err(failed!(
                "{rows} rows and {columns} columns are not a sensor; there are 1 to {MAX_CELLS} cells"
            ));
        }
        Ok(self)
    }

    /// Number of cells.
    pub(super) fn cells(self) -> usize {
        (self.rows * self.columns) as usize
    }

    /// The cell at `row` from the top and `column` from the left, around the grid's middle.
    pub(super) fn cell(self, id: u32, row: u32, column: u32) -> Cell {
        let [width_m, height_m] = self.pitch_m.unwrap_or_default();
        let from_middle = |index: u32, count: u32| f64::from(index) - (f64::from(count) - 1.0) / 2.0;
        let centre_m = [from_middle(column, self.columns) * width_m, -from_middle(row, self.rows) * height_m];
        let area_m2 = self.area_m2.unwrap_or(width_m * height_m);
        Cell::rectangle(id, centre_m, [width_m, height_m], area_m2)
    }

    /// A panel of all cells, whose ids go on from `first_id` row by row.
    pub(super) fn panel(self, name: &str, first_id: u32) -> Panel {
        let places = (0..self.rows).flat_map(|row| (0..self.columns).map(move |column| (row, column)));
        let cells = places.zip(first_id..).map(|((row, column), id)| self.cell(id, row, column)).collect();
        Panel { name: name.to_owned(), cells, is_placed: self.pitch_m.is_some(), ..Panel::default() }
    }
}

/// The value in a cell of a table: a number; nothing is a missing value.
pub(super) fn value(word: Word<'_>) -> Result<RawValue> {
    if word.is_empty() {
        return Ok(RawValue::MISSING);
    }
    word.number()
        .map(RawValue::new)
        .ok_or_else(|| failed!("`{word}` is not a number; correct the cell or leave it blank"))
}

/// The next of `cells` as such a value; `None` if there is none.
#[inline]
pub(super) fn next_value(cells: &mut Cells<'_>) -> Option<Result<RawValue>> {
    match cells.plain_number() {
        Some(number) => Some(Ok(RawValue::new(number))),
        None => cells.next().map(value),
    }
}
