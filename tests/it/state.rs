//! The state between frames is one value: a recording can be entered anywhere with it, and goes on with the same bits.

use somatic::scene::{Cadence, Knobs};
use somatic::{BackendKind, Body, Calibration, Engine, EngineState, Frame, Letter, Options, Outputs, Receptor, Scene};

use crate::batches::{bits, recording};
use crate::common::{backends, frame};

const CALIBRATION: &str = "[checks]\nsettle_frames = 2\nisolated_ratio = 3\nisolated_above = 500\n\
     [all]\np_max = 900\nraw_range = [0, 1023]\nbaseline = 3\ndead_band = 10\n[contact]\non = 900\noff = 300\n";
const DRIFT: &str = "[drift]\ntime_constant_s = 2\nmax_drift = 50\ndead_s = 0.5\nsaturated_s = 1\ncadence_s = 0.3\n";

/// What differs between the engines of this test.
#[derive(Clone, Copy, Debug)]
struct Case {
    backend: BackendKind,
    cadence: Cadence,
    drift: bool,
    tare: bool,
}

impl Case {
    fn engine(self, body: &Body) -> Engine {
        let ids: Vec<u32> = body.taxels.iter().map(|taxel| taxel.id).collect();
        let text = if self.drift { [CALIBRATION, DRIFT].concat() } else { CALIBRATION.to_owned() };
        let calibration = Some(Calibration::parse(&text, &ids).unwrap());
        // Cadence `on-change` excludes letters of change and filters, and what is made of places in the world.
        let on_change = Outputs::all() - Outputs::FILTERED - Outputs::SELF_CONTACTS - Outputs::SPEED_IN_WORLD;
        let (receptors, outputs): (&[_], _) = match self.cadence {
            Cadence::OnChange => (&[Receptor::Sustained], on_change),
            Cadence::EveryFrame => (&[Receptor::Sustained, Receptor::Change], Outputs::all()),
        };
        let knobs = Knobs::default().cadence(self.cadence);
        let letters = Letter::all_of(receptors, &[]);
        let scene = Scene::default().outputs(outputs).max_age_s(0.1).letters(letters).knobs(knobs);
        let options =
            Options::default().backend(self.backend).batch(32).calibration(calibration).scene(scene).tare(self.tare);
        Engine::new(body, options).unwrap()
    }
}

/// All percepts of `frames`, `cut` frames a call.
fn percepts(engine: &mut Engine, frames: &[Frame], cut: usize) -> Vec<Vec<String>> {
    let mut seen = Vec::new();
    for part in frames.chunks(cut) {
        let percepts = engine.process(part).unwrap();
        seen.extend((0..part.len()).map(|frame| bits(percepts, frame)));
    }
    seen
}

#[test]
fn a_recording_goes_on_from_a_state_with_the_same_bits() {
    let body = Body::from_bytes("humanoid", somatic::bundled::HUMANOID).unwrap();
    // Frames that stay as they were for a while, for cadence `on-change`.
    let frames: Vec<Frame> = recording(&body, 60)
        .into_iter()
        .flat_map(|frame| [0.0, 0.005].map(|later_s| Frame { t_s: frame.t_s + later_s, ..frame.clone() }))
        .collect();
    for backend in backends() {
        for (cadence, drift, tare) in
            [(Cadence::EveryFrame, false, false), (Cadence::EveryFrame, true, true), (Cadence::OnChange, true, false)]
        {
            let case = Case { backend, cadence, drift, tare };
            let whole = percepts(&mut case.engine(&body), &frames, 32);
            // From the first frame on in one case only: a minute less.
            for &start in if tare { &[1, 37][..] } else { &[37] } {
                let mut first = case.engine(&body);
                percepts(&mut first, &frames[..start], 16);
                let state = first.state().unwrap();
                assert_eq!(state.frames(), start as u64);
                // Taking the state changes nothing, and another engine goes on from it, after whatever it did before.
                let mut other = case.engine(&body);
                percepts(&mut other, &frames[60..90], 7);
                other.restore(&state).unwrap();
                for (engine, cut) in [(&mut first, 7), (&mut other, 19)] {
                    let rest = percepts(engine, &frames[start..], cut);
                    let differs = whole[start..].iter().zip(&rest).position(|(a, b)| a != b);
                    assert_eq!(differs, None, "{case:?} from frame {start}");
                }
                let without = percepts(&mut case.engine(&body), &frames[start..], 19);
                assert!(without != whole[start..], "{case:?}: the state should matter");
            }
        }
    }
}

#[test]
fn a_comparison_begins_at_any_frame() {
    let body = Body::from_bytes("humanoid", somatic::bundled::HUMANOID).unwrap();
    let frames = recording(&body, 60);
    for backend in backends() {
        for (cadence, drift) in [(Cadence::EveryFrame, true), (Cadence::OnChange, false)] {
            let case = Case { backend, cadence, drift, tare: false };
            let mut engine = case.engine(&body);
            let whole = percepts(&mut engine, &frames, 60);
            let mut engine = case.engine(&body);
            percepts(&mut engine, &frames[..31], 31);
            for (number, frame) in frames.iter().enumerate().skip(31) {
                let (percepts, agreement) = engine.process_and_compare(std::slice::from_ref(frame)).unwrap();
                assert_eq!(bits(percepts, 0), whole[number]);
                assert!(agreement.holds(), "{case:?}, frame {number}: {agreement}");
                assert!(agreement.quantities.values().any(|quantity| quantity.compared > 0), "{agreement}");
                if number % 5 == 0 {
                    // The comparison that follows starts from the backend's state again.
                    let state = engine.state().unwrap();
                    engine.restore(&state).unwrap();
                }
            }
        }
    }
}

#[test]
fn a_state_of_another_engine_is_refused() {
    let hand = Body::from_bytes("hand", somatic::bundled::HAND).unwrap();
    let humanoid = Body::from_bytes("humanoid", somatic::bundled::HUMANOID).unwrap();
    let case = Case { backend: BackendKind::Cpu, cadence: Cadence::EveryFrame, drift: false, tare: false };
    let state: EngineState = case.engine(&hand).state().unwrap();
    for (body, other) in [
        (&humanoid, case),
        (&hand, Case { drift: true, ..case }),
        (&hand, Case { tare: true, ..case }),
        (&hand, Case { cadence: Cadence::OnChange, ..case }),
    ] {
        let mut engine = other.engine(body);
        let before = bits(engine.process(&[frame(0.0, &vec![50.0; body.taxels.len()])]).unwrap(), 0);
        let error = engine.restore(&state).unwrap_err();
        assert_eq!(error.exit_code(), 2, "{error}");
        assert!(error.to_string().contains("another body, scene or calibration"), "{error}");
        assert_eq!(bits(engine.percepts(), 0), before);
    }
    case.engine(&hand).restore(&state).unwrap();
}
