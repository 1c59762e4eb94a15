//! Percepts as a table: one row per frame and field in contact, a column for each component of an output.
//!
//! [`percept_columns`], [`touch_columns`] and [`self_contact_columns`] list the columns; sinks write by these lists.

#[cfg(feature = "arrow")]
mod arrow_table;
mod csv_sink;
#[cfg(feature = "parquet")]
mod parquet_sink;
mod path_beside;

#[cfg(feature = "arrow")]
pub use arrow_table::{ArrowTable, TableKind};
pub use csv_sink::CsvSink;
#[cfg(feature = "parquet")]
pub use parquet_sink::ParquetSink;
pub(super) use path_beside::path_beside;

use super::{FieldNames, Session};
use crate::percept::{Column, ContactKind, Flags, Outputs, Percepts, SelfContact, Touch, Unit};

/// A column of a table.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct TableColumn {
    /// Its name, such as `centroid_u`.
    pub name: String,
    /// What it is measured in, such as `m`; empty where that has no meaning.
    pub unit: String,
    /// The type of its values.
    pub kind: TableType,
    /// Whether a value may be absent.
    pub is_nullable: bool,
    /// What it is, in a line.
    pub help: String,
    value: ValueOf,
}

/// The type of a column's values.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TableType {
    /// Double precision.
    F64,
    /// Single precision.
    F32,
    /// A whole number up to 2⁶⁴.
    U64,
    /// A whole number up to 2³².
    U32,
    /// True or false.
    Bool,
    /// One of few words: a dictionary.
    Word,
    /// A list of words.
    Words,
}

impl TableType {
    /// Its name.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::F64 => "f64",
            Self::F32 => "f32",
            Self::U64 => "u64",
            Self::U32 => "u32",
            Self::Bool => "bool",
            Self::Word => "dictionary of text",
            Self::Words => "list of text",
        }
    }
}

/// Where a column's values are.
#[derive(Clone, Copy, Debug, PartialEq)]
enum ValueOf {
    Time,
    Frame,
    Field,
    Link,
    Letter,
    Signal,
    Contact,
    Output(&'static Column, usize),
    Flags,
    TouchId,
    TouchTotal,
    TouchActive,
    TouchCentroid(usize),
    TouchPosition(usize),
    TouchFit(&'static Column, usize),
    ContactId,
    ContactPosition(usize),
    ContactDistance,
    ContactAngle,
    SideField(usize),
    SideLink(usize),
    SideTouch(usize),
    SideTotal(usize),
}

impl TableColumn {
    fn new(name: &str, unit: &str, kind: TableType, help: &str, value: ValueOf) -> Self {
        let (name, unit, help) = (name.to_owned(), unit.to_owned(), help.to_owned());
        Self { name, unit, kind, is_nullable: false, help, value }
    }

    /// Its name with its unit, as in the header of a CSV: `total [P]`.
    #[must_use]
    pub fn title(&self) -> String {
        match self.unit.as_str() {
            "" | "1" => self.name.clone(),
            unit => format!("{} [{unit}]", self.name),
        }
    }

    fn or_absent(self) -> Self {
        Self { is_nullable: true, ..self }
    }
}

const U_AND_V: [&str; 2] = ["u", "v"];
const X_Y_AND_Z: [&str; 3] = ["x", "y", "z"];

/// What the components of an output are called.
fn suffixes(components: usize) -> &'static [&'static str] {
    match components {
        1 => &[""],
        2 => &U_AND_V,
        _ => &X_Y_AND_Z,
    }
}

/// Time, frame and field, with which every row of either table begins.
fn keys(names: &[FieldNames]) -> Vec<TableColumn> {
    let mut columns = vec![
        TableColumn::new("t", "s", TableType::F64, "Time of the frame.", ValueOf::Time),
        TableColumn::new("frame", "", TableType::U64, "Number of the frame, from 0.", ValueOf::Frame),
        TableColumn::new("field", "", TableType::Word, "Name of the field.", ValueOf::Field),
        TableColumn::new(
            "link",
            "",
            TableType::Word,
            "The link in whose frame positions and normals are, or `world`.",
            ValueOf::Link,
        ),
    ];
    columns.extend(letter_columns(names));
    columns
}

/// Letter and signal, where a field has percepts of several.
fn letter_columns(names: &[FieldNames]) -> impl Iterator<Item = TableColumn> {
    let letter = names.iter().any(|name| name.letter.is_some()).then(|| {
        let help = "Of what the percept is made: `sustained` or `change`.";
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
    let mut columns = keys(&session.names);
    columns.push(TableColumn::new("contact", "", TableType::Bool, "Whether the field is touched.", ValueOf::Contact));
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
    let of = |column: &'static Column| {
        let (kind, value) = (kind_of(column, session), &value);
        let unit = unit_of(column.unit, session);
        suffixes(column.components).iter().enumerate().map(move |(component, suffix)| {
            let name = if suffix.is_empty() { column.name.to_owned() } else { format!("{}_{suffix}", column.name) };
            TableColumn::new(&name, &unit, kind, column.help, value(column, component)).or_absent()
        })
    };
    outputs.columns().flat_map(of).collect()
}

fn kind_of(column: &Column, session: &Session<'_>) -> TableType {
    match column.unit {
        Unit::Kind => TableType::Word,
        _ if column.output == Outputs::ACTIVE => TableType::U32,
        _ if column.is_double() || session.is_double => TableType::F64,
        _ => TableType::F32,
    }
}

/// The columns of a session's separate touches, one row each.
#[must_use]
pub fn touch_columns(session: &Session<'_>) -> Vec<TableColumn> {
    let p = unit_of(Unit::P, session);
    let mut columns = keys(&session.names);
    let id = "Lasts from onset to release, and is never used again for the field.";
    columns.push(TableColumn::new("id", "", TableType::U64, id, ValueOf::TouchId));
    columns.push(TableColumn::new("total", &p, TableType::F64, "Σ wᵢPᵢ over its taxels.", ValueOf::TouchTotal));
    columns.push(TableColumn::new("active", "1", TableType::U32, "Number of its taxels.", ValueOf::TouchActive));
    for (component, suffix) in U_AND_V.into_iter().enumerate() {
        let (name, help) =
            (format!("centroid_{suffix}"), "Its centroid in the field's chart; absent where it has none.");
        let value = ValueOf::TouchCentroid(component);
        columns.push(TableColumn::new(&name, "m", TableType::F64, help, value).or_absent());
    }
    for (component, suffix) in X_Y_AND_Z.into_iter().enumerate() {
        let name = format!("position_{suffix}");
        columns.push(TableColumn::new(
            &name,
            "m",
            TableType::F64,
            "The same point on the surface.",
            ValueOf::TouchPosition(component),
        ));
    }
    let fit = session.outputs.of_each_touch();
    columns.extend(columns_of(fit, session, ValueOf::TouchFit));
    if !fit.is_empty() {
        let help = "Why its fit, or a part of it, is absent, by name.";
        columns.push(TableColumn::new("flags", "", TableType::Words, help, ValueOf::Flags));
    }
    columns
}

/// The columns of a session's self-contacts, one row each.
#[must_use]
pub fn self_contact_columns(session: &Session<'_>) -> Vec<TableColumn> {
    let p = unit_of(Unit::P, session);
    let mut columns = vec![
        TableColumn::new("t", "s", TableType::F64, "Time of the frame.", ValueOf::Time),
        TableColumn::new("frame", "", TableType::U64, "Number of the frame, from 0.", ValueOf::Frame),
        TableColumn::new("id", "", TableType::U64, "Lasts as long as both touches.", ValueOf::ContactId),
    ];
    columns.extend(letter_columns(&session.names));
    for (side, letter) in ["a", "b"].into_iter().enumerate() {
        let mut column = |name: &str, unit: &str, kind, help: &str, value| {
            columns.push(TableColumn::new(&format!("{name}_{letter}"), unit, kind, help, value));
        };
        column("field", "", TableType::Word, "Name of the field on this side.", ValueOf::SideField(side));
        column("link", "", TableType::Word, "The link that it is on.", ValueOf::SideLink(side));
        column("touch", "", TableType::U64, "The `id` of its touch.", ValueOf::SideTouch(side));
        column("total", &p, TableType::F64, "Σ wᵢPᵢ over the touch's taxels.", ValueOf::SideTotal(side));
    }
    for (component, suffix) in X_Y_AND_Z.into_iter().enumerate() {
        let (name, help) = (format!("position_{suffix}"), "Halfway between the places of both touches, in the world.");
        columns.push(TableColumn::new(&name, "m", TableType::F64, help, ValueOf::ContactPosition(component)));
    }
    let help = "How far these places are apart.";
    columns.push(TableColumn::new("distance", "m", TableType::F64, help, ValueOf::ContactDistance));
    let help = "Between the outward normals there, π where they oppose; absent where a field has no chart.";
    columns.push(TableColumn::new("angle", "rad", TableType::F64, help, ValueOf::ContactAngle).or_absent());
    columns
}

fn unit_of(unit: Unit, session: &Session<'_>) -> String {
    match unit {
        Unit::Force if session.p_unit == "Pa" => "N".to_owned(),
        Unit::P | Unit::Force if !session.p_unit.is_empty() => session.p_unit.to_owned(),
        unit => unit.symbol().to_owned(),
    }
}

/// A row of any of the tables.
#[derive(Clone, Copy)]
struct Row<'a> {
    percepts: &'a Percepts,
    frame: usize,
    field: usize,
    /// In the table of touches.
    touch: Option<&'a Touch>,
    /// In the table of self-contacts.
    contact: Option<&'a SelfContact>,
}

/// A number of a row, in double precision or as a whole number.
impl Row<'_> {
    fn link<'n>(&self, names: &'n [FieldNames]) -> &'n str {
        match self.percepts.in_world(self.frame, self.field) {
            true => &names[self.field].world,
            false => &names[self.field].link,
        }
    }

    fn float(&self, value: ValueOf) -> Option<f64> {
        match value {
            ValueOf::Time => Some(self.percepts.t_s(self.frame)),
            ValueOf::Output(column, component) => {
                self.percepts.value(self.frame, self.field, column).map(|components| components[component])
            }
            ValueOf::TouchTotal => self.touch.map(|touch| touch.total),
            ValueOf::TouchCentroid(component) => self.touch?.centroid.map(|centroid| centroid[component]),
            ValueOf::TouchPosition(component) => self.touch?.position.map(|position| position[component]),
            ValueOf::TouchFit(column, component) => Some(self.touch?.value(column)?[component]),
            ValueOf::ContactPosition(component) => self.contact.map(|contact| contact.position[component]),
            ValueOf::ContactDistance => self.contact.map(|contact| contact.distance),
            ValueOf::ContactAngle => self.contact?.angle,
            ValueOf::SideTotal(side) => self.contact.map(|contact| contact.sides[side].total),
            _ => None,
        }
    }

    fn whole(&self, value: ValueOf) -> Option<u64> {
        match value {
            ValueOf::Frame => Some(self.percepts.frame_number(self.frame)),
            ValueOf::TouchId => self.touch.map(|touch| touch.id),
            ValueOf::ContactId => self.contact.map(|contact| contact.id),
            ValueOf::SideTouch(side) => self.contact.map(|contact| contact.sides[side].touch),
            ValueOf::TouchActive => self.touch.map(|touch| touch.active.into()),
            ValueOf::Output(..) => self.float(value).map(|number| number as u64),
            _ => None,
        }
    }

    /// The word in a column of words; none where it is absent.
    fn word<'n>(&self, value: ValueOf, names: &'n [FieldNames]) -> Option<&'n str> {
        let name = &names[self.field];
        match value {
            ValueOf::Field => Some(&name.field),
            ValueOf::Link => Some(self.link(names)),
            ValueOf::Letter => name.letter.as_deref(),
            ValueOf::Signal => name.signal.as_deref(),
            ValueOf::SideField(side) => Some(&names[self.contact?.sides[side].field].field),
            ValueOf::SideLink(side) => Some(&names[self.contact?.sides[side].field].link),
            _ => self.float(value).and_then(|kind| ContactKind::ALL.get(kind as usize)).map(|kind| kind.name()),
        }
    }

    /// Those of the touch in a table of touches.
    fn flags(&self) -> Flags {
        self.touch.map_or_else(|| self.percepts.flags(self.frame, self.field), |touch| touch.flags)
    }

    fn is_touched(&self) -> bool {
        self.percepts.in_contact(self.frame, self.field)
    }
}

/// The rows of a frame: its fields in contact, or all.
fn rows(percepts: &Percepts, frame: usize, all_fields: bool) -> impl Iterator<Item = Row<'_>> {
    let listed = move |&field: &usize| all_fields || percepts.in_contact(frame, field);
    (0..percepts.fields()).filter(listed).map(move |field| Row { percepts, frame, field, touch: None, contact: None })
}

/// The rows of a frame's separate touches.
fn touch_rows(percepts: &Percepts, frame: usize) -> impl Iterator<Item = Row<'_>> {
    rows(percepts, frame, false).flat_map(move |row| {
        percepts.touches(frame, row.field).iter().map(move |touch| Row { touch: Some(touch), ..row })
    })
}

/// The rows of a frame's self-contacts.
fn self_contact_rows(percepts: &Percepts, frame: usize) -> impl Iterator<Item = Row<'_>> {
    let self_contacts = percepts.self_contacts(frame).unwrap_or_default().iter();
    self_contacts.map(move |contact| Row {
        percepts,
        frame,
        field: contact.sides[0].field,
        touch: None,
        contact: Some(contact),
    })
}
