//! Runs a simulated touch through both of the paper's signals.

use std::array;

use super::chart_fit::{self, ChartFit, PlaneChart};
use somatic::backend::BackendKind;
use somatic::body::Body;
use somatic::error::Result;
use somatic::percept::{Outputs, Percept};
use somatic::scene::{FilterBy, MotionFilter, Scene};
use somatic::signal::{Calibration, Frame, FsrCircuit, LayerResponse, RawValue};
use somatic::source::{SimulatedSource, Source as _, Truth};
use somatic::{Engine, Options};

/// The paper's two ways from counts to a calibrated sensor value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Signal {
    /// The inverted reading: about the logarithm of the force.
    Raw,
    /// In proportion to the force.
    Linearised,
}

impl Signal {
    pub(super) const ALL: [Self; 2] = [Self::Raw, Self::Linearised];
    /// Readings this near to open are noise: under a sixth of the step at the break force.
    const DEAD_BAND_COUNTS: u16 = 20;

    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Raw => "logarithmic raw",
            Self::Linearised => "linearised",
        }
    }

    /// The signal of `counts`, 0 to 1000.
    pub(super) fn value(self, counts: u16) -> f64 {
        let circuit = FsrCircuit::default();
        if counts >= FsrCircuit::OPEN_COUNTS - Self::DEAD_BAND_COUNTS {
            return 0.0;
        }
        match self {
            Self::Raw => circuit.logarithmic(counts),
            Self::Linearised => circuit.linearised(counts, FsrCircuit::SATURATION_NEWTON),
        }
    }
}

/// σ of the layer in the paper's experiments, m: 7 mm of silicone.
const SIGMA_M: f64 = 7e-3 * 0.577_350_269_189_625_8;

/// What the percepts of `signal` know of the sensors: nothing, but for what fits of contacts need where it is in proportion to the force.
fn calibration(signal: Signal, taxels: usize) -> Option<Calibration> {
    if signal == Signal::Raw {
        return None;
    }
    let mut calibration = Calibration::identity(taxels);
    // The smallest value that is not 0: below it, one of 0 says nothing.
    let least = signal.value(FsrCircuit::OPEN_COUNTS - Signal::DEAD_BAND_COUNTS - 1);
    calibration.taxels.iter_mut().for_each(|taxel| taxel.dead_band = (1.0 - 1e-6) * least);
    calibration.layer = Some(LayerResponse { sigma_m: SIGMA_M, gain_spread: LayerResponse::GAIN_SPREAD });
    Some(calibration)
}

/// From about the noise of a frame to half of the sensors' pitch.
fn filter() -> MotionFilter {
    MotionFilter::default().over_s(None).low_m(0.5e-3).high_m(6e-3).by(FilterBy::Distance).time_constant_s(0.15)
}

/// One frame: readings, forces, truth, and from each of [`Signal::ALL`] the field's percept and what is fitted to its touch.
#[derive(Clone, Debug)]
pub(super) struct Moment {
    pub(super) t_s: f64,
    /// One per taxel, in the order of the body's pressure taxels.
    pub(super) counts: Vec<u16>,
    pub(super) forces_newton: Vec<f64>,
    /// The truth of the touch, if one presses.
    pub(super) truth: Option<Truth>,
    pub(super) percepts: [Percept; 2],
    pub(super) fits: [Option<ChartFit>; 2],
}

/// The ids of the taxels that a simulation delivers, and its frames.
#[derive(Clone, Debug)]
pub(super) struct Trial {
    pub(super) ids: Vec<u32>,
    pub(super) moments: Vec<Moment>,
}

/// Runs the simulation in `text`, called `name` in messages, whose sensors give counts, over `field` of `body`.
pub(super) fn run(name: &str, text: &str, body: &Body, field: &str) -> Result<Trial> {
    let mut source = SimulatedSource::on_body(name, text, body.clone())?;
    let mut series = Series::default();
    series.read(&mut source)?;
    Ok(Trial { ids: source.taxels().to_vec(), moments: series.with_percepts(&source, field)? })
}

/// The same with the noise of each of `seeds`: as many trials, in that order.
pub(super) fn run_seeds(name: &str, text: &str, body: &Body, field: &str, seeds: &[u64]) -> Result<Vec<Trial>> {
    let mut source = SimulatedSource::on_body(name, text, body.clone())?;
    // One series for all, as creating an engine is slow.
    let mut series = Series::default();
    for &seed in seeds {
        source.reseed(seed);
        series.read(&mut source)?;
    }
    let (ids, mut moments) = (source.taxels().to_vec(), series.with_percepts(&source, field)?.into_iter());
    let frames = moments.len() / seeds.len().max(1);
    let trial = |_| Trial { ids: ids.clone(), moments: moments.by_ref().take(frames).collect() };
    Ok(seeds.iter().map(trial).collect())
}

/// Time between runs, s: too long for motion from one run to the next.
const BETWEEN_RUNS_S: f64 = 1000.0;

/// One frame without percepts.
struct Read {
    t_s: f64,
    counts: Vec<u16>,
    forces_newton: Vec<f64>,
    truth: Option<Truth>,
}

/// The frames of all runs.
#[derive(Default)]
struct Series {
    runs: u32,
    read: Vec<Read>,
    /// The frames for each of [`Signal::ALL`].
    signals: [Vec<Frame>; 2],
}

impl Series {
    /// Reads `source` to its end, as another run.
    fn read(&mut self, source: &mut SimulatedSource) -> Result<()> {
        let mut frame = Frame::missing(0.0, source.taxels().len());
        while source.next_frame(&mut frame)? {
            let counts: Vec<u16> = frame.values.iter().map(|value| value.number().unwrap_or(0.0) as u16).collect();
            for (signal, frames) in Signal::ALL.iter().zip(&mut self.signals) {
                let values = counts.iter().map(|&counts| RawValue::new(signal.value(counts))).collect();
                let t_s = frame.t_s + f64::from(self.runs) * BETWEEN_RUNS_S;
                frames.push(Frame { t_s, values, ..Frame::default() });
            }
            let forces_newton = source.forces_newton().to_vec();
            let truth = source.truth().first().cloned();
            self.read.push(Read { t_s: frame.t_s, counts, forces_newton, truth });
        }
        self.runs += 1;
        Ok(())
    }

    fn with_percepts(self, source: &SimulatedSource, field: &str) -> Result<Vec<Moment>> {
        let chart = PlaneChart::new(source.body(), field)?;
        let mut percepts = Vec::with_capacity(2);
        for (signal, frames) in Signal::ALL.into_iter().zip(&self.signals) {
            let calibration = calibration(signal, source.body().taxels.len());
            let touches = calibration.is_some().then(chart_fit::asked);
            let moments = Outputs::CENTROID | Outputs::ORIENTATION | Outputs::PRINCIPAL_AXIS;
            let scene = Scene::default()
                .outputs(moments | Outputs::MOTION | Outputs::FILTERED)
                .touches(touches)
                .filter(filter())
                .fields(vec![field.to_owned()]);
            let options = Options::default()
                .scene(scene)
                .calibration(calibration)
                .backend(BackendKind::Reference)
                .batch(frames.len());
            let mut engine = Engine::new(source.body(), options)?;
            engine.set_channels(source.taxels())?;
            let batch = engine.process(frames)?;
            let seen = |frame: usize| (batch.get(frame, 0), chart.fit(batch.touches(frame)));
            percepts.push((0..batch.frames()).map(seen).collect::<Vec<_>>());
        }
        let moments = self.read.into_iter().enumerate().map(|(index, read)| Moment {
            t_s: read.t_s,
            counts: read.counts,
            forces_newton: read.forces_newton,
            truth: read.truth,
            percepts: array::from_fn(|signal| percepts[signal][index].0),
            fits: array::from_fn(|signal| percepts[signal][index].1),
        });
        Ok(moments.collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn noise_on_an_open_sensor_is_nothing_and_a_press_is_not() {
        let circuit = FsrCircuit::default();
        for signal in Signal::ALL {
            assert!((1003..=1023).all(|counts| signal.value(counts) == 0.0));
            let presses = [0.11, 1.0, 4.0, 10.0].map(|newton| signal.value(circuit.counts(newton)));
            assert!(presses.windows(2).all(|pair| 0.0 < pair[0] && pair[0] < pair[1]), "{presses:?}");
            assert_eq!(presses[3], 1000.0);
        }
        assert!(circuit.counts(FsrCircuit::BREAK_NEWTON) < 1023 - 6 * Signal::DEAD_BAND_COUNTS);
    }
}
