//! Which fields a part of some percepts has.

use std::collections::BTreeSet;

use pyo3::prelude::*;
use somatic::internal::error::suggestion;

use super::PyPercepts;
use crate::array_body::Names;
use crate::error::unknown_name;
use crate::globs::Globs;

impl PyPercepts {
    /// Those of its fields that match `fields` and are of one of `letters`, numbered as in the whole batch.
    pub(super) fn chosen(&self, py: Python<'_>, fields: Option<Globs>, letters: Option<Names>) -> PyResult<Vec<usize>> {
        let mut indices = self.indices();
        if let Some(fields) = fields {
            let names = |&field: &usize| [self.run.labels[field].as_str(), self.run.names[field].field.as_str()];
            let chosen = fields.chosen(py, &indices.iter().map(names).collect::<Vec<_>>())?;
            indices = chosen.into_iter().map(|at| indices[at]).collect();
        }
        if let Some(letters) = letters {
            let wanted = match letters {
                Names::One(letter) => vec![letter],
                Names::Each(letters) => letters,
            };
            let is_of = |&field: &usize, letter: &String| self.run.letters[field] == *letter;
            if let Some(letter) = wanted.iter().find(|letter| !indices.iter().any(|field| is_of(field, letter))) {
                let there = indices.iter().map(|&field| self.run.letters[field].as_str());
                let near = suggestion(letter, there.collect::<BTreeSet<_>>());
                return Err(unknown_name(py, format!("no field is of letter `{letter}`; {near}")));
            }
            indices.retain(|field| wanted.iter().any(|letter| is_of(field, letter)));
        }
        Ok(indices)
    }
}
