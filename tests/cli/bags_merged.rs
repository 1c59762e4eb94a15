//! Bags of ROS 2 with a cloud for each of several links, read as one run of the whole body.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use serde_json::Value;
use somatic::internal::source::BagName;
use somatic::internal::source::JointStates;

use super::bags::{ROBOT, Said, What, refused, rows, with, write_mcap};
use super::python::python_with;
use super::{done, fails, file, frames, output, stderr, text_of};
use somatic_testing::skip;

const MS: u64 = 1_000_000;
const CLOUD: &str = "sensor_msgs/msg/PointCloud2";
/// The first taxel of the gripper's right jaw; those before are of the left.
const FIRST_OF_RIGHT: u32 = 16;

fn example(name: &str) -> String {
    format!("{ROBOT}/{name}")
}

/// A folder with the gripper's body in it.
fn gripper() -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let body = folder.path().join("gripper.glb");
    done(&["author", "--urdf-skin", &example("gripper.urdf"), "-o", text_of(&body)]);
    (folder, body)
}

/// The arguments of a run of `body` with frames from `source`.
fn run_of(body: &Path, source: &str) -> Vec<String> {
    let all = ["run", "--backend", "reference", "--body", text_of(body), "--source", source, "--sink", "-"];
    all.map(str::to_owned).to_vec()
}

/// The joints of the gripper, without their states.
fn joints() -> [String; 4] {
    ["--joints".to_owned(), example("gripper.urdf"), "--up".to_owned(), "z".to_owned()]
}

/// What the gripper touches: of each frame the time, ns, and the values of each jaw.
fn touches() -> Vec<(u64, [What; 2])> {
    let jaw = |cells: &[(String, f64)], is_right: bool| {
        let ids = cells.iter().map(|(id, value)| (id.parse::<u32>().unwrap(), *value as f32));
        let (taxels, values) = ids.filter(|(id, _)| (*id >= FIRST_OF_RIGHT) == is_right).unzip();
        What::Cloud(taxels, values)
    };
    rows("gripper-touch.csv")
        .iter()
        .map(|(t_ns, cells)| (*t_ns, [false, true].map(|right| jaw(cells, right))))
        .collect()
}

fn cloud(topic: &'static str, stamp_ns: u64, what: &What) -> Said {
    Said { topic, log_ns: stamp_ns + 2 * MS, stamp_ns, what: what.clone() }
}

/// The table under `name` of the left jaw's values in each frame, and of the right jaw's in the frame that `of_right` gives,
/// if any.
fn table(folder: &Path, name: &str, of_right: impl Fn(usize) -> Option<usize>) -> PathBuf {
    let rows = rows("gripper-touch.csv");
    let mut text = std::fs::read_to_string(example("gripper-touch.csv")).unwrap().lines().next().unwrap().to_owned();
    for (at, (t_ns, cells)) in rows.iter().enumerate() {
        text += &format!("\n{}", *t_ns as f64 * 1e-9);
        for (cell, (id, value)) in cells.iter().enumerate() {
            let is_right = id.parse::<u32>().unwrap() >= FIRST_OF_RIGHT;
            let value = if is_right { of_right(at).map(|other| rows[other].1[cell].1) } else { Some(*value) };
            text += &value.map_or(",".to_owned(), |value| format!(",{value}"));
        }
    }
    let path = folder.join(name);
    std::fs::write(&path, text).unwrap();
    path
}

#[test]
fn our_own_bag_of_two_links_is_the_run_that_made_it() {
    let (folder, body) = gripper();
    let (touch, states) = (example("gripper-touch.csv"), example("gripper-joints.csv"));
    let outputs =
        ["--outputs", "total,peak,area,position,normal,orientation,speed,speed_in_world,touches,self_contacts"];
    for delay in ["0", "0.03"] {
        let bag = folder.path().join(format!("bag{delay}"));
        let sink = format!("ros2-mcap:{}", text_of(&bag));
        let joints = joints();
        let joints = joints.each_ref().map(String::as_str);
        let said = ["--joint-states", states.as_str(), "--joints-delay", delay, "--sink", sink.as_str()];
        let first = done(&with(&run_of(&body, &touch), &[&joints[..], &said, &outputs].concat()));
        assert!(
            first.contains("\"link\":\"world\"")
                && first.contains("\"self_contacts\":[{")
                && first.lines().count() == 101
        );
        // The bag has the positions that the joints had at the frames' times.
        let again = output(&with(&run_of(&body, &sink), &[&joints[..], &outputs].concat()));
        assert!(again.status.success(), "{}", stderr(&again));
        assert!(String::from_utf8_lossy(&again.stdout) == first, "{delay}");
        assert!(!stderr(&again).contains("frames have no"), "{}", stderr(&again));
        if delay == "0" {
            // All that reads a recording reads it.
            let named = format!("{sink}:/somatic/taxels/left,/somatic/taxels/right");
            let auto = ["--joint-states", text_of(&bag), "--joints-delay", "auto"];
            let auto = output(&with(&run_of(&body, &named), &[&joints[..], &auto, &outputs].concat()));
            assert!(String::from_utf8_lossy(&auto.stdout) == first && auto.status.success(), "{}", stderr(&auto));
            // A stamp of 0 is none.
            assert!(stderr(&auto).contains("from 200 clouds and 100 states"), "{}", stderr(&auto));
            done(&["plan", "--body", text_of(&body), "--source", &sink]);
            // Its folder is known as a bag.
            let by_folder = done(&with(&run_of(&body, text_of(&bag)), &[&joints[..], &outputs].concat()));
            assert!(by_folder == first);
            if cfg!(feature = "page") {
                let view =
                    ["view", text_of(&bag), "--body", text_of(&body), "--listen", "127.0.0.1:0", "--for", "0.1s"];
                done(&[&view[..], &joints].concat());
            }
            let part = done(&with(&run_of(&body, &sink), &["--from", "0.5", "--to", "1.5", "--outputs", "total"]));
            assert_eq!(part.lines().count(), 50);
            let one = format!("{sink}:/somatic/taxels/left");
            assert!(
                done(&with(&run_of(&body, &one), &[&joints[..], &outputs].concat())) != first,
                "one link is not both"
            );
        } else {
            assert!(first != done(&with(&run_of(&body, &touch), &[&joints[..], &said[..2], &outputs].concat())));
        }
    }
}

#[test]
fn pressures_come_back_as_exact_as_a_cloud_holds_them() {
    let (folder, body) = gripper();
    let (_calibration, calibration) = file("calibration.toml", "[all]\ngain = 0.7\nunit = \"Pa\"\n");
    let sink = format!("ros2-mcap:{}", text_of(&folder.path().join("bag")));
    let flags = ["--calibration", text_of(&calibration), "--sink", &sink, "--outputs", "total,peak,centroid"];
    let first = frames(&done(&with(&run_of(&body, &example("gripper-touch.csv")), &flags)));
    let again = frames(&done(&with(&run_of(&body, &sink), &["--outputs", "total,peak,centroid"])));
    let mut compared = 0;
    assert_eq!(first.len(), again.len());
    for (first, again) in first.iter().zip(&again) {
        assert_eq!(first["t"], again["t"]);
        let (first, again) = (first["fields"].as_array().unwrap(), again["fields"].as_array().unwrap());
        assert_eq!(first.len(), again.len());
        for (first, again) in first.iter().zip(again) {
            assert_eq!(first["field"], again["field"]);
            for name in ["total", "peak"] {
                let [first, again] = [first, again].map(|field| field[name].as_f64().unwrap());
                assert!((first - again).abs() <= first * f64::from(f32::EPSILON) / 2.0, "{first} {again}");
                compared += usize::from(first != again);
            }
        }
    }
    assert!(compared > 10, "{compared} numbers are rounded");
}

#[test]
fn topics_of_two_rates_and_other_stamps_give_the_frames_of_the_faster() {
    let (folder, body) = gripper();
    let mut said = Vec::new();
    for (at, (t_ns, [left, right])) in touches().iter().enumerate() {
        said.push(cloud("/left", *t_ns + 1000 * MS, left));
        if at % 2 == 0 {
            said.push(cloud("/right", *t_ns + 1003 * MS, right));
        }
    }
    // Frames are of the stamps, whatever the order in which messages came.
    said.sort_by_key(|one| one.log_ns + if one.topic == "/left" { 30 * MS } else { 0 });
    let bag = folder.path().join("bag.mcap");
    write_mcap(&bag, &said, "cdr");
    let source = format!("ros2-mcap:{}", text_of(&bag));
    let later = |text: String| {
        let mut all = frames(&text);
        for frame in &mut all {
            frame["t"] = Value::Null;
            // Both are differences of times.
            for touch in frame["touches"].as_array_mut().into_iter().flatten() {
                touch["age"] = Value::Null;
                touch["velocity"] = Value::Null;
            }
        }
        all
    };
    let outputs = ["--outputs", "total,position,touches"];
    let found = done(&with(&run_of(&body, &source), &outputs));
    assert!(frames(&found)[0]["t"] == 1.0 && done(&with(&run_of(&body, &source), &outputs)) == found);
    // Each second frame of the left has the right jaw's cloud of the frame before.
    let expected = table(folder.path(), "expected.csv", |at| Some(at - at % 2));
    assert_eq!(later(found.clone()), later(done(&with(&run_of(&body, text_of(&expected)), &outputs))));
    let touch = example("gripper-touch.csv");
    assert!(later(found) != later(done(&with(&run_of(&body, &touch), &outputs))), "the right jaw is not late");
    // One that is named is read alone.
    let right = done(&with(&run_of(&body, &format!("{source}:/right")), &outputs));
    assert!(right.lines().count() == 51 && !right.contains("\"field\":\"left"));
}

#[test]
fn a_topic_that_stops_leaves_its_taxels_stale() {
    let (folder, body) = gripper();
    for (stops, goes_on) in [(0, 1), (1, 0)] {
        let topics = ["/left", "/right"];
        let mut said = Vec::new();
        for (at, (t_ns, jaws)) in touches().iter().enumerate() {
            for jaw in [0, 1].into_iter().filter(|&jaw| jaw == goes_on || at < 50) {
                said.push(cloud(topics[jaw], *t_ns + 1000 * MS, &jaws[jaw]));
            }
        }
        let bag = folder.path().join(format!("stops{stops}.mcap"));
        write_mcap(&bag, &said, "cdr");
        let run = output(&with(&run_of(&body, &format!("ros2-mcap:{}", text_of(&bag))), &["--all-fields"]));
        assert!(run.status.success(), "{}", stderr(&run));
        let found = frames(&String::from_utf8_lossy(&run.stdout));
        let whole = frames(&done(&with(&run_of(&body, &example("gripper-touch.csv")), &["--all-fields"])));
        let names = ["left", "right"];
        let mut stale = 0;
        for frame in &found {
            let t_s = frame["t"].as_f64().unwrap() - 1.0;
            let other = whole.iter().find(|other| (other["t"].as_f64().unwrap() - t_s).abs() < 1e-6).unwrap();
            let of = |frame: &Value, jaw: usize| -> Vec<Value> {
                let fields = frame["fields"].as_array().unwrap().iter();
                fields.filter(|field| field["link"] == names[jaw]).cloned().collect()
            };
            let totals = |fields: Vec<Value>| fields.iter().map(|field| field["total"].clone()).collect::<Vec<_>>();
            assert!(!of(frame, goes_on).is_empty());
            assert_eq!(totals(of(frame, goes_on)), totals(of(other, goes_on)), "{t_s}");
            let has = |flag: &str| of(frame, stops)[0]["flags"].as_array().unwrap().iter().any(|known| known == flag);
            assert_eq!(has("stale"), has("incomplete"), "{frame}");
            stale += usize::from(has("stale"));
            // Three periods after the last cloud, of 0.98 s.
            assert!(has("stale") == (t_s > 1.05), "{t_s}: {frame}");
        }
        // A topic that led is waited for as long.
        assert!((97..=101).contains(&found.len()) && stale >= 47, "{} frames, {stale} stale", found.len());
        let said = stderr(&run);
        let expected =
            format!("{}: {stale} of {} frames have no cloud of it that is young enough", topics[stops], found.len());
        assert!(said.contains(&expected) && said.contains("they are of 1 to 1.98 s, frames of 1 to 3 s"), "{said}");
    }
}

#[test]
fn what_cannot_be_merged_is_one_line_with_what_to_do() {
    let (folder, body) = gripper();
    let at = |name: &str| folder.path().join(name);
    let all = touches();
    let (t_ns, [left, right]) = &all[0];
    let run = |name: &str, more: &str| {
        refused(1, &with(&run_of(&body, &format!("ros2-mcap:{}{more}", text_of(&at(name)))), &[]))
    };
    write_mcap(
        &at("twice.mcap"),
        &[cloud("/a", *t_ns, left), cloud("/b", *t_ns, right), cloud("/c", *t_ns, left)],
        "cdr",
    );
    let why = run("twice.mcap", "");
    assert!(why.contains("twice.mcap: /c: the message of 0.002 s: taxel 0 is in clouds of /a, too;"), "{why}");
    assert!(why.ends_with(&format!("leave this topic out: ros2-mcap:{}:/a,/b", text_of(&at("twice.mcap")))), "{why}");
    done(&with(&run_of(&body, &format!("ros2-mcap:{}:/c,/b", text_of(&at("twice.mcap")))), &[]));
    assert!(run("twice.mcap", ":/a,/d").contains("there is no topic /d: it has /a"));
    assert!(run("twice.mcap", ":/a,/a").contains("topic /a is named twice"));

    // A cloud that is no skin's.
    let camera = What::Cloud(vec![500, 501], vec![1.0, 2.0]);
    write_mcap(
        &at("camera.mcap"),
        &[cloud("/a", *t_ns, left), cloud("/b", *t_ns, right), cloud("/camera", *t_ns, &camera)],
        "cdr",
    );
    let why = run("camera.mcap", "");
    assert!(why.contains("/camera: the message of ") && why.ends_with("camera.mcap:/a,/b"), "{why}");

    // Numbers do not tell their taxels.
    let numbers = What::Array(vec![0.0; 32]);
    write_mcap(
        &at("mixed.mcap"),
        &[cloud("/a", *t_ns, left), cloud("/b", *t_ns, right), cloud("/n", *t_ns, &numbers)],
        "cdr",
    );
    let why = run("mixed.mcap", "");
    assert!(why.contains("/a, /b, /n; name one: ros2-mcap:") && why.ends_with(&format!("mixed.mcap@{CLOUD}")), "{why}");
    assert!(run("mixed.mcap", ":/a,/n").contains("/n: its messages are std_msgs/msg/Float32MultiArray"));
    done(&with(&run_of(&body, &format!("ros2-mcap:{}@{CLOUD}", text_of(&at("mixed.mcap")))), &[]));
    done(&with(&run_of(&body, &format!("ros2-mcap:{}:/n", text_of(&at("mixed.mcap")))), &[]));

    // A bag without joint states, and one with topics named that have none.
    let joints = joints();
    let jointed = joints.each_ref().map(String::as_str);
    let source = format!("ros2-mcap:{}:/a,/b", text_of(&at("mixed.mcap")));
    let why = refused(1, &with(&run_of(&body, &source), &jointed));
    assert!(
        why.contains("there is no topic of sensor_msgs/msg/JointState") && why.ends_with("--joint-states FILE)"),
        "{why}"
    );
    let states = [&jointed[..], &["--joint-states", &source]].concat();
    assert!(refused(1, &with(&run_of(&body, &source), &states)).contains("sensor_msgs/msg/JointState is read"));
    let looped = [&jointed[..], &["--loop"]].concat();
    assert!(fails(2, &with(&run_of(&body, &source), &looped)).contains("leave --loop out"));

    // Half of a bag is reported once.
    let said: Vec<Said> =
        all.iter().flat_map(|(t_ns, [left, right])| [cloud("/a", *t_ns, left), cloud("/b", *t_ns, right)]).collect();
    write_mcap(&at("whole.mcap"), &said, "cdr");
    let bytes = std::fs::read(at("whole.mcap")).unwrap();
    std::fs::write(at("cut.mcap"), &bytes[..bytes.len() / 2]).unwrap();
    let cut = output(&with(&run_of(&body, &format!("ros2-mcap:{}", text_of(&at("cut.mcap")))), &[]));
    assert!(cut.status.code() == Some(3), "{}", stderr(&cut));
    assert_eq!(stderr(&cut).matches("cut.mcap: it is cut off: what came after t = ").count(), 1, "{}", stderr(&cut));
    let whole = done(&with(&run_of(&body, &format!("ros2-mcap:{}", text_of(&at("whole.mcap")))), &[]));
    let found = String::from_utf8_lossy(&cut.stdout).into_owned();
    assert!(found.lines().count() > 30 && whole.starts_with(&found), "{}", stderr(&cut));
}

#[test]
fn several_topics_that_other_programs_write_are_one_run() {
    let python = match python_with("ros2", "import mcap.writer, rosbags.rosbag2") {
        Ok(python) => python,
        Err(why) => return skip("ROS2", why),
    };
    let (folder, body) = gripper();
    let outputs = ["--outputs", "total,position"];
    let fields = |text: &str| frames(text).iter().map(|frame| frame["fields"].clone()).collect::<Vec<_>>();
    let expected = fields(&done(&with(&run_of(&body, &example("gripper-touch.csv")), &outputs)));
    let said = touches();
    let both =
        said.iter().flat_map(|(t_ns, [left, right])| [cloud("/left", *t_ns, left), cloud("/right", *t_ns, right)]);
    let given: Vec<Value> = both
        .map(|mut one| {
            // A stamp of 0 is none.
            one.stamp_ns += 1;
            one.json()
        })
        .collect();
    let (_given, messages) = file("messages.json", &Value::from(given).to_string());
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/ros2/write.py");
    for (how, name) in [("rosbags", "bag"), ("mcap-lz4", "lz4.mcap"), ("mcap-plain", "plain.mcap")] {
        let bag = folder.path().join(name);
        let written = Command::new(&python).args([script, how, text_of(&messages), text_of(&bag)]).output().unwrap();
        assert!(written.status.success(), "{}", stderr(&written));
        let found = done(&with(&run_of(&body, &format!("ros2-mcap:{}", text_of(&bag))), &outputs));
        assert_eq!(fields(&found), expected, "{how}");
    }
}

#[test]
fn joint_positions_are_written_only_where_they_are_known_and_a_recording_stands_before_frames() {
    let (folder, body) = gripper();
    let joints = joints();
    let joints = joints.each_ref().map(String::as_str);
    // States end after 1 s, and are too old 0.1 s later.
    let states = folder.path().join("states.csv");
    let text = std::fs::read_to_string(example("gripper-joints.csv")).unwrap();
    std::fs::write(&states, text.lines().take(22).collect::<Vec<_>>().join("\n")).unwrap();
    let bag = folder.path().join("bag");
    let sink = format!("ros2-mcap:{}", text_of(&bag));
    let said = ["--joint-states", text_of(&states), "--sink", &sink];
    let first = done(&with(&run_of(&body, &example("gripper-touch.csv")), &[&joints[..], &said].concat()));
    let written = somatic::internal::robot::joint_states_of_bag(&BagName::new(&bag), false).unwrap();
    assert_eq!((written.joint_names(), written.span_s()), (&["grip".to_owned()][..], Some([0.0, 1.1])));
    // At the frame's time, between two states of the recording.
    assert!((written.at(0, 0.02, false).unwrap().position - 0.000546 * 0.4).abs() < 1e-9);
    // With an age of 0, the same frames have poses.
    let again = done(&with(&run_of(&body, &sink), &[&joints[..], &["--joints-max-age", "0"]].concat()));
    assert!(again == first && first.contains("stale_pose"));

    // Frames that carry states, and a recording of others.
    let lines = "{\"t\":0.5,\"values\":{\"0\":9},\"joints\":{\"grip\":0.02}}\n{\"t\":0.52,\"values\":{\"0\":9},\"joints\":{\"grip\":0.02}}\n";
    let (_input, input) = file("frames.ndjson", lines);
    let run = |more: &[&str]| {
        let run = Command::new(env!("CARGO_BIN_EXE_somatic"))
            .args(with(&run_of(&body, "-"), &[&joints[..], more].concat()))
            .stdin(Stdio::from(std::fs::File::open(&input).unwrap()))
            .output()
            .unwrap();
        assert!(run.status.success(), "{}", stderr(&run));
        (String::from_utf8_lossy(&run.stdout).into_owned(), stderr(&run))
    };
    let both = folder.path().join("both");
    let sink = format!("ros2-mcap:{}", text_of(&both));
    let (found, said) = run(&["--joint-states", text_of(&states), "--sink", &sink]);
    let line = format!("at 0.5 s: frames carry joint states of their own; states of {} replace them", text_of(&states));
    assert!(said.matches(&line).count() == 1, "{said}");
    let (carried, said) = run(&[]);
    assert!(found != carried && !said.contains("frames carry"), "{said}");
    let written = somatic::internal::robot::joint_states_of_bag(&BagName::new(&both), false).unwrap();
    let used = JointStates::open(&states).unwrap();
    assert_eq!(written.at(0, 0.5, false), used.at(0, 0.5, false));
}

#[test]
fn a_bag_of_another_robot_whose_ids_fit_is_reported() {
    let (folder, gripper) = gripper();
    let arm = folder.path().join("arm.glb");
    done(&["author", "--urdf-skin", &example("arm.urdf"), "-o", text_of(&arm)]);
    let bag = folder.path().join("drive");
    let sink = format!("ros2-mcap:{}", text_of(&bag));
    done(&["run", "--body", text_of(&arm), "--source", &example("arm-touch.csv"), "--sink", &sink]);
    let run = |body: &Path| {
        let arguments = run_of(body, &format!("ros2-mcap:{}", text_of(&bag)));
        stderr(&output(&arguments.iter().map(String::as_str).collect::<Vec<_>>()))
    };
    let said = run(&gripper);
    assert_eq!(said.matches("clouds are in frame `fore_arm`, which is not a link of ").count(), 1, "{said}");
    assert!(said.contains("gripper.glb; is it the right body?"), "{said}");
    assert!(!run(&arm).contains("clouds are in frame"));
}

#[test]
fn info_lists_the_topics_of_a_bag() {
    let (folder, body) = gripper();
    let bag = folder.path().join("bag");
    let sink = format!("ros2-mcap:{}", text_of(&bag));
    let (touch, states) = (example("gripper-touch.csv"), example("gripper-joints.csv"));
    let joints = joints();
    let joints = joints.each_ref().map(String::as_str);
    done(&with(&run_of(&body, &touch), &[&joints[..], &["--joint-states", &states, "--sink", &sink]].concat()));
    let info = |name: &str| -> Value { serde_json::from_str(&done(&["info", name, "--json"])).unwrap() };
    let known = info(&sink);
    let row = |topic: &str| {
        let topics = known["topics"].as_array().unwrap();
        let found = topics.iter().find(|known| known["topic"] == topic).unwrap_or_else(|| panic!("{known}"));
        (found["type"].as_str().unwrap(), found["messages"].as_u64().unwrap(), found["read_as"].as_str())
    };
    for link in ["left", "right"] {
        assert_eq!(row(&format!("/somatic/taxels/{link}")), (CLOUD, 101, Some("frames")));
    }
    assert_eq!(row("/joint_states"), ("sensor_msgs/msg/JointState", 101, Some("joint states")));
    assert_eq!(row("/tf").2, Some("poses"));
    let rate_hz = known["topics"][0]["rate_hz"].as_f64().unwrap();
    assert!((rate_hz - 50.0).abs() < 1e-6, "{known}");
    assert_eq!(info(text_of(&bag)), known, "its folder is known as a bag");
    assert_eq!(info(&format!("{sink}:/tf"))["topics"].as_array().unwrap().len(), 1);
    let text = done(&["info", &sink]);
    assert!(text.contains("bag of ROS 2, 1 file, ") && text.contains("read as"), "{text}");
    // A bag that was cut off gives what is whole in it.
    let file = bag.join("bag_0.mcap");
    let bytes = std::fs::read(&file).unwrap();
    std::fs::write(&file, &bytes[..bytes.len() / 2]).unwrap();
    fails(3, &["info", &sink]);
}
