//! Tables as all commands print them.

use std::ops::{Deref, DerefMut};

use comfy_table::{Cell, CellAlignment, ContentArrangement, Table};
use console::{Term, style};
use somatic::internal::plain;

/// A table whose cells are one line each, without what a terminal would obey.
pub(super) struct TextTable(Table);

impl TextTable {
    pub(super) fn add_row(&mut self, row: impl IntoIterator<Item: Into<Cell>>) {
        let cell = |cell: Cell| Cell::new(plain::coloured_line(&cell.content()));
        self.0.add_row(row.into_iter().map(|content| cell(content.into())));
    }
}

impl Deref for TextTable {
    type Target = Table;

    fn deref(&self) -> &Table {
        &self.0
    }
}

impl DerefMut for TextTable {
    fn deref_mut(&mut self) -> &mut Table {
        &mut self.0
    }
}

/// A table without lines, under `headings`, as wide as the terminal at most; the columns `numbers` are aligned right.
pub(super) fn plain<'a>(
    headings: impl IntoIterator<Item = &'a str>,
    numbers: impl IntoIterator<Item = usize>,
) -> TextTable {
    let mut table = Table::new();
    table.load_style(comfy_table::presets::NOTHING).set_content_arrangement(ContentArrangement::Dynamic);
    table.set_header(headings.into_iter().map(Cell::new));
    for column in numbers {
        table.column_mut(column).into_iter().for_each(|column| column.set_cell_alignment(CellAlignment::Right));
    }
    let term = Term::stdout();
    if term.is_term() {
        table.set_width(term.size().1);
    }
    TextTable(table)
}

/// What a table of the first `listed` of `all` rows leaves out.
pub(super) fn more(all: usize, listed: usize) -> String {
    match all.checked_sub(listed) {
        None | Some(0) => String::new(),
        Some(more) => format!("{}\n", style(format!(" and {more} more; --json has all")).dim()),
    }
}

/// The table as text, its headings dim.
pub(super) fn shown(table: &TextTable) -> String {
    let mut text = String::new();
    for (index, line) in table.lines().enumerate() {
        let line = line.trim_end();
        text += &if index == 0 { style(line).dim().to_string() } else { line.to_owned() };
        text += "\n";
    }
    text
}
