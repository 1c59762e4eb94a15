//! What is measured on, as people ask for it: which backends, which frames, which touches.

use super::measure::stopped_early;
use super::{CallMode, MeasureOptions, Report, SimulatedTouches, TestFrames, letters, measure};
use crate::backend::BackendKind;
use crate::body::Body;
use crate::engine::Options;
use crate::error::{Error, Result};
use crate::scene::Plan;
use crate::signal::Frame;
use crate::source::{SimulatedSource, Source};

/// Why a GPU is not chosen unless it is asked for, where all there are compute on the CPU.
pub fn software() -> Option<String> {
    #[cfg(feature = "gpu")]
    {
        let adapters = crate::backend::gpu::adapters();
        let names: Vec<&str> = adapters.iter().map(|adapter| &adapter.name[..]).collect();
        let is_software = !adapters.is_empty() && adapters.iter().all(|adapter| adapter.kind == "software");
        is_software
            .then(|| format!("gpu: {} computes on the same CPU; ask for it with --backend gpu", names.join(", ")))
    }
    #[cfg(not(feature = "gpu"))]
    None
}

/// Frames that are measured on by default.
const FRAMES: usize = 512;
/// Values that these hold at most, about.
const VALUES: usize = 1 << 24;

/// Made-up frames, at least, where none are played.
const MADE_UP: usize = 32;

/// The number of frames for `taxels` taxels that is worth its memory.
#[must_use]
pub fn usual_frames(taxels: usize) -> usize {
    FRAMES.min(VALUES / taxels.max(1)).max(8)
}

impl MeasureOptions {
    /// Both ways for some seconds, on `kind`, or where that is left open on those that would be chosen.
    ///
    /// # Errors
    /// It is the reference, which has no options.
    #[doc(hidden)]
    pub fn of_backend(kind: BackendKind, seconds: f64, batch: usize) -> Result<Self> {
        let backends = match kind {
            BackendKind::Auto if software().is_some() => vec![BackendKind::Cpu],
            BackendKind::Auto => vec![BackendKind::Cpu, BackendKind::Gpu],
            BackendKind::Reference => {
                return Err(Error::usage("the reference has no options to compare; use another backend, or auto"));
            }
            kind => vec![kind],
        };
        Ok(Self { seconds, batch, ways: CallMode::ALL.to_vec(), backends })
    }
}

impl TestFrames {
    /// The first frames of `source`, up to `most`; messages call it `name`.
    ///
    /// # Errors
    /// It cannot be read, or has no frame.
    #[doc(hidden)]
    pub fn read(name: &str, source: &mut dyn Source, most: usize) -> Result<Self> {
        let mut read = Self { source: name.to_owned(), taxels: source.taxels().to_vec(), ..Self::default() };
        while read.frames.len() < most && read.next(source)? {}
        read.not_empty()
    }

    /// The same of a simulation, which knows the truth.
    ///
    /// # Errors
    /// It has no frame.
    #[doc(hidden)]
    pub fn simulated(name: &str, source: &mut SimulatedSource, most: usize) -> Result<Self> {
        let mut read = Self { source: name.to_owned(), taxels: source.taxels().to_vec(), ..Self::default() };
        while read.frames.len() < most && read.next(source)? {
            read.truth.push(source.truth().to_vec());
        }
        read.not_empty()
    }

    fn next(&mut self, source: &mut dyn Source) -> Result<bool> {
        let mut frame = Frame::missing(0.0, self.taxels.len());
        let is_there = source.next_frame(&mut frame)?;
        self.frames.extend(is_there.then_some(frame));
        Ok(is_there)
    }

    fn not_empty(self) -> Result<Self> {
        if self.frames.is_empty() {
            return Err(Error::failed("there is no frame in it").at(&self.source));
        }
        Ok(self)
    }
}

/// What is measured on.
pub struct Tested {
    /// What is timed.
    pub played: TestFrames,
    /// How: as a run would, but for the calibration where the frames are simulated touches, which have their own.
    pub options: Options,
    /// Touches to hold percepts against the truth on, or why there are none.
    pub touches: Result<SimulatedTouches>,
    /// What is computed: it says which letters there are.
    plan: Plan,
}

impl Tested {
    /// `played`, or else simulated touches; up to `most` of these. Where no letter is made of pressures, there are no touches to
    /// simulate.
    pub fn new(body: &Body, options: &Options, played: Option<TestFrames>, most: usize) -> Result<Self> {
        let plan = letters::plan(body, options)?;
        if !letters::has_options(&plan) {
            let played = played.unwrap_or_else(|| TestFrames::made_up(body, MADE_UP));
            let touches = Err(Error::failed("no letter is made of pressures"));
            return Ok(Self { played, options: options.clone(), touches, plan });
        }
        let touches = SimulatedTouches::on(body, options, most);
        match (played, touches) {
            (Some(played), touches) => Ok(Self { played, options: options.clone(), touches, plan }),
            (None, Ok(touches)) => {
                let options = options.clone().calibration(touches.calibration.clone());
                let played = TestFrames { truth: Vec::new(), ..touches.frames.clone() };
                Ok(Self { played, options, touches: Ok(touches), plan })
            }
            (None, Err(e)) => Err(e),
        }
    }

    /// Measures it, see [`measure`]; letters that the host makes come last.
    pub fn measure(
        &self,
        body: &Body,
        measure_options: &MeasureOptions,
        progress: &mut dyn FnMut(f64) -> bool,
    ) -> Result<Report> {
        let has_options = letters::has_options(&self.plan);
        let of_letters = match letters::of_host(&self.plan).len() {
            0 => 0.0,
            _ if has_options => letters::TIME_SHARE,
            _ => 1.0,
        };
        let mut report = if has_options {
            let touches = self.touches.as_ref().ok();
            let options = letters::of_pressure(&self.options);
            let mut first = |share: f64| progress((1.0 - of_letters) * share);
            let mut report = measure(body, &options, &self.played, touches, measure_options, &mut first)?;
            report.left_out.extend(self.touches.as_ref().err().map(|e| format!("against the truth: {e}")));
            report
        } else {
            let (source, frames) = (self.played.source.clone(), self.played.frames.len());
            Report { body: body.name.clone(), source, frames, ..Report::default() }
        };
        let asked = (&self.options, &self.plan);
        let mut last = |share: f64| progress(1.0 - of_letters * (1.0 - share));
        report.letters = letters::letter_costs(body, asked, &self.played, measure_options, &mut last)?;
        if !has_options && report.letters.is_empty() {
            return Err(stopped_early());
        }
        Ok(report)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bundled;
    use crate::percept::Outputs;
    use crate::scene::{Arithmetic, Knobs, Scene};
    use crate::signal::{Letter, Receptor};

    fn measured(scene: Scene, goes_on: bool) -> (Vec<f64>, Result<Report>) {
        let body = Body::from_bytes("sensing-hand", bundled::SENSING_HAND).unwrap();
        let options = Options::default().scene(scene).backend(BackendKind::Cpu);
        let tested = Tested::new(&body, &options, Some(TestFrames::made_up(&body, 1)), 8).unwrap();
        let how = MeasureOptions::of_backend(BackendKind::Cpu, 0.05, 16).unwrap();
        let mut shares = Vec::new();
        let report = tested.measure(&body, &how, &mut |share| {
            shares.push(share);
            goes_on
        });
        (shares, report)
    }

    fn of_letters(receptors: &[Receptor]) -> Scene {
        let of_pressure = receptors.contains(&Receptor::Sustained).then_some(Outputs::TOTAL | Outputs::CENTROID);
        let scene = Scene::default().outputs(Outputs::TEMPERATURE | of_pressure.unwrap_or_default());
        scene.letters(Letter::all_of(receptors, &[])).fields(["hand/palm"])
    }

    #[test]
    fn arithmetic_may_be_set_and_all_that_is_done_is_reported_once() {
        let scene = of_letters(&[Receptor::Sustained, Receptor::Temperature]);
        let scene = scene.knobs(Knobs::default().arithmetic(Some(Arithmetic::Compensated)));
        let (shares, report) = measured(scene, true);
        let report = report.unwrap();
        assert!(!report.rows.is_empty() && report.rows.iter().all(|row| row.words.arithmetic == "compensated"));
        assert_eq!(report.letters.len(), 2);
        assert!(shares.windows(2).all(|pair| pair[0] <= pair[1]) && shares.last() == Some(&1.0), "{shares:?}");
    }

    #[test]
    fn what_is_stopped_before_a_letter_is_measured_is_an_error() {
        for letters in [&[Receptor::Sustained, Receptor::Temperature][..], &[Receptor::Temperature]] {
            let (shares, report) = measured(of_letters(letters), false);
            assert!(report.unwrap_err().to_string().contains("stopped before") && shares.len() == 1, "{letters:?}");
        }
    }
}
