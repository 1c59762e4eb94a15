//! The table of touches of the whole body: one row per frame and touch.

use super::frame_columns::frame_columns;
use super::names::{suffixes, unit_of};
use super::row::{OfTouch, Row, TableColumn, TableType, ValueOf};
use crate::percept::{Percepts, TOUCH_COLUMNS, TouchOutputs};
use crate::sink::Session;

/// The columns of touches that have `outputs`.
pub(super) fn columns(outputs: TouchOutputs, session: &Session<'_>) -> Vec<TableColumn> {
    let column =
        |name: &str, unit: &str, kind, help: &str, of| TableColumn::new(name, unit, kind, help, ValueOf::OnSkin(of));
    let mut columns = frame_columns(session);
    let id = match session.recordings {
        [] => "Its id: from onset to release, and never used again.",
        _ => "Its id: from onset to release, and not used again in its recording.",
    };
    columns.extend([
        column("touch", "", TableType::U64, id, OfTouch::Id),
        column("age", "s", TableType::F64, "Time since its onset.", OfTouch::Age),
        column("link", "", TableType::Word, "The link with most of its total.", OfTouch::Link),
        column(
            "in",
            "",
            TableType::Word,
            "The link in whose frame its place and directions are, or `world`.",
            OfTouch::In,
        ),
    ]);
    for (index, quantity) in TOUCH_COLUMNS.iter().enumerate().filter(|(_, of)| outputs.contains(of.output)) {
        if quantity.is_whole() {
            let whole = column(quantity.name, "1", TableType::U32, quantity.help, OfTouch::Whole(index));
            columns.push(if quantity.output == TouchOutputs::ACTIVE { whole } else { whole.or_absent() });
            continue;
        }
        if quantity.output == TouchOutputs::FIT_KIND {
            columns.push(column(quantity.name, "1", TableType::Word, quantity.help, OfTouch::Kind).or_absent());
            continue;
        }
        let unit = unit_of(quantity.unit, session);
        let parts: &[&str] = match quantity.output {
            TouchOutputs::SPREAD => &["along", "across"],
            _ => suffixes(quantity.components),
        };
        for (component, part) in parts.iter().enumerate() {
            let name = if part.is_empty() { quantity.name.to_owned() } else { format!("{}_{part}", quantity.name) };
            let value = OfTouch::Number(index, component);
            columns.push(column(&name, &unit, TableType::F64, quantity.help, value).or_absent());
        }
    }
    let mut list = |output, name: &str, help: &str, of| {
        if outputs.contains(output) {
            columns.push(column(name, "", TableType::Words, help, of));
        }
    };
    list(TouchOutputs::LINKS, "links", "All links that it lies on.", OfTouch::Links);
    list(TouchOutputs::FIELDS, "fields", "The fields that hold parts of it.", OfTouch::Fields);
    list(TouchOutputs::TAXELS, "taxels", "The ids of its taxels.", OfTouch::Taxels);
    columns.push(column(
        "flags",
        "",
        TableType::Words,
        "Why quantities are absent or in doubt, by name.",
        OfTouch::Flags,
    ));
    columns
}

/// The rows of a frame's touches; `None` where none are looked for.
pub(super) fn rows(percepts: &Percepts, frame: usize) -> Option<impl Iterator<Item = Row<'_>>> {
    let found = percepts.touches(frame)?;
    let row = move |on_skin| Row { percepts, frame, field: 0, on_skin: Some((found, on_skin)), contact: None };
    Some(found.touches.iter().map(row))
}
