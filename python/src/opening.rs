//! Files that are opened, with the body and the calibration that come with them.

use std::path::{Path, PathBuf};

use pyo3::prelude::*;
use somatic::internal::recording::{BODY, CALIBRATION};
use somatic::internal::robot::BagSource;
use somatic::internal::setup::open_mapped;
use somatic::internal::signal::UnitOfP;
use somatic::internal::source::ArrayMap;
use somatic::recording::Reader;
use somatic::source::{CsvSource, Cut, Replay, Source, SourceSpec, VendorFormat, VendorOptions, VendorSource};
use somatic::{Calibration, Error, bundled};

use crate::body::PyBody;
use crate::calibration::PyCalibration;
use crate::error::{OrRaise, usage};
use crate::recording::{Frames, PyRecording};

/// A path, or a text such as `csv:FILE`.
pub(crate) fn text_of(source: &Bound<'_, PyAny>) -> PyResult<String> {
    match source.extract::<String>() {
        Ok(text) => Ok(text),
        Err(_) => Ok(source.extract::<PathBuf>()?.display().to_string()),
    }
}

/// A `Body`, or the one that a name says: of a file, or of a bundled one.
#[pyfunction]
#[pyo3(name = "_body")]
pub(crate) fn body_of(py: Python<'_>, body: &Bound<'_, PyAny>) -> PyResult<Py<PyBody>> {
    if let Ok(body) = body.cast::<PyBody>() {
        return Ok(body.clone().unbind());
    }
    match text_of(body) {
        Ok(name) => Py::new(py, PyBody::bundled_or_file(&name).or_raise_of(py, Path::new(&name))?),
        Err(_) => Err(usage(py, "body should be a Body, or its file's name")),
    }
}

/// A body's name and file.
type NamedBytes = (String, Vec<u8>);

/// The body in the recording at `path`, and the text of its calibration.
fn attached(path: &Path) -> somatic::Result<(Option<NamedBytes>, Option<String>)> {
    let mut reader = Reader::open(path)?;
    let body = reader.find_attached(|attached| attached.media_type == BODY)?;
    let body = body.map(|(attached, bytes)| (attached.name, bytes));
    let calibration = reader.find_attached(|attached| attached.name == CALIBRATION)?;
    let text = calibration.map(|(_, bytes)| String::from_utf8(bytes)).transpose();
    let text = text.map_err(|_| Error::failed("the attached calibration is not text").at(path.display()))?;
    Ok((body, text.map(|text| Calibration::with_names_of_now(text).0)))
}

/// Opens the source and finds what comes with it: the source, its body, the text of its calibration.
pub(crate) type Opened = (Box<dyn Source + Send>, Option<PyBody>, Option<String>);

pub(crate) fn open(
    spec: &SourceSpec,
    body: Option<&PyBody>,
    options: &VendorOptions,
    cut: Cut,
) -> somatic::Result<Opened> {
    let (own, calibration) = match spec {
        // What is live has no end: a read of it would not return.
        _ if options.map.is_some() && spec.is_recording() => return open_by_map(spec, body, options, cut),
        SourceSpec::Mcap(path) if options.skip_bad => {
            let what = "skip_bad is for CSV, exports and ROS 2 bags; leave it out here";
            return Err(Error::usage(what).at(path.display()));
        }
        SourceSpec::Mcap(path) => attached(path)?,
        SourceSpec::Vendor(path) => {
            let export = VendorSource::open(path, options)?;
            // Of another body than its own it would be refused by name.
            let text = export.calibration().map(|text| match body {
                None => text,
                Some(_) => text.lines().filter(|line| !line.starts_with("body")).collect::<Vec<_>>().join("\n"),
            });
            (Some((export.body_name(), export.body()?)), text)
        }
        SourceSpec::Sim(_) => {
            return Err(Error::usage("a simulation has a truth too; read it with `simulate`"));
        }
        SourceSpec::Ros2Mcap(bag) => {
            let Some(body) = body else {
                return Err(Error::usage("a bag has frames of a robot; give its body=").at(bag));
            };
            spec.check_options(options)?;
            let (bag, body, skip_bad) = (bag.clone(), body.inner.clone(), options.skip_bad);
            let open = move || -> somatic::Result<Box<dyn Source + Send>> {
                Ok(Box::new(BagSource::open(&bag, &body)?.skip_bad(skip_bad)))
            };
            let source = if cut == Cut::WHOLE { open()? } else { Box::new(Replay::new(open, cut)?) };
            return Ok((source, None, None));
        }
        SourceSpec::LeRobot(_) => {
            return Err(Error::usage("it is a LeRobot dataset; read it with somatic_touch.lerobot.read").at(spec));
        }
        SourceSpec::Csv(_) => (None, None),
        _ => {
            let what = "only recordings are read here; somatic_touch.live gives percepts of it as its frames come";
            return Err(Error::usage(what).at(spec));
        }
    };
    // A recording's calibration is that of its body.
    let calibration = calibration.filter(|_| body.is_none() || matches!(spec, SourceSpec::Vendor(_)));
    let own = own.filter(|_| body.is_none()).map(|(name, bytes)| PyBody::of_bytes(&name, bytes)).transpose()?;
    let ids = body.or(own.as_ref()).map(PyBody::channels).unwrap_or_default();
    let (again, kept) = (spec.clone(), options.clone());
    let open = move || again.open(&ids, &kept);
    let source = if cut == Cut::WHOLE { open()? } else { Box::new(Replay::new(open, cut)?) };
    Ok((source, own, calibration))
}

/// The same by the map of `options`, with the body that the map describes where none is given.
fn open_by_map(spec: &SourceSpec, body: Option<&PyBody>, options: &VendorOptions, cut: Cut) -> somatic::Result<Opened> {
    let own = match body {
        None => Some(PyBody::of_bytes("map.glb", open_mapped(spec, options)?.body()?)?),
        Some(_) => None,
    };
    let (ids, again, kept) = (body.map(PyBody::channels), spec.clone(), options.clone());
    let open = move || -> somatic::Result<Box<dyn Source + Send>> {
        let mapped = open_mapped(&again, &kept)?;
        Ok(Box::new(match &ids {
            Some(ids) => mapped.for_body(ids)?,
            None => mapped,
        }))
    };
    let source = if cut == Cut::WHOLE { open()? } else { Box::new(Replay::new(open, cut)?) };
    Ok((source, own, None))
}

/// The keywords of `read`, `open`, `info` and `convert`.
#[derive(Default)]
pub(crate) struct Keys<'a, 'py> {
    pub(crate) body: Option<&'a Bound<'py, PyAny>>,
    pub(crate) from_s: Option<f64>,
    pub(crate) to_s: Option<f64>,
    pub(crate) rate_hz: Option<f64>,
    pub(crate) format: Option<&'a str>,
    pub(crate) grid: Option<&'a str>,
    pub(crate) pitch: Option<&'a str>,
    pub(crate) unit: Option<&'a str>,
    pub(crate) layout: Option<PathBuf>,
    pub(crate) skip_bad: bool,
    pub(crate) map: Option<&'a str>,
}

impl Keys<'_, '_> {
    /// The part that is read.
    pub(crate) fn cut(&self) -> Cut {
        let Self { from_s, to_s, .. } = self;
        Cut { from_s: from_s.unwrap_or(Cut::WHOLE.from_s), to_s: to_s.unwrap_or(Cut::WHOLE.to_s), times: 1 }
    }

    /// How tables and exports are read.
    pub(crate) fn options(&self) -> somatic::Result<VendorOptions> {
        let Self { rate_hz, format, grid, pitch, unit, layout, skip_bad, map, .. } = self;
        Ok(VendorOptions {
            format: format.map(str::parse::<VendorFormat>).transpose().map_err(|e| e.at("format"))?,
            rate_hz: *rate_hz,
            grid: grid.map(VendorOptions::grid_of).transpose().map_err(|e| e.at("grid"))?,
            pitch_m: pitch.map(VendorOptions::pitch_of).transpose().map_err(|e| e.at("pitch"))?,
            unit: unit.map(str::parse::<UnitOfP>).transpose().map_err(|e| e.at("unit"))?,
            layout: layout.clone(),
            skip_bad: *skip_bad,
            map: map.map(ArrayMap::named).transpose().map_err(|e| e.at("map"))?,
            ..VendorOptions::default()
        })
    }
}

/// A file that is open, with what comes with it.
pub(crate) struct Opening {
    pub(crate) name: String,
    pub(crate) file: PathBuf,
    pub(crate) source: Box<dyn Source + Send>,
    pub(crate) body: Option<Py<PyBody>>,
    pub(crate) calibration: Option<Py<PyCalibration>>,
}

impl Opening {
    /// These frames of it.
    pub(crate) fn recording(&self, py: Python<'_>, frames: Frames) -> PyResult<PyRecording> {
        let body = self.body.as_ref().map(|body| body.clone_ref(py));
        let calibration = self.calibration.as_ref().map(|calibration| calibration.clone_ref(py));
        frames.finish(py, self.name.clone(), &*self.source, body, calibration, false)
    }

    pub(crate) fn new(py: Python<'_>, source: &Bound<'_, PyAny>, keys: Keys<'_, '_>) -> PyResult<Self> {
        let text = text_of(source)?;
        let body = keys.body.map(|body| body_of(py, body)).transpose()?;
        let cut = keys.cut();
        let made = || -> somatic::Result<(VendorOptions, SourceSpec)> {
            let options = keys.options()?;
            let spec = text.parse::<SourceSpec>()?.with_content(&options);
            Ok((options, spec))
        };
        let bundled_touch = match &text[..] {
            "hand" => Some((bundled::TOUCH, None)),
            "sensing-hand" => Some((bundled::MEETING, Some(bundled::MEETING_CALIBRATION))),
            _ => None,
        };
        if let Some((bytes, calibration)) = bundled_touch.filter(|_| body.is_none()) {
            let touch = move || -> somatic::Result<Box<dyn Source + Send>> {
                Ok(Box::new(CsvSource::from_reader("bundled touch", bytes, None, None)?))
            };
            let source =
                if cut == Cut::WHOLE { touch() } else { Replay::new(touch, cut).map(|cut| Box::new(cut) as _) };
            let source = source.or_raise(py)?;
            let body = PyBody::bundled_or_file(&text).or_raise(py)?;
            let calibration = calibration.map(|text| PyCalibration::of_text(text, &body)).transpose().or_raise(py)?;
            let calibration = calibration.map(|calibration| Py::new(py, calibration)).transpose()?;
            let (name, file, body) = ("bundled touch".to_owned(), PathBuf::new(), Some(Py::new(py, body)?));
            return Ok(Self { name, file, source, body, calibration });
        }
        let (options, spec) = made().or_raise(py)?;
        let given = body.as_ref().map(Py::get);
        let file = spec.file().unwrap_or(Path::new("")).to_owned();
        let (source, own, calibration) = open(&spec, given, &options, cut).or_raise_of(py, &file)?;
        let body = match (body, own) {
            (Some(body), _) => Some(body),
            (None, own) => own.map(|own| Py::new(py, own)).transpose()?,
        };
        let calibration = match (&body, calibration) {
            (Some(body), Some(text)) => {
                let made = PyCalibration::of_text(&text, body.get())
                    .map_err(|e| e.at("its own calibration").at(file.display()));
                Some(Py::new(py, made.or_raise_of(py, &file)?)?)
            }
            _ => None,
        };
        Ok(Self { name: file.display().to_string(), file, source, body, calibration })
    }
}
