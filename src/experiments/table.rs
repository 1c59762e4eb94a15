//! A table of the percepts' errors, which the paper does not have.

use std::fmt::Write as _;
use std::sync::atomic::{AtomicUsize, Ordering};

use rayon::prelude::*;
use serde::Serialize;

use super::metric::{Errors, across, between_lines};
use super::trial::{self, Moment, Signal, Trial};
use somatic::body::Body;
use somatic::error::Result;
use somatic::percept::Flags;

const SPEEDS_MM_S: [f64; 3] = [5.0, 20.0, 80.0];
const NOISES_COUNTS: [f64; 3] = [0.0, 1.0, 3.0];
/// Speed and noise of the quick table, and of the table by angle.
const DEFAULT_SPEED_MM_S: f64 = 20.0;
const DEFAULT_NOISE_COUNTS: f64 = 1.0;
/// Number of seeds for each simulation with noise, as ties of two points depend on the noise.
const SEEDS: usize = 30;
/// An orientation with a larger error is across the rod.
const ACROSS_DEG: f64 = 45.0;
const RATE_HZ: f64 = 50.0;
/// Frames for the speed over 0.1 s.
const SPAN_FRAMES: usize = 5;
/// Half the length of a path, mm.
const HALF_PATH_MM: f64 = 8.0;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum IndenterKind {
    Rod,
    Ball,
    Fingertip,
}

impl IndenterKind {
    const ALL: [Self; 3] = [Self::Rod, Self::Ball, Self::Fingertip];

    fn name(self) -> &'static str {
        match self {
            Self::Rod => "rod",
            Self::Ball => "ball",
            Self::Fingertip => "fingertip",
        }
    }

    /// Angles of a rod, directions of round indenters, degrees.
    fn angles_deg(self) -> Vec<f64> {
        match self {
            Self::Rod => (0..36).map(|i| 5.0 * f64::from(i)).collect(),
            _ => (0..12).map(|i| 30.0 * f64::from(i)).collect(),
        }
    }

    /// Its keys in a simulation's file.
    fn keys(self, angle_deg: f64) -> String {
        match self {
            Self::Rod => format!(
                "indenter = \"rod\"\nradius_m = 0.0127\nlength_m = 0.05\nangle_deg = {angle_deg}\nhold = {{ newton = 30 }}"
            ),
            Self::Ball => "indenter = \"ball\"\nradius_m = 0.0127\nhold = { newton = 10 }".to_owned(),
            Self::Fingertip => "indenter = \"fingertip\"\nhold = { newton = 5 }".to_owned(),
        }
    }
}

/// One simulation.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Case {
    toucher: IndenterKind,
    angle_deg: f64,
    speed_mm_s: f64,
    noise_counts: f64,
}

impl Case {
    fn all(quick: bool) -> Vec<Self> {
        let mut cases = Vec::new();
        for toucher in IndenterKind::ALL {
            for speed_mm_s in SPEEDS_MM_S {
                for noise_counts in NOISES_COUNTS {
                    let usual = speed_mm_s == DEFAULT_SPEED_MM_S && noise_counts == DEFAULT_NOISE_COUNTS;
                    if usual || !quick {
                        let angles = toucher.angles_deg().into_iter();
                        cases.extend(angles.map(|angle_deg| Self { toucher, angle_deg, speed_mm_s, noise_counts }));
                    }
                }
            }
        }
        cases
    }

    /// Different seeds for all angles, which are integers below 360.
    fn seeds(&self) -> Vec<u64> {
        let runs = if self.noise_counts > 0.0 { SEEDS } else { 1 };
        (0..runs).map(|run| self.angle_deg as u64 + 360 * run as u64).collect()
    }

    /// A rod rolls across its axis over the middle of the board; a round indenter passes the middle at 3.6 mm, so that it does
    /// not move along a row of sensors.
    fn simulation(&self) -> String {
        let (heading_deg, middle) = match self.toucher {
            IndenterKind::Rod => (self.angle_deg - 90.0, [0.0, 0.0]),
            _ => (self.angle_deg, [3.0, 2.0]),
        };
        let heading = heading_deg.to_radians();
        let at = |mm: f64| {
            let (u, v) = (middle[0] + mm * libm::cos(heading), middle[1] + mm * libm::sin(heading));
            format!("[{:.9}, {:.9}]", u * 1e-3, v * 1e-3)
        };
        let duration_s = 2.0 * HALF_PATH_MM / self.speed_mm_s;
        format!(
            "rate_hz = {RATE_HZ}\nduration_s = {duration_s}\n\
             [layer]\nthickness_m = 0.007\nstiffness_pa = 400e3\n\
             [sensor]\nkind = \"fsr\"\nwiper = 38\nnoise_sigma = {}\n\
             [[touch]]\non = \"hand/back\"\n{}\npath = [{}, {}]\ntimes_s = [0, {duration_s}]\n",
            self.noise_counts,
            self.toucher.keys(self.angle_deg),
            at(-HALF_PATH_MM),
            at(HALF_PATH_MM),
        )
    }
}

/// The errors of one signal.
#[derive(Clone, Debug, Default)]
struct Scores {
    frames: u64,
    felt: u64,
    /// mm, for a rod across it.
    centroid: Errors,
    /// Degrees.
    two_points: Errors,
    principal_axis: Errors,
    /// The place of the contact fitted to the touch, as `centroid`, and its angle.
    fit_place: Errors,
    fit: Errors,
    fitted: u64,
    /// Frames flagged `tie`; those of them in which two points are over [`ACROSS_DEG`] off; and all such frames.
    tied: u64,
    tied_across: u64,
    across: u64,
    /// Per cent of the true speed: frame by frame, over 0.1 s, and the paper's own eq. 8.
    speed: Errors,
    steady_speed: Errors,
    radial_speed: Errors,
}

impl Scores {
    fn from_trial(trial: &Trial, signal: usize) -> Self {
        let mut scores = Self::default();
        for (index, moment) in trial.moments.iter().enumerate() {
            let earlier = index.checked_sub(SPAN_FRAMES).map(|earlier| &trial.moments[earlier]);
            scores.add(moment, earlier, signal);
        }
        scores
    }

    fn add(&mut self, moment: &Moment, earlier: Option<&Moment>, signal: usize) {
        let Some(truth) = &moment.truth else { return };
        let (percept, fit) = (&moment.percepts[signal], &moment.fits[signal]);
        self.frames += 1;
        self.felt += u64::from(percept.contact);
        self.fitted += u64::from(fit.is_some());
        let place = |errors: &mut Errors, seen: Option<[f64; 2]>| {
            let Some((seen, right)) = seen.zip(truth.uv) else { return };
            let error = [(seen[0] - right[0]) * 1e3, (seen[1] - right[1]) * 1e3];
            errors.add(truth.angle.map_or_else(|| libm::hypot(error[0], error[1]), |angle| across(error, angle)));
        };
        place(&mut self.centroid, percept.centroid);
        place(&mut self.fit_place, fit.map(|fit| fit.place));
        if let Some(right) = truth.angle {
            let compare = |errors: &mut Errors, seen: Option<f64>| {
                seen.into_iter().for_each(|seen| errors.add(between_lines(seen, right).to_degrees()));
            };
            compare(&mut self.two_points, percept.orientation);
            compare(&mut self.principal_axis, percept.principal_axis);
            compare(&mut self.fit, fit.and_then(|fit| fit.angle));
            let tied = percept.flags.contains(Flags::TIE);
            let is_across = |seen: f64| between_lines(seen, right).to_degrees() > ACROSS_DEG;
            let across = percept.orientation.is_some_and(is_across);
            self.tied += u64::from(tied);
            self.tied_across += u64::from(tied && across);
            self.across += u64::from(across);
        }
        let Some(right) = truth.speed.filter(|&speed| speed > 0.0) else { return };
        let per_cent = |seen: f64| 100.0 * (seen - right) / right;
        percept.speed.into_iter().for_each(|seen| self.speed.add(per_cent(seen)));
        percept.radial_speed.into_iter().for_each(|seen| self.radial_speed.add(per_cent(seen.abs())));
        if let Some(earlier) = earlier
            && let Some((now, then)) = percept.centroid.zip(earlier.percepts[signal].centroid)
        {
            let distance_m = libm::hypot(now[0] - then[0], now[1] - then[1]);
            self.steady_speed.add(per_cent(distance_m / (moment.t_s - earlier.t_s)));
        }
    }

    fn merge(&mut self, other: &Self) {
        self.frames += other.frames;
        self.felt += other.felt;
        self.centroid.merge(&other.centroid);
        self.two_points.merge(&other.two_points);
        self.principal_axis.merge(&other.principal_axis);
        self.fit_place.merge(&other.fit_place);
        self.fit.merge(&other.fit);
        self.fitted += other.fitted;
        self.tied += other.tied;
        self.tied_across += other.tied_across;
        self.across += other.across;
        self.speed.merge(&other.speed);
        self.steady_speed.merge(&other.steady_speed);
        self.radial_speed.merge(&other.radial_speed);
    }
}

/// RMS and worst over everything, and the lowest and the highest RMS of one seed.
type Spread = [f64; 4];

/// A row: all of an indenter's angles, or one.
#[derive(Clone, Debug, Serialize)]
struct TableRow {
    indenter: &'static str,
    signal: &'static str,
    speed_mm_s: f64,
    noise_counts: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    angle_deg: Option<f64>,
    frames: u64,
    felt_percent: f64,
    centroid_mm: Option<Spread>,
    two_points_deg: Option<Spread>,
    principal_axis_deg: Option<Spread>,
    /// Of the fitted contacts, and in how many of the frames in contact there is one.
    fit_mm: Option<Spread>,
    fit_deg: Option<Spread>,
    fitted_percent: Option<f64>,
    speed_percent: Option<Spread>,
    speed_over_100_ms_percent: Option<Spread>,
    radial_speed_percent: Option<Spread>,
    /// Frames in which two points are over 45° off; frames flagged `tie`, and those of them.
    across_frames: u64,
    tied_frames: u64,
    tied_across_frames: u64,
}

impl TableRow {
    fn new(angle_deg: Option<f64>, signal: usize, group: &[Scored<'_>]) -> Self {
        let case = group[0].0;
        let mut scores = Scores::default();
        let mut by_seed = vec![Scores::default(); SEEDS];
        for (_, runs) in group {
            for (of_seed, run) in by_seed.iter_mut().zip(*runs) {
                scores.merge(&run[signal]);
                of_seed.merge(&run[signal]);
            }
        }
        let spread = |errors: fn(&Scores) -> &Errors| -> Option<Spread> {
            let [rms, worst] = errors(&scores).summary()?;
            let of_seeds = by_seed.iter().filter_map(|scores| errors(scores).summary()).map(|[rms, _]| rms);
            let [low, high] = of_seeds.fold([rms, rms], |[low, high], rms| [low.min(rms), high.max(rms)]);
            Some([rms, worst, low, high])
        };
        Self {
            indenter: case.toucher.name(),
            signal: Signal::ALL[signal].name(),
            speed_mm_s: case.speed_mm_s,
            noise_counts: case.noise_counts,
            angle_deg,
            frames: scores.frames,
            felt_percent: 100.0 * scores.felt as f64 / scores.frames.max(1) as f64,
            centroid_mm: spread(|scores| &scores.centroid),
            two_points_deg: spread(|scores| &scores.two_points),
            principal_axis_deg: spread(|scores| &scores.principal_axis),
            fit_mm: spread(|scores| &scores.fit_place),
            fit_deg: spread(|scores| &scores.fit),
            fitted_percent: (scores.fitted > 0).then(|| 100.0 * scores.fitted as f64 / scores.felt.max(1) as f64),
            speed_percent: spread(|scores| &scores.speed),
            speed_over_100_ms_percent: spread(|scores| &scores.steady_speed),
            radial_speed_percent: spread(|scores| &scores.radial_speed),
            across_frames: scores.across,
            tied_frames: scores.tied,
            tied_across_frames: scores.tied_across,
        }
    }
}

/// A case, and its scores by seed and signal.
type Scored<'a> = (&'a Case, &'a Vec<[Scores; 2]>);

/// All rows: over all angles of an indenter, and for rods by angle.
#[derive(Clone, Debug, Serialize)]
pub(super) struct Table {
    over_all_angles: Vec<TableRow>,
    rods_by_angle: Vec<TableRow>,
}

impl Table {
    /// Simulates all cases on `body`, the bundled hand; `progress` gets the share that is done.
    pub(super) fn new(body: &Body, quick: bool, progress: &(dyn Fn(f64) + Sync)) -> Result<Self> {
        let cases = Case::all(quick);
        let done = AtomicUsize::new(0);
        let scores = cases.par_iter().map(|case| {
            let (name, text) = ("a simulation of the table", case.simulation());
            let trials = trial::run_seeds(name, &text, body, "hand/back", &case.seeds())?;
            let scores: Vec<_> =
                trials.iter().map(|trial| [0, 1].map(|signal| Scores::from_trial(trial, signal))).collect();
            progress((done.fetch_add(1, Ordering::Relaxed) + 1) as f64 / cases.len() as f64);
            Ok(scores)
        });
        let scores: Vec<Vec<[Scores; 2]>> = scores.collect::<Result<_>>()?;
        let mut table = Self { over_all_angles: Vec::new(), rods_by_angle: Vec::new() };
        let alike = |a: &Scored<'_>, b: &Scored<'_>| {
            let key = |case: &Case| (case.toucher, case.speed_mm_s, case.noise_counts);
            key(a.0) == key(b.0)
        };
        let pairs: Vec<Scored<'_>> = cases.iter().zip(&scores).collect();
        for group in pairs.chunk_by(alike) {
            let (case, _) = group[0];
            table.over_all_angles.extend((0..2).map(|signal| TableRow::new(None, signal, group)));
            let usual = case.speed_mm_s == DEFAULT_SPEED_MM_S && case.noise_counts == DEFAULT_NOISE_COUNTS;
            if case.toucher == IndenterKind::Rod && usual {
                for of_angle in group.chunks(1) {
                    let angle_deg = Some(of_angle[0].0.angle_deg);
                    table.rods_by_angle.extend((0..2).map(|signal| TableRow::new(angle_deg, signal, of_angle)));
                }
            }
        }
        Ok(table)
    }

    pub(super) fn markdown(&self) -> String {
        let mut text = format!(
            "Each cell is RMS / worst over all frames of all angles and, with noise, of {SEEDS} seeds; in brackets the\n\
             lowest and the highest RMS of a seed, where they differ.\n\n\
             | indenter | signal | speed mm/s | noise counts | felt % | centroid mm | fit mm | two points ° | \
             principal axis ° | fit ° | fit in % | speed % | speed over 0.1 s % |\n\
             |---|---|---|---|---|---|---|---|---|---|---|---|---|\n",
        );
        for row in &self.over_all_angles {
            let _ = writeln!(
                text,
                "| {} | {} | {} | {} | {:.0} | {} | {} | {} | {} | {} | {} | {} | {} |",
                row.indenter,
                row.signal,
                row.speed_mm_s,
                row.noise_counts,
                row.felt_percent,
                cell(row.centroid_mm, 2),
                cell(row.fit_mm, 2),
                cell(row.two_points_deg, 1),
                cell(row.principal_axis_deg, 1),
                cell(row.fit_deg, 1),
                row.fitted_percent.map_or_else(|| "–".to_owned(), |share| format!("{share:.0}")),
                cell(row.speed_percent, 0),
                cell(row.speed_over_100_ms_percent, 0),
            );
        }
        let _ = write!(
            text,
            "\nRods by angle, {DEFAULT_SPEED_MM_S} mm/s, noise of {DEFAULT_NOISE_COUNTS} count, RMS / worst.\n\n\
             | rod ° | two points °, raw | linearised | principal axis °, raw | linearised | fit °, linearised | \
             centroid mm, raw | linearised |\n|---|---|---|---|---|---|---|---|\n",
        );
        for rows in self.rods_by_angle.chunks(2) {
            let [raw, linearised] = rows else { continue };
            let _ = writeln!(
                text,
                "| {} | {} | {} | {} | {} | {} | {} | {} |",
                raw.angle_deg.unwrap_or(0.0),
                cell(raw.two_points_deg, 1),
                cell(linearised.two_points_deg, 1),
                cell(raw.principal_axis_deg, 1),
                cell(linearised.principal_axis_deg, 1),
                cell(linearised.fit_deg, 1),
                cell(raw.centroid_mm, 2),
                cell(linearised.centroid_mm, 2),
            );
        }
        let across = self.rods_by_angle.iter().filter(|row| row.across_frames > 0).map(|row| {
            format!(
                "{}°, {}: {} of {} frames, {} of them flagged `tie`",
                row.angle_deg.unwrap_or(0.0),
                row.signal,
                row.across_frames,
                row.frames,
                row.tied_across_frames
            )
        });
        let across: Vec<String> = across.collect();
        let _ = writeln!(text, "\nTwo points are over {ACROSS_DEG}° off for rods at: {}.", across.join("; "));
        text
    }
}

fn cell(errors: Option<Spread>, decimals: usize) -> String {
    let Some(errors) = errors else { return "–".to_owned() };
    let [rms, worst, low, high] = errors.map(|error| format!("{error:.decimals$}"));
    if low == high { format!("{rms} / {worst}") } else { format!("{rms} ({low}–{high}) / {worst}") }
}
