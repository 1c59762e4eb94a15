//! What is left to be chosen, settled by measurements: those that are kept, or brief ones.

use somatic::internal::setup::Input;
use somatic::internal::setup::Setup;
use somatic::internal::tradeoff::{
    CallMode, Combination, Found, Measurement, Pick, Report, Store, TestFrames, Tested, day, software,
};
use somatic::scene::Coverage;
use somatic::{BackendKind, Body, Error, Options, Result};

use super::measured::{in_words, measure_options, missed, nothing_to_choose, played};
use crate::cli::stdio::say;

/// Seconds of a brief measurement, and its frames.
const BRIEF_S: f64 = 1.0;
const BRIEF_FRAMES: usize = 64;

/// Options with nothing left open, and what is to be said of them.
pub(in crate::cli) struct Settled {
    pub(in crate::cli) options: Options,
    /// Why it is this backend, where a measurement said so.
    pub(in crate::cli) why: Option<String>,
    /// What was measured of it, if it was.
    pub(in crate::cli) measured: Option<String>,
}

/// The GPU drivers of this machine, in words.
pub(super) fn driver() -> String {
    #[cfg(feature = "gpu")]
    return format!("{:?}", somatic::internal::backend::gpu::adapters());
    #[cfg(not(feature = "gpu"))]
    return "none".to_owned();
}

/// The options of `asked` for `body` and calls of `batch` frames, with what it leaves open settled.
pub(in crate::cli) fn settled(asked: &Setup, input: Option<&Input>, body: &Body, batch: usize) -> Result<Settled> {
    let ids: Vec<u32> = body.taxels.iter().map(|taxel| taxel.id).collect();
    let options = asked.options(body, &ids, batch)?;
    let target = asked.accuracy.target();
    let way = if batch > 1 { CallMode::Batch } else { CallMode::Live };
    let store = Store::of_user();
    let kept = store.as_ref().filter(|store| store.file(body, &options).exists());
    let recording = input.and_then(Input::recording);
    let found = kept.map_or(Found::Nothing, |store| store.find(body, &options, &driver(), recording.as_deref()));
    let (report, when) = match found {
        Found::Fresh(stored) => {
            let when = format!("on {}, on {}", day(stored.taken_at_s), stored.report.source);
            (Some(stored.report), when)
        }
        Found::Useless(why) => {
            if !asked.quiet {
                say(&format!("{why}; measured anew"));
            }
            (None, String::new())
        }
        Found::Nothing => (None, String::new()),
    };
    // Another run may have been asked to measure it.
    let report = report.map(|mut report| {
        let is_gpu = |row: &Measurement| row.words.backend == "gpu";
        let is_left_open = options.backend == BackendKind::Auto;
        if is_left_open && report.rows.iter().any(is_gpu) && software().is_some() {
            report.rows.retain(|row| !is_gpu(row));
        }
        report
    });
    if target.is_empty() {
        return Ok(match report {
            Some(report) => without_wish(options, &report, way, &when),
            None => Settled { options, why: None, measured: None },
        });
    }
    let (report, when) = match report {
        Some(report) => (report, when),
        None => {
            let again = input.filter(|input| input.is_recording());
            let played = again.map(|input| played(input, asked, body, BRIEF_FRAMES)).transpose()?;
            let played = played.unwrap_or_else(|| TestFrames::made_up(body, BRIEF_FRAMES));
            let brief = measure_options(asked, &options, BRIEF_S)?;
            let mut tested = Tested::new(body, &options, Some(played), BRIEF_FRAMES)?;
            let measured = tested.measure(body, &brief, &mut |_| true).or_else(|_| {
                // The first frames of a recording may touch nothing.
                tested.played = TestFrames::made_up(body, BRIEF_FRAMES);
                tested.measure(body, &brief, &mut |_| true)
            })?;
            let when = format!("briefly, just now, on {}", measured.source);
            (measured, when)
        }
    };
    if report.rows.is_empty() {
        return Err(nothing_to_choose(&target));
    }
    let Some(pick) = target.pick(&report, way) else {
        return Err(Error::failed(format!(
            "no measurement meets {}; widen the tolerance or the budget",
            target.words()
        )));
    };
    if !pick.missed.is_empty() {
        return Err(Error::failed(missed(&target, &pick)?));
    }
    granted(options, &report, &pick, &when, &target.words())
}

fn granted(options: Options, report: &Report, pick: &Pick<'_>, when: &str, target: &str) -> Result<Settled> {
    let Combination { backend, knobs } = pick.row.words.in_scene(&report.asked_by)?;
    let scene = options.scene.clone().knobs(knobs);
    Ok(Settled {
        options: options.scene(scene).backend(backend),
        why: Some(format!("picked for {target}, as measured {when}")),
        measured: Some(format!("{}; {when}", in_words(pick.row))),
    })
}

/// `options` with the backend that `report` says is the fastest, where that is left open.
fn without_wish(options: Options, report: &Report, way: CallMode, when: &str) -> Settled {
    let knobs = options.scene.knobs;
    let alike = |row: &&Measurement| {
        let Ok(combination) = row.words.in_scene(&report.asked_by) else { return false };
        let kind = options.backend;
        let other = combination.knobs;
        let arithmetic = knobs.arithmetic.or(other.arithmetic.filter(|_| is_usual(&combination)));
        let coverage =
            if knobs.coverage == Coverage::Auto { usual_coverage(&combination, way) } else { knobs.coverage };
        let wanted = knobs.arithmetic(arithmetic).coverage(coverage);
        (kind == BackendKind::Auto || kind == combination.backend) && other == wanted
    };
    let fastest = report.measurements(way).into_iter().find(alike);
    let Some(row) = fastest else { return Settled { options, why: None, measured: None } };
    let measured = Some(format!("{}; {when}", in_words(row)));
    let Ok(combination) = row.combination() else { return Settled { options, why: None, measured } };
    if options.backend != BackendKind::Auto {
        return Settled { options, why: None, measured };
    }
    let why = Some(format!("the fastest of these options, as measured {when}"));
    Settled { options: options.backend(combination.backend), why, measured }
}

/// Whether its arithmetic is the default of its backend.
fn is_usual(combination: &Combination) -> bool {
    use somatic::scene::Arithmetic;
    combination.backend == BackendKind::Reference || combination.knobs.arithmetic == Some(Arithmetic::OnePass)
}

/// The measured coverage that `auto` becomes.
fn usual_coverage(combination: &Combination, way: CallMode) -> Coverage {
    let gated = combination.backend == BackendKind::Cpu && way == CallMode::Live;
    if gated { Coverage::All } else { combination.knobs.coverage }
}
