//! `open`: a recording in stretches.

use std::path::PathBuf;
use std::sync::{Mutex, MutexGuard, PoisonError};

use pyo3::prelude::*;
use somatic::Frame;

use crate::body::PyBody;
use crate::calibration::PyCalibration;
use crate::channels::{count_of, names_of, taxels_of};
use crate::error::{OrRaise, stays_here, usage};
use crate::opening::{Keys, Opening};
use crate::progress::Progress;
use crate::recording::{Frames, PyRecording};
use crate::threads::free;

/// Frames that are read until Ctrl-C is heard.
const FRAMES_BETWEEN: usize = 1 << 10;
/// Values of a part, at most: 64 MiB.
const MOST_VALUES: usize = 1 << 24;

/// A recording that is read in stretches, from its first frame to its last: a loop over it has a `Recording` for each.
///
/// Memory has one of them, however long the file is: as many seconds as were asked for, and 64 MiB of values at most. An engine goes on
/// from one to the next, so that percepts are those of the whole. It is made by `open`, and closed by `with` or at its end.
///
/// >>> import somatic_touch as st
/// >>> with st.open("hand", seconds=2) as parts:
/// ...     engine = parts.engine({"outputs": ["total"]}, backend="cpu")
/// ...     [engine.process(part.t, part.values)["total"].shape for part in parts]
/// [(100, 13), (100, 13), (80, 13)]
#[pyclass(module = "somatic_touch", name = "Parts", frozen)]
pub(crate) struct PyParts {
    state: Mutex<Option<Reading>>,
    /// Without frames: what engines are made by.
    about: Py<PyRecording>,
    seconds: f64,
    losses: Mutex<Vec<String>>,
}

struct Reading {
    opening: Opening,
    frame: Frame,
    /// Whether `frame` is the first of the next part.
    is_ahead: bool,
    /// The end of the next part, s, once a frame says where it is.
    end_s: Option<f64>,
    frames: usize,
    progress: Option<Progress>,
    losses: usize,
}

impl Reading {
    /// The frames of the next part; none where the recording ends.
    fn next(&mut self, py: Python<'_>, seconds: f64) -> PyResult<Frames> {
        let mut part = Frames::default();
        let most = (MOST_VALUES / self.opening.source.taxels().len().max(1)).max(1);
        loop {
            let read = free(py, || {
                for _ in 0..FRAMES_BETWEEN {
                    if !self.is_ahead && !self.opening.source.next_frame(&mut self.frame)? {
                        return Ok(false);
                    }
                    self.is_ahead = true;
                    let t_s = self.frame.t_s;
                    let end_s = *self.end_s.get_or_insert(t_s + seconds);
                    if part.len() >= most {
                        return Ok(false);
                    }
                    if t_s >= end_s {
                        if part.len() > 0 {
                            return Ok(false);
                        }
                        // After a gap: parts begin where they would have.
                        self.end_s = Some(end_s + seconds * (((t_s - end_s) / seconds).floor() + 1.0));
                    }
                    part.push(&self.frame);
                    self.is_ahead = false;
                }
                Ok(true)
            });
            if !read.or_raise_of(py, &self.opening.file)? {
                return Ok(part);
            }
            py.check_signals()?;
        }
    }
}

impl PyParts {
    fn lock(&self) -> MutexGuard<'_, Option<Reading>> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[pymethods]
impl PyParts {
    /// The ids of its taxels, in the order of the values; one with three axes is there three times.
    #[getter]
    fn taxels(&self) -> Vec<u32> {
        taxels_of(&self.about.get().channels)
    }

    /// The names of its values, in their order, as `Recording.channels`.
    #[getter]
    fn channels(&self) -> Vec<String> {
        names_of(&self.about.get().channels)
    }

    /// The body that was given, or that comes with it.
    #[getter]
    fn body(&self, py: Python<'_>) -> Option<Py<PyBody>> {
        self.about.get().body.as_ref().map(|body| body.clone_ref(py))
    }

    /// The calibration that comes with it.
    #[getter]
    fn calibration(&self, py: Python<'_>) -> Option<Py<PyCalibration>> {
        self.about.get().calibration.as_ref().map(|calibration| calibration.clone_ref(py))
    }

    /// What of the file could not be read so far, a line each. A part has those that were found while it was read.
    #[getter]
    fn losses(&self) -> Vec<String> {
        self.losses.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// An engine for its body and its taxels, under its calibration, as `Recording.engine` makes one.
    #[pyo3(signature = (scene = None, calibration = None, backend = None, *, batch = 256))]
    fn engine<'py>(
        &self,
        py: Python<'py>,
        scene: Option<&Bound<'py, PyAny>>,
        calibration: Option<Py<PyCalibration>>,
        backend: Option<&str>,
        batch: usize,
    ) -> PyResult<Bound<'py, PyAny>> {
        self.about.get().engine(py, scene, calibration, backend, batch)
    }

    /// Closes the file; a loop over it has ended.
    fn close(&self) {
        *self.lock() = None;
    }

    fn __iter__(slf: Py<Self>) -> Py<Self> {
        slf
    }

    fn __next__(&self, py: Python<'_>) -> PyResult<Option<PyRecording>> {
        // Not held while Python runs: another thread that asks meanwhile finds the end.
        let Some(mut reading) = self.lock().take() else { return Ok(None) };
        let frames = reading.next(py, self.seconds)?;
        *self.losses.lock().unwrap_or_else(PoisonError::into_inner) = reading.opening.source.losses();
        if frames.len() == 0 {
            return Ok(None);
        }
        reading.frames += frames.len();
        if let Some(progress) = &reading.progress {
            progress.tell(py, (reading.frames,))?;
        }
        let part = reading.opening.recording(py, frames)?;
        // Each loss is reported once, by its own part.
        let part = part.with_losses_from(&mut reading.losses);
        *self.lock() = Some(reading);
        Ok(Some(part))
    }

    fn __enter__(slf: Py<Self>) -> Py<Self> {
        slf
    }

    fn __exit__(&self, _kind: &Bound<'_, PyAny>, _raised: &Bound<'_, PyAny>, _traceback: &Bound<'_, PyAny>) {
        self.close();
    }

    fn __reduce__(&self) -> PyResult<()> {
        Err(stays_here("a file that is open cannot be pickled; send its path, and open it there"))
    }

    fn __repr__(&self) -> String {
        let PyRecording { name, channels, .. } = self.about.get();
        format!("<Parts of {name}: {} taxels, {} s each>", count_of(channels), self.seconds)
    }
}

/// Opens a recording to be read in stretches of `seconds`. Memory holds one stretch at a time.
///
/// Parameters
/// ----------
/// source : str or path
///     As for `read`, whose other keywords are taken too.
/// seconds : float
///     The length of a stretch. Stretches begin at its first frame and end before each multiple; one without frames is left out.
/// progress : bool or callable, optional
///     True shows a bar of tqdm, a function is called with the number of frames read.
///
/// Returns
/// -------
/// Parts
///     A loop over it has a `Recording` for each stretch, with the body and calibration of the whole.
///
/// Raises
/// ------
/// InputError
///     Where the file cannot be read: at once, or in the loop at the stretch that has the damage.
///
/// Examples
/// --------
/// >>> import somatic_touch as st
/// >>> [(len(part), float(part.t[0])) for part in st.open("hand", seconds=4)]
/// [(200, 0.0), (80, 4.0)]
#[pyfunction]
#[pyo3(signature = (source, *, seconds = 10.0, body = None, from_s = None, to_s = None, rate_hz = None, format = None, grid = None, pitch = None, unit = None, layout = None, skip_bad = false, map = None, progress = None))]
#[expect(clippy::too_many_arguments, reason = "they are keywords")]
pub(crate) fn open(
    py: Python<'_>,
    source: &Bound<'_, PyAny>,
    seconds: f64,
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
    progress: Option<Py<PyAny>>,
) -> PyResult<PyParts> {
    if !(seconds.is_finite() && seconds > 0.0) {
        return Err(usage(py, format!("seconds should be a positive number; this is {seconds}")));
    }
    let keys = Keys { body, from_s, to_s, rate_hz, format, grid, pitch, unit, layout, skip_bad, map };
    let opening = Opening::new(py, source, keys)?;
    let about = Py::new(py, opening.recording(py, Frames::default())?)?;
    let progress = Progress::new(py, progress, None, "frames")?;
    let frame = Frame::missing(0.0, opening.source.taxels().len());
    let reading = Reading { opening, frame, is_ahead: false, end_s: None, frames: 0, progress, losses: 0 };
    Ok(PyParts { state: Mutex::new(Some(reading)), about, seconds, losses: Mutex::default() })
}
