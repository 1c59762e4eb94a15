//! Globs over the names of fields, as scenes have them.

use globset::GlobBuilder;
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use somatic::internal::error::suggestion;

use crate::error::{unknown_name, usage};

/// One or several.
#[derive(FromPyObject)]
pub(crate) enum Globs {
    One(String),
    Several(Vec<String>),
}

impl Globs {
    /// Which of `fields`, each with all of its names, they match, in order.
    pub(crate) fn chosen(self, py: Python<'_>, fields: &[[&str; 2]]) -> PyResult<Vec<usize>> {
        let globs = match self {
            Self::One(glob) => vec![glob],
            Self::Several(globs) => globs,
        };
        let mut chosen = vec![false; fields.len()];
        for glob in &globs {
            let made = GlobBuilder::new(glob).literal_separator(true).build();
            let made = made
                .map_err(|e| usage(py, format!("`{glob}` is not a glob over field names: {}", e.kind())))?
                .compile_matcher();
            let mut is_of_any = false;
            for (field, is_chosen) in fields.iter().zip(&mut chosen) {
                // A name is taken as it is, too: in it `[` and `*` are not signs.
                if field.iter().any(|name| name == glob || made.is_match(name)) {
                    (is_of_any, *is_chosen) = (true, true);
                }
            }
            if !is_of_any {
                let near = suggestion(glob, fields.iter().map(|names| names[0]));
                return Err(unknown_name(py, format!("no field matches `{glob}`; {near}")));
            }
        }
        Ok((0..fields.len()).filter(|&field| chosen[field]).collect())
    }
}

/// The name of a column between brackets: `p[0]` says what to write instead.
pub(crate) fn by_name(name: &Bound<'_, PyAny>) -> PyResult<String> {
    name.extract().map_err(|_| {
        PyTypeError::new_err(
            "columns are read by name, such as [\"total\"]; frames are cut by `between` and `by_frame`, and a loop has rows",
        )
    })
}
