//! `live`: percepts of boards, topics and limbs, as their frames come.

use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use pyo3::prelude::*;
use pyo3::types::PyDict;
use serde_json::Value;
use somatic::internal::error::parse_toml;
use somatic::internal::recording::{BODY, CALIBRATION};
use somatic::internal::run::{Arrival, Feed, Opened, Pace, ReadMode};
use somatic::internal::setup::{Input, Setup, attachments};
use somatic::internal::source::BoardAccount;
use somatic::run::Tell;
use somatic::scene::file::SceneFile;
use somatic::source::Lines;
use somatic::{Engine, Error, Percepts};

use crate::body::PyBody;
use crate::channels::{count_of, names_of, taxels_of};
use crate::error::{OrRaise, stays_here, usage, warn};
use crate::opening::text_of;
use crate::percepts::PyPercepts;
use crate::scene::{PyScene, check_keys, table_of};
use crate::session::Run;
use crate::stream::in_python;
use crate::threads::{free, waiting};

/// How long is waited for frames until Ctrl-C and `stop` are heard.
const WAIT: Duration = Duration::from_millis(40);

/// Percepts of frames as they come: a loop over it has a `Percepts` for each call, live of one frame. `live` makes it.
///
/// It ends when its source does, when `stop` is called, from any thread, or with its `with` block. What a source has to say, such as that a
/// board is gone, is a warning.
#[pyclass(module = "somatic_touch", name = "Live", frozen)]
pub(crate) struct PyLive {
    running: Mutex<Option<Running>>,
    is_stopped: AtomicBool,
    run: Arc<Run>,
    body: Py<PyBody>,
    channels: Vec<u32>,
    name: String,
    lines: Option<Lines>,
    losses: Mutex<Vec<String>>,
}

struct Running {
    engine: Engine,
    feed: Feed,
    lines: Option<Lines>,
    heeds_stale: bool,
    last: Option<Arc<Percepts>>,
}

impl Running {
    /// The percepts of `frames`, with what the engine has to say.
    fn process(&mut self, frames: Vec<somatic::Frame>, has_stale: bool) -> somatic::Result<Arc<Percepts>> {
        if has_stale && !std::mem::replace(&mut self.heeds_stale, true) {
            self.engine.track_stale();
        }
        self.engine.process(&frames)?;
        self.feed.give_back(frames);
        let spare = self.last.take().and_then(Arc::into_inner);
        let percepts = Arc::new(self.engine.take_percepts(spare));
        self.last = Some(Arc::clone(&percepts));
        Ok(percepts)
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        if let Some(lines) = &self.lines {
            lines.close();
        }
    }
}

/// What `__next__` goes on with.
enum Step {
    Percepts(Arc<Percepts>, Vec<String>),
    Wait(Vec<String>),
    End(Vec<String>),
}

impl PyLive {
    fn lock<T>(mutex: &Mutex<T>) -> std::sync::MutexGuard<'_, T> {
        mutex.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Waits a moment for frames.
    fn step(&self, running: &mut Running) -> somatic::Result<Step> {
        let mut notices = Vec::new();
        let arrival = running.feed.next(WAIT);
        if let Some(lines) = &running.lines {
            notices.extend(lines.notices().into_iter().map(|notice| notice.text));
            *Self::lock(&self.losses) = lines.losses();
        }
        Ok(match arrival {
            Some(Arrival::Frames(frames, mut info)) => {
                notices.append(&mut info.notices);
                if running.lines.is_none() {
                    *Self::lock(&self.losses) = info.losses;
                }
                let percepts = running.process(frames, info.has_stale)?;
                notices.extend(running.engine.notice());
                Step::Percepts(percepts, notices)
            }
            Some(Arrival::End(ending)) => {
                if running.lines.is_none() {
                    *Self::lock(&self.losses) = ending.losses;
                }
                notices.extend(ending.notices);
                Step::End(notices)
            }
            Some(Arrival::Failed(error)) => return Err(error),
            None | Some(Arrival::Woken) => Step::Wait(notices),
        })
    }
}

#[pymethods]
impl PyLive {
    /// The body that the frames are of.
    #[getter]
    fn body(&self, py: Python<'_>) -> Py<PyBody> {
        self.body.clone_ref(py)
    }

    /// The ids of the taxels of its frames; one with three axes is there three times.
    #[getter]
    fn taxels(&self) -> Vec<u32> {
        taxels_of(&self.channels)
    }

    /// The names of its values, in their order, as `Recording.channels`.
    #[getter]
    fn channels(&self) -> Vec<String> {
        names_of(&self.channels)
    }

    /// What became of the frames of boards and limbs so far, a `Table` with a row for each: `board` or `limb`, `port`, `state`, `sent`,
    /// `delivered`, `lost`, `dropped`, `replaced`, `corrupt`, `restarts`, `unplugs`, `drift_ppm` of its clock and `rate_hz`, as
    /// `somatic run --summary` writes it; empty if frames come from elsewhere.
    ///
    /// >>> import somatic_touch as st
    /// >>> with st.live(body="hand", backend="cpu") as live:
    /// ...     len(live.boards)
    /// 0
    #[getter]
    fn boards<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let accounts = self.lines.as_ref().map_or_else(Vec::new, Lines::accounts);
        let rows: Vec<Value> = accounts.iter().map(BoardAccount::as_json).collect();
        in_python(py, "_columns", "of_json", (Value::from(rows).to_string(),))
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

    /// What was lost so far, a line each: frames that came damaged, lines that were no frames.
    #[getter]
    fn losses(&self) -> Vec<String> {
        Self::lock(&self.losses).clone()
    }

    /// Ends the loop over it, from any thread, within a twentieth of a second; what was opened is closed.
    fn stop(&self) {
        self.is_stopped.store(true, Ordering::Relaxed);
        // Where a loop is under way, it closes what it has.
        drop(Self::lock(&self.running).take());
    }

    fn __iter__(slf: Py<Self>) -> Py<Self> {
        slf
    }

    fn __next__(&self, py: Python<'_>) -> PyResult<Option<PyPercepts>> {
        // Not held while Python runs: another thread that asks meanwhile finds the end.
        let Some(mut running) = Self::lock(&self.running).take() else { return Ok(None) };
        loop {
            if self.is_stopped.load(Ordering::Relaxed) {
                return Ok(None);
            }
            match free(py, || self.step(&mut running)).or_raise(py)? {
                Step::Percepts(percepts, notices) => {
                    let found = PyPercepts::new(percepts, Arc::clone(&self.run));
                    *Self::lock(&self.running) = Some(running);
                    if self.is_stopped.load(Ordering::Relaxed) {
                        drop(Self::lock(&self.running).take());
                    }
                    warn(py, notices)?;
                    return Ok(Some(found));
                }
                Step::Wait(notices) => warn(py, notices)?,
                Step::End(notices) => {
                    warn(py, notices)?;
                    return Ok(None);
                }
            }
            py.check_signals()?;
        }
    }

    fn __enter__(slf: Py<Self>) -> Py<Self> {
        slf
    }

    fn __exit__(&self, _kind: &Bound<'_, PyAny>, _raised: &Bound<'_, PyAny>, _traceback: &Bound<'_, PyAny>) {
        self.stop();
    }

    fn __reduce__(&self) -> PyResult<()> {
        Err(stays_here("what is live stays in its process; send percepts' arrays or tables"))
    }

    fn __repr__(&self) -> String {
        let fields = self.run.names.len();
        let taxels = count_of(&self.channels);
        format!("<Live {} on {}: {fields} fields, {taxels} taxels>", self.name, self.run.body.name)
    }
}

/// What `scene` and `keys` ask for, and the text of it.
fn scene_of(
    py: Python<'_>,
    scene: Option<&Bound<'_, PyAny>>,
    keys: &Bound<'_, PyDict>,
) -> PyResult<(SceneFile, String)> {
    let mut table = toml::Table::new();
    if let Some(scene) = scene {
        if let Ok(scene) = scene.cast::<PyScene>() {
            table = parse_toml(&scene.get().text).or_raise(py)?;
        } else if let Ok(dict) = scene.cast::<PyDict>() {
            table = table_of(dict)?;
        } else {
            let text = text_of(scene).map_err(|_| usage(py, "a scene is a file, a dict of its keys, or a text"))?;
            if !text.contains(['\n', '=']) {
                if !keys.is_empty() {
                    return Err(usage(py, "give a scene's file or keys, not both"));
                }
                let path = Path::new(&text);
                let scene = SceneFile::load(path).or_raise_of(py, path)?;
                let text = std::fs::read_to_string(path).map_err(|e| Error::io(path, &e)).or_raise_of(py, path)?;
                return Ok((scene, text));
            }
            table = parse_toml(&text).or_raise(py)?;
        }
    }
    table.extend(table_of(keys)?);
    check_keys(py, &table)?;
    let text = toml::to_string(&table).map_err(|why| usage(py, why.to_string()))?;
    Ok((SceneFile::parse(&text).map_err(|e| e.at("scene")).or_raise(py)?, text))
}

#[pyfunction]
#[pyo3(name = "_live")]
pub(crate) fn open_live(
    py: Python<'_>,
    scene: Option<&Bound<'_, PyAny>>,
    keys: &Bound<'_, PyDict>,
) -> PyResult<PyLive> {
    let (scene, text) = scene_of(py, scene, keys)?;
    let notices = Arc::new(Mutex::new(Vec::new()));
    let to = Arc::clone(&notices);
    let tell = Tell::new(move |line: &str| PyLive::lock(&to).push(line.to_owned()));
    // A board may not answer, or a topic have no message yet.
    let opened = waiting(py, move || {
        scene.check()?;
        if !scene.sinks.is_empty() {
            return Err(Error::usage("`sink` is for the command; write percepts as they come, with `write`"));
        }
        if !scene.accuracy.target().is_empty() {
            return Err(Error::usage(
                "a tolerance or a budget is met by measuring: give the options that `tradeoff` picks",
            ));
        }
        let setup = Setup::new(scene, tell);
        let input = Input::named(&setup)?;
        let pace = Pace::for_input(&setup, &input, false);
        let options = |body: &somatic::Body| {
            let ids: Vec<u32> = body.taxels.iter().map(|taxel| taxel.id).collect();
            Ok((setup.options(body, &ids, pace.batch)?, None))
        };
        let opened = Opened::new(&setup, &input, input.body(&setup)?, pace, options)?;
        // A body that the lines of a board describe is in no file.
        let files = attachments(&setup, &opened.body, None).unwrap_or_default();
        Ok((opened, files, input.name))
    });
    let (opened, files, name) = opened?.or_raise(py)?;
    warn(py, std::mem::take(&mut *PyLive::lock(&notices)))?;
    let Opened { body, engine, source, lines, pace, .. } = opened;
    let bytes = files.iter().find(|(_, kind, _)| kind == BODY).map(|(.., bytes)| bytes.clone()).unwrap_or_default();
    let body = PyBody { inner: Arc::new(body), bytes: Arc::new(bytes) };
    let calibration = files.iter().find(|(name, ..)| name == CALIBRATION);
    let calibration = calibration.map(|(.., bytes)| String::from_utf8_lossy(bytes).into_owned());
    let run = Arc::new(Run::new(&engine, &body.inner, &body.bytes, &text, calibration.as_deref()));
    let channels = source.taxels().to_vec();
    let feed = match &lines {
        None => Feed::start(source, ReadMode { most: pace.batch, gather: pace.gather, speed: pace.speed }),
        Some(lines) => Feed::start_woken(source, pace.batch, lines),
    };
    let running = Running { engine, feed, heeds_stale: lines.is_some(), lines: lines.clone(), last: None };
    let (running, losses) = (Mutex::new(Some(running)), Mutex::default());
    let (is_stopped, body) = (AtomicBool::new(false), Py::new(py, body)?);
    Ok(PyLive { running, is_stopped, run, body, channels, name, lines, losses })
}
