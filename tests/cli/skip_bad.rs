//! Wrong lines, rows and messages of recordings: an error, or with `--skip-bad` left out and counted.

use std::fs;
use std::path::{Path, PathBuf};

use super::bags::{ROBOT, Said, What, refused, rows, with, write_mcap};
use super::{done, fails, frames, output, stderr, text_of};

/// A folder with the arm's body in it.
fn arm() -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let body = folder.path().join("arm.glb");
    done(&["author", "--urdf-skin", &format!("{ROBOT}/arm.urdf"), "-o", text_of(&body)]);
    (folder, body)
}

/// Runs these: without the flag an error that says `wrong`; with it what `expected` is, and that says each of `reported`.
fn check(arguments: &[&str], wrong: &str, expected: &str, reported: &[&str]) {
    let why = refused(1, arguments);
    assert!(why.contains(wrong), "{why}");
    let run = output(&[arguments, &["--skip-bad"]].concat());
    let said = stderr(&run);
    assert_eq!(run.status.code(), Some(3), "{said}");
    for reported in reported {
        assert!(said.contains(reported), "{reported}: {said}");
    }
    assert!(String::from_utf8_lossy(&run.stdout) == expected, "{said}");
}

/// The lines of `text` with each of `more` after the line of that number, from 1.
fn with_lines(text: &str, more: &[(usize, &str)]) -> String {
    let mut all = String::new();
    for (number, line) in (1..).zip(text.lines()) {
        all += &format!("{line}\n");
        more.iter().filter(|(after, _)| *after == number).for_each(|(_, line)| all += &format!("{line}\n"));
    }
    all
}

fn run_of<'a>(body: &'a Path, source: &'a str) -> Vec<&'a str> {
    vec!["run", "--backend", "reference", "--body", text_of(body), "--source", source, "--sink", "-"]
}

#[test]
fn wrong_rows_of_tables_and_joint_states_are_left_out() {
    let (folder, body) = arm();
    let (whole, wrong) = (format!("{ROBOT}/arm-touch.csv"), folder.path().join("wrong.csv"));
    let text = fs::read_to_string(&whole).unwrap();
    fs::write(&wrong, with_lines(&text, &[(3, "0.01,5"), (5, "0.02,5"), (9, "now")])).unwrap();
    let expected = done(&run_of(&body, &whole));
    let reported = ["wrong.csv: 3 rows skipped, more or fewer values than columns; the first one: line 4"];
    check(&run_of(&body, text_of(&wrong)), "wrong.csv: line 4: 2 values where", &expected, &reported);

    // Joint states as NDJSON, with one that is null.
    let urdf = format!("{ROBOT}/arm.urdf");
    let mut lines = String::new();
    for (ns, cells) in rows("arm-joints.csv") {
        let joints: serde_json::Map<String, serde_json::Value> =
            cells.into_iter().map(|(joint, position)| (joint, position.into())).collect();
        lines += &format!("{}\n", serde_json::json!({"t": ns as f64 / 1e9, "joints": joints}));
    }
    let (whole_states, states) = (folder.path().join("whole.ndjson"), folder.path().join("wrong.ndjson"));
    fs::write(&whole_states, &lines).unwrap();
    fs::write(&states, with_lines(&lines, &[(2, "{\"t\":0.1,\"joints\":{\"elbow\":null}}"), (4, "{\"t\":NaN")]))
        .unwrap();
    let jointed = |states: &Path| -> Vec<String> {
        let more = ["--joints", &urdf, "--joint-states", text_of(states)];
        run_of(&body, &whole).into_iter().chain(more).map(str::to_owned).collect()
    };
    let expected = done(&with(&jointed(&whole_states), &[]));
    let reported = ["wrong.ndjson: 2 lines skipped, not a joint state; the first one: line 3"];
    check(&with(&jointed(&states), &[]), "wrong.ndjson: line 3", &expected, &reported);
}

#[test]
fn wrong_lines_of_plain_tables_are_left_out_and_their_frames_keep_their_times() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("plain.csv");
    let lines: Vec<String> = (0..30).map(|at| format!("{},{},7,{}", at, 30 - at, at * 3)).collect();
    fs::write(&path, lines.join("\n") + "\n").unwrap();
    let run =
        ["run", "--backend", "reference", "--source", text_of(&path), "--grid", "2x2", "--rate", "10", "--sink", "-"];
    let times = |text: &str| -> Vec<f64> { frames(text).iter().map(|frame| frame["t"].as_f64().unwrap()).collect() };
    let mut expected = times(&done(&run));
    assert_eq!((expected.len(), expected.remove(20)), (30, 2.0));
    let mut wrong = lines;
    wrong[20] = "1,2,3".to_owned();
    fs::write(&path, wrong.join("\n") + "\n").unwrap();
    let skipping = output(&[&run[..], &["--skip-bad"]].concat());
    assert_eq!(skipping.status.code(), Some(3), "{}", stderr(&skipping));
    assert!(stderr(&skipping).contains("plain.csv: 1 line skipped, not a frame: line 21"), "{}", stderr(&skipping));
    assert_eq!(times(&String::from_utf8_lossy(&skipping.stdout)), expected);
    assert!(refused(1, &run).contains("plain.csv: line 21"));
}

#[test]
fn frames_of_several_lines_are_left_out_whole() {
    let folder = tempfile::tempdir().unwrap();
    let examples = concat!(env!("CARGO_MANIFEST_DIR"), "/examples/exports");
    let run = |path: &str| -> Vec<String> {
        let run = [
            "run",
            "--quiet",
            "--backend",
            "reference",
            "--outputs",
            "force",
            "--all-fields",
            "--sink",
            "-",
            "--source",
            path,
        ];
        run.map(str::to_owned).to_vec()
    };
    let reported = |text: &str| -> Vec<(String, String)> {
        frames(text).iter().map(|frame| (frame["t"].to_string(), frame["fields"].to_string())).collect()
    };
    // A wrong cell within a frame, and a row too few, which the next frame shows.
    for (name, mark, number, wrong) in
        [("insoles.csv", "FRAME", 9, "0,0,0,0,0,0,0,0,0,0,0\n"), ("mat.asf", "Frame ", 14, "0,0,0,0,0,0\n")]
    {
        let whole = format!("{examples}/{name}");
        let text = fs::read_to_string(&whole).unwrap();
        let mut expected = reported(&done(&with(&run(&whole), &[])));
        expected.remove(number);
        let start = text.match_indices(mark).nth(number).unwrap().0;
        let row = start + text[start..].find(wrong).unwrap();
        for (what, changed) in [("x,", wrong.replacen("0,", "x,", 1)), ("", String::new())] {
            let path = folder.path().join(name);
            fs::write(&path, format!("{}{changed}{}", &text[..row], &text[row + wrong.len()..])).unwrap();
            let arguments = run(text_of(&path));
            let why = refused(1, &with(&arguments, &[]));
            assert!(why.contains(&format!("{name}: line ")), "{what}: {why}");
            let skipping = output(&with(&arguments, &["--skip-bad"]));
            let said = stderr(&skipping);
            assert_eq!(skipping.status.code(), Some(3), "{said}");
            assert!(said.contains("1 frame skipped, a line that does not fit"), "{said}");
            assert_eq!(reported(&String::from_utf8_lossy(&skipping.stdout)), expected, "{name}, {what}: {said}");
        }
    }
}

#[test]
fn messages_of_bags_that_do_not_fit_are_left_out() {
    let (folder, body) = arm();
    let array = |(ns, cells): (u64, Vec<(String, f64)>)| {
        let values = cells.iter().map(|(_, value)| *value as f32).collect();
        Said { topic: "/numbers", log_ns: ns, stamp_ns: 0, what: What::Array(values) }
    };
    let mut messages: Vec<Said> = rows("arm-touch.csv").into_iter().map(array).collect();
    let at = |name: &str| folder.path().join(name);
    write_mcap(&at("whole.mcap"), &messages, "cdr");
    let mut short = messages[7].clone();
    let What::Array(values) = &mut short.what else { panic!() };
    values.pop();
    messages.insert(8, short);
    write_mcap(&at("short.mcap"), &messages, "cdr");
    let name = |file: &str| format!("ros2-mcap:{}", text_of(&at(file)));
    let expected = done(&run_of(&body, &name("whole.mcap")));
    let reported = ["1 message skipped, values that do not fit: "];
    check(&run_of(&body, &name("short.mcap")), "short.mcap: /numbers: the message of ", &expected, &reported);
}

#[test]
fn what_has_no_wrong_lines_does_not_take_the_flag() {
    for source in ["sim:a.toml", "mcap:a.mcap", "serial:/dev/null", "paxini:/dev/null"] {
        let why = fails(2, &["run", "--source", source, "--skip-bad"]);
        assert!(why.contains("--skip-bad is for CSV, NDJSON, exports and ROS 2 bags"), "{source}: {why}");
    }
}
