//! Shear of touches of the whole body, around limbs and across links: of simulated drags and twists against their truth, whatever
//! fields there are; and wrenches with what pulls.

use std::f64::consts::TAU;

use glam::{DQuat, DVec2, DVec3};
use somatic::body::{FieldSpec, MemberSpec, Modality, Taxel};
use somatic::internal::body::{Glb, MeshData};
use somatic::percept::{Touch, Wrench};
use somatic::source::{SimulatedSource, Source as _, Truth};
use somatic::{
    BackendKind, Body, Calibration, Engine, Frame, Letter, Options, Outputs, RawValue, Receptor, Scene, TouchFlags,
    TouchOutputs, bundled, touch,
};

/// A limb along y.
const RADIUS: f64 = 0.04;
const PITCH: f64 = 5e-3;
const ROWS: u32 = 21;
/// Around it.
const COLUMNS: u32 = 50;
const MU: f64 = 0.6;

/// Where the limb is turned by `turn` from +z and `along` y, m.
fn on_limb(turn: f64, along: f64) -> DVec3 {
    DVec3::new(RADIUS * turn.sin(), along, RADIUS * turn.cos())
}

/// A limb with three axes everywhere, whose tangents point in all directions, and a field over two taxels of its back.
fn limb() -> Body {
    let mut glb = Glb::new();
    let link = glb.node("limb", None, DVec3::ZERO);
    let taxel = |id: u32| {
        let turn = f64::from(id % COLUMNS) * TAU / f64::from(COLUMNS);
        let normal = DVec3::new(turn.sin(), 0.0, turn.cos());
        Taxel {
            id,
            link: 0,
            position_in_link: on_limb(turn, PITCH * (f64::from(id / COLUMNS) - f64::from(ROWS - 1) / 2.0)),
            normal_in_link: normal,
            area: PITCH * PITCH,
            modality: Modality::Force3,
            tangent_in_link: Some(DQuat::from_axis_angle(normal, 0.7 * f64::from(id)) * DVec3::Y),
        }
    };
    glb.taxels("taxels", Some(link), &(0..COLUMNS * ROWS).map(taxel).collect::<Vec<_>>(), None);
    let (around, high) = (120, 12);
    let corners = (0..=high).flat_map(|row| (0..around).map(move |column| (row, column)));
    let corner = |(row, column): (u32, u32)| {
        on_limb(f64::from(column) * TAU / f64::from(around), 0.12 * (f64::from(row) / f64::from(high) - 0.5))
    };
    let positions: Vec<DVec3> = corners.map(corner).collect();
    let outward = |p: &DVec3| (DVec3::new(p.x, 0.0, p.z) / RADIUS).as_vec3().to_array();
    let cells = (0..high).flat_map(|row| (0..around).map(move |column| (row, column)));
    let triangles = cells.flat_map(|(row, column)| {
        let at = |row: u32, column: u32| row * around + column % around;
        let [a, b, c, d] = [at(row, column), at(row, column + 1), at(row + 1, column + 1), at(row + 1, column)];
        [[a, b, c], [a, c, d]]
    });
    let mesh = MeshData {
        normals: positions.iter().map(outward).collect(),
        triangles: triangles.collect(),
        positions: positions.iter().map(|p| p.as_vec3().to_array()).collect(),
        skinning: None,
    };
    glb.mesh(link, "surface", &mesh, None, None);
    let members = [COLUMNS / 2, COLUMNS / 2 + 1].map(|id| (id, MemberSpec::default())).into_iter().collect();
    glb.field(&FieldSpec { name: "back".into(), parent: None, members, chart: None }, Some(link), DVec3::ZERO);
    Body::from_bytes("limb", &glb.to_bytes().unwrap()).unwrap()
}

fn simulated(body: &Body, sensor: &str, [rate_hz, duration_s]: [f64; 2], touch: &str) -> SimulatedSource {
    let text = format!(
        "rate_hz = {rate_hz}\nduration_s = {duration_s}\nseed = 5\n[layer]\nthickness_m = 0.007\n{sensor}\n[[touch]]\n\
         on = \"body\"\n{touch}\n"
    );
    SimulatedSource::on_body("touch", &text, body.clone()).unwrap()
}

/// A ball that presses with 4 N at `from`, and is dragged to `to`.
fn drag(link: &str, from: DVec3, to: DVec3, speed_m_s: f64) -> String {
    let at = |p: DVec3| format!("{{ link = \"{link}\", at = [{}, {}, {}] }}", p.x, p.y, p.z);
    format!(
        "indenter = \"ball\"\nradius_m = 0.01\nfriction = {MU}\npath = [{}, {}]\nstart_s = 0.15\nspeed_m_s = {speed_m_s}\n\
         press = {{ from_s = 0.02, to_s = 9, newton = 4, ramp_s = 0.08 }}",
        at(from),
        at(to)
    )
}

fn scene() -> Scene {
    with_wrenches(TouchOutputs::FRICTION_SIGMA)
}

fn with_wrenches(more: TouchOutputs) -> Scene {
    let outputs = TouchOutputs::USUAL | TouchOutputs::WRENCH | TouchOutputs::TAXELS | more;
    Scene::default().touches(touch::Options { outputs, ..touch::Options::default() })
}

fn engine(body: &Body, calibration: &str, scene: Scene) -> Engine {
    let ids: Vec<u32> = body.taxels.iter().map(|taxel| taxel.id).collect();
    let calibration = Some(Calibration::parse(calibration, &ids).unwrap());
    Engine::new(body, Options::default().scene(scene).calibration(calibration).backend(BackendKind::Reference)).unwrap()
}

/// A frame of a simulation in which one touch is felt.
struct Moment {
    frame: Frame,
    truth: Truth,
    touch: Touch,
}

/// Those of `source`, read by its own calibration; `change` may change its frames.
fn moments(mut source: SimulatedSource, change: impl Fn(&mut Frame)) -> Vec<Moment> {
    let mut engine = engine(source.body(), &source.calibration(), scene());
    let mut frame = Frame::missing(0.0, source.taxels().len());
    let mut found = Vec::new();
    while source.next_frame(&mut frame).unwrap() {
        change(&mut frame);
        let touches = engine.process_one(&frame).unwrap().touches(0).unwrap();
        if let ([touch], [truth]) = (&touches.touches[..], source.truth()) {
            found.push(Moment { frame: frame.clone(), truth: truth.clone(), touch: touch.clone() });
        }
    }
    found
}

/// Ways to drag over the limb: from and to, by the turn around it and the place along it.
fn ways() -> impl Iterator<Item = [DVec3; 2]> {
    [0.4_f64, 2.6, 4.0, 6.1].into_iter().enumerate().map(|(way, turn)| {
        let heading = 0.8 * way as f64;
        let (sin, cos) = heading.sin_cos();
        let at = |along: f64| on_limb(turn + along * cos / RADIUS, along * sin);
        [at(-0.008), at(0.008)]
    })
}

fn slips(moment: &Moment) -> bool {
    moment.truth.slips == Some(true)
}

fn rms(values: &[f64]) -> f64 {
    (values.iter().map(|x| x * x).sum::<f64>() / values.len() as f64).sqrt()
}

#[test]
fn a_drag_around_a_limb_has_its_direction_and_friction() {
    let body = limb();
    let noisy = "[sensor]\nnoise_sigma = 0.01";
    for (sensor, count, most_degrees, most_friction) in [("", 4, 0.5, 1e-6), (noisy, 2, 1.5, 0.04)] {
        let (mut degrees, mut frictions) = (Vec::new(), Vec::new());
        for [from, to] in ways().take(count) {
            let run = moments(simulated(&body, sensor, [50.0, 0.5], &drag("limb", from, to, 0.025)), |_| ());
            let begins = run.iter().position(slips).unwrap();
            let sees = run.iter().position(|moment| moment.touch.slip_ratio.is_some_and(|ratio| ratio >= 0.95));
            assert!(sees.unwrap().abs_diff(begins) <= 2 && run[begins].frame.t_s > 0.155, "{sees:?}, not {begins}");
            for Moment { truth, touch, .. } in run.iter().filter(|moment| slips(moment)) {
                assert!((truth.shear_in_link.unwrap().length() - MU * truth.force_newton).abs() < 1e-9);
                let shear = touch.shear.unwrap();
                degrees.push(shear.angle_between(truth.shear_in_link.unwrap()).to_degrees());
                frictions.push(touch.friction.unwrap() / MU - 1.0);
                // In its chart nothing of it is lost.
                let [u, v] = touch.shear_in_chart.unwrap();
                assert!((u.hypot(v) - touch.friction.unwrap() * touch.total).abs() < 1e-9);
                assert!(shear.length() < u.hypot(v) || !sensor.is_empty());
                assert!((touch.shear_direction_rad.unwrap() - v.atan2(u)).abs() < 1e-12);
                let sigma = touch.friction_sigma.unwrap();
                assert_eq!(sigma > 1e-3, !sensor.is_empty(), "{sigma}");
            }
        }
        let (found, friction) = (rms(&degrees), rms(&frictions));
        eprintln!("{sensor:?}: {found:.2}° RMS, friction {friction:.4} of {} frames", degrees.len());
        assert!(degrees.len() > 12 * count && found <= most_degrees && friction <= most_friction);
    }
    // Without what pulls there is none of it.
    let [from, to] = ways().next().unwrap();
    let taxels = body.taxels.len();
    let still = moments(simulated(&body, "", [50.0, 0.3], &drag("limb", from, to, 0.025)), |frame| {
        frame.values[taxels..].fill(RawValue::new(0.0));
    });
    assert!(still.iter().any(slips));
    for Moment { touch, .. } in &still {
        assert!(touch.friction == Some(0.0) && touch.shear_direction_rad.is_none());
        assert!(touch.flags.contains(TouchFlags::STILL));
    }
}

#[test]
fn twists_and_turns_of_the_whole_body_have_their_sign() {
    let body = limb();
    let place = |touch: &str| {
        format!(
            "{touch}\nfriction = {MU}\npath = [{{ link = \"limb\", at = [0.001, 0.0013, 0.04] }}]\n\
             press = {{ from_s = 0.02, to_s = 9, newton = 4, ramp_s = 0.08 }}"
        )
    };
    let (mut count, mut reaches) = (0, [0.0_f64; 2]);
    for sense in [1.0, -1.0] {
        let ball = format!("indenter = \"ball\"\nradius_m = 0.01\ntwist_deg = [[0.15, 0], [0.4, {}]]", sense * 20.0);
        let rod = format!(
            "indenter = \"rod\"\nradius_m = 0.01\nlength_m = 0.02\nangle_deg = [[0.15, 30], [0.4, {}]]",
            30.0 + sense * 20.0
        );
        for (kind, touch) in [ball, rod].iter().enumerate() {
            let run = moments(simulated(&body, "", [50.0, 0.4], &place(touch)), |_| ());
            for Moment { truth, touch, .. } in run.iter().filter(|moment| slips(moment)) {
                let (right, found) = (truth.torsion.unwrap(), touch.torsion.unwrap());
                assert!(right * sense > 0.0 && (found / right - 1.0).abs() < 0.1, "{kind}: {found}, not {right}");
                reaches[kind] = reaches[kind].max(right.abs());
                count += 1;
            }
        }
    }
    assert!(count > 30 && reaches.iter().all(|&reach| reach > 5e-3), "{count} {reaches:?}");
}

/// The truth of a pair of balls `apart_m` from each other that turns from `degrees` on and is dragged along the limb.
fn pair(apart_m: f64, degrees: f64) -> Vec<[Truth; 2]> {
    let touch = format!(
        "indenter = \"pair\"\nradius_m = 0.008\napart_m = {apart_m}\nfriction = {MU}\n\
         angle_deg = [[0, {degrees}], [0.4, {}]]\npath = [{{ link = \"limb\", at = [0, -0.01, 0.04] }}, {{ link = \"limb\", \
         at = [0, 0.01, 0.04] }}]\nspeed_m_s = 0.1\npress = {{ from_s = 0, to_s = 9, newton = 8, ramp_s = 0.05 }}",
        degrees + 4.0
    );
    let mut source = simulated(&limb(), "", [20.0, 0.4], &touch);
    let mut frame = Frame::missing(0.0, source.taxels().len());
    let mut found = Vec::new();
    while source.next_frame(&mut frame).unwrap() {
        found.extend(<[Truth; 2]>::try_from(source.truth().to_vec()));
    }
    found
}

#[test]
fn a_pair_points_from_its_first_to_its_second_also_around_a_limb() {
    // The path runs along y, and angles are from there: −90° is around the limb, its far ends more than a quarter of a turn away.
    for (apart_m, degrees) in [(0.03, 0.0), (0.03, -90.0), (0.15, -90.0)] {
        let run = pair(apart_m, degrees);
        assert!(run.len() >= 6, "{apart_m} m, {degrees}°: {} frames", run.len());
        for pressed in &run {
            let [first, second] =
                pressed.each_ref().map(|truth| (truth.position_in_link, truth.direction_in_link.unwrap()));
            let turn = |place: DVec3| place.x.atan2(place.z);
            let way = DVec2::new(RADIUS * (turn(second.0) - turn(first.0)), second.0.y - first.0.y);
            assert!((way.length() / apart_m - 1.0).abs() < 0.1, "{apart_m} m, {degrees}°: {way}");
            for (place, direction) in [first, second] {
                let around = DVec3::new(turn(place).cos(), 0.0, -turn(place).sin());
                let right = (way.x * around + way.y * DVec3::Y).normalize();
                let off = direction.angle_between(right).to_degrees();
                assert!(off < 3.0 && (direction.length() - 1.0).abs() < 1e-9, "{apart_m} m, {degrees}°: off by {off}°");
            }
            assert!(pressed.iter().all(|truth| truth.angle.is_some()));
        }
    }
}

/// The wrench of `ids` by its definition, of sensors that deliver newtons.
fn right_wrench(body: &Body, frame: &Frame, taxels: impl Iterator<Item = usize>, pulls: bool) -> Wrench {
    let three = body.taxels.len();
    let mut sum = Wrench::default();
    for index in taxels {
        let taxel = &body.taxels[index];
        let number = |at: usize| frame.values[at].number().unwrap_or(0.0);
        let [t, across] = taxel.tangents_in_link();
        let pulled = number(three + index) * t + number(2 * three + index) * across;
        let force = -number(index) * taxel.normal_in_link + if pulls { pulled } else { DVec3::ZERO };
        sum.force_newton += force;
        sum.torque_newton_m += taxel.position_in_link.cross(force);
    }
    sum
}

fn off(one: &Wrench, other: &Wrench) -> f64 {
    one.force_newton.distance(other.force_newton) + one.torque_newton_m.distance(other.torque_newton_m) / RADIUS
}

#[test]
fn a_wrench_has_what_pulls_whatever_letters_are_read() {
    let body = limb();
    let [from, to] = ways().nth(1).unwrap();
    let run = moments(simulated(&body, "", [50.0, 0.3], &drag("limb", from, to, 0.025)), |_| ());
    let Moment { frame, .. } = run.iter().rfind(|moment| slips(moment)).unwrap();
    let newtons = "[all]\nunit = \"N\"\n";
    let sustained = with_wrenches(TouchOutputs::empty()).letters(Letter::all_of(&[Receptor::Sustained], &[]));
    let mut bits = Vec::new();
    for (scene, has_shear) in [(scene(), true), (sustained.clone(), false)] {
        let mut engine = engine(&body, newtons, scene);
        let touches = engine.process_one(frame).unwrap().touches(0).unwrap();
        let touch = &touches.touches[0];
        let taxels: Vec<usize> = touches.taxels(touch).iter().map(|&node| node as usize).collect();
        let wrench = touches.links(touch)[0].wrench.unwrap();
        let right = right_wrench(&body, frame, taxels.iter().copied(), true);
        let pushed = right_wrench(&body, frame, taxels.iter().copied(), false);
        assert!(off(&wrench, &right) < 1e-6 && off(&wrench, &pushed) > 1.0, "{wrench:?}, not {right:?}");
        assert_eq!(touch.shear.is_some(), has_shear);
        let shown = engine.plan().touch_outputs().unwrap();
        assert_eq!(shown.contains(TouchOutputs::SHEAR), has_shear);
        let mut presses = Vec::new();
        engine.presses_on_links(&mut presses);
        let all = (0..body.taxels.len()).filter(|&index| frame.values[index].number().unwrap() > 0.0);
        assert!(off(&presses[0].wrench.unwrap(), &right_wrench(&body, frame, all, true)) < 1e-6);
        bits.push((wrench, presses));
    }
    assert_eq!(bits[0], bits[1]);
    // What is missing is left out of a touch's and said; of a link nothing would say it.
    let strongest = (0..body.taxels.len())
        .max_by(|&a, &b| frame.values[a].number().unwrap().total_cmp(&frame.values[b].number().unwrap()))
        .unwrap();
    for (value, flag) in [(RawValue::MISSING, TouchFlags::INCOMPLETE), (RawValue::FAULTY, TouchFlags::FAULTY_INPUT)] {
        let mut engine = engine(&body, newtons, sustained.clone());
        let mut frame = frame.clone();
        frame.values[body.taxels.len() + strongest] = value;
        let touches = engine.process_one(&frame).unwrap().touches(0).unwrap();
        let touch = &touches.touches[0];
        assert!(touch.flags.contains(flag));
        // Both axes go, and the normal force stays.
        frame.values[2 * body.taxels.len() + strongest] = RawValue::new(0.0);
        let taxels = touches.taxels(touch).iter().map(|&node| node as usize);
        assert!(off(&touches.links(touch)[0].wrench.unwrap(), &right_wrench(&body, &frame, taxels, true)) < 1e-6);
        let mut presses = Vec::new();
        engine.presses_on_links(&mut presses);
        assert!(presses.len() == 1 && presses[0].wrench.is_none() && presses[0].total > 0.0);
    }
}

#[test]
fn touches_have_shear_where_it_is_asked_for_whatever_fields_feel() {
    let body = limb();
    let given = |scene: Scene| engine(&body, "[all]\nunit = \"N\"\n", scene).plan().touch_outputs().unwrap();
    let asked = |outputs: TouchOutputs| touch::Options { outputs, ..touch::Options::default() };
    let usual = TouchOutputs::USUAL;
    assert!(given(Scene::default().touches(asked(usual))).contains(TouchOutputs::SHEAR));
    let total = Scene::default().outputs(Outputs::TOTAL);
    assert!(given(total.clone().touches(asked(usual))).contains(TouchOutputs::SHEAR));
    // Not for whoever names letters without it, nor where only what is made of touches is asked for.
    let pressed = total.clone().letters(vec![Letter::default()]);
    assert_eq!(given(pressed.touches(asked(usual))), usual);
    assert_eq!(given(Scene::default().outputs(Outputs::SELF_CONTACTS).touches(None)), usual);
    assert!(given(total.touches(asked(usual | TouchOutputs::SHEAR))).contains(TouchOutputs::SHEAR));
    let none = Scene::default().outputs(Outputs::empty());
    assert!(given(none.touches(asked(usual | TouchOutputs::FRICTION_SIGMA))).contains(TouchOutputs::SHEAR));
    // A body without such taxels has nothing to give.
    let hand = Body::from_bytes("hand", bundled::HAND).unwrap();
    let scene = Scene::default().touches(asked(usual | TouchOutputs::FRICTION_SIGMA));
    let options = Options::default().backend(BackendKind::Cpu).scene(scene);
    let why = Engine::new(&hand, options).map(|_| ()).unwrap_err().to_string();
    assert!(why.contains("`touches.friction_sigma`"), "{why}");
}

/// A number from a normal distribution, by two of `state`.
fn normal(state: &mut u64) -> f64 {
    let mut next = || {
        *state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((*state >> 11) as f64 + 0.5) / (1_u64 << 53) as f64
    };
    (-2.0 * next().ln()).sqrt() * (TAU * next()).cos()
}

#[test]
fn the_friction_of_a_touch_varies_as_its_sigma_says() {
    const NOISE: f64 = 0.02;
    let body = limb();
    let calibration = format!("[all]\nunit = \"N\"\nnoise = {NOISE}\n[shear]\ngain = 0.5\n");
    let mut engine = engine(&body, &calibration, scene());
    let pressed = [0, 1, 2, COLUMNS, COLUMNS + 1, COLUMNS + 2].map(|id| id as usize);
    let (mut state, count) = (7, 4000);
    let (mut frictions, mut sigmas) = (Vec::new(), Vec::new());
    for number in 0..count {
        let mut frame = engine.frame(0.01 * f64::from(number));
        frame.values.fill(RawValue::new(0.0));
        for index in pressed {
            let taxel = &body.taxels[index];
            let [t, across] = taxel.tangents_in_link();
            // Along the limb, so that all of it is along one direction.
            let raw = [1.0, 2.0 * 0.4 * t.y, 2.0 * 0.4 * across.y];
            for (axis, raw) in raw.into_iter().enumerate() {
                let at = axis * body.taxels.len() + index;
                frame.values[at] = RawValue::new(raw + NOISE * normal(&mut state));
            }
        }
        let touches = engine.process_one(&frame).unwrap().touches(0).unwrap();
        frictions.push(touches.touches[0].friction.unwrap());
        sigmas.push(touches.touches[0].friction_sigma.unwrap());
    }
    // Of sensors that nobody says it of it is not known.
    let frame = engine.frame(0.0);
    let mut unsaid = self::engine(&body, "[all]\nunit = \"N\"\n", scene());
    let mut frame = Frame { values: vec![RawValue::new(0.0); frame.values.len()], ..frame };
    frame.values[0] = RawValue::new(1.0);
    let touch = unsaid.process_one(&frame).unwrap().touches(0).unwrap().touches[0].clone();
    assert!(touch.friction == Some(0.0) && touch.friction_sigma.is_none());
    assert!(touch.flags.contains(TouchFlags::NOISE_UNKNOWN));
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
    let varies = rms(&frictions.iter().map(|friction| friction - mean(&frictions)).collect::<Vec<_>>());
    let ratio = mean(&sigmas) / varies;
    // Of 4000 samples a standard deviation is known to 1.1 %.
    assert!((mean(&frictions) - 0.4).abs() < 0.002 && (0.95..1.05).contains(&ratio), "{ratio} of {varies}");
}

#[test]
fn a_drag_over_an_elbow_pulls_at_both_links_and_what_presses_stays_the_same() {
    let plain = Body::from_bytes("humanoid", bundled::body("humanoid").unwrap()).unwrap();
    let mut body = plain.clone();
    body.taxels.iter_mut().for_each(|taxel| taxel.modality = Modality::Force3);
    let text = include_str!("../../examples/simulations/elbow.toml");
    let touch = text.split("[[touch]]").nth(1).unwrap();
    let sensor = "[sensor]\nkind = \"ideal\"";
    let touch = touch.replace("on = \"body\"\n", "");
    let touch = format!("friction = {MU}\n{touch}");
    let run = moments(simulated(&body, sensor, [20.0, 1.5], &touch), |_| ());
    let mut on_both = 0;
    let mut slipping = 0;
    for moment in &run {
        on_both += usize::from(moment.touch.flags.contains(TouchFlags::SEVERAL_LINKS));
        slipping += usize::from(slips(moment) && (moment.touch.friction.unwrap() / MU - 1.0).abs() < 0.1);
    }
    eprintln!("{} frames, {on_both} on both links, {slipping} slip", run.len());
    assert!(on_both > 10 && slipping > 15);
    // The same presses on a body of pressure taxels.
    let mut of_plain = simulated(&plain, sensor, [20.0, 1.5], &touch);
    let pressed = with_wrenches(TouchOutputs::empty());
    let mut engine = engine(&plain, &of_plain.calibration(), pressed);
    let mut frame = Frame::missing(0.0, of_plain.taxels().len());
    let mut compared = 0;
    while of_plain.next_frame(&mut frame).unwrap() {
        assert!(of_plain.truth().iter().all(|truth| truth.shear_in_link.is_none()));
        let Some(moment) = run.iter().find(|moment| moment.frame.t_s == frame.t_s) else { continue };
        assert_eq!(frame.values[..], moment.frame.values[..frame.values.len()]);
        let touches = engine.process_one(&frame).unwrap().touches(0).unwrap();
        let own = &touches.touches[0];
        assert!(own.shear.is_none() && own.friction.is_none() && !own.flags.contains(TouchFlags::STILL));
        assert_eq!((own.total, own.position), (moment.touch.total, moment.touch.position));
        let taxels: Vec<usize> = touches.taxels(own).iter().map(|&node| node as usize).collect();
        for share in touches.links(own) {
            let on_link = taxels.iter().copied().filter(|&index| plain.taxels[index].link == share.link as usize);
            let right = right_wrench(&plain, &moment.frame, on_link, false);
            assert!(off(&share.wrench.unwrap(), &right) < 1e-5);
        }
        compared += 1;
    }
    assert!(compared > 20);
}

#[test]
fn what_touches_of_the_whole_body_cannot_do_is_refused() {
    let body = limb();
    let why = |touch: &str| {
        let text = format!(
            "rate_hz = 10\nduration_s = 1\n[layer]\nthickness_m = 0.007\n[[touch]]\non = \"body\"\n\
             path = [{{ taxel = 0 }}]\nhold = {{ newton = 1 }}\n{touch}\n"
        );
        SimulatedSource::on_body("a.toml", &text, body.clone()).map(|_| ()).unwrap_err().to_string()
    };
    let ball = "indenter = \"ball\"\nradius_m = 0.01\n";
    let rod = "indenter = \"rod\"\nradius_m = 0.01\nlength_m = 0.02\nfriction = 1\n";
    for (touch, words) in [
        (format!("{ball}celsius = 30"), "`celsius` has no effect for a touch of the whole body"),
        (format!("{ball}gap_m = [[0, 0]]"), "`gap_m` has no effect for a touch of the whole body"),
        (format!("{ball}twist_deg = [[0, 0]]"), "`twist_deg` has no effect without `friction`"),
        (format!("{ball}friction = 0"), "`friction` is 0; it must be over 0"),
        (format!("{rod}twist_deg = [[0, 0]]"), "`twist_deg` has no effect for this indenter, which `angle_deg` turns"),
    ] {
        let found = why(&touch);
        assert!(found.contains(words) && found.starts_with("a.toml: line"), "{found}");
    }
}
