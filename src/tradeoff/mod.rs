//! Measures time and accuracy of each knob on a body, a recording and a machine, and selects knobs for a tolerance or a time
//! budget.
//!
//! Combinations of knobs take turns, so that changes of the machine's speed affect all of them. Percepts are compared with
//! the reference in the layout's own charts, and with the truth if the source has it.

mod errors;
mod fits;
mod frames;
mod ladder;
mod letters;
mod measure;
mod plot;
mod store;
mod target;
mod tested;
mod touches;
mod truth;
mod write_scene;

use std::fmt;

use serde::{Deserialize, Serialize};

pub use errors::{Errors, TrueErrors};
pub use frames::TestFrames;
pub use ladder::{Rung, ladder};
pub use letters::LetterCost;
pub use measure::{MeasureOptions, measure};
pub use plot::{plot_png, plot_svg};
pub use store::{Found, Store, Stored, day};
pub use target::Pick;
#[doc(hidden)]
pub use tested::{Tested, software, usual_frames};
pub use touches::SimulatedTouches;
pub use write_scene::write_pick;

use crate::backend::BackendKind;
use crate::percept::Outputs;
use crate::scene::{Arithmetic, Cadence, Charts, Coverage, Knobs, OrientationBy, Scene};
pub use crate::scene_file::{Target, angle, length, time};
use crate::signal::Receptor;

/// How frames come to an engine.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum CallMode {
    /// One frame per call.
    Live,
    /// Many frames per call.
    Batch,
}

impl CallMode {
    /// Both.
    pub const ALL: [Self; 2] = [Self::Live, Self::Batch];

    /// Its name.
    #[must_use]
    pub fn word(self) -> &'static str {
        match self {
            Self::Live => "live",
            Self::Batch => "batch",
        }
    }
}

/// A backend and its knobs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Combination {
    /// The backend.
    pub backend: BackendKind,
    /// The knobs.
    pub knobs: Knobs,
}

impl fmt::Display for Combination {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Words { backend, arithmetic, charts, orientation_by, coverage, cadence } = self.words();
        write!(f, "{backend}, {arithmetic}, {charts}, {orientation_by}, {coverage}, {cadence}")
    }
}

impl Combination {
    /// Its backend and knobs in words.
    #[must_use]
    pub fn words(&self) -> Words {
        let Knobs { arithmetic, charts, orientation_by, coverage, cadence, .. } = self.knobs;
        let backend = match self.backend {
            BackendKind::Gpu => "gpu",
            BackendKind::Reference => "reference",
            BackendKind::Cpu | BackendKind::Auto => "cpu",
        };
        let usual = if self.backend == BackendKind::Reference { Arithmetic::Double } else { Arithmetic::OnePass };
        Words {
            backend: backend.to_owned(),
            arithmetic: arithmetic.unwrap_or(usual).word().to_owned(),
            charts: charts.word().to_owned(),
            orientation_by: orientation_by.word().to_owned(),
            coverage: coverage.word().to_owned(),
            cadence: cadence.word().to_owned(),
        }
    }

    /// The combinations for `scene`, called `way`, on `backends`; knobs that `scene` sets stay fixed. Contacts are fitted to
    /// touches where that `can_fit`, on the CPU, once: no other knob changes what they are.
    #[must_use]
    pub fn all(scene: &Scene, way: CallMode, backends: &[BackendKind], can_fit: bool) -> Vec<Self> {
        let given = scene.knobs;
        let usual = Knobs::default();
        let live = way == CallMode::Live;
        fn some<T: Copy + PartialEq>(given: T, usual: T, all: &[T]) -> Vec<T> {
            if given == usual { all.to_vec() } else { vec![given] }
        }
        let charts_to_try = some(given.charts, usual.charts, Charts::ALL);
        let orients = scene.outputs.intersects(Outputs::ORIENTATION | Outputs::PRINCIPAL_AXIS);
        // From moments up; without a scene that knows its layer there is nothing to fit under.
        let ways: Vec<OrientationBy> = match orients {
            true => OrientationBy::ALL[1..].iter().copied().filter(|way| can_fit || way.steps().is_none()).collect(),
            false => vec![OrientationBy::AsAsked],
        };
        let ways = some(given.orientation_by, usual.orientation_by, &ways);
        let arithmetics = match given.arithmetic {
            Some(arithmetic) => vec![arithmetic],
            None => Arithmetic::ALL.to_vec(),
        };
        let changes = scene.letters.iter().any(|letter| letter.receptor == Receptor::Change);
        let cadences = match given.cadence {
            Cadence::EveryFrame if !live || changes || scene.outputs.intersects(Outputs::FILTERED) => {
                vec![given.cadence]
            }
            cadence => some(cadence, usual.cadence, Cadence::ALL),
        };
        let mut all = Vec::new();
        for &backend in backends {
            for &arithmetic in &arithmetics {
                // Only the reference has double precision.
                let backend = match (backend, arithmetic) {
                    (BackendKind::Cpu, Arithmetic::Double) => BackendKind::Reference,
                    (BackendKind::Gpu, Arithmetic::Double) | (BackendKind::Reference | BackendKind::Auto, _) => {
                        continue;
                    }
                    (backend, _) => backend,
                };
                // A gate is for live frames on the CPU.
                let gated = backend == BackendKind::Cpu && live && !changes;
                let coverages = if gated {
                    some(given.coverage, usual.coverage, &Coverage::ALL[1..])
                } else {
                    vec![given.coverage]
                };
                for &charts in &charts_to_try {
                    for &orientation_by in &ways {
                        for &coverage in &coverages {
                            for &cadence in &cadences {
                                let arithmetic = Some(arithmetic);
                                let knobs = Knobs::default()
                                    .arithmetic(arithmetic)
                                    .charts(charts)
                                    .orientation_by(orientation_by)
                                    .coverage(coverage)
                                    .cadence(cadence);
                                let first = arithmetic == Some(arithmetics[0])
                                    && backend == backends[0]
                                    && charts == charts_to_try[0]
                                    && (coverage, cadence) == (coverages[0], cadences[0]);
                                if orientation_by.steps().is_none() || first {
                                    all.push(Self { backend, knobs });
                                }
                            }
                        }
                    }
                }
            }
        }
        all
    }
}

/// A [`Combination`] in words.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Words {
    /// `cpu`, `gpu` or `reference`.
    pub backend: String,
    /// See [`Arithmetic`].
    pub arithmetic: String,
    /// See [`Charts`].
    pub charts: String,
    /// See [`OrientationBy`].
    pub orientation_by: String,
    /// See [`Coverage`].
    pub coverage: String,
    /// See [`Cadence`].
    pub cadence: String,
}

impl Words {
    /// The combination.
    ///
    /// # Errors
    /// The words are of another version.
    pub fn combination(&self) -> crate::Result<Combination> {
        let Self { backend, arithmetic, charts, orientation_by, coverage, cadence } = self;
        let knobs = Knobs::default()
            .arithmetic((backend != "reference").then(|| arithmetic.parse()).transpose()?)
            .charts(charts.parse()?)
            .orientation_by(orientation_by.parse()?)
            .coverage(coverage.parse()?)
            .cadence(cadence.parse()?);
        Ok(Combination { backend: backend.parse()?, knobs })
    }

    /// The combination as a scene would say it: an orientation that is asked for by name, `asked_by`, stays as it was asked for.
    ///
    /// # Errors
    /// The words are of another version.
    pub fn in_scene(&self, asked_by: &str) -> crate::Result<Combination> {
        let mut combination = self.combination()?;
        if self.orientation_by == asked_by {
            combination.knobs.orientation_by = OrientationBy::AsAsked;
        }
        Ok(combination)
    }
}

/// Time and errors of a combination.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Measurement {
    /// How frames were passed.
    pub way: CallMode,
    /// The combination.
    #[serde(flatten)]
    pub words: Words,
    /// Median time of a frame, µs.
    pub p50_us: f64,
    /// The 99th percentile, µs.
    pub p99_us: f64,
    /// Errors of centroids against the reference, mm.
    pub centroid_mm: Errors,
    /// Errors of orientations against the reference's by the same method, degrees.
    pub orientation_deg: Errors,
    /// Errors against the truth, if known.
    pub truth: Option<TrueErrors>,
    /// The same of those touches that all steps together can fit.
    pub truth_with_fit: Option<TrueErrors>,
    /// Whether it is on the Pareto front of its way: no other is faster and at least as accurate.
    pub front: bool,
}

impl Measurement {
    /// The combination.
    ///
    /// # Errors
    /// Its words are of another version.
    pub fn combination(&self) -> crate::Result<Combination> {
        self.words.combination()
    }

    /// How far it is off, in one number: a degree counts like a millimetre; at a distance of 57 mm they are equal.
    pub(super) fn off(&self) -> f64 {
        let [place, orientation] = self.judged();
        place.p95.hypot(orientation.p95)
    }

    /// Its errors against the truth, or else the reference: place, mm, and orientation, degrees.
    #[must_use]
    pub fn judged(&self) -> [&Errors; 2] {
        self.truth.as_ref().map_or([&self.centroid_mm, &self.orientation_deg], |t| [&t.place_mm, &t.orientation_deg])
    }
}

/// What was measured.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Report {
    /// Name of the body.
    pub body: String,
    /// Source of the frames.
    pub source: String,
    /// Number of frames.
    pub frames: usize,
    /// The method of orientation that the scene requests, see [`OrientationBy`]: without a truth, methods cannot be compared.
    pub asked_by: String,
    /// Number of touched fields over all frames.
    pub touched: u64,
    /// Of these, ties of two orientations in the reference, which are not compared.
    pub ties: u64,
    /// Whether the truth was known.
    pub truth: bool,
    /// The touches that the truth was known of, in words; empty where the source has its own.
    pub touches: String,
    /// Fields that cannot have another kind of chart, `charts: field: why`.
    pub kept_charts: Vec<String>,
    /// Combinations that were not measured, and why.
    pub left_out: Vec<String>,
    /// One per combination and way; none if no letter is made of pressures, which all options are about.
    pub rows: Vec<Measurement>,
    /// What letters cost that the host makes, by way and letter.
    #[serde(default)]
    pub letters: Vec<LetterCost>,
}

impl Report {
    /// Marks the rows on the Pareto front.
    fn find_front(&mut self) {
        // Against the truth a hundredth is nothing: percepts of any arithmetic are that near to each other.
        let alike = if self.truth { 1.01 } else { 1.0 };
        let beaten = |row: &Measurement, by: &Measurement| {
            let (a, b) = (row.judged(), by.judged());
            let is_no_worse = |a: &Errors, b: &Errors| b.p95 <= alike * a.p95;
            let is_better = |a: &Errors, b: &Errors| alike * b.p95 < a.p95;
            let no_worse = is_no_worse(a[0], b[0]) && is_no_worse(a[1], b[1]) && by.p50_us <= row.p50_us;
            let better = is_better(a[0], b[0]) || is_better(a[1], b[1]) || by.p50_us < row.p50_us;
            // Without a truth, orientations of different methods cannot be compared.
            let alike = self.truth || row.words.orientation_by == by.words.orientation_by;
            row.way == by.way && alike && no_worse && better
        };
        let fronts: Vec<bool> = self.rows.iter().map(|row| !self.rows.iter().any(|other| beaten(row, other))).collect();
        self.rows.iter_mut().zip(fronts).for_each(|(row, front)| row.front = front);
    }

    /// The rungs of `way` from the fastest up: of each method of orientation the fastest row of those nearest to the truth.
    #[must_use]
    pub fn rungs(&self, way: CallMode) -> Vec<&Measurement> {
        let rows = self.measurements(way);
        let is_rung = |row: &&Measurement| {
            let alike = || rows.iter().filter(|other| other.words.orientation_by == row.words.orientation_by);
            let least = alike().map(|other| other.off()).fold(f64::INFINITY, f64::min);
            let is_near = |row: &Measurement| row.off() <= 1.01 * least;
            is_near(row) && alike().find(|other| is_near(other)).is_some_and(|first| std::ptr::eq(*first, *row))
        };
        rows.iter().copied().filter(is_rung).collect()
    }

    /// The rows of `way` with the method of orientation that was asked for which no other beats in time and errors against the
    /// reference, the fastest first: what the knobs of rounding give.
    #[must_use]
    pub fn rounding(&self, way: CallMode) -> Vec<&Measurement> {
        let mut rows = self.measurements(way);
        rows.retain(|row| row.words.orientation_by == self.asked_by);
        let errors = |row: &Measurement| [row.centroid_mm.p99, row.orientation_deg.p99];
        let is_beaten = |row: &Measurement| {
            let (time, errors_of_row) = (row.p50_us, errors(row));
            rows.iter().any(|by| {
                let errors_of_by = errors(by);
                let no_worse =
                    by.p50_us <= time && errors_of_by[0] <= errors_of_row[0] && errors_of_by[1] <= errors_of_row[1];
                no_worse && (by.p50_us < time || errors_of_by != errors_of_row)
            })
        };
        let front: Vec<bool> = rows.iter().map(|row| !is_beaten(row)).collect();
        rows.into_iter().zip(front).filter_map(|(row, front)| front.then_some(row)).collect()
    }

    /// The rows of `way`, the fastest first.
    #[must_use]
    pub fn measurements(&self, way: CallMode) -> Vec<&Measurement> {
        let mut rows: Vec<&Measurement> = self.rows.iter().filter(|row| row.way == way).collect();
        rows.sort_by(|a, b| a.p50_us.total_cmp(&b.p50_us));
        rows
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    pub(super) fn row(backend: &str, p50_us: f64, centroid: f64, orientation: f64) -> Measurement {
        let errors = |p95: f64| {
            let [rms, median, p99, worst] = [p95 / 2.0, p95 / 4.0, p95, p95 * 2.0];
            Errors { compared: 10, rms, median, p95, p99, worst }
        };
        let knobs = Knobs::default().arithmetic((backend != "reference").then_some(Arithmetic::OnePass));
        let combination = Combination { backend: backend.parse().unwrap(), knobs };
        Measurement {
            way: CallMode::Live,
            words: combination.words(),
            p50_us,
            p99_us: 2.0 * p50_us,
            centroid_mm: errors(centroid),
            orientation_deg: errors(orientation),
            truth: None,
            truth_with_fit: None,
            front: false,
        }
    }

    pub(super) fn report(rows: Vec<Measurement>) -> Report {
        let mut report = Report {
            body: "hand".into(),
            source: "touch".into(),
            frames: 10,
            asked_by: "as-asked".into(),
            touched: 10,
            rows,
            ..Report::default()
        };
        report.find_front();
        report
    }

    #[test]
    fn the_front_is_what_nothing_beats() {
        let rows = vec![
            row("cpu", 1.0, 3.0, 3.0),
            row("cpu", 2.0, 1.0, 4.0),
            row("cpu", 2.5, 1.0, 4.0),
            row("cpu", 3.0, 3.0, 1.0),
            row("reference", 9.0, 0.0, 0.0),
            row("reference", 9.5, 0.0, 0.5),
        ];
        let fronts: Vec<bool> = report(rows).rows.iter().map(|row| row.front).collect();
        assert_eq!(fronts, [true, true, false, true, true, false]);
    }

    #[test]
    fn combinations_are_all_that_make_sense_and_none_that_does_not() {
        let scene = Scene::default();
        let live = Combination::all(&scene, CallMode::Live, &[BackendKind::Cpu, BackendKind::Gpu], false);
        let count = |backend| live.iter().filter(|c| c.backend == backend).count();
        // Arithmetics, charts, ways to orientation, coverages, cadences.
        assert_eq!(count(BackendKind::Cpu), 2 * 3 * 2 * 2 * 2);
        assert_eq!(count(BackendKind::Gpu), 2 * 3 * 2 * 2);
        assert_eq!(count(BackendKind::Reference), 3 * 2 * 2);
        let batch = Combination::all(&scene, CallMode::Batch, &[BackendKind::Cpu], false);
        assert_eq!(batch.len(), 3 * 3 * 2);
        for combination in live.iter().chain(&batch) {
            assert!(combination.backend.with(combination.knobs.arithmetic).is_ok(), "{combination}");
        }
        let knobs = Knobs::default().charts(Charts::Plane).arithmetic(Arithmetic::OnePass);
        let some = Combination::all(
            &scene.knobs(knobs).outputs(Outputs::CENTROID),
            CallMode::Batch,
            &[BackendKind::Cpu],
            true,
        );
        assert_eq!(some.iter().map(|c| c.knobs).collect::<Vec<_>>(), [knobs]);
    }

    #[test]
    fn a_row_says_its_combination_again() {
        for way in CallMode::ALL {
            for combination in Combination::all(&Scene::default(), way, &[BackendKind::Cpu, BackendKind::Gpu], true) {
                let row = Measurement { words: combination.words(), ..row("cpu", 1.0, 0.0, 0.0) };
                assert_eq!(row.combination().unwrap().words(), combination.words());
            }
        }
    }
}
