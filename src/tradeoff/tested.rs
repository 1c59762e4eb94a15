//! What is measured on, as people ask for it: which backends, which frames, which touches.

use super::{CallMode, MeasureOptions, Report, SimulatedTouches, TestFrames, letters, measure};
use crate::backend::BackendKind;
use crate::body::Body;
use crate::engine::Options;
use crate::error::{Error, Result};
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
}

impl Tested {
    /// `played`, or else simulated touches; up to `most` of these. Where no letter is made of pressures, there are no touches to
    /// simulate.
    pub fn new(body: &Body, options: &Options, played: Option<TestFrames>, most: usize) -> Result<Self> {
        if !letters::has_options(body, options)? {
            let played = played.unwrap_or_else(|| TestFrames::made_up(body, MADE_UP));
            let touches = Err(Error::failed("no letter is made of pressures"));
            return Ok(Self { played, options: options.clone(), touches });
        }
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
    pub fn measure(
        &self,
        body: &Body,
        measure_options: &MeasureOptions,
        progress: &mut dyn FnMut(f64) -> bool,
    ) -> Result<Report> {
        let costs = letters::letter_costs(body, &self.options, &self.played, measure_options)?;
        if !letters::has_options(body, &self.options)? {
            progress(1.0);
            let (source, frames) = (self.played.source.clone(), self.played.frames.len());
            return Ok(Report { body: body.name.clone(), source, frames, letters: costs, ..Report::default() });
        }
        let touches = self.touches.as_ref().ok();
        let options = letters::of_pressure(&self.options);
        let mut report = measure(body, &options, &self.played, touches, measure_options, progress)?;
        report.letters = costs;
        report.left_out.extend(self.touches.as_ref().err().map(|e| format!("against the truth: {e}")));
        Ok(report)
    }
}
