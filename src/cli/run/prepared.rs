//! A run before its first frame: its source is open, its engine made, and nothing is written yet.

use std::time::{Duration, Instant};

use somatic::internal::run::{Opened, Pace, RunOptions, Several};
use somatic::internal::setup::{Input, Setup};
use somatic::output::OutputPath;
use somatic::run::Run;
use somatic::sink::Sink;
#[cfg(feature = "page")]
use somatic::sink::SinkSpec;
use somatic::{BackendKind, Error, Options, Result};

use super::console::Console;
use super::order::{OrderOf, OrderReport};
use crate::cli::doubts::Doubts;
#[cfg(feature = "page")]
use crate::cli::explanation::LiveExplainer;
use crate::cli::lines::LineReport;
use crate::cli::live::{RunInfo, ViewKind};
use crate::cli::stdio::say;
use crate::cli::tradeoff::{Settled, say_kept, settled};
use crate::cli::verify::has_another_to_compare;
use crate::cli::words;

/// All that a run at a terminal has before its sinks are opened.
pub(super) struct Prepared {
    pub(super) opened: Opened,
    options: Options,
    /// What is written of boards at the end.
    summary: Option<OutputPath>,
    doubts: Option<Doubts>,
    has_calibration: bool,
    verify: bool,
    /// How long it goes at most.
    lasts: Option<Duration>,
}

impl Prepared {
    /// Opens what is read. At its end the run writes a `summary` of its boards; it `lasts` so long at most.
    pub(super) fn open(
        asked: &Setup,
        input: &Input,
        at_terminal: bool,
        summary: Option<OutputPath>,
        lasts: Option<&str>,
    ) -> Result<Self> {
        let body = input.body(asked)?;
        // The error alone says why a body without a layout cannot be run.
        let has_layout = !(body.taxels.is_empty() && body.fields.is_empty());
        for finding in body.findings.iter().filter(|_| !asked.quiet && has_layout) {
            say(&format!("{}: {finding}", body.name));
        }
        let lasts = lasts.map(words::seconds).transpose()?;
        if summary.is_some() && !input.is_merged() {
            return Err(Error::usage("--summary is for boards on serial lines; add --source serial:PORT"));
        }
        let pace = Pace::for_input(asked, input, input.is_bundled() && at_terminal);
        let mut chosen = None;
        let opened = Opened::new(asked, input, body, pace, |body| {
            let Settled { options, why, .. } = settled(asked, Some(input), body, pace.batch)?;
            chosen = Some((options.clone(), why.clone()));
            Ok((options, why))
        })?;
        let (options, why) = chosen.unwrap_or_default();
        let is_raw = options.calibration.is_none() && !options.tare;
        let has_calibration = options.calibration.is_some();
        let verify = asked.verify && has_another_to_compare(&opened.engine, why.as_deref())?;
        let mut prepared = Self { opened, options, summary, doubts: None, has_calibration, verify, lasts };
        prepared.tell(asked, input, is_raw);
        Ok(prepared)
    }

    /// Says, unless that is not wanted, what computes, and what is doubtful before the first frame.
    fn tell(&mut self, asked: &Setup, input: &Input, is_raw: bool) {
        if asked.quiet {
            return;
        }
        let Opened { body, engine, backend: [name, device, why], source, .. } = &self.opened;
        if asked.backend.unwrap_or_default() == BackendKind::Auto {
            say(&format!("backend {name} ({device}): {why}"));
        }
        say_kept(engine);
        let doubts = Doubts::new(&input.name, body, source.taxels(), input.holds_any(), is_raw);
        doubts.of_taxels(engine.plan()).iter().for_each(|doubt| say(doubt));
        self.doubts = Some(doubts);
    }

    /// Starts to read, for `sinks` and what a `view` shows, what is asked of each recording; the first one is open. Prints the order
    /// of what is pressed, if that is asked for.
    pub(super) fn start(
        self,
        several: Several,
        input: &Input,
        view: ViewKind,
        sinks: Vec<Box<dyn Sink + Send>>,
        check_order: Option<OrderOf>,
    ) -> Result<(Run, Console)> {
        let asked = several.first();
        let Opened { body, engine, lines, .. } = &self.opened;
        let word = if asked.map.is_some() { "pad" } else { "field" };
        let order = check_order
            .map(|of| OrderReport::new(&self.opened, of, word, !self.has_calibration, !input.is_recording()));
        #[cfg(feature = "page")]
        let explainer = match asked.sinks.iter().any(|sink| matches!(sink, SinkSpec::Page(_))) {
            true => {
                let Opened { backend, source, .. } = &self.opened;
                let options = self.options.clone().backend(backend[0].parse()?);
                Some(LiveExplainer::start(body.clone(), options, source.taxels().to_vec()))
            }
            false => None,
        };
        let about = RunInfo { engine, body, source: several.title(&input.name), all_fields: asked.all_fields };
        let console = Console {
            view: view.open(&about),
            live: lines.clone().map(|lines| LineReport::new(lines, self.summary, asked.quiet)),
            doubts: self.doubts,
            order,
            #[cfg(feature = "page")]
            explainer,
        };
        let until = self.lasts.map(|span| Instant::now() + span);
        let following = several.following(&self.opened, &self.options)?;
        let run = self.opened.start(sinks, input, &RunOptions { verify: self.verify, until, ..RunOptions::default() });
        Ok((run.followed_by(following), console))
    }
}
