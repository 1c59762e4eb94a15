//! Measures time and errors of combinations of knobs.

use std::collections::BTreeMap;
use std::hint::black_box;
use std::time::Instant;

use super::errors::{ChartGeometry, ErrorSamples, Errors, rank};
use super::fits;
use super::frames::{Calls, TURN_TIME};
use super::truth::{OfTouches, Truths};
use super::{CallMode, Combination, Measurement, Report, SimulatedTouches, TestFrames};
use crate::backend::BackendKind;
use crate::body::Body;
use crate::engine::{Engine, Options};
use crate::error::{Error, Result};
use crate::field::{FieldSet, Recharted};
use crate::percept::{Flags, Outputs, Percepts};
use crate::scene::{Charts, Knobs, OrientationBy, Scene};
use crate::signal::Receptor;

/// Settings of a measurement.
#[derive(Clone, Debug)]
pub struct MeasureOptions {
    /// Total time of all turns, s.
    pub seconds: f64,
    /// Frames per call of a batch.
    pub batch: usize,
    /// Live, in batches, or both.
    pub ways: Vec<CallMode>,
    /// The backends.
    pub backends: Vec<BackendKind>,
}

/// Minimum number of rounds; the first one warms up.
const MIN_ROUNDS: usize = 4;

/// The shares of all work that are done when all engines are made, and when all errors are known.
const PROGRESS_BUILT: f64 = 0.1;
const PROGRESS_COMPARED: f64 = 0.3;

/// A combination that is being measured.
struct Trial {
    way: CallMode,
    combination: Combination,
    engine: Engine,
    /// The next call, and the number of complete passes.
    next: usize,
    passes: u32,
    times_us: Vec<f64>,
    errors: ErrorSamples,
    truth: Option<OfTouches>,
}

/// Measures all combinations of knobs for `options` on `body`, whose letters are of pressures; knobs that `options` sets stay fixed.
///
/// Times, and errors against the reference, are of `played`. Errors against the truth are of `played` too where it has one, else
/// of `touches` where there are some.
///
/// `progress` gets the share that is done and returns whether to continue. If not, the report has what was measured so far,
/// if every combination had a turn.
///
/// # Errors
/// No frame touches a field; the scene is invalid; it was stopped too early.
pub fn measure(
    body: &Body,
    options: &Options,
    played: &TestFrames,
    touches: Option<&SimulatedTouches>,
    measure_options: &MeasureOptions,
    progress: &mut dyn FnMut(f64) -> bool,
) -> Result<Report> {
    // Once, as geodesic charts may take seconds.
    let charted = all_charts(body, options)?;
    let geometries = geometries(body, options, &charted)?;
    let mut report = Report {
        body: body.name.clone(),
        source: played.source.clone(),
        frames: played.frames.len(),
        asked_by: asked_by(&options.scene).word().to_owned(),
        kept_charts: geometries.values().flat_map(|geometry| geometry.kept.clone()).collect(),
        ..Report::default()
    };
    let authored = &geometries[Charts::AsAuthored.word()];
    let another = |charts: Charts| charts == options.scene.knobs.charts || !geometries[charts.word()].is_like(authored);
    for charts in Charts::ALL.iter().filter(|charts| geometries.contains_key(charts.word()) && !another(**charts)) {
        report.left_out.push(format!("charts {charts}: they are the layout's own"));
    }
    if options.scene.outputs.intersects(Outputs::ORIENTATION | Outputs::PRINCIPAL_AXIS) && !can_fit(options) {
        report.left_out.push("fits: no calibration says what the layer is; add [layer] with sigma_m to it".to_owned());
    }
    let combinations: Vec<(CallMode, Combination)> = measure_options
        .ways
        .iter()
        .flat_map(|&way| {
            Combination::all(&options.scene, way, &measure_options.backends, can_fit(options))
                .into_iter()
                .map(move |one| (way, one))
        })
        .filter(|(_, combination)| another(combination.knobs.charts))
        .collect();
    let mut trials = Vec::new();
    for (index, &(way, combination)) in combinations.iter().enumerate() {
        let recharted = charted[combination.knobs.charts.word()].clone();
        match Trial::new(body, options, played, way, combination, recharted, measure_options.batch) {
            Ok(trial) => trials.push(trial),
            Err(e) if combination.backend == BackendKind::Gpu => {
                let why = format!("gpu: {e}");
                if !report.left_out.contains(&why) {
                    report.left_out.push(why);
                }
            }
            Err(e) => return Err(e),
        }
        go_on(progress, PROGRESS_BUILT * (index + 1) as f64 / combinations.len() as f64)?;
    }
    // Errors, once.
    let right = ReferencePercepts::new(body, options, played)?;
    (report.touched, report.ties) = (right.touched, right.ties);
    let mut truth = Truths::new(body, options, played, touches, &charted, authored)?;
    report.truth = truth.is_some();
    report.touches = truth.as_ref().map_or(String::new(), |truth| truth.description.clone());
    if report.touched == 0 {
        return Err(Error::failed("no field with a chart is touched in these frames; give others").at(&played.source));
    }
    let count = trials.len();
    let mut calls = [Calls::new(&played.frames, 1), Calls::new(&played.frames, measure_options.batch.max(1))];
    for (index, trial) in trials.iter_mut().enumerate() {
        let geometry = &geometries[&trial.combination.knobs.charts.word()];
        trial.compare(&mut calls[trial.way as usize], geometry, authored, &right)?;
        if let Some(truth) = &mut truth {
            let recharted = &charted[trial.combination.knobs.charts.word()];
            trial.truth = Some(truth.errors(trial.combination, recharted, geometry, authored)?);
        }
        let done = (PROGRESS_COMPARED - PROGRESS_BUILT) * (index + 1) as f64 / count as f64;
        go_on(progress, PROGRESS_BUILT + done)?;
    }
    take_turns(&mut trials, &mut calls, measure_options.seconds, progress)?;
    report.rows = trials.into_iter().map(Trial::row).collect();
    report.find_front();
    Ok(report)
}

/// Reports that the share `done` is done, unless that is where it stops.
fn go_on(progress: &mut dyn FnMut(f64) -> bool, done: f64) -> Result<()> {
    match progress(done) {
        true => Ok(()),
        false => Err(stopped_early()),
    }
}

pub(super) fn stopped_early() -> Error {
    Error::failed("stopped before everything had been measured once")
}

/// Times all trials in turns for some seconds. The first turn, in which memory is fetched, does not count.
fn take_turns(
    trials: &mut [Trial],
    calls: &mut [Calls; 2],
    seconds: f64,
    progress: &mut dyn FnMut(f64) -> bool,
) -> Result<()> {
    let start = Instant::now();
    for round in 1.. {
        for trial in &mut *trials {
            trial.turn(&mut calls[trial.way as usize])?;
        }
        if round == 1 {
            trials.iter_mut().for_each(|trial| trial.times_us.clear());
        }
        let share = (start.elapsed().as_secs_f64() / seconds).min(1.0);
        let goes_on = go_on(progress, PROGRESS_COMPARED + (1.0 - PROGRESS_COMPARED) * share);
        if round < 2 {
            goes_on?;
        } else if goes_on.is_err() || (round >= MIN_ROUNDS && share >= 1.0) {
            break;
        }
    }
    Ok(())
}

/// Whether contacts can be fitted to touches.
fn can_fit(options: &Options) -> bool {
    let asked = &options.scene.letters;
    let has_touches = asked.is_empty() || asked.iter().any(|letter| letter.receptor == Receptor::Sustained);
    has_touches && options.calibration.as_ref().is_some_and(|calibration| calibration.layer.is_some())
}

/// The method of orientation that `scene` requests.
fn asked_by(scene: &Scene) -> OrientationBy {
    match scene.knobs.orientation_by {
        OrientationBy::AsAsked if scene.outputs.contains(Outputs::ORIENTATION) => OrientationBy::TwoPoints,
        OrientationBy::AsAsked if scene.outputs.contains(Outputs::PRINCIPAL_AXIS) => OrientationBy::SecondMoments,
        given => given,
    }
}

/// The body's fields with each kind of charts to measure.
fn all_charts(body: &Body, options: &Options) -> Result<BTreeMap<&'static str, Recharted>> {
    let given = options.scene.knobs.charts;
    let kinds =
        Charts::ALL.iter().filter(|&&kind| given == Charts::AsAuthored || kind == given || kind == Charts::AsAuthored);
    kinds.map(|kind| Ok((kind.word(), kind.applied(body, FieldSet::new(body)?, &options.scene.fields)?))).collect()
}

/// Their geometries.
fn geometries(
    body: &Body,
    options: &Options,
    charted: &BTreeMap<&'static str, Recharted>,
) -> Result<BTreeMap<&'static str, ChartGeometry>> {
    let kinds = Charts::ALL.iter().filter_map(|kind| Some((kind, charted.get(kind.word())?)));
    kinds.map(|(&kind, charted)| Ok((kind.word(), ChartGeometry::new(body, options, kind, charted)?))).collect()
}

/// The reference's percepts of all frames.
struct ReferencePercepts {
    percepts: Percepts,
    touched: u64,
    ties: u64,
}

impl ReferencePercepts {
    fn new(body: &Body, options: &Options, played: &TestFrames) -> Result<Self> {
        let outputs = Outputs::CENTROID | Outputs::ORIENTATION | Outputs::PRINCIPAL_AXIS;
        let touches = can_fit(options).then(fits::asked);
        let scene = options.scene.clone().outputs(outputs).knobs(Knobs::default()).touches(touches);
        let options = options.clone().scene(scene).backend(BackendKind::Reference);
        let mut engine = Engine::new(body, options)?;
        engine.set_channels(&played.taxels).map_err(|e| e.at(&played.source))?;
        let percepts = engine.process(&played.frames)?.clone();
        let (mut touched, mut ties) = (0, 0);
        for frame in 0..percepts.frames() {
            for percept in percepts.touched(frame).filter(|percept| percept.letter == 0 && percept.centroid.is_some()) {
                touched += 1;
                ties += u64::from(percept.flags.contains(Flags::TIE));
            }
        }
        Ok(Self { percepts, touched, ties })
    }
}

impl Trial {
    fn new(
        body: &Body,
        options: &Options,
        played: &TestFrames,
        way: CallMode,
        combination: Combination,
        recharted: Recharted,
        batch: usize,
    ) -> Result<Self> {
        let batch = if way == CallMode::Live { 1 } else { batch.max(1) };
        let Combination { backend, mut knobs } = combination;
        if backend == BackendKind::Reference {
            knobs.arithmetic = None;
        }
        // Orientations are compared at their centroids.
        let outputs = options.scene.outputs | Outputs::CENTROID;
        // Touches are the same whatever the knobs, and looked for where they are fitted.
        let scene = options.scene.clone().knobs(knobs).outputs(outputs).touches(None);
        let options = options.clone().scene(scene).backend(backend).batch(batch);
        let mut engine = Engine::in_charts(body, recharted, options)?;
        engine.set_channels(&played.taxels).map_err(|e| e.at(&played.source))?;
        let (times_us, errors) = (Vec::new(), ErrorSamples::default());
        Ok(Self { way, combination, engine, next: 0, passes: 0, times_us, errors, truth: None })
    }

    /// Processes all frames once, and collects errors.
    fn compare(
        &mut self,
        calls: &mut Calls,
        geometry: &ChartGeometry,
        authored: &ChartGeometry,
        right: &ReferencePercepts,
    ) -> Result<()> {
        let by = self.combination.knobs.orientation_by;
        let letter_count = self.engine.plan().letters().len();
        let mut frame = 0;
        for call in 0..calls.calls.len() {
            let percepts = self.engine.process(calls.at(call, 0))?;
            for index in 0..percepts.frames() {
                if by.steps().is_some() {
                    let both = percepts.touches(index).zip(right.percepts.touches(frame));
                    both.into_iter().for_each(|(got, right)| self.errors.add_fits(got, right));
                    frame += 1;
                    continue;
                }
                for field in (0..percepts.fields()).step_by(letter_count) {
                    let mut got = percepts.get(index, field);
                    got.field = field / letter_count;
                    self.errors.add(geometry, authored, &got, &right.percepts.get(frame, field), by);
                }
                frame += 1;
            }
        }
        self.passes = 1;
        Ok(())
    }

    /// Runs for about a turn.
    fn turn(&mut self, calls: &mut Calls) -> Result<()> {
        let start = Instant::now();
        while start.elapsed() < TURN_TIME {
            let call = calls.at(self.next, self.passes);
            let began = Instant::now();
            black_box(self.engine.process(black_box(call))?);
            self.times_us.push(began.elapsed().as_secs_f64() * 1e6 / call.len() as f64);
            self.next += 1;
            if self.next == calls.calls.len() {
                (self.next, self.passes) = (0, self.passes + 1);
            }
        }
        Ok(())
    }

    fn row(mut self) -> Measurement {
        self.times_us.sort_by(f64::total_cmp);
        let errors = &mut self.errors;
        Measurement {
            way: self.way,
            words: self.combination.words(),
            p50_us: rank(&self.times_us, 0.5),
            p99_us: rank(&self.times_us, 0.99),
            centroid_mm: Errors::from_samples(&mut errors.centroid),
            orientation_deg: Errors::from_samples(&mut errors.orientation),
            truth: self.truth.map(|(all, _)| all),
            truth_with_fit: self.truth.and_then(|(_, with_fit)| with_fit),
            front: false,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bundled;
    use crate::signal::Frame;
    use crate::source::{CsvSource, Source as _};

    pub(crate) fn touch() -> TestFrames {
        let mut source = CsvSource::from_reader("touch", bundled::TOUCH, None, None).unwrap();
        let mut frame = Frame::missing(0.0, source.taxels().len());
        let mut frames = Vec::new();
        while frames.len() < 80 && source.next_frame(&mut frame).unwrap() {
            frames.push(frame.clone());
        }
        TestFrames { source: "touch".into(), taxels: source.taxels().to_vec(), frames, truth: Vec::new() }
    }

    fn measure_options(seconds: f64) -> MeasureOptions {
        MeasureOptions { seconds, batch: 32, ways: CallMode::ALL.to_vec(), backends: vec![BackendKind::Cpu] }
    }

    #[test]
    fn every_combination_has_its_turns_and_errors_are_those_of_its_arithmetic() {
        let body = Body::from_bytes("hand", bundled::HAND).unwrap();
        let options = Options::default().scene(Scene::default().outputs(Outputs::CENTROID | Outputs::ORIENTATION));
        let mut shares = Vec::new();
        let report = measure(&body, &options, &touch(), None, &measure_options(0.05), &mut |share| {
            shares.push(share);
            true
        })
        .unwrap();
        assert!(shares.windows(2).all(|pair| pair[0] <= pair[1]) && shares.last() == Some(&1.0));
        // The hand's own charts are planes.
        let of_way = |&way: &CallMode| {
            let all = Combination::all(&options.scene, way, &[BackendKind::Cpu], can_fit(&options));
            all.iter().filter(|combination| combination.knobs.charts != Charts::Plane).count()
        };
        let expected: usize = CallMode::ALL.iter().map(of_way).sum();
        assert!(report.left_out.iter().any(|left| left.starts_with("charts plane")), "{:?}", report.left_out);
        assert_eq!(report.rows.len(), expected);
        for row in &report.rows {
            assert!(row.p50_us > 0.0 && row.p99_us >= row.p50_us, "{row:?}");
            let authored = row.words.charts == "as-authored";
            assert!(!authored || row.centroid_mm.worst < 1e-4, "{row:?}");
            // Negative control: double precision in the layout's charts is the reference, and single precision is not.
            assert_eq!(authored && row.words.arithmetic == "double", row.centroid_mm.worst == 0.0, "{row:?}");
            assert!(row.centroid_mm.compared > 0);
        }
        assert!(report.rows.iter().any(|row| row.front) && report.rows.iter().any(|row| !row.front));
    }

    #[test]
    fn methods_are_held_against_the_truth_of_simulated_touches() {
        let body = Body::from_bytes("hand", bundled::HAND).unwrap();
        let options = Options::default().scene(Scene::default().fields(["hand/back"]));
        let mut touches = SimulatedTouches::on(&body, &options, 400).unwrap();
        let own = options.clone().calibration(touches.calibration.clone());
        let played = TestFrames { truth: Vec::new(), ..touches.frames.clone() };
        let measured = |touches: Option<&SimulatedTouches>| {
            measure(&body, &own, &played, touches, &measure_options(0.05), &mut |_| true).unwrap()
        };
        let report = measured(Some(&touches));
        assert!(report.truth && report.touches.contains("touches simulated on it"));
        let rungs = report.rungs(CallMode::Live);
        assert_eq!(rungs.len(), 5);
        let by = |by: OrientationBy| {
            *rungs.iter().find(|row| row.words.orientation_by == by.word()).expect("every method is a rung")
        };
        let [moments, fit] = [OrientationBy::SecondMoments, OrientationBy::Fit].map(by);
        // Moments say something of every touch, a fit only of what it explains.
        assert_eq!(moments.truth.unwrap().given, 1.0);
        assert!((0.1..0.5).contains(&fit.truth.unwrap().given), "{:?}", fit.truth);
        assert_eq!(
            fit.truth,
            fit.truth_with_fit.map(|of| crate::tradeoff::TrueErrors {
                touches: fit.truth.unwrap().touches,
                given: fit.truth.unwrap().given,
                ..of
            })
        );
        // On the same touches, truer by half and more.
        let [moments, fit] = [moments, fit].map(|row| row.truth_with_fit.unwrap());
        assert!(2.0 * fit.orientation_deg.median < moments.orientation_deg.median, "{fit:?} {moments:?}");
        assert!(2.0 * fit.round_mm.median < moments.round_mm.median, "{fit:?} {moments:?}");
        // Negative control: a truth that is 3 mm elsewhere.
        for truth in touches.frames.truth.iter_mut().flatten() {
            truth.position_in_link += 3e-3 * truth.normal_in_link.any_orthonormal_vector();
        }
        let moved = measured(Some(&touches)).rungs(CallMode::Live)[0].truth.unwrap().round_mm.median;
        assert!(moved > 2.0, "{moved}");
        assert!(!measured(None).truth);
    }

    #[test]
    fn what_is_stopped_too_early_says_so() {
        let body = Body::from_bytes("hand", bundled::HAND).unwrap();
        let stopped = measure(&body, &Options::default(), &touch(), None, &measure_options(60.0), &mut |_| false);
        assert!(stopped.unwrap_err().to_string().contains("stopped before"));
        let nothing = TestFrames { frames: touch().frames[..1].to_vec(), ..touch() };
        let untouched = measure(&body, &Options::default(), &nothing, None, &measure_options(0.1), &mut |_| true);
        assert!(untouched.unwrap_err().to_string().contains("no field with a chart is touched"));
    }
}
