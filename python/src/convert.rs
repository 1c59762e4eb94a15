//! `convert`: a recording or a skin in another format.

use std::path::{Path, PathBuf};

use pyo3::prelude::*;
use somatic::internal::convert::{FrameFile, SkinFormat, is_body};
use somatic::internal::recording::{BODY, CALIBRATION};
use somatic::output::OutputPaths;
use somatic::source::{Cut, Source, SourceSpec};
use somatic::{Error, OutputPath, Result};

use crate::body::PyBody;
use crate::calibration::PyCalibration;
use crate::error::{OrRaise, interrupted, warn};
use crate::given::InMemory;
use crate::opening::{Keys, body_of, open, text_of};
use crate::recording::PyRecording;
use crate::threads::{free, goes_on};

/// Frames that are copied until Ctrl-C is heard.
const FRAMES_BETWEEN: u64 = 1 << 10;

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
        let mut attached = Vec::new();
        if let Some(body) = &self.body {
            let name = Path::new(&body.inner.name).file_name().map(|name| name.to_string_lossy().into_owned());
            attached.push((name.unwrap_or_default(), BODY.to_owned(), body.bytes.to_vec()));
        }
        if let Some(text) = &self.calibration {
            attached.push((CALIBRATION.to_owned(), "application/toml".to_owned(), text.clone().into_bytes()));
        }
        let taxels = self.source.taxels().to_vec();
        let source = &mut *self.source;
        let mut file = match to {
            SourceSpec::Csv(_) => FrameFile::csv(output, &taxels)?,
            _ => FrameFile::mcap(output, &taxels, &attached)?,
        };
        let copied =
            file.copy(source, |frames, _| frames == 0 || !frames.is_multiple_of(FRAMES_BETWEEN) || goes_on(raised))?;
        if !copied.is_whole {
            return Ok(None);
        }
        let names: Vec<&str> = attached.iter().map(|(name, ..)| name.as_str()).collect();
        let mut said = source.losses();
        said.extend(file.left_behind(source, &copied, &names));
        file.finish()?;
        Ok(Some((copied.frames, said)))
    }
}

/// Writes the taxels of `body` to `path`; gives how many, and what is to be said of it.
fn skin(body: &PyBody, path: &Path, force: bool) -> Result<(u64, Vec<String>)> {
    let Some(format) = SkinFormat::of(path) else {
        return Err(Error::usage("the skin of a body becomes a .csv or a .urdf").at(path.display()));
    };
    let body = &*body.inner;
    if body.taxels.is_empty() {
        return Err(Error::failed("it has no taxels; place some on it, with `author`").at(&body.name));
    }
    let (text, mut said) = format.text(body);
    OutputPath::new(path, force, &[])?.write(text.as_bytes())?;
    said.extend(format.without_fields(body));
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
/// rate_hz, format, grid, pitch, unit, layout, map : optional
///     How a table or a pressure system's export is read, as for `read`.
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
#[pyo3(signature = (source, to, *, body = None, calibration = None, rate_hz = None, format = None, grid = None, pitch = None, unit = None, layout = None, map = None, force = false))]
#[expect(clippy::too_many_arguments, reason = "they are keywords")]
pub(crate) fn convert(
    py: Python<'_>,
    source: &Bound<'_, PyAny>,
    to: &Bound<'_, PyAny>,
    body: Option<&Bound<'_, PyAny>>,
    calibration: Option<&PyCalibration>,
    rate_hz: Option<f64>,
    format: Option<&str>,
    grid: Option<&str>,
    pitch: Option<&str>,
    unit: Option<&str>,
    layout: Option<PathBuf>,
    map: Option<&str>,
    force: bool,
) -> PyResult<u64> {
    let to = text_of(to)?;
    let body = body.map(|body| body_of(py, body)).transpose()?;
    let skinned = match source.cast::<PyBody>() {
        Ok(skinned) => Some(skinned.clone().unbind()),
        Err(_) => match text_of(source) {
            Ok(name) if is_body(&name) => Some(body_of(py, source)?),
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
            let keys = Keys { rate_hz, format, grid, pitch, unit, layout, map, ..Keys::default() };
            let options = keys.options().or_raise(py)?;
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
