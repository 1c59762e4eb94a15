//! Live topics of ROS 2, as cyclonedds in another process sees and sends them.

use std::collections::BTreeMap;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use serde_json::{Value, json};
use tempfile::TempDir;

use super::ros2_peer::{CLOUD, Peer, domain, ended, feed, python, run};
use super::serial::Boards;
use super::{done, frames, stderr, text_of};

const ROBOT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/examples/robots");

/// The arm's body, and its frames with joint states as lines for standard input.
fn arm() -> (TempDir, PathBuf, Vec<String>) {
    let folder = tempfile::tempdir().unwrap();
    let body = folder.path().join("arm.glb");
    done(&["author", "--urdf-skin", &format!("{ROBOT}/arm.urdf"), "-o", text_of(&body)]);
    let table = |name: &str| -> Vec<BTreeMap<String, f64>> {
        let text = std::fs::read_to_string(format!("{ROBOT}/{name}")).unwrap();
        let mut lines = text.lines().map(|line| line.split(',').map(str::to_owned).collect::<Vec<_>>());
        let names = lines.next().unwrap();
        let row = |cells: Vec<String>| {
            let cells = names.iter().cloned().zip(cells);
            cells.filter_map(|(name, cell)| Some((name, cell.parse().ok()?))).collect()
        };
        lines.map(row).collect()
    };
    let states = table("arm-joints.csv");
    let frames = table("arm-touch.csv").into_iter().map(|mut frame| {
        let t_s = frame.remove("t").unwrap();
        let mut joints = states.iter().rev().find(|state| state["t"] <= t_s).unwrap_or(&states[0]).clone();
        joints.remove("t");
        json!({"t": t_s, "values": frame, "joints": joints}).to_string()
    });
    let frames = frames.collect();
    (folder, body, frames)
}

fn arm_flags<'a>(body: &'a Path, urdf: &'a str, calibration: &'a str) -> Vec<&'a str> {
    let start = ["run", "--body", text_of(body), "--source", "-", "--joints", urdf, "--up", "z", "--calibration"];
    [&start[..], &[calibration, "--backend", "reference", "--sink", "-"]].concat()
}

fn stamp_ns(message: &Value) -> u64 {
    let header = message.get("header").unwrap_or_else(|| {
        message.get("markers").map_or_else(|| &message["transforms"][0]["header"], |markers| &markers[0]["header"])
    });
    let of = |key: &str| header["stamp"][key].as_u64().unwrap();
    of("sec") * 1_000_000_000 + of("nanosec")
}

fn time_ns(frame: &Value) -> u64 {
    (frame["t"].as_f64().unwrap() * 1e9).round() as u64
}

const ARM_TOPICS: [(&str, &str, &str); 6] = [
    ("/left/somatic/wrench/fore_arm", "geometry_msgs/msg/WrenchStamped", "reliable"),
    ("/left/somatic/taxels/fore_arm", CLOUD, "best_effort"),
    ("/left/somatic/touches", "visualization_msgs/msg/MarkerArray", "reliable"),
    ("/left/tf", "tf2_msgs/msg/TFMessage", "reliable"),
    ("/left/somatic/joint_states", "sensor_msgs/msg/JointState", "reliable"),
    ("/left/diagnostics", "diagnostic_msgs/msg/DiagnosticArray", "reliable"),
];

#[test]
fn another_node_receives_what_ndjson_has_also_after_a_new_start() {
    let Some(python) = python() else { return };
    let (_folder, body, lines) = arm();
    let (urdf, calibration) = (format!("{ROBOT}/arm.urdf"), format!("{ROBOT}/arm-calibration.toml"));
    let outputs = ["--outputs", "touches,touches.wrench,total", "--sink", "ros2:/left"];
    let flags = [&arm_flags(&body, &urdf, &calibration)[..], &outputs].concat();
    let domain = domain();
    let mut topics = ARM_TOPICS.to_vec();
    topics.push(("/left/somatic/touch_wrenches", "geometry_msgs/msg/WrenchStamped", "reliable"));
    let mut peer = Peer::receive(&python, &domain, &topics);
    let mut percepts = Vec::new();
    for _ in 0..2 {
        let mut child = run(&domain, &flags);
        peer.wait_for("matched");
        // The writers have yet to find their readers.
        std::thread::sleep(Duration::from_millis(500));
        feed(&mut child, &lines, Duration::from_millis(10));
        let (reported, said) = ended(child);
        assert!(!said.contains("left out") && !said.contains("not sent"), "{said}");
        percepts.push(frames(&reported));
        peer.wait_for("unmatched");
    }
    assert_eq!(percepts[0], percepts[1]);
    let received = peer.received();
    let of = |topic: &str| -> Vec<&Value> {
        received.iter().filter(|(own, ..)| own == topic).map(|(_, _, message)| message).collect()
    };
    // Every frame, twice: reliable topics in order and without a gap.
    let times: Vec<u64> = percepts.iter().flatten().map(time_ns).collect();
    for topic in ["/left/tf", "/left/somatic/joint_states"] {
        assert_eq!(of(topic).into_iter().map(stamp_ns).collect::<Vec<_>>(), times, "{topic}");
    }
    let clouds = of("/left/somatic/taxels/fore_arm");
    assert!(clouds.len() * 1000 >= times.len() * 999, "{} of {} clouds", clouds.len(), times.len());
    assert!(clouds.iter().all(|cloud| cloud["header"]["frame_id"] == "fore_arm" && cloud["point_step"] == 20));
    // The markers are the touches, one each, and end with them.
    let (mut markers, mut ended) = (BTreeMap::new(), 0);
    for message in of("/left/somatic/touches") {
        for marker in message["markers"].as_array().unwrap() {
            ended += usize::from(marker["action"] == 2);
            if marker["action"] == 0 {
                markers.insert((stamp_ns(message), marker["id"].as_u64().unwrap()), marker.clone());
            }
        }
    }
    // The skin is flat and points to z: the force on it is that of the touches, along −z.
    let pull = |message: &Value| message["wrench"]["force"]["z"].as_f64().unwrap();
    let wrenches = of("/left/somatic/wrench/fore_arm");
    let of_link: BTreeMap<u64, f64> = wrenches.iter().map(|wrench| (stamp_ns(wrench), pull(wrench))).collect();
    assert!(wrenches.len() == times.len() && of_link.len() == percepts[0].len(), "{} wrenches", wrenches.len());
    let of_touches =
        of("/left/somatic/touch_wrenches").iter().fold(BTreeMap::<u64, Vec<f64>>::new(), |mut all, wrench| {
            all.entry(stamp_ns(wrench)).or_default().push(pull(wrench));
            all
        });
    let (mut compared, mut released) = (0, 0);
    for frame in &percepts[0] {
        let number = |value: &Value| value.as_f64().unwrap();
        let mut forces = Vec::new();
        for touch in frame["touches"].as_array().unwrap() {
            let marker = &markers[&(time_ns(frame), touch["id"].as_u64().unwrap())];
            let [x, y, z] = [0, 1, 2].map(|axis| number(&touch["position"][axis]));
            let place = &marker["pose"]["position"];
            for (axis, ours) in [("x", x), ("y", y), ("z", z)] {
                assert!((number(&place[axis]) - ours).abs() < 1e-12, "{place}");
            }
            forces.push(number(&touch["wrench"]["fore_arm"]["force"][2]));
            compared += 1;
        }
        let sum: f64 = forces.iter().sum();
        assert!((of_link[&time_ns(frame)] - sum).abs() <= 1e-9, "{frame}");
        // Both runs have the same times.
        let twice = [&forces[..], &forces].concat();
        assert_eq!(of_touches.get(&time_ns(frame)).cloned().unwrap_or_default(), twice);
        released += 2 * frame["released"].as_array().unwrap().len();
    }
    assert!(compared > 50 && compared == markers.len(), "{compared} of {}", markers.len());
    assert!(ended == released && ended > 0, "{ended} ends of {released}");
}

#[test]
fn another_node_finds_the_node_and_what_it_writes_and_reads_until_it_goes() {
    let Some(python) = python() else { return };
    let (_folder, body, _) = arm();
    let urdf = format!("{ROBOT}/arm.urdf");
    let domain = domain();
    // Five topics, as nothing is in newtons, and the one that tells of the node.
    let mut writes = Peer::start(&python, &domain, &["node", "/left/somatic", "6"]);
    let mut reads = Peer::start(&python, &domain, &["node", "/somatic_joints", "2"]);
    let body = body.display().to_string();
    let flags = [
        "run",
        "-q",
        "--body",
        &body,
        "--source",
        "-",
        "--joints",
        &urdf,
        "--up",
        "z",
        "--outputs",
        "touches,total",
        "--sink",
        "ros2:/left",
    ];
    let child = run(&domain, &[&flags[..], &["--joint-states", "ros2:/joint_states"]].concat());
    let topics = |peer: &mut Peer| -> [Vec<String>; 2] { serde_json::from_str(&peer.line()).unwrap() };
    let names = ["diagnostics", "somatic/joint_states", "somatic/taxels/fore_arm", "somatic/touches", "tf"];
    let of_left = names.iter().map(|name| format!("rt/left/{name}"));
    let own = "ros_discovery_info".to_owned();
    let written: Vec<String> = [own.clone()].into_iter().chain(of_left).collect();
    assert_eq!(topics(&mut writes), [written, vec![]]);
    assert_eq!(topics(&mut reads), [vec![own], vec!["rt/joint_states".to_owned()]]);
    ended(child);
    writes.wait_for("gone");
    reads.wait_for("gone");
}

#[test]
fn nobody_hears_another_domain_or_namespace() {
    let Some(python) = python() else { return };
    let (_folder, body, lines) = arm();
    let (urdf, calibration) = (format!("{ROBOT}/arm.urdf"), format!("{ROBOT}/arm-calibration.toml"));
    let (own, other) = (domain(), domain());
    let here = Peer::receive(&python, &own, &[("/right/tf", "tf2_msgs/msg/TFMessage", "reliable")]);
    let there = Peer::receive(&python, &other, &ARM_TOPICS[3..4]);
    let mut child = run(&own, &[&arm_flags(&body, &urdf, &calibration)[..], &["--sink", "ros2:/left"]].concat());
    std::thread::sleep(Duration::from_secs(2));
    feed(&mut child, &lines[..20], Duration::from_millis(10));
    ended(child);
    assert!(here.received().is_empty() && there.received().is_empty());
}

/// Points of the given taxels as a message, big enough to come in fragments where there are many.
fn cloud(t_s: f64, values: &[(u32, f32)]) -> Value {
    let data: Vec<u8> =
        values.iter().flat_map(|(id, value)| [id.to_le_bytes(), value.to_le_bytes()].concat()).collect();
    let field = |name: &str, offset: u32, datatype: u8| json!({"name": name, "offset": offset, "datatype": datatype, "count": 1});
    json!({
        "header": {"stamp": {"sec": t_s as u32, "nanosec": (t_s.fract() * 1e9).round() as u32}, "frame_id": "hand"},
        "height": 1, "width": values.len(), "fields": [field("taxel", 0, 6), field("value", 4, 7)],
        "is_bigendian": false, "point_step": 8, "row_step": data.len(), "data": data, "is_dense": true,
    })
}

#[test]
fn frames_from_a_topic_are_those_from_standard_input() {
    let Some(python) = python() else { return };
    let ids: Vec<u32> = (0..9).collect();
    let value = |frame: usize, id: u32| ((frame * 7 + id as usize * 13) % 50) as f32;
    let frames_sent: Vec<Vec<(u32, f32)>> =
        (0..40).map(|frame| ids.iter().map(|&id| (id, value(frame, id))).collect()).collect();
    let domain = domain();
    let mut peer = Peer::start(&python, &domain, &["send", "/skin", CLOUD, "reliable"]);
    let child =
        run(&domain, &["run", "--source", "ros2:/skin", "--backend", "reference", "--sink", "-", "--for", "8s"]);
    peer.wait_for("matched");
    for (frame, values) in frames_sent.iter().enumerate() {
        peer.say(&cloud(1.0 + frame as f64 * 0.25, values).to_string());
        std::thread::sleep(Duration::from_millis(10));
    }
    let (reported, _) = ended(child);
    let mut standard = run(&domain, &["run", "--source", "-", "--backend", "reference", "--sink", "-"]);
    let lines: Vec<String> = frames_sent
        .iter()
        .enumerate()
        .map(|(frame, values)| {
            let values: BTreeMap<String, f32> = values.iter().map(|(id, value)| (id.to_string(), *value)).collect();
            json!({"t": 1.0 + frame as f64 * 0.25, "values": values}).to_string()
        })
        .collect();
    feed(&mut standard, &lines, Duration::ZERO);
    let (expected, _) = ended(standard);
    assert_eq!(frames(&reported), frames(&expected));
    assert!(frames(&reported).len() == 40 && reported.contains("hand/"), "{reported}");
}

#[test]
fn a_topic_that_does_not_fit_or_is_not_there_is_reported_with_counts() {
    let Some(python) = python() else { return };
    let refused = |domain: &str, source: &str, send: Option<(&str, &str, Value)>| {
        let peer = send
            .map(|(topic, kind, message)| (Peer::start(&python, domain, &["send", topic, kind, "reliable"]), message));
        let child = run(domain, &["run", "--source", source, "--sink", "-", "--for", "20s"]);
        let _peer = peer.map(|(mut peer, message)| {
            if !message.is_null() {
                peer.wait_for("matched");
                (0..20).for_each(|_| {
                    peer.say(&message.to_string());
                    std::thread::sleep(Duration::from_millis(20));
                });
            }
            peer
        });
        let output = child.child.wait_with_output().unwrap();
        assert_eq!(output.status.code(), Some(1), "{}", stderr(&output));
        stderr(&output)
    };
    let own = domain();
    let why = refused(&own, "ros2:/skin", Some(("/other", CLOUD, Value::Null)));
    assert!(
        why.contains(&format!("within 10 s in domain {own}")) && why.contains("/other (sensor_msgs/msg/PointCloud2)"),
        "{why}"
    );
    let why = refused(&domain(), "ros2:/skin", Some(("/skin", "sensor_msgs/msg/JointState", Value::Null)));
    assert!(why.contains("its messages are sensor_msgs/msg/JointState"), "{why}");
    let why = refused(&domain(), "ros2:/skin", Some(("/skin", CLOUD, cloud(1.0, &[(0, 1.0), (77, 1.0)]))));
    assert!(why.contains("1 of 2 points are of taxels that the body does not have, taxel 77 first"), "{why}");
    let array = json!({"layout": {"dim": [], "data_offset": 0}, "data": [1.0, 2.0, 3.0]});
    let why = refused(&domain(), "ros2:/skin", Some(("/skin", "std_msgs/msg/Float32MultiArray", array)));
    assert!(why.contains("an array has 3 numbers, and the body 40 taxels"), "{why}");
}

#[test]
fn joint_states_of_a_topic_put_percepts_into_the_world() {
    let Some(python) = python() else { return };
    let (_folder, body, lines) = arm();
    let (urdf, calibration) = (format!("{ROBOT}/arm.urdf"), format!("{ROBOT}/arm-calibration.toml"));
    let without: Vec<String> = lines
        .iter()
        .map(|line| {
            let mut frame: Value = serde_json::from_str(line).unwrap();
            frame.as_object_mut().unwrap().remove("joints");
            frame.to_string()
        })
        .collect();
    let pose = json!({"shoulder": 0.3, "elbow": -0.4, "grip": 0.01});
    let with: Vec<String> = without
        .iter()
        .map(|line| {
            let mut frame: Value = serde_json::from_str(line).unwrap();
            frame["joints"] = pose.clone();
            frame.to_string()
        })
        .collect();
    let domain = domain();
    let flags = arm_flags(&body, &urdf, &calibration);
    let mut given = run(&domain, &flags);
    feed(&mut given, &with, Duration::ZERO);
    let expected = frames(&ended(given).0);
    let kind = "sensor_msgs/msg/JointState";
    let mut peer = Peer::start(&python, &domain, &["send", "/joint_states", kind, "reliable"]);
    let live = [&flags[..], &["--joint-states", "ros2:/joint_states", "--joints-max-age", "1"]].concat();
    let mut child = run(&domain, &live);
    peer.wait_for("matched");
    std::thread::sleep(Duration::from_millis(300));
    let state = json!({
        "header": {"stamp": {"sec": 5, "nanosec": 0}, "frame_id": ""}, "name": ["shoulder", "elbow", "grip"],
        "position": [0.3, -0.4, 0.01], "velocity": [], "effort": [],
    });
    for line in &without {
        peer.say(&state.to_string());
        std::thread::sleep(Duration::from_millis(10));
        feed(&mut child, std::slice::from_ref(line), Duration::ZERO);
    }
    let (reported, said) = ended(child);
    let reported = frames(&reported);
    assert_eq!(reported.len(), expected.len());
    // The first states may come after the first frames.
    let late = reported.iter().zip(&expected).filter(|(own, other)| own != other).count();
    assert!(late <= 5, "{late} frames differ: {said}");
    assert!(reported.iter().any(|frame| frame["fields"][0]["link"] == "world"));
    // Nobody sends: positions stay in links.
    let mut silent = run(&domain, &[&flags[..], &["--joint-states", "ros2:/nobody"]].concat());
    std::thread::sleep(Duration::from_secs(1));
    feed(&mut silent, &without, Duration::ZERO);
    let (reported, said) = ended(silent);
    assert!(said.contains("no state so far") && !reported.contains("\"link\":\"world\""), "{said}");
    let about = "joint states `ros2:/nobody`: no state has come in ";
    assert!(said.matches(about).count() == 1 && said.contains("; there is /joint_states"), "{said}");
}

#[test]
fn states_of_a_topic_are_those_of_the_clouds_stamps() {
    const CLOUDS: usize = 40;
    let Some(python) = python() else { return };
    let (folder, body, _) = arm();
    let (body, urdf) = (body.display().to_string(), format!("{ROBOT}/arm.urdf"));
    // A state each 20 ms, and a cloud half-way to the next.
    let shoulder = |at: usize| 0.3 * (at as f64 * 0.3).sin();
    let write = |name: &str, head: &str, rows: usize, row: &dyn Fn(usize) -> String| {
        let path = folder.path().join(name).display().to_string();
        let rows: Vec<String> = (0..rows).map(row).collect();
        std::fs::write(&path, format!("{head}\n{}\n", rows.join("\n"))).unwrap();
        path
    };
    let ms = |at: usize, offset: usize| 1_000_000 + 20 * at + offset;
    let touch = write("touch.csv", "t,11", CLOUDS, &|at| format!("{},5", ms(at, 10) as f64 / 1e3));
    let states = write("states.csv", "t,shoulder,elbow,grip", CLOUDS + 1, &|at| {
        format!("{},{},-0.4,0.01", ms(at, 0) as f64 / 1e3, shoulder(at))
    });
    let flags =
        ["--body", &body, "--joints", &urdf, "--up", "z", "--backend", "reference", "--outputs", "total,position"];
    let domain = domain();
    let recorded = ["run", "-q", "--source", &touch, "--joint-states", &states, "--sink", "-"];
    let expected = frames(&ended(run(&domain, &[&recorded[..], &flags].concat())).0);
    assert_eq!(expected.len(), CLOUDS);
    let place = |frame: &Value| {
        let field = &frame["fields"][0];
        let position = [0, 1, 2].map(|axis| field["position"][axis].as_f64().unwrap());
        (field["link"] == "world").then_some(position)
    };
    let live = |ahead_s: usize, more: &[&str]| {
        let mut skin = Peer::start(&python, &domain, &["send", "/skin", CLOUD, "reliable"]);
        let kind = "sensor_msgs/msg/JointState";
        let mut joints = Peer::start(&python, &domain, &["send", "/joint_states", kind, "reliable"]);
        let topics =
            ["run", "--source", "ros2:/skin@sensor_msgs/msg/PointCloud2", "--joint-states", "ros2:/joint_states"];
        let child = run(&domain, &[&topics[..], &flags, &["--sink", "-", "--for", "5s"], more].concat());
        skin.wait_for("matched");
        joints.wait_for("matched");
        std::thread::sleep(Duration::from_millis(500));
        for at in 0..=CLOUDS {
            let stamp_ms = ms(at, 0) + 1000 * ahead_s;
            let stamp = json!({"sec": stamp_ms / 1000, "nanosec": stamp_ms % 1000 * 1_000_000});
            let state = json!({
                "header": {"stamp": stamp, "frame_id": ""}, "name": ["shoulder", "elbow", "grip"],
                "position": [shoulder(at), -0.4, 0.01], "velocity": [], "effort": [],
            });
            joints.say(&state.to_string());
            std::thread::sleep(Duration::from_millis(15));
            if at > 0 {
                skin.say(&cloud(ms(at - 1, 10) as f64 / 1e3, &[(11, 5.0)]).to_string());
                std::thread::sleep(Duration::from_millis(15));
            }
        }
        let (reported, said) = ended(child);
        let reported = frames(&reported);
        // How far each place is from where the recordings have it at that time.
        let mut apart_m: Vec<f64> = Vec::new();
        for (frame, other) in reported
            .iter()
            .filter_map(|frame| expected.iter().find(|other| other["t"] == frame["t"]).map(|other| (frame, other)))
        {
            if let (Some(own), Some(other)) = (place(frame), place(other)) {
                apart_m.push((0..3).map(|axis| (own[axis] - other[axis]).powi(2)).sum::<f64>().sqrt());
            }
        }
        assert!(apart_m.len() >= CLOUDS - 8, "{} of {CLOUDS} in the world: {said}", apart_m.len());
        apart_m.sort_by(f64::total_cmp);
        (apart_m[apart_m.len() * 3 / 4], said)
    };
    let (apart_m, said) = live(0, &[]);
    assert!(apart_m < 1e-9 && !said.contains("another clock"), "{apart_m} m: {said}");
    // By another clock: as they come, half a step late, or by the delay that is given.
    let (apart_m, said) = live(100, &[]);
    assert!(apart_m > 1e-3 && said.matches("as of another clock").count() == 1, "{apart_m} m: {said}");
    let (apart_m, said) = live(100, &["--joints-delay", "100"]);
    assert!(apart_m < 1e-9 && !said.contains("another clock"), "{apart_m} m: {said}");
}

#[test]
fn a_thousand_taxels_at_250_hz_arrive() {
    let Some(python) = python() else { return };
    let seconds: usize = std::env::var("SOMATIC_ROS2_SECONDS").map_or(4, |text| text.parse().unwrap());
    let folder = tempfile::tempdir().unwrap();
    let body = folder.path().join("sheet.glb");
    done(&["author", "--grid", "25x40", "--pitch", "5mm", "-o", text_of(&body)]);
    let domain = domain();
    let topics = [
        ("/somatic/taxels/sheet", CLOUD, "best_effort:stamps"),
        ("/somatic/touches", "visualization_msgs/msg/MarkerArray", "reliable:stamps"),
    ];
    let mut peer = Peer::receive(&python, &domain, &topics);
    let mut child = run(
        &domain,
        &["run", "--body", text_of(&body), "--source", "-", "--outputs", "touches,total", "--sink", "ros2"],
    );
    peer.wait_for("matched");
    std::thread::sleep(Duration::from_millis(500));
    let frame = |number: usize| {
        let values: BTreeMap<String, usize> =
            (0..1000).map(|id: usize| (id.to_string(), 1 + (id + 7 * number) % 250)).collect();
        json!({"t": number as f64 * 0.004, "values": values}).to_string()
    };
    // A second of lines is sent again with other times.
    let tail: Vec<String> =
        (1..=250).map(|number| frame(number).split_once(",\"values\"").unwrap().1.to_owned()).collect();
    let input = child.child.stdin.as_mut().unwrap();
    let begin = Instant::now();
    let count = seconds * 250;
    for number in 1..=count {
        std::thread::sleep(Duration::from_micros(4000 * number as u64).saturating_sub(begin.elapsed()));
        writeln!(input, "{{\"t\":{},\"values\"{}", number as f64 * 0.004, tail[number % 250]).unwrap();
    }
    let took = begin.elapsed();
    let (_, said) = ended(child);
    assert!(!said.contains("left out") && !said.contains("not sent"), "{said}");
    let received = peer.received();
    let sent: Vec<u64> = (1..=count).map(|number| (number as f64 * 0.004 * 1e9).round() as u64).collect();
    let stamps = |topic: &str| -> Vec<u64> {
        let own = received.iter().filter(|(name, ..)| name == topic);
        own.map(|(_, _, stamp)| stamp.as_u64().unwrap()).collect()
    };
    assert_eq!(stamps("/somatic/touches"), sent, "reliable");
    let clouds = stamps("/somatic/taxels/sheet");
    let missing: Vec<&u64> = sent.iter().filter(|stamp| clouds.binary_search(stamp).is_err()).collect();
    println!("{count} frames in {took:?}: {} clouds missing, at {missing:?} ns", missing.len());
    assert!(
        clouds.is_sorted() && missing.len() * 1000 <= count,
        "{} of {count} are missing: {missing:?}",
        missing.len()
    );
}

#[test]
fn another_node_hears_how_a_board_is_doing_until_it_falls_silent() {
    let Some(python) = python() else { return };
    let domain = domain();
    let mut peer =
        Peer::receive(&python, &domain, &[("/diagnostics", "diagnostic_msgs/msg/DiagnosticArray", "reliable")]);
    let boards = Boards::start(&["--wait", "--rate", "50", "--loop", "--for", "4s"]);
    let source = format!("serial:{}", boards.ports[0]);
    let child = run(&domain, &["run", "--source", &source, "--sink", "-", "--sink", "ros2", "--for", "8s"]);
    peer.wait_for("matched");
    let sent = boards.end()[0];
    ended(child);
    let reported = peer.received();
    let status: Vec<&Value> = reported.iter().map(|(_, _, array)| &array["status"][0]).collect();
    let value = |status: &Value, key: &str| -> Option<f64> {
        let pair = status["values"].as_array().unwrap().iter().find(|pair| pair["key"] == key)?;
        pair["value"].as_str().unwrap().parse().ok()
    };
    let frames: Vec<f64> = status.iter().map(|status| value(status, "frames").unwrap()).collect();
    println!("{sent} frames, {} messages, the last {}", reported.len(), status.last().unwrap());
    assert!(frames.is_sorted() && reported.windows(2).all(|pair| stamp_ns(&pair[0].2) <= stamp_ns(&pair[1].2)));
    assert!(status.iter().all(|status| status["name"].as_str().unwrap().starts_with("somatic: ")), "{status:?}");
    // OK while it speaks, at its rate; STALE from when it is silent, with its last count.
    let [ok, stale] = [0, 3].map(|level| status.iter().filter(|status| status["level"] == level).collect::<Vec<_>>());
    let rate_hz = ok.last().and_then(|status| value(status, "rate [Hz]")).unwrap();
    // As many frames as its four seconds have.
    let expected_hz = sent as f64 / 4.0;
    assert!(ok.len() >= 3 && (rate_hz / expected_hz - 1.0).abs() < 0.15, "{rate_hz} of {expected_hz} Hz, {status:?}");
    assert!(ok.iter().all(|status| status["message"] == "speaking"), "{ok:?}");
    assert!(stale.len() >= 3 && *frames.last().unwrap() == sent as f64, "{sent} sent, {status:?}");
    assert!(value(stale.last().unwrap(), "age [s]").unwrap() > 1.0, "{status:?}");
}
