//! Baselines that follow drift and taxels that are found unfit, on every backend.

use somatic::scene::{Coverage, Knobs, Scene};
use somatic::signal::{Unfit, Wiring};
use somatic::{BackendKind, Body, Calibration, Engine, Flags, Frame, Options, Outputs, Percept, RawValue, touch};

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
                    [drift]\ntime_constant_s = 30\nmax_drift = 50\nstuck_s = 1000\nsaturated_s = 20\n";

struct Run {
    percepts: Vec<Vec<Percept>>,
    unfit: Vec<(u32, Unfit)>,
}

/// Runs `frames` of [`feet`] as [`on_every_backend_of`] does.
fn on_every_backend(calibration: &str, frames: &[Frame]) -> Run {
    on_every_backend_of(&feet(), None, calibration, frames)
}

/// Runs `frames` on every backend, cut in three ways, with a gate and without; each run is held to the reference and to the
/// others.
fn on_every_backend_of(body: &Body, wiring: Option<&Wiring>, calibration: &str, frames: &[Frame]) -> Run {
    let ids: Vec<u32> = body.taxels.iter().map(|taxel| taxel.id).collect();
    let calibration = Calibration::parse(calibration, &ids).unwrap();
    let mut runs: Vec<Run> = Vec::new();
    for backend in backends() {
        let mut of_this_backend: Vec<Vec<Vec<Percept>>> = Vec::new();
        let gated = Coverage::Touched;
        for (cut, coverage) in [(1, Coverage::All), (1, gated), (7, gated), (frames.len(), Coverage::All)] {
            if coverage == gated && backend != BackendKind::Cpu {
                continue;
            }
            let scene = Scene::default().knobs(Knobs::default().coverage(coverage));
            let calibration = Some(calibration.clone());
            let mut engine =
                Engine::new(body, Options::default().scene(scene).backend(backend).calibration(calibration).batch(64))
                    .unwrap();
            wiring.into_iter().for_each(|wiring| engine.wire(wiring));
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
fn without_drift_compensation_the_same_drift_is_taken_for_a_touch() {
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
    let keep = KEEP.replace("[drift]\n", "[drift]\ndead_s = 3\n");
    let mut frames = record(30, |t| [100.0 + t % 2.0, 300.0 + t % 3.0, 100.0, 100.0]);
    for frame in &mut frames[10..40] {
        frame.values[1] = RawValue::FAULTY;
    }
    assert_eq!(on_every_backend(&keep, &frames[..30]).unfit, [(1, Unfit::Dead)]);
    let whole = on_every_backend(&keep, &frames);
    assert!(whole.unfit.is_empty() && whole.percepts[59][1].total.unwrap() > 190.0);
}

#[test]
fn drift_keys_that_make_no_sense_are_refused() {
    let why = |text: &str| Calibration::parse(text, &[0]).unwrap_err().to_string();
    assert!(why("[drift]\ntime_constant_s = 0").contains("`time_constant_s` must be over 0"));
    assert!(why("[drift]\nstuck_s = nan").contains("`stuck_s`"));
    assert!(why("[drift]\ntime_constant = 3").contains("did you mean `time_constant_s`"));
}

/// Three boards of eight taxels: a foot, a palm and a rear, in a field above all.
fn three_boards() -> (Body, Wiring) {
    let places: Vec<[f64; 2]> =
        (0..24).map(|taxel| [0.01 * f64::from(taxel % 8), 0.1 * f64::from(taxel / 8)]).collect();
    let body = Flat::new(&places)
        .field("body", None, [])
        .field("body/foot", Some("body"), 0..8)
        .field("body/palm", Some("body"), 8..16)
        .field("body/rear", Some("body"), 16..24)
        .body();
    let board =
        |id: u32| format!("[[board]]\nid = {id}\ntaxels = [{{ channel = 0, first = {}, count = 8 }}]\n", id * 8);
    (body, Wiring::from_text(&(0..3).map(board).collect::<String>()).unwrap())
}

/// What presses a taxel: from when to when, and by how many counts. Up and down take 0.3 s.
struct Press {
    taxel: usize,
    from_s: f64,
    to_s: f64,
    counts: f64,
}

impl Press {
    fn at(&self, t_s: f64) -> f64 {
        self.counts * ((t_s - self.from_s) / 0.3).min((self.to_s - t_s) / 0.3).clamp(0.0, 1.0)
    }
}

const HZ: f64 = 5.0;
const DRIFTING: &str = "[all]\nbaseline = 1000\ndead_band = 12\nraw_range = [0, 2000]\n\
                        [drift]\ntime_constant_s = 60\nmax_drift = 600\n";

/// Whole counts of taxels that all drift by about `per_minute`, each by up to a twentieth more or less.
fn drifting(seconds: f64, per_minute: f64, presses: &[Press]) -> Vec<Frame> {
    let row = |tick: u32| {
        let t = f64::from(tick) / HZ;
        let raw = |taxel: usize| {
            let own = 1.0 + 0.05 * ((taxel * 7 % 11) as f64 / 5.0 - 1.0);
            let pressed: f64 = presses.iter().filter(|press| press.taxel == taxel).map(|press| press.at(t)).sum();
            (1000.0 + 0.37 * (taxel % 5) as f64 + per_minute * own * t / 60.0 + pressed).round()
        };
        frame(t, &(0..24).map(raw).collect::<Vec<_>>())
    };
    (0..(seconds * HZ) as u32).map(row).collect()
}

/// Runs `frames` of [`three_boards`] on the CPU.
fn run_boards(calibration: &str, frames: &[Frame]) -> Vec<Vec<Percept>> {
    let (body, wiring) = three_boards();
    let ids: Vec<u32> = (0..24).collect();
    let calibration = Some(Calibration::parse(calibration, &ids).unwrap());
    let mut engine = Engine::new(&body, Options::default().backend(BackendKind::Cpu).calibration(calibration)).unwrap();
    engine.wire(&wiring);
    let percepts = engine.process(frames).unwrap();
    (0..frames.len()).map(|frame| percepts.frame(frame).collect()).collect()
}

/// Holds what is felt in the foot, palm and rear against what presses: from 2 s after a release on there is no contact,
/// every touch is felt from onset to release, and the total of each field's is within its share.
fn check_against(presses: &[Press], felt: &[Vec<Percept>], shares: [f64; 3]) {
    for (tick, frame) in felt.iter().enumerate() {
        let t = tick as f64 / HZ;
        for (field, share) in shares.into_iter().enumerate() {
            let of_field = || presses.iter().filter(|press| press.taxel / 8 == field);
            let held: f64 = of_field().map(|press| press.at(t)).sum();
            let is_full = of_field().all(|press| press.at(t) == 0.0 || press.at(t) == press.counts);
            let percept = &frame[field + 1];
            if held > 0.0 && is_full {
                let total = percept.total.filter(|_| percept.contact).unwrap_or_else(|| panic!("{t}: {percept:?}"));
                assert!((total / held - 1.0).abs() < share, "{t}: {total} for {held} in field {field}");
            }
            if of_field().all(|press| t < press.from_s || t > press.to_s + 2.0) {
                assert!(!percept.contact, "{t}: {percept:?}");
            }
        }
    }
}

/// A foot that covers its whole board and two taxels of the palm are pressed for 17 minutes; the rear is
/// tapped every 20 s.
fn long_and_short() -> Vec<Press> {
    let hold = |taxel| Press { taxel, from_s: 60.0, to_s: 1100.0, counts: 400.0 };
    let tap = |tap: u32| {
        let from_s = 20.0 * f64::from(tap) + 0.37 * f64::from(tap % 7);
        Press { taxel: 16 + (tap * 3 % 8) as usize, from_s, to_s: from_s + 1.0 + f64::from(tap % 4), counts: 60.0 }
    };
    (0..8).chain([10, 11]).map(hold).chain((3..59).map(tap)).collect()
}

#[test]
fn no_touch_is_lost_to_drift_and_none_is_left_behind() {
    let presses = long_and_short();
    for per_minute in [-20.0, -8.0, -2.0, 2.0, 8.0, 20.0] {
        let felt = run_boards(DRIFTING, &drifting(1200.0, per_minute, &presses));
        let is_known = |frame: &Vec<Percept>| !frame.iter().any(|p| p.flags.contains(Flags::DRIFT_UNKNOWN));
        assert!(felt.iter().all(is_known), "{per_minute}");
        // While the rear is tapped, nobody is untouched: its own drift is not known in these 4 s.
        check_against(&presses, &felt, [0.05, 0.05, 0.1]);
    }
}

#[test]
fn a_drift_that_nobody_can_tell_is_reported_as_unknown_and_ends_with_the_touch() {
    let presses: Vec<Press> = (0..24).map(|taxel| Press { taxel, from_s: 20.0, to_s: 200.0, counts: 400.0 }).collect();
    let felt = run_boards(DRIFTING, &drifting(220.0, 8.0, &presses));
    // 3 minutes of drift are 24 counts.
    check_against(&presses, &felt, [0.07; 3]);
    for (tick, frame) in felt.iter().enumerate() {
        let t = tick as f64 / HZ;
        let unknown = frame.iter().all(|percept| percept.flags.contains(Flags::DRIFT_UNKNOWN));
        assert!(unknown || !(83.0..200.0).contains(&t), "{t}");
        assert!(!unknown || (79.0..203.0).contains(&t), "{t}");
    }
}

#[test]
fn a_noisy_taxel_leaves_no_drift_behind_in_its_finger() {
    let mut frames = drifting(1200.0, 20.0, &[]);
    for (tick, frame) in frames.iter_mut().enumerate().filter(|(tick, _)| (300..5500).contains(tick)) {
        let noise = 40.0 * (f64::from(tick as u32 % 2) * 2.0 - 1.0);
        frame.values[10] = RawValue::new(frame.values[10].number().unwrap() + noise);
    }
    for (calibration, of_noise) in [(DRIFTING.to_owned(), 70.0), (format!("{DRIFTING}noisy = 30\n"), 0.0)] {
        let felt = run_boards(&calibration, &frames);
        // What its neighbours in the palm drift is not felt.
        let most = felt[310..].iter().filter_map(|frame| frame[2].total).fold(0.0, f64::max);
        assert!(most <= of_noise, "{most}");
        assert!(felt[5511..].iter().all(|frame| !frame[2].contact));
    }
}

#[test]
fn what_is_left_of_a_press_is_a_touch_and_is_kept() {
    let part = |to_s, counts| Press { taxel: 10, from_s: 20.0, to_s, counts };
    let presses = [part(300.0, 360.0), part(900.0, 40.0)];
    let felt = run_boards(DRIFTING, &drifting(1000.0, 8.0, &presses));
    check_against(&presses, &felt, [0.05, 0.3, 0.05]);
    // A slow press, half a count a second, is felt too, and kept.
    let mut frames = drifting(600.0, 0.0, &[]);
    for (tick, frame) in frames.iter_mut().enumerate() {
        let pressed = (0.5 * (tick as f64 / HZ - 20.0)).clamp(0.0, 100.0);
        frame.values[10] = RawValue::new(frame.values[10].number().unwrap() + pressed.round());
    }
    let felt = run_boards(DRIFTING, &frames);
    assert!(felt[600..].iter().all(|frame| frame[2].contact), "from 120 s on");
}

#[test]
fn what_drifts_together_is_the_same_however_it_is_computed() {
    let (body, wiring) = three_boards();
    let hold = |taxel| Press { taxel, from_s: 20.0, to_s: 90.0, counts: 400.0 };
    let frames = drifting(110.0, 20.0, &(0..8).chain([10]).map(hold).collect::<Vec<_>>());
    let run = on_every_backend_of(&body, Some(&wiring), DRIFTING, &frames);
    let last = run.percepts.last().unwrap();
    assert!(last.iter().all(|percept| !percept.contact), "{last:?}");
    // Without a wiring, the link's untouched taxels tell as much.
    let unwired = on_every_backend_of(&body, None, DRIFTING, &frames);
    assert!(unwired.percepts.last().unwrap().iter().all(|percept| !percept.contact));
}

/// A grid of eight by eight taxels under one field, as a mat without a layout has it.
fn mat() -> Body {
    let places: Vec<[f64; 2]> =
        (0..64).map(|taxel| [0.01 * f64::from(taxel % 8), 0.01 * f64::from(taxel / 8)]).collect();
    Flat::new(&places).field("mat", None, 0..64).surface(0.2).body()
}

/// Shares of 20 minutes in which a touch is felt that is none, and in which a press is not felt.
fn wrong_shares(calibration: &str, touches: bool, drift: impl Fn(usize, f64) -> f64) -> [f64; 2] {
    // Two by two taxels for ten minutes, and a tap elsewhere every 15 s.
    let hold = [18, 19, 26, 27].map(|taxel| Press { taxel, from_s: 60.0, to_s: 660.0, counts: 300.0 });
    let tap = |tap: u32| {
        let from_s = 15.0 * f64::from(tap) + 0.31 * f64::from(tap % 5);
        Press { taxel: (tap * 11 % 16) as usize + 48, from_s, to_s: from_s + 2.0, counts: 80.0 }
    };
    let presses: Vec<Press> = hold.into_iter().chain((1..78).map(tap)).collect();
    let body = mat();
    let ids: Vec<u32> = (0..64).collect();
    let scene = Scene::default().outputs(Outputs::TOTAL);
    let scene = if touches { scene.touches(touch::Options::default()) } else { scene };
    let calibration = Some(Calibration::parse(calibration, &ids).unwrap());
    let options = Options::default().scene(scene).backend(BackendKind::Cpu).calibration(calibration);
    let mut engine = Engine::new(&body, options).unwrap();
    engine.keep_touch_taxels(true);
    let (mut phantoms, mut missed, frames) = (0, 0, (1200.0 * HZ) as u32);
    for tick in 0..frames {
        let t = f64::from(tick) / HZ;
        let pressed =
            |taxel: usize| presses.iter().filter(|press| press.taxel == taxel).map(|press| press.at(t)).sum::<f64>();
        let noise = |taxel: usize| ((tick as usize * 31 + taxel * 17) % 7) as f64 / 3.0 - 1.0;
        let raw = |taxel: usize| (1000.0 + drift(taxel, t) + noise(taxel) + pressed(taxel)).round();
        let percepts = engine.process(&[frame(t, &(0..64).map(raw).collect::<Vec<_>>())]).unwrap();
        let is_near = |press: &Press| t > press.from_s - 0.5 && t < press.to_s + 2.0;
        let at: Vec<usize> = presses.iter().filter(|press| is_near(press)).map(|press| press.taxel).collect();
        let is_full = presses.iter().filter(|press| press.at(t) == press.counts).count();
        let felt: Vec<u32> = match percepts.touches(0) {
            Some(found) => found.touches.iter().flat_map(|touch| found.taxels(touch)).copied().collect(),
            None => Vec::new(),
        };
        if touches {
            phantoms += usize::from(felt.iter().any(|&node| !at.contains(&(node as usize))));
            missed += usize::from(is_full > 0 && felt.is_empty());
        } else {
            phantoms += usize::from(at.is_empty() && percepts.frame(0).next().unwrap().contact);
        }
    }
    [phantoms, missed].map(|count| count as f64 / f64::from(frames))
}

#[test]
fn drift_under_one_field_is_estimated_by_taxels_away_from_the_touch() {
    // A warm-up of 40 counts, and a room that warms by 15 counts in 10 minutes and cools again.
    let own = |taxel: usize| 1.0 + 0.05 * ((taxel * 7 % 11) as f64 / 5.0 - 1.0);
    let warm_up = |taxel: usize, t: f64| 40.0 * own(taxel) * (1.0 - (-t / 150.0).exp());
    let room = |taxel: usize, t: f64| 15.0 * own(taxel) * (std::f64::consts::TAU * t / 1200.0).sin();
    for (name, drift) in [("warm-up", &warm_up as &dyn Fn(usize, f64) -> f64), ("room", &room)] {
        let [phantoms, missed] = wrong_shares(DRIFTING, true, drift);
        assert!(phantoms <= 0.01 && missed == 0.0, "{name}: {phantoms} {missed}");
    }
    // Negative control: without compensation the warm-up is a touch, for good.
    let [phantoms, _] = wrong_shares("[all]\nbaseline = 1000\ndead_band = 12\nraw_range = [0, 2000]\n", true, warm_up);
    assert!(phantoms > 0.5, "{phantoms}");
}
