//! `run`: from a file to a file, without arrays in between.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

use pyo3::prelude::*;
use pyo3::types::PyDict;
use somatic::internal::run::{Feed, ReadMode, RunOptions};
use somatic::output::OutputPaths;
use somatic::run::{FrameInfo, Observer, Remark, Run as Running};
use somatic::sink::SinkSpec;
use somatic::source::{Cut, SourceSpec, VendorOptions};
use somatic::{BackendKind, Engine, Error, Frame};

use crate::body::PyBody;
use crate::calibration::PyCalibration;
use crate::error::{OrRaise, interrupted, usage, warn};
use crate::opening::{Keys, open};
use crate::progress::Progress;
use crate::scene::PyScene;
use crate::session::Run;
use crate::threads::free;

/// Frames of a call.
const BATCH: usize = 256;

/// Turns a recording into a file of percepts, as `somatic run --source … --sink …` does, in bounded memory.
///
/// `source` and `sink` are paths or texts such as `mcap:FILE` and `parquet:FILE`; `body`, `scene`, `calibration` and `backend` as in
/// `read` and `Engine`; what comes with the recording is used where nothing is given. The file's metadata has `label` as its
/// source. `from_s`, `to_s`, `skip_bad` and how exports are read are as in `read`, `header` and `wide` as in `write`. `progress` is called
/// with the number of frames done; True shows a bar of tqdm.
///
/// Gives the number of frames, and what of the source was lost, a line each.
///
/// >>> import pathlib, tempfile
/// >>> import somatic_touch as st
/// >>> folder = pathlib.Path(tempfile.mkdtemp())
/// >>> _ = (folder / "touch.csv").write_text("t,0,1\n0,1,2\n0.1,3,4\n")
/// >>> st.run(folder / "touch.csv", folder / "touch.parquet", body=st.Body.grid(1, 2, 0.01))
/// {'frames': 2, 'losses': []}
#[pyfunction]
#[pyo3(signature = (source, sink, *, body = None, scene = None, calibration = None, backend = None, force = false, all_fields = false, header = false, wide = false, label = None, from_s = None, to_s = None, rate_hz = None, format = None, grid = None, pitch = None, unit = None, layout = None, skip_bad = false, progress = None))]
#[expect(clippy::too_many_arguments, reason = "they are keywords")]
pub(crate) fn run<'py>(
    py: Python<'py>,
    source: PathBuf,
    sink: PathBuf,
    body: Option<Bound<'py, PyBody>>,
    scene: Option<&Bound<'py, PyAny>>,
    calibration: Option<Bound<'py, PyCalibration>>,
    backend: Option<&str>,
    force: bool,
    all_fields: bool,
    header: bool,
    wide: bool,
    label: Option<String>,
    from_s: Option<f64>,
    to_s: Option<f64>,
    rate_hz: Option<f64>,
    format: Option<&str>,
    grid: Option<&str>,
    pitch: Option<&str>,
    unit: Option<&str>,
    layout: Option<PathBuf>,
    skip_bad: bool,
    progress: Option<Py<PyAny>>,
) -> PyResult<Bound<'py, PyDict>> {
    let scene = PyScene::of_any(scene, py)?;
    let scene = scene.get();
    let backend = backend.map(str::parse::<BackendKind>).transpose().or_raise(py)?;
    let keys = Keys { from_s, to_s, rate_hz, format, grid, pitch, unit, layout, skip_bad, ..Keys::default() };
    let (options, cut) = (keys.options().or_raise(py)?, keys.cut());
    let spec = source.display().to_string().parse::<SourceSpec>().or_raise(py)?.with_content(&options);
    let sink: SinkSpec = sink.display().to_string().parse().or_raise(py)?;
    if matches!(sink, SinkSpec::Page(_)) {
        return Err(usage(py, "a page shows live frames; see `Engine.view`, or run `somatic view` on the recording"));
    }
    if wide && !matches!(sink, SinkSpec::Csv(_)) {
        return Err(usage(py, "wide is for a table in CSV; name a sink csv:FILE"));
    }
    let file = spec.file().unwrap_or(Path::new("")).to_owned();
    let (given, calibration) = (body.as_ref().map(Bound::get), calibration.as_ref().map(Bound::get));
    let progress = Progress::new(py, progress, None, "frames")?;
    let label = label.unwrap_or_else(|| file.display().to_string());
    let wish =
        Wish { spec, given, options, cut, scene, calibration, backend, sink, force, all_fields, header, wide, label };
    let mut raised = None;
    let done = free(py, || wish.run(&file, progress.as_ref(), &mut raised));
    match done.or_raise_of(py, &file)? {
        None => Err(interrupted(raised)),
        Some((frames, losses)) => {
            let dict = PyDict::new(py);
            dict.set_item("frames", frames)?;
            dict.set_item("losses", losses)?;
            Ok(dict)
        }
    }
}

/// What goes from where to where.
struct Wish<'a> {
    spec: SourceSpec,
    given: Option<&'a PyBody>,
    options: VendorOptions,
    cut: Cut,
    scene: &'a PyScene,
    calibration: Option<&'a PyCalibration>,
    backend: Option<BackendKind>,
    sink: SinkSpec,
    force: bool,
    all_fields: bool,
    header: bool,
    wide: bool,
    label: String,
}

impl Wish<'_> {
    /// Runs it; gives how many frames there were, and what was lost. None where Python raised something.
    fn run(
        &self,
        file: &Path,
        progress: Option<&Progress>,
        raised: &mut Option<PyErr>,
    ) -> Result<Option<(u64, Vec<String>)>, Error> {
        let (source, own, text) = open(&self.spec, self.given, &self.options, self.cut)?;
        let Some(body) = self.given.or(own.as_ref()) else {
            return Err(Error::usage("it has no body; give body=").at(file.display()));
        };
        let its_own = text.map(|text| PyCalibration::of_text(&text, body)).transpose()?;
        let laid = match (self.calibration, &its_own) {
            (Some(given), Some(own)) => Some(given.over(own, &file.display().to_string(), body)?),
            _ => None,
        };
        let laid = laid.map(|(both, lines)| {
            *raised = Python::attach(|py| warn(py, lines)).err();
            both
        });
        if raised.is_some() {
            return Ok(None);
        }
        let calibration = laid.as_ref().or(self.calibration).or(its_own.as_ref());
        let options = self.scene.options(calibration.map(|it| &it.inner), self.backend, BATCH)?;
        let mut engine = Engine::new(&body.inner, options)?;
        engine.set_channels(source.taxels()).map_err(|e| e.at("header").at(file.display()))?;
        let text = calibration.map(|calibration| calibration.text.as_str());
        let about = Run::new(&engine, &body.inner, &body.bytes, &self.scene.text, text);
        let mut session = about.session(&self.label, self.all_fields, true);
        (session.is_recorded, session.header) = (true, self.header);
        let target = self.sink.target(&mut OutputPaths::new(self.force, [file]), &[], about.tables(self.wide))?;
        let sink = target.open(&session)?;
        let feed = Feed::start(source, ReadMode { most: BATCH, gather: true, speed: None });
        let mut run = Running::new(engine, feed, vec![sink], RunOptions::default());
        let stop = AtomicBool::new(false);
        let mut caller = Caller { progress, frames: 0, stop: &stop, raised: None };
        let ending = run.run(&mut caller, || stop.load(Ordering::Relaxed))?;
        *raised = caller.raised;
        if raised.is_some() {
            return Ok(None);
        }
        let outcome = run.finish(ending)?;
        Ok(Some((outcome.frames, outcome.losses)))
    }
}

/// The caller of `run`, who gets its progress and warnings.
struct Caller<'a> {
    progress: Option<&'a Progress>,
    frames: usize,
    /// Ends the run.
    stop: &'a AtomicBool,
    /// What the caller has raised meanwhile.
    raised: Option<PyErr>,
}

impl Caller<'_> {
    fn heed(&mut self, result: PyResult<()>) {
        if let Err(error) = result {
            self.stop.store(true, Ordering::Relaxed);
            self.raised.get_or_insert(error);
        }
    }
}

impl Observer for Caller<'_> {
    fn remark(&mut self, kind: Remark, text: &str) {
        if kind == Remark::Warning {
            let result = Python::attach(|py| warn(py, Some(text.to_owned())));
            self.heed(result);
        }
    }

    fn computed(&mut self, _: &Engine, frames: &[Frame], _: &FrameInfo) {
        self.frames += frames.len();
    }

    fn written(&mut self, _: &[Instant]) {
        let result = Python::attach(|py| {
            let frames = self.frames;
            self.progress.map_or(Ok(()), |progress| progress.tell(py, (frames,)))
        });
        self.heed(result);
    }

    fn turned(&mut self) {
        #[expect(clippy::redundant_closure_for_method_calls, reason = "the method alone is for one lifetime")]
        let result = Python::attach(|py| py.check_signals());
        self.heed(result);
    }
}

/// What a file in Parquet says of itself, by key: which body, scene and calibration it was made with, from what.
///
/// >>> import somatic_touch as st
/// >>> st.metadata("no.parquet")
/// Traceback (most recent call last):
///     ...
/// somatic_touch.InputError: no.parquet: no such file or directory
#[pyfunction]
pub(crate) fn metadata<'py>(py: Python<'py>, path: PathBuf) -> PyResult<Bound<'py, PyDict>> {
    use parquet::arrow::arrow_reader::ParquetRecordBatchReaderBuilder;
    let file = std::fs::File::open(&path).map_err(|e| Error::io(&path, &e)).or_raise_of(py, &path)?;
    let read = ParquetRecordBatchReaderBuilder::try_new(file);
    let read = read.map_err(|why| Error::failed(format!("this is not a whole Parquet file: {why}")).at(path.display()));
    let dict = PyDict::new(py);
    let schema = Arc::clone(read.or_raise_of(py, &path)?.schema());
    for (key, value) in schema.metadata() {
        dict.set_item(key, value)?;
    }
    Ok(dict)
}
