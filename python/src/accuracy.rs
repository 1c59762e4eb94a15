//! `_tradeoff`, `_calibrate` and `_gains`: what the package's functions make tables of.

use std::path::{Path, PathBuf};
use std::time::Duration;

use pyo3::prelude::*;
use serde_json::json;
use somatic::internal::gains::GainsSurvey;
use somatic::internal::run::{Arrival, Feed, ReadMode};
use somatic::internal::setup::bodies::in_body;
use somatic::internal::signal::UnitOfP;
use somatic::internal::source::ArrayMap;
use somatic::internal::survey::gains::{layer_under, with_gains};
use somatic::internal::survey::known::{KnownForces, PressedOn};
use somatic::internal::survey::{Findings, Survey, Wishes};
use somatic::internal::tradeoff::{CallMode, MeasureOptions, Target, Tested, Words, software, time, usual_frames};
use somatic::scene::file::{LineKeys, TextKeys};
use somatic::source::{SourceSpec, VendorOptions, VendorSource};
use somatic::{BackendKind, Body, Calibration, Error, Frame, OutputPath, RawValue};

use crate::body::PyBody;
use crate::calibration::PyCalibration;
use crate::error::{OrRaise, interrupted, usage, warn};
use crate::given::{Given, OpenSource};
use crate::opening::text_of;
use crate::progress::Progress;
use crate::scene::PyScene;
use crate::threads::free;

/// Frames of a call, unless the scene says otherwise.
const BATCH: usize = 256;
/// Frames that are taken at once.
const TAKEN: usize = 256;
/// How long a live source is waited for until Ctrl-C is heard.
const WAIT: Duration = Duration::from_millis(40);

/// Says to Python how far a call is; what Python raises is kept, and ends the call.
fn tell(progress: Option<&Progress>, raised: &mut Option<PyErr>, share: f64) -> bool {
    let heard = Python::attach(|py| {
        py.check_signals()?;
        progress.map_or(Ok(()), |progress| progress.tell(py, (share,)))
    });
    *raised = heard.err();
    raised.is_none()
}

/// What a pick should meet.
fn target_of(within: Option<&str>, budget: Option<&str>) -> somatic::Result<Target> {
    let within = within.map(Target::within).transpose().map_err(|e| e.at("within"))?.unwrap_or_default();
    let budget_s = budget.map(time).transpose().map_err(|e| e.at("budget"))?;
    Ok(within.or(Target { budget_s, ..Target::default() }))
}

#[pyfunction]
#[pyo3(name = "_tradeoff")]
#[expect(clippy::too_many_arguments, reason = "they are the keywords of `tradeoff`")]
pub(crate) fn tradeoff(
    py: Python<'_>,
    body: Option<&Bound<'_, PyAny>>,
    scene: Option<&Bound<'_, PyAny>>,
    source: Option<&Bound<'_, PyAny>>,
    calibration: Option<&Bound<'_, PyCalibration>>,
    backend: Option<&str>,
    seconds: f64,
    frames: Option<usize>,
    within: Option<&str>,
    budget: Option<&str>,
    progress: Option<Py<PyAny>>,
) -> PyResult<String> {
    if !(seconds.is_finite() && seconds > 0.0) {
        return Err(usage(py, format!("seconds should be a positive number; this is {seconds}")));
    }
    let scene = PyScene::of_any(scene, py)?;
    let scene = scene.get();
    let backend = backend.map(str::parse::<BackendKind>).transpose().or_raise(py)?;
    let target = target_of(within, budget).or_raise(py)?;
    let most = |taxels: usize| frames.unwrap_or_else(|| usual_frames(taxels));
    let Given { body, calibration, played } = Given::new(py, body, source, calibration, most)?;
    let (body, calibration) = (body.get(), calibration.as_ref().map(Py::get));
    let progress = Progress::new(py, progress, Some(1.0), "")?;
    let mut raised = None;
    let measured = free(py, || {
        let body = &*body.inner;
        let options = scene.options(calibration.map(|calibration| &calibration.inner), backend, 1)?;
        let batch = scene.batch().unwrap_or(BATCH);
        let how = MeasureOptions::of_backend(options.backend, seconds, batch)?;
        let tested = Tested::new(body, &options, played, most(body.taxels.len()))?;
        let measured =
            tested.measure(body, &how, &mut |share| raised.is_none() && tell(progress.as_ref(), &mut raised, share));
        if raised.is_some() {
            return Ok(None);
        }
        let mut report = measured?;
        report.left_out.extend(software().filter(|_| options.backend == BackendKind::Auto));
        let way = if scene.batch().is_some_and(|batch| batch > 1) { CallMode::Batch } else { CallMode::Live };
        let broken = |e: serde_json::Error| Error::failed(e.to_string());
        let mut value = serde_json::to_value(&report).map_err(broken)?;
        let pick = if target.is_empty() { None } else { target.pick(&report, way) };
        if let Some(pick) = pick {
            value["pick"] = serde_json::to_value(pick.row).map_err(broken)?;
            value["missed"] = pick.missed.into();
        }
        Ok::<_, Error>(Some(value.to_string()))
    });
    match measured.or_raise(py)? {
        Some(text) => Ok(text),
        None => Err(interrupted(raised)),
    }
}

/// Writes the options that `pick` names, JSON of a row's words, into the scene file `path`.
#[pyfunction]
#[pyo3(name = "_write_pick")]
pub(crate) fn write_pick(
    py: Python<'_>,
    path: PathBuf,
    pick: &str,
    asked_by: &str,
    within: Option<&str>,
    budget: Option<&str>,
) -> PyResult<()> {
    let written = || -> somatic::Result<()> {
        let words: Words = serde_json::from_str(pick).map_err(|e| Error::failed(e.to_string()))?;
        let edit = OutputPath::edit(&path)?;
        somatic::internal::tradeoff::write_pick(edit, &words.in_scene(asked_by)?, &target_of(within, budget)?)
    };
    written().or_raise_of(py, &path)
}

/// The keywords of `calibrate`.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub(crate) struct Asked {
    rest_s: f64,
    press_s: Option<f64>,
    bits: Option<u8>,
    missing: Vec<f64>,
    equalise: bool,
    known: Option<String>,
    on: Option<String>,
    mask_moved: bool,
    rate_hz: Option<f64>,
    wiring: Option<PathBuf>,
    live_rate_hz: Option<f64>,
    board_rate_hz: Option<f64>,
    text: [Option<String>; 4],
    map: Option<String>,
}

impl Asked {
    fn options(&self) -> somatic::Result<VendorOptions> {
        let [columns, ids, frame_end, time] = self.text.clone();
        let mut keys = TextKeys::default();
        (keys.columns, keys.ids, keys.frame_end, keys.time) = (columns, ids, frame_end, time);
        let map = self.map.as_deref().map(ArrayMap::named).transpose().map_err(|e| e.at("map"))?;
        Ok(VendorOptions { rate_hz: self.rate_hz, text: keys.options()?, map, ..VendorOptions::default() })
    }

    fn lines(&self) -> LineKeys {
        let mut keys = LineKeys::default();
        keys.wiring.clone_from(&self.wiring);
        (keys.live_rate_hz, keys.board_rate_hz) = (self.live_rate_hz, self.board_rate_hz);
        keys
    }

    fn known(&self) -> somatic::Result<Option<(KnownForces, PressedOn)>> {
        match (&self.known, &self.on) {
            (Some(known), Some(on)) => {
                Ok(Some((known.parse().map_err(|e: Error| e.at("known"))?, on.parse().map_err(|e: Error| e.at("on"))?)))
            }
            (None, None) => Ok(None),
            _ => Err(Error::usage("a known force needs what it pressed on: give both known= and on=")),
        }
    }
}

/// A survey that is being made.
struct Taking<'a> {
    survey: Survey,
    asked: &'a Asked,
    begin_s: Option<f64>,
    is_pressing: bool,
}

impl Taking<'_> {
    /// Takes a frame; false when all was taken that was asked for.
    fn take(&mut self, frame: &mut Frame) -> bool {
        for value in &mut frame.values {
            if self.asked.missing.iter().any(|&code| *value == RawValue::new(code)) {
                *value = RawValue::MISSING;
            }
        }
        let since_s = frame.t_s - *self.begin_s.get_or_insert(frame.t_s);
        if since_s < self.asked.rest_s {
            self.survey.rest(&frame.values);
            return true;
        }
        self.is_pressing = true;
        if self.asked.press_s.is_some_and(|press_s| since_s >= self.asked.rest_s + press_s) {
            return false;
        }
        self.survey.press(&frame.values);
        true
    }
}

/// Takes rest and press from `opened`; gives what was lost. On a live source, `say` gets the instructions, and Ctrl-C ends the presses.
fn gather(
    py: Python<'_>,
    taking: &mut Taking<'_>,
    opened: OpenSource,
    say: &Bound<'_, PyAny>,
) -> PyResult<Vec<String>> {
    let OpenSource { source, lines, is_live } = opened;
    let guide = |what: String| if is_live { say.call1((what,)).map(drop) } else { Ok(()) };
    let mut feed = match &lines {
        Some(_) => Feed::start_live(source, 64),
        None => Feed::start(source, ReadMode { most: 64, gather: !is_live, speed: None }),
    };
    guide(format!("leave the robot alone for {} s", taking.asked.rest_s))?;
    let mut losses = Vec::new();
    loop {
        let arrival = free(py, || feed.next(WAIT));
        if let Some(lines) = &lines {
            warn(py, lines.notices().iter().map(ToString::to_string))?;
        }
        match arrival {
            Some(Arrival::Frames(mut frames, info)) => {
                warn(py, info.notices)?;
                losses = info.losses;
                let was_pressing = taking.is_pressing;
                let goes_on = frames.iter_mut().all(|frame| taking.take(frame));
                feed.give_back(frames);
                if taking.is_pressing && !was_pressing {
                    let how = if taking.asked.press_s.is_none() { "; Ctrl-C when all are done" } else { "" };
                    guide(format!("now press every sensor firmly{how}"))?;
                }
                if !goes_on {
                    break;
                }
            }
            Some(Arrival::End(ending)) => {
                losses = ending.losses;
                break;
            }
            Some(Arrival::Failed(error)) => return Err(error).or_raise(py),
            None | Some(Arrival::Woken) => {}
        }
        if let Err(raised) = py.check_signals() {
            let ends = is_live && taking.is_pressing && taking.asked.press_s.is_none();
            if ends && raised.is_instance_of::<pyo3::exceptions::PyKeyboardInterrupt>(py) {
                break;
            }
            return Err(raised);
        }
    }
    if let Some(lines) = &lines {
        lines.close();
    }
    Ok(losses)
}

/// What an export's values are in, as it says itself.
fn unit_of(source: &Bound<'_, PyAny>, options: &VendorOptions) -> somatic::Result<UnitOfP> {
    let text = text_of(source).unwrap_or_default();
    let spec = text.parse::<SourceSpec>().map(|spec| spec.with_content(options));
    match spec {
        Ok(SourceSpec::Vendor(path)) => Ok(VendorSource::open(path, options)?.layout().unit),
        _ => Ok(UnitOfP::COUNT),
    }
}

/// What a calibration calls `body`: its file's name without folder and ending.
fn name_of(body: &Body) -> String {
    Path::new(&body.name).file_stem().map_or_else(|| body.name.clone(), |stem| stem.to_string_lossy().into_owned())
}

#[pyfunction]
#[pyo3(name = "_calibrate")]
pub(crate) fn calibrate(
    py: Python<'_>,
    body: &PyBody,
    source: &Bound<'_, PyAny>,
    asked: Asked,
    say: &Bound<'_, PyAny>,
) -> PyResult<(String, String)> {
    if !(asked.rest_s > 0.0 && asked.press_s.is_none_or(|press_s| press_s > 0.0)) {
        return Err(usage(py, "rest and press should be over 0 s"));
    }
    let known = asked.known().or_raise(py)?;
    let options = asked.options().or_raise(py)?;
    let ids = body.channels();
    let opened = OpenSource::new(py, source, &ids, &asked.lines(), &options)?;
    let channels = in_body(&body.inner, &*opened.source).or_raise(py)?;
    let survey = Survey::new(&channels).on(&body.inner).or_raise(py)?;
    let unit = if opened.is_live { UnitOfP::COUNT } else { unit_of(source, &options).or_raise(py)? };
    let mut taking = Taking { survey, asked: &asked, begin_s: None, is_pressing: false };
    let losses = gather(py, &mut taking, opened, say)?;
    let found = || -> somatic::Result<(Findings, String)> {
        let Asked { bits, equalise, mask_moved, .. } = asked;
        let mut findings = taking.survey.finish(Wishes { bits, equalise, mask_moved })?;
        findings.missing.clone_from(&asked.missing);
        findings.unit = unit;
        if let Some((forces, on)) = known {
            findings.know(&forces, on)?;
        }
        let text = findings.calibration(&name_of(&body.inner));
        Ok((findings, text))
    };
    let (findings, text) = found().or_raise(py)?;
    let mut about = findings.json();
    let rows = about.as_object_mut().and_then(|about| about.remove("sensors"));
    about["rows"] = json!(rows);
    about["losses"] = json!(losses);
    Ok((about.to_string(), text))
}

#[pyfunction]
#[pyo3(name = "_gains")]
#[expect(clippy::too_many_arguments, reason = "each is a keyword of Python")]
pub(crate) fn gains(
    py: Python<'_>,
    body: &PyBody,
    source: &Bound<'_, PyAny>,
    calibration: &PyCalibration,
    stamp_m: Option<f64>,
    rate_hz: Option<f64>,
    map: Option<&str>,
    progress: Option<Py<PyAny>>,
) -> PyResult<(String, String)> {
    let ids = body.channels();
    let map = map.map(ArrayMap::named).transpose().map_err(|e| e.at("map")).or_raise(py)?;
    let options = VendorOptions { rate_hz, map, ..VendorOptions::default() };
    let OpenSource { mut source, is_live, .. } = OpenSource::new(py, source, &ids, &LineKeys::default(), &options)?;
    if is_live {
        return Err(usage(py, "gains are found from a recording; record what is live first"));
    }
    let progress = Progress::new(py, progress, Some(1.0), "")?;
    let mut raised = None;
    let done = free(py, || {
        let channels = in_body(&body.inner, &*source)?;
        let mut survey = GainsSurvey::new(&body.inner, calibration.inner.clone(), &channels)?;
        let mut frames = Vec::with_capacity(TAKEN);
        let mut frame = Frame::missing(0.0, channels.len());
        while source.next_frame(&mut frame)? {
            frames.push(frame.clone());
            if frames.len() == TAKEN {
                survey.add(&frames)?;
                frames.clear();
                // Reading is the lesser part.
                if !tell(progress.as_ref(), &mut raised, 0.2 * source.progress().unwrap_or(0.0)) {
                    return Ok(None);
                }
            }
        }
        survey.add(&frames)?;
        let mut estimate =
            survey.finish(&mut |share| raised.is_none() && tell(progress.as_ref(), &mut raised, 0.2 + 0.8 * share))?;
        if raised.is_some() {
            return Ok(None);
        }
        if let Some(radius_m) = stamp_m {
            estimate.sigma_m = layer_under(radius_m, estimate.width_m)?;
        }
        let kinds: Vec<_> = body.inner.taxels.iter().map(|taxel| (taxel.id, taxel.modality)).collect();
        let text = with_gains(&calibration.text, &kinds, &estimate)?;
        Calibration::parse_for(&text, &kinds).map_err(|e| e.at("the calibration that follows from these touches"))?;
        Ok::<_, Error>(Some((estimate, text, source.losses())))
    });
    let Some((estimate, text, losses)) = done.or_raise(py)? else { return Err(interrupted(raised)) };
    let rows = ids.iter().zip(&estimate.gains).zip(&estimate.pressed);
    let rows = rows.map(|((taxel, gain), pressed)| json!({"taxel": taxel, "gain": gain, "pressed": pressed}));
    let about = json!({
        "touches": estimate.touches, "width_m": estimate.width_m, "sigma_m": estimate.sigma_m, "left": estimate.left,
        "gain_spread": estimate.gain_spread, "losses": losses, "rows": rows.collect::<Vec<_>>(),
    });
    Ok((about.to_string(), text))
}
