//! `Body` and its fields.

use std::path::PathBuf;
use std::sync::Arc;

use pyo3::prelude::*;
use pyo3::types::PyDict;
use somatic::field::FieldSet;
use somatic::internal::body::Original;
use somatic::internal::error::suggestion;
use somatic::internal::signal::Channel;
use somatic::signal::Pose;
use somatic::{Body, OutputPath, bundled};

use crate::array_body::{Arrays, Names};
use crate::arrays::{array, pose_frames, poses};
use crate::body_tables;
use crate::channels::names_of;
use crate::error::{OrRaise, unknown_name, usage};
use crate::field::{PitchOfGrid, PyField, pitch_of};
use crate::kinematics::Positions;
use crate::same::{hash_of, same};
use crate::sheet::Sheet;
use crate::stream::in_python;
use crate::threads::free;

/// A robot's shape, its sensors and its fields.
///
/// Threads may share one. Two of the same name and the same file are equal (`==`).
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

    /// The channels of its frames: every taxel's own, then the tangential ones.
    pub(crate) fn channels(&self) -> Vec<u32> {
        Channel::all_of(&self.inner)
    }

    pub(crate) fn bundled_or_file(name: &str) -> somatic::Result<Self> {
        match bundled::body(name) {
            Some(bytes) if !std::path::Path::new(name).is_file() => Self::of_bytes(name, bytes.to_vec()),
            _ => Self::of_file(std::path::Path::new(name)),
        }
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

    /// One of the bodies that come with the package: 'hand', 'sensing-hand', 'mat' or 'humanoid'.
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
    /// or with `order="columns"` along each column. `cells`, bool [rows, columns], is False where there is no sensor; ids stay as
    /// in the full grid.
    ///
    /// >>> import somatic_touch as st
    /// >>> mat = st.Body.grid(31, 11, 0.0086, name="mat", regions=(3, 1))
    /// >>> len(mat.taxels), sorted(mat.fields)[:2]
    /// (341, ['mat', 'mat/r1_c1'])
    /// >>> st.Body.grid(2, 2, 0.01, cells=[[True, False], [True, True]]).taxels["id"].tolist()
    /// [0, 2, 3]
    #[staticmethod]
    #[pyo3(signature = (rows, columns, pitch_m, *, name = "grid", order = "rows", regions = None, cells = None))]
    #[expect(clippy::too_many_arguments, reason = "they are keywords")]
    fn grid(
        py: Python<'_>,
        rows: u32,
        columns: u32,
        #[pyo3(from_py_with = pitch_of)] pitch_m: PitchOfGrid,
        name: &str,
        order: &str,
        regions: Option<(u32, u32)>,
        cells: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        Sheet { size: [rows, columns], pitch_m, name, order, regions, cells }.body(py)
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
    /// [3] in the link's frame, in metres; `place`, the position in the world with the body at rest; `area`, in m², 0 where unknown;
    /// `modality`, what it measures: 'pressure', 'force3' (three axes), 'temperature' or 'proximity'; and, if any has three axes,
    /// `tangent` [3], the direction t of its second value in the link's frame (the third is along n × t), of others NaN.
    ///
    /// It is a table as it is: `pandas.DataFrame(body.taxels)` and `polars.DataFrame(body.taxels)` have vectors as columns
    /// `position_x`, `position_y`, `position_z`, and so on.
    ///
    /// >>> import somatic_touch as st
    /// >>> taxels = st.Body.bundled("hand").taxels
    /// >>> taxels["id"][:3].tolist(), taxels["area"].dtype, str(taxels["modality"][0])
    /// ([0, 1, 2], dtype('float64'), 'pressure')
    #[getter]
    fn taxels<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        body_tables::taxels(py, &self.inner)
    }

    /// The names of a frame's values, in the order in which `Engine.process` takes them: of each taxel its id, by ascending id, then of
    /// those with three axes `4.u`, their forces along t, and `4.v`, along n × t.
    ///
    /// >>> import somatic_touch as st
    /// >>> st.Body.grid(1, 3, 0.01).channels
    /// ['0', '1', '2']
    #[getter(channels)]
    fn channel_names(&self) -> Vec<String> {
        names_of(&self.channels())
    }

    /// Its fields by name.
    #[getter]
    fn fields<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let set = FieldSet::new(&self.inner).or_raise(py)?;
        let fields = PyDict::new(py);
        for field in &set.fields {
            let made = PyField::from_field(py, &self.inner, &set, field)?;
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

    /// Its surface in the world with the body at rest: vertices, float64 [vertices, 3], in metres, and faces, uint32 [faces, 3], indices
    /// of vertices, counter-clockwise seen from outside. Without a surface both are empty.
    ///
    /// >>> import somatic_touch as st
    /// >>> vertices, faces = st.Body.bundled("hand").surface
    /// >>> vertices.shape[1], faces.shape[1], int(faces.max()) < len(vertices)
    /// (3, 3, True)
    #[getter]
    fn surface(&self, py: Python<'_>) -> PyResult<(Py<PyAny>, Py<PyAny>)> {
        body_tables::surface(py, &self.inner)
    }

    /// A body of arrays, in metres, in the world's axes: z up, x forward, y left.
    ///
    /// Parameters
    /// ----------
    /// positions, normals : array_like, [taxels, 3]
    ///     Of each taxel where it is and which way it points, outwards, in the frame of its link. Normals need not have length 1.
    /// link : str or sequence of str
    ///     The link of all taxels, or of each. Links move each by itself, and at rest all are at the origin.
    /// ids : array_like of int, [taxels], optional
    ///     By default 0, 1, 2, …
    /// areas : float or array_like, [taxels], optional
    ///     In m²; unknown by default, and with that what needs one, such as `force` of pressures.
    /// modality : str or sequence of str
    ///     What all taxels measure, or each: 'pressure', 'force3' (force along three axes), 'temperature' or 'proximity'.
    /// tangents : array_like, [taxels, 3], optional
    ///     Of taxels with three axes the direction t of their second value, in the frame of their link; the third is along n × t. As much
    ///     of it as is at right angles to the normal counts. NaN, and by default all: the link's x, as far as it is tangential.
    /// surface : (vertices, faces) or dict of link to (vertices, faces), optional
    ///     Triangles, float [vertices, 3] and int [faces, 3], counter-clockwise seen from outside; without a link that of the first one.
    /// name : str
    ///     Of the body, and of its link unless that has a name.
    ///
    /// Returns
    /// -------
    /// Body
    ///     With a field for each link, or those that `author` would make. A file has numbers in single precision, so this one has them too.
    ///
    /// Raises
    /// ------
    /// UsageError
    ///     Where shapes do not fit, a number is not finite, a normal is zero, a tangent is along it, an id is there twice, or a face has no
    ///     vertex.
    ///
    /// Examples
    /// --------
    /// >>> import numpy as np
    /// >>> import somatic_touch as st
    /// >>> x, y = np.meshgrid(np.arange(4) * 0.01, np.arange(3) * 0.01)
    /// >>> positions = np.stack([x.ravel(), y.ravel(), np.zeros(12)], axis=1)
    /// >>> st.Body.from_arrays(positions, np.tile([0, 0, 1], (12, 1)), areas=1e-4, name="pad")
    /// <Body pad: 12 taxels in 1 field on 1 link>
    /// >>> st.Body.from_arrays(positions[:2], [[0, 0, 1]] * 2, modality="force3", tangents=[[0, 1, 0]] * 2).taxels["tangent"].tolist()
    /// [[0.0, 1.0, 0.0], [0.0, 1.0, 0.0]]
    #[staticmethod]
    #[pyo3(signature = (positions, normals, *, link = None, ids = None, areas = None, modality = None, tangents = None, surface = None, name = "skin"))]
    #[expect(clippy::too_many_arguments, reason = "they are keywords")]
    fn from_arrays(
        py: Python<'_>,
        positions: &Bound<'_, PyAny>,
        normals: &Bound<'_, PyAny>,
        link: Option<Names>,
        ids: Option<Vec<u32>>,
        areas: Option<&Bound<'_, PyAny>>,
        modality: Option<Names>,
        tangents: Option<&Bound<'_, PyAny>>,
        surface: Option<&Bound<'_, PyAny>>,
        name: &str,
    ) -> PyResult<Self> {
        let parts = Arrays { positions, normals, link, ids, areas, modality, tangents, surface }.body(py, name)?;
        free(py, || Self::of_bytes(name, parts.to_glb(name)?)).or_raise(py)
    }

    /// The joints that move on their own, by name: `link`, which each moves; `kind`, 'revolute', 'continuous' or 'prismatic'; `unit` of
    /// its positions, 'rad' or 'm'; and `limits`, the least and the greatest position, or None. A body that was made from a URDF has them.
    ///
    /// >>> import somatic_touch as st
    /// >>> st.Body.bundled("hand").joints
    /// {}
    #[getter]
    fn joints<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        body_tables::joints(py, &self.inner)
    }

    /// Where links are, from the positions of joints: what `Engine.process` takes as `pose`.
    ///
    /// Parameters
    /// ----------
    /// joints : dict of str to float or array_like, [frames]
    ///     By joint its position in rad or m, of all frames or of each. At 0 a link is where the body has it at rest. Joints that follow
    ///     others are left out.
    /// pose : dict of str to array_like, [7] or [frames, 7], optional
    ///     Poses of links that are known otherwise, such as a floating base: links below them start from there. Without it roots
    ///     are where the body has them at rest.
    ///
    /// Returns
    /// -------
    /// dict of str to numpy.ndarray
    ///     By link float64 [7], or [frames, 7] where any position or pose has frames: x, y, z in the world, in metres, and a quaternion
    ///     qx, qy, qz, qw. Links below a joint without a position are not in it.
    ///
    /// Examples
    /// --------
    /// >>> import somatic_touch as st
    /// >>> poses = st.Body.bundled("hand").forward({}, {"hand": [1, 2, 3, 0, 0, 0, 1]})
    /// >>> poses["hand"].tolist()
    /// [1.0, 2.0, 3.0, 0.0, 0.0, 0.0, 1.0]
    #[pyo3(signature = (joints, pose = None))]
    fn forward<'py>(
        &self,
        py: Python<'py>,
        joints: &Bound<'py, PyAny>,
        pose: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let known = pose.map(pose_frames).transpose()?.flatten();
        let (positions, frames) = Positions::new(joints, &self.inner, known)?;
        let count = frames.unwrap_or(1);
        let given = pose.map(|pose| poses(pose, count)).transpose()?.unwrap_or_default();
        for (link, _) in &given {
            if self.inner.link_index(link).is_none() {
                let near = suggestion(link, self.inner.links.iter().map(|link| link.name.as_str()));
                return Err(unknown_name(py, format!("pose: there is no link `{link}`; {near}")));
            }
        }
        let made = PyDict::new(py);
        for (link, poses) in positions.poses(&self.inner, count, &given) {
            let numbers = poses.iter().flat_map(|Pose { translation, rotation }| {
                translation.to_array().into_iter().chain(rotation.to_array())
            });
            let shape = [count, 7];
            made.set_item(link, array(py, numbers.collect(), if frames.is_some() { &shape } else { &shape[1..] })?)?;
        }
        Ok(made)
    }

    /// Draws its taxels at rest, in the world, with its surface, and gives matplotlib's axes.
    ///
    /// Parameters
    /// ----------
    /// values : array_like, [taxels] or [taxels, 3], optional
    ///     A number for each taxel by ascending id, which is its colour; hollow where it is NaN. Without it colours are of links. Three numbers
    ///     are forces along the normal, which is the colour, and along t and n × t, which are an arrow.
    /// ax : mpl_toolkits.mplot3d.Axes3D, optional
    ///     Where to draw; by default in a new figure.
    /// surface : bool
    ///     Whether to draw triangles: at most 20,000, of more every second or third, and so on.
    /// unit : str, optional
    ///     What the values are, beside the scale of colours.
    /// letter : {'sustained', 'shear', 'temperature', 'proximity'}, optional
    ///     Draws values of the taxels that this letter reads alone, others small and grey: temperatures from blue over white, which is their
    ///     median, to red; distances dark where something is near. By default that of the body's taxels, if they are of one kind.
    ///
    /// Returns
    /// -------
    /// mpl_toolkits.mplot3d.Axes3D
    ///
    /// Examples
    /// --------
    /// >>> import matplotlib
    /// >>> matplotlib.use("Agg")
    /// >>> import somatic_touch as st
    /// >>> st.Body.bundled("hand").plot().get_zlabel()
    /// 'z, up [m]'
    #[pyo3(signature = (values = None, *, ax = None, surface = true, unit = None, letter = None))]
    fn plot<'py>(
        slf: &Bound<'py, Self>,
        values: Option<Bound<'py, PyAny>>,
        ax: Option<Bound<'py, PyAny>>,
        surface: bool,
        unit: Option<&str>,
        letter: Option<&str>,
    ) -> PyResult<Bound<'py, PyAny>> {
        in_python(slf.py(), "_plots", "body", (slf, values, ax, surface, unit, letter))
    }

    /// Vectors in the frames of taxels' links, [taxels, 3], in the world with the body at rest. For pictures.
    fn _at_rest(&self, py: Python<'_>, vectors: &Bound<'_, PyAny>) -> PyResult<Py<PyAny>> {
        body_tables::at_rest(py, &self.inner, vectors)
    }

    fn _repr_html_<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        in_python(slf.py(), "_html", "body", (slf,))
    }

    fn __eq__(&self, py: Python<'_>, other: &Bound<'_, PyAny>) -> PyResult<Py<PyAny>> {
        same(py, other, |other: &Self| self.inner.name == other.inner.name && self.bytes == other.bytes)
    }

    fn __hash__(&self) -> u64 {
        hash_of(&(&self.inner.name, &*self.bytes))
    }

    fn __copy__(slf: Py<Self>) -> Py<Self> {
        slf
    }

    fn __deepcopy__(slf: Py<Self>, _memo: &Bound<'_, PyDict>) -> Py<Self> {
        slf
    }

    fn __repr__(&self) -> String {
        let Body { name, taxels, fields, links, .. } = &*self.inner;
        let s = |count: usize| if count == 1 { "" } else { "s" };
        let (fields, links) = (fields.len(), links.len());
        format!("<Body {name}: {} taxels in {fields} field{} on {links} link{}>", taxels.len(), s(fields), s(links))
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
