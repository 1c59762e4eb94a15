//! Errors that are to be expected on a layout: `--errors`, and `author --compare`.

use serde_json::{Value, json};

use super::{done, fails, file, files_in, text_of};

const KEYS: [&str; 7] = ["taxels", "spacing", "touch_spacing", "touches", "place", "axis", "force"];

fn keys(value: &Value) -> Vec<&str> {
    value.as_object().unwrap().keys().map(String::as_str).collect()
}

fn median(of: &Value, what: &str) -> f64 {
    of[what]["median"].as_f64().unwrap()
}

#[test]
fn errors_are_printed_beside_those_of_an_ideal_skin() {
    let folder = tempfile::tempdir().unwrap();
    let grid = folder.path().join("grid.glb");
    let grid = text_of(&grid);
    done(&["author", "--grid", "25x25", "--pitch", "10mm", "-o", grid]);
    let text = done(&["inspect", grid, "--errors"]);
    let line = |name: &str| text.lines().find(|line| line.trim_start().starts_with(name)).unwrap_or_default();
    assert!(line("errors").contains(" mm, axis ") && line("errors").contains("of 400 touches"), "{text}");
    assert!(line("ideal").contains("the same on a flat sheet of regular hexagons as dense"), "{text}");
    let reported: Value = serde_json::from_str(&done(&["inspect", grid, "--errors", "--json"])).unwrap();
    let errors = &reported["errors"];
    assert_eq!(keys(errors), [&KEYS[..], &["ideal"]].concat());
    assert_eq!(keys(&errors["ideal"]), KEYS);
    assert_eq!(keys(&errors["place"]), ["touches", "median", "p95"]);
    // Metres, and radians: a square grid is nearly as good as hexagons.
    for what in ["place", "axis", "force"] {
        let ratio = median(errors, what) / median(&errors["ideal"], what);
        assert!((0.7..1.6).contains(&ratio), "{what}: {errors}");
    }
    assert!((5e-5..1e-3).contains(&median(errors, "place")) && median(errors, "axis") < 0.05, "{errors}");
    assert!(!done(&["inspect", grid]).contains("errors"));
}

#[test]
fn two_layouts_are_compared_and_drawn() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let (scattered, even, picture) = (at("scattered.glb"), at("even.glb"), at("errors.svg"));
    let author = ["author", "humanoid", "--taxels", "300", "--json"];
    let made = |more: &[&str]| -> Value { serde_json::from_str(&done(&[&author[..], more].concat())).unwrap() };
    assert!(made(&["--even", "off", "-o", &scattered])["errors"].is_null());
    let reported = made(&["-o", &even, "--errors"]);
    assert_eq!(keys(&reported["errors"]), [&KEYS[..], &["ideal"]].concat());

    let compare = ["author", "--compare", &scattered, &even];
    let compared: Value = serde_json::from_str(&done(&[&compare[..], &["--json", "-o", &picture]].concat())).unwrap();
    assert_eq!(keys(&compared), ["layouts", "same_places", "second_is_nearer"]);
    let layouts = &compared["layouts"];
    for (layout, name) in layouts.as_array().unwrap().iter().zip([&scattered, &even]) {
        assert_eq!(keys(layout), [&KEYS[..], &["ideal", "body", "cells", "frame_s"]].concat());
        assert_eq!((&layout["body"], &layout["taxels"]), (&json!(name), &json!(300)));
        assert!(layout["frame_s"].as_f64().unwrap() > 0.0);
    }
    // The even one is truer, and it shows in the table.
    assert_eq!(compared["same_places"], true);
    assert!(median(&layouts[1], "place") < 0.95 * median(&layouts[0], "place"), "{compared}");
    assert!(compared["second_is_nearer"].as_f64().unwrap() > 0.52, "{compared}");
    let text = done(&compare);
    for words in ["spacing mm", "place mm", "axis °", "force %", "a frame", "B is nearer to the true place in"] {
        assert!(text.contains(words), "{words}: {text}");
    }
    let svg = std::fs::read_to_string(&picture).unwrap();
    for words in ["Errors of simulated touches", "A: scattered.glb", "B: even.glb", "off by, mm", "ideal"] {
        assert!(svg.contains(words), "{words}");
    }
    assert_eq!(files_in(folder.path()), ["errors.svg", "even.glb", "scattered.glb"]);
}

#[test]
fn what_cannot_be_compared_is_one_line() {
    let one = |code: i32, arguments: &[&str], words: &str| {
        let line = fails(code, arguments);
        assert!(line.contains(words) && line.lines().count() == 1, "{arguments:?}: {line}");
    };
    let (_folder, broken) = file("broken.glb", "no body");
    let (_elsewhere, bare) =
        file("bare.gltf", r#"{"asset":{"version":"2.0"},"scenes":[{"nodes":[0]}],"nodes":[{"name":"a"}]}"#);
    one(1, &["author", "--compare", "hand", "/no/such.glb"], "/no/such.glb: no such file");
    one(1, &["author", "--compare", text_of(&broken), "hand"], "broken.glb: ");
    one(1, &["author", "--compare", "hand", text_of(&bare)], "bare.gltf: errors of touches cannot be simulated");
    one(1, &["author", "--compare", "hand", "humanoyd"], "did you mean the bundled body `humanoid`?");
    one(2, &["author", "--compare", "hand", "mat", "-o", "a.glb"], "-o a.glb is neither .svg nor .png");
    one(1, &["inspect", text_of(&bare), "--errors"], "bare.gltf: errors of touches cannot be simulated");
    one(2, &["author", "hand", "--taxels", "9"], "-o BODY.glb");
    one(2, &["author", "--compare", "hand", "mat", "--compare", "hand", "mat"], "--compare takes two bodies");
    for wrong in [&["--compare", "hand"][..], &["--compare", "hand", "mat", "--taxels", "9"]] {
        assert!(fails(2, &[&["author"], wrong].concat()).contains("--compare"));
    }
}
