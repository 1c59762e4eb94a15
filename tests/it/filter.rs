//! Filtered motion over time, on every backend, each also held to the reference.

use std::f64::consts::{FRAC_PI_2, PI};

use somatic::scene::{FilterBy, MotionFilter};
use somatic::source::{CsvSource, Source as _};
use somatic::{
    Agreement, BackendKind, Body, Calibration, Engine, Flags, Frame, Options, Outputs, Percept, RawValue, Scene,
};

use crate::common::{Flat, backends, frame};

/// Taxels at (±1, 0) and (0, ±1) m, and one in the middle; ids count +u, +v, −u, −v, middle.
fn square() -> Body {
    let uv = [[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0], [0.0, 0.0]];
    Flat::new(&uv).field("field", None, 0..5).body()
}

/// A frame whose centroid is (u, v), |u| + |v| ≤ 1.
fn at(t_s: f64, u: f64, v: f64) -> Frame {
    let part = |x: f64| 64.0 * x.max(0.0);
    frame(t_s, &[part(u), part(v), part(-u), part(-v), 64.0 * (1.0 - u.abs() - v.abs())])
}

fn filter(low_m: f64, high_m: f64, time_constant_s: f64) -> MotionFilter {
    MotionFilter::default()
        .over_s(None)
        .low_m(low_m)
        .high_m(high_m)
        .by(FilterBy::Distance)
        .time_constant_s(time_constant_s)
}

/// The percepts of the one field on every backend, all at once and frame by frame, with how each compared.
fn runs(filter: MotionFilter, contact: &str, frames: &[Frame]) -> Vec<(Vec<Percept>, Agreement)> {
    let body = square();
    let calibration = Calibration::parse(contact, &[0, 1, 2, 3, 4]).unwrap();
    let mut runs = Vec::new();
    for backend in backends() {
        for cut in [1, frames.len()] {
            let scene = Scene::default().outputs(Outputs::FILTERED).max_gap_s(5.0).filter(filter);
            let calibration = Some(calibration.clone());
            let options = Options::default().backend(backend).scene(scene).calibration(calibration).batch(64);
            let mut engine = Engine::new(&body, options).unwrap();
            let (mut seen, mut sum) = (Vec::new(), Agreement::default());
            for part in frames.chunks(cut) {
                let (percepts, agreement) = engine.process_and_compare(part).unwrap();
                assert!(agreement.holds(), "{backend:?}: {agreement}");
                sum.merge(agreement);
                seen.extend((0..part.len()).map(|frame| percepts.get(frame, 0)));
            }
            runs.push((seen, sum));
        }
    }
    runs
}

fn on_every_backend(filter: MotionFilter, frames: &[Frame]) -> Vec<Vec<Percept>> {
    runs(filter, "", frames).into_iter().map(|(seen, _)| seen).collect()
}

fn near(a: Option<f64>, b: f64) -> bool {
    a.is_some_and(|a| (a - b).abs() < 1e-5)
}

#[test]
fn slow_motion_counts_in_the_end_with_all_its_way_and_time() {
    let frames: Vec<Frame> = (0..7).map(|i| at(0.5 * f64::from(i), 0.0, 0.03 * f64::from(i))).collect();
    for run in on_every_backend(filter(0.1, 0.5, 0.0), &frames) {
        assert_eq!(run[0].flags, Flags::NO_PREVIOUS);
        for percept in &run[1..4] {
            assert_eq!((percept.flags, percept.filtered_direction), (Flags::HELD, None));
        }
        let [du, dv] = run[4].filtered_displacement.unwrap();
        assert!(du == 0.0 && (dv - 0.12).abs() < 1e-6 && run[4].flags.is_empty(), "{:?}", run[4]);
        assert!(near(run[4].filtered_direction, FRAC_PI_2) && near(run[4].filtered_speed, 0.06));
        // Held back again, the direction is still known.
        assert_eq!((run[5].flags, run[5].filtered_speed, run[5].filtered_displacement), (Flags::HELD, None, None));
        assert!(near(run[5].filtered_direction, FRAC_PI_2));
        // What was not asked for is not there.
        assert!(run.iter().all(|p| p.centroid.is_none() && p.position.is_none() && p.direction.is_none()));
    }
    // Jitter never counts, however long it lasts.
    let jitter: Vec<Frame> = (0..50).map(|i| at(0.1 * f64::from(i), 0.04 * f64::from(i % 3), 0.0)).collect();
    for run in on_every_backend(filter(0.1, 0.5, 0.0), &jitter) {
        assert!(run[1..].iter().all(|p| p.flags == Flags::HELD && p.filtered_direction.is_none()));
    }
}

#[test]
fn frames_that_were_dropped_count_with_their_time() {
    let frames = [at(0.0, 0.0, 0.0), at(0.1, 0.05, 0.0), at(2.5, 0.25, 0.0)];
    for run in on_every_backend(filter(0.1, 0.5, 0.0), &frames) {
        assert!(near(run[2].filtered_speed, 0.1), "{:?}", run[2]);
    }
}

#[test]
fn the_papers_measure_sees_nothing_around_the_origin() {
    let quarter = |i: u32| [[0.8, 0.0], [0.0, 0.8], [-0.8, 0.0], [0.0, -0.8]][i as usize % 4];
    let frames: Vec<Frame> = (0..6).map(|i| at(0.1 * f64::from(i), quarter(i)[0], quarter(i)[1])).collect();
    for run in on_every_backend(filter(0.1, 1.5, 0.0), &frames) {
        assert!(run[1..].iter().all(|p| p.filtered_displacement.is_some()));
        assert!(near(run[1].filtered_direction, 3.0 * PI / 4.0) && near(run[2].filtered_direction, -3.0 * PI / 4.0));
    }
    let radial = filter(0.1, 1.5, 0.0).by(FilterBy::Radial);
    for run in on_every_backend(radial, &frames) {
        assert!(run[1..].iter().all(|p| p.flags == Flags::HELD && p.filtered_direction.is_none()));
    }
    // Towards the origin counts as much as away from it; to the other side, as far out, does not.
    for run in on_every_backend(radial, &[at(0.0, 0.8, 0.0), at(0.1, 0.4, 0.0), at(0.2, -0.4, 0.0)]) {
        assert!(near(run[1].filtered_direction, PI) && run[2].flags == Flags::HELD, "{run:?}");
    }
}

#[test]
fn the_seam_is_nowhere_and_minus_pi_never() {
    // To −u with a little up and down: averaged, it is ±π and never 0.
    let frames: Vec<Frame> =
        (0..12).map(|i| at(0.1 * f64::from(i), 0.6 - 0.1 * f64::from(i), 0.01 * f64::from(i % 2))).collect();
    for run in on_every_backend(filter(0.05, 0.5, 0.3), &frames) {
        assert!(run[1..].iter().all(|p| p.filtered_direction.is_some_and(|d| d.abs() > 3.0 && d > -PI)));
    }
    for run in on_every_backend(filter(0.05, 0.5, 0.0), &[at(0.0, 0.5, 0.0), at(0.1, 0.0, 0.0)]) {
        assert!(run[1].filtered_direction.is_some_and(|d| d > PI - 1e-6));
    }
}

#[test]
fn contact_that_ends_and_a_jump_start_anew() {
    let off = |t_s| frame(t_s, &[0.0; 5]);
    let frames = [
        at(0.0, 0.0, 0.0),
        at(0.1, 0.2, 0.0),
        off(0.2),
        at(0.3, 0.2, 0.3),
        at(0.4, 0.2, 0.5),
        at(0.5, -0.5, 0.2),
        at(0.6, -0.3, 0.2),
    ];
    for run in on_every_backend(filter(0.1, 0.5, 1.0), &frames) {
        assert!(near(run[1].filtered_direction, 0.0));
        assert_eq!((run[2].flags, run[2].filtered_direction), (Flags::NO_CONTACT, None));
        assert_eq!((run[3].flags, run[3].filtered_direction), (Flags::NO_PREVIOUS, None));
        assert!(near(run[4].filtered_direction, FRAC_PI_2), "nothing is left of the contact before: {:?}", run[4]);
        assert_eq!((run[5].flags, run[5].filtered_direction), (Flags::JUMPED, None));
        assert!(near(run[6].filtered_direction, 0.0) && near(run[6].filtered_speed, 2.0));
    }
}

#[test]
fn a_clock_that_jumps_is_in_no_speed() {
    let times = [0.0, 0.1, 0.1, 0.2, -3.0, -2.9, 7200.0, 7200.1];
    let frames: Vec<Frame> = times.iter().zip(0..).map(|(&t, i)| at(t, 0.8 - 0.2 * f64::from(i), 0.0)).collect();
    for run in on_every_backend(filter(0.1, 0.5, 1.0), &frames) {
        assert!(near(run[1].filtered_speed, 2.0));
        // The same time twice: nothing counts, what is known stays, and the next frame counts both ways.
        assert_eq!((run[2].flags, run[2].filtered_displacement), (Flags::BAD_DT, None));
        assert!(run[2].filtered_direction.is_some() && near(run[3].filtered_speed, 4.0));
        for index in [4, 6] {
            assert_eq!((run[index].flags, run[index].filtered_direction), (Flags::BAD_DT, None), "{index}");
            assert!(run[index + 1].filtered_speed.is_some_and(|s| (s - 2.0).abs() < 1e-3), "{index}");
        }
    }
}

#[test]
fn a_field_of_one_taxel_and_one_without_a_chart_have_no_filtered_motion() {
    let one = Flat::new(&[[0.1, 0.2]]).field("one", None, 0..1).body();
    for backend in backends() {
        let scene = Scene::default().outputs(Outputs::all());
        let mut engine = Engine::new(&one, Options::default().backend(backend).scene(scene)).unwrap();
        let frames = [frame(0.0, &[1.0]), frame(0.1, &[3.0]), frame(0.2, &[0.7])];
        let (percepts, agreement) = engine.process_and_compare(&frames).unwrap();
        assert!(agreement.holds(), "{agreement}");
        for index in 1..3 {
            let percept = percepts.get(index, 0);
            assert!(
                percept.flags.intersects(Flags::HELD | Flags::STILL) && percept.filtered_direction.is_none(),
                "{percept:?}"
            );
        }
    }
    // The humanoid's whole body wraps around: no chart, so no motion, and it says so.
    let body = Body::from_bytes("humanoid", somatic::bundled::HUMANOID).unwrap();
    for backend in backends() {
        let scene = Scene::default().outputs(Outputs::FILTERED);
        let mut engine = Engine::new(&body, Options::default().backend(backend).scene(scene)).unwrap();
        let mut pressed = engine.frame(0.0);
        pressed.values.fill(RawValue::new(5.0));
        let later = Frame { t_s: 0.1, ..pressed.clone() };
        let percepts = engine.process(&[pressed, later]).unwrap();
        let chartless: Vec<Percept> = percepts.frame(1).filter(|p| p.flags.contains(Flags::NO_CHART)).collect();
        assert!(!chartless.is_empty());
        assert!(chartless.iter().all(|p| p.filtered_direction.is_none() && !p.flags.contains(Flags::HELD)));
    }
}

#[test]
fn a_choice_too_close_to_call_is_counted_and_the_comparison_goes_on_after_it() {
    // A third is no binary fraction: on the very end of the window, f32 may take it either way.
    let low = 1.0 / 3.0;
    let step = |t_s: f64, part: f64| frame(t_s, &[part, 0.0, 0.0, 0.0, 3.0 - part]);
    let mut frames = vec![step(0.0, 0.0), step(0.1, 1.0), step(0.2, 2.5), frame(0.3, &[0.0; 5])];
    frames.extend([step(0.4, 0.0), step(0.5, 2.0)]);
    for (run, agreement) in runs(filter(low, 3.0, 0.1), "", &frames) {
        // The one choice; the step after it is from where the backend's own filter was then.
        assert_eq!(agreement.quantities["flags"].too_close, 1, "{agreement}");
        let direction = agreement.quantities["filtered_direction"];
        assert_eq!((direction.compared, direction.agreeing), (2, 2), "{agreement}");
        assert!(near(run[5].filtered_direction, 0.0));
    }
    // Clear of the end nothing is in doubt.
    for (_, agreement) in runs(filter(0.3, 3.0, 0.1), "", &frames) {
        let close = agreement.quantities["flags"].too_close;
        assert_eq!((close, agreement.quantities["filtered_direction"].compared), (0, 3));
    }
}

#[test]
fn over_a_time_motion_is_the_mean_of_that_time_on_every_backend_however_it_is_cut() {
    // Steps of 0.01 and 0.05 m in turn, which frame by frame are 0.1 and 0.5 m/s; then nothing, and a touch elsewhere.
    let mut frames: Vec<Frame> =
        (0..12).map(|n| at(0.1 * f64::from(n), 0.03 * f64::from(n) - 0.01 * f64::from(n % 2), 0.0)).collect();
    frames.push(frame(1.2, &[0.0; 5]));
    frames.extend((13..20).map(|n| at(0.1 * f64::from(n), 0.0, 0.02 * f64::from(n - 13))));
    let over = MotionFilter::default().high_m(1.0).over_s(0.4);
    for (run, agreement) in runs(over, "", &frames) {
        assert!(agreement.quantities["filtered_speed"].compared >= 11, "{agreement}");
        for (index, percept) in run.iter().enumerate() {
            match index {
                0 | 13 => assert_eq!((percept.flags, percept.filtered_speed), (Flags::NO_PREVIOUS, None)),
                12 => assert!(!percept.contact),
                1..4 | 14..17 => {
                    assert_eq!((percept.flags, percept.filtered_direction), (Flags::HELD, None), "{index}");
                }
                4..12 => {
                    assert!(near(percept.filtered_speed, 0.3) && near(percept.filtered_direction, 0.0), "{percept:?}");
                }
                _ => assert!(near(percept.filtered_speed, 0.2) && near(percept.filtered_direction, FRAC_PI_2)),
            }
        }
    }
}

#[test]
fn doubt_about_contact_is_doubt_about_the_filter_in_that_frame_alone() {
    // 0.1 + 0.2 is over 0.3 in one precision and not in the other; 64 is far above.
    let frames = [
        frame(0.0, &[0.1, 0.2, 0.0, 0.0, 0.0]),
        at(0.1, 0.2, 0.0),
        at(0.2, 0.5, 0.0),
        frame(0.3, &[0.0; 5]),
        at(0.4, 0.2, 0.0),
        at(0.5, 0.5, 0.0),
    ];
    for (run, agreement) in runs(filter(0.1, 0.9, 0.0), "[contact]\non = 0.3\noff = 0.3", &frames) {
        assert_eq!(agreement.quantities["flags"].too_close, 1, "{agreement}");
        let speed = agreement.quantities["filtered_speed"];
        assert!(speed.compared >= 2 && speed.too_close == 0, "{agreement}");
        assert!(near(run[5].filtered_speed, 3.0));
    }
}

#[test]
fn over_the_bundled_touch_every_backend_agrees_and_few_choices_are_close() {
    let body = Body::from_bytes("hand", somatic::bundled::HAND).unwrap();
    let mut source = CsvSource::from_reader("touch", somatic::bundled::TOUCH, None, None).unwrap();
    let mut frames = Vec::new();
    let mut frame = Frame::missing(0.0, source.taxels().len());
    while source.next_frame(&mut frame).unwrap() {
        frames.push(frame.clone());
    }
    for backend in backends() {
        let scene = Scene::default().outputs(Outputs::all());
        let mut engine = Engine::new(&body, Options::default().backend(backend).scene(scene).batch(64)).unwrap();
        engine.set_channels(source.taxels()).unwrap();
        let back = engine.plan().fields().position(|field| field.name == "hand/back").unwrap();
        let (percepts, agreement) = engine.process_and_compare(&frames).unwrap();
        assert!(agreement.holds(), "{backend:?}: {agreement}");
        let direction = agreement.quantities["filtered_direction"];
        assert!(direction.compared > 300 && direction.too_close == 0, "{agreement}");
        assert!(
            backend == BackendKind::Reference || direction.worst_error > 0.0,
            "one compared with itself: {agreement}"
        );
        // While the rod is in the middle of the back of the hand it rolls to the wrist, along -v.
        let middle = (135..150).map(|frame| percepts.get(frame, back));
        assert!(middle.clone().all(|p| p.filtered_direction.is_some_and(|d| (d + FRAC_PI_2).abs() < 0.3)));
        assert!(middle.filter(|p| p.filtered_speed.is_some()).count() >= 5);
    }
}
