//! novel's `.asc`: pedar's insoles and pliance's mats and gloves. A header, the numbers of the sensors, and a row for each
//! frame: its time, then the pressures.
//!
//! Of pliance the places of the sensors stand after the rows ([`Places`]), so that such a file is read twice; of pedar they stand
//! nowhere, and may be given ([`Insoles`]).

use super::insoles::Insoles;
use super::layout::{Cell, Layout, MAX_CELLS, Panel, next_value};
use super::novel_places::Places;
use super::parser::{Parser, Rate};
use super::text::{Separator, decoded};
use crate::error::{Error, Result, failed};
use crate::signal::{Frame, RawValue, UnitOfP};

/// Reads frames from lines.
pub(super) struct NovelAsc {
    rate: Rate,
    unit: Option<UnitOfP>,
    /// What the first pass found.
    places: Option<Places>,
    /// What was given beside the file.
    insoles: Option<Insoles>,
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
    pub(super) fn new(rate: Rate, unit: Option<UnitOfP>, places: Option<Places>, insoles: Option<Insoles>) -> Self {
        Self { rate, unit, places, insoles, sides: [false; 2], sensors: Vec::new(), place: Place::Header }
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
            let sensors: Option<Vec<u32>> = words.map(super::text::Word::whole).collect();
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
            if let Some(insoles) = &self.insoles {
                self.panels().iter().try_for_each(|(name, sensors)| insoles.check(name, sensors))?;
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
            let value = next_value(&mut words).ok_or_else(|| failed!("it has {index} of {count} pressures"))?;
            *slot = value.map_err(|e| e.at(format!("sensor {}", self.sensors[index])))?;
        }
        if let Some(more) = words.next() {
            return Err(failed!("`{more}` follows the last of {count} pressures"));
        }
        to.t_s = self.rate.time_of(Some(t_s), None)?;
        Ok(true)
    }

    /// Where each panel's sensors end: their numbers begin anew.
    fn ends(&self) -> Vec<usize> {
        let anew = (1..self.sensors.len()).filter(|&index| self.sensors[index] <= self.sensors[index - 1]);
        anew.chain([self.sensors.len()]).collect()
    }

    /// Each panel's name and the numbers of its sensors.
    fn panels(&self) -> Vec<(String, &[u32])> {
        let ends = self.ends();
        let starts = std::iter::once(0).chain(ends.iter().copied());
        let sensors = starts.zip(&ends).map(|(start, &end)| &self.sensors[start..end]);
        self.names(ends.len()).into_iter().zip(sensors).collect()
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

    fn go_on(&mut self) -> bool {
        self.rate.pass();
        self.place == Place::Table
    }

    fn layout(&self) -> Layout {
        let (mut panels, mut start, mut shift) = (Vec::new(), 0, 0_u32);
        for (name, numbers) in self.panels() {
            let place = |index: usize, number: u32| match (&self.places, &self.insoles) {
                (Some(places), _) => places.cell(start + index),
                (None, Some(insoles)) => insoles.cell(&name, number),
                (None, None) => Cell::default(),
            };
            let cell =
                |(index, &number): (usize, &u32)| Cell { id: shift.saturating_add(number), ..place(index, number) };
            let cells: Vec<Cell> = numbers.iter().enumerate().map(cell).collect();
            shift = shift.saturating_add(numbers.iter().copied().max().unwrap_or(0));
            start += numbers.len();
            let is_placed = self.places.is_some() || self.insoles.is_some();
            panels.push(Panel { name, cells, is_placed, ..Panel::default() });
        }
        let mut layout = Layout { panels, unit: self.unit.unwrap_or(UnitOfP::KILOPASCAL) };
        if layout.panels.len() > 1 && layout.is_placed() {
            layout.side_by_side();
        }
        layout
    }
}
