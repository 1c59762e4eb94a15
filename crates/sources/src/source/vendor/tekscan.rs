//! Tekscan's ASCII (`.asf`, and the same as `.csv`): a header of keys, then for each frame a line and a table of the map.
//!
//! `B` marks places without a sensor. They also part panels: cells that touch each other, corners included, are one.

use super::layout::{Cell, Grid, Layout, Panel, value};
use super::parser::{AfterWrong, Parser, Rate};
use super::text::{Separator, Word, leading_number, metres};
use crate::error::{Error, Result, failed};
use crate::signal::{Frame, RawValue, UnitOfP};

/// Reads frames from lines.
pub(super) struct Tekscan {
    separator: Separator,
    rate: Rate,
    unit: Option<UnitOfP>,
    keys: Keys,
    /// By place on the map, row by row, the place of its value in frames; set by the first frame.
    map: Vec<Option<usize>>,
    panels: Vec<Panel>,
    values: Vec<RawValue>,
    /// Of the frame that is being read.
    frame: Option<Started>,
    /// The cells of the first frame.
    first_cells: Vec<Option<RawValue>>,
    after_wrong: AfterWrong,
}

struct Started {
    number: Option<u32>,
    t_s: Option<f64>,
    rows: u32,
}

#[derive(Default)]
struct Keys {
    rows: Option<u32>,
    columns: Option<u32>,
    row_spacing_m: Option<f64>,
    column_spacing_m: Option<f64>,
    cell_area_m2: Option<f64>,
    seconds_per_frame: Option<f64>,
}

impl Tekscan {
    pub(super) fn new(separator: Separator, rate: Rate, unit: Option<UnitOfP>) -> Self {
        Self {
            separator,
            rate,
            unit,
            keys: Keys::default(),
            map: Vec::new(),
            panels: Vec::new(),
            values: Vec::new(),
            frame: None,
            first_cells: Vec::new(),
            after_wrong: AfterWrong::default(),
        }
    }

    /// Takes a key of the header.
    fn key(&mut self, line: &[u8]) -> Result<()> {
        let text = super::text::decoded(line);
        let (key, value) = text.split_once([' ', ',', ';', '\t']).unwrap_or((&text, ""));
        let value = value.trim_matches([' ', ',', ';', '\t', '"']);
        let wrong = || failed!("`{key}` is `{}`, which is not a size", super::text::shortened(value));
        let number = || leading_number(value).filter(|(number, _)| *number > 0.0).ok_or_else(wrong);
        let count = || value.parse().ok().filter(|count| *count > 0).ok_or_else(wrong);
        let length = || number().and_then(|(number, unit)| Ok(number * metres(unit).ok_or_else(wrong)?));
        let area = || number().and_then(|(number, unit)| Ok(number * metres(unit).ok_or_else(wrong)?.powi(2)));
        let keys = &mut self.keys;
        match key.to_ascii_uppercase().as_str() {
            "ROWS" => keys.rows = Some(count()?),
            "COLS" => keys.columns = Some(count()?),
            "ROW_SPACING" => keys.row_spacing_m = Some(length()?),
            "COL_SPACING" => keys.column_spacing_m = Some(length()?),
            "SENSEL_AREA" => keys.cell_area_m2 = Some(area()?),
            "SECONDS_PER_FRAME" => keys.seconds_per_frame = Some(number()?.0),
            "UNITS" if self.unit.is_none() => self.unit = Some(value.parse()?),
            _ => {}
        }
        Ok(())
    }

    /// The columns of a row: those of the header, or of the first row.
    fn columns(&mut self, row: &[u8]) -> u32 {
        let separator = self.separator;
        let counted = || separator.cells(row).filter(|word| !word.is_empty()).count() as u32;
        *self.keys.columns.get_or_insert_with(counted)
    }

    fn row(&mut self, line: &[u8]) -> Result<()> {
        let columns = self.columns(line);
        let Some(frame) = &mut self.frame else { return Ok(()) };
        let row = frame.rows;
        let at = |column: u32| format!("row {}, column {}", row + 1, column + 1);
        if let Some(rows) = self.keys.rows.filter(|&rows| row >= rows) {
            return Err(failed!("a row follows the last of {rows}"));
        }
        frame.rows += 1;
        let mut cells = self.separator.cells(line);
        let is_first = self.map.is_empty();
        if is_first {
            Grid { rows: row + 1, columns, ..Grid::default() }.check()?;
        }
        for column in 0..columns {
            if !is_first
                && let Some(index) = self.map.get((row * columns + column) as usize).copied().flatten()
                && let Some(number) = cells.plain_number()
            {
                self.values[index] = RawValue::new(number);
                continue;
            }
            let Some(word) = cells.next() else {
                return Err(failed!("it has {column} of {columns} cells").at(format!("row {}", row + 1)));
            };
            let is_absent = word.is("B");
            if is_first {
                let cell = if is_absent { None } else { Some(value(word).map_err(|e| e.at(at(column)))?) };
                self.first_cells.push(cell);
                continue;
            }
            let index = self.map.get((row * columns + column) as usize).copied().flatten();
            match index {
                Some(index) if !is_absent => self.values[index] = value(word).map_err(|e| e.at(at(column)))?,
                None if !is_absent => {
                    return Err(failed!("`{word}` is where the first frame has no sensor").at(at(column)));
                }
                _ => {}
            }
        }
        match cells.next_filled() {
            Some(more) => Err(failed!("`{more}` follows the last of {columns} columns").at(format!("row {}", row + 1))),
            None => Ok(()),
        }
    }

    /// Gives the frame that is complete, if there is one.
    fn finish(&mut self, to: &mut Frame) -> Result<bool> {
        let Some(frame) = self.frame.take() else { return Ok(false) };
        let rows = *self.keys.rows.get_or_insert(frame.rows);
        if frame.rows != rows || rows == 0 {
            let number = frame.number.map_or("a frame".to_owned(), |number| format!("frame {number}"));
            return Err(failed!("{number} has {} of {rows} rows", frame.rows));
        }
        if self.map.is_empty() {
            self.find_panels(rows)?;
        }
        to.clear();
        let counted =
            frame.number.zip(self.keys.seconds_per_frame).map(|(number, step)| f64::from(number.max(1) - 1) * step);
        to.t_s = self.rate.time_of(frame.t_s.or(counted), frame.number)?;
        to.values.clone_from(&self.values);
        self.values.fill(RawValue::MISSING);
        Ok(true)
    }

    /// Parts the cells of the first frame into panels, from the top left on.
    fn find_panels(&mut self, rows: u32) -> Result<()> {
        let columns = self.keys.columns.unwrap_or_default();
        let grid = Grid { rows, columns, pitch_m: self.pitch_m(), area_m2: self.keys.cell_area_m2 }.check()?;
        let cells = std::mem::take(&mut self.first_cells);
        self.map = vec![None; cells.len()];
        let mut panel_of: Vec<Option<usize>> = vec![None; cells.len()];
        let mut panels: Vec<Vec<usize>> = Vec::new();
        for start in 0..cells.len() {
            if cells[start].is_none() || panel_of[start].is_some() {
                continue;
            }
            let (mut members, mut open) = (Vec::new(), vec![start]);
            panel_of[start] = Some(panels.len());
            while let Some(place) = open.pop() {
                members.push(place);
                let (row, column) = (place as u32 / columns, place as u32 % columns);
                for near_row in row.saturating_sub(1)..(row + 2).min(rows) {
                    for near_column in column.saturating_sub(1)..(column + 2).min(columns) {
                        let near = (near_row * columns + near_column) as usize;
                        if cells[near].is_some() && panel_of[near].is_none() {
                            panel_of[near] = Some(panels.len());
                            open.push(near);
                        }
                    }
                }
            }
            members.sort_unstable();
            panels.push(members);
        }
        if panels.is_empty() {
            return Err(Error::failed("the first frame has no sensor: all its cells are `B`"));
        }
        let single = panels.len() == 1;
        for (number, members) in panels.into_iter().enumerate() {
            let name = if single { "sensor".to_owned() } else { format!("panel_{}", number + 1) };
            self.panels.push(panel(&name, grid, &members));
            for place in members {
                self.map[place] = Some(self.values.len());
                self.values.push(cells[place].unwrap_or_default());
            }
        }
        Ok(())
    }

    fn pitch_m(&self) -> Option<[f64; 2]> {
        let Keys { row_spacing_m, column_spacing_m, .. } = self.keys;
        Some([column_spacing_m.or(row_spacing_m)?, row_spacing_m.or(column_spacing_m)?])
    }
}

/// The panel of the places `members` on a map, with its origin in its middle. A cell's id is its place on the map.
fn panel(name: &str, map: Grid, members: &[usize]) -> Panel {
    let mut cells: Vec<Cell> = members
        .iter()
        .map(|&place| map.cell(place as u32, place as u32 / map.columns, place as u32 % map.columns))
        .collect();
    let along = |axis: usize| {
        let ends = cells.iter().map(|cell| cell.centre_m[axis]);
        let (low, high) = ends.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(x), high.max(x)));
        (low + high) / 2.0
    };
    let offset_m = [along(0), along(1)];
    for cell in &mut cells {
        for point in std::iter::once(&mut cell.centre_m).chain(&mut cell.corners_m) {
            *point = [point[0] - offset_m[0], point[1] - offset_m[1]];
        }
    }
    Panel { name: name.to_owned(), cells, is_placed: map.pitch_m.is_some(), offset_m, ..Panel::default() }
}

impl Parser for Tekscan {
    fn line(&mut self, line: &[u8], to: &mut Frame) -> Result<bool> {
        let mut cells = self.separator.cells(line);
        if self.after_wrong.passes(|| cells.clone().next().is_some_and(|word| word.after("Frame ").is_some())) {
            return Ok(false);
        }
        let Some(word) = cells.next().filter(|_| !line.trim_ascii().is_empty()) else {
            // A blank line ends a frame whose number of rows is unknown.
            let ends = self.keys.rows.is_none() && self.frame.as_ref().is_some_and(|frame| frame.rows > 0);
            return if ends { self.finish(to) } else { Ok(false) };
        };
        if let Some(number) = word.after("Frame ") {
            let complete = self.finish(to);
            self.after_wrong.begin(&complete);
            let t_s = cells.next().and_then(Word::number);
            self.frame = Some(Started { number: number.parse().ok(), t_s, rows: 0 });
            return complete;
        }
        if word.is("@@") {
            return self.finish(to);
        }
        if self.frame.is_some() {
            return self.row(line).map(|()| false);
        }
        if !self.map.is_empty() {
            return Err(failed!("`{word}` is between frames; each begins with `Frame` and its number"));
        }
        self.key(line).map(|()| false)
    }

    fn end(&mut self, to: &mut Frame) -> Result<bool> {
        self.finish(to)
    }

    fn go_on(&mut self) -> bool {
        if self.map.is_empty() {
            return false;
        }
        self.rate.pass();
        self.values.fill(RawValue::MISSING);
        if self.after_wrong.pass_rest() {
            self.frame = None;
        }
        true
    }

    fn is_of_lines(&self) -> bool {
        true
    }

    fn layout(&self) -> Layout {
        Layout { panels: self.panels.clone(), unit: self.unit.unwrap_or_default() }
    }
}
