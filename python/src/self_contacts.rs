//! `SelfContacts`: where the robot touches itself, in a batch.

use std::ops::Range;
use std::sync::Arc;

use pyo3::prelude::*;
use pyo3::types::{PyCapsule, PyDict};
use somatic::internal::error::suggestion;
use somatic::sink::TableKind;
use somatic::{Percepts, SelfContact};

use crate::arrays::array;
use crate::error::{stays_here, unknown_name};
use crate::globs::by_name;
use crate::session::Run;
use crate::stream::{Part, in_python, stream, to_arrow, to_pandas, to_polars};

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
    /// The frames that it is of.
    pub(crate) frames: Range<usize>,
}

/// The names of its columns.
const COLUMNS: [&str; 9] = ["frame", "t", "id", "link", "touch", "total", "position", "distance", "angle"];

impl PySelfContacts {
    /// Frame and contact of each row.
    fn rows(&self) -> impl Iterator<Item = (usize, &SelfContact)> {
        let contacts = |frame| self.percepts.self_contacts(frame).unwrap_or_default().iter();
        let first = self.frames.start;
        self.frames.clone().flat_map(move |frame| contacts(frame).map(move |contact| (frame - first, contact)))
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

    /// The column called `name`.
    fn named(&self, py: Python<'_>, name: &str) -> PyResult<Py<PyAny>> {
        match name {
            "frame" => self.frame(py),
            "t" => self.t(py),
            "id" => self.id(py),
            "link" => self.link(py),
            "touch" => self.touch(py),
            "total" => self.total(py),
            "position" => self.position(py),
            "distance" => self.distance(py),
            "angle" => self.angle(py),
            _ => {
                let near = suggestion(name, COLUMNS);
                Err(unknown_name(py, format!("self-contacts have no column `{name}`; {near}")))
            }
        }
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
        self.column(py, 1, |(frame, _), to| to.push(self.percepts.t_s(self.frames.start + frame)))
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
        let part = Part { percepts: Arc::clone(&self.percepts), frames: self.frames.clone(), fields: None };
        stream(py, &part, &self.run, TableKind::SelfContacts)
    }

    /// A column by its name, such as `contacts["distance"]`.
    fn __getitem__(&self, py: Python<'_>, #[pyo3(from_py_with = by_name)] name: String) -> PyResult<Py<PyAny>> {
        self.named(py, &name)
    }

    /// The names of its columns.
    #[expect(clippy::unused_self, reason = "a method of dicts")]
    fn keys(&self) -> Vec<&'static str> {
        COLUMNS.to_vec()
    }

    fn __contains__(&self, name: &str) -> bool {
        self.keys().contains(&name)
    }

    /// The column called `name`; `default` where there is none.
    #[pyo3(signature = (name, default = None))]
    fn get(&self, py: Python<'_>, name: &str, default: Option<Py<PyAny>>) -> PyResult<Option<Py<PyAny>>> {
        if self.__contains__(name) { self.named(py, name).map(Some) } else { Ok(default) }
    }

    /// The names of its columns, each with the column.
    fn items(&self, py: Python<'_>) -> PyResult<Vec<(&'static str, Py<PyAny>)>> {
        self.keys().into_iter().map(|name| Ok((name, self.named(py, name)?))).collect()
    }

    fn __iter__<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        in_python(slf.py(), "_tables", "rows", (slf,))
    }

    /// The self-contacts of each frame, one `SelfContacts` after the other, also of frames without any.
    fn by_frame<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        in_python(slf.py(), "_tables", "by_frame", (slf, slf.get().frames.len()))
    }

    fn _of_frame(&self, frame: usize) -> Self {
        let at = self.frames.start + frame;
        Self { percepts: Arc::clone(&self.percepts), run: Arc::clone(&self.run), frames: at..at + 1 }
    }

    /// The table, a row a self-contact, as a `pyarrow.Table`. Needs pyarrow.
    fn to_arrow<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        to_arrow(slf)
    }

    /// The table as a `pandas.DataFrame`. Needs pandas and pyarrow.
    fn to_pandas<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        to_pandas(slf)
    }

    /// The table as a `polars.DataFrame`. Needs polars.
    fn to_polars<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        to_polars(slf)
    }

    fn _repr_html_<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        in_python(slf.py(), "_html", "self_contacts", (slf,))
    }

    fn __copy__(slf: Py<Self>) -> Py<Self> {
        slf
    }

    fn __deepcopy__(slf: Py<Self>, _memo: &Bound<'_, PyDict>) -> Py<Self> {
        slf
    }

    fn __reduce__(&self) -> PyResult<()> {
        Err(stays_here("self-contacts cannot be pickled; send their arrays, or the table `self_contacts.to_arrow()`"))
    }

    fn __len__(&self) -> usize {
        self.rows().count()
    }

    fn __repr__(&self) -> String {
        format!("<SelfContacts: {} rows>", self.__len__())
    }
}
