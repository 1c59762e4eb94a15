//! Plain matrices: a line for each frame with all its cells, row by row, and the time before them or not, totals and a
//! label after them or not ([`Columns`]); or a block of rows for each frame, with whatever between blocks. What the file does not say is
//! given: rows and columns, pitch, rate, unit.

use super::super::time_column::TimeColumn;
use super::layout::{Grid, Layout, next_value};
use super::matrix_columns::{Columns, begins_row, is_narrow, is_row, recognise};
use super::parser::{Parser, Rate};
use super::text::Separator;
use crate::error::{Result, failed};
use crate::signal::{Frame, RawValue, UnitOfP};

/// Reads frames from lines.
pub(super) struct Matrix {
    separator: Separator,
    grid: Grid,
    unit: UnitOfP,
    rate: Rate,
    shape: Option<Shape>,
    /// What the first rows showed.
    columns: Option<Columns>,
    time: TimeColumn,
    /// Whether a row has been seen.
    has_begun: bool,
    /// The next row of a block.
    row: u32,
    values: Vec<RawValue>,
}

#[derive(Clone, Copy, PartialEq)]
enum Shape {
    /// A line for each frame, whose last `left_out` columns are no sensors.
    Line { has_time: bool, left_out: usize },
    /// A block of rows for each frame.
    Block,
}

impl Matrix {
    /// A reader of a text that begins with `head`.
    pub(super) fn new(separator: Separator, grid: Grid, rate: Rate, unit: UnitOfP, head: &[u8]) -> Result<Self> {
        let grid = grid.check()?;
        let values = vec![RawValue::MISSING; grid.cells()];
        let columns = recognise(separator, grid, head)?;
        let time = TimeColumn::new(columns.as_ref().and_then(|columns| columns.unit));
        let shape =
            columns.as_ref().map(|columns| Shape::Line { has_time: columns.has_time, left_out: columns.left_out });
        Ok(Self { separator, grid, unit, rate, shape, columns, time, has_begun: false, row: 0, values })
    }

    /// How frames stand in the file, by its first line of numbers, where the first rows did not show it.
    fn shape(&self, line: &[u8]) -> Result<Shape> {
        let mut cells = self.separator.cells(line).collect::<Vec<_>>();
        while cells.last().is_some_and(|word| word.is_empty()) {
            cells.pop();
        }
        let (count, whole) = (cells.len(), self.grid.cells());
        let Grid { rows, columns, .. } = self.grid;
        match count {
            _ if count == whole + 1 => Ok(Shape::Line { has_time: true, left_out: 0 }),
            // A single row is a line for each frame.
            _ if count == whole => Ok(Shape::Line { has_time: false, left_out: 0 }),
            _ if count == columns as usize => Ok(Shape::Block),
            _ => Err(failed!(
                "it has {count} cells: neither the {columns} columns of a row nor the {whole} cells of all {rows}; correct \
                 --grid"
            )),
        }
    }

    fn frame(&mut self, line: &[u8], has_time: bool, left_out: usize, to: &mut Frame) -> Result<bool> {
        let mut cells = self.separator.cells(line);
        let time = if has_time { cells.next() } else { None };
        let t_s = time.map(|word| self.time.read(&word.text(), word.number())).transpose()?;
        let count = self.values.len();
        to.clear();
        to.values.resize(count, RawValue::MISSING);
        for (index, slot) in to.values.iter_mut().enumerate() {
            let value = next_value(&mut cells).ok_or_else(|| failed!("it has {index} of {count} cells"))?;
            *slot = value.map_err(|e| e.at(format!("cell {}", index + 1)))?;
        }
        for _ in 0..left_out {
            cells.next();
        }
        if let Some(more) = cells.next_filled() {
            return Err(failed!("`{more}` follows the last of {count} cells"));
        }
        to.t_s = self.rate.time_of(t_s, None)?;
        Ok(true)
    }

    fn block(&mut self, line: &[u8], to: &mut Frame) -> Result<bool> {
        let Grid { rows, columns, .. } = self.grid;
        let mut cells = self.separator.cells(line);
        let first = (self.row * columns) as usize;
        let place = format!("row {}", self.row + 1);
        for (index, slot) in self.values[first..first + columns as usize].iter_mut().enumerate() {
            let value =
                next_value(&mut cells).ok_or_else(|| failed!("it has {index} of {columns} cells").at(&place))?;
            *slot = value.map_err(|e| e.at(format!("{place}, column {}", index + 1)))?;
        }
        if let Some(more) = cells.next_filled() {
            return Err(failed!("`{more}` follows the last of {columns} columns").at(&place));
        }
        self.row += 1;
        if self.row < rows {
            return Ok(false);
        }
        self.row = 0;
        to.clear();
        to.t_s = self.rate.time_of(None, None)?;
        to.values.clone_from(&self.values);
        Ok(true)
    }
}

impl Parser for Matrix {
    fn line(&mut self, line: &[u8], to: &mut Frame) -> Result<bool> {
        // Between frames anything may stand that does not begin with a number.
        let has_time = matches!(self.shape, Some(Shape::Line { has_time: true, .. }));
        let is_between = self.row == 0 && !has_time && !matches!(self.shape, Some(Shape::Line { .. }));
        let is_row = match self.has_begun {
            true => self.separator.cells(line).next().is_some_and(begins_row),
            false => is_row(self.separator, line, is_narrow(self.grid)),
        };
        let is_blank = line.trim_ascii().is_empty();
        let is_above = !self.has_begun && !is_row;
        if is_blank && self.row == 0 || is_above || !is_row && is_between {
            return Ok(false);
        }
        self.has_begun = true;
        let shape = match self.shape {
            Some(shape) => shape,
            None => *self.shape.insert(self.shape(line)?),
        };
        match shape {
            Shape::Line { has_time, left_out } => self.frame(line, has_time, left_out, to),
            Shape::Block => self.block(line, to),
        }
    }

    fn end(&mut self, _: &mut Frame) -> Result<bool> {
        match self.row {
            0 => Ok(false),
            row => Err(failed!("the last frame has {row} of {} rows", self.grid.rows)),
        }
    }

    fn go_on(&mut self) -> bool {
        self.rate.pass();
        matches!(self.shape, Some(Shape::Line { .. }))
    }

    fn understood(&self) -> Option<String> {
        self.columns.as_ref().map(|columns| columns.words.clone())
    }

    fn layout(&self) -> Layout {
        Layout { panels: vec![self.grid.panel("sensor", 0)], unit: self.unit }
    }
}
