//! What a plan should take, from its own counts and what this machine was found to take for each.

use somatic::scene::{Cadence, Coverage, PlannedStage};
use somatic::tradeoff::{Combination, Rates, Rung, Store, day};
use somatic::{BackendKind, Error};

use crate::cli::say;
use crate::cli::tradeoff::driver;

/// Times of a frame, µs.
pub(super) struct Estimate {
    /// Per rung; `None` where nothing is known of one of its stages.
    pub(super) rungs_us: Vec<Option<f64>>,
    /// Of all.
    pub(super) whole_us: Option<f64>,
    /// Where it comes from, or why there is none.
    pub(super) by: String,
}

impl Estimate {
    /// Of a plan whose stages are `explained`, for calls of `batch` frames.
    pub(super) fn new(rungs: &[Rung], explained: &[PlannedStage], knobs: Combination, batch: usize) -> Self {
        let rates = gated(knobs).map_or_else(|| rates(knobs, batch), |why| Err(Error::failed(why)));
        let (rates, by) = match rates {
            Ok(known) => known,
            Err(why) => return Self { rungs_us: vec![None; rungs.len()], whole_us: None, by: why.to_string() },
        };
        let us = |rung: &Rung| rates.estimate_us(&explained[rung.stages.clone()]);
        let rungs_us: Vec<Option<f64>> = rungs.iter().map(us).collect();
        let whole_us: Option<f64> = rungs_us.iter().copied().sum();
        let by = if whole_us.is_some() { by } else { "nothing is known of letter `change`".to_owned() };
        Self { rungs_us, whole_us, by }
    }
}

/// Why counts do not tell what `knobs` take, where they do not.
fn gated(knobs: Combination) -> Option<String> {
    let Combination { knobs, .. } = knobs;
    let all = matches!(knobs.coverage, Coverage::Auto | Coverage::All) && knobs.cadence == Cadence::EveryFrame;
    let what = if knobs.cadence == Cadence::EveryFrame { knobs.coverage.word() } else { knobs.cadence.word() };
    (!all).then(|| format!("with `{what}` it hangs on what is touched, and counts do not tell that"))
}

/// The rates of this machine, and where they come from.
fn rates(knobs: Combination, batch: usize) -> Result<(Rates, String), Error> {
    let Combination { backend, knobs } = knobs;
    let driver = if backend == BackendKind::Gpu { driver() } else { somatic::backend::processor() };
    let [name, arithmetic, ..] = Combination { backend, knobs }.words();
    let built = if cfg!(debug_assertions) { "without optimisation" } else { "with optimisation" };
    let of = format!("{name}, {arithmetic}, {batch} frames a call, {built}");
    let store = Store::of_user();
    if let Some(stored) = store.as_ref().and_then(|store| store.rates(&of, &driver)) {
        return Ok((stored.rates, format!("by what this machine took on other skins on {}", day(stored.taken_at_s))));
    }
    let arithmetic = knobs.arithmetic.filter(|_| backend != BackendKind::Reference);
    let rates = Rates::learn(backend, arithmetic, batch)?;
    if let Some(store) = store
        && let Err(e) = store.keep_rates(&of, &driver, &rates)
    {
        say(&format!("what was learned of this machine is not kept: {e}"));
    }
    Ok((rates, "by what this machine took on other skins just now".to_owned()))
}
