//! Lines whose values have names: pairs and JSON; and what flags say of columns.

use std::collections::HashMap;
use std::sync::Arc;
use std::time::Duration;

use super::super::super::column_names::is_beside_sensors;
use super::super::super::time_column::{TimeUnit, unit_in_head};
use super::super::cells::{Cell, Decoded, json, pairs};
use super::super::form::{Form, Syntax, Use, short};
use super::super::options::{Column, TextIds, TextTime};
use super::clock::{Rising, rising};
use super::heard::{Heard, Known, guessed_grid};
use crate::error::{Result, failed};
use crate::signal::Channel;

/// Columns while it is found out what they are.
#[derive(Debug, Default)]
pub(super) struct Columns {
    pub(super) names: Vec<String>,
    pub(super) uses: Vec<Use>,
    pub(super) time: Option<TimeUnit>,
    pub(super) is_time_guessed: bool,
    /// Whether a name says that it is a time, but not in which unit.
    pub(super) is_unit_open: bool,
}

impl Columns {
    pub(super) fn new(names: Vec<String>, count: usize) -> Self {
        Self { names, uses: vec![Use::Sensor(0); count], ..Self::default() }
    }

    pub(super) fn sensors(&self) -> usize {
        self.uses.iter().filter(|column| matches!(column, Use::Sensor(_))).count()
    }

    fn name(&self, index: usize) -> Option<&str> {
        self.names.get(index).map(String::as_str)
    }
}

/// What a line says: its names and numbers.
struct Said {
    at: Duration,
    values: Vec<(String, Option<f64>)>,
}

fn said(line: &Heard, is_json: bool, decoded: Option<&Decoded>) -> Said {
    let mut values: Vec<(String, Option<f64>)> = Vec::new();
    let mut each = |name: &str, cell: Cell<'_>| match cell {
        Cell::Number(number) => values.push((name.to_owned(), Some(number))),
        Cell::Blank => values.push((name.to_owned(), None)),
        Cell::Word(_) => {}
    };
    if is_json {
        // It was JSON a moment ago.
        let _ = json(&line.text, decoded, &mut each);
    } else {
        pairs(&line.text, &mut each);
    }
    Said { at: line.at, values }
}

/// How `lines` of pairs, or of JSON, are written.
pub(super) fn named(lines: &[&Heard], is_json: bool, known: Known<'_>) -> Result<Form> {
    let paths = known.paths();
    let decoded = known.decoder.map(|decoder| Arc::new(Decoded { decoder, paths: paths.clone() }));
    let said: Vec<Said> = lines.iter().map(|line| said(line, is_json, decoded.as_deref())).collect();
    let mut counts: HashMap<&str, usize> = HashMap::new();
    let mut names: Vec<String> = Vec::new();
    for (name, _) in said.iter().flat_map(|said| &said.values) {
        let count = counts.entry(name).or_default();
        if *count == 0 {
            names.push(name.clone());
        }
        *count += 1;
    }
    let most = counts.values().copied().max().unwrap_or(0);
    // What only lines of another kind say, such as one about the start of a board, is not a sensor.
    names.retain(|name| 2 * counts[&**name] >= most);
    let widest = said.iter().map(|said| said.values.iter().filter(|(name, _)| names.contains(name)).count()).max();
    let is_spread = !is_json && widest.unwrap_or(0) < names.len();
    let count = names.len();
    let mut columns = Columns::new(names, count);
    times(&mut columns, &said)?;
    by_options(&mut columns, known)?;
    let sensors = columns.sensors();
    let ids = ids(&columns, sensors, known)?;
    let matrix = matrix(&columns);
    let form = Form {
        syntax: if is_json { Syntax::Json } else { Syntax::Pairs },
        width: sensors,
        rows: 1,
        end: None,
        header: None,
        names: columns.names,
        columns: columns.uses,
        time: columns.time,
        is_time_guessed: columns.is_time_guessed,
        is_spread,
        grid: None,
        is_grid_guessed: false,
        ids,
        decoded,
        has_paths: !paths.is_empty(),
        has_axes: known.has_axes,
    };
    sized(form, matrix, known)
}

/// The last part of a path such as `values.4`.
fn last_part(name: &str) -> &str {
    name.rsplit('.').next().unwrap_or(name)
}

/// The channel that a path such as `values.4` or `values.4.u` ends with.
fn channel_in(name: &str) -> Option<Channel> {
    let last = last_part(name);
    // `u` of `4.u` is behind the last dot.
    let start = name.len() - last.len();
    let whole = matches!(last, "u" | "v").then(|| last_part(&name[..start.saturating_sub(1)]).len() + 1);
    Channel::named(&name[start - whole.unwrap_or(0)..])
}

/// Which names are of a time, and which of no sensor.
fn times(columns: &mut Columns, said: &[Said]) -> Result<()> {
    for (index, name) in columns.names.clone().iter().enumerate() {
        let unit = unit_in_head(last_part(name)).map_err(|e| e.at(format!("`{name}`")))?;
        if let Some(unit) = unit.filter(|_| columns.time.is_none()) {
            columns.uses[index] = Use::Time;
            let given: Vec<(f64, Duration)> = said
                .iter()
                .filter_map(|said| Some((said.values.iter().find(|(own, _)| own == name)?.1?, said.at)))
                .collect();
            let (values, at): (Vec<f64>, Vec<Duration>) = given.into_iter().unzip();
            // Seconds, unless the clock on the wall says another unit.
            columns.time = Some(unit.unwrap_or(match rising(&values, &at) {
                Rising::Time(unit, false) => unit,
                _ => TimeUnit::Seconds,
            }));
        } else if is_beside_sensors(last_part(name)) {
            columns.uses[index] = Use::LeftOut("is not a sensor");
        }
    }
    Ok(())
}

/// Rows and columns of the sensors where names such as `m[0][3]` say them.
fn matrix(columns: &Columns) -> Option<[usize; 2]> {
    let mut size = [0, 0];
    let mut count = 0;
    for (name, _) in columns.names.iter().zip(&columns.uses).filter(|(_, column)| matches!(column, Use::Sensor(_))) {
        let mut indices =
            name.strip_suffix(']')?.rsplit('[').take(2).map(|part| part.trim_end_matches(']').parse::<usize>());
        let (Some(Ok(column)), Some(Ok(row))) = (indices.next(), indices.next()) else { return None };
        size = [size[0].max(row + 1), size[1].max(column + 1)];
        count += 1;
    }
    (count > 0 && size[0].checked_mul(size[1]) == Some(count)).then_some(size)
}

/// What flags say of columns.
///
/// # Errors
/// There are no such columns.
pub(super) fn by_options(columns: &mut Columns, known: Known<'_>) -> Result<()> {
    let options = known.options;
    let found = |columns: &Columns, column: &Column| -> Result<Vec<usize>> {
        let found: Vec<usize> =
            (0..columns.uses.len()).filter(|&index| column.is(index, columns.name(index))).collect();
        let is_short = matches!(column, Column::Numbers(_, high) if *high > columns.uses.len());
        if found.is_empty() || is_short {
            let there = match columns.names.is_empty() {
                true => format!("lines have {} columns", columns.uses.len()),
                false => format!("columns are {}", short(&columns.names.join(", "))),
            };
            return Err(failed!("there is no column `{}`; {there}", column.word()).into_usage());
        }
        Ok(found)
    };
    match &options.time {
        Some(TextTime::Arrival) => {
            (columns.time, columns.is_time_guessed) = (None, false);
            for column in columns.uses.iter_mut().filter(|column| **column == Use::Time) {
                *column = Use::LeftOut("is not a sensor");
            }
        }
        Some(TextTime::Column(time)) => {
            let index = found(columns, &time.column)?[0];
            let before = columns.time;
            for column in columns.uses.iter_mut().filter(|column| **column == Use::Time) {
                *column = Use::Sensor(0);
            }
            columns.uses[index] = Use::Time;
            columns.time = Some(time.unit.or(before).unwrap_or(TimeUnit::Seconds));
            columns.is_time_guessed = false;
        }
        None => {}
    }
    if let Some(asked) = &options.columns {
        let mut is_sensor = vec![false; columns.uses.len()];
        for column in &asked.0 {
            found(columns, column)?.into_iter().for_each(|index| is_sensor[index] = true);
        }
        for (index, is_sensor) in is_sensor.into_iter().enumerate() {
            match (&columns.uses[index], is_sensor) {
                (Use::Time, true) if options.time.is_some() => {
                    return Err(
                        failed!("column {} is the time by --time and a sensor by --columns", index + 1).into_usage()
                    );
                }
                (Use::Time, true) => {
                    (columns.uses[index], columns.time) = (Use::Sensor(0), None);
                    columns.is_time_guessed = false;
                }
                (Use::Word, true) => return Err(failed!("column {} holds words, not a sensor", index + 1)),
                (_, true) => columns.uses[index] = Use::Sensor(0),
                (Use::Sensor(_), false) => columns.uses[index] = Use::LeftOut("is not a sensor"),
                (_, false) => {}
            }
        }
    }
    if known.has_rate && columns.time.is_some() {
        let what = "lines have their own times; leave out --rate, or add --time arrival";
        return Err(failed!("{what}").into_usage());
    }
    // Those of one path follow those of the one before, and the items of arrays each other.
    let paths = known.paths();
    let place_of = |index: usize| {
        let name = columns.names.get(index)?;
        paths.iter().enumerate().find_map(|(number, path)| Some((number, path.place_of(name)?)))
    };
    let mut sensors: Vec<usize> =
        (0..columns.uses.len()).filter(|&index| matches!(columns.uses[index], Use::Sensor(_))).collect();
    sensors.sort_by_cached_key(|&index| place_of(index));
    for (place, &index) in sensors.iter().enumerate() {
        columns.uses[index] = Use::Sensor(place);
    }
    if sensors.is_empty() {
        return Err(failed!("no column is a sensor; --columns says which are"));
    }
    Ok(())
}

/// The taxels that flags or names give to the `count` sensors.
pub(super) fn ids(columns: &Columns, count: usize, known: Known<'_>) -> Result<Option<Vec<u32>>> {
    if let Some(TextIds::Listed(ids)) = &known.options.ids {
        if ids.len() != count {
            return Err(failed!("--ids names {} taxels, and a frame has {count} sensors", ids.len()).into_usage());
        }
        return Ok(Some(ids.clone()));
    }
    let sensors = columns.names.iter().zip(&columns.uses).filter(|(_, column)| matches!(column, Use::Sensor(_)));
    let ids: Option<Vec<u32>> = sensors.map(|(name, _)| Some(channel_in(name)?.0)).collect();
    let ids = ids.filter(|ids| ids.len() == count && count > 0).filter(|ids| {
        let mut sorted = ids.clone();
        sorted.sort_unstable();
        sorted.windows(2).all(|pair| pair[0] != pair[1])
    });
    match (&known.options.ids, ids) {
        (Some(TextIds::Names), None) => Err(failed!(
            "--ids names needs columns that are called by whole numbers, or as 4.u, each by a different one"
        )
        .into_usage()),
        (_, ids) => Ok(ids),
    }
}

/// `form` with the grid that is asked for, that `matrix` says, or that is guessed.
pub(super) fn sized(mut form: Form, matrix: Option<[usize; 2]>, known: Known<'_>) -> Result<Form> {
    let count = form.taxels();
    if let Some([rows, columns]) = known.grid {
        if known.may_have_grids && count > rows * columns && count.is_multiple_of(rows * columns) {
            return Ok(form);
        }
        if rows * columns != count {
            return Err(failed!(
                "--grid {rows}x{columns} is {} sensors, and a frame has {count}; --columns says which columns are sensors",
                rows * columns
            ));
        }
        form.grid = (rows > 1 && columns > 1).then_some([rows, columns]);
        return Ok(form);
    }
    form.grid = matrix.filter(|[rows, columns]| *rows > 1 && *columns > 1);
    if form.grid.is_none() && form.rows > 1 && form.width > 1 {
        form.grid = Some([form.rows, form.width]);
    }
    if form.grid.is_none() && form.rows == 1 && form.ids.is_none() {
        form.grid = guessed_grid(count);
        form.is_grid_guessed = form.grid.is_some();
    }
    Ok(form)
}
