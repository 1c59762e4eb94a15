//! `SelfContacts`: where the robot touches itself, in a batch.

use std::sync::Arc;

use pyo3::prelude::*;
use pyo3::types::PyCapsule;
use somatic::sink::TableKind;
use somatic::{Percepts, SelfContact};

use crate::arrays::array;
use crate::session::Run;
use crate::stream::stream;

/// The self-contacts of some frames, a row each, in the order of frames: touches of two links at one place in the
/// world. Frames without poses have none.
///
/// Needs output `self_contacts`.
///
/// >>> import numpy as np
/// >>> import somatic_touch as st
/// >>> engine = st.Engine(st.Body.grid(1, 5, 0.01), {"outputs": ["self_contacts"]}, backend="cpu")
/// >>> contacts = engine.process([0.0], np.array([[3, 1, 0, 0, 5]], np.float32)).self_contacts
/// >>> len(contacts), contacts.touch.shape
/// (0, (0, 2))
#[pyclass(module = "somatic_touch", name = "SelfContacts", frozen)]
pub(crate) struct PySelfContacts {
    pub(crate) percepts: Arc<Percepts>,
    pub(crate) run: Arc<Run>,
}

impl PySelfContacts {
    /// Frame and contact of each row.
    fn rows(&self) -> impl Iterator<Item = (usize, &SelfContact)> {
        let of = |frame| self.percepts.self_contacts(frame).unwrap_or_default().iter();
        (0..self.percepts.frames()).flat_map(move |frame| of(frame).map(move |contact| (frame, contact)))
    }

    fn column<T: numpy::Element>(
        &self,
        py: Python<'_>,
        width: usize,
        of: impl Fn((usize, &SelfContact), &mut Vec<T>),
    ) -> PyResult<Py<PyAny>> {
        let mut values = Vec::new();
        self.rows().for_each(|row| of(row, &mut values));
        let shape = [values.len() / width, width];
        array(py, values, if width == 1 { &shape[..1] } else { &shape })
    }
}

#[pymethods]
impl PySelfContacts {
    /// The frame of each, int64 [self-contacts]: an index into the batch.
    #[getter]
    fn frame(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        self.column(py, 1, |(frame, _), to| to.push(frame as i64))
    }

    /// The time of its frame, float64 [self-contacts], in seconds.
    #[getter]
    fn t(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        self.column(py, 1, |(frame, _), to| to.push(self.percepts.t_s(frame)))
    }

    /// Its identity, uint64 [self-contacts]: lasts as long as both touches.
    #[getter]
    fn id(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        self.column(py, 1, |(_, contact), to| to.push(contact.id))
    }

    /// The link on either side, int64 [contacts, 2]: an index into the body's links.
    #[getter]
    fn link(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        self.column(py, 2, |(_, contact), to| to.extend(contact.sides.map(|side| i64::from(side.link))))
    }

    /// The touch on either side, uint64 [self-contacts, 2]: its `id` among `Percepts.touches`.
    #[getter]
    fn touch(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        self.column(py, 2, |(_, contact), to| to.extend(contact.sides.map(|side| side.touch)))
    }

    /// The total of either touch, float64 [self-contacts, 2], in the unit of pressures.
    #[getter]
    fn total(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        self.column(py, 2, |(_, contact), to| to.extend(contact.sides.map(|side| side.total)))
    }

    /// Halfway between the places of both touches, float64 [self-contacts, 3], in metres, in the world.
    #[getter]
    fn position(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        self.column(py, 3, |(_, contact), to| to.extend(contact.position))
    }

    /// How far these places are apart, float64 [self-contacts], in metres.
    #[getter]
    fn distance(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        self.column(py, 1, |(_, contact), to| to.push(contact.distance))
    }

    /// The angle between the normals there, float64 [self-contacts], in radians.
    #[getter]
    fn angle(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        self.column(py, 1, |(_, contact), to| to.push(contact.angle))
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
        stream(py, &self.percepts, &self.run, TableKind::SelfContacts)
    }

    fn __len__(&self) -> usize {
        self.rows().count()
    }

    fn __repr__(&self) -> String {
        format!("<SelfContacts: {} rows>", self.__len__())
    }
}
