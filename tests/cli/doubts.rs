//! What `somatic run` says is doubtful in its input, once, though it goes on.

use serde_json::Value;

use super::{done, fails, file, output, stderr, text_of};

const TOUCH: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/bodies/touch.csv");

/// What a run that must succeed says.
fn said(arguments: &[&str]) -> String {
    let output = output(&[&["run", "--backend", "cpu", "--sink", "-"][..], arguments].concat());
    assert_eq!(output.status.code(), Some(0), "{arguments:?}: {}", stderr(&output));
    stderr(&output)
}

/// The ids of the taxels of a field of the bundled hand.
fn taxels_of(field: &str) -> Vec<u64> {
    let hand: Value = serde_json::from_str(&done(&["inspect", "hand", "--json"])).unwrap();
    let field = hand["fields"].as_array().unwrap().iter().find(|known| known["name"] == field).unwrap();
    field["members"].as_array().unwrap().iter().map(|member| member["taxel"].as_u64().unwrap()).collect()
}

/// A recording of `rows` frames at 50 Hz in which each of `ids` has what `value` gives for its id and row.
fn recording(ids: &[u64], rows: u64, value: impl Fn(u64, u64) -> f64) -> String {
    let head: String = ids.iter().map(|id| format!(",{id}")).collect();
    let row = |row: u64| -> String {
        let values: String = ids.iter().map(|&id| format!(",{}", value(id, row))).collect();
        format!("{}{values}\n", row as f64 / 50.0)
    };
    format!("t{head}\n{}", (0..rows).map(row).collect::<String>())
}

#[test]
fn a_source_for_another_body_is_reported_once() {
    let about = "touch.csv has 40 of the 2048 taxels of mat; ";
    let text = said(&["--body", "mat", "--source", TOUCH]);
    assert!(text.matches(about).count() == 1 && text.contains("lack over half of theirs, such as mat"), "{text}");
    assert!(text.contains("is it the right body?") && text.lines().count() == 1, "{text}");
    assert_eq!(said(&["--body", "mat", "--source", TOUCH, "--quiet"]), "");
    // The same from an MCAP that somebody else's body is given for. A simulation knows its body.
    let folder = tempfile::tempdir().unwrap();
    let mcap = folder.path().join("touch.mcap");
    done(&["convert", TOUCH, text_of(&mcap), "--body", "hand"]);
    assert!(said(&["--body", "mat", "--source", text_of(&mcap)]).contains("touch.mcap has 40 of the 2048 taxels"));
    assert_eq!(said(&["--source", text_of(&mcap)]), "");
    let rod = concat!("sim:", env!("CARGO_MANIFEST_DIR"), "/examples/simulations/rod.toml");
    let refused = fails(2, &["run", "--body", "mat", "--source", rod]);
    assert!(refused.contains("rod.toml: it is on another body than `mat`; leave --body out"), "{refused}");
    assert!(!said(&["--source", rod]).contains("right body"));
}

#[test]
fn what_needs_poses_says_that_no_frame_has_any() {
    let said_of = |more: &[&str]| said(&[&["--body", "hand", "--source", TOUCH][..], more].concat());
    let text = said_of(&["--outputs", "self_contacts,speed_in_world"]);
    let about =
        "touch.csv: no frame says where links are, as self_contacts, speed_in_world needs; give the robot's --joints";
    assert!(text.contains(about) && text.lines().count() == 1, "{text}");
    assert!(said_of(&["--relative-to", "thumb"]).contains("as --relative-to needs; "));
    assert_eq!(said_of(&["--outputs", "position"]), "");
    // Late joints are reported elsewhere.
    let robot = concat!(env!("CARGO_MANIFEST_DIR"), "/examples/robots");
    let of_robot = |name: &str| format!("{robot}/{name}");
    let (urdf, states, touch) = (of_robot("arm.urdf"), of_robot("arm-joints.csv"), of_robot("arm-touch.csv"));
    let folder = tempfile::tempdir().unwrap();
    let arm = folder.path().join("arm.glb");
    done(&["author", "--urdf-skin", &urdf, "-o", text_of(&arm)]);
    let of_arm = ["--body", text_of(&arm), "--source", &touch, "--outputs", "self_contacts"];
    assert!(said(&of_arm).contains("no frame says where links are"));
    let posed = [&of_arm[..], &["--joints", &urdf, "--joint-states", &states, "--up", "z"]].concat();
    assert!(!said(&posed).contains("no frame says where links are"));
}

#[test]
fn only_the_fields_that_are_asked_for_count() {
    let palm = taxels_of("hand/palm");
    let (_folder, path) = file("palm.csv", &recording(&palm, 3, |_, row| row as f64));
    let text = said(&["--source", text_of(&path)]);
    assert!(text.contains(&format!("palm.csv has {} of the 40 taxels of hand", palm.len())), "{text}");
    assert_eq!(said(&["--source", text_of(&path), "--fields", "hand/palm*"]), "");
    // Half of a field is enough.
    let half = &palm[..palm.len().div_ceil(2)];
    let (_folder, path) = file("half.csv", &recording(half, 3, |_, row| row as f64));
    assert_eq!(said(&["--source", text_of(&path), "--fields", "hand/palm"]), "");
    let (_folder, path) = file("less.csv", &recording(&half[1..], 3, |_, row| row as f64));
    assert!(said(&["--source", text_of(&path), "--fields", "hand/palm"]).contains("1 of 1 field"));
}

#[test]
fn a_driver_for_another_body_is_reported_after_a_second() {
    let lines = |until: u32| -> String {
        (0..=until).map(|n| format!("{{\"t\":{},\"values\":{{\"4\":{n}}}}}\n", f64::from(n) * 0.5)).collect()
    };
    let said = |until| {
        let (_folder, path) = file("frames", &lines(until));
        let input = std::fs::File::open(path).unwrap();
        let mut command = super::somatic(&["run", "--backend", "cpu", "--body", "mat", "--source", "-"]);
        stderr(&command.stdin(input).output().unwrap())
    };
    assert_eq!(said(2), "", "a few frames may well hold few taxels");
    let text = said(9);
    assert!(text.contains("stdin has 1 of the 2048 taxels of mat") && text.lines().count() == 1, "{text}");
}

#[test]
fn sensors_that_rest_pressed_are_reported_once() {
    let hand = taxels_of("hand");
    let falling = |id: u64, row: u64| if row == 10 && id < 9 { 200.0 } else { 1023.0 - (id % 7) as f64 };
    let about = "wholly pressed from the start on; do readings fall when pressed";
    for rows in [1, 20, 200] {
        let (_folder, path) = file("hand.csv", &recording(&hand, rows, falling));
        let text = said(&["--source", text_of(&path)]);
        assert!(text.matches(about).count() == 1 && text.lines().count() == 1, "{rows}: {text}");
        assert_eq!(said(&["--source", text_of(&path), "--quiet"]), "");
        assert_eq!(said(&["--source", text_of(&path), "--tare"]), "");
        let (_other, calibration) = file("hand.toml", "[all]\nbaseline = 1023\ninvert = true\n");
        assert_eq!(said(&["--source", text_of(&path), "--calibration", text_of(&calibration)]), "");
        let input = recording(&hand, rows, falling);
        let (_other, piped) = file("rows", &input);
        let mut command = super::somatic(&["run", "--backend", "cpu", "--source", "csv:-"]);
        let piped = command.stdin(std::fs::File::open(piped).unwrap()).output().unwrap();
        assert_eq!(stderr(&piped).matches(about).count(), 1, "{}", stderr(&piped));
    }
}

#[test]
fn sensors_that_rest_at_nothing_are_no_matter_of_doubt() {
    assert_eq!(said(&["--source", TOUCH]), "");
    let hand = taxels_of("hand");
    // Each taxel rests once within the second, at another time; or only from the second second on are all pressed.
    let resting = |id: u64, row: u64| if row == id { 0.0 } else { 9.0 };
    let later = |_: u64, row: u64| if row < 5 { 0.0 } else { 9.0 };
    for value in [&resting as &dyn Fn(u64, u64) -> f64, &later] {
        let (_folder, path) = file("hand.csv", &recording(&hand, 100, value));
        assert_eq!(said(&["--source", text_of(&path)]), "");
    }
    // Fields of two or three taxels may well be pressed by one finger.
    let thumb = hand.iter().copied().take(3).collect::<Vec<u64>>();
    let (_folder, path) = file("hand.csv", &recording(&hand, 100, |id, _| if thumb.contains(&id) { 9.0 } else { 0.0 }));
    assert_eq!(said(&["--source", text_of(&path)]), "");
}
