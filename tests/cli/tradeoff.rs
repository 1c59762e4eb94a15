//! The trade of speed against accuracy, at the process boundary.

use std::path::Path;
use std::process::Output;

use serde_json::Value;

use crate::{fails, somatic};

const ROD: &str = concat!("sim:", env!("CARGO_MANIFEST_DIR"), "/examples/simulations/rod.toml");

/// What the program does with a cache of its own in `folder`.
fn with_cache(folder: &Path, arguments: &[&str]) -> Output {
    somatic(arguments).env("XDG_CACHE_HOME", folder.join("cache")).output().unwrap()
}

fn done(folder: &Path, arguments: &[&str]) -> (String, String) {
    let output = with_cache(folder, arguments);
    let texts = [output.stdout, output.stderr].map(|bytes| String::from_utf8(bytes).unwrap());
    assert!(output.status.success(), "{arguments:?}: {}", texts[1]);
    let [out, err] = texts;
    (out, err)
}

/// Few frames, little time, and no backend but the CPU's: as much as a test needs.
const BRIEF: [&str; 4] = ["--seconds", "0.2", "--frames", "60"];

fn scene(folder: &Path, text: &str) -> String {
    let path = folder.join("scene.toml");
    std::fs::write(&path, text).unwrap();
    path.display().to_string()
}

#[test]
fn a_simulation_is_held_against_its_truth_and_drawn() {
    let folder = tempfile::tempdir().unwrap();
    let plot = folder.path().join("rod.svg").display().to_string();
    let rest = ["--source", ROD, "--backend", "cpu", "--json", "--plot", &plot, "--fields", "hand/back"];
    let (out, _) = done(folder.path(), &[&["tradeoff"][..], &BRIEF, &rest].concat());
    let report: Value = serde_json::from_str(&out).unwrap();
    let rows = report["rows"].as_array().unwrap();
    assert!(report["truth"] == true && rows.iter().any(|row| row["front"] == true));
    for row in rows {
        // A rod over taxels centimetres apart: far from the truth by far more than by any arithmetic.
        let truth = row["truth"]["place_mm"]["rms"].as_f64().unwrap();
        assert!(truth > 0.01 && truth < 20.0, "{row}");
        assert!(row["truth"]["orientation_deg"]["compared"].as_u64().unwrap() > 0, "{row}");
    }
    let ways = |way: &str| rows.iter().filter(|row| row["orientation_by"] == way).count();
    assert_eq!(ways("two-points"), ways("second-moments"));
    let svg = std::fs::read_to_string(plot).unwrap();
    assert!(svg.contains("from the truth") && svg.contains("fit-2") && svg.matches("<circle").count() > 2 * 2 * 5);
}

#[test]
fn a_pick_is_written_into_the_scene_used_and_reported() {
    let folder = tempfile::tempdir().unwrap();
    let text =
        "# What I want.\noutputs = [\"centroid\", \"orientation\"] # no more\n\n[accuracy]\ncentroid = \"5 mm\"\n";
    let path = scene(folder.path(), text);
    let (_, said) = done(folder.path(), &[&["tradeoff", &path, "--write"][..], &BRIEF].concat());
    assert!(said.contains("picked (live) for 5 mm"), "{said}");
    let written = std::fs::read_to_string(&path).unwrap();
    assert!(written.contains("# What I want.") && written.contains("# no more"), "{written}");
    assert!(written.contains("backend = ") && !written.contains("centroid = "), "{written}");
    // What was measured is kept, and a plan of the unchanged scene reports it.
    let path = scene(folder.path(), text);
    let (plan, said) = done(folder.path(), &["plan", &path, "--json"]);
    let plan: Value = serde_json::from_str(&plan).unwrap();
    assert!(plan["measured"].as_str().unwrap().contains("touches simulated on it"), "{plan}");
    assert!(plan["why"].as_str().unwrap().contains("picked for 5 mm"), "{plan}");
    assert!(said.is_empty(), "{said}");
    // Damage is reported in a line, and it is measured anew.
    let kept: Vec<_> = std::fs::read_dir(folder.path().join("cache/somatic/tradeoff")).unwrap().collect();
    let [kept] = &kept[..] else { panic!("{kept:?}") };
    std::fs::write(kept.as_ref().unwrap().path(), "{").unwrap();
    let (_, said) = done(folder.path(), &["plan", &path, "--json"]);
    assert!(said.contains("damaged; measured anew") && said.lines().count() == 1, "{said}");
}

#[test]
fn a_body_alone_is_measured_on_touches_that_are_simulated_on_it() {
    let folder = tempfile::tempdir().unwrap();
    let asked = ["tradeoff", "--fields", "hand/back", "--backend", "cpu"];
    let brief = ["--seconds", "0.2", "--frames", "200"];
    let (out, _) = done(folder.path(), &[&asked[..], &brief].concat());
    for said in ["from the truth: 2", "touches simulated on it", "that have a fit", "fit-1", "second-moments"] {
        assert!(out.contains(said), "{said}: {out}");
    }
    // What only a fit reaches, and what a fit is too slow for.
    let pick = |target: &[&str]| done(folder.path(), &[&asked[..], &brief, target].concat()).1;
    let said = pick(&["--within", "1.2 mm, 6 deg"]);
    assert!(said.contains("fit") && said.contains("absent for the others"), "{said}");
    let live_us = |by: &str| -> f64 {
        let row = out.lines().find(|line| line.trim_end().ends_with(by)).unwrap();
        row.split_whitespace().next().unwrap().parse().unwrap()
    };
    let between = (live_us("second-moments") * live_us("fit-1")).sqrt();
    let said = pick(&["--budget", &format!("{between:.2}us")]);
    assert!(said.contains("second-moments") && said.contains("of the truth"), "{said}");
}

#[test]
fn what_nothing_reaches_is_reported_with_by_how_much() {
    let folder = tempfile::tempdir().unwrap();
    let rest = ["tradeoff", "--source", ROD, "--fields", "hand/back", "--backend", "cpu", "--within", "0.1 um"];
    let output = with_cache(folder.path(), &[&rest[..], &BRIEF].concat());
    let said = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(1), "{said}");
    assert!(said.contains("no options meet 0.0001 mm; nearest is ") && said.contains(" times 0.0001 mm"), "{said}");
    let path = scene(folder.path(), "backend = \"cpu\"\n[accuracy]\nbudget = \"1 ns\"\n");
    let output = with_cache(folder.path(), &["run", &path, "--quiet"]);
    let said = String::from_utf8(output.stderr).unwrap();
    assert!(output.status.code() == Some(1) && said.contains("no options meet 0.001 us"), "{said}");
}

#[test]
fn contradictions_are_found_where_they_stand() {
    let folder = tempfile::tempdir().unwrap();
    for (text, place, what) in [
        ("[accuracy]\ncentroid = \"0.5 mm\"\narithmetic = \"compensated\"\n", "line 3, column 1", "one or the other"),
        ("backend = \"gpu\"\n[accuracy]\narithmetic = \"double\"\n", "line 3, column 1", "no double precision"),
        ("backend = \"reference\"\n[accuracy]\narithmetic = \"one-pass\"", "line 3, column 1", "always double"),
        ("backend = \"gpu\"\n[accuracy]\n  coverage = \"touched\"", "line 3, column 3", "only backend `cpu`"),
        ("outputs = [\"total\"]\n[accuracy]\norientation = \"2 deg\"", "line 3, column 1", "add one of them"),
        ("[accuracy]\ncentroid = \"0.5\"", "line 2, column 12", "is not a length"),
        ("[accuracy]\ncharts = \"geodesik\"", "line 2, column 10", "did you mean `geodesic`?"),
        ("[accuracy]\ncentriod = \"1 mm\"", "line 2, column 1", "did you mean `centroid`?"),
    ] {
        let line = fails(2, &["run", &scene(folder.path(), text)]);
        assert!(line.contains(place) && line.contains(what) && line.lines().count() == 1, "{text}: {line}");
    }
    assert!(fails(2, &["tradeoff", "--write", "--within", "1 mm"]).contains("name one"));
    assert!(fails(2, &["tradeoff", "--plot", "a.gif"]).contains("neither .svg nor .png"));
    assert!(fails(2, &["tradeoff", "--source", "-"]).contains("a recording or a simulation"));
}

#[cfg(feature = "gpu")]
#[test]
fn a_software_gpu_is_measured_only_if_it_is_asked_for() {
    let adapters = somatic::internal::backend::gpu::adapters();
    if adapters.is_empty() || adapters.iter().any(|adapter| adapter.kind != "software") {
        return somatic_testing::skip("SOFTWARE_GPU", "there is no software GPU, or a real one beside it");
    }
    let folder = tempfile::tempdir().unwrap();
    let (text, _) = done(folder.path(), &["tradeoff", "--seconds", "0.05", "--frames", "30", "--json"]);
    let report: Value = serde_json::from_str(&text).unwrap();
    let rows = report["rows"].as_array().unwrap();
    assert!(!rows.is_empty() && rows.iter().all(|row| row["backend"] != "gpu"), "{text}");
    let left_out = report["left_out"].to_string();
    assert!(left_out.contains("computes on the same CPU; ask for it with --backend gpu"), "{left_out}");
}

#[test]
fn what_was_measured_counts_for_its_recording_and_for_what_is_live() {
    let folder = tempfile::tempdir().unwrap();
    let touch = folder.path().join("touch.csv");
    std::fs::write(&touch, somatic::bundled::TOUCH).unwrap();
    let named = ["--source", touch.to_str().unwrap()];
    let outputs = ["--outputs", "centroid"];
    done(folder.path(), &[&["tradeoff"][..], &BRIEF, &named, &outputs].concat());
    let said = |source: &[&str]| done(folder.path(), &[&["run"][..], source, &outputs].concat()).1;
    let by_measurement = "the fastest of these options, as measured on 20";
    for source in [&named[..], &["--source", "-"]] {
        let said = said(source);
        assert!(said.contains(by_measurement) && said.contains("touch.csv"), "{source:?}: {said}");
    }
    // The bundled touch is the same frames, but who knows that.
    let other = said(&[]);
    assert!(other.contains("somatic: backend ") && !other.contains("touch.csv"), "{other}");
    // So with a tolerance: it is measured again, and on what is run.
    let plan = ["plan", "--json", "--within", "5 mm", "--outputs", "centroid"];
    let (bill, _) = done(folder.path(), &plan);
    assert!(bill.contains("briefly, just now, on bundled touch"), "{bill}");
    let (bill, _) = done(folder.path(), &[&plan[..], &named].concat());
    assert!(bill.contains("picked for 5 mm, as measured on 20") && bill.contains("touch.csv"), "{bill}");
    // A recording that has changed is another.
    std::fs::write(&touch, "t,4\n0,1\n0.1,2\n").unwrap();
    assert!(!said(&named).contains(by_measurement));
}
