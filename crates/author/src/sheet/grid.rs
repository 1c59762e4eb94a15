//! Sheets whose cells stand in rows and columns.

use super::mask;
use crate::body::{Sheet, SheetCell};
use crate::error::{Error, Result, failed};
use crate::limits::{MAX_CELLS, MAX_FIELDS};

/// How the cells of a grid are numbered.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum GridOrder {
    /// Row by row: the id is row · columns + column.
    #[default]
    Rows,
    /// Column by column: the id is column · rows + row.
    Columns,
}

/// Rows and columns of cells. Row 0 is at the top and column 0 at the left, as in a table; absent cells keep their numbers.
#[derive(Clone, Debug, PartialEq)]
pub struct SheetGrid {
    /// Number of rows.
    pub rows: u32,
    /// Number of columns.
    pub columns: u32,
    /// From one row to the next, m.
    pub row_pitch_m: f64,
    /// From one column to the next, m.
    pub column_pitch_m: f64,
    /// How cells are numbered.
    pub order: GridOrder,
    /// The id of the first cell.
    pub first_id: u32,
    /// Whether each cell is there, row by row; `None` for all.
    pub present: Option<Vec<bool>>,
    /// Fields of regions: how many from top to bottom, and from left to right.
    pub regions: Option<[u32; 2]>,
}

impl SheetGrid {
    /// A full grid of `rows` and `columns` that are `pitch_m` apart.
    #[must_use]
    pub fn new(rows: u32, columns: u32, pitch_m: f64) -> Self {
        Self {
            rows,
            columns,
            row_pitch_m: pitch_m,
            column_pitch_m: pitch_m,
            order: GridOrder::Rows,
            first_id: 0,
            present: None,
            regions: None,
        }
    }

    /// The same with the cells of a mask: a line for each row, with 1 for a cell that is there and 0 or nothing for one that
    /// is not, between commas, semicolons, tabs or spaces. Messages use `name`.
    ///
    /// # Errors
    /// It does not have as many rows and columns, or something else than 0 and 1; with the line.
    pub fn with_mask(self, name: &str, text: &str) -> Result<Self> {
        let present = mask::read(text, self.rows, self.columns).map_err(|e| e.at(name))?;
        Ok(Self { present: Some(present), ..self })
    }

    /// The id of the cell at `row` and `column`.
    #[must_use]
    pub fn id(&self, row: u32, column: u32) -> u32 {
        let number = match self.order {
            GridOrder::Rows => row * self.columns + column,
            GridOrder::Columns => column * self.rows + row,
        };
        self.first_id + number
    }

    /// Whether the cell at `row` and `column` is there.
    #[must_use]
    pub fn has(&self, row: u32, column: u32) -> bool {
        self.present.as_ref().is_none_or(|present| present[(row * self.columns + column) as usize])
    }

    /// The sheet called `name` with these cells around the origin of its coordinates.
    ///
    /// # Errors
    /// It has no cells, too many, or more regions than rows or columns; a pitch is invalid.
    pub fn sheet(&self, name: &str) -> Result<Sheet> {
        self.check()?;
        let mut cells = Vec::new();
        for (row, column) in self.all() {
            if self.has(row, column) {
                let (width, height) = (self.column_pitch_m, self.row_pitch_m);
                cells.push(SheetCell::rectangle(self.id(row, column), self.centre(row, column), width, height));
            }
        }
        if cells.is_empty() {
            return Err(Error::failed("none of its cells is there; mark those that are with 1"));
        }
        cells.sort_unstable_by_key(|cell| cell.id);
        Ok(Sheet { parts: self.parts(), ..Sheet::new(name, cells) })
    }

    fn all(&self) -> impl Iterator<Item = (u32, u32)> + use<> {
        let columns = self.columns;
        (0..self.rows).flat_map(move |row| (0..columns).map(move |column| (row, column)))
    }

    /// The middle of a cell.
    fn centre(&self, row: u32, column: u32) -> [f64; 2] {
        let from_middle =
            |index: u32, count: u32, pitch: f64| pitch * (f64::from(index) - (f64::from(count) - 1.0) / 2.0);
        [from_middle(column, self.columns, self.column_pitch_m), -from_middle(row, self.rows, self.row_pitch_m)]
    }

    /// The regions that have cells.
    fn parts(&self) -> Vec<(String, Vec<u32>)> {
        let Some([down, across]) = self.regions else { return Vec::new() };
        let start =
            |index: u32, of: u32, count: u32| (u64::from(index) * u64::from(count)).div_ceil(u64::from(of)) as u32;
        let mut parts = Vec::new();
        for r in 0..down {
            let rows = start(r, down, self.rows)..start(r + 1, down, self.rows);
            for c in 0..across {
                let columns = start(c, across, self.columns)..start(c + 1, across, self.columns);
                let cells = rows.clone().flat_map(|row| columns.clone().map(move |column| (row, column)));
                let ids: Vec<u32> = cells
                    .filter(|&(row, column)| self.has(row, column))
                    .map(|(row, column)| self.id(row, column))
                    .collect();
                if !ids.is_empty() {
                    parts.push((format!("r{}_c{}", r + 1, c + 1), ids));
                }
            }
        }
        parts
    }

    fn check(&self) -> Result<()> {
        let (rows, columns) = (self.rows, self.columns);
        if rows == 0 || columns == 0 || u64::from(rows) * u64::from(columns) > MAX_CELLS as u64 {
            return Err(failed!("a grid of {rows} rows and {columns} columns; give it 1 to {MAX_CELLS} cells"));
        }
        if self.present.as_ref().is_some_and(|present| present.len() != (rows * columns) as usize) {
            return Err(failed!("the cells that are there do not fit {rows} rows and {columns} columns"));
        }
        for pitch_m in [self.row_pitch_m, self.column_pitch_m] {
            if !(pitch_m.is_finite() && pitch_m > 0.0) {
                return Err(failed!("a pitch of {pitch_m} m is invalid; give one over 0"));
            }
        }
        match self.regions {
            Some([down, across]) if down == 0 || across == 0 || down > rows || across > columns => Err(failed!(
                "{down} × {across} regions do not fit {rows} rows and {columns} columns; ask for fewer, at least one"
            )),
            Some([down, across]) if u64::from(down) * u64::from(across) > MAX_FIELDS as u64 => Err(failed!(
                "{down} × {across} regions are over the {MAX_FIELDS} fields that a sheet may have; ask for fewer"
            )),
            _ => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ids_go_by_rows_or_by_columns_and_absent_cells_keep_theirs() {
        let rows = SheetGrid::new(2, 3, 0.01).with_mask("mask.csv", "1,0,1\n1,1,0\n").unwrap();
        let ids = |grid: &SheetGrid| grid.sheet("a").unwrap().cells.iter().map(|cell| cell.id).collect::<Vec<_>>();
        assert_eq!(ids(&rows), [0, 2, 3, 4]);
        let columns = SheetGrid { order: GridOrder::Columns, first_id: 100, ..rows };
        assert_eq!(ids(&columns), [100, 101, 103, 104]);
    }

    #[test]
    fn every_cell_is_in_one_region() {
        let grid = SheetGrid { regions: Some([3, 2]), ..SheetGrid::new(31, 11, 0.0086) };
        let sheet = grid.sheet("insole").unwrap();
        let mut held: Vec<u32> = sheet.parts.iter().flat_map(|(_, ids)| ids.clone()).collect();
        held.sort_unstable();
        assert_eq!((sheet.parts.len(), held), (6, (0..341).collect()));
        let sizes: Vec<usize> = sheet.parts.iter().map(|(_, ids)| ids.len()).collect();
        assert!(sizes.iter().all(|size| (50..=66).contains(size)), "{sizes:?}");
    }

    #[test]
    fn a_region_without_cells_is_left_out() {
        let grid = SheetGrid { regions: Some([1, 2]), ..SheetGrid::new(1, 2, 0.01) };
        let sheet = grid.with_mask("m", "0 1").unwrap().sheet("a").unwrap();
        assert_eq!(sheet.parts, [("r1_c2".to_owned(), vec![1])]);
    }

    #[test]
    fn a_pitch_of_its_own_each_way() {
        let grid = SheetGrid { column_pitch_m: 0.005, ..SheetGrid::new(4, 3, 0.0086) };
        let sheet = grid.sheet("a").unwrap();
        let [low, high] = sheet.extent();
        assert!((high[0] - low[0] - 0.015).abs() < 1e-12 && (high[1] - low[1] - 0.0344).abs() < 1e-12);
        assert!((sheet.cells[0].area_m2 - 0.0086 * 0.005).abs() < 1e-15);
    }

    #[test]
    fn what_no_grid_can_be_is_refused() {
        let why = |grid: SheetGrid| grid.sheet("a").unwrap_err().to_string();
        assert!(why(SheetGrid::new(0, 3, 0.01)).contains("0 rows"));
        assert!(why(SheetGrid::new(u32::MAX, u32::MAX, 0.01)).contains("cells"));
        assert!(why(SheetGrid::new(3, 3, -0.01)).contains("pitch"));
        assert!(why(SheetGrid { regions: Some([4, 1]), ..SheetGrid::new(3, 3, 0.01) }).contains("regions"));
        assert!(why(SheetGrid::new(1, 2, 0.01).with_mask("m", "0,0").unwrap()).contains("there"));
    }
}
