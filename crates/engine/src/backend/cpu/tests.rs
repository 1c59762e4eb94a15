//! Percepts have the same bits on every set of instructions, in batches and frame by frame.

use fearless_simd::Level;
use glam::{DAffine3, DVec3};

use super::lanes::{LANES, levels};
use super::*;
use crate::backend::raw::{Near, Picks};
use crate::backend::{Delivered, Rows, Step};
use crate::body::{Body, FieldSpec, Link, MemberSpec, Modality, Taxel};
use crate::field::FieldSet;
use crate::percept::{Flags, Outputs, Precision};
use crate::scene::{Arithmetic, Coverage, Knobs, PlanField, Scene};
use crate::signal::{Calibration, Frame, Letter, Receptor};

const HAND: &[u8] = somatic_bodies::HAND;
const HUMANOID: &[u8] = somatic_bodies::HUMANOID;

/// `frames` frames for `plan`: pressed here and there, with everything in between that a value can be.
fn values(plan: &Plan, frames: usize) -> Vec<RawValue> {
    let mut state = 7_u64;
    let mut random = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 40) as f64 / f64::from(1 << 24)
    };
    let odd = [f64::NAN, 1e30, 1e-30, -5.0, 1e18, 0.0, 1e-12];
    (0..frames * plan.channels())
        .map(|index| match (random(), index / plan.channels() % 16) {
            // Whole stretches without a fault, and frames that nobody touches.
            (_, 3) => RawValue::new(0.0),
            (chance, 0..8) if chance < 0.01 => RawValue::MISSING,
            (chance, 0..8) if chance < 0.03 => RawValue::new(odd[(chance * 1e4) as usize % odd.len()]),
            (chance, _) if chance < 0.5 => RawValue::new(0.0),
            (chance, _) => RawValue::new((chance * 2000.0).floor() / 2.0 - 450.0),
        })
        .collect()
}

/// The same where most of the skin rests: every twenty frames another ninth of it is touched, and elsewhere a value is
/// missing now and then.
fn mostly_at_rest(mut raw: Vec<RawValue>, channels: usize) -> Vec<RawValue> {
    for (index, value) in raw.iter_mut().enumerate() {
        let (frame, channel) = (index / channels, index % channels);
        let is_touched = channel * 9 / channels == frame / 20 % 9;
        if !is_touched && (frame * 7 + channel) % 9973 != 0 {
            *value = RawValue::new(0.0);
        } else if !is_touched {
            *value = RawValue::MISSING;
        }
    }
    raw
}

/// Frames touched all over, and where most of the skin rests.
fn recordings(plan: &Plan, frames: usize) -> [Vec<RawValue>; 2] {
    let all_over = values(plan, frames);
    [mostly_at_rest(all_over.clone(), plan.channels()), all_over]
}

fn plan_of(body: &Body, scene: &Scene) -> Plan {
    Plan::new(body, &FieldSet::new(body).unwrap(), scene, &Calibration::identity(body.taxels.len())).unwrap()
}

fn run(plan: &Plan, level: Level, raw: &[RawValue], frames: usize, at_once: usize) -> Percepts {
    run_rows(plan, level, Rows::Packed { values: raw, channels: plan.channels() }, frames, at_once)
}

fn run_rows(plan: &Plan, level: Level, rows: Rows<'_>, frames: usize, at_once: usize) -> Percepts {
    let mut cpu = Cpu::with_level(plan, level);
    let mut percepts = Percepts::new(plan.outputs, plan.fields.len(), Precision::F32)
        .with_columns(plan.columns, plan.kept_pressures())
        .with_letters(plan.letter_by_field());
    percepts.reset(frames);
    let steps = vec![Step { dt_s: 0.01, flags: Flags::empty() }; frames];
    for first in (0..frames).step_by(at_once) {
        let count = at_once.min(frames - first);
        let raw = RawBatch { first, frames: count, rows: rows.part(first..first + count), steps: &steps[..count] };
        cpu.run(&raw, &mut percepts).unwrap();
    }
    percepts
}

#[test]
fn bits_do_not_depend_on_instructions_or_on_what_stands_abreast() {
    const FRAMES: usize = 53;
    for (name, bytes) in [("hand", HAND), ("humanoid", HUMANOID)] {
        let body = Body::from_bytes(name, bytes).unwrap();
        let letters = Letter::all_of(&[Receptor::Sustained, Receptor::Change], &[]);
        let scene = Scene { outputs: Outputs::all(), letters, ..Scene::default() };
        let knobs = Knobs { arithmetic: Some(Arithmetic::Compensated), ..Knobs::default() };
        let scenes = [scene.clone(), Scene { knobs, ..scene }];
        let ids: Vec<u32> = body.taxels.iter().map(|taxel| taxel.id).collect();
        let calibration = Calibration::parse("[all]\nbaseline = 1\ngain = 0.7\np_max = 300", &ids).unwrap();
        let calibrations = [Calibration::identity(ids.len()), calibration];
        for (scene, calibration) in scenes.iter().flat_map(|scene| calibrations.iter().map(move |c| (scene, c))) {
            let plan = Plan::new(&body, &FieldSet::new(&body).unwrap(), scene, calibration).unwrap();
            assert!(name == "hand" || plan.fields.iter().any(PlanField::is_wide));
            for raw in recordings(&plan, FRAMES) {
                let right = run(&plan, Level::new(), &raw, FRAMES, 1);
                assert!((0..FRAMES).any(|frame| right.touched(frame).next().is_some()));
                for level in levels() {
                    for at_once in [1, 7, 16, FRAMES] {
                        let also = run(&plan, level, &raw, FRAMES, at_once);
                        assert!(right == also, "{name}, {level:?}, {at_once} at once");
                    }
                }
            }
        }
    }
}

#[test]
fn much_of_a_skin_rests_and_has_the_same_bits() {
    const FRAMES: usize = 64;
    let body = Body::from_bytes("humanoid", HUMANOID).unwrap();
    let scene = Scene { outputs: Outputs::all(), ..Scene::default() };
    let plan = plan_of(&body, &scene);
    let raw = mostly_at_rest(values(&plan, FRAMES), plan.channels());
    let right = run(&plan, Level::new(), &raw, FRAMES, 1);
    assert!(right == run(&plan, Level::new(), &raw, FRAMES, FRAMES));
    let rest = window::Rest::new(&plan.fields, &plan.members);
    let rests = |block: usize| {
        let pressed = |tile: usize| {
            let channels = tile * LANES..plan.channels().min((tile + 1) * LANES);
            (block * LANES..(block + 1) * LANES)
                .flat_map(|frame| &raw[frame * plan.channels()..][channels.clone()])
                .any(|value| value.number() != Some(0.0))
        };
        (0..plan.fields.len()).filter(|&field| rest.has_at_rest(field, |tile| !pressed(tile))).count()
    };
    let (resting, all) = ((0..FRAMES / LANES).map(rests).sum::<usize>(), plan.fields.len() * FRAMES / LANES);
    assert!(resting > all / 3 && resting < all, "{resting} of {all}");
}

/// Where [`sheet`] is folded back.
const FOLD: u32 = 20_000;

/// Rows of taxels on a sheet, and fields of sixteen that follow each other, each over half of the one before.
fn sheet(taxels: u32) -> Body {
    const COLUMNS: u32 = 100;
    let taxel = |id| Taxel {
        id,
        link: 0,
        position_in_link: DVec3::new(f64::from(id % COLUMNS), 0.0, f64::from(id / COLUMNS)) * 0.005,
        normal_in_link: if id < FOLD { DVec3::Y } else { -DVec3::Y },
        area: 25e-6,
        modality: Modality::Pressure,
        tangent_in_link: None,
    };
    let field = |first: u32| FieldSpec {
        name: format!("field {first}"),
        members: (first..first + 16).map(|id| (id, MemberSpec::default())).collect(),
        ..FieldSpec::default()
    };
    let link = Link {
        name: "sheet".to_owned(),
        parent: None,
        body_from_link: DAffine3::IDENTITY,
        link_from_node: DAffine3::IDENTITY,
        joint: None,
        urdf_up: None,
    };
    Body {
        name: "sheet".to_owned(),
        fields: (0..taxels - 15).step_by(8).map(field).collect(),
        links: vec![link],
        surfaces: Vec::new(),
        taxels: (0..taxels).map(taxel).collect(),
        edges: None,
        findings: Vec::new(),
        kept: Default::default(),
    }
}

/// `raw` in frames of `width` values as a source would deliver them, each channel's at the place in `channels`.
fn delivered(raw: &[RawValue], channels: &[u32], width: usize) -> Vec<Frame> {
    raw.chunks(channels.len())
        .map(|values| {
            let mut frame = Frame::missing(0.0, width);
            channels.iter().zip(values).for_each(|(&place, &value)| frame.values[place as usize] = value);
            frame
        })
        .collect()
}

#[test]
fn bits_do_not_depend_on_how_much_of_a_skin_is_at_hand() {
    const FRAMES: usize = 37;
    let body = sheet(30_000);
    for outputs in [Outputs::USUAL_AND_MOTION, Outputs::USUAL_AND_MOTION - Outputs::MOTION] {
        let plan = plan_of(&body, &Scene { outputs, ..Scene::default() });
        let window = window::Window::new(&plan);
        assert!(window.slots() < plan.slots() && window.stretches().len() > 3);
        same_bits_however_cut(&plan, FRAMES);
    }
}

#[test]
fn a_frame_that_all_cores_share_has_the_same_bits() {
    const FRAMES: usize = 37;
    let body = sheet(36_000);
    for letters in [Vec::new(), Letter::all_of(&[Receptor::Sustained, Receptor::Change], &[])] {
        // Nothing is left out, as then there is little to share.
        let knobs = Knobs { coverage: Coverage::All, ..Knobs::default() };
        let mut scene = Scene { outputs: Outputs::USUAL_AND_MOTION - Outputs::MOTION, knobs, ..Scene::default() };
        if !letters.is_empty() {
            scene.letters = letters;
        }
        let plan = plan_of(&body, &scene);
        assert!(live::is_shared(&plan, 2) && !live::is_shared(&plan, 1));
        // Frames with faults in some parts of the skin, where those before had others, and frames without any.
        let raw = mostly_at_rest(values(&plan, FRAMES), plan.channels());
        for level in levels() {
            let right = run(&plan, level, &raw, FRAMES, FRAMES);
            for threads in [1, 2, 3] {
                let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
                let shared = pool.install(|| run(&plan, level, &raw, FRAMES, 1));
                assert!(right == shared, "{level:?}, {threads} threads");
            }
        }
    }
}

#[test]
fn fields_wider_than_what_is_at_hand_have_the_same_bits() {
    const FRAMES: usize = 37;
    let wide = |name: &str, members: Vec<u32>| FieldSpec {
        name: name.to_owned(),
        members: members.into_iter().map(|id| (id, MemberSpec { weight: 1.0 + f64::from(id % 7), uv: None })).collect(),
        ..FieldSpec::default()
    };
    let mut body = sheet(30_000);
    // Among the others, as charted fields and on both sides of the fold, where there is no chart.
    body.fields.insert(5, wide("all", (0..30_000).step_by(2).collect()));
    body.fields.push(wide("one side", (0..FOLD).filter(|id| id % 5 != 1).collect()));
    for outputs in [Outputs::USUAL_AND_MOTION, Outputs::TOTAL, Outputs::CENTROID, Outputs::PRINCIPAL_AXIS] {
        let plan = plan_of(&body, &Scene { outputs, ..Scene::default() });
        assert_eq!(window::Window::new(&plan).slots(), plan.slots());
        same_bits_however_cut(&plan, FRAMES);
    }
}

fn same_bits_however_cut(plan: &Plan, frames: usize) {
    for raw in recordings(plan, frames) {
        // A frame alone has all of it.
        let right = run(plan, Level::new(), &raw, frames, 1);
        let channels: Vec<u32> = (0..plan.channels() as u32).map(|channel| channel + channel / 7).collect();
        let width = 35_000;
        let (rows, picks) = (delivered(&raw, &channels, width), Picks::new(&channels, plan.calibrated(), width));
        for level in levels() {
            assert!(right == run(plan, level, &raw, frames, frames), "{level:?}");
            let rows = Rows::Picked { frames: Delivered::Frames(&rows), picks: &picks };
            assert!(right == run_rows(plan, level, rows, frames, frames), "{level:?}, as delivered");
        }
    }
}

#[test]
fn bits_do_not_depend_on_where_values_lie() {
    const FRAMES: usize = 217;
    let body = sheet(1000);
    let plan = plan_of(&body, &Scene { outputs: Outputs::USUAL_AND_MOTION - Outputs::MOTION, ..Scene::default() });
    // In frames as they come some values are nobody's, some lie one after the other, some the other way round, and some come
    // from two, four and five boards in turn.
    let in_turn = |index: u32, boards: u32, apart: u32| index % boards * apart + index / boards;
    let place = |channel: u32| match channel {
        0..200 => channel * 5 / 4,
        200..400 => channel + 100,
        400..500 => 1099 - channel,
        500..600 => 700 + in_turn(channel - 500, 2, 50),
        600..800 => 800 + in_turn(channel - 600, 4, 50),
        _ => 1000 + in_turn(channel - 800, 5, 40),
    };
    let channels: Vec<u32> = (0..plan.channels() as u32).map(place).collect();
    let picks = Picks::new(&channels, plan.calibrated(), 1203);
    assert!(picks.near.iter().any(|near| matches!(near, Near::Straight(_))));
    assert!(picks.near.iter().any(|near| matches!(near, Near::Scattered)));
    for shuffles in [1, 2, 4] {
        assert!(picks.near.iter().any(|near| matches!(near, Near::Shuffled { count, .. } if *count == shuffles)));
    }
    for raw in recordings(&plan, FRAMES) {
        let right = run(&plan, Level::new(), &raw, FRAMES, 1);
        let frames = delivered(&raw, &channels, 1203);
        let rows = Rows::Picked { frames: Delivered::Frames(&frames), picks: &picks };
        for level in levels() {
            assert!(right == run_rows(&plan, level, rows, FRAMES, FRAMES), "{level:?}");
        }
    }
}

#[test]
fn fields_of_few_taxels_have_the_same_bits() {
    const FRAMES: usize = 53;
    let mut body = sheet(FOLD + 1000);
    let mut next = 0;
    // Each size in runs that mostly end within sixteen fields, two of three weighted, one field over the fold.
    body.fields = (0..)
        .map_while(|index: u32| {
            let taxels = [1, 2, 1, 4, 16, 3, 2, 1, 5][index as usize / 75 % 9];
            let weight = |id: u32| if index % 450 < 150 { 1.0 } else { f64::from(1 + id % 3) };
            let members = (next..next + taxels).map(|id| (id, MemberSpec { weight: weight(id), uv: None })).collect();
            next += taxels;
            (next <= FOLD + 1000).then(|| FieldSpec { name: format!("field {index}"), members, ..FieldSpec::default() })
        })
        .collect();
    let sums = Outputs::TOTAL | Outputs::ACTIVE | Outputs::CENTROID;
    // In a window that slides, without one, and fewer than stand abreast.
    for fields in [body.fields.len(), 107, 7] {
        body.fields.truncate(fields);
        for outputs in [Outputs::USUAL_AND_MOTION - Outputs::MOTION, sums | Outputs::ORIENTATION, sums] {
            let plan = plan_of(&body, &Scene { outputs, ..Scene::default() });
            let is_large = fields > 1000;
            assert_eq!(window::Window::new(&plan).slots() < plan.slots(), is_large);
            assert_eq!(plan.fields.iter().filter(|field| !field.charted).count(), usize::from(is_large));
            for mut raw in recordings(&plan, FRAMES) {
                // Faults in the second sixteen frames and in the few after the third.
                for (index, value) in raw.iter_mut().enumerate() {
                    let is_plain = value.number().is_some_and(|number| number == 0.0 || (1.0..1e6).contains(&number));
                    if (index / plan.channels() / LANES).is_multiple_of(2) && !is_plain {
                        *value = RawValue::new(0.0);
                    }
                }
                let right = run(&plan, Level::new(), &raw, FRAMES, 1);
                let is_faulty = |frame: usize| {
                    let flags = |field| right.get(frame, field).flags;
                    (0..fields).any(|field| flags(field).intersects(Flags::FAULTY_INPUT | Flags::INCOMPLETE))
                };
                assert!(!(0..16).chain(32..48).any(is_faulty) && (!is_large || (16..32).any(is_faulty)));
                assert!((0..FRAMES).any(|frame| right.touched(frame).next().is_some()));
                for level in levels() {
                    for at_once in [16, 40, FRAMES] {
                        assert!(right == run(&plan, level, &raw, FRAMES, at_once), "{level:?}, {at_once} at once");
                    }
                }
            }
        }
    }
}
