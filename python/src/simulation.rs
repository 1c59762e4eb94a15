//! `simulate`: touches whose truth is known.

use std::path::{Path, PathBuf};

use pyo3::prelude::*;
use somatic::source::{SimulatedSource, Source, Truth};
use somatic::{Error, bundled};

use crate::arrays::{array, structured};
use crate::body::PyBody;
use crate::calibration::PyCalibration;
use crate::error::{OrRaise, warn};
use crate::recording::{Frames, PyRecording};
use crate::threads::free;

/// Frames that are simulated until Ctrl-C is heard.
const FRAMES_BETWEEN: usize = 1 << 6;

/// A simulated touch: its frames, and what is true of them.
#[pyclass(module = "somatic_touch", name = "Simulation", frozen)]
pub(crate) struct PySimulation {
    recording: Py<PyRecording>,
    truth: Py<PyAny>,
    forces: Py<PyAny>,
}

/// What is true of a frame.
struct Row {
    frame: usize,
    truth: Truth,
}

impl PySimulation {
    fn from_source(py: Python<'_>, name: String, mut source: SimulatedSource, body: PyBody) -> PyResult<Self> {
        let (mut rows, mut forces, mut index) = (Vec::new(), Vec::new(), 0);
        let mut frame = somatic::Frame::missing(0.0, source.taxels().len());
        let mut frames = Frames::default();
        loop {
            let computed = free(py, || {
                for _ in 0..FRAMES_BETWEEN {
                    if !source.next_frame(&mut frame)? {
                        return Ok(false);
                    }
                    frames.push(&frame);
                    rows.extend(source.truth().iter().map(|truth| Row { frame: index, truth: truth.clone() }));
                    forces.extend_from_slice(source.forces_newton());
                    index += 1;
                }
                Ok(true)
            });
            if !computed.or_raise(py)? {
                break;
            }
            py.check_signals()?;
        }
        let calibration = PyCalibration::of_text(&source.calibration(), &body).or_raise(py)?;
        let pressed = source.forces_newton().len();
        let recording =
            frames.finish(py, name, &source, Some(Py::new(py, body)?), Some(Py::new(py, calibration)?), true)?;
        Ok(Self {
            recording: Py::new(py, recording)?,
            truth: truth(py, &rows)?,
            forces: array(py, forces, &[index, pressed])?,
        })
    }
}

/// The rows as an array of structures.
fn truth(py: Python<'_>, rows: &[Row]) -> PyResult<Py<PyAny>> {
    let count = rows.len();
    let numbers = |width: usize, of: &dyn Fn(&Truth) -> Vec<f64>| {
        let shape = [count, width];
        array(py, rows.iter().flat_map(|row| of(&row.truth)).collect(), if width == 1 { &shape[..1] } else { &shape })
    };
    let whole = |of: &dyn Fn(&Row) -> usize| array(py, rows.iter().map(|row| of(row) as i64).collect(), &[count]);
    let words = |of: &dyn Fn(&Truth) -> String| -> PyResult<Py<PyAny>> {
        let list: Vec<String> = rows.iter().map(|row| of(&row.truth)).collect();
        Ok(list.into_pyobject(py)?.into_any().unbind())
    };
    let nan = f64::NAN;
    let vector = |vector: Option<[f64; 3]>| vector.unwrap_or([nan; 3]).to_vec();
    let fields = [
        ("frame", "i8", 1, whole(&|row| row.frame)?),
        ("touch", "i8", 1, whole(&|row| row.truth.touch)?),
        ("name", "U64", 1, words(&|truth| truth.name.clone())?),
        ("link", "U64", 1, words(&|truth| truth.link.clone())?),
        ("field", "U64", 1, words(&|truth| truth.field.clone().unwrap_or_default())?),
        ("position", "f8", 3, numbers(3, &|truth| truth.position_in_link.to_array().to_vec())?),
        ("normal", "f8", 3, numbers(3, &|truth| truth.normal_in_link.to_array().to_vec())?),
        ("uv", "f8", 2, numbers(2, &|truth| truth.uv.unwrap_or([nan; 2]).to_vec())?),
        ("angle", "f8", 1, numbers(1, &|truth| vec![truth.angle.unwrap_or(nan)])?),
        ("velocity", "f8", 3, numbers(3, &|truth| vector(truth.velocity_in_link.map(Into::into)))?),
        ("velocity_uv", "f8", 2, numbers(2, &|truth| truth.velocity_uv.unwrap_or([nan; 2]).to_vec())?),
        ("speed", "f8", 1, numbers(1, &|truth| vec![truth.speed.unwrap_or(nan)])?),
        ("force", "f8", 1, numbers(1, &|truth| vec![truth.force_newton])?),
        ("direction", "f8", 3, numbers(3, &|truth| vector(truth.direction_in_link.map(Into::into)))?),
        ("principal_axis", "f8", 3, numbers(3, &|truth| vector(truth.principal_axis_in_link.map(Into::into)))?),
        ("depth", "f8", 1, numbers(1, &|truth| vec![truth.depth_m.unwrap_or(nan)])?),
        ("shear", "f8", 3, numbers(3, &|truth| vector(truth.shear_in_link.map(Into::into)))?),
        ("shear_uv", "f8", 2, numbers(2, &|truth| truth.shear_uv.unwrap_or([nan; 2]).to_vec())?),
        ("torsion", "f8", 1, numbers(1, &|truth| vec![truth.torsion.unwrap_or(nan)])?),
        ("slips", "f8", 1, numbers(1, &|truth| vec![truth.slips.map_or(nan, |slips| u8::from(slips).into())])?),
        ("gap", "f8", 1, numbers(1, &|truth| vec![truth.gap_m.unwrap_or(nan)])?),
        ("celsius", "f8", 1, numbers(1, &|truth| vec![truth.celsius.unwrap_or(nan)])?),
    ];
    structured(py, count, &fields).map(Bound::unbind)
}

#[pymethods]
impl PySimulation {
    /// Its frames, body and calibration.
    #[getter]
    fn recording(&self, py: Python<'_>) -> Py<PyRecording> {
        self.recording.clone_ref(py)
    }

    /// What is true, an array of structures, one for each touch that presses in a frame: `frame`, `touch`, `name`, `link`, `field`;
    /// `position` and `normal` [3] in the link's frame and `uv` [2] in the field's chart, in metres; `angle` along, in rad;
    /// `velocity` [3], `velocity_uv` [2] and `speed`, in m/s; `force`, in N;
    /// of touches of the whole body `direction` and `principal_axis` [3], unit vectors in the link's frame, and `depth`, in metres;
    /// of those with friction on taxels with three axes `shear` [3] in the link's frame and `shear_uv` [2], in N, `torsion`, in N m,
    /// and `slips`, 0 or 1; `gap`, in metres, above the skin, and the indenter's `celsius`. What is not defined is NaN.
    #[getter]
    fn truth(&self, py: Python<'_>) -> Py<PyAny> {
        self.truth.clone_ref(py)
    }

    /// The force along the normal on each taxel of pressure or force before its sensor, float64 [frames, taxels], in N.
    #[getter]
    fn forces(&self, py: Python<'_>) -> Py<PyAny> {
        self.forces.clone_ref(py)
    }

    fn __len__(&self) -> usize {
        self.recording.get().frames
    }

    fn __repr__(&self) -> String {
        format!("<Simulation {}: {} frames>", self.recording.get().name, self.recording.get().frames)
    }
}

/// Simulates the touches in a TOML file, as docs/reference/simulation.md describes it; its truth is in `.truth`.
///
/// `simulation` is the file's path or its text. `body` replaces the body that it names.
///
/// >>> import somatic_touch as st
/// >>> ball = """
/// ... body = "hand"
/// ... rate_hz = 50
/// ... duration_s = 1
/// ... [[touch]]
/// ... on = "hand/back"
/// ... indenter = "ball"
/// ... radius_m = 0.008
/// ... path = [[0, 0.002]]
/// ... times_s = [0]
/// ... force_newton = [[0, 4], [1, 4]]
/// ... """
/// >>> touch = st.simulate(ball)
/// >>> len(touch), touch.truth["uv"][-1].tolist(), float(touch.truth["force"][-1])
/// (50, [0.0, 0.002], 4.0)
#[pyfunction]
#[pyo3(signature = (simulation, *, body = None, seed = None))]
pub(crate) fn simulate(
    py: Python<'_>,
    simulation: &Bound<'_, PyAny>,
    body: Option<&PyBody>,
    seed: Option<u64>,
) -> PyResult<PySimulation> {
    let text = simulation.extract::<String>();
    let path: PathBuf = simulation.extract().unwrap_or_default();
    let is_text = text.as_ref().is_ok_and(|text| text.contains(['\n', '=']) && !path.is_file());
    let opened = match (&text, is_text, body) {
        (Ok(text), true, None) => SimulatedSource::from_text("simulation", text, Path::new("")),
        (Ok(text), true, Some(body)) => SimulatedSource::on_body("simulation", text, (*body.inner).clone()),
        (_, _, None) => SimulatedSource::open(&path),
        (_, _, Some(body)) => std::fs::read_to_string(&path)
            .map_err(|e| Error::io(&path, &e))
            .and_then(|text| SimulatedSource::on_body(&path.display().to_string(), &text, (*body.inner).clone())),
    };
    let mut source = if is_text { opened.or_raise(py)? } else { opened.or_raise_of(py, &path)? };
    warn(py, source.notices())?;
    if let Some(seed) = seed {
        source.reseed(seed);
    }
    let name = if is_text { "simulation".to_owned() } else { path.display().to_string() };
    let body = body_of(&source, &path, body).or_raise(py)?;
    PySimulation::from_source(py, name, source, body)
}

/// The body that `source` is on: `given`, a bundled one, or the file that the simulation at `path` names.
pub(crate) fn body_of(source: &SimulatedSource, path: &Path, given: Option<&PyBody>) -> somatic::Result<PyBody> {
    if let Some(given) = given {
        return Ok(given.clone());
    }
    let name = &source.body().name;
    match bundled::body(name) {
        Some(bytes) => PyBody::of_bytes(name, bytes.to_vec()),
        None => SimulatedSource::files(path)
            .get(1)
            .map_or_else(|| PyBody::of_file(Path::new(name)), |file| PyBody::of_file(file)),
    }
}
