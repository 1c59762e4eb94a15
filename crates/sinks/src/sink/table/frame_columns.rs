//! The columns that say which frame a row is of.

use super::row::{TableColumn, TableType, ValueOf};
use crate::sink::Session;

/// The recording, if there are several, time and frame, with which every row of any table begins.
pub(super) fn frame_columns(session: &Session<'_>) -> Vec<TableColumn> {
    let help = "The recording that the frame is of.";
    let recording = TableColumn::new("recording", "", TableType::Word, help, ValueOf::Recording);
    let mut columns = if session.recordings.is_empty() { Vec::new() } else { vec![recording] };
    columns.push(TableColumn::new("t", "s", TableType::F64, "Time of the frame.", ValueOf::Time));
    columns.push(TableColumn::new("frame", "", TableType::U64, "Number of the frame, from 0.", ValueOf::Frame));
    columns
}
