//! `read`: what `somatic run` reads from files, as arrays.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};
use somatic::signal::Pose;
use somatic::source::Source;
use somatic::{Frame, RawValue};

use crate::arrays::{array, poses, times};
use crate::body::PyBody;
use crate::calibration::PyCalibration;
use crate::channels::{Channels, GivenChannel, count_of, names_of, numbers_of, taxels_of};
use crate::error::{OrRaise, usage, warn};
use crate::frame_values::values;
use crate::opening::{Keys, Opening, body_of, text_of};
use crate::stream::in_python;
use crate::threads::free;

/// Frames that are read until Ctrl-C is heard.
const FRAMES_BETWEEN: usize = 1 << 10;

/// Frames in memory, with the body and the calibration that come with them.
///
/// >>> import somatic_touch as st
/// >>> touch = st.read("hand")
/// >>> touch
/// <Recording bundled touch: 280 frames of 40 taxels in 5.58 s>
/// >>> engine = touch.engine({"outputs": ["total"]}, backend="cpu")
/// >>> engine.process(touch.t, touch.values)["total"].shape
/// (280, 13)
///
/// It can be pickled, with its body and calibration. Two are equal (`==`) if all that they have is the same to the bit.
#[pyclass(module = "somatic_touch", name = "Recording", frozen)]
pub(crate) struct PyRecording {
    pub(crate) name: String,
    pub(crate) frames: usize,
    /// Whose the values of a frame are.
    pub(crate) channels: Vec<u32>,
    pub(crate) t: Py<PyAny>,
    pub(crate) values: Py<PyAny>,
    mask: Py<PyAny>,
    pose: Py<PyDict>,
    pub(crate) body: Option<Py<PyBody>>,
    pub(crate) calibration: Option<Py<PyCalibration>>,
    /// Whether a calibration that is given replaces its own.
    is_simulated: bool,
    losses: Vec<String>,
    length_s: f64,
}

#[pymethods]
impl PyRecording {
    /// The times of its frames, float64 [frames], in seconds.
    #[getter]
    fn t(&self, py: Python<'_>) -> Py<PyAny> {
        self.t.clone_ref(py)
    }

    /// Raw values, float32 [frames, taxels], of taxels with three axes three each, as `channels` names them: NaN where faulty, and a NaN
    /// that `Engine.process` knows where missing.
    #[getter]
    fn values(&self, py: Python<'_>) -> Py<PyAny> {
        self.values.clone_ref(py)
    }

    /// Where a value is missing, bool [frames, taxels].
    #[getter]
    fn mask(&self, py: Python<'_>) -> Py<PyAny> {
        self.mask.clone_ref(py)
    }

    /// The ids of its taxels, in the order of the values; one with three axes is there three times.
    #[getter]
    fn taxels(&self) -> Vec<u32> {
        taxels_of(&self.channels)
    }

    /// The names of its values, in their order: a taxel's id, and of one with three axes `4.u` and `4.v` too.
    ///
    /// >>> import somatic_touch as st
    /// >>> st.read("hand").channels[:3]
    /// ['0', '1', '2']
    #[getter]
    fn channels(&self) -> Vec<String> {
        names_of(&self.channels)
    }

    /// By link its poses in the world (z up, x forward, y left), float64 [frames, 7]: x, y, z in metres, and a quaternion qx, qy, qz, qw.
    #[getter]
    fn pose(&self, py: Python<'_>) -> Py<PyDict> {
        self.pose.clone_ref(py)
    }

    /// The body that was given, or that comes with it.
    #[getter]
    fn body(&self, py: Python<'_>) -> Option<Py<PyBody>> {
        self.body.as_ref().map(|body| body.clone_ref(py))
    }

    /// The calibration that comes with it.
    #[getter]
    fn calibration(&self, py: Python<'_>) -> Option<Py<PyCalibration>> {
        self.calibration.as_ref().map(|calibration| calibration.clone_ref(py))
    }

    /// What of the file could not be read, a line each: a truncated row, a damaged part.
    #[getter]
    fn losses(&self) -> Vec<String> {
        self.losses.clone()
    }

    /// An engine for its body and its taxels, under its calibration. `calibration` is laid over that: keys that it has replace the
    /// recording's own, others stay, and a warning names those. A simulation's calibration is replaced.
    #[pyo3(signature = (scene = None, calibration = None, backend = None, *, batch = 256))]
    pub(crate) fn engine<'py>(
        &self,
        py: Python<'py>,
        scene: Option<&Bound<'py, PyAny>>,
        calibration: Option<Py<PyCalibration>>,
        backend: Option<&str>,
        batch: usize,
    ) -> PyResult<Bound<'py, PyAny>> {
        let Some(body) = &self.body else {
            return Err(usage(py, format!("{}: it has no body; read it with body=", self.name)));
        };
        let calibration = self.calibrated(py, calibration.as_ref().map(|given| given.bind(py)), body.bind(py).get())?;
        let keys = PyDict::new(py);
        keys.set_item("taxels", &self.channels)?;
        keys.set_item("batch", batch)?;
        let class = py.get_type::<crate::engine::PyEngine>();
        class.call((body, scene, calibration, backend), Some(&keys))
    }

    fn _repr_html_<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        in_python(slf.py(), "_html", "recording", (slf,))
    }

    fn __eq__(slf: &Bound<'_, Self>, other: &Bound<'_, PyAny>) -> PyResult<Py<PyAny>> {
        let py = slf.py();
        if !other.is_instance_of::<Self>() {
            return Ok(py.NotImplemented());
        }
        in_python(py, "_tables", "are_same_recordings", (slf, other)).map(Bound::unbind)
    }

    fn __copy__(slf: Py<Self>) -> Py<Self> {
        slf
    }

    fn __deepcopy__(slf: Py<Self>, _memo: &Bound<'_, PyDict>) -> Py<Self> {
        slf
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyTuple>)> {
        let (py, of) = (slf.py(), slf.get());
        let (name, channels, losses) = (of.name.clone(), of.channels.clone(), of.losses.clone());
        let (body, calibration) = (of.body(py), of.calibration(py));
        let parts = (name, channels, of.t(py), of.values(py), of.pose(py), body, calibration, of.is_simulated, losses);
        Ok((slf.get_type().getattr("_of_parts")?, parts.into_pyobject(py)?))
    }

    #[staticmethod]
    #[pyo3(name = "_of_parts")]
    #[expect(clippy::too_many_arguments, reason = "pickle's own form: a function and its arguments")]
    fn unpickled(
        py: Python<'_>,
        name: String,
        taxels: Vec<GivenChannel>,
        t: Bound<'_, PyAny>,
        values: Bound<'_, PyAny>,
        pose: Bound<'_, PyDict>,
        body: Option<Py<PyBody>>,
        calibration: Option<Py<PyCalibration>>,
        is_simulated: bool,
        losses: Vec<String>,
    ) -> PyResult<Self> {
        let t_s = times(&t)?.as_slice()?.to_vec();
        let channels = Channels::new(numbers_of(py, taxels)?);
        let values = self::values(&values, None, Some(t_s.len()), &channels)?;
        for poses in pose.values() {
            poses.call_method1("setflags", (false,))?;
        }
        let channels = channels.numbers().to_vec();
        let about = About { name, channels, body, calibration, is_simulated, losses };
        Self::new(py, t_s, values.slice(), pose.unbind(), about)
    }

    fn __len__(&self) -> usize {
        self.frames
    }

    fn __repr__(&self) -> String {
        format!(
            "<Recording {}: {} frames of {} taxels in {:.2} s>",
            self.name,
            self.frames,
            count_of(&self.channels),
            self.length_s
        )
    }
}

impl PyRecording {
    fn new(py: Python<'_>, t_s: Vec<f64>, values: &[RawValue], pose: Py<PyDict>, about: About) -> PyResult<Self> {
        let About { name, channels, body, calibration, is_simulated, losses } = about;
        let shape = [t_s.len(), channels.len()];
        let mask = values.iter().map(|value| value.is_missing()).collect();
        let length_s = t_s.last().zip(t_s.first()).map_or(0.0, |(last, first)| last - first);
        Ok(Self {
            name,
            frames: t_s.len(),
            t: array(py, t_s, &shape[..1])?,
            values: array(py, bytemuck::cast_slice::<_, f32>(values).to_vec(), &shape)?,
            mask: array(py, mask, &shape)?,
            channels,
            pose,
            body,
            calibration,
            is_simulated,
            losses,
            length_s,
        })
    }

    /// The same with the losses from number `known` on; `known` becomes their total.
    pub(crate) fn with_losses_from(mut self, known: &mut usize) -> Self {
        let all = self.losses.len();
        self.losses = self.losses.split_off((*known).min(all));
        *known = all;
        self
    }

    /// Its first frames, up to `most`.
    pub(crate) fn first_frames(&self, py: Python<'_>, most: usize) -> PyResult<Vec<Frame>> {
        let t_s = times(self.t.bind(py))?.as_slice()?.to_vec();
        let (channels, width) = (Channels::new(self.channels.clone()), self.channels.len());
        let held = values(self.values.bind(py), None, Some(t_s.len()), &channels)?;
        let placed = poses(self.pose.bind(py), t_s.len())?;
        let frame = |(index, &t_s): (usize, &f64)| Frame {
            t_s,
            values: held.slice()[index * width..][..width].to_vec(),
            pose: placed.iter().map(|(link, poses)| (link.clone(), poses[index])).collect(),
            ..Frame::default()
        };
        Ok(t_s.iter().enumerate().take(most).map(frame).collect())
    }

    /// The calibration that holds for it on `body`: its own, with `given` laid over it.
    pub(crate) fn calibrated(
        &self,
        py: Python<'_>,
        given: Option<&Bound<'_, PyCalibration>>,
        body: &PyBody,
    ) -> PyResult<Option<Py<PyCalibration>>> {
        Ok(match (given, &self.calibration) {
            (Some(given), Some(own)) if !self.is_simulated => {
                let (both, lines) = given.get().over(own.get(), &self.name, body).or_raise(py)?;
                warn(py, lines)?;
                Some(Py::new(py, both)?)
            }
            (Some(given), _) => Some(given.clone().unbind()),
            (None, own) => own.as_ref().map(|own| own.clone_ref(py)),
        })
    }
}

/// What a source delivered.
#[derive(Default)]
pub(crate) struct Frames {
    t_s: Vec<f64>,
    values: Vec<RawValue>,
    /// By link: of each frame its pose, missing ones NaN.
    poses: BTreeMap<String, Vec<f64>>,
}

impl Frames {
    pub(crate) fn push(&mut self, frame: &Frame) {
        let index = self.t_s.len();
        self.t_s.push(frame.t_s);
        self.values.extend_from_slice(&frame.values);
        for (link, Pose { translation, rotation }) in &frame.pose {
            let poses = self.poses.entry(link.clone()).or_default();
            poses.resize(7 * index, f64::NAN);
            poses.extend(translation.to_array().into_iter().chain(rotation.to_array()));
        }
    }

    pub(crate) fn finish(
        self,
        py: Python<'_>,
        name: String,
        source: &dyn Source,
        body: Option<Py<PyBody>>,
        calibration: Option<Py<PyCalibration>>,
        is_simulated: bool,
    ) -> PyResult<PyRecording> {
        let frames = self.t_s.len();
        let pose = PyDict::new(py);
        for (link, mut poses) in self.poses {
            poses.resize(7 * frames, f64::NAN);
            pose.set_item(link, array(py, poses, &[frames, 7])?)?;
        }
        let (channels, losses) = (source.taxels().to_vec(), source.losses());
        let about = About { name, channels, body, calibration, is_simulated, losses };
        PyRecording::new(py, self.t_s, &self.values, pose.unbind(), about)
    }

    pub(crate) fn len(&self) -> usize {
        self.t_s.len()
    }
}

/// What a recording has beside its frames.
struct About {
    name: String,
    channels: Vec<u32>,
    body: Option<Py<PyBody>>,
    calibration: Option<Py<PyCalibration>>,
    is_simulated: bool,
    losses: Vec<String>,
}

/// All frames of `source`; Ctrl-C ends it.
fn gather(py: Python<'_>, source: &mut (dyn Source + Send), file: &Path) -> PyResult<Frames> {
    let mut frames = Frames::default();
    let mut frame = Frame::missing(0.0, source.taxels().len());
    loop {
        let read = free(py, || {
            for _ in 0..FRAMES_BETWEEN {
                if !source.next_frame(&mut frame)? {
                    return Ok(false);
                }
                frames.push(&frame);
            }
            Ok(true)
        });
        if !read.or_raise_of(py, file)? {
            return Ok(frames);
        }
        py.check_signals()?;
    }
}

/// Reads a recording from a file: CSV, MCAP, or a pressure system's export, as `somatic run --source` does.
///
/// `source` is a path, or a text such as `csv:FILE` and `mcap:FILE`; 'hand' and 'sensing-hand' are the bundled touches. `body` is the
/// robot, for recordings that bring none: a `Body`, or the name of a file or of a bundled one. `from_s` and `to_s` take a part, in seconds
/// after its start. Of an HDF5 file `dataset` is the path of the values, such as 'tactile/left', and `time` that of their times; h5py reads
/// it. With `skip_bad` bad rows of a CSV, an export or a bag are skipped and counted in `losses`; else the first is an error. `map` is a
/// TOML file, or a name such as 'dex3', that says which arrays of messages are sensors. The other keywords are those of
/// docs/reference/exports.md.
///
/// >>> import somatic_touch as st
/// >>> st.read("no-such.csv")
/// Traceback (most recent call last):
///     ...
/// somatic_touch.InputError: no-such.csv: no such file or directory
#[pyfunction]
#[pyo3(signature = (source, *, body = None, from_s = None, to_s = None, rate_hz = None, format = None, grid = None, pitch = None, unit = None, layout = None, skip_bad = false, map = None, dataset = None, time = None))]
#[expect(clippy::too_many_arguments, reason = "they are keywords")]
pub(crate) fn read(
    py: Python<'_>,
    source: &Bound<'_, PyAny>,
    body: Option<&Bound<'_, PyAny>>,
    from_s: Option<f64>,
    to_s: Option<f64>,
    rate_hz: Option<f64>,
    format: Option<&str>,
    grid: Option<&str>,
    pitch: Option<&str>,
    unit: Option<&str>,
    layout: Option<PathBuf>,
    skip_bad: bool,
    map: Option<&str>,
    dataset: Option<&str>,
    time: Option<&str>,
) -> PyResult<Py<PyRecording>> {
    let text = text_of(source)?;
    let ending = Path::new(&text).extension().map(|ending| ending.to_string_lossy().to_lowercase());
    if matches!(ending.as_deref(), Some("h5" | "hdf5")) {
        if format.or(grid).or(pitch).or(unit).is_some() || layout.is_some() {
            return Err(usage(
                py,
                format!("{text}: format, grid, pitch, unit and layout are for exports; leave them out"),
            ));
        }
        let body = body.map(|body| body_of(py, body)).transpose()?;
        let read = in_python(py, "_hdf5", "read", (text, dataset, time, rate_hz, body, from_s, to_s))?;
        return Ok(read.cast_into::<PyRecording>()?.unbind());
    }
    if dataset.or(time).is_some() {
        return Err(usage(py, format!("{text}: dataset and time are for HDF5 (.h5, .hdf5); leave them out")));
    }
    let keys = Keys { body, from_s, to_s, rate_hz, format, grid, pitch, unit, layout, skip_bad, map };
    let mut opened = Opening::new(py, source, keys)?;
    let frames = gather(py, &mut *opened.source, &opened.file)?;
    Py::new(py, opened.recording(py, frames)?)
}
