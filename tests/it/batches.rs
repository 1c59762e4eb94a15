//! However a recording is cut into calls, and however its taxels are ordered, its percepts are the same bits.

use somatic::internal::shape::Shape;
use somatic::scene::{Arithmetic, Knobs};
use somatic::{BackendKind, Body, Engine, Frame, Letter, Options, Percepts, RawValue, Receptor, Scene};

use crate::common::{backends, frame};

/// Everything a frame's percepts say, with numbers as bits.
pub(crate) fn bits(percepts: &Percepts, frame: usize) -> Vec<String> {
    // f64's `{:?}` prints the shortest number that reads back to the same bits.
    let of_fields = percepts.frame(frame).map(|p| format!("{} {p:?}", percepts.t_s(frame)));
    of_fields.chain([format!("{:?}", percepts.touches(frame))]).collect()
}

fn run(body: &Body, kind: BackendKind, frames: &[Frame], cut: usize, ids: Option<&[u32]>) -> Vec<Vec<String>> {
    let calibration = "[checks]\nsettle_frames = 2\nisolated_ratio = 3\nisolated_above = 500\n[all]\np_max = 900";
    let all: Vec<u32> = body.taxels.iter().map(|taxel| taxel.id).collect();
    let calibration = Some(somatic::Calibration::parse(calibration, &all).unwrap());
    let letters = Letter::all_of(&[Receptor::Sustained, Receptor::Change], &[]);
    let outputs = somatic::Outputs::all();
    let scene = Scene::default().outputs(outputs).max_age_s(0.1).letters(letters);
    let mut engine =
        Engine::new(body, Options::default().backend(kind).batch(100).calibration(calibration).scene(scene)).unwrap();
    if let Some(ids) = ids {
        engine.set_channels(ids).unwrap();
    }
    let mut seen = Vec::new();
    for part in frames.chunks(cut) {
        let percepts = engine.process(part).unwrap();
        assert_eq!(percepts.frame_number(0), seen.len() as u64);
        seen.extend((0..part.len()).map(|frame| bits(percepts, frame)));
    }
    seen
}

/// A recording with a bit of everything: touches that move, gaps, faults.
pub(crate) fn recording(body: &Body, frames: usize) -> Vec<Frame> {
    let mut seed = 12_345_u32;
    let mut random = move || {
        seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        f64::from(seed >> 8) / f64::from(1 << 24)
    };
    (0..frames)
        .map(|number| {
            let centre = random() * body.taxels.len() as f64;
            let mut frame = frame(number as f64 * 0.02, &[]);
            frame.values = (0..body.taxels.len())
                .map(|taxel| match random() {
                    x if x < 0.02 => RawValue::MISSING,
                    x if x < 0.03 => RawValue::FAULTY,
                    x if (taxel as f64 - centre).abs() < 40.0 => RawValue::new((x * 1023.0).round()),
                    _ => RawValue::new(0.0),
                })
                .collect();
            frame
        })
        .collect()
}

#[test]
fn percepts_do_not_depend_on_the_cut() {
    let body = Body::from_bytes("humanoid", somatic::bundled::HUMANOID).unwrap();
    let frames = recording(&body, 131);
    for kind in backends() {
        let whole = run(&body, kind, &frames, frames.len(), None);
        for cut in [1, 7, 64] {
            let parts = run(&body, kind, &frames, cut, None);
            let differs = whole.iter().zip(&parts).position(|(a, b)| a != b);
            assert_eq!(differs, None, "{kind:?} cut by {cut}");
        }
        // The comparison itself can fail: another frame in one place is seen.
        let mut other = frames.clone();
        other.swap(100, 101);
        assert_ne!(run(&body, kind, &other, 64, None), whole);
    }
}

/// A call of this many frames goes through the GPU in several parts, some on their way while others are packed and read.
#[test]
fn percepts_do_not_depend_on_how_a_long_call_streams() {
    let body = Body::from_bytes("mat", somatic::bundled::MAT).unwrap();
    let frames = recording(&body, 2300);
    let wanted = somatic::Outputs::TOTAL | somatic::Outputs::CENTROID | somatic::Outputs::ORIENTATION;
    let run = |kind: BackendKind, cut: usize| {
        let scene = Scene::default().outputs(wanted | somatic::Outputs::SPEED);
        let options = Options::default().backend(kind).batch(cut).scene(scene);
        let mut engine = Engine::new(&body, options).unwrap();
        let mut seen = Vec::new();
        for part in frames.chunks(cut) {
            let percepts = engine.process(part).unwrap();
            seen.extend((0..part.len()).map(|frame| bits(percepts, frame)));
        }
        seen
    };
    for kind in backends().into_iter().filter(|kind| *kind != BackendKind::Reference) {
        let whole = run(kind, 2300);
        // One at a time has programs of its own on the GPU.
        for cut in [230, 1] {
            let differs = whole.iter().zip(&run(kind, cut)).position(|(a, b)| a != b);
            assert_eq!(differs, None, "{kind:?} cut by {cut}");
        }
    }
}

/// The GPU's programs for one frame at a time take what others take four of: fields small and wide, plain values and
/// calibrated ones, sums with care and without.
#[test]
fn percepts_of_a_frame_at_a_time_are_those_of_many() {
    let shape = Shape { sensors: 34_000, fields: 200, members: 40, wide: 33_500, local: true, frames: 9, seed: 7 };
    let body = shape.body();
    let mut frames = shape.frames();
    for (number, value) in frames.iter_mut().flat_map(|frame| &mut frame.values).enumerate().step_by(97) {
        *value = [RawValue::MISSING, RawValue::FAULTY, RawValue::new(0.0), RawValue::new(1e-30)][number / 97 % 4];
    }
    frames[3].values.fill(RawValue::MISSING);
    let ids: Vec<u32> = body.taxels.iter().map(|taxel| taxel.id).collect();
    let calibrated = somatic::Calibration::parse("[all]\np_max = 900\ndead_band = 20", &ids).unwrap();
    let outputs = somatic::Outputs::USUAL_AND_MOTION | somatic::Outputs::SPEED;
    for kind in backends().into_iter().filter(|kind| *kind != BackendKind::Reference) {
        for (calibration, arithmetic) in [
            (None, Arithmetic::OnePass),
            (None, Arithmetic::Compensated),
            (Some(calibrated.clone()), Arithmetic::OnePass),
            (Some(calibrated.clone()), Arithmetic::Compensated),
        ] {
            let scene = Scene::default().outputs(outputs).knobs(Knobs::default().arithmetic(arithmetic));
            let run = |cut: usize| {
                let (calibration, scene) = (calibration.clone(), scene.clone());
                let options = Options::default().backend(kind).batch(cut).calibration(calibration).scene(scene);
                let mut engine = Engine::new(&body, options).unwrap();
                let mut seen = Vec::new();
                for part in frames.chunks(cut) {
                    let percepts = engine.process(part).unwrap();
                    for frame in 0..part.len() {
                        let is_missing = seen.len() == 3;
                        assert!(percepts.frame(frame).all(|percept| percept.total.is_none() == is_missing));
                        seen.push(bits(percepts, frame));
                    }
                }
                seen
            };
            let (whole, apart) = (run(frames.len()), run(1));
            let differs = whole.iter().zip(&apart).position(|(a, b)| a != b);
            assert_eq!(differs, None, "{kind:?}, {arithmetic:?}, calibrated: {}", calibration.is_some());
        }
    }
}

#[test]
fn percepts_do_not_depend_on_the_order_of_channels() {
    let body = Body::from_bytes("hand", somatic::bundled::HAND).unwrap();
    let frames = recording(&body, 50);
    let ids: Vec<u32> = body.taxels.iter().map(|taxel| taxel.id).collect();
    let order: Vec<usize> = (0..ids.len()).map(|i| (i * 7 + 3) % ids.len()).collect();
    let mixed_ids: Vec<u32> = order.iter().map(|&i| ids[i]).collect();
    let mixed: Vec<Frame> = frames
        .iter()
        .map(|f| Frame { t_s: f.t_s, values: order.iter().map(|&i| f.values[i]).collect(), ..Frame::default() })
        .collect();
    for kind in backends() {
        let straight = run(&body, kind, &frames, 10, None);
        assert_eq!(run(&body, kind, &mixed, 10, Some(&mixed_ids)), straight, "{kind:?}");
        assert_ne!(
            run(&body, kind, &mixed, 10, None),
            straight,
            "{kind:?}: the order should matter if it is not reported"
        );
    }
}
