//! Motion and contact over time, on every backend, each also held to the reference.

use std::f64::consts::{FRAC_PI_2, PI};

use somatic::{Body, Calibration, Engine, Flags, Frame, Options, Outputs, Percept, Scene, Touch};

use crate::common::{Flat, backends, frame};

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
        let options = Options {
            backend,
            calibration: Some(calibration.clone()),
            scene: Scene { max_gap_s: 5.0, ..Scene::default() },
            batch: 64,
            ..Options::default()
        };
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
    let totals = [5.0, 9.0, 12.0, 9.0, 5.0, 4.0, 9.0, 11.0];
    let frames: Vec<Frame> = (0..8).map(|i| press(i as f64 * 0.1, &[(i, totals[i])])).collect();
    for run in on_every_backend("[contact]\non = 10\noff = 4", &frames) {
        let contact: Vec<bool> = run.iter().map(|p| p.contact).collect();
        assert_eq!(contact, [false, false, true, true, true, false, false, true]);
        for (p, total) in run.iter().zip(totals) {
            // Out of contact the sums are still told, and nothing that needs a touch.
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
    let refused = Engine::new(&cross(), Options { calibration, ..Options::default() }).err().unwrap().to_string();
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
            let scene = Scene { outputs: Outputs::TOUCHES | Outputs::CENTROID, ..Scene::default() };
            let mut engine = Engine::new(&cross(), Options { backend, scene, ..Options::default() }).unwrap();
            let mut seen: Vec<Vec<Touch>> = Vec::new();
            let mut several = Vec::new();
            for part in frames.chunks(cut) {
                let (percepts, agreement) = engine.process_and_compare(part).unwrap();
                assert!(agreement.holds(), "{backend:?}: {agreement}");
                seen.extend((0..part.len()).map(|frame| percepts.touches(frame, 0).to_vec()));
                several.extend((0..part.len()).map(|frame| percepts.get(frame, 0).flags.contains(Flags::SEVERAL)));
            }
            let told = |touches: &[Touch]| -> Vec<(u64, f64, u32, f64)> {
                touches.iter().map(|t| (t.id, t.total, t.active, t.centroid.unwrap()[0])).collect()
            };
            assert_eq!(told(&seen[0]), [(1, 4.0, 2, -3.5), (2, 6.0, 1, 4.0)]);
            assert_eq!(told(&seen[1]), [(1, 4.0, 1, -3.0), (2, 6.0, 1, 3.0)]);
            assert_eq!(told(&seen[2]), [(2, 6.0, 1, 3.0)]);
            assert!(seen[3].is_empty());
            assert_eq!(told(&seen[4]), [(3, 6.0, 1, 3.0)]);
            assert_eq!(several, [true, true, false, false, false]);
            assert_eq!(seen[0][1].position, [4.0, 0.0, 0.0]);
        }
        let mut usual = Engine::new(&cross(), Options { backend, ..Options::default() }).unwrap();
        let percepts = usual.process(&frames).unwrap();
        assert!(percepts.touches(0, 0).is_empty() && !percepts.get(0, 0).flags.contains(Flags::SEVERAL));
    }
}
