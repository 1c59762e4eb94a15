//! What `somatic calibrate` reads: the robot, and frames of its sensors, opened as `somatic run` opens them.

use somatic::internal::setup::attached;
use somatic::internal::setup::{Input, Setup};
use somatic::internal::signal::{Channel, UnitOfP};
use somatic::scene::file::SceneFile;
use somatic::source::{Lines, Source, SourceSpec, VendorOptions, VendorSource};
use somatic::{Body, Error, Result};

use crate::cli::scene::{in_flags, input, set_up};

/// The robot, and what its sensors deliver.
pub(super) struct Opened {
    pub(super) body: Body,
    pub(super) source: Box<dyn Source + Send>,
    /// Of boards on serial lines.
    pub(super) lines: Option<Lines>,
    pub(super) is_live: bool,
    /// What an export says that its values are in.
    pub(super) unit: UnitOfP,
}

impl Opened {
    /// Opens the sources that `scene` names.
    pub(super) fn new(scene: SceneFile) -> Result<Self> {
        Self::open(scene).map_err(in_flags)
    }

    fn open(scene: SceneFile) -> Result<Self> {
        scene.check()?;
        let (lines, rate_hz) = (scene.line_keys(), scene.rate_hz);
        let ports = lines.lines(&scene.sources)?;
        if !ports.is_empty() && rate_hz.is_some() {
            return Err(Error::usage("--rate is for CSV recordings; --board-rate is for boards on serial lines"));
        }
        let setup = set_up(scene);
        let input = input(&setup)?;
        let body = body_of(&setup, &input)?;
        let ids = Channel::all_of(&body);
        let is_live = !input.is_recording();
        if !ports.is_empty() {
            let source = lines.open(&ports, &ids, None)?;
            let lines = Some(source.lines());
            return Ok(Self { body, source: Box::new(source), lines, is_live, unit: UnitOfP::COUNT });
        }
        let unit = unit_of(&input, rate_hz)?;
        Ok(Self { source: input.open(&ids, &setup)?, body, lines: None, is_live, unit })
    }
}

/// The robot that is named, or that of the source. A source without one is not taken to be of the bundled hand.
fn body_of(setup: &Setup, input: &Input) -> Result<Body> {
    let has_own = match &input.spec {
        Some(SourceSpec::Vendor(_) | SourceSpec::Text(_) | SourceSpec::Sim(_) | SourceSpec::Paxini { .. }) => true,
        Some(SourceSpec::Mcap(path)) => attached::body(path)?.is_some(),
        _ => setup.map.is_some(),
    };
    match has_own || setup.body.is_some() {
        true => input.body(setup),
        false => Err(Error::usage("this source does not say which robot it is of; name the robot as --body BODY")),
    }
}

/// What an export's values are in, as it says itself.
fn unit_of(input: &Input, rate_hz: Option<f64>) -> Result<UnitOfP> {
    match &input.spec {
        Some(SourceSpec::Vendor(path)) => {
            Ok(VendorSource::open(path, &VendorOptions { rate_hz, ..VendorOptions::default() })?.layout().unit)
        }
        _ => Ok(UnitOfP::COUNT),
    }
}
