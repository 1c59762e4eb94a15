//! Once it runs, the `cpu` backend allocates nothing for a frame, but for the tasks of one that is shared among cores.

// The skins of `somatic bench`.
#[cfg(feature = "cli")]
use somatic::{BackendKind, Body, Calibration, Engine, Options, Outputs, RawValue, Scene, bundled};

/// Allocations of 100 frames, one a call, after some that make room.
fn allocations(body: &Body, outputs: Outputs, calibration: Option<&str>) -> u64 {
    let ids: Vec<u32> = body.taxels.iter().map(|taxel| taxel.id).collect();
    let calibration = calibration.map(|text| Calibration::parse(text, &ids).unwrap());
    let scene = Scene::default().outputs(outputs);
    let options = Options::default().scene(scene).calibration(calibration).backend(BackendKind::Cpu);
    let mut engine = Engine::new(body, options).unwrap();
    let mut frame = engine.frame(0.0);
    let mut touched = 0;
    let mut process = |number: u32| {
        frame.t_s = f64::from(number) * 0.01;
        for (value, index) in frame.values.iter_mut().zip(0_u32..) {
            // A touch that wanders.
            *value = RawValue::new(f64::from((index + number) % 19).max(9.0) - 9.0);
        }
        let percepts = engine.process(std::slice::from_ref(&frame)).unwrap();
        touched += percepts.touched(0).count();
    };
    (0..100).for_each(&mut process);
    let made = allocation_counter::measure(|| (100..200).for_each(&mut process)).count_total;
    assert!(touched > 100, "{touched}");
    made
}

#[test]
fn a_frame_on_the_cpu_allocates_nothing() {
    let checks = "[all]\nbaseline = 2\np_max = 30\n[checks]\nisolated_ratio = 5\n[contact]\non = 3\noff = 1";
    // The sensing hand also measures shear, temperature and proximity.
    for bytes in [bundled::HAND, bundled::MAT, bundled::HUMANOID, bundled::SENSING_HAND] {
        let body = Body::from_bytes("body", bytes).unwrap();
        for calibration in [None, Some(checks)] {
            for outputs in [Outputs::CENTROID | Outputs::ORIENTATION, Outputs::USUAL_AND_MOTION] {
                assert_eq!(allocations(&body, outputs, calibration), 0, "{outputs:?} {calibration:?}");
            }
        }
    }
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

/// What is shared among cores is a task for each other core, twice a frame.
#[cfg(feature = "cli")]
#[test]
fn a_frame_that_is_shared_allocates_its_tasks_alone() {
    use somatic::internal::shape::Shape;
    let shape = Shape { sensors: 5000, fields: 4400, members: 16, wide: 0, local: true, frames: 1, seed: 1 };
    let made = allocations(&shape.body(), Outputs::CENTROID | Outputs::ORIENTATION, None);
    let others = rayon::current_num_threads() as u64 - 1;
    // Now and then a queue grows.
    assert!(made <= 100 * 2 * others * 5 / 4, "{made} for 100 frames on {others} other threads");
}
