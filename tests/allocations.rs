//! Once it runs, the `cpu` backend allocates nothing for a frame, with or without touches and poses, but for the tasks of one that is shared
//! among cores, and for what is made on request of all that a touch or a field feels: standard deviations, fits and self-contacts.

use glam::DQuat;
use somatic::percept::TouchOutputs;
use somatic::signal::Pose;
use somatic::{BackendKind, Body, Calibration, Engine, Options, Outputs, RawValue, Receptor, Scene, bundled};

/// Allocations of 100 frames, one a call, after some that make room. `posed`: every frame says where each link is.
fn allocations(body: &Body, scene: &Scene, calibration: Option<&str>, posed: bool) -> u64 {
    let ids: Vec<u32> = body.taxels.iter().map(|taxel| taxel.id).collect();
    let calibration = calibration.map(|text| Calibration::parse(text, &ids).unwrap());
    let options = Options::default().scene(scene.clone()).calibration(calibration).backend(BackendKind::Cpu);
    let mut engine = Engine::new(body, options).unwrap();
    let mut frame = engine.frame(0.0);
    if posed {
        frame.pose.extend(body.links.iter().map(|link| {
            let at_rest = link.world_from_link().translation;
            (link.name.clone(), Pose { translation: at_rest, rotation: DQuat::IDENTITY })
        }));
    }
    let (mut touched, mut touches) = (0, 0);
    let mut process = |number: u32| {
        frame.t_s = f64::from(number) * 0.01;
        for (value, index) in frame.values.iter_mut().zip(0_u32..) {
            // A touch that wanders.
            *value = RawValue::new(f64::from((index + number) % 19).max(9.0) - 9.0);
        }
        for ((_, pose), index) in frame.pose.iter_mut().zip(0_u32..) {
            // Each link turns at a speed of its own.
            pose.rotation = DQuat::from_rotation_y(f64::from(number * (index % 7)) * 1e-3);
        }
        let percepts = engine.process(std::slice::from_ref(&frame)).unwrap();
        touched += percepts.touched(0).count();
        touches += percepts.touches(0).map_or(0, |found| found.touches.len());
    };
    (0..100).for_each(&mut process);
    let made = allocation_counter::measure(|| (100..200).for_each(&mut process)).count_total;
    assert!(touched > 100, "{touched}");
    assert_eq!(touches > 100, scene.touches.is_some(), "{touches}");
    made
}

const CHECKS: &str = "[all]\nbaseline = 2\np_max = 30\n[checks]\nisolated_ratio = 5\n[contact]\non = 3\noff = 1";

#[test]
fn a_frame_on_the_cpu_allocates_nothing() {
    // The sensing hand also measures shear, temperature and proximity.
    for bytes in [bundled::HAND, bundled::MAT, bundled::HUMANOID, bundled::SENSING_HAND] {
        let body = Body::from_bytes("body", bytes).unwrap();
        for calibration in [None, Some(CHECKS)] {
            for outputs in [Outputs::CENTROID | Outputs::ORIENTATION, Outputs::USUAL_AND_MOTION] {
                let scene = Scene::default().outputs(outputs);
                assert_eq!(allocations(&body, &scene, calibration, false), 0, "{outputs:?} {calibration:?}");
            }
        }
    }
}

/// The calibration of the sensing hand, which has every letter, with noise, so that there are standard deviations, and with a matrix that
/// corrects what is along the skin.
const SENSING: &str = "[all]\nunit = \"N\"\nnoise = 0.01\n\
                       [shear]\nslips_at = 0.6\ncross_axis = [[1, 0.01, 0], [0, 1, 0.02], [0.01, 0, 1]]\n\
                       [temperature]\nwindow_s = 0.5\n[proximity]\nunit = \"mm\"\nrange = 5";

const BODIES: [(&[u8], &str); 3] =
    [(bundled::HAND, CHECKS), (bundled::HUMANOID, CHECKS), (bundled::SENSING_HAND, SENSING)];

#[test]
fn a_frame_with_touches_of_all_letters_allocates_nothing() {
    let usual = somatic::touch::Options::default();
    // Shear and temperature are given where they are felt.
    let exact = TouchOutputs::USUAL | TouchOutputs::ORIENTATION | TouchOutputs::TAXELS | TouchOutputs::WRENCH;
    let exact = somatic::touch::Options { outputs: exact, ..usual };
    let mut made = Vec::new();
    for (bytes, calibration) in BODIES {
        let body = Body::from_bytes("body", bytes).unwrap();
        for (name, touches) in [("usual", usual), ("exact", exact)] {
            let scene = Scene::default().outputs(Outputs::USUAL_AND_MOTION).touches(touches);
            made.push((allocations(&body, &scene, Some(calibration), false), body.links.len(), name));
        }
    }
    assert!(made.iter().all(|(made, ..)| *made == 0), "in 100 frames, by links and outputs of touches: {made:?}");
    // That is of all letters.
    let body = Body::from_bytes("body", bundled::SENSING_HAND).unwrap();
    let scene = Scene::default().touches(usual);
    let engine = Engine::new(&body, Options::default().scene(scene).backend(BackendKind::Cpu)).unwrap();
    let felt = TouchOutputs::SHEAR | TouchOutputs::TEMPERATURE;
    assert!(engine.plan().touch_outputs().unwrap().contains(felt));
    let letters: Vec<Receptor> = engine.plan().letters().iter().map(|letter| letter.receptor).collect();
    for receptor in [Receptor::Sustained, Receptor::Shear, Receptor::Temperature, Receptor::Proximity] {
        assert!(letters.contains(&receptor), "{letters:?}");
    }
}

/// Of a body that stands still, and of one with joints, whose fields lie over several links, too.
#[test]
fn a_posed_frame_allocates_nothing() {
    let plain = Scene::default().outputs(Outputs::USUAL_AND_MOTION);
    let touched = plain.clone().touches(somatic::touch::Options::default());
    let exact = touched.clone().outputs(Outputs::all() - Outputs::SIGMAS - Outputs::SELF_CONTACTS);
    let mut made = Vec::new();
    for (bytes, calibration) in BODIES {
        let body = Body::from_bytes("body", bytes).unwrap();
        for (name, scene) in [("usual", &plain), ("usual and touches", &touched), ("exact", &exact)] {
            made.push((allocations(&body, scene, Some(calibration), true), body.links.len(), name));
        }
    }
    assert!(made.iter().all(|(made, ..)| *made == 0), "in 100 frames, by links and outputs: {made:?}");
}

#[test]
fn allocations_are_counted() {
    let body = Body::from_bytes("hand", bundled::HAND).unwrap();
    let made = allocation_counter::measure(|| drop(Engine::new(&body, Options::default())));
    assert!(made.count_total > 100, "{made:?}");
}

/// Frames of a hand that a joint turns, each emptied by its source as sources do.
#[cfg(feature = "meshes")]
struct Emptied(u32);

#[cfg(feature = "meshes")]
impl somatic::source::Source for Emptied {
    fn taxels(&self) -> &[u32] {
        &[]
    }

    fn next_frame(&mut self, frame: &mut somatic::Frame) -> somatic::Result<bool> {
        frame.clear();
        frame.t_s = f64::from(self.0) * 0.01;
        self.0 += 1;
        Ok(true)
    }
}

#[cfg(feature = "meshes")]
#[test]
fn positions_of_joints_in_a_frame_allocate_nothing() {
    use somatic::internal::author::mesh::Up;
    use somatic::internal::robot::{JointOptions, JointedSource};
    use somatic::internal::source::JointStates;
    use somatic::robot::Kinematics;
    use somatic::source::Source as _;
    let body = Body::from_bytes("hand", bundled::HAND).unwrap();
    // What hangs on the grip is no link of the body.
    let urdf = r#"<robot name="r"><link name="arm"/><link name="hand"/><link name="tool"/>
        <joint name="wrist" type="continuous"><parent link="arm"/><child link="hand"/><axis xyz="1 0 0"/></joint>
        <joint name="grip" type="continuous"><parent link="hand"/><child link="tool"/><axis xyz="1 0 0"/></joint></robot>"#;
    let allocations = |joint: &str, joints: usize| {
        let file = tempfile::NamedTempFile::new().unwrap();
        std::fs::write(file.path(), format!("t,wrist,{joint}\n0,0,0\n9,1,1\n")).unwrap();
        let mut options = JointOptions::new(Up::Y);
        (options.states, options.max_age_s) = (Some(JointStates::open(file.path()).unwrap()), 10.0);
        let robot = Kinematics::from_urdf("r", urdf).unwrap();
        let mut source = JointedSource::new(Box::new(Emptied(0)), robot, &body, options).unwrap();
        let mut frame = somatic::Frame::default();
        let mut read = || assert!(source.next_frame(&mut frame).unwrap());
        (0..10).for_each(|_| read());
        let made = allocation_counter::measure(|| (0..100).for_each(|_| read())).count_total;
        assert_eq!((frame.joints.len(), frame.pose.len()), (joints, 1));
        made
    };
    assert_eq!(allocations("grip", 2), allocations("other", 1));
}

// The skins of `somatic bench`.
/// What is shared among cores is a task for each other core, twice a frame.
#[cfg(feature = "cli")]
#[test]
fn a_frame_that_is_shared_allocates_its_tasks_alone() {
    use somatic::internal::shape::Shape;
    let shape = Shape { sensors: 5000, fields: 4400, members: 16, wide: 0, local: true, frames: 1, seed: 1 };
    let scene = Scene::default().outputs(Outputs::CENTROID | Outputs::ORIENTATION);
    let made = allocations(&shape.body(), &scene, None, false);
    let others = rayon::current_num_threads() as u64 - 1;
    // Now and then a queue grows.
    assert!(made <= 100 * 2 * others * 5 / 4, "{made} for 100 frames on {others} other threads");
}
