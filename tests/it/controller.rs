//! What the example of a controller takes off a joint's torque, against the truth of the simulation that it runs on.

use glam::DVec3;
use somatic::source::{SimulatedSource, Source as _};
use somatic::{Body, Calibration, Engine, Frame, Options, Scene, touch};

use self::joint_torques::{Joint, Pressed};

#[allow(dead_code, unreachable_pub, reason = "an example has a main of its own")]
#[path = "../../examples/joint_torques.rs"]
mod joint_torques;

const ELBOW: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/examples/simulations/elbow.toml");

fn engine(source: &SimulatedSource, unit: &str) -> Engine {
    let body = source.body();
    let ids: Vec<u32> = body.taxels.iter().map(|taxel| taxel.id).collect();
    let text = Calibration::lay_over(&source.calibration(), unit).unwrap().text;
    let options = Options::default()
        .scene(Scene::default().touches(touch::Options::default()))
        .calibration(Calibration::parse(&text, &ids).unwrap());
    let mut engine = Engine::new(body, options).unwrap();
    engine.set_channels(source.taxels()).unwrap();
    engine
}

/// What is true: each touch's force, along its normal and at its place, in the frame of `joint`'s link; and how far from its origin
/// the farthest of them is, m.
fn truth(source: &SimulatedSource, body: &Body, joint: &Joint) -> (Pressed, f64) {
    let mut sum = Pressed { force_newton: DVec3::ZERO, torque_newton_m: DVec3::ZERO };
    let mut lever_m: f64 = 0.0;
    for touch in source.truth() {
        let link = body.links.iter().position(|link| link.name == touch.link).unwrap();
        if joint.is_moved[link] {
            let own_from_link = body.links[joint.link].body_from_link.inverse() * body.links[link].body_from_link;
            let force = own_from_link.transform_vector3(-touch.normal_in_link * touch.force_newton);
            sum.force_newton += force;
            let place = own_from_link.transform_point3(touch.position_in_link);
            sum.torque_newton_m += place.cross(force);
            lever_m = lever_m.max(place.length());
        }
    }
    (sum, lever_m)
}

#[test]
fn a_joint_bears_what_presses_on_its_link_and_below_and_nothing_else() {
    let mut source = SimulatedSource::open(ELBOW).unwrap();
    let body = source.body().clone();
    let mut engine = engine(&source, "[all]\nunit = \"N\"\n");
    let [elbow, shoulder] = ["left_forearm", "left_upper_arm"].map(|link| Joint::new(&body, link, "x").unwrap());
    let (mut frame, mut presses) = (Frame::missing(0.0, source.taxels().len()), Vec::new());
    let (mut compared, mut unmoved) = ([0, 0], 0);
    // Every third frame: a simulated one takes longer than what is tested.
    for index in (0..).step_by(3) {
        source.seek(index);
        if !source.next_frame(&mut frame).unwrap() {
            break;
        }
        engine.process_one(&frame).unwrap();
        engine.presses_on_links(&mut presses);
        for (joint, compared) in [&elbow, &shoulder].into_iter().zip(&mut compared) {
            let found = joint.pressed(&body, &presses).unwrap();
            let (right, lever_m) = truth(&source, &body, joint);
            let total = |is_moved: bool| -> f64 {
                let own = presses.iter().filter(|press| joint.is_moved[press.link as usize] == is_moved);
                own.map(|press| press.total).sum()
            };
            // What lies on both sides of the joint is, in the truth, on one of them alone.
            if right.force_newton.length() > 5.0 && total(false) < 0.02 * total(true) {
                let off_newton = found.force_newton.distance(right.force_newton);
                let off_newton_m = found.torque_newton_m.distance(right.torque_newton_m);
                // Sensors up to 3 cm apart on limbs 4 cm thick, each with its own normal: a quarter.
                let truth_newton = right.force_newton.length();
                assert!(off_newton < 0.3 * truth_newton, "{} s: {off_newton} N", frame.t_s);
                assert!(off_newton_m < 0.3 * truth_newton * lever_m, "{} s: {off_newton_m} N m", frame.t_s);
                *compared += 1;
            } else if source.truth().iter().all(|touch| touch.link == "chest") {
                // Fingers on the chest are none of the arm's.
                assert!(found.force_newton == DVec3::ZERO && found.torque_newton_m == DVec3::ZERO);
                unmoved += usize::from(!source.truth().is_empty());
            }
        }
    }
    assert!(compared[0] >= 5 && compared[1] > compared[0] && unmoved >= 7, "{compared:?} {unmoved}");
}

#[test]
fn without_a_unit_the_example_says_what_is_missing() {
    let mut source = SimulatedSource::open(ELBOW).unwrap();
    let body = source.body().clone();
    // A count, whatever the simulation's own calibration says.
    let ids: Vec<u32> = body.taxels.iter().map(|taxel| taxel.id).collect();
    let scene = Scene::default().touches(touch::Options::default());
    let counts = Calibration::parse("[all]\ngain = 1\n", &ids).unwrap();
    let mut engine = Engine::new(&body, Options::default().scene(scene).calibration(counts)).unwrap();
    engine.set_channels(source.taxels()).unwrap();
    let joint = Joint::new(&body, "left_upper_arm", "z").unwrap();
    let (mut frame, mut presses) = (Frame::missing(0.0, source.taxels().len()), Vec::new());
    source.seek(16);
    assert!(source.next_frame(&mut frame).unwrap());
    engine.process_one(&frame).unwrap();
    engine.presses_on_links(&mut presses);
    let why = joint.pressed(&body, &presses).err().unwrap().to_string();
    assert!(why.contains("left_upper_arm") && why.contains("calibration with a unit"), "{why}");
    assert!(Joint::new(&body, "tail", "x").is_err() && Joint::new(&body, "left_hand", "w").is_err());
}
