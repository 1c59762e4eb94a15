//! `Touches`: the touches of a batch.

use std::sync::Arc;

use pyo3::prelude::*;
use pyo3::types::PyCapsule;
use somatic::renamed::new_name;
use somatic::sink::TableKind;
use somatic::{Percepts, TOUCH_COLUMNS, Touch};

use crate::arrays::array;
use crate::error::usage;
use crate::session::Run;
use crate::stream::stream;

/// The touches of some frames, a row each, in the order of frames: of the whole body, over fields and joints.
///
/// Needs output `touches`, which is there unless outputs are named; `touches.wrench` and others add to it.
///
/// >>> import numpy as np
/// >>> import somatic_touch as st
/// >>> engine = st.Engine(st.Body.grid(1, 5, 0.01), {"outputs": ["touches"]}, backend="cpu")
/// >>> touches = engine.process([0.0], np.array([[3, 1, 0, 0, 5]], np.float32)).touches
/// >>> touches.total.tolist(), touches["centre"].shape, touches.link[0]
/// ([5.0, 4.0], (2, 3), 'grid')
#[pyclass(module = "somatic_touch", name = "Touches", frozen)]
pub(crate) struct PyTouches {
    pub(crate) percepts: Arc<Percepts>,
    pub(crate) run: Arc<Run>,
}

impl PyTouches {
    /// Frame and touch of each row.
    fn rows(&self) -> impl Iterator<Item = (usize, &Touch)> {
        let frames = 0..self.percepts.frames();
        frames.flat_map(move |frame| {
            self.percepts
                .touches(frame)
                .into_iter()
                .flat_map(move |found| found.touches.iter().map(move |t| (frame, t)))
        })
    }

    fn column<T: numpy::Element>(
        &self,
        py: Python<'_>,
        width: usize,
        of: impl Fn((usize, &Touch), &mut Vec<T>),
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
        self.column(py, 1, |(frame, _), to| to.push(frame as i64))
    }

    /// The time of its frame, float64 [touches], in seconds.
    #[getter]
    fn t(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        self.column(py, 1, |(frame, _), to| to.push(self.percepts.t_s(frame)))
    }

    /// The link with most of its total, a list of names.
    #[getter]
    fn link(&self) -> Vec<String> {
        let links = &self.run.body.links;
        self.rows().map(|(_, touch)| links[touch.link as usize].name.clone()).collect()
    }

    /// Its identity, uint64 [touches]: lasts from onset to release, and is never used again.
    #[getter]
    fn id(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        self.column(py, 1, |(_, touch), to| to.push(touch.id))
    }

    /// Time since its onset, float64 [touches], in seconds.
    #[getter]
    fn age(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        self.column(py, 1, |(_, touch), to| to.push(touch.age_s))
    }

    /// Its total, float64 [touches], in the unit of pressures.
    #[getter]
    fn total(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        self.column(py, 1, |(_, touch), to| to.push(touch.total))
    }

    /// The number of its pressed taxels, uint32 [touches].
    #[getter]
    fn active(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        self.column(py, 1, |(_, touch), to| to.push(touch.active))
    }

    /// Where it is on the skin, float64 [touches, 3], in metres: in its link, or in the world where frames say where that is.
    #[getter]
    fn position(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        self.column(py, 3, |(_, touch), to| to.extend(touch.position.to_array()))
    }

    /// Why quantities of each are absent or in doubt, uint32 [touches]; the bits are those of `TouchFlags`.
    #[getter]
    fn flags(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        self.column(py, 1, |(_, touch), to| to.push(touch.flags.bits()))
    }

    /// A quantity of each touch by its name, such as `touches["principal_axis"]` or `touches["fit_place"]`, float64 [touches] or
    /// [touches, components]; NaN where it is absent. `fit_kind` is 0 for a point, 1 for a line, 2 for a segment and 3 for a blob.
    fn __getitem__(&self, py: Python<'_>, name: &str) -> PyResult<Py<PyAny>> {
        let outputs = self.run.plan.touch_outputs().unwrap_or_default();
        let Some(column) = outputs.columns().find(|column| column.name == name) else {
            let asked = match TOUCH_COLUMNS.iter().find(|column| column.name == name) {
                Some(column) => format!(
                    "was not asked for; add `touches.{}` to the outputs",
                    column.output.names().collect::<String>()
                ),
                None => match new_name(name, TOUCH_COLUMNS.iter().map(|column| column.name)) {
                    Some(new) => return Err(usage(py, format!("`{name}` is `{new}` now"))),
                    None => format!(
                        "does not exist; there are: {}",
                        outputs.columns().map(|column| column.name).collect::<Vec<_>>().join(", ")
                    ),
                },
            };
            return Err(usage(py, format!("the quantity `{name}` of touches {asked}")));
        };
        self.column(py, column.components, |(_, touch), to| {
            to.extend_from_slice(&column.value(touch).unwrap_or([f64::NAN; 3])[..column.components]);
        })
    }

    /// Arrow's C stream of the table that docs/how-to/tables.md describes.
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
