//! Fields by their names.

use globset::{GlobBuilder, GlobSetBuilder};

use crate::error::{Error, Result, nearest};
use crate::field::FieldSet;

/// Indices of the fields that `globs` name, in order; of all where there are no globs.
///
/// # Errors
/// A glob is malformed or matches nothing.
pub fn choose_fields(fields: &FieldSet, globs: &[String]) -> Result<Vec<usize>> {
    let mut set = GlobSetBuilder::new();
    for glob in globs {
        let glob = GlobBuilder::new(glob)
            .literal_separator(true)
            .build()
            .map_err(|e| Error::usage(format!("`{glob}` is not a glob over field names: {}", e.kind())))?;
        set.add(glob);
    }
    let set = set.build().map_err(|e| Error::usage(e.to_string()))?;
    let mut matched = vec![false; globs.len()];
    let mut chosen = Vec::new();
    for (index, field) in fields.fields.iter().enumerate() {
        let matches = set.matches(&field.name);
        matches.iter().for_each(|&glob| matched[glob] = true);
        if globs.is_empty() || !matches.is_empty() {
            chosen.push(index);
        }
    }
    if let Some(glob) = matched.iter().position(|matched| !matched).map(|index| &globs[index]) {
        let near = nearest(glob, fields.fields.iter().map(|field| field.name.as_str()));
        let hint =
            near.map_or("`somatic inspect` lists the fields".to_owned(), |near| format!("did you mean `{near}`?"));
        return Err(Error::usage(format!("no field matches `{glob}`: {hint}")));
    }
    Ok(chosen)
}
