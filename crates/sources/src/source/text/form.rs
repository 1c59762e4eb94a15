//! How lines of text are understood: what their columns are, and how many lines make a frame.

use std::fmt::Write as _;
use std::sync::Arc;

use super::super::column_names::columns;
use super::super::time_column::TimeUnit;
use super::cells::{Decoded, Separator};
use crate::signal::Channel;

/// How the values of a line are written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Syntax {
    /// Numbers with something between them.
    Numbers(Separator),
    /// `name: value`.
    Pairs,
    /// A line of JSON each.
    Json,
}

/// What ends a frame of several lines.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum End {
    Blank,
    /// Lines of this shape, as [`shape`] has it; and one of them, for messages.
    Shape(String, String),
    /// Lines that begin with this.
    Begins(String),
}

impl End {
    /// Whether `line`, which is not a row, is one.
    pub(super) fn is(&self, line: &str) -> bool {
        match self {
            Self::Blank => line.is_empty(),
            Self::Shape(wanted, _) => !line.is_empty() && *wanted == shape(line),
            Self::Begins(start) => line.starts_with(start.as_str()),
        }
    }

    fn words(&self) -> String {
        match self {
            Self::Blank => "a blank line".to_owned(),
            Self::Shape(_, line) | Self::Begins(line) => format!("a line such as `{}`", short(line)),
        }
    }
}

/// `line` with its numbers made alike, so that `frame 12` and `frame 13` are one shape.
pub(super) fn shape(line: &str) -> String {
    let mut shape = String::new();
    let mut run = String::new();
    for c in line.chars().take(80).chain(std::iter::once('\0')) {
        if c.is_ascii_digit() || matches!(c, '-' | '+' | '.') {
            run.push(c);
            continue;
        }
        if run.contains(|c: char| c.is_ascii_digit()) {
            shape.push('#');
        } else {
            shape.push_str(&run);
        }
        run.clear();
        shape.push(c);
    }
    shape
}

/// As much of a line as fits in a message.
pub(super) fn short(line: &str) -> String {
    super::super::csv_cells::shortened(line)
}

/// What a column is.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Use {
    /// The sensor at this place in a row.
    Sensor(usize),
    Time,
    /// Numbers that are not a sensor; why not.
    LeftOut(&'static str),
    /// A word.
    Word,
}

/// How lines are understood.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Form {
    pub(super) syntax: Syntax,
    /// Of each column: of a line of numbers by place, else by name.
    pub(super) columns: Vec<Use>,
    /// What columns are called; those of numbers may have no names.
    pub(super) names: Vec<String>,
    /// The line that names the columns, which comes again when a board starts again.
    pub(super) header: Option<String>,
    /// Sensors in a row.
    pub(super) width: usize,
    /// Rows of a frame.
    pub(super) rows: usize,
    pub(super) end: Option<End>,
    /// Whether a frame's names come on several lines.
    pub(super) is_spread: bool,
    pub(super) time: Option<TimeUnit>,
    /// Whether the unit of the time is not certain.
    pub(super) is_time_guessed: bool,
    /// Rows and columns of the grid that the sensors are, if they are one.
    pub(super) grid: Option<[usize; 2]>,
    pub(super) is_grid_guessed: bool,
    /// The channels of the sensors, where names or flags say them.
    pub(super) ids: Option<Vec<u32>>,
    /// How texts within JSON are numbers.
    pub(super) decoded: Option<Arc<Decoded>>,
    /// Whether paths say what is read of JSON, so that messages without these are of something else.
    pub(super) has_paths: bool,
    /// Whether each taxel has three sensors, as a map says.
    pub(super) has_axes: bool,
}

impl Form {
    /// Sensors of a frame.
    pub(super) fn sensors(&self) -> usize {
        self.width * self.rows
    }

    /// Taxels of a frame: those with three axes have three sensors each.
    pub(super) fn taxels(&self) -> usize {
        match &self.ids {
            Some(ids) => Channel::taxels_of(ids).len(),
            None => self.sensors() / if self.has_axes { 3 } else { 1 },
        }
    }

    /// What the columns in `which` are called in messages: `columns 2–17`, or their names.
    fn called(&self, which: &[usize]) -> String {
        if !self.names.is_empty() {
            let names: Vec<String> = which.iter().map(|&index| format!("`{}`", short(&self.names[index]))).collect();
            return match &names[..] {
                [first, .., last] if names.len() > 4 => format!("{first} to {last}"),
                names => names.join(", "),
            };
        }
        let is_row = which.windows(2).all(|pair| pair[1] == pair[0] + 1);
        match which {
            [first, .., last] if is_row => columns(first + 1, last + 1).replace(" to ", "–"),
            [only] => columns(only + 1, only + 1),
            several => {
                let numbers: Vec<String> = several.iter().take(8).map(|index| (index + 1).to_string()).collect();
                format!("columns {}{}", numbers.join(", "), if several.len() > 8 { ", …" } else { "" })
            }
        }
    }

    fn which(&self, is: impl Fn(&Use) -> bool) -> Vec<usize> {
        (0..self.columns.len()).filter(|&index| is(&self.columns[index])).collect()
    }

    /// What was understood, on a line; `has_rate` is whether a rate gives the times.
    pub(super) fn words(&self, has_rate: bool) -> String {
        let sensors = self.which(|column| matches!(column, Use::Sensor(_)));
        let called = self.called(&sensors);
        let verb = if sensors.len() == 1 { "is" } else { "are" };
        let count = self.taxels();
        let what = match self.grid {
            Some([rows, columns]) => format!("a {rows} × {columns} grid"),
            None if count == 1 => "a sensor".to_owned(),
            None => format!("a row of {count} sensors"),
        };
        let mut text = match self.rows {
            1 => format!("{called} {verb} {what}"),
            rows => format!("{called} of {rows} lines are {what}"),
        };
        if let Some(end) = self.end.as_ref().filter(|end| self.rows > 1 || **end != End::Blank) {
            let _ = write!(text, ", {} is between two frames", end.words());
        }
        let time = self.which(|column| *column == Use::Time);
        match self.time {
            Some(unit) => {
                let guess = if self.is_time_guessed { ", as it seems" } else { "" };
                let _ = write!(text, ", {} is time in {}{guess}", self.called(&time), unit.symbol());
            }
            None if has_rate => text += ", time advances by --rate",
            None => text += ", time is the time of arrival",
        }
        for why in ["counts frames", "rises like a time of unknown unit", "is not a sensor"] {
            let which = self.which(|column| *column == Use::LeftOut(why));
            if !which.is_empty() {
                let out = if which.len() == 1 { "is" } else { "are" };
                let _ = write!(text, "; {} {why} and {out} left out", self.called(&which));
            }
        }
        text
    }

    /// The flags that say it otherwise, where something was guessed.
    pub(super) fn advice(&self) -> Option<String> {
        let mut flags = Vec::new();
        if self.is_grid_guessed {
            flags.push(format!("--grid 1x{}", self.sensors()));
        }
        if self.is_time_guessed {
            flags.push("--time COLUMN:UNIT".to_owned());
        }
        if self.columns.contains(&Use::LeftOut("rises like a time of unknown unit")) {
            flags.push("--time COLUMN:UNIT or --columns".to_owned());
        }
        (!flags.is_empty()).then(|| format!("if that is wrong, add {}", flags.join(" and ")))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_that_differ_in_numbers_are_one_shape() {
        assert_eq!(shape("frame 12"), shape("frame -3.5"));
        assert_ne!(shape("frame 12"), shape("frame 12,3"));
        assert_ne!(shape("---"), shape("5"));
        assert!(End::Begins("--".to_owned()).is("---") && !End::Blank.is("x") && End::Blank.is(""));
    }
}
