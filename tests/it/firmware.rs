//! The wire in C: what it writes is what Rust writes, and it hears what Rust says.

use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::{Command as Process, Stdio};

use proptest::prelude::*;
use somatic::internal::wire::{Answer, Command, Status};

use crate::wire::{Packet, decoded, examples, hex, root, unhex, vectors};
use somatic_testing::skip;

const FLAGS: [&str; 4] = ["-Wall", "-Wextra", "-Werror", "-std=c99"];

/// The C compiler of this machine, if it has one.
fn compiler() -> Option<&'static str> {
    let runs = |name: &&str| Process::new(name).arg("--version").output().is_ok_and(|output| output.status.success());
    let found = ["gcc", "cc", "clang"].into_iter().find(runs);
    if found.is_none() {
        skip("COMPILER", "no C compiler: examples/firmware is not checked");
    }
    found
}

/// `examples/firmware/check.c`, compiled into `folder`.
fn check(folder: &Path) -> Option<PathBuf> {
    let (compiler, firmware) = (compiler()?, root().join("examples/firmware"));
    let program = folder.join("check");
    let compile = |arguments: &[&str]| {
        let output = Process::new(compiler).args(FLAGS).args(arguments).current_dir(&firmware).output().unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    };
    compile(&["check.c", "somatic_wire.c", "-o", program.to_str().unwrap()]);
    let object = folder.join("board.o");
    compile(&["-c", "board.c", "-o", object.to_str().unwrap()]);
    Some(program)
}

/// What the program says to `lines`, one line each.
fn says(program: &Path, lines: &[String]) -> Vec<String> {
    let mut child = Process::new(program).stdin(Stdio::piped()).stdout(Stdio::piped()).spawn().unwrap();
    let (mut stdin, text) = (child.stdin.take().unwrap(), lines.join("\n") + "\n");
    let writer = std::thread::spawn(move || stdin.write_all(text.as_bytes()).unwrap());
    let output = child.wait_with_output().unwrap();
    writer.join().unwrap();
    assert!(output.status.success());
    String::from_utf8(output.stdout).unwrap().lines().map(str::to_owned).collect()
}

/// The line for the program, and what it must say to it.
fn line(packet: &Packet) -> (String, String) {
    let list = |values: &[u16]| values.iter().map(u16::to_string).collect::<Vec<_>>().join(" ");
    let with = |kind: &str, head: &somatic::internal::wire::Head, rest: String| {
        format!("{kind} {} {} {} {} {rest}", head.board, head.boot, head.sequence, head.time_us)
    };
    let bytes = hex(&packet.line());
    match packet {
        Packet::Frame { head, bits, values } => {
            (with("frame", head, format!("{} {}", bits.count(), list(values))), bytes)
        }
        Packet::Partial { head, bits, values } => {
            let channels = values.last().map_or(0, |(channel, _)| channel + 1);
            let values: Vec<String> = values.iter().map(|(channel, value)| format!("{channel}={value}")).collect();
            (with("partial", head, format!("{} {channels} {}", bits.count(), values.join(" "))), bytes)
        }
        Packet::Identity { head, request, running, channels, bits, layout, rate, text } => {
            let (running, bits) = (u8::from(*running), bits.count());
            (with("identity", head, format!("{request} {running} {channels} {bits} {layout} {rate} {text}")), bytes)
        }
        Packet::Answer { head, answer: Answer { request, command, status, value } } => {
            let status = [Status::Done, Status::Unknown, Status::Bad].iter().position(|s| s == status).unwrap();
            (with("answer", head, format!("{request} {command} {status} {value}")), bytes)
        }
        Packet::Command { board, request, command } => {
            let (rate, channel, wiper) = match *command {
                Command::Rate { rate_mhz } => (rate_mhz, 0, 0),
                Command::Wiper { channel, wiper } => (0, channel, wiper),
                _ => (0, 0, 0),
            };
            let heard = format!("{} {board} {request} {rate} {channel} {wiper} ", command.kind());
            (format!("hear {bytes}"), heard)
        }
        Packet::Corrupt(why) => panic!("{why}"),
    }
}

#[test]
fn the_sketch_in_c_writes_and_hears_the_documented_vectors() {
    let folder = tempfile::tempdir().unwrap();
    let Some(program) = check(folder.path()) else { return };
    let (asked, wanted): (Vec<_>, Vec<_>) = examples().iter().map(|(_, packet)| line(packet)).unzip();
    let said = says(&program, &asked);
    assert_eq!(said, wanted);
    // The file itself, in case the examples here are not what it has.
    for (vector, said) in vectors().iter().zip(&said).filter(|(_, said)| said.starts_with("00")) {
        assert_eq!(vector["line"].as_str(), Some(&said[..]));
    }
    // What is turned, cut or noise is no command.
    let start = hex(&Packet::Command { board: 3, request: 4, command: Command::Start }.line());
    let turned: Vec<String> = (0..start.len() / 2 * 8)
        .map(|bit| {
            let mut bytes = unhex(&start);
            bytes[bit / 8] ^= 1 << (bit % 8);
            format!("hear {}", hex(&bytes[1..]))
        })
        .skip(8)
        .collect();
    assert!(says(&program, &turned).iter().all(String::is_empty));
    let said = says(&program, &[format!("hear 05aa{}{start}", "ff".repeat(3000))]);
    assert_eq!(said, ["19 3 4 0 0 0 "]);
}

#[test]
fn frames_from_c_are_what_rust_reads() {
    let folder = tempfile::tempdir().unwrap();
    let Some(program) = check(folder.path()) else { return };
    use proptest::strategy::ValueTree as _;
    let mut runner = proptest::test_runner::TestRunner::deterministic();
    let strategy = prop::collection::vec(crate::wire::frames_of_a_board(), 60);
    let packets: Vec<Packet> = strategy.new_tree(&mut runner).unwrap().current().into_iter().flatten().collect();
    let lines: Vec<String> = packets.iter().map(|packet| line(packet).0).collect();
    let said = says(&program, &lines);
    assert!(packets.len() > 200 && said.len() == packets.len());
    for (packet, said) in packets.iter().zip(&said) {
        assert_eq!(decoded(&unhex(said)), std::slice::from_ref(packet));
    }
}

#[test]
fn a_sketch_in_cpp_links_with_it() {
    let Some(c) = compiler() else { return };
    let runs = |name: &&str| Process::new(name).arg("--version").output().is_ok_and(|output| output.status.success());
    let Some(cpp) = ["g++", "c++", "clang++"].into_iter().find(runs) else {
        return skip("COMPILER", "no C++ compiler: a sketch is not linked");
    };
    let (folder, firmware) = (tempfile::tempdir().unwrap(), root().join("examples/firmware"));
    let sketch = r#"
        #include "somatic_wire.h"
        int main() {
            uint8_t line[SOMATIC_LINE];
            somatic_head head = {1, 1, 0, 0};
            uint16_t values[4] = {1, 2, 3, 4};
            somatic_ear ear = {};
            somatic_command command;
            return somatic_frame(line, &head, 10, values, 4) > 0 && somatic_hear(&ear, 0, &command) == 0 ? 0 : 1;
        }"#;
    std::fs::write(folder.path().join("sketch.cpp"), sketch).unwrap();
    let compile = |with: &str, arguments: &[&str]| {
        let output = Process::new(with)
            .args(["-Wall", "-Wextra", "-Werror", "-I"])
            .arg(&firmware)
            .args(arguments)
            .current_dir(folder.path())
            .output();
        let output = output.unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    };
    let source = firmware.join("somatic_wire.c");
    compile(c, &["-std=c99", "-c", source.to_str().unwrap(), "-o", "wire.o"]);
    compile(cpp, &["-std=c++11", "sketch.cpp", "wire.o", "-o", "sketch"]);
    assert!(Process::new(folder.path().join("sketch")).status().unwrap().success());
}
