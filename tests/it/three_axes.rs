//! Taxels with three axes, each with a gain, a range and shares in the others, by closed forms on every backend.

use glam::{DMat3, DVec2, DVec3};
use somatic::internal::scene::SensedTaxels;
use somatic::internal::signal::{Channel, Reading};
use somatic::percept::TouchFlags;
use somatic::signal::Unfit;
use somatic::{
    BackendKind, Body, Calibration, Engine, Flags, Frame, Options, Outputs, Percept, RawValue, Scene, TouchOutputs,
    touch,
};

use crate::common::backends;
use crate::senses::{grid, skin};

/// What the pressed taxels feel along n, t and n × t, N.
const FELT: [(u32, [f64; 3]); 3] = [(11, [1.0, 0.2, -0.1]), (12, [2.0, -0.3, 0.4]), (13, [1.5, 0.1, 0.3])];
/// Gains along the three.
const GAINS: [f64; 3] = [0.01, 0.02, 0.005];
/// Raw values at rest.
const REST: [f64; 3] = [100.0, 500.0, 600.0];
/// What of what is measured along n, u and v is in each.
const CROSS: [[f64; 3]; 3] = [[1.05, 0.08, -0.05], [0.04, 0.98, 0.1], [-0.03, 0.07, 1.02]];
const OF_AXES: &str = "[all]\nunit = \"N\"\nbaseline = 100\ngain = 0.01\ndead_band = 0.1\nnoise = 0.5\n[shear]\nbaseline = [500, 600]\ngain = [0.02, 0.005]\n\
                       noise = 2\n";

fn engine(body: &Body, kind: BackendKind, text: &str, tare: bool) -> Engine {
    let kinds: Vec<_> = body.taxels.iter().map(|taxel| (taxel.id, taxel.modality)).collect();
    let calibration = Calibration::parse_for(text, &kinds).unwrap();
    let outputs = TouchOutputs::USUAL | TouchOutputs::FRICTION_SIGMA;
    let scene = Scene::default()
        .outputs(Outputs::USUAL | Outputs::SHEAR | Outputs::FRICTION | Outputs::TOTAL_SIGMA | Outputs::FRICTION_SIGMA)
        .touches(touch::Options { outputs, ..touch::Options::default() });
    let options = Options::default().scene(scene).calibration(Some(calibration)).backend(kind).tare(tare);
    Engine::new(body, options).unwrap()
}

fn with_matrix(rows: &[[f64; 3]]) -> String {
    format!("{OF_AXES}cross_axis = {rows:?}\n")
}

fn measured(felt: [f64; 3]) -> DVec3 {
    let rows = DMat3::from_cols_array_2d(&CROSS).transpose();
    rows.inverse() * DVec3::from_array(felt)
}

/// A frame in which taxels measure `felt`, by the places of their values, and others are at rest.
fn frame(engine: &Engine, t_s: f64, felt: &[(u32, DVec3)]) -> Frame {
    let mut frame = engine.frame(t_s);
    for (id, _) in grid() {
        let own = felt.iter().find(|(taxel, _)| *taxel == id).map_or(DVec3::ZERO, |(_, felt)| *felt);
        for (axis, name) in ["", ".u", ".v"].into_iter().enumerate() {
            let raw = REST[axis] + own[axis] / GAINS[axis];
            frame.values[engine.index_of(&format!("{id}{name}")).unwrap()] = RawValue::new(raw);
        }
    }
    frame
}

fn percepts(engine: &mut Engine, frame: &Frame) -> Vec<Percept> {
    let (percepts, agreement) = engine.process_and_compare(std::slice::from_ref(frame)).unwrap();
    assert!(agreement.holds(), "{agreement}");
    percepts.frame(0).collect()
}

fn near(a: Option<f64>, b: f64, within: f64) {
    assert!(a.is_some_and(|a| (a - b).abs() < within), "{a:?} is not {b}");
}

/// Σ of what is felt along the axes.
fn sum() -> DVec3 {
    FELT.iter().map(|(_, felt)| DVec3::from_array(*felt)).sum()
}

#[test]
fn each_axis_has_its_gain_and_what_others_put_into_it_is_taken_out() {
    let body = skin(1);
    for kind in backends() {
        let mut engine = engine(&body, kind, &with_matrix(&CROSS), false);
        let felt = FELT.map(|(id, felt)| (id, measured(felt)));
        let pulled = frame(&engine, 0.0, &felt);
        let [pressure, shear] = percepts(&mut engine, &pulled)[..] else { panic!("two letters") };
        near(pressure.total, sum().x, 1e-5);
        near(pressure.peak, 2.0, 1e-5);
        // t is the chart's +v and n × t its −u.
        let along = shear.shear.unwrap();
        near(Some(along[0]), -sum().z, 1e-6);
        near(Some(along[1]), sum().y, 1e-6);
        near(shear.friction, sum().y.hypot(sum().z) / sum().x, 1e-6);
        let touch = &engine.percepts().touches(0).unwrap().touches[0];
        near(touch.friction, shear.friction.unwrap(), 1e-6);
        near(Some(touch.total), sum().x, 1e-5);
        // Of frames by themselves, as pages look at them.
        let (mut seen, other) = (Vec::new(), frame(&engine, 0.1, &felt));
        engine.pressures(&other, &mut seen);
        near(seen.iter().find(|(id, _)| *id == 12).map(|(_, pressure)| *pressure), 2.0, 1e-5);
        assert!(seen.iter().all(|(id, pressure)| (11..=13).contains(id) || pressure.abs() < 1e-9));
    }
}

/// What single taxels feel along t and n × t in `frame`, as pages and pictures show it.
fn seen(engine: &Engine, body: &Body, frame: &Frame) -> Vec<[f64; 2]> {
    let taxels = SensedTaxels::new(engine.plan(), body);
    let value = |name: &str| frame.values[engine.index_of(name).unwrap()];
    let raw: Vec<RawValue> = grid().map(|(id, _)| value(&id.to_string())).collect();
    let sensed: Vec<RawValue> = taxels.channels().iter().map(|&id| value(&Channel(id).to_string())).collect();
    taxels.read(engine.plan(), &raw, &sensed).map(|seen| seen.shear).collect()
}

#[test]
fn a_soft_onset_takes_nothing_from_what_is_along_the_skin() {
    let body = skin(1);
    let soft = |text: String| text.replace("dead_band = 0.1", "dead_band = 0.5\nonset = \"soft\"");
    for kind in backends() {
        for rows in [&CROSS[..], &CROSS[1..]] {
            let of = |text: &str| {
                let mut engine = engine(&body, kind, text, false);
                let felt = FELT.map(|(id, felt)| (id, measured(felt)));
                let pulled = frame(&engine, 0.0, &felt);
                let [pressure, shear] = percepts(&mut engine, &pulled)[..] else { panic!("two letters") };
                let touch = engine.percepts().touches(0).unwrap().touches[0].clone();
                (pressure.total.unwrap(), DVec2::from_array(shear.shear.unwrap()), touch, seen(&engine, &body, &pulled))
            };
            let (hard, soft) = (of(&with_matrix(rows)), of(&soft(with_matrix(rows))));
            // Each of the three presses by 0.5 N less, and is pulled along by as much as before.
            near(Some(soft.0), hard.0 - 1.5, 1e-5);
            assert!((soft.1 - hard.1).length() < 1e-9, "{kind:?}: {} is not {}", soft.1, hard.1);
            let [softly, hardly] = [&soft.2, &hard.2].map(|touch| touch.shear.unwrap());
            assert!((softly - hardly).length() < 1e-6, "{kind:?}: {softly} is not {hardly}");
            let apart = soft.3.iter().flatten().zip(hard.3.iter().flatten()).map(|(a, b)| (a - b).abs());
            assert!(apart.fold(0.0, f64::max) < 1e-9 && soft.3.iter().filter(|felt| felt[0] != 0.0).count() == 3);
        }
    }
}

#[test]
fn noise_along_the_skin_is_in_what_is_corrected_by_it() {
    let body = skin(1);
    let sigmas = |text: &str| {
        let mut engine = engine(&body, BackendKind::Cpu, text, false);
        let pulled = frame(&engine, 0.0, &FELT.map(|(id, felt)| (id, measured(felt))));
        let [pressure, shear] = percepts(&mut engine, &pulled)[..] else { panic!("two letters") };
        let of_touch = engine.percepts().touches(0).unwrap().touches[0].friction_sigma.unwrap();
        near(shear.friction_sigma, of_touch, 1e-6);
        (pressure.total_sigma.unwrap(), of_touch)
    };
    // Of a taxel's raw values, in N.
    let own = [0.01 * 0.5, 0.02 * 2.0, 0.005 * 2.0];
    let squares = |shares: [f64; 3]| (0..3).map(|axis| (shares[axis] * own[axis]).powi(2)).sum::<f64>();
    let (total, friction) = sigmas(&with_matrix(&CROSS));
    near(Some(total), (3.0 * squares(CROSS[0])).sqrt(), 1e-6);
    // What the pull varies along itself, less the friction's share of what P does.
    let way = [sum().y, sum().z].map(|along| along / sum().y.hypot(sum().z));
    let share = sum().y.hypot(sum().z) / sum().x;
    let pulled = [0, 1, 2].map(|of| way[0] * CROSS[1][of] + way[1] * CROSS[2][of] - share * CROSS[0][of]);
    near(Some(friction), (3.0 * squares(pulled)).sqrt() / sum().x, 1e-6);
    // Without the first row it is what normal values vary by.
    near(Some(sigmas(&with_matrix(&CROSS[1..])).0), (3.0 * own[0] * own[0]).sqrt(), 1e-6);
}

#[test]
fn the_first_frame_is_the_rest_of_what_is_corrected() {
    let body = skin(1);
    for kind in backends() {
        let mut engine = engine(&body, kind, &with_matrix(&CROSS), true);
        // Where all stand otherwise than the file has it.
        let off = DVec3::new(0.3, -0.2, 0.1);
        let all: Vec<(u32, DVec3)> = grid().map(|(id, _)| (id, off)).collect();
        let rest = frame(&engine, 0.0, &all);
        assert!(percepts(&mut engine, &rest).iter().all(|percept| !percept.contact));
        let own =
            |id: u32| FELT.iter().find(|(taxel, _)| *taxel == id).map_or(DVec3::ZERO, |(_, felt)| measured(*felt));
        let felt: Vec<(u32, DVec3)> = grid().map(|(id, _)| (id, off + own(id))).collect();
        let pulled = frame(&engine, 0.1, &felt);
        let [pressure, shear] = percepts(&mut engine, &pulled)[..] else { panic!("two letters") };
        near(pressure.total, sum().x, 1e-4);
        near(shear.friction, sum().y.hypot(sum().z) / sum().x, 1e-5);
    }
}

#[test]
fn a_tangential_value_out_of_its_range_is_not_believed_and_said() {
    let body = skin(1);
    let text = "[all]\nunit = \"N\"\np_max = 3\nraw_range = [-5, 5]\n";
    for kind in backends() {
        for (range, is_believed) in [
            ("", true),
            ("[shear]\nraw_range = [-5, 5]\n", false),
            ("[taxel.12]\nshear_raw_range = [-5, 5]\n", false),
            ("[shear]\nraw_range = [-5, 5]\n[taxel.12]\nshear_raw_range = [-500, 500]\n", true),
        ] {
            let mut engine = engine(&body, kind, &format!("{text}{range}"), false);
            let mut pressed = engine.frame(0.0);
            pressed.values.fill(RawValue::new(0.0));
            for (name, value) in [("12", 2.0), ("12.u", 300.0), ("13", 1.0), ("13.v", 0.5)] {
                pressed.values[engine.index_of(name).unwrap()] = RawValue::new(value);
            }
            let [pressure, shear] = percepts(&mut engine, &pressed)[..] else { panic!("two letters") };
            let touch = &engine.percepts().touches(0).unwrap().touches[0];
            assert!(pressure.total == Some(3.0) && !pressure.flags.contains(Flags::OUT_OF_RANGE), "{pressure:?}");
            assert_eq!(shear.flags.contains(Flags::OUT_OF_RANGE), !is_believed, "{range}: {:?}", shear.flags);
            assert_eq!(touch.flags.contains(TouchFlags::OUT_OF_RANGE), !is_believed, "{range}: {:?}", touch.flags);
            let friction = if is_believed { 300.0_f64.hypot(0.5) / 3.0 } else { 0.5 };
            near(shear.friction, friction, 1e-9);
            near(touch.friction, friction, 1e-9);
            // What is out of range at rest tells nothing of a press.
            pressed.values[engine.index_of("12").unwrap()] = RawValue::new(0.0);
            let [_, shear] = percepts(&mut engine, &pressed)[..] else { panic!("two letters") };
            assert!(!shear.flags.contains(Flags::OUT_OF_RANGE) && shear.friction == Some(0.5), "{shear:?}");
        }
    }
}

#[test]
fn a_normal_value_is_corrected_by_what_is_known_and_flagged_for_the_rest() {
    let body = skin(1);
    let text = "[all]\nunit = \"N\"\nraw_range = [0, 1023]\n[shear]\nraw_range = [-500, 500]\n\
                cross_axis = [[2, 0.5, 0], [0, 1, 0], [0, 0, 1]]\n";
    let raw = RawValue::new;
    let (none, faulty, off) = (Flags::INCOMPLETE, Flags::FAULTY_INPUT, Flags::OUT_OF_RANGE);
    for kind in backends() {
        for (name, value, total, flags) in [
            ("12.u", raw(0.0), 200.0, Flags::empty()),
            ("12.u", raw(-40.0), 180.0, Flags::empty()),
            ("12.u", RawValue::MISSING, 200.0, none),
            ("12.u", RawValue::STALE, 200.0, none | Flags::STALE),
            ("12.u", RawValue::FAULTY, 200.0, faulty),
            ("12.u", raw(501.0), 200.0, off),
            // Nothing of it is in P.
            ("12.v", RawValue::MISSING, 200.0, Flags::empty()),
            // The range is of what is measured.
            ("12", raw(700.0), 1400.0, Flags::empty()),
            ("12", raw(1024.0), 2048.0, off),
        ] {
            let mut engine = engine(&body, kind, text, false);
            engine.track_stale();
            let mut pressed = engine.frame(0.0);
            pressed.values.fill(raw(0.0));
            for (name, value) in [("12", raw(100.0)), (name, value)] {
                pressed.values[engine.index_of(name).unwrap()] = value;
            }
            let [pressure, shear] = percepts(&mut engine, &pressed)[..] else { panic!("two letters") };
            let touch = &engine.percepts().touches(0).unwrap().touches[0];
            let of_values = none | faulty | off | Flags::STALE;
            assert_eq!((pressure.total, pressure.flags & of_values), (Some(total), flags), "{name} {value}");
            assert!(shear.flags.contains(flags), "{name} {value}: {shear:?}");
            assert_eq!(touch.total, total, "{name} {value}");
            for (of_touch, flag) in [
                (TouchFlags::INCOMPLETE, none),
                (TouchFlags::FAULTY_INPUT, faulty),
                (TouchFlags::OUT_OF_RANGE, off),
                (TouchFlags::STALE, Flags::STALE),
            ] {
                // A touch says also that its tangential force is not known.
                let is_lost = name == "12.v" && of_touch == TouchFlags::INCOMPLETE;
                assert_eq!(
                    touch.flags.contains(of_touch),
                    flags.contains(flag) || is_lost,
                    "{name} {value}: {of_touch:?}"
                );
            }
        }
    }
}

#[test]
fn a_sensor_at_its_end_is_found_whatever_its_value_is_corrected_to() {
    let body = skin(1);
    let text = "[all]\nunit = \"N\"\nraw_range = [-10, 1023]\n[drift]\nsaturated_s = 0.5\ncadence_s = 0.2\n\
                [shear]\ncross_axis = [[0.5, 0, 0], [0, 1, 0], [0, 0, 1]]\n";
    for kind in backends() {
        let mut engine = engine(&body, kind, text, false);
        let at = |engine: &Engine, id: &str| engine.index_of(id).unwrap();
        for tick in 0..20 {
            let mut pressed = engine.frame(0.1 * f64::from(tick));
            pressed.values.fill(RawValue::new(0.0));
            // One at its end, one just under it, and one that is beyond it in the last frame.
            pressed.values[at(&engine, "12")] = RawValue::new(1023.0);
            pressed.values[at(&engine, "13")] = RawValue::new(1022.0);
            pressed.values[at(&engine, "6")] = RawValue::new(if tick == 19 { 1030.0 } else { 500.0 });
            engine.process_one(&pressed).unwrap();
        }
        assert_eq!(engine.unfit().collect::<Vec<_>>(), [(12, Unfit::Saturated)], "{kind:?}");
        // As pages are told.
        assert_eq!(engine.values_noted(), [(6, Reading::Value(1030.0, false))], "{kind:?}");
    }
}

#[test]
fn pressures_of_a_frame_that_is_too_short_are_those_of_its_values() {
    let body = skin(1);
    let text = "[shear]\ncross_axis = [[2, 0.5, 1], [0, 1, 0], [0, 0, 1]]\n";
    let engine = engine(&body, BackendKind::Reference, text, false);
    let mut short = engine.frame(0.0);
    let [normal, u, v] = ["12", "12.u", "12.v"].map(|name| engine.index_of(name).unwrap());
    for (place, value) in [(normal, 100.0), (u, 10.0), (v, 7.0)] {
        short.values[place] = RawValue::new(value);
    }
    let mut felt = Vec::new();
    for (length, right) in [(v + 1, Some(212.0)), (v, Some(205.0)), (u, Some(200.0)), (normal, None)] {
        short.values.truncate(length);
        engine.pressures(&short, &mut felt);
        assert_eq!(felt.iter().find(|(id, _)| *id == 12).map(|(_, pressure)| *pressure), right);
    }
}

#[test]
fn a_scale_of_all_gains_leaves_the_friction() {
    let body = skin(1);
    let of = |scale: &str, own: &str| {
        let text = OF_AXES.replace("gain = 0.01", &format!("gain = 0.01\n{scale}")) + own;
        let mut engine = engine(&body, BackendKind::Reference, &text, false);
        let pulled = frame(&engine, 0.0, &FELT.map(|(id, felt)| (id, DVec3::from_array(felt))));
        let [pressure, shear] = percepts(&mut engine, &pulled)[..] else { panic!("two letters") };
        (pressure.total.unwrap(), shear.friction.unwrap())
    };
    for own in ["", "[taxel.12]\nshear_gain = 0.04\n"] {
        let ((once, friction), (twice, same)) = (of("", own), of("scale = 2\n", own));
        assert!((twice - 2.0 * once).abs() < 1e-9 && (same - friction).abs() < 1e-12, "{friction} {same}");
    }
}

#[test]
fn normal_forces_by_a_curve_are_not_corrected_and_that_is_said() {
    let body = skin(1);
    let text = "[curve.a]\nraw = [0, 10]\np = [0, 4]\n[shear]\ngain = 1\ncross_axis = [[1, 0.1, 0], [0, 1, 0], [0, 0, 1]]\n[taxel.12]\n";
    let made = |own: &str| {
        // Without a body it is not known which taxels have three axes.
        let ids: Vec<u32> = body.taxels.iter().map(|taxel| taxel.id).collect();
        let calibration = Calibration::parse(&format!("{text}{own}"), &ids).unwrap();
        Engine::new(&body, Options::default().calibration(Some(calibration))).map(drop).map_err(|e| e.to_string())
    };
    let why = made("curve = \"a\"").unwrap_err();
    let right = format!("{}: `cross_axis` in [shear] corrects normal forces, which taxel 12 has by a curve", body.name);
    assert!(why.starts_with(&right), "{why}");
    made("curve = \"a\"\nmask = true").unwrap();
    made("gain = 2").unwrap();
}
