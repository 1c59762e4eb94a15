//! Bags of ROS 2 that other programs have recorded: frames and joint states from them, and the delay between two clocks.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::BufWriter;
use std::path::{Path, PathBuf};
use std::process::Command;

use glam::DVec3;
use serde_json::{Value, json};
use somatic::internal::robot::messages::{
    Float32MultiArray, Header, JointState, Message, MultiArrayLayout, PointCloud2, PointField, Time,
};

use super::python::python_with;
use super::random::Random;
use super::{done, fails, file, frames, output, stderr, text_of};
use somatic_testing::skip;

pub(super) const ROBOT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/examples/robots");
const MS: u64 = 1_000_000;

/// A message as a recorder has it.
#[derive(Clone, Debug)]
pub(super) struct Said {
    pub(super) topic: &'static str,
    pub(super) log_ns: u64,
    pub(super) stamp_ns: u64,
    pub(super) what: What,
}

#[derive(Clone, Debug)]
pub(super) enum What {
    /// Names and positions.
    Joints(Vec<String>, Vec<f64>),
    /// Taxels and their values.
    Cloud(Vec<u32>, Vec<f32>),
    /// Values in the body's order.
    Array(Vec<f32>),
}

impl Said {
    /// Its type, its definition and its bytes.
    fn written(&self) -> (&'static str, String, Vec<u8>) {
        fn all<M: Message>(message: &M) -> (&'static str, String, Vec<u8>) {
            (M::TYPE, M::definition(), message.to_cdr())
        }
        let header = Header { stamp: Time::from_ns(self.stamp_ns), frame_id: "fore_arm".to_owned() };
        match &self.what {
            What::Joints(name, position) => {
                all(&JointState { header, name: name.clone(), position: position.clone(), ..JointState::default() })
            }
            What::Cloud(taxels, values) => {
                let field =
                    |name: &str, offset, datatype| PointField { name: name.to_owned(), offset, datatype, count: 1 };
                let points = taxels.iter().zip(values);
                let data = points.flat_map(|(id, value)| [id.to_le_bytes(), value.to_le_bytes()].concat()).collect();
                all(&PointCloud2 {
                    header,
                    height: 1,
                    width: taxels.len() as u32,
                    fields: vec![field("taxel", 0, 6), field("value", 4, 7)],
                    is_bigendian: false,
                    point_step: 8,
                    row_step: 8 * taxels.len() as u32,
                    data,
                    is_dense: true,
                })
            }
            What::Array(data) => all(&Float32MultiArray { layout: MultiArrayLayout::default(), data: data.clone() }),
        }
    }

    pub(super) fn json(&self) -> Value {
        let mut said = json!({"topic": self.topic, "log_ns": self.log_ns, "stamp_ns": self.stamp_ns});
        match &self.what {
            What::Joints(name, position) => (said["name"], said["position"]) = (json!(name), json!(position)),
            What::Cloud(taxels, values) => {
                (said["link"], said["taxel"], said["value"]) = (json!("fore_arm"), json!(taxels), json!(values));
            }
            What::Array(_) => panic!("not written by others"),
        }
        said
    }
}

/// Writes `said`, in the order in which they came, to an MCAP at `path`, with messages in `encoding`.
pub(super) fn write_mcap(path: &Path, said: &[Said], encoding: &str) {
    let to = BufWriter::new(File::create(path).unwrap());
    let options = mcap::WriteOptions::new().compression(None).profile("ros2").chunk_size(Some(4096));
    let mut writer = options.create(to).unwrap();
    for (sequence, one) in (0..).zip(said) {
        let (kind, definition, data) = one.written();
        let schema = writer.add_schema(kind, "ros2msg", definition.as_bytes()).unwrap();
        let channel_id = writer.add_channel(schema, one.topic, encoding, &BTreeMap::new()).unwrap();
        let (log_time, publish_time) = (one.log_ns, one.log_ns);
        let header = mcap::records::MessageHeader { channel_id, sequence, log_time, publish_time };
        writer.write_to_known_channel(&header, &data).unwrap();
    }
    writer.finish().unwrap();
}

/// The rows of an example's table: the time in ns, and the cells by the names of their columns.
pub(super) fn rows(name: &str) -> Vec<(u64, Vec<(String, f64)>)> {
    let text = std::fs::read_to_string(format!("{ROBOT}/{name}")).unwrap();
    let mut lines = text.lines().map(|line| line.split(',').map(str::to_owned).collect::<Vec<_>>());
    let names = lines.next().unwrap();
    let row = |cells: Vec<String>| {
        let numbers: Vec<f64> = cells.iter().map(|cell| cell.parse().unwrap()).collect();
        ((numbers[0] * 1e9).round() as u64, names[1..].iter().cloned().zip(numbers[1..].iter().copied()).collect())
    };
    lines.map(row).collect()
}

/// How two clocks and a network are.
struct Clocks {
    /// When the recording begins, ns.
    start_ns: u64,
    /// How much later the joints' clock stamps an instant than the frames', ns.
    delay_ns: u64,
    /// The least and the most time that frames and joint states take to the recorder, ns.
    frames_ns: [u64; 2],
    joints_ns: [u64; 2],
}

const ONE_CLOCK: Clocks = Clocks { start_ns: 0, delay_ns: 0, frames_ns: [0, 0], joints_ns: [0, 0] };

/// The arm's touch and joint states, from two publishers with some joints each, in the order of arrival.
fn said(clocks: &Clocks) -> Vec<Said> {
    let mut random = Random::new(3);
    let mut took = |[least, most]: [u64; 2]| {
        // Most are fast, some are late.
        let share = random.unit().powi(3);
        least + (share * (most - least) as f64) as u64
    };
    let mut said = Vec::new();
    for (t_ns, cells) in rows("arm-touch.csv") {
        let (taxels, values) = cells.iter().map(|(id, value)| (id.parse::<u32>().unwrap(), *value as f32)).unzip();
        let stamp_ns = clocks.start_ns + t_ns;
        let log_ns = stamp_ns + took(clocks.frames_ns);
        said.push(Said { topic: "/skin", log_ns, stamp_ns, what: What::Cloud(taxels, values) });
    }
    for (t_ns, cells) in rows("arm-joints.csv") {
        for joints in [&cells[..1], &cells[1..]] {
            let stamp_ns = clocks.start_ns + t_ns + clocks.delay_ns;
            let log_ns = clocks.start_ns + t_ns + took(clocks.joints_ns);
            let what = What::Joints(
                joints.iter().map(|(name, _)| name.clone()).collect(),
                joints.iter().map(|(_, at)| *at).collect(),
            );
            said.push(Said { topic: "/joint_states", log_ns, stamp_ns, what });
        }
    }
    said.sort_by_key(|one| one.log_ns);
    said
}

/// A folder with the arm's body in it.
fn arm() -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let body = folder.path().join("arm.glb");
    done(&["author", "--urdf-skin", &format!("{ROBOT}/arm.urdf"), "-o", text_of(&body)]);
    (folder, body)
}

/// The arguments of a run of the arm with frames and joint states from these.
fn run_of(body: &Path, source: &str, states: &str) -> Vec<String> {
    let urdf = format!("{ROBOT}/arm.urdf");
    let all = ["run", "--backend", "reference", "--body", text_of(body), "--joints", &urdf, "--up", "z", "--sink", "-"];
    let named = ["--source", source, "--joint-states", states];
    all.into_iter().chain(named).map(str::to_owned).collect()
}

pub(super) fn with<'a>(arguments: &'a [String], more: &[&'a str]) -> Vec<&'a str> {
    arguments.iter().map(String::as_str).chain(more.iter().copied()).collect()
}

/// What the arm's tables give, which bags are held to.
fn of_tables(body: &Path) -> String {
    let text = done(&with(&run_of(body, &format!("{ROBOT}/arm-touch.csv"), &format!("{ROBOT}/arm-joints.csv")), &[]));
    assert!(text.contains("\"link\":\"world\"") && text.lines().count() == 101);
    text
}

/// The error, of one line, of a run that must end with `code`.
pub(super) fn refused(code: i32, arguments: &[&str]) -> String {
    let why = fails(code, arguments);
    let said: Vec<&str> = why.lines().filter(|line| line.starts_with("somatic: error: ")).collect();
    assert_eq!(said.len(), 1, "{why}");
    said[0].to_owned()
}

#[test]
fn joint_states_of_two_topics_are_joined_unless_both_have_a_joint() {
    let (folder, body) = arm();
    let expected = of_tables(&body);
    let mut messages = said(&ONE_CLOCK);
    for one in &mut messages {
        if matches!(&one.what, What::Joints(names, _) if names[0] == "shoulder") {
            one.topic = "/shoulder_states";
        }
    }
    let path = folder.path().join("two.mcap");
    write_mcap(&path, &messages, "cdr");
    let bag = format!("ros2-mcap:{}", text_of(&path));
    for states in [bag.clone(), format!("{bag}:/joint_states,/shoulder_states")] {
        let ran = output(&with(&run_of(&body, &bag, &states), &[]));
        let said = stderr(&ran);
        assert!(said.contains("joint states of /joint_states, /shoulder_states are joined"), "{said}");
        assert_eq!((ran.status.code(), String::from_utf8(ran.stdout).unwrap()), (Some(0), expected.clone()), "{said}");
    }
    // One alone lacks a joint; and where both have one, none is preferred.
    let why = refused(1, &with(&run_of(&body, &bag, &format!("{bag}:/shoulder_states")), &[]));
    assert!(why.contains("no state has joint `elbow`"), "{why}");
    let first = messages.iter().position(|one| one.topic == "/joint_states").unwrap();
    messages[first].what = What::Joints(vec!["shoulder".to_owned()], vec![0.0]);
    write_mcap(&path, &messages, "cdr");
    let why = refused(1, &with(&run_of(&body, &bag, &bag), &[]));
    assert!(why.contains("joint `shoulder` is in /") && why.contains("name the topics to read"), "{why}");
}

#[test]
fn poses_of_a_bag_put_percepts_where_joints_do() {
    let (folder, body) = arm();
    let touch = format!("{ROBOT}/arm-touch.csv");
    let bag = format!("ros2-mcap:{}", text_of(&folder.path().join("moved")));
    let jointed = run_of(&body, &touch, &format!("{ROBOT}/arm-joints.csv"));
    let expected = frames(&done(&with(&jointed, &["--sink", &bag])));
    let run = ["run", "--backend", "reference", "--body", text_of(&body), "--source", &touch, "--sink", "-"];
    let posed = output(&[&run[..], &["--poses", &bag]].concat());
    assert!(stderr(&posed).contains("links, in `world`"), "{}", stderr(&posed));
    let posed = frames(&String::from_utf8(posed.stdout).unwrap());
    let mut compared = 0;
    for (expected, found) in expected.iter().zip(&posed) {
        let of = |frame: &Value| -> Vec<Value> { frame["fields"].as_array().cloned().unwrap_or_default() };
        for (expected, found) in of(expected).iter().zip(of(found)).filter(|(one, _)| one["link"] == "world") {
            assert_eq!((&found["field"], &found["link"]), (&expected["field"], &expected["link"]));
            for axis in 0..3 {
                let [a, b] = [&expected, &&found].map(|one| one["position"][axis].as_f64().unwrap());
                assert!((a - b).abs() < 1e-9, "{expected} and {found}");
            }
            compared += 1;
        }
    }
    assert!(compared > 50 && posed.len() == expected.len(), "{compared}");
    // A bag without transforms, and no bag.
    let none = folder.path().join("none.mcap");
    write_mcap(&none, &said(&ONE_CLOCK), "cdr");
    let why = refused(1, &[&run[..], &["--poses", text_of(&none)]].concat());
    assert!(why.contains("it has no topic of tf2_msgs/msg/TFMessage or nav_msgs/msg/Odometry"), "{why}");
    assert!(fails(2, &[&run[..], &["--poses", "poses.csv"]].concat()).contains("poses come from a ROS 2 bag"));
}

#[test]
fn a_bag_gives_the_percepts_of_the_tables_that_it_holds() {
    let (folder, body) = arm();
    let expected = of_tables(&body);
    let messages = said(&ONE_CLOCK);
    let one = folder.path().join("one.mcap");
    write_mcap(&one, &messages, "cdr");
    let source = format!("ros2-mcap:{}", text_of(&one));
    assert!(done(&with(&run_of(&body, &source, text_of(&one)), &[])) == expected);
    // A recorder that begins a new file now and then, and was killed before it wrote its metadata.
    let bag = folder.path().join("bag");
    std::fs::create_dir(&bag).unwrap();
    let files = messages.chunks(20);
    assert!(files.len() > 9);
    for (number, messages) in (2..).zip(files) {
        write_mcap(&bag.join(format!("bag_{number}.mcap")), messages, "cdr");
    }
    let (skin, states) =
        (format!("ros2-mcap:{}:/skin", text_of(&bag)), format!("ros2-mcap:{}:/joint_states", text_of(&bag)));
    assert!(done(&with(&run_of(&body, &skin, text_of(&bag)), &[])) == expected);
    // A scene file's names are relative to its folder.
    let scene = folder.path().join("arm.scene.toml");
    let text = format!(
        "body = 'arm.glb'\nsource = 'ros2-mcap:bag:/skin'\njoints = '{ROBOT}/arm.urdf'\njoint_states = 'ros2-mcap:bag:/joint_states'\n\
         up = 'z'\njoints_delay_s = 'auto'\nbackend = 'reference'\nsink = '-'\n"
    );
    std::fs::write(&scene, &text).unwrap();
    assert!(done(&["run", text_of(&scene)]) == expected, "both clocks are one");
    std::fs::write(&scene, text.replace("'auto'", "0")).unwrap();
    assert!(done(&["run", text_of(&scene)]) == expected);
    std::fs::write(&scene, text.replace("'auto'", "'soon'")).unwrap();
    let why = refused(2, &["run", text_of(&scene)]);
    assert!(why.contains("line 6") && why.contains("give seconds, or \"auto\""), "{why}");
    // A bag that is read is not written to.
    let sink = format!("ros2-mcap:{}", text_of(&bag));
    let own = bag.join("bag_0.mcap");
    std::fs::copy(bag.join("bag_2.mcap"), &own).unwrap();
    let why =
        refused(2, &with(&run_of(&body, &format!("{ROBOT}/arm-touch.csv"), &states), &["--sink", &sink, "--force"]));
    assert!(why.contains("this is the input"), "{why}");
}

#[test]
fn numbers_are_frames_of_the_time_at_which_they_came() {
    let (folder, body) = arm();
    let bag = folder.path().join("numbers.mcap");
    let messages: Vec<Said> = rows("arm-touch.csv")
        .into_iter()
        .map(|(log_ns, cells)| {
            let values = cells.iter().map(|(_, value)| *value as f32).collect();
            Said { topic: "/numbers", log_ns, stamp_ns: 0, what: What::Array(values) }
        })
        .collect();
    write_mcap(&bag, &messages, "cdr");
    let source = format!("ros2-mcap:{}@std_msgs/Float32MultiArray", text_of(&bag));
    let states = format!("{ROBOT}/arm-joints.csv");
    assert!(done(&with(&run_of(&body, &source, &states), &[])) == of_tables(&body));
    // Joint states without stamps have the times at which they came, too.
    let mut unstamped = said(&ONE_CLOCK);
    unstamped.iter_mut().for_each(|one| one.stamp_ns = 0);
    let bag = folder.path().join("unstamped.mcap");
    write_mcap(&bag, &unstamped, "cdr");
    let arguments = run_of(&body, &format!("ros2-mcap:{}", text_of(&bag)), text_of(&bag));
    assert!(done(&with(&arguments, &[])) == of_tables(&body));
    let why = refused(1, &with(&arguments, &["--joints-delay", "auto"]));
    assert!(
        why.contains("/skin: its messages have no stamps") && why.contains("give --joints-delay in seconds"),
        "{why}"
    );
}

/// By frame and field, the positions that are in the world.
fn places(text: &str) -> BTreeMap<(usize, String), DVec3> {
    let mut places = BTreeMap::new();
    for (number, frame) in frames(text).iter().enumerate() {
        for field in frame["fields"].as_array().unwrap().iter().filter(|field| field["link"] == "world") {
            if let [Some(x), Some(y), Some(z)] = [0, 1, 2].map(|axis| field["position"][axis].as_f64()) {
                places.insert((number, field["field"].as_str().unwrap().to_owned()), DVec3::new(x, y, z));
            }
        }
    }
    places
}

#[test]
fn the_delay_between_two_clocks_is_estimated_within_the_difference_of_the_least_delays() {
    let (folder, body) = arm();
    let true_s = 0.25;
    let clocks = Clocks {
        start_ns: 1_700_000_000_000_000_000,
        delay_ns: 250 * MS,
        frames_ns: [2 * MS, 40 * MS],
        joints_ns: [3 * MS, 15 * MS],
    };
    let mut messages = said(&clocks);
    // The arm is at rest before, so that even a wrong delay finds a state.
    for ago_ms in 1..=10 {
        let ns = clocks.start_ns - ago_ms * 50 * MS;
        let what = What::Joints(["shoulder", "elbow", "grip"].map(str::to_owned).to_vec(), vec![0.0; 3]);
        messages.insert(0, Said { topic: "/joint_states", log_ns: ns + 8 * MS, stamp_ns: ns + clocks.delay_ns, what });
    }
    let least_s = |topic: &str, later_ns: u64| {
        let took = messages.iter().filter(|one| one.topic == topic).map(|one| one.log_ns + later_ns - one.stamp_ns);
        took.min().unwrap() as f64 * 1e-9
    };
    let bound_s = (least_s("/skin", 0) - least_s("/joint_states", clocks.delay_ns)).abs();
    let bag = folder.path().join("bag.mcap");
    write_mcap(&bag, &messages, "cdr");
    let arguments = run_of(&body, &format!("ros2-mcap:{}:/skin", text_of(&bag)), text_of(&bag));
    let run = |delay: &str| {
        let run = output(&with(&arguments, &["--joints-delay", delay]));
        assert_eq!(run.status.code(), Some(0), "{}", stderr(&run));
        (places(&String::from_utf8_lossy(&run.stdout)), stderr(&run))
    };
    let (estimated, said) = run("auto");
    let line = said.lines().find(|line| line.contains("--joints-delay auto is ")).unwrap_or_else(|| panic!("{said}"));
    assert!(line.contains("from 101 clouds and 94 states") && line.contains("longer than their fastest"), "{line}");
    let after = line.split("--joints-delay auto is ").nth(1).unwrap();
    let estimate_s: f64 = after.split(' ').next().unwrap().parse().unwrap();
    let off_s = (estimate_s - true_s).abs();
    eprintln!("{line}\noff by {:.3} ms, least delays differ by {:.3} ms", off_s * 1e3, bound_s * 1e3);
    assert!(off_s <= bound_s + 1e-6 && bound_s < 2e-3, "{estimate_s}: off by {off_s}, bound {bound_s}");

    // How far a taxel moves meanwhile, at most: the arm is 0.6 m long.
    let states = rows("arm-joints.csv");
    let speed = |joint: usize| {
        let steps = states
            .windows(2)
            .map(|two| (two[1].1[joint].1 - two[0].1[joint].1).abs() / ((two[1].0 - two[0].0) as f64 * 1e-9));
        steps.fold(0.0, f64::max)
    };
    let bound_m = (speed(0) + speed(1)) * 0.6 * (off_s + 1e-6) + 1e-6;
    let (known, _) = run("0.25");
    assert!(known.len() > 100 && estimated.keys().eq(known.keys()), "{} places", known.len());
    let farthest = |found: &BTreeMap<(usize, String), DVec3>| {
        known.iter().map(|(of, place)| place.distance(found[of])).fold(0.0, f64::max)
    };
    let (with_auto, without) = (farthest(&estimated), farthest(&run("0").0));
    eprintln!("auto: {:.3} mm of at most {:.3} mm; without: {:.1} mm", with_auto * 1e3, bound_m * 1e3, without * 1e3);
    assert!(with_auto <= bound_m, "{with_auto} m, and {bound_m} m are allowed");
    assert!(without > 0.02 && without > 10.0 * bound_m, "a delay of 0 is not seen: {without} m");
}

#[test]
fn an_estimate_that_cannot_be_had_is_refused_with_what_is_missing() {
    let (folder, body) = arm();
    let clocks = Clocks { start_ns: 5_000 * MS, ..ONE_CLOCK };
    let messages = said(&clocks);
    let at = |name: &str| folder.path().join(name);
    write_mcap(&at("bag.mcap"), &messages, "cdr");
    write_mcap(&at("other.mcap"), &messages, "cdr");
    let mut numbers = messages.clone();
    for one in &mut numbers {
        if let What::Cloud(_, values) = &one.what {
            one.what = What::Array(values.clone());
        }
    }
    write_mcap(&at("numbers.mcap"), &numbers, "cdr");
    let bag = |name: &str| format!("ros2-mcap:{}", text_of(&at(name)));
    let (touch, states) = (format!("{ROBOT}/arm-touch.csv"), format!("{ROBOT}/arm-joints.csv"));
    for (code, source, states, why) in [
        (2, bag("bag.mcap"), states, "this file of --joint-states has no arrivals; give both from one bag"),
        (2, touch, bag("bag.mcap"), "frames of this source have no arrivals; give both from one bag"),
        (2, bag("bag.mcap"), "ros2:/joint_states".to_owned(), "--joints-delay auto is not for live topics"),
        (1, bag("bag.mcap"), bag("other.mcap"), "is another bag; record both topics into one"),
        (1, bag("numbers.mcap"), bag("numbers.mcap"), "Float32MultiArray have no stamps"),
    ] {
        let said = refused(code, &with(&run_of(&body, &source, &states), &["--joints-delay", "auto"]));
        assert!(said.contains(why), "{said}");
    }
    let said = fails(2, &with(&run_of(&body, &bag("bag.mcap"), &bag("bag.mcap")), &["--joints-delay", "soon"]));
    assert!(said.contains("`soon` is not a time; give seconds, a time such as 25ms, or auto"), "{said}");
}

#[test]
fn bags_that_are_not_read_say_what_to_do_and_cut_ones_give_what_is_whole() {
    let (folder, body) = arm();
    let at = |name: &str| folder.path().join(name);
    let messages = said(&ONE_CLOCK);
    let run = |states: &str| run_of(&body, &format!("{ROBOT}/arm-touch.csv"), states);
    write_mcap(&at("json.mcap"), &messages, "json");
    let why = refused(1, &with(&run(text_of(&at("json.mcap"))), &[]));
    assert!(why.contains("json.mcap: /joint_states: messages are in `json`, and CDR is read here"), "{why}");
    let mut two = messages.clone();
    two.iter_mut().step_by(2).filter(|one| one.topic != "/skin").for_each(|one| one.topic = "/left/joint_states");
    write_mcap(&at("two.mcap"), &two, "cdr");
    let why = refused(1, &with(&run(text_of(&at("two.mcap"))), &[]));
    assert!(why.contains("/left/joint_states") && why.contains("name the topics to read, such as ros2-mcap:"), "{why}");
    let why = refused(1, &with(&run(&format!("ros2-mcap:{}:/skin", text_of(&at("two.mcap")))), &[]));
    assert!(why.contains("/skin: its messages are sensor_msgs/msg/PointCloud2"), "{why}");
    let why = refused(1, &with(&run(text_of(&at("none.mcap"))), &[]));
    assert!(why.contains("none.mcap: no such file"), "{why}");
    std::fs::write(at("text.mcap"), "t,elbow\n").unwrap();
    assert!(refused(1, &with(&run(text_of(&at("text.mcap"))), &[])).contains("not an MCAP file"));
    for (name, first, kind) in [
        ("skin.db3", &b"SQLite format 3\0"[..], "it is damaged or cut off, and SQLite reads nothing of it"),
        (
            "skin.bag",
            b"#ROSBAG V2.0\n",
            "it is a ROS 1 bag, and bags of ROS 2 are read here; convert it: rosbags-convert --src",
        ),
    ] {
        std::fs::write(at(name), first).unwrap();
        if name == "skin.db3" {
            let why = fails(1, &["run", "--source", &format!("mcap:{}", text_of(&at(name)))]);
            assert!(why.contains("it is a ROS 2 bag in SQLite, which is named ros2-mcap:PATH"), "{why}");
        }
        let path = at(name);
        let bag = format!("ros2-mcap:{}", text_of(&path));
        for arguments in [&["info", text_of(&path)][..], &["info", &bag], &["run", "--source", text_of(&path)]] {
            let why = fails(1, arguments);
            assert!(why.contains(&format!("{name}: {kind}")), "{arguments:?}: {why}");
        }
        let why = refused(1, &with(&run(text_of(&path)), &[]));
        assert!(why.contains(&format!("{name}: {kind}")), "{why}");
    }
    // A list that names no file is no empty bag.
    std::fs::create_dir(at("odd")).unwrap();
    std::fs::write(at("odd/metadata.yaml"), "a:\n  storage_identifier: mcap\n  relative_file_paths: [..]\n").unwrap();
    let why = fails(1, &["info", &format!("ros2-mcap:{}", text_of(&at("odd")))]);
    assert!(
        why.contains("metadata.yaml: `..` under relative_file_paths names no file; write it anew: ros2 bag reindex")
    );
    let mut short = messages.clone();
    let What::Joints(_, position) = &mut short.iter_mut().rfind(|one| one.topic != "/skin").unwrap().what else {
        panic!()
    };
    position.push(0.0);
    write_mcap(&at("short.mcap"), &short, "cdr");
    let why = refused(1, &with(&run(text_of(&at("short.mcap"))), &[]));
    assert!(why.contains("short.mcap: /joint_states: at ") && why.contains("positions; send one for each"), "{why}");

    // What is cut off gives what is whole, says what is missing, and ends with 3.
    write_mcap(&at("whole.mcap"), &messages, "cdr");
    let bytes = std::fs::read(at("whole.mcap")).unwrap();
    std::fs::write(at("cut.mcap"), &bytes[..bytes.len() / 2]).unwrap();
    let source = format!("ros2-mcap:{}", text_of(&at("cut.mcap")));
    let cut = output(&with(&run_of(&body, &source, text_of(&at("cut.mcap"))), &[]));
    assert_eq!(cut.status.code(), Some(3), "{}", stderr(&cut));
    let found = String::from_utf8_lossy(&cut.stdout);
    let whole = of_tables(&body);
    let count = found.lines().count();
    assert!((20..100).contains(&count), "{count}");
    // The last states are known no more, so that positions there are the last known.
    let same = found.lines().zip(whole.lines()).take_while(|(cut, whole)| cut == whole).count();
    assert!(same + 10 > count, "{same} of {count}");
    let said = stderr(&cut);
    assert_eq!(said.matches("cut.mcap: it is cut off: what came after t = ").count(), 2, "{said}");
    // A position that is not a number is ignored and reported.
    let mut odd = messages.clone();
    let What::Joints(_, position) = &mut odd.iter_mut().rfind(|one| one.topic != "/skin").unwrap().what else {
        panic!()
    };
    position[0] = f64::NAN;
    write_mcap(&at("odd.mcap"), &odd, "cdr");
    let why = fails(3, &with(&run(text_of(&at("odd.mcap"))), &[]));
    assert!(why.contains("positions that are not finite numbers: 1, the first of joint `elbow` at "), "{why}");
}

#[test]
fn bags_that_other_programs_write_are_read_compressed_or_not() {
    let python = match python_with("ros2", "import mcap.writer, rosbags.rosbag2") {
        Ok(python) => python,
        Err(why) => return skip("ROS2", why),
    };
    let (folder, body) = arm();
    let expected = of_tables(&body);
    let given: Vec<Value> = said(&ONE_CLOCK).iter().map(Said::json).collect();
    let (_given, messages) = file("messages.json", &Value::from(given).to_string());
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/ros2/write.py");
    for (how, name) in [
        ("rosbags", "bag"),
        ("rosbags-file", "packed"),
        ("rosbags-message", "messages"),
        ("rosbags-db3", "db3"),
        ("rosbags-db3-message", "db3-messages"),
        ("mcap-lz4", "lz4.mcap"),
        ("mcap-plain", "plain.mcap"),
    ] {
        let bag = folder.path().join(name);
        let written = Command::new(&python).args([script, how, text_of(&messages), text_of(&bag)]).output().unwrap();
        assert!(written.status.success(), "{}", stderr(&written));
        let arguments = run_of(&body, &format!("ros2-mcap:{}", text_of(&bag)), text_of(&bag));
        if how == "rosbags-file" {
            let why = refused(1, &with(&arguments, &[]));
            assert!(why.contains("each file is compressed by itself") && why.contains("rosbags-convert"), "{why}");
        } else {
            assert!(done(&with(&arguments, &[])) == expected, "{how}");
        }
    }
}
