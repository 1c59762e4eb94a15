//! `Body` and its fields.

use std::path::PathBuf;
use std::sync::Arc;

use pyo3::prelude::*;
use pyo3::types::PyDict;
use somatic::author::{GridOrder, SheetGrid, author_sheets};
use somatic::body::Original;
use somatic::error::suggestion;
use somatic::field::FieldSet;
use somatic::{Body, OutputPath, bundled};

use crate::arrays::{array, structured};
use crate::error::{OrRaise, usage};
use crate::threads::free;

/// A robot's shape, its sensors and its fields.
///
/// Threads may share one.
///
/// >>> import somatic_touch as st
/// >>> body = st.Body.bundled("hand")
/// >>> body
/// <Body hand: 40 taxels in 13 fields on 5 links>
/// >>> body.taxels["position"].shape
/// (40, 3)
#[pyclass(module = "somatic_touch", name = "Body", frozen, skip_from_py_object)]
#[derive(Clone)]
pub(crate) struct PyBody {
    pub(crate) inner: Arc<Body>,
    /// The same as a `.glb`, for recordings and tables.
    pub(crate) bytes: Arc<Vec<u8>>,
}

impl PyBody {
    pub(crate) fn of_bytes(name: &str, bytes: Vec<u8>) -> somatic::Result<Self> {
        Ok(Self { inner: Arc::new(Body::from_bytes(name, &bytes)?), bytes: Arc::new(bytes) })
    }

    /// The body in the file at `path`.
    pub(crate) fn of_file(path: &std::path::Path) -> somatic::Result<Self> {
        let inner = Arc::new(Body::load(path)?);
        let bytes = std::fs::read(path).map_err(|e| somatic::Error::io(path, &e))?;
        // A .glb may refer to buffers in other files; writing it anew embeds them.
        let file = Original::from_bytes(&path.display().to_string(), &bytes, path.parent())?;
        Ok(Self { inner, bytes: Arc::new(file.to_glb()?) })
    }

    pub(crate) fn ids(&self) -> Vec<u32> {
        self.inner.taxels.iter().map(|taxel| taxel.id).collect()
    }

    pub(crate) fn bundled_or_file(name: &str) -> somatic::Result<Self> {
        match bundled::body(name) {
            Some(bytes) if !std::path::Path::new(name).is_file() => Self::of_bytes(name, bytes.to_vec()),
            _ => Self::of_file(std::path::Path::new(name)),
        }
    }
}

/// A field of a body: which taxels it has, and where these are in its chart.
///
/// >>> import somatic_touch as st
/// >>> back = st.Body.bundled("hand").fields["hand/back"]
/// >>> back
/// <Field hand/back: 9 taxels on hand, chart plane>
/// >>> back.uv.shape
/// (9, 2)
#[pyclass(module = "somatic_touch", name = "Field", frozen)]
pub(crate) struct PyField {
    name: String,
    parent: Option<String>,
    anchor: Option<String>,
    chart: Option<String>,
    distortion: Option<f64>,
    taxels: Py<PyAny>,
    weights: Py<PyAny>,
    uv: Option<Py<PyAny>>,
}

#[pymethods]
impl PyField {
    /// Its name, such as 'hand/back'.
    #[getter]
    fn name(&self) -> &str {
        &self.name
    }

    /// The name of the field that it is a part of.
    #[getter]
    fn parent(&self) -> Option<&str> {
        self.parent.as_deref()
    }

    /// The link in whose frame its positions are; None where its taxels sit on several links.
    #[getter]
    fn anchor(&self) -> Option<&str> {
        self.anchor.as_deref()
    }

    /// The kind of its chart, 'plane' or 'geodesic'; None where it has none.
    #[getter]
    fn chart(&self) -> Option<&str> {
        self.chart.as_deref()
    }

    /// The largest relative error of distances between neighbours in the chart.
    #[getter]
    fn distortion(&self) -> Option<f64> {
        self.distortion
    }

    /// The ids of its taxels, uint32 [members], ascending.
    #[getter]
    fn taxels(&self, py: Python<'_>) -> Py<PyAny> {
        self.taxels.clone_ref(py)
    }

    /// Their weights, float64 [members].
    #[getter]
    fn weights(&self, py: Python<'_>) -> Py<PyAny> {
        self.weights.clone_ref(py)
    }

    /// Where they are in the chart, float64 [members, 2], in metres; None without a chart.
    #[getter]
    fn uv(&self, py: Python<'_>) -> Option<Py<PyAny>> {
        self.uv.as_ref().map(|uv| uv.clone_ref(py))
    }

    fn __len__(&self, py: Python<'_>) -> PyResult<usize> {
        self.taxels.bind(py).len()
    }

    fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
        let (anchor, chart) = (self.anchor.as_deref().unwrap_or("several links"), self.chart.as_deref());
        Ok(format!(
            "<Field {}: {} taxels on {anchor}, chart {}>",
            self.name,
            self.__len__(py)?,
            chart.unwrap_or("none")
        ))
    }
}

#[pymethods]
impl PyBody {
    /// Reads the body in the file at `path`: a .glb or .gltf with a layout, as docs/reference/layout.md specifies it.
    ///
    /// >>> import somatic_touch as st
    /// >>> st.Body.load("robot.glb")
    /// Traceback (most recent call last):
    ///     ...
    /// somatic_touch.InputError: robot.glb: no such file or directory
    #[staticmethod]
    fn load(py: Python<'_>, path: PathBuf) -> PyResult<Self> {
        free(py, || Self::of_file(&path)).or_raise_of(py, &path)
    }

    /// One of the bodies that come with the package: 'hand', 'mat' or 'humanoid'.
    ///
    /// >>> import somatic_touch as st
    /// >>> [len(st.Body.bundled(name).taxels) for name in ("hand", "mat", "humanoid")]
    /// [40, 2048, 960]
    #[staticmethod]
    fn bundled(py: Python<'_>, name: &str) -> PyResult<Self> {
        let Some(bytes) = bundled::body(name) else {
            let hint = suggestion(name, bundled::BODIES);
            return Err(usage(py, format!("there is no bundled body `{name}`; {hint}")));
        };
        free(py, || Self::of_bytes(name, bytes.to_vec())).or_raise(py)
    }

    /// A flat sheet of `rows` × `columns` sensors that are `pitch_m` apart, in metres: a mat, an insole, an array.
    ///
    /// The field is called `name`; `regions` (rows, columns) makes fields of parts below it. Ids count from 0 along each row,
    /// or with `order="columns"` along each column.
    ///
    /// >>> import somatic_touch as st
    /// >>> mat = st.Body.grid(31, 11, 0.0086, name="mat", regions=(3, 1))
    /// >>> len(mat.taxels), sorted(mat.fields)[:2]
    /// (341, ['mat', 'mat/r1_c1'])
    #[staticmethod]
    #[pyo3(signature = (rows, columns, pitch_m, *, name = "grid", order = "rows", regions = None))]
    fn grid(
        py: Python<'_>,
        rows: u32,
        columns: u32,
        pitch_m: PitchOfGrid,
        name: &str,
        order: &str,
        regions: Option<(u32, u32)>,
    ) -> PyResult<Self> {
        let (row_pitch_m, column_pitch_m) = match pitch_m {
            PitchOfGrid::Both(pitch) => (pitch, pitch),
            PitchOfGrid::Each(rows, columns) => (rows, columns),
        };
        let order = match order {
            "rows" => GridOrder::Rows,
            "columns" => GridOrder::Columns,
            other => return Err(usage(py, format!("there is no order `{other}`; it is rows or columns"))),
        };
        let regions = regions.map(|(rows, columns)| [rows, columns]);
        let grid =
            SheetGrid { row_pitch_m, column_pitch_m, order, regions, ..SheetGrid::new(rows, columns, row_pitch_m) };
        free(py, || {
            let authored = author_sheets(name, &[grid.sheet(name)?])?;
            Self::of_bytes(name, authored.file.to_glb()?)
        })
        .or_raise(py)
    }

    /// Writes it to `path` as .glb; a file that exists is replaced only with `force`.
    ///
    /// >>> import somatic_touch as st, tempfile, pathlib
    /// >>> path = pathlib.Path(tempfile.mkdtemp()) / "mat.glb"
    /// >>> st.Body.grid(4, 4, 0.01).save(path)
    /// >>> len(st.Body.load(path).taxels)
    /// 16
    #[pyo3(signature = (path, *, force = false))]
    fn save(&self, py: Python<'_>, path: PathBuf, force: bool) -> PyResult<()> {
        OutputPath::new(&path, force, &[]).and_then(|output| output.write(&self.bytes)).or_raise_of(py, &path)
    }

    /// Its name: that of the file, or of the bundled body.
    #[getter]
    fn name(&self) -> &str {
        &self.inner.name
    }

    /// The names of its links.
    #[getter]
    fn links(&self) -> Vec<&str> {
        self.inner.links.iter().map(|link| link.name.as_str()).collect()
    }

    /// What is odd about its file, a line each.
    #[getter]
    fn findings(&self) -> Vec<&str> {
        self.inner.findings.iter().map(String::as_str).collect()
    }

    /// Its sensors, an array of structures [taxels] by ascending id: `id`; `link`, an index into `links`; `position` and `normal`
    /// [3] in the link's frame, in metres; `place`, the position in the world with the body at rest; `area`, in m², 0 where unknown; `modality`.
    ///
    /// >>> import somatic_touch as st
    /// >>> taxels = st.Body.bundled("hand").taxels
    /// >>> taxels["id"][:3].tolist(), taxels["area"].dtype
    /// ([0, 1, 2], dtype('float64'))
    #[getter]
    fn taxels<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let taxels = &self.inner.taxels;
        let count = taxels.len();
        let place = |taxel: &somatic::body::Taxel| {
            self.inner.links[taxel.link].world_from_link().transform_point3(taxel.position_in_link).to_array()
        };
        let vectors = |of: &dyn Fn(&somatic::body::Taxel) -> [f64; 3]| {
            array(py, taxels.iter().flat_map(of).collect::<Vec<f64>>(), &[count, 3])
        };
        let fields = [
            ("id", "u4", 1, array(py, self.ids(), &[count])?),
            ("link", "i8", 1, array(py, taxels.iter().map(|taxel| taxel.link as i64).collect(), &[count])?),
            ("position", "f8", 3, vectors(&|taxel| taxel.position_in_link.to_array())?),
            ("normal", "f8", 3, vectors(&|taxel| taxel.normal_in_link.to_array())?),
            ("place", "f8", 3, vectors(&place)?),
            ("area", "f8", 1, array(py, taxels.iter().map(|taxel| taxel.area).collect(), &[count])?),
            ("modality", "u4", 1, array(py, taxels.iter().map(|taxel| taxel.modality.code()).collect(), &[count])?),
        ];
        structured(py, count, &fields)
    }

    /// Its fields by name.
    #[getter]
    fn fields<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let set = FieldSet::new(&self.inner).or_raise(py)?;
        let fields = PyDict::new(py);
        for field in &set.fields {
            let count = field.members.len();
            let members = || field.members.iter();
            let chart = field.chart.as_ref().ok();
            let uv =
                chart.map(|_| members().flat_map(|member| member.place.truncate().to_array()).collect::<Vec<f64>>());
            let made = PyField {
                name: field.name.clone(),
                parent: field.parent.map(|parent| set.fields[parent].name.clone()),
                anchor: field.anchor.map(|anchor| self.inner.links[anchor].name.clone()),
                chart: chart.map(|chart| format!("{:?}", chart.kind).to_lowercase()),
                distortion: chart.map(|chart| chart.distortion),
                taxels: array(py, members().map(|member| self.inner.taxels[member.taxel].id).collect(), &[count])?,
                weights: array(py, members().map(|member| member.weight).collect(), &[count])?,
                uv: uv.map(|uv| array(py, uv, &[count, 2])).transpose()?,
            };
            fields.set_item(&field.name, Bound::new(py, made)?)?;
        }
        Ok(fields)
    }

    /// The triangles of its surface in the body at rest, float64 [triangles, 3, 3], in metres.
    ///
    /// >>> import somatic_touch as st
    /// >>> st.Body.bundled("hand").triangles.shape[1:]
    /// (3, 3)
    #[getter]
    fn triangles(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        let triangles = self.inner.triangles_at_rest();
        let corners = triangles.iter().flat_map(|(_, corners)| corners.iter().flat_map(glam::DVec3::to_array));
        array(py, corners.collect::<Vec<f64>>(), &[triangles.len(), 3, 3])
    }

    fn __repr__(&self) -> String {
        let Body { name, taxels, fields, links, .. } = &*self.inner;
        let s = if links.len() == 1 { "" } else { "s" };
        format!("<Body {name}: {} taxels in {} fields on {} link{s}>", taxels.len(), fields.len(), links.len())
    }

    #[expect(clippy::type_complexity, reason = "pickle's own form: a function and its arguments")]
    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<(Bound<'py, PyAny>, (String, Vec<u8>))> {
        let body = slf.get();
        Ok((slf.get_type().getattr("_of_bytes")?, (body.inner.name.clone(), body.bytes.to_vec())))
    }

    #[staticmethod]
    #[pyo3(name = "_of_bytes")]
    fn unpickled(py: Python<'_>, name: &str, bytes: Vec<u8>) -> PyResult<Self> {
        Self::of_bytes(name, bytes).or_raise(py)
    }
}

/// From one sensor to the next: in both directions, or from row to row and from column to column.
#[derive(FromPyObject)]
pub(crate) enum PitchOfGrid {
    Both(f64),
    Each(f64, f64),
}
