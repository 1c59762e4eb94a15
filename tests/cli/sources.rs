//! What a run reads from: names of sources, CSV and NDJSON on standard input.

use std::io::{BufRead as _, BufReader, Read as _, Write as _};
use std::process::{Output, Stdio};

use super::{done, fails, file, frames, somatic, stderr, text_of};

/// A run that gets `input` on its standard input.
fn fed(arguments: &[&str], input: &str) -> Output {
    let mut command = somatic(&["run", "--backend", "cpu"]);
    let mut child =
        command.args(arguments).stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    let mut stdin = child.stdin.take().unwrap();
    // One that ends before it has read everything closes the pipe.
    let _ = stdin.write_all(input.as_bytes());
    drop(stdin);
    child.wait_with_output().unwrap()
}

fn stdout(output: &Output) -> String {
    String::from_utf8(output.stdout.clone()).unwrap()
}

#[test]
fn a_stray_quote_costs_no_row_before_it() {
    let rows: String = (0..2000).map(|row| format!("{row},{}5\n", if row == 9 { "\"" } else { "" })).collect();
    let (_folder, path) = file("touch.csv", &format!("t,4\n{rows}"));
    let error = fails(1, &["run", "--backend", "cpu", "--quiet", "--source", text_of(&path), "--sink", "-"]);
    let line = format!("somatic: error: {}: line 11: column 2 (taxel 4): `\"5` has a quote;", path.display());
    assert!(error.starts_with(&line) && error.lines().count() == 1, "{error}");
}

#[test]
fn values_of_taxels_that_the_body_does_not_have_are_left_out_and_counted() {
    let lines: String =
        (0..5).map(|t| format!("{{\"t\":0.{t},\"values\":{{\"4\":7,\"777\":1,\"778\":null}}}}\n")).collect();
    let output = fed(&["--source", "-"], &lines);
    let said = stderr(&output);
    assert_eq!(output.status.code(), Some(3), "{said}");
    assert_eq!(frames(&stdout(&output)).len(), 5);
    assert_eq!(said.matches("stdin: line 1: the body has no taxel 777; its values are left out").count(), 1, "{said}");
    let lost = "somatic: never processed: stdin: 5 values of taxels that the body does not have (777)\n";
    assert!(said.ends_with(lost) && said.lines().count() == 2, "{said}");
    // The same bits as without them.
    let known = fed(&["--source", "-"], &lines.replace("\"777\":1,", "").replace(",\"778\":null", ""));
    assert_eq!((known.status.code(), &output.stdout), (Some(0), &known.stdout));

    let strict = fed(&["--source", "-", "--strict"], &lines);
    assert_eq!(strict.status.code(), Some(1));
    assert!(stderr(&strict).starts_with("somatic: error: stdin: line 1, column"), "{}", stderr(&strict));
    assert!(stderr(&strict).contains("the body has no taxel 777"));
    assert!(fails(2, &["run", "--strict"]).contains("--strict is for --source -"));
}

/// A run that ends before its input does says what it left out too.
#[test]
fn what_was_left_out_is_counted_when_the_time_is_over() {
    let mut child = somatic(&["run", "--backend", "cpu", "--source", "-", "--for", "2s"])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut stdin = child.stdin.take().unwrap();
    writeln!(stdin, "{{\"t\":0,\"values\":{{\"4\":7,\"777\":1}}}}").unwrap();
    let mut line = String::new();
    BufReader::new(child.stdout.take().unwrap()).read_line(&mut line).unwrap();
    assert_eq!(child.wait().unwrap().code(), Some(3));
    let mut said = String::new();
    child.stderr.take().unwrap().read_to_string(&mut said).unwrap();
    assert!(said.ends_with("never processed: stdin: 1 value of taxels that the body does not have (777)\n"), "{said}");
    drop(stdin);
}

#[test]
fn csv_on_standard_input_is_the_same_as_from_a_file() {
    let text = String::from_utf8(somatic::bundled::TOUCH.to_vec()).unwrap();
    let (_folder, path) = file("touch.csv", &text);
    let fields = ["--fields", "hand/palm"];
    for more in [&[][..], &["--from", "1", "--to", "2.5"], &["--to", "0.5"]] {
        let from_file = done(&[&["run", "--backend", "cpu", "--source", text_of(&path)][..], &fields, more].concat());
        let piped = fed(&[&["--source", "csv:-"][..], &fields, more].concat(), &text);
        assert_eq!((piped.status.code(), stdout(&piped)), (Some(0), from_file), "{more:?} {}", stderr(&piped));
    }
    let piped = fed(&["--source", "csv:-", "--rate", "10"], "4\n1\n2\n");
    assert_eq!(frames(&stdout(&piped))[1]["t"], 0.1);
    let bad = fed(&["--source", "csv:-"], "t,4\n0,x\n");
    assert!(stderr(&bad).contains("stdin: line 2: taxel 4: `x` is not a number"), "{}", stderr(&bad));
    assert!(fails(2, &["run", "--source", "csv:-", "--loop=2"]).contains("--loop is for recordings in files"));
    assert!(fails(2, &["run", "--source", "csv:-", "--source", "-"]).contains("only serial lines"));
    assert!(fails(2, &["info", "csv:-"]).contains("should be csv:FILE, mcap:FILE, ros2-mcap:PATH"));
    assert!(fails(2, &["convert", "csv:-", "a.mcap"]).contains("should be csv:FILE, mcap:FILE, a pressure system's"));
    assert!(fails(2, &["tradeoff", "--source", "csv:-"]).contains("a recording or a simulation"));
}

#[test]
fn a_row_on_standard_input_is_answered_at_once() {
    let mut child = somatic(&["run", "--backend", "cpu", "--quiet", "--source", "csv:-"])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    let mut stdin = child.stdin.take().unwrap();
    let (sender, lines) = std::sync::mpsc::channel();
    let stdout = child.stdout.take().unwrap();
    std::thread::spawn(move || {
        BufReader::new(stdout).lines().map_while(Result::ok).try_for_each(|line| sender.send(line))
    });
    writeln!(stdin, "t,4").unwrap();
    for row in 1..4 {
        writeln!(stdin, "{row},{row}").unwrap();
        let line = lines.recv_timeout(std::time::Duration::from_secs(20)).expect("a line at once");
        assert_eq!(frames(&line)[0]["fields"][0]["total"].as_f64(), Some(f64::from(row)));
    }
    drop(stdin);
    assert!(child.wait().unwrap().success());
}

#[test]
fn a_source_that_is_written_otherwise_is_named_as_it_should_be() {
    let error = fails(2, &["run", "--source", "/dev/ttyUSB0"]);
    assert!(error.contains("text:/dev/ttyUSB0 if its board prints numbers"), "{error}");
    assert!(error.contains("serial:/dev/ttyUSB0 if"), "{error}");
    for input in ["t,4\n0,5\n", "0.5,1,2,\n"] {
        let output = fed(&["--source", "-"], input);
        let what =
            "somatic: error: stdin: line 1: this is CSV, and `-` reads a line of JSON a frame; use --source csv:-\n";
        assert_eq!((output.status.code(), stderr(&output).as_str()), (Some(1), what));
    }
}

#[test]
fn the_frame_that_help_shows_is_answered_in_the_world() {
    let help = done(&["help", "run"]);
    let frame = help.lines().find(|line| line.trim().starts_with("{\"t\":")).expect("a frame").trim();
    let output = fed(&["--quiet", "--source", "-"], &format!("{frame}\n"));
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    let percept = &frames(&stdout(&output))[0]["fields"][0];
    assert!(percept["link"] == "world" && percept["position"][2].as_f64() > Some(0.2), "{percept}");
    assert!(help.contains("qx,qy,qz,qw"));
}
