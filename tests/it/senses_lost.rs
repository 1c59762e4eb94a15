//! Values that are lost: what is not known is absent, and what comes back goes on.

use somatic::body::Modality::{Force3, Pressure, Proximity};
use somatic::internal::scene::SensedTaxels;
use somatic::internal::signal::Reading;
use somatic::{BackendKind, Flags, Outputs, RawValue, Receptor, Scene};

use crate::common::backends;
use crate::senses::engine;
use crate::senses_extremes::{frame_with, number, of, percepts_of, row};

#[test]
fn a_force_is_absent_where_no_taxel_has_a_value() {
    for kind in backends() {
        let scene = Scene::default().outputs(Outputs::TOTAL | Outputs::FORCE);
        let mut engine = engine(&row(&[Pressure, Force3, Pressure]), kind, scene);
        let all = |value: RawValue| [("0", value), ("1", value), ("2", value)];
        let cases = [
            (all(RawValue::MISSING), None, Flags::INCOMPLETE),
            (all(number(f64::NAN)), None, Flags::FAULTY_INPUT),
            ([("0", number(0.0)), ("1", RawValue::MISSING), ("2", number(f64::NAN))], Some(0.0), Flags::INCOMPLETE),
            (all(number(0.0)), Some(0.0), Flags::NO_CONTACT),
            (all(number(2.0)), Some(6.0), Flags::empty()),
        ];
        for (index, (values, force, flag)) in cases.into_iter().enumerate() {
            let frame = frame_with(&engine, 0.1 * index as f64, &values);
            let percepts = percepts_of(&frame, &mut engine);
            let pressed = of(&engine, &percepts, Receptor::Sustained);
            assert_eq!(pressed.force, force, "{kind}, case {index}: {pressed:?}");
            assert!(pressed.flags.contains(flag), "{kind}, case {index}: {pressed:?}");
        }
    }
}

#[test]
fn what_comes_near_goes_on_coming_when_its_taxel_has_no_value_for_a_frame() {
    let mut engine = engine(&row(&[Proximity, Proximity]), BackendKind::Reference, Scene::default());
    let mut at = |frame: u32, near: Option<f64>, far_mm: f64| {
        let near = near.map_or(RawValue::MISSING, number);
        let frame = frame_with(&engine, 0.02 * f64::from(frame), &[("0", near), ("1", number(far_mm))]);
        percepts_of(&frame, &mut engine)[0]
    };
    // It comes at 0.1 m/s; the other taxel sees nothing within 80 mm.
    let coming = |frame: u32| Some(75.0 - 2.0 * f64::from(frame));
    for frame in 0..20 {
        at(frame, coming(frame), 200.0);
    }
    let lost = at(20, None, 200.0);
    assert!(lost.nearest.is_none() && lost.approach_speed.is_none() && lost.flags.contains(Flags::INCOMPLETE));
    let back = at(21, coming(21), 200.0);
    assert!((back.approach_speed.unwrap() - 0.1).abs() < 1e-5, "{back:?}");
    // Where it reads that nothing is near, what was there has gone.
    assert!(at(22, Some(200.0), 200.0).flags.contains(Flags::OUT_OF_RANGE));
    let other = at(23, coming(23), 200.0);
    assert!(other.approach_speed.is_none() && other.flags.contains(Flags::NO_PREVIOUS), "{other:?}");
}

#[test]
fn a_taxel_whose_normal_value_is_lost_is_not_told_to_pull_nothing() {
    let body = row(&[Force3, Force3]);
    let mut engine = engine(&body, BackendKind::Reference, Scene::default());
    let sensed = SensedTaxels::new(engine.plan(), &body);
    let mut reading_of = |normal: RawValue, along: f64| {
        let frame = frame_with(&engine, 0.0, &[("0", normal), ("0.u", number(along)), ("1", number(1.0))]);
        let mut read = Vec::new();
        engine.process_one(&frame).unwrap();
        engine.sensed(&frame, &sensed, &mut read);
        read[0].reading
    };
    assert_eq!(reading_of(number(2.0), -0.5), Reading::Value(0.5, true));
    assert_eq!(reading_of(number(0.0), -0.5), Reading::Value(0.0, true), "nothing presses");
    assert_eq!(reading_of(RawValue::MISSING, -0.5), Reading::Missing);
    assert_eq!(reading_of(number(f64::NAN), -0.5), Reading::Faulty);
    assert_eq!(reading_of(number(2.0), f64::NAN), Reading::Faulty);
}
