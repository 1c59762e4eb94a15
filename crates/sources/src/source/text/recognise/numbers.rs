//! Lines of numbers with something between them.

use std::collections::HashMap;
use std::time::Duration;

use super::super::super::column_names::is_beside_sensors;
use super::super::super::time_column::{TimeUnit, by_size, calendar, unit_in_head};
use super::super::cells::{Cell, MARKS, Separator, count};
use super::super::form::{Form, Syntax, Use};
use super::clock::{Rising, rising};
use super::frames::{Frames, Item, frames};
use super::heard::{Heard, Kind, Known};
use super::named::{Columns, by_options, ids, sized};

use crate::error::{Error, Result, failed};

/// How `lines`, which look like `kinds`, without the first one if that may be torn, are written as numbers.
pub(super) fn numbers(lines: &[Heard], kinds: &[Kind], known: Known<'_>) -> Result<Form> {
    let joined = lines.len() - kinds.len();
    let whole = &lines[joined..];
    let of_numbers: Vec<&str> =
        whole.iter().zip(kinds).filter(|(_, kind)| **kind == Kind::Numbers).map(|(line, _)| &*line.text).collect();
    let separator = separator(&of_numbers);
    let width = usual(of_numbers.iter().map(|line| width_of(line, separator)));
    let rows: Vec<Row<'_>> = whole.iter().map(|line| Row::from_heard(line, separator)).collect();
    let of_width: Vec<&Row<'_>> = rows
        .iter()
        .zip(kinds)
        .filter(|(row, kind)| **kind == Kind::Numbers && row.width == width)
        .map(|(row, _)| row)
        .collect();
    let is_word: Vec<bool> =
        (0..width).map(|index| 2 * of_width.iter().filter(|row| row.is_word(index)).count() > of_width.len()).collect();
    let rows_of_all: Vec<bool> = rows.iter().map(|row| row.fits(&is_word)).collect();
    let header = header(lines, separator, &rows_of_all, joined, width);
    let names: Vec<String> = header.as_ref().map(|(_, names)| names.clone()).unwrap_or_default();

    let is_header = |line: &str| header.as_ref().is_some_and(|(known, _)| known == line);
    let items: Vec<Item<'_>> = rows
        .iter()
        .zip(&rows_of_all)
        .filter(|(row, _)| !is_header(row.line))
        .map(|(row, is_row)| if *is_row { Item::Row } else { Item::Other(row.line) })
        .collect();
    let mut frames = frames(&items, known.options.frame_end.as_ref());
    let fitting: Vec<&Row<'_>> =
        rows.iter().zip(&rows_of_all).filter(|(_, is_row)| **is_row).map(|(row, _)| row).collect();
    let mut columns = Columns::new(names, width);
    columns.uses = is_word.iter().map(|is| if *is { Use::Word } else { Use::Sensor(0) }).collect();
    by_names(&mut columns)?;
    if columns.is_unit_open {
        by_clock(&mut columns, &fitting);
    } else if columns.time.is_none() {
        by_values(&mut columns, &fitting, frames.rows.max(1));
    }
    by_options(&mut columns, known)?;
    let sensors = columns.sensors();
    by_grid(&mut frames, sensors, known)?;
    let ids = ids(&columns, sensors * frames.rows, known)?;
    let form = Form {
        syntax: Syntax::Numbers(separator),
        width: sensors,
        rows: frames.rows,
        end: frames.end,
        header: header.map(|(line, _)| line),
        names: columns.names,
        columns: columns.uses,
        time: columns.time,
        is_time_guessed: columns.is_time_guessed,
        is_spread: false,
        grid: None,
        is_grid_guessed: false,
        ids,
        decoded: None,
        has_paths: false,
        has_axes: false,
    };
    sized(form, None, known)
}

/// A line of numbers that is looked at.
struct Row<'a> {
    line: &'a str,
    at: Duration,
    cells: Vec<Cell<'a>>,
    width: usize,
}

impl<'a> Row<'a> {
    fn from_heard(heard: &'a Heard, separator: Separator) -> Self {
        let mut cells = Vec::new();
        separator.split(&heard.text, &mut cells);
        Self { line: &heard.text, at: heard.at, width: count(&cells), cells }
    }

    fn is_word(&self, index: usize) -> bool {
        matches!(self.cells.get(index), Some(Cell::Word(_)))
    }

    /// Whether it is a row whose words are where `is_word` has them.
    fn fits(&self, is_word: &[bool]) -> bool {
        let is_blank = |index: usize| matches!(self.cells.get(index), None | Some(Cell::Blank));
        let wide = self.width == is_word.len() || (self.cells.len() == is_word.len() && is_blank(self.cells.len() - 1));
        wide && (0..is_word.len())
            .all(|index| is_word[index] == self.is_word(index) || (is_word[index] && is_blank(index)))
            && self.cells.iter().any(|cell| matches!(cell, Cell::Number(_)))
    }

    fn number(&self, index: usize) -> Option<f64> {
        if let Some(Cell::Number(number)) = self.cells.get(index) { Some(*number) } else { None }
    }
}

fn width_of(line: &str, separator: Separator) -> usize {
    let mut cells = Vec::new();
    separator.split(line, &mut cells);
    count(&cells)
}

/// The value that most have; the largest of several.
fn usual(values: impl Iterator<Item = usize>) -> usize {
    let mut counts: HashMap<usize, usize> = HashMap::new();
    values.for_each(|value| *counts.entry(value).or_default() += 1);
    counts.into_iter().max_by_key(|&(value, count)| (count, value)).map_or(0, |(value, _)| value)
}

/// What is between the numbers of most of `lines`.
fn separator(lines: &[&str]) -> Separator {
    let usual = usual(lines.iter().map(|line| width_of(line, Separator::Any)));
    let lines: Vec<&str> = lines.iter().copied().filter(|line| width_of(line, Separator::Any) == usual).collect();
    let most = |count: usize| 5 * count > 4 * lines.len();
    for mark in MARKS {
        let has = |line: &&&str| line.contains(mark);
        if !most(lines.iter().filter(has).count()) {
            continue;
        }
        for separator in [Separator::One(mark), Separator::OneWithComma(mark)] {
            if mark == ',' && separator != Separator::One(',') {
                continue;
            }
            let is_split = |line: &&&str| {
                let mut cells = Vec::new();
                separator.split(line, &mut cells);
                let is_whole = |cell: &Cell<'_>| match cell {
                    Cell::Word(word) => !word.contains([';', ',', '\t', '|', ' ']) || calendar(word).is_some(),
                    _ => true,
                };
                cells.len() > 1 && cells.iter().all(is_whole)
            };
            if most(lines.iter().filter(is_split).count()) {
                return separator;
            }
        }
    }
    Separator::Any
}

/// The line that names the columns, if one does: the last one before the rows that has as many cells, words among them or all of
/// them, and is not what the rows are.
fn header(
    lines: &[Heard],
    separator: Separator,
    is_row: &[bool],
    joined: usize,
    width: usize,
) -> Option<(String, Vec<String>)> {
    let first = is_row.iter().position(|is| *is)? + joined;
    lines[..first].iter().rev().find_map(|line| {
        let mut cells = Vec::new();
        // Between names there is what is between numbers, but for a decimal comma.
        let separator = if let Separator::OneWithComma(mark) = separator { Separator::One(mark) } else { separator };
        separator.split(line.text.trim_start_matches(['\u{feff}', '#']), &mut cells);
        let width_of = count(&cells);
        let has_word = cells.iter().any(|cell| matches!(cell, Cell::Word(_)));
        let name = |cell: &Cell<'_>| match cell {
            Cell::Word(word) => (*word).to_owned(),
            Cell::Number(number) => number.to_string(),
            Cell::Blank => String::new(),
        };
        (width_of == width && has_word).then(|| (line.text.clone(), cells[..width].iter().map(name).collect()))
    })
}

/// What names say of columns.
fn by_names(columns: &mut Columns) -> Result<()> {
    for (index, name) in columns.names.clone().iter().enumerate() {
        if columns.uses[index] == Use::Word && columns.time.is_none() && unit_in_head(name)?.is_some() {
            // A time of the calendar is a word.
            (columns.uses[index], columns.time) = (Use::Time, Some(TimeUnit::Calendar));
        } else if let (Use::Sensor(_), Some(unit)) =
            (&columns.uses[index], unit_in_head(name).map_err(|e| e.at(format!("column {}", index + 1)))?)
            && columns.time.is_none()
        {
            columns.uses[index] = Use::Time;
            columns.time = Some(unit.unwrap_or(TimeUnit::Seconds));
            columns.is_unit_open = unit.is_none();
        } else if is_beside_sensors(name) && columns.uses[index] != Use::Word {
            columns.uses[index] = Use::LeftOut("is not a sensor");
        }
    }
    Ok(())
}

/// What the values of the first and the last column say of them, and of a time whose unit no name says.
fn by_values(columns: &mut Columns, rows: &[&Row<'_>], of_frame: usize) {
    let first = rows.iter().find_map(|row| match row.cells.first() {
        Some(Cell::Word(word)) => calendar(word),
        _ => None,
    });
    if columns.uses.first() == Some(&Use::Word) && first.is_some() {
        (columns.uses[0], columns.time) = (Use::Time, Some(TimeUnit::Calendar));
        return;
    }
    let firsts: Vec<&&Row<'_>> = rows.iter().step_by(of_frame).collect();
    for index in [0, columns.uses.len().saturating_sub(1)] {
        if !matches!(columns.uses.get(index), Some(Use::Sensor(_))) || columns.sensors() < 2 {
            continue;
        }
        let values: Option<Vec<f64>> = firsts.iter().map(|row| row.number(index)).collect();
        let at: Vec<Duration> = firsts.iter().map(|row| row.at).collect();
        columns.is(index, rising(&values.unwrap_or_default(), &at));
    }
}

/// Finds the unit of a time column whose name does not give it.
fn by_clock(columns: &mut Columns, rows: &[&Row<'_>]) {
    let Some(index) = columns.uses.iter().position(|column| *column == Use::Time) else { return };
    let given = rows.iter().filter_map(|row| Some((row.number(index)?, row.at)));
    let (values, at): (Vec<f64>, Vec<Duration>) = given.unzip();
    match (rising(&values, &at), values.first()) {
        // Seconds, unless the clock on the wall says another unit.
        (Rising::Time(unit, false), _) => columns.time = Some(unit),
        (_, Some(first)) => columns.time = Some(by_size(*first)),
        _ => {}
    }
}

impl Columns {
    fn is(&mut self, index: usize, rising: Rising) {
        match rising {
            Rising::Time(unit, is_guessed) if self.time.is_none() => {
                self.uses[index] = Use::Time;
                (self.time, self.is_time_guessed) = (Some(unit), is_guessed);
            }
            Rising::Count => self.uses[index] = Use::LeftOut("counts frames"),
            Rising::Unknown => self.uses[index] = Use::LeftOut("rises like a time of unknown unit"),
            Rising::Time(..) | Rising::No => {}
        }
    }
}

/// How many lines are a frame, where a grid is asked for.
fn by_grid(frames: &mut Frames, sensors: usize, known: Known<'_>) -> Result<()> {
    let advice = "--columns or --time says which columns are sensors";
    if let Some([rows, columns]) = known.grid {
        frames.rows = match sensors {
            _ if sensors == rows * columns => 1,
            // Each with three axes.
            _ if sensors == 3 * rows * columns => 1,
            _ if sensors == columns => rows,
            _ => {
                return Err(failed!(
                    "--grid {rows}x{columns} needs lines of {columns} or {} values, and most have {sensors}; {advice}",
                    rows * columns
                ));
            }
        };
        if frames.rows > 1 && frames.end.is_none() && known.is_joined {
            return Err(Error::failed(
                "no line separates two frames, so the first row of a frame is unknown; print a blank line after each frame, \
                 or all of it on one line",
            ));
        }
    }
    if frames.rows == 0 {
        return Err(Error::failed("no line ends a frame as --frame-end says; leave it out, or say what does"));
    }
    Ok(())
}
