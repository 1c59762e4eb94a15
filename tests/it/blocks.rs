//! Frames in one slice give the bits that the same frames give one by one, and are read where they lie.

use glam::{DQuat, DVec3};
use somatic::internal::signal::FrameBlock;
use somatic::signal::Pose;
use somatic::{
    BackendKind, Body, COLUMNS, Calibration, Engine, Frame, Options, Outputs, Percepts, RawValue, Scene, bundled,
};

use crate::batches::{bits, recording};
use crate::common::backends;

/// Times, values and poses by link.
type Flattened = (Vec<f64>, Vec<RawValue>, Vec<(String, Vec<Pose>)>);

/// A block of `frames`.
fn flat(frames: &[Frame]) -> Flattened {
    let values = frames.iter().flat_map(|frame| frame.values.iter().copied()).collect();
    let links = frames[0].pose.iter().enumerate();
    let poses = links.map(|(at, (link, _))| (link.clone(), frames.iter().map(|frame| frame.pose[at].1).collect()));
    (frames.iter().map(|frame| frame.t_s).collect(), values, poses.collect())
}

fn engine(body: &Body, kind: BackendKind, calibration: &str, fields: &[&str]) -> Engine {
    let ids: Vec<u32> = body.taxels.iter().map(|taxel| taxel.id).collect();
    let calibration = Calibration::parse(calibration, &ids).unwrap();
    let scene = Scene::default().outputs(Outputs::all()).fields(fields.iter().copied());
    Engine::new(body, Options::default().backend(kind).batch(64).calibration(calibration).scene(scene)).unwrap()
}

fn all_bits(percepts: &Percepts) -> Vec<Vec<String>> {
    (0..percepts.frames()).map(|frame| bits(percepts, frame)).collect()
}

#[test]
fn a_block_gives_the_bits_of_its_frames() {
    let body = Body::from_bytes("humanoid", bundled::HUMANOID).unwrap();
    let mut frames = recording(&body, 60);
    for (index, frame) in frames.iter_mut().enumerate() {
        let pose = Pose { translation: DVec3::X * index as f64, rotation: DQuat::IDENTITY };
        frame.pose = vec![(body.links[0].name.clone(), pose)];
    }
    let (t_s, values, poses) = flat(&frames);
    let block = FrameBlock { t_s: &t_s, values: &values, poses: &poses };
    // Read where they are, gathered, and only a part of them.
    let ways = [("", &[][..]), ("[checks]\nisolated_ratio = 3", &[][..]), ("", &["**/forearm*"][..])];
    for kind in backends() {
        for (calibration, fields) in ways {
            let mut one = engine(&body, kind, calibration, fields);
            let wanted = all_bits(one.process(&frames).unwrap());
            let mut other = engine(&body, kind, calibration, fields);
            assert_eq!(all_bits(other.process_block(&block).unwrap()), wanted, "{kind:?}");
            // In parts, and what comes after it.
            let mut other = engine(&body, kind, calibration, fields);
            let mut done = Vec::new();
            let parts = other.process_block_while(&block, |frames| {
                done.push(frames);
                true
            });
            assert_eq!(all_bits(parts.unwrap().unwrap()), wanted, "{kind:?}");
            assert_eq!(done.last(), Some(&frames.len()));
            let after = frames[..20].to_vec();
            assert_eq!(all_bits(other.process(&after).unwrap()), all_bits(one.process(&after).unwrap()));
            // The comparison itself can fail.
            let mut changed = values.clone();
            changed.swap(0, 200);
            let changed = FrameBlock { values: &changed, ..block };
            let mut other = engine(&body, kind, "", &[]);
            assert_ne!(all_bits(other.process_block(&changed).unwrap()), wanted);
        }
    }
}

#[test]
fn an_interrupted_call_leaves_the_engine_where_it_was() {
    let body = Body::from_bytes("humanoid", bundled::HUMANOID).unwrap();
    let frames = recording(&body, 300);
    let (t_s, values, poses) = flat(&frames);
    let block = FrameBlock { t_s: &t_s, values: &values, poses: &poses };
    for kind in backends() {
        let calibration = "[checks]\nsettle_frames = 3";
        let wanted = all_bits(engine(&body, kind, calibration, &[]).process_block(&block).unwrap());
        let mut interrupted = engine(&body, kind, calibration, &[]);
        let mut asked = 0;
        let stopped = interrupted.process_block_while(&block, |done| {
            asked += 1;
            done < 256
        });
        assert!(stopped.unwrap().is_none() && asked == 1);
        assert_eq!(interrupted.percepts().frames(), 0);
        assert_eq!(all_bits(interrupted.process_block(&block).unwrap()), wanted, "{kind:?}");
    }
}

#[test]
fn a_block_of_another_shape_is_refused() {
    let body = Body::from_bytes("hand", bundled::HAND).unwrap();
    let mut engine = engine(&body, BackendKind::Cpu, "", &[]);
    let values = vec![RawValue::new(1.0); 2 * body.taxels.len() - 1];
    let block = FrameBlock { t_s: &[0.0, 1.0], values: &values, poses: &[] };
    let why = engine.process_block(&block).unwrap_err().to_string();
    assert_eq!(why, "there are 79 values, and 2 frames of 40 values take 80");
    let poses = [("hand".to_owned(), Vec::new())];
    let values = vec![RawValue::new(1.0); body.taxels.len()];
    let block = FrameBlock { t_s: &[0.0], values: &values, poses: &poses };
    assert_eq!(engine.process_block(&block).unwrap_err().to_string(), "link `hand` has 0 poses for 1 frames");
    let pose = Pose { translation: DVec3::ZERO, rotation: DQuat::IDENTITY };
    let poses = [("hnad".to_owned(), vec![pose])];
    let block = FrameBlock { t_s: &[0.0], values: &values, poses: &poses };
    let why = engine.process_block(&block).unwrap_err().to_string();
    assert!(why.ends_with("did you mean `hand`?"), "{why}");
    assert_eq!(engine.process_block(&FrameBlock::default()).unwrap().frames(), 0);
}

#[test]
fn percepts_that_are_taken_keep_what_they_say_and_lend_their_memory() {
    let body = Body::from_bytes("hand", bundled::HAND).unwrap();
    for kind in backends() {
        let mut engine = engine(&body, kind, "", &[]);
        let frames = recording(&body, 40);
        let wanted = all_bits(engine.process(&frames[..20]).unwrap());
        let first = engine.take_percepts(None);
        let later = all_bits(engine.process(&frames[20..]).unwrap());
        assert_eq!(all_bits(&first), wanted);
        let second = engine.take_percepts(Some(first));
        assert_eq!(all_bits(&second), later);
        let third = all_bits(engine.process(&frames[..20]).unwrap());
        // Other fields have no use for the memory.
        let mut other = self::engine(&body, kind, "", &["hand/back"]);
        other.take_percepts(Some(second));
        assert_eq!(other.process(&frames[..20]).unwrap().fields(), 1);
        assert_ne!(third, wanted, "touches go on");
    }
}

#[test]
fn columns_are_percepts_one_after_the_other() {
    use somatic::percept::ColumnValues::{F32, F64, U32};
    let body = Body::from_bytes("hand", bundled::HAND).unwrap();
    let frames = recording(&body, 30);
    for kind in backends() {
        let mut engine = engine(&body, kind, "[all]\nnoise = 1\nunit = \"Pa\"\n[layer]\nsigma_m = 0.002", &[]);
        let percepts = engine.process(&frames).unwrap();
        let mut there = 0;
        for column in COLUMNS.iter().filter(|column| !Outputs::OF_OTHER_LETTERS.contains(column.output)) {
            let values = percepts.column(column).unwrap();
            let value = |at: usize| match &values {
                F32(values) => values[at].into(),
                F64(values) => values[at],
                U32(values) => values[at].into(),
            };
            let presence: Vec<bool> = percepts.presence(column.output).collect();
            for (cell, present) in presence.into_iter().enumerate() {
                let (frame, field) = (cell / percepts.fields(), cell % percepts.fields());
                let wanted = percepts.value(frame, field, column);
                assert_eq!(present, wanted.is_some());
                for component in 0..column.components {
                    let got = value(cell * column.components + component);
                    match wanted {
                        Some(wanted) => assert_eq!(got.to_bits(), wanted[component].to_bits(), "{}", column.name),
                        None => assert!(got.is_nan() || (matches!(values, U32(_)) && got == 0.0)),
                    }
                }
                there += usize::from(present);
            }
        }
        assert!(there > 1000, "{there}");
        assert_eq!(percepts.all_flags().len(), percepts.frames() * percepts.fields());
        assert_eq!(percepts.times_s()[3], percepts.t_s(3));
        let scene = Scene::default().outputs(Outputs::TOTAL);
        let mut few = Engine::new(&body, Options::default().backend(kind).scene(scene)).unwrap();
        assert!(few.process(&frames).unwrap().column(&COLUMNS[1]).is_none());
    }
}
