//! `Touches`: the separate touches of a batch.

use std::sync::Arc;

use pyo3::prelude::*;
use pyo3::types::PyCapsule;
use somatic::renamed::new_name;
use somatic::sink::TableKind;
use somatic::{Outputs, Percepts, Touch};

use crate::arrays::array;
use crate::error::usage;
use crate::session::Run;
use crate::stream::stream;

/// The separate touches of some frames, a row each, in the order of frames and fields.
///
/// Needs output `touches`.
///
/// >>> import numpy as np
/// >>> import somatic_touch as st
/// >>> engine = st.Engine(st.Body.grid(1, 5, 0.01), {"outputs": ["touches"]}, backend="cpu")
/// >>> touches = engine.process([0.0], np.array([[3, 1, 0, 0, 5]], np.float32)).touches
/// >>> touches.total.tolist(), touches.centroid.shape
/// ([4.0, 5.0], (2, 2))
#[pyclass(module = "somatic_touch", name = "Touches", frozen)]
pub(crate) struct PyTouches {
    pub(crate) percepts: Arc<Percepts>,
    pub(crate) run: Arc<Run>,
}

impl PyTouches {
    /// Frame, field and touch of each row.
    fn rows(&self) -> impl Iterator<Item = (usize, usize, &Touch)> {
        let percepts = &self.percepts;
        let cells = (0..percepts.frames()).flat_map(|frame| (0..percepts.fields()).map(move |field| (frame, field)));
        cells.flat_map(|(frame, field)| percepts.touches(frame, field).iter().map(move |touch| (frame, field, touch)))
    }

    fn column<T: numpy::Element>(
        &self,
        py: Python<'_>,
        width: usize,
        of: impl Fn((usize, usize, &Touch), &mut Vec<T>),
    ) -> PyResult<Py<PyAny>> {
        let mut values = Vec::new();
        self.rows().for_each(|row| of(row, &mut values));
        let rows = values.len() / width;
        let shape = [rows, width];
        array(py, values, if width == 1 { &shape[..1] } else { &shape })
    }
}

#[pymethods]
impl PyTouches {
    /// The frame of each, int64 [touches]: an index into the batch.
    #[getter]
    fn frame(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        self.column(py, 1, |(frame, _, _), to| to.push(frame as i64))
    }

    /// The time of its frame, float64 [touches], in seconds.
    #[getter]
    fn t(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        self.column(py, 1, |(frame, _, _), to| to.push(self.percepts.t_s(frame)))
    }

    /// The field of each, int64 [touches]: an index into `Percepts.fields`.
    #[getter]
    fn field(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        self.column(py, 1, |(_, field, _), to| to.push(field as i64))
    }

    /// Its identity, uint64 [touches]: lasts from onset to release, and is never used again for the field.
    #[getter]
    fn id(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        self.column(py, 1, |(_, _, touch), to| to.push(touch.id))
    }

    /// Its total, float64 [touches], in the unit of pressures.
    #[getter]
    fn total(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        self.column(py, 1, |(_, _, touch), to| to.push(touch.total))
    }

    /// The number of its pressed taxels, uint32 [touches].
    #[getter]
    fn active(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        self.column(py, 1, |(_, _, touch), to| to.push(touch.active))
    }

    /// Its centroid in the field's chart, float64 [touches, 2], in metres; NaN where the field has no chart.
    #[getter]
    fn centroid(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        self.column(py, 2, |(_, _, touch), to| to.extend(touch.centroid.unwrap_or([f64::NAN; 2])))
    }

    /// The same point on the surface, float64 [touches, 3], in metres; NaN where the frame does not say where the touch's link is.
    #[getter]
    fn position(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        self.column(py, 3, |(_, _, touch), to| to.extend(touch.position.unwrap_or([f64::NAN; 3])))
    }

    /// Why the fit of each, or a part of it, is absent, uint32 [touches]; the bits are those of `Flags`.
    #[getter]
    fn flags(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        self.column(py, 1, |(_, _, touch), to| to.push(touch.flags.bits()))
    }

    /// An output of each touch's own fit, such as `touches["fit_place"]`, float64 [touches] or [touches, components];
    /// NaN where it is absent. `fit_kind` is 0 for a point, 1 for a line, 2 for a segment and 3 for a blob.
    fn __getitem__(&self, py: Python<'_>, name: &str) -> PyResult<Py<PyAny>> {
        let asked = self.percepts.outputs().of_each_touch();
        let Some(column) = asked.columns().find(|column| column.name == name) else {
            let of_fits = Outputs::all().of_each_touch();
            if let Some(new) = new_name(name, of_fits.columns().map(|column| column.name)) {
                return Err(usage(py, format!("`{name}` is `{new}` now")));
            }
            let names: Vec<&str> = asked.columns().map(|column| column.name).collect();
            let has = if names.is_empty() { "none".to_owned() } else { names.join(", ") };
            return Err(usage(py, format!("no output of the fit `{name}` was asked for; there are: {has}")));
        };
        self.column(py, column.components, |(_, _, touch), to| {
            to.extend_from_slice(&touch.value(column).unwrap_or([f64::NAN; 3])[..column.components]);
        })
    }

    /// Arrow's C stream of the table that docs/tables.md describes.
    #[pyo3(signature = (requested_schema = None))]
    fn __arrow_c_stream__<'py>(
        &self,
        py: Python<'py>,
        requested_schema: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyCapsule>> {
        // The interface lets a producer keep to its own schema.
        let _ = requested_schema;
        stream(py, &self.percepts, &self.run, TableKind::Touches)
    }

    fn __len__(&self) -> usize {
        self.rows().count()
    }

    fn __repr__(&self) -> String {
        format!("<Touches: {} rows>", self.__len__())
    }
}
