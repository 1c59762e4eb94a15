//! What is measured, on which frames, and how a measurement is described.

use somatic::internal::setup::Setup;
use somatic::internal::setup::{Input, RECORDED_BATCH};
use somatic::internal::tradeoff::{
    CallMode, MeasureOptions, Measurement, Pick, Report, SimulatedTouches, Store, Target, TestFrames, measure,
};
use somatic::signal::Frame;
use somatic::source::{SimulatedSource, Source, SourceSpec};
use somatic::{BackendKind, Body, Error, Options, Result};

use crate::cli::plan::pressed;
use crate::cli::words::number;

/// What `pick` misses of `target`, which nothing grants.
pub(super) fn missed(target: &Target, pick: &Pick<'_>) -> Result<String> {
    let combination = pick.row.combination()?;
    Ok(format!("no options meet {}; nearest is {combination}: {}", target.words(), pick.missed.join("; ")))
}

/// Why a GPU is not chosen unless it is asked for, where all there are compute on the CPU.
pub(super) fn software() -> Option<String> {
    #[cfg(feature = "gpu")]
    {
        let adapters = somatic::internal::backend::gpu::adapters();
        let names: Vec<&str> = adapters.iter().map(|adapter| &adapter.name[..]).collect();
        let is_software = !adapters.is_empty() && adapters.iter().all(|adapter| adapter.kind == "software");
        is_software
            .then(|| format!("gpu: {} computes on the same CPU; ask for it with --backend gpu", names.join(", ")))
    }
    #[cfg(not(feature = "gpu"))]
    None
}

pub(super) fn measure_options(asked: &Setup, options: &Options, seconds: f64) -> Result<MeasureOptions> {
    let backends = match options.backend {
        BackendKind::Auto if software().is_some() => vec![BackendKind::Cpu],
        BackendKind::Auto => vec![BackendKind::Cpu, BackendKind::Gpu],
        BackendKind::Reference => {
            return Err(Error::usage("the reference has no options to compare; use another backend, or auto"));
        }
        kind => vec![kind],
    };
    let batch = asked.batch.map_or(RECORDED_BATCH, |batch| batch as usize);
    Ok(MeasureOptions { seconds, batch, ways: CallMode::ALL.to_vec(), backends })
}

/// The first frames of `input`, up to `most`, and the truth where it knows it.
pub(super) fn played(input: &Input, asked: &Setup, body: &Body, most: usize) -> Result<TestFrames> {
    let mut played = TestFrames { source: input.name.clone(), ..TestFrames::default() };
    fn next(played: &mut TestFrames, source: &mut dyn Source) -> Result<bool> {
        if played.frames.is_empty() {
            played.taxels = source.taxels().to_vec();
        }
        let mut frame = Frame::missing(0.0, played.taxels.len());
        let is_there = source.next_frame(&mut frame)?;
        played.frames.extend(is_there.then_some(frame));
        Ok(is_there)
    }
    if let Some(SourceSpec::Sim(path)) = &input.spec {
        let mut source = SimulatedSource::open(path)?;
        while played.frames.len() < most && next(&mut played, &mut source)? {
            played.truth.push(source.truth().to_vec());
        }
    } else {
        let mut source = input.open_posed(body, asked)?;
        while played.frames.len() < most && next(&mut played, &mut *source)? {}
    }
    if played.frames.is_empty() {
        return Err(Error::failed("there is no frame in it").at(&played.source));
    }
    Ok(played)
}

/// What is measured on.
pub(super) struct Tested {
    /// What is timed.
    pub(super) played: TestFrames,
    /// How: as a run would, but for the calibration where the frames are simulated touches, which have their own.
    pub(super) options: Options,
    /// Touches to hold percepts against the truth on, or why there are none.
    pub(super) touches: Result<SimulatedTouches>,
}

impl Tested {
    /// `played`, or else simulated touches; up to `most` of these.
    pub(super) fn new(body: &Body, options: &Options, played: Option<TestFrames>, most: usize) -> Result<Self> {
        let touches = SimulatedTouches::on(body, options, most);
        match (played, touches) {
            (Some(played), touches) => Ok(Self { played, options: options.clone(), touches }),
            (None, Ok(touches)) => {
                let options = options.clone().calibration(touches.calibration.clone());
                let played = TestFrames { truth: Vec::new(), ..touches.frames.clone() };
                Ok(Self { played, options, touches: Ok(touches) })
            }
            (None, Err(e)) => Err(e),
        }
    }

    /// Measures it, see [`measure`].
    pub(super) fn measure(
        &self,
        body: &Body,
        measure_options: &MeasureOptions,
        progress: &mut dyn FnMut(f64) -> bool,
    ) -> Result<Report> {
        let touches = self.touches.as_ref().ok();
        let mut report = measure(body, &self.options, &self.played, touches, measure_options, progress)?;
        report.left_out.extend(self.touches.as_ref().err().map(|e| format!("against the truth: {e}")));
        Ok(report)
    }
}

/// What measurements on `input`, or on touches simulated on the body, are kept for.
pub(super) fn recording(input: Option<&Input>) -> Option<String> {
    input.map_or(Some(Store::TOUCHES.to_owned()), Input::recording)
}

/// What `somatic plan` calls a row.
pub(super) fn in_words(row: &Measurement) -> String {
    let [place, orientation] = row.judged();
    let mut words = vec![format!("{:.2} µs a frame, p99 {:.2} µs", row.p50_us, row.p99_us)];
    let from = if row.truth.is_some() { "the truth" } else { "the reference" };
    if place.compared > 0 {
        words.push(format!("95 % of places within {} mm of {from}", number(place.p95)));
    }
    if orientation.compared > 0 {
        words.push(format!("95 % of orientations within {}°", number(orientation.p95)));
    }
    if let Some(truth) = row.truth.filter(|truth| truth.given < 1.0) {
        words.push(format!("given for {:.0} % of the touches, absent for the others", 100.0 * truth.given));
    }
    words.join(", ")
}

/// Frames for a body that nobody has recorded, or cannot be read again: every taxel pressed, each time otherwise.
pub(super) fn made_up(body: &Body, taxels: Vec<u32>) -> TestFrames {
    let frames = pressed(body.taxels.len(), 32);
    TestFrames { source: "every taxel pressed".to_owned(), taxels, frames, truth: Vec::new() }
}
