//! `Percepts`: columns of a batch by name.

use std::collections::HashMap;
use std::sync::{Arc, Mutex, PoisonError};

use pyo3::exceptions::PyAttributeError;
use pyo3::prelude::*;
use pyo3::types::PyCapsule;
use somatic::error::{suggestion, unknown};
use somatic::percept::ColumnValues;
use somatic::renamed::new_name;
use somatic::scene::AskedOutputs;
use somatic::sink::TableKind;
use somatic::{COLUMNS, Column, Flags, Outputs, Percepts};

use crate::arrays::array;
use crate::error::usage;
use crate::self_contacts::PySelfContacts;
use crate::session::Run;
use crate::stream::stream;
use crate::threads::free;
use crate::touches::PyTouches;

/// What the fields reported in some frames.
///
/// `p["centroid"]` is an array [frames, fields, components], without the last axis where there is one component. It is float32
/// with backends `cpu` and `gpu` (float64 for what is computed in double precision everywhere), float64 with `reference`; `active` is
/// uint32. What is absent is NaN (0 in `active`), and `p.present(name)` says it. Arrays are made when first asked for, read-only,
/// and own their memory: they outlive the percepts and the engine.
///
/// >>> import numpy as np
/// >>> import somatic_touch as st
/// >>> engine = st.Engine(st.Body.grid(1, 3, 0.01), backend="cpu")
/// >>> p = engine.process([0.0, 0.1], np.array([[0, 2, 2], [0, 0, 0]], np.float32))
/// >>> p["centroid"].shape, p["total"].tolist()
/// ((2, 1, 2), [[4.0], [0.0]])
/// >>> p.present("centroid").tolist()
/// [[True], [False]]
#[pyclass(module = "somatic_touch", name = "Percepts", frozen)]
pub(crate) struct PyPercepts {
    pub(crate) inner: Arc<Percepts>,
    pub(crate) run: Arc<Run>,
    made: Mutex<HashMap<String, Py<PyAny>>>,
}

impl PyPercepts {
    pub(crate) fn new(inner: Arc<Percepts>, run: Arc<Run>) -> Self {
        Self { inner, run, made: Mutex::default() }
    }

    fn column(&self, py: Python<'_>, name: &str) -> PyResult<&'static Column> {
        let outputs = self.inner.outputs();
        if let Some(column) = outputs.columns().find(|column| column.name == name) {
            return Ok(column);
        }
        Err(usage(
            py,
            match name {
                "touches" | "self_contacts" => format!("{name} are not a column; see `.{name}`"),
                _ if COLUMNS.iter().any(|column| column.name == name) => {
                    format!("`{name}` was not asked for; add it to the scene's outputs")
                }
                _ => {
                    let names: Vec<String> =
                        AskedOutputs::names().filter(|name| name.starts_with("touches.")).collect();
                    match new_name(name, names.iter().map(String::as_str)) {
                        Some(new) => format!("`{name}` is `{new}` now; see `.touches`"),
                        None => unknown("output", name, outputs.columns().map(|column| column.name)),
                    }
                }
            },
        ))
    }

    /// The array called `name`, made once.
    fn once(&self, py: Python<'_>, name: &str, make: impl FnOnce() -> PyResult<Py<PyAny>>) -> PyResult<Py<PyAny>> {
        let made =
            |of: &Self| of.made.lock().unwrap_or_else(PoisonError::into_inner).get(name).map(|it| it.clone_ref(py));
        if let Some(array) = made(self) {
            return Ok(array);
        }
        // Made without the lock, which a thread that waits for Python must not hold.
        let array = make()?;
        self.made.lock().unwrap_or_else(PoisonError::into_inner).insert(name.to_owned(), array.clone_ref(py));
        Ok(array)
    }

    fn shape(&self) -> [usize; 2] {
        [self.inner.frames(), self.inner.fields()]
    }
}

#[pymethods]
impl PyPercepts {
    fn __getitem__(&self, py: Python<'_>, name: &str) -> PyResult<Py<PyAny>> {
        let column = self.column(py, name)?;
        self.once(py, name, || {
            let [frames, fields] = self.shape();
            let shape = [frames, fields, column.components];
            let shape = if column.components == 1 { &shape[..2] } else { &shape[..] };
            match free(py, || self.inner.column(column)) {
                Some(ColumnValues::F32(values)) => array(py, values, shape),
                Some(ColumnValues::F64(values)) => array(py, values, shape),
                Some(ColumnValues::U32(values)) => array(py, values, shape),
                None => Err(usage(py, format!("`{name}` was not asked for; add it to the scene's outputs"))),
            }
        })
    }

    fn __contains__(&self, name: &str) -> bool {
        self.inner.outputs().columns().any(|column| column.name == name)
    }

    /// The names of its columns.
    ///
    /// >>> import somatic_touch as st
    /// >>> st.Engine(st.Body.bundled("hand"), {"outputs": ["total", "principal_axis"]}, backend="cpu").step(0.0, [0] * 40).keys()
    /// ['total', 'principal_axis']
    fn keys(&self) -> Vec<&'static str> {
        self.inner.outputs().columns().map(|column| column.name).collect()
    }

    fn __iter__<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        Ok(self.keys().into_pyobject(py)?.try_iter()?.into_any())
    }

    fn __len__(&self) -> usize {
        self.keys().len()
    }

    /// Where the column called `name` has a value, bool [frames, fields].
    fn present(&self, py: Python<'_>, name: &str) -> PyResult<Py<PyAny>> {
        let column = self.column(py, name)?;
        self.once(py, &format!("present {name}"), || {
            array(py, self.inner.presence(column.output).collect(), &self.shape())
        })
    }

    /// The unit of the column called `name`, such as 'm' or 'Pa'; '1' where it has none.
    fn unit(&self, py: Python<'_>, name: &str) -> PyResult<String> {
        use somatic::percept::Unit;
        let column = self.column(py, name)?;
        let p = self.run.unit();
        Ok(match column.unit {
            Unit::P if !p.is_empty() => p.to_owned(),
            unit => unit.symbol().to_owned(),
        })
    }

    /// Why quantities are absent or in doubt, uint32 [frames, fields]; the bits are those of `Flags`.
    ///
    /// >>> import somatic_touch as st
    /// >>> p = st.Engine(st.Body.grid(2, 2, 0.01), backend="cpu").step(0.0, [0] * 4)
    /// >>> st.Flags(p.flags[0, 0])
    /// <Flags.NO_CONTACT: 1>
    #[getter]
    fn flags(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        self.once(py, "flags", || array(py, self.inner.all_flags().iter().map(Flags::bits).collect(), &self.shape()))
    }

    /// Whether each field is touched, bool [frames, fields].
    #[getter]
    fn contact(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        self.once(py, "contact", || {
            let contact = self.inner.all_flags().iter().map(|flags| !flags.contains(Flags::NO_CONTACT));
            array(py, contact.collect(), &self.shape())
        })
    }

    /// The times of its frames, float64 [frames], in seconds.
    #[getter]
    fn t(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        self.once(py, "t", || array(py, self.inner.times_s().to_vec(), &self.shape()[..1]))
    }

    /// The number of its first frame since the engine started.
    #[getter]
    fn first_frame(&self) -> u64 {
        self.inner.frame_number(0)
    }

    /// The names of its fields, in the order of the second axis; with `letters`, each with its letter.
    #[getter]
    fn fields(&self) -> Vec<&str> {
        self.run.labels.iter().map(String::as_str).collect()
    }

    /// Where the field called `name` is on the second axis.
    ///
    /// >>> import somatic_touch as st
    /// >>> p = st.Engine(st.Body.bundled("hand"), backend="cpu").step(0.0, [0] * 40)
    /// >>> p.fields[p.index("hand/back")]
    /// 'hand/back'
    fn index(&self, py: Python<'_>, name: &str) -> PyResult<usize> {
        let labels = || self.run.labels.iter().map(String::as_str);
        let found = labels().position(|label| label == name);
        found.ok_or_else(|| usage(py, format!("there is no field `{name}`; {}", suggestion(name, labels()))))
    }

    /// Whether positions and normals are in the world (z up, x forward, y left), bool [frames, fields]: where frames carry poses.
    #[getter]
    fn in_world(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        self.once(py, "in_world", || {
            let [frames, _] = self.shape();
            let in_world = (0..frames).flat_map(|frame| self.inner.frame(frame).map(|percept| percept.in_world));
            array(py, in_world.collect(), &self.shape())
        })
    }

    /// The touches, with output `touches`.
    #[getter]
    fn touches(&self, py: Python<'_>) -> PyResult<PyTouches> {
        if self.run.plan.touch_outputs().is_none() {
            return Err(usage(py, "`touches` were not asked for; add them to the scene's outputs"));
        }
        Ok(PyTouches { percepts: Arc::clone(&self.inner), run: Arc::clone(&self.run) })
    }

    fn __getattr__(&self, name: &str) -> PyResult<Py<PyAny>> {
        Err(PyAttributeError::new_err(match new_name(name, ["self_contacts"]) {
            Some(new) => format!("`{name}` is `{new}` now"),
            None => format!("'Percepts' object has no attribute '{name}'"),
        }))
    }

    /// The self-contacts, with output `self_contacts`: where the robot touches itself.
    #[getter]
    fn self_contacts(&self, py: Python<'_>) -> PyResult<PySelfContacts> {
        if !self.inner.outputs().contains(Outputs::SELF_CONTACTS) {
            return Err(usage(py, "`self_contacts` were not asked for; add them to the scene's outputs"));
        }
        Ok(PySelfContacts { percepts: Arc::clone(&self.inner), run: Arc::clone(&self.run) })
    }

    /// Arrow's C stream of the table that docs/how-to/tables.md describes: a row per frame and field in contact.
    #[pyo3(signature = (requested_schema = None))]
    fn __arrow_c_stream__<'py>(
        &self,
        py: Python<'py>,
        requested_schema: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyCapsule>> {
        // The interface lets a producer keep to its own schema.
        let _ = requested_schema;
        stream(py, &self.inner, &self.run, TableKind::Touched)
    }

    /// The table as a `pyarrow.Table`; with `all_fields` it has fields without contact too. Needs pyarrow.
    #[pyo3(signature = (*, all_fields = false))]
    fn to_arrow<'py>(&self, py: Python<'py>, all_fields: bool) -> PyResult<Bound<'py, PyAny>> {
        py.import("pyarrow")?.call_method1("table", (self.table(py, all_fields)?,))
    }

    /// The table as a `pandas.DataFrame`. Needs pandas and pyarrow.
    #[pyo3(signature = (*, all_fields = false))]
    fn to_pandas<'py>(&self, py: Python<'py>, all_fields: bool) -> PyResult<Bound<'py, PyAny>> {
        self.to_arrow(py, all_fields)?.call_method0("to_pandas")
    }

    /// The table as a `polars.DataFrame`. Needs polars.
    #[pyo3(signature = (*, all_fields = false))]
    fn to_polars<'py>(&self, py: Python<'py>, all_fields: bool) -> PyResult<Bound<'py, PyAny>> {
        py.import("polars")?.call_method1("DataFrame", (self.table(py, all_fields)?,))
    }

    fn __repr__(&self) -> String {
        let [frames, fields] = self.shape();
        let s = |count: usize| if count == 1 { "" } else { "s" };
        format!("<Percepts: {frames} frame{} of {fields} field{}>", s(frames), s(fields))
    }
}

impl PyPercepts {
    fn table<'py>(&self, py: Python<'py>, all_fields: bool) -> PyResult<Bound<'py, Table>> {
        Bound::new(py, Table { percepts: Arc::clone(&self.inner), run: Arc::clone(&self.run), all_fields })
    }
}

/// A table that others take through its stream.
#[pyclass(frozen)]
struct Table {
    percepts: Arc<Percepts>,
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
        stream(py, &self.percepts, &self.run, kind)
    }
}
