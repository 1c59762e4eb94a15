//! The form of lines of text in a scene, instead of finding it out.

#[cfg(feature = "cli")]
use schemars::JsonSchema;
use serde::Deserialize;

use crate::error::Result;
use crate::source::TextOptions;

/// The form of the lines of sources text:. What is left out is found out from the first second of them.
#[derive(Clone, Debug, Default, Deserialize, PartialEq)]
#[serde(default, deny_unknown_fields)]
#[cfg_attr(feature = "cli", derive(JsonSchema))]
#[non_exhaustive]
pub struct TextKeys {
    /// The columns that are sensors, such as 2-17, 1,3,8-10 or 'A*' [default: all but times, counts and words].
    ///
    /// They are given by number from 1, or by name.
    pub columns: Option<String>,
    /// The taxels of these columns, such as 4-19, or names [default: as names say, else the body's in ascending
    /// order].
    ///
    /// With names, columns are called by the ids of their taxels.
    pub ids: Option<String>,
    /// The line between two frames of several lines [default: as found out].
    ///
    /// Write blank, or what such a line begins with.
    pub frame_end: Option<String>,
    /// The column of the time and its unit, such as 1:ms [default: as found out].
    ///
    /// The column is given by number or name, the unit is s, ms, us or iso. With arrival, frames have the time when
    /// they come.
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
