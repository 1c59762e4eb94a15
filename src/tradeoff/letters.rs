//! What letters cost that the host makes: shear, temperature and proximity. They are made in double precision, the same bits on every
//! backend and with every option, so that of them there is nothing to trade.

use std::collections::BTreeMap;
use std::hint::black_box;
use std::time::Instant;

use serde::{Deserialize, Serialize};

use super::CallMode;
use super::errors::rank;
use super::frames::{Calls, TURN_TIME, TestFrames, made_up_value};
use super::measure::MeasureOptions;
use crate::backend::BackendKind;
use crate::body::Body;
use crate::engine::{Engine, Options};
use crate::error::Result;
use crate::field::FieldSet;
use crate::percept::Outputs;
use crate::scene::Plan;
use crate::signal::{Calibration, Channel, Frame, Letter, Receptor};

/// The part of the whole time in which letters take turns.
pub(super) const TIME_SHARE: f64 = 0.1;
/// The share of a way's work that is done when its engines are made.
const PROGRESS_BUILT: f64 = 0.1;
/// Minimum number of rounds; the first one warms up.
const MIN_ROUNDS: usize = 4;

/// What a letter costs that the host makes: measured on the CPU, of fields alone, as touches are not traded either.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LetterCost {
    /// Its name.
    pub letter: String,
    /// How frames were passed.
    pub way: CallMode,
    /// What it adds to the median time of a frame without touches, µs.
    pub us: f64,
    /// The part of the time of such a frame with all letters, 0 to 1.
    pub share: f64,
}

/// The plan for `options` on `body`, for its letters: with the fields in the layout's own charts, as others may take seconds.
///
/// # Errors
/// The scene is invalid.
pub(super) fn plan(body: &Body, options: &Options) -> Result<Plan> {
    let identity = Calibration::identity(body.taxels.len());
    Plan::new(body, &FieldSet::new(body)?, &options.scene, options.calibration.as_ref().unwrap_or(&identity))
}

/// Whether options change anything that `plan` computes: a letter is made of pressures.
pub(super) fn has_options(plan: &Plan) -> bool {
    plan.letters().iter().any(|letter| letter.receptor.is_of_pressure())
}

/// The letters of `plan` that the host makes.
pub(super) fn of_host(plan: &Plan) -> Vec<Letter> {
    plan.letters().iter().copied().filter(|letter| !letter.receptor.is_of_pressure()).collect()
}

/// The same for the letters of pressure alone: the others are made alike whatever is traded.
pub(super) fn of_pressure(options: &Options) -> Options {
    let scene = options.scene.clone();
    let mut letters = scene.letters.clone();
    letters.retain(|letter| letter.receptor.is_of_pressure());
    if letters.is_empty() {
        letters.push(Letter::default());
    }
    let outputs = scene.outputs - Outputs::OF_OTHER_LETTERS;
    options.clone().scene(scene.letters(letters).outputs(outputs))
}

/// What each letter of `plan`, that of `options`, costs beside the others if the host makes it: an engine with all of them takes turns with
/// one without it. `progress` gets the share that is done and returns whether to continue; if not, the ways are left out that are not done.
///
/// # Errors
/// The scene is invalid.
pub(super) fn letter_costs(
    body: &Body,
    (options, plan): (&Options, &Plan),
    played: &TestFrames,
    measure_options: &MeasureOptions,
    progress: &mut dyn FnMut(f64) -> bool,
) -> Result<Vec<LetterCost>> {
    let (all, of_host) = (plan.letters(), of_host(plan));
    if of_host.is_empty() {
        return Ok(Vec::new());
    }
    let frames = filled(body, played);
    let ways = measure_options.ways.len() as f64;
    let seconds = TIME_SHARE * measure_options.seconds / ways;
    let mut costs = Vec::new();
    for (done, &way) in measure_options.ways.iter().enumerate() {
        let mut goes_on = |share: f64| progress((done as f64 + share) / ways);
        let at_once = if way == CallMode::Live { 1 } else { measure_options.batch.max(1) };
        let engine = |letters: Vec<Letter>| -> Result<Option<Engine>> {
            let outputs = plan.outputs() - outputs_of_others(plan, &letters);
            let scene = options.scene.clone().letters(letters.clone()).outputs(outputs).touches(None);
            let options = options.clone().scene(scene).backend(BackendKind::Cpu).batch(at_once);
            let made = || {
                let mut engine = Engine::new(body, options)?;
                engine.set_channels(&frames.taxels)?;
                Ok(engine)
            };
            if letters.is_empty() { Ok(None) } else { made().map(Some) }
        };
        let without = |left_out: &Letter| all.iter().copied().filter(|letter| letter != left_out).collect();
        let sets: Vec<Vec<Letter>> = std::iter::once(all.to_vec()).chain(of_host.iter().map(without)).collect();
        let mut engines = Vec::new();
        for (made, letters) in sets.iter().enumerate() {
            if !goes_on(PROGRESS_BUILT * made as f64 / sets.len() as f64) {
                return Ok(costs);
            }
            engines.push(engine(letters.clone())?);
        }
        let mut calls = Calls::new(&frames.frames, at_once);
        let mut timed = |share: f64| goes_on(PROGRESS_BUILT + (1.0 - PROGRESS_BUILT) * share);
        let Some(times) = medians(&mut engines, &mut calls, seconds, &mut timed)? else { return Ok(costs) };
        for (letter, time) in of_host.iter().zip(&times[1..]) {
            let us = (times[0] - time).max(0.0);
            costs.push(LetterCost { letter: letter.receptor.to_string(), way, us, share: us / times[0] });
        }
    }
    progress(1.0);
    Ok(costs)
}

/// What the letters of `plan` give that are not among `letters`.
fn outputs_of_others(plan: &Plan, letters: &[Letter]) -> Outputs {
    let is_left_out = |receptor: Receptor| letters.iter().all(|letter| letter.receptor != receptor);
    let stages = plan.explain().into_iter().filter(|stage| stage.letter.is_some_and(is_left_out));
    stages.fold(Outputs::empty(), |sum, stage| sum | stage.gives)
}

/// The same frames with a value for each channel of `body`: what a recording lacks is made up, as a letter without values costs nothing.
fn filled(body: &Body, played: &TestFrames) -> TestFrames {
    let there: BTreeMap<u32, usize> = played.taxels.iter().copied().zip(0..).collect();
    let taxels = Channel::all_of(body);
    let fill = |(number, frame): (usize, &Frame)| {
        let value = |(index, channel): (usize, &u32)| match there.get(channel) {
            Some(&at) => frame.values[at],
            None => made_up_value(index, number),
        };
        Frame { values: taxels.iter().enumerate().map(value).collect(), ..frame.clone() }
    };
    let frames = played.frames.iter().enumerate().map(fill).collect();
    TestFrames { source: played.source.clone(), taxels, frames, truth: Vec::new() }
}

/// The median time of a frame on each of `engines`, which take turns for some seconds, µs; 0 of none. `None` if `progress` stops it.
fn medians(
    engines: &mut [Option<Engine>],
    calls: &mut Calls,
    seconds: f64,
    progress: &mut dyn FnMut(f64) -> bool,
) -> Result<Option<Vec<f64>>> {
    let mut times_us: Vec<Vec<f64>> = vec![Vec::new(); engines.len()];
    let mut passes = vec![0; engines.len()];
    let start = Instant::now();
    for round in 0.. {
        for ((engine, times_us), passes) in engines.iter_mut().zip(&mut times_us).zip(&mut passes) {
            let Some(engine) = engine else { continue };
            if !progress((start.elapsed().as_secs_f64() / seconds).min(1.0)) {
                return Ok(None);
            }
            let began = Instant::now();
            while began.elapsed() < TURN_TIME {
                for index in 0..calls.calls.len() {
                    let call = calls.at(index, *passes);
                    let began = Instant::now();
                    black_box(engine.process(black_box(call))?);
                    if round > 0 {
                        times_us.push(began.elapsed().as_secs_f64() * 1e6 / call.len() as f64);
                    }
                }
                *passes += 1;
            }
        }
        if round + 1 >= MIN_ROUNDS && start.elapsed().as_secs_f64() >= seconds {
            break;
        }
    }
    let median = |mut times: Vec<f64>| {
        times.sort_by(f64::total_cmp);
        if times.is_empty() { 0.0 } else { rank(&times, 0.5) }
    };
    Ok(Some(times_us.into_iter().map(median).collect()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bundled;
    use crate::scene::Scene;
    use crate::signal::{RawValue, Receptor};

    fn costs_until(letters: &[Receptor], goes_on: &mut dyn FnMut(f64) -> bool) -> (bool, Vec<LetterCost>) {
        let body = Body::from_bytes("sensing-hand", bundled::SENSING_HAND).unwrap();
        let options = Options::default().scene(Scene::default().letters(Letter::all_of(letters, &[])));
        let ways = CallMode::ALL.to_vec();
        let how = MeasureOptions { seconds: 0.1, batch: 16, ways, backends: vec![BackendKind::Cpu] };
        let plan = plan(&body, &options).unwrap();
        let played = TestFrames::made_up(&body, 1);
        (has_options(&plan), letter_costs(&body, (&options, &plan), &played, &how, goes_on).unwrap())
    }

    fn costs(letters: &[Receptor]) -> (bool, Vec<LetterCost>) {
        costs_until(letters, &mut |_| true)
    }

    #[test]
    fn every_letter_that_the_host_makes_has_its_cost_and_no_other() {
        let (has_options, all) = costs(&[]);
        let named: Vec<(&str, &str)> = all.iter().map(|cost| (&cost.letter[..], cost.way.word())).collect();
        let letters = ["shear", "temperature", "proximity"];
        assert_eq!(named, [("live", letters), ("batch", letters)].map(|(way, all)| all.map(|one| (one, way))).concat());
        assert!(has_options && all.iter().all(|cost| (0.0..1.0).contains(&cost.share)), "{all:?}");
        // A shear of 29 pressed taxels is not free.
        assert!(all.iter().all(|cost| cost.letter != "shear" || cost.us > 0.0), "{all:?}");
        // Alone, a letter is all of the time, and nothing is to be chosen.
        let (has_options, alone) = costs(&[Receptor::Temperature]);
        assert!(!has_options && alone.iter().all(|cost| cost.us > 0.0 && cost.share == 1.0), "{alone:?}");
        assert_eq!(alone.len(), 2);
        // Of pressures none is made by the host.
        assert_eq!(costs(&[Receptor::Sustained]), (true, Vec::new()));
    }

    #[test]
    fn letters_report_how_far_they_are_and_stop_when_asked() {
        let mut shares = Vec::new();
        costs_until(&[], &mut |share| {
            shares.push(share);
            true
        });
        assert!(shares.windows(2).all(|pair| pair[0] <= pair[1]), "{shares:?}");
        assert!(shares[0] == 0.0 && shares.last() == Some(&1.0) && shares.len() > 20, "{shares:?}");
        // At once, and within the second way: what is done by then counts.
        let mut asked = 0;
        let at_once = costs_until(&[], &mut |_| {
            asked += 1;
            false
        });
        assert_eq!((at_once.1.len(), asked), (0, 1));
        let (_, half) = costs_until(&[], &mut |share| share <= 0.5);
        assert!(half.len() == 3 && half.iter().all(|cost| cost.way == CallMode::Live), "{half:?}");
    }

    #[test]
    fn values_that_a_recording_lacks_are_made_up_and_no_others() {
        let body = Body::from_bytes("sensing-hand", bundled::SENSING_HAND).unwrap();
        let all = Channel::all_of(&body);
        let own = Frame { t_s: 1.0, values: vec![RawValue::new(-5.0), RawValue::MISSING], ..Frame::default() };
        let played = TestFrames { taxels: vec![all[3], all[40]], frames: vec![own], ..TestFrames::default() };
        let filled = filled(&body, &played);
        let values = &filled.frames[0].values;
        assert_eq!((filled.taxels.len(), values.len(), filled.frames[0].t_s), (all.len(), all.len(), 1.0));
        assert!(values[3].number() == Some(-5.0) && values[40].is_missing());
        let made = values.iter().enumerate().filter(|(index, _)| ![3, 40].contains(index));
        assert!(made.clone().count() == all.len() - 2 && made.into_iter().all(|(_, value)| value.number() > Some(0.0)));
    }
}
