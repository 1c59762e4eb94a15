//! Robots whose joints move: poses of links from joint states, and percepts in the world.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use glam::{DAffine3, DQuat, DVec3};
use serde_json::Value;
use somatic::robot::Kinematics;

use super::python::python_with;
use super::random::Random;
use super::{done, fails, file, frames, stderr, text_of};
use somatic_testing::skip;

const URDF: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/examples/robots/arm.urdf");
const TOUCH: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/examples/robots/arm-touch.csv");
const STATES: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/examples/robots/arm-joints.csv");

/// A folder with the arm's body, and its path.
fn arm() -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let body = folder.path().join("arm.glb");
    done(&["author", "--urdf-skin", URDF, "-o", text_of(&body)]);
    (folder, body)
}

/// Percepts of `lines` on standard input, and what was said.
fn run_lines(body: &Path, lines: &str, flags: &[&str]) -> (Vec<Value>, String) {
    let (_folder, input) = file("frames.ndjson", lines);
    let run = Command::new(env!("CARGO_BIN_EXE_somatic"))
        .args(["run", "--body", text_of(body), "--source", "-", "--backend", "reference"])
        .args(flags)
        .stdin(Stdio::from(std::fs::File::open(input).unwrap()))
        .output()
        .unwrap();
    assert!(run.status.success(), "{}", stderr(&run));
    (frames(&String::from_utf8_lossy(&run.stdout)), stderr(&run))
}

/// The place of the first touched field of a frame, and the link that it is in.
fn place(frame: &Value) -> (DVec3, String) {
    let field = &frame["fields"][0];
    let number = |axis: usize| field["position"][axis].as_f64().unwrap_or_else(|| panic!("{frame}"));
    (DVec3::new(number(0), number(1), number(2)), field["link"].as_str().unwrap().to_owned())
}

fn has_flag(frame: &Value, flag: &str) -> bool {
    frame["fields"][0]["flags"].as_array().unwrap().iter().any(|known| known == flag)
}

#[test]
fn a_joint_that_the_urdf_lacks_is_left_out_and_reported_once() {
    let (_folder, body) = arm();
    let line = |t: f64, more: &str| {
        format!("{{\"t\":{t},\"values\":{{\"11\":5}},\"joints\":{{\"shoulder\":0.3,\"elbow\":-0.4{more}}}}}\n")
    };
    let flags = ["--joints", URDF, "--up", "z"];
    let without = run_lines(&body, &(line(0.0, "") + &line(0.1, "")), &flags);
    let with = run_lines(&body, &(line(0.0, ",\"elbwo\":2,\"lift\":0.1") + &line(0.1, ",\"lift\":0.1")), &flags);
    assert!(with.0 == without.0 && !with.0.is_empty());
    for what in
        ["at 0 s: the URDF has no joint `lift`, which is left out", "`elbwo`, which is left out; did you mean `elbow`?"]
    {
        assert!(with.1.matches(what).count() == 1 && !without.1.contains(what), "{}", with.1);
    }
}

#[test]
fn a_joint_that_never_comes_is_named_and_leaves_the_links_that_it_does_not_move_in_the_world() {
    let folder = tempfile::tempdir().unwrap();
    let skin = "<sensor name=\"upper_skin\"><parent link=\"upper_arm\"/><origin xyz=\"0.05 -0.015 0.03\"/>\
                <tactile><array rows=\"2\" cols=\"2\" size=\"0.008 0.008\" spacing=\"0.02 0.01\"/></tactile></sensor></robot>";
    let urdf = folder.path().join("two.urdf");
    std::fs::write(&urdf, std::fs::read_to_string(URDF).unwrap().replace("</robot>", skin)).unwrap();
    let body = folder.path().join("two.glb");
    done(&["author", "--urdf-skin", text_of(&urdf), "-o", text_of(&body)]);
    let run = |joints: &str| {
        let line = |index: u32| {
            let t = f64::from(index) * 0.05;
            format!("{{\"t\":{t},\"values\":{{\"11\":5,\"33\":7}},\"joints\":{{{joints}}}}}\n")
        };
        let lines: String = (0..30).map(line).collect();
        run_lines(&body, &lines, &["--joints", text_of(&urdf), "--up", "z", "--outputs", "total,position"])
    };
    // By link of the layout, in the last frame: the link that the position is in, that position, and whether it is flagged.
    let places = |frames: &[Value]| -> Vec<(f64, String, String, bool)> {
        let fields = frames.last().unwrap()["fields"].as_array().unwrap().clone();
        let of = |field: &Value| {
            let is_stale = field["flags"].to_string().contains("stale_pose");
            let [link, at] = ["link", "position"].map(|key| field[key].to_string());
            (field["total"].as_f64().unwrap(), link, at, is_stale)
        };
        fields.iter().map(of).filter(|(total, ..)| *total < 12.0).collect()
    };
    let (all, said) = run("\"shoulder\":0.3,\"elbow\":-0.4");
    assert!(!said.contains("lack poses"), "{said}");
    let whole = places(&all);
    assert!(whole.len() >= 2 && whole.iter().all(|place| place.1 == "\"world\"" && !place.3), "{whole:?}");
    let (some, said) = run("\"shoulder\":0.3");
    for (place, whole) in places(&some).iter().zip(&whole) {
        // The shoulder alone moves the upper arm, which is pressed with 7.
        let is_placed = place.0 == 7.0;
        assert_eq!((place == whole, place.3), (is_placed, !is_placed), "{place:?} {whole:?}");
        assert_eq!(place.1, if is_placed { "\"world\"" } else { "\"fore_arm\"" });
    }
    assert!(said.contains("at 0 s: joint `elbow`, which moves `fore_arm`: no state so far"), "{said}");
    assert!(said.contains("30 of 30 frames lack poses of links"), "{said}");
    assert!(said.contains("no frame has a state of `elbow`, which moves `fore_arm`"), "{said}");
    let (none, said) = run("\"elbow\":-0.4");
    assert!(places(&none).iter().all(|place| place.3), "{none:?}");
    assert!(said.contains("at 0 s: joint `shoulder`, which moves `fore_arm`: no state so far"), "{said}");
    assert!(said.contains("no frame has a state of `shoulder`"), "{said}");
}

#[test]
fn frames_without_a_pose_are_counted_where_a_run_is_stopped_too() {
    let (_folder, body) = arm();
    let (_other, states) = file("states.csv", "t,shoulder,elbow,grip\n100,0,0,0\n101,0,0,0\n");
    let run = ["run", "--body", text_of(&body), "--source", TOUCH, "--backend", "reference", "--sink", "-"];
    let jointed = ["--joints", URDF, "--joint-states", text_of(&states), "--up", "z"];
    let output = super::output(&[&run[..], &jointed, &["--speed", "0.5", "--for", "0.5s"]].concat());
    assert_eq!(output.status.code(), Some(0));
    let said = stderr(&output);
    assert!(said.matches(" frames lack poses of links: ").count() == 1, "{said}");
}

#[test]
fn a_source_without_a_frame_is_reported() {
    let (_folder, path) = file("touch.csv", "t,4\n");
    let output = super::output(&["run", "--body", "hand", "--source", text_of(&path), "--sink", "-"]);
    assert!(stderr(&output).contains("the source has ended without a frame"), "{}", stderr(&output));
}

/// What `tests/kinematics/compare.py` prints, or `None` where it cannot be run.
fn compare(arguments: &[&str]) -> Option<String> {
    let python = match python_with("kinematics", "import pinocchio, yourdfpy") {
        Ok(python) => python,
        Err(why) => {
            skip("KINEMATICS", why);
            return None;
        }
    };
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/kinematics/compare.py");
    let output = Command::new(python).arg(script).args(arguments).output().unwrap();
    assert!(output.status.success(), "{}", stderr(&output));
    Some(String::from_utf8(output.stdout).unwrap())
}

#[test]
fn pressed_taxels_of_robots_are_in_the_world_where_pinocchio_and_yourdfpy_have_them() {
    const TOUCHES: usize = 80;
    let folder = tempfile::tempdir().unwrap();
    let (names, numbers) = (folder.path().join("names.json"), folder.path().join("numbers"));
    let (urdf, body) = (folder.path().join("robot.urdf"), folder.path().join("robot.glb"));
    for robot in ["panda", "icub", "tiago"] {
        let Some(original) = compare(&["where", robot]) else { return };
        let original = original.trim();
        let kinematics = Kinematics::load(original).unwrap();
        let joints: Vec<&str> = kinematics.joint_names().collect();
        let links: Vec<&str> = kinematics.link_names().collect();
        std::fs::write(&names, serde_json::json!({"joints": joints, "links": links}).to_string()).unwrap();
        // A sensor of one taxel on each link.
        let mut random = Random::new(7);
        let points: Vec<[f64; 3]> = links.iter().map(|_| [(); 3].map(|()| 0.2 * (random.unit() - 0.5))).collect();
        let sensor = |(index, (link, [x, y, z])): (usize, (&&str, &[f64; 3]))| {
            format!(
                "<sensor name=\"s{index}\"><parent link=\"{link}\"/><origin xyz=\"{x} {y} {z}\"/>\
                 <tactile channel=\"skin\"><taxel idx=\"{index}\" xyz=\"0 0 0\"/></tactile></sensor>"
            )
        };
        let sensors: String = links.iter().zip(&points).enumerate().map(sensor).collect();
        let text = std::fs::read_to_string(original).unwrap();
        std::fs::write(&urdf, text.replace("</robot>", &format!("{sensors}</robot>"))).unwrap();
        done(&["author", "--urdf-skin", text_of(&urdf), "--geometry", "none", "--force", "-o", text_of(&body)]);
        let mut touches: Vec<(Vec<f64>, usize)> = Vec::new();
        let line = |index: usize| {
            let positions: Vec<f64> = joints.iter().map(|_| 6.0 * (random.unit() - 0.5)).collect();
            let link = (random.unit() * links.len() as f64) as usize;
            let reported: serde_json::Map<String, Value> = joints
                .iter()
                .zip(&positions)
                .map(|(joint, &position)| ((*joint).to_owned(), position.into()))
                .collect();
            touches.push((positions, link));
            let line =
                serde_json::json!({"t": 0.01 * index as f64, "values": {link.to_string(): 5.0}, "joints": reported});
            format!("{line}\n")
        };
        let lines: String = (0..TOUCHES).map(line).collect();
        let flags = ["--joints", text_of(&urdf), "--outputs", "total,position"];
        let (found, _) = run_lines(&body, &lines, &flags);
        assert_eq!(found.len(), TOUCHES);
        let largest = |off_m: f64| -> Value {
            let mut bytes = Vec::new();
            for ((positions, link), frame) in touches.iter().zip(&found) {
                let (place, of) = place(frame);
                assert_eq!(of, "world", "{frame}");
                let touch =
                    [*link as f64].into_iter().chain(points[*link]).chain((place + off_m * DVec3::X).to_array());
                bytes.extend(positions.iter().copied().chain(touch).flat_map(f64::to_le_bytes));
            }
            std::fs::write(&numbers, bytes).unwrap();
            serde_json::from_str(&compare(&["places", original, text_of(&names), text_of(&numbers)]).unwrap()).unwrap()
        };
        let (right, wrong) = (largest(0.0), largest(2e-6));
        for library in ["pinocchio", "yourdfpy"] {
            let [right, wrong] = [&right, &wrong].map(|of| of[library]["largest"].as_f64().unwrap());
            eprintln!("{robot}, {library}: {right:e} m");
            assert!(right < 1e-6 && wrong > 1e-6, "{robot}, {library}: {right:e} and {wrong:e} m");
        }
    }
}

#[test]
fn links_are_where_pinocchio_and_yourdfpy_have_them() {
    // yourdfpy takes 20 ms for each.
    const CONFIGURATIONS: usize = 200;
    let folder = tempfile::tempdir().unwrap();
    let (names, numbers) = (folder.path().join("names.json"), folder.path().join("numbers"));
    for (robot, joints, links) in [("panda", 8, 13), ("icub", 32, 56), ("tiago", 48, 78)] {
        let Some(urdf) = compare(&["where", robot]) else { return };
        let urdf = urdf.trim();
        let kinematics = Kinematics::load(urdf).unwrap();
        assert_eq!((kinematics.joint_names().len(), kinematics.link_names().len()), (joints, links), "{robot}");
        let listed = serde_json::json!({
            "joints": kinematics.joint_names().collect::<Vec<_>>(), "links": kinematics.link_names().collect::<Vec<_>>()
        });
        std::fs::write(&names, listed.to_string()).unwrap();
        let largest_off = |configurations: usize, off_rad: f64| -> Value {
            let mut random = Random::new(1);
            let mut bytes = Vec::new();
            for _ in 0..configurations {
                let mut positions: Vec<f64> = (0..joints).map(|_| 6.0 * (random.unit() - 0.5)).collect();
                let reported = positions.clone();
                positions[1] += off_rad;
                let poses = kinematics.link_poses(&positions);
                let rows = poses.iter().flat_map(|(_, pose)| {
                    let rows = pose.matrix3.transpose();
                    [0, 1, 2].into_iter().flat_map(move |row| {
                        let [x, y, z] = rows.col(row).to_array();
                        [x, y, z, pose.translation[row]]
                    })
                });
                bytes.extend(reported.into_iter().chain(rows).flat_map(f64::to_le_bytes));
            }
            std::fs::write(&numbers, bytes).unwrap();
            serde_json::from_str(&compare(&["compare", urdf, text_of(&names), text_of(&numbers)]).unwrap()).unwrap()
        };
        let (right, wrong) = (largest_off(CONFIGURATIONS, 0.0), largest_off(3, 1.0_f64.to_radians()));
        for library in ["pinocchio", "yourdfpy"] {
            assert_eq!(right[library]["configurations"], CONFIGURATIONS);
            let largest = |of: &Value| of[library]["largest"].as_f64().unwrap();
            eprintln!("{robot}, {library}: {:e} m", largest(&right));
            assert!(largest(&right) < 1e-9, "{robot}: {right}");
            assert!(largest(&wrong) > 1e-3, "{robot}: a joint off by 1° is not seen: {wrong}");
        }
    }
}

#[test]
fn joints_in_frames_put_percepts_into_the_world() {
    let (_folder, body) = arm();
    let line = |t: f64, joints: &str| format!("{{\"t\":{t},\"values\":{{\"11\":5}}{joints}}}\n");
    let straight = ",\"joints\":{\"shoulder\":0,\"elbow\":0,\"grip\":0.01}";
    // The shoulder turns x to −z, the elbow x to y.
    let bent = ",\"joints\":{\"shoulder\":1.5707963267948966,\"elbow\":1.5707963267948966,\"grip\":0}";
    let based = format!("{bent},\"pose\":{{\"base\":[10,0,0,0,0,0,1]}}");
    let lines =
        [line(0.0, straight), line(0.05, ""), line(0.1, bent), line(0.15, &based), line(0.9, ""), line(1.0, straight)];
    let (found, said) = run_lines(&body, &lines.concat(), &["--joints", URDF, "--up", "z"]);
    assert!(said.contains("5 of the body's") && said.contains("links are in the URDF"), "{said}");
    // Taxel 11 on the fore arm: row 2, column 3 of the array.
    let in_link = run_lines(&body, &line(0.0, ""), &[]).0;
    let (in_link, link) = place(&in_link[0]);
    assert_eq!(link, "fore_arm");
    assert!(in_link.distance(DVec3::new(0.07, 0.015, 0.02)) < 1e-6, "{in_link}");
    // By hand, in the URDF's own axes, which are the world's.
    let when_straight = DVec3::new(0.3, 0.0, 0.12) + in_link;
    let shoulder =
        DAffine3::from_rotation_translation(DQuat::from_rotation_y(std::f64::consts::FRAC_PI_2), DVec3::Z * 0.12);
    let elbow =
        DAffine3::from_rotation_translation(DQuat::from_rotation_z(std::f64::consts::FRAC_PI_2), DVec3::X * 0.3);
    let in_base = (shoulder * elbow).transform_point3(in_link);
    // A base that is posed is where that says.
    let expected = [when_straight, when_straight, in_base, in_base + DVec3::X * 10.0, in_link, when_straight];
    for ((frame, expected), at) in found.iter().zip(expected).zip(0..) {
        let (position, link) = place(frame);
        let is_late = at == 4;
        assert_eq!(
            (link.as_str(), has_flag(frame, "stale_pose")),
            (if is_late { "fore_arm" } else { "world" }, is_late),
            "{at}"
        );
        assert!(position.distance(expected) < 1e-6, "frame {at}: {position}, not {expected}");
    }
    assert_eq!(found.len(), 6);
    assert!(said.contains("at 0.9 s: joint `elbow`") || said.contains("at 0.9 s: joint `shoulder`"), "{said}");
    assert!(said.contains("0.750 s old") && said.contains("at 1 s: every joint has a state"), "{said}");
    assert!(said.contains("1 of 6 frames lack poses") && !said.contains("degrees"), "{said}");
    // Who asks for the anchor gets it, and no flag.
    let flags = ["--joints", URDF, "--up", "z", "--coordinates", "anchor"];
    let anchored = run_lines(&body, &lines.concat(), &flags).0;
    assert!(anchored.iter().all(|frame| place(frame).1 == "fore_arm" && !has_flag(frame, "stale_pose")));
}

#[test]
fn a_body_of_a_urdf_remembers_what_points_up_in_it() {
    let (folder, body) = arm();
    let frame = "{\"t\":0,\"values\":{\"11\":5},\"joints\":{\"shoulder\":0,\"elbow\":0,\"grip\":0}}\n";
    let in_root = DVec3::new(0.3 + 0.07, 0.015, 0.12 + 0.02);
    let assumed = "its z counts as up, as in REP 103";
    let (found, said) = run_lines(&body, frame, &["--joints", URDF]);
    assert!(place(&found[0]).0.distance(in_root) < 1e-6 && !said.contains(assumed), "{said}");
    // With y up the URDF has glTF's axes, and faces along its z.
    let lying = folder.path().join("lying.glb");
    done(&["author", "--urdf-skin", URDF, "--up", "y", "-o", text_of(&lying)]);
    let (found, said) = run_lines(&lying, frame, &["--joints", URDF]);
    let (position, link) = place(&found[0]);
    assert!(position.distance(DVec3::new(in_root.z, in_root.x, in_root.y)) < 1e-6 && link == "world", "{position}");
    assert!(!said.contains(assumed), "{said}");
    // Another program may drop that: then z is assumed, and a line says so.
    let (key, other) = (&b"somatic_urdf"[..], &b"another_name"[..]);
    let mut bytes = std::fs::read(&body).unwrap();
    let at: Vec<usize> = (0..bytes.len() - key.len()).filter(|&at| bytes[at..].starts_with(key)).collect();
    assert_eq!(at.len(), 1);
    bytes[at[0]..][..other.len()].copy_from_slice(other);
    std::fs::write(&body, bytes).unwrap();
    let (again, said) = run_lines(&body, frame, &["--joints", URDF]);
    assert!(place(&again[0]).0.distance(in_root) < 1e-6 && said.matches(assumed).count() == 1, "{said}");
    assert!(!run_lines(&body, frame, &["--joints", URDF, "--up", "z"]).1.contains(assumed));
}

#[test]
fn states_of_a_recording_are_interpolated_to_the_frames_time() {
    let (folder, body) = arm();
    let touch = folder.path().join("touch.csv");
    std::fs::write(&touch, "t,11\n0,5\n0.025,5\n0.1,5\n0.5,5\n").unwrap();
    let states = folder.path().join("states.csv");
    let run = |text: &str, flags: &[&str]| {
        std::fs::write(&states, text).unwrap();
        let all = [
            &["run", "--backend", "reference", "--body", text_of(&body), "--source", text_of(&touch), "--joints", URDF]
                [..],
            &["--joint-states", text_of(&states), "--up", "z", "--sink", "-"],
            flags,
        ];
        frames(&done(&all.concat()))
            .iter()
            .map(|frame| (place(frame).0, has_flag(frame, "stale_pose")))
            .collect::<Vec<_>>()
    };
    let turned = |angle: f64| {
        let [x, y, z] = [0.07, 0.015, 0.02];
        let (sin, cos) = angle.sin_cos();
        // Turned around the elbow's z.
        DVec3::new(0.3 + cos * x - sin * y, sin * x + cos * y, 0.12 + z)
    };
    let states_text = "t,elbow,shoulder,grip\n-0.05,-1,0,0\n0.05,1,0,0\n0.1,1,0,0\n";
    let found = run(states_text, &[]);
    for ((position, is_late), angle) in found.iter().zip([0.0, 0.5, 1.0]) {
        assert!(!is_late && position.distance(turned(angle)) < 1e-6, "{position} is not {}", turned(angle));
    }
    assert!(found[3].1, "the last state is 0.4 s old");
    // The joints' clock stamps an instant 25 ms later.
    let delayed = run(states_text, &["--joints-delay", "0.025", "--joints-max-age", "1"]);
    assert!(delayed[0].0.distance(turned(0.5)) < 1e-6 && !delayed[3].1, "{delayed:?}");
    // A grip that no state has moves no taxel.
    assert_eq!(run("t,elbow,shoulder\n-0.05,-1,0\n0.05,1,0\n0.1,1,0\n", &[]), found);
}

#[test]
fn poses_of_a_recording_with_joints_are_replayed_without_the_urdf() {
    let (folder, body) = arm();
    let recording = folder.path().join("arm.mcap");
    let jointed = ["--joints", URDF, "--joint-states", STATES, "--up", "z"];
    let flags = ["run", "--backend", "reference", "--body", text_of(&body), "--source", TOUCH, "--sink", "-"];
    let first = done(&[&flags[..], &jointed, &["--sink", text_of(&recording)]].concat());
    let again = done(&["run", "--backend", "reference", "--source", text_of(&recording), "--sink", "-"]);
    assert!(first == again && first.contains("\"link\":\"world\""));
}

#[test]
fn what_does_not_go_together_is_refused_in_one_line() {
    let (folder, body) = arm();
    let run = |code: i32, flags: &[&str]| {
        let why = fails(code, &[&["run", "--body", text_of(&body), "--source", TOUCH][..], flags].concat());
        assert_eq!(why.lines().count(), 1, "{why}");
        why
    };
    assert!(run(2, &["--up", "z"]).contains("add --joints robot.urdf"));
    assert!(run(2, &["--joints", URDF, "--up", "z"]).contains("--joint-states FILE"));
    let wrong_up = run(1, &["--joints", URDF, "--joint-states", STATES, "--up", "y"]);
    assert!(wrong_up.contains("arm.urdf: with all joints at 0, link `base` is 0.0 mm and 120.0°"), "{wrong_up}");
    assert!(wrong_up.contains("with --up z they agree"), "{wrong_up}");
    // A link that has been moved by 2 mm is seen, and one by 0.5 mm is not.
    let moved = |origin: &str| {
        let text = std::fs::read_to_string(URDF).unwrap();
        let mut path = folder.path().join("moved");
        path.set_extension(format!("{}.urdf", origin.replace(' ', "_")));
        std::fs::write(&path, text.replace("<origin xyz=\"0.3 0 0\"/>", &format!("<origin xyz=\"{origin}\"/>")))
            .unwrap();
        path
    };
    let far = run(1, &["--joints", text_of(&moved("0.302 0 0")), "--joint-states", STATES, "--up", "z"]);
    assert!(far.contains("link `fore_arm` is 2.0 mm and 0.0° from where body"), "{far}");
    let near = moved("0.3005 0 0");
    done(&[
        "run",
        "--body",
        text_of(&body),
        "--source",
        TOUCH,
        "--joints",
        text_of(&near),
        "--joint-states",
        STATES,
        "--up",
        "z",
    ]);
    let states = folder.path().join("states.csv");
    std::fs::write(&states, "t,shoulder\n0,0\n").unwrap();
    let lacking = run(1, &["--joints", URDF, "--joint-states", text_of(&states), "--up", "z"]);
    assert!(lacking.contains("states.csv: no state has joint `elbow`, which moves `fore_arm`"), "{lacking}");
    let jointed = ["--joints", URDF, "--joint-states", STATES, "--up", "z"];
    let other = fails(1, &[&["run", "--body", "hand", "--source", TOUCH][..], &jointed].concat());
    assert!(other.contains("none of its links has the name of a link of body `hand`"), "{other}");
    let looped = ["--joints", URDF, "--up", "z", "--joint-states", STATES, "--loop=2"];
    assert!(run(2, &looped).contains("--loop lets the time"));
}

#[test]
fn states_that_cannot_be_meant_are_reported() {
    let (folder, body) = arm();
    let touch = folder.path().join("touch.csv");
    let rows: String = (0..100).map(|frame| format!("{},5\n", f64::from(frame) * 0.01)).collect();
    std::fs::write(&touch, format!("t,11\n{rows}")).unwrap();
    let states = folder.path().join("states.csv");
    let said = |urdf: &str, text: &str| {
        std::fs::write(&states, text).unwrap();
        let output = super::somatic(&["run", "--backend", "reference", "--body", text_of(&body)])
            .args(["--source", text_of(&touch), "--joints", urdf, "--joint-states", text_of(&states)])
            .args(["--up", "z", "--sink", "-"])
            .output()
            .unwrap();
        (output.status.code(), stderr(&output))
    };
    let (code, reported) = said(URDF, "t,shoulder,elbow,grip\n0,28.6,0,0\n0.99,28.6,0,0\n");
    assert!(code == Some(0) && reported.matches("are these degrees?").count() == 1, "{reported}");
    assert!(reported.contains("joint `shoulder` is at 28.6 rad"), "{reported}");
    // In ms instead of s; the states come too late again and again.
    let (code, reported) = said(URDF, "t,shoulder,elbow,grip\n0,0,0,0\n250,0,0,0\n500,0,0,0\n");
    assert!(code == Some(0) && reported.contains("89 of 100 frames lack poses"), "{reported}");
    assert!(reported.contains("states are of 0 to 500 s on the frames' clock, frames of 0 to 0.99 s"), "{reported}");
    let slow: String = (0..5).map(|state| format!("{},0,0,0\n", f64::from(state) * 0.25)).collect();
    let (_, reported) = said(URDF, &format!("t,shoulder,elbow,grip\n{slow}"));
    assert_eq!(reported.matches("from here on").count(), 2, "{reported}");
    for (text, why) in [
        ("t,shoulder,elbow,grip\n", "it has no states, only a header"),
        ("t,shoulder,elbow,grip\n0,0,0,0\n1,0\n", "line 3: 2 cells, and the header has 4"),
        ("t,shoulder,elbwo,grip\n0,0,0,0\n", "no state has joint `elbow`, which moves `fore_arm`; is `elbwo` meant?"),
    ] {
        let (code, reported) = said(URDF, text);
        assert!(code == Some(1) && reported.contains(why), "{reported}");
    }
    let (_, reported) = said(URDF, "t,joint1,joint2\n0,0,0\n");
    assert!(
        reported.contains("no state has joint `elbow`, which moves `fore_arm`; add it to its `joint1`, `joint2`"),
        "{reported}"
    );
    // Degrees that are less than a whole turn, and millimetres.
    for (row, what) in [
        ("6,0,0", "joint `shoulder` is at 6 rad, and its limits in the URDF are "),
        ("0,0,19.48", "joint `grip` is at 19.48 m, and its limits in the URDF are 0 to "),
    ] {
        let (code, reported) = said(URDF, &format!("t,shoulder,elbow,grip\n0,{row}\n0.99,{row}\n"));
        assert!(
            code == Some(0) && reported.matches(what).count() == 1 && reported.contains("are its states in "),
            "{reported}"
        );
    }
    // Two clocks.
    let (_, reported) = said(URDF, "t,shoulder,elbow,grip\n1700000000,0,0,0\n1700000001,0,0,0\n");
    assert!(
        reported.contains("100 of 100 frames lack poses") && reported.contains("two clocks, give --joints-delay"),
        "{reported}"
    );
    // The base of another robot is called alike.
    let other = folder.path().join("other.urdf");
    let urdf = "<robot name=\"other\"><link name=\"base\"/><link name=\"tool\"/><joint name=\"turn\" type=\"continuous\">\
                <parent link=\"base\"/><child link=\"tool\"/></joint></robot>";
    std::fs::write(&other, urdf).unwrap();
    let (code, reported) = said(text_of(&other), "t,turn\n0,0\n");
    assert!(code == Some(1) && reported.contains("is it the URDF of this robot?"), "{reported}");
}
