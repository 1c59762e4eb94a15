//! What is said of lines of text instead of being found out.

use clap::Args;
use somatic::Result;
use somatic::scene::file::TextKeys;
use somatic::source::TextOptions;

/// How lines of text are written, of sources text:; what is not said is found out from the first second of them.
#[derive(Args, Clone, Debug, Default)]
pub(super) struct TextFlags {
    /// Of text:, the columns that are sensors, by number from 1 or by name, such as 2-17, 1,3,8-10 or 'A*' [default: all but times,
    /// counts and words].
    #[arg(long, help_heading = "Live", value_name = "COLUMNS")]
    pub(super) columns: Option<String>,

    /// Of text:, the taxels of these columns, such as 4-19, or names, where columns are called by the ids of their taxels [default:
    /// as names say, else the body's in ascending order].
    #[arg(long, help_heading = "Live", value_name = "IDS")]
    pub(super) ids: Option<String>,

    /// Of text:, what stands between two frames of several lines: blank, or what such a line begins with [default: as found out].
    #[arg(long, help_heading = "Live", value_name = "TEXT")]
    pub(super) frame_end: Option<String>,

    /// Of text:, the column of the time, by number or name, and its unit, s, ms, us or iso, such as 1:ms; arrival stamps frames when
    /// they come [default: as found out].
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

    pub(super) fn options(&self) -> Result<TextOptions> {
        self.keys().options()
    }
}
