//! Plain matrices: a line for each frame with all its cells, row by row, and the time before them or not; or a block of rows
//! for each frame, with whatever between blocks. What the file does not say is given: rows and columns, pitch, rate, unit.

use super::layout::{Grid, Layout, next_value};
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
    /// The next row of a block.
    row: u32,
    values: Vec<RawValue>,
}

#[derive(Clone, Copy, PartialEq)]
enum Shape {
    /// A line for each frame.
    Line { has_time: bool },
    /// A block of rows for each frame.
    Block,
}

impl Matrix {
    pub(super) fn new(separator: Separator, grid: Grid, rate: Rate, unit: UnitOfP) -> Result<Self> {
        let grid = grid.check()?;
        let values = vec![RawValue::MISSING; grid.cells()];
        Ok(Self { separator, grid, unit, rate, shape: None, row: 0, values })
    }

    /// How frames stand in the file, by its first line of numbers.
    fn shape(&self, line: &[u8]) -> Result<Shape> {
        let mut cells = self.separator.cells(line).collect::<Vec<_>>();
        while cells.last().is_some_and(|word| word.is_empty()) {
            cells.pop();
        }
        let (count, whole) = (cells.len(), self.grid.cells());
        let Grid { rows, columns, .. } = self.grid;
        match count {
            _ if count == whole + 1 => Ok(Shape::Line { has_time: true }),
            // A single row is a line for each frame.
            _ if count == whole => Ok(Shape::Line { has_time: false }),
            _ if count == columns as usize => Ok(Shape::Block),
            _ => Err(failed!(
                "it has {count} cells: neither the {columns} columns of a row nor the {whole} cells of all {rows}; correct \
                 --grid"
            )),
        }
    }

    fn frame(&mut self, line: &[u8], has_time: bool, to: &mut Frame) -> Result<bool> {
        let mut cells = self.separator.cells(line);
        let time = if has_time { cells.next() } else { None };
        let wrong = || failed!("`{}` is not a time in seconds", time.map_or(String::new(), |word| word.to_string()));
        let t_s = time.map(|word| word.number().filter(|t| t.is_finite()).ok_or_else(wrong)).transpose()?;
        let count = self.values.len();
        to.clear();
        to.values.resize(count, RawValue::MISSING);
        for (index, slot) in to.values.iter_mut().enumerate() {
            let value = next_value(&mut cells).ok_or_else(|| failed!("it has {index} of {count} cells"))?;
            *slot = value.map_err(|e| e.at(format!("cell {}", index + 1)))?;
        }
        if let Some(more) = cells.next_filled() {
            return Err(failed!("`{more}` stands after the last of {count} cells"));
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
            return Err(failed!("`{more}` stands after the last of {columns} columns").at(&place));
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
        let is_between = self.row == 0 && self.shape != Some(Shape::Line { has_time: true });
        let is_row = self.separator.cells(line).next().is_some_and(|word| word.number().is_some() || word.is_empty());
        let is_blank = line.trim_ascii().is_empty();
        if is_blank && self.row == 0
            || !is_row && (is_between && self.shape != Some(Shape::Line { has_time: false }) || self.shape.is_none())
        {
            return Ok(false);
        }
        let shape = match self.shape {
            Some(shape) => shape,
            None => *self.shape.insert(self.shape(line)?),
        };
        match shape {
            Shape::Line { has_time } => self.frame(line, has_time, to),
            Shape::Block => self.block(line, to),
        }
    }

    fn end(&mut self, _: &mut Frame) -> Result<bool> {
        match self.row {
            0 => Ok(false),
            row => Err(failed!("the last frame has {row} of {} rows", self.grid.rows)),
        }
    }

    fn layout(&self) -> Layout {
        Layout { panels: vec![self.grid.panel("sensor", 0)], unit: self.unit }
    }
}
