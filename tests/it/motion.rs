//! Motion and contact over time, on every backend, each also held to the reference.

use std::f64::consts::{FRAC_PI_2, PI};

use somatic::scene::{Arithmetic, Cadence, MotionFilter};
use somatic::{Body, Calibration, Engine, Flags, Frame, Options, Outputs, Percept, Scene, Touch, touch};

use crate::common::{Flat, backends, frame, ways};

/// Nine taxels a metre apart in a line along u, and three along v above the middle one.
fn cross() -> Body {
    let along_u = (0..9).map(|i| [f64::from(i) - 4.0, 0.0]);
    let along_v = (1..4).map(|i| [0.0, f64::from(i)]);
    let uv: Vec<[f64; 2]> = along_u.chain(along_v).collect();
    Flat::new(&uv).field("field", None, 0..12).body()
}

/// A frame at `t_s` in which the taxels in `pressed` are.
fn press(t_s: f64, pressed: &[(usize, f64)]) -> Frame {
    let mut values = [0.0; 12];
    for &(taxel, value) in pressed {
        values[taxel] = value;
    }
    frame(t_s, &values)
}

/// The percepts of the one field, on every backend, all at once and frame by frame.
fn on_every_backend(calibration: &str, frames: &[Frame]) -> Vec<Vec<Percept>> {
    let body = cross();
    let ids: Vec<u32> = (0..12).collect();
    let calibration = Calibration::parse(calibration, &ids).unwrap();
    let mut runs = Vec::new();
    for backend in backends() {
        let options = Options::default()
            .backend(backend)
            .calibration(calibration.clone())
            .scene(Scene::default().outputs(Outputs::USUAL_AND_MOTION).max_gap_s(5.0))
            .batch(64);
        for cut in [1, frames.len()] {
            let mut engine = Engine::new(&body, options.clone()).unwrap();
            let mut seen = Vec::new();
            for part in frames.chunks(cut) {
                let (percepts, agreement) = engine.process_and_compare(part).unwrap();
                assert!(agreement.holds(), "{backend:?}: {agreement}");
                seen.extend((0..part.len()).map(|frame| percepts.get(frame, 0)));
            }
            runs.push(seen);
        }
    }
    runs
}

fn near(a: Option<f64>, b: f64) -> bool {
    a.is_some_and(|a| (a - b).abs() < 1e-5)
}

fn without_active(mut percept: Percept) -> Percept {
    percept.active = None;
    percept
}

#[test]
fn a_touch_that_moves_has_a_direction_and_a_speed() {
    let frames = [
        press(0.0, &[(4, 5.0)]),
        press(0.5, &[(6, 5.0)]),
        press(1.0, &[(4, 3.0)]),
        press(1.25, &[(10, 3.0)]),
        press(1.5, &[(10, 9.0)]),
        press(1.75, &[(4, 9.0)]),
    ];
    for run in on_every_backend("", &frames) {
        assert!(run[0].flags.contains(Flags::NO_PREVIOUS));
        assert_eq!((run[0].displacement, run[0].direction, run[0].speed), (None, None, None));
        assert_eq!(run[1].displacement, Some([2.0, 0.0]));
        assert!(near(run[1].direction, 0.0) && near(run[1].distance, 2.0) && near(run[1].speed, 4.0));
        assert!(near(run[1].radial_distance, 2.0) && near(run[1].radial_speed, 4.0));
        // Back along −u: π, not −π; towards the origin the paper's distance is negative.
        let back = run[2].direction.unwrap();
        assert!(back > PI - 1e-6 && back <= PI);
        assert!(near(run[2].radial_distance, -2.0) && near(run[2].distance, 2.0));
        assert!(near(run[3].direction, FRAC_PI_2) && near(run[3].speed, 8.0));
        assert!(run[4].flags.contains(Flags::STILL) && run[4].direction.is_none());
        assert_eq!((run[4].displacement, run[4].speed), (Some([0.0, 0.0]), Some(0.0)));
        assert!(near(run[5].direction, -FRAC_PI_2));
    }
}

#[test]
fn motion_around_the_origin_is_seen_though_the_papers_distance_is_blind() {
    for run in on_every_backend("", &[press(0.0, &[(6, 1.0)]), press(1.0, &[(10, 1.0)])]) {
        assert!(near(run[1].radial_distance, 0.0) && near(run[1].distance, 8.0_f64.sqrt()));
    }
}

#[test]
fn a_gap_in_contact_starts_afresh_and_a_dropped_frame_counts_its_time() {
    let frames = [press(0.0, &[(4, 5.0)]), press(0.1, &[]), press(0.2, &[(6, 5.0)]), press(0.6, &[(8, 5.0)])];
    for run in on_every_backend("", &frames) {
        assert_eq!(run[1].flags, Flags::NO_CONTACT);
        assert!(run[2].flags.contains(Flags::NO_PREVIOUS) && run[2].distance.is_none());
        assert!(near(run[3].speed, 5.0));
    }
}

#[test]
fn a_clock_that_jumps_gives_no_motion() {
    let times = [0.0, 0.0, -3.0, -2.9, 7200.0, 7200.1];
    let frames: Vec<Frame> = times.iter().enumerate().map(|(i, &t)| press(t, &[(i, 1.0)])).collect();
    for run in on_every_backend("", &frames) {
        for index in [1, 2, 4] {
            assert!(run[index].flags.contains(Flags::BAD_DT), "{index}");
            assert_eq!((run[index].speed, run[index].displacement), (None, None), "{index}");
        }
        assert!(near(run[3].distance, 1.0) && run[3].speed.is_some_and(|s| (s - 10.0).abs() < 1e-3));
        assert!(run[5].speed.is_some_and(|s| (s - 10.0).abs() < 1e-3));
    }
}

#[test]
fn contact_with_thresholds_begins_high_and_ends_low() {
    let totals = [5.0, 10.0, 12.0, 9.0, 5.0, 4.0, 9.0, 11.0];
    let frames: Vec<Frame> = (0..8).map(|i| press(i as f64 * 0.1, &[(i, totals[i])])).collect();
    for run in on_every_backend("[contact]\non = 10\noff = 4", &frames) {
        let contact: Vec<bool> = run.iter().map(|p| p.contact).collect();
        assert_eq!(contact, [false, false, true, true, true, false, false, true]);
        for (p, total) in run.iter().zip(totals) {
            // Out of contact the sums are still given, and nothing that needs a touch.
            assert_eq!((p.total, p.centroid.is_some()), (Some(total), p.contact));
            assert_eq!(p.flags.contains(Flags::NO_CONTACT), !p.contact);
        }
        assert!(run[2].flags.contains(Flags::NO_PREVIOUS) && near(run[3].distance, 1.0));
        assert!(run[7].flags.contains(Flags::NO_PREVIOUS));
    }
    // One field's own thresholds.
    for run in on_every_backend("[contact]\non = 10\n[contact.field.field]\non = 4.5", &frames) {
        assert_eq!(
            run.iter().map(|p| p.contact).collect::<Vec<_>>(),
            [true, true, true, true, true, false, true, true]
        );
    }
}

#[test]
fn thresholds_for_a_field_that_is_not_there_are_refused() {
    let ids: Vec<u32> = (0..12).collect();
    let calibration = Some(Calibration::parse("[contact.field.feild]\non = 3", &ids).unwrap());
    let refused = Engine::new(&cross(), Options::default().calibration(calibration)).err().unwrap().to_string();
    assert!(refused.contains("`feild`") && refused.contains("did you mean `field`"), "{refused}");
}

#[test]
fn two_fingers_are_two_touches_only_when_asked_for() {
    let frames = [
        press(0.0, &[(0, 2.0), (1, 2.0), (8, 6.0)]),
        press(0.1, &[(1, 4.0), (7, 6.0)]),
        press(0.2, &[(7, 6.0)]),
        press(0.3, &[]),
        press(0.4, &[(7, 6.0)]),
    ];
    for backend in backends() {
        for cut in [1, frames.len()] {
            let scene = Scene::default().outputs(Outputs::CENTROID).touches(touch::Options::default());
            let mut engine = Engine::new(&cross(), Options::default().backend(backend).scene(scene)).unwrap();
            let mut seen: Vec<Vec<Touch>> = Vec::new();
            let mut several = Vec::new();
            for part in frames.chunks(cut) {
                let (percepts, agreement) = engine.process_and_compare(part).unwrap();
                assert!(agreement.holds(), "{backend:?}: {agreement}");
                seen.extend((0..part.len()).map(|frame| percepts.touches(frame).unwrap().touches.clone()));
                several.extend((0..part.len()).map(|frame| percepts.get(frame, 0).flags.contains(Flags::SEVERAL)));
            }
            let reported = |touches: &[Touch]| -> Vec<(u64, f64, u32, f64)> {
                touches.iter().map(|t| (t.id, t.total, t.active, t.centre.x)).collect()
            };
            assert_eq!(reported(&seen[0]), [(1, 6.0, 1, 4.0), (2, 4.0, 2, -3.5)]);
            // One that shares no taxel with those before is another.
            assert_eq!(reported(&seen[1]), [(2, 4.0, 1, -3.0), (3, 6.0, 1, 3.0)]);
            assert_eq!(reported(&seen[2]), [(3, 6.0, 1, 3.0)]);
            assert!(seen[3].is_empty());
            assert_eq!(reported(&seen[4]), [(4, 6.0, 1, 3.0)]);
            assert_eq!(several, [true, true, false, false, false]);
            assert!(seen[0][0].position.distance(glam::DVec3::new(4.0, 0.0, 0.0)) < 1e-9);
        }
        let mut usual = Engine::new(&cross(), Options::default().backend(backend)).unwrap();
        let percepts = usual.process(&frames).unwrap();
        assert!(percepts.touches(0).is_none() && !percepts.get(0, 0).flags.contains(Flags::SEVERAL));
    }
}

/// What tells of motion, and of filtered motion.
const MOVED: Outputs = Outputs::DIRECTION.union(Outputs::DISTANCE).union(Outputs::FILTERED);

#[test]
fn a_ball_that_rolls_on_a_large_plate_has_a_direction() {
    const SIDE: usize = 317;
    let along = |i: usize| i as f64 / (SIDE - 1) as f64 - 0.5;
    let uv: Vec<[f64; 2]> = (0..SIDE * SIDE).map(|i| [along(i % SIDE), along(i / SIDE)]).collect();
    let body = Flat::new(&uv).field("plate", None, 0..uv.len() as u32).body();
    // It touches some 500 taxels of 100,489, and goes 15 mm a frame.
    let heading = 0.5_f64;
    let frames: Vec<Frame> = (0..18)
        .map(|turn| {
            let way = 0.015 * f64::from(turn);
            let middle = [way * heading.cos() - 0.15, way * heading.sin() - 0.1];
            let pressure = |&[u, v]: &[f64; 2]| {
                let off = (u - middle[0]).hypot(v - middle[1]) / 0.0402;
                1000.0 * (1.0 - off * off).max(0.0).powi(2)
            };
            frame(0.1 * f64::from(turn), &uv.iter().map(pressure).collect::<Vec<_>>())
        })
        .collect();
    let pressed = frames[3].values.iter().filter(|value| value.number().is_some_and(|value| value > 0.0)).count();
    assert!((480..530).contains(&pressed), "{pressed}");
    let filter = MotionFilter::default().with_window("1mm..50mm").unwrap();
    for backend in backends() {
        let mut seen = Vec::new();
        for (outputs, cut) in [(MOVED, 1), (MOVED | Outputs::ACTIVE, 18), (MOVED, 7)] {
            let scene = Scene::default().outputs(outputs).filter(filter);
            let mut engine = Engine::new(&body, Options::default().backend(backend).scene(scene).batch(cut)).unwrap();
            let mut run = Vec::new();
            for part in frames.chunks(cut) {
                let (percepts, agreement) = engine.process_and_compare(part).unwrap();
                assert!(agreement.holds(), "{backend:?}: {agreement}");
                assert_eq!(percepts.get(0, 0).active.is_some(), outputs.contains(Outputs::ACTIVE));
                run.extend((0..part.len()).map(|frame| without_active(percepts.get(frame, 0))));
            }
            for percept in &run[1..] {
                assert!(percept.flags.is_empty(), "{backend:?}: {percept:?}");
                assert!((percept.distance.unwrap() - 0.015).abs() < 1e-5, "{backend:?}: {percept:?}");
                for direction in [percept.direction, percept.filtered_direction] {
                    let off = (direction.unwrap() - heading).to_degrees();
                    assert!(off.abs() < 0.1, "{backend:?}: {off} degrees off");
                }
                assert!(percept.filtered_speed.is_some());
            }
            seen.push(run);
        }
        assert!(seen.iter().all(|run| *run == seen[0]), "{backend:?}");
    }
}

#[test]
fn what_counts_as_still_grows_with_the_pressed_taxels_of_both_frames() {
    // A thousand and one taxels in a line from −1 to 1, and one more 1006 u from its middle, where u is the rounding of single
    // precision.
    let u = f64::from(f32::EPSILON) / 2.0;
    let mut uv: Vec<[f64; 2]> = (0..1001).map(|i| [f64::from(i) / 500.0 - 1.0, 0.0]).collect();
    uv.push([1006.0 * u, 0.0]);
    let body = Flat::new(&uv).field("line", None, 0..1002).body();
    let pressed = |taxels: &[(usize, f64)]| {
        let mut values = vec![0.0; 1002];
        taxels.iter().for_each(|&(taxel, value)| values[taxel] = value);
        values
    };
    let mut all = vec![1.0; 1002];
    all[1001] = 0.0;
    let round = [
        pressed(&[(0, 1.0), (1000, 1.0)]),
        // 1024 u further, where four pressed taxels of two frames feign 30 u.
        pressed(&[(0, 1.0), (1000, 1.0 + 2048.0 * u)]),
        // 8 u further.
        pressed(&[(0, 1.0), (1000, 1.0 + 2064.0 * u)]),
        // Back in the middle, and 1006 u off it; each time a thousand pressed taxels feign twice as much.
        all,
        pressed(&[(1001, 1.0)]),
        // Back again by one taxel.
        pressed(&[(500, 1.0)]),
        pressed(&[(500, 1.0)]),
        pressed(&[(1001, 1.0)]),
        pressed(&[]),
        pressed(&[(500, 1.0)]),
    ];
    let frames: Vec<Frame> =
        (0..20).map(|turn| frame(0.1 * f64::from(turn), &round[turn as usize % round.len()])).collect();
    let filter = MotionFilter::default().over_s(None).low_m(0.0).high_m(1.0).time_constant_s(0.0);
    for (backend, knobs) in ways() {
        // That cadence filters motion in its own way.
        let filtered = knobs.cadence == Cadence::EveryFrame;
        let moved = if filtered { MOVED } else { MOVED - Outputs::FILTERED };
        let mut seen = Vec::new();
        for (outputs, cut) in [(moved, 1), (moved, 20), (moved | Outputs::ACTIVE, 7)] {
            let scene = Scene::default().outputs(outputs).filter(filter).knobs(knobs);
            let mut engine = Engine::new(&body, Options::default().backend(backend).scene(scene).batch(cut)).unwrap();
            let mut run = Vec::new();
            for part in frames.chunks(cut) {
                let (percepts, agreement) = engine.process_and_compare(part).unwrap();
                assert!(agreement.holds(), "{backend:?} {knobs:?}: {agreement}");
                run.extend((0..part.len()).map(|frame| without_active(percepts.get(frame, 0))));
            }
            seen.push(run);
        }
        assert!(seen.iter().all(|run| *run == seen[0]), "{backend:?} {knobs:?}");
        // Compensated sums lose little, however many taxels are pressed.
        let careful = knobs.arithmetic == Some(Arithmetic::Compensated);
        for (turn, percept) in seen[0].iter().enumerate() {
            let turns = [(1, true), (2, false), (3, careful), (4, careful), (5, true), (7, true)];
            for (_, moves) in turns.into_iter().filter(|(of_round, _)| turn % round.len() == *of_round) {
                let what = format!("{backend:?} {knobs:?} frame {turn}: {percept:?}");
                assert_eq!(
                    (percept.direction.is_some(), percept.flags.contains(Flags::STILL)),
                    (moves, !moves),
                    "{what}"
                );
                assert_eq!(percept.filtered_speed.is_some(), moves && filtered, "{what}");
                assert_eq!(percept.flags.contains(Flags::HELD), !moves && filtered, "{what}");
            }
        }
        assert!(seen[0][9].flags.contains(Flags::NO_PREVIOUS) && seen[0][19].flags.contains(Flags::NO_PREVIOUS));
    }
}
