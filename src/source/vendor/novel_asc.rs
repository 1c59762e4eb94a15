//! novel's `.asc`: pedar's insoles and pliance's mats and gloves. A header, the numbers of the sensors, and a row for each
//! frame: its time, then the pressures.
//!
//! Of pliance the places of the sensors stand after the rows, so that such a file is read twice; of pedar they stand nowhere.

use super::layout::{Cell, Layout, MAX_CELLS, Panel, value};
use super::parser::{Parser, Rate};
use super::text::{Separator, decoded};
use crate::error::{Error, Result, failed};
use crate::signal::{Frame, RawValue, UnitOfP};

const CM: f64 = 0.01;

/// Reads frames from lines.
pub(super) struct NovelAsc {
    rate: Rate,
    unit: Option<UnitOfP>,
    /// What the first pass found.
    places: Option<Places>,
    /// The sides that the header names.
    sides: [bool; 2],
    /// The sensors' numbers as the table is headed.
    sensors: Vec<u32>,
    place: Place,
}

#[derive(Clone, Copy, PartialEq)]
enum Place {
    Header,
    Table,
    After,
}

impl NovelAsc {
    pub(super) fn new(rate: Rate, unit: Option<UnitOfP>, places: Option<Places>) -> Self {
        Self { rate, unit, places, sides: [false; 2], sensors: Vec::new(), place: Place::Header }
    }

    fn header(&mut self, line: &[u8]) -> Result<()> {
        let text = decoded(line);
        let text = text.trim();
        if let Some((_, unit)) = text.split_once("pressure values in").filter(|_| self.unit.is_none()) {
            self.unit = Some(unit.parse()?);
        }
        for (side, name) in self.sides.iter_mut().zip(["left insole:", "right insole:"]) {
            *side |= text.strip_prefix(name).is_some_and(|sensors| sensors.contains(|c: char| c.is_ascii_digit()));
        }
        if text.starts_with("time[") {
            let words = Separator::Blanks.cells(line).skip(1);
            let sensors: Option<Vec<u32>> = words.map(|word| word.whole()).collect();
            self.sensors = sensors.filter(|sensors| !sensors.is_empty()).ok_or_else(|| {
                Error::failed("the table's header is not `time[secs]` and the numbers of the sensors")
            })?;
            if self.sensors.len() as u64 > MAX_CELLS || self.sensors.iter().any(|&number| u64::from(number) > MAX_CELLS)
            {
                return Err(failed!("a sensor has a number over {MAX_CELLS}"));
            }
            if let Some(places) = &self.places {
                places.check(&self.sensors)?;
            }
            self.place = Place::Table;
        }
        Ok(())
    }

    fn row(&mut self, line: &[u8], to: &mut Frame) -> Result<bool> {
        let mut words = Separator::Blanks.cells(line);
        let Some(time) = words.next() else { return Ok(false) };
        if ["MPP", "MVP"].iter().any(|name| time.is(name)) {
            // The largest and the mean of each sensor.
            return Ok(false);
        }
        let begins = |start: &str| time.text().starts_with(start);
        if begins("time[") || begins("sensor") || begins("corner") {
            self.place = Place::After;
            return Ok(false);
        }
        let t_s = time.number().ok_or_else(|| failed!("`{time}` is not a time in seconds"))?;
        to.clear();
        to.values.resize(self.sensors.len(), RawValue::MISSING);
        let count = self.sensors.len();
        for (index, slot) in to.values.iter_mut().enumerate() {
            let word = words.next().ok_or_else(|| failed!("it has {index} of {count} pressures"))?;
            *slot = value(word).map_err(|e| e.at(format!("sensor {}", self.sensors[index])))?;
        }
        if let Some(more) = words.next() {
            return Err(failed!("`{more}` stands after the last of {count} pressures"));
        }
        to.t_s = self.rate.time_of(Some(t_s), None)?;
        Ok(true)
    }

    /// Where each panel's sensors end: their numbers begin anew.
    fn ends(&self) -> Vec<usize> {
        let anew = (1..self.sensors.len()).filter(|&index| self.sensors[index] <= self.sensors[index - 1]);
        anew.chain([self.sensors.len()]).collect()
    }

    fn names(&self, panels: usize) -> Vec<String> {
        match (panels, self.sides) {
            (1, [true, false]) => vec!["left".to_owned()],
            (1, [false, true]) => vec!["right".to_owned()],
            (1, _) => vec!["sensor".to_owned()],
            (2, _) => vec!["left".to_owned(), "right".to_owned()],
            _ => (1..=panels).map(|number| format!("panel_{number}")).collect(),
        }
    }
}

impl Parser for NovelAsc {
    fn line(&mut self, line: &[u8], to: &mut Frame) -> Result<bool> {
        match self.place {
            Place::Header => self.header(line).map(|()| false),
            Place::Table => self.row(line, to),
            Place::After => Ok(false),
        }
    }

    fn end(&mut self, _: &mut Frame) -> Result<bool> {
        Ok(false)
    }

    fn layout(&self) -> Layout {
        let (mut panels, mut start, mut shift) = (Vec::new(), 0, 0);
        let ends = self.ends();
        for (name, &end) in self.names(ends.len()).into_iter().zip(&ends) {
            let numbers = &self.sensors[start..end];
            let cell = |(index, &number): (usize, &u32)| {
                let placed = self.places.as_ref().map(|places| places.cell(start + index));
                Cell { id: shift + number, ..placed.unwrap_or_default() }
            };
            let cells: Vec<Cell> = numbers.iter().enumerate().map(cell).collect();
            shift += numbers.iter().copied().max().unwrap_or(0);
            panels.push(Panel { name, cells, is_placed: self.places.is_some(), ..Panel::default() });
            start = end;
        }
        let mut layout = Layout { panels, unit: self.unit.unwrap_or(UnitOfP::KILOPASCAL) };
        if layout.panels.len() > 1 && layout.is_placed() {
            layout.side_by_side();
        }
        layout
    }
}

/// Where a file says its sensors are: for each its number, its corners, its middle and its area.
#[derive(Clone, Debug, Default)]
pub(super) struct Places {
    sensors: Vec<u32>,
    /// x[0], y[0], …, y[3], x[c], y[c], area, as far as they were found.
    rows: [Vec<f64>; 11],
}

/// What the rows are headed.
const HEADS: [&[u8]; 11] =
    [b"x[0]", b"y[0]", b"x[1]", b"y[1]", b"x[2]", b"y[2]", b"x[3]", b"y[3]", b"x[c]", b"y[c]", b"area"];

impl Places {
    /// Takes a line of the file, whichever it is.
    pub(super) fn line(&mut self, line: &[u8]) -> Result<()> {
        // Nearly every line is a row of pressures, which begins with a digit.
        let line = line.trim_ascii_start();
        if !line.first().is_some_and(|first| matches!(first, b's' | b'x' | b'y' | b'a')) {
            return Ok(());
        }
        let mut words = Separator::Blanks.cells(line);
        words.next();
        if line.starts_with(b"sensor") {
            let sensors: Option<Vec<u32>> = words.map(|word| word.whole()).collect();
            // `sensor type:` is a line of the header.
            self.sensors = sensors.unwrap_or_default();
        } else if let Some(row) = HEADS.iter().position(|head| line.starts_with(head)) {
            let wrong = |word| failed!("`{word}` is no number");
            self.rows[row] = words
                .map(|word| word.number().filter(|x| x.is_finite()).ok_or_else(|| wrong(word)))
                .collect::<Result<_>>()?;
        }
        Ok(())
    }

    /// These, if the file had any.
    pub(super) fn found(self) -> Option<Self> {
        (!self.sensors.is_empty() && self.rows.iter().any(|row| !row.is_empty())).then_some(self)
    }

    /// Refuses places that are not those of `sensors`.
    fn check(&self, sensors: &[u32]) -> Result<()> {
        if self.sensors != sensors {
            return Err(Error::failed("the places at the end of the file are not those of the sensors in its table"));
        }
        for (head, row) in HEADS.iter().zip(&self.rows) {
            if row.len() != sensors.len() {
                let head = String::from_utf8_lossy(head);
                return Err(failed!("row `{head}` of the places has {} of {} numbers", row.len(), sensors.len()));
            }
        }
        Ok(())
    }

    fn cell(&self, index: usize) -> Cell {
        let point = |x: usize| [self.rows[x][index] * CM, self.rows[x + 1][index] * CM];
        Cell {
            id: 0,
            centre_m: point(8),
            corners_m: [point(0), point(2), point(4), point(6)],
            area_m2: (self.rows[10][index] * CM * CM).max(0.0),
        }
    }
}
