//! The first row of a CSV: which column is the time, and which taxels the others are. A row of values that stands where the header
//! should is found out, rather than read as ids.

use std::collections::HashMap;

use csv::ByteRecord;

use super::column_names::{grid_of, is_beside_sensors};
use super::csv_cells::{number, shortened, trimmed};
use super::time_column::{TimeColumn, calendar, unit_in_head};
use crate::error::{Error, Result, failed};
use crate::signal::Channel;

/// Rows below the first that tell whether that is a frame.
pub(super) const ROWS_BELOW: usize = 3;

/// What the first row says.
pub(super) struct Header {
    /// The times, if there are any, and their column, from 0.
    pub(super) time: Option<TimeColumn>,
    pub(super) time_at: usize,
    pub(super) taxels: Vec<u32>,
    /// Columns that are not a sensor, from 0, ascending.
    pub(super) left_out: Vec<usize>,
    /// What is to be said of how it was understood.
    pub(super) notes: Vec<String>,
}

/// Whether the rows below `first` are needed to tell whether it is a header: it names no time, and is not ids in ascending order.
pub(super) fn is_doubtful(first: &ByteRecord) -> bool {
    let has_time = first.get(0).is_some_and(|cell| unit_in_head(&word(cell)).is_ok_and(|unit| unit.is_some()));
    !has_time && !ids(first).is_some_and(|ids| ids.is_sorted())
}

/// Reads the header `first`; `below` are the rows under it if it is doubtful. `has_rate` is whether a rate is given.
///
/// # Errors
/// It is not a header. A usage error where flags are the way out.
pub(super) fn read(first: &ByteRecord, below: &[ByteRecord], has_rate: bool) -> Result<Header> {
    let unit = first.get(0).map(|cell| unit_in_head(&word(cell))).transpose().map_err(|e| e.at("column 1"))?.flatten();
    if unit.is_some() && has_rate {
        return Err(Error::usage("the recording has its own times in column 1; leave out --rate"));
    }
    let ids = ids(first);
    let is_plain = ids.as_ref().is_some_and(|ids| ids.is_sorted() || !resembles(first, below));
    if unit.is_none() && !is_plain && is_frame(first, below) {
        return Err(no_header(first, below, has_rate));
    }
    let mut header = Header {
        time: unit.map(TimeColumn::new),
        time_at: 0,
        taxels: Vec::new(),
        left_out: Vec::new(),
        notes: Vec::new(),
    };
    let skipped = usize::from(header.time.is_some());
    let has_ids = first.iter().skip(skipped).any(|cell| Channel::named(&word(cell)).is_some());
    let mut columns = HashMap::new();
    for (index, cell) in first.iter().enumerate().skip(skipped) {
        if has_ids && is_beside_sensors(&word(cell)) {
            header.left_out.push(index);
            let name = shortened(&word(cell));
            header.notes.push(format!("column {} (`{name}`) is not a taxel and is left out", index + 1));
            continue;
        }
        let id = header_id(index + 1, cell, header.time.is_some(), || way_out(first, below, skipped))?;
        if let Some(before) = columns.insert(id, index + 1) {
            return Err(failed!(
                "taxel {} heads columns {before} and {}; give each taxel one column",
                Channel(id),
                index + 1
            ));
        }
        header.taxels.push(id);
    }
    let grid = grid_of(first.len());
    // Checked last, so that a file without any header gets the header's message.
    if header.time.is_none() && !has_rate {
        return Err(Error::usage(format!(
            "the recording has no column `t`; give its frame rate with --rate HZ; if row 1 is a frame too, add --grid {grid}"
        )));
    }
    if header.taxels.is_empty() {
        return Err(Error::failed("the header names no taxel; it should be `t,<taxel id>,<taxel id>,...`"));
    }
    if header.time.is_none() {
        let ids: Vec<String> = header.taxels.iter().take(4).map(|&id| Channel(id).to_string()).collect();
        let more = if header.taxels.len() > 4 { ",…" } else { "" };
        header.notes.push(format!(
            "row 1 ({}{more}) is read as the taxels' ids; if it is a frame, --grid {grid} reads it as one",
            ids.join(",")
        ));
    }
    Ok(header)
}

fn word(cell: &[u8]) -> String {
    String::from_utf8_lossy(trimmed(cell)).into_owned()
}

/// The ids that `row` is, if each of its cells is one and none is there twice.
fn ids(row: &ByteRecord) -> Option<Vec<u32>> {
    let ids: Vec<u32> = row.iter().map(|cell| Some(Channel::named(&word(cell))?.0)).collect::<Option<_>>()?;
    let mut sorted = ids.clone();
    sorted.sort_unstable();
    sorted.windows(2).all(|pair| pair[0] != pair[1]).then_some(ids)
}

/// Whether the numbers of `first` are near those of the next row, column by column, as one frame's are to the next one's.
fn resembles(first: &ByteRecord, below: &[ByteRecord]) -> bool {
    let Some(next) = below.first().filter(|next| next.len() == first.len()) else { return false };
    first.iter().zip(next).all(|(a, b)| match (number(trimmed(a)), number(trimmed(b))) {
        (Some(a), Some(b)) => (a - b).abs() <= 0.3 * a.abs().max(b.abs()),
        _ => false,
    })
}

/// Columns at the end of `row` that are words.
fn labels(row: &ByteRecord) -> usize {
    let is_word = |cell: &[u8]| !trimmed(cell).is_empty() && number(trimmed(cell)).is_none();
    let cells: Vec<&[u8]> = row.iter().collect();
    cells.iter().rev().take_while(|cell| is_word(cell)).count()
}

/// Whether `row` is values: numbers and blanks, with a time of the calendar before them, or with words after them that the rows
/// below have too.
fn is_frame(row: &ByteRecord, below: &[ByteRecord]) -> bool {
    let labels = labels(row);
    let values = row.len() - labels;
    let has_numbers = row.iter().any(|cell| number(trimmed(cell)).is_some());
    let is_value = |(index, cell): (usize, &[u8])| {
        let cell = trimmed(cell);
        cell.is_empty() || number(cell).is_some() || (index == 0 && calendar(&String::from_utf8_lossy(cell)).is_some())
    };
    has_numbers
        && row.iter().enumerate().take(values).all(is_value)
        && (labels == 0 || (!below.is_empty() && below.iter().all(|row| self::labels(row) == labels)))
}

/// Whether the first column of these rows rises as a time does.
fn begins_with_time(rows: &[&ByteRecord]) -> bool {
    let first = |row: &&ByteRecord| -> Option<f64> {
        let cell = trimmed(row.get(0)?);
        number(cell).or_else(|| calendar(&String::from_utf8_lossy(cell)))
    };
    let times: Option<Vec<f64>> = rows.iter().map(first).collect();
    let Some(times) = times.filter(|times| times.len() > 2) else { return false };
    let steps: Vec<f64> = times.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let (low, high) =
        steps.iter().fold((f64::INFINITY, 0.0_f64), |(low, high), step| (low.min(*step), high.max(*step)));
    low > 0.0 && high <= 2.0 * low
}

/// The error for a frame where the header should be.
fn no_header(first: &ByteRecord, below: &[ByteRecord], has_rate: bool) -> Error {
    let rows: Vec<&ByteRecord> = std::iter::once(first).chain(below).collect();
    let (labels, has_time) = (labels(first), begins_with_time(&rows) || calendar(&word(&first[0])).is_some());
    let sensors = first.len() - labels - usize::from(has_time);
    let mut reads = vec![format!("{sensors} sensors")];
    if has_time {
        reads.insert(0, "column 1 as the time".to_owned());
    }
    if labels > 0 {
        reads.push("leaves the words at the end out".to_owned());
    }
    let rate = match (has_time, has_rate) {
        (true, true) => "leave out --rate, and ",
        (false, false) => "give --rate HZ, and ",
        _ => "",
    };
    Error::usage(format!(
        "row 1 is a frame of {} cells, not a header `t,<taxel id>,...`; {rate}add --grid {}, which reads {}",
        first.len(),
        grid_of(sensors.max(1)),
        reads.join(" and ")
    ))
}

/// What to do about a header of names.
fn way_out(first: &ByteRecord, below: &[ByteRecord], skipped: usize) -> String {
    let heads = "head each sensor's column with its taxel's id, a whole number, and remove the other columns";
    let is_table = below.first().is_none_or(|next| next.len() == first.len() && is_frame(next, &[]));
    let sensors = first.len() - skipped;
    match is_table && sensors > 0 {
        true => format!(
            "say which columns are sensors, as --columns {}-{} does; or {heads}; if they all are sensors, add --grid {}",
            skipped + 1,
            first.len(),
            grid_of(sensors)
        ),
        false => format!("the header is `t,<taxel id>,<taxel id>,...`: {heads}"),
    }
}

/// What to do about a time that is not in column 1 but in `column`; `has_time` is whether column 1 has one, too.
fn time_elsewhere(column: usize, has_time: bool) -> String {
    match has_time {
        true => "column 1 has the time already; remove one of the two".to_owned(),
        false => format!("if it is the time, --time {column} says so; else head it with an id"),
    }
}

/// The taxel id that heads column `column`, counted from 1. `has_time` is whether column 1 is the time.
fn header_id(column: usize, cell: &[u8], has_time: bool, way_out: impl FnOnce() -> String) -> Result<u32> {
    let word = word(cell);
    if let Some(channel) = Channel::named(&word) {
        return Ok(channel.0);
    }
    let remedy = if cell.starts_with(b"\xFF\xFE") || cell.starts_with(b"\xFE\xFF") {
        "the file is UTF-16; save it as UTF-8".to_owned()
    } else if word.contains('"') {
        "ids have no quotes: remove the quote".to_owned()
    } else if word.contains([';', '\t']) {
        "columns are separated by commas".to_owned()
    } else if word.contains('\r') {
        "lines should end with a newline".to_owned()
    } else if word.is_empty() {
        "remove the comma before it, or write the id".to_owned()
    } else if unit_in_head(&word).is_ok_and(|unit| unit.is_some()) {
        time_elsewhere(column, has_time)
    } else {
        way_out()
    };
    Err(failed!("column {column} is headed `{}`, which is not a taxel id; {remedy}", shortened(&word)))
}
