//! Shear, temperature and proximity at extremes: calls that stop half way, one taxel with three axes among others, values that are lost,
//! stale or beyond belief, clocks that stand still, states in the middle of a window, and fields that share taxels.

use glam::{DQuat, DVec2, DVec3};
use somatic::body::{ChartKind, ChartSpec, FieldSpec, MemberSpec, Modality, Taxel};
use somatic::internal::body::Glb;
use somatic::internal::signal::FrameBlock;
use somatic::percept::{LinkShare, TouchFlags};
use somatic::signal::Pose;
use somatic::{
    BackendKind, Body, Calibration, Engine, Flags, Frame, Letter, Options, Outputs, Percept, RawValue, Receptor, Scene,
    TouchOutputs, touch,
};

use crate::common::backends;
use crate::senses::{CALIBRATION, PITCH, SIDE, TOUCH, Touch, WARM, engine, grid, skin};

fn with_touches() -> Scene {
    let outputs = TouchOutputs::USUAL | TouchOutputs::WRENCH;
    Scene::default().touches(touch::Options { outputs, ..touch::Options::default() })
}

/// Taxels of `kinds` in a row 5 mm apart, ids from 0, and two fields: over all, and over all but the first with the weight 3.
pub fn row(kinds: &[Modality]) -> Body {
    let mut glb = Glb::new();
    let link = glb.node("row", None, DVec3::ZERO);
    let taxels: Vec<Taxel> = (0..)
        .zip(kinds)
        .map(|(id, &modality)| Taxel {
            id,
            link: 0,
            position_in_link: DVec3::new(PITCH * f64::from(id), 0.0, 0.0),
            normal_in_link: DVec3::Y,
            area: PITCH * PITCH,
            modality,
            tangent_in_link: (modality == Modality::Force3).then_some(DVec3::X),
        })
        .collect();
    glb.taxels("taxels", Some(link), &taxels, None);
    for (name, first, weight) in [("all", 0, 1.0), ("rest", 1, 3.0)] {
        let chart =
            ChartSpec { kind: ChartKind::Plane, origin_in_anchor: Some([0.0; 3]), u_in_anchor: Some([1.0, 0.0, 0.0]) };
        let ids = first..kinds.len() as u32;
        let members = ids.map(|id| (id, MemberSpec { weight, ..MemberSpec::default() })).collect();
        let spec = FieldSpec { name: name.into(), parent: None, members, chart: Some(chart) };
        glb.field(&spec, Some(link), DVec3::ZERO);
    }
    Body::from_bytes("row", &glb.to_bytes().unwrap()).unwrap()
}

/// A frame in which all values but those of `named` are 0.
pub fn frame_with(engine: &Engine, t_s: f64, named: &[(&str, RawValue)]) -> Frame {
    let mut frame = engine.frame(t_s);
    frame.values.fill(RawValue::new(0.0));
    for &(name, value) in named {
        frame.values[engine.index_of(name).unwrap()] = value;
    }
    frame
}

pub fn number(value: f64) -> RawValue {
    RawValue::new(value)
}

pub fn percepts_of(frame: &Frame, engine: &mut Engine) -> Vec<Percept> {
    engine.process_one(frame).unwrap().frame(0).collect()
}

/// The percept of `receptor` in the first field that has one.
pub fn of(engine: &Engine, percepts: &[Percept], receptor: Receptor) -> Percept {
    let letters = engine.plan().letters();
    *percepts.iter().find(|percept| letters[percept.letter].receptor == receptor).unwrap()
}

#[test]
fn one_taxel_with_three_axes_among_others_has_no_torsion_and_says_why() {
    use Modality::{Force3, Pressure};
    for (kinds, has_torsion) in [([Pressure, Force3, Pressure], false), ([Force3, Force3, Pressure], true)] {
        for kind in backends() {
            let mut engine = engine(&row(&kinds), kind, with_touches());
            let pulled = [("0", number(1.0)), ("1", number(2.0)), ("2", number(1.0)), ("1.u", number(0.5))];
            let frame = frame_with(&engine, 0.0, &pulled);
            let percepts = engine.process_one(&frame).unwrap();
            let [touch] = &percepts.touches(0).unwrap().touches[..] else { panic!("one touch") };
            // 0.5 N of the one that is pulled, over the 2 N that it presses with, or 3 N where the first tells how it is pulled, too.
            let friction = if has_torsion { 0.5 / 3.0 } else { 0.25 };
            assert!(touch.active == 3 && (touch.friction.unwrap() - friction).abs() < 1e-6, "{:?}", touch.friction);
            assert_eq!(
                (touch.torsion.is_some(), touch.flags.contains(TouchFlags::ONE_PULLED)),
                (has_torsion, !has_torsion)
            );
            let all: Vec<Percept> = percepts.frame(0).collect();
            let shear = of(&engine, &all, Receptor::Shear);
            assert_eq!((shear.torsion.is_some(), shear.flags.contains(Flags::ONE_TAXEL)), (has_torsion, !has_torsion));
        }
    }
    // Where another is there and not known, that is why.
    let mut engine = engine(&row(&[Force3, Force3, Pressure]), BackendKind::Reference, with_touches());
    let lost = [("0", number(1.0)), ("1", number(2.0)), ("1.v", RawValue::MISSING)];
    let frame = frame_with(&engine, 0.0, &lost);
    let touches = engine.process_one(&frame).unwrap().touches(0).unwrap();
    let touch = &touches.touches[0];
    assert!(touch.torsion.is_none() && touch.flags.contains(TouchFlags::INCOMPLETE));
    assert!(!touch.flags.contains(TouchFlags::ONE_PULLED));
}

#[test]
fn a_touch_says_what_is_lost_of_its_pull_and_its_warmth() {
    let body = skin(2);
    let mut engine = engine(&body, BackendKind::Cpu, with_touches());
    let whole = TOUCH.frame(&engine, 0.0);
    let clean = engine.process_one(&whole).unwrap().touches(0).unwrap().touches[0].clone();
    let doubts = TouchFlags::INCOMPLETE | TouchFlags::FAULTY_INPUT | TouchFlags::OUT_OF_RANGE;
    assert!(clean.temperature_celsius.is_some() && !clean.flags.intersects(doubts));
    for (value, flag) in [(RawValue::MISSING, TouchFlags::INCOMPLETE), (RawValue::FAULTY, TouchFlags::FAULTY_INPUT)] {
        for all in [false, true] {
            let mut frame = whole.clone();
            frame.t_s = 0.1;
            for (i, _) in grid().filter(|&(i, _)| all || i == 12) {
                frame.values[engine.index_of(&(WARM + i).to_string()).unwrap()] = value;
            }
            let touch = engine.process_one(&frame).unwrap().touches(0).unwrap().touches[0].clone();
            assert_eq!((touch.temperature_celsius.is_none(), touch.flags & doubts), (all, flag));
        }
        // What presses pushes, where it is not known how any of it pulls.
        let mut frame = whole.clone();
        frame.t_s = 0.2;
        for (i, _) in grid() {
            frame.values[engine.index_of(&format!("{i}.u")).unwrap()] = value;
        }
        let touch = engine.process_one(&frame).unwrap().touches(0).unwrap().touches[0].clone();
        assert!(touch.flags.contains(flag) && touch.shear.is_none() && touch.friction.is_none());
        let force = touch.force_vector_newton.unwrap();
        assert!((force + touch.total * DVec3::Y).length() < 1e-6 * touch.total, "{force}");
    }
}

#[test]
fn after_a_call_that_stopped_half_way_links_are_pressed_as_before_it() {
    let body = skin(1);
    let presses = |engine: &Engine| {
        let mut presses: Vec<LinkShare> = Vec::new();
        engine.presses_on_links(&mut presses);
        presses
    };
    for kind in backends() {
        let make = || engine(&body, kind, with_touches());
        let (mut stopped, mut whole) = (make(), make());
        let first = TOUCH.frame(&stopped, 0.0);
        stopped.process_one(&first).unwrap();
        let before = presses(&stopped);
        // The other way, on one taxel, and in the end not at all: each part of it would be told from the first frame.
        let frames: Vec<Frame> = (0..600)
            .map(|index| {
                let t_s = 0.01 * f64::from(index + 1);
                let at = DVec2::splat(PITCH * f64::from(index % 3));
                let drag = if index < 500 { -TOUCH.drag } else { DVec2::ZERO };
                Touch { at, drag, ..TOUCH }.frame(&stopped, t_s)
            })
            .collect();
        let times: Vec<f64> = frames.iter().map(|frame| frame.t_s).collect();
        let values: Vec<RawValue> = frames.iter().flat_map(|frame| frame.values.clone()).collect();
        let block = FrameBlock { t_s: &times, values: &values, poses: &[] };
        let mut done = 0;
        let go_on = |frames: usize| {
            done = frames;
            false
        };
        assert!(stopped.process_block_while(&block, go_on).unwrap().is_none());
        assert!(done > 0 && done < frames.len(), "{done} frames");
        assert_eq!(presses(&stopped), before, "{kind:?}");
        assert!(stopped.percepts().frames() == 0 && stopped.values_sensed().is_empty());
        // A call that is refused changes nothing, and what comes next is as if nothing had been.
        let mut short = frames[0].clone();
        short.values.pop();
        assert!(stopped.process_one(&short).is_err());
        assert_eq!(presses(&stopped), before);
        whole.process_one(&first).unwrap();
        let percepts = whole.process(&frames[..20]).unwrap().clone();
        assert_eq!(*stopped.process(&frames[..20]).unwrap(), percepts);
        assert_eq!(presses(&stopped), presses(&whole));
        assert_ne!(presses(&stopped), before);
        // A state brings back what pressed then, also in another engine.
        let state = whole.state().unwrap();
        let then = presses(&whole);
        whole.process(&frames[20..40]).unwrap();
        let mut other = make();
        for engine in [&mut whole, &mut other] {
            engine.restore(&state).unwrap();
            assert_eq!(presses(engine), then);
        }
    }
}

#[test]
fn letters_without_a_position_forget_that_they_were_in_the_world() {
    let body = skin(3);
    let outputs = Outputs::WARMEST_POSITION | Outputs::NEAREST_POSITION;
    let scene = Scene::default()
        .outputs(outputs)
        .letters(Letter::all_of(&[Receptor::Temperature, Receptor::Proximity], &[]))
        .touches(None);
    let pose = Pose { translation: DVec3::Z, rotation: DQuat::IDENTITY };
    for kind in backends() {
        let make = || engine(&body, kind, scene.clone());
        let frames: Vec<Frame> = (0..12)
            .map(|index| {
                let distance_m = if index % 3 == 1 { 0.5 } else { 0.03 };
                let mut frame = Touch { distance_m, ..TOUCH }.frame(&make(), 0.01 * f64::from(index));
                if index % 3 == 2 {
                    (WARM..WARM + SIDE * SIDE).for_each(|id| frame.values[id as usize - 75] = RawValue::MISSING);
                }
                frame.pose.push(("skin".into(), pose));
                frame
            })
            .collect();
        let cut_by = |cut: usize| {
            let mut engine = make();
            let calls = frames.chunks(cut);
            let percepts = calls.flat_map(|call| {
                let percepts = engine.process(call).unwrap();
                (0..call.len()).flat_map(|frame| percepts.frame(frame).collect::<Vec<_>>()).collect::<Vec<_>>()
            });
            percepts.collect::<Vec<Percept>>()
        };
        let whole = cut_by(12);
        assert!(whole.iter().any(|percept| percept.in_world) && whole.iter().any(|percept| !percept.contact));
        assert!(whole.iter().all(|percept| percept.contact == percept.in_world), "{kind:?}");
        for cut in [1, 5] {
            assert_eq!(cut_by(cut), whole, "{kind:?} cut by {cut}");
        }
    }
}

#[test]
fn rates_stand_clocks_that_are_coarse_and_times_that_are_none() {
    let body = skin(3);
    let mut engine = engine(&body, BackendKind::Reference, Scene::default());
    // Four frames in each tick of 10 ms.
    for index in 0..400 {
        let t_s = 0.01 * f64::from(index / 4);
        let touch = Touch { celsius: 20.0 + 5.0 * t_s, distance_m: 0.07 - 0.05 * t_s, ..TOUCH };
        let percepts = percepts_of(&touch.frame(&engine, t_s), &mut engine);
        let [warm, near] = [Receptor::Temperature, Receptor::Proximity].map(|letter| of(&engine, &percepts, letter));
        if t_s >= 0.5 {
            assert!((warm.temperature_rate.unwrap() - 5.0).abs() < 1e-2, "{index}: {:?}", warm.temperature_rate);
            assert!((near.approach_speed.unwrap() - 0.05).abs() < 1e-4, "{index}: {:?}", near.approach_speed);
        }
    }
    for wrong in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 0.5] {
        let frame = TOUCH.frame(&engine, wrong);
        let percepts = percepts_of(&frame, &mut engine);
        let warm = of(&engine, &percepts, Receptor::Temperature);
        assert!(warm.temperature_rate.is_none() && warm.flags.contains(Flags::NO_PREVIOUS), "{wrong}: {warm:?}");
        // The temperature itself needs no time.
        assert!((warm.temperature.unwrap() - TOUCH.celsius).abs() < 1e-5, "{wrong}: {:?}", warm.temperature);
        for index in 0..200 {
            let t_s = 1.0 + 0.01 * f64::from(index);
            let percepts = percepts_of(&Touch { celsius: 20.0 - t_s, ..TOUCH }.frame(&engine, t_s), &mut engine);
            let rate = of(&engine, &percepts, Receptor::Temperature).temperature_rate;
            // A time that is none leaves nothing behind; of one half a second before the first frame the window, which is as long, still
            // has the fall from 31 to 19 °C.
            match (wrong.is_finite(), index) {
                (true, 0..25) => assert!(rate.unwrap() < -1.1, "{index} after {wrong}: {rate:?}"),
                (true, 25..100) => assert!(rate.unwrap().is_finite(), "{index} after {wrong}: {rate:?}"),
                (false, 0..25) => assert_eq!(rate, None, "{index} after {wrong}"),
                _ => assert!((rate.unwrap() + 1.0).abs() < 1e-2, "{index} after {wrong}: {rate:?}"),
            }
        }
    }
}

#[test]
fn what_is_stale_is_said_of_the_letters_that_it_is_in() {
    let body = skin(3);
    for kind in backends() {
        let mut engine = engine(&body, kind, with_touches());
        engine.track_stale();
        for (name, of_letter, of_touch) in
            [("12.u", Receptor::Shear, true), ("112", Receptor::Temperature, true), ("212", Receptor::Proximity, false)]
        {
            let mut frame = TOUCH.frame(&engine, 0.0);
            frame.values[engine.index_of(name).unwrap()] = RawValue::STALE;
            let percepts = engine.process_one(&frame).unwrap();
            let touch = &percepts.touches(0).unwrap().touches[0];
            assert_eq!(touch.flags.contains(TouchFlags::STALE), of_touch, "{name}: {:?}", touch.flags);
            let letters: Vec<Percept> = percepts.frame(0).collect();
            for percept in letters {
                let own = engine.plan().letters()[percept.letter].receptor == of_letter;
                let flags = Flags::STALE | Flags::INCOMPLETE;
                assert_eq!(percept.flags & flags, if own { flags } else { Flags::empty() }, "{kind:?} {name}");
            }
        }
    }
}

#[test]
fn pulls_beyond_belief_are_faulty_as_pressures_are() {
    let body = skin(1);
    let ids: Vec<u32> = body.taxels.iter().map(|taxel| taxel.id).collect();
    let calibration = Calibration::parse("[all]\nunit = \"N\"\n[shear]\ngain = 1e9\n", &ids).unwrap();
    let options = Options::default().scene(with_touches()).calibration(Some(calibration));
    let mut engine = Engine::new(&body, options.backend(BackendKind::Reference)).unwrap();
    for value in [1e15, -1e15, 1e30, f64::from(f32::MAX)] {
        let frame = frame_with(&engine, 0.0, &[("12", number(1.0)), ("13", number(1.0)), ("13.v", number(value))]);
        let percepts = engine.process_one(&frame).unwrap();
        let touch = &percepts.touches(0).unwrap().touches[0];
        assert!(
            touch.flags.contains(TouchFlags::FAULTY_INPUT) && touch.shear == Some(DVec3::ZERO),
            "{value}: {touch:?}"
        );
        let shear = percepts.get(0, 1);
        assert!(shear.flags.contains(Flags::FAULTY_INPUT) && shear.friction == Some(0.0), "{value}: {shear:?}");
    }
    // What is large and believed is finite.
    let frame = frame_with(&engine, 0.1, &[("12", number(1e-17)), ("12.u", number(1e9)), ("13", number(1e-17))]);
    let shear = engine.process_one(&frame).unwrap().get(0, 1);
    assert!(
        shear.friction.unwrap() > 1e30 && shear.friction.unwrap().is_finite() && shear.torsion.unwrap().is_finite()
    );
}

#[test]
fn checks_of_pressures_leave_other_taxels_alone() {
    let body = skin(3);
    let ids: Vec<u32> = body.taxels.iter().map(|taxel| taxel.id).collect();
    for checks in ["isolated_ratio = 2\nisolated_above = 0.5", "broken_frame_share = 0.3"] {
        let text = CALIBRATION.replace("noise = 0.01", "noise = 0.01\nraw_range = [0, 3]") + "[checks]\n" + checks;
        let calibration = Calibration::parse(&text, &ids).unwrap();
        let options = Options::default().calibration(Some(calibration)).backend(BackendKind::Reference);
        let mut engine = Engine::new(&body, options).unwrap();
        let percepts = percepts_of(&TOUCH.frame(&engine, 0.0), &mut engine);
        assert!(percepts.iter().all(|percept| !percept.flags.contains(Flags::FAULTY_INPUT)), "{checks}: {percepts:?}");
        // A pressed taxel without company is still not believed, however warm it is around it.
        if checks.starts_with("isolated") {
            let alone = frame_with(&engine, 0.1, &[("12", number(2.0)), ("112", number(30.0)), ("113", number(90.0))]);
            let percepts = percepts_of(&alone, &mut engine);
            assert!(percepts[0].flags.contains(Flags::FAULTY_INPUT) && !percepts[0].contact, "{:?}", percepts[0]);
        }
    }
}

#[test]
fn a_state_in_the_middle_of_a_window_goes_on_with_the_same_bits() {
    use Modality::{Force3, Proximity, Temperature};
    let bodies = [skin(3), row(&[Force3, Force3, Force3, Temperature, Temperature, Proximity, Proximity])];
    for (body, kind) in bodies.iter().flat_map(|body| backends().into_iter().map(move |kind| (body, kind))) {
        let make = || engine(body, kind, with_touches());
        let frames: Vec<Frame> = (0..60_u32)
            .map(|index| {
                let mut frame = make().frame(0.013 * f64::from(index) - if index > 40 { 0.2 } else { 0.0 });
                for (at, value) in frame.values.iter_mut().enumerate() {
                    let chance = (index.wrapping_mul(2_654_435_761) ^ (at as u32).wrapping_mul(40_503)) >> 7;
                    *value = match chance % 11 {
                        0 => RawValue::MISSING,
                        1 => RawValue::FAULTY,
                        _ => number(f64::from(chance % 97) * 0.1),
                    };
                }
                frame
            })
            .collect();
        let mut whole = make();
        let right = whole.process(&frames).unwrap().clone();
        assert!((0..60).any(|frame| right.frame(frame).any(|percept| percept.temperature_rate.is_some())));
        for at in [1, 7, 30, 41, 59] {
            let mut engine = make();
            engine.process(&frames[..at]).unwrap();
            let state = engine.state().unwrap();
            engine.process(&frames[at..]).unwrap();
            let mut other = make();
            for engine in [&mut engine, &mut other] {
                engine.restore(&state).unwrap();
                let got = engine.process(&frames[at..]).unwrap();
                for frame in at..60 {
                    let pair = [got.frame(frame - at), right.frame(frame)].map(Iterator::collect::<Vec<_>>);
                    assert_eq!(pair[0], pair[1], "{kind:?} from {at}: frame {frame}");
                    assert_eq!(got.touches(frame - at), right.touches(frame));
                }
            }
        }
    }
}

#[test]
fn fields_that_share_taxels_have_each_its_own_and_faulty_ones_have_none() {
    use Modality::{Force3, Proximity, Temperature};
    let body = row(&[Force3, Force3, Force3, Temperature, Temperature, Proximity, Proximity]);
    for kind in backends() {
        let mut engine = engine(&body, kind, Scene::default());
        let pressed =
            [("0", 1.0), ("1", 2.0), ("2", 1.0), ("0.u", 0.5), ("1.u", 0.25), ("2.v", 0.5), ("3", 20.0), ("4", 30.0)];
        let named: Vec<(&str, RawValue)> = pressed.iter().map(|&(name, value)| (name, number(value))).collect();
        let percepts = percepts_of(&frame_with(&engine, 0.0, &named), &mut engine);
        let letters = engine.plan().letters().to_vec();
        let shear: Vec<&Percept> =
            percepts.iter().filter(|one| letters[one.letter].receptor == Receptor::Shear).collect();
        let [all, rest] = shear[..] else { panic!("{} fields", shear.len()) };
        // n × t is (0, 1, 0) × (1, 0, 0) = (0, 0, −1), which is +v.
        let close = |got: Option<[f64; 2]>, right: [f64; 2]| {
            let off = DVec2::from_array(got.unwrap()).distance(DVec2::from_array(right));
            assert!(off < 1e-12, "{kind:?}: {got:?}, not {right:?}");
        };
        close(all.shear, [0.75, 0.5]);
        close(rest.shear, [0.75, 1.5]);
        assert!((all.friction.unwrap() - 0.75_f64.hypot(0.5) / 4.0).abs() < 1e-12);
        assert!((rest.friction.unwrap() - 0.75_f64.hypot(1.5) / 9.0).abs() < 1e-12);
        for (value, flag) in [
            (RawValue::FAULTY, Flags::FAULTY_INPUT),
            (number(1e30), Flags::FAULTY_INPUT),
            (RawValue::MISSING, Flags::INCOMPLETE),
        ] {
            let mut frame = engine.frame(0.1);
            frame.values.fill(value);
            for percept in percepts_of(&frame, &mut engine) {
                let there = [percept.shear.is_some(), percept.friction.is_some(), percept.force_vector.is_some()];
                let more =
                    [percept.temperature.is_some(), percept.temperature_rate.is_some(), percept.covered.is_some()];
                assert!(!percept.contact && percept.flags.contains(flag | Flags::NO_CONTACT), "{kind:?}: {percept:?}");
                assert!(!there.into_iter().chain(more).any(|is_there| is_there), "{kind:?}: {percept:?}");
            }
        }
    }
}

#[test]
fn codes_of_every_table_are_missing_before_values_are_held() {
    let body = skin(3);
    let ids: Vec<u32> = body.taxels.iter().map(|taxel| taxel.id).collect();
    let codes = "[all]\nmissing = [7]\n[temperature]\nmissing = [-999]\n[proximity]\nmissing = [8190]\n[taxel.101]\nmissing = [9]\n";
    for (name, letter, code) in
        [("100", 2, 7.0), ("100", 2, -999.0), ("200", 3, 8190.0), ("101", 2, 9.0), ("101", 2, -999.0)]
    {
        for (max_age_s, is_held) in [(0.5, true), (0.0, false)] {
            let calibration = Calibration::parse(codes, &ids).unwrap();
            let scene = Scene::default().max_age_s(max_age_s);
            let options = Options::default().scene(scene).calibration(Some(calibration)).backend(BackendKind::Cpu);
            let mut engine = Engine::new(&body, options).unwrap();
            let [before, after] = [0.0, 0.1].map(|t_s| {
                let mut frame = TOUCH.frame(&engine, t_s);
                let index = engine.index_of(name).unwrap();
                frame.values[index] = if t_s > 0.0 { RawValue::new(code) } else { frame.values[index] };
                let percept = engine.process_one(&frame).unwrap().get(0, letter);
                (percept.flags.contains(Flags::INCOMPLETE), percept.temperature, percept.covered)
            });
            assert_eq!((before.0, after.0), (false, !is_held), "{name} = {code}, held for {max_age_s} s");
            assert_eq!((before.1, before.2) == (after.1, after.2), is_held, "{name} = {code}: {before:?} {after:?}");
        }
    }
}
