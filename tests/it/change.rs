//! Several letters at once: what changes beside what lasts, and both of the paper's signals, on every backend.

use somatic::signal::FsrSignal;
use somatic::source::{SimulatedSource, Source as _};
use somatic::{
    BackendKind, Body, Calibration, Engine, Flags, Frame, Letter, Options, Outputs, Percept, RawValue, Receptor, Scene,
    bundled,
};

use crate::common::{Flat, backends, frame};

const BOTH: [Receptor; 2] = [Receptor::Sustained, Receptor::Change];

/// Nine taxels a centimetre apart in one field.
fn skin() -> Body {
    let uv: Vec<[f64; 2]> = (0..9).map(|i| [0.01 * f64::from(i % 3 - 1), 0.01 * f64::from(i / 3 - 1)]).collect();
    Flat::new(&uv).field("skin", None, 0..9).surface(0.1).body()
}

fn engine(body: &Body, kind: BackendKind, calibration: &str, letters: Vec<Letter>) -> somatic::Result<Engine> {
    let ids: Vec<u32> = body.taxels.iter().map(|taxel| taxel.id).collect();
    let scene = Scene::default().letters(letters).outputs(Outputs::all() - Outputs::SELF_CONTACTS);
    let calibration = Some(Calibration::parse(calibration, &ids)?);
    Engine::new(body, Options::default().scene(scene).calibration(calibration).backend(kind).batch(32))
}

/// The percepts of `frames` in `letters`, frame by frame: the same bits however they are cut, and held to the reference.
fn run(body: &Body, kind: BackendKind, calibration: &str, letters: &[Letter], frames: &[Frame]) -> Vec<Vec<Percept>> {
    let cut_by = |cut: usize| {
        let mut engine = engine(body, kind, calibration, letters.to_vec()).unwrap();
        let mut seen: Vec<Vec<Percept>> = Vec::new();
        for part in frames.chunks(cut) {
            let (percepts, agreement) = engine.process_and_compare(part).unwrap();
            assert!(agreement.holds(), "{kind:?}: {agreement}");
            seen.extend((0..part.len()).map(|frame| percepts.frame(frame).collect()));
        }
        seen
    };
    let whole = cut_by(frames.len());
    for cut in [1, 7, 20] {
        assert_eq!(cut_by(cut), whole, "{kind:?} cut by {cut}");
    }
    whole
}

/// A run of one skin in both letters.
fn hear(kind: BackendKind, calibration: &str, frames: &[Frame]) -> Vec<[Percept; 2]> {
    let percepts = run(&skin(), kind, calibration, &Letter::all_of(&BOTH, &[]), frames);
    percepts.into_iter().map(|frame| frame.try_into().unwrap()).collect()
}

#[test]
fn a_press_is_felt_by_its_ends_where_change_is_and_throughout_where_pressure_is() {
    const PRESS: &str = "body = \"hand\"\nrate_hz = 50\nduration_s = 2\n[layer]\nthickness_m = 0.004\n\
                         [[touch]]\non = \"hand/palm\"\nindenter = \"fingertip\"\n\
                         path = [[0, 0]]\npress = { from_s = 0.5, to_s = 1.5, newton = 4, ramp_s = 0.1 }\n";
    let body = Body::from_bytes("hand", bundled::HAND).unwrap();
    let mut source = SimulatedSource::on_body("press", PRESS, body.clone()).unwrap();
    let (mut frame, mut frames) = (Frame::missing(0.0, source.taxels().len()), Vec::new());
    assert_eq!(frame.values.len(), body.taxels.len());
    while source.next_frame(&mut frame).unwrap() {
        frames.push(frame.clone());
    }
    for kind in backends() {
        let percepts = run(&body, kind, "", &Letter::all_of(&BOTH, &[]), &frames);
        let names = engine(&body, kind, "", Letter::all_of(&BOTH, &[])).unwrap();
        let palm = names.plan().fields().position(|field| field.name == "hand/palm").unwrap();
        assert_eq!(names.plan().label(palm + 1), "hand/palm · change");
        let (mut ends, mut held) = (0, 0);
        for (index, frame) in frames.iter().enumerate().skip(1) {
            let percepts_before = &percepts[index - 1];
            let percepts = &percepts[index];
            let [lasting, changing] = [percepts[palm], percepts[palm + 1]];
            assert_eq!((lasting.letter, changing.letter), (0, 1));
            // A frame tells of the time since the one before it.
            let during = |from: f64, to: f64| frame.t_s > from + 1e-9 && frame.t_s - 0.02 < to - 1e-9;
            let (pressed, ramps) = (frame.t_s > 0.501 && frame.t_s < 1.499, during(0.5, 0.6) || during(1.4, 1.5));
            assert_eq!(lasting.contact, pressed, "{kind:?} {}", frame.t_s);
            assert_eq!(changing.contact, ramps, "{kind:?} {}", frame.t_s);
            assert_eq!(changing.total == Some(0.0), !ramps);
            ends += u32::from(ramps);
            held += u32::from(pressed && !ramps);
            // All taxels rise together and fall together.
            let rate = (lasting.total.unwrap() - percepts_before[palm].total.unwrap()).abs() / 0.02;
            let within = 1e-5 * lasting.peak.unwrap().max(percepts_before[palm].peak.unwrap()) / 0.02;
            assert!((changing.total.unwrap() - rate).abs() <= within, "{kind:?} {} {rate}", frame.t_s);
            assert_eq!(changing.centroid.is_some() && changing.position.is_some(), ramps);
        }
        assert!(ends == 10 && held > 35, "{ends} {held}");
    }
}

#[test]
fn what_has_nothing_before_it_is_absent_and_says_so() {
    let calm = [10.0; 9];
    let mut frames: Vec<Frame> = [0.0, 0.1, 0.2, 0.1, 0.2, 20.0, 20.1, 20.2, 20.3].map(|t| frame(t, &calm)).to_vec();
    frames[7].values[4] = RawValue::MISSING;
    for values in frames.iter_mut().skip(1).step_by(2).map(|frame| &mut frame.values) {
        values[0] = RawValue::new(30.0);
    }
    // With thresholds, hysteresis must keep the reasons too.
    for thresholds in ["", "[change]\non = 2\noff = 1"] {
        for kind in backends() {
            let heard = hear(kind, thresholds, &frames);
            // Of a change there is no force either.
            let change = |frame: usize| {
                let mut percept = heard[frame][1];
                percept.flags -= Flags::NO_UNIT;
                percept
            };
            assert!(heard.iter().all(|[lasting, _]| lasting.contact));
            assert_eq!((change(0).total, change(0).active), (None, None));
            assert_eq!(change(0).flags, Flags::NO_PREVIOUS | Flags::NO_CONTACT, "{kind:?}");
            // 20 in 0.1 s, of one taxel.
            assert!((change(1).total.unwrap() - 200.0).abs() < 1e-3 && change(1).active == Some(1), "{kind:?}");
            for bad in [3, 5] {
                assert_eq!((change(bad).total, change(bad).contact), (None, false));
                assert_eq!(change(bad).flags, Flags::BAD_DT | Flags::NO_CONTACT, "{kind:?} {bad}");
            }
            // The value is gone in one frame, and so its change in two; the others' is there.
            for (at, incomplete) in [(6, false), (7, true), (8, true)] {
                assert_eq!(change(at).flags.contains(Flags::INCOMPLETE), incomplete, "{kind:?} {at}");
                assert!((change(at).total.unwrap() - 200.0).abs() < 1e-2, "{kind:?} {at}");
            }
        }
    }
}

#[test]
fn changes_have_a_dead_band_and_thresholds_of_their_own() {
    let levels = [0.0, 4.0, 30.0, 36.0, 36.0, 42.0, 0.0];
    let frames: Vec<Frame> = (0..).zip(levels).map(|(i, p)| frame(f64::from(i), &[p; 9])).collect();
    for kind in backends() {
        let contacts = |calibration: &str| -> Vec<bool> {
            hear(kind, calibration, &frames).iter().map(|[_, change]| change.contact).collect()
        };
        assert_eq!(contacts(""), [false, true, true, true, false, true, true]);
        assert_eq!(contacts("[change]\ndead_band = 5"), [false, false, true, true, false, true, true]);
        assert_eq!(contacts("[change]\non = 100\noff = 50"), [false, false, true, true, false, false, true]);
        assert_eq!(contacts("[change]\non = 100\noff = 60"), [false, false, true, false, false, false, true]);
        // Those of pressures are not asked.
        assert_eq!(contacts("[contact]\non = 1e6"), contacts(""));
    }
}

#[test]
fn a_baseline_that_moves_is_not_a_change_and_neither_is_a_taxel_found_unfit() {
    const KEEP: &str =
        "[all]\nbaseline = 100\ngain = 0.3\n[contact]\non = 200\n[drift]\ntime_constant_s = 1\nstuck_s = 4\n";
    // Every taxel is 10 over its baseline, which follows; that is no contact. Then taxel 0 is really pressed a little.
    let frames: Vec<Frame> = (0..24_u32)
        .map(|tick| {
            let mut values = [110.0; 9];
            if tick >= 20 {
                values[0] = 130.0;
            }
            frame(f64::from(tick) / 2.0, &values)
        })
        .collect();
    let lasting_only = KEEP.replace("stuck_s = 4\n", "");
    for kind in backends() {
        let heard = hear(kind, &lasting_only, &frames);
        let totals: Vec<f64> = heard.iter().map(|[lasting, _]| lasting.total.unwrap()).collect();
        assert!(totals[19] < 0.2 * totals[0], "the baselines should follow: {totals:?}");
        for (tick, [_, change]) in heard.iter().enumerate().skip(1) {
            assert_eq!(change.contact, tick == 20, "{kind:?} {tick}: {change:?}");
        }
        // 20 raw units of 0.3 in half a second, whatever the baseline.
        assert!((heard[20][1].total.unwrap() - 12.0).abs() < 1e-4, "{:?}", heard[20][1]);
        let stuck = hear(kind, KEEP, &frames);
        // None moves, and after 4 s none is believed; in the end taxel 0 is again, and there is nothing new to it.
        assert_eq!((stuck[18][0].total, stuck[23][0].active), (None, Some(1)), "{kind:?}");
        for (tick, [_, change]) in stuck.iter().enumerate() {
            assert!(!change.contact, "{kind:?} {tick}: {change:?}");
        }
    }
}

#[test]
fn both_signals_in_one_run_are_what_each_is_alone() {
    let calibration = "[all]\nsensor = \"fsr\"\n[taxel.7]\nsensor = \"linear\"\nbaseline = 1023\ninvert = true\n";
    let frames: Vec<Frame> = (0..40_u32)
        .map(|tick| {
            let mut frame = frame(f64::from(tick) * 0.02, &[1023.0; 9]);
            for (id, value) in frame.values.iter_mut().enumerate() {
                *value = RawValue::new(f64::from(1023 - (tick * 37 + 101 * id as u32) % 900));
            }
            frame
        })
        .collect();
    let signals = [FsrSignal::Raw, FsrSignal::Linear];
    for kind in backends() {
        let all = run(&skin(), kind, calibration, &Letter::all_of(&BOTH, &signals), &frames);
        for (index, letter) in Letter::all_of(&BOTH, &signals).into_iter().enumerate() {
            let alone = run(&skin(), kind, calibration, &[letter], &frames);
            for (all, alone) in all.iter().zip(&alone) {
                let mut one = all[index];
                (one.field, one.letter) = (0, 0);
                assert_eq!(one, alone[0], "{kind:?} {letter:?}");
            }
        }
        assert!(all[5].windows(2).all(|pair| pair[0].total != pair[1].total));
    }
}

#[test]
fn letters_that_make_no_sense_are_refused() {
    let why = |calibration: &str, letters: Vec<Letter>| {
        let error = engine(&skin(), BackendKind::Cpu, calibration, letters).err().unwrap();
        assert!(error.is_usage(), "{error}");
        error.to_string()
    };
    assert!(why("", vec![Letter::default(); 2]).contains("letter `sustained` is asked for twice"));
    let raw = Letter { signal: Some(FsrSignal::Raw), receptor: Receptor::Change };
    assert!(why("", vec![raw]).contains("signal `raw` is for sensors of kind `fsr`"));
    let fsr = "[all]\nsensor = \"fsr\"";
    assert!(why(fsr, vec![raw, Letter::default(), raw]).contains("`change` of signal `raw` is asked for twice"));
    let change = vec![Letter { receptor: Receptor::Change, signal: None }];
    assert!(why("[drift]\nstuck_s = 3", change.clone()).contains("ask for letter `sustained` too"));
    assert!(engine(&skin(), BackendKind::Cpu, "", change).is_ok());
}

#[test]
fn fields_of_hundreds_of_taxels_have_their_own_changes() {
    let body = Body::from_bytes("humanoid", bundled::HUMANOID).unwrap();
    // A hand's breadth of pressed taxels that goes over the body, harder and softer.
    let frames: Vec<Frame> = (0..20_u32)
        .map(|number| {
            let mut frame = Frame::missing(f64::from(number) * 0.01, body.taxels.len());
            for (value, index) in frame.values.iter_mut().zip(0_u32..) {
                let pressed = (index + 37 * number) % 480 < 200;
                *value = RawValue::new(if pressed { f64::from((index * 7 + number * 13) % 50) } else { 0.0 });
            }
            frame
        })
        .collect();
    for kind in backends() {
        let percepts = run(&body, kind, "", &Letter::all_of(&BOTH, &[]), &frames);
        let most = |letter: usize| {
            percepts[9].iter().filter(|p| p.letter == letter).filter_map(|p| p.total).fold(0.0, f64::max)
        };
        assert!(most(1) > 10.0 * most(0), "a change is per second, at a hundred frames a second");
    }
}
