//! `somatic run` at a terminal: a pseudo-terminal that `script` of util-linux makes.
#![cfg(unix)]

use std::io::Write as _;
use std::process::{Command, Stdio};
use std::time::Duration;

use super::{file, text_of};
use somatic_testing::skip;

const BINARY: &str = env!("CARGO_BIN_EXE_somatic");

/// What a terminal gets to see of `command`, and its exit code; `typed` is typed after a second.
fn seen(command: &str, typed: &str) -> Option<(String, Option<i32>)> {
    let there = Command::new("script").arg("--version").output().is_ok_and(|o| o.stdout.starts_with(b"script"));
    if !there {
        skip("TERMINAL", "there is no `script` of util-linux to make a terminal");
        return None;
    }
    let mut child = Command::new("script")
        // `exec`, because a shell that waits tells its own interruption, not the command's end (dash does: 130).
        .args(["-qec", &format!("stty cols 100 rows 30; exec {command}"), "/dev/null"])
        .env("TERM", "xterm-256color")
        .env_remove("NO_COLOR")
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    let mut stdin = child.stdin.take().unwrap();
    if !typed.is_empty() {
        std::thread::sleep(Duration::from_secs(2));
        stdin.write_all(typed.as_bytes()).unwrap();
    }
    let output = child.wait_with_output().unwrap();
    drop(stdin);
    Some((String::from_utf8_lossy(&output.stdout).into_owned(), output.status.code()))
}

#[test]
fn a_table_is_drawn_and_a_summary_stays() {
    let Some((text, code)) = seen(&format!("{BINARY} run --backend cpu --speed 8"), "") else { return };
    assert_eq!(code, Some(0), "{text}");
    for part in ["\x1b[?25l", "hand ← bundled touch", "━", " left", "hand/back", "█", "aniso"] {
        assert!(text.contains(part), "{part:?}: {text}");
    }
    let (_, after) = text.rsplit_once("\x1b[?25h").expect("the cursor comes back");
    assert!(after.contains("280 frames over 5.58 s") && after.contains("1 field never touched"), "{after}");
    assert!(!text.contains(r#"{"t""#), "no JSON into a table");
}

#[test]
fn without_colours_there_are_none() {
    let Some((text, _)) = seen(&format!("env NO_COLOR=1 {BINARY} run --backend cpu --speed 20"), "") else { return };
    assert!(text.contains("hand/back") && !text.contains("\x1b[36m") && !text.contains("\x1b[2m"), "{text}");
}

#[test]
fn ctrl_c_ends_a_table_with_its_summary_and_a_cursor() {
    let Some((text, code)) = seen(&format!("{BINARY} run --backend cpu --speed 0.2"), "\x03") else { return };
    assert_eq!(code, Some(0), "{text}");
    let (_, after) = text.rsplit_once("\x1b[?25h").expect("the cursor comes back");
    assert!(after.contains("frames over") && !after.contains("280 frames"), "{after}");
}

#[test]
fn an_error_takes_the_table_away_first() {
    let (_folder, path) = file("touch.csv", "t,4\n0,1\n0.3,oops\n");
    let command = format!("{BINARY} run --backend cpu --speed 1 --source {}", text_of(&path));
    let Some((text, code)) = seen(&command, "") else { return };
    assert_eq!(code, Some(1), "{text}");
    let (_, after) = text.rsplit_once("\x1b[?25h").expect("the cursor comes back");
    assert!(after.contains("error") && after.contains("line 3") && after.contains("\x1b[31m"), "{after}");
}

#[test]
fn with_its_output_elsewhere_a_recording_shows_a_bar_unless_quiet() {
    let (folder, _) = file("x", "");
    let out = folder.path().join("out");
    let command = |more| format!("{BINARY} run --backend cpu --speed 8 {more} > {}", text_of(&out));
    let Some((text, code)) = seen(&command(""), "") else { return };
    assert_eq!(code, Some(0), "{text}");
    assert!(text.contains(" %") && text.contains("━") && !text.contains("hand/back"), "{text}");
    assert_eq!(std::fs::read_to_string(&out).unwrap().lines().count(), 280);
    let Some((text, _)) = seen(&command("--quiet"), "") else { return };
    assert_eq!(text, "");
}

#[test]
fn q_ends_a_table_as_ctrl_c_does_and_both_leave_the_terminal_as_it_was() {
    let (folder, _) = file("x", "");
    for key in ["q", "\x03"] {
        let out = folder.path().join("out.ndjson");
        let run = format!("{BINARY} run --backend cpu --speed 0.2 --sink ndjson:{}", text_of(&out));
        // The shell lives on after Ctrl-C.
        let command = format!("sh -c 'trap : INT; stty -a; {run}; echo code $?; stty -a'");
        let Some((text, _)) = seen(&command, key) else { return };
        // A recording that was not played to its end.
        let (before, after) = text.split_once("code 3").unwrap_or_else(|| panic!("{key:?}: {text}"));
        assert!(before.contains("frames over") && !before.contains("280 frames"), "{before}");
        let modes = |text: &str| text.lines().find(|line| line.contains("icanon")).map(str::to_owned);
        assert!(modes(before).is_some() && modes(before) == modes(after), "{text}");
        assert!(after.contains(" icanon") && after.contains(" echo "), "{after}");
        // What was made of the frames until then is whole.
        let lines = std::fs::read_to_string(&out).unwrap();
        assert!(lines.ends_with('\n') && super::frames(&lines).len() < 280, "{key:?}");
        std::fs::remove_file(&out).unwrap();
    }
}

#[test]
fn what_is_typed_where_frames_are_read_is_not_a_key() {
    let Some((text, code)) = seen(&format!("{BINARY} run --backend cpu --source -"), "q\n") else { return };
    assert!(code == Some(1) && text.contains("line 1"), "{text}");
}

#[test]
fn areas_have_a_column_where_they_are_asked_for() {
    let command = format!("{BINARY} run --backend cpu --speed 8 --outputs total,area");
    let Some((text, _)) = seen(&command, "") else { return };
    assert!(text.contains("area mm²"), "{text}");
    let row = text.lines().find(|line| line.contains("hand/back") && line.contains('█')).expect("it is touched");
    // Of sensors whose areas are known.
    // Without what colours it.
    let row: String = row.split("\x1b[").map(|part| part.split_once('m').map_or(part, |(_, text)| text)).collect();
    let words: Vec<&str> = row.split_whitespace().collect();
    assert!(words.iter().any(|word| word.parse().is_ok_and(|mm2: f64| mm2 > 10.0)), "{row}");
    let Some((text, _)) = seen(&format!("{BINARY} run --backend cpu --speed 20 --outputs total"), "") else { return };
    assert!(!text.contains("area"), "{text}");
}
