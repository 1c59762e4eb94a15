//! Frames out of lines, once it is known how these are written.

use std::collections::{HashMap, VecDeque};

use super::super::time_column::{TimeColumn, TimeUnit};
use super::cells::{Cell, Separator, json, pairs};
use super::form::{Form, Syntax, Use};
use super::skipped::{Skipped, Wrong};
use super::splitter::Line;
use crate::signal::{Frame, RawValue};

/// Counters of boards have 32 bits, and so have their times in milliseconds and microseconds.
const WRAP: f64 = 4_294_967_296.0;

/// What comes of a row.
type Row = Result<(), Wrong>;

/// Puts frames together.
pub(super) struct Assembler {
    form: Form,
    by_name: HashMap<String, usize>,
    current: Frame,
    /// Whether the frame has a time of its own.
    has_time: bool,
    time: Option<Clock>,
    /// The column of the time.
    time_index: Option<usize>,
    /// Rows of the current frame that have come.
    rows: usize,
    /// By sensor, whether a name has come in this frame.
    seen: Vec<bool>,
    /// Whether it is known where in a frame this is.
    in_step: bool,
    /// Whether the next line may be the end of a longer one.
    is_joining: bool,
    spare: Vec<Frame>,
    /// Frames that are whole, and whether each has its own time.
    pub(super) ready: VecDeque<(Frame, bool)>,
    pub(super) skipped: Skipped,
    /// The time went back so often.
    pub(super) restarts: u64,
}

/// A column of times that goes on where a board's counter begins again.
struct Clock {
    column: TimeColumn,
    wraps: bool,
    before: Option<f64>,
    offset: f64,
}

impl Clock {
    fn new(unit: TimeUnit) -> Self {
        let wraps = matches!(unit, TimeUnit::Milliseconds | TimeUnit::Microseconds);
        Self { column: TimeColumn::new(Some(unit)), wraps, before: None, offset: 0.0 }
    }

    /// The time in seconds, and whether it went back.
    fn read(&mut self, cell: Cell<'_>) -> Option<(f64, bool)> {
        let (word, number) = match cell {
            Cell::Number(number) => ("", Some(number)),
            Cell::Word(word) => (word, None),
            Cell::Blank => return None,
        };
        let mut went_back = false;
        if let (Some(now), Some(before)) = (number, self.before) {
            if self.wraps && before < WRAP && before - now > 0.9 * WRAP {
                self.offset += WRAP;
            } else {
                went_back = now < before;
            }
        }
        self.before = number.or(self.before);
        self.column.read(word, number.map(|number| number + self.offset)).ok().map(|t_s| (t_s, went_back))
    }
}

impl Assembler {
    /// For lines of `form`. `is_joined` is whether the first line may be the end of a longer one.
    pub(super) fn new(form: Form, is_joined: bool) -> Self {
        let by_name = form.names.iter().cloned().zip(0..).collect();
        let sensors = form.sensors();
        let mut new = Self {
            by_name,
            current: Frame::missing(0.0, sensors),
            has_time: false,
            time: form.time.map(Clock::new),
            time_index: form.columns.iter().position(|column| *column == Use::Time),
            rows: 0,
            seen: vec![false; sensors],
            in_step: true,
            is_joining: false,
            spare: Vec::new(),
            ready: VecDeque::new(),
            skipped: Skipped::default(),
            restarts: 0,
            form,
        };
        if is_joined {
            new.join();
        }
        new
    }

    /// Call it where the connection begins anew in the middle of lines.
    pub(super) fn join(&mut self) {
        self.is_joining = true;
        self.begin_frame();
        self.in_step = self.form.rows == 1 || self.form.end.is_none();
    }

    /// Takes back a frame that is used no longer.
    pub(super) fn give_back(&mut self, frame: Frame) {
        if self.spare.len() < 64 {
            self.spare.push(frame);
        }
    }

    fn begin_frame(&mut self) {
        self.current.clear();
        self.current.values.clear();
        self.current.values.resize(self.form.sensors(), RawValue::MISSING);
        self.seen.fill(false);
        (self.rows, self.has_time) = (0, false);
    }

    fn end_frame(&mut self) {
        let next = self.spare.pop().unwrap_or_else(|| Frame::missing(0.0, 0));
        self.ready.push_back((std::mem::replace(&mut self.current, next), self.has_time));
        self.begin_frame();
    }

    /// Call it when nothing comes any more.
    pub(super) fn end(&mut self) {
        if self.form.is_spread && self.seen.contains(&true) {
            self.end_frame();
        } else if self.form.rows > 1 && self.rows > 0 && self.rows < self.form.rows && self.in_step {
            self.skipped.add(Wrong::Rows, "");
        }
    }

    /// Takes a line.
    pub(super) fn take(&mut self, line: Line<'_>) {
        let text = match line {
            Line::Text(text) => text,
            Line::Garbled if std::mem::take(&mut self.is_joining) => return self.skipped.add(Wrong::Torn, ""),
            Line::Garbled => return self.lose(Wrong::Garbled, ""),
            Line::Long => return self.lose(Wrong::Long, ""),
        };
        if self.form.header.as_deref() == Some(text) {
            self.is_joining = false;
            return;
        }
        if std::mem::take(&mut self.is_joining) {
            // Its first number may be the end of a longer one, so none of it is used; where it looks whole, that is not a loss.
            match self.row(text, false) {
                _ if text.is_empty() => {}
                Ok(()) => self.skipped.leave_out(text),
                Err(_) if self.is_end(text) => {}
                Err(_) => self.skipped.add(Wrong::Torn, text),
            }
            self.begin_frame();
            return;
        }
        if self.form.rows > 1 && self.form.end.is_some() {
            return self.row_of_several(text);
        }
        if text.is_empty() {
            return;
        }
        match self.row(text, true) {
            Ok(()) if self.form.is_spread => {}
            Ok(()) => self.next_row(),
            Err(_) if self.is_end(text) => {}
            Err(wrong) => self.lose(wrong, text),
        }
    }

    fn is_end(&self, text: &str) -> bool {
        self.form.end.as_ref().is_some_and(|end| end.is(text))
    }

    /// Counts a line. If it may have been a row, the frame that it was of is none.
    fn lose(&mut self, wrong: Wrong, text: &str) {
        self.skipped.add(wrong, text);
        if self.form.rows > 1 && wrong != Wrong::Words {
            match self.form.end {
                Some(_) => self.in_step = false,
                // Nothing else says where a frame begins.
                None => self.next_row(),
            }
        } else if self.form.rows == 1 && !self.form.is_spread {
            self.begin_frame();
        }
    }

    fn next_row(&mut self) {
        self.rows += 1;
        if self.rows == self.form.rows {
            self.end_frame();
        }
    }

    /// Takes a line of frames that have several, and something between them.
    fn row_of_several(&mut self, text: &str) {
        let result = self.row(text, self.in_step);
        if result.is_err() && self.is_end(text) {
            if self.in_step && self.rows > 0 && self.rows < self.form.rows {
                self.skipped.add(Wrong::Rows, text);
            }
            self.in_step = true;
            return self.begin_frame();
        }
        match result {
            _ if text.is_empty() => {}
            Err(wrong) if self.in_step => self.lose(wrong, text),
            Err(Wrong::Words) => self.skipped.add(Wrong::Words, text),
            // Of a frame that is lost already.
            _ if !self.in_step => {}
            Ok(()) if self.rows == self.form.rows => {
                // The frame was whole, and its end did not come.
                self.skipped.add(Wrong::Rows, text);
                self.in_step = false;
            }
            _ => {
                self.rows += 1;
                if self.rows == self.form.rows {
                    let rows = self.rows;
                    self.end_frame();
                    self.rows = rows;
                }
            }
        }
    }

    /// Reads `text` as a row, into the current frame if it `counts`.
    fn row(&mut self, text: &str, counts: bool) -> Row {
        match self.form.syntax {
            Syntax::Numbers(separator) => self.numbers(text, separator, counts),
            Syntax::Pairs => self.named(text, counts, |each| match pairs(text, &mut |name, cell| each(name, cell)) {
                true => Ok(()),
                false => Err(Wrong::Words),
            }),
            Syntax::Json => {
                let decoded = self.form.decoded.clone();
                self.named(text, counts, |each| {
                    let wrong = if text.starts_with(['{', '[']) { Wrong::Json } else { Wrong::Words };
                    json(text, decoded.as_deref(), each).map_err(|_| wrong)
                })
            }
        }
    }

    fn numbers(&mut self, text: &str, separator: Separator, counts: bool) -> Row {
        let mut cells = Vec::with_capacity(self.form.columns.len() + 1);
        separator.split(text, &mut cells);
        let wanted = self.form.columns.len();
        if cells.len() == wanted + 1 && cells.last() == Some(&Cell::Blank) {
            cells.pop();
        }
        let has_numbers = cells.iter().filter(|cell| matches!(cell, Cell::Number(_))).count();
        let words = cells.iter().zip(&self.form.columns).filter(|(cell, column)| {
            matches!(cell, Cell::Word(_)) && !matches!(column, Use::Word | Use::Time | Use::LeftOut(_))
        });
        let words = words.count();
        if has_numbers == 0 || 2 * words > cells.len() || (words > 0 && cells.len() != wanted) {
            return Err(Wrong::Words);
        }
        match cells.len().cmp(&wanted) {
            std::cmp::Ordering::Less => return Err(Wrong::Few),
            std::cmp::Ordering::Greater => return Err(Wrong::Many),
            std::cmp::Ordering::Equal if words > 0 => return Err(Wrong::Word),
            std::cmp::Ordering::Equal => {}
        }
        if !counts || self.rows >= self.form.rows {
            return Ok(());
        }
        if let Some(index) = self.time_index {
            self.time(cells[index])?;
        }
        let first = self.rows * self.form.width;
        for (cell, column) in cells.iter().zip(&self.form.columns) {
            if let (Use::Sensor(place), Cell::Number(number)) = (column, cell) {
                self.current.values[first + place] = RawValue::new(*number);
            }
        }
        Ok(())
    }

    fn time(&mut self, cell: Cell<'_>) -> Row {
        let Some(clock) = &mut self.time else { return Ok(()) };
        let (t_s, went_back) = clock.read(cell).ok_or(Wrong::Time)?;
        self.restarts += u64::from(went_back);
        (self.current.t_s, self.has_time) = (t_s, true);
        Ok(())
    }

    /// Reads names and values that `read` gives.
    fn named(&mut self, text: &str, counts: bool, read: impl FnOnce(&mut dyn FnMut(&str, Cell<'_>)) -> Row) -> Row {
        let mut found: Vec<(usize, Option<f64>)> = Vec::with_capacity(self.form.columns.len());
        let (mut strange, mut has_word, mut time) = (false, false, None);
        let mut next = 0;
        let (names, by_name, columns) = (&self.form.names, &self.by_name, &self.form.columns);
        read(&mut |name, cell| {
            // Names mostly come in their order.
            let index = match names.get(next) {
                Some(own) if own == name => Some(next),
                _ => by_name.get(name).copied(),
            };
            let Some(index) = index else {
                strange |= !matches!(cell, Cell::Word(_));
                return;
            };
            next = index + 1;
            match (&columns[index], cell) {
                (Use::Time, Cell::Number(number)) => time = Some((Some(number), String::new())),
                (Use::Time, Cell::Word(word)) => time = Some((None, word.to_owned())),
                (Use::Sensor(place), Cell::Number(number)) => found.push((*place, Some(number))),
                (Use::Sensor(place), Cell::Blank) => found.push((*place, None)),
                (Use::Sensor(_), Cell::Word(_)) => has_word = true,
                _ => {}
            }
        })?;
        if has_word {
            return Err(Wrong::Word);
        }
        if found.is_empty() && self.form.has_paths {
            self.skipped.other(text);
            return Err(Wrong::Other);
        }
        if found.is_empty() {
            return Err(if strange { Wrong::Names } else { Wrong::Words });
        }
        if !counts {
            return Ok(());
        }
        if strange {
            self.skipped.add(Wrong::Names, text);
        }
        if self.form.is_spread && found.iter().any(|&(place, _)| self.seen[place]) {
            self.end_frame();
        }
        match time {
            Some((Some(number), _)) => self.time(Cell::Number(number))?,
            Some((None, word)) => self.time(Cell::Word(&word))?,
            None if self.time_index.is_some() && !self.form.is_spread => return Err(Wrong::Time),
            None => {}
        }
        for (place, number) in found {
            self.current.values[place] = number.map_or(RawValue::MISSING, RawValue::new);
            self.seen[place] = true;
        }
        if self.form.is_spread && self.seen.iter().all(|seen| *seen) {
            self.end_frame();
        }
        Ok(())
    }
}
