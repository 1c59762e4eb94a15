//! `Percepts`: columns of a batch by name.

mod chosen;
mod columns;
mod table;

use std::collections::HashMap;
use std::ops::Range;
use std::sync::{Arc, Mutex};

use pyo3::exceptions::PyAttributeError;
use pyo3::prelude::*;
use pyo3::types::{PyCapsule, PyDict};
use somatic::internal::error::suggestion;
use somatic::internal::renamed::new_name;
use somatic::sink::TableKind;
use somatic::{Flags, Outputs, Percepts};

use crate::array_body::Names;
use crate::arrays::{array, time_s};
use crate::error::{stays_here, unknown_name, usage};
use crate::globs::{Globs, by_name};
use crate::self_contacts::PySelfContacts;
use crate::session::Run;
use crate::stream::{Part, in_python, stream, to_arrow, to_pandas, to_polars};
use crate::touches::PyTouches;

/// What the fields reported in some frames.
///
/// `p["centroid"]` is an array [frames, fields, components], without the last axis where there is one component. It is float32
/// with backends `cpu` and `gpu` (float64 for what is computed in double precision everywhere), float64 with `reference`; `active` is
/// uint32. What is absent is NaN (0 in `active`), and `p.present(name)` says it. A field of taxels of several kinds is there once for each
/// letter that they have, as `p.letters` says: `p["shear"]` is NaN in fields of another letter. Arrays are made when first asked for,
/// read-only, and own their memory: they outlive the percepts and the engine.
///
/// >>> import numpy as np
/// >>> import somatic_touch as st
/// >>> engine = st.Engine(st.Body.grid(1, 3, 0.01), backend="cpu")
/// >>> p = engine.process([0.0, 0.1], np.array([[0, 2, 2], [0, 0, 0]], np.float32))
/// >>> p["centroid"].shape, p["total"].tolist()
/// ((2, 1, 2), [[4.0], [0.0]])
/// >>> p.present("centroid").tolist()
/// [[True], [False]]
///
/// It is used as a dict of its columns: `"centroid" in p`, `p.get(name)`, `p.keys()`, `p.items()`. `p.between(t0, t1)` and
/// `p.select("hand/palm*")` are parts of it. Two are equal (`==`) if they say the same of the same frames.
#[pyclass(module = "somatic_touch", name = "Percepts", frozen, mapping)]
pub(crate) struct PyPercepts {
    pub(crate) inner: Arc<Percepts>,
    pub(crate) run: Arc<Run>,
    /// The frames that it has.
    frames: Range<usize>,
    /// The fields that it has; all where there is none.
    fields: Option<Arc<[usize]>>,
    /// All that a call has given, whose arrays parts share; none where it is that.
    whole: Option<Py<Self>>,
    made: Mutex<HashMap<String, Py<PyAny>>>,
}

impl PyPercepts {
    pub(crate) fn new(inner: Arc<Percepts>, run: Arc<Run>) -> Self {
        Self { frames: 0..inner.frames(), fields: None, inner, run, whole: None, made: Mutex::default() }
    }

    /// The part of `of` with these frames and fields, which are numbered as in the whole batch.
    fn part(of: &Bound<'_, Self>, frames: Range<usize>, fields: Option<Arc<[usize]>>) -> Self {
        let Self { inner, run, whole, .. } = of.get();
        let whole = whole.as_ref().map_or_else(|| of.clone().unbind(), |whole| whole.clone_ref(of.py()));
        let (inner, run) = (Arc::clone(inner), Arc::clone(run));
        Self { inner, run, frames, fields, whole: Some(whole), made: Mutex::default() }
    }

    /// Whether it is all that a call has given.
    pub(crate) fn is_whole(&self) -> bool {
        self.frames == (0..self.inner.frames()) && self.fields.is_none()
    }

    fn of_table(&self) -> Part {
        Part { percepts: Arc::clone(&self.inner), frames: self.frames.clone(), fields: self.fields.clone() }
    }

    /// The fields that it has, numbered as in the whole batch.
    fn indices(&self) -> Vec<usize> {
        self.fields.as_ref().map_or_else(|| (0..self.inner.fields()).collect(), |fields| fields.to_vec())
    }

    fn labels(&self) -> Vec<&str> {
        self.indices().iter().map(|&field| self.run.labels[field].as_str()).collect()
    }
}

#[pymethods]
impl PyPercepts {
    fn __getitem__(&self, py: Python<'_>, #[pyo3(from_py_with = by_name)] name: String) -> PyResult<Py<PyAny>> {
        self.named(py, &name)
    }

    fn __contains__(&self, name: &str) -> bool {
        self.inner.outputs().columns().any(|column| column.name == name)
    }

    /// The column called `name`; `default` where there is none.
    ///
    /// >>> import somatic_touch as st
    /// >>> p = st.Engine(st.Body.bundled("hand"), {"outputs": ["total"]}, backend="cpu").step(0.0, [0] * 40)
    /// >>> p.get("total").shape, p.get("centroid")
    /// ((1, 13), None)
    #[pyo3(signature = (name, default = None))]
    fn get(&self, py: Python<'_>, name: &str, default: Option<Py<PyAny>>) -> PyResult<Option<Py<PyAny>>> {
        if self.__contains__(name) { self.named(py, name).map(Some) } else { Ok(default) }
    }

    /// Its columns, in the order of `keys`.
    fn values(&self, py: Python<'_>) -> PyResult<Vec<Py<PyAny>>> {
        self.keys().iter().map(|name| self.named(py, name)).collect()
    }

    /// The names of its columns, each with the column.
    ///
    /// >>> import somatic_touch as st
    /// >>> p = st.Engine(st.Body.bundled("hand"), {"outputs": ["total", "centroid"]}, backend="cpu").step(0.0, [0] * 40)
    /// >>> {name: column.shape for name, column in p.items()}
    /// {'total': (1, 13), 'centroid': (1, 13, 2)}
    fn items(&self, py: Python<'_>) -> PyResult<Vec<(&'static str, Py<PyAny>)>> {
        self.keys().into_iter().map(|name| Ok((name, self.named(py, name)?))).collect()
    }

    /// The part of it from time `t0` on and before `t1`: seconds, or dates. What is not given has no end.
    ///
    /// Parameters
    /// ----------
    /// t0, t1 : float or datetime, optional
    ///     In the clock of `t`, in seconds; dates as for `Engine.process`.
    ///
    /// Returns
    /// -------
    /// Percepts
    ///     Of these frames. Arrays are views; `touches.frame` counts from the part's first frame.
    ///
    /// Examples
    /// --------
    /// >>> import numpy as np
    /// >>> import somatic_touch as st
    /// >>> engine = st.Engine(st.Body.bundled("hand"), {"outputs": ["total"]}, backend="cpu")
    /// >>> p = engine.process([0.0, 0.1, 0.2, 0.3], np.zeros((4, 40), np.float32))
    /// >>> p.between(0.1, 0.3).t.tolist()
    /// [0.1, 0.2]
    #[pyo3(signature = (t0 = None, t1 = None))]
    fn between(slf: &Bound<'_, Self>, t0: Option<&Bound<'_, PyAny>>, t1: Option<&Bound<'_, PyAny>>) -> PyResult<Self> {
        let (py, of) = (slf.py(), slf.get());
        let from_s = t0.map(|t| time_s(t, "t0")).transpose()?.unwrap_or(f64::NEG_INFINITY);
        let to_s = t1.map(|t| time_s(t, "t1")).transpose()?.unwrap_or(f64::INFINITY);
        if from_s.is_nan() || to_s.is_nan() {
            return Err(usage(py, "t0 and t1 should be times in seconds; one is NaN"));
        }
        let times = &of.inner.times_s()[of.frames.clone()];
        let is_in = |t: &f64| (from_s..to_s).contains(t);
        let Some(first) = times.iter().position(is_in) else {
            return Ok(Self::part(slf, of.frames.start..of.frames.start, of.fields.clone()));
        };
        let end = times.iter().rposition(is_in).map_or(first, |last| last + 1);
        if let Some(other) = times[first..end].iter().position(|t| !is_in(t)) {
            let (frame, t) = (first + other, times[first + other]);
            let what = format!(
                "times are not in order: frame {frame} at {t} s is between frames of this part; choose rows of its arrays by `t`"
            );
            return Err(usage(py, what));
        }
        Ok(Self::part(slf, of.frames.start + first..of.frames.start + end, of.fields.clone()))
    }

    /// The part of it with the fields whose names match `fields`: a glob, or several, as in a scene. `*` does not go over a `/`.
    ///
    /// Parameters
    /// ----------
    /// fields : str or iterable of str, optional
    ///     Such as `"hand/palm*"`, `"left_*"` or `["hand/back", "hand/palm"]`; all by default.
    /// letters : str or iterable of str, optional
    ///     Such as `"shear"`; all by default.
    ///
    /// Returns
    /// -------
    /// Percepts
    ///     Of these fields, in their order. Touches are of the whole body, and stay.
    ///
    /// Raises
    /// ------
    /// UnknownNameError
    ///     Where a glob matches nothing, or no field is of a letter.
    ///
    /// Examples
    /// --------
    /// >>> import somatic_touch as st
    /// >>> p = st.Engine(st.Body.bundled("hand"), {"outputs": ["total"]}, backend="cpu").step(0.0, [0] * 40)
    /// >>> p.select("hand/b*").fields, p.select("hand/b*")["total"].shape
    /// (['hand/back'], (1, 1))
    #[pyo3(signature = (fields = None, *, letters = None))]
    fn select(slf: &Bound<'_, Self>, fields: Option<Globs>, letters: Option<Names>) -> PyResult<Self> {
        let (py, of) = (slf.py(), slf.get());
        let indices = of.chosen(py, fields, letters)?;
        Ok(Self::part(slf, of.frames.clone(), Some(indices.into())))
    }

    /// Draws a column over time, a line a field, and gives matplotlib's axes.
    ///
    /// Parameters
    /// ----------
    /// output : str, optional
    ///     A column; by default `force`, `total` or the first that there is.
    /// fields : str or iterable of str, optional
    ///     Globs, as for `select`. At most ten fields that are touched are drawn, those that are touched longest.
    /// ax : matplotlib.axes.Axes, optional
    ///     Where to draw; by default in a new figure.
    ///
    /// Returns
    /// -------
    /// matplotlib.axes.Axes
    ///     Lines have gaps where the column is absent.
    ///
    /// Examples
    /// --------
    /// >>> import matplotlib
    /// >>> matplotlib.use("Agg")
    /// >>> import somatic_touch as st
    /// >>> touch = st.read("hand")
    /// >>> p = touch.engine({"outputs": ["total"]}, backend="cpu").process(touch.t, touch.values)
    /// >>> p.plot("total", fields="hand/*").get_ylabel()
    /// 'total [count]'
    #[pyo3(signature = (output = None, *, fields = None, ax = None))]
    fn plot<'py>(
        slf: &Bound<'py, Self>,
        output: Option<&str>,
        fields: Option<Bound<'py, PyAny>>,
        ax: Option<Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        in_python(slf.py(), "_plots", "percepts", (slf, output, fields, ax))
    }

    fn _repr_html_<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        in_python(slf.py(), "_html", "percepts", (slf,))
    }

    fn __eq__(slf: &Bound<'_, Self>, other: &Bound<'_, PyAny>) -> PyResult<Py<PyAny>> {
        let py = slf.py();
        if !other.is_instance_of::<Self>() {
            return Ok(py.NotImplemented());
        }
        in_python(py, "_tables", "are_same_percepts", (slf, other)).map(Bound::unbind)
    }

    fn __copy__(slf: Py<Self>) -> Py<Self> {
        slf
    }

    fn __deepcopy__(slf: Py<Self>, _memo: &Bound<'_, PyDict>) -> Py<Self> {
        slf
    }

    fn __reduce__(&self) -> PyResult<()> {
        Err(stays_here(
            "percepts cannot be pickled; send their arrays, such as `p[\"total\"]`, or the table `p.to_arrow()`, or write a file by `st.write`",
        ))
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
        Ok(self.run.symbol_of(self.column(py, name)?.unit))
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

    /// Whether each field is touched, bool [frames, fields]; of letter `proximity` whether something is in range, of `temperature` whether
    /// there is a reading.
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
        self.inner.frame_number(self.frames.start)
    }

    /// The names of its fields, in the order of the second axis; with `letters`, each with its letter.
    #[getter]
    fn fields(&self) -> Vec<&str> {
        self.labels()
    }

    /// The letter of each field, in the order of the second axis: 'sustained', 'change', 'shear', 'temperature' or 'proximity'.
    ///
    /// >>> import somatic_touch as st
    /// >>> engine = st.Engine(st.Body.grid(1, 2, 0.01), {"letters": ["sustained", "change"]}, backend="cpu")
    /// >>> p = engine.step(0.0, [0, 0])
    /// >>> p.letters, p.select(letters="change").fields == p.fields[1:]
    /// (['sustained', 'change'], True)
    #[getter]
    fn letters(&self) -> Vec<&str> {
        self.indices().iter().map(|&field| self.run.letters[field].as_str()).collect()
    }

    /// Where the field called `name` is on the second axis.
    ///
    /// >>> import somatic_touch as st
    /// >>> p = st.Engine(st.Body.bundled("hand"), backend="cpu").step(0.0, [0] * 40)
    /// >>> p.fields[p.index("hand/back")]
    /// 'hand/back'
    fn index(&self, py: Python<'_>, name: &str) -> PyResult<usize> {
        let labels = self.labels();
        let found = labels.iter().position(|label| *label == name);
        found.ok_or_else(|| {
            unknown_name(py, format!("there is no field `{name}`; {}", suggestion(name, labels.iter().copied())))
        })
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
        Ok(PyTouches { percepts: Arc::clone(&self.inner), run: Arc::clone(&self.run), frames: self.frames.clone() })
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
        Ok(PySelfContacts {
            percepts: Arc::clone(&self.inner),
            run: Arc::clone(&self.run),
            frames: self.frames.clone(),
        })
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
        stream(py, &self.of_table(), &self.run, TableKind::Touched)
    }

    /// The table as a `pyarrow.Table`; with `all_fields` it has fields without contact too. Needs pyarrow.
    #[pyo3(signature = (*, all_fields = false))]
    fn to_arrow<'py>(&self, py: Python<'py>, all_fields: bool) -> PyResult<Bound<'py, PyAny>> {
        to_arrow(&self.table(py, all_fields)?)
    }

    /// The table as a `pandas.DataFrame`. Needs pandas and pyarrow.
    #[pyo3(signature = (*, all_fields = false))]
    fn to_pandas<'py>(&self, py: Python<'py>, all_fields: bool) -> PyResult<Bound<'py, PyAny>> {
        to_pandas(&self.table(py, all_fields)?)
    }

    /// The table as a `polars.DataFrame`. Needs polars.
    #[pyo3(signature = (*, all_fields = false))]
    fn to_polars<'py>(&self, py: Python<'py>, all_fields: bool) -> PyResult<Bound<'py, PyAny>> {
        to_polars(&self.table(py, all_fields)?)
    }

    fn __repr__(&self) -> String {
        let (frames, fields) = (self.frames.len(), self.indices().len());
        let s = |count: usize| if count == 1 { "" } else { "s" };
        format!("<Percepts: {frames} frame{} of {fields} field{}>", s(frames), s(fields))
    }
}
