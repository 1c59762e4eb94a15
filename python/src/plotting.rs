//! `plot`: recordings as one picture.

use std::path::PathBuf;

use pyo3::prelude::*;
use somatic::internal::plot::{Gathered, Gatherer, png, svg, wanted_of};
use somatic::output::OutputPaths;
use somatic::percept::Unit;
use somatic::signal::Quantity;
use somatic::source::Source;
use somatic::{BackendKind, Engine, Error, Frame, Options, Outputs, Result, Scene};

use crate::body::PyBody;
use crate::calibration::PyCalibration;
use crate::error::{OrRaise, interrupted, usage};
use crate::given::InMemory;
use crate::recording::PyRecording;
use crate::threads::free;

/// Most recordings of a plot.
const MAX_RECORDINGS: usize = 8;
/// Frames of a call.
const BATCH: usize = 256;

/// What is plotted of a recording.
struct Plotted {
    name: String,
    body: PyBody,
    calibration: Option<PyCalibration>,
    source: InMemory,
}

impl Plotted {
    fn gather(mut self, wanted: Outputs, fields: &[String], raised: &mut Option<PyErr>) -> Result<Option<Gathered>> {
        let body = &self.body.inner;
        let [wanted, computed] = wanted_of(body, fields, wanted)?;
        let scene = Scene::default().outputs(computed).fields(fields.to_vec());
        let calibration = self.calibration.map(|calibration| calibration.inner);
        let options = Options::default().scene(scene).calibration(calibration).backend(BackendKind::Cpu).batch(BATCH);
        let mut engine = Engine::new(body, options)?;
        engine.set_channels(self.source.taxels()).map_err(|e| e.at(&self.name))?;
        let p_unit = engine.plan().common_quantity().map_or(Unit::P.symbol(), Quantity::symbol);
        let gatherer = Gatherer::new(&self.name, body, &engine, wanted, !fields.is_empty())?;
        let mut gatherer = gatherer.with_p_unit(p_unit);
        let width = self.source.taxels().len();
        let mut frames = Vec::with_capacity(BATCH);
        loop {
            frames.clear();
            while frames.len() < BATCH {
                let mut frame = Frame::missing(0.0, width);
                if !self.source.next_frame(&mut frame)? {
                    break;
                }
                frames.push(frame);
            }
            if frames.is_empty() {
                return Ok(Some(gatherer.finish()));
            }
            *raised = Python::attach(|py| py.check_signals().err());
            if raised.is_some() {
                return Ok(None);
            }
            engine.process(&frames)?;
            gatherer.see(&engine, &frames);
        }
    }
}

#[pyfunction]
#[pyo3(name = "_plot")]
pub(crate) fn plot(
    py: Python<'_>,
    recordings: Vec<Py<PyRecording>>,
    to: PathBuf,
    outputs: Vec<String>,
    fields: Vec<String>,
    calibration: Option<Bound<'_, PyCalibration>>,
    force: bool,
) -> PyResult<()> {
    if recordings.len() > MAX_RECORDINGS {
        return Err(usage(py, format!("at most {MAX_RECORDINGS} recordings have room side by side")));
    }
    let named = |name: &String| {
        Outputs::named(name).ok_or_else(|| {
            let near = somatic::internal::error::suggestion(name, somatic::COLUMNS.iter().map(|column| column.name));
            Error::usage(format!("there is no output `{name}`; {near}"))
        })
    };
    let wanted = outputs.iter().map(named).collect::<Result<Vec<Outputs>>>().or_raise(py)?;
    let wanted = wanted.into_iter().fold(Outputs::empty(), |all, one| all | one);
    let is_svg = match to.extension().and_then(|ending| ending.to_str()) {
        Some("svg") => true,
        Some("png") => false,
        _ => return Err(usage(py, format!("{}: a plot ends in .svg or .png", to.display()))),
    };
    let mut plotted = Vec::new();
    for recording in &recordings {
        let known = recording.get();
        let Some(body) = &known.body else {
            return Err(usage(py, format!("{}: it has no body; read it with body=", known.name)));
        };
        plotted.push(Plotted {
            name: known.name.clone(),
            body: body.get().clone(),
            calibration: known
                .calibrated(py, calibration.as_ref(), body.get())?
                .map(|calibration| calibration.get().clone()),
            source: InMemory::from_recording(py, known)?,
        });
    }
    let mut raised = None;
    let done = free(py, || {
        let none: [PathBuf; 0] = [];
        let output = OutputPaths::new(force, none).add(&to)?;
        let mut all = Vec::new();
        for plotted in plotted {
            match plotted.gather(wanted, &fields, &mut raised)? {
                Some(gathered) => all.push(gathered),
                None => return Ok(()),
            }
        }
        let bytes = if is_svg { svg(&all)?.into_bytes() } else { png(&all)? };
        output.write(&bytes)
    });
    done.or_raise_of(py, &to)?;
    if raised.is_some() { Err(interrupted(raised)) } else { Ok(()) }
}
