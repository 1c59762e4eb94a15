//! Scenes from files, and what is said of their cost.

use std::path::Path;

use serde_json::Value;

use crate::{done, fails, frames, text_of};

const PALM: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/examples/scenes/palm.toml");

fn scene(folder: &Path, text: &str) -> String {
    let path = folder.join("scene.toml");
    std::fs::write(&path, text).unwrap();
    path.display().to_string()
}

#[test]
fn a_scene_says_what_flags_would_and_flags_come_first() {
    let touch = concat!(env!("CARGO_MANIFEST_DIR"), "/bodies/touch.csv");
    let flags = ["--body", "hand", "--source", touch, "--fields", "hand/palm", "--fields", "hand/palm/*"];
    let rest = ["--outputs", "centroid,orientation", "--backend", "cpu", "--max-gap", "0.1", "--sink", "-"];
    let by_flags = done(&[&["run"][..], &flags, &rest].concat());
    let by_scene = done(&["run", PALM, "--sink", "-"]);
    assert_eq!(by_scene, by_flags);
    let totals = done(&["run", PALM, "--sink", "-", "--outputs", "total"]);
    let touched = frames(&totals).into_iter().find(|frame| frame["fields"][0].is_object()).unwrap();
    assert!(touched["fields"][0]["total"].is_number() && touched["fields"][0]["centroid"].is_null());
}

#[test]
fn paths_in_a_scene_are_relative_to_it() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("frames.csv"), "t,4,5\n0,1,2\n0.1,3,4\n").unwrap();
    let text = "source = \"frames.csv\"\nsink = [\"ndjson:out.ndjson\"]\nbackend = \"reference\"\nbody = \"hand\"\n";
    done(&["run", &scene(folder.path(), text), "--quiet"]);
    let out = std::fs::read_to_string(folder.path().join("out.ndjson")).unwrap();
    assert_eq!(frames(&out).len(), 2);
}

#[test]
fn what_a_scene_gets_wrong_is_one_line_with_line_and_column() {
    let folder = tempfile::tempdir().unwrap();
    for (text, place, what) in [
        ("\n  sorce = \"-\"", "line 2, column 3", "did you mean `source`"),
        ("outputs = [\"total\", \"centriod\"]", "line 1, column 11", "did you mean `centroid`"),
        ("backend = \"cuda\"", "line 1, column 11", "it is one of auto, cpu, gpu, reference"),
        ("batch = 0", "line 1, column 9", "between 1 and 65536"),
        ("source = \"seril:a\"", "line 1, column 10", "did you mean `serial:`"),
        ("sink = 3", "line 1, column 8", "a text, or a list of texts"),
        ("filter_window = \"5..2mm\"", "line 1, column 17", "lets nothing pass"),
        ("body = \"hand", "line 1", "basic string"),
    ] {
        let line = fails(2, &["run", &scene(folder.path(), text)]);
        assert!(line.contains(place) && line.contains(what) && line.lines().count() == 1, "{text}: {line}");
    }
    assert!(fails(2, &["run", &scene(folder.path(), "max_age_s = -1")]).contains("scene.toml"));
    assert!(fails(1, &["run", "no/such.toml"]).contains("no such file"));
    assert!(fails(2, &["run", &scene(folder.path(), "fields = \"hand/plam\"")]).contains("did you mean `hand/palm`"));
}

/// One mistake, by flag and by key, ends with one exit code.
#[test]
fn a_mistake_is_wrong_usage_whether_by_flag_or_by_key() {
    let folder = tempfile::tempdir().unwrap();
    for (flags, key) in [
        ("--sorce -", "sorce = \"-\""),
        ("--source seril:a", "source = \"seril:a\""),
        ("--sink jsn:a", "sink = \"jsn:a\""),
        ("--outputs centriod", "outputs = [\"centriod\"]"),
        ("--fields hand/plam", "fields = \"hand/plam\""),
        ("--backend cuda", "backend = \"cuda\""),
        ("--batch 0", "batch = 0"),
        ("--batch x", "batch = \"x\""),
        ("--speed 0", "playback_speed = 0"),
        ("--speed x", "playback_speed = \"x\""),
        ("--max-age -1", "max_age_s = -1"),
        ("--max-gap x", "max_gap_s = \"x\""),
        ("--letters chnage", "letters = \"chnage\""),
        ("--signal log", "signal = \"log\""),
        ("--coordinates wrld", "coordinates = \"wrld\""),
        ("--filter-window 5..2mm", "filter_window = \"5..2mm\""),
        ("--filter-by x", "filter_by = \"x\""),
        ("--record frmes", "record = \"frmes\""),
        ("--relative-to nowhere --outputs position", "relative_to = \"nowhere\"\noutputs = \"position\""),
        ("--arithmetic f16", "[accuracy]\narithmetic = \"f16\""),
        ("--charts x", "[accuracy]\ncharts = \"x\""),
    ] {
        let words: Vec<&str> = flags.split(' ').collect();
        fails(2, &[&["run"][..], &words].concat());
        let said = fails(2, &["run", &scene(folder.path(), key)]);
        assert_eq!(said.lines().count(), 1, "{key}: {said}");
    }
}

#[test]
fn a_plan_counts_what_a_scene_needs_and_leaves_out_the_rest() {
    let plan = |arguments: &[&str]| -> Value {
        serde_json::from_str(&done(&[&["plan", "--json", "--backend", "cpu"], arguments].concat())).unwrap()
    };
    let palm = plan(&[PALM]);
    let running = |bill: &Value| -> Vec<String> {
        let stages = bill["stages"].as_array().unwrap().iter().filter(|stage| stage["runs"] == true);
        stages.map(|stage| stage["stage"].as_str().unwrap().to_owned()).collect()
    };
    assert_eq!(running(&palm), ["calibrate", "contact", "centroid", "orientation"]);
    assert_eq!(palm["bytes_up"].as_u64().unwrap(), 4 * palm["taxels"].as_u64().unwrap());
    // A status, u, v and the orientation; and total, peak and the active taxels, which tell if one taxel is nearly all of a touch.
    assert_eq!(palm["bytes_down"].as_u64().unwrap(), 28 * palm["fields"].as_u64().unwrap());
    assert!(palm["taxels"].as_u64() < palm["of_taxels"].as_u64());
    assert!(palm["us"].as_f64().unwrap() > 0.0 && palm["agrees"] == true);
    assert!(palm["worst_errors"]["centroid"].as_f64().unwrap() < 1e-6);
    let centroid = plan(&["--outputs", "centroid", "--body", "humanoid"]);
    assert_eq!(running(&centroid), ["calibrate", "contact", "centroid"]);
    // Without a source a plan is still a plan.
    assert_eq!(centroid["taxels"], centroid["of_taxels"]);
    let text = done(&["plan", "--body", "humanoid", "--outputs", "centroid", "--backend", "reference"]);
    assert!(text.contains("no output needs it") && text.contains("memberships"), "{text}");
    // Touches are of the whole skin, whatever fields there are.
    let skin = ["--body", "hand", "--fields", "hand/palm", "--outputs", "total,touches", "--backend", "reference"];
    let text = done(&[&["plan"][..], &skin].concat());
    let row = |stage: &str| text.lines().find(|line| line.trim_start().starts_with(stage)).unwrap().to_owned();
    assert!(row("touches").contains(" 40 taxels ") && row("contact").contains(" 1 field "), "{text}");
}

#[test]
fn what_is_measured_of_stages_adds_up_to_the_frame() {
    let bill: Value = serde_json::from_str(&done(&[
        "plan",
        "--json",
        "--backend",
        "cpu",
        "--body",
        "humanoid",
        "--outputs",
        "centroid,orientation",
    ]))
    .unwrap();
    let of_stages = |key: &str| {
        let stages = bill["stages"].as_array().unwrap().iter();
        stages.map(|stage| stage[key].as_f64().unwrap_or(0.0)).sum::<f64>()
    };
    let whole = |key: &str| bill[key].as_f64().unwrap();
    assert_eq!((of_stages("bytes_up"), of_stages("bytes_down")), (whole("bytes_up"), whole("bytes_down")));
    // A stage that seems to take less than nothing is shown as nothing.
    assert!(whole("us") > 0.0 && of_stages("us") >= whole("us") - 0.01, "{bill}");
    // The whole is always measured.
    assert!(fails(2, &["plan", "--estimate"]).contains("--estimate"));
}

#[test]
fn the_schema_that_is_shipped_is_the_one_that_is_printed() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/docs/scene.schema.json");
    let printed = done(&["plan", "--schema"]);
    // To make it: somatic plan --schema > docs/scene.schema.json
    assert_eq!(std::fs::read_to_string(path).unwrap(), printed);
    let schema: Value = serde_json::from_str(&printed).unwrap();
    let documented = include_str!("../../docs/reference/scene.md");
    let keys = schema["properties"].as_object().unwrap();
    for (key, says) in keys {
        assert!(documented.contains(&format!("| `{key}` |")), "docs/reference/scene.md does not tell of `{key}`");
        assert!(says["description"].is_string(), "{key}");
    }
    let accuracy = schema["$defs"]["Accuracy"]["properties"].as_object().unwrap();
    for (key, says) in accuracy {
        assert!(documented.contains(&format!("`{key}`")) && says["description"].is_string(), "{key}");
    }
    // Two tolerances have one flag, and when touches begin and end has none.
    let reported = documented.lines().filter(|line| line.contains("` | `--")).count();
    assert_eq!(reported, keys.len() + accuracy.len() - 2);
    assert!(documented.contains(include_str!("../../examples/scenes/palm.toml")));
}

#[test]
fn a_plan_says_how_far_centroids_are_off_and_what_it_leaves_out() {
    let folder = tempfile::tempdir().unwrap();
    // Taxels 0, 1 and 2 are a row of the palm's board, and 1 is in its middle: pressed alike, 0 and 2 are the farthest;
    // with the row above pressed alike too, four are equally far.
    let path = folder.path().join("tie.csv");
    std::fs::write(&path, "t,0,1,2,3,4,5\n0,5,5,5,0,0,0\n0.1,5,5,5,5,5,5\n0.2,7,3,1,2,9,4\n").unwrap();
    let flags = ["--source", text_of(&path), "--backend", "cpu", "--fields", "hand/palm"];
    let bill: Value = serde_json::from_str(&done(&[&["plan", "--json"][..], &flags].concat())).unwrap();
    let frames_of = |backend: &str| {
        let flags = ["--source", text_of(&path), "--fields", "hand/palm"];
        frames(&done(&[&["run", "--backend", backend][..], &flags].concat()))
    };
    let (right, got) = (frames_of("reference"), frames_of("cpu"));
    let ties = right.iter().filter(|frame| frame["fields"][0]["flags"].to_string().contains("tie")).count();
    assert!((1..3).contains(&ties), "{right:?}");
    assert_eq!(bill["left_out"]["orientation"], ties);
    let place = |frame: &Value| [0, 1].map(|axis| frame["fields"][0]["centroid"][axis].as_f64().unwrap());
    let apart = right.iter().zip(&got).map(|(right, got)| {
        // What is written are the shortest digits that stand for a number in single precision.
        let ([u, v], [got_u, got_v]) = (place(right), place(got).map(|number| f64::from(number as f32)));
        (got_u - u).hypot(got_v - v)
    });
    let apart = apart.fold(0.0, f64::max);
    let reported = bill["worst_errors"]["centroid"].as_f64().unwrap();
    assert!((reported - apart).abs() <= 1e-3 * apart, "{reported} reported, {apart} found");
    let text = done(&[&["plan"][..], &flags].concat());
    assert!(text.contains("° (1 tie left out)") || text.contains(&format!("° ({ties} ties left out)")), "{text}");
}

#[test]
fn a_body_without_taxels_is_sent_to_author_once() {
    // As Blender writes a mesh that never had a skin.
    let folder = tempfile::tempdir().unwrap();
    let body = folder.path().join("arm.gltf");
    let generator = "Khronos glTF Blender I/O v5.0.21";
    let text = format!(r#"{{"asset":{{"version":"2.0","generator":"{generator}"}},"nodes":[{{"name":"arm"}}]}}"#);
    std::fs::write(&body, text).unwrap();
    let csv = folder.path().join("a.csv");
    std::fs::write(&csv, "t,0\n0,1\n").unwrap();
    let (body, csv) = (body.to_str().unwrap(), csv.to_str().unwrap());
    for arguments in [&["run", "--body", body, "--source", csv][..], &["plan", "--body", body]] {
        let said = fails(1, arguments);
        assert_eq!(said.lines().count(), 1, "{said}");
        assert!(said.contains("no taxels") && said.contains("somatic author") && !said.contains("Blender"), "{said}");
    }
}

#[test]
fn a_mesh_in_another_format_says_how_it_becomes_a_body() {
    let folder = tempfile::tempdir().unwrap();
    for (name, text, format) in [
        ("arm.stl", "solid arm\n", "STL"),
        ("arm.STL", "\u{1}binary", "STL"),
        ("arm.obj", "v 0 0 0\n", "OBJ"),
        ("arm.dae", "<?xml version=\"1.0\"?>", "COLLADA"),
        ("arm.ply", "ply\n", "PLY"),
        ("arm.urdf", "<robot name=\"arm\"/>", "URDF"),
    ] {
        let path = folder.path().join(name);
        std::fs::write(&path, text).unwrap();
        let path = path.to_str().unwrap();
        for arguments in [&["inspect", path][..], &["plan", "--body", path]] {
            let said = fails(1, arguments);
            assert!(said.contains(format) && said.contains("somatic author") && said.contains(name), "{said}");
            assert_eq!(said.lines().count(), 1, "{said}");
        }
    }
    // What is a glTF is read, whatever it is called.
    let path = folder.path().join("hand.stl");
    std::fs::write(&path, somatic::bundled::HAND).unwrap();
    done(&["inspect", path.to_str().unwrap()]);
}
