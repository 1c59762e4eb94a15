//! `Touches`: the touches of a batch.

use std::ops::Range;
use std::sync::Arc;

use pyo3::prelude::*;
use pyo3::types::{PyCapsule, PyDict};
use somatic::internal::error::{nearest, suggestion};
use somatic::internal::renamed::new_name;
use somatic::percept::TouchOutputs;
use somatic::sink::TableKind;
use somatic::{Percepts, TOUCH_COLUMNS, Touch, TouchColumn};

use crate::arrays::array;
use crate::error::{stays_here, unknown_name, usage};
use crate::globs::by_name;
use crate::session::Run;
use crate::stream::{Part, in_python, stream, to_arrow, to_pandas, to_polars};
use crate::touch_parts::{taxels, wrenches};

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
///
/// A loop over it has a dict for each touch, without the quantities that are absent; `by_frame` has the touches of each frame.
///
/// >>> [(touch["id"], touch["total"], "principal_axis" in touch) for touch in touches]
/// [(1, 5.0, False), (2, 4.0, True)]
#[pyclass(module = "somatic_touch", name = "Touches", frozen)]
pub(crate) struct PyTouches {
    pub(crate) percepts: Arc<Percepts>,
    pub(crate) run: Arc<Run>,
    /// The frames that it is of.
    pub(crate) frames: Range<usize>,
}

/// What every touch has, in the order of its table.
const ALWAYS: [&str; 8] = ["frame", "t", "link", "id", "age", "total", "active", "position"];

impl PyTouches {
    /// Frame and touch of each row.
    fn rows(&self) -> impl Iterator<Item = (usize, &Touch)> {
        let first = self.frames.start;
        self.frames.clone().flat_map(move |frame| {
            let found = self.percepts.touches(frame).into_iter();
            found.flat_map(move |found| found.touches.iter().map(move |t| (frame - first, t)))
        })
    }

    /// The quantities that were asked for beside those that are always there.
    fn quantities(&self) -> impl Iterator<Item = &'static TouchColumn> {
        let outputs = self.run.plan.touch_outputs().unwrap_or_default();
        outputs.columns().filter(|column| !ALWAYS.contains(&column.name))
    }

    fn part(&self) -> Part {
        Part { percepts: Arc::clone(&self.percepts), frames: self.frames.clone(), fields: None }
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

    /// The column called `name`.
    fn named(&self, py: Python<'_>, name: &str) -> PyResult<Py<PyAny>> {
        match name {
            "frame" => return self.frame(py),
            "t" => return self.t(py),
            "link" => return Ok(self.link().into_pyobject(py)?.into_any().unbind()),
            "id" => return self.id(py),
            "age" => return self.age(py),
            "total" => return self.total(py),
            "active" => return self.active(py),
            "position" => return self.position(py),
            "flags" => return self.flags(py),
            _ => {}
        }
        let outputs = self.run.plan.touch_outputs().unwrap_or_default();
        let Some(column) = outputs.columns().find(|column| column.name == name) else {
            let asked = match TOUCH_COLUMNS.iter().find(|column| column.name == name) {
                Some(column) => format!(
                    "was not asked for; add `touches.{}` to the outputs",
                    column.output.names().collect::<String>()
                ),
                None => match new_name(name, TOUCH_COLUMNS.iter().map(|column| column.name)) {
                    Some(new) => return Err(unknown_name(py, format!("`{name}` is `{new}` now"))),
                    None => {
                        let near = nearest(name, TOUCH_COLUMNS.iter().map(|column| column.name));
                        let near = near.map_or(String::new(), |near| format!("; did you mean `{near}`?"));
                        format!("does not exist; there are: {}{near}", self.keys()[5..].join(", "))
                    }
                },
            };
            return Err(unknown_name(py, format!("the quantity `{name}` of touches {asked}")));
        };
        self.column(py, column.components, |(_, touch), to| {
            to.extend_from_slice(&column.value(touch).unwrap_or([f64::NAN; 3])[..column.components]);
        })
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
        self.column(py, 1, |(frame, _), to| to.push(self.percepts.t_s(self.frames.start + frame)))
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

    /// What each touch does to each link that it lies on, an array of structures [parts]: `touch`, a row of this table; `link`, an index
    /// into the body's `links`; `total`; `force` [3] and `torque` [3] about the link's origin, in its frame, in N and N m, NaN where
    /// unknown.
    ///
    /// Needs the output `touches.wrench` for forces; a table of pandas and polars has columns `force_x`, `torque_z` and so on.
    ///
    /// >>> import somatic_touch as st
    /// >>> body = st.Body.grid(1, 5, 0.01)
    /// >>> kilopascals = st.Calibration("[all]\nunit = 'kPa'", body)
    /// >>> engine = st.Engine(body, {"outputs": ["touches", "touches.wrench"]}, kilopascals, backend="cpu")
    /// >>> wrenches = engine.process([0.0], [[3, 1, 0, 0, 5]]).touches.wrenches
    /// >>> wrenches["force"].shape, float(abs(wrenches["force"]).max().round(6))
    /// ((2, 3), 0.5)
    #[getter]
    fn wrenches<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let found = self.frames.clone().filter_map(|frame| self.percepts.touches(frame));
        wrenches(py, found)
    }

    /// The ids of the pressed taxels of each, a list of uint32 arrays. Needs the output `touches.taxels`.
    ///
    /// >>> import somatic_touch as st
    /// >>> engine = st.Engine(st.Body.grid(1, 5, 0.01), {"outputs": ["touches.taxels"]}, backend="cpu")
    /// >>> [taxels.tolist() for taxels in engine.process([0.0], [[3, 1, 0, 0, 5]]).touches.taxels]
    /// [[4], [0, 1]]
    #[getter]
    fn taxels(&self, py: Python<'_>) -> PyResult<Vec<Py<PyAny>>> {
        if !self.run.plan.touch_outputs().unwrap_or_default().contains(TouchOutputs::TAXELS) {
            return Err(usage(py, "`taxels` were not asked for; add `touches.taxels` to the scene's outputs"));
        }
        taxels(py, &self.run.body, self.frames.clone().filter_map(|frame| self.percepts.touches(frame)))
    }

    /// A quantity of each touch by its name, such as `touches["principal_axis"]` or `touches["fit_place"]`, float64 [touches] or
    /// [touches, components]; NaN where it is absent. `fit_kind` is 0 for a point, 1 for a line, 2 for a segment and 3 for a blob.
    /// What is an attribute, such as `id`, is there by its name, too.
    fn __getitem__(&self, py: Python<'_>, #[pyo3(from_py_with = by_name)] name: String) -> PyResult<Py<PyAny>> {
        self.named(py, &name)
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
        stream(py, &self.part(), &self.run, TableKind::Touches)
    }

    /// The names of its quantities, which `touches[name]` gives: what every touch has, and what was asked for.
    ///
    /// >>> import somatic_touch as st
    /// >>> touches = st.Engine(st.Body.bundled("hand"), backend="cpu").step(0.0, [0] * 40).touches
    /// >>> touches.keys()[:8], "spread" in touches, "wrench" in touches
    /// (['frame', 't', 'link', 'id', 'age', 'total', 'active', 'position'], True, False)
    fn keys(&self) -> Vec<&'static str> {
        ALWAYS.into_iter().chain(self.quantities().map(|column| column.name)).chain(["flags"]).collect()
    }

    fn __contains__(&self, name: &str) -> bool {
        self.keys().contains(&name)
    }

    /// The quantity called `name`; `default` where there is none.
    #[pyo3(signature = (name, default = None))]
    fn get(&self, py: Python<'_>, name: &str, default: Option<Py<PyAny>>) -> PyResult<Option<Py<PyAny>>> {
        if self.__contains__(name) { self.named(py, name).map(Some) } else { Ok(default) }
    }

    /// The names of its quantities, each with its values.
    fn items(&self, py: Python<'_>) -> PyResult<Vec<(&'static str, Py<PyAny>)>> {
        self.keys().into_iter().map(|name| Ok((name, self.named(py, name)?))).collect()
    }

    /// The unit of the quantity called `name`, such as 'm' or 'Pa'; '1' where it has none.
    ///
    /// >>> import somatic_touch as st
    /// >>> touches = st.Engine(st.Body.bundled("hand"), backend="cpu").step(0.0, [0] * 40).touches
    /// >>> touches.unit("position"), touches.unit("age"), touches.unit("total")
    /// ('m', 's', 'count')
    fn unit(&self, py: Python<'_>, name: &str) -> PyResult<String> {
        if !self.__contains__(name) {
            return Err(unknown_name(py, format!("there is no quantity `{name}`; {}", suggestion(name, self.keys()))));
        }
        let column = TOUCH_COLUMNS.iter().find(|column| column.name == name);
        Ok(match (name, column) {
            ("t" | "age", _) => "s".to_owned(),
            (_, column) => column.map_or_else(|| "1".to_owned(), |column| self.run.symbol_of(column.unit)),
        })
    }

    fn __iter__<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        in_python(slf.py(), "_tables", "rows", (slf,))
    }

    /// The touches of each frame, one `Touches` after the other, also of frames without any.
    ///
    /// Yields
    /// ------
    /// Touches
    ///     Of one frame; its `frame` is 0 in all rows.
    ///
    /// Examples
    /// --------
    /// >>> import numpy as np
    /// >>> import somatic_touch as st
    /// >>> engine = st.Engine(st.Body.grid(1, 3, 0.01), backend="cpu")
    /// >>> p = engine.process([0.0, 0.1], np.array([[0, 0, 0], [1, 0, 2]], np.float32))
    /// >>> for t, touches in zip(p.t, p.touches.by_frame()):
    /// ...     print(t, touches.total)
    /// 0.0 []
    /// 0.1 [2. 1.]
    fn by_frame<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        in_python(slf.py(), "_tables", "by_frame", (slf, slf.get().frames.len()))
    }

    fn _of_frame(&self, frame: usize) -> Self {
        let at = self.frames.start + frame;
        Self { percepts: Arc::clone(&self.percepts), run: Arc::clone(&self.run), frames: at..at + 1 }
    }

    /// The table, a row a touch, as a `pyarrow.Table`. Needs pyarrow.
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

    /// Draws a quantity over time, a line a touch, and gives matplotlib's axes.
    ///
    /// Parameters
    /// ----------
    /// quantity : str
    ///     One of `keys`; of vectors each component is drawn, with another style of line.
    /// ax : matplotlib.axes.Axes, optional
    ///     Where to draw; by default in a new figure.
    ///
    /// Returns
    /// -------
    /// matplotlib.axes.Axes
    ///     Lines have gaps where the quantity is absent.
    ///
    /// Examples
    /// --------
    /// >>> import matplotlib
    /// >>> matplotlib.use("Agg")
    /// >>> import somatic_touch as st
    /// >>> touch = st.read("hand")
    /// >>> touches = touch.engine(backend="cpu").process(touch.t, touch.values).touches
    /// >>> touches.plot("spread").get_ylabel()
    /// 'spread [m]'
    #[pyo3(signature = (quantity = "total", *, ax = None))]
    fn plot<'py>(slf: &Bound<'py, Self>, quantity: &str, ax: Option<Bound<'py, PyAny>>) -> PyResult<Bound<'py, PyAny>> {
        in_python(slf.py(), "_plots", "touches", (slf, quantity, ax))
    }

    fn _repr_html_<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        in_python(slf.py(), "_html", "touches", (slf,))
    }

    fn __copy__(slf: Py<Self>) -> Py<Self> {
        slf
    }

    fn __deepcopy__(slf: Py<Self>, _memo: &Bound<'_, PyDict>) -> Py<Self> {
        slf
    }

    fn __reduce__(&self) -> PyResult<()> {
        Err(stays_here(
            "touches cannot be pickled; send their arrays, such as `touches.position`, or the table `touches.to_arrow()`",
        ))
    }

    fn __len__(&self) -> usize {
        self.rows().count()
    }

    fn __repr__(&self) -> String {
        format!("<Touches: {} rows>", self.__len__())
    }
}
