//! A run before its first frame: its source is open, its engine made, and nothing is written yet.

use std::path::Path;
use std::time::{Duration, Instant};

use somatic::output::OutputPath;
use somatic::run::{Feed, ReadMode, Run, RunOptions};
use somatic::signal::{Quantity, Wiring};
use somatic::sink::{FieldNames, Session, Sink, SinkSpec, SinkTarget};
use somatic::source::{Lines, Source};
use somatic::{BackendKind, Body, Engine, Error, Precision, Result};

use super::console::Console;
use crate::cli::attachments::attachments;
use crate::cli::doubts::Doubts;
#[cfg(feature = "page")]
use crate::cli::explanation::LiveExplainer;
use crate::cli::input::{Input, RECORDED_BATCH};
use crate::cli::lines::LineReport;
use crate::cli::live::{RunInfo, ViewKind};
use crate::cli::scene::Asked;
use crate::cli::stdio::say;
use crate::cli::tradeoff::{say_kept, settled};
use crate::cli::verify::has_another_to_compare;
use crate::cli::words;

/// How fast frames come, and how many at once.
struct Pace {
    /// Times the recording's own speed; `None` is as fast as possible.
    speed: Option<f64>,
    /// Whether calls wait for as many frames as they may have.
    gather: bool,
    /// Frames of a call at most.
    batch: usize,
    /// Whether a recording ends: what is played until somebody ends it is never a part.
    ends: bool,
}

impl Pace {
    fn of(asked: &Asked, input: &Input, at_terminal: bool) -> Self {
        let is_watched = (input.is_bundled() && at_terminal)
            || (input.is_recording() && asked.sinks.iter().any(SinkSpec::is_watched));
        let speed = asked.playback_speed.or(is_watched.then_some(1.0));
        let gather = input.is_recording() && speed.is_none();
        let ends = input.is_recording() && asked.repeat != Some(0);
        let batch = asked.batch.map_or(if gather { RECORDED_BATCH } else { 1 }, |batch| batch as usize);
        Self { speed, gather, batch, ends }
    }
}

/// All that a run has before its sinks are opened.
pub(super) struct Prepared {
    body: Body,
    engine: Engine,
    /// Its backend: the name, what it runs on, and why it was chosen.
    backend: [String; 3],
    #[cfg(feature = "page")]
    options: somatic::Options,
    source: Box<dyn Source + Send>,
    lines: Option<(Lines, Option<OutputPath>)>,
    wiring: Option<Wiring>,
    doubts: Option<Doubts>,
    pace: Pace,
    verify: bool,
    /// How long it goes at most.
    lasts: Option<Duration>,
}

impl Prepared {
    /// Opens what is read, boards last: they speak as soon as their lines are open, and not before somebody can listen. At its end
    /// the run writes a `summary` of its boards; it `lasts` so long at most.
    pub(super) fn open(
        asked: &Asked,
        input: &Input,
        at_terminal: bool,
        summary: Option<OutputPath>,
        lasts: Option<&str>,
    ) -> Result<Self> {
        let body = input.body(asked)?;
        // Why a body without a layout cannot be run is said once, by the error.
        let has_layout = !(body.taxels.is_empty() && body.fields.is_empty());
        for finding in body.findings.iter().filter(|_| !asked.quiet && has_layout) {
            say(&format!("{}: {finding}", body.name));
        }
        let ids: Vec<u32> = body.taxels.iter().map(|taxel| taxel.id).collect();
        let recorded = if input.is_merged() { None } else { Some(input.open(&ids, asked)?) };
        let lasts = lasts.map(words::seconds).transpose()?;
        if summary.is_some() && recorded.is_some() {
            return Err(Error::usage("--summary is for boards on serial lines; add --source serial:PORT"));
        }
        let pace = Pace::of(asked, input, at_terminal);
        let settled = settled(asked, Some(input), &body, pace.batch)?;
        let is_raw = settled.options.calibration.is_none() && !settled.options.tare;
        asked.line_keys().check_wipers(settled.options.calibration.as_ref(), &ids)?;
        let mut engine = Engine::new(&body, settled.options.clone())?;
        engine.keep_touch_taxels(asked.sinks.iter().any(|sink| matches!(sink, SinkSpec::Page(_))));
        let verify = asked.verify && has_another_to_compare(&engine, settled.why.as_deref())?;
        let (source, lines, wiring) = match recorded {
            Some(mut source) => {
                source.report_stale();
                (source, None, None)
            }
            None => {
                let opened = input.open_lines(&ids, asked)?;
                engine.track_stale();
                opened.wiring.iter().for_each(|wiring| engine.wire(wiring));
                (opened.source, Some((opened.lines, summary)), opened.wiring)
            }
        };
        let source = asked.jointed(source, &body)?;
        engine.set_channels(source.taxels()).map_err(|e| e.at("header").at(&input.name))?;
        let (name, device, why) = engine.backend();
        let mut prepared = Self {
            backend: [name.to_owned(), device, settled.why.unwrap_or_else(|| why.to_owned())],
            body,
            engine,
            #[cfg(feature = "page")]
            options: settled.options,
            source,
            lines,
            wiring,
            doubts: None,
            pace,
            verify,
            lasts,
        };
        prepared.tell(asked, input, is_raw);
        Ok(prepared)
    }

    /// Says, unless that is not wanted, what computes, and what is doubtful before the first frame.
    fn tell(&mut self, asked: &Asked, input: &Input, is_raw: bool) {
        if asked.quiet {
            return;
        }
        if asked.backend.unwrap_or_default() == BackendKind::Auto {
            let [name, device, why] = &self.backend;
            say(&format!("backend {name} ({device}): {why}"));
        }
        say_kept(&self.engine);
        let doubts = Doubts::new(&input.name, &self.body, self.source.taxels(), input.holds_any(), is_raw);
        doubts.of_taxels(self.engine.plan()).iter().for_each(|doubt| say(doubt));
        self.doubts = Some(doubts);
    }

    /// What sinks are told that are opened for `targets`; a recording has the `scene` in it.
    pub(super) fn session<'a>(
        &'a self,
        asked: &'a Asked,
        input: &'a Input,
        targets: &[SinkTarget],
        scene: Option<&Path>,
    ) -> Result<Session<'a>> {
        let plan = self.engine.plan();
        let records = targets.iter().any(SinkTarget::holds_attached);
        let [name, device, why] = &self.backend;
        Ok(Session {
            names: FieldNames::all_of(plan),
            all_fields: asked.all_fields,
            outputs: self.engine.percepts().outputs(),
            is_double: self.engine.percepts().precision() == Precision::F64,
            p_unit: plan.common_quantity().map_or("", Quantity::symbol),
            header: asked.header,
            taxels: self.source.taxels(),
            body: Some(&self.body),
            attached: if records { attachments(asked, &self.body, scene)? } else { Vec::new() },
            parts: asked.record.clone(),
            plan: Some(plan),
            source: &input.name,
            backend: [name, device, why],
            is_recorded: self.pace.ends,
            wiring: self.wiring.as_ref(),
            zenoh_config: asked.zenoh_config.as_deref(),
            ros_time: asked.ros_time.unwrap_or_default(),
        })
    }

    /// Starts to read, for `sinks` and what a `view` shows.
    pub(super) fn start(
        self,
        asked: &Asked,
        input: &Input,
        view: ViewKind,
        sinks: Vec<Box<dyn Sink + Send>>,
    ) -> Result<(Run, Console)> {
        let Self { body, engine, source, lines, pace, .. } = self;
        #[cfg(feature = "page")]
        let explainer = match asked.sinks.iter().any(|sink| matches!(sink, SinkSpec::Page(_))) {
            true => {
                let options = self.options.backend(self.backend[0].parse()?);
                Some(LiveExplainer::start(body.clone(), options, source.taxels().to_vec()))
            }
            false => None,
        };
        let about = RunInfo { engine: &engine, body: &body, source: &input.name, all_fields: asked.all_fields };
        let view = view.open(&about);
        let live = lines.map(|(lines, summary)| LineReport::new(lines, summary, asked.quiet));
        let feed = match &live {
            None => Feed::start(source, ReadMode { most: pace.batch, gather: pace.gather, speed: pace.speed }),
            Some(live) => Feed::start_woken(source, pace.batch, live.lines()),
        };
        let options = RunOptions {
            is_live: !pace.gather,
            verify: self.verify,
            tracks_stale: live.is_some(),
            recording: pace.ends.then(|| input.name.clone()),
            until: self.lasts.map(|span| Instant::now() + span),
        };
        let console = Console {
            view,
            live,
            doubts: self.doubts,
            #[cfg(feature = "page")]
            explainer,
        };
        Ok((Run::new(engine, feed, sinks, options), console))
    }
}
