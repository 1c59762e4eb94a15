//! A line that is looked at, what it looks like, and what is known beside the lines.

use std::time::Duration;

use super::super::super::map::{ArrayPath, Decoder};
use super::super::cells::{Cell, Separator, json, may_be_json, pairs};
use super::super::options::{Column, TextOptions};

/// A line as it came, without blanks around it, and when.
#[derive(Clone, Debug)]
pub(in crate::source::text) struct Heard {
    pub(in crate::source::text) text: String,
    pub(in crate::source::text) at: Duration,
}

/// What a line looks like.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::source::text) enum Kind {
    Blank,
    Numbers,
    Pairs,
    Json,
    Words,
}

/// What `line` looks like by itself.
pub(in crate::source::text) fn kind(line: &str) -> Kind {
    if line.is_empty() {
        return Kind::Blank;
    }
    if may_be_json(line) {
        let mut numbers = 0;
        if json(line, None, &mut |_, cell| numbers += usize::from(matches!(cell, Cell::Number(_)))).is_ok() {
            return if numbers > 0 { Kind::Json } else { Kind::Words };
        }
    }
    if pairs(line, &mut |_, _| {}) {
        return Kind::Pairs;
    }
    let mut cells = Vec::new();
    Separator::Any.split(line, &mut cells);
    let numbers = cells.iter().filter(|cell| matches!(cell, Cell::Number(_))).count();
    if numbers > 0 && 2 * numbers >= cells.len() { Kind::Numbers } else { Kind::Words }
}

/// What is known beside the lines.
#[derive(Clone, Copy, Debug)]
pub(in crate::source::text) struct Known<'a> {
    pub(in crate::source::text) options: &'a TextOptions,
    pub(in crate::source::text) grid: Option<[usize; 2]>,
    /// Whether there may be several of that grid.
    pub(in crate::source::text) may_have_grids: bool,
    /// Whether the first line may be the end of a longer one.
    pub(in crate::source::text) is_joined: bool,
    /// Whether frames are stamped by a rate.
    pub(in crate::source::text) has_rate: bool,
    /// How texts within JSON are numbers, where a map says it.
    pub(in crate::source::text) decoder: Option<Decoder>,
    /// Whether a map says that taxels have three axes.
    pub(in crate::source::text) has_axes: bool,
}

impl Known<'_> {
    /// The paths of what is read of JSON.
    pub(super) fn paths(&self) -> Vec<ArrayPath> {
        let columns = self.options.columns.iter().flat_map(|columns| &columns.0);
        let path = |column: &Column| if let Column::Path(path) = column { Some(path.clone()) } else { None };
        columns.filter_map(path).collect()
    }
}

/// The grid of `count` sensors that nobody says anything of: a square where they make one and are many.
pub(super) fn guessed_grid(count: usize) -> Option<[usize; 2]> {
    let side = count.isqrt();
    (count >= 16 && side * side == count).then_some([side, side])
}
