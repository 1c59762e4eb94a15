//! Baselines that follow drift and taxels that are found unfit, on every backend.

use somatic::signal::Unfit;
use somatic::{Body, Calibration, Engine, Flags, Frame, Options, Percept, RawValue};

use crate::common::{Flat, backends, frame};

/// Two patches of two taxels in a field above both.
fn feet() -> Body {
    Flat::new(&[[-0.1, 0.0], [-0.05, 0.0], [0.05, 0.0], [0.1, 0.0]])
        .field("body", None, [])
        .field("body/left", Some("body"), [0, 1])
        .field("body/right", Some("body"), [2, 3])
        .body()
}

const KEEP: &str = "[all]\nbaseline = 100\ndead_band = 12\np_max = 1000\nraw_range = [0, 1023]\n\
                    [upkeep]\ntime_constant_s = 30\nmax_drift = 50\nstuck_s = 1000\nsaturated_s = 20\n";

struct Run {
    percepts: Vec<Vec<Percept>>,
    unfit: Vec<(u32, Unfit)>,
}

/// Runs `frames` on every backend, cut in three ways; each run is held to the reference and to the others.
fn on_every_backend(calibration: &str, frames: &[Frame]) -> Run {
    let body = feet();
    let calibration = Calibration::parse(calibration, &[0, 1, 2, 3]).unwrap();
    let mut runs: Vec<Run> = Vec::new();
    for backend in backends() {
        let mut of_this_backend: Vec<Vec<Vec<Percept>>> = Vec::new();
        for cut in [1, 7, frames.len()] {
            let options = Options { backend, calibration: Some(calibration.clone()), batch: 64, ..Options::default() };
            let mut engine = Engine::new(&body, options).unwrap();
            let mut seen = Vec::new();
            for part in frames.chunks(cut) {
                let (percepts, agreement) = engine.process_and_compare(part).unwrap();
                assert!(agreement.holds(), "{backend:?}: {agreement}");
                seen.extend((0..part.len()).map(|frame| percepts.frame(frame).collect::<Vec<_>>()));
            }
            runs.push(Run { percepts: seen.clone(), unfit: engine.unfit().collect() });
            of_this_backend.push(seen);
        }
        assert!(of_this_backend.windows(2).all(|pair| pair[0] == pair[1]), "{backend:?} depends on the cut");
    }
    assert!(runs.windows(2).all(|pair| pair[0].unfit == pair[1].unfit));
    runs.pop().unwrap()
}

/// `seconds` at 2 Hz.
fn record(seconds: u32, values: impl Fn(f64) -> [f64; 4]) -> Vec<Frame> {
    (0..seconds * 2).map(|tick| f64::from(tick) / 2.0).map(|t| frame(t, &values(t))).collect()
}

#[test]
fn a_foot_that_stands_for_ten_minutes_is_still_felt() {
    // The left foot carries the robot from 2 s on; the right one drifts by 24 counts meanwhile.
    let frames = record(600, |t| {
        let load = if t < 2.0 { 100.0 } else { 500.0 };
        [load, load, 100.0 + 0.04 * t, 100.0]
    });
    let run = on_every_backend(KEEP, &frames);
    for frame in &run.percepts[5..] {
        let left = &frame[1];
        assert!(left.contact && left.total == Some(800.0), "{left:?}");
        assert!(frame[0].contact && !frame[2].contact, "drift was taken for a touch: {:?}", frame[2]);
    }
    assert!(run.unfit.is_empty());
}

#[test]
fn without_upkeep_the_same_drift_is_taken_for_a_touch() {
    let frames = record(600, |t| [100.0, 100.0, 100.0 + 0.04 * t, 100.0]);
    let run = on_every_backend("[all]\nbaseline = 100\ndead_band = 12", &frames);
    assert!(run.percepts[1199][2].contact);
}

#[test]
fn a_robot_switched_on_while_it_stands_feels_the_ground() {
    let run = on_every_backend(KEEP, &record(120, |_| [450.0, 470.0, 100.0, 100.0]));
    for frame in &run.percepts {
        assert_eq!(frame[1].total, Some(720.0));
    }
}

#[test]
fn a_stuck_taxel_is_masked_and_named_and_the_others_go_on() {
    let keep = KEEP.replace("stuck_s = 1000", "stuck_s = 5");
    // Taxel 0 hangs at 300 while its neighbour breathes with the load.
    let frames = record(20, |t| [300.0, 500.0 + (t * 2.0) % 5.0, 100.0, 100.0]);
    let run = on_every_backend(&keep, &frames);
    assert_eq!(run.unfit, [(0, Unfit::Stuck)]);
    let (first, last) = (&run.percepts[0][1], &run.percepts[39][1]);
    assert_eq!((first.active, first.flags.contains(Flags::FAULTY_INPUT)), (Some(2), false));
    assert_eq!((last.active, last.flags.contains(Flags::FAULTY_INPUT)), (Some(1), true));
    assert!(last.contact && last.total.unwrap() > 390.0);
}

#[test]
fn a_dead_taxel_is_named_and_comes_back() {
    let keep = KEEP.replace("[upkeep]\n", "[upkeep]\ndead_s = 3\n");
    let mut frames = record(30, |t| [100.0 + t % 2.0, 300.0 + t % 3.0, 100.0, 100.0]);
    for frame in &mut frames[10..40] {
        frame.values[1] = RawValue::FAULTY;
    }
    assert_eq!(on_every_backend(&keep, &frames[..30]).unfit, [(1, Unfit::Dead)]);
    let whole = on_every_backend(&keep, &frames);
    assert!(whole.unfit.is_empty() && whole.percepts[59][1].total.unwrap() > 190.0);
}

#[test]
fn upkeep_that_makes_no_sense_is_refused() {
    let why = |text: &str| Calibration::parse(text, &[0]).unwrap_err().to_string();
    assert!(why("[upkeep]\ntime_constant_s = 0").contains("`time_constant_s` must be over 0"));
    assert!(why("[upkeep]\nstuck_s = nan").contains("`stuck_s`"));
    assert!(why("[upkeep]\ntime_constant = 3").contains("did you mean `time_constant_s`"));
}
