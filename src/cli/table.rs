//! Tables as all commands print them.

use comfy_table::{Cell, CellAlignment, ContentArrangement, Table};
use console::{Term, style};

/// A table without lines, under `headings`, as wide as the terminal at most.
pub(super) fn plain<const N: usize>(headings: [&str; N]) -> Table {
    let mut table = Table::new();
    table.load_style(comfy_table::presets::NOTHING).set_content_arrangement(ContentArrangement::Dynamic);
    table.set_header(headings.map(Cell::new));
    let term = Term::stdout();
    if term.is_term() {
        table.set_width(term.size().1);
    }
    table
}

/// Aligns a column of numbers.
pub(super) fn right(table: &mut Table, column: usize) {
    if let Some(column) = table.column_mut(column) {
        column.set_cell_alignment(CellAlignment::Right);
    }
}

/// The table as text, its headings dim.
pub(super) fn shown(table: &Table) -> String {
    let mut text = String::new();
    for (index, line) in table.lines().enumerate() {
        let line = line.trim_end();
        text += &if index == 0 { style(line).dim().to_string() } else { line.to_owned() };
        text += "\n";
    }
    text
}
