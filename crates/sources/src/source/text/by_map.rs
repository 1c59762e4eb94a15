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
    let [values] = &map.values[..] else {
        return bad("of lines that come live one path is read; name one in values, or send them to --source -");
    };
    if map.decoder.is_some() || map.message.is_some() {
        return bad("message and decoder are for bags and NDJSON; send the lines to --source -");
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
        columns: Some(TextColumns(vec![Column::Path(values.clone())])),
        ids: map.ids.clone().map(TextIds::Listed),
        frame_end: None,
        time,
    })
}
