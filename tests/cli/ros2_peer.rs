//! Another node for tests of live topics: cyclonedds in a process of its own, and the command in its domain.

use std::io::{BufRead as _, BufReader, Read as _, Write as _};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};
use std::sync::atomic::{AtomicU32, Ordering};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use serde_json::Value;

use super::python::python_with;
use super::{somatic, stderr};
use somatic_testing::skip;

pub const CLOUD: &str = "sensor_msgs/msg/PointCloud2";

/// Another process with cyclonedds, in a domain of its own.
pub struct Peer {
    child: Child,
    input: Option<ChildStdin>,
    output: BufReader<ChildStdout>,
}

/// A domain that no other test has: ports of domains up to 101 are below those that Linux gives away.
pub fn domain() -> String {
    static NEXT: AtomicU32 = AtomicU32::new(0);
    ((std::process::id() * 11 + NEXT.fetch_add(1, Ordering::Relaxed)) % 101 + 1).to_string()
}

/// Python with cyclonedds, unless the test is skipped.
pub fn python() -> Option<PathBuf> {
    match python_with("ros2", "import cyclonedds.idl, mcap_ros2.reader, rosbags.rosbag2") {
        Ok(python) => Some(python),
        Err(why) => {
            skip("ROS2", why);
            None
        }
    }
}

impl Peer {
    pub fn start(python: &Path, domain: &str, arguments: &[&str]) -> Self {
        let mut child = Command::new(python)
            .arg(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/ros2/live.py"))
            .args(arguments)
            .env("ROS_DOMAIN_ID", domain)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let output = BufReader::new(child.stdout.take().unwrap());
        Self { input: child.stdin.take(), output, child }
    }

    pub fn receive(python: &Path, domain: &str, topics: &[(&str, &str, &str)]) -> Self {
        let named: Vec<String> = topics.iter().map(|(topic, kind, how)| format!("{topic}={kind}:{how}")).collect();
        let mut arguments = vec!["receive"];
        arguments.extend(named.iter().map(String::as_str));
        let mut peer = Self::start(python, domain, &arguments);
        peer.wait_for("listening");
        peer
    }

    pub fn line(&mut self) -> String {
        let mut line = String::new();
        assert!(self.output.read_line(&mut line).unwrap() > 0, "the peer has ended");
        line
    }

    pub fn wait_for(&mut self, word: &str) {
        while self.line().trim() != word {}
    }

    pub fn say(&mut self, line: &str) {
        writeln!(self.input.as_mut().unwrap(), "{line}").unwrap();
    }

    /// Sends it the system's signal of this name.
    pub fn signal(&self, name: &str) {
        let id = self.child.id().to_string();
        assert!(Command::new("kill").args([&format!("-{name}"), &id]).status().unwrap().success());
    }

    /// Everything that has come: topic, time (ns), message.
    pub fn received(mut self) -> Vec<(String, u64, Value)> {
        self.say("end");
        loop {
            let line = self.line();
            if line.starts_with('[') {
                assert!(self.child.wait().unwrap().success());
                let all: Vec<(String, u64, Value)> = serde_json::from_str(&line).unwrap();
                return all;
            }
        }
    }
}

impl Drop for Peer {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// The command in `domain`. What it prints is read as it comes: a full pipe would hold it up.
pub struct Running {
    pub child: Child,
    reported: JoinHandle<String>,
}

pub fn run(domain: &str, arguments: &[&str]) -> Running {
    let mut command = somatic(arguments);
    command.env("ROS_DOMAIN_ID", domain).stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut child = command.spawn().unwrap();
    let mut output = child.stdout.take().unwrap();
    let reported = std::thread::spawn(move || {
        let mut text = String::new();
        output.read_to_string(&mut text).unwrap();
        text
    });
    Running { child, reported }
}

/// Sends `lines` to the command's standard input, one every `period`.
pub fn feed(running: &mut Running, lines: &[String], period: Duration) {
    let input = running.child.stdin.as_mut().unwrap();
    let begin = Instant::now();
    for (number, line) in lines.iter().enumerate() {
        std::thread::sleep((period * number as u32).saturating_sub(begin.elapsed()));
        writeln!(input, "{line}").unwrap();
    }
}

/// What the command prints until its end, with its standard input closed; on standard error too.
pub fn ended(running: Running) -> (String, String) {
    let Running { mut child, reported } = running;
    drop(child.stdin.take());
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    (reported.join().unwrap(), stderr(&output))
}
