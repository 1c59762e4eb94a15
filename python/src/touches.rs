//! `Touches`: the touches of a batch.

use std::sync::Arc;

use pyo3::prelude::*;
use pyo3::types::PyCapsule;
use somatic::renamed::new_name;
use somatic::sink::TableKind;
use somatic::{FieldTouch, Outputs, Percepts, TOUCH_COLUMNS, Touch};

use crate::arrays::array;
use crate::error::usage;
use crate::session::Run;
use crate::stream::stream;

/// The touches of some frames, a row each, in the order of frames: of the whole body, over fields and joints. Where fits or
/// self-contacts are asked for too, each field has touches of its own, in the order of frames and fields.
///
/// Needs output `touches`; `touches.wrench` and others add to them.
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

/// A touch of the whole body, or of a field.
#[derive(Clone, Copy)]
enum Row<'a> {
    OfBody(&'a Touch),
    OfField(usize, &'a FieldTouch),
}

impl PyTouches {
    fn are_of_body(&self) -> bool {
        self.run.plan.touch_outputs().is_some()
    }

    /// Frame and touch of each row.
    fn rows(&self) -> impl Iterator<Item = (usize, Row<'_>)> {
        let percepts = &self.percepts;
        (0..percepts.frames()).flat_map(move |frame| {
            let of_body = percepts.touches(frame);
            let fields = if of_body.is_some() { 0 } else { percepts.fields() };
            let of_fields = (0..fields).flat_map(move |field| {
                percepts.field_touches(frame, field).iter().map(move |touch| (frame, Row::OfField(field, touch)))
            });
            let of_body = of_body.into_iter().flat_map(|found| found.touches.iter());
            of_body.map(move |touch| (frame, Row::OfBody(touch))).chain(of_fields)
        })
    }

    fn column<T: numpy::Element>(
        &self,
        py: Python<'_>,
        width: usize,
        of: impl Fn((usize, Row<'_>), &mut Vec<T>),
    ) -> PyResult<Py<PyAny>> {
        let mut values = Vec::new();
        self.rows().for_each(|row| of(row, &mut values));
        let rows = values.len() / width;
        let shape = [rows, width];
        array(py, values, if width == 1 { &shape[..1] } else { &shape })
    }

    /// Refuses `name` where touches are not `of_body`.
    fn only(&self, py: Python<'_>, name: &str, of_body: bool) -> PyResult<()> {
        match (self.are_of_body() == of_body, of_body) {
            (true, _) => Ok(()),
            (_, true) => Err(usage(
                py,
                format!(
                    "`{name}` is of touches of the whole body, and fits and self-contacts are of fields': leave those out"
                ),
            )),
            (_, false) => {
                Err(usage(py, format!("`{name}` is of a field's own touches, and these are of the whole body")))
            }
        }
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

    /// Of a field's own touches the field, int64 [touches]: an index into `Percepts.fields`.
    #[getter]
    fn field(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        self.only(py, "field", false)?;
        self.column(py, 1, |(_, row), to| {
            let Row::OfField(field, _) = row else { return };
            to.push(field as i64);
        })
    }

    /// The link with most of its total, a list of names.
    #[getter]
    fn link(&self, py: Python<'_>) -> PyResult<Vec<String>> {
        self.only(py, "link", true)?;
        let links = &self.run.body.links;
        let link = |(_, row)| match row {
            Row::OfBody(touch) => Some(links[touch.link as usize].name.clone()),
            Row::OfField(..) => None,
        };
        Ok(self.rows().filter_map(link).collect())
    }

    /// Its identity, uint64 [touches]: lasts from onset to release, and is never used again.
    #[getter]
    fn id(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        self.column(py, 1, |(_, row), to| {
            to.push(match row {
                Row::OfBody(touch) => touch.id,
                Row::OfField(_, touch) => touch.id,
            });
        })
    }

    /// Time since its onset, float64 [touches], in seconds.
    #[getter]
    fn age(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        self.only(py, "age", true)?;
        self.column(py, 1, |(_, row), to| to.extend(row.of_body().map(|touch| touch.age_s)))
    }

    /// Its total, float64 [touches], in the unit of pressures.
    #[getter]
    fn total(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        self.column(py, 1, |(_, row), to| {
            to.push(match row {
                Row::OfBody(touch) => touch.total,
                Row::OfField(_, touch) => touch.total,
            });
        })
    }

    /// The number of its pressed taxels, uint32 [touches].
    #[getter]
    fn active(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        self.column(py, 1, |(_, row), to| {
            to.push(match row {
                Row::OfBody(touch) => touch.active,
                Row::OfField(_, touch) => touch.active,
            });
        })
    }

    /// Of a field's own touches the centroid in its chart, float64 [touches, 2], in metres; NaN where the field has no chart.
    #[getter]
    fn centroid(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        self.only(py, "centroid", false)?;
        self.column(py, 2, |(_, row), to| {
            let Row::OfField(_, touch) = row else { return };
            to.extend(touch.centroid.unwrap_or([f64::NAN; 2]));
        })
    }

    /// Where it is on the skin, float64 [touches, 3], in metres: in its link, or in the world where frames say where that is. NaN where
    /// a field's own touch has no place.
    #[getter]
    fn position(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        self.column(py, 3, |(_, row), to| match row {
            Row::OfBody(touch) => to.extend(touch.position.to_array()),
            Row::OfField(_, touch) => to.extend(touch.position.unwrap_or([f64::NAN; 3])),
        })
    }

    /// Why quantities of each are absent or in doubt, uint32 [touches]; the bits are those of `TouchFlags`, of a field's own touches
    /// those of `Flags`.
    #[getter]
    fn flags(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        self.column(py, 1, |(_, row), to| {
            to.push(match row {
                Row::OfBody(touch) => touch.flags.bits(),
                Row::OfField(_, touch) => touch.flags.bits(),
            });
        })
    }

    /// A quantity of each touch by its name, such as `touches["principal_axis"]` or `touches["fit_place"]`, float64 [touches] or
    /// [touches, components]; NaN where it is absent. `fit_kind` is 0 for a point, 1 for a line, 2 for a segment and 3 for a blob.
    fn __getitem__(&self, py: Python<'_>, name: &str) -> PyResult<Py<PyAny>> {
        if let Some(outputs) = self.run.plan.touch_outputs() {
            let Some(column) = outputs.columns().find(|column| column.name == name) else {
                let asked = match TOUCH_COLUMNS.iter().find(|column| column.name == name) {
                    Some(column) => format!(
                        "was not asked for; add `touches.{}` to the outputs",
                        column.output.names().collect::<String>()
                    ),
                    None => format!(
                        "is none; there are: {}",
                        outputs.columns().map(|column| column.name).collect::<Vec<_>>().join(", ")
                    ),
                };
                return Err(usage(py, format!("the quantity `{name}` of touches {asked}")));
            };
            return self.column(py, column.components, |(_, row), to| {
                let Some(touch) = row.of_body() else { return };
                to.extend_from_slice(&column.value(touch).unwrap_or([f64::NAN; 3])[..column.components]);
            });
        }
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
        self.column(py, column.components, |(_, row), to| {
            let Row::OfField(_, touch) = row else { return };
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

impl<'a> Row<'a> {
    fn of_body(self) -> Option<&'a Touch> {
        match self {
            Self::OfBody(touch) => Some(touch),
            Self::OfField(..) => None,
        }
    }
}
