//! Motion measured in different ways, against the truth: from frame to frame, over a time, and by a Kalman filter.

use std::fmt::Write as _;

use somatic::body::Body;
use somatic::error::Result;
use somatic::percept::{Outputs, Percept};
use somatic::scene::{MotionFilter, Scene};
use somatic::signal::{Calibration, Frame};
use somatic::source::{SimulatedSource, Source as _};
use somatic::{BackendKind, Engine, Options, touch};

use super::chart_fit::{self, ChartFit, PlaneChart};
use super::kalman::{self, Kalman};

/// The field that is touched.
const FIELD: &str = "hand/back";
const RATE_HZ: f64 = 50.0;
/// Runs of each case, each with noise of its own.
const SEEDS: u64 = 30;
/// Of the difference, s, and so half of that is its lag, and the Kalman filter's.
const OVER_S: f64 = 0.2;
/// What begins a run until every way has an answer, s.
const WARM_UP_S: f64 = 0.3;
/// Between runs, s: too long for motion from one run to the next.
const BETWEEN_RUNS_S: f64 = 1000.0;
/// The P at the force at which a sensor begins to feel.
const THRESHOLD: f64 = 10.0;

const INDENTERS: [(&str, &str, &[f64]); 3] = [
    (
        "rod",
        "indenter = \"rod\"\nradius_m = 0.0127\nlength_m = 0.05\nhold = { newton = 30 }",
        &[0.0, 20.0, 45.0, 70.0, 110.0],
    ),
    ("ball", "indenter = \"ball\"\nradius_m = 0.0127\nhold = { newton = 10 }", &[0.0, 30.0, 75.0, 160.0]),
    ("fingertip", "indenter = \"fingertip\"\nhold = { newton = 5 }", &[15.0, 60.0, 130.0]),
];

/// How a touch moves along its line.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Motion {
    /// 16 mm at this speed, mm/s.
    Constant(f64),
    /// Forth, back and forth again over 12 mm.
    Reversals(f64),
    /// Three times 4 mm, each followed by 0.6 s of rest.
    Stops(f64),
    /// A sine of this frequency, Hz: 6 mm up to 1 Hz, 3 mm above.
    Sine(f64),
}

const MOTIONS: [Motion; 10] = [
    Motion::Constant(5.0),
    Motion::Constant(20.0),
    Motion::Constant(40.0),
    Motion::Reversals(10.0),
    Motion::Reversals(30.0),
    Motion::Stops(20.0),
    Motion::Sine(0.2),
    Motion::Sine(0.5),
    Motion::Sine(1.0),
    Motion::Sine(2.0),
];

impl Motion {
    fn name(self) -> String {
        match self {
            Self::Constant(speed) => format!("{speed} mm/s"),
            Self::Reversals(speed) => format!("{speed} mm/s, reversals"),
            Self::Stops(speed) => format!("{speed} mm/s, stops"),
            Self::Sine(hz) => format!("sine, {hz} Hz"),
        }
    }

    /// (s, mm) along the line, with straight lines between.
    fn waypoints(self) -> Vec<[f64; 2]> {
        match self {
            Self::Constant(speed) => vec![[0.0, -8.0], [16.0 / speed, 8.0]],
            Self::Reversals(speed) => {
                let ends = [-6.0, 6.0, -6.0, 6.0];
                ends.iter().enumerate().map(|(k, &end)| [k as f64 * 12.0 / speed, end]).collect()
            }
            Self::Stops(speed) => {
                let mut points = vec![[0.0, -6.0]];
                for k in 0..3 {
                    let [t_s, at] = points[2 * k];
                    points.extend([[t_s + 4.0 / speed, at + 4.0], [t_s + 4.0 / speed + 0.6, at + 4.0]]);
                }
                points
            }
            Self::Sine(hz) => {
                let (size, step_s) = (if hz <= 1.0 { 6.0 } else { 3.0 }, 0.01);
                let steps = ((2.0 / hz).max(2.0) / step_s).round() as u32;
                let at = |t_s: f64| [t_s, size * libm::sin(std::f64::consts::TAU * hz * t_s)];
                (0..=steps).map(|k| at(f64::from(k) * step_s)).collect()
            }
        }
    }
}

/// The errors of one way, in per cent of the RMS of the true speed, and of directions, degrees.
#[derive(Clone, Debug, Default)]
struct Errors {
    velocity: Vec<f64>,
    direction: Vec<f64>,
}

impl Errors {
    fn add(&mut self, found: [f64; 2], right: [f64; 2], across: Option<[f64; 2]>) {
        let off = [found[0] - right[0], found[1] - right[1]];
        // Sensors cannot feel a rod move along itself.
        let off = across.map_or(libm::hypot(off[0], off[1]), |across| off[0] * across[0] + off[1] * across[1]);
        self.velocity.push(off.abs());
        if libm::hypot(right[0], right[1]) > 1e-3 && across.is_none() {
            let [dot, cross] = [found[0] * right[0] + found[1] * right[1], found[0] * right[1] - found[1] * right[0]];
            self.direction.push(libm::atan2(cross, dot).abs().to_degrees());
        }
    }
}

fn rms(values: &[f64]) -> f64 {
    (values.iter().map(|value| value * value).sum::<f64>() / values.len() as f64).sqrt()
}

/// RMS, median and 95th percentile, each divided by `by`.
fn cell(values: &[f64], by: f64) -> String {
    if values.is_empty() {
        return "–".to_owned();
    }
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let at = |share: f64| sorted[((sorted.len() - 1) as f64 * share).round() as usize] / by;
    format!("{:.0} / {:.0} / {:.0}", rms(values) / by, at(0.5), at(0.95))
}

/// The ways, in the order of the table.
const WAYS: [&str; 6] = ["frame by frame", "over 0.1 s", "over 0.2 s", "Kalman", "soft, over 0.2 s", "fit, over 0.2 s"];
/// The last of them, whose places are absent where a touch is not explained.
const FIT: usize = 5;
/// What the sensors' noise and the layer are, for fits.
const LAYER: &str = "noise = 1.04\n[layer]\nsigma_m = 0.004\n";

/// One run's frames: percepts, what is fitted to touches, and the truth's velocity.
type Run = Vec<(f64, Percept, Option<ChartFit>, [f64; 2])>;

/// All seeds and angles of a case under a hard or a soft onset.
fn runs(body: &Body, indenter: usize, motion: Motion, onset: &str) -> Result<Vec<(Option<[f64; 2]>, Run)>> {
    let (name, keys, angles) = INDENTERS[indenter];
    let is_rod = name == "rod";
    let (mut frames, mut truths, mut directions) = (Vec::new(), Vec::new(), Vec::new());
    let mut ids = Vec::new();
    for &angle_deg in angles {
        let heading = (if is_rod { angle_deg - 90.0 } else { angle_deg }).to_radians();
        let along = [libm::cos(heading), libm::sin(heading)];
        let middle = if is_rod { [0.0, 0.0] } else { [3.0, 2.0] };
        let points = motion.waypoints();
        let path: Vec<String> = points
            .iter()
            .map(|[_, at]| {
                let [u, v] = [0, 1].map(|axis| (middle[axis] + at * along[axis]) * 1e-3);
                format!("[{u:.9}, {v:.9}]")
            })
            .collect();
        let times: Vec<String> = points.iter().map(|[t_s, _]| format!("{t_s:.6}")).collect();
        let angle = if is_rod { format!("angle_deg = {angle_deg}\n") } else { String::new() };
        let text = format!(
            "rate_hz = {RATE_HZ}\nduration_s = {:.6}\n[layer]\nthickness_m = 0.007\n[sensor]\nkind = \"fsr\"\nwiper = 38\n\
             noise_sigma = 1\n[[touch]]\non = \"{FIELD}\"\n{keys}\n{angle}path = [{}]\ntimes_s = [{}]\n",
            points[points.len() - 1][0],
            path.join(", "),
            times.join(", ")
        );
        let mut source = SimulatedSource::on_body(name, &text, body.clone())?;
        ids = source.taxels().to_vec();
        for seed in 0..SEEDS {
            source.reseed(1000 * seed + angle_deg as u64);
            let mut frame = Frame::missing(0.0, ids.len());
            while source.next_frame(&mut frame)? {
                let run = directions.len();
                truths.push((run, source.truth().first().and_then(|truth| truth.velocity_uv)));
                frames.push(Frame { t_s: frame.t_s + run as f64 * BETWEEN_RUNS_S, ..frame.clone() });
            }
            directions.push(is_rod.then_some(along));
        }
    }
    let dead_band = if onset == "soft" { THRESHOLD } else { 0.5 * THRESHOLD };
    let keys = format!("[all]\nsensor = \"fsr\"\nwiper = 38\ndead_band = {dead_band}\nonset = \"{onset}\"\n{LAYER}");
    let scene = Scene::default()
        .outputs(Outputs::CENTROID | Outputs::MOTION | Outputs::FILTERED)
        .filter(MotionFilter::default().over_s(OVER_S))
        .touches(touch::Options { velocity_over_s: OVER_S, ..chart_fit::asked() })
        .fields(vec![FIELD.to_owned()]);
    let chart = PlaneChart::new(body, FIELD)?;
    let calibration = Calibration::parse(&keys, &ids)?;
    let options = Options::default()
        .scene(scene)
        .calibration(Some(calibration))
        .backend(BackendKind::Reference)
        .batch(frames.len());
    let mut engine = Engine::new(body, options)?;
    engine.set_channels(&ids)?;
    let percepts = engine.process(&frames)?;
    let mut runs: Vec<(Option<[f64; 2]>, Run)> = directions.into_iter().map(|along| (along, Vec::new())).collect();
    for (index, (run, velocity)) in truths.into_iter().enumerate() {
        let t_s = frames[index].t_s - run as f64 * BETWEEN_RUNS_S;
        let fit = chart.fit(percepts.touches(index));
        runs[run].1.push((t_s, percepts.get(index, 0), fit, velocity.unwrap_or_default()));
    }
    Ok(runs)
}

/// The velocity of a displacement with this speed.
fn velocity(displacement: Option<[f64; 2]>, speed: Option<f64>) -> Option<[f64; 2]> {
    let (displacement, speed) = displacement.zip(speed)?;
    let length = libm::hypot(displacement[0], displacement[1]);
    Some(if length > 0.0 { displacement.map(|part| part * speed / length) } else { [0.0; 2] })
}

/// Adds what every way makes of a run.
fn judge(run: &Run, across: Option<[f64; 2]>, is_soft: bool, errors: &mut [Errors; 6], speeds: &mut Vec<f64>) {
    let mut filter = Kalman::with_lag(OVER_S / 2.0, 1.0 / RATE_HZ);
    for (index, (t_s, percept, fit, right)) in run.iter().enumerate() {
        let tracked = filter.follow(percept.centroid);
        let Some(now) = percept.centroid.filter(|_| *t_s >= WARM_UP_S) else { continue };
        let over = |frames: usize| {
            let (before_s, then, ..) = &run[index.checked_sub(frames)?];
            let then = then.centroid?;
            Some([0, 1].map(|axis| (now[axis] - then[axis]) / (t_s - before_s)))
        };
        let steady = velocity(percept.filtered_displacement, percept.filtered_speed);
        let fitted = fit.and_then(|fit| fit.velocity);
        let ways: Vec<(usize, Option<[f64; 2]>)> = if is_soft {
            vec![(4, steady)]
        } else {
            speeds.push(libm::hypot(right[0], right[1]));
            vec![(0, over(1)), (1, over(5)), (2, steady), (3, tracked), (FIT, fitted)]
        };
        for (way, found) in ways {
            if let Some(found) = found {
                errors[way].add(found, *right, across);
            }
        }
    }
}

/// The table, in Markdown; `quick` makes one of its rows an indenter.
pub(super) fn markdown(body: &Body, quick: bool, progress: &(dyn Fn(f64) + Sync)) -> Result<String> {
    let motions: &[Motion] = if quick { &[Motion::Constant(20.0)] } else { &MOTIONS };
    let mut text = String::from(
        "Each cell is RMS / median / 95th percentile over all frames, of 30 seeds and all directions, from 0.3 s on: of the\n\
         velocity's error in per cent of the RMS of the true speed, for a rod across it, and of the direction's in degrees.\n\
         In brackets the per cent of the frames for which fitted places give a velocity.\n\n\
         | indenter | motion |",
    );
    for way in WAYS {
        let _ = write!(text, " {way} % |");
    }
    text.push_str(" direction over 0.2 s ° | Kalman ° |\n|---|---|---|---|---|---|---|---|---|---|\n");
    let cases: Vec<(usize, Motion)> = (0..INDENTERS.len()).flat_map(|i| motions.iter().map(move |&m| (i, m))).collect();
    for (done, &(indenter, motion)) in cases.iter().enumerate() {
        progress(done as f64 / cases.len() as f64);
        let (mut errors, mut speeds) = (<[Errors; 6]>::default(), Vec::new());
        for onset in ["hard", "soft"] {
            for (along, run) in runs(body, indenter, motion, onset)? {
                judge(&run, along, onset == "soft", &mut errors, &mut speeds);
            }
        }
        let per_cent = rms(&speeds) / 100.0;
        let _ = write!(text, "| {} | {} |", INDENTERS[indenter].0, motion.name());
        for (way, own) in errors.iter().enumerate() {
            let _ = write!(text, " {}", cell(&own.velocity, per_cent));
            if way == FIT {
                let share = own.velocity.len() as f64 / errors[2].velocity.len() as f64;
                let _ = write!(text, " ({:.0})", 100.0 * share);
            }
            text.push_str(" |");
        }
        let _ = writeln!(text, " {} | {} |", cell(&errors[2].direction, 1.0), cell(&errors[3].direction, 1.0));
    }
    let (lag_s, overshoot) = kalman::response(OVER_S / 2.0, 1.0 / RATE_HZ);
    let _ = writeln!(
        text,
        "\nOn a perfect path both lag by 0.1 s (the Kalman filter by {lag_s:.3} s); when it stops, the difference overshoots by\n\
         nothing, the Kalman filter by {:.0} % of the speed.",
        100.0 * overshoot
    );
    Ok(text)
}
