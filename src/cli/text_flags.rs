//! The form of lines of text, instead of finding it out.

use clap::Args;
use somatic::scene::file::TextKeys;

/// The form of the lines of sources text:. What is left out is found out from the first second of them.
#[derive(Args, Clone, Debug, Default)]
pub(super) struct TextFlags {
    /// For text: and CSV, the columns that are sensors, such as 2-17, 1,3,8-10 or 'A*' [default: all but times, counts and
    /// words].
    ///
    /// They are given by number from 1, or by name.
    #[arg(long, help_heading = "Live", value_name = "COLUMNS")]
    pub(super) columns: Option<String>,

    /// For text: and CSV, the taxels of these columns, such as 4-19, or names [default: as names say, else the body's in
    /// ascending order].
    ///
    /// With names, columns are called by the ids of their taxels.
    #[arg(long, help_heading = "Live", value_name = "IDS")]
    pub(super) ids: Option<String>,

    /// For text:, the line between two frames of several lines [default: as found out].
    ///
    /// Write blank, or what such a line begins with.
    #[arg(long, help_heading = "Live", value_name = "TEXT")]
    pub(super) frame_end: Option<String>,

    /// For text: and CSV, the column of the time and its unit, such as 1:ms [default: as found out].
    ///
    /// The column is given by number or name, the unit is s, ms, us or iso. With arrival, frames have the time when
    /// they come.
    #[arg(long, help_heading = "Live", value_name = "COLUMN[:UNIT]")]
    pub(super) time: Option<String>,
}

impl TextFlags {
    /// What a scene would say of it.
    pub(super) fn keys(&self) -> TextKeys {
        let Self { columns, ids, frame_end, time } = self.clone();
        let mut keys = TextKeys::default();
        (keys.columns, keys.ids, keys.frame_end, keys.time) = (columns, ids, frame_end, time);
        keys
    }
}
