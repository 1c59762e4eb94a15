//! The knobs of speed and accuracy: each does what it says, held to the reference by its own bound.

use somatic::scene::{Arithmetic, Cadence, Charts, Knobs, OrientationBy};
use somatic::{BackendKind, Body, Engine, Flags, Frame, Options, Outputs, Scene, bundled};

use crate::common::{Flat, backends, frame};

fn engine(body: &Body, backend: BackendKind, outputs: Outputs, knobs: Knobs) -> Engine {
    Engine::new(body, Options::default().scene(Scene::default().outputs(outputs).knobs(knobs)).backend(backend))
        .unwrap()
}

fn with(arithmetic: Arithmetic) -> Knobs {
    Knobs::default().arithmetic(arithmetic)
}

/// The backends of single precision.
fn single() -> impl Iterator<Item = BackendKind> {
    backends().into_iter().filter(|kind| *kind != BackendKind::Reference)
}

#[test]
fn a_million_taxels_add_up_only_with_compensation() {
    let side = 1000_u32;
    let uv: Vec<[f64; 2]> =
        (0..side * side).map(|i| [f64::from(i % side) * 1e-3, f64::from(i / side) * 1e-3]).collect();
    let body = Flat::new(&uv).field("field", None, 0..side * side).body();
    // Tenths are no binary fractions: each addition to a large sum errs to the same side.
    let frame = frame(0.0, &vec![0.1; uv.len()]);
    let outputs = Outputs::TOTAL | Outputs::CENTROID | Outputs::PRINCIPAL_AXIS | Outputs::ANISOTROPY;
    for kind in single() {
        let mut errors = Vec::new();
        for arithmetic in [Arithmetic::OnePass, Arithmetic::Compensated] {
            let mut engine = engine(&body, kind, outputs, with(arithmetic));
            let (percepts, agreement) = engine.process_and_compare(std::slice::from_ref(&frame)).unwrap();
            assert!(agreement.holds(), "{kind:?}, {arithmetic}: {agreement}");
            let total = percepts.get(0, 0).total.unwrap();
            // 0.1 as single precision has it.
            let right = f64::from(0.1_f32) * uv.len() as f64;
            errors.push((total - right).abs() / right);
        }
        // What compensation is held to: 12 roundings of 2⁻²⁴ and a tenth more. A naive sum must fail it, or this compares
        // nothing.
        let limit = 1.1 * 12.2 / f64::from(1 << 24);
        assert!(errors[0] > limit && errors[1] <= limit, "{kind:?}: {errors:?}, {limit:e}");
    }
}

#[test]
fn compensated_percepts_agree_with_the_reference_within_their_own_bound() {
    for (name, bytes) in [("hand", bundled::HAND), ("humanoid", bundled::HUMANOID)] {
        let body = Body::from_bytes(name, bytes).unwrap();
        let frames: Vec<Frame> = (0..40)
            .map(|turn| {
                let value = |index: usize| ((index * 7919 + turn * 131) % 1024) as f64 / 7.0 - 40.0;
                frame(turn as f64 * 0.01, &(0..body.taxels.len()).map(value).collect::<Vec<_>>())
            })
            .collect();
        for kind in single() {
            let mut engine = engine(&body, kind, Outputs::USUAL_AND_MOTION, with(Arithmetic::Compensated));
            for frames in [&frames[..1], &frames[1..]] {
                let (_, agreement) = engine.process_and_compare(frames).unwrap();
                assert!(agreement.holds(), "{name}, {kind:?}: {agreement}");
            }
        }
    }
}

#[test]
fn double_precision_is_the_references_wherever_it_is_asked_for() {
    let body = Body::from_bytes("hand", bundled::HAND).unwrap();
    let values: Vec<f64> = (0..body.taxels.len()).map(|index| (index * 37 % 101) as f64).collect();
    let answer = |backend, arithmetic| {
        let knobs = Knobs::default().arithmetic(arithmetic);
        let mut engine = engine(&body, backend, Outputs::USUAL_AND_MOTION, knobs);
        assert_eq!(engine.backend().name, "reference");
        format!("{:?}", engine.process(&[frame(0.0, &values)]).unwrap())
    };
    let right = answer(BackendKind::Reference, None);
    for backend in [BackendKind::Auto, BackendKind::Cpu, BackendKind::Reference] {
        assert_eq!(answer(backend, Some(Arithmetic::Double)), right);
    }
}

#[test]
fn what_a_backend_cannot_do_is_refused_in_a_line() {
    let body = Body::from_bytes("hand", bundled::HAND).unwrap();
    for (backend, arithmetic, what) in [
        (BackendKind::Gpu, Arithmetic::Double, "shaders have no double precision"),
        (BackendKind::Reference, Arithmetic::OnePass, "always in double precision"),
        (BackendKind::Reference, Arithmetic::Compensated, "always in double precision"),
    ] {
        let scene = Scene::default().knobs(with(arithmetic));
        let error = Engine::new(&body, Options::default().scene(scene).backend(backend)).err().unwrap();
        assert!(error.is_usage() && error.to_string().contains(what), "{error}");
    }
}

#[test]
fn second_moments_take_the_place_of_two_points_and_their_work() {
    let body = Body::from_bytes("hand", bundled::HAND).unwrap();
    let stages = |orientation_by| {
        let knobs = Knobs::default().orientation_by(orientation_by);
        let engine = engine(&body, BackendKind::Cpu, Outputs::ORIENTATION, knobs);
        let running = engine.plan().explain().into_iter().filter(|stage| stage.runs);
        (engine.plan().outputs(), running.map(|stage| stage.name).collect::<Vec<_>>())
    };
    let two = (Outputs::ORIENTATION, vec!["calibrate", "contact", "centroid", "orientation"]);
    assert_eq!(stages(OrientationBy::AsAsked), two);
    assert_eq!(stages(OrientationBy::TwoPoints), two);
    assert_eq!(
        stages(OrientationBy::SecondMoments),
        (Outputs::PRINCIPAL_AXIS, vec!["calibrate", "contact", "centroid", "principal_axis"])
    );
    let knobs = Knobs::default().orientation_by(OrientationBy::SecondMoments);
    let scene = Scene::default().outputs(Outputs::TOTAL).knobs(knobs);
    let error = Engine::new(&body, Options::default().scene(scene)).err().unwrap();
    assert!(error.is_usage() && error.to_string().contains("add output `orientation`"), "{error}");
}

#[test]
fn charts_of_the_other_kind_agree_with_the_reference_in_them() {
    let body = Body::from_bytes("humanoid", bundled::HUMANOID).unwrap();
    let values: Vec<f64> = (0..body.taxels.len()).map(|index| (index * 37 % 101) as f64).collect();
    let mut centroids = Vec::new();
    for charts in [Charts::AsAuthored, Charts::Plane, Charts::Geodesic] {
        let outputs = Outputs::CENTROID | Outputs::ORIENTATION | Outputs::POSITION;
        let mut engine = engine(&body, BackendKind::Cpu, outputs, Knobs::default().charts(charts));
        let (percepts, agreement) = engine.process_and_compare(&[frame(0.0, &values)]).unwrap();
        assert!(agreement.holds(), "{charts}: {agreement}");
        centroids.push(percepts.frame(0).map(|percept| percept.centroid).collect::<Vec<_>>());
        let kept: Vec<String> = engine.kept_charts().map(|(name, why)| format!("{name}: {why}")).collect();
        assert!(charts != Charts::AsAuthored || kept.is_empty(), "{kept:?}");
    }
    assert!(centroids[1] != centroids[0] && centroids[2] != centroids[1]);
}

/// A row of taxels 1 cm apart in two fields.
fn row() -> Body {
    let uv: Vec<[f64; 2]> = (0..8).map(|id| [f64::from(id) * 0.01, 0.0]).collect();
    Flat::new(&uv).field("left", None, 0..4).field("right", None, 4..8).body()
}

#[test]
fn a_field_is_looked_at_when_it_changes_and_moves_from_change_to_change() {
    // A touch moves a centimetre every tenth frame, and values are repeated in between.
    let frames: Vec<Frame> = (0..40_usize)
        .map(|turn| {
            let at = turn / 10;
            frame(turn as f64 * 0.001, &(0..8).map(|id| if id == at { 5.0 } else { 0.0 }).collect::<Vec<_>>())
        })
        .collect();
    let knobs = Knobs::default().cadence(Cadence::OnChange);
    for kind in backends() {
        let mut seen: Vec<Vec<String>> = Vec::new();
        for at_once in [1, 7, 40] {
            let mut engine = engine(&row(), kind, Outputs::USUAL_AND_MOTION, knobs);
            let mut said = Vec::new();
            for frames in frames.chunks(at_once) {
                let (percepts, agreement) = engine.process_and_compare(frames).unwrap();
                assert!(agreement.holds(), "{kind:?}: {agreement}");
                for index in 0..frames.len() {
                    let (left, right) = (percepts.get(index, 0), percepts.get(index, 1));
                    let turn = said.len();
                    assert!(left.contact && !right.contact);
                    match turn {
                        0..10 => assert!(left.flags.contains(Flags::NO_PREVIOUS)),
                        // A centimetre in ten frames, not in the last of them; and reported until there is news.
                        _ => assert!((left.speed.unwrap() - 1.0).abs() < 1e-5, "{kind:?}, {turn}: {left:?}"),
                    }
                    said.push(format!("{left:?} {right:?}"));
                }
            }
            seen.push(said);
        }
        assert!(seen[0] == seen[1] && seen[1] == seen[2], "{kind:?}");
        // In every frame, the touch stands still, and then leaps.
        let mut every = engine(&row(), kind, Outputs::USUAL_AND_MOTION, Knobs::default());
        let percepts = every.process(&frames).unwrap();
        assert!(percepts.get(15, 0).flags.contains(Flags::STILL));
        assert!((percepts.get(20, 0).speed.unwrap() - 10.0).abs() < 1e-4);
    }
}

#[test]
fn a_field_that_changes_in_every_frame_has_the_same_bits_on_change() {
    let body = Body::from_bytes("humanoid", bundled::HUMANOID).unwrap();
    let value = |turn: usize, index: usize| ((index * 7919 + turn * 131) % 1024) as f64;
    let frames: Vec<Frame> = (0..20)
        .map(|turn| frame(turn as f64 * 0.01, &(0..body.taxels.len()).map(|i| value(turn, i)).collect::<Vec<_>>()))
        .collect();
    let percepts = |cadence| {
        let mut engine = engine(&body, BackendKind::Cpu, Outputs::USUAL_AND_MOTION, Knobs::default().cadence(cadence));
        format!("{:?}", engine.process(&frames).unwrap())
    };
    assert_eq!(percepts(Cadence::OnChange), percepts(Cadence::EveryFrame));
}

#[test]
fn a_cadence_and_what_it_makes_no_sense_with_are_refused() {
    let body = Body::from_bytes("hand", bundled::HAND).unwrap();
    let knobs = Knobs::default().cadence(Cadence::OnChange);
    let letters = somatic::Letter::all_of(&[somatic::Receptor::Change], &[]);
    let change = Scene::default().knobs(knobs).letters(letters);
    let filtered = Scene::default().knobs(knobs).outputs(Outputs::FILTERED_SPEED);
    for (scene, what) in [(change, "letter `change`"), (filtered, "filtered_*")] {
        let error = Engine::new(&body, Options::default().scene(scene)).err().unwrap();
        assert!(error.is_usage() && error.to_string().contains(what), "{error}");
    }
}
