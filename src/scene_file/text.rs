//! What a scene says of lines of text instead of its being found out.

#[cfg(feature = "cli")]
use schemars::JsonSchema;
use serde::Deserialize;

use crate::error::Result;
use crate::source::TextOptions;

/// How lines of text are written, of sources text:; what is not said is found out from the first second of them.
#[derive(Clone, Debug, Default, Deserialize, PartialEq)]
#[serde(default, deny_unknown_fields)]
#[cfg_attr(feature = "cli", derive(JsonSchema))]
#[non_exhaustive]
pub struct TextKeys {
    /// The columns that are sensors, by number from 1 or by name, such as 2-17, 1,3,8-10 or 'A*' [default: all but times, counts and
    /// words].
    pub columns: Option<String>,
    /// The taxels of these columns, such as 4-19, or names, where columns are called by the ids of their taxels [default: as names say,
    /// else the body's in ascending order].
    pub ids: Option<String>,
    /// What stands between two frames of several lines: blank, or what such a line begins with [default: as found out].
    pub frame_end: Option<String>,
    /// The column of the time, by number or name, and its unit, s, ms, us or iso, such as 1:ms; arrival stamps frames when they come
    /// [default: as found out].
    pub time: Option<String>,
}

impl TextKeys {
    /// These keys, and those of `other` where there are none.
    #[must_use]
    pub fn over(self, other: Self) -> Self {
        Self {
            columns: self.columns.or(other.columns),
            ids: self.ids.or(other.ids),
            frame_end: self.frame_end.or(other.frame_end),
            time: self.time.or(other.time),
        }
    }

    /// How a reader of text takes them.
    ///
    /// # Errors
    /// A usage error: a key is not written as it should be.
    pub fn options(&self) -> Result<TextOptions> {
        Ok(TextOptions {
            columns: self.columns.as_deref().map(str::parse).transpose()?,
            ids: self.ids.as_deref().map(str::parse).transpose()?,
            frame_end: self.frame_end.as_deref().map(str::parse).transpose()?,
            time: self.time.as_deref().map(str::parse).transpose()?,
        })
    }
}
