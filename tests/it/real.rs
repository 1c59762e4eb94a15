//! Real recordings, dirt and all, on every backend. They are not part of the project; without them this is a skip.

use std::collections::BTreeSet;

use glam::DVec3;
use somatic::body::{FieldSpec, MemberSpec, Modality, Taxel};
use somatic::internal::body::Glb;
use somatic::source::{CsvSource, Source};
use somatic::{Agreement, BackendKind, Body, Calibration, Engine, Flags, Frame, Options, Percepts};

use crate::common::{backends, data};

/// All frames of a recording, and the ids they are for.
fn read(path: &std::path::Path) -> (Vec<u32>, Vec<Frame>) {
    let mut source = CsvSource::open(path, None).unwrap();
    let ids = source.taxels().to_vec();
    let mut frames = Vec::new();
    let mut frame = Frame::missing(0.0, ids.len());
    while source.next_frame(&mut frame).unwrap() {
        frames.push(frame.clone());
    }
    (ids, frames)
}

fn run(body: &Body, calibration: &str, kind: BackendKind, ids: &[u32], frames: &[Frame]) -> (Percepts, Agreement) {
    let all: Vec<u32> = body.taxels.iter().map(|taxel| taxel.id).collect();
    let calibration = Some(Calibration::parse(calibration, &all).unwrap());
    let mut engine = Engine::new(body, Options::default().backend(kind).batch(64).calibration(calibration)).unwrap();
    engine.set_channels(ids).unwrap();
    let (percepts, agreement) = engine.process_and_compare(frames).unwrap();
    (percepts.clone(), agreement)
}

fn field(body: &Body, name: &str) -> usize {
    body.fields.iter().position(|field| field.name == name).unwrap()
}

const MAT: &str = include_str!("../../bodies/mat.toml");

#[test]
fn six_postures_on_the_mat() {
    let Some(folder) = data("recordings/mat") else { return };
    let body = Body::from_bytes("mat", somatic::bundled::MAT).unwrap();
    let mut ranged = 0;
    for posture in 1..=6 {
        let (ids, frames) = read(&folder.join(format!("posture_{posture}.csv")));
        for kind in backends() {
            let (percepts, agreement) = run(&body, MAT, kind, &ids, &frames);
            println!("posture {posture} on {kind:?} {agreement}");
            assert!(agreement.holds(), "posture {posture} on {kind:?}: {agreement}");
            // The partial first frame and the byte-swapped second: marked, and nothing is said of a touch.
            for frame in 0..2 {
                for p in percepts.frame(frame) {
                    assert!(p.flags.contains(Flags::FAULTY_INPUT) && !p.contact && p.total.is_none(), "{frame} {p:?}");
                }
            }
            let whole = field(&body, "mat");
            for frame in 2..frames.len() {
                let p = percepts.get(frame, whole);
                assert!(p.contact && p.active.unwrap() > 1000, "{p:?}");
                // A value beyond the sensor's range is reported: as such, or as implausible if it is alone.
                let beyond = frames[frame].values.iter().any(|v| v.number().unwrap() > 1000.0);
                let is_flagged = p.flags.intersects(Flags::OUT_OF_RANGE | Flags::FAULTY_INPUT);
                assert!(is_flagged || !beyond, "posture {posture}, frame {frame}");
                assert!(beyond || !p.flags.contains(Flags::OUT_OF_RANGE), "posture {posture}, frame {frame}");
                ranged += u32::from(p.flags.contains(Flags::OUT_OF_RANGE));
                // The body lies along the mat.
                let [u, v] = p.centroid.unwrap();
                assert!(u.abs() < 0.3 && v.abs() < 0.4, "{p:?}");
            }
        }
    }
    assert!(ranged > 100, "{ranged}");
}

#[test]
fn without_its_calibration_the_mat_is_taken_at_its_word() {
    let Some(folder) = data("recordings/mat") else { return };
    let body = Body::from_bytes("mat", somatic::bundled::MAT).unwrap();
    let (ids, frames) = read(&folder.join("posture_1.csv"));
    let (percepts, _) = run(&body, "", BackendKind::Cpu, &ids, &frames[..3]);
    // The garbled frame's total is thirty times that of the sound one after it.
    let total = |frame: usize| percepts.get(frame, field(&body, "mat")).total.unwrap();
    assert!(total(1) > 25.0 * total(2) && percepts.get(1, 0).flags.is_empty());
}

#[test]
fn a_hot_taxel_is_left_out_and_reported() {
    let Some(folder) = data("recordings/mat") else { return };
    let body = Body::from_bytes("mat", somatic::bundled::MAT).unwrap();
    let (ids, frames) = read(&folder.join("posture_1.csv"));
    let hot = 1802;
    let holders: BTreeSet<usize> = (0..body.fields.len())
        .filter(|&f| body.fields[f].members.contains_key(&hot) || body.fields[f].name == "mat")
        .collect();
    for kind in backends() {
        let (checked, _) = run(&body, MAT, kind, &ids, &frames);
        let (trusting, _) = run(&body, "", kind, &ids, &frames);
        for frame in 2..frames.len() {
            for f in 0..body.fields.len() {
                let faulty = checked.get(frame, f).flags.contains(Flags::FAULTY_INPUT);
                assert!(!holders.contains(&f) || faulty, "frame {frame}, {}", body.fields[f].name);
            }
        }
        let v = |percepts: &Percepts| percepts.get(10, field(&body, "mat")).centroid.unwrap()[1];
        let moved = (v(&checked) - v(&trusting)).abs();
        println!("{kind:?}: one hot taxel moves the centroid of the body by {:.1} mm", moved * 1e3);
        assert!(moved > 0.25 * 0.0254, "{moved}");
    }
}

/// Five fingertips of twelve taxels, each a link of its own, with the field of each and of its flat side.
fn fingertips(layout: &str) -> Body {
    let rows: Vec<Vec<f64>> =
        layout.lines().skip(1).map(|l| l.split(',').map(|x| x.parse().unwrap()).collect()).collect();
    let mut glb = Glb::new();
    let hand = glb.node("hand", None, DVec3::ZERO);
    let mut all = FieldSpec { name: "hand".into(), ..FieldSpec::default() };
    for (finger, name) in ["thumb", "index", "middle", "ring", "little"].into_iter().enumerate() {
        let link = glb.node(name, Some(hand), DVec3::new(0.1, 0.0, 0.02 * finger as f64));
        let taxels: Vec<Taxel> = rows
            .iter()
            .map(|row| Taxel {
                id: finger as u32 * 12 + row[0] as u32,
                link: 0,
                position_in_link: DVec3::new(row[4], row[5], row[6]) * 1e-3,
                normal_in_link: DVec3::new(row[1], row[2], row[3]),
                area: 0.0,
                modality: Modality::Pressure,
                tangent_in_link: None,
            })
            .collect();
        glb.taxels(&format!("{name}_taxels"), Some(link), &taxels, None);
        let ids = |keep: &dyn Fn(&Taxel) -> bool| {
            taxels.iter().filter(|t| keep(t)).map(|t| (t.id, MemberSpec::default())).collect()
        };
        all.members.extend(taxels.iter().map(|t| (t.id, MemberSpec::default())));
        let whole = FieldSpec {
            name: format!("hand/{name}"),
            parent: Some("hand".into()),
            members: ids(&|_| true),
            chart: None,
        };
        let pad = FieldSpec {
            name: format!("hand/{name}/pad"),
            parent: Some(whole.name.clone()),
            members: ids(&|t| t.normal_in_link.y > 0.4),
            chart: None,
        };
        glb.field(&whole, Some(link), DVec3::ZERO);
        glb.field(&pad, Some(link), DVec3::ZERO);
    }
    glb.field(&all, Some(hand), DVec3::ZERO);
    Body::from_bytes("fingertips", &glb.to_bytes().unwrap()).unwrap()
}

#[test]
fn thirty_grasps_of_five_fingertips() {
    let (Some(folder), Some(layout)) = (data("recordings/icub_grasp"), data("layouts/ftx2_taxels.csv")) else { return };
    let body = fingertips(&std::fs::read_to_string(layout).unwrap());
    // Pressure lowers these counts.
    let calibration = "[all]\nbaseline = 244\ninvert = true\ndead_band = 4\nraw_range = [0, 255]\np_max = 244";
    let mut recordings = 0;
    let mut touched = 0;
    for entry in std::fs::read_dir(folder).unwrap() {
        let (ids, frames) = read(&entry.unwrap().path());
        recordings += 1;
        for kind in backends() {
            let (percepts, agreement) = run(&body, calibration, kind, &ids, &frames);
            assert!(agreement.holds(), "{kind:?}: {agreement}");
            for frame in 0..frames.len() {
                for p in percepts.frame(frame) {
                    let name = &body.fields[p.field].name;
                    let charted = name.ends_with("/pad");
                    // A fingertip wraps around itself; only its flat side has coordinates.
                    assert_eq!(p.flags.contains(Flags::NO_CHART), !charted, "{name}");
                    assert_eq!(p.centroid.is_some(), charted && p.contact, "{name}");
                    assert_eq!(p.position.is_some(), p.contact, "{name}");
                    touched += usize::from(p.contact);
                }
            }
        }
    }
    assert!(recordings == 30 && touched > 1000, "{recordings} recordings, {touched} touches");
}

#[test]
fn grasps_are_distinguished_by_how_much_the_total_rises() {
    let (Some(folder), Some(layout)) = (data("recordings/icub_grasp"), data("layouts/ftx2_taxels.csv")) else { return };
    let body = fingertips(&std::fs::read_to_string(layout).unwrap());
    let ids: Vec<u32> = (0..60).collect();
    let calibration = Calibration::parse("[all]\ninvert = true", &ids).unwrap();
    for backend in backends() {
        // The largest total over the five fingertips, above the trial's own first frame.
        let rises = |object: &str| -> Vec<f64> {
            (1..=5)
                .map(|trial| {
                    let (ids, frames) = read(&folder.join(format!("{object}_{trial}.csv")));
                    let calibration = Some(calibration.clone());
                    let options = Options::default().backend(backend).tare(true).calibration(calibration).batch(32);
                    let mut engine = Engine::new(&body, options).unwrap();
                    engine.set_channels(&ids).unwrap();
                    let (percepts, agreement) = engine.process_and_compare(&frames).unwrap();
                    assert!(agreement.holds(), "{agreement}");
                    let total = |frame| percepts.get(frame, field(&body, "hand")).total.unwrap();
                    (0..percepts.frames()).map(total).fold(0.0, f64::max)
                })
                .collect()
        };
        let ends =
            |rises: &[f64]| (rises.iter().copied().fold(f64::MAX, f64::min), rises.iter().copied().fold(0.0, f64::max));
        let (nothing, book, toy) = (ends(&rises("none")), ends(&rises("book")), ends(&rises("monkey_toy")));
        println!("{backend:?}: nothing {nothing:?}, book {book:?}, toy {toy:?}");
        assert!(nothing.1 < book.0 && book.1 < toy.0, "{backend:?}: {nothing:?} {book:?} {toy:?}");
    }
}
