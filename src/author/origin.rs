//! Places of keys, for errors that are found after a recipe was read.

use crate::error::Error;

/// The place of a key in messages: `recipe.toml: line 12, column 1`, or a flag.
#[derive(Clone, Debug, Default)]
pub(super) struct Origin(pub(super) String);

impl Origin {
    pub(super) fn wrong(&self, what: impl Into<String>) -> Error {
        self.put(Error::failed(what))
    }

    pub(super) fn put(&self, error: Error) -> Error {
        if self.0.is_empty() { error } else { error.at(&self.0) }
    }
}
