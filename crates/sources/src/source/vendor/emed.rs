//! novel's emed `.lst`: for each picture one or more pages, each with a header, the numbers of its columns, and rows that
//! begin with their number. The pages have only the part of the platform that was stepped on, and the force of every row and
//! column.
//!
//! The unit of the pressures is not printed. It follows from the forces, where there are any; else it is kPa.

use super::layout::{Cell, Grid, Layout, Panel, next_value};
use super::parser::{Parser, Rate};
use super::text::{Separator, decoded, leading_number, metres};
use crate::error::{Error, Result, failed};
use crate::signal::{Frame, Quantity, RawValue, UnitOfP};

/// Units in which such systems measure.
const UNITS: [&str; 5] = ["kPa", "N/cm2", "psi", "mmHg", "kgf/cm2"];
/// By how much a force may be off from what pressures and area make, for the digits that are printed.
const FORCE_TOLERANCE: f64 = 0.03;

/// Reads frames from lines.
pub(super) struct Emed {
    rate: Rate,
    unit: Option<UnitOfP>,
    keys: Keys,
    /// The rows of a picture's pages, in their order.
    rows: Vec<Row>,
    cells: Vec<[u32; 2]>,
    is_known: bool,
    place: Place,
    /// The numbers of the page's columns.
    columns: Vec<u32>,
    has_forces: bool,
    picture: Option<Started>,
    values: Vec<RawValue>,
}

#[derive(Default)]
struct Keys {
    columns: Option<u32>,
    cell_area_m2: Option<f64>,
    pitch_m: Option<[f64; 2]>,
    seconds_per_picture: Option<f64>,
}

/// A row of a page: its number, its columns', and where its values begin.
#[derive(Clone, Debug, PartialEq)]
struct Row {
    number: u32,
    columns: Vec<u32>,
    first: usize,
}

struct Started {
    number: u32,
    /// Rows so far.
    rows: usize,
    /// Force of all pages, N, as the file adds it up.
    force_newton: Option<f64>,
}

#[derive(Clone, Copy, PartialEq)]
enum Place {
    Header,
    Table,
    /// In pages that sum others up.
    Summary,
}

impl Emed {
    pub(super) fn new(rate: Rate, unit: Option<UnitOfP>) -> Self {
        Self {
            rate,
            unit,
            keys: Keys::default(),
            rows: Vec::new(),
            cells: Vec::new(),
            is_known: false,
            place: Place::Header,
            columns: Vec::new(),
            has_forces: false,
            picture: None,
            values: Vec::new(),
        }
    }

    /// Takes a line of a page's header.
    fn header(&mut self, text: &str) -> Result<()> {
        if self.is_known {
            return Ok(());
        }
        let after = |key: &str| text.split_once(key).map(|(_, after)| after.trim_start());
        let wrong = |what: &str| failed!("the {what} is not a size; correct the line");
        if let Some(size) = after("Matrix:") {
            let columns = size.split(['x', 'X']).next().and_then(|word| word.trim().parse().ok());
            self.keys.columns = Some(columns.ok_or_else(|| wrong("matrix"))?);
        }
        if let Some((area, unit)) =
            after("Sensor area:").map(|area| leading_number(area).ok_or_else(|| wrong("area"))).transpose()?
        {
            self.keys.cell_area_m2 = Some(area * metres(unit).unwrap_or(0.01).powi(2));
        }
        if let Some(size) = after("Sensor size:") {
            let sides: Option<Vec<f64>> = size.split(['x', 'X']).map(|side| Some(leading_number(side)?.0)).collect();
            let Some([width, height]) = sides.as_deref() else { return Err(wrong("sensor's size")) };
            let unit_m = size.split_whitespace().find_map(metres).unwrap_or(0.01);
            self.keys.pitch_m = Some([width * unit_m, height * unit_m]);
        }
        if let Some((time, unit)) =
            after("Time/picture:").map(|time| leading_number(time).ok_or_else(|| wrong("time"))).transpose()?
        {
            self.keys.seconds_per_picture = Some(if unit.starts_with("ms") { time / 1000.0 } else { time });
        }
        Ok(())
    }

    /// Begins a page of picture `word`; gives whether that completes the picture before.
    fn page(&mut self, word: &str, to: &mut Frame) -> Result<bool> {
        let number = word.split_whitespace().next().and_then(|number| number.parse().ok());
        let Some(number) = number else {
            // The largest and the mean of all, which are not frames.
            let complete = self.finish(to)?;
            self.place = Place::Summary;
            return Ok(complete);
        };
        let complete = if self.picture.as_ref().is_some_and(|picture| picture.number != number) {
            self.finish(to)?
        } else {
            false
        };
        self.place = Place::Header;
        if self.picture.is_none() {
            self.picture = Some(Started { number, rows: 0, force_newton: None });
        }
        Ok(complete)
    }

    fn row(&mut self, line: &[u8]) -> Result<()> {
        let mut words = Separator::Blanks.cells(line);
        let (Some(word), Some(picture)) = (words.next(), &mut self.picture) else { return Ok(()) };
        if word.is("Force") {
            let total = words.last().and_then(super::text::Word::number);
            picture.force_newton = total.map(|total| total + picture.force_newton.unwrap_or(0.0));
            self.place = Place::Header;
            return Ok(());
        }
        let number = word.whole().ok_or_else(|| failed!("`{word}` is not the number of a row"))?;
        let at = |e: Error| e.at(format!("picture {}, row {number}", picture.number));
        let first = if self.is_known {
            let row = self.rows.get(picture.rows).filter(|row| row.number == number && row.columns == self.columns);
            row.ok_or_else(|| at(Error::failed("it has other rows or columns than the first picture")))?.first
        } else {
            let first = self.values.len();
            self.rows.push(Row { number, columns: self.columns.clone(), first });
            self.cells.extend(self.columns.iter().map(|&column| [number, column]));
            self.values.resize(first + self.columns.len(), RawValue::MISSING);
            first
        };
        picture.rows += 1;
        for (index, slot) in self.values[first..first + self.columns.len()].iter_mut().enumerate() {
            let what = || failed!("it has {index} of {} cells", self.columns.len());
            *slot = next_value(&mut words).ok_or_else(|| at(what()))?.map_err(at)?;
        }
        match (words.count(), self.has_forces) {
            (0, false) | (1, true) => Ok(()),
            (more, _) => Err(at(failed!("{more} numbers follow its {} cells", self.columns.len()))),
        }
    }

    /// Takes the numbers of a page's columns.
    fn head(&mut self, line: &[u8]) -> Result<()> {
        let mut words: Vec<_> = Separator::Blanks.cells(line).collect();
        self.has_forces = words.last().is_some_and(|word| word.is("Force"));
        if self.has_forces {
            words.pop();
        }
        let columns: Option<Vec<u32>> = words.iter().map(|word| word.whole()).collect();
        self.columns = columns.ok_or_else(|| Error::failed("the columns are not all numbers"))?;
        self.place = Place::Table;
        Ok(())
    }

    /// Gives the picture that is complete, if there is one.
    fn finish(&mut self, to: &mut Frame) -> Result<bool> {
        let Some(picture) = self.picture.take() else { return Ok(false) };
        let rows = if self.is_known { self.rows.len() } else { picture.rows };
        if picture.rows != rows || self.place == Place::Table && self.has_forces || rows == 0 {
            return Err(failed!("picture {} is incomplete: it has {} rows", picture.number, picture.rows));
        }
        if !self.is_known {
            self.check()?;
            self.unit = self.unit.or_else(|| self.unit_of(picture.force_newton?));
            self.is_known = true;
        }
        to.clear();
        let number = picture.number;
        let t_s = self.keys.seconds_per_picture.map(|step| (f64::from(number.max(1) - 1) * step * 1e9).round() / 1e9);
        to.t_s = self.rate.time_of(t_s, Some(number))?;
        to.values.clone_from(&self.values);
        self.values.fill(RawValue::MISSING);
        self.place = Place::Header;
        Ok(true)
    }

    /// Refuses a first picture whose cells make no platform.
    fn check(&self) -> Result<()> {
        let (rows, columns) = self.size();
        Grid { rows, columns, ..Grid::default() }.check()?;
        let mut cells = self.cells.clone();
        cells.sort_unstable();
        match cells.windows(2).find(|pair| pair[0] == pair[1]) {
            Some(pair) => Err(failed!("row {} and column {} are in one picture twice", pair[0][0], pair[0][1])),
            None => Ok(()),
        }
    }

    /// Rows and columns of the platform as far as it is known.
    fn size(&self) -> (u32, u32) {
        let most = |axis: usize| self.cells.iter().map(|cell| cell[axis]).max().unwrap_or(0);
        (most(0).saturating_add(1), self.keys.columns.unwrap_or(0).max(most(1)).saturating_add(1))
    }

    /// The unit in which the pressures of the first picture make a force of `newton`.
    fn unit_of(&self, newton: f64) -> Option<UnitOfP> {
        let area = self.keys.cell_area_m2.or_else(|| self.keys.pitch_m.map(|[width, height]| width * height))?;
        let sum: f64 = self.values.iter().filter_map(|value| value.number()).sum();
        let pascal = newton / (sum * area);
        let units = UNITS.iter().filter_map(|name| name.parse::<UnitOfP>().ok());
        let fits = |unit: &UnitOfP| (pascal / unit.factor - 1.0).abs() < FORCE_TOLERANCE;
        units.into_iter().find(|unit| unit.quantity == Quantity::Pascal && fits(unit))
    }
}

impl Parser for Emed {
    fn line(&mut self, line: &[u8], to: &mut Frame) -> Result<bool> {
        let line = line.trim_ascii_start();
        if line.trim_ascii().is_empty() {
            return Ok(false);
        }
        if line.starts_with(b"Pict-No") {
            let text = decoded(line);
            return self.page(text.split_once(':').map_or("", |(_, number)| number), to);
        }
        match self.place {
            Place::Summary => Ok(false),
            _ if line.starts_with(b"Page") => {
                self.place = Place::Header;
                Ok(false)
            }
            Place::Table => self.row(line).map(|()| false),
            Place::Header if self.picture.is_some() && line[0].is_ascii_digit() => self.head(line).map(|()| false),
            Place::Header => self.header(&decoded(line)).map(|()| false),
        }
    }

    fn end(&mut self, to: &mut Frame) -> Result<bool> {
        self.finish(to)
    }

    fn layout(&self) -> Layout {
        let (rows, columns) = self.size();
        let grid = Grid { rows, columns, pitch_m: self.keys.pitch_m, area_m2: self.keys.cell_area_m2 };
        let numbers = columns.saturating_sub(1).max(1);
        let cell = |&[row, column]: &[u32; 2]| -> Cell {
            // Rows and columns are counted from 1.
            let id = row.saturating_sub(1) * numbers + column.saturating_sub(1);
            grid.cell(id, row, column)
        };
        let mut cells: Vec<Cell> = self.cells.iter().map(cell).collect();
        let centre = |axis: usize| {
            let (low, high) = cells
                .iter()
                .map(|cell| cell.centre_m[axis])
                .fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(x), h.max(x)));
            (low + high) / 2.0
        };
        let middle = [centre(0), centre(1)];
        for cell in &mut cells {
            for point in std::iter::once(&mut cell.centre_m).chain(&mut cell.corners_m) {
                *point = [point[0] - middle[0], point[1] - middle[1]];
            }
        }
        let panel =
            Panel { name: "platform".to_owned(), cells, is_placed: self.keys.pitch_m.is_some(), ..Panel::default() };
        Layout { panels: vec![panel], unit: self.unit.unwrap_or(UnitOfP::KILOPASCAL) }
    }
}
