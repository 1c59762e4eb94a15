//! `Engine`: frames in, percepts out, without Python's lock.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use pyo3::exceptions::PyMemoryError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use somatic::signal::FrameBlock;
use somatic::{Agreement, BackendKind, Engine, Error, Frame, Percepts};

use crate::arrays::{Values, poses, times, values};
use crate::body::PyBody;
use crate::calibration::PyCalibration;
use crate::error::{OrRaise, interrupted, usage};
use crate::percepts::PyPercepts;
use crate::scene::PyScene;
use crate::session::Run;
use crate::threads::free;

/// Values of a call from which on it is made in parts, between which Ctrl-C is heard.
const LONG: usize = 1 << 20;
/// Bytes of percepts from which on it is asked whether there is room for them.
const LARGE: usize = 1 << 28;
/// Batches that may be lent to Python and wait for their memory to come back.
const LENT: usize = 4;

/// Turns touch frames into percepts.
///
/// `scene` is a `Scene`, a dict of its keys, or the text of a scene file. `backend` is 'auto', 'cpu', 'gpu' or 'reference'.
/// `taxels` are the ids of the values of a frame, in their order; without them it is all of the body's, by ascending id.
/// An engine goes on from call to call: motion, touches and filters know the frames before. Threads may share one, and take turns.
///
/// >>> import numpy as np
/// >>> import somatic_touch as st
/// >>> body = st.Body.bundled("hand")
/// >>> engine = st.Engine(body, {"outputs": ["total", "position"]}, backend="cpu")
/// >>> values = np.zeros((100, 40), np.float32)
/// >>> values[50:, 4] = 512
/// >>> p = engine.process(np.arange(100) * 0.01, values)
/// >>> p["total"][60, p.index("hand/palm")]
/// np.float32(512.0)
#[pyclass(module = "somatic_touch", name = "Engine", frozen)]
pub(crate) struct PyEngine {
    inner: Mutex<Inner>,
    run: Arc<Run>,
    /// The values of a frame.
    width: usize,
}

struct Inner {
    engine: Engine,
    /// Batches that were given to Python, whose memory is used again when nobody needs them.
    lent: Vec<Arc<Percepts>>,
}

impl Inner {
    /// The percepts of the last call, to keep.
    fn take(&mut self) -> Arc<Percepts> {
        let free = self.lent.iter().position(|lent| Arc::strong_count(lent) == 1);
        let spare = free.and_then(|free| Arc::into_inner(self.lent.swap_remove(free)));
        let percepts = Arc::new(self.engine.take_percepts(spare));
        if self.lent.len() == LENT {
            self.lent.remove(0);
        }
        self.lent.push(Arc::clone(&percepts));
        percepts
    }
}

impl PyEngine {
    fn lock(&self) -> MutexGuard<'_, Inner> {
        // What panicked has not left it in between: a call begins by making room.
        self.inner.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Runs `work` without Python's lock.
    fn without_python<T: Send>(&self, py: Python<'_>, work: impl FnOnce(&mut Inner) -> T + Send) -> T {
        free(py, || work(&mut self.lock()))
    }

    fn wrap(&self, percepts: Arc<Percepts>) -> PyPercepts {
        PyPercepts::new(percepts, Arc::clone(&self.run))
    }

    /// Refuses a call whose percepts have no room, which would end the process.
    fn check_room(&self, frames: usize) -> PyResult<()> {
        let numbers: usize = self.run.outputs.columns().map(|column| 8 * column.components).sum();
        let cells = frames.saturating_mul(self.run.names.len());
        let bytes = cells.saturating_mul(numbers + 16);
        let is_there =
            bytes < LARGE || (bytes < isize::MAX as usize && Vec::<u8>::new().try_reserve_exact(bytes).is_ok());
        if is_there {
            return Ok(());
        }
        let gibibytes = bytes as f64 / f64::from(1 << 30);
        let what = format!("the percepts of {frames} frames take {gibibytes:.0} GiB; process fewer frames a call");
        Err(PyMemoryError::new_err(what))
    }
}

#[pymethods]
impl PyEngine {
    #[new]
    #[pyo3(signature = (body, scene = None, calibration = None, backend = None, *, taxels = None, batch = 256))]
    fn new(
        py: Python<'_>,
        body: &PyBody,
        scene: Option<&Bound<'_, PyAny>>,
        calibration: Option<&PyCalibration>,
        backend: Option<&str>,
        taxels: Option<Vec<u32>>,
        batch: usize,
    ) -> PyResult<Self> {
        let scene = PyScene::of_any(scene, py)?;
        let scene = scene.get();
        let backend = backend.map(str::parse::<BackendKind>).transpose().or_raise(py)?;
        let made = free(py, || {
            let options = scene.options(calibration.map(|calibration| &calibration.inner), backend, batch)?;
            let mut engine = Engine::new(&body.inner, options)?;
            if let Some(taxels) = &taxels {
                engine.set_channels(taxels).map_err(|e| e.at("taxels"))?;
            }
            Ok::<_, Error>(engine)
        });
        let engine = made.or_raise(py)?;
        let text = calibration.map(|calibration| calibration.text.as_str());
        let run = Arc::new(Run::new(&engine, &body.inner, &body.bytes, &scene.text, text));
        let width = taxels.map_or(body.inner.taxels.len(), |taxels| taxels.len());
        let inner = Mutex::new(Inner { engine, lent: Vec::new() });
        Ok(Self { inner, run, width })
    }

    /// Turns frames into percepts, in order.
    ///
    /// `t`: float64 [frames], in seconds. `values`: raw values, float32 [frames, taxels] in C order, which is read where it is
    /// (do not write to it meanwhile; anything else is converted first); NaN is a faulty value. `mask`: bool [frames, taxels] or
    /// [taxels], True where a value is missing; it makes a copy. `pose`: by link `[x, y, z, qx, qy, qz, qw]`, [7] or [frames, 7], in
    /// metres, where links move. However a recording is cut into calls, its percepts are the same bits.
    ///
    /// Python's lock is free while it computes. Ctrl-C ends a long call, and leaves the engine as it was before. `progress` is
    /// called with the number of frames done, about ten times a second.
    ///
    /// >>> import numpy as np
    /// >>> import somatic_touch as st
    /// >>> engine = st.Engine(st.Body.bundled("hand"), backend="cpu")
    /// >>> engine.process([0.0, 0.1], np.zeros((2, 39), np.float32))
    /// Traceback (most recent call last):
    ///     ...
    /// somatic_touch.UsageError: values should be float32 of shape [frames, taxels] = [2, 40]; this has shape [2, 39]
    #[pyo3(signature = (t, values, mask = None, pose = None, *, progress = None))]
    fn process(
        &self,
        py: Python<'_>,
        t: &Bound<'_, PyAny>,
        values: &Bound<'_, PyAny>,
        mask: Option<&Bound<'_, PyAny>>,
        pose: Option<&Bound<'_, PyAny>>,
        progress: Option<Py<PyAny>>,
    ) -> PyResult<PyPercepts> {
        let t = times(t)?;
        let t_s = t.as_slice()?;
        let held = self::values(values, mask, &[t_s.len(), self.width], "[frames, taxels]")?;
        let moved = pose.map(|pose| poses(pose, t_s.len())).transpose()?.unwrap_or_default();
        self.check_room(t_s.len())?;
        let block = FrameBlock { t_s, values: held.slice(), poses: &moved };
        if block.values.len() < LONG && progress.is_none() {
            let done = self.without_python(py, |inner| {
                inner.engine.process_block(&block)?;
                Ok(inner.take())
            });
            return done.or_raise(py).map(|percepts| self.wrap(percepts));
        }
        let mut raised = None;
        let done = self.without_python(py, |inner| {
            let go_on = |frames: usize| {
                Python::attach(|py| {
                    py.check_signals()?;
                    progress.as_ref().map_or(Ok(()), |progress| progress.call1(py, (frames,)).map(drop))
                })
                .map_err(|error| raised = Some(error))
                .is_ok()
            };
            let is_whole = inner.engine.process_block_while(&block, go_on)?.is_some();
            Ok(is_whole.then(|| inner.take()))
        });
        match done.or_raise(py)? {
            Some(percepts) => Ok(self.wrap(percepts)),
            None => Err(interrupted(raised)),
        }
    }

    /// The same for one frame, as in a control loop: `t` in seconds, `values` [taxels]. Its percepts have one frame.
    ///
    /// >>> import numpy as np
    /// >>> import somatic_touch as st
    /// >>> engine = st.Engine(st.Body.bundled("hand"), {"outputs": ["total"]}, backend="cpu")
    /// >>> frame = np.zeros(40, np.float32)
    /// >>> frame[4] = 512
    /// >>> p = engine.step(0.02, frame)
    /// >>> p["total"][0, p.index("hand/palm")]
    /// np.float32(512.0)
    #[pyo3(signature = (t, values, mask = None, pose = None))]
    fn step(
        &self,
        py: Python<'_>,
        t: f64,
        values: &Bound<'_, PyAny>,
        mask: Option<&Bound<'_, PyAny>>,
        pose: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<PyPercepts> {
        let held: Values<'_> = self::values(values, mask, &[self.width], "[taxels]")?;
        let moved = pose.map(|pose| poses(pose, 1)).transpose()?.unwrap_or_default();
        let block = FrameBlock { t_s: &[t], values: held.slice(), poses: &moved };
        let done = self.without_python(py, |inner| {
            inner.engine.process_block(&block)?;
            Ok(inner.take())
        });
        done.or_raise(py).map(|percepts| self.wrap(percepts))
    }

    /// The state after the frames so far, so that a recording can be entered here again: see `restore`.
    ///
    /// >>> import numpy as np
    /// >>> import somatic_touch as st
    /// >>> engine = st.Engine(st.Body.bundled("hand"), backend="cpu")
    /// >>> first = engine.state()
    /// >>> a = engine.step(0.0, np.full(40, 9))
    /// >>> engine.restore(first)
    /// >>> engine.step(0.0, np.full(40, 9)).first_frame
    /// 0
    fn state(&self, py: Python<'_>) -> PyResult<PyState> {
        self.without_python(py, |inner| inner.engine.state()).or_raise(py).map(|inner| PyState { inner })
    }

    /// Goes on from `state`, of an engine with the same body, scene and calibration.
    fn restore(&self, py: Python<'_>, state: &PyState) -> PyResult<()> {
        self.without_python(py, |inner| inner.engine.restore(&state.inner)).or_raise(py)
    }

    /// Compares the backend with the double-precision reference on these frames, which are processed as by `process`.
    ///
    /// A dict: `agrees`; `percepts` and `failed`, how many were compared and differ; `failures`, the first of those in words;
    /// `quantities`, by output `compared`, `agreeing`, `too_close`, `worst_error` (in its unit) and `worst_share` (of its bound).
    ///
    /// >>> import somatic_touch as st
    /// >>> touch = st.read("hand")
    /// >>> found = touch.engine(backend="cpu").verify(touch.t, touch.values)
    /// >>> found["agrees"], found["percepts"]
    /// (True, 3640)
    #[pyo3(signature = (t, values, mask = None, pose = None))]
    fn verify<'py>(
        &self,
        py: Python<'py>,
        t: &Bound<'py, PyAny>,
        values: &Bound<'py, PyAny>,
        mask: Option<&Bound<'py, PyAny>>,
        pose: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyDict>> {
        if self.backend() == "reference" {
            return Err(usage(py, "this would compare the reference with itself; take backend cpu or gpu"));
        }
        let t = times(t)?;
        let t_s = t.as_slice()?;
        let held = self::values(values, mask, &[t_s.len(), self.width], "[frames, taxels]")?;
        let moved = pose.map(|pose| poses(pose, t_s.len())).transpose()?.unwrap_or_default();
        let mut sum = Agreement::default();
        for first in (0..t_s.len()).step_by(256) {
            py.check_signals()?;
            let frame = |index: usize| Frame {
                t_s: t_s[index],
                values: held.slice()[index * self.width..][..self.width].to_vec(),
                pose: moved.iter().map(|(link, poses)| (link.clone(), poses[index])).collect(),
                ..Frame::default()
            };
            let frames: Vec<Frame> = (first..t_s.len().min(first + 256)).map(frame).collect();
            let part = self.without_python(py, |inner| inner.engine.process_and_compare(&frames).map(|(_, part)| part));
            sum.merge(part.or_raise(py)?);
        }
        let quantities = PyDict::new(py);
        for (name, of) in &sum.quantities {
            let made = PyDict::new(py);
            made.set_item("compared", of.compared)?;
            made.set_item("agreeing", of.agreeing)?;
            made.set_item("too_close", of.too_close)?;
            made.set_item("worst_error", of.worst_error)?;
            made.set_item("worst_share", of.worst_share)?;
            quantities.set_item(name, made)?;
        }
        let found = PyDict::new(py);
        found.set_item("agrees", sum.holds())?;
        found.set_item("percepts", sum.percepts)?;
        found.set_item("failed", sum.failed)?;
        found.set_item("failures", &sum.failures)?;
        found.set_item("quantities", quantities)?;
        Ok(found)
    }

    /// The names of the fields, in the order of the percepts' second axis.
    #[getter]
    fn fields(&self) -> Vec<&str> {
        self.run.labels.iter().map(String::as_str).collect()
    }

    /// The names of the outputs.
    #[getter]
    fn outputs(&self) -> Vec<String> {
        self.run.outputs.names().collect()
    }

    /// The backend that computes.
    #[getter]
    fn backend(&self) -> &str {
        &self.run.backend[0]
    }

    /// What is computed, over how much, and why, as docs/scenes.md describes it.
    ///
    /// >>> import somatic_touch as st
    /// >>> plan = st.Engine(st.Body.bundled("hand"), {"outputs": ["centroid"]}, backend="cpu").plan()
    /// >>> [stage["stage"] for stage in plan["stages"] if stage["runs"]]
    /// ['calibrate', 'contact', 'centroid']
    fn plan<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let text = serde_json::to_string(&self.run.plan).map_err(|why| usage(py, why.to_string()))?;
        py.import("json")?.call_method1("loads", (text,))
    }

    fn __repr__(&self) -> String {
        let run = &self.run;
        format!(
            "<Engine {} on {}: {} fields, {} values a frame>",
            run.backend[0],
            run.body.name,
            run.names.len(),
            self.width
        )
    }
}

/// What an engine's next percepts depend on beside the next frames.
#[pyclass(module = "somatic_touch", name = "EngineState", frozen)]
pub(crate) struct PyState {
    inner: somatic::EngineState,
}

#[pymethods]
impl PyState {
    /// The number of frames that were processed before it.
    #[getter]
    fn frames(&self) -> u64 {
        self.inner.frames()
    }
}
