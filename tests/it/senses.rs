//! Shear, temperature and proximity on every backend: the same bits everywhere, however frames are cut; nothing of
//! one letter is in another, and nothing costs a body without such taxels anything.

use glam::{DQuat, DVec2, DVec3};
use somatic::body::{ChartKind, ChartSpec, FieldSpec, MemberSpec, Modality, Taxel};
use somatic::internal::body::Glb;
use somatic::signal::Pose;
use somatic::{
    BackendKind, Body, Calibration, Engine, Flags, Frame, Letter, Options, Outputs, Percept, RawValue, Receptor, Scene,
};

use crate::common::{Flat, backends};

pub const PITCH: f64 = 0.005;
pub const SIDE: u32 = 5;
/// Ids of the first taxel of each kind.
pub const WARM: u32 = 100;
pub const NEAR: u32 = 200;
pub const CALIBRATION: &str = "[all]\nunit = \"N\"\nnoise = 0.01\n[shear]\nslips_at = 0.5\n[proximity]\nunit = \"mm\"\nrange = 80\n\
                           window_s = 0.2\n[temperature]\nwindow_s = 0.5\n";

pub fn grid() -> impl Iterator<Item = (u32, DVec2)> {
    let half = f64::from(SIDE - 1) / 2.0;
    (0..SIDE * SIDE).map(move |i| (i, PITCH * DVec2::new(f64::from(i % SIDE) - half, f64::from(i / SIDE) - half)))
}

/// A sheet whose normal is +y in its link, with 25 taxels of each kind, and one field over the first `kinds` of them.
/// Its chart's +u is +x and its +v −z; tangents are turned by 90° against that.
pub fn skin(kinds: usize) -> Body {
    let mut glb = Glb::new();
    let link = glb.node("skin", None, DVec3::ZERO);
    let all = [(0, Modality::Force3), (WARM, Modality::Temperature), (NEAR, Modality::Proximity)];
    for (first, modality) in all.into_iter().take(kinds) {
        let taxel = |(i, at): (u32, DVec2)| Taxel {
            id: first + i,
            link: 0,
            position_in_link: DVec3::new(at.x, 0.0, -at.y),
            normal_in_link: DVec3::Y,
            area: PITCH * PITCH,
            modality,
            tangent_in_link: (modality == Modality::Force3).then_some(DVec3::NEG_Z),
        };
        let taxels: Vec<Taxel> = grid().map(taxel).collect();
        glb.taxels(&format!("taxels {first}"), Some(link), &taxels, None);
    }
    let chart =
        ChartSpec { kind: ChartKind::Plane, origin_in_anchor: Some([0.0; 3]), u_in_anchor: Some([1.0, 0.0, 0.0]) };
    let ids = all.into_iter().take(kinds).flat_map(|(first, _)| (0..SIDE * SIDE).map(move |i| first + i));
    let members = ids.map(|id| (id, MemberSpec::default())).collect();
    glb.field(&FieldSpec { name: "skin".into(), parent: None, members, chart: Some(chart) }, Some(link), DVec3::ZERO);
    Body::from_bytes("skin", &glb.to_bytes().unwrap()).unwrap()
}

pub fn engine(body: &Body, kind: BackendKind, scene: Scene) -> Engine {
    let ids: Vec<u32> = body.taxels.iter().map(|taxel| taxel.id).collect();
    let calibration = Calibration::parse(CALIBRATION, &ids).unwrap();
    Engine::new(body, Options::default().scene(scene).calibration(Some(calibration)).backend(kind).batch(16)).unwrap()
}

/// A finger's pressure at `at`, N.
fn pressure(at: DVec2, of: DVec2) -> f64 {
    let share = 1.0 - (of - at).length_squared() / (2.5 * PITCH).powi(2);
    (0.2 * share).max(0.0)
}

/// What a touch does in a frame.
#[derive(Clone, Copy)]
pub struct Touch {
    pub at: DVec2,
    /// Tangential force over pressure, along u and v of the chart.
    pub drag: DVec2,
    /// The same, about the middle, for each metre of distance.
    pub twist: f64,
    /// Of what comes near, m.
    pub distance_m: f64,
    /// Of a plane of temperatures in the middle, °C.
    pub celsius: f64,
}

impl Touch {
    pub fn frame(self, engine: &Engine, t_s: f64) -> Frame {
        let mut frame = engine.frame(t_s);
        let mut set = |name: String, value: f64| {
            if let Some(index) = engine.index_of(&name) {
                frame.values[index] = RawValue::new(value);
            }
        };
        for (i, of) in grid() {
            let p = pressure(self.at, of);
            let s = p * (self.drag + self.twist * (of - self.at).perp());
            set(i.to_string(), p);
            // t is the chart's +v and n × t its −u.
            set(format!("{i}.u"), s.y);
            set(format!("{i}.v"), -s.x);
            set((WARM + i).to_string(), self.celsius + 300.0 * of.x - 100.0 * of.y);
            set((NEAR + i).to_string(), 1e3 * (self.distance_m + (of - self.at).length()));
        }
        frame
    }
}

pub const TOUCH: Touch =
    Touch { at: DVec2::ZERO, drag: DVec2::new(0.3, 0.1), twist: 0.0, distance_m: 0.03, celsius: 31.0 };

/// The percepts of `frames`, which are the same however they are cut and agree with the reference.
fn run(body: &Body, kind: BackendKind, scene: &Scene, touches: &[(f64, Touch)]) -> Vec<Vec<Percept>> {
    let cut_by = |cut: usize| {
        let mut engine = engine(body, kind, scene.clone());
        let frames: Vec<Frame> = touches.iter().map(|&(t_s, touch)| touch.frame(&engine, t_s)).collect();
        let mut seen = Vec::new();
        for part in frames.chunks(cut) {
            let (percepts, agreement) = engine.process_and_compare(part).unwrap();
            assert!(agreement.holds(), "{kind:?}: {agreement}");
            seen.extend((0..part.len()).map(|frame| percepts.frame(frame).collect::<Vec<_>>()));
        }
        seen
    };
    let whole = cut_by(touches.len());
    for cut in [1, 5] {
        assert_eq!(cut_by(cut), whole, "{kind:?} cut by {cut}");
    }
    whole
}

fn close(a: DVec2, b: DVec2, within: f64) {
    assert!((a - b).length() <= within, "{a} is not {b}");
}

#[test]
fn a_field_of_all_kinds_has_a_percept_for_each_letter_and_they_are_right() {
    let body = skin(3);
    let touches: Vec<(f64, Touch)> = (0..20)
        .map(|i| {
            let t_s = 0.05 * f64::from(i);
            (t_s, Touch { distance_m: 0.06 - 0.04 * t_s, celsius: 25.0 + 6.0 * t_s, ..TOUCH })
        })
        .collect();
    let mut all: Vec<Vec<Vec<Percept>>> = Vec::new();
    for kind in backends() {
        let percepts = run(&body, kind, &Scene::default(), &touches);
        let [ref pressure, ref shear, ref warm, ref near] = percepts[19][..] else {
            panic!("{} percepts", percepts[19].len());
        };
        assert_eq!([pressure, shear, warm, near].map(|percept| percept.letter), [0, 1, 2, 3]);
        let total = pressure.total.unwrap();
        assert!(
            pressure.shear.is_none() && shear.total.is_none() && warm.nearest.is_none() && near.temperature.is_none()
        );
        // Each taxel is pulled by 0.3 and 0.1 of its pressure.
        close(DVec2::from_array(shear.shear.unwrap()), total * TOUCH.drag, 1e-6 * total);
        assert!((shear.shear_direction.unwrap() - TOUCH.drag.to_angle()).abs() < 1e-6);
        assert!((shear.friction.unwrap() - TOUCH.drag.length()).abs() < 1e-6 && shear.contact);
        assert!((shear.slip_ratio.unwrap() - 2.0 * TOUCH.drag.length()).abs() < 1e-6);
        assert!(shear.torsion.unwrap().abs() < 1e-9);
        // In the link: u is +x, v −z, the normal +y.
        let force = DVec3::from_array(shear.force_vector.unwrap());
        assert!((force - total * DVec3::new(0.3, -1.0, -0.1)).length() < 1e-5 * total, "{force}");
        let celsius = 25.0 + 6.0 * 0.95;
        assert!((warm.temperature.unwrap() - celsius).abs() < 1e-5);
        close(DVec2::from_array(warm.temperature_gradient.unwrap()), DVec2::new(300.0, -100.0), 1e-2);
        assert!((warm.temperature_rate.unwrap() - 6.0).abs() < 1e-3);
        assert_eq!((warm.warmest_taxel, warm.coldest_taxel), (Some(WARM + 4), Some(WARM + 20)));
        // Positions are stored in single precision.
        assert!((warm.warmest_position.unwrap()[0] - 2.0 * PITCH).abs() < 1e-9);
        assert!((near.nearest.unwrap() - (0.06 - 0.04 * 0.95)).abs() < 1e-8 && near.nearest_taxel == Some(NEAR + 12));
        assert!((near.approach_speed.unwrap() - 0.04).abs() < 1e-5 && near.covered == Some(25));
        close(DVec2::from_array(near.proximity_centroid.unwrap()), DVec2::ZERO, 1e-9);
        assert_eq!(near.nearest_normal, Some([0.0, 1.0, 0.0]));
        // No rate before half a window.
        assert!(percepts[4][2].temperature_rate.is_none() && percepts[4][2].flags.contains(Flags::NO_PREVIOUS));
        all.push(percepts);
    }
    for other in &all[1..] {
        for (a, b) in all[0].iter().flatten().zip(other.iter().flatten()).filter(|(a, _)| a.letter > 0) {
            assert_eq!(a, b, "made of raw values, these are the same bits on every backend");
        }
    }
}

#[test]
fn a_twist_has_the_sign_of_its_sense_and_no_direction() {
    let body = skin(1);
    for (twist, sign) in [(40.0, 1.0), (-40.0, -1.0)] {
        let touch = Touch { drag: DVec2::ZERO, twist, ..TOUCH };
        let percepts = run(&body, BackendKind::Cpu, &Scene::default(), &[(0.0, touch)]);
        let shear = percepts[0].iter().find(|percept| percept.letter == 1).unwrap();
        assert!(shear.torsion.unwrap() * sign > 1e-4, "{:?}", shear.torsion);
        // What pulls on one side is what pulls on the other, to the last bit.
        assert_eq!((shear.shear_direction, shear.flags.contains(Flags::STILL)), (None, true), "{:?}", shear.friction);
        assert!(shear.friction.unwrap() < 1e-9);
    }
}

#[test]
fn a_touch_pulls_and_is_warm_as_the_taxels_under_it() {
    let body = skin(3);
    for kind in backends() {
        let scene = Scene::default().touches(somatic::touch::Options::default());
        let mut engine = engine(&body, kind, scene);
        let at = DVec2::new(PITCH, 0.0);
        let touch = Touch { at, ..TOUCH };
        let frame = touch.frame(&engine, 0.0);
        let touches = engine.process_one(&frame).unwrap().touches(0).unwrap();
        let [felt] = &touches.touches[..] else { panic!("{} touches", touches.touches.len()) };
        let force = felt.force_vector_newton.unwrap();
        let right = felt.total * DVec3::new(0.3, -1.0, -0.1);
        assert!((force - right).length() < 1e-5 * felt.total, "{kind:?}: {force}, not {right}");
        assert!((felt.shear.unwrap() - DVec3::new(0.3, 0.0, -0.1) * felt.total).length() < 1e-5 * felt.total);
        assert!((felt.friction.unwrap() - TOUCH.drag.length()).abs() < 1e-5 && felt.torsion.unwrap().abs() < 1e-8);
        // A taxel of temperature lies on each pressed one.
        let under = grid().filter(|&(_, of)| pressure(at, of) > 0.0);
        let of_each = under.map(|(_, of)| TOUCH.celsius + 300.0 * of.x - 100.0 * of.y).collect::<Vec<_>>();
        let mean = of_each.iter().sum::<f64>() / of_each.len() as f64;
        assert!((felt.temperature_celsius.unwrap() - mean).abs() < 1e-4);
        // What is pressed pushes, whether it is known how it pulls or not; in a field, too.
        let mut lost = touch.frame(&engine, 0.1);
        lost.values[engine.index_of("13.u").unwrap()] = RawValue::MISSING;
        let percepts = engine.process_one(&lost).unwrap();
        let felt = &percepts.touches(0).unwrap().touches[0];
        let of_field = DVec3::from_array(percepts.get(0, 1).force_vector.unwrap());
        for force in [felt.force_vector_newton.unwrap(), of_field] {
            // Taxel 13 is in the middle of the touch: it presses by 0.2 N, and how it pulls is not known.
            let right = felt.total * DVec3::new(0.3, -1.0, -0.1) - 0.2 * DVec3::new(0.3, 0.0, -0.1);
            assert!((force - right).length() < 1e-5 * felt.total, "{kind:?}: {force}, not {right}");
        }
        assert!(felt.flags.contains(somatic::percept::TouchFlags::INCOMPLETE));
    }
    let plain = Flat::new(&[[0.0, 0.0], [0.01, 0.0]]).field("skin", None, 0..2).body();
    let scene = Scene::default().touches(somatic::touch::Options::default());
    let mut engine = Engine::new(&plain, Options::default().scene(scene).backend(BackendKind::Cpu)).unwrap();
    let mut frame = engine.frame(0.0);
    frame.values.fill(RawValue::new(1.0));
    let touches = engine.process_one(&frame).unwrap().touches(0).unwrap();
    assert!(touches.touches[0].shear.is_none() && touches.touches[0].temperature_celsius.is_none());
}

#[test]
fn vectors_and_places_turn_with_the_link() {
    let body = skin(3);
    let mut engine = engine(&body, BackendKind::Cpu, Scene::default());
    let rotation = DQuat::from_rotation_x(std::f64::consts::FRAC_PI_2);
    let mut frame = TOUCH.frame(&engine, 0.0);
    let at_rest: Vec<Percept> = engine.process_one(&frame).unwrap().frame(0).collect();
    frame.t_s = 0.1;
    frame.pose.push(("skin".into(), Pose { translation: DVec3::Z, rotation }));
    let posed: Vec<Percept> = engine.process_one(&frame).unwrap().frame(0).collect();
    assert!(at_rest.iter().all(|percept| !percept.in_world) && posed.iter().all(|percept| percept.in_world));
    let turned = |vector: Option<[f64; 3]>| rotation * DVec3::from_array(vector.unwrap());
    let same =
        |a: Option<[f64; 3]>, b: DVec3| assert!((DVec3::from_array(a.unwrap()) - b).length() < 1e-12, "{a:?} {b}");
    same(posed[1].force_vector, turned(at_rest[1].force_vector));
    same(posed[1].shear_vector, turned(at_rest[1].shear_vector));
    same(posed[2].warmest_position, turned(at_rest[2].warmest_position) + DVec3::Z);
    same(posed[3].nearest_normal, turned(at_rest[3].nearest_normal));
}

#[test]
fn what_is_missing_or_out_of_range_is_said_and_the_rest_counts() {
    let body = skin(3);
    let mut engine = engine(&body, BackendKind::Reference, Scene::default());
    let mut frame = Touch { distance_m: 0.5, ..TOUCH }.frame(&engine, 0.0);
    let mut put = |name: &str, value: RawValue| frame.values[engine.index_of(name).unwrap()] = value;
    put("12.u", RawValue::MISSING);
    put("7.v", RawValue::FAULTY);
    put("100", RawValue::FAULTY);
    put("101", RawValue::MISSING);
    let percepts: Vec<Percept> = engine.process_one(&frame).unwrap().frame(0).collect();
    let [pressure, shear, warm, near] = &percepts[..] else { panic!() };
    // Its normal part counts.
    assert!(!pressure.flags.intersects(Flags::INCOMPLETE | Flags::FAULTY_INPUT) && pressure.peak.unwrap() > 0.19);
    assert!(shear.flags.contains(Flags::INCOMPLETE | Flags::FAULTY_INPUT));
    assert!((shear.friction.unwrap() - TOUCH.drag.length()).abs() < 1e-6);
    assert!(warm.flags.contains(Flags::INCOMPLETE | Flags::FAULTY_INPUT));
    // Of 25 around 31 °C the two are lost that read 29 and 30.5 °C.
    let mean = (25.0 * TOUCH.celsius - 29.0 - 30.5) / 23.0;
    assert!((warm.temperature.unwrap() - mean).abs() < 1e-5, "{:?}", warm.temperature);
    assert!(near.nearest.is_none() && near.covered == Some(0) && !near.contact);
    assert!(near.flags.contains(Flags::OUT_OF_RANGE | Flags::NO_CONTACT));
    // What touches a distance sensor is as near as it can tell.
    let close = Touch { distance_m: 0.0, ..TOUCH }.frame(&engine, 0.1);
    let near = engine.process_one(&close).unwrap().get(0, 3);
    assert!(near.nearest == Some(1e-4) && near.flags.contains(Flags::SATURATED));
}

#[test]
fn what_is_lost_for_a_while_is_no_motion_and_what_tells_nothing_counts_nothing() {
    let body = skin(3);
    for kind in backends() {
        let mut engine = engine(&body, kind, Scene::default());
        for index in 0..40 {
            let mut frame = TOUCH.frame(&engine, 0.05 * f64::from(index));
            // The nearest and the warmest taxel now and then, and all of both kinds in one frame.
            let all = (WARM..WARM + SIDE * SIDE).chain(NEAR..NEAR + SIDE * SIDE);
            let lost: Vec<u32> = match index {
                0 => Vec::new(),
                20 => all.collect(),
                _ if index % 3 == 0 => vec![WARM + 4, NEAR + 12],
                _ => Vec::new(),
            };
            for id in lost {
                frame.values[engine.index_of(&id.to_string()).unwrap()] = RawValue::MISSING;
            }
            let percepts: Vec<Percept> = engine.process_one(&frame).unwrap().frame(0).collect();
            let (warm, near) = (percepts[2], percepts[3]);
            if index == 20 {
                assert!(warm.temperature.is_none() && near.covered.is_none(), "{near:?}");
                assert_eq!(near.flags, Flags::INCOMPLETE | Flags::NO_CONTACT);
                continue;
            }
            if index >= 10 {
                let (rate, speed) = (warm.temperature_rate.unwrap(), near.approach_speed.unwrap());
                assert!(rate.abs() < 1e-9 && speed.abs() < 1e-9, "{kind:?} {index}: {rate} K/s, {speed} m/s");
            }
        }
    }
}

#[test]
fn what_presses_pushes_where_nothing_is_known_of_how_it_pulls() {
    let body = skin(1);
    for kind in backends() {
        let mut engine = engine(&body, kind, Scene::default());
        let mut frame = TOUCH.frame(&engine, 0.0);
        for (i, _) in grid() {
            frame.values[engine.index_of(&format!("{i}.v")).unwrap()] = RawValue::MISSING;
        }
        let percepts: Vec<Percept> = engine.process_one(&frame).unwrap().frame(0).collect();
        let (pressure, shear) = (percepts[0], percepts[1]);
        let force = DVec3::from_array(shear.force_vector.unwrap());
        assert!((force - pressure.total.unwrap() * DVec3::NEG_Y).length() < 1e-6, "{kind:?}: {force}");
        assert!(shear.contact && shear.flags.contains(Flags::INCOMPLETE) && !shear.flags.contains(Flags::NO_CONTACT));
        assert!(shear.shear.is_none() && shear.shear_vector.is_none() && shear.friction.is_none());
        assert!(shear.torsion.is_none() && !shear.flags.contains(Flags::ONE_TAXEL));
    }
}

#[test]
fn one_taxel_has_no_torsion_and_two_have_no_gradient() {
    let body = skin(3);
    let mut engine = engine(&body, BackendKind::Reference, Scene::default());
    let mut frame = TOUCH.frame(&engine, 0.0);
    for i in (0..SIDE * SIDE).filter(|i| *i != 12) {
        frame.values[engine.index_of(&i.to_string()).unwrap()] = RawValue::new(0.0);
    }
    for i in (0..SIDE * SIDE).filter(|i| *i != 3 && *i != 12) {
        frame.values[engine.index_of(&(WARM + i).to_string()).unwrap()] = RawValue::MISSING;
    }
    let percepts: Vec<Percept> = engine.process_one(&frame).unwrap().frame(0).collect();
    assert!(percepts[1].torsion.is_none() && percepts[1].flags.contains(Flags::ONE_TAXEL));
    close(DVec2::from_array(percepts[1].shear.unwrap()), 0.2 * TOUCH.drag, 1e-8);
    assert!(percepts[2].temperature_gradient.is_none() && percepts[2].flags.contains(Flags::NO_GRADIENT));
    assert!(!percepts[2].flags.contains(Flags::COINCIDENT) && !percepts[1].flags.contains(Flags::NO_GRADIENT));
}

#[test]
fn shear_whose_calibration_does_not_say_what_it_is_made_of_is_refused() {
    let (body, ids) = (skin(1), (0..SIDE * SIDE).collect::<Vec<_>>());
    let made = |calibration: &str, outputs: Outputs| {
        let calibration = Calibration::parse(calibration, &ids).unwrap();
        let options = Options::default().scene(Scene::default().outputs(outputs)).calibration(Some(calibration));
        Engine::new(&body, options.backend(BackendKind::Reference)).map(|_| ()).map_err(|e| e.to_string())
    };
    let curve = "[curve.c]\nraw = [0, 10]\np = [0, 1]\n[all]\ncurve = \"c\"\n";
    let why = made(curve, Outputs::USUAL).unwrap_err();
    assert!(why.contains("taxel 0 has a curve or is an FSR") && why.contains("`gain` in [shear]"), "{why}");
    made(&format!("{curve}[shear]\ngain = 0.1\n"), Outputs::USUAL).unwrap();
    made(curve, Outputs::TOTAL).unwrap();
    made(curve, Outputs::SELF_CONTACTS).unwrap();
}

#[test]
fn letters_are_those_that_are_asked_for_and_each_needs_its_taxels() {
    let letters = |receptors: &[Receptor]| Letter::all_of(receptors, &[]);
    let body = skin(3);
    let count = |scene: Scene| engine(&body, BackendKind::Cpu, scene).plan().letters().len();
    assert_eq!(count(Scene::default()), 4);
    assert_eq!(count(Scene::default().letters(letters(&[Receptor::Sustained, Receptor::Change]))), 2);
    assert_eq!(count(Scene::default().outputs(Outputs::TOTAL)), 1);
    assert_eq!(count(Scene::default().outputs(Outputs::TOTAL | Outputs::WARMEST)), 2);
    assert_eq!(count(Scene::default().letters(letters(&[Receptor::Temperature])).touches(None)), 1);
    let plain = Flat::new(&[[0.0, 0.0], [0.01, 0.0]]).field("skin", None, 0..2).body();
    let why = |scene: Scene| {
        let made = Engine::new(&plain, Options::default().scene(scene).backend(BackendKind::Cpu));
        made.map(|_| ()).unwrap_err().to_string()
    };
    let shear = why(Scene::default().letters(letters(&[Receptor::Shear])));
    assert!(shear.contains("letter `shear` has no taxels"), "{shear}");
    let nearest = why(Scene::default().outputs(Outputs::NEAREST));
    assert!(nearest.contains("`nearest` is of letter `proximity`"), "{nearest}");
    // A body of plain taxels has what it had.
    let plain = Engine::new(&plain, Options::default().backend(BackendKind::Cpu)).unwrap();
    assert!(plain.plan().letters().len() == 1 && !plain.plan().outputs().intersects(Outputs::OF_OTHER_LETTERS));
}

#[test]
fn a_skin_without_any_pressure_is_read_on_every_backend() {
    let (mut glb, chart) = (Glb::new(), ChartKind::Plane);
    let link = glb.node("skin", None, DVec3::ZERO);
    let taxel = |(i, at): (u32, DVec2)| Taxel {
        id: NEAR + i,
        link: 0,
        position_in_link: DVec3::new(at.x, 0.0, -at.y),
        normal_in_link: DVec3::Y,
        area: 0.0,
        modality: Modality::Proximity,
        tangent_in_link: None,
    };
    glb.taxels("taxels", Some(link), &grid().map(taxel).collect::<Vec<_>>(), None);
    let members = (0..SIDE * SIDE).map(|i| (NEAR + i, MemberSpec::default())).collect();
    let chart = Some(ChartSpec { kind: chart, origin_in_anchor: None, u_in_anchor: None });
    glb.field(&FieldSpec { name: "skin".into(), parent: None, members, chart }, Some(link), DVec3::ZERO);
    let body = Body::from_bytes("skin", &glb.to_bytes().unwrap()).unwrap();
    for kind in backends() {
        let scene = Scene::default().touches(somatic::touch::Options::default());
        let percepts = run(&body, kind, &scene, &[(0.0, TOUCH), (0.1, TOUCH)]);
        for frame in &percepts {
            let [near] = frame[..] else { panic!("{kind:?}: {} percepts", frame.len()) };
            assert!((near.nearest.unwrap() - TOUCH.distance_m).abs() < 1e-8, "{kind:?}: {:?}", near.nearest);
            assert_eq!((near.nearest_taxel, near.covered), (Some(NEAR + 12), Some(25)), "{kind:?}");
        }
    }
}

#[test]
fn the_first_frame_may_be_the_rest_of_tangential_values_too() {
    let body = skin(1);
    for kind in backends() {
        let options = Options::default().backend(kind).tare(true);
        let mut engine = Engine::new(&body, options).unwrap();
        let frame = |engine: &Engine, t_s: f64, more: [f64; 3]| {
            let mut frame = engine.frame(t_s);
            for (i, _) in grid() {
                for (axis, (rest, more)) in
                    ["", ".u", ".v"].into_iter().zip([100.0, 510.0, 530.0].into_iter().zip(more))
                {
                    let index = engine.index_of(&format!("{i}{axis}")).unwrap();
                    frame.values[index] = RawValue::new(rest + if i == 12 { more } else { 0.0 });
                }
            }
            frame
        };
        let rest = frame(&engine, 0.0, [0.0; 3]);
        assert!(engine.process_one(&rest).unwrap().frame(0).all(|percept| !percept.contact));
        let state = engine.state().unwrap();
        let pulled = frame(&engine, 0.1, [3.0, 1.0, -2.0]);
        let percepts: Vec<Percept> = engine.process_one(&pulled).unwrap().frame(0).collect();
        // t is the chart's +v and n × t its −u.
        close(DVec2::from_array(percepts[1].shear.unwrap()), DVec2::new(2.0, 1.0), 1e-9);
        assert_eq!(percepts[0].total, Some(3.0));
        // An engine that goes on from there knows them.
        let mut other = Engine::new(&body, Options::default().backend(kind).tare(true)).unwrap();
        other.restore(&state).unwrap();
        assert_eq!(other.process_one(&pulled).unwrap().frame(0).collect::<Vec<_>>(), percepts);
    }
}
