//! Places of keys, for errors that are found after a recipe was read.

use std::sync::Arc;

use crate::error::{Error, place_in};

/// The place of a key in messages: `recipe.toml: line 12, column 1`, or a flag.
#[derive(Clone, Debug, Default)]
pub(super) struct Origin {
    /// A recipe's name, or the flag; empty for none.
    name: Arc<str>,
    /// The recipe's text, and the byte there. Lines are counted when they are asked for: it takes time.
    at: Option<(Arc<str>, usize)>,
}

impl Origin {
    /// Of the argument `flag`.
    pub(super) fn flag(flag: &str) -> Self {
        Self { name: flag.into(), at: None }
    }

    /// Of byte `at` of the recipe `text` called `name`.
    pub(super) fn in_text(name: &Arc<str>, text: &Arc<str>, at: usize) -> Self {
        Self { name: name.clone(), at: Some((text.clone(), at)) }
    }

    pub(super) fn wrong(&self, what: impl Into<String>) -> Error {
        self.put(Error::failed(what))
    }

    pub(super) fn put(&self, error: Error) -> Error {
        let error = match &self.at {
            Some((text, at)) => error.at(place_in(text, *at)),
            None => error,
        };
        if self.name.is_empty() { error } else { error.at(&self.name) }
    }
}
