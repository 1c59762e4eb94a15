//! What adds up only over a long time or a wide range: a million frames, every angle, every size of pressure.

use std::f64::consts::{PI, TAU};

use glam::DVec2;
use somatic::{BackendKind, Body, Engine, Flags, Frame, Options, Outputs, Percept, Scene};

use crate::common::{Flat, backends, frame};

/// Unit roundoff of single precision.
const U: f64 = 1.0 / 16_777_216.0;

/// What the arctangent of both single-precision backends may lose, rad.
const ATAN2: f64 = 16.0 * U;

/// How far apart two angles of lines are.
fn between_lines(a: f64, b: f64) -> f64 {
    let apart = (a - b).rem_euclid(PI);
    apart.min(PI - apart)
}

/// Eight taxels on a circle of 40 mm, and one in its middle.
fn ring() -> Body {
    let on = |i: u32| [0.04 * (f64::from(i) / 8.0 * TAU).cos(), 0.04 * (f64::from(i) / 8.0 * TAU).sin()];
    let uv: Vec<[f64; 2]> = (0..8).map(on).chain([[0.0; 2]]).collect();
    Flat::new(&uv).field("ring", None, 0..9).body()
}

/// A finger that goes round that circle, at `angle`.
fn going_round(t_s: f64, angle: f64) -> Frame {
    let on = |i: u32| 100.0 * (2.0 + (angle - f64::from(i) / 8.0 * TAU).cos());
    let values: Vec<f64> = (0..8).map(on).chain([150.0]).collect();
    frame(t_s, &values)
}

/// Frames of a round, a prime, so that no call and no block of frames falls in with it.
const ROUND: usize = 977;

/// The same round, for `frames` frames. Times are whole numbers of 1/128 s: their differences are exact however late it is.
fn rounds(frames: usize) -> impl Iterator<Item = Frame> {
    (0..frames).map(|n| going_round(n as f64 / 128.0, (n % ROUND) as f64 / ROUND as f64 * TAU))
}

fn engine(body: &Body, backend: BackendKind, outputs: Outputs) -> Engine {
    // Filtered motion by its window: what it holds back is known.
    let filter = somatic::scene::MotionFilter::default().over_s(None);
    let scene = Scene::default().outputs(outputs).filter(filter);
    Engine::new(body, Options::default().backend(backend).scene(scene).batch(1024)).unwrap()
}

#[test]
fn a_million_frames_leave_no_trace() {
    const FRAMES: usize = 1_000_000;
    let moving = Outputs::CENTROID | Outputs::DISPLACEMENT | Outputs::DIRECTION | Outputs::DISTANCE | Outputs::SPEED;
    let body = ring();
    for backend in backends() {
        let mut engine = engine(&body, backend, moving | Outputs::FILTERED_DISPLACEMENT);
        let mut frames = rounds(FRAMES);
        let mut second_round: Vec<Percept> = Vec::with_capacity(ROUND);
        let (mut way, mut filtered_way) = (DVec2::ZERO, DVec2::ZERO);
        let (mut length, mut filtered_length) = (0.0, 0.0);
        let mut begin = None;
        let mut done = 0;
        while done < FRAMES {
            let call: Vec<Frame> = frames.by_ref().take(1024).collect();
            let percepts = engine.process(&call).unwrap();
            for row in 0..call.len() {
                let mut percept = percepts.get(row, 0);
                let centroid = DVec2::from_array(percept.centroid.unwrap());
                let start = *begin.get_or_insert(centroid);
                let add = |step: Option<[f64; 2]>, way: &mut DVec2, length: &mut f64| {
                    let step = DVec2::from_array(step.unwrap_or_default());
                    *way += step;
                    *length += step.length();
                };
                add(percept.displacement, &mut way, &mut length);
                add(percept.filtered_displacement, &mut filtered_way, &mut filtered_length);
                // Steps are differences of the very centroids that are given, rounded once: they telescope.
                let rounding = |length: f64| 1.1 * U * length + 1e-12;
                assert!((way - (centroid - start)).length() <= rounding(length), "{backend:?}: frame {done}");
                // What the filter holds back is less than the least that it lets pass, a sixteenth of the spacing.
                let held = (filtered_way - (centroid - start)).length();
                assert!(held <= 0.04 / 16.0 + rounding(filtered_length), "{backend:?}: frame {done}: {held}");
                // Where the filter's steps fall does hang on where the round began.
                percept.filtered_displacement = None;
                percept.flags -= Flags::HELD;
                match done {
                    n if n < ROUND => {}
                    n if n < 2 * ROUND => second_round.push(percept),
                    n => assert_eq!(percept, second_round[n % ROUND], "{backend:?}: frame {n}"),
                }
                done += 1;
            }
        }
        assert!(length > 50.0 && filtered_length > 50.0, "{backend:?}: it went nowhere");
    }
}

#[test]
fn an_axis_goes_through_the_seam_without_a_jump() {
    const STEPS: usize = 20_000;
    let body = ring();
    // cos² about θ: the second moments of the eight have their axis at θ, exactly, and an anisotropy of a half.
    let frames: Vec<Frame> = (0..=STEPS)
        .map(|n| {
            let theta = n as f64 / STEPS as f64 * TAU;
            let on = |i: u32| 1000.0 * (theta - f64::from(i) / 8.0 * TAU).cos().powi(2);
            let values: Vec<f64> = (0..8).map(on).chain([0.0]).collect();
            frame(n as f64, &values)
        })
        .collect();
    for backend in backends() {
        let mut engine = engine(&body, backend, Outputs::CENTROID | Outputs::PRINCIPAL_AXIS | Outputs::ANISOTROPY);
        let (percepts, agreement) = engine.process_and_compare(&frames).unwrap();
        assert!(agreement.holds(), "{backend:?}: {agreement}");
        let axes: Vec<f64> = (0..frames.len()).map(|n| percepts.get(n, 0).principal_axis.unwrap()).collect();
        let mut turns = 0;
        for (n, pair) in axes.windows(2).enumerate() {
            let theta = n as f64 / STEPS as f64 * TAU;
            assert!((0.0..PI).contains(&pair[0]) && pair[0].is_sign_positive(), "{backend:?}: {}", pair[0]);
            // Places and pressures are rounded to single precision, some dozen times u together.
            assert!(between_lines(pair[0], theta) < 20.0 * U + ATAN2, "{backend:?}: {} at {theta}", pair[0]);
            turns += usize::from(pair[0] - pair[1] > 0.5 * PI);
            assert!(pair[1] - pair[0] < 0.5 * PI, "{backend:?}: it went back through the seam at {theta}");
        }
        assert_eq!(turns, 2, "{backend:?}");
    }
}

#[test]
fn a_rod_at_any_angle_has_it() {
    // Every 2⁻⁸ of a half turn, and ever closer to the seam from both sides.
    let near_the_seam = (1..150).map(|k| 2.0_f64.powi(-k)).flat_map(|near| [near, -near, PI - near, PI + near]);
    let angles: Vec<f64> = (0..512).map(|k| f64::from(k) / 256.0 * PI).chain(near_the_seam).collect();
    let ends = |angle: f64| [-1.0, -0.3, 0.6, 1.0].map(|r| [0.01 * r * angle.cos(), 0.01 * r * angle.sin()]);
    let uv: Vec<[f64; 2]> = angles.iter().flat_map(|&angle| ends(angle)).collect();
    let mut flat = Flat::new(&uv);
    for field in 0..angles.len() as u32 {
        flat = flat.field(&format!("rod {field:04}"), None, 4 * field..4 * field + 4);
    }
    let body = flat.body();
    let values = [3.0, 1.0, 1.0, 2.0].repeat(angles.len());
    for backend in backends() {
        let mut engine = engine(&body, backend, Outputs::CENTROID | Outputs::ORIENTATION | Outputs::PRINCIPAL_AXIS);
        let (percepts, agreement) = engine.process_and_compare(&[frame(0.0, &values)]).unwrap();
        assert!(agreement.holds(), "{backend:?}: {agreement}");
        for (field, &right) in angles.iter().enumerate() {
            let percept = percepts.get(0, field);
            for (angle, arithmetic) in [(percept.orientation, 8.0 * U), (percept.principal_axis, 40.0 * U)] {
                let angle = angle.unwrap();
                assert!((0.0..PI).contains(&angle) && angle.is_sign_positive(), "{backend:?}: {angle} for {right}");
                assert!(between_lines(angle, right) < arithmetic + ATAN2, "{backend:?}: {angle} for {right}");
            }
        }
    }
}

#[test]
fn pressures_of_every_size_are_measured_or_flagged() {
    let body = ring();
    for backend in backends() {
        let mut engine = engine(&body, backend, Outputs::USUAL_AND_MOTION - Outputs::POSITION - Outputs::NORMAL);
        for exponent in -45..=45 {
            let size = 10.0_f64.powi(exponent);
            let values = [1.0, 3.0, 0.0, 0.0, 2.0, 0.0, 0.0, 0.0, 1.0].map(|p| p * size);
            let (percepts, agreement) = engine.process_and_compare(&[frame(f64::from(exponent), &values)]).unwrap();
            assert!(agreement.holds(), "{backend:?}, 1e{exponent}: {agreement}");
            let percept = percepts.get(0, 0);
            let (smallest, largest) = (2.0_f64.powi(-60), 2.0_f64.powi(60));
            if size >= smallest && 3.0 * size <= largest {
                assert!(!percept.flags.contains(Flags::FAULTY_INPUT), "{backend:?}, 1e{exponent}: {percept:?}");
                assert_eq!((percept.contact, percept.active), (true, Some(4)), "{backend:?}, 1e{exponent}");
                let total = percept.total.unwrap();
                assert!((total / size - 7.0).abs() < 7.0 * 11.0 * U, "{backend:?}, 1e{exponent}: {total}");
            } else if 3.0 * size < smallest {
                assert_eq!(percept.flags, Flags::FAULTY_INPUT | Flags::NO_CONTACT, "{backend:?}, 1e{exponent}");
                assert_eq!((percept.total, percept.active), (Some(0.0), Some(0)), "{backend:?}, 1e{exponent}");
            } else if size > largest {
                // Nothing that was pressed is believed, and the taxels that read 0 do say so.
                assert_eq!(percept.flags, Flags::FAULTY_INPUT | Flags::NO_CONTACT, "{backend:?}, 1e{exponent}");
                assert_eq!(percept.centroid, None, "{backend:?}, 1e{exponent}");
            } else {
                assert!(percept.flags.contains(Flags::FAULTY_INPUT), "{backend:?}, 1e{exponent}: {percept:?}");
            }
            let numbers = [percept.total, percept.peak, percept.orientation, percept.principal_axis, percept.speed];
            assert!(numbers.into_iter().flatten().all(f64::is_finite), "{backend:?}, 1e{exponent}: {percept:?}");
        }
    }
}
