//! `somatic run` without a terminal.

use std::collections::BTreeSet;
use std::io::{BufRead as _, BufReader, Write as _};
use std::process::{Child, ChildStdout, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::time::Duration;

use serde_json::Value;

use super::{code_of, done, fails, file, files_in, frames, output, somatic, stderr, text_of};
use somatic_testing::skip;

/// One taxel of the bundled hand's palm, pressed in two of three frames.
const PRESSED: &str = "t,4\n0,0\n0.1,5\n0.2,7\n";

fn has_adapters() -> bool {
    #[cfg(feature = "gpu")]
    let there = !somatic::internal::backend::gpu::adapters().is_empty();
    #[cfg(not(feature = "gpu"))]
    let there = false;
    if !there {
        skip("GPU", "no adapter answers");
    }
    there
}

/// What kind of adapters there are.
#[cfg_attr(not(feature = "gpu"), expect(dead_code))]
enum Gpus {
    Hardware,
    Software,
    None,
}

fn gpus() -> Gpus {
    #[cfg(feature = "gpu")]
    let kinds: Vec<&str> = somatic::internal::backend::gpu::adapters().iter().map(|adapter| adapter.kind).collect();
    #[cfg(not(feature = "gpu"))]
    let kinds: Vec<&str> = Vec::new();
    match kinds.iter().filter(|kind| **kind != "software").count() {
        0 if kinds.is_empty() => Gpus::None,
        0 => Gpus::Software,
        _ => Gpus::Hardware,
    }
}

fn fields(frame: &Value) -> &Vec<Value> {
    frame["fields"].as_array().unwrap()
}

#[test]
fn without_arguments_the_bundled_touch_comes_out_as_lines_of_json() {
    let output = output(&["run"]);
    assert_eq!(output.status.code(), Some(0));
    assert_eq!(stderr(&output).matches("somatic: backend ").count(), 1, "{}", stderr(&output));
    let text = String::from_utf8(output.stdout).unwrap();
    assert!(!text.contains('\x1b'));
    let frames = frames(&text);
    assert_eq!(frames.len(), somatic::bundled::TOUCH.iter().filter(|&&byte| byte == b'\n').count() - 1);
    let mut keys = BTreeSet::new();
    for (number, frame) in frames.iter().enumerate() {
        assert_eq!(frame["frame"], number);
        assert!(frame["t"].is_number());
        for field in fields(frame) {
            assert_eq!(field["contact"], true);
            keys.extend(field.as_object().unwrap().keys().cloned());
        }
    }
    for key in [
        "field",
        "link",
        "total",
        "peak",
        "active",
        "area",
        "centroid",
        "position",
        "normal",
        "orientation",
        "principal_axis",
        "anisotropy",
        "flags",
    ] {
        assert!(keys.contains(key), "{key} in {keys:?}");
    }
}

#[test]
fn fields_and_outputs_are_those_asked_for() {
    let run = ["run", "--backend", "cpu"];
    let all = done(&[&run[..], &["--all-fields"]].concat());
    assert!(frames(&all).iter().all(|frame| fields(frame).len() == 13));
    assert!(all.contains(r#""contact":false"#));

    let some = done(&[&run[..], &["--all-fields", "--fields", "hand/palm", "--fields", "hand/palm/ulnar*"]].concat());
    let some = frames(&some);
    let named: Vec<&Value> = fields(&some[0]).iter().map(|field| &field["field"]).collect();
    assert_eq!(named, ["hand/palm", "hand/palm/ulnar_distal", "hand/palm/ulnar_proximal"]);
    assert!(fails(2, &[&run[..], &["--fields", "hand/plam"]].concat()).contains("did you mean `hand/palm`?"));

    let one = done(&[&run[..], &["--outputs", "centroid"]].concat());
    assert!(one.contains("centroid") && !one.contains("total") && !one.contains("position"));
    let two = done(&[&run[..], &["--outputs", "total,principal_axis"]].concat());
    assert!(two.contains("total") && two.contains("principal_axis") && !two.contains("centroid"));
}

#[test]
fn backends_give_the_same_percepts() {
    let run = |backend| frames(&done(&["run", "--backend", backend, "--all-fields"]));
    let right = run("reference");
    let mut others = vec![("cpu", run("cpu"))];
    if has_adapters() {
        others.push(("gpu", run("gpu")));
    }
    for (name, got) in others {
        assert_eq!(right.len(), got.len());
        let mut compared = 0;
        for (a, b) in right.iter().zip(&got) {
            for (a, b) in fields(a).iter().zip(fields(b)) {
                assert_eq!((&a["field"], &a["contact"], &a["active"]), (&b["field"], &b["contact"], &b["active"]));
                for key in ["total", "peak"] {
                    if let (Some(a), Some(b)) = (a[key].as_f64(), b[key].as_f64()) {
                        assert!((a - b).abs() <= 1e-5 * a.abs(), "{name}: {key} {a} {b}");
                        compared += 1;
                    }
                }
                if let (Some(a), Some(b)) = (a["centroid"].as_array(), b["centroid"].as_array()) {
                    for (a, b) in a.iter().zip(b) {
                        assert!((a.as_f64().unwrap() - b.as_f64().unwrap()).abs() < 1e-7, "{name}: centroid {a} {b}");
                        compared += 1;
                    }
                }
            }
        }
        assert!(compared > 1000, "{name}: {compared}");
    }
}

#[test]
fn verify_reports_how_the_backend_compares() {
    let output = output(&["run", "--backend", "cpu", "--verify"]);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    let report = stderr(&output);
    let verdict = report.lines().find(|line| line.contains("backend cpu agrees with the reference: of ")).unwrap();
    assert!(verdict.contains(" in 3640 percepts and 202 touches, ") && verdict.ends_with(" not compared"), "{report}");
    assert!(report.contains("orientation"), "{report}");
    assert_eq!(String::from_utf8(output.stdout).unwrap().lines().count(), 280);
}

#[test]
fn a_dead_band_on_a_value_is_too_close_to_call_and_said_so() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    // A tenth of 10 is 1, which is not over 1. A gain that is rounded to single precision is more than a tenth.
    std::fs::write(at("ten.csv"), "t,0,1,2,3,4,5,6,7,8\n0,10,10,10,10,10,10,10,10,10\n").unwrap();
    std::fs::write(at("tenth.toml"), "[all]\ngain = 0.1\ndead_band = 1\n").unwrap();
    let run = |backend: &str, more: &[&str]| {
        let (source, calibration) = (at("ten.csv"), at("tenth.toml"));
        let given = ["run", "--body", "hand", "--source", &source, "--calibration", &calibration, "--all-fields"];
        output(&[&given[..], &["--fields", "hand/palm", "--backend", backend], more].concat())
    };
    let (reference, cpu) = (run("reference", &[]), run("cpu", &["--verify"]));
    assert_eq!((reference.status.code(), cpu.status.code()), (Some(0), Some(0)), "{}", stderr(&cpu));
    for output in [&reference, &cpu] {
        let said = String::from_utf8_lossy(&output.stdout);
        assert!(said.contains("no_contact") && said.contains("\"total\":0.0"), "{said}");
    }
    let report = stderr(&cpu);
    let verdict = report.lines().find(|line| line.contains("backend cpu ")).unwrap();
    // Of the percept's values its flags, contact and sums are all that there are.
    assert_eq!(
        verdict,
        "somatic: backend cpu could not be compared with the reference: of 6 values in 1 percept, 0 agreeing, 0 different, 6 too \
         close to call, 0 not compared"
    );
}

#[test]
fn the_reference_is_not_compared_with_itself() {
    for given in [&["--backend", "reference"][..], &["--arithmetic", "double"]] {
        let output = output(&[&["run", "--verify"], given].concat());
        assert_eq!(output.status.code(), Some(2), "{given:?}: {}", stderr(&output));
        assert!(stderr(&output).contains("--verify would compare the reference with itself"), "{}", stderr(&output));
        assert!(output.stdout.is_empty());
    }
}

#[test]
fn the_cut_into_batches_changes_nothing() {
    let run = |batch| done(&["run", "--backend", "cpu", "--batch", batch]);
    let whole = run("1000");
    assert!(run("1") == whole && run("7") == whole);
}

#[test]
fn what_makes_no_sense_is_wrong_usage() {
    assert!(fails(2, &["run", "--outputs", "centriod"]).contains("did you mean `centroid`?"));
    assert!(
        fails(2, &["run", "--outputs", "banana"]).contains("it is one of active, anisotropy, approach_speed, area")
    );
    assert!(fails(2, &["run", "--nonsense"]).contains("--nonsense"));
    assert!(fails(2, &["run", "--backend", "gpo"]).contains("'gpu'"));
    assert!(fails(2, &["run", "--body", "mat"]).contains("needs a --source"));
    for arguments in [&["run", "--body", "hnad"][..], &["run", "--body", "hnad", "--source", "a.csv"]] {
        assert!(fails(1, arguments).contains("hnad: no such file; did you mean the bundled body `hand`?"));
    }
    assert!(fails(2, &["run", "--source", "a.csv", "--source", "text:a"]).contains("only serial lines"));
    assert!(fails(2, &["run", "--source", "-", "--speed", "2"]).contains("--speed"));
    assert!(fails(2, &["run", "--speed", "0"]).contains("--speed 0"));
    assert!(fails(2, &["run", "--max-age", "nan"]).contains("--max-age"));
    assert!(fails(2, &["run", "--max-age", "5mm"]).contains("`5mm` is not a time; write a number in seconds"));
    assert!(fails(2, &["run", "--live-rate", "5s"]).contains("`5s` is not a rate; write a number in Hz"));
    assert!(fails(2, &["run", "--rate", "9"]).contains("--rate"));
    assert!(fails(2, &["run", "--batch", "0"]).contains("--batch"));
    // What nothing would heed is not passed over in silence.
    assert!(fails(2, &["run", "--columns", "1"]).contains("--columns is for lines of text"));
    assert!(fails(2, &["run", "--grid", "3x2"]).contains("--grid"));
    assert!(fails(2, &["run", "--record", "frames"]).contains("--record is for a recording; add --sink mcap:FILE"));
    assert!(fails(2, &["run", "--sink", "json:x"]).contains("did you mean `ndjson:`?"));
}

#[test]
fn filtered_motion_is_given_where_it_is_asked_for() {
    let run = ["run", "--backend", "cpu", "--fields", "hand/back", "--outputs", "filtered_direction,filtered_speed"];
    let counted = |more: &[&str]| {
        let frames = frames(&done(&[&run[..], more].concat()));
        let having = |key: &str| frames.iter().flat_map(fields).filter(|field| field[key].is_number()).count();
        (having("filtered_direction"), having("filtered_speed"))
    };
    // By steps that are long enough.
    let (directions, speeds) = counted(&["--filter-by", "distance"]);
    assert!(speeds > 20 && directions > speeds, "{directions} {speeds}");
    // Wider steps are fewer.
    let wide = counted(&["--filter-window", "2mm.."]);
    assert!(wide.1 > 2 && wide.1 < speeds / 2 && wide.0 > wide.1, "{wide:?}");
    assert!(counted(&["--filter-by", "radial"]).1 > 20);
    // Over 0.2 s, unless something else is asked for.
    assert_eq!(done(&run), done(&[&run[..], &["--filter-over", "0.2"]].concat()));
    for other in
        [["--filter-by", "distance"], ["--filter-by", "radial"], ["--filter-time", "1"], ["--filter-over", "0.1"]]
    {
        assert_ne!(done(&run), done(&[&run[..], &other].concat()), "{other:?}");
    }

    for (arguments, why) in [
        (&["--filter-time", "nan"][..], "filter time of NaN"),
        (&["--filter-time", "-1"], "filter time of -1"),
        (&["--filter-over", "0"], "motion over 0 s"),
        (&["--filter-over", "0.2", "--filter-by", "radial"], "--filter-by has no effect with --filter-over"),
        (&["--filter-window", "-1mm..2mm"], "from -1 mm"),
        (&["--filter-window", "3mm..2mm"], "the smaller first"),
        (&["--filter-window", "3..4"], "has no unit"),
    ] {
        let error = fails(2, &[&run[..], arguments].concat());
        assert!(error.contains(why) && error.lines().count() == 1, "{error}");
    }
    for flag in [["--filter-time", "1"], ["--filter-window", "1mm.."], ["--filter-by", "radial"]] {
        let error = fails(2, &[&["run", "--backend", "cpu"][..], &flag].concat());
        assert!(error.contains(flag[0]) && error.contains("--outputs filtered_direction"), "{error}");
    }
    assert!(fails(2, &[&run[..], &["--filter-by", "area"]].concat()).contains("radial"));
}

#[test]
fn what_is_not_there_is_named_in_one_line() {
    for arguments in [
        ["run", "--body", "no/such.glb", "--source", "-"],
        ["run", "--source", "no/such.csv", "--backend", "cpu"],
        ["run", "--calibration", "no/such.toml", "--backend", "cpu"],
        ["run", "--sink", "no/such.ndjson", "--backend", "cpu"],
    ] {
        let error = fails(1, &arguments);
        assert!(error.starts_with("somatic: error: no/such."), "{error}");
        assert_eq!(error.lines().count(), 1, "{error}");
    }
    assert!(fails(1, &["inspect", "humanoit"]).contains("did you mean the bundled body `humanoid`?"));
}

#[test]
fn ids_that_the_body_does_not_have_are_reported_with_the_file() {
    let (_folder, path) = file("touch.csv", "t,4,77\n0,1,2\n");
    let error = fails(1, &["run", "--backend", "cpu", "--source", text_of(&path)]);
    let start = format!("somatic: error: {}: header: taxel id 77 is not in the body", path.display());
    assert!(error.starts_with(&start), "{error}");
    let (_folder, path) = file("touch.csv", "t,4,4\n0,1,2\n");
    assert!(fails(1, &["run", "--source", text_of(&path)]).contains("touch.csv: taxel 4 heads columns 2 and 3"));
}

#[test]
fn an_error_midway_leaves_no_output_behind() {
    let (folder, path) = file("touch.csv", "t,4\n0,1\n0.1,2\n0.2\n0.3,4\n");
    let out = folder.path().join("out.ndjson");
    let error = fails(1, &["run", "--backend", "cpu", "--source", text_of(&path), "--sink", text_of(&out)]);
    assert!(error.contains("touch.csv: line 4: 1 values where the header has 2"), "{error}");
    assert_eq!(files_in(folder.path()), ["touch.csv"]);
}

#[test]
fn a_ragged_end_is_a_loss_and_the_rest_is_done() {
    let (folder, path) = file("touch.csv", "t,4,5\n0,1,0\n0.1,2,0\n0.2,3");
    let out = folder.path().join("out.ndjson");
    let lost = fails(3, &["run", "--backend", "cpu", "--source", text_of(&path), "--sink", text_of(&out)]);
    assert!(lost.contains("never processed") && lost.contains("touch.csv: line 4: last row truncated"), "{lost}");
    assert_eq!(frames(&std::fs::read_to_string(&out).unwrap()).len(), 2);
    assert_eq!(files_in(folder.path()), ["out.ndjson", "touch.csv"]);
}

#[test]
fn several_sinks_get_the_same_and_a_rate_stands_in_for_times() {
    let (folder, path) = file("touch.csv", "4\n1\n2\n");
    let out = folder.path().join("out.ndjson");
    let text = done(&[
        "run",
        "--backend",
        "cpu",
        "--source",
        text_of(&path),
        "--rate",
        "10",
        "--sink",
        "-",
        "--sink",
        text_of(&out),
    ]);
    assert_eq!(std::fs::read_to_string(&out).unwrap(), text);
    assert_eq!(frames(&text)[1]["t"], 0.1);
    assert!(fails(2, &["run", "--source", text_of(&path)]).contains("--rate"));
}

#[test]
fn calibration_and_age_reach_the_percepts() {
    let (_folder, calibration) = file("robot.toml", "[all]\nbaseline = 1\ngain = 10\n");
    let (_other, path) = file("touch.csv", "t,4\n0,3\n0.1,\n0.9,\n");
    let run = ["run", "--backend", "cpu", "--all-fields", "--fields", "hand/palm", "--source", text_of(&path)];
    let totals = |more: &[&str]| -> Vec<f64> {
        let frames = frames(&done(&[&run[..], more].concat()));
        frames.iter().map(|frame| frame["fields"][0]["total"].as_f64().unwrap_or(0.0)).collect()
    };
    assert_eq!(totals(&["--calibration", text_of(&calibration)]), [20.0, 0.0, 0.0]);
    assert_eq!(totals(&["--max-age", "0.5"]), [3.0, 3.0, 0.0]);
    assert_eq!(totals(&["--max-age", "500ms"]), totals(&["--max-age", "0.5"]));
}

#[test]
fn the_circuits_signal_is_chosen_for_a_run() {
    let text = "[all]\nsensor = \"fsr\"\nsignal = \"linear\"\nwiper = 60\n";
    let (_folder, calibration) = file("robot.toml", text);
    let (_other, path) = file("touch.csv", "t,4\n0,1023\n0.1,600\n0.2,0\n");
    let run = ["run", "--backend", "cpu", "--all-fields", "--fields", "hand/palm", "--source", text_of(&path)];
    let totals = |more: &[&str]| -> Vec<f64> {
        let arguments = [&run[..], &["--calibration", text_of(&calibration)], more].concat();
        frames(&done(&arguments)).iter().map(|frame| frame["fields"][0]["total"].as_f64().unwrap()).collect()
    };
    let sensor = somatic::signal::FsrCircuit { wiper: 60 };
    let [raw, linear] = [sensor.logarithmic(600), sensor.linearised(600, 10.0)].map(|p| f64::from(p as f32));
    let near = |totals: Vec<f64>, p: f64| {
        assert_eq!((totals[0], totals[2]), (0.0, 1000.0));
        assert!((totals[1] - p).abs() < 1e-3 * p, "{totals:?} {p}");
    };
    near(totals(&[]), linear);
    near(totals(&["--signal", "linear"]), linear);
    near(totals(&["--signal", "raw"]), raw);
    assert!(raw > 2.0 * linear, "{raw} {linear}");
    assert!(fails(2, &[&run[..], &["--signal", "raw"]].concat()).contains("signal `raw` is for sensors of kind `fsr`"));
    assert!(fails(2, &[&run[..], &["--signal", "log"]].concat()).contains("--signal"));
}

#[test]
fn a_calibration_for_another_body_is_refused_by_name() {
    let (_folder, calibration) = file("robot.toml", "body = \"mat\"\n[taxel.4]\ngain = 2\n");
    let error = fails(1, &["run", "--backend", "cpu", "--calibration", text_of(&calibration)]);
    let start =
        format!("somatic: error: {}: the calibration is for body `mat`, and this is `hand`", calibration.display());
    assert!(error.starts_with(&start) && error.lines().count() == 1, "{error}");
}

#[test]
fn speed_is_kept() {
    let (_folder, path) = file("touch.csv", PRESSED);
    let start = std::time::Instant::now();
    done(&["run", "--backend", "cpu", "--source", text_of(&path), "--speed", "0.4"]);
    let seconds = start.elapsed().as_secs_f64();
    assert!((0.5..5.0).contains(&seconds), "{seconds}");
}

#[test]
fn a_reader_that_goes_ends_the_run_in_silence() {
    for arguments in [&["run", "--backend", "cpu", "--all-fields"][..], &["inspect", "humanoid", "--json"]] {
        let mut child = somatic(arguments).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
        let mut reader = BufReader::new(child.stdout.take().unwrap());
        reader.fill_buf().unwrap();
        drop(reader);
        assert_eq!(code_of(&mut child), Some(0));
        assert_eq!(stderr(&child.wait_with_output().unwrap()), "");
    }
}

/// A run that reads from a pipe, and the lines it has written.
struct Piped {
    child: Child,
    lines: Receiver<String>,
}

impl Piped {
    fn start(arguments: &[&str]) -> Self {
        let mut command = somatic(&["run", "--backend", "cpu", "--source", "-"]);
        let mut child = command
            .args(arguments)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let (sender, lines) = channel();
        let stdout: ChildStdout = child.stdout.take().unwrap();
        std::thread::spawn(move || {
            BufReader::new(stdout).lines().map_while(Result::ok).try_for_each(|line| sender.send(line))
        });
        Self { child, lines }
    }

    fn send(&mut self, line: &str) {
        writeln!(self.child.stdin.as_mut().unwrap(), "{line}").unwrap();
    }

    /// The next line, which must come while the pipe stays open.
    fn line(&self) -> Value {
        let line = self.lines.recv_timeout(Duration::from_secs(20)).expect("a line at once");
        serde_json::from_str(&line).unwrap()
    }
}

#[test]
fn every_live_frame_is_answered_at_once() {
    let mut run = Piped::start(&[]);
    for number in 0..5 {
        run.send(&format!(r#"{{"t":{number},"values":{{"4":{}}}}}"#, number + 1));
        let answer = run.line();
        assert_eq!(answer["frame"], number);
        assert_eq!(answer["fields"][0]["total"].as_f64(), Some(f64::from(number + 1)));
    }
    drop(run.child.stdin.take());
    assert_eq!(code_of(&mut run.child), Some(0));
}

#[test]
fn a_pose_puts_positions_into_the_world() {
    let mut run = Piped::start(&["--fields", "hand/palm"]);
    run.send(r#"{"t":0,"values":{"4":1}}"#);
    run.send(r#"{"t":1,"values":{"4":1},"pose":{"hand":[10,20,30,0,0,0,1]}}"#);
    let (still, posed) = (run.line(), run.line());
    let place = |line: &Value| -> Vec<f64> {
        line["fields"][0]["position"].as_array().unwrap().iter().map(|x| x.as_f64().unwrap()).collect()
    };
    assert_eq!((&still["fields"][0]["link"], &posed["fields"][0]["link"]), (&"hand".into(), &"world".into()));
    for (axis, offset) in [10.0, 20.0, 30.0].into_iter().enumerate() {
        assert!((place(&posed)[axis] - place(&still)[axis] - offset).abs() < 1e-9);
    }
    drop(run.child.stdin.take());
    assert_eq!(code_of(&mut run.child), Some(0));
}

#[test]
fn a_bad_live_frame_names_its_line_and_keeps_what_was_answered() {
    let mut run = Piped::start(&[]);
    run.send(r#"{"t":0,"values":{"4":1}}"#);
    run.line();
    run.send(r#"{"t":0,"values":{"5":oops}}"#);
    assert_eq!(code_of(&mut run.child), Some(1));
    let error = stderr(&run.child.wait_with_output().unwrap());
    assert!(error.starts_with("somatic: error: stdin: line 2"), "{error}");
}

#[test]
fn letters_and_signals_are_reported_where_there_are_several() {
    let (_folder, path) = file("touch.csv", "t,4\n0,0\n0.1,5\n0.2,5\n0.3,0\n");
    let run = ["run", "--quiet", "--backend", "cpu", "--source", text_of(&path), "--fields", "hand/palm"];
    let seen = |more: &[&str]| -> Vec<Vec<String>> {
        let text = done(&[&run[..], &["--outputs", "total"], more].concat());
        let reported = |field: &Value| format!("{} {} {}", field["letter"], field["signal"], field["total"]);
        frames(&text).iter().map(|frame| fields(frame).iter().map(reported).collect()).collect()
    };
    let plain = seen(&[]);
    assert_eq!(plain[1], ["null null 5.0"]);
    assert_eq!(seen(&["--letters", "sustained"]), plain);
    let both = seen(&["--letters", "sustained,change"]);
    assert_eq!(both[1], [r#""sustained" null 5.0"#, r#""change" null 50.0"#]);
    assert_eq!((&both[0][..], &both[2][..]), (&[][..], &[r#""sustained" null 5.0"#.to_owned()][..]));
    assert!(both[3].len() == 1 && both[3][0].starts_with(r#""change" null 5"#), "{both:?}");
    assert_eq!(seen(&["--letters", "change"])[2].len(), 0);

    let (_keep, fsr) = file("fsr.toml", "[all]\nsensor = \"fsr\"\n");
    let signals = seen(&["--calibration", text_of(&fsr), "--signal", "raw,linear"]);
    assert!(signals[1].len() == 2 && signals[1][0].starts_with(r#"null "raw""#), "{signals:?}");
    assert!(signals[1][1].starts_with(r#"null "linear""#), "{signals:?}");
    let one = seen(&["--calibration", text_of(&fsr), "--signal", "raw"]);
    assert!(one[1].len() == 1 && one[1][0].starts_with("null null"), "{one:?}");

    assert!(fails(2, &[&run[..], &["--letters", "chnage"]].concat()).contains("change"));
    assert!(fails(2, &[&run[..], &["--letters", "change,change"]].concat()).contains("asked for twice"));
    let taught = done(&["help", "run"]);
    assert!(taught.contains("--letters") && taught.contains("(sustained)") && taught.contains("(change)"), "{taught}");
}

#[cfg(unix)]
#[test]
fn a_signal_brings_a_run_that_waits_for_input_to_a_clean_end() {
    for signal in ["-INT", "-TERM"] {
        let folder = tempfile::tempdir().unwrap();
        let out = folder.path().join("out.ndjson");
        let mut run = Piped::start(&["--sink", "-", "--sink", text_of(&out)]);
        for t in 0..2 {
            run.send(&format!(r#"{{"t":0.{t},"values":{{"4":1}}}}"#));
            run.line();
        }
        let [part] = &files_in(folder.path())[..] else { panic!("{:?}", files_in(folder.path())) };
        assert!(part.starts_with("out.ndjson.") && part.ends_with(".part"), "{part}");
        assert!(Command::new("kill").args([signal, &run.child.id().to_string()]).status().unwrap().success());
        // Its standard input is still open.
        assert_eq!(code_of(&mut run.child), Some(0), "{signal}");
        assert_eq!(files_in(folder.path()), ["out.ndjson"]);
        assert_eq!(frames(&std::fs::read_to_string(&out).unwrap()).len(), 2);
        assert_eq!(stderr(&run.child.wait_with_output().unwrap()), "");
    }
}

#[test]
fn auto_says_once_what_it_chose_and_quiet_says_nothing() {
    let output = output(&["run"]);
    let said: Vec<String> =
        stderr(&output).lines().filter(|line| line.starts_with("somatic:")).map(str::to_owned).collect();
    assert_eq!(said.len(), 1, "{said:?}");
    let why = match gpus() {
        Gpus::Hardware => "measured on this plan, 256 frames a call: cpu ",
        Gpus::Software => "computes on the same CPU",
        Gpus::None => "no GPU driver answers",
    };
    assert!(said[0].starts_with("somatic: backend ") && said[0].contains(why), "{said:?}");
    let quiet = super::output(&["run", "--quiet"]);
    assert!(!stderr(&quiet).contains("somatic:"));
    assert_eq!(quiet.stdout.iter().filter(|&&byte| byte == b'\n').count(), 280);
}
