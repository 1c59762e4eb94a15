//! Live topics of ROS 2 with messages of other types, read by a map, as cyclonedds in another process sends them.

use std::collections::BTreeMap;
use std::fs;
use std::time::Duration;

use serde_json::{Value, json};

use super::ros2_peer::{Peer, domain, ended, python, run};
use super::{frames, stderr, text_of};

const SENT: usize = 30;

/// The totals of the fields in each frame, with its time.
fn totals(text: &str) -> Vec<(f64, BTreeMap<String, f64>)> {
    let of = |frame: &Value| {
        let fields = frame["fields"].as_array().unwrap().iter();
        let sums = fields
            .map(|field| (field["field"].as_str().unwrap().to_owned(), field["total"].as_f64().unwrap()))
            .collect();
        (frame["t"].as_f64().unwrap(), sums)
    };
    frames(text).iter().map(of).collect()
}

fn header(at: usize) -> Value {
    json!({"stamp": {"sec": 100 + at, "nanosec": 0}, "frame_id": "hand"})
}

const TACTILE_STATE: &str = "std_msgs/Header header\nsensor_msgs/ChannelFloat32[] sensors\n";
const JOINT_STATE: &str =
    "std_msgs/Header header\nstring[] name\nfloat64[] position\nfloat64[] velocity\nfloat64[] effort\n";

#[test]
fn messages_of_other_types_are_read_by_a_map_or_by_its_name() {
    let Some(python) = python() else { return };
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    fs::write(at("TactileState.msg"), TACTILE_STATE).unwrap();
    fs::write(at("JointState.msg"), JOINT_STATE).unwrap();
    let of_joints = "values = 'effort'\nnames = 'name[*]'\nscale = 2\ndefinition = 'JointState.msg'\n";
    fs::write(at("joints.toml"), of_joints).unwrap();
    fs::write(at("array.toml"), "values = 'data'\ngrid = '1x3'\n").unwrap();
    let (joints, array, definition) = (at("joints.toml"), at("array.toml"), at("TactileState.msg"));
    let domain = domain();
    let read = |kind: &str, definitions: &[&str], map: &str, source: &str, message: &dyn Fn(usize) -> Value| {
        let topic = source.split('@').next().unwrap().strip_prefix("ros2:").unwrap();
        let mut peer = Peer::start(&python, &domain, &[&["send", topic, kind, "reliable"], definitions].concat());
        let asked =
            ["run", "--map", map, "--source", source, "--outputs", "total", "--all-fields", "--backend", "reference"];
        let child = run(&domain, &[&asked[..], &["--sink", "-", "--for", "4s"]].concat());
        peer.wait_for("matched");
        std::thread::sleep(Duration::from_millis(500));
        for number in 0..SENT {
            peer.say(&message(number).to_string());
            std::thread::sleep(Duration::from_millis(20));
        }
        let (reported, said) = ended(child);
        let all = totals(&reported);
        assert!(all.len() + 2 >= SENT, "{} of {SENT} came: {said}", all.len());
        (all, said)
    };
    // A preset has the definition, and sensors' names are fields.
    let state = |number: usize| {
        json!({"header": header(number), "sensors": [
            {"name": "tip", "values": [number, 1]}, {"name": "palm", "values": [0.5]},
        ]})
    };
    let kind = "tactile_msgs/msg/TactileState";
    let (all, said) = read(kind, &[text_of(&definition)], "tactile-state", "ros2:/tactile", &state);
    assert!(
        said.contains(
            "`ros2:/tactile` (tactile_msgs/msg/TactileState): sensors[*].values; time is as the map names it"
        ),
        "{said}"
    );
    for (t_s, sums) in &all {
        assert_eq!((sums["tip"], sums["palm"]), (t_s - 100.0 + 1.0, 0.5));
    }
    // A type that the map defines by a file; the name of the type is the robot's.
    let state = |number: usize| json!({"header": header(number), "name": ["a", "b"], "position": [], "velocity": [], "effort": [number, 0.25]});
    let (all, _) = read("sensor_msgs/msg/JointState", &[], text_of(&joints), "ros2:/joints", &state);
    for (t_s, sums) in &all {
        assert_eq!((sums["a"], sums["b"]), (2.0 * (t_s - 100.0), 0.5));
    }
    // An array of ROS's own, with a layout column by column and without a stamp.
    let data = |number: usize| {
        let dimension =
            |label: &str, size: usize, stride: usize| json!({"label": label, "size": size, "stride": stride});
        json!({"layout": {"dim": [dimension("taxels", 3, 3)], "data_offset": 1}, "data": [77, number, 2, 3]})
    };
    let source = "ros2:/array@std_msgs/msg/Int16MultiArray";
    let (all, said) = read("std_msgs/msg/Int16MultiArray", &[], text_of(&array), source, &data);
    assert!(said.contains("time is when a message comes: 3 values a message"), "{said}");
    assert!(all.iter().all(|(t_s, sums)| *t_s > 1e9 && (5.0..=5.0 + SENT as f64).contains(&sums["row"])), "{all:?}");
}

#[test]
fn what_nobody_sends_or_defines_is_said_in_a_line() {
    let folder = tempfile::tempdir().unwrap();
    let map = folder.path().join("map.toml");
    fs::write(&map, "values = 'data'\n").unwrap();
    let domain = domain();
    let refused = |source: &str| {
        let mut command = super::somatic(&["run", "--map", text_of(&map), "--source", source, "--sink", "-"]);
        let output = command.env("ROS_DOMAIN_ID", &domain).output().unwrap();
        assert_eq!(output.status.code(), Some(1), "{}", stderr(&output));
        let said = stderr(&output);
        assert_eq!(said.lines().filter(|line| line.contains("error: ")).count(), 1, "{said}");
        said
    };
    let why = refused("ros2:/pads@maker/msg/Pads");
    assert!(why.contains("live messages do not define maker/msg/Pads; give its .msg in the map"), "{why}");
    let why = refused("ros2:/pads@std_msgs/msg/Int16MultiArray");
    assert!(why.contains("no message of std_msgs/msg/Int16MultiArray came within 10 s in domain"), "{why}");
}
