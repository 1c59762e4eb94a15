//! StappOne's `.csv`: a header, and a row for each sole and time. Rows of one time are a frame; otherwise the other sole keeps its values
//! for a moment. Rows that are marked as corrupt have no values. What the values are measured in, and where the sensors are, is not
//! in the file.

use std::sync::Arc;

use super::super::column_names::columns;
use super::super::time_column::TimeColumn;
use super::layout::{Cell, Layout, Panel, next_value};
use super::parser::{Parser, Rate};
use super::text::{Separator, Word};
use crate::error::{Error, Result, failed};
use crate::signal::{Frame, RawValue, UnitOfP};

/// How long a sole keeps its values while others come, s: three of its rows.
const KEPT_S: f64 = 0.05;
/// Most soles of a recording, so that a column of anything else does not fill the memory.
const MAX_SOLES: usize = 16;
/// The ids of a sole's sensors begin with its number.
const IDS_OF_SOLE: u32 = 100;

/// The columns that are read.
#[derive(Clone, Debug, Default, PartialEq)]
struct Header {
    sole: usize,
    time: usize,
    corrupt: Option<usize>,
    /// Of the sensors.
    sensors: Vec<usize>,
}

impl Header {
    /// The columns of `line`, if it is a header.
    fn of(separator: Separator, line: &[u8]) -> Option<Self> {
        let names: Vec<String> = separator.cells(line).map(|word| word.text().to_ascii_lowercase()).collect();
        let column = |name: &str| names.iter().position(|own| own == name);
        let is_sensor = |name: &&String| {
            name.strip_prefix("pressure_")
                .is_some_and(|rest| !rest.is_empty() && rest.bytes().all(|b| b.is_ascii_digit()))
        };
        let sensors: Vec<usize> = (0..names.len()).filter(|&index| is_sensor(&&names[index])).collect();
        let is_whole = !sensors.is_empty() && sensors.len() < IDS_OF_SOLE as usize;
        is_whole.then_some(())?;
        Some(Self { sole: column("sole_id")?, time: column("timestamp")?, corrupt: column("corrupt"), sensors })
    }
}

/// The soles of a file, as a first pass finds them.
#[derive(Default)]
pub(super) struct Soles {
    header: Option<Header>,
    /// Their numbers, ascending.
    numbers: Vec<u32>,
}

impl Soles {
    /// Takes the next line; what is wrong with it is said when it is read for its frame.
    pub(super) fn line(&mut self, separator: Separator, line: &[u8]) {
        let Some(header) = &self.header else {
            self.header = Header::of(separator, line);
            return;
        };
        let number = separator.cells(line).nth(header.sole).and_then(Word::whole);
        let Some(number) = number.filter(|number| *number < u32::MAX / IDS_OF_SOLE / 2) else { return };
        if let Err(at) = self.numbers.binary_search(&number)
            && self.numbers.len() < MAX_SOLES
        {
            self.numbers.insert(at, number);
        }
    }
}

/// Reads frames from lines.
pub(super) struct Stappone {
    separator: Separator,
    rate: Rate,
    unit: Option<UnitOfP>,
    numbers: Vec<u32>,
    header: Option<Arc<Header>>,
    time: TimeColumn,
    /// By sole, its last values and their time.
    last: Vec<Option<(f64, Vec<RawValue>)>>,
    /// The time of the frame that is not given yet, and the soles that are in it.
    pending: Option<(f64, Vec<bool>)>,
    corrupt: u64,
}

impl Stappone {
    /// A reader of `soles`.
    pub(super) fn new(separator: Separator, rate: Rate, unit: Option<UnitOfP>, soles: Soles) -> Result<Self> {
        if soles.header.is_none() || soles.numbers.is_empty() {
            return Err(Error::failed(
                "it has no rows under a header with `sole_id`, `timestamp` and `pressure_01`; export it again",
            ));
        }
        Ok(Self {
            separator,
            rate,
            unit,
            last: vec![None; soles.numbers.len()],
            numbers: soles.numbers,
            header: None,
            time: TimeColumn::new(None),
            pending: None,
            corrupt: 0,
        })
    }

    /// Gives the frame that is complete, if there is one.
    fn finish(&mut self, to: &mut Frame) -> Result<bool> {
        let (Some((t_s, _)), Some(header)) = (self.pending.take(), &self.header) else { return Ok(false) };
        to.clear();
        for last in &self.last {
            match last {
                Some((at_s, values)) if (0.0..=KEPT_S).contains(&(t_s - at_s)) => to.values.extend_from_slice(values),
                _ => to.values.resize(to.values.len() + header.sensors.len(), RawValue::MISSING),
            }
        }
        to.t_s = self.rate.time_of(Some(t_s), None)?;
        Ok(true)
    }

    /// A row: the place of its sole, its time, and its values.
    fn row(&mut self, header: &Header, line: &[u8]) -> Result<(usize, f64, Vec<RawValue>)> {
        let mut values = Vec::with_capacity(header.sensors.len());
        let (mut sole, mut t_s, mut is_corrupt) = (None, None, false);
        let count =
            1 + header.sensors.iter().chain([&header.sole, &header.time]).chain(&header.corrupt).max().unwrap_or(&0);
        let mut cells = self.separator.cells(line);
        for column in 0..count {
            let short = || failed!("it has {column} of {count} cells");
            if header.sensors.contains(&column) {
                let value = next_value(&mut cells).ok_or_else(short)?;
                values.push(value.map_err(|e| e.at(format!("column {}", column + 1)))?);
                continue;
            }
            let word = cells.next().ok_or_else(short)?;
            if column == header.sole {
                let of = word.whole().and_then(|number| self.numbers.binary_search(&number).ok());
                sole = Some(of.ok_or_else(|| failed!("`{word}` is not the number of a sole"))?);
            } else if column == header.time {
                t_s = Some(self.time.read(&word.text(), word.number())?);
            } else if header.corrupt == Some(column) {
                is_corrupt = word.number().is_some_and(|mark| mark != 0.0);
            }
        }
        if is_corrupt {
            self.corrupt += 1;
            values.fill(RawValue::MISSING);
        }
        let both = sole.zip(t_s).ok_or_else(|| Error::failed("it has neither sole nor time"))?;
        Ok((both.0, both.1, values))
    }
}

impl Parser for Stappone {
    fn line(&mut self, line: &[u8], to: &mut Frame) -> Result<bool> {
        if line.trim_ascii().is_empty() {
            return Ok(false);
        }
        let Some(header) = self.header.clone() else {
            self.header = Header::of(self.separator, line).map(Arc::new);
            return Ok(false);
        };
        let (sole, t_s, values) = self.row(&header, line)?;
        let goes_with = self.pending.as_ref().is_some_and(|(at_s, seen)| *at_s == t_s && !seen[sole]);
        let complete = if goes_with { false } else { self.finish(to)? };
        let (_, seen) = self.pending.get_or_insert_with(|| (t_s, vec![false; self.last.len()]));
        seen[sole] = true;
        self.last[sole] = Some((t_s, values));
        Ok(complete)
    }

    fn end(&mut self, to: &mut Frame) -> Result<bool> {
        self.finish(to)
    }

    fn rest(&mut self, to: &mut Frame) -> bool {
        self.finish(to).unwrap_or(false)
    }

    fn losses(&self) -> Option<String> {
        match self.corrupt {
            0 => None,
            1 => Some("a row is marked as corrupt: its values are missing".to_owned()),
            rows => Some(format!("{rows} rows are marked as corrupt: their values are missing")),
        }
    }

    fn go_on(&mut self) -> bool {
        self.rate.pass();
        self.header.is_some()
    }

    fn understood(&self) -> Option<String> {
        let header = self.header.as_ref()?;
        let (first, last) = (header.sensors.first()? + 1, header.sensors.last()? + 1);
        let soles: Vec<String> = self.numbers.iter().map(u32::to_string).collect();
        let s = if soles.len() == 1 { "" } else { "s" };
        Some(format!(
            "{}: the sole, {}; {}: the time; {}: {} sensors of sole{s} {}; the other columns are left out",
            columns(header.sole + 1, header.sole + 1),
            soles.join(" or "),
            columns(header.time + 1, header.time + 1),
            columns(first, last),
            header.sensors.len(),
            soles.join(" and "),
        ))
    }

    fn layout(&self) -> Layout {
        let sensors = self.header.as_ref().map_or(0, |header| header.sensors.len() as u32);
        let panel = |number: &u32| {
            let cell = |index: u32| Cell { id: number * IDS_OF_SOLE + index, ..Cell::default() };
            Panel { name: format!("sole_{number}"), cells: (1..=sensors).map(cell).collect(), ..Panel::default() }
        };
        Layout { panels: self.numbers.iter().map(panel).collect(), unit: self.unit.unwrap_or_default() }
    }
}
