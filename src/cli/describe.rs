//! `run --describe`: the columns of the tables that sinks write.

use comfy_table::Cell;
use somatic::internal::sink::{TableColumn, percept_columns, self_contact_columns, touch_columns};
use somatic::sink::{Session, SinkSpec};
use somatic::{Error, Outputs, Result};

use super::table::{plain, shown};

/// The columns of `sinks`, or of a table if there are none.
pub(super) fn describe(sinks: &[SinkSpec], session: &Session<'_>, wide: bool) -> Result<String> {
    if let Some(other) = sinks.iter().find(|sink| !sink.is_table()) {
        let what = match other {
            SinkSpec::Mcap(_) => {
                "--describe is for csv: and parquet:; a recording has its schemas in itself: somatic info FILE"
            }
            SinkSpec::Page(_) => "--describe is for csv: and parquet:; a page has no columns",
            _ => "--describe is for csv: and parquet:; NDJSON has the same names as keys",
        };
        return Err(Error::usage(what));
    }
    let mut text = match wide {
        true if !session.recordings.is_empty() => {
            "one row per frame: recording, t and frame, then, for each field and called by it, the columns from contact on that its letter has\n"
        }
        true => "one row per frame: t and frame, then, for each field and called by it, the columns from contact on that its letter has\n",
        false if session.all_fields => "one row per frame and field\n",
        false => "one row per frame and field in contact\n",
    }
    .to_owned();
    text += &table(&percept_columns(session));
    if session.skin().is_some() {
        text += "\nin a second file, one row per frame and touch of the whole body\n";
        text += &table(&touch_columns(session));
    }
    if session.outputs.contains(Outputs::SELF_CONTACTS) {
        text += "\nin a third file, one row per frame and self-contact\n";
        text += &table(&self_contact_columns(session));
    }
    Ok(text)
}

fn table(columns: &[TableColumn]) -> String {
    let mut table = plain(["column", "unit", "type", "what"], []);
    for column in columns {
        let absent = if column.is_nullable { " or absent" } else { "" };
        table.add_row([
            Cell::new(&column.name),
            Cell::new(&column.unit),
            Cell::new(format!("{}{absent}", column.kind.name())),
            Cell::new(&column.help),
        ]);
    }
    shown(&table)
}
