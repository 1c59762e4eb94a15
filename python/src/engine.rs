//! `Engine`: frames in, percepts out, without Python's lock.

mod columns;
mod inner;
mod input;
mod wish;

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Instant;

use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};
use somatic::internal::signal::FrameBlock;
use somatic::page::Listen;
use somatic::{Agreement, Error, Frame, Percepts};

use self::inner::Inner;
use self::wish::Wish;
use crate::agreement::agreement_dict;
use crate::arrays::{time_s, times};
use crate::body::PyBody;
use crate::calibration::PyCalibration;
use crate::channels::{Channels, GivenChannel, names_of, numbers_of};
use crate::error::{OrRaise, interrupted, stays_here, usage, warn};
use crate::frame_values::{Values, values};
use crate::percepts::PyPercepts;
use crate::progress::Progress;
use crate::scene::PyScene;
use crate::session::Run;
use crate::state::PyState;
use crate::threads::free;
use crate::view::{Page, PyView};

/// Values of a call from which on it is made in parts, between which Ctrl-C is heard.
const LONG: usize = 1 << 20;

/// Turns touch frames into percepts.
///
/// `scene` is a `Scene`, a dict of its keys, or the text of a scene file. `backend` is 'auto', 'cpu', 'gpu' or 'reference'.
/// `taxels` are the ids of the values of a frame, in their order; without them it is all of the body's, by ascending id. A taxel with three
/// axes has three values, its force along its normal, its tangent t and n × t, which are called `4`, `4.u` and `4.v`: see `channels`.
/// An engine goes on from call to call: motion, touches and filters know the frames before. Threads may share one, and take turns.
/// `copy.copy` makes another in the same state. One that has processed no frame can be pickled; a state cannot.
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
    /// Whose the values of a frame are.
    channels: Channels,
    wish: Wish,
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

    /// What `taken` holds, for Python; its notice is a warning.
    fn wrap(&self, py: Python<'_>, taken: (Arc<Percepts>, Option<String>)) -> PyResult<PyPercepts> {
        let (percepts, notice) = taken;
        warn(py, notice)?;
        Ok(PyPercepts::new(percepts, Arc::clone(&self.run)))
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
        taxels: Option<Vec<GivenChannel>>,
        batch: usize,
    ) -> PyResult<Self> {
        let taxels = taxels.map(|taxels| numbers_of(py, taxels)).transpose()?;
        let scene = PyScene::of_any(scene, py)?.get().text.clone();
        let (body, calibration, backend) = (body.clone(), calibration.cloned(), backend.map(str::to_owned));
        Wish { body, scene, calibration, backend, taxels, batch }.make(py)
    }

    /// Another engine in the same state, which goes on by itself.
    fn __copy__(&self, py: Python<'_>) -> PyResult<Self> {
        let state = self.without_python(py, |inner| inner.engine.state()).or_raise(py)?;
        let copy = Wish { backend: Some(self.backend().to_owned()), ..self.wish.clone() }.make(py)?;
        copy.without_python(py, |inner| inner.engine.restore(&state)).or_raise(py)?;
        Ok(copy)
    }

    fn __deepcopy__(&self, py: Python<'_>, _memo: &Bound<'_, PyDict>) -> PyResult<Self> {
        self.__copy__(py)
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyTuple>)> {
        let (py, of) = (slf.py(), slf.get());
        let frames = of.without_python(py, |inner| inner.engine.state()).or_raise(py)?.frames();
        if frames > 0 {
            return Err(stays_here(&format!(
                "this engine has processed {frames} frames, and its state cannot be pickled; pickle it before its first frame, or \
                 send the recording and process it there"
            )));
        }
        let Wish { body, scene, calibration, backend, taxels, batch } = of.wish.clone();
        let parts = (body, scene, calibration, backend, taxels, batch).into_pyobject(py)?;
        Ok((slf.get_type().getattr("_of_parts")?, parts))
    }

    #[staticmethod]
    #[pyo3(name = "_of_parts")]
    fn unpickled(
        py: Python<'_>,
        body: &PyBody,
        scene: String,
        calibration: Option<&PyCalibration>,
        backend: Option<String>,
        taxels: Option<Vec<u32>>,
        batch: usize,
    ) -> PyResult<Self> {
        Wish { body: body.clone(), scene, calibration: calibration.cloned(), backend, taxels, batch }.make(py)
    }

    /// Turns frames into percepts, in order.
    ///
    /// `t`: float64 [frames], in seconds. `values`: raw values, float32 [frames, taxels] in C order, which is read where it is
    /// (do not write to it meanwhile; anything else is converted first); NaN is a faulty value. `mask`: bool [frames, taxels] or
    /// [taxels], True where a value is missing; it makes a copy. `pose`: by link `[x, y, z, qx, qy, qz, qw]`, [7] or [frames, 7], in
    /// metres, where links move. However a recording is cut into calls, its percepts are the same bits.
    ///
    /// `t` may have dates too: NumPy's, pandas', or a list of `datetime`; they become seconds since 1970, and those without a time zone are
    /// in UTC. `values` may be a table whose columns are named as `channels`, in any order, or a list of dicts, by taxel its value: what a
    /// dict does not have is missing. `joints` are positions of the body's joints by name, in rad or m, [] or [frames], which say where
    /// links are, as `Body.forward` does; poses of links come before them.
    ///
    /// If all taxels have three axes, `values` may be [frames, taxels, 3]: the forces along the normal, t and n × t, and a `mask` of the
    /// same shape or of taxels. Of other bodies with such taxels it is [frames, channels], in the order of `channels`. A dict has `{4: [n,
    /// u, v]}`, or `{4: n, "4.u": u}` with v missing.
    ///
    /// Python's lock is free while it computes. Ctrl-C ends a long call, and leaves the engine as it was before. `progress` is
    /// called with the number of frames done, about ten times a second; True shows a bar of tqdm.
    ///
    /// >>> import numpy as np
    /// >>> import somatic_touch as st
    /// >>> engine = st.Engine(st.Body.bundled("hand"), backend="cpu")
    /// >>> engine.process([0.0, 0.1], np.zeros((2, 39), np.float32))
    /// Traceback (most recent call last):
    ///     ...
    /// somatic_touch.UsageError: values should be float32 of shape [frames, taxels] = [2, 40]; this has shape [2, 39]
    /// >>> engine.process([0.0, 0.1], [{4: 512}, {4: 500, 7: 3}])
    /// <Percepts: 2 frames of 13 fields>
    #[pyo3(signature = (t, values, mask = None, pose = None, *, joints = None, progress = None))]
    #[expect(clippy::too_many_arguments, reason = "they are keywords")]
    fn process(
        &self,
        py: Python<'_>,
        t: &Bound<'_, PyAny>,
        values: &Bound<'_, PyAny>,
        mask: Option<&Bound<'_, PyAny>>,
        pose: Option<&Bound<'_, PyAny>>,
        joints: Option<&Bound<'_, PyAny>>,
        progress: Option<Py<PyAny>>,
    ) -> PyResult<PyPercepts> {
        let t = times(t)?;
        let t_s = t.as_slice()?;
        let held = self.held(values, mask, t_s.len())?;
        let moved = self.placed(t_s.len(), pose, joints)?;
        self.check_room(t_s.len())?;
        let progress = Progress::new(py, progress, Some(t_s.len() as f64), "frames")?;
        let block = FrameBlock { t_s, values: held.slice(), poses: &moved };
        if block.values.len() < LONG && progress.is_none() {
            let done = self.without_python(py, |inner| {
                let began = Instant::now();
                inner.engine.process_block(&block)?;
                inner.show(&block, began);
                Ok(inner.take())
            });
            return self.wrap(py, done.or_raise(py)?);
        }
        let mut raised = None;
        let done = self.without_python(py, |inner| {
            let go_on = |frames: usize| {
                Python::attach(|py| {
                    py.check_signals()?;
                    progress.as_ref().map_or(Ok(()), |progress| progress.tell(py, (frames,)))
                })
                .map_err(|error| raised = Some(error))
                .is_ok()
            };
            let began = Instant::now();
            let is_whole = inner.engine.process_block_while(&block, go_on)?.is_some();
            if is_whole {
                inner.show(&block, began);
            }
            Ok(is_whole.then(|| inner.take()))
        });
        match done.or_raise(py)? {
            Some(taken) => self.wrap(py, taken),
            None => Err(interrupted(raised)),
        }
    }

    /// The same for one frame, as in a control loop: `t` in seconds, or a date; `values` [taxels], [taxels, 3], or a dict. Its percepts
    /// have one frame.
    ///
    /// >>> import numpy as np
    /// >>> import somatic_touch as st
    /// >>> engine = st.Engine(st.Body.bundled("hand"), {"outputs": ["total"]}, backend="cpu")
    /// >>> frame = np.zeros(40, np.float32)
    /// >>> frame[4] = 512
    /// >>> p = engine.step(0.02, frame)
    /// >>> p["total"][0, p.index("hand/palm")]
    /// np.float32(512.0)
    #[pyo3(signature = (t, values, mask = None, pose = None, *, joints = None))]
    fn step(
        &self,
        py: Python<'_>,
        t: &Bound<'_, PyAny>,
        values: &Bound<'_, PyAny>,
        mask: Option<&Bound<'_, PyAny>>,
        pose: Option<&Bound<'_, PyAny>>,
        joints: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<PyPercepts> {
        let t = time_s(t, "t")?;
        let held: Values<'_> = self::values(values, mask, None, &self.channels)?;
        let moved = self.placed(1, pose, joints)?;
        let block = FrameBlock { t_s: &[t], values: held.slice(), poses: &moved };
        let done = self.without_python(py, |inner| {
            let began = Instant::now();
            inner.engine.process_block(&block)?;
            inner.show(&block, began);
            Ok(inner.take())
        });
        self.wrap(py, done.or_raise(py)?)
    }

    /// The address at which `process` reads these values: that of the array itself where nothing is converted. For tests.
    #[pyo3(signature = (values, mask = None))]
    fn _reads_at(&self, values: &Bound<'_, PyAny>, mask: Option<&Bound<'_, PyAny>>) -> PyResult<usize> {
        Ok(self.held(values, mask, values.len()?)?.slice().as_ptr().addr())
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
    #[pyo3(signature = (t, values, mask = None, pose = None, *, joints = None))]
    fn verify<'py>(
        &self,
        py: Python<'py>,
        t: &Bound<'py, PyAny>,
        values: &Bound<'py, PyAny>,
        mask: Option<&Bound<'py, PyAny>>,
        pose: Option<&Bound<'py, PyAny>>,
        joints: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyDict>> {
        if self.backend() == "reference" {
            return Err(usage(py, "this would compare the reference with itself; use backend cpu or gpu"));
        }
        let t = times(t)?;
        let t_s = t.as_slice()?;
        let held = self.held(values, mask, t_s.len())?;
        let moved = self.placed(t_s.len(), pose, joints)?;
        let (mut sum, width) = (Agreement::default(), self.channels.width());
        let before = self.without_python(py, |inner| inner.engine.state()).or_raise(py)?;
        for first in (0..t_s.len()).step_by(256) {
            if let Err(raised) = py.check_signals() {
                self.without_python(py, |inner| inner.engine.restore(&before)).or_raise(py)?;
                return Err(raised);
            }
            let frame = |index: usize| Frame {
                t_s: t_s[index],
                values: held.slice()[index * width..][..width].to_vec(),
                pose: moved.iter().map(|(link, poses)| (link.clone(), poses[index])).collect(),
                ..Frame::default()
            };
            let frames: Vec<Frame> = (first..t_s.len().min(first + 256)).map(frame).collect();
            let part = self.without_python(py, |inner| inner.engine.process_and_compare(&frames).map(|(_, part)| part));
            sum.merge(part.or_raise(py)?);
        }
        agreement_dict(py, &sum)
    }

    /// Shows in a browser what it computes from now on, on the page of docs/reference/view.md: after each call its last frame.
    ///
    /// Open `url` of the `View` that it gives; it is served until it is closed. `listen` is HOST:PORT, where port 0 is any free one,
    /// by default 127.0.0.1:7879 or the next free port, which this machine alone reaches. Others need one of the names `allow_hosts`.
    ///
    /// >>> import somatic_touch as st
    /// >>> engine = st.Engine(st.Body.bundled("hand"), backend="cpu")
    /// >>> with engine.view("127.0.0.1:0") as view:
    /// ...     p = engine.step(0.0, [0] * 40)
    /// ...     view.url[:17], view.viewers
    /// ('http://127.0.0.1:', 0)
    #[pyo3(signature = (listen = None, *, allow_hosts = Vec::new()))]
    fn view(&self, py: Python<'_>, listen: Option<&str>, allow_hosts: Vec<String>) -> PyResult<PyView> {
        let listen = Listen::new(listen, &allow_hosts).or_raise(py)?;
        let started = self.without_python(py, |inner| {
            if inner.page.as_ref().is_some_and(|page| page.is_open()) {
                return Err(Error::usage("this engine is shown already; close its other view"));
            }
            inner.engine.keep_touch_taxels(true);
            let page = Arc::new(Page::start(&listen, &inner.engine, &self.run.body, self.channels.numbers())?);
            inner.page = Some(Arc::clone(&page));
            Ok(page)
        });
        started.or_raise(py).map(PyView::new)
    }

    /// The names of the fields, in the order of the percepts' second axis.
    #[getter]
    fn fields(&self) -> Vec<&str> {
        self.run.labels.iter().map(String::as_str).collect()
    }

    /// The letter of each field, in the order of `fields`, such as 'sustained', 'shear', 'temperature' or 'proximity'.
    ///
    /// >>> import somatic_touch as st
    /// >>> st.Engine(st.Body.grid(1, 2, 0.01), {"letters": ["sustained", "change"]}, backend="cpu").letters
    /// ['sustained', 'change']
    #[getter]
    fn letters(&self) -> Vec<&str> {
        self.run.letters.iter().map(String::as_str).collect()
    }

    /// The names of a frame's values, in their order: of a taxel its id, and of one with three axes `4.u` and `4.v` too, after all of
    /// these.
    ///
    /// >>> import somatic_touch as st
    /// >>> pad = st.Body.from_arrays([[0, 0, 0], [0.01, 0, 0]], [[0, 0, 1]] * 2, modality="force3")
    /// >>> st.Engine(pad, backend="cpu").channels
    /// ['0', '1', '0.u', '1.u', '0.v', '1.v']
    #[getter]
    fn channels(&self) -> Vec<String> {
        names_of(self.channels.numbers())
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

    /// What is computed, over how much, and why, as docs/reference/scene.md describes it.
    ///
    /// >>> import somatic_touch as st
    /// >>> plan = st.Engine(st.Body.bundled("hand"), {"outputs": ["centroid"]}, backend="cpu").plan()
    /// >>> [stage["stage"] for stage in plan["stages"] if stage["runs"]]
    /// ['calibrate', 'contact', 'centroid']
    fn plan<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let text = serde_json::to_string(&self.run.plan).map_err(|why| usage(py, why.to_string()))?;
        py.import("json")?.call_method1("loads", (text,))
    }

    /// The columns of the table `table` of its percepts: 'fields', 'touches' or 'self_contacts'; a `Table` of `name`, `unit`, `type`,
    /// `absent`, whether a value may be, and `what` it is, as `somatic run --describe` tells them.
    ///
    /// >>> import somatic_touch as st
    /// >>> engine = st.Engine(st.Body.bundled("hand"), {"outputs": ["centroid"]}, backend="cpu")
    /// >>> [(row["name"], row["unit"]) for row in engine.columns() if row["name"].startswith("centroid")]
    /// [('centroid_u', 'm'), ('centroid_v', 'm')]
    #[pyo3(signature = (table = "fields"))]
    fn columns<'py>(&self, py: Python<'py>, table: &str) -> PyResult<Bound<'py, PyAny>> {
        columns::table(py, &self.run, table)
    }

    fn __repr__(&self) -> String {
        let run = &self.run;
        format!(
            "<Engine {} on {}: {} fields, {} values a frame>",
            run.backend[0],
            run.body.name,
            run.names.len(),
            self.channels.width()
        )
    }
}
