//! The columns of a CSV that are named instead of found out: sensors, their taxels, and the time.

use csv::ByteRecord;

use super::column_names::{columns, is_beside_sensors};
use super::csv_cells::{shortened, trimmed};
use super::csv_header::Header;
use super::text::{TextIds, TextOptions, TextTime};
use super::time_column::{TimeColumn, unit_at_end, unit_in_head};
use crate::error::{Error, Result};
use crate::signal::Channel;

/// How many names of columns a message lists.
const LISTED: usize = 12;

/// What the header `first` is by what is `asked`, for a body with the taxels `ids`. `has_rate` is whether a rate is given.
///
/// # Errors
/// A usage error: there are no such columns, or other ones than taxels.
pub(super) fn header_of(first: &ByteRecord, asked: &TextOptions, ids: &[u32], has_rate: bool) -> Result<Header> {
    let names: Vec<String> = first.iter().map(|cell| String::from_utf8_lossy(trimmed(cell)).into_owned()).collect();
    let time = time_of(&names, asked, has_rate)?;
    let time_at = time.as_ref().map(|(at, _)| *at);
    let sensors = sensors(&names, asked, time_at)?;
    let taxels = taxels(&names, &sensors, asked, ids)?;
    let is_left_out = |at: &usize| Some(*at) != time_at && !sensors.contains(at);
    let left_out: Vec<usize> = (0..names.len()).filter(is_left_out).collect();
    let mut words = vec![format!("{} of {} columns are sensors: {}", sensors.len(), names.len(), ranges(&sensors))];
    words.extend(time_at.map(|at| format!("column {} (`{}`) is the time", at + 1, shortened(&names[at]))));
    Ok(Header {
        time_at: time_at.unwrap_or(0),
        time: time.map(|(_, column)| column),
        taxels,
        left_out,
        notes: vec![words.join("; ")],
    })
}

/// The column of times and how it is read.
fn time_of(names: &[String], asked: &TextOptions, has_rate: bool) -> Result<Option<(usize, TimeColumn)>> {
    let unit_of = |name: &String| unit_in_head(name).ok().flatten();
    match &asked.time {
        Some(TextTime::Arrival) => {
            Err(Error::usage("--time arrival is for lines as they come; name the column of a table, or give --rate HZ"))
        }
        Some(TextTime::Column(_)) if has_rate => Err(Error::usage("--time and --rate: give one of them")),
        Some(TextTime::Column(named)) => {
            let at = names.iter().enumerate().position(|(at, name)| named.column.is(at, Some(name)));
            let at = at.ok_or_else(|| none("--time", &named.column.word(), names))?;
            let unit = named.unit.or_else(|| unit_of(&names[at]).flatten()).or_else(|| unit_at_end(&names[at]));
            Ok(Some((at, TimeColumn::new(unit))))
        }
        None if has_rate => Ok(None),
        None => match names.first().and_then(unit_of) {
            Some(unit) => Ok(Some((0, TimeColumn::new(unit)))),
            None => {
                Err(Error::usage("column 1 is not the time; name the column that is with --time, or give --rate HZ"))
            }
        },
    }
}

/// The columns of sensors, from 0, ascending.
fn sensors(names: &[String], asked: &TextOptions, time_at: Option<usize>) -> Result<Vec<usize>> {
    let others = (0..names.len()).filter(|at| Some(*at) != time_at);
    let Some(wanted) = &asked.columns else {
        let is_sensor = |at: &usize| !names[*at].is_empty() && !is_beside_sensors(&names[*at]);
        return Ok(others.filter(is_sensor).collect());
    };
    for column in &wanted.0 {
        if !names.iter().enumerate().any(|(at, name)| column.is(at, Some(name))) {
            return Err(none("--columns", &column.word(), names));
        }
    }
    let found: Vec<usize> =
        others.filter(|&at| wanted.0.iter().any(|column| column.is(at, Some(&names[at])))).collect();
    match found.is_empty() {
        true => Err(Error::usage("--columns names the column of the time alone; name those of the sensors")),
        false => Ok(found),
    }
}

/// The taxels of the columns `sensors`.
fn taxels(names: &[String], sensors: &[usize], asked: &TextOptions, ids: &[u32]) -> Result<Vec<u32>> {
    let by_name: Option<Vec<u32>> = sensors.iter().map(|&at| Some(Channel::named(&names[at])?.0)).collect();
    let taxels = match (&asked.ids, by_name) {
        (Some(TextIds::Listed(listed)), _) => listed.clone(),
        (_, Some(named)) => named,
        (Some(TextIds::Names), None) => {
            return Err(Error::usage(
                "--ids names: not all columns of sensors are called by a number, or as 4.u; list their taxels",
            ));
        }
        (None, None) => {
            let mut ids = ids.to_vec();
            Channel::side_by_side(&mut ids);
            ids
        }
    };
    if taxels.len() != sensors.len() {
        let of_body = Channel::taxels_of(&taxels).len();
        let values = if of_body == taxels.len() { String::new() } else { format!(" with {} values", taxels.len()) };
        let [columns, taxels] =
            [(sensors.len(), "column is a sensor", "columns are sensors"), (of_body, "taxel", "taxels")]
                .map(|(count, one, many)| format!("{count} {}", if count == 1 { one } else { many }));
        let listed = matches!(asked.ids, Some(TextIds::Listed(_)));
        let (whose, remedy) = match (listed, &asked.columns) {
            (true, Some(_)) => {
                ("--ids has ", "give each column one id, as 4,4.u,4.v for a taxel of three axes, or other --columns")
            }
            (true, None) => (
                "--ids has ",
                "give each column one id, as 4,4.u,4.v for a taxel of three axes, or name the columns with --columns",
            ),
            (false, _) => ("the body has ", "name the columns with --columns, or their taxels with --ids"),
        };
        return Err(Error::usage(format!("{columns}, and {whose}{taxels}{values}; {remedy}")));
    }
    let mut sorted = taxels.clone();
    sorted.sort_unstable();
    match sorted.windows(2).find(|pair| pair[0] == pair[1]) {
        Some(twice) => Err(Error::usage(format!("taxel {} has two columns; give each one", Channel(twice[0])))),
        None => Ok(taxels),
    }
}

fn none(flag: &str, word: &str, names: &[String]) -> Error {
    let listed: Vec<String> = names.iter().take(LISTED).map(|name| shortened(name)).collect();
    let more = if names.len() > LISTED { ", …" } else { "" };
    Error::usage(format!("{flag} {word}: there is no such column; the header has {}{more}", listed.join(", ")))
}

/// The places `all`, from 0 and ascending, as columns from 1.
fn ranges(all: &[usize]) -> String {
    let mut words = Vec::new();
    for part in all.chunk_by(|a, b| a + 1 == *b) {
        if let (Some(first), Some(last)) = (part.first(), part.last()) {
            words.push(columns(first + 1, last + 1));
        }
    }
    words.join(", ")
}
