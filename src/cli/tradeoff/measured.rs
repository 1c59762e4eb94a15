//! On which frames is measured, and how a measurement is described.

use somatic::internal::setup::Setup;
use somatic::internal::setup::{Input, RECORDED_BATCH};
use somatic::internal::tradeoff::{MeasureOptions, Measurement, Pick, Store, Target, TestFrames};
use somatic::source::{SimulatedSource, SourceSpec};
use somatic::{Body, Error, Options, Result};

use crate::cli::words::number;

/// What `pick` misses of `target`, which nothing grants.
pub(super) fn missed(target: &Target, pick: &Pick<'_>) -> Result<String> {
    let combination = pick.row.combination()?;
    Ok(format!("no options meet {}; nearest is {combination}: {}", target.words(), pick.missed.join("; ")))
}

/// Why nothing can be picked for `target` where no letter is made of pressures.
pub(super) fn nothing_to_choose(target: &Target) -> Error {
    let what =
        format!("nothing to choose for {}: options are for letters of pressure, and there is none", target.words());
    Error::usage(format!("{what}; leave `within` and `budget` out"))
}

pub(super) fn measure_options(asked: &Setup, options: &Options, seconds: f64) -> Result<MeasureOptions> {
    let batch = asked.batch.map_or(RECORDED_BATCH, |batch| batch as usize);
    MeasureOptions::of_backend(options.backend, seconds, batch)
}

/// The first frames of `input`, up to `most`, and the truth where it knows it.
pub(super) fn played(input: &Input, asked: &Setup, body: &Body, most: usize) -> Result<TestFrames> {
    match &input.spec {
        Some(SourceSpec::Sim(path)) => TestFrames::simulated(&input.name, &mut SimulatedSource::open(path)?, most),
        _ => TestFrames::read(&input.name, &mut *input.open_posed(body, asked)?, most),
    }
}

/// What measurements on `input`, or on touches simulated on the body, are kept for.
pub(super) fn recording(input: Option<&Input>) -> Option<String> {
    input.map_or(Some(Store::TOUCHES.to_owned()), Input::recording)
}

/// What `somatic plan` calls a row.
pub(super) fn in_words(row: &Measurement) -> String {
    let [place, orientation] = row.judged();
    let mut words = vec![format!("{:.2} µs a frame, p99 {:.2} µs", row.p50_us, row.p99_us)];
    let from = if row.truth.is_some() { "the truth" } else { "the reference" };
    if place.compared > 0 {
        words.push(format!("95 % of places within {} mm of {from}", number(place.p95)));
    }
    if orientation.compared > 0 {
        words.push(format!("95 % of angles within {}°", number(orientation.p95)));
    }
    if let Some(truth) = row.truth.filter(|truth| truth.given < 1.0) {
        words.push(format!("given for {:.0} % of the touches, absent for the others", 100.0 * truth.given));
    }
    words.join(", ")
}
