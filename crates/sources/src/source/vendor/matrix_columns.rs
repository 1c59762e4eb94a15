//! What the columns of a plain table are: the time, sensors, totals of these, labels. The first rows show it, and the
//! names in the line above them, if there is one.

use super::super::column_names::{columns, grid_of, is_beside_sensors};
use super::super::time_column::{TimeUnit, by_size, calendar, is_long_step, unit_in_head};
use super::layout::Grid;
use super::lines::HEAD_BYTES;
use super::text::{Separator, Word};
use super::totals::{Total, totals};
use crate::error::{Error, Result, failed};

/// Rows that are looked at.
const MAX_ROWS: usize = 64;

/// The columns of a table with a line for each frame.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Columns {
    /// Whether the first one is the time.
    pub(super) has_time: bool,
    /// The unit of the time, if a name says it.
    pub(super) unit: Option<TimeUnit>,
    /// Columns after the sensors that are none: totals, then a label.
    pub(super) left_out: usize,
    /// All of it in words.
    pub(super) words: String,
}

/// The first rows of a table.
struct Rows<'a> {
    rows: Vec<Vec<Word<'a>>>,
    /// The names above them.
    names: Vec<String>,
}

/// What is known of a column for sure, and what may be.
#[derive(Clone, Copy)]
struct Likely {
    is_sure: bool,
    may_be: bool,
}

/// Whether `word` begins a row: a number, nothing, or a time of the calendar.
pub(super) fn begins_row(word: Word<'_>) -> bool {
    word.number().is_some() || word.is_empty() || calendar(&word.text()).is_some()
}

/// Whether `line` is a row of a table whose rows have several cells, unless `is_narrow`: it begins as one, and has a number. A
/// number alone above a wide table is part of what is said above it.
pub(super) fn is_row(separator: Separator, line: &[u8], is_narrow: bool) -> bool {
    let mut cells = separator.cells(line);
    let filled = cells.clone().filter(|word| !word.is_empty()).take(2).count();
    cells.clone().next().is_some_and(begins_row)
        && (is_narrow || filled > 1)
        && cells.any(|word| word.number().is_some())
}

impl<'a> Rows<'a> {
    /// The rows in `head`, the beginning of a text, as wide as the first; `None` if there is no whole one.
    fn from_head(separator: Separator, head: &'a [u8], is_narrow: bool) -> Option<Self> {
        let mut lines: Vec<&[u8]> = head.split(|&byte| byte == b'\n').collect();
        if head.len() >= HEAD_BYTES {
            // It goes on.
            lines.pop();
        }
        let cells = |line: &'a [u8]| separator.cells(line).collect::<Vec<_>>();
        let is_row = |line: &[u8]| is_row(separator, line, is_narrow);
        let first = lines.iter().position(|line| is_row(line))?;
        let above = lines[..first].iter().rev().find(|line| !line.trim_ascii().is_empty());
        let names =
            above.map_or_else(Vec::new, |line| separator.cells(line).map(|word| word.text().into_owned()).collect());
        let mut rows: Vec<Vec<Word<'_>>> =
            lines[first..].iter().filter(|line| is_row(line)).take(MAX_ROWS).map(|line| cells(line)).collect();
        let width = rows[0].iter().rposition(|word| !word.is_empty()).map_or(0, |last| last + 1);
        if width == 0 {
            return None;
        }
        rows.retain_mut(|row| {
            let is_wide = row.len() >= width && row[width..].iter().all(|word| word.is_empty());
            row.truncate(width);
            is_wide
        });
        Some(Self { rows, names })
    }

    fn width(&self) -> usize {
        self.rows[0].len()
    }

    fn column(&self, index: usize) -> impl Iterator<Item = Word<'a>> {
        self.rows.iter().filter_map(move |row| row.get(index).copied())
    }

    fn numbers(&self, index: usize) -> Option<Vec<f64>> {
        self.column(index).map(Word::number).collect()
    }

    /// The name above the last column.
    fn last_name(&self) -> Option<&str> {
        let is_whole = self.names.len() == self.width();
        self.names.last().filter(|_| is_whole).map(String::as_str)
    }

    /// Whether the first column is the time, and its unit, if a name says it. A line above that names the time alone is as good.
    fn time(&self) -> Result<(Likely, Option<TimeUnit>)> {
        let named = self.named_time()?;
        let is_calendar = self.column(0).all(|word| calendar(&word.text()).is_some());
        let times = self.numbers(0).unwrap_or_default();
        let rising = times.windows(2).filter(|pair| pair[1] > pair[0]).count();
        let may_be = !times.is_empty() && 2 * rising + 1 >= times.len();
        let is_sure = is_calendar || named.is_some();
        let unit = named.flatten().or(is_calendar.then_some(TimeUnit::Calendar));
        Ok((Likely { is_sure, may_be: may_be || is_sure }, unit))
    }

    /// What the line above says of a time in the first column; its unit may be a word of its own, as in `t [ms]` between blanks.
    fn named_time(&self) -> Result<Option<Option<TimeUnit>>> {
        let Some(name) = self.names.first() else { return Ok(None) };
        match self.names.get(1).filter(|next| next.starts_with(['[', '('])) {
            Some(next) => unit_in_head(&format!("{name} {next}")),
            None => unit_in_head(name),
        }
    }

    /// Whether the last column is a label.
    fn label(&self) -> Likely {
        let last = self.width() - 1;
        let is_word = |word: Word<'_>| !word.is_empty() && word.number().is_none();
        let is_sure = last > 0 && (self.column(last).all(is_word) || self.last_name().is_some_and(is_beside_sensors));
        let mut numbers = self.numbers(last).unwrap_or_default();
        numbers.sort_by(f64::total_cmp);
        numbers.dedup();
        let may_be = numbers.len() <= 1.max(self.rows.len() / 8) && numbers.iter().all(|number| number.fract() == 0.0);
        Likely { is_sure, may_be: last > 0 && (is_sure || may_be) }
    }

    fn totals(&self, first: usize, end: usize) -> Vec<Total> {
        totals(&self.rows, first, end)
    }
}

/// What the columns of a table of `grid` are whose text begins with `head`; `None` where the head does not tell, or a frame is a block
/// of lines.
///
/// # Errors
/// There are more or fewer columns than `grid` and what is beside it take, or it would take totals or the time for sensors; a
/// usage error, as flags are the way out.
pub(super) fn recognise(separator: Separator, grid: Grid, head: &[u8]) -> Result<Option<Columns>> {
    let Some(rows) = Rows::from_head(separator, head, is_narrow(grid)) else { return Ok(None) };
    let (width, cells) = (rows.width(), grid.cells());
    if width < cells {
        // Rows of a block, or too few.
        return Ok(None);
    }
    let ((time, unit), label) = (rows.time()?, rows.label());
    // By likelihood: where there is one column more, it is the time before it is a label.
    let fits = |has: bool, likely: Likely| if has { likely.may_be } else { !likely.is_sure };
    let readings: Vec<(bool, bool, Vec<Total>)> = [(true, false), (false, false), (true, true), (false, true)]
        .into_iter()
        .filter(|&(has_time, has_label)| fits(has_time, time) && fits(has_label, label))
        .map(|(has_time, has_label)| {
            let (first, end) = (usize::from(has_time), width - usize::from(has_label));
            (has_time, has_label, if first < end { rows.totals(first, end) } else { Vec::new() })
        })
        .collect();
    // Where totals are seen, no reading may take them for anything else.
    let has_totals = readings.iter().any(|(.., totals)| !totals.is_empty());
    for (has_time, has_label, totals) in readings {
        let (first, end) = (usize::from(has_time), width - usize::from(has_label));
        if first + cells + totals.len() != end || has_totals == totals.is_empty() {
            continue;
        }
        let left_out = totals.len() + usize::from(has_label);
        let unit = if has_time { unit } else { None };
        if has_time {
            check_step(&rows, unit)?;
        }
        let words = words(grid, &rows, first, &totals, has_label, unit);
        return Ok(Some(Columns { has_time, unit, left_out, words }));
    }
    Err(misfit(&rows, grid, time, label))
}

/// Whether rows of `grid` may have a single cell.
pub(super) fn is_narrow(grid: Grid) -> bool {
    grid.columns == 1
}

/// Refuses times that nobody says the unit of and that are hardly seconds.
fn check_step(rows: &Rows<'_>, unit: Option<TimeUnit>) -> Result<()> {
    let times = rows.numbers(0).unwrap_or_default();
    let mut steps: Vec<f64> = times.windows(2).map(|pair| pair[1] - pair[0]).collect();
    steps.sort_by(f64::total_cmp);
    let Some(&step) = steps.get(steps.len() / 2) else { return Ok(()) };
    let is_whole = times.iter().all(|t| t.fract() == 0.0);
    let is_said = unit.is_some() || times.first().is_some_and(|&first| by_size(first) != TimeUnit::Seconds);
    if is_said || !is_whole || !is_long_step(step) {
        return Ok(());
    }
    Err(Error::usage(format!(
        "column 1 is the time and rises by {step} a line, without a unit; write `t [ms]`, or `t [s]`, in a line above the first \
         one"
    )))
}

/// What was understood, in a line.
fn words(
    grid: Grid,
    rows: &Rows<'_>,
    first: usize,
    totals: &[Total],
    has_label: bool,
    unit: Option<TimeUnit>,
) -> String {
    let mut words = Vec::new();
    if first > 0 {
        let by_first = || rows.numbers(0).and_then(|times| times.first().copied()).map(by_size);
        let unit = unit.or_else(by_first).unwrap_or(TimeUnit::Seconds);
        words.push(format!("column 1: the time in {}", unit.symbol()));
    }
    let sensors = grid.cells();
    words.push(format!("{}: a {} × {} grid", columns(first + 1, first + sensors), grid.rows, grid.columns));
    if !totals.is_empty() {
        let sums: Vec<String> = totals.iter().map(|total| columns(total.first + 1, total.end)).collect();
        let places = columns(first + sensors + 1, first + sensors + totals.len());
        words.push(format!("{places}: totals of {}, left out", sums.join(" and of ")));
    }
    if has_label {
        words.push(format!("column {}: a label, left out", rows.width()));
    }
    words.join("; ")
}

/// The error for columns that are not those of `grid`.
fn misfit(rows: &Rows<'_>, grid: Grid, time: Likely, label: Likely) -> Error {
    let (width, cells) = (rows.width(), grid.cells());
    let has_time = time.is_sure || (time.may_be && rows.rows.len() > 2);
    let first = usize::from(has_time);
    let end = width - usize::from(label.is_sure && width > first + 1);
    let totals = rows.totals(first, end);
    let mut known = Vec::new();
    if has_time {
        known.push("column 1 is the time".to_owned());
    }
    if !totals.is_empty() {
        let sums: Vec<String> = totals.iter().map(|total| columns(total.first + 1, total.end)).collect();
        let verb = if totals.len() == 1 { "is the total" } else { "are the totals" };
        known.push(format!("{} {verb} of {}", columns(end - totals.len() + 1, end), sums.join(" and of ")));
    }
    if end < width {
        known.push(format!("column {width} is a label"));
    }
    let sensors = (end - totals.len()).saturating_sub(first);
    let rows_of_grid = grid.rows as usize;
    let fitting = if sensors > 0 && rows_of_grid > 1 && sensors.is_multiple_of(rows_of_grid) {
        format!("{rows_of_grid}x{}", sensors / rows_of_grid)
    } else {
        grid_of(sensors.max(1))
    };
    let known = if known.is_empty() { String::new() } else { format!(": {}", known.join(", and ")) };
    Error::usage(format!(
        "a line has {width} columns, and --grid {}x{} takes {cells} for sensors{known}; correct --grid, as to {fitting}, or remove the \
         columns that are not sensors",
        grid.rows, grid.columns
    ))
}

/// What may be tried with a text that begins with `head` and is of no known format.
pub(super) fn way_out(separator: Separator, head: &[u8]) -> Error {
    let table = "else save the columns of time and sensors as a CSV with the header `t,<taxel id>,...`";
    let is_wide = |rows: &Rows<'_>| rows.width() > 1;
    let wide = Rows::from_head(separator, head, false).filter(is_wide);
    let is_narrow = wide.is_none();
    let Some(rows) = wide.or_else(|| Rows::from_head(separator, head, true)) else {
        let first = head.split(|&byte| byte == b'\n').find(|line| !line.trim_ascii().is_empty()).unwrap_or_default();
        let first = super::text::shortened(super::text::decoded(first).trim());
        return failed!(
            "its format is unknown: no line is a row of numbers, such as `{first}`; name the format with --format, or leave \
             only the numbers, the time before them, and give the rows and columns of a frame with --grid; {table}"
        );
    };
    let (height, blocks) = blocks(separator, head, is_narrow);
    let likely = rows.time().map(|(time, _)| time);
    let first = usize::from(likely.is_ok_and(|time| time.is_sure || (time.may_be && rows.rows.len() > 2)));
    let end = rows.width() - usize::from(rows.label().is_sure);
    let grid = if blocks > 1 && height > 1 {
        format!("{height}x{}", rows.width())
    } else {
        grid_of((end.saturating_sub(first + rows.totals(first, end).len())).max(1))
    };
    Error::failed(format!(
        "its format is unknown; name it with --format, or, if its numbers are the sensors' values, give the rows and columns of a \
         frame, as --grid {grid}; {table}"
    ))
}

/// How many rows the first block of rows in `head` has, and how many blocks have as many.
fn blocks(separator: Separator, head: &[u8], is_narrow: bool) -> (usize, usize) {
    let mut heights = vec![0];
    for line in head.split(|&byte| byte == b'\n') {
        let is_row = is_row(separator, line, is_narrow);
        match heights.last_mut() {
            Some(height) if is_row => *height += 1,
            Some(0) | None => {}
            Some(_) => heights.push(0),
        }
    }
    let first = heights[0];
    (first, heights.iter().filter(|&&height| height == first).count())
}
