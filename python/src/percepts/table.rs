//! The table of some percepts, which others take through Arrow's stream.

use std::sync::Arc;

use pyo3::prelude::*;
use pyo3::types::PyCapsule;
use somatic::sink::TableKind;

use super::PyPercepts;
use crate::session::Run;
use crate::stream::{Part, stream};

impl PyPercepts {
    pub(super) fn table<'py>(&self, py: Python<'py>, all_fields: bool) -> PyResult<Bound<'py, PyAny>> {
        Ok(Bound::new(py, Table { part: self.of_table(), run: Arc::clone(&self.run), all_fields })?.into_any())
    }
}

/// A table that others take through its stream.
#[pyclass(frozen)]
struct Table {
    part: Part,
    run: Arc<Run>,
    all_fields: bool,
}

#[pymethods]
impl Table {
    #[pyo3(signature = (requested_schema = None))]
    fn __arrow_c_stream__<'py>(
        &self,
        py: Python<'py>,
        requested_schema: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyCapsule>> {
        let _ = requested_schema;
        let kind = if self.all_fields { TableKind::AllFields } else { TableKind::Touched };
        stream(py, &self.part, &self.run, kind)
    }
}
