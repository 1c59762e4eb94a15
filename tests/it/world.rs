//! Touches on links that move: where they are in the world, or in a link that stands for it, and how fast.

use std::collections::BTreeSet;

use glam::{DAffine3, DQuat, DVec3};
use somatic::field::FieldSet;
use somatic::{BackendKind, Body, Engine, Flags, Frame, Options, Outputs, Pose, RawValue, Scene, bundled};

use crate::common::{Flat, backends, frame};

/// (u, v) is (x, −z) of the link.
const SQUARE: [[f64; 2]; 4] = [[0.0, 0.0], [0.1, 0.0], [0.1, 0.1], [0.0, 0.1]];
const DT_S: f64 = 0.01;

/// A turn about the world's z in each frame, far from its origin, m and rad.
fn pose(index: u32) -> Pose {
    let rotation = DQuat::from_rotation_z(0.2 * f64::from(index));
    Pose { translation: DVec3::new(3.0, -2.0, 5.0), rotation }
}

#[test]
fn a_touch_that_rests_on_a_turning_link_moves_in_the_world_alone() {
    let body = Flat::new(&SQUARE).field("field", None, 0..4).surface(4.0).body();
    let frames: Vec<_> = (0..5)
        .map(|index| {
            let mut frame = frame(DT_S * f64::from(index), &[0.0, 7.0, 3.0, 0.0]);
            frame.pose.push(("skin".into(), pose(index)));
            frame
        })
        .collect();
    let outputs = Outputs::POSITION | Outputs::SPEED | Outputs::SPEED_IN_WORLD;
    for backend in backends() {
        for link in [None, Some("skin")] {
            let scene = Scene::default().outputs(outputs).relative_to(link);
            let mut engine = Engine::new(&body, Options::default().backend(backend).scene(scene)).unwrap();
            let (percepts, agreement) = engine.process_and_compare(&frames).unwrap();
            assert!(agreement.holds() && agreement.quantities["speed_in_world"].compared == 4, "{agreement}");
            // On a circle around the link's own z, at 0.1 m; of a chord of 0.2 rad.
            let expected = if link.is_some() { 0.0 } else { 2.0 * 0.1 * 0.1_f64.sin() / DT_S };
            for index in 0..5 {
                let percept = percepts.get(index as usize, 0);
                assert!(percept.in_world);
                let in_link = DVec3::new(0.1, 0.0, -0.03);
                let posed = pose(index);
                let right = if link.is_some() { in_link } else { posed.translation + posed.rotation * in_link };
                let off = DVec3::from_array(percept.position.unwrap()).distance(right);
                assert!(off < 1e-8, "{backend:?}, {link:?}: {off}");
                let Some(speed) = percept.speed_in_world else {
                    assert_eq!(index, 0);
                    continue;
                };
                assert!((speed - expected).abs() < 1e-9 / DT_S, "{backend:?}, {link:?}: {speed}, not {expected}");
                assert_eq!(percept.speed, Some(0.0));
            }
        }
    }
}

/// The bundled humanoid, with a pose of each link in every frame that is nowhere near its rest, and touches on several limbs.
struct Moving {
    body: Body,
    fields: FieldSet,
    frames: Vec<Frame>,
}

impl Moving {
    fn new() -> Self {
        let body = Body::from_bytes("humanoid", bundled::HUMANOID).unwrap();
        let mut random = 1_u32;
        let mut next = move || {
            random = random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            f64::from(random >> 8) / f64::from(1 << 24)
        };
        let frame_at = |index: u32| {
            let mut frame = Frame::missing(DT_S * f64::from(index), body.taxels.len());
            for value in &mut frame.values {
                *value = RawValue::new(if next() < 0.1 { 1.0 + 99.0 * next() } else { 0.0 });
            }
            for link in &body.links {
                let turn = DQuat::from_axis_angle(DVec3::new(next(), next(), 1.0).normalize(), 6.0 * next());
                let translation = DVec3::new(next(), next(), next()) * 3.0;
                frame.pose.push((link.name.clone(), Pose { translation, rotation: turn }));
            }
            frame
        };
        let frames = (0..9).map(frame_at).collect();
        let fields = FieldSet::new(&body).unwrap();
        Self { body, fields, frames }
    }

    fn engine(&self, scene: Scene, backend: BackendKind) -> Engine {
        Engine::new(&self.body, Options::default().backend(backend).scene(scene)).unwrap()
    }

    /// world_from_link in `frame`: its own pose, or that of the nearest link above it, at rest from there on.
    fn world_from(&self, link: usize, frame: &Frame) -> Option<DAffine3> {
        let mut at = Some(link);
        while let Some(above) = at {
            if let Some((_, pose)) = frame.pose.iter().find(|(name, _)| *name == self.body.links[above].name) {
                let world = DAffine3::from_rotation_translation(pose.rotation, pose.translation);
                return Some(world * self.body.rest_transform(above, link));
            }
            at = self.body.links[above].parent;
        }
        None
    }

    /// Σ wP x / Σ wP over the members of field `name` where they are in `frame`, and how many links they lie on.
    fn mean(&self, name: &str, frame: &Frame) -> (Option<DVec3>, usize) {
        let field = self.fields.fields.iter().find(|field| field.name == name).unwrap();
        let (mut total, mut moment, mut is_known, mut links) = (0.0, DVec3::ZERO, true, BTreeSet::new());
        for member in &field.members {
            let taxel = &self.body.taxels[member.taxel];
            links.insert(taxel.link);
            let pull = member.weight * frame.values[member.taxel].number().unwrap();
            if pull > 0.0 {
                match self.world_from(taxel.link, frame) {
                    Some(world) => moment += pull * world.transform_point3(taxel.position_in_link),
                    None => is_known = false,
                }
                total += pull;
            }
        }
        (is_known.then_some(moment / total), links.len())
    }
}

#[test]
fn a_field_over_links_that_move_is_where_its_members_are_now() {
    let moving = Moving::new();
    let in_link = moving.body.links[3].name.clone();
    let outputs = Outputs::TOTAL | Outputs::POSITION | Outputs::SPEED_IN_WORLD;
    for backend in backends() {
        for link in [None, Some(in_link.as_str())] {
            let scene = Scene::default().outputs(outputs).relative_to(link);
            let mut engine = moving.engine(scene.clone(), backend);
            let (percepts, agreement) = engine.process_and_compare(&moving.frames).unwrap();
            assert!(agreement.holds(), "{backend:?}: {agreement}");
            let whole = percepts.clone();
            let names: Vec<String> = engine.plan().fields().map(|field| field.name.to_owned()).collect();
            let (mut compared, mut speeds) = (0, 0);
            for (index, frame) in moving.frames.iter().enumerate() {
                let to = |frame: &Frame| {
                    let link = link.map(|link| moving.body.link_index(link).unwrap());
                    link.map_or(DAffine3::IDENTITY, |link| moving.world_from(link, frame).unwrap().inverse())
                };
                for (number, name) in names.iter().enumerate() {
                    let percept = whole.get(index, number);
                    let (Some(mean), links) = moving.mean(name, frame) else { panic!("{name} is posed") };
                    if links < 2 || !percept.contact {
                        continue;
                    }
                    let right = to(frame).transform_point3(mean);
                    let position = DVec3::from_array(percept.position.unwrap());
                    assert!(percept.in_world && position.distance(right) < 1e-12, "{name}: {position}, not {right}");
                    compared += 1;
                    if let Some(speed) = percept.speed_in_world {
                        let before = &moving.frames[index - 1];
                        let moved = right - to(before).transform_point3(moving.mean(name, before).0.unwrap());
                        assert!((speed - moved.length() / DT_S).abs() < 1e-9, "{name}: {speed}");
                        speeds += 1;
                    }
                }
            }
            assert!(compared >= 18 && speeds >= 16, "{compared} {speeds}");
            // The same bits one frame at a time.
            let mut alone = moving.engine(scene, backend);
            for (index, frame) in moving.frames.iter().enumerate() {
                let one = alone.process_one(frame).unwrap();
                for number in 0..names.len() {
                    assert_eq!(one.get(0, number), whole.get(index, number));
                }
            }
        }
    }
}

#[test]
fn a_field_over_links_has_no_position_if_a_pressed_link_has_no_pose() {
    let moving = Moving::new();
    let mut frame = moving.frames[0].clone();
    let arm = |name: &str| name.starts_with("left_");
    frame.pose.retain(|(name, _)| arm(name));
    let outputs = Outputs::TOTAL | Outputs::POSITION;
    for backend in backends() {
        let mut engine = moving.engine(Scene::default().outputs(outputs), backend);
        let names: Vec<String> = engine.plan().fields().map(|field| field.name.to_owned()).collect();
        let percepts = engine.process_one(&frame).unwrap();
        let (mut placed, mut lost) = (0, 0);
        for (number, name) in names.iter().enumerate() {
            let percept = percepts.get(0, number);
            let (mean, links) = moving.mean(name, &frame);
            if links < 2 || !percept.contact {
                continue;
            }
            let has_flag = percept.flags.contains(Flags::NO_POSE);
            assert_eq!((percept.position.is_some(), has_flag), (mean.is_some(), mean.is_none()), "{name}");
            placed += usize::from(mean.is_some());
            lost += usize::from(mean.is_none());
        }
        assert!(placed > 0 && lost > 0, "{placed} {lost}");
        // Without any pose it is where it is at rest.
        let rest = Frame { pose: Vec::new(), ..frame.clone() };
        let percepts = engine.process_one(&rest).unwrap();
        assert!(percepts.touched(0).all(|percept| percept.position.is_some() && !percept.in_world));
    }
}

#[test]
fn links_without_a_pose_are_nowhere_while_joints_are_late() {
    let moving = Moving::new();
    let mut frame = moving.frames[0].clone();
    let root = moving.body.links[0].name.clone();
    frame.pose.retain(|(name, _)| *name == root);
    for (is_late, number) in [(false, 0), (true, 1)] {
        frame.has_stale_pose = is_late;
        frame.t_s = f64::from(number);
        let mut engine = moving.engine(Scene::default().outputs(Outputs::TOTAL | Outputs::POSITION), BackendKind::Cpu);
        let fields: Vec<(String, String)> =
            engine.plan().fields().map(|field| (field.name.to_owned(), field.link.to_owned())).collect();
        let percepts = engine.process_one(&frame).unwrap();
        for (number, (name, link)) in fields.iter().enumerate() {
            let percept = percepts.get(0, number);
            let links = moving.mean(name, &frame).1;
            if !percept.contact {
                continue;
            }
            let is_placed = !is_late || (links == 1 && *link == root);
            assert_eq!(percept.flags.contains(Flags::STALE_POSE), !is_placed, "{name}");
            assert_eq!(percept.position.is_some(), is_placed || links == 1, "{name}");
        }
    }
}

#[test]
fn poses_that_cannot_be_computed_with_are_refused() {
    let moving = Moving::new();
    let mut engine = moving.engine(Scene::default(), BackendKind::Cpu);
    let mut frame = moving.frames[0].clone();
    for translation in [DVec3::X * 1e160, DVec3::Y * -1e308, DVec3::Z * f64::NAN] {
        frame.pose[2].1.translation = translation;
        let why = engine.process_one(&frame).unwrap_err().to_string();
        let name = &moving.body.links[2].name;
        assert!(why.contains(&format!("frame 0: the pose of `{name}` is at")) && why.len() < 200, "{why}");
    }
    frame.pose[2].1 = Pose { translation: DVec3::ZERO, rotation: DQuat::from_xyzw(0.0, 0.0, 0.0, 0.0) };
    assert!(engine.process_one(&frame).unwrap_err().to_string().contains("has length 0e0"));
}
