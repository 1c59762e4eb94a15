//! A gate changes what is computed and nothing of what comes out.

use proptest::prelude::*;
use somatic::scene::{Coverage, Knobs};
use somatic::{BackendKind, Body, Calibration, Engine, Frame, Options, Outputs, RawValue, Scene};

use crate::common::Flat;

fn engine(coverage: Coverage, calibration: Option<&str>) -> Engine {
    let body = Body::from_bytes("humanoid", somatic::bundled::HUMANOID).unwrap();
    let ids: Vec<u32> = body.taxels.iter().map(|taxel| taxel.id).collect();
    let calibration = calibration.map(|text| Calibration::parse(text, &ids).unwrap());
    let scene = Scene::default().outputs(Outputs::all()).knobs(Knobs::default().coverage(coverage));
    Engine::new(&body, Options::default().scene(scene).calibration(calibration).backend(BackendKind::Cpu)).unwrap()
}

/// All that a call gives, to the last bit: numbers are written with as many digits as tell them apart.
fn bits(engine: &mut Engine, frame: &Frame) -> Vec<String> {
    let percepts = engine.process(std::slice::from_ref(frame)).unwrap();
    let of_fields = percepts.frame(0).map(|percept| format!("{percept:?}"));
    of_fields.chain([format!("{:?}", percepts.touches(0))]).collect()
}

/// A step of a skin's life: from which taxel on how many change, and to what.
fn steps() -> impl Strategy<Value = Vec<(usize, usize, f64)>> {
    let value = prop_oneof![
        4 => 1.0..900.0,
        2 => Just(0.0),
        1 => Just(-0.0),
        1 => Just(3.0),
        1 => Just(f64::NAN),
        1 => Just(f64::INFINITY),
        1 => Just(2e3),
    ];
    prop::collection::vec((0..960_usize, prop_oneof![Just(0), 1..20_usize, Just(960)], value), 1..40)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(if cfg!(debug_assertions) { 12 } else { 60 }))]

    #[test]
    fn percepts_behind_a_gate_are_the_same_bits(steps in steps(), calibrated in any::<bool>()) {
        let text = "[all]\ndead_band = 5.0\np_max = 800.0\n[contact]\non = 20.0\noff = 10.0\n";
        let calibration = calibrated.then_some(text);
        let mut whole = engine(Coverage::All, calibration);
        let mut gated = engine(Coverage::Touched, calibration);
        let mut frame = whole.frame(0.0);
        frame.values.fill(RawValue::new(0.0));
        for (turn, (from, count, value)) in steps.into_iter().enumerate() {
            frame.t_s = turn as f64 * 0.01;
            let to = frame.values.len().min(from + count);
            for (index, at) in frame.values[from.min(to)..to].iter_mut().enumerate() {
                *at = RawValue::new(value + index as f64);
            }
            let right = bits(&mut whole, &frame);
            prop_assert_eq!(&right, &bits(&mut gated, &frame));
        }
    }
}

#[test]
fn a_gate_that_steps_aside_and_comes_back_changes_nothing() {
    // Wholly touched for long enough that it steps aside, then idle, then touched in one place.
    let mut engines = [Coverage::All, Coverage::Auto, Coverage::Touched].map(large);
    let mut frame = engines[0].frame(0.0);
    for turn in 0..200_usize {
        frame.t_s = turn as f64 * 0.01;
        for (index, value) in frame.values.iter_mut().enumerate() {
            let pressed = match turn {
                0..80 => (index * 7 + turn * 131) % 977,
                80..150 => 0,
                _ => {
                    if index < 100 {
                        index + turn
                    } else {
                        0
                    }
                }
            };
            *value = RawValue::new(pressed as f64);
        }
        let [whole, others @ ..] = &mut engines;
        let right = bits(whole, &frame);
        for other in others {
            assert!(bits(other, &frame) == right, "frame {turn}");
        }
    }
}

/// Enough taxels for a gate to pay: a sheet of 80 × 80 in patches, and one field of them all.
fn large(coverage: Coverage) -> Engine {
    let places: Vec<[f64; 2]> = (0..6400).map(|id| [f64::from(id % 80) * 0.01, f64::from(id / 80) * 0.01]).collect();
    let mut skin = Flat::new(&places).field("whole", None, 0..6400);
    for patch in 0..400 {
        skin = skin.field(&format!("patch {patch}"), Some("whole"), patch * 16..(patch + 1) * 16);
    }
    let scene = Scene::default().outputs(Outputs::USUAL_AND_MOTION).knobs(Knobs::default().coverage(coverage));
    let options = Options::default().scene(scene).backend(BackendKind::Cpu);
    Engine::new(&skin.body(), options).unwrap()
}
