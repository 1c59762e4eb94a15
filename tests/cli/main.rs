//! The command, driven as people and scripts drive it: the real binary, its output and its exit code.

mod arduino;
mod asked_together;
mod author;
mod axes;
#[cfg(unix)]
mod axes_live;
mod bags;
mod bags_db3;
mod bags_merged;
mod bench;
#[cfg(feature = "page")]
#[cfg(all(unix, any(feature = "ros2", feature = "zenoh")))]
mod blocked_networks;
#[cfg(unix)]
mod board;
mod browser;
mod calibrate;
mod check_order;
mod devices;
mod doubts;
mod escape;
mod expected;
mod exports;
mod fields;
mod formats;
mod inspect;
mod kinds_drawn;
mod letters_asked;
mod letters_oracle;
mod limbs;
#[cfg(all(unix, feature = "zenoh"))]
mod limbs_axes;
#[cfg(all(unix, feature = "zenoh"))]
mod limbs_faults;
#[cfg(all(unix, feature = "zenoh"))]
mod limbs_merged;
#[cfg(all(unix, feature = "zenoh"))]
mod limbs_network;
#[cfg(all(unix, feature = "zenoh"))]
mod limbs_others;
#[cfg(all(unix, feature = "zenoh"))]
mod limbs_touches;
mod limits;
mod live;
mod map;
mod mjcf;
mod names;
mod other_readers;
mod outputs;
#[cfg(all(unix, feature = "page"))]
mod page;
mod paper;
mod plan;
mod plot;
mod presses;
mod python;
mod recording;
#[cfg(all(unix, feature = "zenoh"))]
mod relay;
#[cfg(feature = "gpu")]
mod render;
mod robots;
mod ros2;
#[cfg(all(unix, feature = "ros2"))]
mod ros2_live;
#[cfg(all(unix, feature = "ros2"))]
mod ros2_mapped;
#[cfg(all(unix, feature = "ros2"))]
mod ros2_peer;
mod run;
mod self_contacts;
#[cfg(feature = "gpu")]
mod senses;
#[cfg(unix)]
mod serial;
mod several;
#[cfg(unix)]
mod signals;
mod simulate;
mod skins;
mod skip_bad;
mod sources;
mod tables;
#[cfg(unix)]
mod text;
mod touches;
mod touches_accuracy;
mod touches_oracle;
mod tradeoff;
#[cfg(unix)]
mod tune;
#[cfg(all(unix, feature = "page"))]
mod view;
mod voronoi;
mod world;

// The library's own numbers that look like chance.
use somatic::internal::random;

use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};

use serde_json::Value;
use tempfile::TempDir;

/// The command, with nothing around it that colours its output.
fn somatic(arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_somatic"));
    command.args(arguments).stdin(Stdio::null());
    // What somebody has measured on this machine is no part of a test.
    command.env("XDG_CACHE_HOME", concat!(env!("CARGO_TARGET_TMPDIR"), "/no-cache"));
    for name in ["NO_COLOR", "CLICOLOR", "CLICOLOR_FORCE"] {
        command.env_remove(name);
    }
    command
}

fn output(arguments: &[&str]) -> Output {
    somatic(arguments).output().unwrap()
}

/// Standard output of a run that must succeed.
fn done(arguments: &[&str]) -> String {
    let output = output(arguments);
    assert_eq!(output.status.code(), Some(0), "{arguments:?}: {}", stderr(&output));
    String::from_utf8(output.stdout).unwrap()
}

/// Standard error of a run that must end with `code`.
fn fails(code: i32, arguments: &[&str]) -> String {
    let output = output(arguments);
    assert_eq!(output.status.code(), Some(code), "{arguments:?}: {}", stderr(&output));
    stderr(&output)
}

fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// Lines of JSON.
fn frames(text: &str) -> Vec<Value> {
    text.lines().map(|line| serde_json::from_str(line).unwrap_or_else(|e| panic!("{e}: {line}"))).collect()
}

/// Waits for `child`, which must end soon, and gives its exit code.
fn code_of(child: &mut Child) -> Option<i32> {
    let start = Instant::now();
    loop {
        if let Some(status) = child.try_wait().unwrap() {
            return status.code();
        }
        if start.elapsed() > Duration::from_secs(20) {
            child.kill().unwrap();
            panic!("the command does not end");
        }
        std::thread::sleep(Duration::from_millis(10));
    }
}

/// A folder with a file `name` that holds `text`, and the file's path.
fn file(name: &str, text: &str) -> (TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    std::fs::File::create(&path).unwrap().write_all(text.as_bytes()).unwrap();
    (folder, path)
}

fn text_of(path: &Path) -> &str {
    path.to_str().unwrap()
}

/// The names of the files in `folder`.
fn files_in(folder: &Path) -> Vec<String> {
    let mut names: Vec<String> =
        std::fs::read_dir(folder).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

#[test]
fn help_teaches_and_names_everything() {
    let help = done(&["--help"]);
    for word in
        ["run", "inspect", "author", "render", "plan", "paper", "bench", "completions", "Examples:", "Exit codes"]
    {
        assert!(help.contains(word), "{word}: {help}");
    }
    let help = done(&["run", "--help"]);
    for word in ["--source", "--verify", "Examples:", "centroid", "anisotropy", "Hz", "seconds"] {
        assert!(help.contains(word), "{word}: {help}");
    }
    let short = done(&["run", "-h"]);
    let flags = |help: &str| help.lines().filter(|line| line.trim_start().starts_with("--")).count();
    assert!(flags(&short) == 10 && flags(&help) > 30, "{short}");
    let headings =
        ["Options:", "What is computed:", "Recordings:", "Live:", "Accuracy and speed:", "Output:", "Examples:"];
    let places: Vec<usize> = headings.iter().map(|heading| help.find(&format!("\n{heading}\n")).unwrap()).collect();
    assert!(places.is_sorted(), "{help}");
    assert_eq!(done(&["--version"]), format!("somatic {}\n", env!("CARGO_PKG_VERSION")));
}

#[test]
fn help_leads_to_no_page_that_is_not_installed() {
    let help = done(&["--help"]);
    let listed = help.split("\nUse:\n").nth(1).unwrap().split("\nOptions:\n").next().unwrap();
    let commands: Vec<&str> =
        listed.lines().filter_map(|line| line.strip_prefix("  ")?.split_whitespace().next()).collect();
    assert!(commands.len() > 12, "{commands:?}");
    assert!(help.lines().count() <= 55, "{help}");
    for command in commands {
        for flag in ["-h", "--help"].into_iter().filter(|_| command != "help") {
            let help = done(&[command, flag]);
            assert!(!help.contains("docs/"), "{command} {flag}: {help}");
        }
    }
}

#[test]
fn the_command_alone_names_what_people_use_first() {
    let output = output(&[]);
    assert_eq!((output.status.code(), stderr(&output)), (Some(0), String::new()));
    let text = String::from_utf8(output.stdout).unwrap();
    assert!(text.starts_with("somatic ") && text.lines().count() <= 12, "{text}");
    assert!(text.lines().all(|line| line.chars().count() <= 80), "{text}");
    let named: Vec<&str> =
        text.lines().filter_map(|line| line.strip_prefix("  somatic ")?.split_whitespace().next()).collect();
    assert_eq!(named.len(), 5, "{text}");
    // Each of them is a command, and help is where it says.
    for command in named {
        done(&[command, "--help"]);
    }
    assert!(text.contains("somatic --help") && text.contains("somatic run -h"), "{text}");
}

#[test]
fn completions_are_printed_for_shells() {
    for shell in ["bash", "zsh", "fish"] {
        assert!(done(&["completions", shell]).contains("all-fields"), "{shell}");
    }
    fails(2, &["completions", "fsh"]);
}
