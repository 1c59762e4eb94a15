//! Touches of the whole body in the engine: the same on every backend and however a recording is cut, whatever fields are asked for,
//! where their links are, and what is said of values that are missing or doubtful.

use glam::{DAffine3, DQuat, DVec3};
use somatic::body::Modality;
use somatic::touch;
use somatic::{
    BackendKind, Body, Calibration, Engine, Frame, Letter, Options, Outputs, Percepts, Pose, RawValue, Receptor, Scene,
    Touch, TouchFlags, TouchOutputs, bundled,
};

use crate::common::backends;

const HZ: f64 = 50.0;

fn hand() -> Body {
    Body::from_bytes("hand", bundled::HAND).unwrap()
}

fn asked() -> touch::Options {
    touch::Options { outputs: TouchOutputs::all(), ..touch::Options::default() }
}

fn engine(body: &Body, scene: Scene, calibration: Option<&str>, backend: BackendKind) -> Engine {
    let ids: Vec<u32> = body.taxels.iter().map(|taxel| taxel.id).collect();
    let calibration = calibration.map(|text| Calibration::parse(text, &ids).unwrap());
    Engine::new(body, Options::default().scene(scene).calibration(calibration).backend(backend)).unwrap()
}

/// Scenes of outputs that touches need none of.
fn scene() -> Scene {
    Scene::default().outputs(Outputs::TOTAL).touches(asked())
}

/// Two fingers that stroke the skin: by taxel the value at `t_s`.
fn value(body: &Body, taxel: usize, t_s: f64) -> f64 {
    let at = |taxel: usize| {
        let taxel = &body.taxels[taxel];
        body.links[taxel.link].body_from_link.transform_point3(taxel.position_in_link)
    };
    let place = at(taxel);
    let fingers = [(7, 40.0), (body.taxels.len() / 2, 25.0)];
    let felt = fingers.map(|(middle, force)| {
        let middle = at(middle) + DVec3::new(0.02 * t_s, 0.01 * t_s, 0.0);
        let away = place.distance(middle) / 0.006;
        if away < 3.0 { (force * (-0.5 * away * away).exp()).round() } else { 0.0 }
    });
    felt.iter().sum()
}

fn frames(body: &Body, count: usize) -> Vec<Frame> {
    let frame = |number: usize| {
        let t_s = number as f64 / HZ;
        let values = (0..body.taxels.len()).map(|taxel| RawValue::new(value(body, taxel, t_s))).collect();
        Frame { t_s, values, ..Frame::default() }
    };
    (0..count).map(frame).collect()
}

fn touches_in(percepts: &Percepts, frame: usize) -> &[Touch] {
    &percepts.touches(frame).unwrap().touches
}

#[test]
fn they_are_the_same_on_every_backend_for_all_fields_and_however_a_recording_is_cut() {
    let body = hand();
    let frames = frames(&body, 30);
    let mut before: Option<Vec<(u64, u32, usize)>> = None;
    for backend in backends() {
        let mut whole = engine(&body, scene(), None, backend);
        let whole = whole.process(&frames).unwrap().clone();
        let mut seen = Vec::new();
        for index in 0..frames.len() {
            let found = whole.touches(index).unwrap();
            seen.extend(found.touches.iter().map(|touch| (touch.id, touch.link, found.taxels(touch).len())));
        }
        assert!(seen.len() >= 2 * frames.len(), "{}", seen.len());
        // Counts are whole numbers in single precision too.
        assert!(before.as_ref().is_none_or(|before| *before == seen), "{backend:?}");
        before = Some(seen);

        let mut alone = engine(&body, scene(), None, backend);
        for (index, frame) in frames.iter().enumerate() {
            assert_eq!(alone.process_one(frame).unwrap().touches(0), whole.touches(index), "{backend:?} {index}");
        }
        let mut first = engine(&body, scene(), None, backend);
        first.process(&frames[..11]).unwrap();
        let state = first.state().unwrap();
        let mut second = engine(&body, scene(), None, backend);
        second.restore(&state).unwrap();
        let rest = second.process(&frames[11..]).unwrap();
        for index in 11..frames.len() {
            assert_eq!(rest.touches(index - 11), whole.touches(index), "{backend:?} {index}");
        }
        let name = body.fields[0].name.clone();
        let mut narrow = engine(&body, scene().fields([name]), None, backend);
        assert_eq!(narrow.plan().channels(), body.taxels.len());
        let narrow = narrow.process(&frames).unwrap();
        for index in 0..frames.len() {
            let strip =
                |touch: &Touch| (touch.id, touch.total.to_bits(), touch.position, touch.principal_axis, touch.velocity);
            let [a, b] =
                [&whole, narrow].map(|percepts| touches_in(percepts, index).iter().map(strip).collect::<Vec<_>>());
            assert_eq!(a, b, "{backend:?} {index}");
        }
    }
    let mut without = engine(&body, Scene::default(), None, BackendKind::Cpu);
    assert!(without.process(&frames).unwrap().touches(0).is_none() && without.skin().is_none());
}

#[test]
fn a_touch_moves_with_its_link_and_its_wrench_stays_in_the_link() {
    let body = hand();
    let calibration = "[all]\ngain = 100\nunit = \"Pa\"\n";
    let mut frames = frames(&body, 20);
    let mut rest = engine(&body, scene(), Some(calibration), BackendKind::Cpu);
    let rest_percepts = rest.process(&frames).unwrap().clone();
    let root = body.links.iter().find(|link| link.parent.is_none()).unwrap().name.clone();
    let turn = DQuat::from_euler(glam::EulerRot::XYZ, 0.3, -0.7, 1.1);
    let world_from_root = DAffine3::from_rotation_translation(turn, DVec3::new(1.0, 2.0, 3.0));
    for frame in &mut frames {
        frame.pose.push((root.clone(), Pose { translation: world_from_root.translation, rotation: turn }));
    }
    let mut posed = engine(&body, scene(), Some(calibration), BackendKind::Cpu);
    let posed_percepts = posed.process(&frames).unwrap();
    let root_at_rest = body.links.iter().find(|link| link.name == root).unwrap().world_from_link();
    let mut compared = 0;
    for index in 0..frames.len() {
        let (at_rest, found) = (rest_percepts.touches(index).unwrap(), posed_percepts.touches(index).unwrap());
        assert_eq!(at_rest.touches.len(), found.touches.len());
        for (still, moved) in at_rest.touches.iter().zip(&found.touches) {
            let link = &body.links[still.link as usize];
            let world_from_link = world_from_root * root_at_rest.inverse() * link.world_from_link();
            assert!(moved.in_world && !still.in_world);
            assert!(moved.position.distance(world_from_link.transform_point3(still.position)) < 1e-12);
            assert!(moved.normal.distance(world_from_link.transform_vector3(still.normal)) < 1e-12);
            let (Some(axis), Some(as_it_was)) = (moved.principal_axis, still.principal_axis) else { continue };
            assert!(axis.distance(world_from_link.transform_vector3(as_it_was)) < 1e-12);
            assert!(still.velocity.is_some() == (still.age_s > 0.2 - 1e-9), "{}", still.age_s);
            let force: f64 = found.links(moved).iter().map(|share| share.wrench.unwrap().force_newton.length()).sum();
            assert!(force > 0.0 && force <= moved.force_newton.unwrap() * (1.0 + 1e-12));
            assert_eq!(at_rest.links(still), found.links(moved), "in the frames of links");
            compared += 1;
        }
    }
    assert!(compared >= frames.len());
    let mut on_links = Vec::new();
    posed.presses_on_links(&mut on_links);
    let last = frames.len() - 1;
    let total: f64 = touches_in(posed.percepts(), last).iter().map(|touch| touch.total).sum();
    assert!((on_links.iter().map(|share| share.total).sum::<f64>() / total - 1.0).abs() < 1e-12);
    let relative = scene().relative_to(Some(root));
    let relative = engine(&body, relative, Some(calibration), BackendKind::Cpu).process(&frames).unwrap().clone();
    let (found, still) = (&touches_in(&relative, last)[0], &touches_in(&rest_percepts, last)[0]);
    let root_from_link = root_at_rest.inverse() * body.links[still.link as usize].world_from_link();
    assert!(found.position.distance(root_from_link.transform_point3(still.position)) < 1e-12);
}

#[test]
fn what_is_missing_masked_or_out_of_range_is_reported_for_the_touches_it_is_in_or_next_to() {
    let body = hand();
    let frame = frames(&body, 1).remove(0);
    let mut plain = engine(&body, scene(), None, BackendKind::Cpu);
    let whole = plain.process_one(&frame).unwrap().touches(0).unwrap().clone();
    let strongest = whole.touches.iter().max_by(|a, b| a.total.total_cmp(&b.total)).unwrap();
    let skin = plain.skin().unwrap();
    let pressed = whole.taxels(strongest);
    let value = |node: u32| value(&body, node as usize, 0.0);
    let peak = *pressed.iter().max_by(|a, b| value(**a).total_cmp(&value(**b))).unwrap();
    let id = skin.taxels()[peak as usize].id;
    let of_values =
        TouchFlags::INCOMPLETE | TouchFlags::FAULTY_INPUT | TouchFlags::SATURATED | TouchFlags::OUT_OF_RANGE;
    assert!(!strongest.flags.intersects(of_values | TouchFlags::STALE), "{strongest:?}");

    let mut missing = frame.clone();
    missing.values[peak as usize] = RawValue::MISSING;
    for backend in backends() {
        let mut engine = engine(&body, scene(), None, backend);
        let flagged = |percepts: &Percepts, flag: TouchFlags| {
            touches_in(percepts, 0).iter().filter(|touch| touch.flags.contains(flag)).count()
        };
        let percepts = engine.process_one(&missing).unwrap();
        assert!(flagged(percepts, TouchFlags::INCOMPLETE) >= 1, "{backend:?}");
        // Its neighbours are each other's: it is one touch still.
        assert_eq!(touches_in(percepts, 0).len(), whole.touches.len(), "{backend:?}");
        let of_taxel = |keys: &str| format!("[taxel.{id}]\n{keys}\n");
        for (keys, flag) in [
            ("mask = true", TouchFlags::FAULTY_INPUT),
            ("p_max = 1", TouchFlags::SATURATED),
            ("raw_range = [0, 2]", TouchFlags::OUT_OF_RANGE),
        ] {
            let mut engine = self::engine(&body, scene(), Some(&of_taxel(keys)), backend);
            let percepts = engine.process_one(&frame).unwrap();
            assert_eq!(flagged(percepts, flag), 1, "{backend:?} {keys}");
        }
        let mut broken = frame.clone();
        broken.values[peak as usize] = RawValue::new(f64::NAN);
        assert_eq!(flagged(engine.process_one(&broken).unwrap(), TouchFlags::FAULTY_INPUT), 1);
    }
    let mut stale = frame;
    stale.values[peak as usize] = RawValue::STALE;
    plain.track_stale();
    assert!(
        touches_in(plain.process_one(&stale).unwrap(), 0).iter().any(|touch| touch.flags.contains(TouchFlags::STALE))
    );
}

#[test]
fn a_taxel_in_no_field_is_touched_too_and_drift_does_not_take_its_touch_away() {
    let mut body = hand();
    let alone = body.taxels.len() - 1;
    let id = body.taxels[alone].id;
    for field in &mut body.fields {
        field.members.retain(|taxel, _| *taxel != id);
    }
    body.fields.retain(|field| !field.members.is_empty());
    let calibration = "[drift]\ntime_constant_s = 0.2\n[all]\ndead_band = 5\n";
    let mut engine = engine(&body, scene(), Some(calibration), BackendKind::Cpu);
    let mut touched = 0;
    for number in 0..200 {
        let mut values = vec![RawValue::new(0.0); body.taxels.len()];
        if number > 20 {
            values[alone] = RawValue::new(50.0);
        }
        let percepts = engine.process_one(&Frame { t_s: number as f64 / HZ, values, ..Frame::default() }).unwrap();
        assert!(percepts.touched(0).next().is_none());
        touched += touches_in(percepts, 0).len();
    }
    assert_eq!(touched, 179);
    assert!(body.taxels[alone].modality == Modality::Pressure);
}

#[test]
fn taxels_weigh_as_their_sensors_cover_their_cells() {
    let mut body = hand();
    let frame = frames(&body, 1).remove(0);
    let position = |body: &Body, keys: &str| {
        let mut engine = engine(body, scene(), Some(&format!("[all]\n{keys}\n")), BackendKind::Cpu);
        (touches_in(engine.process_one(&frame).unwrap(), 0)[0].position, engine.remarks())
    };
    let [cell, equal] = ["sensors = \"cell\"", "sensors = \"equal\""].map(|keys| position(&body, keys).0);
    assert!(cell.distance(equal) > 1e-5, "{cell} {equal}");
    assert_eq!([position(&body, "").0, position(&body, "unit = \"N\"").0], [equal, cell]);
    assert_eq!(position(&body, "unit = \"N\"\nsensors = \"equal\"").0, equal);
    let pascal = |keys: &str| position(&body, &format!("unit = \"Pa\"\n{keys}")).0;
    assert_eq!([pascal(""), pascal("sensors = \"cell\"")], [equal; 2], "a pressure always weighs by its cell");
    // Buttons of one size, as the layout has it: there is nothing to ask.
    assert!(position(&body, "").1.is_empty());
    body.taxels[3].area *= 2.0;
    assert!(position(&body, "").1.is_empty(), "nobody has begun to calibrate");
    let said = position(&body, "gain = 0.5").1;
    assert!(said.len() == 1 && said[0].contains("`sensors = \"equal\"`"), "{said:?}");
    for known in ["sensors = \"equal\"", "sensors = \"cell\"", "unit = \"N\"", "unit = \"Pa\""] {
        assert!(position(&body, known).1.is_empty(), "{known}");
    }
    let without = engine(&body, Scene::default(), None, BackendKind::Cpu);
    assert!(without.remarks().is_empty(), "without touches there is nothing to weigh");
}

#[test]
fn touches_are_of_pressures() {
    let body = hand();
    let scene = scene().letters(vec![Letter { receptor: Receptor::Change, ..Letter::default() }]);
    let error = Engine::new(&body, Options::default().scene(scene)).err().unwrap();
    assert!(error.is_usage() && error.to_string().contains("sustained"), "{error}");
}
