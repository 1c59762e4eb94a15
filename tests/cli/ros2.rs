//! Messages and bags of ROS 2, as other programs read them.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::process::Command;

use glam::{DAffine3, DQuat, DVec3};
use serde_json::{Value, json};
use somatic::internal::robot::messages::{
    Byte, DiagnosticArray, DiagnosticStatus, Header, JointState, KeyValue, Marker, MarkerArray, Message, PointCloud2,
    PointField, TfMessage, Time, TransformStamped, Wrench, WrenchStamped,
};

use super::python::python_with;
use super::{done, fails, file, files_in, frames, output, stderr, text_of};
use somatic_testing::skip;

const ROBOT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/examples/robots");

/// What `tests/ros2/read.py` prints, or `None` where it cannot be run.
fn read(arguments: &[&str]) -> Option<Result<Value, String>> {
    let works = "import cyclonedds.idl, mcap_ros2.reader, rosbags.rosbag2";
    let python = match python_with("ros2", works) {
        Ok(python) => python,
        Err(why) => {
            skip("ROS2", why);
            return None;
        }
    };
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/ros2/read.py");
    let output = Command::new(python).arg(script).args(arguments).output().unwrap();
    let said = || serde_json::from_slice(&output.stdout).unwrap();
    Some(if output.status.success() { Ok(said()) } else { Err(stderr(&output)) })
}

fn header(frame_id: &str) -> Header {
    Header { stamp: Time::from_ns(1_700_000_000_123_456_789), frame_id: frame_id.to_owned() }
}

fn as_json<M: Message>(message: &M) -> Value {
    let bytes: String = message.to_cdr().iter().map(|byte| format!("{byte:02x}")).collect();
    json!({"type": M::TYPE, "hash": M::HASH, "definition": M::definition(), "bytes": bytes})
}

/// A message of every type for each of these texts, whose lengths put all that follows at every alignment.
fn messages() -> Vec<Value> {
    let mut all = Vec::new();
    for text in ["", "a", "ab", "abc", "abcd", "abcde", "touché", "a longer text of 27 letters"] {
        let text = || text.to_owned();
        all.push(as_json(&PointCloud2 {
            header: header(&text()),
            height: 1,
            width: 3,
            fields: vec![PointField { name: text(), offset: 4, datatype: 7, count: 1 }; 2],
            is_bigendian: false,
            point_step: 1,
            row_step: 3,
            data: vec![1, 2, 255],
            is_dense: true,
        }));
        let marker = Marker {
            header: header(&text()),
            ns: text(),
            id: -7,
            text: text(),
            frame_locked: true,
            ..Marker::default()
        };
        all.push(as_json(&MarkerArray {
            markers: vec![marker.clone(), Marker { ns: "b".to_owned(), action: 2, ..marker }],
        }));
        let mut wrench = Wrench::default();
        (wrench.force.x, wrench.torque.z) = (-1.5, 1e-300);
        all.push(as_json(&WrenchStamped { header: header(&text()), wrench }));
        let status = DiagnosticStatus {
            level: Byte(1),
            name: text(),
            message: "lost".to_owned(),
            hardware_id: text(),
            values: vec![KeyValue { key: text(), value: "3".to_owned() }, KeyValue::default()],
        };
        all.push(as_json(&DiagnosticArray { header: header(&text()), status: vec![status.clone(), status] }));
        let mut transform =
            TransformStamped { header: header("world"), child_frame_id: text(), ..TransformStamped::default() };
        (transform.transform.translation.y, transform.transform.rotation.w) = (0.25, 1.0);
        all.push(as_json(&TfMessage { transforms: vec![transform.clone(), transform] }));
        let names = vec![text(), "wrist".to_owned(), text()];
        all.push(as_json(&JointState {
            header: header(""),
            name: names,
            position: vec![0.5, -2.0],
            ..JointState::default()
        }));
    }
    all
}

#[test]
fn three_decoders_read_every_message_and_write_the_same_bytes() {
    let given = messages();
    let (_folder, path) = file("messages.json", &Value::from(given.clone()).to_string());
    let Some(read) = read(&["messages", text_of(&path)]) else { return };
    let read = read.unwrap();
    assert_eq!(read.as_array().unwrap().len(), given.len());
    for (found, given) in read.as_array().unwrap().iter().zip(&given) {
        assert_eq!(found["type"], given["type"]);
        let decoders = found["decoders"].as_object().unwrap();
        assert_eq!(decoders.len(), 3);
        for (decoder, what) in decoders {
            assert_eq!(what["same_bytes"], true, "{decoder}: {found}\n{given}");
            assert_eq!(what["values"], decoders["by_rosbags"]["values"], "{decoder}");
        }
        assert!(found["hash"] == true && found["hash_of_definition"] == true, "{found}");
    }
    // What was written is what is read.
    let values = |index: usize| &read[index]["decoders"]["by_cyclonedds"]["values"];
    assert_eq!(values(7)["markers"][0]["ns"], "a");
    assert_eq!((&values(7)["markers"][1]["action"], &values(7)["markers"][0]["id"]), (&2.into(), &(-7).into()));
    assert_eq!(values(36)["data"], json!([1, 2, 255]));
    assert_eq!(values(36)["header"]["frame_id"], "touché");
    assert_eq!(values(36)["header"]["stamp"], json!({"sec": 1_700_000_000, "nanosec": 123_456_789}));
    assert_eq!(values(2)["wrench"]["torque"]["z"], 1e-300);
    assert_eq!(values(4)["transforms"][1]["transform"]["translation"]["y"], 0.25);
}

#[test]
fn one_digit_that_is_flipped_is_seen() {
    let flip = |text: &mut String, at: usize| {
        let other = if &text[at..=at] == "1" { "2" } else { "1" };
        text.replace_range(at..=at, other);
    };
    let mut given = messages()[2..4].to_vec();
    let wrench = given[0].clone();
    for (message, key) in given.iter_mut().zip(["hash", "definition"]) {
        let mut text = message[key].as_str().unwrap().to_owned();
        // A digit of the hash; a letter of a field's name.
        let at = if key == "hash" { text.len() - 1 } else { text.find("string message").unwrap() + 8 };
        flip(&mut text, at);
        message[key] = text.into();
    }
    // A digit of the last number.
    let mut other = wrench.clone();
    let mut bytes = other["bytes"].as_str().unwrap().to_owned();
    let last = bytes.len() - 1;
    flip(&mut bytes, last);
    other["bytes"] = bytes.into();
    given.extend([wrench, other]);
    let (_folder, path) = file("messages.json", &Value::from(given).to_string());
    let Some(read) = read(&["messages", text_of(&path)]) else { return };
    let read = read.unwrap();
    assert!(read[0]["hash"] == false && read[0]["hash_of_definition"] == false, "{}", read[0]);
    assert!(read[1]["hash"] == true && read[1]["hash_of_definition"] == false, "{}", read[1]);
    for decoder in ["by_rosbags", "by_mcap_ros2", "by_cyclonedds"] {
        assert_ne!(read[2]["decoders"][decoder]["values"], read[3]["decoders"][decoder]["values"], "{decoder}");
    }
}

/// The arm's run with joints: its flags, where the body is, and the folder.
fn arm_run() -> (tempfile::TempDir, Vec<String>) {
    let folder = tempfile::tempdir().unwrap();
    let body = folder.path().join("arm.glb");
    let at = |name: &str| format!("{ROBOT}/{name}");
    done(&["author", "--urdf-skin", &at("arm.urdf"), "-o", text_of(&body)]);
    let (touch, urdf, states, calibration) =
        (at("arm-touch.csv"), at("arm.urdf"), at("arm-joints.csv"), at("arm-calibration.toml"));
    let flags = [
        "run",
        "--body",
        text_of(&body),
        "--source",
        &touch,
        "--joints",
        &urdf,
        "--joint-states",
        &states,
        "--up",
        "z",
        "--calibration",
        &calibration,
        "--backend",
        "reference",
        "--sink",
        "-",
    ];
    let flags = flags.map(str::to_owned).to_vec();
    (folder, flags)
}

fn with<'a>(flags: &'a [String], more: &[&'a str]) -> Vec<&'a str> {
    flags.iter().map(String::as_str).chain(more.iter().copied()).collect()
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("{value} is not a number"))
}

#[test]
fn a_bag_is_read_whole_and_our_percepts_come_back_from_it() {
    let (folder, flags) = arm_run();
    let bag = folder.path().join("touch bag");
    let sink = format!("ros2-mcap:{}", text_of(&bag));
    let outputs = ["--outputs", "touches,touches.wrench,total", "--sink", &sink];
    let percepts = frames(&done(&with(&flags, &outputs)));
    assert_eq!(files_in(&bag), ["metadata.yaml", "touch bag_0.mcap"]);
    let Some(read) = read(&["bag", text_of(&bag)]) else { return };
    let read = read.unwrap();
    let topics = read["topics"].as_object().unwrap();
    assert!(topics.values().all(|topic| topic["hash"] == true), "{topics:?}");
    let count = |topic: &str| topics[topic]["count"].as_u64().unwrap();
    for topic in ["/somatic/taxels/fore_arm", "/somatic/wrench/fore_arm", "/tf"] {
        assert_eq!(count(topic), 101, "{topic}");
    }
    let messages = read["messages"].as_array().unwrap();
    assert_eq!((&read["count"], &read["by_mcap_ros2"]), (&messages.len().into(), &messages.len().into()));
    assert!(read["times_ns"].as_array().unwrap().is_sorted_by_key(|time| time.as_u64().unwrap()));
    assert_eq!((&read["start_ns"], &read["duration_ns"]), (&0.into(), &2_000_000_001_u64.into()));

    // By time and id, the marker of each touch, and its end; by time, the wrench of the link, and those of touches.
    let (mut markers, mut ended) = (BTreeMap::new(), BTreeSet::new());
    let (mut of_link, mut of_touches) = (BTreeMap::new(), BTreeMap::<u64, Vec<&Value>>::new());
    for message in messages {
        let (topic, time_ns, values) = (message[0].as_str().unwrap(), message[1].as_u64().unwrap(), &message[2]);
        match topic {
            "/somatic/touches" => {
                for marker in values["markers"].as_array().unwrap() {
                    assert_eq!(marker["header"]["stamp"]["sec"].as_u64().unwrap(), time_ns / 1_000_000_000);
                    assert_eq!(marker["ns"], "touches");
                    let key = (time_ns, marker["id"].as_u64().unwrap());
                    let is_new =
                        if marker["action"] == 2 { ended.insert(key) } else { markers.insert(key, marker).is_none() };
                    assert!(is_new, "one for each touch: {marker}");
                }
            }
            "/somatic/wrench/fore_arm" => drop(of_link.insert(time_ns, values)),
            "/somatic/touch_wrenches" => of_touches.entry(time_ns).or_default().push(values),
            _ => {}
        }
    }
    let vector = |value: &Value| DVec3::from_array(["x", "y", "z"].map(|axis| number(&value[axis])));
    let listed = |value: &Value| DVec3::from_array([0, 1, 2].map(|axis| number(&value[axis])));
    let (mut compared, mut deleted) = (0, 0);
    for frame in &percepts {
        let time_ns = (number(&frame["t"]) * 1e9).round() as u64;
        let (mut force, mut torque) = (DVec3::ZERO, DVec3::ZERO);
        let touches = frame["touches"].as_array().unwrap();
        let presses = of_touches.remove(&time_ns).unwrap_or_default();
        assert_eq!(presses.len(), touches.len(), "all on one link");
        for (touch, press) in touches.iter().zip(presses) {
            let id = touch["id"].as_u64().unwrap();
            let marker = markers.remove(&(time_ns, id)).unwrap_or_else(|| panic!("{id} at {time_ns}"));
            assert_eq!(
                (&marker["type"], &touch["in"], &marker["header"]["frame_id"]),
                (&2.into(), &"world".into(), &"world".into())
            );
            let pose = &marker["pose"];
            assert!(
                vector(&pose["position"]).distance(listed(&touch["position"])) < 1e-12,
                "{id} at {time_ns}: {pose}"
            );
            let [x, y, z, w] = ["x", "y", "z", "w"].map(|part| number(&pose["orientation"][part]));
            let turn = DQuat::from_xyzw(x, y, z, w);
            assert!((turn * DVec3::Z).distance(listed(&touch["normal"])) < 1e-9, "{id} at {time_ns}: {pose}");
            if let Some(axis) = touch.get("principal_axis") {
                assert!((turn * DVec3::X).cross(listed(axis)).length() < 1e-6, "{id} at {time_ns}: {pose} {axis}");
            }
            let own = &touch["wrench"]["fore_arm"];
            assert_eq!(press["header"]["frame_id"], "fore_arm");
            for (part, sum) in [("force", &mut force), ("torque", &mut torque)] {
                assert_eq!(vector(&press["wrench"][part]), listed(&own[part]));
                *sum += listed(&own[part]);
            }
            compared += 1;
        }
        // The skin is flat and points to z: what presses it pulls along −z.
        let wrench = &of_link[&time_ns]["wrench"];
        assert_eq!(of_link[&time_ns]["header"]["frame_id"], "fore_arm");
        assert!(vector(&wrench["force"]).distance(force) < 1e-9 && vector(&wrench["torque"]).distance(torque) < 1e-9);
        assert!(force.x.abs() < 1e-9 && force.z <= 0.0, "{force}");
        for id in frame["released"].as_array().unwrap() {
            assert!(ended.remove(&(time_ns, id.as_u64().unwrap())), "{id} at {time_ns}");
            deleted += 1;
        }
    }
    assert!(
        markers.is_empty() && ended.is_empty() && compared > 50 && deleted > 0,
        "{compared} compared, {deleted} deleted"
    );
}

#[test]
fn what_a_bag_will_not_hold_is_reported_once() {
    let (folder, flags) = arm_run();
    let body = flags[2].as_str();
    let said = |name: &str, more: &[&str]| {
        let sink = format!("ros2-mcap:{}", text_of(&folder.path().join(name)));
        let arm = ["run", "--body", body, "--source", &flags[4], "--backend", "reference", "--sink", &sink];
        let output = output(&[&arm[..], more].concat());
        assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
        stderr(&output).lines().filter(|line| line.contains("sink `ros2-mcap`")).map(str::to_owned).collect::<Vec<_>>()
    };
    // Without a calibration P is a count; fields alone have no touches.
    let counts = said("counts", &["--outputs", "touches,total"]);
    assert!(matches!(&counts[..], [why] if why.contains("no wrenches of links: P has no unit")), "{counts:?}");
    let calibration = flags.iter().find(|flag| flag.ends_with("arm-calibration.toml")).unwrap();
    let calibrated = ["--calibration", calibration];
    assert_eq!(said("both", &[&calibrated[..], &["--outputs", "touches,total"]].concat()), [""; 0]);
    let fields = said("fields", &[&calibrated[..], &["--outputs", "total"]].concat());
    assert!(
        matches!(&fields[..], [why] if why.contains("no markers of touches: add touches to --outputs")),
        "{fields:?}"
    );
    assert_eq!(said("quiet", &["--outputs", "total", "--quiet"]), [""; 0]);
}

#[test]
fn clouds_of_a_bag_come_back_with_the_taxels_that_are_missing() {
    let (folder, flags) = arm_run();
    let (_touch, touch) = file("touch.csv", "t,11,12,30\n1,900,,3\n1.05,5,700,\n1.1,,,8\n");
    let bag = folder.path().join("gaps");
    let sink = format!("ros2-mcap:{}", text_of(&bag));
    let body = flags[2].as_str();
    let run = |source: &str, more: &[&str]| {
        let all =
            [&["run", "--body", body, "--backend", "reference", "--source", source, "--sink", "-"][..], more].concat();
        frames(&done(&all)).iter().map(|frame| frame["fields"].clone()).collect::<Vec<_>>()
    };
    let lines = run(text_of(&touch), &["--sink", &sink]);
    assert!(lines.len() == 3 && lines[0].to_string().contains("incomplete"), "{lines:?}");
    assert_eq!(run(&sink, &[]), lines);
}

/// world_from_link of `fore_arm` in a message of `/tf`.
fn fore_arm_in(message: &Value) -> DAffine3 {
    let transforms = message["transforms"].as_array().unwrap();
    let found = &transforms.iter().find(|transform| transform["child_frame_id"] == "fore_arm").unwrap()["transform"];
    let of = |part: &str, axis: &str| number(&found[part][axis]);
    let [x, y, z, w] = ["x", "y", "z", "w"].map(|axis| of("rotation", axis));
    let translation = DVec3::from_array(["x", "y", "z"].map(|axis| of("translation", axis)));
    DAffine3::from_rotation_translation(DQuat::from_xyzw(x, y, z, w), translation)
}

#[test]
fn links_in_a_bag_are_where_joints_put_them_with_z_up() {
    let (folder, flags) = arm_run();
    let bag = folder.path().join("bag");
    let sink = format!("ros2-mcap:{}", text_of(&bag));
    done(&with(&flags, &["--sink", &sink]));
    let Some(read) = read(&["bag", text_of(&bag)]) else { return };
    let read = read.unwrap();
    let (_, _, first) = read["messages"]
        .as_array()
        .unwrap()
        .iter()
        .map(|message| (&message[0], &message[1], &message[2]))
        .find(|(topic, ..)| *topic == "/tf")
        .unwrap();
    // Every joint is at 0 then: the URDF's own numbers.
    let expected = [("base", [0.0, 0.0, 0.0]), ("upper_arm", [0.0, 0.0, 0.12]), ("fore_arm", [0.3, 0.0, 0.12])];
    for (link, place) in expected {
        let transforms = first["transforms"].as_array().unwrap();
        let found = transforms.iter().find(|transform| transform["child_frame_id"] == link).unwrap();
        assert_eq!(found["header"]["frame_id"], "world");
        for (axis, expected) in ["x", "y", "z"].into_iter().zip(place) {
            assert!((number(&found["transform"]["translation"][axis]) - expected).abs() < 1e-6, "{found}");
        }
        assert!((number(&found["transform"]["rotation"]["w"]).abs() - 1.0).abs() < 1e-6, "{found}");
    }
    // With any joints, what a line says of a place in the link and of it in the world is one point.
    let [in_world, in_link] = ["world", "anchor"].map(|of| frames(&done(&with(&flags, &["--coordinates", of]))));
    let transforms: Vec<(f64, DAffine3)> = read["messages"]
        .as_array()
        .unwrap()
        .iter()
        .filter(|message| message[0] == "/tf")
        .map(|message| (message[1].as_u64().unwrap() as f64 * 1e-9, fore_arm_in(&message[2])))
        .collect();
    let mut compared = 0;
    for (world, link) in in_world.iter().zip(&in_link) {
        let (_, fore_arm) = transforms.iter().find(|(t_s, _)| (t_s - number(&world["t"])).abs() < 1e-6).unwrap();
        for (of_world, of_link) in world["fields"].as_array().unwrap().iter().zip(link["fields"].as_array().unwrap()) {
            assert_eq!((&of_world["link"], &of_link["link"]), (&"world".into(), &"fore_arm".into()));
            let [found, place] = [of_world, of_link]
                .map(|field| DVec3::from_array([0, 1, 2].map(|axis| number(&field["position"][axis]))));
            let expected = fore_arm.transform_point3(place);
            assert!(found.distance(expected) < 1e-9, "{found} is not {expected}");
            compared += 1;
        }
    }
    assert!(compared > 50, "{compared}");
}

#[test]
fn a_bag_replaces_nothing_and_damage_is_seen() {
    let (folder, flags) = arm_run();
    let bag = folder.path().join("bag");
    let sink = format!("ros2-mcap:{}", text_of(&bag));
    done(&with(&flags, &["--sink", &sink, "--ros-time", "wall"]));
    let why = fails(1, &with(&flags, &["--sink", &sink]));
    assert!(why.contains("bag_0.mcap") && why.lines().count() == 1, "{why}");
    let why = fails(2, &with(&flags, &["--ros-time", "wall"]));
    assert!(why.contains("add --sink ros2-mcap:FOLDER or --sink ros2"), "{why}");
    let Some(whole) = read(&["bag", text_of(&bag)]) else { return };
    let now_ns = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH).unwrap().as_nanos() as u64;
    let start_ns = whole.unwrap()["start_ns"].as_u64().unwrap();
    assert!((now_ns - 600_000_000_000..now_ns).contains(&start_ns), "{start_ns}");
    // A digit of a hash in the metadata.
    let metadata: PathBuf = bag.join("metadata.yaml");
    let text = std::fs::read_to_string(&metadata).unwrap();
    let damaged = text.replacen("RIHS01_e369d0f0", "RIHS01_e369d0f1", 1);
    assert_ne!(damaged, text);
    std::fs::write(&metadata, damaged).unwrap();
    let answer = read(&["bag", text_of(&bag)]).unwrap();
    assert!(answer.as_ref().is_ok_and(|read| read["topics"]["/tf"]["hash"] == false) || answer.is_err(), "{answer:?}");
    std::fs::write(&metadata, text).unwrap();
    // Cut in the middle, it is no whole bag.
    let recording = Path::new(&bag).join("bag_0.mcap");
    let bytes = std::fs::read(&recording).unwrap();
    std::fs::write(&recording, &bytes[..bytes.len() / 2]).unwrap();
    let cut = read(&["bag", text_of(&bag)]).unwrap();
    assert!(cut.is_err(), "a bag that is cut is read");
}
