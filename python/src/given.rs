//! What a measurement is made on: a recording in memory or in a file, boards, or a simulation.

use std::vec::IntoIter;

use pyo3::prelude::*;
use somatic::internal::setup::open_mapped;
use somatic::internal::tradeoff::TestFrames;
use somatic::scene::file::LineKeys;
use somatic::source::{Lines, SimulatedSource, Source, SourceSpec, TextSource, VendorOptions};
use somatic::{Error, Frame, Result};

use crate::body::PyBody;
use crate::calibration::PyCalibration;
use crate::error::{OrRaise, usage, warn};
use crate::opening::{Keys, Opening, body_of, text_of};
use crate::recording::{Frames, PyRecording};
use crate::simulation;
use crate::threads::{free, waiting};

/// Frames in memory, as a source.
pub(crate) struct InMemory {
    taxels: Vec<u32>,
    frames: IntoIter<Frame>,
}

impl InMemory {
    pub(crate) fn from_recording(py: Python<'_>, recording: &PyRecording) -> PyResult<Self> {
        let frames = recording.first_frames(py, usize::MAX)?.into_iter();
        Ok(Self { taxels: recording.channels.clone(), frames })
    }
}

impl Source for InMemory {
    fn taxels(&self) -> &[u32] {
        &self.taxels
    }

    fn next_frame(&mut self, frame: &mut Frame) -> Result<bool> {
        let next = self.frames.next();
        let is_there = next.is_some();
        if let Some(next) = next {
            *frame = next;
        }
        Ok(is_there)
    }
}

/// A body, its calibration, and frames to measure on if there are some.
pub(crate) struct Given {
    pub(crate) body: Py<PyBody>,
    pub(crate) calibration: Option<Py<PyCalibration>>,
    pub(crate) played: Option<TestFrames>,
}

impl Given {
    /// What `source` has. The first frames are read: as many as `most` gives for its number of taxels.
    pub(crate) fn new(
        py: Python<'_>,
        body: Option<&Bound<'_, PyAny>>,
        source: Option<&Bound<'_, PyAny>>,
        calibration: Option<&Bound<'_, PyCalibration>>,
        most: impl Fn(usize) -> usize,
    ) -> PyResult<Self> {
        let given = calibration.map(|calibration| calibration.clone().unbind());
        let Some(source) = source else {
            let body = match body {
                Some(body) => body_of(py, body)?,
                None => Py::new(py, PyBody::bundled_or_file("hand").or_raise(py)?)?,
            };
            return Ok(Self { body, calibration: given, played: None });
        };
        if let Ok(recording) = source.cast::<PyRecording>() {
            return Self::of_recording(py, recording.get(), body, calibration, most);
        }
        if let Ok(SourceSpec::Sim(path)) = &text_of(source)?.parse() {
            if body.is_some() {
                return Err(usage(py, "a simulation names its body; leave body= out, or change the simulation's"));
            }
            let mut simulation = SimulatedSource::open(path).or_raise_of(py, path)?;
            let body = simulation::body_of(&simulation, path, None).or_raise(py)?;
            let own = PyCalibration::of_text(&simulation.calibration(), &body).or_raise(py)?;
            let calibration = given.map_or_else(|| Py::new(py, own), Ok)?;
            let (name, most) = (path.display().to_string(), most(body.inner.taxels.len()));
            let played = free(py, || TestFrames::simulated(&name, &mut simulation, most)).or_raise(py)?;
            return Ok(Self { body: Py::new(py, body)?, calibration: Some(calibration), played: Some(played) });
        }
        let mut opening = Opening::new(py, source, Keys { body, ..Keys::default() })?;
        let Some(body) = opening.body.as_ref().map(|body| body.clone_ref(py)) else {
            return Err(usage(py, format!("{}: it has no body; give body=", opening.name)));
        };
        let about = opening.recording(py, Frames::default())?;
        let calibration = about.calibrated(py, calibration, body.get())?;
        let (name, most) = (opening.name.clone(), most(body.get().inner.taxels.len()));
        let played = free(py, || TestFrames::read(&name, &mut *opening.source, most));
        Ok(Self { played: Some(played.or_raise_of(py, &opening.file)?), body, calibration })
    }

    fn of_recording(
        py: Python<'_>,
        recording: &PyRecording,
        body: Option<&Bound<'_, PyAny>>,
        calibration: Option<&Bound<'_, PyCalibration>>,
        most: impl Fn(usize) -> usize,
    ) -> PyResult<Self> {
        // A recording's calibration is that of its body.
        let (body, calibration) = match (body, &recording.body) {
            (Some(body), _) => (body_of(py, body)?, calibration.map(|given| given.clone().unbind())),
            (None, Some(own)) => (own.clone_ref(py), recording.calibrated(py, calibration, own.get())?),
            (None, None) => return Err(usage(py, format!("{}: it has no body; give body=", recording.name))),
        };
        let frames = recording.first_frames(py, most(recording.channels.len()))?;
        let (source, taxels) = (recording.name.clone(), recording.channels.clone());
        Ok(Self { body, calibration, played: Some(TestFrames { source, taxels, frames, truth: Vec::new() }) })
    }
}

/// A source that is open, of a recording or of boards.
pub(crate) struct OpenSource {
    pub(crate) source: Box<dyn Source + Send>,
    /// Of boards.
    pub(crate) lines: Option<Lines>,
    pub(crate) is_live: bool,
}

impl OpenSource {
    /// Opens `source`, a recording, or one or several names, for a body with the channels `ids`; what is found out of lines of text is a
    /// warning.
    pub(crate) fn new(
        py: Python<'_>,
        source: &Bound<'_, PyAny>,
        ids: &[u32],
        keys: &LineKeys,
        options: &VendorOptions,
    ) -> PyResult<Self> {
        if let Ok(recording) = source.cast::<PyRecording>() {
            let source = Box::new(InMemory::from_recording(py, recording.get())?);
            return Ok(Self { source, lines: None, is_live: false });
        }
        let names = match text_of(source) {
            Ok(name) => vec![name],
            Err(_) => source.try_iter()?.map(|name| text_of(&name?)).collect::<PyResult<_>>()?,
        };
        let (ids, keys, options) = (ids.to_vec(), keys.clone(), options.clone());
        // A board may not answer, or a device have no value yet.
        let opened = waiting(py, move || Self::named(&names, &ids, &keys, &options));
        let (opened, notices) = opened?.or_raise(py)?;
        warn(py, notices)?;
        Ok(opened)
    }

    /// The same of `names`; with what is to be said of it.
    fn named(names: &[String], ids: &[u32], keys: &LineKeys, options: &VendorOptions) -> Result<(Self, Vec<String>)> {
        let mut notices = Vec::new();
        let specs = names.iter().map(|name| name.parse()).collect::<Result<Vec<SourceSpec>>>()?;
        let ports = keys.lines(&specs)?;
        if !ports.is_empty() {
            let source = keys.open(&ports, ids, None)?;
            let lines = Some(source.lines());
            return Ok((Self { source: Box::new(source), lines, is_live: true }, notices));
        }
        let Some(spec) = specs.into_iter().next() else { return Err(Error::usage("give a source")) };
        let is_live = !spec.is_recording();
        let source: Box<dyn Source + Send> = match (&spec, &options.map) {
            (SourceSpec::Text(place), _) => {
                spec.check_options(options)?;
                let mut say = |what: &str| notices.push(what.to_owned());
                Box::new(TextSource::open(place, options, &mut say)?.for_body(ids)?)
            }
            (_, Some(_)) => {
                let mut mapped = open_mapped(&spec.with_content(options), options)?;
                notices.extend(mapped.take_notices());
                Box::new(mapped.for_body(ids)?)
            }
            (_, None) => spec.with_content(options).open(ids, options)?,
        };
        Ok((Self { source, lines: None, is_live }, notices))
    }
}
