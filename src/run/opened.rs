//! A run before its first frame: its source is open, its engine is made, and nothing is written yet.

use std::path::Path;

use super::feed::{Feed, ReadMode};
use super::running::{Run, RunOptions};
use crate::body::Body;
use crate::engine::{Engine, Options};
use crate::error::Result;
use crate::percept::Precision;
use crate::setup::{Input, RECORDED_BATCH, Setup, attachments};
use crate::signal::{Channel, Quantity, Wiring};
use crate::sink::{FieldNames, Session, Sink, SinkSpec, SinkTarget};
use crate::source::{Lines, Source};

/// How fast frames come, and how many at once.
#[derive(Clone, Copy, Debug)]
pub struct Pace {
    /// Times the recording's own speed; `None` is as fast as possible.
    pub speed: Option<f64>,
    /// Whether calls wait for as many frames as they may have.
    pub gather: bool,
    /// Frames of a call at most.
    pub batch: usize,
    /// Whether a recording ends: what is played until somebody ends it is never a part.
    pub ends: bool,
}

impl Pace {
    /// The pace of `setup`; a recording that `is_watched` plays at its own speed.
    #[must_use]
    pub fn for_input(setup: &Setup, input: &Input, is_watched: bool) -> Self {
        let is_watched = is_watched || (input.is_recording() && setup.sinks.iter().any(SinkSpec::is_watched));
        let speed = setup.playback_speed.or(is_watched.then_some(1.0));
        let gather = input.is_recording() && speed.is_none();
        let ends = input.is_recording() && setup.repeat != Some(0);
        let batch = setup.batch.map_or(if gather { RECORDED_BATCH } else { 1 }, |batch| batch as usize);
        Self { speed, gather, batch, ends }
    }
}

/// All that a run has before its sinks are opened.
pub struct Opened {
    /// The robot.
    pub body: Body,
    /// Knows the source's taxels.
    pub engine: Engine,
    /// Its backend: the name, what it runs on, and why it was chosen.
    pub backend: [String; 3],
    /// Where frames come from, with poses where joints are asked for.
    pub source: Box<dyn Source + Send>,
    /// Boards or limbs, if these are read.
    pub lines: Option<Lines>,
    /// Of boards.
    pub wiring: Option<Wiring>,
    /// How fast frames come.
    pub pace: Pace,
}

impl Opened {
    /// Opens what `setup` reads, boards last: they speak as soon as their lines are open, and not before somebody can listen. The
    /// engine gets `options`, and why its backend was chosen where that is known; they are asked for when a recording is open.
    ///
    /// # Errors
    /// The source or the options are invalid, or do not fit the body.
    pub fn new(
        setup: &Setup,
        input: &Input,
        body: Body,
        pace: Pace,
        options: impl FnOnce(&Body) -> Result<(Options, Option<String>)>,
    ) -> Result<Self> {
        let ids: Vec<u32> = body.taxels.iter().map(|taxel| taxel.id).collect();
        let channels = Channel::all_of(&body);
        let recorded = if input.is_merged() { None } else { Some(input.open(&channels, setup)?) };
        let (options, why) = options(&body)?;
        setup.line_keys().check_wipers(options.calibration.as_ref(), &ids)?;
        let mut engine = Engine::new(&body, options)?;
        engine.keep_touch_taxels(setup.sinks.iter().any(|sink| matches!(sink, SinkSpec::Page(_))));
        let (source, lines, wiring) = match recorded {
            Some(mut source) => {
                source.report_stale();
                (source, None, None)
            }
            None => {
                let opened = input.open_lines(&channels, setup)?;
                engine.track_stale();
                opened.wiring.iter().for_each(|wiring| engine.wire(wiring));
                (opened.source, Some(opened.lines), opened.wiring)
            }
        };
        let source = setup.jointed(source, &body)?;
        engine.set_channels(source.taxels()).map_err(|e| e.at("header").at(&input.name))?;
        let chosen = engine.backend();
        let backend = [chosen.name.to_owned(), chosen.device, why.unwrap_or_else(|| chosen.reason.to_owned())];
        Ok(Self { body, engine, backend, source, lines, wiring, pace })
    }

    /// The session for the sinks of `targets`; a recording holds the file `scene`.
    ///
    /// # Errors
    /// A file that a recording holds cannot be read.
    pub fn session<'a>(
        &'a self,
        setup: &'a Setup,
        input: &'a Input,
        targets: &[SinkTarget],
        scene: Option<&Path>,
    ) -> Result<Session<'a>> {
        let plan = self.engine.plan();
        let records = targets.iter().any(SinkTarget::holds_attached);
        let [name, device, why] = &self.backend;
        Ok(Session {
            names: FieldNames::all_of(plan),
            all_fields: setup.all_fields,
            outputs: self.engine.percepts().outputs(),
            is_double: self.engine.percepts().precision() == Precision::F64,
            p_unit: plan.common_quantity().map_or("", Quantity::symbol),
            header: setup.header,
            taxels: self.source.taxels(),
            body: Some(&self.body),
            attached: if records { attachments(setup, &self.body, scene)? } else { Vec::new() },
            parts: setup.record.clone(),
            plan: Some(plan),
            source: &input.name,
            recordings: &[],
            backend: [name, device, why],
            is_recorded: self.pace.ends,
            wiring: self.wiring.as_ref(),
            zenoh_config: setup.zenoh_config.as_deref(),
            ros_time: setup.ros_time.unwrap_or_default(),
        })
    }

    /// Starts to read, for `sinks`. Of boards or limbs, somebody else reads the lines.
    #[must_use]
    pub fn start(self, sinks: Vec<Box<dyn Sink + Send>>, input: &Input, options: &RunOptions) -> Run {
        let options = RunOptions {
            is_live: !self.pace.gather,
            tracks_stale: self.lines.is_some(),
            recording: self.pace.ends.then(|| input.name.clone()),
            ..options.clone()
        };
        let (engine, feed) = self.read();
        Run::new(engine, feed, sinks, options)
    }

    /// Starts to read.
    #[must_use]
    pub(super) fn read(self) -> (Engine, Feed) {
        let Self { engine, source, lines, pace, .. } = self;
        let feed = match &lines {
            None => Feed::start(source, ReadMode { most: pace.batch, gather: pace.gather, speed: pace.speed }),
            Some(lines) => Feed::start_woken(source, pace.batch, lines),
        };
        (engine, feed)
    }
}
