//! `somatic view`: a recording played, entered anywhere, and explained.

use std::time::{Duration, Instant};

use serde_json::{Value, json};

use super::page::{Run, Viewer, f32_at, say, u32_at};
use super::{done, fails, frames};

const VIEW: [&str; 5] = ["view", "--listen", "127.0.0.1:0", "--backend", "cpu"];

/// Waits for a text of `kind` that `is` so.
fn text(viewer: &mut Viewer, kind: &str, is: impl Fn(&Value) -> bool) -> Value {
    let start = Instant::now();
    loop {
        if let Some(at) = viewer.texts.iter().position(|text| text["type"] == kind && is(text)) {
            return viewer.texts.remove(at);
        }
        assert!(start.elapsed() < Duration::from_secs(20), "no {kind} among {:?}", viewer.texts);
        match viewer.socket.read().unwrap() {
            tungstenite::Message::Text(text) => viewer.texts.push(serde_json::from_str(&text).unwrap()),
            tungstenite::Message::Binary(bytes) if bytes[0] == 2 => {
                say(&mut viewer.socket, &json!({"type": "drawn", "seq": u32_at(&bytes, 4)}));
            }
            _ => {}
        }
    }
}

/// The frame of number `number`.
fn frame(viewer: &mut Viewer, number: u64) -> Vec<u8> {
    let start = Instant::now();
    loop {
        let frame = viewer.frame();
        if u64::from_le_bytes(frame[8..16].try_into().unwrap()) == number {
            return frame;
        }
        assert!(start.elapsed() < Duration::from_secs(20));
    }
}

/// A frame's fields in contact, each with its total, which is the only column asked for.
fn totals(frame: &[u8], taxels: usize) -> Vec<(u32, f32)> {
    let sections = u16::from_le_bytes([frame[2], frame[3]]);
    let count = u32_at(frame, 36) as usize;
    let padded = |bytes: usize| bytes.next_multiple_of(8);
    let at = 72 + if sections & 1 == 1 { padded(5 * taxels) } else { 0 };
    assert!(sections & 0b110 == 0b100 || count == 0, "percepts, and no poses: {sections:b}");
    (0..count).map(|k| (u32_at(frame, at + 4 * k), f32_at(frame, at + 4 * (4 * count + k)))).collect()
}

#[test]
fn a_recording_is_entered_anywhere_with_the_percepts_of_an_uninterrupted_run() {
    let run = frames(&done(&["run", "--quiet", "--backend", "cpu", "--sink", "-"]));
    let mut view = Run::spawn(&VIEW);
    let mut viewer = view.viewer();
    viewer.binary();
    let welcome = text(&mut viewer, "welcome", |_| true);
    assert_eq!((&welcome["mode"], &welcome["time"]["frames"]), (&"recording".into(), &run.len().into()));
    let taxels = 40;
    say(&mut viewer.socket, &json!({"type": "columns", "columns": ["total"]}));
    say(&mut viewer.socket, &json!({"type": "pause"}));
    text(&mut viewer, "status", |status| status["playing"] == false);
    for number in [150, 20, 208, 150, 279] {
        let expected = &run[number];
        say(&mut viewer.socket, &json!({"type": "seek", "t_s": expected["t"]}));
        let shown = totals(&frame(&mut viewer, number as u64), taxels);
        let expected: Vec<(&str, f32)> = expected["fields"]
            .as_array()
            .unwrap()
            .iter()
            .map(|percept| (percept["field"].as_str().unwrap(), percept["total"].as_f64().unwrap() as f32))
            .collect();
        let label = |field: u32| welcome["fields"][field as usize]["label"].as_str().unwrap();
        let shown: Vec<(&str, f32)> = shown.into_iter().map(|(field, total)| (label(field), total)).collect();
        assert_eq!(shown, expected, "frame {number}");
    }
    // A step back, and over the end.
    say(&mut viewer.socket, &json!({"type": "step", "frames": -3}));
    frame(&mut viewer, 276);
    say(&mut viewer.socket, &json!({"type": "step", "frames": 1000}));
    frame(&mut viewer, 279);
    text(&mut viewer, "status", |status| status["at_end"] == true);
    // The timeline comes in parts while it is computed.
    let mut peaks = vec![Value::Null; 600];
    loop {
        let part = text(&mut viewer, "timeline", |_| true);
        let first = part["first_bin"].as_u64().unwrap() as usize;
        let found = part["peak"].as_array().unwrap();
        peaks[first..first + found.len()].clone_from_slice(found);
        if part["computed_until_s"].as_f64() >= run[279]["t"].as_f64() {
            break;
        }
    }
    assert!(peaks.iter().any(Value::is_null) && peaks.iter().any(|peak| peak.as_f64() > Some(100.0)), "{peaks:?}");
    assert_eq!(view.interrupt(), Some(0));
}

#[test]
fn a_percept_is_explained_and_its_history_sent() {
    let run = frames(&done(&["run", "--quiet", "--backend", "cpu", "--sink", "-"]));
    let mut view = Run::spawn(&VIEW);
    let mut viewer = view.viewer();
    viewer.binary();
    let welcome = text(&mut viewer, "welcome", |_| true);
    let field = welcome["fields"].as_array().unwrap().iter().position(|field| field["name"] == "hand/back").unwrap();
    say(&mut viewer.socket, &json!({"type": "pause"}));
    // Before the seek: waiting for a text passes over frames.
    text(&mut viewer, "status", |status| status["playing"] == false);
    say(&mut viewer.socket, &json!({"type": "seek", "t_s": 2.9}));
    let shown = frame(&mut viewer, 145);
    say(&mut viewer.socket, &json!({"type": "explain", "field": field}));
    let why = text(&mut viewer, "explain", |_| true);
    assert_eq!((&why["frame"], &why["backend"], &why["t_s"]), (&145.into(), &"cpu".into(), &2.9.into()));
    let columns = why["columns"].as_array().unwrap();
    assert!(columns.len() == 10 && columns.iter().all(|column| column["verdict"] == "agrees"), "{why}");
    let total = columns.iter().find(|column| column["name"] == "total").unwrap();
    let [value, reference] = ["value", "reference"].map(|of| total[of][0].as_f64().unwrap());
    assert!((value - reference).abs() <= total["bound"].as_f64().unwrap());
    let sum: f64 = why["members"].as_array().unwrap().iter().filter_map(|member| member["pressure"].as_f64()).sum();
    assert_eq!(sum, reference, "weights of the hand are 1");

    let series = json!([{"field": field, "column": "total", "component": 0}]);
    let ask = json!({"type": "history", "id": 9, "from_s": 0.0, "to_s": 5.6, "bins": 7, "series": series});
    say(&mut viewer.socket, &ask);
    let history = loop {
        let bytes = viewer.binary();
        if bytes[0] == 3 {
            break bytes;
        }
    };
    assert_eq!([4, 8, 12].map(|at| u32_at(&history, at)), [9, 7, 1]);
    let most = (0..7).map(|bin| f32_at(&history, 32 + 4 * (7 + bin))).fold(0.0, f32::max);
    let totals = run.iter().flat_map(|frame| frame["fields"].as_array().unwrap().clone());
    let of_back = totals.filter(|percept| percept["field"] == "hand/back");
    let largest = of_back.map(|percept| percept["total"].as_f64().unwrap()).fold(0.0, f64::max);
    assert_eq!(most, largest as f32, "no peak is lost");

    // By its number, whatever is shown.
    for number in [150, 145] {
        say(&mut viewer.socket, &json!({"type": "show", "frame": number}));
        frame(&mut viewer, number);
    }
    // Of one moment they are its pressures, and of all the highest.
    let mut peaks = |from_s: f64, to_s: f64| {
        say(&mut viewer.socket, &json!({"type": "peaks", "id": 5, "from_s": from_s, "to_s": to_s}));
        let bytes = loop {
            let bytes = viewer.binary();
            if bytes[0] == 4 {
                break bytes;
            }
        };
        assert_eq!(u32_at(&bytes, 4), 5);
        (24..bytes.len()).step_by(4).map(|at| f32_at(&bytes, at)).collect::<Vec<f32>>()
    };
    let now = peaks(2.9, 2.9);
    let pressures: Vec<f32> = (0..now.len()).map(|taxel| f32_at(&shown, 72 + 4 * taxel)).collect();
    assert!(now == pressures && pressures.iter().any(|&pressure| pressure > 0.0), "{now:?} {pressures:?}");
    let highest = run.iter().flat_map(|frame| frame["fields"].as_array().unwrap().clone());
    let highest = highest.filter_map(|percept| percept["peak"].as_f64()).fold(0.0, f64::max);
    assert_eq!(peaks(-1.0, 99.0).into_iter().fold(0.0, f32::max), highest as f32);
    assert_eq!(view.interrupt(), Some(0));
}

#[test]
fn percepts_that_a_recording_holds_are_compared_with_those_computed_now() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let (recorded, calibration) = (at("touch.mcap"), at("half.toml"));
    std::fs::write(&calibration, "[all]\ngain = 0.5\n").unwrap();
    let sink = format!("mcap:{recorded}");
    // Not the backend that views: what it rounds otherwise is no difference.
    done(&["run", "--quiet", "--backend", "reference", "--record", "frames,percepts", "--sink", &sink]);
    let touched =
        frames(&done(&["run", "--quiet", "--sink", "-"])).iter().filter(|frame| !frame["fields"][0].is_null()).count();
    for (calibration, differing) in [(None, 0), (Some(&*calibration), touched)] {
        let given = calibration.map_or(vec![], |file| vec!["--calibration", file]);
        let mut view = Run::spawn(&[&VIEW[..], &[&*recorded], &given].concat());
        let mut viewer = view.viewer();
        viewer.binary();
        let welcome = text(&mut viewer, "welcome", |_| true);
        let mut counts = vec![0; 600];
        loop {
            let part = text(&mut viewer, "timeline", |_| true);
            let first = part["first_bin"].as_u64().unwrap() as usize;
            for (bin, count) in part["differing"].as_array().into_iter().flatten().enumerate() {
                counts[first + bin] = count.as_u64().unwrap();
            }
            if part["computed_until_s"].as_f64() >= welcome["time"]["end_s"].as_f64() {
                break;
            }
        }
        assert_eq!(counts.iter().sum::<u64>(), differing as u64, "{calibration:?}");
        let fields = welcome["fields"].as_array().unwrap();
        let field = fields.iter().position(|field| field["name"] == "hand/back").unwrap();
        say(&mut viewer.socket, &json!({"type": "pause"}));
        text(&mut viewer, "status", |status| status["playing"] == false);
        say(&mut viewer.socket, &json!({"type": "seek", "t_s": 2.9}));
        frame(&mut viewer, 145);
        say(&mut viewer.socket, &json!({"type": "explain", "field": field}));
        let why = text(&mut viewer, "explain", |_| true);
        let column =
            |name: &str| why["columns"].as_array().unwrap().iter().find(|column| column["name"] == name).unwrap();
        let [now, then] = [column("total")["value"][0].as_f64(), column("total")["recorded"]["value"][0].as_f64()];
        assert_eq!(then, calibration.and(now).map(|now| 2.0 * now));
        // Where the hand is touched does not depend on a gain.
        assert!(column("centroid")["recorded"].is_null());
        assert_eq!(view.interrupt(), Some(0));
    }
}

#[test]
fn a_body_is_shown_at_rest() {
    let mut view = Run::spawn(&["view", "humanoid", "--listen", "127.0.0.1:0"]);
    let mut viewer = view.viewer();
    let mesh = viewer.binary();
    assert_eq!(mesh[0], 1);
    text(&mut viewer, "ended", |ended| ended["reason"].as_str().unwrap().contains("at rest"));
    assert_eq!(view.interrupt(), Some(0));
}

#[test]
fn what_cannot_be_shown_is_one_line() {
    for (code, arguments, word) in [
        (2, &["view", "robot"][..], "give a body"),
        (1, &["view", "none.mcap"], "no such file"),
        (1, &["view", "none.toml"], "no such file"),
        (2, &["view", "hand", "--body", "mat"], "give one of them"),
        (2, &["view", "a.csv", "--source", "b.csv"], "give one of them"),
        (2, &["view", "--source", "-"], "--sink page"),
        (2, &["view", "--listen", "0.0.0.0:0"], "--allow-host"),
        (2, &["view", "--for", "soon"], "is not a time"),
        (2, &["view", "--sink", "a.ndjson"], "has no use for --sink and --verify"),
        (2, &["view", "--verify"], "has no use for --sink and --verify"),
        (2, &["view", "hand", "--calibration", "none.toml"], "--calibration: it is about frames"),
    ] {
        let line = fails(code, arguments);
        assert!(line.contains(word) && line.lines().count() == 1, "{arguments:?}: {line}");
    }
}

#[test]
fn joints_move_the_links_of_a_view_and_self_contacts_are_reported() {
    let folder = tempfile::tempdir().unwrap();
    let body = folder.path().join("gripper.glb").display().to_string();
    let example = |name: &str| format!("{}/examples/robots/{name}", env!("CARGO_MANIFEST_DIR"));
    let urdf = example("gripper.urdf");
    done(&["author", "--urdf-skin", &urdf, "-o", &body]);
    let (touch, states) = (example("gripper-touch.csv"), example("gripper-joints.csv"));
    let joints = ["--joints", &urdf, "--joint-states", &states, "--up", "z"];
    let of_robot = ["--body", &body, "--source", &touch, "--outputs", "total,self_contacts"];
    let mut view = Run::spawn(&[&VIEW[..], &of_robot, &joints].concat());
    let mut viewer = view.viewer();
    viewer.binary();
    say(&mut viewer.socket, &json!({"type": "pause"}));
    text(&mut viewer, "status", |status| status["playing"] == false);
    for (t_s, number, contacts) in [(0.54, 27, 1), (1.62, 81, 0)] {
        say(&mut viewer.socket, &json!({"type": "seek", "t_s": t_s}));
        let frame = frame(&mut viewer, number);
        let sections = u16::from_le_bytes([frame[2], frame[3]]);
        // Pressures, poses, percepts, touches and self-contacts: all of them have changed.
        assert_eq!(sections, 0b10_1111, "{sections:b}");
        // The last section, 48 bytes each behind their number.
        let section = (4_usize + 48 * contacts).next_multiple_of(8);
        assert_eq!(u32_at(&frame, frame.len() - section) as usize, contacts, "at {t_s} s");
    }
    assert_eq!(view.interrupt(), Some(0));
}
