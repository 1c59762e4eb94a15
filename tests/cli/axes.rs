//! Taxels with three axes in every file: their three values come back to the bit, by the names `4`, `4.u` and `4.v`.

use std::collections::BTreeSet;
use std::fs;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::Stdio;

use serde_json::Value;

use super::{done, fails, frames, output, stderr, text_of};

/// Odd numbers that text and single precision have to the bit; `None` is missing.
fn value(frame: usize, at: usize) -> Option<f32> {
    let odd = (0.1_f32 * (frame * 7 + at) as f32).sin() * 10_f32.powi(at as i32 % 5);
    (!(frame == 2 && at == 4)).then_some(odd)
}

/// Messages with four taxels, whose three values follow each other, and a map of them.
fn messages(folder: &Path) -> [PathBuf; 2] {
    let (lines, map) = (folder.join("messages.ndjson"), folder.join("map.toml"));
    let text: String = (0..5)
        .map(|frame| {
            let values: Vec<String> =
                (0..12).map(|at| value(frame, at).map_or("null".to_owned(), |value| value.to_string())).collect();
            format!("{{\"t\":{},\"a\":[{}]}}\n", frame as f64 * 0.01, values.join(","))
        })
        .collect();
    fs::write(&lines, text).unwrap();
    fs::write(&map, "values = \"a\"\naxes = \"nuv\"\ngrid = \"2x2\"\npitch = \"5mm\"\n").unwrap();
    [lines, map]
}

/// The columns of a table by their heads.
fn table(path: &Path) -> Vec<(String, Vec<Option<f32>>)> {
    let text = fs::read_to_string(path).unwrap();
    let mut rows = text.lines().map(|line| line.split(',').collect::<Vec<_>>());
    let mut columns: Vec<(String, Vec<Option<f32>>)> =
        rows.next().unwrap().iter().map(|head| ((*head).to_owned(), Vec::new())).collect();
    for row in rows {
        columns.iter_mut().zip(row).for_each(|((_, column), cell)| column.push(cell.parse().ok()));
    }
    columns.sort_by(|a, b| a.0.cmp(&b.0));
    columns
}

#[test]
fn three_values_survive_tables_recordings_and_lines_to_the_bit() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    let [lines, map] = messages(folder.path());
    let source = format!("ndjson:{}", lines.display());
    let with_map = ["--map", text_of(&map)];
    for to in ["a.csv", "a.mcap", "pad.glb"] {
        done(&[&["convert", &source, text_of(&path(to))][..], &with_map].concat());
    }
    done(&["convert", text_of(&path("a.mcap")), text_of(&path("b.csv"))]);
    done(&["convert", text_of(&path("b.csv")), text_of(&path("c.mcap"))]);
    done(&["convert", text_of(&path("c.mcap")), text_of(&path("c.csv"))]);
    let first = table(&path("a.csv"));
    let heads: Vec<&str> = first.iter().map(|(head, _)| head.as_str()).collect();
    assert_eq!(heads, ["0", "0.u", "0.v", "1", "1.u", "1.v", "2", "2.u", "2.v", "3", "3.u", "3.v", "t"]);
    for (place, (_, column)) in first[..12].iter().enumerate() {
        let bits = |values: &[Option<f32>]| values.iter().map(|value| value.map(f32::to_bits)).collect::<Vec<_>>();
        let sent: Vec<Option<f32>> = (0..5).map(|frame| value(frame, place)).collect();
        assert_eq!(bits(column), bits(&sent), "{}", first[place].0);
    }
    assert_eq!(table(&path("b.csv")), first);
    assert_eq!(table(&path("c.csv")), first);
    // As frames of NDJSON, with the three values as an array or by their names.
    let line = |frame: usize, by_name: bool| {
        let word = |at: usize| value(frame, at).map_or("null".to_owned(), |value| value.to_string());
        let taxel = |id: usize| match by_name {
            true => {
                format!("\"{id}.v\":{},\"{id}\":{},\"{id}.u\":{}", word(3 * id + 2), word(3 * id), word(3 * id + 1))
            }
            false => format!("\"{id}\":[{},{},{}]", word(3 * id), word(3 * id + 1), word(3 * id + 2)),
        };
        format!(
            "{{\"t\":{},\"values\":{{{}}}}}\n",
            frame as f64 * 0.01,
            (0..4).map(taxel).collect::<Vec<_>>().join(",")
        )
    };
    for (name, by_name) in [("arrays.ndjson", false), ("names.ndjson", true)] {
        fs::write(path(name), (0..5).map(|frame| line(frame, by_name)).collect::<String>()).unwrap();
    }
    let asked = [
        "--body",
        text_of(&path("pad.glb")),
        "--backend",
        "reference",
        "--all-fields",
        "--outputs",
        "total,shear,friction",
    ]
    .map(str::to_owned);
    let run = |source: &str| {
        let asked: Vec<&str> = asked.iter().map(String::as_str).collect();
        done(&[&["run", "--source", source][..], &asked].concat())
    };
    let percepts = run(&source_of(&path("a.csv")));
    assert!(percepts.contains("\"shear\":["), "{percepts}");
    for name in ["a.mcap", "c.mcap", "c.csv", "arrays.ndjson", "names.ndjson"] {
        assert_eq!(run(&source_of(&path(name))), percepts, "{name}");
    }
    let recorded = format!("mcap:{}", path("d.mcap").display());
    let asked: Vec<&str> = asked.iter().map(String::as_str).collect();
    done(&[&["run", "--source", &source_of(&path("a.csv")), "--sink", &recorded][..], &asked].concat());
    done(&["convert", text_of(&path("d.mcap")), text_of(&path("d.csv"))]);
    assert_eq!(table(&path("d.csv")), first);
}

fn source_of(path: &Path) -> String {
    path.display().to_string()
}

/// Runs the command with `lines` as its standard input.
fn fed(lines: &str, arguments: &[&str]) -> (String, String) {
    let mut child =
        super::somatic(arguments).stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    child.stdin.take().unwrap().write_all(lines.as_bytes()).unwrap();
    let done = child.wait_with_output().unwrap();
    assert!(done.status.success(), "{}", stderr(&done));
    (String::from_utf8_lossy(&done.stdout).into_owned(), stderr(&done))
}

#[test]
fn lines_of_text_name_axes_by_a_header_or_by_flags() {
    let asked = ["--backend", "reference", "--all-fields", "--outputs", "total,shear"];
    let rows = "1.5,2,0.5,3,1,-1\n1.25,4,0.5,3,1,-1\n".repeat(8);
    let (by_header, said) = fed(
        &format!("4,4.u,4.v,7,7.u,7.v\n{rows}"),
        &[&["run", "--source", "text:-", "--rate", "100"][..], &asked].concat(),
    );
    assert!(said.contains("a row of 2 sensors") && by_header.contains("\"shear\":["), "{said}");
    let ids = ["run", "--source", "text:-", "--rate", "100", "--ids", "4,4.u,4.v,7,7.u,7.v"];
    assert_eq!(fed(&rows, &[&ids[..], &asked].concat()).0, by_header);
    let why = fails(2, &["run", "--source", "text:-", "--ids", "4,4.w"]);
    assert!(why.contains("4,4.u,4.v"), "{why}");
}

#[test]
fn an_axis_that_a_body_does_not_have_is_named_as_people_write_it() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.csv");
    fs::write(&path, "t,0,0.u\n0,1,2\n").unwrap();
    let run = output(&["run", "--body", "hand", "--source", text_of(&path)]);
    let why = stderr(&run);
    assert!(!run.status.success() && why.contains("0.u") && !why.contains("33554432"), "{why}");
}

#[test]
fn clouds_of_a_bag_have_what_every_kind_of_taxel_reads() {
    let folder = tempfile::tempdir().unwrap();
    let bag = format!("ros2-mcap:{}", folder.path().join("bag").display());
    let asked = ["run", "--body", "sensing-hand", "--backend", "reference", "--all-fields", "--sink", "-"];
    let lines = frames(&done(&[&asked[..], &["--sink", &bag]].concat()));
    let calibration = concat!(env!("CARGO_MANIFEST_DIR"), "/bodies/sensing-hand.toml");
    let again = frames(&done(&[&asked[..], &["--source", &bag, "--calibration", calibration]].concat()));
    assert!(lines.len() > 100 && lines.len() == again.len(), "{} and {}", lines.len(), again.len());
    let percepts = |frame: &Value| frame["fields"].as_array().unwrap().clone();
    let mut seen = BTreeSet::new();
    for (sent, read) in lines.iter().zip(&again) {
        for (sent, read) in percepts(sent).iter().zip(&percepts(read)) {
            assert_eq!(sent, read, "at {}", sent["t"]);
            let known = ["shear_vector", "friction", "temperature", "nearest"].map(|key| sent.get(key).map(|_| key));
            seen.extend(known.into_iter().flatten());
        }
    }
    assert_eq!(seen.len(), 4, "{seen:?}");
    // A taxel without one of its values says so there, too, and no other value is in its place.
    let body = folder.path().join("pad.glb");
    let touch = folder.path().join("touch.csv");
    fs::write(&touch, "t,0,0.u,0.v,1,1.u,1.v\n0,5,1,2,4,,3\n0.1,5,1,2,4,2,3\n").unwrap();
    let [messages, map] = messages(folder.path());
    let from = ["convert", "--map", text_of(&map), text_of(&messages), text_of(&body)];
    done(&from);
    let bag = format!("ros2-mcap:{}", folder.path().join("gaps").display());
    let asked = ["run", "--body", text_of(&body), "--backend", "reference", "--all-fields", "--sink", "-", "--outputs"];
    let asked = [&asked[..], &["total,shear,shear_vector"]].concat();
    let lines = frames(&done(&[&asked[..], &["--source", text_of(&touch), "--sink", &bag]].concat()));
    let again = frames(&done(&[&asked[..], &["--source", &bag]].concat()));
    let shear = |frame: &Value| {
        let all = percepts(frame);
        all.into_iter().find(|percept| percept["letter"] == "shear").unwrap()
    };
    for (sent, read) in lines.iter().zip(&again) {
        assert_eq!(shear(sent), shear(read));
    }
    assert!(shear(&lines[0])["flags"].to_string().contains("incomplete"), "{}", shear(&lines[0]));
    assert_ne!(shear(&lines[0])["shear_vector"], shear(&lines[1])["shear_vector"]);
}

#[test]
fn a_recording_of_lines_or_messages_has_the_body_that_was_made_for_them() {
    let folder = tempfile::tempdir().unwrap();
    let [lines, map] = messages(folder.path());
    let (of_map, of_lines) = (folder.path().join("map.mcap"), folder.path().join("lines.mcap"));
    let asked = ["--backend", "reference", "--all-fields", "--outputs", "total,shear_vector", "--sink", "-"];
    let sink = |path: &Path| format!("mcap:{}", path.display());
    let source = format!("ndjson:{}", lines.display());
    let by_map = ["run", "--source", &source, "--map", text_of(&map), "--sink", &sink(&of_map)];
    let percepts = done(&[&by_map[..], &asked].concat());
    let again = |path: &Path| done(&[&["run", "--source", text_of(path)][..], &asked].concat());
    assert!(percepts.contains("shear_vector") && again(&of_map) == percepts);
    let rows = "4,4.u,4.v,7,7.u,7.v\n1.5,2,0.5,3,1,-1\n1.25,4,0.5,3,1,-1\n";
    let by_lines = ["run", "--source", "text:-", "--rate", "100", "--sink", &sink(&of_lines)];
    let (percepts, said) = fed(rows, &[&by_lines[..], &asked].concat());
    assert_eq!(said.matches("a body is made").count(), 1, "{said}");
    assert!(percepts.contains("shear_vector") && again(&of_lines) == percepts);
    // The recording has it itself: without, the frames are of no bundled body.
    assert!(done(&["info", text_of(&of_lines)]).contains("text (model/gltf-binary"));
}
