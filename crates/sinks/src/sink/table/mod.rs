//! Percepts as a table: one row per frame and field in contact, a column for each component of an output.
//!
//! [`percept_columns`], [`touch_columns`] and [`self_contact_columns`] list the columns; sinks write by these lists.

#[cfg(feature = "arrow")]
mod arrow_table;
mod csv_sink;
mod frame_columns;
mod names;
mod on_skin;
#[cfg(feature = "parquet")]
mod parquet_sink;
mod path_beside;
mod row;

#[cfg(feature = "arrow")]
pub use arrow_table::{ArrowTable, TableKind};
pub use csv_sink::CsvSink;
#[cfg(feature = "parquet")]
pub use parquet_sink::ParquetSink;
pub(super) use path_beside::path_beside;
pub use row::{TableColumn, TableType};

use self::frame_columns::frame_columns;
use self::names::{X_Y_AND_Z, suffixes, unit_of, unit_of_fields};
use self::row::{Row, ValueOf};
use super::{FieldNames, Session};
use crate::percept::{Column, Outputs, Percepts, Unit};

/// Time, frame and field, with which every row of percepts begins.
fn keys(session: &Session<'_>) -> Vec<TableColumn> {
    let mut columns = frame_columns(session);
    columns.extend([
        TableColumn::new("field", "", TableType::Word, "Name of the field.", ValueOf::Field),
        TableColumn::new(
            "link",
            "",
            TableType::Word,
            "The link in whose frame positions and normals are, or `world`.",
            ValueOf::Link,
        ),
    ]);
    columns.extend(letter_columns(&session.names));
    columns
}

/// Letter and signal, where a field has percepts of several.
fn letter_columns(names: &[FieldNames]) -> impl Iterator<Item = TableColumn> {
    let letter = names.iter().any(|name| name.letter.is_some()).then(|| {
        let help = "Of what the percept is made: `sustained`, `change`, `shear`, `temperature` or `proximity`.";
        TableColumn::new("letter", "", TableType::Word, help, ValueOf::Letter).or_absent()
    });
    let signal = names.iter().any(|name| name.signal.is_some()).then(|| {
        let help = "The signal of the sensors: `raw` or `linear`.";
        TableColumn::new("signal", "", TableType::Word, help, ValueOf::Signal).or_absent()
    });
    letter.into_iter().chain(signal)
}

/// The columns of the percepts of a session: keys, contact, a column for each component of its outputs, and flags.
#[must_use]
pub fn percept_columns(session: &Session<'_>) -> Vec<TableColumn> {
    let mut columns = keys(session);
    columns.push(TableColumn::new("contact", "", TableType::Bool, "Whether the field is touched; of letter proximity whether something is in range, of temperature whether there is a reading.", ValueOf::Contact));
    columns.extend(output_columns(session));
    let help = "Why quantities are absent or in doubt, by name.";
    columns.push(TableColumn::new("flags", "", TableType::Words, help, ValueOf::Flags));
    columns
}

/// A column for each component of the outputs.
fn output_columns(session: &Session<'_>) -> Vec<TableColumn> {
    columns_of(session.outputs, session, ValueOf::Output)
}

/// A column for each component of `outputs`, where `value` says that it is.
fn columns_of(
    outputs: Outputs,
    session: &Session<'_>,
    value: impl Fn(&'static Column, usize) -> ValueOf,
) -> Vec<TableColumn> {
    let table_columns = |column: &'static Column| {
        let (kind, value) = (kind_of(column, session), &value);
        let unit = unit_of_fields(column, session);
        suffixes(column.components).iter().enumerate().map(move |(component, suffix)| {
            let name = if suffix.is_empty() { column.name.to_owned() } else { format!("{}_{suffix}", column.name) };
            TableColumn::new(&name, &unit, kind, column.help, value(column, component)).or_absent()
        })
    };
    outputs.columns().flat_map(table_columns).collect()
}

fn kind_of(column: &Column, session: &Session<'_>) -> TableType {
    match column {
        _ if column.is_whole() => TableType::U32,
        _ if column.is_double() || session.is_double => TableType::F64,
        _ => TableType::F32,
    }
}

/// The columns of a session's touches, one row each; none where it looks for none.
#[must_use]
pub fn touch_columns(session: &Session<'_>) -> Vec<TableColumn> {
    session.skin().map_or(Vec::new(), |skin| on_skin::columns(skin.outputs, session))
}

/// The columns of a session's self-contacts, one row each.
#[must_use]
pub fn self_contact_columns(session: &Session<'_>) -> Vec<TableColumn> {
    let p = unit_of(Unit::P, session);
    let mut columns = frame_columns(session);
    columns.push(TableColumn::new("id", "", TableType::U64, "Lasts as long as both touches.", ValueOf::ContactId));
    for (side, letter) in ["a", "b"].into_iter().enumerate() {
        let mut column = |name: &str, unit: &str, kind, help: &str, value| {
            columns.push(TableColumn::new(&format!("{name}_{letter}"), unit, kind, help, value));
        };
        column("link", "", TableType::Word, "The link on this side.", ValueOf::SideLink(side));
        column("touch", "", TableType::U64, "The `id` of its touch.", ValueOf::SideTouch(side));
        column("total", &p, TableType::F64, "ΣP over the touch's taxels.", ValueOf::SideTotal(side));
    }
    for (component, suffix) in X_Y_AND_Z.into_iter().enumerate() {
        let (name, help) = (format!("position_{suffix}"), "Halfway between the places of both touches, in the world.");
        columns.push(TableColumn::new(&name, "m", TableType::F64, help, ValueOf::ContactPosition(component)));
    }
    let help = "How far these places are apart.";
    columns.push(TableColumn::new("distance", "m", TableType::F64, help, ValueOf::ContactDistance));
    let help = "Between the outward normals there, π where they oppose.";
    columns.push(TableColumn::new("angle", "rad", TableType::F64, help, ValueOf::ContactAngle));
    columns
}

/// The rows of a frame: its fields in contact, or all.
fn rows(percepts: &Percepts, frame: usize, all_fields: bool) -> impl Iterator<Item = Row<'_>> {
    let listed = move |&field: &usize| all_fields || percepts.in_contact(frame, field);
    (0..percepts.fields()).filter(listed).map(move |field| Row { percepts, frame, field, on_skin: None, contact: None })
}

/// The rows of a frame's touches.
fn touch_rows(percepts: &Percepts, frame: usize) -> impl Iterator<Item = Row<'_>> {
    on_skin::rows(percepts, frame).into_iter().flatten()
}

/// The rows of a frame's self-contacts.
fn self_contact_rows(percepts: &Percepts, frame: usize) -> impl Iterator<Item = Row<'_>> {
    let self_contacts = percepts.self_contacts(frame).unwrap_or_default().iter();
    self_contacts.map(move |contact| Row { percepts, frame, field: 0, on_skin: None, contact: Some(contact) })
}
