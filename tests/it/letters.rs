//! Letters: what calibration makes of single sensors, on every backend.

use proptest::prelude::*;
use somatic::signal::{FsrCircuit, FsrSignal};
use somatic::{BackendKind, Body, Calibration, Engine, Flags, Frame, Letter, Options, Percept, RawValue, Scene};

use crate::common::{Flat, backends, frame};

/// `count` taxels, each with a field of its own, in their order, and one over all of them.
fn taxels(count: u32) -> Body {
    let uv: Vec<[f64; 2]> = (0..count).map(|i| [0.01 * f64::from(i), 0.013 * f64::from(i % 3)]).collect();
    let flat = (0..count).fold(Flat::new(&uv), |flat, id| flat.field(&format!("taxel_{id}"), None, [id]));
    flat.field("whole", None, 0..count).body()
}

fn parse(text: &str, count: u32) -> Calibration {
    Calibration::parse(text, &(0..count).collect::<Vec<_>>()).unwrap()
}

fn options(kind: BackendKind, calibration: &Calibration, signal: Option<FsrSignal>) -> Options {
    let scene = Scene::default().letters(vec![Letter { signal, ..Letter::default() }]);
    Options::default().scene(scene).calibration(calibration.clone()).backend(kind).batch(64)
}

/// The percepts of `frames` on `kind`, frame by frame, held to the reference.
fn run(kind: BackendKind, calibration: &Calibration, signal: Option<FsrSignal>, frames: &[Frame]) -> Vec<Vec<Percept>> {
    let body = taxels(calibration.taxels.len() as u32);
    let mut engine = Engine::new(&body, options(kind, calibration, signal)).unwrap();
    let (percepts, agreement) = engine.process_and_compare(frames).unwrap();
    assert!(agreement.holds(), "{kind:?}: {agreement}");
    (0..frames.len()).map(|frame| percepts.frame(frame).collect()).collect()
}

/// The pressure of one taxel and its flags, for each of `values`.
fn answers(kind: BackendKind, text: &str, values: &[f64]) -> Vec<(Option<f64>, Flags)> {
    let frames: Vec<Frame> = (0..).zip(values).map(|(i, &value)| frame(f64::from(i), &[value])).collect();
    run(kind, &parse(text, 1), None, &frames).iter().map(|cells| (cells[0].total, cells[0].flags)).collect()
}

const TABLE: &str = "[curve.table]\nraw = [-8, 0, 4, 64]\np = [0, 2, 10, 11.5]\n[all]\ncurve = \"table\"\n";

#[test]
fn a_table_is_read_at_knots_between_them_and_beyond_its_ends() {
    let values = [-8.0, 0.0, 4.0, 64.0, -4.0, 1.0, 3.0, 24.0, 64.5, 1e18, -9.0, -1e18];
    let right = [0.0, 2.0, 10.0, 11.5, 1.0, 4.0, 8.0, 10.5, 11.5, 11.5, 0.0, 0.0];
    let text = format!("{TABLE}raw_range = [-8, 64]\np_max = 11\n");
    for kind in backends() {
        for (index, (p, flags)) in answers(kind, &text, &values).into_iter().enumerate() {
            // All of these are exact in single precision but one in which the slope, 1/40, is not.
            let within = if values[index] == 24.0 { 1e-6 } else { 0.0 };
            let raw = values[index];
            assert!((p.unwrap() - right[index]).abs() <= within, "{kind:?} {raw}: {p:?}");
            assert_eq!(flags.contains(Flags::OUT_OF_RANGE), index >= 8, "{kind:?} {raw}");
            assert_eq!(flags.contains(Flags::SATURATED), right[index] > 11.0, "{kind:?} {raw}");
            assert_eq!(flags.contains(Flags::NO_CONTACT), right[index] == 0.0, "{kind:?} {raw}");
        }
    }
}

#[test]
fn a_table_does_not_make_sense_of_what_has_none() {
    for kind in backends() {
        for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e19, -1e30] {
            let answer = (None, Flags::FAULTY_INPUT | Flags::NO_CONTACT);
            assert_eq!(answers(kind, TABLE, &[bad]), [answer], "{kind:?} {bad}");
        }
        let tiny = answers(kind, TABLE, &[1e-30, -1e-40]);
        assert!(tiny.iter().all(|(p, flags)| *p == Some(2.0) && flags.contains(Flags::FAULTY_INPUT)), "{tiny:?}");
        let mut missing = frame(0.0, &[0.0]);
        missing.values[0] = RawValue::MISSING;
        let cell = run(kind, &parse(TABLE, 1), None, &[missing])[0][0];
        assert_eq!((cell.total, cell.flags), (None, Flags::INCOMPLETE | Flags::NO_CONTACT));
        let masked = answers(kind, &format!("{TABLE}mask = true"), &[4.0]);
        assert_eq!(masked, [(None, Flags::FAULTY_INPUT | Flags::NO_CONTACT)]);
    }
}

#[test]
fn an_inverted_sensor_may_invert_or_have_a_falling_curve() {
    let values: Vec<f64> = (0..=255).map(f64::from).collect();
    let inverted =
        "[curve.table]\nraw = [0, 16, 240]\np = [0, 1, 15]\n[all]\nbaseline = 240\ninvert = true\ncurve = \"table\"";
    let falling = "[curve.table]\nraw = [0, 224, 240]\np = [15, 1, 0]\n[all]\ncurve = \"table\"";
    let plain = "[all]\nbaseline = 240\ninvert = true\ngain = 0.0625";
    for kind in backends() {
        let one = answers(kind, inverted, &values);
        assert_eq!(one, answers(kind, falling, &values), "{kind:?}");
        // Knots on one line are that line.
        assert_eq!(one, answers(kind, plain, &values), "{kind:?}");
    }
}

#[test]
fn gain_and_baseline_move_a_table() {
    for kind in backends() {
        let text = format!("{TABLE}gain = 4\nbaseline = 100\n");
        let values = [92.0, 100.0, 104.0, 101.0, 500.0];
        let totals: Vec<f64> = answers(kind, &text, &values).into_iter().map(|(p, _)| p.unwrap()).collect();
        assert_eq!(totals, [0.0, 8.0, 40.0, 16.0, 46.0], "{kind:?}");
    }
}

const WIPERS: [u8; 4] = [5, FsrCircuit::MIDDLE_WIPER, 120, 255];

/// Four sensors of the circuit, each with its own wiper.
fn circuit() -> Calibration {
    let wipers: String = (0..).zip(WIPERS).map(|(id, wiper)| format!("[taxel.{id}]\nwiper = {wiper}\n")).collect();
    parse(&format!("[all]\nsensor = \"fsr\"\nsignal = \"raw\"\n{wipers}"), 4)
}

#[test]
fn every_reading_of_the_circuit_is_exact_in_both_signals() {
    let frames: Vec<Frame> = (0..1024).map(|n| frame(f64::from(n), &[f64::from(n); 4])).collect();
    for kind in backends() {
        for signal in [None, Some(FsrSignal::Raw), Some(FsrSignal::Linear)] {
            let cells = run(kind, &circuit(), signal, &frames);
            for (counts, cells) in (0..).zip(&cells) {
                for (cell, wiper) in cells.iter().zip(WIPERS) {
                    let sensor = FsrCircuit { wiper };
                    let right = match signal {
                        Some(FsrSignal::Linear) => sensor.linearised(counts, 10.0),
                        _ => sensor.logarithmic(counts),
                    };
                    // The reference has the circuit's own numbers, the others those next to them in single precision.
                    let right = if kind == BackendKind::Reference { right } else { f64::from(right as f32) };
                    assert_eq!(cell.total, Some(right), "{kind:?} {signal:?} {wiper} {counts}");
                }
            }
        }
    }
}

#[test]
fn both_signals_rise_with_the_force_and_the_linear_one_is_linear() {
    let forces: Vec<f64> = (0..=520).map(|i| f64::from(i) * 0.02).collect();
    let read = |force: f64| WIPERS.map(|wiper| f64::from(FsrCircuit { wiper }.counts(force)));
    let frames: Vec<Frame> = forces.iter().map(|&force| frame(force, &read(force))).collect();
    for kind in backends() {
        for signal in [FsrSignal::Raw, FsrSignal::Linear] {
            let cells = run(kind, &circuit(), Some(signal), &frames);
            for (index, wiper) in WIPERS.into_iter().enumerate() {
                let sensor = FsrCircuit { wiper };
                let signals: Vec<f64> = cells.iter().map(|cells| cells[index].total.unwrap()).collect();
                assert!(signals.windows(2).all(|pair| pair[0] <= pair[1]), "{kind:?} {signal} {wiper}");
                assert_eq!((signals[0], *signals.last().unwrap()), (0.0, 1000.0), "{kind:?} {signal} {wiper}");
                if signal == FsrSignal::Linear {
                    for (&force, got) in forces.iter().zip(&signals) {
                        // A reading stands for a step of forces, and what it says is in it; 100 a newton.
                        let [least, most] = sensor.step_newton(sensor.counts(force));
                        let step = 100.0 * (most.min(10.0) - least);
                        let off = (got - 100.0 * force.min(10.0)).abs();
                        assert!(off <= step + 1e-4, "{kind:?} wiper {wiper}: {got} at {force} N, step {step}");
                    }
                }
            }
        }
        // Negative control: the raw signal is not linear, but in the logarithm.
        let half = run(kind, &circuit(), None, &[frame(0.0, &read(5.0))])[0][1].total.unwrap();
        assert!(half > 800.0, "{half}");
    }
}

#[test]
fn readings_that_no_converter_gives_are_out_of_range_and_held() {
    let frames = [frame(0.0, &[1024.0; 4]), frame(1.0, &[-1.0; 4]), frame(2.0, &[1023.0; 4])];
    for kind in backends() {
        let cells = run(kind, &circuit(), None, &frames);
        assert_eq!((cells[0][0].total, cells[1][0].total), (Some(0.0), Some(1000.0)));
        let flags: Vec<bool> = cells.iter().map(|cells| cells[0].flags.contains(Flags::OUT_OF_RANGE)).collect();
        assert_eq!(flags, [true, true, false]);
    }
}

#[test]
fn what_cannot_be_is_refused_before_the_first_frame() {
    let refused = |text: &str, signal| {
        let options = options(BackendKind::Cpu, &parse(text, 1), signal);
        let error = Engine::new(&taxels(1), options).err().unwrap();
        (error.is_usage(), error.to_string())
    };
    let (usage, why) = refused("[all]\ngain = 2", Some(FsrSignal::Raw));
    assert!(usage && why.contains("signal `raw` is for sensors of kind `fsr`"), "{why}");
    let (_, why) = refused("body = \"hand\"", None);
    assert!(why.contains("is for body `hand`, and this is `flat`"), "{why}");
    let mut calibration = Calibration::identity(1);
    calibration.taxels[0].response = somatic::signal::Response::Curve(3);
    let why = Engine::new(&taxels(1), options(BackendKind::Cpu, &calibration, None)).err().unwrap().to_string();
    assert!(why.contains("curve 3 of 0"), "{why}");
}

/// A calibration with a table, values near and far from its knots, and whether P rises with them.
fn table() -> impl Strategy<Value = (String, Vec<f64>, bool)> {
    let step = prop_oneof![(1..40_u32).prop_map(f64::from), 0.001..3.0_f64, 1.0..1e6_f64];
    let rise = prop_oneof![Just(0.0), (0..40_u32).prop_map(f64::from), 0.001..1e3_f64];
    let steps = prop::collection::vec((step, rise), 1..30);
    let keys = (-500.0..500.0_f64, any::<bool>(), any::<bool>(), 0.001..1e3_f64, 0.0..20.0_f64);
    let places = prop::collection::vec((0..30_usize, prop_oneof![Just(0.0), -3.0..3.0_f64, -1e5..1e5_f64]), 4);
    (steps, keys, places).prop_map(|(steps, (start, falls, invert, gain, dead_band), places)| {
        let (mut raw, mut p) = (vec![start], vec![-5.0]);
        for (step, rise) in steps {
            // Knots that single precision cannot tell apart would be refused.
            let last: f64 = raw[raw.len() - 1];
            raw.push(last + step.max(1e-6 * last.abs()));
            p.push(p[p.len() - 1] + rise);
        }
        // A table without any rise would be refused.
        *p.last_mut().unwrap() += 1.0;
        if falls {
            p.reverse();
        }
        let (baseline, sign) = (start / 3.0, if invert { -1.0 } else { 1.0 });
        let values = places.iter().map(|&(knot, off)| baseline + sign * (raw[knot % raw.len()] + off)).collect();
        let text = format!(
            "[curve.table]\nraw = {raw:?}\np = {p:?}\n[all]\ncurve = \"table\"\nbaseline = {baseline}\ninvert = \
             {invert}\ngain = {gain}\ndead_band = {dead_band}\np_max = 700.0\n"
        );
        (text, values, falls == invert)
    })
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 48, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn every_backend_keeps_its_bounds_on_any_table((text, values, _) in table()) {
        let calibration = parse(&text, values.len() as u32);
        for kind in backends() {
            run(kind, &calibration, None, &[frame(0.0, &values)]);
        }
    }

    #[test]
    fn every_backend_is_monotone_on_any_table((text, values, rises) in table()) {
        let mut sorted: Vec<f64> = values.iter().map(|&value| f64::from(value as f32)).collect();
        sorted.sort_by(f64::total_cmp);
        let calibration = parse(&text, sorted.len() as u32);
        for kind in backends() {
            let cells = run(kind, &calibration, None, &[frame(0.0, &sorted)]);
            let totals: Vec<f64> = cells[0][..sorted.len()].iter().map(|cell| cell.total.unwrap()).collect();
            let in_order = |pair: &[f64]| if rises { pair[0] <= pair[1] } else { pair[0] >= pair[1] };
            prop_assert!(totals.windows(2).all(in_order), "{kind:?} {sorted:?} {totals:?}");
        }
    }
}
