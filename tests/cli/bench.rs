//! `somatic bench`: its figures, and its dump against the equations written out here.

use std::collections::BTreeSet;
use std::f64::consts::PI;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Duration;

use serde_json::Value;

use super::{code_of, done, fails, files_in, frames, somatic, stderr, text_of};

const SMALL: [&str; 9] = ["bench", "--sensors", "60", "--fields", "8", "--members", "5", "--calls", "5"];

fn with<'a>(more: &[&'a str]) -> Vec<&'a str> {
    [&SMALL[..], more].concat()
}

/// An array of little-endian numbers as NumPy's format has it: shape, dtype and numbers.
fn array(folder: &Path, index: &Value, name: &str) -> (Vec<usize>, String, Vec<f64>) {
    let about = &index["arrays"][name];
    let bytes = std::fs::read(folder.join(about["file"].as_str().unwrap())).unwrap();
    assert_eq!(&bytes[..8], b"\x93NUMPY\x01\x00");
    let end = 10 + usize::from(u16::from_le_bytes([bytes[8], bytes[9]]));
    let header = std::str::from_utf8(&bytes[10..end]).unwrap();
    let shape = header.split_once("'shape': (").unwrap().1.split_once(')').unwrap().0;
    let shape: Vec<usize> = shape.split(',').filter(|s| !s.is_empty()).map(|s| s.trim().parse().unwrap()).collect();
    let dtype = header.split_once("'descr': '").unwrap().1.split_once('\'').unwrap().0.to_owned();
    assert_eq!((serde_json::json!(shape), serde_json::json!(dtype)), (about["shape"].clone(), about["dtype"].clone()));
    let numbers: Vec<f64> = match dtype.as_str() {
        "<u8" => bytes[end..].chunks(8).map(|b| u64::from_le_bytes(b.try_into().unwrap()) as f64).collect(),
        "<u4" => bytes[end..].chunks(4).map(|b| f64::from(u32::from_le_bytes(b.try_into().unwrap()))).collect(),
        "<f4" => bytes[end..].chunks(4).map(|b| f64::from(f32::from_le_bytes(b.try_into().unwrap()))).collect(),
        "<f8" => bytes[end..].chunks(8).map(|b| f64::from_le_bytes(b.try_into().unwrap())).collect(),
        other => panic!("{name}: {other}"),
    };
    assert_eq!(numbers.len(), shape.iter().product::<usize>(), "{name}");
    assert!(numbers.iter().all(|number| number.is_finite()), "{name}");
    (shape, dtype, numbers)
}

/// Centroid and the two farthest points' line of one cell, and how much farther than the third the second is.
fn by_the_equations(members: &[(f64, [f64; 2])]) -> ([f64; 2], [f64; 2], f64) {
    let total: f64 = members.iter().map(|(p, _)| p).sum();
    let centroid = [0, 1].map(|k| members.iter().map(|(p, uv)| p * uv[k]).sum::<f64>() / total);
    let mut points: Vec<[f64; 2]> = members.iter().map(|(p, uv)| [0, 1].map(|k| p * (uv[k] - centroid[k]))).collect();
    points.sort_by(|a, b| b[0].hypot(b[1]).total_cmp(&a[0].hypot(a[1])));
    let margin = points[1][0].hypot(points[1][1]) - points[2][0].hypot(points[2][1]);
    (centroid, [points[0][0] - points[1][0], points[0][1] - points[1][1]], margin)
}

/// Checks a dump of [`SMALL`] with 20 frames and a wide field against the equations; `u` is the arithmetic's roundoff.
fn check(folder: &Path, u: f64) {
    let index: Value = serde_json::from_slice(&std::fs::read(folder.join("dump.json")).unwrap()).unwrap();
    let all = |name: &str| array(folder, &index, name).2;
    let shape = |name: &str| array(folder, &index, name).0;
    assert_eq!((shape("values"), shape("members"), shape("uv")), (vec![20, 60], vec![8, 5], vec![8, 5, 2]));
    assert_eq!((shape("centroid"), shape("orientation"), shape("present")), (vec![20, 9, 2], vec![20, 9], vec![20, 9]));
    let (values, present) = (all("values"), all("present"));
    assert!(values.iter().all(|v| 0.0 < *v && *v <= 1023.0) && all("weights").iter().all(|w| *w == 1.0));
    let both =
        index["present_bits"]["centroid"].as_f64().unwrap() + index["present_bits"]["orientation"].as_f64().unwrap();
    assert!(present.iter().all(|bits| *bits == both));

    let pairs = |prefix: &str| -> Vec<(usize, [f64; 2])> {
        let uv = all(&format!("{prefix}uv"));
        let members = all(&format!("{prefix}members"));
        members.iter().enumerate().map(|(i, &s)| (s as usize, [uv[2 * i], uv[2 * i + 1]])).collect()
    };
    let (alike, wide) = (pairs(""), pairs("wide_"));
    assert_eq!(wide.iter().map(|pair| pair.0).collect::<BTreeSet<_>>().len(), 60);
    let (centroids, lines) = (all("centroid"), all("orientation"));
    let mut compared = 0;
    for frame in 0..20 {
        for field in 0..9 {
            let of_field = if field < 8 { &alike[5 * field..5 * field + 5] } else { &wide[..] };
            assert_eq!(of_field.iter().map(|m| m.0).collect::<BTreeSet<_>>().len(), of_field.len(), "distinct");
            let members: Vec<(f64, [f64; 2])> =
                of_field.iter().map(|&(sensor, uv)| (values[frame * 60 + sensor], uv)).collect();
            let (centroid, line, margin) = by_the_equations(&members);
            let cell = frame * 9 + field;
            // n products and sums of numbers up to x, a division, and the rounding of what went in.
            let x = members.iter().flat_map(|(_, uv)| uv.map(f64::abs)).fold(0.0, f64::max);
            let bound = (members.len() + 6) as f64 * u * x;
            for k in [0, 1] {
                assert!((centroids[2 * cell + k] - centroid[k]).abs() <= bound, "frame {frame}, field {field}");
            }
            let point_bound = 2.0_f64.sqrt() * 1023.0 * (bound + 8.0 * u * x);
            if margin > 2.0 * point_bound {
                let turned = (lines[cell] - line[1].atan2(line[0])).rem_euclid(PI);
                let off = turned.min(PI - turned);
                assert!(off <= 2.0 * point_bound / line[0].hypot(line[1]) + 8.0 * u * PI, "{frame}, {field}: {off}");
                compared += 1;
            }
        }
    }
    assert!(compared > 150, "{compared}");
}

#[test]
fn a_dump_is_what_the_equations_give() {
    let folder = tempfile::tempdir().unwrap();
    for (backend, u) in [("reference", 0.5 * f64::EPSILON), ("cpu", 0.5 * f64::from(f32::EPSILON))] {
        let out = folder.path().join(backend);
        let pair = ["--outputs", "centroid,orientation", "--backend", backend];
        done(&with(&[&["--frames", "20", "--wide", "60"][..], &pair, &["--dump", text_of(&out)]].concat()));
        check(&out, u);
        assert_eq!(files_in(&out).len(), 12);
    }
    // Double precision's bound is no bound for single precision, or this would test nothing.
    assert!(std::panic::catch_unwind(|| check(&folder.path().join("cpu"), 0.5 * f64::EPSILON)).is_err());
}

#[test]
fn what_is_measured_by_default_is_what_run_computes() {
    let folder = tempfile::tempdir().unwrap();
    let outputs = |more: &[&str]| -> BTreeSet<String> {
        let out = folder.path().join(more.len().to_string());
        done(&with(&[&["--backend", "cpu", "--dump", text_of(&out)], more].concat()));
        let index: Value = serde_json::from_slice(&std::fs::read(out.join("dump.json")).unwrap()).unwrap();
        index["present_bits"].as_object().unwrap().keys().cloned().collect()
    };
    // What a percept has beside its outputs.
    let own = ["field", "link", "contact", "touches", "flags"];
    let percepts = frames(&done(&["run", "--backend", "cpu", "--fields", "hand/back", "--quiet"]));
    let fields = percepts.iter().flat_map(|frame| frame["fields"].as_array().unwrap());
    let keys = fields.flat_map(|field| field.as_object().unwrap().keys().cloned());
    let computed: BTreeSet<String> = keys.filter(|key| !own.contains(&key.as_str())).collect();
    assert_eq!(outputs(&[]), computed);
    let pair = ["centroid", "orientation"].map(str::to_owned);
    assert_eq!(outputs(&["--outputs", "centroid,orientation"]), pair.into());
}

#[test]
fn what_is_absent_in_a_dump_is_marked_and_the_seed_decides_everything() {
    let folder = tempfile::tempdir().unwrap();
    let dump = |name: &str, seed: &str| {
        let out = folder.path().join(name);
        let one = ["bench", "--sensors", "60", "--fields", "8", "--members", "1", "--frames", "2", "--calls", "1"];
        let pair = ["--outputs", "centroid,orientation", "--backend", "cpu"];
        done(&[&one[..], &pair, &["--seed", seed, "--dump", text_of(&out)]].concat());
        out
    };
    let (first, again, other) = (dump("first", "3"), dump("again", "3"), dump("other", "4"));
    let index: Value = serde_json::from_slice(&std::fs::read(first.join("dump.json")).unwrap()).unwrap();
    let all = |name: &str| array(&first, &index, name).2;
    let (centroid, one_taxel) = (&index["present_bits"]["centroid"], &index["flag_bits"]["one_taxel"]);
    assert!(all("present").iter().all(|bits| Some(*bits) == centroid.as_f64()));
    assert!(all("flags").iter().all(|bits| Some(*bits) == one_taxel.as_f64()));
    assert!(all("orientation").iter().all(|angle| *angle == 0.0));
    for name in files_in(&first) {
        let [first, again] = [&first, &again].map(|folder| std::fs::read(folder.join(&name)).unwrap());
        assert!(first == again, "{name}");
    }
    let [values, members] = ["values.npy", "members.npy"]
        .map(|name| std::fs::read(first.join(name)).unwrap() != std::fs::read(other.join(name)).unwrap());
    assert!(values && members);
}

#[test]
fn figures_are_json_for_programs_and_lines_for_people() {
    let text = done(&with(&["--frames", "20", "--backend", "cpu", "--json"]));
    let figures: Value = serde_json::from_str(&text).unwrap();
    let keys: Vec<&String> = figures.as_object().unwrap().keys().collect();
    assert_eq!(keys, ["backend", "adapter", "us_median", "us_p99", "rate"]);
    assert_eq!(figures["backend"], "cpu");
    let [median, p99, rate] = ["us_median", "us_p99", "rate"].map(|key| figures[key].as_f64().unwrap());
    assert!(0.0 < median && median <= p99);
    // The median is printed to a nanosecond, the rate to a membership.
    let memberships = 8.0 * 5.0 * 20.0;
    assert!((rate * median * 1e-6 - memberships).abs() <= rate * 0.5e-9 + median, "{text}");

    let text = done(&with(&["--backend", "reference", "--wide", "7"]));
    let lines: Vec<&str> = text.lines().collect();
    assert_eq!(lines[0], "8 fields of 5 sensors and one of 7, out of 60; 1 frame a call");
    assert!(lines[1].starts_with("reference: ") && lines[2].contains("of 5 calls"), "{text}");
    assert!(lines[3].contains("memberships/s") && lines.len() == 4, "{text}");
}

#[test]
fn letters_are_compared_with_pressures_alone() {
    let letters = "sustained,shear,temperature,proximity";
    let text = done(&with(&["--letters", letters, "--frames", "20", "--backend", "reference", "--json"]));
    let figures: Value = serde_json::from_str(&text).unwrap();
    let keys: Vec<&String> = figures.as_object().unwrap().keys().collect();
    assert_eq!(keys, ["backend", "adapter", "us_median", "us_p99", "rate", "letters", "us_median_pressure"]);
    assert_eq!(figures["letters"].as_array().unwrap().len(), 4);
    let [median, alone, rate] = ["us_median", "us_median_pressure", "rate"].map(|key| figures[key].as_f64().unwrap());
    assert!(median > alone && alone > 0.0, "four letters take longer than one: {text}");
    let memberships = 4.0 * 8.0 * 5.0 * 20.0;
    assert!((rate * median * 1e-6 - memberships).abs() <= rate * 0.5e-9 + median, "{text}");

    let text = done(&with(&["--letters", "sustained,shear", "--backend", "cpu"]));
    let lines: Vec<&str> = text.lines().collect();
    assert_eq!(lines[0], "8 fields of 5 sensors, out of 60; sustained, shear, 1 frame a call");
    assert!(lines.len() == 5 && lines[3].contains("times as long as pressures alone, median "), "{text}");
    // Pressures alone have none of what letters beside them give.
    for outputs in ["shear", "total,shear"] {
        let text = done(&with(&["--letters", "sustained,shear", "--outputs", outputs, "--backend", "cpu"]));
        assert!(text.contains("times as long as pressures alone"), "{text}");
    }
}

#[test]
fn what_cannot_be_measured_is_one_line() {
    let refused = |more: &[&str], word: &str| {
        let error = fails(2, &with(more));
        assert!(error.contains(word), "{more:?}: {error}");
        error
    };
    for (more, word) in [
        (&["--frames", "0"][..], "--frames 0"),
        (&["--wide", "61"], "61 is more than the 60 sensors"),
        (&["--frames", "100000000000"], "GiB of memory"),
        (&["--frames", "18446744073709551615"], "GiB of memory"),
        (&["--outputs", "self_contacts", "--dump", "x"], "self_contacts"),
    ] {
        assert_eq!(refused(more, word).lines().count(), 1);
    }
    refused(&["--letters", "shear", "--outputs", "warmest"], "`warmest` is of letter `temperature`");
    refused(&["--letters", "shaer"], "shear");
    refused(&["--letters", "shear", "--dump", "x"], "--dump");
    refused(&["--outputs", "centriod"], "did you mean `centroid`?");
    refused(&["--backend", "gpo"], "gpu");
    for (more, word) in [
        (["--sensors", "5", "--members", "6"], "--members 6"),
        (["--sensors", "33554432", "--members", "6"], "16777217"),
        (["--sensors", "9000000", "--letters", "shear,temperature"], "18000000 taxels"),
    ] {
        let error = fails(2, &[&["bench"], &more[..]].concat());
        assert!(error.contains(word) && error.lines().count() == 1, "{error}");
    }
    let file = tempfile::NamedTempFile::new().unwrap();
    let error = fails(1, &with(&["--backend", "cpu", "--dump", text_of(file.path())]));
    assert!(error.contains(text_of(file.path())) && error.lines().count() == 1, "{error}");
    assert!(done(&["help", "bench"]).contains("Examples:"));
}

#[test]
#[cfg(unix)]
fn ctrl_c_gives_the_figures_so_far() {
    let arguments = ["bench", "--sensors", "9", "--fields", "1", "--members", "9", "--backend", "cpu", "--json"];
    let mut child = somatic(&[&arguments[..], &["--calls", "4000000000"]].concat())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    std::thread::sleep(Duration::from_secs(1));
    assert!(Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap().success());
    assert_eq!(code_of(&mut child), Some(0));
    let output = child.wait_with_output().unwrap();
    assert!(stderr(&output).contains("stopped after"), "{}", stderr(&output));
    assert!(serde_json::from_slice::<Value>(&output.stdout).unwrap()["us_median"].as_f64().unwrap() > 0.0);
}
