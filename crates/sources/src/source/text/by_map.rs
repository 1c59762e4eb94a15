//! The form of lines of JSON by a map.

use super::super::map::{ArrayMap, ArrayPath, MapTime};
use super::super::time_column::TimeUnit;
use super::options::{Column, TextColumns, TextIds, TextOptions, TextTime, TimeColumnName};
use crate::error::{Error, Result};

/// What `map` says of lines that come live.
///
/// # Errors
/// It says what such lines do not have.
pub(super) fn options_of(map: &ArrayMap) -> Result<TextOptions> {
    let bad = |what: &str| Err(Error::usage(format!("{}: {what}", map.name)));
    if map.message.is_some() {
        return bad("message is for bags and NDJSON; send the lines to --source -");
    }
    let column = |path: &ArrayPath, unit| {
        TextTime::Column(TimeColumnName { column: Column::Path(path.clone()), unit: Some(unit) })
    };
    let time = match &map.time {
        MapTime::Usual => None,
        MapTime::Arrival => Some(TextTime::Arrival),
        MapTime::At(path, per_second) => Some(column(
            path,
            match per_second {
                1e3 => TimeUnit::Milliseconds,
                1e6 => TimeUnit::Microseconds,
                1e9 => TimeUnit::Nanoseconds,
                _ => TimeUnit::Seconds,
            },
        )),
    };
    Ok(TextOptions {
        columns: Some(TextColumns(map.values.iter().cloned().map(Column::Path).collect())),
        // With three axes a taxel has three columns.
        ids: map.ids.clone().filter(|_| map.axes.is_none()).map(TextIds::Listed),
        frame_end: None,
        time,
    })
}
