//! What calibrations make of temperatures and distances: values beyond the ends of ranges and curves, and flags of what is asked for alone.

use somatic::body::Modality;
use somatic::{BackendKind, Body, Calibration, Engine, Flags, Options, Outputs, Percept, RawValue, Receptor, Scene};

use crate::common::backends;
use crate::senses_extremes::row;

/// What the frame that has `values` gives by `calibration` in the letter `receptor`, of `outputs` if they are given.
fn percept(
    (body, kind): (&Body, BackendKind),
    calibration: &str,
    (receptor, outputs): (Receptor, Option<Outputs>),
    values: &[(&str, f64)],
) -> Percept {
    let kinds: Vec<_> = body.taxels.iter().map(|taxel| (taxel.id, taxel.modality)).collect();
    let calibration = Calibration::parse_for(calibration, &kinds).unwrap();
    let scene = outputs.map_or(Scene::default(), |outputs| Scene::default().outputs(outputs));
    let mut engine =
        Engine::new(body, Options::default().scene(scene).calibration(Some(calibration)).backend(kind)).unwrap();
    let mut frame = engine.frame(0.0);
    for &(name, value) in values {
        frame.values[engine.index_of(name).unwrap()] = RawValue::new(value);
    }
    let (percepts, agreement) = engine.process_and_compare(std::slice::from_ref(&frame)).unwrap();
    assert!(agreement.holds(), "{agreement}");
    let all: Vec<Percept> = percepts.frame(0).collect();
    let letters = engine.plan().letters();
    *all.iter().find(|percept| letters[percept.letter].receptor == receptor).unwrap()
}

const ENDS: Flags = Flags::OUT_OF_RANGE.union(Flags::SATURATED).union(Flags::FAULTY_INPUT);

#[test]
fn what_is_beyond_the_raw_range_of_a_distance_is_kept_and_said_and_what_is_far_is_neither() {
    let body = row(&[Modality::Proximity; 3]);
    let of = |calibration: &str, raw: [f64; 3]| {
        let values = [("0", raw[0]), ("1", raw[1]), ("2", raw[2])];
        let felt = backends()
            .into_iter()
            .map(|kind| percept((&body, kind), calibration, (Receptor::Proximity, None), &values));
        let all: Vec<_> = felt.map(|felt| (felt.covered, felt.nearest_taxel, felt.flags & ENDS)).collect();
        assert!(all.iter().all(|felt| *felt == all[0]), "{all:?}");
        all[0]
    };
    let text = "[proximity]\nraw_range = [10, 800]\nrange = 100\n";
    assert_eq!(of(text, [500.0, 5.0, 50.0]), (Some(2), Some(1), Flags::OUT_OF_RANGE));
    assert_eq!(of(text, [500.0, 60.0, 50.0]), (Some(2), Some(2), Flags::empty()));
    // Beyond both: nothing is near, and the value is not one of the sensor's.
    assert_eq!(of(text, [900.0, 60.0, 50.0]), (Some(2), Some(2), Flags::OUT_OF_RANGE));
    assert_eq!(
        of("[proximity]\nraw_range = [10, 800]\n", [900.0, 60.0, 50.0]),
        (Some(3), Some(2), Flags::OUT_OF_RANGE)
    );
    assert_eq!(of(text, [500.0, 600.0, 700.0]), (Some(0), None, Flags::OUT_OF_RANGE));
}

#[test]
fn beyond_the_far_end_of_a_curve_nothing_is_near_and_beyond_the_near_one_it_is_held() {
    let body = row(&[Modality::Proximity; 3]);
    let of = |keys: &str, curve: &str, raw: [f64; 3]| {
        let text = format!("[curve.infrared]\n{curve}\n[proximity]\ncurve = \"infrared\"\n{keys}");
        let values = [("0", raw[0]), ("1", raw[1]), ("2", raw[2])];
        let felt =
            backends().into_iter().map(|kind| percept((&body, kind), &text, (Receptor::Proximity, None), &values));
        let all: Vec<_> = felt.map(|felt| (felt.covered, felt.nearest, felt.flags & ENDS)).collect();
        assert!(all.iter().all(|felt| *felt == all[0]), "{all:?}");
        all[0]
    };
    // Readings of one grow as something comes near, of the other they fall.
    let (grows, falls) = ("raw = [100, 200, 800]\np = [100, 50, 2]", "raw = [100, 700, 800]\np = [2, 50, 100]");
    for range in ["", "range = 100\n"] {
        for (keys, curve, raw) in [
            ("", grows, [50.0, 100.0, 200.0]),
            ("", falls, [850.0, 800.0, 700.0]),
            ("invert = true\nbaseline = 900\n", falls, [50.0, 100.0, 200.0]),
        ] {
            let keys = format!("{keys}{range}");
            assert_eq!(of(&keys, curve, raw), (Some(2), Some(0.05), Flags::empty()), "{keys}{curve}");
            assert_eq!(of(&keys, curve, [raw[0]; 3]), (Some(0), None, Flags::OUT_OF_RANGE), "{keys}{curve}");
        }
        assert_eq!(of(range, grows, [50.0, 800.0, 200.0]), (Some(2), Some(0.002), Flags::empty()));
        assert_eq!(of(range, grows, [50.0, 801.0, 200.0]), (Some(2), Some(0.002), Flags::SATURATED));
        assert_eq!(of(range, falls, [99.0, 801.0, 700.0]), (Some(2), Some(0.002), Flags::SATURATED));
    }
    // An end that single precision rounds is not one that its own raw value is beyond.
    let (covered, _, flags) = of("", "raw = [0.1, 0.7]\np = [9, 3]", [0.1, 0.7, 0.1]);
    assert_eq!((covered, flags), (Some(3), Flags::empty()));
}

#[test]
fn a_temperature_beyond_a_curve_is_that_of_its_end_and_one_under_absolute_zero_is_none() {
    let body = row(&[Modality::Temperature; 2]);
    for kind in backends() {
        let of = |text: &str, raw: [f64; 2]| {
            let felt = percept((&body, kind), text, (Receptor::Temperature, None), &[("0", raw[0]), ("1", raw[1])]);
            (felt.temperature, felt.coldest, felt.flags & ENDS)
        };
        let curve = "[curve.a]\nraw = [100, 200]\np = [10, 30]\n[temperature]\ncurve = \"a\"\n";
        assert_eq!(of(curve, [50.0, 300.0]), (Some(20.0), Some(10.0), Flags::empty()));
        assert_eq!(of("", [-400.0, 20.0]), (Some(20.0), Some(20.0), Flags::FAULTY_INPUT));
        assert_eq!(of("[temperature]\nunit = \"K\"\n", [-5.0, 273.25]).2, Flags::FAULTY_INPUT);
        assert_eq!(of("", [-400.0, -300.0]), (None, None, Flags::FAULTY_INPUT));
        // So is what a masked one reads, a code that is no reading, too.
        assert_eq!(
            of("[temperature]\nmissing = [77]\n[taxel.0]\nmask = true\n", [77.0, 20.0]),
            (Some(20.0), Some(20.0), Flags::FAULTY_INPUT)
        );
    }
}

#[test]
fn flags_say_why_what_is_asked_for_is_absent_and_nothing_else() {
    let given =
        |modality: Modality, taxels: usize, (receptor, outputs): (Receptor, Outputs), values: &[(&str, f64)]| {
            let felt =
                percept((&row(&vec![modality; taxels]), BackendKind::Cpu), "", (receptor, Some(outputs)), values);
            felt.flags - Flags::INCOMPLETE
        };
    let warm = |outputs: Outputs| {
        given(Modality::Temperature, 2, (Receptor::Temperature, outputs), &[("0", 20.0), ("1", 21.0)])
    };
    assert_eq!(warm(Outputs::TEMPERATURE), Flags::empty());
    assert_eq!(warm(Outputs::TEMPERATURE | Outputs::TEMPERATURE_RATE), Flags::NO_PREVIOUS);
    assert_eq!(warm(Outputs::COLDEST | Outputs::TEMPERATURE_GRADIENT), Flags::NO_GRADIENT);
    let near =
        |outputs: Outputs| given(Modality::Proximity, 2, (Receptor::Proximity, outputs), &[("0", 20.0), ("1", 21.0)]);
    assert_eq!(near(Outputs::NEAREST), Flags::empty());
    assert_eq!(near(Outputs::NEAREST | Outputs::APPROACH_SPEED), Flags::NO_PREVIOUS);
    // Without a unit, and nothing pulls.
    let pulled = |outputs: Outputs| {
        given(Modality::Force3, 2, (Receptor::Shear, outputs), &[("0", 3.0), ("0.u", 0.0), ("0.v", 0.0)])
    };
    assert_eq!(pulled(Outputs::SHEAR), Flags::empty());
    assert_eq!(pulled(Outputs::FORCE_VECTOR), Flags::NO_UNIT);
    assert_eq!(pulled(Outputs::TORSION), Flags::ONE_TAXEL);
    assert_eq!(pulled(Outputs::SHEAR | Outputs::SHEAR_DIRECTION), Flags::STILL);
}
