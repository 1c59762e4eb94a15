//! Names as people ask for them: `palm*`, `finger_?`.

use globset::{GlobBuilder, GlobSet, GlobSetBuilder};

use crate::error::{Error, Result};

/// Globs of which a name has to match one.
#[derive(Clone, Debug)]
pub(super) struct Globs {
    asked: Vec<String>,
    set: GlobSet,
}

impl Globs {
    pub(super) fn new(asked: &[String]) -> Result<Self> {
        let wrong =
            |glob: &str, e: &globset::Error| Error::failed(format!("`{glob}` is no glob over names: {}", e.kind()));
        let mut set = GlobSetBuilder::new();
        for glob in asked {
            set.add(GlobBuilder::new(glob).build().map_err(|e| wrong(glob, &e))?);
        }
        let set = set.build().map_err(|e| wrong(&asked.join(", "), &e))?;
        Ok(Self { asked: asked.to_vec(), set })
    }

    /// Whether `name` is meant; a name that is asked for as it is always is, even with brackets in it.
    pub(super) fn is_match(&self, name: &str) -> bool {
        self.set.is_match(name) || self.asked.iter().any(|asked| asked == name)
    }

    /// As they were asked for.
    pub(super) fn text(&self) -> String {
        self.asked.join(", ")
    }

    /// The first, to find what else may have been meant.
    pub(super) fn first(&self) -> &str {
        self.asked.first().map_or("", String::as_str)
    }
}
