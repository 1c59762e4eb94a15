//! Globs over names: `palm*`, `finger_?`.

use globset::{GlobBuilder, GlobSet, GlobSetBuilder};

use crate::error::{Error, Result};

/// A list of globs, of which a name must match one.
#[derive(Clone, Debug)]
pub(super) struct Globs {
    globs: Vec<String>,
    set: GlobSet,
}

impl Globs {
    pub(super) fn new(globs: &[String]) -> Result<Self> {
        let wrong =
            |glob: &str, e: &globset::Error| Error::failed(format!("`{glob}` is no glob over names: {}", e.kind()));
        let mut set = GlobSetBuilder::new();
        for glob in globs {
            set.add(GlobBuilder::new(glob).build().map_err(|e| wrong(glob, &e))?);
        }
        let set = set.build().map_err(|e| wrong(&globs.join(", "), &e))?;
        Ok(Self { globs: globs.to_vec(), set })
    }

    /// Whether `name` matches; it always matches itself, even with brackets in it.
    pub(super) fn is_match(&self, name: &str) -> bool {
        self.set.is_match(name) || self.globs.iter().any(|globs| globs == name)
    }

    /// The globs as text.
    pub(super) fn text(&self) -> String {
        self.globs.join(", ")
    }

    /// The first glob, for suggestions.
    pub(super) fn first(&self) -> &str {
        self.globs.first().map_or("", String::as_str)
    }
}
