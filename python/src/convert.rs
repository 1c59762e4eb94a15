//! `convert`: a recording or a skin in another format.

use std::path::{Path, PathBuf};

use pyo3::prelude::*;
use somatic::internal::author::mesh::urdf_of_skin;
use somatic::internal::body::taxel_table;
use somatic::internal::recording::{BODY, CALIBRATION};
use somatic::internal::source::CsvFile;
use somatic::output::OutputPaths;
use somatic::recording::Recorder;
use somatic::source::{Cut, Source, SourceSpec, VendorOptions};
use somatic::{Error, Frame, OutputPath, Result, bundled};

use crate::body::PyBody;
use crate::calibration::PyCalibration;
use crate::error::{OrRaise, interrupted, warn};
use crate::given::InMemory;
use crate::opening::{body_of, open, text_of};
use crate::recording::PyRecording;
use crate::threads::free;

/// Frames that are copied until Ctrl-C is heard.
const FRAMES_BETWEEN: usize = 1 << 10;

enum Target {
    Csv(CsvFile),
    Mcap(Box<Recorder>),
}

impl Target {
    fn frame(&mut self, frame: &Frame) -> Result<()> {
        match self {
            Self::Csv(file) => file.frame(frame),
            Self::Mcap(recorder) => recorder.frame(frame),
        }
    }
}

/// What is copied, and what lies beside it.
struct Copied {
    source: Box<dyn Source + Send>,
    body: Option<PyBody>,
    calibration: Option<String>,
}

/// The file `to` as the format that its name says.
fn target_of(to: &str) -> Result<(SourceSpec, PathBuf)> {
    let spec = SourceSpec::one_of(to, &["csv", "mcap"]).map_err(|e| e.at(format!("output `{to}`")))?;
    let path = spec.file().unwrap_or(Path::new("")).to_owned();
    Ok((spec, path))
}

impl Copied {
    /// Copies all to `to`; gives how many frames, and what is to be said of it. None where Ctrl-C ended it.
    fn copy(
        mut self,
        to: &SourceSpec,
        output: OutputPath,
        raised: &mut Option<PyErr>,
    ) -> Result<Option<(u64, Vec<String>)>> {
        self.source.report_stale();
        let is_csv = matches!(to, SourceSpec::Csv(_));
        let mut target = match is_csv {
            true => Target::Csv(CsvFile::create(output, self.source.taxels())?),
            false => {
                let mut recorder = Recorder::create_whole(output, self.source.taxels())?;
                if let Some(body) = &self.body {
                    let name = Path::new(&body.inner.name).file_name().map(|name| name.to_string_lossy().into_owned());
                    recorder.attach(&name.unwrap_or_default(), BODY, &body.bytes)?;
                }
                if let Some(text) = &self.calibration {
                    recorder.attach(CALIBRATION, "application/toml", text.as_bytes())?;
                }
                Target::Mcap(Box::new(recorder))
            }
        };
        let mut frame = Frame::missing(0.0, self.source.taxels().len());
        let (mut frames, mut posed) = (0_u64, 0_u64);
        while self.source.next_frame(&mut frame)? {
            target.frame(&frame)?;
            frames += 1;
            posed += u64::from(!frame.pose.is_empty());
            if frames.is_multiple_of(FRAMES_BETWEEN as u64) {
                *raised = Python::attach(|py| py.check_signals().err());
                if raised.is_some() {
                    return Ok(None);
                }
            }
        }
        match target {
            Target::Csv(file) => file.finish()?,
            Target::Mcap(recorder) => recorder.finish()?,
        }
        let mut said = self.source.losses();
        if is_csv && posed > 0 {
            said.push(format!("a CSV has no place for poses: those of {posed} frames are left out"));
        }
        if is_csv && self.source.has_stale() {
            said.push("a CSV cannot mark stale values: they are missing there".to_owned());
        }
        if is_csv && (self.body.is_some() || self.calibration.is_some()) {
            said.push("a CSV has no place for a body and a calibration: they are left out".to_owned());
        }
        Ok(Some((frames, said)))
    }
}

/// Writes the taxels of `body` to `path`; gives how many, and what is to be said of it.
fn skin(body: &PyBody, path: &Path, force: bool) -> Result<(u64, Vec<String>)> {
    let ending = path.extension().map(|ending| ending.to_string_lossy().to_ascii_lowercase());
    let is_table = match ending.as_deref() {
        Some("csv") => true,
        Some("urdf") => false,
        _ => return Err(Error::usage("the skin of a body becomes a .csv or a .urdf").at(path.display())),
    };
    let body = &*body.inner;
    if body.taxels.is_empty() {
        return Err(Error::failed("it has no taxels; place some on it, with `author`").at(&body.name));
    }
    let (text, mut said) = if is_table { (taxel_table(body), Vec::new()) } else { urdf_of_skin(body) };
    OutputPath::new(path, force, &[])?.write(text.as_bytes())?;
    if !body.fields.is_empty() {
        let what = if is_table { "table" } else { "URDF" };
        said.push(format!("a {what} has no place for fields: {} left out", body.fields.len()));
    }
    Ok((body.taxels.len() as u64, said))
}

/// Turns a recording or a skin into another format, as `somatic convert` does.
///
/// Parameters
/// ----------
/// source : Recording, Body, str or path
///     A recording as for `read`, or a body: a `Body`, a .glb or .gltf, or the name of a bundled one.
/// to : str or path
///     Of a recording a .csv or a .mcap, of a body a .csv or a .urdf.
/// body, calibration : Body or path, and Calibration, optional
///     What an MCAP gets beside its frames; by default what comes with the recording.
/// force : bool
///     Whether a file that exists is replaced.
///
/// Returns
/// -------
/// int
///     How many frames or taxels were read. What has no place in the other format is a warning.
///
/// Examples
/// --------
/// >>> import pathlib, tempfile
/// >>> import somatic_touch as st
/// >>> folder = pathlib.Path(tempfile.mkdtemp())
/// >>> st.convert(st.read("hand"), folder / "touch.mcap")
/// 280
/// >>> len(st.read(folder / "touch.mcap").body.taxels)
/// 40
#[pyfunction]
#[pyo3(signature = (source, to, *, body = None, calibration = None, rate_hz = None, force = false))]
pub(crate) fn convert(
    py: Python<'_>,
    source: &Bound<'_, PyAny>,
    to: &Bound<'_, PyAny>,
    body: Option<&Bound<'_, PyAny>>,
    calibration: Option<&PyCalibration>,
    rate_hz: Option<f64>,
    force: bool,
) -> PyResult<u64> {
    let to = text_of(to)?;
    let body = body.map(|body| body_of(py, body)).transpose()?;
    let skinned = match source.cast::<PyBody>() {
        Ok(skinned) => Some(skinned.clone().unbind()),
        Err(_) => match text_of(source) {
            Ok(name) if name.ends_with(".glb") || name.ends_with(".gltf") || bundled::body(&name).is_some() => {
                Some(body_of(py, source)?)
            }
            _ => None,
        },
    };
    if let Some(skinned) = skinned {
        let path = Path::new(to.strip_prefix("csv:").unwrap_or(&to));
        let (taxels, said) = free(py, || skin(skinned.get(), path, force)).or_raise_of(py, path)?;
        warn(py, said)?;
        return Ok(taxels);
    }
    let (spec, path) = target_of(&to).or_raise(py)?;
    let (read, mut copied): (Option<PathBuf>, Copied) = match source.cast::<PyRecording>() {
        Ok(recording) => {
            let known = recording.get();
            let own = known.body.as_ref().map(|body| body.get().clone());
            let text = known.calibration.as_ref().map(|calibration| calibration.get().text.clone());
            (None, Copied { source: Box::new(InMemory::from_recording(py, known)?), body: own, calibration: text })
        }
        Err(_) => {
            let options = VendorOptions { rate_hz, ..VendorOptions::default() };
            let from = text_of(source)?.parse::<SourceSpec>().or_raise(py)?.with_content(&options);
            let file = from.file().map(Path::to_owned);
            let given = body.as_ref().map(Py::get);
            let opened = free(py, || open(&from, given, &options, Cut::WHOLE));
            let (source, own, text) = opened.or_raise_of(py, file.as_deref().unwrap_or(Path::new("")))?;
            (file, Copied { source, body: own, calibration: text })
        }
    };
    copied.body = body.map(|body| body.get().clone()).or(copied.body);
    copied.calibration = calibration.map(|calibration| calibration.text.clone()).or(copied.calibration);
    let mut raised = None;
    let done = free(py, || {
        let output = OutputPaths::new(force, &read).add(&path)?;
        copied.copy(&spec, output, &mut raised)
    });
    match done.or_raise_of(py, &path)? {
        Some((frames, said)) => warn(py, said).map(|()| frames),
        None => Err(interrupted(raised)),
    }
}
