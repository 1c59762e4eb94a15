//! A recording that has been read and can be shown.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use somatic::internal::page::{PageInfo, PageScene, Publisher};
use somatic::internal::scene::SenseRanges;
use somatic::internal::setup::{Input, Setup};
use somatic::page::Server;
use somatic::signal::Quantity;
use somatic::source::SourceSpec;
use somatic::{Body, ChosenBackend, Engine, Error, Result};

use super::super::scene::input;
use super::super::stdio::say;
use super::super::tradeoff::{Settled, settled};
use super::answers::Explainer;
use super::checkpoints::Checkpoints;
use super::clock::Clock;
use super::peaks::Peaks;
use super::player::Player;
use super::recorded::{Differences, Recorded};
use super::recording::{CHUNK, Recording};
use super::shared::Shared;
use super::timeline;

/// A recording in memory, its body, and an engine for it.
pub(super) struct Ready {
    input: Input,
    body: Arc<Body>,
    recording: Arc<Recording>,
    settled: Settled,
    engine: Engine,
}

/// How far the readings of a recording go.
#[derive(Clone, Copy, Default)]
pub(super) struct Extremes {
    pub(super) pressure: Option<f64>,
    pub(super) senses: SenseRanges,
}

impl Extremes {
    /// Those of both; of pressures only if these are of the same quantity.
    pub(super) fn of_both([one, other]: [Self; 2], is_same: bool) -> [Self; 2] {
        let senses = one.senses.union(other.senses);
        let both = [one.pressure, other.pressure].into_iter().flatten().reduce(f64::max);
        [one, other].map(|own| Self { pressure: if is_same { both } else { own.pressure }, senses })
    }
}

impl Ready {
    /// Reads what `asked` names. `None` if `stop` was set meanwhile.
    ///
    /// # Errors
    /// It is no recording, cannot be read, or does not fit its body.
    pub(super) fn read(asked: &Setup, stop: &AtomicBool) -> Result<Option<Self>> {
        let input = input(asked)?;
        if !input.is_recording() {
            return Err(Error::usage("a view shows recordings; show live frames with `somatic run --sink page`")
                .at(&input.name));
        }
        let body = Arc::new(input.body(asked)?);
        let source = input.open_posed(&body, asked)?;
        let Some(recording) = Recording::read(source, stop, asked.quiet)? else { return Ok(None) };
        let settled = settled(asked, Some(&input), &body, CHUNK)?;
        let mut engine = Engine::new(&body, settled.options.clone())?;
        engine.keep_touch_taxels(true);
        engine.set_channels(&recording.taxels).map_err(|e| e.at("header").at(&input.name))?;
        if !asked.quiet {
            engine.remarks().iter().for_each(|remark| say(remark));
        }
        Ok(Some(Self { input, body, recording: Arc::new(recording), settled, engine }))
    }

    /// Whether it is the bundled touch.
    pub(super) fn is_bundled(&self) -> bool {
        self.input.is_bundled()
    }

    /// The largest pressure and what else taxels read, unless finding it takes long.
    pub(super) fn extremes(&self) -> Extremes {
        Extremes {
            pressure: self.recording.largest_pressure(&self.engine),
            senses: self.recording.sense_ranges(&self.engine, &self.body),
        }
    }

    /// What pressures are of, if all are of the same.
    pub(super) fn quantity(&self) -> Option<Quantity> {
        self.engine.plan().common_quantity()
    }

    /// What a page shows of it, in colours up to `extremes` where nothing else says how far.
    pub(super) fn scene(&self, extremes: Extremes) -> PageScene {
        let ChosenBackend { name, device, reason, .. } = self.engine.backend();
        PageScene::new(
            &self.body,
            self.engine.plan(),
            &PageInfo {
                source: &self.input.name,
                mode: self.recording.mode(),
                backend: [name, &device, self.settled.why.as_deref().unwrap_or(reason)],
                taxels: &self.recording.taxels,
                wiring: None,
                recorded_max: extremes.pressure,
                recorded_senses: extremes.senses,
            },
        )
    }

    /// Plays it by `clock` until `is_over`. Whether part of it was never processed.
    ///
    /// # Errors
    /// The device was lost, or percepts in the recording cannot be read.
    pub(super) fn play(
        self,
        mut server: Server,
        mut publisher: Publisher,
        clock: Clock,
        is_over: impl Fn() -> bool,
    ) -> Result<bool> {
        let Self { input, body, recording, settled, mut engine } = self;
        // At first, as a browser may be there already.
        let requests = server.requests().ok_or_else(|| Error::failed("the server has no requests"))?;
        // The same backend for all engines, so that they have the same bits.
        let options = settled.options.backend(engine.backend().name.parse()?);
        let checkpoints = Arc::new(Checkpoints::new(&mut engine)?);
        let recorded = match input.spec {
            Some(SourceSpec::Mcap(ref path)) => Recorded::open(path, engine.plan())?,
            _ => None,
        };
        let shared = Shared {
            peaks: Arc::new(Peaks::new(&body, &recording)),
            body,
            options,
            recording: Arc::clone(&recording),
            checkpoints,
            differences: Arc::new(Differences::default()),
            replies: server.replies(),
        };
        let timeline = timeline::start(shared.clone(), recorded, publisher.recording_events());
        let explainer = Explainer::start(shared.clone());
        let player = Player::new(engine, shared, publisher, explainer, timeline, clock);
        player.run(&requests, is_over)?;
        for loss in &recording.losses {
            say(&format!("never processed: {loss}"));
        }
        Ok(!recording.losses.is_empty())
    }
}
